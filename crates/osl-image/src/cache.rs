//! Textures by name, loaded on first use and shared by all threads.
//!
//! A file that cannot be read is remembered too: it is tried once, and its failure is reported once.

use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};

use osl_files::FileError;
use osl_limits::Limits;

use crate::admission::Admission;
use crate::budget::{Budget, Reservation, Slot};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::file;
use crate::image::{OwnedSubImage, SubImage};
use crate::loaded::{LoadFailure, TextureResult, failure};
use crate::read::read_part;
use crate::search::{ReadFile, Search};
use crate::texture::Texture;
use crate::udim::{self, Square};

/// Why no file with a name can be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// No folder has such a file.
    NotFound,
    /// The name leads out of the permitted folders, whether or not a file is there.
    Outside,
}

/// All textures of a run. Clones share their contents.
///
/// A texture stays in memory while it is in use or the budget has room for it; otherwise it is read again on
/// the next request. The result is the same, as long as the files do not change.
#[derive(Clone, Debug)]
pub struct TextureCache {
    shared: Arc<Shared>,
    /// The limits of the work for which this clone reads files.
    limits: Limits,
}

#[derive(Debug)]
struct Shared {
    search: Search,
    budget: Budget,
    /// The lock is held to find a slot, never while a file is read. Threads that want different files do not
    /// wait for each other, and those that want the same file wait for a single read.
    slots: RwLock<Slots>,
    /// The files of each tiled name.
    tiles: RwLock<HashMap<String, Arc<[String]>>>,
    /// The names of the files in a folder, in lower case; `None` if there are too many.
    folders: RwLock<HashMap<PathBuf, Option<Arc<HashSet<String>>>>>,
}

#[derive(Debug, Default)]
struct Slots {
    /// The first image of each file, kept separately so that a lookup need not copy the name.
    first: HashMap<String, Arc<Slot>>,
    others: HashMap<(String, OwnedSubImage), Arc<Slot>>,
}

impl Slots {
    /// If there are too many names, forgets those whose slot nobody holds: they have no texture or failed.
    fn make_room(&mut self, most: u64) {
        let is_full = |count: usize| count as u64 >= most;
        if is_full(self.first.len()) {
            self.first.retain(|_, slot| Arc::strong_count(slot) > 1);
        }
        if is_full(self.others.len()) {
            self.others.retain(|_, slot| Arc::strong_count(slot) > 1);
        }
    }
}

/// An image of a file, unless it is the first.
fn other_than_first(part: SubImage<'_>) -> Option<OwnedSubImage> {
    match part {
        SubImage::Index(0) | SubImage::Name("") => None,
        SubImage::Index(index) => Some(OwnedSubImage::Index(index)),
        SubImage::Name(name) => Some(OwnedSubImage::Name(name.into())),
    }
}

impl Default for TextureCache {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl TextureCache {
    /// A cache that looks for names in the working directory, then in `search`, in order, with the usual
    /// limits. Files elsewhere are refused, see [`TextureCache::allow_files`].
    pub fn new(search: Vec<PathBuf>) -> Self {
        Self::within(search, &Limits::default())
    }

    /// A cache like [`TextureCache::new`] that keeps as much as the limits of images permit. Each texture
    /// counts with all of its levels, whether they exist yet or not. Beyond the limit, the least recently
    /// used textures that nobody holds are dropped; textures in use stay, even if they alone exceed the
    /// budget.
    pub fn within(search: Vec<PathBuf>, limits: &Limits) -> Self {
        Self::of(Search::new(search), limits)
    }

    /// A cache whose files come from the client instead of the disk, within limits as for
    /// [`TextureCache::within`].
    pub fn given(files: ReadFile, limits: &Limits) -> Self {
        Self::of(Search::Given(files), limits)
    }

    fn of(search: Search, limits: &Limits) -> Self {
        let images = &limits.images;
        let budget = Budget::new(images.texture_memory, images.working_memory, images.names);
        let shared = Shared {
            search,
            budget,
            slots: RwLock::default(),
            tiles: RwLock::default(),
            folders: RwLock::default(),
        };
        Self { shared: Arc::new(shared), limits: limits.clone() }
    }

    /// The same textures for other work, under its limits. Names without a texture are forgotten: that work
    /// may have been cancelled.
    #[must_use]
    pub fn renewed(&self, limits: &Limits) -> Self {
        let mut slots = self.shared.slots.write().unwrap_or_else(PoisonError::into_inner);
        slots.first.retain(|_, slot| slot.holds_texture());
        slots.others.retain(|_, slot| slot.holds_texture());
        drop(slots);
        Self { shared: Arc::clone(&self.shared), limits: limits.clone() }
    }

    /// Sets whether names may lead to files outside the working directory and the search paths: absolute
    /// names, `..`, or symbolic links. By default they may not. Forgets everything that was read.
    #[must_use]
    pub fn allow_files(self, allowed: bool) -> Self {
        let search = match &self.shared.search {
            Search::Given(files) => Search::Given(Arc::clone(files)),
            Search::Folders { folders, .. } => Search::new(folders.clone()).or_anywhere(allowed),
        };
        Self::of(search, &self.limits)
    }

