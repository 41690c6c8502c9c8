//! Checks format strings, such as those of `printf`: each conversion against its argument.
//!
//! OSL language specification, chapter on printing.

use super::Resolver;
use super::errors;
use crate::builtins::Builtin;
use crate::hir::{Expr, ExprKind};
use osl_ir::types::{Base, Type};
use osl_syntax::Reports;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// Letters that end a conversion.
const LETTERS: &str = "cdefgimnopsuvxX";

/// A conversion in a format string.
struct Conversion<'f> {
    /// As written, `%5.3f`.
    text: &'f str,
    /// The position of its letter in the format.
    letter_at: usize,
    letter: char,
    /// The start of its precision; the position of the letter if there is none.
    precision_at: usize,
}

impl Resolver<'_> {
    /// Checks the arguments of a call, if its function prints.
    pub(super) fn check_format(&mut self, row: &Builtin, args: &[Expr], span: Span) {
        let Some(at) = row.facts.format else { return };
        let Some((format, values)) = args.get(at..).and_then(<[Expr]>::split_first) else { return };
        let ExprKind::Str(text) = &format.kind else {
            return self.report(errors::open_format(format.span, row.name));
        };
        let conversions = conversions(text);
        let n_errors = self.n_errors;
        for (conversion, value) in conversions.iter().zip(values) {
            if self.n_errors > self.max_diagnostics() {
                return;
            }
            self.check_conversion(format.span, text, conversion, value);
            if self.reports == Reports::AsReference && self.n_errors > n_errors {
                return;
            }
        }
        if conversions.len() != values.len() {
            let first_extra = values.get(conversions.len()).map(|value| value.span);
            self.report(errors::format_count(
                span,
                format.span,
                conversions.len(),
                values.len(),
                first_extra,
            ));
        }
    }

    fn check_conversion(&mut self, literal: Span, format: &str, conversion: &Conversion<'_>, value: &Expr) {
        let Some((letters, usual)) = letters_for(value.ty) else {
            if !value.ty.is_error() {
                self.report(errors::unprintable(value.span, &self.show_a(value.ty)));
            }
            return;
        };
        if letters.contains(conversion.letter) {
            return;
        }
        let ty = self.show_a(value.ty);
        let element = self.show_a(value.ty.element());
        let mut d = errors::format_letter(value.span, conversion.text, &ty, literal)
            .help(format!("{element} prints with `%{usual}`"));
        // Only if the literal is in one piece, written as this code would write it.
        if quoted(format).len() == (literal.end - literal.start) as usize {
            let at = |offset: usize| literal.start + quoted(&format[..offset]).len() as u32 - 1;
            // A precision would truncate a string, and has another meaning for an int.
            let from = if usual == "g" { conversion.letter_at } else { conversion.precision_at };
            let edit = Edit { span: Span::new(at(from), at(conversion.letter_at + 1)), text: usual.into() };
            d = d.fix(format!("print it with `%{usual}`"), vec![edit]);
        }
        self.report(d);
    }
}

/// The letters that print a value of the type, and the usual one; `None` for types that cannot be printed.
fn letters_for(ty: Type) -> Option<(&'static str, &'static str)> {
    match ty.base {
        Base::Int => Some(("dioxX", "d")),
        Base::String | Base::Closure => Some(("s", "s")),
        Base::Float | Base::Matrix => Some(("fgecmnpv", "g")),
        base if base.is_triple() => Some(("fgecmnpv", "g")),
        _ => None,
    }
}

/// Number of values that a format prints.
pub(crate) fn count_conversions(format: &str) -> usize {
    conversions(format).len()
}

/// The conversions of a format, in order. One without a letter takes no argument.
fn conversions(format: &str) -> Vec<Conversion<'_>> {
    let mut found = Vec::new();
    let mut from = 0;
    while let Some(at) = format[from..].find('%').map(|at| at + from) {
        if format[at..].starts_with("%%") {
            from = at + 2;
            continue;
        }
        let letter = format[at..].char_indices().find(|(_, c)| LETTERS.contains(*c));
        let Some((offset, letter)) = letter else { break };
        let letter_at = at + offset;
        from = letter_at + 1;
        let precision_at = format[at..letter_at].find('.').map_or(letter_at, |dot| at + dot);
        found.push(Conversion { text: &format[at..from], letter_at, letter, precision_at });
    }
    found
}

/// The text as a string literal.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '\n' => out += "\\n",
            '\t' => out += "\\t",
            '\r' => out += "\\r",
            '"' => out += "\\\"",
            '\\' => out += "\\\\",
            _ => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_a_conversion() {
        let texts =
            |format| conversions(format).iter().map(|c| c.text.to_string()).collect::<Vec<_>>().join(" ");
        assert_eq!(texts("a %d, %-5.3f%% %s"), "%d %-5.3f %s");
        assert_eq!(texts("100%"), "");
        assert_eq!(texts("%é%d"), "%é%d");
        assert_eq!(texts("%%%g"), "%g");
    }
}
