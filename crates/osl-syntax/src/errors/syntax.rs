//! Messages about the order of tokens.

use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::span::Span;

pub(crate) const SYNTAX: Code = Code { id: "E0110", name: "syntax" };
pub(crate) const UNCLOSED: Code = Code { id: "E0111", name: "unclosed" };
pub(crate) const STRAY_CLOSER: Code = Code { id: "E0112", name: "stray-closer" };
pub(crate) const NESTING: Code = Code { id: "E0113", name: "nesting" };
pub(crate) const NOT_ASSIGNABLE: Code = Code { id: "E0114", name: "not-assignable" };
pub(crate) const NOT_INDEXABLE: Code = Code { id: "E0115", name: "not-indexable" };
pub(crate) const ARRAY_LENGTH: Code = Code { id: "E0116", name: "array-length" };
pub(crate) const ARRAY_INITIALIZER: Code = Code { id: "E0117", name: "array-initializer" };
pub(crate) const EMPTY_INITIALIZER: Code = Code { id: "E0118", name: "empty-initializer" };
pub(crate) const TOO_MANY_ERRORS: Code = Code { id: "E0120", name: "too-many-errors" };

/// E0110: a token that the grammar does not allow here.
pub(crate) fn syntax(span: Span, found: &str, expected: &str) -> Diagnostic {
    Diagnostic::error(SYNTAX, span, format!("expected {expected}, found {found}")).label("not expected here")
}

/// E0110: a separator or closing bracket that is missing at `end`, the end of the token before.
pub(crate) fn missing(end: Span, next: Span, found: &str, what: &str) -> Diagnostic {
    let names = [(",", "comma"), (";", "semicolon"), (")", "parenthesis")];
    let name = names.iter().find(|(text, _)| *text == what).map_or(what, |(_, name)| name);
    syntax(end, found, &format!("`{what}`"))
        .label(format!("a `{what}` is missing here"))
        .also(next, "not expected here")
        .fix(format!("add the {name}"), vec![Edit { span: end, text: what.to_owned() }])
}

/// E0110: a factor directly after a number.
pub(crate) fn missing_operator(end: Span, next: Span) -> Diagnostic {
    Diagnostic::error(SYNTAX, end, "an operator or a comma is missing")
        .label("between these two")
        .also(next, "not expected here")
        .help("a product is written with `*`, as in `2 * u`")
        .suggest("multiply", vec![Edit { span: end, text: " *".to_owned() }])
}

/// E0110: a name that resembles a keyword where only a keyword fits.
pub(crate) fn misspelt_keyword(span: Span, name: &str, word: &str, written: bool) -> Diagnostic {
    let d = Diagnostic::error(SYNTAX, span, format!("`{name}` begins no statement"))
        .label("not a keyword")
        .help(format!("OSL has `{word}`"));
    match written {
        true => d.fix(format!("write `{word}`"), vec![Edit { span, text: word.to_owned() }]),
        false => d,
    }
}

/// E0110: an operator of another language.
pub(crate) fn foreign_operator(span: Span, found: &str, meant: &str) -> Diagnostic {
    Diagnostic::error(SYNTAX, span, format!("`{found}` is not an operator"))
        .label("not an operator of OSL")
        .fix(format!("write `{meant}`"), vec![Edit { span, text: meant.to_owned() }])
}

/// E0110: a number with a decimal comma.
pub(crate) fn decimal_comma(span: Span, comma: Span) -> Diagnostic {
    Diagnostic::error(SYNTAX, span, "a number is written with a decimal point")
        .label("two numbers, with a comma between them")
        .fix("write a point", vec![Edit { span: comma, text: ".".to_owned() }])
}

/// E0110: the name of a space before the parenthesis that holds the values; `both` reaches from the type to
/// the parenthesis.
pub(crate) fn space_before_values(both: Span, space: Span, written: &str) -> Diagnostic {
    Diagnostic::error(SYNTAX, space, "the space stands before the values")
        .label("not expected here")
        .help("in OSL the space is the first argument: `point(\"shader\", 0, 0, 0)`")
        .fix("move it into the parentheses", vec![Edit { span: both, text: format!("({written}, ") }])
}

