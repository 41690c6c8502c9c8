//! Translates regular expressions of the ECMAScript grammar, as `std::regex` of C++ reads them, to those of
//! `fancy-regex`. It knows nothing of searching.
//!
//! Both grammars agree on groups, repetition, anchors and the usual classes. They differ in what this module
//! writes anew: in ECMAScript a backslash before any other letter means nothing, `.` matches neither a
//! newline nor a carriage return, a class may be empty, and within a class `[`, `&` and `~` are themselves.
//! A pattern that C++ refuses may work here.

use std::fmt::Write;

/// Letters that mean something after a backslash in both grammars.
const ESCAPES: &[u8] = b"bBdDsSwWfnrtvxu";

/// A pattern for `fancy-regex` in its mode for bytes. A character beyond ASCII becomes the bytes of its UTF-8
/// form, each a character of its own.
pub(super) fn translated(pattern: &str) -> String {
    let mut text = String::with_capacity(pattern.len());
    let mut rest = pattern.as_bytes();
    let mut in_class = false;
    while let [byte, after @ ..] = rest {
        rest = after;
        match (byte, after) {
            (b'\\', [escaped, after @ ..]) => rest = escape(&mut text, *escaped, after),
            (b'[', [b'^', b']', after @ ..]) if !in_class => {
                text.push_str("[\\x00-\\xFF]");
                rest = after;
            }
            (b'[', [b']', after @ ..]) if !in_class => {
                text.push_str("[^\\x00-\\xFF]");
                rest = after;
            }
            (b'[', _) if !in_class => {
                in_class = true;
                text.push('[');
            }
            (b'.', _) if !in_class => text.push_str("[^\\n\\r]"),
            (b']', _) => {
                in_class = false;
                text.push(']');
            }
            // A named class, as in `[[:alpha:]]`.
            (b'[', [b':', ..]) => {
                let end = after.windows(2).position(|pair| pair == b":]").map_or(after.len(), |at| at + 2);
                let (name, after) = after.split_at(end);
                text.push('[');
                text.extend(name.iter().filter(|b| b.is_ascii()).map(|b| char::from(*b)));
                rest = after;
            }
            (b'[' | b'&' | b'~', _) if in_class => exactly(&mut text, *byte),
            (byte, _) if byte.is_ascii() => text.push(char::from(*byte)),
            (byte, _) => exactly(&mut text, *byte),
        }
    }
    text
}

/// Writes what a backslash and a byte mean; returns the rest of the pattern.
fn escape<'a>(text: &mut String, escaped: u8, after: &'a [u8]) -> &'a [u8] {
    match (escaped, after) {
        (b'0', _) => exactly(text, 0),
        // A control character in ECMAScript, but libstdc++ matches the letter itself.
        (b'c', [letter, after @ ..]) => {
            exactly(text, *letter);
            return after;
        }
        (b'1'..=b'9', _) => text.extend(['\\', char::from(escaped)]),
        (letter, _) if ESCAPES.contains(&letter) => text.extend(['\\', char::from(letter)]),
        (letter, _) if letter.is_ascii_alphanumeric() => text.push(char::from(letter)),
        (byte, _) => exactly(text, byte),
    }
    after
}

/// Writes an escape that matches one byte and nothing else.
fn exactly(text: &mut String, byte: u8) {
    // Writing to a string cannot fail.
    let _ = write!(text, "\\x{byte:02X}");
}
