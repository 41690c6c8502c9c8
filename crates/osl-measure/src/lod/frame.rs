//! The places of a shader's source where text can be inserted: the ends of its parameters and of its body.

use crate::stability::fix::source::Source;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// Offsets in the text of the main file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Where the line of the shader's keyword begins.
    pub(super) shader: usize,
    /// The closing parenthesis of the parameters.
    pub(super) params: usize,
    /// Whether a comma precedes it.
    pub(super) has_comma: bool,
    /// Just after the opening brace of the body.
    pub(super) open: usize,
    /// The closing brace of the body.
    pub(super) close: usize,
}

impl Frame {
    /// Finds the places. `None` if the shader's body is not in the main file, or made by a macro.
    pub(super) fn of(source: &Source<'_>) -> Option<Frame> {
        let bare = source.bare();
        let first = source.program.shader.body.first()?.span.start as usize;
        let mut depth = 0_i32;
        let mut open = None;
        for (at, c) in bare.get(..first)?.char_indices().rev() {
            match c {
                '}' => depth += 1,
                '{' if depth == 0 => {
                    open = Some(at + 1);
                    break;
                }
                '{' => depth -= 1,
                _ => {}
            }
        }
        let open = open?;
        let mut depth = 0_i32;
        let mut close = None;
        for (at, c) in bare.get(open..)?.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => {
                    close = Some(open + at);
                    break;
                }
                '}' => depth -= 1,
                _ => {}
            }
        }
        let close = close?;
        let last = source.program.shader.body.last()?.span.end as usize;
        let before = bare.get(..open - 1)?.trim_end();
        let params = before.strip_suffix(')')?.len();
        let has_comma = bare.get(..params)?.trim_end().ends_with(',');
        // The keyword stands before the name, which stands before the parameters or the metadata.
        let name = &*source.program.shader.name;
        let words = |text: &str, at: usize| {
            let is_part = |c: char| c.is_alphanumeric() || c == '_';
            let ends = !text.get(at + name.len()..).is_some_and(|rest| rest.starts_with(is_part));
            ends && !text.get(..at).is_some_and(|before| before.ends_with(is_part))
        };
        let head = bare.get(..params)?;
        let kind = |at: usize| {
            let before = head.get(..at)?.trim_end();
            let kinds = ["shader", "surface", "displacement", "volume", "light"];
            let kind = kinds.into_iter().find(|kind| before.ends_with(kind))?;
            Some(before.len() - kind.len())
        };
        let found = head.match_indices(name).filter(|(at, _)| words(head, *at));
        let keyword = found.filter_map(|(at, _)| kind(at)).last()?;
        let shader = bare.get(..keyword)?.rfind('\n').map_or(0, |at| at + 1);
        (last <= close).then_some(Frame { shader, params, has_comma, open, close })
    }

    /// The edit that adds output parameters, written as `float name = 0`.
    pub(super) fn outputs(&self, list: &[String]) -> Edit {
        let mut text: String = list.iter().map(|output| format!(", output {output}")).collect();
        if self.has_comma {
            text = text.trim_start_matches(", ").to_string();
        }
        let at = self.params as u32;
        Edit { span: Span::new(at, at), text }
    }
}

/// Applies those edits that lie in a part of the text, to this part alone.
pub(super) fn applied(text: &str, (from, to): (usize, usize), edits: &[Edit]) -> Option<String> {
    let inside = |edit: &&Edit| edit.span.start as usize >= from && edit.span.end as usize <= to;
    let moved = |edit: &Edit| {
        let span = Span::new(edit.span.start - from as u32, edit.span.end - from as u32);
        Edit { span, text: edit.text.clone() }
    };
    let mut edits: Vec<Edit> = edits.iter().filter(inside).map(moved).collect();
    edits.sort_by_key(|edit| edit.span.start);
    osl_syntax::repair::apply(text.get(from..to)?, &edits)
}
