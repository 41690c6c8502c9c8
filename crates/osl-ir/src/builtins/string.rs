//! Strings, and numbers made from anything by hashing.

use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Kernel, Kind};
use crate::text::TextFn;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "concat",
        &["s(s,s)", "s(s,s,s)", "s(s,s,s,s)", "s(s,s,s,s,s)", "s(s,s,s,s,s,s)"],
        |b, s| text(b, s, TextFn::Concat),
        "Two to six strings joined.",
    ),
    Builtin::compose("strlen", &["i(s)"], |b, s| text(b, s, TextFn::Length), "Length in bytes."),
    Builtin::compose(
        "substr",
        &["s(s,i,i)", "s(s,i)"],
        substr,
        "Bytes of a string from a start, counted from the end where negative, of a length, or all of the rest.",
    ),
    Builtin::compose(
        "getchar",
        &["i(s,i)"],
        |b, s| text(b, s, TextFn::Character),
        "The byte at an offset as a signed number; 0 outside the string.",
    ),
    Builtin::compose(
        "startswith",
        &["i(s,s)"],
        |b, s| text(b, s, TextFn::StartsWith),
        "Whether a string starts with another.",
    ),
    Builtin::compose(
        "endswith",
        &["i(s,s)"],
        |b, s| text(b, s, TextFn::EndsWith),
        "Whether a string ends with another.",
    ),
    Builtin::compose(
        "stoi",
        &["i(s)"],
        |b, s| text(b, s, TextFn::ToInt),
        "The decimal int at the start of a string; 0 without one.",
    ),
    Builtin::compose(
        "stof",
        &["f(s)"],
        |b, s| text(b, s, TextFn::ToFloat),
        "The float at the start of a string; 0 without one.",
    ),
    Builtin::compose(
        "hash",
        &["i(i)", "i(f)", "i(f,f)", "i(p)", "i(p,f)", "i(s)"],
        hash,
        "A number that looks random, the same for the same bits.",
    ),
    Builtin::compose(
        "split",
        &["i(s,os[],s,i)", "i(s,os[],s)", "i(s,os[])"],
        split,
        "Cuts a string at separators (default: white space) into an array; the number of pieces.",
    ),
    Builtin::compose(
        "regex_search",
        &["i(s,s)", "i(s,oi[],s)"],
        |b, s| regex(b, s, false),
        "Whether a pattern is found in a string; begin and end of each group in an array.",
    ),
    Builtin::compose(
        "regex_match",
        &["i(s,s)", "i(s,oi[],s)"],
        |b, s| regex(b, s, true),
        "Whether a pattern is the whole of a string; begin and end of each group in an array.",
    ),
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
        None => b.constant(crate::ir::Const::Str("".into())),
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
