//! Escapes foreign text in messages: terminal control sequences and marks that change the text direction are
//! written out.
//!
//! A shader, a file name or a command-line argument may contain escape sequences. Every message goes through
//! [`shown`]; further escaping for HTML belongs to the pages.

use std::borrow::Cow;
use std::fmt::Write;

/// Whether a character does more than stand for itself: control characters (ESC, BEL, backspace, also those
/// above 127), line separators, and marks that change the direction of the surrounding text.
pub fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}')
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// The text with control characters written out, as `\x1b` or `\u{202e}`; line breaks and tabs stay.
pub fn shown(text: &str) -> Cow<'_, str> {
    let commands = |c: char| is_control(c) && !matches!(c, '\n' | '\t');
    if !text.contains(commands) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            c if !commands(c) => out.push(c),
            c if c.is_ascii() => {
                let _ = write!(out, "\\x{:02x}", u32::from(c));
            }
            c => {
                let _ = write!(out, "\\u{{{:x}}}", u32::from(c));
            }
        }
    }
    out.into()
}

/// The text with control characters replaced by characters of the same length in bytes, so that positions do
/// not change.
pub(crate) fn same_places(text: &str) -> Cow<'_, str> {
    let commands = |c: char| is_control(c) && !matches!(c, '\n' | '\t');
    if !text.contains(commands) {
        return text.into();
    }
    let plain = |c: char| match c.len_utf8() {
        _ if !commands(c) => c,
        // A line end of other systems.
        1 if c == '\r' => ' ',
        1 => '?',
        2 => '¿',
        _ => '\u{fffd}',
    };
    text.chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_commands_a_terminal_is_written_out() {
        assert_eq!(shown("plain é → ok\n\tindented"), "plain é → ok\n\tindented");
        assert_eq!(shown("a\u{1b}[2Jb\u{7}\u{8}\rc\u{7f}"), "a\\x1b[2Jb\\x07\\x08\\x0dc\\x7f");
        assert_eq!(shown("\u{9b}2J \u{202e}txt\u{2066}"), "\\u{9b}2J \\u{202e}txt\\u{2066}");
    }

    #[test]
    fn places_stay() {
        let text = "x\u{1b}[1m\u{9b}\u{202e}é\r\n\ty";
        let plain = same_places(text);
        assert_eq!(plain, "x?[1m¿\u{fffd}é \n\ty");
        assert_eq!(plain.len(), text.len());
    }
}
