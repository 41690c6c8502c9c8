//! Codes and messages of resolution: names E02xx, types E03xx, calls E04xx, statements E05xx; warnings W02xx
//! on.

use super::vocabulary::Word;
use osl_syntax::diagnostic::{Code, Diagnostic, Edit};
use osl_syntax::span::Span;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $id:literal $text:literal;)*) => {
        $($(#[$doc])* pub const $name: Code = Code { id: $id, name: $text };)*
        /// All codes of this module, in order.
        pub const ALL: &[Code] = &[$($name),*];
    };
}

codes! {
    /// A variable or function that no scope declares.
    UNKNOWN_NAME = "E0201" "unknown-name";
    /// A name declared twice in one scope.
    REDECLARED = "E0202" "redeclared";
    /// A struct type that was not declared.
    UNKNOWN_TYPE = "E0203" "unknown-type";
    /// A member that the type does not have.
    UNKNOWN_MEMBER = "E0204" "unknown-member";
    /// A function used as a value, or a variable called.
    WRONG_KIND_OF_NAME = "E0205" "wrong-kind-of-name";
    /// The file declares no shader.
    NO_SHADER = "E0206" "no-shader";
    /// The file declares more than one shader.
    TWO_SHADERS = "E0207" "two-shaders";
    /// More functions with one name than overload resolution permits.
    TOO_MANY_OVERLOADS = "E0208" "too-many-overloads";
    /// Operands that the operator does not take.
    BAD_OPERANDS = "E0301" "bad-operands";
    /// A value that cannot be assigned to its destination.
    NOT_ASSIGNABLE = "E0302" "not-assignable";
    /// A conversion that does not exist.
    BAD_CAST = "E0303" "bad-cast";
    /// Constructor arguments that do not make a value of the type.
    BAD_CONSTRUCTOR = "E0304" "bad-constructor";
    /// An initialiser list that is not permitted here, or has the wrong length.
    BAD_LIST = "E0305" "bad-initializer-list";
    /// A condition without truth value.
    BAD_CONDITION = "E0306" "bad-condition";
    /// `?:` branches of types that have no common type.
    BAD_TERNARY = "E0307" "bad-ternary";
    /// `[ ]` on a type without elements, or with an index that is not an int.
    BAD_INDEX = "E0308" "bad-index";
    /// An array length that is not a positive int literal.
    BAD_ARRAY_LENGTH = "E0309" "bad-array-length";
    /// A struct with an invalid declaration.
    BAD_STRUCT = "E0310" "bad-struct";
    /// Something that cannot be assigned to. The parser refuses these first; other sources of trees may not.
    NOT_AN_LVALUE = "E0311" "not-an-lvalue";
    /// A write to a parameter that is not an output, or to a constant.
    READ_ONLY = "E0312" "read-only";
    /// No overload takes the arguments.
    NO_OVERLOAD = "E0401" "no-overload";
    /// Overloads that differ only in the struct that they return, or in the type that a list would have.
    AMBIGUOUS_STRUCTS = "E0402" "ambiguous-structs";
    /// A function that was declared but has no body yet.
    NO_BODY = "E0403" "no-body";
    /// An output argument of another type.
    OUTPUT_TYPE = "E0404" "output-type";
    /// A format string that does not match its arguments.
    BAD_FORMAT = "E0405" "bad-format";
    /// A function with a return type but without a `return` of a value.
    NEVER_RETURNS = "E0406" "never-returns";
    /// A void call used as a value.
    VOID_VALUE = "E0407" "void-value";
    /// The name of a texture option that is not a literal.
    OPEN_OPTION = "E0408" "open-option";
    /// `break` or `continue` outside a loop.
    OUTSIDE_LOOP = "E0501" "outside-loop";
    /// `return` with a value in a function without a result, or without a value in any other.
    BAD_RETURN = "E0502" "bad-return";
    /// A shader parameter without default.
    NO_DEFAULT = "E0503" "no-default";
    /// A function's formal with a default.
    FORMAL_DEFAULT = "E0504" "formal-default";
    /// A parameter type that shaders cannot have.
    BAD_PARAMETER = "E0505" "bad-parameter";
    /// Metadata that is not a constant of its type.
    BAD_METADATA = "E0506" "bad-metadata";
    /// A call that several overloads match equally well.
    AMBIGUOUS = "W0201" "ambiguous-call";
    /// A float stored in an int.
    PRECISION = "W0202" "lossy-conversion";
    /// A write to a global or argument that is read-only by rule.
    WRITES_READ_ONLY = "W0203" "writes-read-only";
    /// A function with the same signature as another.
    REDEFINED = "W0204" "redefined";
    /// A parameter that has the name of a function.
    HIDES_FUNCTION = "W0206" "hides-function";
    /// An output of a built-in that would need a conversion and is lost.
    OUTPUT_LOST = "W0207" "output-lost";
    /// A format string that is not a literal.
    OPEN_FORMAT = "W0208" "open-format";
    /// An unknown texture option, or a value of the wrong type for it.
    UNKNOWN_OPTION = "W0209" "unknown-option";
    /// A string among the numbers of an array initialiser, or the reverse.
    ELEMENT_IGNORED = "W0210" "element-ignored";
    /// `++` or `--` on a string.
    IDLE_STEP = "W0211" "idle-step";
    /// A struct with a field of its own type.
    HOLDS_ITSELF = "W0212" "holds-itself";
    /// A constant index that no element has.
    OUT_OF_RANGE = "W0213" "index-out-of-range";
    /// A division by a literal zero.
    DIVISION_BY_ZERO = "W0214" "division-by-zero";
}

/// E0201: the name is not declared here.
pub(super) fn unknown_name(span: Span, what: &str, name: &str, close: Option<&str>) -> Diagnostic {
    let d = Diagnostic::error(UNKNOWN_NAME, span, format!("{what} `{name}` is not declared"))
        .label("not found in this scope");
    match close {
        Some(close) => d
            .help(format!("there is one named `{close}`"))
            .suggest(format!("write `{close}`"), vec![Edit { span, text: close.to_string() }]),
        None => d,
    }
}

/// What a function hears that calls itself.
pub(super) const NO_RECURSION: &str = "OSL has no recursion, because calls are inlined: write a loop";

/// E0201: a value is assigned to a name that was never declared; `ty` is the type of the value, if a
/// declaration can name it.
pub(super) fn undeclared(span: Span, name: &str, ty: Option<&str>) -> Diagnostic {
    let d = Diagnostic::error(UNKNOWN_NAME, span, format!("variable `{name}` is not declared"))
        .label("not found in this scope")
        .help("a variable is declared, with its type, where it gets its first value");
    let Some(ty) = ty else { return d };
    let before = Span::new(span.start, span.start);
    d.suggest(format!("declare it: `{ty} {name}`"), vec![Edit { span: before, text: format!("{ty} ") }])
}

/// E0201: a statement of one word that resembles a keyword.
pub(super) fn misspelt_jump(span: Span, name: &str, word: &str) -> Diagnostic {
    Diagnostic::error(UNKNOWN_NAME, span, format!("variable `{name}` is not declared"))
        .label("not found in this scope")
        .help(format!("OSL has the keyword `{word}`"))
        .fix(format!("write `{word}`"), vec![Edit { span, text: word.to_string() }])
}

/// E0201: a word of another language; `close` is the end of the call's arguments, if it is a call with
/// arguments.
pub(super) fn foreign_name(span: Span, what: &str, name: &str, word: Word, close: Option<u32>) -> Diagnostic {
    let d = Diagnostic::error(UNKNOWN_NAME, span, format!("{what} `{name}` is not declared"))
        .label("not found in this scope")
        .help(word.advice);
    let Some(instead) = word.instead else { return d };
    let mut edits = vec![Edit { span, text: instead.to_string() }];
    match (word.behind, close) {
        (Some(behind), Some(at)) => edits.push(Edit { span: Span::new(at, at), text: behind.to_string() }),
        (Some(_), None) => return d,
        (None, _) => {}
    }
    d.fix(format!("write `{instead}`"), edits)
}

/// E0201: a variable used in its own initialiser.
pub(super) fn own_value(span: Span, name: &str) -> Diagnostic {
    Diagnostic::error(UNKNOWN_NAME, span, format!("`{name}` has no value yet"))
        .label("it is declared by this very statement")
        .help("declare it first, or write another name here")
}

/// E0310: an array of structs that hold arrays.
pub(super) fn nested_arrays(span: Span) -> Diagnostic {
    Diagnostic::error(BAD_STRUCT, span, "arrays do not nest, through structs either")
}

/// E0312: an argument that a function changes through a formal that is no output. `written` is what the
/// argument is.
pub(super) fn written_argument(span: Span, written: &str, formal: &str, declared: Span) -> Diagnostic {
    Diagnostic::error(
        READ_ONLY,
        span,
        format!("{written} cannot be changed by the function that it is passed to"),
    )
    .label(format!("the function assigns `{formal}`"))
    .also(declared, "this formal")
    .note("arguments are passed by reference: the caller's variable changes too")
    .help("copy it into a local variable and pass that, or assign to a local variable in the function")
}

/// The word that a misspelt type probably means.
#[derive(Clone, Copy, Debug)]
pub(super) enum CloseType<'a> {
    /// A type of the language.
    Own(&'a str),
    /// A keyword.
    Keyword(&'a str),
    /// A struct.
    Struct(&'a str),
}

/// E0203: no struct with this name is declared.
pub(super) fn unknown_type(
    span: Span,
    name: &str,
    word: Option<Word>,
    close: Option<CloseType<'_>>,
) -> Diagnostic {
    let d = Diagnostic::error(UNKNOWN_TYPE, span, format!("there is no type `{name}`"));
    let edit = |text: &str| vec![Edit { span, text: text.to_string() }];
    if let Some(word) = word {
        let d = d.help(word.advice);
        return match word.instead {
            // The space behind the word goes with it.
            Some("") => {
                let edit = Edit { span: Span::new(span.start, span.end + 1), text: String::new() };
                d.suggest("leave it out", vec![edit])
            }
            Some(instead) => d.fix(format!("write `{instead}`"), edit(instead)),
            None => d,
        };
    }
    match close {
        Some(CloseType::Own(close)) => {
            d.help(format!("there is one named `{close}`")).fix(format!("write `{close}`"), edit(close))
        }
        Some(CloseType::Struct(close)) => {
            d.help(format!("there is one named `{close}`")).suggest(format!("write `{close}`"), edit(close))
        }
        Some(CloseType::Keyword(close)) => {
            d.help(format!("OSL has the keyword `{close}`")).fix(format!("write `{close}`"), edit(close))
        }
        None => d,
    }
}

/// E0202: the scope already has the name.
pub(super) fn redeclared(span: Span, name: &str, earlier: Option<Span>) -> Diagnostic {
    let d = Diagnostic::error(REDECLARED, span, format!("`{name}` is already declared in this scope"))
        .label("again");
    match earlier {
        Some(earlier) if earlier != Span::default() => d.also(earlier, "first declared here"),
        _ => match about_global(name) {
            Some(about) => d.note(format!("`{name}` is a global variable of every shader: {about}")),
            None => d.note(format!("`{name}` is a built-in function")),
        }
        .help("take another name"),
    }
}

/// The meaning of a global variable of shaders.
fn about_global(name: &str) -> Option<&'static str> {
    Some(match name {
        "P" => "the shaded point",
        "I" => "the direction from the eye to the shaded point",
        "N" => "the normal of the surface, for shading",
        "Ng" => "the normal of the geometry",
        "u" => "the first coordinate on the surface",
        "v" => "the second coordinate on the surface",
        "dPdu" => "how `P` changes with `u`",
        "dPdv" => "how `P` changes with `v`",
        "Ps" => "the point on a light",
        "time" => "the time of the shaded point",
        "dtime" => "the length of the time that is shaded",
        "dPdtime" => "how `P` changes with time",
        "Ci" => "the closure that a surface returns",
        _ => return None,
    })
}

/// E0208: the name has the maximum number of functions.
pub(super) fn too_many_overloads(span: Span, name: &str, limit: u64) -> Diagnostic {
    Diagnostic::error(TOO_MANY_OVERLOADS, span, format!("more than {limit} functions `{name}` in one scope"))
        .help("give some of them names of their own")
}

/// E0302: the value's type does not fit.
pub(super) fn not_assignable(span: Span, to: &str, from: &str) -> Diagnostic {
    Diagnostic::error(NOT_ASSIGNABLE, span, format!("cannot make {to} from {from}"))
        .label(format!("this is {from}"))
}

/// E0405: more or fewer arguments than conversions.
pub(super) fn format_count(
    call: Span,
    format: Span,
    wanted: usize,
    given: usize,
    extra: Option<Span>,
) -> Diagnostic {
    let conversions = count(wanted, "conversion");
    let message = format!("{conversions} in the format, but {}", count(given, "argument"));
    match extra {
        Some(extra) => Diagnostic::error(BAD_FORMAT, extra, message)
            .label("printed by no conversion")
            .also(format, conversions)
            .help("one conversion prints one argument; `%%` prints a percent sign"),
        None => Diagnostic::error(BAD_FORMAT, format, message)
            .label("some conversions have no argument")
            .also(call, "in this call")
            .help("one conversion prints one argument whole, a triple or an array too"),
    }
}

/// E0405: a conversion for another type.
pub(super) fn format_letter(value: Span, conversion: &str, ty: &str, format: Span) -> Diagnostic {
    Diagnostic::error(BAD_FORMAT, value, format!("`{conversion}` does not print {ty}"))
        .label(format!("this is {ty}"))
        .also(format, "the format")
}

/// E0405: an argument that no conversion can print.
pub(super) fn unprintable(value: Span, ty: &str) -> Diagnostic {
    Diagnostic::error(BAD_FORMAT, value, format!("{ty} cannot be printed"))
        .help("print its fields one by one")
}

/// W0208: the format is known only at run time.
pub(super) fn open_format(format: Span, function: &str) -> Diagnostic {
    Diagnostic::warning(OPEN_FORMAT, format, format!("the format of `{function}` is no literal"))
        .label("cannot be checked against the arguments")
        .help("write the format here, and print changing text with `%s`")
}

/// E0408: the name of an option is known only at run time.
pub(super) fn open_option(name: Span, function: &str) -> Diagnostic {
    Diagnostic::error(OPEN_OPTION, name, format!("the name of an option of `{function}` is no literal"))
        .label("not a string literal")
        .help("write the option's name here; only its value may change")
}

/// W0209: the option does not exist.
pub(super) fn unknown_option(name: Span, option: &str) -> Diagnostic {
    Diagnostic::warning(UNKNOWN_OPTION, name, format!("there is no texture option `{option}`"))
        .label("ignored, with an error when the shader runs")
}

/// W0209: an option with a value of another type.
pub(super) fn option_type(value: Span, option: &str, wanted: &str, given: &str) -> Diagnostic {
    Diagnostic::warning(UNKNOWN_OPTION, value, format!("the option `{option}` takes {wanted}, not {given}"))
        .label("ignored, with an error when the shader runs")
}

/// E0506: a value that is not a constant.
pub(super) fn open_metadata(value: Span) -> Diagnostic {
    Diagnostic::error(BAD_METADATA, value, "the value of metadata is not a constant")
        .label("not a literal, nor made of literals")
        .help("metadata is read without running the shader: write its value out")
}

/// E0506: a constant of another type.
pub(super) fn metadata_type(value: Span, ty: &str) -> Diagnostic {
    Diagnostic::error(BAD_METADATA, value, format!("this metadata value is not {ty}"))
        .label("of another type")
        .help("the type before the name says what the value is")
}

/// W0210: an element that its array cannot hold.
pub(super) fn element_ignored(value: Span, element: &str, given: &str) -> Diagnostic {
    Diagnostic::warning(ELEMENT_IGNORED, value, format!("{given} among the elements of {element} array"))
        .label("the element starts as zero, or empty, instead")
}

/// W0211: `++` or `--` on a type without a next value.
pub(super) fn idle_step(span: Span, ty: &str) -> Diagnostic {
    Diagnostic::warning(IDLE_STEP, span, format!("a {ty} has no next value")).label("does nothing")
}

/// W0212: a field that would make its struct infinitely large.
pub(super) fn holds_itself(field: Span, name: &str) -> Diagnostic {
    Diagnostic::warning(HOLDS_ITSELF, field, format!("struct `{name}` cannot hold itself"))
        .label("left out: the struct would have no end")
}

/// W0213: a constant index that no element has.
pub(super) fn out_of_range(index: Span, n: u32) -> Diagnostic {
    Diagnostic::warning(OUT_OF_RANGE, index, format!("the last index is {}", n.saturating_sub(1)))
        .label("out of range: the nearest element is taken, with an error when the shader runs")
}

/// W0214: a divisor that is zero.
pub(super) fn division_by_zero(divisor: Span) -> Diagnostic {
    Diagnostic::warning(DIVISION_BY_ZERO, divisor, "a division by zero").label("gives 0, whatever is divided")
}

/// E0402: overloads that would give one list different types.
pub(super) fn ambiguous_list(call: Span, list: Span, name: &str, a: &str, b: &str) -> Diagnostic {
    Diagnostic::error(AMBIGUOUS_STRUCTS, call, format!("`{name}` fits in more than one way"))
        .also(list, format!("could become {a} or {b}"))
        .help("write a constructor instead of the list, or pass a variable of the type that is meant")
}

/// The edit that writes `(int)` before a value.
pub(super) fn cast_to_int(value: Span, is_operand: bool) -> Vec<Edit> {
    let before = Edit { span: Span::new(value.start, value.start), text: "(int)".to_string() };
    if is_operand {
        return vec![before];
    }
    let open = Edit { text: "(int)(".to_string(), ..before };
    vec![open, Edit { span: Span::new(value.end, value.end), text: ")".to_string() }]
}

/// `no value`, `1 value`, `2 values`.
pub(super) fn count(n: usize, noun: &str) -> String {
    match n {
        0 => format!("no {noun}"),
        1 => format!("1 {noun}"),
        _ => format!("{n} {noun}s"),
    }
}
