//! Library functions for which run times have no operation: their bodies are put in place of calls.
//!
//! `library.osl` contains the functions, in the language itself. Each has the name of the built-in function
//! with an underscore after it, because a function would hide a built-in one of its name.

use super::table::Sym;
use super::{Leaf, Storage, Writer};
use crate::builtins::{ParamType, Signature};
use crate::hir::{BuiltinCall, Function, GLOBALS, Program};
use crate::resolve;
use osl_limits::Limits;
use osl_syntax::{NoFiles, Options, Reports};
use rustc_hash::FxHashSet;
use std::sync::OnceLock;

const TEXT: &str = include_str!("library.osl");

fn program() -> Option<&'static Program> {
    static PROGRAM: OnceLock<Option<Program>> = OnceLock::new();
    let read = || {
        let parsed = osl_syntax::parse("library.osl", TEXT, &NoFiles, &Options::default());
        resolve::resolve_parsed(&parsed, Reports::Once, &Limits::default()).program.ok()
    };
    PROGRAM.get_or_init(read).as_ref()
}

/// The function for a form of a built-in function.
fn find(name: &str, signature: &Signature) -> Option<(&'static Program, &'static Function)> {
    // Most functions are operations, for which the library need not be read.
    static NAMES: OnceLock<FxHashSet<&str>> = OnceLock::new();
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let words = || TEXT.split(|c| !is_part(c)).filter_map(|word| word.strip_suffix('_'));
    if !NAMES.get_or_init(|| words().collect()).contains(name) {
        return None;
    }
    let program = program()?;
    let ty =
        |formal: &crate::hir::VarId| program.vars.get(formal.0 as usize).map(|var| ParamType::Of(var.ty));
    let function = program.functions.iter().find(|function| {
        let types = function.formals.iter().map(ty);
        function.name.strip_suffix('_') == Some(name) && types.eq(signature.params.iter().map(|p| Some(p.ty)))
    });
    Some((program, function?))
}

impl Writer<'_> {
    /// Writes the body of a function in place of a call whose arguments are symbols; `false` if the function
    /// is an operation. The operations belong to the line of the call.
    pub(super) fn library(&mut self, call: &BuiltinCall, to: Option<Sym>, args: &[Sym]) -> bool {
        let signature = call.row.signatures().get(call.overload);
        let Some((program, function)) = signature.and_then(|s| find(call.row.name, s)) else { return false };
        let outer = std::mem::replace(&mut self.program, program);
        let vars = std::mem::replace(&mut self.vars, globals(program));
        let (span, fixed) = (self.span, self.fixed);
        self.fixed = Some(fixed.unwrap_or(span));
        let whole = |sym| Storage::Leaf(Leaf::Symbol(sym));
        for (formal, arg) in function.formals.iter().zip(args) {
            self.bind(*formal, whole(*arg));
        }
        self.inline(function, call.row.name, to.map(whole));
        (self.span, self.fixed) = (span, fixed);
        (self.program, self.vars) = (outer, vars);
        true
    }
}

/// The storage of variables before anything is declared: that of the globals.
pub(super) fn globals(program: &Program) -> Vec<Option<Storage>> {
    let global = |index| (index < GLOBALS.len()).then_some(Storage::Leaf(Leaf::Global(index)));
    (0..program.vars.len()).map(global).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtins;

    /// Each function of the library is found by a form of a built-in function.
    #[test]
    fn the_library_is_used() {
        let program = program().expect("the library has no errors");
        let mut used = std::collections::BTreeSet::new();
        for row in builtins::all() {
            for signature in row.signatures() {
                used.extend(find(row.name, signature).map(|(_, function)| function.span.start));
            }
        }
        let unused: Vec<_> = program.functions.iter().filter(|f| f.name.ends_with('_')).collect();
        let unused = unused.iter().filter(|f| !used.contains(&f.span.start)).map(|f| &f.name);
        assert_eq!(unused.collect::<Vec<_>>(), Vec::<&std::sync::Arc<str>>::new());
    }
}
