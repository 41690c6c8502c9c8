//! The difference between two texts, in the unified format. It knows nothing of shaders, and who prints it
//! escapes what a terminal would obey.

use similar::TextDiff;

/// Lines of context around a change.
const CONTEXT: usize = 2;

/// The change of a file called `name` from `before` to `after`; `what` was done to it stands behind its name.
pub(super) fn unified(name: &str, (before, after): (&str, &str), what: &str) -> String {
    let diff = TextDiff::from_lines(before, after);
    diff.unified_diff().context_radius(CONTEXT).header(name, &format!("{name} ({what})")).to_string()
}
