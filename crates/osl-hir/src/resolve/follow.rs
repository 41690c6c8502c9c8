//! Follow-up errors: what an earlier error, or a gap in the tree, explains is not reported.
//!
//! Four rules. A message about a part of the file that a gap covers is dropped, and so is the second error of
//! one kind at one place. A type or member that is not there is reported once in a declaration. A message
//! about a name that a gap may have declared is dropped. Within a declaration that has a gap, scopes and
//! loops may end at other places than written, so messages that depend on them are dropped. Scripts that
//! count the errors of the reference get all that it reports ([`Reports::AsReference`]): an expression with
//! an error is reported again where its type matters, and the types of the shader are only checked if
//! everything else is right.

use super::{Resolver, errors};
use osl_syntax::Reports;
use osl_syntax::ast::Item;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::gaps::Gap;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// What errors so far explain.
#[derive(Debug, Default)]
pub(super) struct Follow {
    /// The declaration at file level that is being resolved.
    item: Span,
    /// Names that the gaps in it may have declared.
    lost: FxHashSet<Arc<str>>,
    /// Whether there are gaps between declarations.
    gap_between: bool,
    /// Names that those gaps may have declared, for all of the file.
    lost_between: FxHashSet<Arc<str>>,
    /// Number of declarations in those gaps that lack their name.
    nameless: usize,
    /// Number of structs in gaps between declarations that lack their name, as far as none is assumed.
    nameless_structs: usize,
    /// The start of the first gap in it.
    first_gap: Option<u32>,
    /// Code and location of each error.
    reported: FxHashSet<(&'static str, Span)>,
    /// The messages about types and members that are not there, in the declaration that is being resolved.
    named: FxHashSet<String>,
    /// Whether a declaration with an unknown type may be the shader, whose first word is misspelt.
    shader_misspelt: bool,
    /// Structs whose fields are not all known, by index.
    open_structs: FxHashSet<u32>,
}

/// Whether the reference finds such a mistake while it reads a file, before it checks types.
pub(super) fn is_of_names(d: &Diagnostic) -> bool {
    let of_declarations = [
        errors::BAD_ARRAY_LENGTH,
        errors::BAD_STRUCT,
        errors::NOT_AN_LVALUE,
        errors::NO_DEFAULT,
        errors::FORMAL_DEFAULT,
        errors::BAD_PARAMETER,
        errors::REDEFINED,
        errors::HIDES_FUNCTION,
    ];
    (d.code.id.starts_with("E02") && d.code != errors::NO_SHADER) || of_declarations.contains(&d.code)
}

impl Resolver<'_> {
    /// Begins the file.
    pub(super) fn begin_file(&mut self) {
        let ast = self.ast;
        let between = |gap: &&Gap| !ast.items.iter().any(|item| gap.meets(item.span()));
        self.follow.gap_between = ast.gaps.list.iter().any(|gap| between(&gap));
        self.follow.nameless_structs = ast.gaps.list.iter().map(|gap| gap.nameless_structs).sum();
        let lost = ast.gaps.list.iter().filter(between).flat_map(|gap| &gap.declarations);
        self.follow.lost_between = lost.cloned().collect();
    }

    /// Begins a declaration at file level.
    pub(super) fn begin_item(&mut self, item: Span) {
        self.follow.item = item;
        let ast = self.ast;
        let meeting = || ast.gaps.list.iter().filter(|gap| gap.meets(item));
        self.follow.first_gap = meeting().map(|gap| gap.span.start).min();
        self.follow.nameless = meeting().map(|gap| gap.nameless).sum();
        self.follow.lost = meeting().flat_map(|gap| &gap.names).cloned().collect();
        self.told.clear();
        self.follow.named.clear();
    }

    /// Whether a diagnostic follows from an earlier error or a gap.
    pub(super) fn follows(&mut self, d: &Diagnostic) -> bool {
        if self.reports == Reports::AsReference {
            return false;
        }
        if d.code == errors::NO_SHADER {
            return self.follow.shader_misspelt || !self.ast.gaps.is_empty();
        }
        let of_scopes = [errors::REDECLARED, errors::OUTSIDE_LOOP, errors::BAD_RETURN];
        // Like a variable that is not declared, these are reported where they come first in a declaration.
        let of_names = [errors::UNKNOWN_TYPE, errors::UNKNOWN_MEMBER];
        self.ast.gaps.list.iter().any(|gap| gap.overlaps(d.span))
            || (of_scopes.contains(&d.code) && self.is_after_gap(d.span))
            || (d.is_error() && !self.follow.reported.insert((d.code.id, d.span)))
            || (of_names.contains(&d.code) && !self.follow.named.insert(d.message.to_string()))
    }

    /// Whether the declaration at file level has a gap before this part of it.
    fn is_after_gap(&self, span: Span) -> bool {
        self.follow.first_gap.is_some_and(|gap| gap <= span.start)
    }

    /// Whether the declaration that is being resolved is that of a function of this name.
    pub(super) fn is_within(&self, name: &str) -> bool {
        self.ast.items.iter().any(|item| match item {
            Item::Function(f) => f.span == self.follow.item && &*f.name.text == name,
            _ => false,
        })
    }

    /// Whether a gap may have declared a name, here or in a scope that ends elsewhere than written.
    pub(super) fn may_be_declared(&self, name: &str) -> bool {
        let gaps = &self.ast.gaps;
        if self.reports == Reports::AsReference || gaps.is_empty() {
            return false;
        }
        let item = self.follow.item;
        let within = |span: Span| item.start <= span.start && span.end <= item.end;
        let elsewhere = || {
            self.vars.iter().any(|var| &*var.name == name && within(var.span))
                || self.functions.iter().any(|function| &*function.name == name)
        };
        gaps.any_name
            || self.follow.lost.contains(name)
            || self.follow.lost_between.contains(name)
            || (self.follow.first_gap.is_some() && elsewhere())
    }

    /// Takes an unknown variable for one of those whose declarations lack their name, if there is one.
    pub(super) fn is_nameless(&mut self, name: &str) -> bool {
        if self.reports == Reports::AsReference || self.follow.nameless == 0 {
            return false;
        }
        self.follow.nameless -= 1;
        self.follow.lost.insert(name.into())
    }

    /// Takes an unknown type for one of the structs that lack their name, if there is one.
    pub(super) fn is_nameless_struct(&mut self, name: &str) -> bool {
        if self.reports == Reports::AsReference || self.follow.nameless_structs == 0 {
            return false;
        }
        self.follow.nameless_structs -= 1;
        self.follow.lost_between.insert(name.into())
    }

    /// Whether text that could not be read may have added functions of this name.
    pub(super) fn may_have_overloads(&self, name: &str) -> bool {
        self.may_be_declared(name) && !(self.ast.gaps.any_name && crate::builtins::find(name).is_some())
    }

    /// Whether statements of a function may be missing: it has a gap, or its end may be between declarations.
    pub(super) fn may_be_cut_off(&self, function: Span) -> bool {
        self.follow.gap_between || self.ast.gaps.meet(function)
    }

    /// Records a declaration whose type is not known: it may be the shader, and its parameters have defaults.
    pub(super) fn unknown_declaration(&mut self) {
        self.follow.shader_misspelt = true;
    }

    /// Records that the fields of a struct are not all known.
    pub(super) fn open_struct(&mut self, index: u32) {
        self.follow.open_structs.insert(index);
    }

    /// Whether the fields of a struct are not all known.
    pub(super) fn is_open_struct(&self, index: u32) -> bool {
        self.reports != Reports::AsReference && self.follow.open_structs.contains(&index)
    }
}
