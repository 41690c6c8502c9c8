//! The difference between two texts, in the unified format. It knows nothing of shaders, and who prints it
//! escapes what a terminal would obey.

use diffy::DiffOptions;

/// Lines of context around a change.
const CONTEXT: usize = 2;

/// The change of a file called `name` from `before` to `after`. `what` says what changed the file, and
/// follows the name of its new form.
pub fn unified(name: &str, (before, after): (&str, &str), what: &str) -> String {
    let mut options = DiffOptions::new();
    options.set_context_len(CONTEXT);
    options.set_original_filename(name.to_owned()).set_modified_filename(format!("{name} ({what})"));
    options.create_patch(before, after).to_string()
}
