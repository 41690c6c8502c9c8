//! An image as it is read: its pixels and metadata, which image of a file it is, and the opened file itself.

use std::io::{BufRead, Seek};
use std::path::Path;
use std::sync::Arc;

use crate::attributes::Attributes;
use crate::error::ImageError;
use crate::wrap::Wrap;

/// Which image of a file that holds several: a part of an EXR, a page of a TIFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SubImage<'a> {
    /// By index, from 0. EXR parts of deep data and a TIFF page's reduced copies are not counted.
    Index(usize),
    /// By the name of the part or page. The empty name is the first.
    Name(&'a str),
}

impl Default for SubImage<'_> {
    fn default() -> Self {
        Self::Index(0)
    }
}

/// The same with a name of its own, to keep.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum OwnedSubImage {
    /// By index, from 0.
    Index(usize),
    /// By name.
    Name(Arc<str>),
}

impl Default for OwnedSubImage {
    fn default() -> Self {
        Self::Index(0)
    }
}

impl OwnedSubImage {
    /// The same, borrowed.
    pub fn sub_image(&self) -> SubImage<'_> {
        match self {
            Self::Index(index) => SubImage::Index(*index),
            Self::Name(name) => SubImage::Name(name),
        }
    }
}

impl SubImage<'_> {
    /// The index of this image among images with these names.
    pub(crate) fn among<'n>(self, mut names: impl Iterator<Item = Option<&'n str>>) -> Option<usize> {
        match self {
            Self::Index(index) => names.nth(index).map(|_| index),
            Self::Name("") => names.next().map(|_| 0),
            Self::Name(wanted) => names.position(|name| name == Some(wanted)),
        }
    }

    /// The error of a file that lacks this image.
    pub(crate) fn absent(self, path: &Path, n_parts: usize) -> ImageError {
        let reason = match self {
            Self::Index(index) => format!("there is no subimage {index}, only {n_parts}"),
            Self::Name(name) => format!("there is no subimage named \"{}\"", name.escape_debug()),
        };
        ImageError::format(path, reason)
    }
}

/// How a file stores its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredType {
    /// 8-bit integers, read as fractions of 255.
    U8,
    /// 16-bit integers, read as fractions of 65535.
    U16,
    /// 32-bit integers (EXR), read as numbers: they count things and are no fractions.
    U32,
    /// Signed 8-bit integers, read as fractions of 127.
    I8,
    /// Signed 16-bit integers, read as fractions of 32767.
    I16,
    /// Signed 32-bit integers, read as fractions of 2147483647.
    I32,
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Float,
}

/// The pixels of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// One name for each channel: R, G, B, A first, then the others; for grey `Y` (and `A`).
    pub channels: Vec<String>,
    /// How the file stored the first channel.
    pub stored: StoredType,
    /// The wraps of s and t that the file specifies for use as a texture; [`Wrap::File`] if it does not. Only
    /// EXR and TIFF files can.
    pub wraps: (Wrap, Wrap),
    /// How many images the file holds; this is one of them.
    pub n_parts: usize,
    /// Further metadata.
    pub header: Header,
    /// `width * height * channels.len()` values, pixel by pixel, row 0 (the first scanline) first.
    pub samples: Vec<f32>,
}

/// The metadata of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The column and row of the first stored pixel.
    pub data_origin: (i32, i32),
    /// The whole image, if a file stores only a part of it: first column, first row, last column, last row.
    /// `None` if the stored pixels are the whole image.
    pub display_window: Option<[i32; 4]>,
    /// Columns and rows of the tiles in which the file stores its pixels; `None` if it stores rows.
    pub tile: Option<(usize, usize)>,
    /// The coarser levels of the file, from the larger to the smaller: width, height, samples.
    pub coarser: Vec<(usize, usize, Vec<f32>)>,
    /// Attributes by name.
    pub attributes: Attributes,
}

impl Header {
    /// Width and height of the whole image, if the file specifies them.
    pub(crate) fn whole_size(&self) -> Option<(usize, usize)> {
        let [x0, y0, x1, y1] = self.display_window?;
        let texels = |first: i32, last: i32| usize::try_from(i64::from(last) - i64::from(first) + 1);
        match (texels(x0, x1), texels(y0, y1)) {
            (Ok(columns @ 1..), Ok(rows @ 1..)) => Some((columns, rows)),
            _ => None,
        }
    }
}

impl ImageData {
    /// The values of one channel, row 0 first; empty if there is no such channel.
    pub fn plane(&self, channel: usize) -> Vec<f32> {
        let n_channels = self.channels.len().max(1);
        self.samples.iter().skip(channel).step_by(n_channels).copied().collect()
    }
}

/// The bytes of a file, from any source.
pub(crate) trait Source: BufRead + Seek {}
impl<T: BufRead + Seek> Source for T {}

/// What is known of a file before decoding. The path is used only in error messages.
pub(crate) struct EncodedFile<'a> {
    pub(crate) path: &'a Path,
    /// The first bytes of the file, as many as a header may have.
    pub(crate) head: Vec<u8>,
    /// Its length in bytes.
    pub(crate) length: u64,
    pub(crate) source: &'a mut dyn Source,
}

/// Default channel names for an image without any: grey for up to two channels, colors for three or more.
pub(crate) fn channel_names(n_channels: usize) -> Vec<String> {
    let known: &[&str] = if n_channels < 3 { &["Y", "A"] } else { &["R", "G", "B", "A"] };
    let name = |i: usize| known.get(i).map_or_else(|| format!("channel{i}"), |name| (*name).to_owned());
    (0..n_channels).map(name).collect()
}
