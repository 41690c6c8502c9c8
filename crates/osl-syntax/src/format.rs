//! The formatter: the same file in one style.
//!
//! It works on the text before preprocessing, since the tree has lost comments, directives and macros. `pieces`
//! splits the text, `structure` finds the lines and what each piece is to its neighbours (`role`), and `layout`
//! writes them with the line breaks that the width asks for. Only white space between tokens is changed.
//!
//! The style:
//! - four spaces a level; the brace on the line of its header; one statement a line; a body without braces on a line
//!   of its own; at most one blank line, none at the inner ends of a block;
//! - spaces around binary operators, behind commas and casts, inside `[[ ]]`; none inside parentheses;
//! - lines of up to [`WIDTH`] columns. A longer one is broken behind a comma, before a binary operator or before
//!   `[[`, outside of brackets rather than inside; it goes on two levels deeper. What cannot be broken stays longer;
//! - declared parameters one a line where they do not fit on one, where one has metadata or a comment of its own,
//!   or where the line was broken behind the `(` before;
//! - an initialiser whose line was broken behind the `{` keeps its rows; other line breaks are not kept;
//! - a comment stays on a line of its own, or behind the code that it stood behind;
//! - directives, text behind `#if 0`, and the uses of macros with their arguments stay byte for byte.
//!
//! Conditionals are not evaluated: all branches are laid out. What only a macro makes whole, such as a brace from a
//! macro's body, counts as it stands in the text. `__LINE__` gives the new line. A macro that an included file
//! defines is known only by its name in capitals.

mod layout;
mod pieces;
mod role;
mod structure;

use crate::diagnostic::Diagnostic;
use crate::errors;
use crate::span::Span;
use pieces::{Kind, Piece};

/// Columns that a line should keep to.
pub const WIDTH: usize = 99;

/// The text of a file in the style of this module. `name` is what a diagnostic calls the file; its spans are bytes
/// of `text`.
///
/// What the compiler only warns of is kept: a string literal broken over lines, a stray `}` before the shader. If,
/// against expectation, white space alone could not carry a token over, the text comes back as it is.
///
/// # Errors
/// What is no token of the language, strings, comments and conditionals without an end, brackets out of balance
/// or nested too deep: there the lines cannot be told with certainty, and nothing should be written.
pub fn format(name: &str, text: &str) -> Result<String, Vec<Diagnostic>> {
    let Ok(end) = u32::try_from(text.len()) else {
        return Err(vec![errors::too_large(Span::default(), name)]);
    };
    let pieces = pieces::split(text)?;
    let structure = structure::structure(&pieces, end).map_err(|d| vec![*d])?;
    let out = layout::layout(text, &pieces, &structure);
    let kept = pieces::split(&out).is_ok_and(|after| same(&pieces, &after));
    Ok(if kept { out } else { text.to_owned() })
}

/// Whether two texts differ in nothing but the white space between their pieces.
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
