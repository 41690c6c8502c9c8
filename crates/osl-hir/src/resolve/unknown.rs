//! Names that nothing declares: what they probably mean.
//!
//! A name is compared only with names of the needed kind, and words of other languages come first
//! (`vocabulary`). Where nothing is close, the message says how to declare it.

use super::Resolver;
use super::errors::{self, CloseType};
use super::vocabulary::{self, NameKind};
use crate::builtins;
use crate::hir::{Init, Stmt, StmtKind, VarKind};
use osl_ir::types::{Base, Type};
use osl_syntax::Reports;
use osl_syntax::ast::{self, ExprId};
use osl_syntax::span::Span;
use osl_syntax::spelling::closest;

/// The types of the language.
const TYPES: [&str; 9] = ["int", "float", "color", "point", "vector", "normal", "matrix", "string", "void"];

/// Keywords that a misspelt type of a function may stand for.
pub(super) const SHADERS: &[&str] = &["shader", "surface", "displacement", "volume"];
/// Keywords that a misspelt type of a local may stand for: in `retrun x;`, and in `esle x = 1;`.
pub(super) const BEFORE_NAME: &[&str] = &["return", "else"];
pub(super) const BEFORE_ASSIGNMENT: &[&str] = &["else"];

/// Keywords that are a statement by themselves.
const JUMPS: [&str; 3] = ["break", "continue", "return"];

/// What an unknown name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// A variable.
    Value,
    /// A function that is called.
    Call {
        /// Where the arguments end, if there are any.
        arguments_end: Option<u32>,
        /// Whether the place of the call takes a closure.
        closure: bool,
    },
}

