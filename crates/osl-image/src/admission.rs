//! The memory of an image, which is known before any of it is allocated.
//!
//! A decoder reads the header, states the memory it needs ([`Claim`]), and continues if that is admitted
//! ([`Admission`]).

use std::cell::RefCell;
use std::path::Path;

use osl_limits::Limits;

use crate::budget::{Budget, Reservation};
use crate::decoded::{makes_levels, samples};
use crate::error::ImageError;
use crate::image::StoredType;
use crate::levels::samples_below;
use crate::texels::bytes_of;

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
