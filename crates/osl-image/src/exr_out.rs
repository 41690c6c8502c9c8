//! Writing: several outputs as named channels of one EXR file.
//!
//! A layer called `result` with three color planes becomes the channels `result.R`, `result.G` and `result.B`,
//! the naming by which viewers group channels. It must not know where the planes come from.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes, LineOrder,
    Text, WritableImage,
};
use half::f16;

use crate::error::ImageError;
use crate::file;

/// What the planes of a layer mean, which decides the names of its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerKind {
    /// Three planes: `name.R`, `name.G`, `name.B`.
    Color,
    /// Three planes of a point, vector or normal: `name.X`, `name.Y`, `name.Z`.
    Triple,
    /// One plane: `name` alone. An integer output is stored like this, as the nearest `f32`: exact up to
    /// 2^24 in magnitude. (EXR's own integers are unsigned, and few viewers show them.)
    Scalar,
    /// Sixteen planes, row by row: `name.m00` to `name.m33`.
    Matrix,
}

impl LayerKind {
    /// The channel names after the dot, one for each plane, in plane order.
    pub fn suffixes(self) -> &'static [&'static str] {
        match self {
            Self::Color => &["R", "G", "B"],
            Self::Triple => &["X", "Y", "Z"],
            Self::Scalar => &[""],
            Self::Matrix => &[
                "m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23", "m30",
                "m31", "m32", "m33",
            ],
        }
    }
}

/// One output to be written.
///
/// **Shape**: `planes` holds one slice of `width * height` values for each of [`LayerKind::suffixes`], row 0
/// first.
#[derive(Clone, Debug)]
pub struct Layer<'a> {
    /// The name of the output. If it is empty, the channels have the bare names `R`, `G`, `B` and so on: the
    /// ones that every viewer shows first. A scalar needs a name.
    pub name: &'a str,
    /// What the planes mean.
    pub kind: LayerKind,
    /// The values, one plane for each channel.
    pub planes: Vec<&'a [f32]>,
}

/// How a sample is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleType {
    /// 32 bits, bit for bit what was given (under a lossless compression).
    #[default]
    Float,
    /// 16 bits, rounded to nearest; values beyond 65504 become infinite.
    Half,
}

/// How the file is compressed. All but [`ExrCompression::Pxr24`] are lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Stored plainly.
    None,
    /// Run lengths.
    Rle,
    /// Zip, each scanline alone.
    Zip1,
    /// Zip, sixteen scanlines together: small, and read by everything.
    #[default]
    Zip16,
    /// Wavelets, best for grainy images.
    Piz,
    /// Zip of floats cut to 24 bits: lossy for [`SampleType::Float`], exact for [`SampleType::Half`].
    Pxr24,
}

impl ExrCompression {
    /// Every name that [`ExrCompression::from_name`] knows, for help texts.
    pub const NAMES: [&'static str; 6] = ["none", "rle", "zip1", "zip16", "piz", "pxr24"];

    /// The compression of this name, in lower case; none for an unknown one.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "none" => Self::None,
            "rle" => Self::Rle,
            "zip1" => Self::Zip1,
            "zip16" => Self::Zip16,
            "piz" => Self::Piz,
            "pxr24" => Self::Pxr24,
            _ => return None,
        })
    }

    fn method(self) -> Compression {
        match self {
            Self::None => Compression::Uncompressed,
            Self::Rle => Compression::RLE,
            Self::Zip1 => Compression::ZIP1,
            Self::Zip16 => Compression::ZIP16,
            Self::Piz => Compression::PIZ,
            Self::Pxr24 => Compression::PXR24,
        }
    }
}

/// How [`write_exr`] stores its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrOptions {
    /// 32 or 16 bits.
    pub samples: SampleType,
    /// The method of compression.
    pub compression: ExrCompression,
}

