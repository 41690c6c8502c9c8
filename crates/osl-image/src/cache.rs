//! Textures by name, loaded when first asked for and shared by all threads.
//!
//! A file that cannot be read is remembered too: it is tried once, and its failure is handed out for reporting
//! once. It must not know how textures are looked up.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

use crate::budget::{Budget, Slot};
use crate::error::ImageError;
use crate::read::{SubImage, read_part};
use crate::search::Search;
use crate::texture::Texture;
use crate::udim::{self, Square};
use osl_files::FileError;

/// Why a texture is not there.
#[derive(Debug)]
pub struct LoadFailure {
    message: String,
    /// The name, if there is no file.
    missing: Option<String>,
    reported: AtomicBool,
}

impl LoadFailure {
    /// A failure for a reason of the caller's, of a file that is there.
    pub fn new(message: &str) -> Arc<LoadFailure> {
        failure(message.to_owned(), None)
    }

    /// The reason, on one line.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The reason for the one caller, of all threads, that asks first; none for everyone after.
    pub fn take_report(&self) -> Option<&str> {
        let first = !self.reported.swap(true, Ordering::Relaxed);
        first.then_some(self.message.as_str())
    }

    /// Whether there is no file, rather than one that cannot be read.
    pub fn is_missing(&self) -> bool {
        self.missing.is_some()
    }

    /// The reason in the words of the reference's texture library, which scripts may look for. They depend on the format
    /// that the ending of the name promises.
    pub fn reference_message(&self) -> String {
        /// Endings of the formats that the library reads, except TIFF.
        const KNOWN: &str = " bmp bw cin cineon dds dib dpx exr fits gif hdr ico iff int inta j2c j2k jfi jfif jp2 jpe jpeg \
                             jpg pbm pdd pfm pgm pic png pnm ppm psb psd rgb rgba rgbe rla sgi softimage tga tpic webp z \
                             zfile ";
        let Some(name) = &self.missing else { return self.message.clone() };
        if name.is_empty() {
            return "ImageInput::create() called with no filename".to_owned();
        }
        let shown = name.escape_debug();
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
        match &*ending {
            "tif" | "tiff" | "tx" | "env" | "sm" | "vsm" => {
                format!("Could not open file: {shown}: No such file or directory")
            }
            known if !known.is_empty() && KNOWN.contains(&format!(" {known} ")) => {
                format!("Could not open file \"{shown}\"")
            }
            _ => format!(
                "Image \"{shown}\" does not exist. Also, it is not the name of an image format that OpenImageIO recognizes."
            ),
        }
    }
}

/// Why no file of a name can be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// No folder has such a file.
    NotFound,
    /// The name leads out of the folders that may be read, whether or not something is there.
    Outside,
}

/// A texture, or why there is none.
pub type Loaded = Result<Arc<Texture>, Arc<LoadFailure>>;

/// All textures of a run.
///
/// A texture stays in memory while somebody holds it or the budget has room for it; when it is asked for
/// again it is read again. Nobody sees a difference, as long as the files stay what they are.
#[derive(Debug)]
pub struct TextureCache {
    search: Search,
    budget: Budget,
    /// The lock is held to find a slot, never while a file is read: threads that want different files do not
    /// wait for each other, and those that want the same one wait for a single read.
    slots: RwLock<Slots>,
    /// The files that names of many files stand for.
    tiles: RwLock<HashMap<String, Arc<[String]>>>,
}

#[derive(Debug, Default)]
struct Slots {
    /// The first image of each file; apart, since looking one up takes no copy of the name.
    first: HashMap<String, Arc<Slot>>,
    others: HashMap<(String, Part), Arc<Slot>>,
}

/// An image other than the first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Part {
    Index(usize),
    Name(String),
}

impl Part {
    fn other_than_first(part: SubImage<'_>) -> Option<Self> {
        match part {
            SubImage::Index(0) | SubImage::Name("") => None,
            SubImage::Index(index) => Some(Self::Index(index)),
            SubImage::Name(name) => Some(Self::Name(name.to_owned())),
        }
    }
}

impl Default for TextureCache {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl TextureCache {
    /// A cache that looks for names in the working directory, then in `search`, in order, and keeps all that
    /// it has read. Files elsewhere are refused, see [`TextureCache::allow_files`].
    pub fn new(search: Vec<PathBuf>) -> Self {
        Self::with_budget(search, u64::MAX)
    }

    /// A cache like [`TextureCache::new`] that keeps up to `bytes` of samples. Each texture counts with all of
    /// its levels, made or not. Beyond that, textures that nobody holds are dropped, those first that were
    /// asked for longest ago; what is in use stays, even if it exceeds the budget alone.
    pub fn with_budget(search: Vec<PathBuf>, bytes: u64) -> Self {
        Self {
            search: Search::new(search),
            budget: Budget::new(bytes),
            slots: RwLock::default(),
            tiles: RwLock::default(),
        }
    }

    /// Whether names may also lead to files that lie neither below the working directory nor below a search
    /// path, by being absolute, by `..` or by a symbolic link. They may not by default.
    #[must_use]
    pub fn allow_files(mut self, allowed: bool) -> Self {
        self.search = self.search.or_anywhere(allowed);
        self
    }

    /// The first image of the file of this name, read if it is not at hand.
    ///
    /// **Errors**: the failure of that read; every call with this name shares it.
    pub fn get(&self, name: &str) -> Loaded {
        self.get_part(name, SubImage::default())
    }

