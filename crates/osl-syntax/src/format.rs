//! The formatter: rewrites a file in one style.
//!
//! It works on the text before preprocessing, because the tree has no comments, directives and macros.
//! `pieces` splits the text, `structure` finds the lines and the role of each piece (`role`), and `layout`
//! writes them with the line breaks that the width requires. Only white space between tokens changes.
//!
//! The style:
//! - four spaces per level; the brace on the line of its header; one statement per line; a body without
//!   braces on its own line; at most one blank line, none at the inner ends of a block;
//! - spaces around binary operators, after commas and casts, and inside `[[ ]]`; none inside parentheses;
//! - lines of up to [`WIDTH`] columns. A longer line is broken after a comma, before a binary operator or
//!   before `[[`, preferably outside brackets; its continuation is indented by two levels. What cannot be
//!   broken stays longer;
//! - declared parameters one per line if they do not fit on one line, if one has metadata or a comment of its
//!   own, or if the line was broken after the `(` before;
//! - an initialiser whose line was broken after the `{` keeps its rows; other line breaks are not kept;
//! - a comment stays on its own line, or after the code that it followed;
//! - directives, text after `#if 0`, and macro calls with their arguments stay byte for byte.
//!
//! Conditionals are not evaluated: all branches are formatted. Code that only a macro makes complete, such as
//! a brace from a macro's body, is formatted as it appears in the text. `__LINE__` gives the new line. A
//! macro that an included file defines is recognised only by its name in capitals.

mod layout;
mod pieces;
mod role;
mod structure;

use crate::diagnostic::Diagnostic;
use crate::errors;
use crate::source;
use crate::span::Span;
use osl_limits::Limits;
use pieces::{Kind, Piece};
use std::borrow::Cow;

/// Maximum number of columns in a line, where possible.
pub const WIDTH: usize = 99;

/// The text of a file in the style of this module. `name` is the file name in diagnostics, whose spans are
/// bytes of `text`.
///
/// Constructs that the compiler only warns about are kept: a string literal broken over lines, a stray `}`
/// before the shader. If, unexpectedly, changing white space would change a token, the text is returned
/// unchanged.
///
/// # Errors
/// Invalid tokens; strings, comments and conditionals without an end; unbalanced brackets; too deep nesting.
/// The lines are then uncertain, and nothing should be written.
pub fn format(name: &str, text: &str) -> Result<String, Vec<Diagnostic>> {
    format_within(name, text, &Limits::default())
}

/// The same as [`format()`] with given limits: of the text of a source, of nesting, of errors.
///
/// # Errors
/// Those of [`format()`].
pub fn format_within(name: &str, text: &str, limits: &Limits) -> Result<String, Vec<Diagnostic>> {
    if let Cow::Owned(lines) = source::with_line_ends(text) {
        // Lines that end in carriage returns alone do so afterwards.
        let returns = !text.contains('\n');
        let out = format_within(name, &lines, limits)?;
        return Ok(if returns { out.replace('\n', "\r") } else { out });
    }
    let Ok(end) = u32::try_from(text.len()) else {
        return Err(vec![errors::too_large(Span::default(), name)]);
    };
    let reading = &limits.reading;
    let pieces = pieces::split(text, reading.diagnostics)?;
    let structure = structure::structure(&pieces, end, reading.nesting).map_err(|d| vec![*d])?;
    let out = layout::layout(text, &pieces, &structure);
    let kept = pieces::split(&out, reading.diagnostics).is_ok_and(|after| same(&pieces, &after));
    Ok(if kept { out } else { text.to_owned() })
}

/// Whether two texts differ only in the white space between their pieces.
fn same(before: &[Piece<'_>], after: &[Piece<'_>]) -> bool {
    let text = |p: &Piece<'_>| match p.kind {
        Kind::Lines(_) => p.text.trim_end_matches(['\r', '\n']).len(),
        _ => p.text.len(),
    };
    before.len() == after.len()
        && before
            .iter()
            .zip(after)
            .all(|(a, b)| a.kind == b.kind && a.text.get(..text(a)) == b.text.get(..text(b)))
}
