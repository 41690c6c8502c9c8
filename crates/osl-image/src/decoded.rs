//! An image as a decoder returns it, with values of the type that the file stores.

use osl_limits::Limits;

use crate::image::{Header, ImageData, StoredType};
use crate::texels::Texels;
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
pub(crate) fn makes_levels(
    stored: (usize, usize),
    full: (usize, usize),
    n_channels: usize,
    limits: &Limits,
) -> bool {
    full == stored || samples((full.0, full.1), n_channels) <= limits.images.partial_samples
}

/// Number of samples of an image.
pub(crate) fn samples((width, height): (usize, usize), n_channels: usize) -> u64 {
    (width as u64).saturating_mul(height as u64).saturating_mul(n_channels as u64)
}
