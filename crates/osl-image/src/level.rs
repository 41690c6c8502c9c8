//! One resolution of a texture: where its texels are.

use std::sync::OnceLock;

use crate::texels::Texels;

/// One resolution of a texture.
#[derive(Debug)]
pub(crate) struct Level {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// The number of texels across the texture's full width and height. `width * height` of them are stored,
    /// from `origin` on; all of them, unless the file stores only a part of the image.
    pub(crate) full: (usize, usize),
    pub(crate) origin: (i64, i64),
    pub(crate) n_channels: usize,
    /// Whether the file stores the level as one tile.
    pub(crate) one_tile: bool,
    /// The means of the first and the last row, one value per channel.
    poles: OnceLock<[Vec<f32>; 2]>,
    /// `width * height * n_channels` values, pixel by pixel, row 0 first.
    pub(crate) texels: Texels,
}

impl Level {
    /// A level that stores all of its texels; `None` if the number of samples does not match the size.
    pub(crate) fn whole(width: usize, height: usize, n_channels: usize, texels: Texels) -> Option<Self> {
        let expected = width.checked_mul(height).and_then(|n| n.checked_mul(n_channels));
        let fits = expected == Some(texels.len()) && texels.len() > 0;
        fits.then(|| Self::new(width, height, n_channels, texels))
    }

    /// A level whose samples match its size.
    pub(crate) fn new(width: usize, height: usize, n_channels: usize, texels: Texels) -> Self {
        let poles = OnceLock::new();
        Self {
            width,
            height,
            full: (width, height),
            origin: (0, 0),
            n_channels,
            one_tile: true,
            poles,
            texels,
        }
    }

    /// The means of the first and the last row.
    pub(crate) fn poles(&self) -> &[Vec<f32>; 2] {
        self.poles.get_or_init(|| [0, self.height.saturating_sub(1)].map(|row| self.mean_of_row(row)))
    }

    fn mean_of_row(&self, row: usize) -> Vec<f32> {
        let length = self.width * self.n_channels;
        let places = row * length..(row + 1) * length;
        let channel = |c: usize| {
            let column = places.clone().skip(c).step_by(self.n_channels);
            column.map(|at| f64::from(self.texels.get(at))).sum::<f64>()
        };
        (0..self.n_channels).map(|c| (channel(c) / self.width.max(1) as f64) as f32).collect()
    }

    /// The index of the first channel of a texel of the full image; `None` where the file stores nothing.
    pub(crate) fn texel(&self, x: usize, y: usize) -> Option<usize> {
        let place = |at: usize, origin: i64, n: usize| {
            usize::try_from(i64::try_from(at).ok()?.checked_sub(origin)?).ok().filter(|at| *at < n)
        };
        let (x, y) = (place(x, self.origin.0, self.width)?, place(y, self.origin.1, self.height)?);
        Some((y * self.width + x) * self.n_channels)
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.full == (self.width, self.height) && self.origin == (0, 0)
    }
}