    /// Lets these names lead to files anywhere: a user who types the name of a file trusts it. All other
    /// names stay below the folders. Of a tiled name, this holds for the squares of the first ten rows.
    /// Forgets everything that was read.
    #[must_use]
    pub fn trusting(self, names: impl IntoIterator<Item = String>) -> Self {
        let search = match &self.shared.search {
            Search::Given(files) => Search::Given(Arc::clone(files)),
            Search::Folders { folders, roots, trusted } => {
                let (folders, roots, trusted) = (folders.clone(), roots.clone(), trusted.clone());
                Search::Folders { folders, roots, trusted }.trusting(names)
            }
        };
        Self::of(search, &self.limits)
    }

    /// The places of the files that were requested so far, and of files with these names, whether or not
    /// there are such files. Of a tiled name, only requested squares are included.
    pub fn places<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Vec<PathBuf> {
        let slots = self.shared.slots.read().unwrap_or_else(PoisonError::into_inner);
        let requested = slots.first.keys().chain(slots.others.keys().map(|(name, _)| name)).cloned();
        let names = names.into_iter().map(str::to_string);
        let all: HashSet<String> = requested.chain(names).filter(|name| !name.is_empty()).collect();
        let folders = self.shared.search.folders();
        let beside = |name: &str| folders.iter().map(|folder| folder.join(name)).collect::<Vec<_>>();
        all.iter().flat_map(|name| std::iter::once(PathBuf::from(name)).chain(beside(name))).collect()
    }

    /// The first image of the file with this name, read if necessary.
    ///
    /// **Errors**: the failure of that read; every call with this name shares it.
    pub fn get(&self, name: &str) -> TextureResult {
        self.get_part(name, SubImage::default())
    }

    /// One image of the file with this name, read if necessary.
    ///
    /// **Errors**: as for [`TextureCache::get`]; also if the file has no such image.
    pub fn get_part(&self, name: &str, part: SubImage<'_>) -> TextureResult {
        self.shared.budget.get(&self.slot(name, part), || self.load(name, part))
    }

    /// The texture at a point, and the point's coordinates in it.
    ///
    /// Most names stand for one texture that applies everywhere; for tiled names see
    /// [`TextureCache::is_tiled`]. A tiled name gives the texture of the unit square around the point, and
    /// coordinates relative to the corner of that square. Negative coordinates belong to the first column and
    /// row.
    ///
    /// **Errors**: as for [`TextureCache::get_part`]; each square without a file fails separately.
    pub fn tile(&self, name: &str, part: SubImage<'_>, s: f32, t: f32) -> (TextureResult, f32, f32) {
        if !Self::is_tiled(name) {
            return (self.get_part(name, part), s, t);
        }
        let (square, s, t) = Square::of(s, t);
        let loaded = match square.name(name) {
            Some(name) => self.get_part(&name, part),
            // No file has the pattern itself as its name, so its failure serves for all squares without a
            // name.
            None => self.get_part(name, part),
        };
        (loaded, s, t)
    }

    /// Whether a name stands for many textures, one per unit square: it contains `<UDIM>` or `%(UDIM)d` (1001
    /// plus the column plus ten times the row), `<UVTILE>` or `%(UVTILE)d` (`u1_v1` for the first square),
    /// `<u>` and `<v>` (`u0`, `v0`), or `<U>` and `<V>` (`u1`, `v1`).
    pub fn is_tiled(name: &str) -> bool {
        udim::is_pattern(name)
    }

    /// The text of the file with this name, up to `limit` bytes, with the search and checks that apply to
    /// textures.
    ///
    /// **Errors**, as one line: there is no such file, it may not be read, it is too long, or it is not
    /// UTF-8.
    pub fn read_text(&self, name: &str, limit: u64) -> Result<String, String> {
        let shown = name.escape_debug();
        let file = self.shared.search.open(name).map_err(|_| format!("Could not open file \"{shown}\""))?;
        let too_long = || format!("the file \"{shown}\" is longer than {limit} bytes");
        if file.length > limit {
            return Err(too_long());
        }
        let mut bytes = Vec::new();
        // The file may grow while it is read, so one byte more than the limit is requested.
        let read = file.source.take(limit.saturating_add(1)).read_to_end(&mut bytes);
        read.map_err(|e| format!("the file \"{shown}\": cannot read the file: {e}"))?;
        if bytes.len() as u64 > limit {
            return Err(too_long());
        }
        String::from_utf8(bytes).map_err(|_| format!("the file \"{shown}\" is not text"))
    }

    /// Whether there is a readable file with this name, or one for any square of the first ten rows. Does not
    /// read it.
    pub fn exists(&self, name: &str) -> bool {
        if Self::is_tiled(name) {
            return !self.tiles(name).is_empty();
        }
        self.shared.search.find(name).is_ok()
    }

    /// Why no file with this name can be opened; `None` if one exists, which may still not be an image.
    pub fn missing(&self, name: &str) -> Option<Missing> {
        if self.exists(name) {
            return None;
        }
        Some(match self.shared.search.find(name) {
            Err(FileError::Outside) => Missing::Outside,
            _ => Missing::NotFound,
        })
    }

