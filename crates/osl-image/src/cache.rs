//! Textures by name, loaded once and shared by all threads.
//!
//! A file that cannot be read is remembered too: it is tried once, and its failure is handed out for reporting
//! once. It must not know how textures are looked up.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::error::ImageError;
use crate::file;
use crate::read::read_image;
use crate::texture::Texture;

/// Why a texture is not there.
#[derive(Debug)]
pub struct LoadFailure {
    message: String,
    reported: AtomicBool,
}

impl LoadFailure {
    /// The reason, on one line.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The reason for the one caller, of all threads, that asks first; none for everyone after.
    pub fn take_report(&self) -> Option<&str> {
        let first = !self.reported.swap(true, Ordering::Relaxed);
        first.then_some(self.message.as_str())
    }
}

type Loaded = Result<Arc<Texture>, Arc<LoadFailure>>;

/// All textures of a run. They stay in memory until the cache is dropped.
#[derive(Debug, Default)]
pub struct TextureCache {
    search: Vec<PathBuf>,
    /// The outer lock is held to find a slot, never while a file is read: threads that want different files
    /// do not wait for each other, and those that want the same one wait for a single read.
    slots: Mutex<HashMap<String, Arc<OnceLock<Loaded>>>>,
}

impl TextureCache {
    /// A cache that looks for relative names in the working directory, then in `search`, in order.
    pub fn new(search: Vec<PathBuf>) -> Self {
        Self { search, slots: Mutex::default() }
    }

    /// The texture of this name, read at the first call.
    ///
    /// **Errors**: the failure of that read; every call with this name shares it.
    pub fn get(&self, name: &str) -> Result<Arc<Texture>, Arc<LoadFailure>> {
        self.slot(name).get_or_init(|| self.load(name)).clone()
    }

    /// Whether there is a file of this name. Does not read it.
    pub fn exists(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn slot(&self, name: &str) -> Arc<OnceLock<Loaded>> {
        // The map is never left half-changed, so a panic elsewhere does not spoil it.
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slot) = slots.get(name) {
            return Arc::clone(slot);
        }
        Arc::clone(slots.entry(name.to_owned()).or_default())
    }

    fn load(&self, name: &str) -> Loaded {
        let Some(path) = self.find(name) else {
            return Err(failure(format!("Could not open file \"{}\"", name.escape_debug())));
        };
        match read_image(&path) {
            Ok(image) => Ok(Arc::new(Texture::new(image))),
            Err(error) => Err(failure(message(error))),
        }
    }

    fn find(&self, name: &str) -> Option<PathBuf> {
        let name = Path::new(name);
        let elsewhere = self.search.iter().map(|dir| dir.join(name));
        std::iter::once(name.to_owned()).chain(elsewhere).find(|path| file::is_there(path))
    }
}

fn message(error: ImageError) -> String {
    format!("Could not read file {error}")
}

fn failure(message: String) -> Arc<LoadFailure> {
    Arc::new(LoadFailure { message, reported: AtomicBool::new(false) })
}
