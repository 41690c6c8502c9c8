//! The lints with their codes, and one constructor for each message.

use super::{Level, Lint};
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;

macro_rules! lints {
    ($($(#[$doc:meta])* $name:ident = $id:literal $text:literal $level:ident;)*) => {
        $($(#[$doc])* pub const $name: Code = Code { id: $id, name: $text };)*
        /// All lints, in order of their numbers.
        pub const LINTS: &[Lint] = &[$(Lint { code: $name, level: Level::$level }),*];
    };
}

lints! {
    /// A local variable whose value nothing reads.
    UNUSED_VARIABLE = "W0301" "unused-variable" Check;
    /// A parameter, of the shader or of a function, that nothing reads.
    UNUSED_PARAMETER = "W0302" "unused-parameter" Check;
    /// A function that nothing calls.
    UNUSED_FUNCTION = "W0303" "unused-function" Check;
    /// A read of a variable that nothing can have assigned before.
    UNINITIALIZED_USE = "W0304" "uninitialized-use" Always;
    /// A read of a variable that one path to it leaves unassigned.
    MAYBE_UNINITIALIZED = "W0305" "maybe-uninitialized" Check;
    /// A statement after a jump.
    UNREACHABLE_CODE = "W0306" "unreachable-code" Check;
    /// A loop without a way out.
    ENDLESS_LOOP = "W0307" "endless-loop" Always;
    /// A condition that is always or never true.
    CONSTANT_CONDITION = "W0308" "constant-condition" Check;
    /// `=` in place of a condition.
    ASSIGNMENT_IN_CONDITION = "W0309" "assignment-in-condition" Always;
    /// A variable assigned to itself.
    SELF_ASSIGNMENT = "W0310" "self-assignment" Check;
    /// `==` between computed floats.
    FLOAT_EQUALITY = "W0311" "float-equality" Check;
    /// A division of int literals that loses a fraction and becomes a float.
    INTEGER_DIVISION = "W0312" "integer-division" Always;
    /// A variable that hides another one.
    SHADOWING = "W0313" "shadowing" Check;
    /// A named coordinate space that renderers do not define.
    UNKNOWN_SPACE = "W0314" "unknown-space" Check;
    /// A named color space that the language does not define.
    UNKNOWN_COLOR_SPACE = "W0315" "unknown-color-space" Check;
    /// A variable that only a query sets, without a check whether the query succeeded.
    UNCHECKED_QUERY = "W0316" "unchecked-query" Check;
    /// A function with a type that can end without a `return`.
    MISSING_RETURN = "W0317" "missing-return" Always;
    /// A statement whose value nothing uses.
    NO_EFFECT = "W0318" "no-effect" Always;
    /// A `;` in place of the body of an `if` or loop.
    EMPTY_BODY = "W0319" "empty-body" Always;
    /// `a < b < c`.
    CHAINED_COMPARISON = "W0320" "chained-comparison" Always;
    /// `!a > b`.
    NEGATED_OPERAND = "W0321" "negated-operand" Always;
    /// An output of the shader that nothing writes.
    UNWRITTEN_OUTPUT = "W0322" "unwritten-output" Check;
    /// A division of int variables that becomes a float.
    TRUNCATED_DIVISION = "W0323" "truncated-division" Always;
    /// A name that a function does not know: of a noise, a wrap mode, an interpolation, a distribution.
    UNKNOWN_WORD = "W0324" "unknown-word" Always;
    /// The name of an attribute that resembles a standard one.
    MISSPELT_ATTRIBUTE = "W0325" "misspelt-attribute" Always;
    /// The first of two constant edges is the larger one.
    REVERSED_EDGES = "W0326" "reversed-edges" Always;
    /// A color with parts from 0 to 255.
    BYTE_COLOR = "W0327" "byte-color" Always;
    /// A condition whose two branches are the same.
    SAME_BRANCHES = "W0328" "same-branches" Always;
}

/// W0301: the local is never read.
pub(super) fn unused_variable(span: Span, name: &str, assigned: bool) -> Diagnostic {
    let what = if assigned { "is assigned but never read" } else { "is never used" };
    Diagnostic::warning(UNUSED_VARIABLE, span, format!("variable `{name}` {what}"))
        .label("no expression reads it")
        .help(format!("remove it, or name it `_{name}` to say that this is intended"))
}

/// W0302: these parameters of the shader are never read; the location is that of the first.
pub(super) fn unused_shader_parameters(span: Span, names: &[&str]) -> Diagnostic {
    let (what, label) = match names {
        [one] => (format!("parameter `{one}` has no effect"), "nothing reads it"),
        _ => (format!("{} parameters have no effect: {}", names.len(), listed(names)), "the first of them"),
    };
    Diagnostic::warning(UNUSED_PARAMETER, span, what)
        .label(label)
        .help("remove it; if the interface needs it, put `#pragma osl nowarn` on the line before")
}

/// Maximum number of names in a message.
const MOST_NAMES: usize = 12;

/// `a`, `b` and so on, as far as they fit on a line.
pub(super) fn listed(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(MOST_NAMES);
    if more > 0 { format!("{} and {more} more", shown.join(", ")) } else { shown.join(", ") }
}

/// W0302: the function's formal is never read.
pub(super) fn unused_formal(span: Span, name: &str) -> Diagnostic {
    Diagnostic::warning(UNUSED_PARAMETER, span, format!("parameter `{name}` is never read"))
        .label("its function does not read it")
        .help(format!("remove it, or name it `_{name}` to say that this is intended"))
}

/// W0303: these functions are never called; the location is that of the first.
pub(super) fn unused_functions(span: Span, names: &[&str]) -> Diagnostic {
    let (what, label) = match names {
        [one] => (format!("function `{one}` is never called"), "no call of it is in this file"),
        _ => (format!("{} functions are never called: {}", names.len(), listed(names)), "the first of them"),
    };
    Diagnostic::warning(UNUSED_FUNCTION, span, what).label(label).help("remove it, or move it into a header")
}

/// W0316: if the query fails, the variable has no value.
pub(super) fn unchecked_query(span: Span, name: &str, query: &str, declared: Span) -> Diagnostic {
    Diagnostic::warning(UNCHECKED_QUERY, span, format!("`{name}` has no value where `{query}` fails"))
        .label("nobody asks whether it succeeded")
        .also(declared, "declared without a value")
        .note("oslrun starts every variable at zero; other renderers leave what was in memory")
        .help(format!("give `{name}` a value where it is declared, or test what `{query}` returns"))
}

/// W0304: no path to the read assigns the variable.
pub(super) fn uninitialized(span: Span, name: &str, declared: Span) -> Diagnostic {
    Diagnostic::warning(
        UNINITIALIZED_USE,
        span,
        format!("`{name}` is read before anything is assigned to it"),
    )
    .label("its value is undefined here")
    .also(declared, "declared without a value")
    .note("oslrun starts every variable at zero; other renderers leave what was in memory")
    .help(format!("give `{name}` a value where it is declared"))
}

/// W0304: the loop assigns the variable, but reads it first.
pub(super) fn uninitialized_first_pass(span: Span, name: &str, declared: Span, assigned: Span) -> Diagnostic {
    let d = Diagnostic::warning(
        UNINITIALIZED_USE,
        span,
        format!("the first pass of the loop reads `{name}` before anything is assigned to it"),
    )
    .label("its value is undefined on the first pass")
    .also(declared, "declared without a value");
    let d = if assigned == span { d } else { d.also(assigned, "first assigned here") };
    d.note("oslrun starts every variable at zero; other renderers leave what was in memory")
        .help(format!("give `{name}` a value where it is declared"))
}

/// W0305: one side of an `if` leaves the variable unassigned.
pub(super) fn maybe_uninitialized(
    span: Span,
    name: &str,
    declared: Span,
    cond: Span,
    when: bool,
) -> Diagnostic {
    Diagnostic::warning(MAYBE_UNINITIALIZED, span, format!("`{name}` may be read before it is assigned"))
        .label("its value may be undefined here")
        .also(declared, "declared without a value")
        .also(cond, format!("nothing is assigned where this is {when}"))
        .help(format!("give `{name}` a value where it is declared"))
}

/// W0306: the statement is never reached.
pub(super) fn unreachable(span: Span, jump: Span, what: &str) -> Diagnostic {
    Diagnostic::warning(UNREACHABLE_CODE, span, "this statement is never reached")
        .label("nothing comes here")
        .also(jump, what)
        .help("remove what follows, or make the jump conditional")
}

/// W0307: neither the condition nor a jump ends the loop.
pub(super) fn endless(span: Span) -> Diagnostic {
    Diagnostic::warning(ENDLESS_LOOP, span, "this loop never ends")
        .label("nothing in the loop leaves it")
        .help("add a `break`, or a condition that becomes false")
}

/// W0307: nothing in the loop changes its condition.
pub(super) fn unchanged_condition(span: Span, names: &[&str]) -> Diagnostic {
    Diagnostic::warning(ENDLESS_LOOP, span, "this loop never ends once it runs")
        .label(format!("nothing in the loop changes {}", listed(names)))
        .help("change a variable of the condition in the loop, or add a `break`")
}

/// W0307: the counter of the loop moves away from its end.
pub(super) fn counts_away(span: Span, name: &str, up: bool, step: Span) -> Diagnostic {
    let (moves, other) = if up { ("grows", "--") } else { ("shrinks", "++") };
    Diagnostic::warning(ENDLESS_LOOP, span, "this loop counts away from its end")
        .label(format!("`{name}` only {moves}"))
        .also(step, "here")
        .help(format!("write `{name}{other}`, or turn the comparison around"))
}

/// W0308: the condition does not hold for the first value of the loop's counter.
pub(super) fn never_runs(span: Span, name: &str, start: Span, value: &str) -> Diagnostic {
    Diagnostic::warning(CONSTANT_CONDITION, span, "the condition of this loop does not hold at first")
        .label(format!("it never runs: `{name}` is {value} at first"))
        .also(start, "its first value")
        .help("the condition says how long the loop goes on: turn the comparison around")
}

/// W0308: the condition is a constant; if it does not consist of literals alone, because of the variable
/// declared there.
pub(super) fn constant_condition(
    span: Span,
    value: Option<bool>,
    source: Option<(Span, &str)>,
) -> Diagnostic {
    let (what, label) = match value {
        Some(true) => ("this condition always holds", "always true"),
        Some(false) => ("this condition never holds", "always false"),
        None => ("this condition is a constant", "the same at every point"),
    };
    let d = Diagnostic::warning(CONSTANT_CONDITION, span, what)
        .label(label)
        .help("remove the branch that is not taken, or make a macro or parameter of the condition");
    match source {
        Some((declared, name)) => d.also(declared, format!("`{name}` has this value from here on")),
        None => d,
    }
}

/// W0309: an assignment is the condition.
pub(super) fn assignment_in_condition(span: Span) -> Diagnostic {
    Diagnostic::warning(ASSIGNMENT_IN_CONDITION, span, "an assignment stands as the condition")
        .label("this assigns, then tests the new value")
        .help("compare with `==`; if the assignment is meant, put it in parentheses of its own")
}

/// W0310: a variable receives its own value.
pub(super) fn self_assignment(span: Span, text: &str) -> Diagnostic {
    Diagnostic::warning(SELF_ASSIGNMENT, span, format!("`{text}` is assigned to itself"))
        .label("this changes nothing")
        .help("assign something else, or remove the statement")
}

/// W0311: floats compared for equality; `literal` is one that no float equals exactly.
pub(super) fn float_equality(span: Span, op: &str, literal: Option<Span>, triple: bool) -> Diagnostic {
    let help = if triple {
        "compare their distance with a tolerance, as in `length(vector(a - b)) < 1e-4`"
    } else {
        "compare their distance with a tolerance, as in `abs(a - b) < 1e-4`"
    };
    let d = Diagnostic::warning(FLOAT_EQUALITY, span, format!("`{op}` asks for exact equality of floats"))
        .label("holds only where all bits agree")
        .help(help);
    match literal {
        Some(at) => d.also(at, "no float has exactly this value"),
        None => d,
    }
}

/// W0312: the fraction of an int division is lost before the result becomes a float.
pub(super) fn integer_division(span: Span, a: i32, b: i32) -> Diagnostic {
    let (int, float) = (a.wrapping_div(b), f64::from(a) / f64::from(b));
    Diagnostic::warning(
        INTEGER_DIVISION,
        span,
        format!("the division of two ints yields {int}, not {float:.4}"),
    )
    .label("the fraction is lost before this becomes a float")
    .help("write one of the numbers with a decimal point")
}

/// W0313: the inner variable hides the outer one.
pub(super) fn shadowing(span: Span, name: &str, outer: Option<Span>) -> Diagnostic {
    let d = Diagnostic::warning(SHADOWING, span, format!("`{name}` hides another variable of that name"))
        .label("a new variable")
        .help("give it another name, or drop the type to assign the outer one");
    match outer {
        Some(outer) => d.also(outer, "the hidden one"),
        None => d.note(format!("`{name}` is a global variable of every shader")),
    }
}

/// W0314, W0315: an unknown name.
pub(super) fn unknown_space(code: Code, span: Span, name: &str, known: &[&str]) -> Diagnostic {
    let kind = if code == UNKNOWN_SPACE { "coordinate space" } else { "color space" };
    Diagnostic::warning(code, span, format!("not every renderer has a {kind} \"{name}\""))
        .label("unknown unless the renderer defines it")
        .help(format!("usual names: {}; declare others with `--known-space`", known.join(", ")))
}
