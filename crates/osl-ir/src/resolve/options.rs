//! The options of texture lookups: their names are literals, and the usual ones are known with their types.
//!
//! OSL language specification, texture functions. A renderer may know more, so that an unknown name is a warning.

use super::Resolver;
use super::errors::{self, closest};
use crate::hir::{Expr, ExprKind};
use crate::types::Type;
use osl_syntax::diagnostic::Edit;

const NUMBERS: &[&str] = &[
    "blur",
    "sblur",
    "tblur",
    "rblur",
    "width",
    "swidth",
    "twidth",
    "rwidth",
    "fill",
    "time",
    "alpha",
    "missingalpha",
];
const STRINGS: &[&str] = &["wrap", "swrap", "twrap", "rwrap", "interp", "errormessage", "colorspace"];
const OTHERS: &[&str] = &["firstchannel", "subimage", "missingcolor"];

impl Resolver<'_> {
    /// Checks the pairs of option and value behind the `n_params` fixed arguments, if the function looks up textures.
    pub(super) fn check_options(&mut self, function: &str, args: &[Expr], n_params: usize) {
        if !matches!(function, "texture" | "texture3d" | "environment") {
            return;
        }
        for pair in args.get(n_params..).unwrap_or_default().chunks_exact(2) {
            let [name, value] = pair else { continue };
            match &name.kind {
                ExprKind::Str(text) => self.check_option(text, name, value),
                _ => self.report(errors::open_option(name.span, function)),
            }
        }
    }

    fn check_option(&mut self, text: &str, name: &Expr, value: &Expr) {
        let Some((fits, wanted)) = suits(text, value.ty) else {
            if self.is_full() {
                return;
            }
            let known = NUMBERS.iter().chain(STRINGS).chain(OTHERS).copied();
            let mut d = errors::unknown_option(name.span, text);
            if let Some(close) = closest(text, known) {
                d = d.help(format!("there is one named `{close}`"));
                // Only where the literal is written in one piece.
                if (name.span.end - name.span.start) as usize == text.len() + 2 {
                    let edit = Edit { span: name.span, text: format!("\"{close}\"") };
                    d = d.fix(format!("write \"{close}\""), vec![edit]);
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

/// Whether a value of the type suits the option, and what does; `None` for an unknown option.
fn suits(option: &str, ty: Type) -> Option<(bool, &'static str)> {
    Some(match option {
        _ if NUMBERS.contains(&option) => (ty.is_number(), "a float"),
        _ if STRINGS.contains(&option) => (ty == Type::STRING, "a string"),
        "firstchannel" => (ty == Type::INT, "an int"),
        "subimage" => (ty == Type::INT || ty == Type::STRING, "an int or a string"),
        "missingcolor" => (ty.is_triple(), "a color"),
        _ => return None,
    })
}