/// E0110: commas between the parts of a `for`.
pub(crate) fn commas_in_for(first: Span, second: Span) -> Diagnostic {
    let edit = |span| Edit { span, text: ";".to_owned() };
    Diagnostic::error(SYNTAX, first, "the parts of a `for` are separated by `;`")
        .label("a comma")
        .also(second, "and here")
        .fix("write semicolons", vec![edit(first), edit(second)])
}

/// E0110: a method, or a function of a module; `text` is the head of the call that was meant.
pub(crate) fn method(span: Span, name: &str, of_module: bool, text: Option<String>) -> Diagnostic {
    let (message, help) = match of_module {
        true => ("OSL has no modules", "its functions need no name before them".to_owned()),
        false => {
            ("OSL has no methods", format!("the value is the first argument of a function: `{name}(a, b)`"))
        }
    };
    let d = Diagnostic::error(SYNTAX, span, message).label("not expected here").help(help);
    match text {
        Some(text) => d.fix(format!("call `{name}`"), vec![Edit { span, text }]),
        None => d,
    }
}

/// E0110: a list in square brackets.
pub(crate) fn list_in_brackets(span: Span, edits: Vec<Edit>) -> Diagnostic {
    Diagnostic::error(SYNTAX, span, "a list stands in braces")
        .label("square brackets are for indices")
        .help("only a declaration takes a list: `float a[3] = {1, 2, 3}`")
        .fix("write braces", edits)
}

/// E0110: metadata in single brackets.
pub(crate) fn single_brackets(open: Span, close: Span, edits: Vec<Edit>) -> Diagnostic {
    Diagnostic::error(SYNTAX, open, "metadata stands in double brackets")
        .label("a single bracket")
        .also(close, "and here")
        .fix("write `[[` and `]]`", edits)
}

/// E0110: metadata without its type.
pub(crate) fn untyped_metadata(span: Span, name: &str, before: Span, ty: &str) -> Diagnostic {
    Diagnostic::error(SYNTAX, span, format!("the metadata `{name}` has no type"))
        .label("a type is missing before this")
        .suggest(format!("write `{ty} {name}`"), vec![Edit { span: before, text: format!("{ty} ") }])
}

/// E0110: a word before the type of a parameter.
pub(crate) fn qualifier(span: Span, word: &str, edit: Edit) -> Diagnostic {
    let d = Diagnostic::error(SYNTAX, span, format!("`{word}` is no qualifier of OSL")).label("not a type");
    match edit.text.is_empty() {
        true => d.help("a parameter is an input unless it says `output`").fix("leave it out", vec![edit]),
        false => d.help("a parameter that returns a value is an `output`").fix("write `output`", vec![edit]),
    }
}

/// E0112: a `}` that ends the declaration `name` before the statements at `next`, so that the one at `stray`
/// closes nothing. `sure`: the indentation says that this one is too many.
pub(crate) fn extra_brace(span: Span, name: &str, next: Span, stray: Span, sure: bool) -> Diagnostic {
    let d = Diagnostic::error(STRAY_CLOSER, span, format!("there is a `}}` too many in `{name}`"))
        .also(next, format!("a brace before this closes `{name}`, so this stands outside of it"))
        .also(stray, "and this one closes nothing");
    match sure {
        true => d
            .label("it is not indented like the block that it closes")
            .suggest("remove the `}`", vec![Edit { span, text: String::new() }]),
        false => d.label(format!("closes `{name}`")).help("remove one of the braces before this place"),
    }
}

/// E0111: a block without its `}`, where the indentation says at which token it ends.
pub(crate) fn unclosed_block(opener: Span, ends: Span) -> Diagnostic {
    Diagnostic::error(UNCLOSED, opener, "this `{` is never closed")
        .label("the block begins here")
        .also(ends, "by the indentation, it ends before this")
}

