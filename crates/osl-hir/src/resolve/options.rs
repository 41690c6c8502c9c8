//! Checks the options of texture lookups: their names are literals, and the standard ones have known types.
//!
//! OSL language specification, texture functions. A renderer may have further options, so an unknown name is
//! a warning.

use super::Resolver;
use super::errors;
use crate::builtins::{Builtin, OPTIONS};
use crate::hir::{Expr, ExprKind};
use osl_ir::types::Type;
use osl_syntax::diagnostic::Edit;
use osl_syntax::spelling::closest;

impl Resolver<'_> {
    /// Checks the pairs of option and value after the `n_params` fixed arguments, if the function looks up
    /// textures.
    pub(super) fn check_options(&mut self, row: &Builtin, args: &[Expr], n_params: usize) {
        if !row.facts.lookup {
            return;
        }
        for pair in args.get(n_params..).unwrap_or_default().chunks_exact(2) {
            let [name, value] = pair else { continue };
            match &name.kind {
                // An empty name is not an option: renderers skip it.
                ExprKind::Str(text) if text.is_empty() => {}
                ExprKind::Str(text) => self.check_option(text, name, value),
                _ => self.report(errors::open_option(name.span, row.name)),
            }
        }
    }

    fn check_option(&mut self, text: &str, name: &Expr, value: &Expr) {
        let Some((fits, wanted)) = suits(text, value.ty) else {
            if self.is_full() {
                return;
            }
            let known = OPTIONS.iter().map(|option| option.name);
            let mut d = errors::unknown_option(name.span, text);
            if let Some(close) = closest(text, known) {
                d = d.help(format!("there is one named `{close}`"));
                // Only if the literal is in one piece.
                if (name.span.end - name.span.start) as usize == text.len() + 2 {
                    let edit = Edit { span: name.span, text: format!("\"{close}\"") };
                    d = d.suggest(format!("write \"{close}\""), vec![edit]);
                }
            }
            return self.report(d);
        };
        if !fits && !value.ty.is_error() {
            let d = errors::option_type(value.span, text, wanted, &self.show_a(value.ty));
            self.report(d);
        }
    }
}

/// Whether a value of the type fits the option, and the required type; `None` for an unknown option.
fn suits(name: &str, ty: Type) -> Option<(bool, &'static str)> {
    let forms = || OPTIONS.iter().filter(|option| option.name == name);
    let wanted = match forms().next()?.ty {
        _ if forms().count() > 1 => "an int or a string",
        Type::FLOAT => "a float",
        Type::STRING => "a string",
        Type::INT => "an int",
        _ => "a color",
    };
    Some((forms().any(|option| option.takes(ty)), wanted))
}
