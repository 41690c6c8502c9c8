//! Strings, and numbers made from anything by hashing.

use super::{Builtin, Composed, Emitted, Site};
use osl_ir::ir::{Builder, Kernel, Kind};
use osl_ir::text::TextFn;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "concat",
        &["s(s,s)", "s(s,s,s)", "s(s,s,s,s)", "s(s,s,s,s,s)", "s(s,s,s,s,s,s)"],
        "s1, s2, s3, s4, s5, s6",
        |b, s| text(b, s, TextFn::Concat),
        "Two to six strings joined.",
    )
    .composed(Composed::Concat)
    .derivatives("none: the result is a string")
    .extremes("Empty strings add nothing.")
    .example("string s = concat(\"one\", \" \", \"two\");"),
    Builtin::compose("strlen", &["i(s)"], "s", |b, s| text(b, s, TextFn::Length), "Length in bytes.")
        .derivatives("none: the result is an int")
        .extremes(
            "Bytes, not characters: a letter outside ASCII counts more than once. 0 for the empty string.",
        )
        .example("int n = strlen(\"hello\");"),
    Builtin::compose(
        "substr",
        &["s(s,i,i)", "s(s,i)"],
        "s, start, length",
        substr,
        "Bytes of a string from a start, counted from the end where negative, of a length, or all of the \
         rest.",
    )
    .composed(Composed::Substr)
    .derivatives("none: the result is a string")
    .extremes(
        "A start beyond either end is clamped to it; a length below 0 is 0, and one beyond the end \
               stops there. The empty string gives itself.",
    )
    .example("string s = substr(\"hello\", 1, 3); string tail = substr(\"hello\", -3);"),
    Builtin::compose(
        "getchar",
        &["i(s,i)"],
        "s, n",
        |b, s| text(b, s, TextFn::Character),
        "The byte at an offset as a signed number; 0 outside the string.",
    )
    .derivatives("none: the result is an int")
    .extremes("0 for an index below 0 or from the length on. Bytes from 128 on are negative.")
    .example("int c = getchar(\"hello\", 1);"),
    Builtin::compose(
        "startswith",
        &["i(s,s)"],
        "s, prefix",
        |b, s| text(b, s, TextFn::StartsWith),
        "Whether a string starts with another.",
    )
    .derivatives("none: the result is an int")
    .extremes("Every string starts with the empty one.")
    .example("int yes = startswith(\"hello\", \"he\");"),
    Builtin::compose(
        "endswith",
        &["i(s,s)"],
        "s, suffix",
        |b, s| text(b, s, TextFn::EndsWith),
        "Whether a string ends with another.",
    )
    .derivatives("none: the result is an int")
    .extremes("Every string ends with the empty one.")
    .example("int yes = endswith(\"hello\", \"lo\");"),
    Builtin::compose(
        "stoi",
        &["i(s)"],
        "str",
        |b, s| text(b, s, TextFn::ToInt),
        "The decimal int at the start of a string; 0 without one.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "White space before the number and any text after it are ignored. A number out of range gives the \
         nearest int, 2147483647 or -2147483648. Hexadecimal numbers are not read: 0x10 gives 0.",
    )
    .example("int n = stoi(\"42 apples\");"),
    Builtin::compose(
        "stof",
        &["f(s)"],
        "str",
        |b, s| text(b, s, TextFn::ToFloat),
        "The float at the start of a string; 0 without one.",
    )
    .derivatives("zero")
    .extremes(
        "White space before the number and any text after it are ignored. Reads inf and nan; a number \
         out of range gives inf or 0.",
    )
    .example("float x = stof(\"1.5e3\");"),
    Builtin::compose(
        "hash",
        &["i(i i)", "i(f x)", "i(f x,f y)", "i(p p)", "i(p p,f y)", "i(s s)"],
        "",
        hash,
        "A number that looks random, the same for the same bits.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Bits count: 0.0 and -0.0 differ; every nan counts as one. Defined for every number and \
               string.",
    )
    .example("int seed = hash(\"wood\"); int h = hash(P);"),
    Builtin::compose(
        "split",
        &["i(s,os[],s,i)", "i(s,os[],s)", "i(s,os[])"],
        "str, results, sep, maxsplit",
        split,
        "Cuts a string at separators (default: white space) into an array; the number of pieces.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "The empty string and a limit of 0 or less give 0 pieces. A full array keeps the unsplit rest \
               in its last element; elements after the pieces are not changed. Empty pieces count with a separator, \
               not with white space.",
    )
    .example("string parts[3]; int n = split(\"a/b/c\", parts, \"/\");"),
    Builtin::compose(
        "regex_search",
        &["i(s,s)", "i(s,oi[],s)"],
        "subject, results, regex | subject, regex",
        |b, s| regex(b, s, false),
        "Whether a pattern is found in a string; begin and end of each group in an array.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Without a match the array is filled with the length of the pattern, and so are the groups \
               that took no part. A pattern that cannot be read is an error of the run and matches \
               nothing.",
    )
    .example("int at[2]; int found = regex_search(\"wood07\", at, \"[0-9]+\");"),
    Builtin::compose(
        "regex_match",
        &["i(s,s)", "i(s,oi[],s)"],
        "subject, results, regex | subject, regex",
        |b, s| regex(b, s, true),
        "Whether a pattern is the whole of a string; begin and end of each group in an array.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Without a match the array is filled with the length of the pattern, and so are the groups \
               that took no part. A pattern that cannot be read is an error of the run and matches \
               nothing.",
    )
    .example("int all = regex_match(\"wood07\", \"[a-z]+[0-9]+\");"),
];

fn text(b: &mut Builder, s: &Site<'_>, function: TextFn) -> Emitted {
    b.kernel(Kernel::Text(function), s.args, function.result()).into()
}

fn substr(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.args.len() == 3 {
        return text(b, s, TextFn::Substring);
    }
    let all = b.int(i32::MAX);
    b.kernel(Kernel::Text(TextFn::Substring), &[s.arg(0), s.arg(1), all], Kind::Str).into()
}

fn hash(b: &mut Builder, s: &Site<'_>) -> Emitted {
    match b.body.kind(s.arg(0)) {
        Kind::Str => text(b, s, TextFn::Hash),
        _ => b.kernel(Kernel::Hash, s.args, Kind::Int).into(),
    }
}

fn split(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let Some(pieces) = s.array(1) else { return Emitted::default() };
    let separator = match s.args.get(2) {
        Some(separator) => *separator,
        None => b.constant(osl_ir::ir::Const::Str("".into())),
    };
    let most = match s.args.get(3) {
        Some(most) => *most,
        None => b.int(pieces.len as i32),
    };
    b.kernel(Kernel::Split { pieces: pieces.slot }, &[s.arg(0), separator, most], Kind::Int).into()
}

fn regex(b: &mut Builder, s: &Site<'_>, whole: bool) -> Emitted {
    let places = s.array(1).map(|a| a.slot);
    let pattern = s.arg(s.args.len().saturating_sub(1));
    b.kernel(Kernel::Regex { whole, places }, &[s.arg(0), pattern], Kind::Int).into()
}
