//! The messages of lints about slips that other compilers report too: statements and comparisons that do
//! something else than they seem to, names that a function does not know, constants in the wrong order.

use super::codes::*;
use osl_syntax::diagnostic::{Diagnostic, Edit};
use osl_syntax::span::Span;

fn insertion(at: u32, text: &str) -> Edit {
    Edit { span: Span::new(at, at), text: text.to_owned() }
}

/// W0317: a path through the function ends without a `return`.
pub(in crate::lint) fn missing_return(span: Span, name: &str, ty: &str) -> Diagnostic {
    Diagnostic::warning(MISSING_RETURN, span, format!("`{name}` can end without a `return`"))
        .label(format!("it has to return {ty}"))
        .help("add a `return` at its end: without one the value is undefined")
}

/// W0318: the value of the statement is not used.
pub(in crate::lint) fn no_effect(span: Span, what: &str, help: &str) -> Diagnostic {
    Diagnostic::warning(NO_EFFECT, span, "this statement has no effect").label(what).help(help)
}

/// W0318: what follows a decimal comma.
pub(in crate::lint) fn decimal_comma(span: Span, comma: Span) -> Diagnostic {
    no_effect(span, "computes a value that nothing uses", "a number is written with a decimal point")
        .also(comma, "this comma begins it")
        .suggest("write a point", vec![Edit { span: comma, text: ".".to_owned() }])
}

/// W0319: a `;` directly after the condition.
pub(in crate::lint) fn empty_body(semicolon: Span, word: &str, head: Span) -> Diagnostic {
    Diagnostic::warning(EMPTY_BODY, semicolon, format!("this `;` is the whole body of the `{word}`"))
        .label("what follows does not belong to it")
        .also(head, if word == "for" { "its head ends here" } else { "the condition" })
        .help("remove the `;`, or write `{ }` to say that nothing is meant")
        .suggest("remove the semicolon", vec![Edit { span: semicolon, text: String::new() }])
}

/// W0320: the result of a comparison, 0 or 1, is compared again; `middle` is the text of the operand that
/// both comparisons share.
pub(in crate::lint) fn chained(span: Span, inner: Span, middle: Option<(&str, &str)>) -> Diagnostic {
    let d = Diagnostic::warning(CHAINED_COMPARISON, span, "comparisons do not chain")
        .label("compares 0 or 1, the result of the first")
        .also(inner, "the first comparison")
        .help("join two comparisons with `&&`");
    match middle {
        Some((middle, op)) => d.suggest(
            format!("write `… {op} {middle} && {middle} …`"),
            vec![insertion(inner.end, &format!(" && {middle}"))],
        ),
        None => d,
    }
}

/// W0321: `!` applies to the left operand alone; `plain` if the text is `!operand op operand`.
pub(in crate::lint) fn negated_operand(not: Span, whole: Span, plain: bool) -> Diagnostic {
    let d = Diagnostic::warning(NEGATED_OPERAND, not, "`!` applies to the left operand only")
        .label("this is 0 or 1")
        .also(whole, "the comparison")
        .help("put the comparison in parentheses, or the left side if that is meant");
    if !plain {
        return d;
    }
    let edits = vec![insertion(not.start + 1, "("), insertion(whole.end, ")")];
    d.suggest("negate the comparison", edits)
}

/// W0322: these outputs are never written; the location is that of the first.
pub(in crate::lint) fn unwritten_outputs(span: Span, names: &[&str]) -> Diagnostic {
    let message = match names {
        [one] => format!("output `{one}` is never written"),
        _ => format!("{} outputs are never written: {}", names.len(), listed(names)),
    };
    Diagnostic::warning(UNWRITTEN_OUTPUT, span, message)
        .label("keeps its default")
        .help("assign it, or remove it; `#pragma osl nowarn` on the line before says that it is intended")
}

/// W0323: the quotient of two ints becomes a float; `plain` if the numerator is a single operand.
pub(in crate::lint) fn truncated_division(span: Span, numerator: Span, plain: bool) -> Diagnostic {
    let d = Diagnostic::warning(TRUNCATED_DIVISION, span, "the division of two ints drops the fraction")
        .label("an int, before it becomes a float")
        .help("make one of them a float, as in `(float)a / b`; `(float)(a / b)` says that it is intended");
    match plain {
        true => d.suggest("divide floats", vec![insertion(numerator.start, "(float)")]),
        false => d,
    }
}

/// W0324: the function does not know the name.
pub(in crate::lint) fn unknown_word(
    span: Span,
    kind: &str,
    name: &str,
    effect: &str,
    known: &[&str],
) -> Diagnostic {
    Diagnostic::warning(UNKNOWN_WORD, span, format!("there is no {kind} \"{name}\""))
        .label(effect)
        .help(format!("known names: {}", known.join(", ")))
}

/// W0325: the name of metadata is almost a usual one.
pub(in crate::lint) fn misspelt_metadata(span: Span, name: &str, close: &str) -> Diagnostic {
    Diagnostic::warning(MISSPELT_ATTRIBUTE, span, format!("metadata `{name}` is not a usual one"))
        .label("only a program that knows this name reads it")
        .help(format!("there is metadata named `{close}`"))
        .suggest(format!("write `{close}`"), vec![Edit { span, text: close.to_owned() }])
}

/// W0325: the name of an attribute is almost a standard one.
pub(in crate::lint) fn misspelt_attribute(span: Span, name: &str, close: &str) -> Diagnostic {
    Diagnostic::warning(MISSPELT_ATTRIBUTE, span, format!("\"{name}\" is not a standard attribute"))
        .label("only a renderer with an attribute of this name sets the value")
        .help(format!("there is one named \"{close}\""))
}

/// W0326: the first edge is the larger one.
pub(in crate::lint) fn reversed_edges(span: Span, function: &str, low: Span, high: Span) -> Diagnostic {
    let d = match function {
        "clamp" => Diagnostic::warning(REVERSED_EDGES, span, "the minimum is larger than the maximum")
            .label("gives the maximum, whatever the value is")
            .help("write the smaller bound first"),
        _ => Diagnostic::warning(REVERSED_EDGES, span, "the first edge is larger than the second")
            .label("steps without a transition")
            .help("write the smaller edge first; `1 - ` before the call turns the step around"),
    };
    d.also(low, "this is the larger one").also(high, "than this")
}

/// W0327: parts of a color that look like bytes.
pub(in crate::lint) fn byte_color(span: Span, parts: Option<String>) -> Diagnostic {
    let d = Diagnostic::warning(BYTE_COLOR, span, "the parts of a color go from 0 to 1, not to 255")
        .label("many times as bright as white")
        .help("divide it by 255");
    match parts {
        Some(text) => d.suggest("divide by 255", vec![Edit { span, text }]),
        None => d,
    }
}

/// W0328: both branches do the same.
pub(in crate::lint) fn same_branches(span: Span, first: Span, second: Span) -> Diagnostic {
    Diagnostic::warning(SAME_BRANCHES, span, "both branches are the same")
        .label("decides nothing")
        .also(first, "if it holds")
        .also(second, "if not")
        .help("change one of them, or leave the condition out")
}
