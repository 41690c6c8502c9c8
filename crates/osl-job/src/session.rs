//! What is kept from picture to picture: sources that were read and resolved, and textures.
//!
//! A file is read again when its time or size has changed, and so is everything else that was kept with it.

use osl_files::{Stamp, stamp};
use osl_hir::hir;
use osl_image::TextureCache;
use osl_limits::Limits;
use osl_lower::group::Group;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// What pictures share. Clones share the same; a session from `default` keeps nothing.
#[derive(Clone, Debug, Default)]
pub struct Session(Option<Arc<Mutex<Kept>>>);

#[derive(Debug, Default)]
struct Kept {
    source: Option<Entry<Arc<Source>>>,
    textures: Option<Entry<TextureCache>>,
}

/// Something that was made from files, for a request with this key.
#[derive(Debug)]
struct Entry<T> {
    key: String,
    files: BTreeMap<PathBuf, Option<Stamp>>,
    made: T,
}

impl<T: Clone> Entry<T> {
    /// What was made, if it is for this key and no file has changed.
    fn get(&self, key: &str) -> Option<T> {
        let is_same = self.key == key && self.files.iter().all(|(path, before)| stamp(path) == *before);
        is_same.then(|| self.made.clone())
    }

    /// Something that was made from files that were read after a moment; nothing if one of them may have
    /// changed since it was read.
    fn new(
        key: String,
        began: SystemTime,
        files: impl IntoIterator<Item = PathBuf>,
        made: T,
    ) -> Option<Self> {
        let files: BTreeMap<_, _> = files.into_iter().map(|path| (path.clone(), stamp(&path))).collect();
        let rests = files.values().flatten().all(|stamp| stamp.is_older_than(began));
        rests.then_some(Entry { key, files, made })
    }
}

/// A shader or a group, read and resolved.
#[derive(Debug)]
pub(crate) struct Source {
    /// The files.
    pub(crate) sources: SourceMap,
    /// Its diagnostics, judged by the warnings that the request asks for.
    pub(crate) list: Vec<Diagnostic>,
    /// What was resolved; nothing if there are errors.
    pub(crate) resolved: Option<Resolved>,
}

/// What was resolved.
#[derive(Clone, Debug)]
pub(crate) enum Resolved {
    /// A shader.
    Shader(Box<hir::Program>),
    /// A group.
    Group(Box<Group>),
}

impl Session {
    /// A session that keeps what it has read.
    pub fn keeping() -> Session {
        Session(Some(Arc::default()))
    }

    /// The source for a key, read by `read` unless it is kept. A source with errors is not kept.
    pub(crate) fn source<E>(
        &self,
        key: impl FnOnce() -> String,
        read: impl FnOnce() -> Result<Source, E>,
    ) -> Result<Arc<Source>, E> {
        let Some(kept) = &self.0 else { return read().map(Arc::new) };
        let key = key();
        let lock = || kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(source) = lock().source.as_ref().and_then(|entry| entry.get(&key)) {
            return Ok(source);
        }
        let began = SystemTime::now();
        let source = Arc::new(read()?);
        if source.resolved.is_some() {
            let files = source.sources.files().iter().map(|file| PathBuf::from(&*file.name));
            lock().source = Entry::new(key, began, files, source.clone());
        }
        Ok(source)
    }

    /// The textures for a picture: those that are kept if the same files may be read and none of them has
    /// changed, else those that `make` makes.
    pub(crate) fn textures(
        &self,
        key: impl FnOnce() -> String,
        limits: &Limits,
        make: impl FnOnce() -> TextureCache,
    ) -> TextureCache {
        let Some(kept) = &self.0 else { return make() };
        let key = key();
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(textures) = kept.textures.as_ref().and_then(|entry| entry.get(&key)) {
            return textures.renewed(limits);
        }
        let textures = make();
        kept.textures = Some(Entry { key, files: BTreeMap::new(), made: textures.clone() });
        textures
    }

    /// Notes which files the kept textures come from, after a run that began at a moment.
    pub(crate) fn note_textures(&self, began: SystemTime) {
        let Some(kept) = &self.0 else { return };
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(Entry { key, made, .. }) = kept.textures.take() else { return };
        kept.textures = Entry::new(key, began, made.places([]), made);
    }
}
