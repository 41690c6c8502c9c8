//! Strings, and numbers made from anything by hashing.

use super::{Builtin, Emitted, Site};
use osl_ir::ir::{Builder, Kernel, Kind};
use osl_ir::text::TextFn;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "concat",
        &["s(s,s)", "s(s,s,s)", "s(s,s,s,s)", "s(s,s,s,s,s)", "s(s,s,s,s,s,s)"],
        "s1, s2, s3, s4, s5, s6",
        |b, s| text(b, s, TextFn::Concat),
        "Joins two to six strings.",
    )
    .derivatives("none: the result is a string")
    .extremes("Empty strings add nothing.")
    .example("string s = concat(\"one\", \" \", \"two\");"),
    Builtin::compose(
        "strlen",
        &["i(s)"],
        "s",
        |b, s| text(b, s, TextFn::Length),
        "Returns the length of `s` in bytes.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Bytes are counted, not characters: a letter outside ASCII counts more than once. The empty \
         string gives 0.",
    )
    .example("int n = strlen(\"hello\");"),
    Builtin::compose(
        "substr",
        &["s(s,i,i)", "s(s,i)"],
        "s, start, length",
        substr,
        "Returns `length` bytes of `s` from position `start`, or without `length` the rest of the \
         string. A negative `start` counts from the end.",
    )
    .derivatives("none: the result is a string")
    .extremes(
        "A `start` beyond an end of the string is clamped to that end. A negative `length` counts as \
         0, and a `length` beyond the end stops at the end. The empty string gives the empty string.",
    )
    .example("string s = substr(\"hello\", 1, 3); string tail = substr(\"hello\", -3);"),
    Builtin::compose(
        "getchar",
        &["i(s,i)"],
        "s, n",
        |b, s| text(b, s, TextFn::Character),
        "Returns the byte of `s` at position `n`, as a signed number.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "A position below 0, or from the length of the string on, gives 0. Bytes from 128 on are \
         negative.",
    )
    .example("int c = getchar(\"hello\", 1);"),
    Builtin::compose(
        "startswith",
        &["i(s,s)"],
        "s, prefix",
        |b, s| text(b, s, TextFn::StartsWith),
        "Returns 1 if `s` starts with `prefix`, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("Every string starts with the empty string.")
    .example("int yes = startswith(\"hello\", \"he\");"),
    Builtin::compose(
        "endswith",
        &["i(s,s)"],
        "s, suffix",
        |b, s| text(b, s, TextFn::EndsWith),
        "Returns 1 if `s` ends with `suffix`, else 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("Every string ends with the empty string.")
    .example("int yes = endswith(\"hello\", \"lo\");"),
    Builtin::compose(
        "stoi",
        &["i(s)"],
        "str",
        |b, s| text(b, s, TextFn::ToInt),
        "Returns the decimal int at the start of `str`, or 0 if there is none.",
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
        "Returns the float at the start of `str`, or 0 if there is none.",
    )
    .derivatives("zero")
    .extremes(
        "White space before the number and any text after it are ignored. The words inf and nan are \
         read. A number out of range gives inf or 0.",
    )
    .example("float x = stof(\"1.5e3\");"),
    Builtin::compose(
        "hash",
        &["i(i i)", "i(f x)", "i(f x,f y)", "i(p p)", "i(p p,f y)", "i(s s)"],
        "",
        hash,
        "Returns an int that looks random. Arguments with the same bits give the same int.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "The bits count: 0.0 and -0.0 give different results. Every nan counts as the same number. \
         Every number and every string has a result.",
    )
    .example("int seed = hash(\"wood\"); int h = hash(P);"),
    Builtin::compose(
        "split",
        &["i(s,os[],s,i)", "i(s,os[],s)", "i(s,os[])"],
        "str, results, sep, maxsplit",
        split,
        "Splits `str` at every `sep` (default: white space) and returns the number of pieces. The \
         pieces are stored in `results`; there are at most `maxsplit`.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "The empty string, and a `maxsplit` of 0 or less, give 0 pieces. If there is no room for more \
         pieces, the last piece is the unsplit rest of the string. Elements after the pieces are not \
         changed. Between two separators there may be an empty piece; between two blanks, if the \
         separator is white space, there is none.",
    )
    .example("string parts[3]; int n = split(\"a/b/c\", parts, \"/\");"),
    Builtin::compose(
        "regex_search",
        &["i(s,s)", "i(s,oi[],s)"],
        "subject, results, regex | subject, regex",
        |b, s| regex(b, s, false),
        "Returns 1 if the pattern `regex` is found in `subject`, else 0. `results` receives the begin \
         and the end of each group.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Without a match, every element of `results` is the length of the pattern; so are the \
         elements of groups that are not part of the match. A pattern that cannot be read is a \
         run-time error and matches nothing. Pattern and subject are bytes: a character beyond ASCII is \
         two to four of them, and is in none of `\\w`, `\\d` and `\\s`.",
    )
    .example("int at[2]; int found = regex_search(\"wood07\", at, \"[0-9]+\");"),
    Builtin::compose(
        "regex_match",
        &["i(s,s)", "i(s,oi[],s)"],
        "subject, results, regex | subject, regex",
        |b, s| regex(b, s, true),
        "Returns 1 if the pattern `regex` matches the whole of `subject`, else 0. `results` receives \
         the begin and the end of each group.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "Without a match, every element of `results` is the length of the pattern; so are the \
         elements of groups that are not part of the match. A pattern that cannot be read is a \
         run-time error and matches nothing. Pattern and subject are bytes: a character beyond ASCII is \
         two to four of them, and is in none of `\\w`, `\\d` and `\\s`.",
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
