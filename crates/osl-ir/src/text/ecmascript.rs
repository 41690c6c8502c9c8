//! Translates regular expressions of the ECMAScript grammar, as `std::regex` of C++ reads them, to those of
//! `fancy-regex`. It knows nothing of searching.
//!
//! Both grammars agree on groups, repetition, anchors and the usual classes. They differ in what this module
//! writes anew: in ECMAScript a backslash before any other letter means nothing, `.` matches neither a
//! newline nor a carriage return, a class may be empty, within a class `[`, `&` and `~` are themselves, and a
//! repetition may be repeated: `a++` is `(?:a+)+`. A pattern that C++ refuses may work here.
//!
//! Of 5895 random patterns that libstdc++ accepts and finishes in a second, 5870 have the same match and the
//! same groups. In 13 of the others, a repeated group also matches the empty string, and C++ reports that
//! match of the group. The other 12 repeat a group that holds nothing but a look-ahead, which `fancy-regex`
//! refuses.

use std::fmt::Write;

/// Letters that mean something after a backslash in both grammars.
const ESCAPES: &[u8] = b"bBdDsSwWfnrtv";
/// How many repetitions of a pattern may be repeated: each becomes a group, and groups are nested.
const REPEATED: usize = 32;

/// A pattern for `fancy-regex` in its mode for bytes. A character beyond ASCII becomes the bytes of its UTF-8
/// form, each a character of its own.
pub(super) fn translated(pattern: &str) -> String {
    let mut written = Written { text: String::with_capacity(pattern.len()), ..Written::default() };
    let mut rest = pattern.as_bytes();
    while let [byte, after @ ..] = rest {
        rest = match byte {
            b'\\' if !after.is_empty() => {
                written.atom();
                escape(&mut written.text, after)
            }
            b'[' => {
                written.atom();
                class(&mut written.text, after)
            }
            b'(' => written.open(after),
            b'*' | b'+' | b'?' | b'{' => written.repeat(rest),
            b')' => {
                written.close();
                after
            }
            b'|' | b'^' | b'$' => {
                written.last = None;
                written.text.push(char::from(*byte));
                after
            }
            b'.' => {
                written.atom();
                written.text.push_str("[^\\n\\r]");
                after
            }
            _ => {
                written.atom();
                literal(&mut written.text, *byte);
                after
            }
        };
    }
    written.text
}

/// What is written of a pattern.
#[derive(Default)]
struct Written {
    text: String,
    /// Where open groups start.
    groups: Vec<usize>,
    /// Where the last atom starts, which a repetition repeats.
    last: Option<usize>,
    /// Whether the last atom is repeated, and whether as few times as possible.
    is_repeated: bool,
    is_lazy: bool,
    /// How many repetitions were repeated.
    repeated: usize,
}

impl Written {
    /// An atom starts here.
    fn atom(&mut self) {
        self.end_at(Some(self.text.len()));
    }

    fn end_at(&mut self, start: Option<usize>) {
        (self.last, self.is_repeated, self.is_lazy) = (start, false, false);
    }

    /// Opens a group; returns what follows its kind.
    fn open<'a>(&mut self, after: &'a [u8]) -> &'a [u8] {
        self.groups.push(self.text.len());
        self.last = None;
        self.text.push('(');
        let [b'?', kind, after @ ..] = after else { return after };
        self.text.push('?');
        literal(&mut self.text, *kind);
        after
    }

    fn close(&mut self) {
        self.text.push(')');
        let start = self.groups.pop();
        self.end_at(start);
    }

    /// Writes the repetition at the start of a pattern; returns what follows it.
    fn repeat<'a>(&mut self, pattern: &'a [u8]) -> &'a [u8] {
        let end = match pattern {
            [b'{', ..] => pattern.iter().position(|b| *b == b'}').map_or(pattern.len(), |at| at + 1),
            _ => 1,
        };
        let (how, after) = pattern.split_at(end);
        match self.last {
            Some(_) if self.is_repeated && !self.is_lazy && how == b"?" => self.is_lazy = true,
            Some(start) if self.is_repeated && self.repeated < REPEATED => {
                self.text.insert_str(start, "(?:");
                self.text.push(')');
                (self.is_lazy, self.repeated) = (false, self.repeated + 1);
            }
            // What cannot be read is refused.
            Some(_) if self.is_repeated => self.text.push('('),
            _ => self.is_repeated = true,
        }
        how.iter().for_each(|byte| literal(&mut self.text, *byte));
        after
    }
}

