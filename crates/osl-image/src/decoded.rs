//! An image as a decoder returns it, and its memory, which is known before any of it is allocated.
//!
//! A decoder reads the header, states the memory it needs ([`Claim`]), and continues if that is admitted
//! ([`Admission`]). This module must not know formats, files or lookups.

use std::cell::RefCell;
use std::path::Path;

use osl_limits::Limits;

use crate::budget::{Budget, Reservation};
use crate::error::ImageError;
use crate::image::{Header, ImageData, StoredType};
use crate::levels::samples_below;
use crate::texels::{Texels, bytes_of};
use crate::wrap::Wrap;

/// An image whose values have the type that the file stores.
#[derive(Clone, Debug)]
pub(crate) struct Decoded {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: Vec<String>,
    pub(crate) stored: StoredType,
    pub(crate) wraps: (Wrap, Wrap),
    pub(crate) n_parts: usize,
    /// The field `coarser` is empty; the levels are below.
    pub(crate) header: Header,
    pub(crate) texels: Texels,
    /// The coarser levels of the file: width, height, values.
    pub(crate) coarser: Vec<(usize, usize, Texels)>,
}

impl Decoded {
    /// An image with a single part and no further metadata.
    pub(crate) fn plain(
        (width, height): (usize, usize),
        channels: Vec<String>,
        (stored, texels): (StoredType, Texels),
    ) -> Self {
        Self {
            width,
            height,
            channels,
            stored,
            wraps: Default::default(),
            n_parts: 1,
            header: Header::default(),
            texels,
            coarser: Vec::new(),
        }
    }

    /// The image with all values as floats.
    pub(crate) fn into_image(self) -> ImageData {
        let Self { width, height, channels, stored, wraps, n_parts, mut header, texels, coarser } = self;
        let floats = |(width, height, texels): (usize, usize, Texels)| (width, height, texels.into_floats());
        header.coarser = coarser.into_iter().map(floats).collect();
        ImageData { width, height, channels, stored, wraps, n_parts, header, samples: texels.into_floats() }
    }

    /// Whether levels are computed if the file has none.
    pub(crate) fn makes_levels(&self, limits: &Limits) -> bool {
        let stored = (self.width, self.height);
        makes_levels(stored, self.header.whole_size().unwrap_or(stored), self.channels.len(), limits)
    }
}

impl From<ImageData> for Decoded {
    fn from(image: ImageData) -> Self {
        let ImageData { width, height, channels, stored, wraps, n_parts, mut header, samples } = image;
        let coarser = std::mem::take(&mut header.coarser).into_iter();
        let coarser = coarser.map(|(w, h, samples)| (w, h, Texels::Float(samples))).collect();
        let texels = Texels::Float(samples);
        Self { width, height, channels, stored, wraps, n_parts, header, texels, coarser }
    }
}

/// A file may store only a corner of an image of any size. Levels of the whole image are computed only up to
/// a limit.
fn makes_levels(stored: (usize, usize), full: (usize, usize), n_channels: usize, limits: &Limits) -> bool {
    full == stored || samples((full.0, full.1), n_channels) <= limits.images.partial_samples
}

fn samples((width, height): (usize, usize), n_channels: usize) -> u64 {
    (width as u64).saturating_mul(height as u64).saturating_mul(n_channels as u64)
}

/// The memory that an image needs, according to its header.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claim {
    /// Width and height of the stored pixels.
    pub(crate) size: (usize, usize),
    /// Width and height of the whole image.
    pub(crate) full: (usize, usize),
    pub(crate) n_channels: usize,
    /// The type in which values are kept.
    pub(crate) kept: StoredType,
    /// Whether levels must be computed because the file has none.
    pub(crate) makes_levels: bool,
    /// Bytes that the decoder needs besides the values.
    pub(crate) working: u64,
}

impl Claim {
    /// The bytes of the image with all levels. The levels of a file take less than a third of the finest, as
    /// computed ones do.
    fn kept_bytes(&self, limits: &Limits) -> u64 {
        let full = if self.makes_levels { self.full } else { self.size };
        let makes = makes_levels(self.size, full, self.n_channels, limits);
        let below = if makes { samples_below(full, self.n_channels) } else { 0 };
        let finest = samples(self.size, self.n_channels);
        finest.saturating_add(below).saturating_mul(bytes_of(self.kept))
    }
}

/// Decides whether an image may be decoded.
pub(crate) struct Admission<'a> {
    pub(crate) limits: &'a Limits,
    /// The budget from which the memory is taken.
    budget: Option<&'a Budget>,
    reserved: RefCell<Option<Reservation<'a>>>,
}

impl<'a> Admission<'a> {
    /// Admits an image within the limits.
    pub(crate) fn by_limits(limits: &'a Limits) -> Self {
        Self { limits, budget: None, reserved: RefCell::new(None) }
    }

    /// Admits an image within the limits, once the budget has room for it.
    pub(crate) fn by_budget(limits: &'a Limits, budget: &'a Budget) -> Self {
        Self { limits, budget: Some(budget), reserved: RefCell::new(None) }
    }

    /// Refuses an image that exceeds the limit for images, or that the texture memory can never hold;
    /// otherwise waits until there is room for it.
    pub(crate) fn admit(&self, path: &Path, claim: &Claim) -> Result<(), ImageError> {
        let limits = &self.limits.images;
        let samples = samples(claim.size, claim.n_channels);
        if samples > limits.samples {
            return Err(ImageError::TooLarge { path: path.to_owned(), samples, limit: limits.samples });
        }
        if samples == 0 {
            return Err(ImageError::format(path, "the image has no pixels"));
        }
        let kept = claim.kept_bytes(self.limits);
        if kept > limits.texture_memory {
            let (width, height) = claim.size;
            let what =
                format!("{width} x {height} pixels of {} channels, with coarser levels,", claim.n_channels);
            return Err(ImageError::memory(path, what, kept, limits.texture_memory, "texture_memory"));
        }
        let most = limits.texture_memory.saturating_add(limits.working_memory);
        let bytes = kept.saturating_add(claim.working);
        if bytes > most {
            let what = "decoding this image".to_owned();
            return Err(ImageError::memory(path, what, bytes, most, "working_memory"));
        }
        // Releases the reservation of an earlier claim for the same file, so that a thread does not wait for
        // itself.
        self.reserved.replace(None);
        self.reserved.replace(self.budget.map(|budget| budget.reserve(bytes)));
        Ok(())
    }

    /// Fails once the command has to stop.
    pub(crate) fn goes_on(&self, path: &Path) -> Result<(), ImageError> {
        self.limits.halted().map_or(Ok(()), |why| Err(ImageError::format(path, why)))
    }

    /// The reserved memory, which is released when this is dropped.
    pub(crate) fn into_reserved(self) -> Option<Reservation<'a>> {
        self.reserved.into_inner()
    }
}
