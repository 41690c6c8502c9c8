//! Saves a text as the file of a page.
//!
//! Only a source below the folder of the command line's file is saved, links resolved, and only if it is
//! there. It is replaced as a whole, and only if it has the text that the page read. This module must not
//! know connections.

use osl_files::{Roots, Unsaved};
use osl_limits::Limits;
use osl_studio::{Edit, Saved, Stop, version};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The ending of a source.
pub(super) const SOURCE: &str = "osl";

/// Why a page cannot save a file; none if it can.
pub(super) fn locked(roots: &Roots, path: &Path) -> Option<String> {
    if path.extension().is_none_or(|ending| ending != SOURCE) {
        return Some("a page saves only sources (.osl)".to_string());
    }
    roots.may_replace(path).err().map(|why| why.to_string())
}

/// Whether a page may show a path with a text that is not saved: it is a source below the folder, and it is
/// there.
pub(super) fn is_source(roots: &Roots, path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == SOURCE) && roots.open(path).is_ok()
}

/// Held while a file is compared and replaced: of several pages that save one version, one does.
static SAVING: Mutex<()> = Mutex::new(());

/// Replaces the text of a file.
pub(super) fn save(roots: &Roots, path: &Path, edit: &Edit, limits: &Limits) -> Result<Saved, Stop> {
    let refused = |why: &dyn std::fmt::Display| Stop::error(format!("not saved: {}: {why}", path.display()));
    if let Some(why) = locked(roots, path) {
        return Err(refused(&why));
    }
    let bytes = osl_files::text(edit.text.clone().into_bytes()).map_err(|why| refused(&why))?;
    let _saving = SAVING.lock().unwrap_or_else(PoisonError::into_inner);
    let now = roots.open(path).and_then(|file| file.text(limits.reading.file_bytes));
    let now = version(&now.map_err(|why| refused(&why))?);
    if now != edit.version {
        return Ok(Saved::Changed(now));
    }
    let file = Unsaved::existing(roots, path).and_then(|file| file.with(bytes.as_bytes()));
    file.and_then(Unsaved::save).map_err(|why| refused(&why.error))?;
    Ok(Saved::Done(version(&edit.text)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn of_several_pages_that_save_one_version_one_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.osl");
        std::fs::write(&path, "one").unwrap();
        let roots = Roots::new([folder.path()]);
        let page = |at: usize| {
            let edit =
                Edit { file: "a.osl".to_string(), text: format!("text {at}"), version: version("one") };
            let saved = save(&roots, &path, &edit, &Limits::default()).unwrap();
            usize::from(matches!(saved, Saved::Done(_)))
        };
        let done: usize = std::thread::scope(|scope| {
            let pages: Vec<_> = (0..8).map(|at| scope.spawn(move || page(at))).collect();
            pages.into_iter().map(|page| page.join().unwrap()).sum()
        });
        assert_eq!(done, 1);
    }
}