impl Resolver<'_> {
    /// Reports an unknown type.
    pub(super) fn unknown_type(&mut self, span: Span, name: &str) {
        if self.may_be_declared(name)
            || self.is_nameless_struct(name)
            || (self.reports != Reports::AsReference && !self.told.insert(format!("type {name}")))
        {
            return;
        }
        let known = vocabulary::word(NameKind::Type, name);
        let close = match known {
            None if self.n_errors < self.max_diagnostics() => {
                let words =
                    TYPES.into_iter().chain(self.keywords.iter().copied()).chain(self.structs.names());
                closest(name, words).map(str::to_string)
            }
            _ => None,
        };
        let close = close.as_deref().map(|word| match word {
            word if TYPES.contains(&word) => CloseType::Own(word),
            word if self.structs.find(word).is_some() => CloseType::Struct(word),
            word => CloseType::Keyword(word),
        });
        self.report(errors::unknown_type(span, name, known, close));
    }

    /// Reports an unknown variable or function.
    pub(super) fn unknown(&mut self, span: Span, what: &str, name: &str, wanted: Wanted) {
        let functions = wanted != Wanted::Value;
        if self.may_be_declared(name) || (!functions && self.is_nameless(name)) {
            return;
        }
        if self.n_errors >= self.max_diagnostics() {
            return self.report(errors::unknown_name(span, what, name, None));
        }
        // Reported once for readers; the reference repeats it.
        if self.reports != Reports::AsReference && !self.told.insert(format!("{what} {name}")) {
            return;
        }
        if !functions && self.declaring.as_deref() == Some(name) {
            return self.report(errors::own_value(span, name));
        }
        if functions && self.is_within(name) {
            return self.report(errors::unknown_name(span, what, name, None).help(errors::NO_RECURSION));
        }
        if functions && let Some(below) = self.declared_below(name, span) {
            let d = errors::unknown_name(span, what, name, None).also(below, "its definition");
            return self.report(d.help("it is defined below its use: move the definition up"));
        }
        let kind = if functions { NameKind::Function } else { NameKind::Variable };
        if let Some(word) = vocabulary::word(kind, name) {
            let end = if let Wanted::Call { arguments_end, .. } = wanted { arguments_end } else { None };
            return self.report(errors::foreign_name(span, what, name, word, end));
        }
        let close = self.close_name(name, functions);
        let d = errors::unknown_name(span, what, name, close.as_deref());
        let d = match (wanted, &close) {
            (Wanted::Call { closure: true, .. }, None) => d.help(vocabulary::RENDERERS_CLOSURE),
            (Wanted::Value, None) if self.in_default => {
                d.help("a default is made of literals, constants and the parameters before it")
            }
            (Wanted::Value, None) => {
                let lower = name.to_lowercase();
                let example = match name {
                    "i" | "j" | "k" | "n" | "count" | "index" => format!("int {name} = 0"),
                    _ if ["file", "name", "path", "space"].iter().any(|word| lower.contains(word)) => {
                        format!("string {name} = \"\"")
                    }
                    _ => format!("float {name} = 0"),
                };
                d.help(format!("declare it with its type before it is used, as in `{example}`"))
            }
            _ => d,
        };
        self.report(d);
    }

    /// The name of the function that the file defines below a place.
    fn declared_below(&self, name: &str, place: Span) -> Option<Span> {
        self.ast.items.iter().find_map(|item| match item {
            ast::Item::Function(f) if &*f.name.text == name && f.name.span.start > place.start => {
                Some(f.name.span)
            }
            _ => None,
        })
    }

    /// The function or variable in scope that a name probably means.
    fn close_name(&self, name: &str, functions: bool) -> Option<String> {
        let mut names = self.names_in_scope(functions);
        if functions {
            builtins::names().for_each(|builtin| names.push(builtin));
            ["if", "for", "while", "return"].into_iter().for_each(|word| names.push(word));
        }
        if !functions && name.starts_with("M_") {
            names.extend(vocabulary::CONSTANTS);
        }
        // `i` is probably a counter without a declaration, and not the ray `I`.
        closest(name, names).filter(|close| functions || close.len() > 1).map(str::to_string)
    }

    /// `i = 0;` with a name that nothing declares: reports it, and declares it for the statements after it.
    /// `None` for every other statement.
    pub(super) fn undeclared(&mut self, id: ExprId, span: Span) -> Option<Stmt> {
        let ast = self.ast;
        let ast::ExprKind::Assign { op: None, target, value } = &ast[id].kind else { return None };
        let ast::ExprKind::Name(name) = &ast[*target].kind else { return None };
        let is_list = matches!(ast[*value].kind, ast::ExprKind::InitList(_));
        let known = self.lookup(name).is_some() || builtins::find(name).is_some();
        if self.reports == Reports::AsReference || known || is_list || self.may_be_declared(name) {
            return None;
        }
        let foreign = vocabulary::word(NameKind::Variable, name).is_some();
        let full = self.n_errors >= self.max_diagnostics();
        if full || foreign || self.told.contains(&format!("variable {name}")) {
            return None;
        }
        if self.close_name(name, false).is_some() {
            return None;
        }
        self.told.insert(format!("variable {name}"));
        let at = ast[*target].span;
        let value = self.value(*value, None);
        let nameable = !value.ty.is_error() && !value.ty.is_array() && value.ty.base != Base::Void;
        let ty = nameable.then(|| match value.ty.base {
            Base::Closure => "closure color".to_string(),
            _ => self.show(value.ty),
        });
        self.report(errors::undeclared(at, name, ty.as_deref()));
        let ty = if nameable { value.ty } else { Type::ERROR };
        let var = self.add_var(name.clone(), ty, VarKind::Local, at);
        Some(Stmt { kind: StmtKind::Declare(var, Some(Init::Value(value))), span })
    }

    /// `breka;`: a statement of one unknown word that resembles a keyword. Returns whether it was reported.
    pub(super) fn misspelt_jump(&mut self, id: ExprId) -> bool {
        let ast = self.ast;
        let ast::ExprKind::Name(name) = &ast[id].kind else { return false };
        if self.reports == Reports::AsReference || self.lookup(name).is_some() || self.may_be_declared(name) {
            return false;
        }
        let Some(word) = closest(name, JUMPS) else { return false };
        self.report(errors::misspelt_jump(ast[id].span, name, word));
        true
    }
}
