//! A texture in memory: the image, its coarser levels and its metadata.
//!
//! The levels come from the file. If it has none, they are computed when a filtered lookup first needs one,
//! so that unfiltered lookups never pay for them.

use std::sync::OnceLock;

use crate::attributes::Attributes;
use crate::decoded::Decoded;
use crate::image::{Header, ImageData, StoredType};
use crate::level::Level;
use crate::levels::{made, samples_below, sizes_below};
use crate::texels::Texels;
use crate::wrap::Wrap;
use osl_limits::Limits;

/// The smallest and the largest value of a channel; `None` if a value may be infinite or NaN.
pub type Reach = Option<[f32; 2]>;

/// An image with its mip-maps, ready for lookups from any thread.
#[derive(Debug)]
pub struct Texture {
    finest: Level,
    /// The levels of the file, or computed ones.
    coarser: OnceLock<Vec<Level>>,
    /// Whether levels are computed if the file has none.
    has_levels: bool,
    /// The color of all texels, if the file says that they are equal.
    constant: Option<[f32; 4]>,
    /// The smallest and the largest texel of each channel, see `reach`.
    pub(crate) extremes: OnceLock<Vec<Reach>>,
    channels: Vec<String>,
    stored: StoredType,
    wraps: (Wrap, Wrap),
    n_parts: usize,
    data_window: [i32; 4],
    display_window: [i32; 4],
    attributes: Attributes,
    /// Tells whether the command has to stop.
    limits: Limits,
}

impl Texture {
    /// Makes a texture of an image. An image whose sample count does not match its size becomes one without
    /// pixels, which is black everywhere.
    pub fn new(image: ImageData) -> Self {
        Self::of(Decoded::from(image), &Limits::default())
    }

