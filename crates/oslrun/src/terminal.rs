//! The standard streams of the process: unchanged for a pipe or file, made safe for a terminal.
//!
//! The text of a shader is written to a pipe or a file byte for byte. A terminal would execute control
//! sequences: set its title, move the cursor, clear text. So, on a terminal, each control character except
//! line breaks and tabs is written in visible form, except for the colors of our own messages.

use osl_syntax::escape::shown;
use std::io::{IsTerminal, Result, Write};

/// The standard output.
pub(crate) fn stdout() -> Box<dyn Write> {
    let stream = std::io::stdout();
    if stream.is_terminal() { Box::new(Harmless::new(anstream::stdout())) } else { Box::new(stream) }
}

/// The standard error. It has colors only on a terminal.
pub(crate) fn stderr() -> Box<dyn Write> {
    let terminal = std::io::stderr().is_terminal();
    if terminal { Box::new(Harmless::new(anstream::stderr())) } else { Box::new(anstream::stderr()) }
}

/// Maximum length in bytes of a color sequence.
const MAX_SEQUENCE: usize = 24;

/// Writes text with its control characters in visible form.
struct Harmless<W: Write> {
    to: W,
    /// The incomplete end of the text so far: more bytes may complete a character or a color.
    rest: Vec<u8>,
}

impl<W: Write> Harmless<W> {
    fn new(to: W) -> Self {
        Harmless { to, rest: Vec::new() }
    }

    /// Writes all complete parts; with `all` also the rest.
    fn pass(&mut self, all: bool) -> Result<()> {
        let bytes = std::mem::take(&mut self.rest);
        let mut out = String::with_capacity(bytes.len());
        let mut at = 0;
        while let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
            match piece(rest) {
                Piece::Color(length) => {
                    out.push_str(&String::from_utf8_lossy(rest.get(..length).unwrap_or_default()));
                    at += length;
                }
                Piece::Open if !all => {
                    self.rest = rest.to_vec();
                    break;
                }
                Piece::Char(c) => {
                    out.push_str(&shown(c.encode_utf8(&mut [0; 4])));
                    at += c.len_utf8();
                }
                Piece::Open | Piece::Byte => {
                    out.push_str(&format!("\\x{:02x}", rest.first().copied().unwrap_or_default()));
                    at += 1;
                }
            }
        }
        self.to.write_all(out.as_bytes())
    }
}

impl<W: Write> Write for Harmless<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.rest.extend_from_slice(bytes);
        self.pass(false)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        self.pass(true)?;
        self.to.flush()
    }
}

impl<W: Write> Drop for Harmless<W> {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// What comes first in a sequence of bytes.
enum Piece {
    /// A color sequence of this many bytes.
    Color(usize),
    /// A character.
    Char(char),
    /// The beginning of a color or a character that more bytes may complete.
    Open,
    /// A byte that is not part of a character.
    Byte,
}

fn piece(bytes: &[u8]) -> Piece {
    if let Some(rest) = bytes.strip_prefix(b"\x1b") {
        let sequence = rest.strip_prefix(b"[").unwrap_or_default();
        let length = sequence.iter().take_while(|b| b.is_ascii_digit() || **b == b';').count();
        return match sequence.get(length) {
            Some(b'm') if is_color(sequence.get(..length).unwrap_or_default()) => Piece::Color(length + 3),
            None if (rest.is_empty() || rest.first() == Some(&b'[')) && length < MAX_SEQUENCE => Piece::Open,
            _ => Piece::Char('\x1b'),
        };
    }
    let head = bytes.get(..bytes.len().min(4)).unwrap_or_default();
    let valid = match std::str::from_utf8(head) {
        Ok(text) => text,
        Err(e) if e.valid_up_to() == 0 && e.error_len().is_none() => return Piece::Open,
        Err(e) => std::str::from_utf8(head.get(..e.valid_up_to()).unwrap_or_default()).unwrap_or_default(),
    };
    valid.chars().next().map_or(Piece::Byte, Piece::Char)
}

/// Whether the numbers of a sequence belong to messages: bold, underlined, a text color, or reset.
fn is_color(numbers: &[u8]) -> bool {
    let text = std::str::from_utf8(numbers).unwrap_or("x");
    let list: Option<Vec<u32>> =
        text.split(';').map(|n| if n.is_empty() { Some(0) } else { n.parse().ok() }).collect();
    match list.as_deref() {
        Some([38, 5, 0..=255]) => true,
        Some(list) => list.iter().all(|n| matches!(n, 0 | 1 | 4 | 22 | 24 | 39 | 30..=37 | 90..=97)),
        None => false,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    fn written(pieces: &[&[u8]]) -> String {
        let mut out = Vec::new();
        let mut stream = Harmless::new(&mut out);
        for piece in pieces {
            stream.write_all(piece).unwrap();
        }
        stream.flush().unwrap();
        drop(stream);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn colors_pass_and_commands_do_not() {
        assert_eq!(
            written(&[b"\x1b[1m\x1b[38;5;9merror\x1b[0m: a\tb\n"]),
            "\x1b[1m\x1b[38;5;9merror\x1b[0m: a\tb\n"
        );
        assert_eq!(
            written(&[b"\x1b]0;title\x07\x1b[2J\x1b[8mx\r\x08"]),
            "\\x1b]0;title\\x07\\x1b[2J\\x1b[8mx\\x0d\\x08"
        );
        assert_eq!(written(&["\u{9b}2J\u{202e}".as_bytes(), b"\xff\xc3"]), "\\u{9b}2J\\u{202e}\\xff\\xc3");
    }

    #[test]
    fn pieces_belong_together() {
        assert_eq!(written(&[b"\x1b", b"[", b"31", b"mred\xc3", b"\xa9"]), "\x1b[31mred\u{e9}");
        assert_eq!(written(&[b"\x1b", b"]8;;x"]), "\\x1b]8;;x");
        assert_eq!(written(&[b"end\x1b[3"]), "end\\x1b[3");
    }
}
