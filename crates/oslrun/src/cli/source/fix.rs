//! `oslrun check --fix`: applies the safe edits of the diagnostics to a text.
//!
//! An edit is applied only within the file that the command line names, never together with one that it
//! overlaps, and only if the text then compiles at least as well as before. Edits that depend on each other
//! are found by checking again. This module must not write files: the caller does.

use osl::stages::Checked;
use osl_syntax::diagnostic::{Diagnostic, Edit};
use osl_syntax::repair::apply;

/// Maximum number of times that a text is checked again after edits.
const MOST_ROUNDS: usize = 8;
/// Maximum number of fixes that are tried one by one after they failed together.
const MOST_ALONE: usize = 50;

/// A text after its fixes.
pub(in crate::cli) struct Fixed {
    /// The new text; the old one if nothing was fixed.
    pub(in crate::cli) text: String,
    /// Number of applied fixes.
    pub(super) applied: usize,
}

/// How well a text compiles: less is better. Syntax errors may hide others, so they count first.
type Badness = (usize, usize);

/// Applies the safe fixes of the diagnostics that `judge` shows, until there are none left.
pub(in crate::cli) fn fix(
    text: &str,
    check: impl Fn(&str) -> Checked,
    judge: impl Fn(&Checked) -> Vec<Diagnostic>,
) -> Fixed {
    let mut fixed = Fixed { text: text.to_string(), applied: 0 };
    let mut checked = check(&fixed.text);
    for _ in 0..MOST_ROUNDS {
        let fixes = safe_fixes(&judge(&checked), fixed.text.len());
        let bad = badness(&checked);
        let together = apart(fixes.clone());
        let Some((text, after, n)) = attempt(&fixed.text, &together, bad, &check)
            .map(|(text, after)| (text, after, together.len()))
            .or_else(|| alone(&fixed.text, fixes, bad, &check))
        else {
            break;
        };
        fixed = Fixed { text, applied: fixed.applied + n };
        checked = after;
    }
    fixed
}

/// The text after these fixes, if it compiles at least as well.
fn attempt(
    text: &str,
    fixes: &[Vec<Edit>],
    bad: Badness,
    check: &impl Fn(&str) -> Checked,
) -> Option<(String, Checked)> {
    let mut edits: Vec<Edit> = fixes.iter().flatten().cloned().collect();
    edits.sort_by_key(|edit| (edit.span.start, edit.span.end));
    let new = (!edits.is_empty()).then(|| apply(text, &edits)).flatten().filter(|new| new != text)?;
    let after = check(&new);
    (badness(&after) <= bad).then_some((new, after))
}

/// The first fix that can be applied by itself.
fn alone(
    text: &str,
    fixes: Vec<Vec<Edit>>,
    bad: Badness,
    check: &impl Fn(&str) -> Checked,
) -> Option<(String, Checked, usize)> {
    let mut fixes = fixes.into_iter().take(MOST_ALONE);
    fixes.find_map(|fix| attempt(text, &[fix], bad, check)).map(|(text, after)| (text, after, 1))
}

/// Number of errors of syntax, and of all errors.
fn badness(checked: &Checked) -> Badness {
    let errors = || checked.diagnostics.iter().filter(|d| d.is_error());
    let of_reading = |code: &str| ["E00", "E01"].iter().any(|digits| code.starts_with(digits));
    (errors().filter(|d| of_reading(d.code.id)).count(), errors().count())
}

/// The safe fixes whose edits lie in the main file, which has this length and comes first.
fn safe_fixes(list: &[Diagnostic], length: usize) -> Vec<Vec<Edit>> {
    let inside = |edit: &Edit| edit.span.start <= edit.span.end && edit.span.end as usize <= length;
    let fixes = list.iter().filter_map(|d| d.fixes.first());
    fixes.filter(|fix| fix.safe && fix.edits.iter().all(inside)).map(|fix| fix.edits.clone()).collect()
}

/// The fixes without those that overlap an earlier one.
fn apart(fixes: Vec<Vec<Edit>>) -> Vec<Vec<Edit>> {
    let mut chosen: Vec<Vec<Edit>> = Vec::new();
    for fix in fixes {
        let clashes = |edit: &Edit| chosen.iter().flatten().any(|other| overlap(edit, other));
        if !fix.iter().any(clashes) {
            chosen.push(fix);
        }
    }
    chosen
}

/// Whether two edits touch the same text, or insert at the same place.
fn overlap(a: &Edit, b: &Edit) -> bool {
    let (a, b) = (a.span, b.span);
    a.start == b.start || (a.start < b.end && b.start < a.end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_syntax::span::Span;

    fn edit(start: u32, end: u32) -> Edit {
        Edit { span: Span::new(start, end), text: "x".to_string() }
    }

    #[test]
    fn edits_that_touch_are_not_applied_together() {
        assert!(overlap(&edit(2, 5), &edit(4, 6)) && overlap(&edit(3, 3), &edit(2, 4)));
        assert!(overlap(&edit(3, 3), &edit(3, 3)));
        assert!(!overlap(&edit(2, 4), &edit(4, 6)) && !overlap(&edit(4, 4), &edit(2, 4)));
        let fixes = vec![vec![edit(0, 2), edit(8, 9)], vec![edit(8, 8)], vec![edit(3, 3)]];
        assert_eq!(apart(fixes.clone()), [fixes[0].clone(), fixes[2].clone()]);
    }
}