    /// Makes a texture of a decoded file.
    pub(crate) fn of(image: Decoded, limits: &Limits) -> Self {
        let has_levels = image.makes_levels(limits);
        let Decoded { width, height, channels, stored, wraps, n_parts, header, texels, coarser } = image;
        let whole_size = header.whole_size();
        let Header { data_origin, display_window, tile, attributes, .. } = header;
        let n_channels = channels.len();
        let whole = Level::whole(width, height, n_channels, texels);
        let nothing = || Level::new(0, 0, n_channels, Texels::Float(Vec::new()));
        let mut finest = whole.unwrap_or_else(nothing);
        let last = |first: i32, n: usize| {
            first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX).saturating_sub(1))
        };
        let (x, y) = data_origin;
        let data_window = [x, y, last(x, finest.width), last(y, finest.height)];
        if let (Some([x0, y0, ..]), Some(whole)) = (display_window, whole_size) {
            finest.full = whole;
            finest.origin = (i64::from(x) - i64::from(x0), i64::from(y) - i64::from(y0));
        }
        let one_tile =
            |level: &Level| tile.is_none_or(|(width, height)| level.width <= width && level.height <= height);
        finest.one_tile = one_tile(&finest);
        let mut stored_levels = Vec::new();
        if finest.is_whole() {
            // Damage in one level does not affect the finer ones.
            let levels = coarser
                .into_iter()
                .map_while(|(width, height, texels)| Level::whole(width, height, n_channels, texels));
            stored_levels.extend(levels);
            stored_levels.iter_mut().for_each(|level| level.one_tile = one_tile(level));
        }
        let coarser = OnceLock::new();
        if !stored_levels.is_empty() {
            let _ = coarser.set(stored_levels);
        }
        let constant =
            attributes.numbers("oiio:ConstantColor").filter(|color| color.len() >= n_channels).map(|color| {
                std::array::from_fn(
                    |c| if c < n_channels { color.get(c).copied().unwrap_or(0.0) } else { 0.0 },
                )
            });
        let constant = constant.filter(|_| n_channels <= 4);
        let display_window = display_window.unwrap_or(data_window);
        Self {
            finest,
            coarser,
            has_levels,
            constant,
            extremes: OnceLock::new(),
            channels,
            stored,
            wraps,
            n_parts,
            data_window,
            display_window,
            attributes,
            limits: limits.clone(),
        }
    }

    /// Pixels in a row of the finest level.
    pub fn width(&self) -> usize {
        self.finest.width
    }

    /// Rows of the finest level.
    pub fn height(&self) -> usize {
        self.finest.height
    }

    /// The names of the channels, in the order used by lookups.
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// How the file stored its samples.
    pub fn stored(&self) -> StoredType {
        self.stored
    }

    /// The wraps of s and t that the file specifies; [`Wrap::File`] if it does not.
    pub fn wraps(&self) -> (Wrap, Wrap) {
        self.wraps
    }

    /// How many images the file holds; this texture is one of them.
    pub fn n_parts(&self) -> usize {
        self.n_parts
    }

    /// The number of resolutions that lookups choose from.
    pub fn n_levels(&self) -> usize {
        match self.coarser.get() {
            Some(levels) => levels.len() + 1,
            None if self.has_levels => sizes_below(self.finest.full).count() + 1,
            None => 1,
        }
    }

    /// The pixels that the file stores: first column, first row, last column, last row.
    pub fn data_window(&self) -> [i32; 4] {
        self.data_window
    }

    /// The pixels of the whole image: first column, first row, last column, last row.
    pub fn display_window(&self) -> [i32; 4] {
        self.display_window
    }

    /// Further metadata.
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }

    /// Whether the file says that it is an environment map.
    pub fn is_environment(&self) -> bool {
        self.attributes.text("textureformat").is_some_and(|format| format.ends_with("Environment"))
    }

    /// The index of the alpha channel.
    pub fn alpha(&self) -> Option<usize> {
        self.channels.iter().position(|name| name == "A")
    }

    /// The mean color, one value per channel: as stated in the file, or from the coarsest level. It is 0 if
    /// the file stores only a part of the image, as in the reference.
    pub fn average(&self) -> Option<Vec<f32>> {
        if let Some(color) = self.attributes.numbers("oiio:AverageColor") {
            return Some(color);
        }
        if !self.finest.is_whole() {
            return Some(vec![0.0; self.channels.len()]);
        }
        let coarsest = self.coarser().last().unwrap_or(&self.finest);
        let channels = 0..coarsest.texels.len();
        (coarsest.full == (1, 1)).then(|| channels.map(|at| coarsest.texels.get(at)).collect())
    }

    /// The color of all texels, one value per channel, if the file says that they are equal.
    pub fn constant(&self) -> Option<Vec<f32>> {
        self.attributes.numbers("oiio:ConstantColor")
    }

    /// The first channels of [`Texture::constant`].
    pub(crate) fn constant_color(&self) -> Option<&[f32; 4]> {
        self.constant.as_ref()
    }

    /// The bytes of the samples of all levels, whether they exist yet or not.
    pub(crate) fn bytes(&self) -> u64 {
        let below = match self.coarser.get() {
            Some(levels) => levels.iter().map(|level| level.texels.bytes()).sum(),
            None if self.has_levels => {
                let each = self.finest.texels.bytes() / (self.finest.texels.len() as u64).max(1);
                samples_below(self.finest.full, self.channels.len()).saturating_mul(each)
            }
            None => 0,
        };
        below.saturating_add(self.finest.texels.bytes()).saturating_add(self.attributes.bytes())
    }

    pub(crate) fn finest(&self) -> &Level {
        &self.finest
    }

    /// The levels below the finest: those of the file, or each half as large as the one before, down to a
    /// single pixel.
    pub(crate) fn coarser(&self) -> &[Level] {
        self.coarser.get_or_init(|| match self.has_levels {
            true => made(&self.finest, self.channels.len(), self.stored, &self.limits),
            false => Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, stored: StoredType, samples: Vec<f32>) -> ImageData {
        let wraps = (Wrap::File, Wrap::File);
        ImageData {
            width,
            height,
            channels: vec!["Y".to_owned()],
            stored,
            wraps,
            n_parts: 1,
            header: Header::default(),
            samples,
        }
    }

    fn texture(width: usize, height: usize, stored: StoredType, samples: Vec<f32>) -> Texture {
        Texture::new(image(width, height, stored, samples))
    }

    #[test]
    fn levels_of_odd_sizes_are_bilinear_samples() {
        let texture = texture(5, 1, StoredType::Float, vec![1.0, 2.0, 3.0, 4.0, 6.0]);
        let sizes: Vec<_> = texture.coarser().iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(2, 1), (1, 1)]);
        // The centers lie at texels 0.75 and 3.25, and then in the middle.
        assert_eq!(texture.coarser()[0].texels.clone().into_floats(), [1.75, 4.5]);
        assert_eq!(texture.coarser()[1].texels.clone().into_floats(), [3.125]);
        assert_eq!(texture.average(), Some(vec![3.125]));
        assert_eq!(texture.n_levels(), 3);
    }

    #[test]
    fn levels_stop() {
        let limits = Limits::default();
        limits.halt(osl_limits::Halt::Memory);
        let texture = Texture::of(Decoded::from(image(4, 4, StoredType::Float, vec![1.0; 16])), &limits);
        assert!(texture.coarser().is_empty());
    }

    /// A part of 2 x 1 texels, at (1, 1) of an image of 4 x 2.
    fn part(display_window: [i32; 4]) -> Texture {
        let mut image = image(2, 1, StoredType::Float, vec![4.0, 8.0]);
        image.header.data_origin = (1, 1);
        image.header.display_window = Some(display_window);
        Texture::new(image)
    }

    #[test]
    fn a_part_of_an_image_has_black_around_it() {
        let texture = part([0, 0, 3, 1]);
        assert_eq!((texture.data_window(), texture.display_window()), ([1, 1, 2, 1], [0, 0, 3, 1]));
        assert_eq!((texture.n_levels(), texture.bytes()), (3, (2 + 2 + 1) * 4));
        assert_eq!(texture.coarser()[0].texels.clone().into_floats(), [1.0, 2.0]);
        assert_eq!(texture.average(), Some(vec![0.0]));
    }

    #[test]
    fn a_claim_of_any_size_takes_no_memory() {
        let texture = part([-i32::MAX, -i32::MAX, i32::MAX, i32::MAX]);
        assert_eq!((texture.n_levels(), texture.bytes(), texture.coarser().len()), (1, 8, 0));
        // A window without pixels counts as no window.
        let texture = part([5, 5, 4, 4]);
        assert_eq!(texture.finest().full, (2, 1));
    }

    #[test]
    fn levels_of_the_file_are_taken() {
        let mut image = image(4, 1, StoredType::Float, vec![1.0; 4]);
        image.header.coarser = vec![(2, 1, vec![5.0, 6.0]), (1, 1, vec![7.0]), (1, 1, vec![])];
        let texture = Texture::new(image);
        assert_eq!((texture.n_levels(), texture.bytes()), (3, 28));
        assert_eq!(texture.coarser()[0].texels.clone().into_floats(), [5.0, 6.0]);
        assert_eq!(texture.average(), Some(vec![7.0]));
    }

    #[test]
    fn bytes_are_averaged_to_bytes_with_halves_up() {
        let of = |bytes: [u8; 4]| {
            let samples = bytes.iter().map(|&b| f32::from(b) / 255.0).collect();
            (texture(2, 2, StoredType::U8, samples).coarser()[0].texels.get(0) * 255.0).round()
        };
        assert_eq!(of([0, 0, 1, 1]), 1.0);
        assert_eq!(of([0, 0, 0, 1]), 0.0);
        assert_eq!(of([2, 2, 3, 3]), 3.0);
        assert_eq!(of([255, 255, 255, 255]), 255.0);
    }

    #[test]
    fn bytes_are_those_of_all_levels() {
        for (width, height) in [(5, 1), (1, 1), (7, 12), (16, 16)] {
            let texture = texture(width, height, StoredType::Float, vec![0.0; width * height]);
            let levels = std::iter::once(texture.finest()).chain(texture.coarser());
            assert_eq!(texture.bytes(), levels.map(|level| level.texels.len() as u64 * 4).sum::<u64>());
        }
    }

    #[test]
    fn a_misfit_has_no_pixels() {
        let texture = texture(5, 1, StoredType::Float, vec![1.0]);
        assert_eq!((texture.width(), texture.coarser().len(), texture.bytes()), (0, 0, 0));
        assert_eq!(texture.average(), None);
    }
}
