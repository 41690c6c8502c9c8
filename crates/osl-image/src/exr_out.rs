//! Writes several outputs as named channels of one EXR file.
//!
//! A layer `result` with three color planes becomes the channels `result.R`, `result.G` and `result.B`, the
//! naming by which viewers group channels.

use std::path::Path;

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, Chromaticities, IntegerBounds, LineOrder, Text,
};
use exr::meta::header::{Header, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use half::f16;
use rayon::prelude::*;

use crate::error::ImageError;
use crate::exr_zip::{self, SampleType};
use crate::file;
use osl_files::Unsaved;

/// The meaning of a layer's planes, which determines the names of its channels.
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

    /// The names of the channels of a layer, in plane order.
    pub fn channels(self, layer: &str) -> Vec<String> {
        self.suffixes().iter().map(|suffix| channel_name(layer, suffix)).collect()
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

/// How the file is compressed. All but [`ExrCompression::Pxr24`] are lossless.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Uncompressed.
    None,
    /// Run-length encoding.
    Rle,
    /// Zip, each scanline alone.
    Zip1,
    /// Zip, sixteen scanlines together: small, and read by everything.
    #[default]
    Zip16,
    /// Wavelets, best for grainy images.
    Piz,
    /// Zip of floats truncated to 24 bits: lossy for [`SampleType::Float`], exact for [`SampleType::Half`].
    Pxr24,
}

impl ExrCompression {
    /// Every name accepted by [`ExrCompression::from_name`], for help texts.
    pub const NAMES: [&'static str; 6] = ["none", "rle", "zip1", "zip16", "piz", "pxr24"];

    /// The compression with this lower-case name; `None` if it is unknown.
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
pub struct ExrOptions<'a> {
    /// 32 or 16 bits.
    pub samples: SampleType,
    /// The method of compression.
    pub compression: ExrCompression,
    /// The larger image that the pixels are a part of; `None` if they are the whole image.
    pub part: Option<DataWindow>,
    /// The program that made the image: the attribute `software`. It is to have ASCII characters only.
    pub software: Option<&'static str>,
    /// The command that made the image: the attribute [`COMMAND`]. Control characters become spaces.
    pub command: Option<&'a str>,
}

/// The least number of samples for which several threads are worth starting.
const MANY: usize = 1 << 17;
/// The name of the attribute with the command that made an image.
pub const COMMAND: &str = "oslrun:command";
/// The primaries and the white of Rec. 709 (ITU-R BT.709-6), the space of colors in shaders.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// A place in a larger image: the data window of a file whose display window is the larger image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataWindow {
    /// Column and row of the first pixel.
    pub first: (usize, usize),
    /// Columns and rows of the larger image.
    pub of: (usize, usize),
}

/// Writes all layers as channels of one EXR file. Infinities and NaN are written unchanged. A file with
/// colors says that they are linear with the primaries of Rec. 709 (`chromaticities`).
///
/// **Errors**: sizes or names do not form an image, or the system refuses. The file at `path` is then
/// unchanged.
pub fn write_exr(
    path: &Path,
    width: usize,
    height: usize,
    layers: &[Layer<'_>],
    options: ExrOptions<'_>,
) -> Result<(), ImageError> {
    Ok(exr_file(path, width, height, layers, options)?.save()?)
}

/// The file for [`write_exr`], which replaces its target once it is saved.
///
/// **Errors**: as for [`write_exr`].
pub fn exr_file(
    path: &Path,
    width: usize,
    height: usize,
    layers: &[Layer<'_>],
    options: ExrOptions<'_>,
) -> Result<Unsaved, ImageError> {
    whole(|| file::unsaved(path), path, (width, height), layers, options)
}

/// The file for [`write_exr`] in memory.
///
/// **Errors**: sizes or names do not form an image.
pub fn exr_in_memory(
    width: usize,
    height: usize,
    layers: &[Layer<'_>],
    options: ExrOptions<'_>,
) -> Result<Unsaved, ImageError> {
    whole(|| Ok(Unsaved::in_memory()), Path::new("the picture"), (width, height), layers, options)
}

fn whole(
    file: impl FnOnce() -> Result<Unsaved, ImageError>,
    path: &Path,
    (width, height): (usize, usize),
    layers: &[Layer<'_>],
    options: ExrOptions<'_>,
) -> Result<Unsaved, ImageError> {
    check_size(path, width, height)?;
    let shapes: Vec<(&str, LayerKind)> = layers.iter().map(|l| (l.name, l.kind)).collect();
    for layer in layers {
        check_planes(path, layer, width * height)?;
    }
    let mut planes = Some(layers.iter().flat_map(|l| l.planes.iter().copied()).collect::<Vec<&[f32]>>());
    rows_into(file, path, (width, height), &shapes, options, || Ok::<_, ImageError>(planes.take()))
}

/// The number of rows in a piece of [`write_exr_rows`] must be a multiple of this, except in the last piece.
pub const ROWS_TOGETHER: usize = 32;

/// Writes an EXR file in pieces, starting with the first row. `next` returns the planes of all layers for the
/// next rows, a multiple of [`ROWS_TOGETHER`] until the last piece. It is called while the previous piece is
/// compressed and written. The file replaces its target once the result is saved.
///
/// **Errors**: those of [`write_exr`] and those of `next`. The file at `path` is then unchanged.
pub fn write_exr_rows<P: AsRef<[f32]> + Sync + Send, E: From<ImageError> + Send>(
    path: &Path,
    (width, height): (usize, usize),
    layers: &[(&str, LayerKind)],
    options: ExrOptions<'_>,
    next: impl FnMut() -> Result<Option<Vec<P>>, E> + Send,
) -> Result<Unsaved, E> {
    rows_into(|| file::unsaved(path), path, (width, height), layers, options, next)
}

fn rows_into<P: AsRef<[f32]> + Sync + Send, E: From<ImageError> + Send>(
    file: impl FnOnce() -> Result<Unsaved, ImageError>,
    path: &Path,
    (width, height): (usize, usize),
    layers: &[(&str, LayerKind)],
    options: ExrOptions<'_>,
    mut next: impl FnMut() -> Result<Option<Vec<P>>, E> + Send,
) -> Result<Unsaved, E> {
    check_size(path, width, height)?;
    let (header, order) = header(path, (width, height), layers, BlockDescription::ScanLines, options)?;
    let mut file = file()?;
    let mut stopped: Option<E> = None;
    let headers = smallvec::smallvec![header];
    let written = exr::block::writer::write_chunks_with(file.sink(), headers, true, |meta, chunks| {
        let mut row = 0;
        let mut piece = next();
        loop {
            let planes = match piece {
                Ok(Some(planes)) => planes,
                Ok(None) => return Ok(()),
                Err(error) => {
                    stopped = Some(error);
                    return Err(exr::error::Error::Aborted);
                }
            };
            let rows = planes.first().map_or(0, |p| p.as_ref().len() / width);
            let ordered: Vec<&[f32]> =
                order.iter().filter_map(|i| planes.get(*i)).map(|p| p.as_ref()).collect();
            let whole = rows > 0 && (rows % ROWS_TOGETHER == 0 || row + rows == height);
            if !whole || ordered.len() != order.len() || ordered.iter().any(|p| p.len() != rows * width) {
                return Err(exr::error::Error::Invalid("piece of the image".into()));
            }
            let mut write = || write_rows(&meta, chunks, &ordered, row, rows, options.samples);
            // After the last rows there is nothing to compute.
            let (result, following) = match row + rows < height {
                true => rayon::join(write, &mut next),
                false => (write(), next()),
            };
            result?;
            row += rows;
            piece = following;
        }
    });
    match stopped {
        Some(error) => Err(error),
        None => {
            written.map_err(|e| ImageError::format(path, format!("cannot encode EXR: {e}")))?;
            Ok(file)
        }
    }
}

/// The header of the file, and the plane of each of its channels, which are sorted by name.
pub(crate) fn header(
    path: &Path,
    size: (usize, usize),
    layers: &[(&str, LayerKind)],
    blocks: BlockDescription,
    options: ExrOptions<'_>,
) -> Result<(Header, Vec<usize>), ImageError> {
    let mut names = Vec::new();
    for (layer, kind) in layers {
        for suffix in kind.suffixes() {
            names.push(checked_text(path, &channel_name(layer, suffix))?);
        }
    }
    if names.is_empty() {
        return Err(ImageError::input(path, "no channels to write"));
    }
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by(|a, b| names[*a].cmp(&names[*b]));
    if let Some(pair) = order.windows(2).find(|pair| names[pair[0]] == names[pair[1]]) {
        return Err(ImageError::input(path, format!("two channels are called `{}`", names[pair[0]])));
    }
    let sample_type = match options.samples {
        SampleType::Float => exr::meta::attribute::SampleType::F32,
        SampleType::Half => exr::meta::attribute::SampleType::F16,
    };
    let channels =
        order.iter().map(|i| ChannelDescription::new(names[*i].clone(), sample_type, false)).collect();
    // A fixed order of lines, so that the same values give the same bytes.
    let software_name = options.software.map(|name| checked_text(path, name)).transpose()?;
    // The map has one element at most: more would be written in an order that differs from run to run.
    let other = options
        .command
        .map(|text| (Text::from(COMMAND), AttributeValue::Text(printable(text))))
        .into_iter()
        .collect();
    let mut header = Header::new(Text::from(""), size, channels)
        .with_attributes(LayerAttributes { software_name, other, ..LayerAttributes::default() })
        .with_encoding(options.compression.method(), blocks, LineOrder::Increasing);
    let has_colors = layers.iter().any(|(_, kind)| *kind == LayerKind::Color);
    header.shared_attributes.chromaticities = has_colors.then_some(REC_709);
    match options.part {
        Some(part) => Ok((placed(path, header, size, part)?, order)),
        None => Ok((header, order)),
    }
}

/// The header of a part of a larger image.
fn placed(path: &Path, header: Header, size: (usize, usize), part: DataWindow) -> Result<Header, ImageError> {
    let DataWindow { first, of } = part;
    check_size(path, of.0, of.1)?;
    let fits = |first: usize, n: usize, of: usize| first.checked_add(n).is_some_and(|end| end <= of);
    if !fits(first.0, size.0, of.0) || !fits(first.1, size.1, of.1) {
        return Err(ImageError::input(path, "the pixels are not a part of the larger image"));
    }
    // `check_size` made sure that all of them fit.
    let position = Vec2(first.0 as i32, first.1 as i32);
    let whole = IntegerBounds::new(Vec2(0, 0), Vec2(of.0, of.1));
    Ok(header.with_position(position).with_display_window(whole))
}

/// Compresses rows on all threads and writes them.
fn write_rows(
    meta: &MetaData,
    chunks: &mut impl ChunksWriter,
    planes: &[&[f32]],
    first: usize,
    rows: usize,
    samples: SampleType,
) -> exr::error::UnitResult {
    let Some(header) = meta.headers.first() else { return Ok(()) };
    let (width, together) = (header.layer_size.width(), header.compression.scan_lines_per_block());
    let compress = |block: usize| {
        let lines = block * together..rows.min((block + 1) * together);
        if matches!(header.compression, Compression::ZIP1 | Compression::ZIP16) {
            let row = |line: usize| planes.iter().map(move |plane| &plane[line * width..][..width]);
            let all: Vec<&[f32]> = lines.clone().flat_map(row).collect();
            let y_coordinate = header.own_attributes.layer_position.y() + (first + lines.start) as i32;
            let compressed_pixels_le = exr_zip::block(&all, samples);
            let block = CompressedScanLineBlock { y_coordinate, compressed_pixels_le };
            return Ok(Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) });
        }
        let mut data = Vec::with_capacity(lines.len() * width * header.channels.bytes_per_pixel);
        for line in lines.clone() {
            for plane in planes {
                let values = &plane[line * width..][..width];
                match samples {
                    SampleType::Float => values.iter().for_each(|v| data.extend(v.to_ne_bytes())),
                    SampleType::Half => {
                        values.iter().for_each(|v| data.extend(f16::from_f32(*v).to_ne_bytes()));
                    }
                }
            }
        }
        let index = BlockIndex {
            layer: 0,
            pixel_position: Vec2(0, first + lines.start),
            pixel_size: Vec2(width, lines.len()),
            level: Vec2(0, 0),
        };
        UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)
    };
    let blocks = 0..rows.div_ceil(together);
    let compressed: Vec<exr::error::Result<_>> = match rows * width * planes.len() < MANY {
        true => blocks.map(compress).collect(),
        false => blocks.into_par_iter().map(compress).collect(),
    };
    for (block, chunk) in compressed.into_iter().enumerate() {
        chunks.write_chunk(first / together + block, chunk?)?;
    }
    Ok(())
}

/// Refuses sizes that no image has, or that do not fit EXR's signed 32-bit windows.
pub(crate) fn check_size(path: &Path, width: usize, height: usize) -> Result<(), ImageError> {
    let fits = |n: usize| (1..=i32::MAX as usize).contains(&n);
    if fits(width) && fits(height) && width.checked_mul(height).is_some() {
        Ok(())
    } else {
        Err(ImageError::input(path, format!("{width} x {height} is not a size an image can have")))
    }
}

/// Refuses a plane that does not have one value per pixel.
pub(crate) fn check_plane(path: &Path, what: &str, plane: &[f32], n_pixels: usize) -> Result<(), ImageError> {
    if plane.len() == n_pixels {
        return Ok(());
    }
    let got = plane.len();
    Err(ImageError::input(path, format!("{what} has {got} values for {n_pixels} pixels")))
}

pub(crate) fn check_planes(path: &Path, layer: &Layer<'_>, n_pixels: usize) -> Result<(), ImageError> {
    let suffixes = layer.kind.suffixes();
    if layer.planes.len() != suffixes.len() {
        let (got, want) = (layer.planes.len(), suffixes.len());
        return Err(ImageError::input(path, format!("`{}` has {got} planes, not {want}", layer.name)));
    }
    suffixes.iter().zip(&layer.planes).try_for_each(|(suffix, plane)| {
        check_plane(path, &format!("channel `{}`", channel_name(layer.name, suffix)), plane, n_pixels)
    })
}

fn channel_name(layer: &str, suffix: &str) -> String {
    match (layer, suffix) {
        ("", bare) | (bare, "") => bare.to_owned(),
        (layer, suffix) => format!("{layer}.{suffix}"),
    }
}

/// A name as EXR stores it: printable ASCII, which every reader accepts, and at most 255 bytes.
/// A text for an attribute, in UTF-8.
fn printable(text: &str) -> Text {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    Text::from_slice_unchecked(text.as_bytes())
}

fn checked_text(path: &Path, name: &str) -> Result<Text, ImageError> {
    let plain = (1..=255).contains(&name.len()) && name.bytes().all(|b| b == b' ' || b.is_ascii_graphic());
    let text = if plain { Text::new_or_none(name) } else { None };
    text.ok_or_else(|| ImageError::input(path, format!("{name:?} cannot be a channel name")))
}
