//! Strings: the functions of the language on strings, one point at a time.
//!
//! Folding and running share them. Strings are UTF-8 here, and offsets count bytes; a cut inside a character
//! leaves a replacement character. Sources: OSL language specification, chapters on strings and on printing.

mod ecmascript;
mod format;
mod hash;
mod number;
mod regex;

pub use format::{Flavour, Value, format};
pub use hash::hash;
pub use regex::{Groups, Pattern};

use crate::ir::Const;
pub use crate::ir::TextFn;
use std::sync::Arc;

impl TextFn {
    /// The result for arguments of the right kinds; 0 or empty for others. A result of more than `most` bytes
    /// is cut.
    pub fn eval(self, args: &[Const], most: u64) -> Const {
        let text = |at: usize| match args.get(at) {
            Some(Const::Str(s)) => &**s,
            _ => "",
        };
        let int = |at: usize| match args.get(at) {
            Some(Const::Int(n)) => *n,
            _ => 0,
        };
        let s = text(0);
        match self {
            TextFn::Concat => Const::Str(concat((0..args.len()).map(text), most)),
            TextFn::Length => Const::Int(s.len() as i32),
            TextFn::Substring => Const::Str(substring(s, int(1), int(2))),
            TextFn::Character => {
                let byte = usize::try_from(int(1)).ok().and_then(|i| s.as_bytes().get(i).copied());
                Const::Int(byte.map_or(0, |b| i32::from(b as i8)))
            }
            TextFn::StartsWith => Const::Int(s.starts_with(text(1)).into()),
            TextFn::EndsWith => Const::Int(s.ends_with(text(1)).into()),
            TextFn::ToInt => Const::Int(number::int(s)),
            TextFn::ToFloat => Const::Float(number::float(s)),
            TextFn::Hash => Const::Int(hash(s) as u32 as i32),
        }
    }
}

fn concat<'a>(parts: impl Iterator<Item = &'a str>, most: u64) -> Arc<str> {
    let mut out = String::new();
    for part in parts {
        if (out.len() + part.len()) as u64 > most {
            break;
        }
        out.push_str(part);
    }
    out.into()
}

/// `len` bytes from `start` on; a negative start counts from the end.
fn substring(s: &str, start: i32, len: i32) -> Arc<str> {
    let n = s.len() as i64;
    let start = i64::from(start);
    let start = (if start < 0 { start + n } else { start }).clamp(0, n);
    let len = i64::from(len).clamp(0, n - start);
    let bytes = s.as_bytes().get(start as usize..(start + len) as usize).unwrap_or(&[]);
    String::from_utf8_lossy(bytes).into()
}

/// The pieces of a string between separators, at most `most`; the last piece has the unsplit rest. An empty
/// separator stands for runs of white space, which are dropped at both ends.
pub fn split<'a>(s: &'a str, separator: &str, most: usize) -> Vec<&'a str> {
    if s.is_empty() || most == 0 {
        return Vec::new();
    }
    if !separator.is_empty() {
        return s.splitn(most, separator).collect();
    }
    let mut pieces = Vec::new();
    let mut rest = s.trim();
    while !rest.is_empty() {
        if pieces.len() + 1 == most {
            pieces.push(rest);
            break;
        }
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (piece, behind) = rest.split_at(end);
        pieces.push(piece);
        rest = behind.trim_start();
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn substrings_count_from_either_end() {
        assert_eq!(&*substring("hello", 1, 3), "ell");
        assert_eq!(&*substring("hello", -3, 2), "ll");
        assert_eq!(&*substring("hello", -9, 2), "he");
        assert_eq!(&*substring("hello", 9, 2), "");
        assert_eq!(&*substring("hello", 3, i32::MAX), "lo");
        assert_eq!(&*substring("", i32::MIN, i32::MIN), "");
    }

    #[test]
    fn splitting() {
        assert_eq!(split("a,b,,c", ",", 9), ["a", "b", "", "c"]);
        assert_eq!(split("a,b,c", ",", 2), ["a", "b,c"]);
        assert_eq!(split("  a  b c ", "", 9), ["a", "b", "c"]);
        assert_eq!(split("a b  c ", "", 2), ["a", "b  c"]);
        assert!(split("a", ",", 0).is_empty() && split("", ",", 5).is_empty());
    }
}