    /// One image of the file of this name, read if it is not at hand.
    ///
    /// **Errors**: as for [`TextureCache::get`], and a file without that image.
    pub fn get_part(&self, name: &str, part: SubImage<'_>) -> Loaded {
        self.budget.get(&self.slot(name, part), || self.load(name, part))
    }

    /// The texture at a point, and the point's coordinates in it.
    ///
    /// Most names stand for one texture, which is everywhere; see [`TextureCache::is_tiled`] for the others.
    /// Of those, the texture is that of the unit square around the point, and the coordinates begin at the
    /// square's corner. Negative coordinates belong to the first column and row.
    ///
    /// **Errors**: as for [`TextureCache::get_part`]; a square without a file fails on its own.
    pub fn tile(&self, name: &str, part: SubImage<'_>, s: f32, t: f32) -> (Loaded, f32, f32) {
        if !Self::is_tiled(name) {
            return (self.get_part(name, part), s, t);
        }
        let (square, s, t) = Square::of(s, t);
        let loaded = match square.name(name) {
            Some(name) => self.get_part(&name, part),
            // No file has the name of the pattern, so its failure serves for all squares that have no name.
            None => self.get_part(name, part),
        };
        (loaded, s, t)
    }

    /// Whether a name stands for many textures, one a unit square: it contains `<UDIM>` or `%(UDIM)d` (1001
    /// plus the column plus ten times the row), `<UVTILE>` or `%(UVTILE)d` (`u1_v1` for the first square),
    /// `<u>` and `<v>` (`u0`, `v0`), or `<U>` and `<V>` (`u1`, `v1`).
    pub fn is_tiled(name: &str) -> bool {
        udim::is_pattern(name)
    }

    /// The text of a file of this name, found and admitted as textures are, of up to `limit` bytes.
    ///
    /// **Errors**: there is no such file, it may not be read, it is too long, or it is not UTF-8: one line.
    pub fn read_text(&self, name: &str, limit: u64) -> Result<String, String> {
        let shown = name.escape_debug();
        let file = self.search.open(name).map_err(|_| format!("Could not open file \"{shown}\""))?;
        if file.length() > limit {
            return Err(format!("the file \"{shown}\" is longer than {limit} bytes"));
        }
        let bytes = file.bytes(limit).map_err(|e| format!("the file \"{shown}\": {e}"))?;
        String::from_utf8(bytes).map_err(|_| format!("the file \"{shown}\" is not text"))
    }

    /// Whether there is a file of this name that may be read, or one for any square of the first ten rows.
    /// Does not read it.
    pub fn exists(&self, name: &str) -> bool {
        if Self::is_tiled(name) {
            return !self.tiles(name).is_empty();
        }
        self.search.open(name).is_ok()
    }

    /// Why no file of this name can be opened; `None` where there is one, which may still be no image.
    pub fn missing(&self, name: &str) -> Option<Missing> {
        if self.exists(name) {
            return None;
        }
        Some(match self.search.open(name) {
            Err(FileError::Outside) => Missing::Outside,
            _ => Missing::NotFound,
        })
    }

    /// The folders in which names are looked for after the working directory.
    pub fn folders(&self) -> &[PathBuf] {
        self.search.folders()
    }

    /// The files that a name of many files stands for, of the squares of the first ten rows. They are looked for once.
    pub fn tiles(&self, name: &str) -> Arc<[String]> {
        let known = self.tiles.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(tiles) = known.get(name) {
            return Arc::clone(tiles);
        }
        drop(known);
        let names = Square::usual().filter_map(|square| square.name(name));
        let tiles: Arc<[String]> = names.filter(|name| self.search.open(name).is_ok()).collect();
        let mut known = self.tiles.write().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(known.entry(name.to_owned()).or_insert(tiles))
    }

    /// The bytes of samples that the cache holds, counted as for [`TextureCache::with_budget`].
    pub fn held_bytes(&self) -> u64 {
        self.budget.held()
    }

    fn slot(&self, name: &str, part: SubImage<'_>) -> Arc<Slot> {
        let part = Part::other_than_first(part).map(|part| (name.to_owned(), part));
        // The maps are never left half-changed, so a panic elsewhere does not spoil them.
        let slots = self.slots.read().unwrap_or_else(PoisonError::into_inner);
        let known = match &part {
            None => slots.first.get(name),
            Some(key) => slots.others.get(key),
        };
        if let Some(slot) = known {
            return Arc::clone(slot);
        }
        drop(slots);
        let mut slots = self.slots.write().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(match part {
            None => slots.first.entry(name.to_owned()).or_default(),
            Some(key) => slots.others.entry(key).or_default(),
        })
    }

    fn load(&self, name: &str, part: SubImage<'_>) -> Loaded {
        let file = self.search.open(name).map_err(|error| match error {
            FileError::Io { .. } => {
                failure(format!("Could not read file {}: {error}", name.escape_debug()), None)
            }
            error => {
                let reason = match error {
                    FileError::Outside => {
                        ": it is neither below the working directory nor below a search path"
                    }
                    _ => "",
                };
                failure(format!("Could not open file \"{}\"{reason}", name.escape_debug()), Some(name))
            }
        })?;
        let image = read_part(file, part).map_err(|error| failure(message(error), None))?;
        Ok(Arc::new(Texture::new(image)))
    }
}

fn message(error: ImageError) -> String {
    format!("Could not read file {error}")
}

fn failure(message: String, missing: Option<&str>) -> Arc<LoadFailure> {
    Arc::new(LoadFailure { message, missing: missing.map(str::to_owned), reported: AtomicBool::new(false) })
}