/// E0111: brackets that are still open at the end of the text or where something else begins.
pub(crate) fn unclosed(span: Span, found: &str, opener: Span, bracket: &str) -> Diagnostic {
    Diagnostic::error(UNCLOSED, span, format!("found {found}, but a `{bracket}` is still open"))
        .label("not expected inside the brackets")
        .also(opener, format!("this `{bracket}` is never closed"))
}

/// E0112: a closing bracket that closes nothing.
pub(crate) fn stray_closer(span: Span, bracket: &str) -> Diagnostic {
    Diagnostic::error(STRAY_CLOSER, span, format!("this `{bracket}` closes nothing"))
        .label("no bracket is open here")
        .suggest(format!("remove the `{bracket}`"), vec![Edit { span, text: String::new() }])
}

/// E0113: constructs that are nested too deeply.
pub(crate) fn nesting(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(NESTING, span, format!("nested more than {limit} levels deep"))
        .label("this part nests too deep")
        .help("split it: give parts of it names of their own")
}

/// E0114: `=`, `++` and the like on something that is not a variable.
pub(crate) fn not_assignable(span: Span, action: &str) -> Diagnostic {
    Diagnostic::error(NOT_ASSIGNABLE, span, format!("cannot {action} this expression"))
        .label("not a variable")
        .note("a target is a name, with indices and fields behind it; parentheses make it a value")
}

/// E0115: `[ ]` or `.` after something that is not a variable; `text`: a string.
pub(crate) fn not_indexable(span: Span, action: &str, text: bool) -> Diagnostic {
    let d = Diagnostic::error(NOT_INDEXABLE, span, format!("cannot {action} this expression"))
        .label("not a variable")
        .note("OSL takes components, elements and fields of variables only");
    match text {
        true => d.help(
            "the channel of a texture is an option: `texture(\"file.exr\", u, v, \"firstchannel\", 0)`",
        ),
        false => d.help("assign it to a variable first"),
    }
}

/// E0115: a fourth consecutive index.
pub(crate) fn too_many_indices(span: Span) -> Diagnostic {
    Diagnostic::error(NOT_INDEXABLE, span, "more than three indices in a row")
        .label("the fourth")
        .note("an array of matrices, which takes three, is the deepest there is")
}

/// E0116: a length that is not a positive int literal; `listed` is the number of values of an array without a
/// length.
pub(crate) fn array_length(span: Span, listed: Option<usize>) -> Diagnostic {
    let d = Diagnostic::error(ARRAY_LENGTH, span, "an array length is an int literal of at least 1")
        .label("not such a literal")
        .help("a macro that stands for a literal will do");
    match listed {
        Some(n) => {
            let at = Span::new(span.end - 1, span.end - 1);
            d.fix(format!("write the length, {n}"), vec![Edit { span: at, text: n.to_string() }])
        }
        None => d,
    }
}

/// E0117: an array initialiser that is not a list; `values`: one in parentheses.
pub(crate) fn array_initializer(span: Span, values: bool) -> Diagnostic {
    let d = Diagnostic::error(ARRAY_INITIALIZER, span, "an array is initialised by a list in braces")
        .label("not a list");
    match values {
        true => d.help("write braces instead of the parentheses: `{1, 2, 3}`"),
        false => d.help("to copy another array, declare first and assign then"),
    }
}

/// E0118: an empty `{ }`.
pub(crate) fn empty_initializer(span: Span) -> Diagnostic {
    Diagnostic::error(EMPTY_INITIALIZER, span, "empty initialiser list")
        .label("at least one value is needed")
        .note("only the default of a shader's array parameter may be empty")
}

/// E0120: the limit of reported errors.
pub fn too_many_errors(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(TOO_MANY_ERRORS, span, format!("more than {limit} problems: the rest is not reported"))
        .label("given up here")
}
