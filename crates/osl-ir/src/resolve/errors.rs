//! Codes and messages of resolution: names E02xx, types E03xx, calls E04xx, statements E05xx; warnings W02xx on.

use osl_syntax::diagnostic::{Code, Diagnostic};
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
    /// Operands that the operator does not take.
    BAD_OPERANDS = "E0301" "bad-operands";
    /// A value that cannot be assigned to its destination.
    NOT_ASSIGNABLE = "E0302" "not-assignable";
    /// A conversion that does not exist.
    BAD_CAST = "E0303" "bad-cast";
    /// Constructor arguments that make no value of the type.
    BAD_CONSTRUCTOR = "E0304" "bad-constructor";
    /// An initialiser list where none may stand, or of the wrong length.
    BAD_LIST = "E0305" "bad-initializer-list";
    /// A condition without truth value.
    BAD_CONDITION = "E0306" "bad-condition";
    /// `?:` branches of types that have no common type.
    BAD_TERNARY = "E0307" "bad-ternary";
    /// `[ ]` on a type without elements, or with an index that is no int.
    BAD_INDEX = "E0308" "bad-index";
    /// An array length that is no positive int literal.
    BAD_ARRAY_LENGTH = "E0309" "bad-array-length";
    /// A struct that cannot be declared so.
    BAD_STRUCT = "E0310" "bad-struct";
    /// Something that cannot be assigned to. The parser refuses these first; other makers of trees may not.
    NOT_AN_LVALUE = "E0311" "not-an-lvalue";
    /// A write to a parameter that is not an output, or to a constant.
    READ_ONLY = "E0312" "read-only";
    /// No overload takes the arguments.
    NO_OVERLOAD = "E0401" "no-overload";
    /// Overloads that differ only in what a list would become.
    AMBIGUOUS_STRUCTS = "E0402" "ambiguous-structs";
    /// A function that was declared but has no body yet.
    NO_BODY = "E0403" "no-body";
    /// An output argument of another type.
    OUTPUT_TYPE = "E0404" "output-type";
    /// A function with a value of which no statement returns one.
    NEVER_RETURNS = "E0406" "never-returns";
    /// A void call used as a value.
    VOID_VALUE = "E0407" "void-value";
    /// `break` or `continue` outside of a loop.
    OUTSIDE_LOOP = "E0501" "outside-loop";
    /// `return` with a value where there is none, or without one.
    BAD_RETURN = "E0502" "bad-return";
    /// A shader parameter without default.
    NO_DEFAULT = "E0503" "no-default";
    /// A function's formal with a default.
    FORMAL_DEFAULT = "E0504" "formal-default";
    /// A parameter type that shaders cannot have.
    BAD_PARAMETER = "E0505" "bad-parameter";
    /// A call that several overloads fit equally well.
    AMBIGUOUS = "W0201" "ambiguous-call";
    /// A float stored in an int.
    PRECISION = "W0202" "lossy-conversion";
    /// A write to a global or argument that is read-only by rule.
    WRITES_READ_ONLY = "W0203" "writes-read-only";
    /// A function with the signature of another.
    REDEFINED = "W0204" "redefined";
    /// A parameter that has the name of a function.
    HIDES_FUNCTION = "W0206" "hides-function";
    /// An output of a built-in that would need a conversion and is lost.
    OUTPUT_LOST = "W0207" "output-lost";
}

/// E0201: nothing of this name is declared here.
pub(super) fn unknown_name(span: Span, what: &str, name: &str, close: Option<&str>) -> Diagnostic {
    let d = Diagnostic::error(UNKNOWN_NAME, span, format!("{what} `{name}` is not declared"))
        .label("not found in this scope");
    match close {
        Some(close) => d.help(format!("there is one named `{close}`")).fix(
            format!("write `{close}`"),
            vec![osl_syntax::diagnostic::Edit { span, text: close.to_string() }],
        ),
        None => d,
    }
}

/// E0202: the scope already has the name.
pub(super) fn redeclared(span: Span, name: &str, earlier: Option<Span>) -> Diagnostic {
    let d = Diagnostic::error(REDECLARED, span, format!("`{name}` is already declared in this scope"))
        .label("again");
    match earlier {
        Some(earlier) if earlier != Span::default() => d.also(earlier, "first declared here"),
        _ => d.note(format!("`{name}` is a name of the language itself")),
    }
}

/// E0302: the value's type does not fit.
pub(super) fn not_assignable(span: Span, to: &str, from: &str) -> Diagnostic {
    Diagnostic::error(NOT_ASSIGNABLE, span, format!("cannot make a {to} from a {from}"))
        .label(format!("this is a {from}"))
}

/// The closest of `names` to `name`, if it is close enough to suggest.
pub(super) fn closest<'n>(name: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let lower = name.to_lowercase();
    names
        .into_iter()
        .filter(|candidate| *candidate != name)
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, candidate)| *distance <= 1 + name.len().min(candidate.len()) / 4)
        .min()
        .map(|(_, candidate)| candidate)
}