    /// The folders that are searched after the working directory.
    pub fn folders(&self) -> &[PathBuf] {
        self.shared.search.folders()
    }

    /// The files of a tiled name, for the squares of the first ten rows. They are searched for once.
    pub fn tiles(&self, name: &str) -> Arc<[String]> {
        let known = self.shared.tiles.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(tiles) = known.get(name) {
            return Arc::clone(tiles);
        }
        drop(known);
        let listed = self.listed(name);
        // File names are compared in lower case, since some systems ignore case; whether a file exists is
        // checked below.
        let may_be = |name: &String| {
            let file = name.rsplit_once('/').map_or(name.as_str(), |(_, file)| file).to_lowercase();
            listed.as_ref().is_none_or(|folders| folders.iter().any(|folder| folder.contains(&file)))
        };
        let names = Square::usual().filter_map(|square| square.name(name)).filter(may_be);
        let tiles: Arc<[String]> = names.filter(|name| self.shared.search.find(name).is_ok()).collect();
        let mut known = self.shared.tiles.write().unwrap_or_else(PoisonError::into_inner);
        if known.len() as u64 >= self.limits.images.patterns {
            known.clear();
        }
        Arc::clone(known.entry(name.to_owned()).or_insert(tiles))
    }

    /// The names in the folders that may contain the files of a tiled name, so that not every file has to be
    /// tried. `None` if each file must be tried.
    fn listed(&self, name: &str) -> Option<Vec<Arc<HashSet<String>>>> {
        let (folder, _) = name.rsplit_once('/').unwrap_or((".", ""));
        if Self::is_tiled(folder) || cfg!(not(unix)) || !self.shared.search.is_on_disk() {
            return None;
        }
        let first = Square::usual().next().and_then(|square| square.name(name))?;
        if matches!(self.shared.search.find(&first), Err(FileError::Outside)) {
            return None;
        }
        let folders = self.folders().iter().map(|root| root.join(folder));
        std::iter::once(PathBuf::from(folder)).chain(folders).map(|folder| self.names_in(folder)).collect()
    }

    /// The names of the files in a folder, in lower case; `None` if there are too many.
    fn names_in(&self, folder: PathBuf) -> Option<Arc<HashSet<String>>> {
        let known = self.shared.folders.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(names) = known.get(&folder) {
            return names.clone();
        }
        drop(known);
        let limits = &self.limits.images;
        let most = usize::try_from(limits.names).unwrap_or(usize::MAX);
        let mut names = HashSet::new();
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten().take(most.saturating_add(1)) {
            names.insert(entry.file_name().to_string_lossy().to_lowercase());
        }
        let names = (names.len() <= most).then(|| Arc::new(names));
        let mut known = self.shared.folders.write().unwrap_or_else(PoisonError::into_inner);
        if known.len() as u64 >= limits.patterns {
            known.clear();
        }
        known.entry(folder).or_insert(names).clone()
    }

    /// The bytes of samples that the cache holds, counted as in [`TextureCache::within`].
    pub fn held_bytes(&self) -> u64 {
        self.shared.budget.held()
    }

    fn slot(&self, name: &str, part: SubImage<'_>) -> Arc<Slot> {
        let part = other_than_first(part).map(|part| (name.to_owned(), part));
        // The maps are never left half-changed, so a panic elsewhere does not corrupt them.
        let slots = self.shared.slots.read().unwrap_or_else(PoisonError::into_inner);
        let known = match &part {
            None => slots.first.get(name),
            Some(key) => slots.others.get(key),
        };
        if let Some(slot) = known {
            return Arc::clone(slot);
        }
        drop(slots);
        let mut slots = self.shared.slots.write().unwrap_or_else(PoisonError::into_inner);
        slots.make_room(self.limits.images.names);
        Arc::clone(match part {
            None => slots.first.entry(name.to_owned()).or_default(),
            Some(key) => slots.others.entry(key).or_default(),
        })
    }

    /// Reads a texture. Also returns the memory that was reserved for reading.
    fn load(&self, name: &str, part: SubImage<'_>) -> (TextureResult, Option<Reservation<'_>>) {
        let (limits, budget) = (&self.limits, &self.shared.budget);
        let admission = Admission::by_budget(limits, budget);
        let loaded = self.read(name, part, &admission);
        let loaded = loaded.map(|image| Arc::new(Texture::of(image, limits)));
        (loaded, admission.into_reserved())
    }

    fn read(
        &self,
        name: &str,
        part: SubImage<'_>,
        admission: &Admission<'_>,
    ) -> Result<Decoded, Arc<LoadFailure>> {
        let file = self.shared.search.open(name).map_err(|error| match error {
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
        let unreadable = |error| failure(message(error), None);
        let file = file::to_read(file, &self.limits).map_err(unreadable)?;
        read_part(file, part, admission).map_err(unreadable)
    }
}

fn message(error: ImageError) -> String {
    format!("Could not read file {error}")
}