/// Writes all layers as channels of one EXR file. Infinite values and nans are written as they are.
///
/// **Errors**: sizes or names that make no image, and what the disk refuses. The file at `path` is then as it
/// was before.
pub fn write_exr(
    path: &Path,
    width: usize,
    height: usize,
    layers: &[Layer<'_>],
    options: ExrOptions,
) -> Result<(), ImageError> {
    check_size(path, width, height)?;
    let mut channels = Vec::new();
    for layer in layers {
        for (name, plane) in channels_of(path, layer, width * height)? {
            channels.push(AnyChannel::new(name, samples(plane, options.samples)));
        }
    }
    if channels.is_empty() {
        return Err(ImageError::input(path, "no channels to write"));
    }
    let channels = AnyChannels::sort(channels.into());
    if let Some(name) = first_duplicate(&channels) {
        return Err(ImageError::input(path, format!("two channels are called `{name}`")));
    }
    let encoding = Encoding {
        compression: options.compression.method(),
        blocks: Blocks::ScanLines,
        // A fixed order, so that the same values give the same bytes.
        line_order: LineOrder::Increasing,
    };
    let layer = exr::prelude::Layer::new((width, height), LayerAttributes::default(), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    let encoded = Image::from_layer(layer).write().to_buffered(&mut bytes);
    encoded.map_err(|error| ImageError::format(path, format!("cannot encode EXR: {error}")))?;
    file::replace(path, bytes.get_ref())
}

/// Refuses sizes that no image has, or that EXR's signed 32-bit windows cannot express.
pub(crate) fn check_size(path: &Path, width: usize, height: usize) -> Result<(), ImageError> {
    let fits = |n: usize| (1..=i32::MAX as usize).contains(&n);
    if fits(width) && fits(height) && width.checked_mul(height).is_some() {
        Ok(())
    } else {
        Err(ImageError::input(path, format!("{width} x {height} is not a size an image can have")))
    }
}

/// Refuses a plane that is not one value for each pixel.
pub(crate) fn check_plane(path: &Path, what: &str, plane: &[f32], n_pixels: usize) -> Result<(), ImageError> {
    if plane.len() == n_pixels {
        return Ok(());
    }
    let got = plane.len();
    Err(ImageError::input(path, format!("{what} has {got} values for {n_pixels} pixels")))
}

fn channels_of<'a>(
    path: &Path,
    layer: &Layer<'a>,
    n_pixels: usize,
) -> Result<Vec<(Text, &'a [f32])>, ImageError> {
    let suffixes = layer.kind.suffixes();
    if layer.planes.len() != suffixes.len() {
        let (got, want) = (layer.planes.len(), suffixes.len());
        return Err(ImageError::input(path, format!("`{}` has {got} planes, not {want}", layer.name)));
    }
    let mut channels = Vec::with_capacity(suffixes.len());
    for (suffix, plane) in suffixes.iter().zip(&layer.planes) {
        let name = channel_name(layer.name, suffix);
        check_plane(path, &format!("channel `{name}`"), plane, n_pixels)?;
        channels.push((checked_text(path, &name)?, *plane));
    }
    Ok(channels)
}

fn channel_name(layer: &str, suffix: &str) -> String {
    match (layer, suffix) {
        ("", bare) | (bare, "") => bare.to_owned(),
        (layer, suffix) => format!("{layer}.{suffix}"),
    }
}

/// A name as EXR stores it: printable ASCII is what every reader takes, and 255 bytes are the most.
fn checked_text(path: &Path, name: &str) -> Result<Text, ImageError> {
    let plain = (1..=255).contains(&name.len()) && name.bytes().all(|b| b == b' ' || b.is_ascii_graphic());
    let text = if plain { Text::new_or_none(name) } else { None };
    text.ok_or_else(|| ImageError::input(path, format!("{name:?} cannot be a channel name")))
}

fn samples(plane: &[f32], sample_type: SampleType) -> FlatSamples {
    match sample_type {
        SampleType::Float => FlatSamples::F32(plane.to_vec()),
        SampleType::Half => FlatSamples::F16(plane.iter().map(|&v| f16::from_f32(v)).collect()),
    }
}

/// The first name that occurs twice in channels sorted by name.
fn first_duplicate(channels: &AnyChannels<FlatSamples>) -> Option<String> {
    let mut neighbours = channels.list.windows(2);
    neighbours.find(|pair| pair[0].name == pair[1].name).map(|pair| pair[0].name.to_string())
}
