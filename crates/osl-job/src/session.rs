//! What is kept from picture to picture, and the state that a picture is made of.
//!
//! A [`Session`] lasts as long as its client. Work begins on a [`Snapshot`] of it, which does not change; a
//! change makes another snapshot, and cancels the work on the older ones. What was read is kept until the
//! time or the size of a file changes: sources that were resolved, textures, meshes and attributes.

use crate::host::{Disk, Host};
use crate::open::Open;
use crate::spoken::Spoken;
use osl_files::Stamp;
use osl_hir::hir;
use osl_image::TextureCache;
use osl_limits::{Cancel, Limits};
use osl_lower::group::Group;
use osl_scene::Data;
use osl_scene::mesh::Mesh;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::any::Any;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// What pictures share. Clones are one session.
#[derive(Clone, Debug)]
pub struct Session(Arc<Mutex<Snapshot>>);

impl Session {
    /// A session that keeps what it reads from this host.
    pub fn new(host: impl Host + 'static) -> Session {
        let first = Snapshot { host: Arc::new(host), cancel: Cancel::new(), kept: Some(Arc::default()) };
        Session(Arc::new(Mutex::new(first)))
    }

    /// The present state.
    pub fn snapshot(&self) -> Snapshot {
        self.now().clone()
    }

    /// Sets the host of the work that begins from now on, and cancels the work on older snapshots. It does
    /// not wait for the end of that work.
    pub fn change(&self, host: impl Host + 'static) -> Snapshot {
        self.next(Some(Arc::new(host)))
    }

    /// Cancels the work on older snapshots because the client wants something else, or because files have
    /// changed; the host stays.
    pub fn outdate(&self) -> Snapshot {
        self.next(None)
    }

    fn next(&self, host: Option<Arc<dyn Host>>) -> Snapshot {
        let mut now = self.now();
        now.cancel.cancel();
        now.cancel = Cancel::new();
        now.host = host.unwrap_or_else(|| now.host.clone());
        now.clone()
    }

    fn now(&self) -> MutexGuard<'_, Snapshot> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The state of a session at a time. One from `default` is the disk; it keeps nothing and is never outdated.
#[derive(Clone, Debug)]
pub struct Snapshot {
    host: Arc<dyn Host>,
    cancel: Cancel,
    kept: Option<Arc<Mutex<Kept>>>,
}

impl Default for Snapshot {
    fn default() -> Snapshot {
        Snapshot { host: Arc::new(Disk), cancel: Cancel::new(), kept: None }
    }
}

#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub(crate) source: Slot<Arc<Source>>,
    pub(crate) mesh: Slot<Arc<Mesh>>,
    pub(crate) data: Slot<Data>,
    /// A source, and what was compiled of it.
    pub(crate) forms: Slot<(Arc<Source>, Arc<dyn Any + Send + Sync>)>,
    /// Parameters that change from picture to picture.
    pub(crate) open: Open,
    /// The number of forms that were compiled to be kept.
    pub(crate) compiled: u64,
    textures: Slot<TextureCache>,
}

/// The last thing of a kind.
type Slot<T> = Option<Entry<T>>;

/// Something that was made from files, for a request with this key.
#[derive(Debug)]
pub(crate) struct Entry<T> {
    key: String,
    files: BTreeMap<PathBuf, Option<Stamp>>,
    made: T,
}

impl<T: Clone> Entry<T> {
    /// What was made, if it is for this key and no file has changed.
    fn get(&self, key: &str, host: &dyn Host) -> Option<T> {
        let is_same = self.key == key && self.files.iter().all(|(path, before)| host.stamp(path) == *before);
        is_same.then(|| self.made.clone())
    }

    /// Something that was made from files that were read after a moment; nothing if one of them may have
    /// changed since it was read.
    fn new(
        key: String,
        (host, began): (&dyn Host, SystemTime),
        files: impl IntoIterator<Item = PathBuf>,
        made: T,
    ) -> Slot<T> {
        let files: BTreeMap<_, _> = files.into_iter().map(|path| (path.clone(), host.stamp(&path))).collect();
        let rests = files.values().flatten().all(|stamp| stamp.is_older_than(began));
        rests.then_some(Entry { key, files, made })
    }
}

/// A shader or a group, read and resolved.
#[derive(Debug)]
pub(crate) struct Source {
    /// The files.
    pub(crate) sources: SourceMap,
    /// The dialect of the shader; of a group, that of the last shader that has one.
    pub(crate) spoken: Option<Spoken>,
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

impl Snapshot {
    /// The host.
    pub fn host(&self) -> &Arc<dyn Host> {
        &self.host
    }

    /// Whether the session has changed since. Work on the snapshot has limits until this.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// How often a shader of the session was compiled, as far as its program may be kept.
    pub fn compiled(&self) -> u64 {
        self.kept().map_or(0, |kept| kept.compiled)
    }

    /// What is kept; nothing by default.
    pub(crate) fn kept(&self) -> Option<MutexGuard<'_, Kept>> {
        Some(self.kept.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What a slot keeps for a key, or what `make` makes, with the files that it is made from if it is to be
    /// kept.
    pub(crate) fn keep<T: Clone, E>(
        &self,
        slot: fn(&mut Kept) -> &mut Slot<T>,
        key: impl FnOnce() -> String,
        make: impl FnOnce() -> Result<(T, Option<Vec<PathBuf>>), E>,
    ) -> Result<T, E> {
        let Some(mut kept) = self.kept() else { return Ok(make()?.0) };
        let key = key();
        if let Some(made) = slot(&mut kept).as_ref().and_then(|entry| entry.get(&key, &*self.host)) {
            return Ok(made);
        }
        drop(kept);
        let began = self.host.now();
        let (made, files) = make()?;
        if let (Some(files), Some(mut kept)) = (files, self.kept()) {
            *slot(&mut kept) = Entry::new(key, (&*self.host, began), files, made.clone());
        }
        Ok(made)
    }

    /// The textures for a picture: those that are kept if the same files may be read and none of them has
    /// changed, else those that `make` makes.
    pub(crate) fn textures(
        &self,
        key: impl FnOnce() -> String,
        limits: &Limits,
        make: impl FnOnce() -> TextureCache,
    ) -> TextureCache {
        let Some(mut kept) = self.kept() else { return make() };
        let key = key();
        if let Some(textures) = kept.textures.as_ref().and_then(|entry| entry.get(&key, &*self.host)) {
            return textures.renewed(limits);
        }
        let textures = make();
        kept.textures = Some(Entry { key, files: self.all_textures(), made: textures.clone() });
        textures
    }

    /// Notes which files the kept textures come from, after a run that began at a moment.
    pub(crate) fn note_textures(&self, began: SystemTime) {
        let Some(mut kept) = self.kept() else { return };
        let Some(Entry { key, files, made }) = kept.textures.take() else { return };
        // Those of a snapshot with other textures belong to its run.
        if files.get(&PathBuf::new()) == self.all_textures().get(&PathBuf::new()) {
            let places = made.places([]).into_iter().chain(files.into_keys());
            kept.textures = Entry::new(key, (&*self.host, began), places, made);
        }
    }

    /// The stamp that changes when the host has other textures.
    fn all_textures(&self) -> BTreeMap<PathBuf, Option<Stamp>> {
        BTreeMap::from([(PathBuf::new(), self.host.stamp(&PathBuf::new()))])
    }
}
