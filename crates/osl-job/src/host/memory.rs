//! Texts and images that the program gives, by path; no files.

use super::{Host, Within, clean};
use osl_files::{FileError, Roots, Stamp};
use osl_image::{ChannelOptions, ImageError, TextureCache, Transfer, channel_bytes};
use osl_limits::Limits;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Files in memory. All of them may be read, by the user and by shaders; paths are compared by their text,
/// without `.` and `..`. Copies share the contents.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, (Arc<[u8]>, Stamp)>,
    /// The last change of a file that may be a texture.
    images: u64,
}

/// The number of the next change, of any memory: two texts never have one stamp.
fn next_change() -> u64 {
    static CHANGES: AtomicU64 = AtomicU64::new(1);
    CHANGES.fetch_add(1, Ordering::Relaxed)
}

impl Memory {
    /// Sets the text of a source or a header, or of a group, a scene, a mesh or attributes.
    pub fn text(&mut self, path: impl AsRef<Path>, text: &str) {
        self.put(path.as_ref(), text.as_bytes().into());
    }

    /// Sets the bytes of an image in its format, or of another file that shaders read while they run.
    pub fn bytes(&mut self, path: impl AsRef<Path>, bytes: impl Into<Arc<[u8]>>) {
        self.images = self.put(path.as_ref(), bytes.into());
    }

    /// Sets a texture from its channels, each with a value for every pixel, row 0 first. The first three
    /// channels are red, green and blue if there are that many. Shaders get these values, in every bit.
    ///
    /// # Errors
    /// There is no channel, or one has another number of values than the image has pixels.
    pub fn image(
        &mut self,
        path: impl AsRef<Path>,
        (width, height): (usize, usize),
        channels: &[&[f32]],
    ) -> Result<(), ImageError> {
        let options = ChannelOptions { samples: None, transfer: Transfer::Linear, software: None };
        // TIFF has floats, and any number of channels.
        let bytes = channel_bytes(Path::new("the image.tif"), (width, height), channels, options)?;
        self.bytes(path, bytes);
        Ok(())
    }

    /// Removes a file.
    pub fn remove(&mut self, path: impl AsRef<Path>) {
        self.images = next_change();
        self.files.remove(&clean(path.as_ref()));
    }

    fn put(&mut self, path: &Path, bytes: Arc<[u8]>) -> u64 {
        let change = next_change();
        self.files.insert(clean(path), (bytes, Stamp::revision(change)));
        change
    }

    /// The bytes of a file.
    pub(super) fn get(&self, path: &Path) -> Option<&Arc<[u8]>> {
        self.files.get(&clean(path)).map(|(bytes, _)| bytes)
    }

    /// The bytes of a file, if they are not too many.
    pub(super) fn at_most(&self, path: &Path, most: u64) -> Option<Result<Vec<u8>, FileError>> {
        self.get(path).map(|bytes| match bytes.len() as u64 > most {
            true => Err(FileError::TooLong(most)),
            false => Ok(bytes.to_vec()),
        })
    }
}

impl Host for Memory {
    fn read(&self, path: &Path, _: Within<'_>, most: u64) -> Result<Vec<u8>, FileError> {
        self.at_most(path, most).unwrap_or(Err(FileError::NotFound))
    }

    fn stamp(&self, path: &Path) -> Option<Stamp> {
        match path.as_os_str().is_empty() {
            true => Some(Stamp::revision(self.images)),
            false => self.files.get(&clean(path)).map(|(_, stamp)| *stamp),
        }
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let folder = clean(folder);
        let inside = self.files.keys().filter(|path| path.parent() == Some(&folder));
        inside.filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned())).collect()
    }

    fn permit(&self, _: &Path, _: bool, _: &mut Roots) {}

    fn textures(&self, folders: Vec<PathBuf>, limits: &Limits) -> TextureCache {
        let files = self.clone();
        let places = move |name: &str| {
            let beside = folders.iter().find_map(|folder| files.get(&folder.join(name)));
            files.get(Path::new(name)).or(beside).cloned()
        };
        TextureCache::given(Arc::new(places), limits)
    }

    /// Stamps count changes, so the moment does not matter.
    fn now(&self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(1 << 32)
    }
}
