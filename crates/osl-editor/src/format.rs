//! Formatting as edits of the white space between tokens.

use crate::page::Page;
use gen_lsp_types::{Range, TextEdit};
use osl::Limits;

impl Page {
    /// The edits that format the text, or the part of them that touches a range.
    ///
    /// # Errors
    /// The text cannot be formatted; the message says why.
    pub fn formatted(&self, range: Option<Range>, limits: &Limits) -> Result<Vec<TextEdit>, String> {
        let new = osl::format(&self.name, self.text.as_str(), limits).map_err(|error| {
            let first = error.diagnostics().first();
            first.map_or_else(String::new, |d| format!("line {}: {}", d.line_column().0, d.message))
        })?;
        let edits = spaces_between(self.text.as_str(), &new).unwrap_or_default().into_iter();
        let edits = edits.map(|(start, end, new)| TextEdit::new(self.text.range(start, end), new));
        let touches = |edit: &TextEdit| {
            range.is_none_or(|range| edit.range.start <= range.end && range.start <= edit.range.end)
        };
        Ok(edits.filter(touches).collect())
    }
}

/// The white space that differs between two texts, as replaced bytes of the old text and their new text;
/// `None` if they differ in more than white space.
pub fn spaces_between(old: &str, new: &str) -> Option<Vec<(usize, usize, String)>> {
    let mut edits = Vec::new();
    let (mut a, mut b) = (0, 0);
    loop {
        let (old_gap, new_gap) = (gap(old.get(a..)?), gap(new.get(b..)?));
        if old_gap != new_gap {
            edits.push((a, a + old_gap.len(), new_gap.to_string()));
        }
        (a, b) = (a + old_gap.len(), b + new_gap.len());
        match (old.get(a..)?.chars().next(), new.get(b..)?.chars().next()) {
            (None, None) => return Some(edits),
            (Some(c), Some(d)) if c == d => (a, b) = (a + c.len_utf8(), b + d.len_utf8()),
            _ => return None,
        }
    }
}

/// The white space at the start of a text.
fn gap(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_whitespace()).unwrap_or(text.len());
    text.get(..end).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_white_space_is_replaced() {
        let edits = spaces_between("a=é;\n\n\nb", " a = é;\nb\n");
        let edit = |start, end, text: &str| (start, end, text.to_string());
        let all = [edit(0, 0, " "), edit(1, 1, " "), edit(2, 2, " "), edit(5, 8, "\n"), edit(9, 9, "\n")];
        assert_eq!(edits.as_deref(), Some(&all[..]));
        assert_eq!(spaces_between("ab", "a c"), None);
    }
}
