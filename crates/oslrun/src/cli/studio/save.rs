//! Saves a text as the file of a page.
//!
//! Only a source below the folder of the command line's file is saved, links resolved, and only if it is
//! there. It is replaced as a whole, and only if it has the text that the page read. This module must not
//! know connections.

use osl_files::{Roots, Unsaved};
use osl_limits::Limits;
use osl_studio::{Edit, Saved, Stop, version};
use std::path::Path;

/// The ending of a source.
pub(super) const SOURCE: &str = "osl";

/// Why a page cannot save a file; none if it can.
pub(super) fn locked(roots: &Roots, path: &Path) -> Option<String> {
    if path.extension().is_none_or(|ending| ending != SOURCE) {
        return Some("a page saves only sources (.osl)".to_string());
    }
    roots.may_replace(path).err().map(|why| why.to_string())
}

/// Replaces the text of a file.
pub(super) fn save(roots: &Roots, path: &Path, edit: &Edit, limits: &Limits) -> Result<Saved, Stop> {
    let refused = |why: &dyn std::fmt::Display| Stop::error(format!("not saved: {}: {why}", path.display()));
    if let Some(why) = locked(roots, path) {
        return Err(refused(&why));
    }
    let bytes = osl_files::text(edit.text.clone().into_bytes()).map_err(|why| refused(&why))?;
    let now = roots.open(path).and_then(|file| file.text(limits.reading.file_bytes));
    let now = version(&now.map_err(|why| refused(&why))?);
    if now != edit.version {
        return Ok(Saved::Changed(now));
    }
    let file = Unsaved::existing(roots, path).and_then(|file| file.with(bytes.as_bytes()));
    file.and_then(Unsaved::save).map_err(|why| refused(&why.error))?;
    Ok(Saved::Done(version(&edit.text)))
}
