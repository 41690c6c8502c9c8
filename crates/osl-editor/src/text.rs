//! A text with its lines: converts between bytes and the positions of the protocol, and takes edits.

use gen_lsp_types::{Position, Range, TextEdit};

/// A text in an editor.
///
/// Positions of the protocol are lines and UTF-16 code units, both from 0. A line ends with a line feed, with
/// a carriage return, or with both. A position after the end of a line is its end, and a position after the
/// last line is the end of the text; one within a character is its start.
#[derive(Clone, Debug)]
pub struct Text {
    text: String,
    /// The first byte of each line.
    lines: Vec<usize>,
}

impl Text {
    /// A text.
    pub fn new(text: String) -> Text {
        let bytes = text.as_bytes();
        let ends = bytes.iter().enumerate().filter(|(at, byte)| match byte {
            b'\n' => true,
            b'\r' => bytes.get(at + 1) != Some(&b'\n'),
            _ => false,
        });
        let lines = std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect();
        Text { text, lines }
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// A part of the text; empty if the bytes are not one.
    pub fn slice(&self, start: usize, end: usize) -> &str {
        self.text.get(start..end).unwrap_or_default()
    }

    /// The byte at a position.
    pub fn offset(&self, position: Position) -> usize {
        let line = position.line as usize;
        let Some(start) = self.lines.get(line) else { return self.text.len() };
        let end = self.line_end(line);
        let mut units = 0;
        let within = self.slice(*start, end).char_indices().find(|(_, c)| {
            units += c.len_utf16() as u32;
            units > position.character
        });
        within.map_or(end, |(at, _)| start + at)
    }

    /// The end of a line, without the characters that end it.
    pub fn line_end(&self, line: usize) -> usize {
        let start = self.line_start(line);
        let end = self.line_start(line + 1);
        start + self.slice(start, end).trim_end_matches(['\r', '\n']).len()
    }

    /// The first byte of a line; the end of the text if there is no such line.
    pub fn line_start(&self, line: usize) -> usize {
        self.lines.get(line).copied().unwrap_or(self.text.len())
    }

    /// The line of a byte, from 0.
    pub fn line(&self, offset: usize) -> usize {
        self.lines.partition_point(|start| *start <= offset).saturating_sub(1)
    }

    /// The position of a byte.
    pub fn position(&self, offset: usize) -> Position {
        let line = self.line(offset);
        let before = self.slice(self.line_start(line), offset);
        Position::new(line as u32, before.encode_utf16().count() as u32)
    }

    /// The range of some bytes.
    pub fn range(&self, start: usize, end: usize) -> Range {
        Range::new(self.position(start), self.position(end))
    }

    /// Replaces a part of the text; without a range, all of it.
    pub fn edit(&mut self, range: Option<Range>, new: &str) {
        let mut text = std::mem::take(&mut self.text);
        match range {
            None => new.clone_into(&mut text),
            Some(range) => {
                self.text = text;
                let (start, end) = (self.offset(range.start), self.offset(range.end));
                text = std::mem::take(&mut self.text);
                text.replace_range(start..end.max(start), new);
            }
        }
        *self = Text::new(text);
    }

    /// The edit that turns this text into another one: it replaces only what is between the common start and
    /// the common end. `None` if they are equal.
    pub fn edit_to(&self, new: &str) -> Option<TextEdit> {
        if self.text == new {
            return None;
        }
        let same = |(a, b): &(char, char)| a == b;
        let length = |pairs: &mut dyn Iterator<Item = (char, char)>| -> usize {
            pairs.take_while(same).map(|(c, _)| c.len_utf8()).sum()
        };
        let start = length(&mut self.text.chars().zip(new.chars()));
        let (old_rest, new_rest) = (self.slice(start, self.text.len()), new.get(start..).unwrap_or_default());
        let end = length(&mut old_rest.chars().rev().zip(new_rest.chars().rev()));
        let range = self.range(start, self.text.len() - end);
        Some(TextEdit::new(range, new_rest.get(..new_rest.len() - end).unwrap_or_default().to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIXED: &str = "a\u{10400}b\r\n\tü\rc\n\nlast";

    #[test]
    fn positions_count_utf16() {
        let text = Text::new(MIXED.to_string());
        let at = |line, character| text.offset(Position::new(line, character));
        assert_eq!((at(0, 0), at(0, 1), at(0, 2), at(0, 3), at(0, 4), at(0, 99)), (0, 1, 1, 5, 6, 6));
        assert_eq!(
            (at(1, 0), at(1, 1), at(1, 2), at(2, 0), at(3, 7), at(4, 4), at(9, 0)),
            (8, 9, 11, 12, 14, 19, 19)
        );
        for (offset, _) in MIXED.char_indices() {
            // A line feed after a carriage return has no position of its own.
            if MIXED.get(offset..).is_some_and(|rest| !rest.starts_with('\n')) {
                assert_eq!(text.offset(text.position(offset)), offset);
            }
        }
    }

    #[test]
    fn edits_are_those_of_the_protocol() {
        let mut text = Text::new(MIXED.to_string());
        text.edit(Some(Range::new(Position::new(0, 3), Position::new(2, 1))), "x\n");
        assert_eq!(text.as_str(), "a\u{10400}x\n\n\nlast");
        text.edit(Some(Range::new(Position::new(9, 0), Position::new(9, 0))), "!");
        assert_eq!((text.as_str(), text.line(8)), ("a\u{10400}x\n\n\nlast!", 2));
        text.edit(None, "new");
        assert_eq!(text.as_str(), "new");
    }

    #[test]
    fn an_edit_replaces_what_differs() {
        let text = Text::new("float ä = 1;\n".to_string());
        let edit = text.edit_to("float ö = 1;\n");
        assert_eq!(edit, Some(TextEdit::new(text.range(6, 8), "ö".to_string())));
        assert_eq!(
            Text::new("aa".to_string()).edit_to("aaa").map(|edit| edit.new_text),
            Some("a".to_string())
        );
        assert_eq!(text.edit_to(text.as_str()), None);
    }
}