/// Writes a class after its bracket; returns what follows it.
fn class<'a>(text: &mut String, pattern: &'a [u8]) -> &'a [u8] {
    let mut rest = match pattern {
        [b'^', b']', after @ ..] => {
            text.push_str("[\\x00-\\xFF]");
            return after;
        }
        [b']', after @ ..] => {
            text.push_str("[^\\x00-\\xFF]");
            return after;
        }
        _ => pattern,
    };
    text.push('[');
    while let [byte, after @ ..] = rest {
        rest = after;
        match (byte, after) {
            (b'\\', [_, ..]) => rest = escape(text, after),
            (b']', _) => {
                text.push(']');
                return after;
            }
            // A named class, as in `[[:alpha:]]`.
            (b'[', [b':', ..]) => {
                let end = after.windows(2).position(|pair| pair == b":]").map_or(after.len(), |at| at + 2);
                let (name, after) = after.split_at(end);
                text.push('[');
                name.iter().for_each(|byte| literal(text, *byte));
                rest = after;
            }
            (b'[' | b'&' | b'~', _) => exactly(text, *byte),
            (byte, _) => literal(text, *byte),
        }
    }
    rest
}

/// Writes what a backslash before the start of a pattern means; returns what follows.
fn escape<'a>(text: &mut String, pattern: &'a [u8]) -> &'a [u8] {
    let [escaped, after @ ..] = pattern else { return pattern };
    match (*escaped, after) {
        (b'0', _) => exactly(text, 0),
        // A control character in ECMAScript, but libstdc++ matches the letter itself.
        (b'c', [letter, after @ ..]) => {
            exactly(text, *letter);
            return after;
        }
        (b'x', [a, b, after @ ..]) if let Some(byte) = hexadecimal(&[*a, *b]) => {
            exactly(text, byte);
            return after;
        }
        // Beyond a byte, C++ refuses it.
        (b'u', [b'0', b'0', a, b, after @ ..]) if let Some(byte) = hexadecimal(&[*a, *b]) => {
            exactly(text, byte);
            return after;
        }
        // A group by its number.
        (b'1'..=b'9', _) => {
            let digits = pattern.iter().take_while(|byte| byte.is_ascii_digit()).count();
            let (number, after) = pattern.split_at(digits);
            text.push('\\');
            number.iter().for_each(|digit| literal(text, *digit));
            return after;
        }
        (letter, _) if ESCAPES.contains(&letter) => text.extend(['\\', char::from(letter)]),
        (letter, _) if letter.is_ascii_alphanumeric() => text.push(char::from(letter)),
        (byte, _) => exactly(text, byte),
    }
    after
}

/// The byte that two hexadecimal digits mean.
fn hexadecimal(digits: &[u8]) -> Option<u8> {
    let text = std::str::from_utf8(digits).ok()?;
    if text.starts_with('+') { None } else { u8::from_str_radix(text, 16).ok() }
}

/// Writes a byte: itself, or an escape for one beyond ASCII.
fn literal(text: &mut String, byte: u8) {
    if byte.is_ascii() { text.push(char::from(byte)) } else { exactly(text, byte) }
}

/// Writes an escape that matches one byte and nothing else.
fn exactly(text: &mut String, byte: u8) {
    // Writing to a string cannot fail.
    let _ = write!(text, "\\x{byte:02X}");
}
