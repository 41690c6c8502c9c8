//! Writes the channels of one output as an image file, in the format given by the file's extension.
//!
//! Channels have the names that image tools expect: `Y` alone, else `R`, `G`, `B`, `A`, `channel4` and so on.

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use crate::error::ImageError;
use crate::exr_out::{ExrOptions, Layer, LayerKind, check_plane, check_size, exr_file};
use crate::exr_zip::SampleType;
use crate::file;
use crate::png_out::{BitDepth, PngOptions, png_bytes};
use crate::tiff_out::{Stored, tiff_bytes};
use crate::transfer::Transfer;
use osl_files::Unsaved;

/// How samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 0 to 255.
    Byte,
    /// 0 to 65535.
    Short,
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Float,
}

impl Samples {
    /// The sample type with a name: `uint8`, `uint16`, `half`, `float`.
    pub fn from_name(name: &str) -> Option<Samples> {
        Some(match name {
            "uint8" => Samples::Byte,
            "uint16" => Samples::Short,
            "half" => Samples::Half,
            "float" => Samples::Float,
            _ => return None,
        })
    }
}

/// Writes planes of ints as the channels of a file, which replaces its target once the result is saved. A
/// TIFF file without an explicit sample type stores the ints unchanged. Otherwise the range of an int,
/// −2147483647 to 2147483647, is mapped to that of the samples. An EXR file has half floats by default.
///
/// **Shape** and **Errors**: as for [`write_channels`].
pub fn write_ints(
    path: &Path,
    size: (usize, usize),
    planes: &[&[i32]],
    samples: Option<Samples>,
) -> Result<Unsaved, ImageError> {
    check_size(path, size.0, size.1)?;
    let format = ImageFormat::of(path);
    if samples.is_none() && format == Some(ImageFormat::Tiff) {
        if planes.iter().any(|plane| plane.len() != size.0 * size.1) {
            return Err(ImageError::input(path, "a plane does not have one value for each pixel"));
        }
        let bytes = pixels(planes, size.0 * size.1, i32::to_ne_bytes);
        let bytes = tiff_bytes(path, size, planes.len(), Stored::Int, bytes.as_flattened())?;
        return file::with(path, &bytes);
    }
    let fractions = |plane: &&[i32]| plane.iter().map(|n| *n as f32 * (1.0 / i32::MAX as f32)).collect();
    let fractions: Vec<Vec<f32>> = planes.iter().map(fractions).collect();
    let planes: Vec<&[f32]> = fractions.iter().map(Vec::as_slice).collect();
    let samples = samples.or((format == Some(ImageFormat::Exr)).then_some(Samples::Half));
    write_channels(path, size, &planes, samples)
}

/// The formats in which images are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR: layers of floats.
    Exr,
    /// TIFF: floats or integers.
    Tiff,
    /// PNG: 8 or 16 bits.
    Png,
    /// JPEG: 8 bits, with losses.
    Jpeg,
}

impl ImageFormat {
    /// The format that the ending of a file's name means; `None` if it means none of these.
    pub fn of(path: &Path) -> Option<ImageFormat> {
        Some(match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "exr" => ImageFormat::Exr,
            "tif" | "tiff" => ImageFormat::Tiff,
            "png" => ImageFormat::Png,
            "jpg" | "jpeg" => ImageFormat::Jpeg,
            _ => return None,
        })
    }
}

/// Writes planes as the channels of a file, which replaces its target once the result is saved: .exr, .tif,
/// .png or .jpg. A sample type that the format lacks is replaced by the nearest one. The default is floats;
/// PNG and JPEG store bytes, which go through the sRGB curve.
///
/// **Shape**: each plane has `width * height` values, row 0 first.
///
/// **Errors**: the format is unknown or cannot hold so many channels, sizes do not match, or the system
/// refuses.
pub fn write_channels(
    path: &Path,
    (width, height): (usize, usize),
    planes: &[&[f32]],
    samples: Option<Samples>,
) -> Result<Unsaved, ImageError> {
    check_size(path, width, height)?;
    for (i, plane) in planes.iter().enumerate() {
        check_plane(path, &format!("plane {i}"), plane, width * height)?;
    }
    match ImageFormat::of(path) {
        Some(ImageFormat::Exr) => exr(path, (width, height), planes, samples),
        _ => {
            let options = ChannelOptions { samples, transfer: Transfer::Srgb, software: None };
            file::with(path, &channel_bytes(path, (width, height), planes, options)?)
        }
    }
}

/// How [`channel_bytes`] stores channels.
#[derive(Clone, Copy, Debug)]
pub struct ChannelOptions {
    /// The type of the samples; the format's own by default. A sample type that the format lacks is replaced
    /// by the nearest one.
    pub samples: Option<Samples>,
    /// The curve between the values and the integers of PNG and JPEG.
    pub transfer: Transfer,
    /// The program that made the image, in a PNG: see [`PngOptions::software`].
    pub software: Option<&'static str>,
}

/// The bytes of a .tif, .png or .jpg file with these planes as its channels. PNG and JPEG store integers.
///
/// **Shape** and **Errors**: as for [`write_channels`].
pub fn channel_bytes(
    path: &Path,
    (width, height): (usize, usize),
    planes: &[&[f32]],
    options: ChannelOptions,
) -> Result<Vec<u8>, ImageError> {
    check_size(path, width, height)?;
    for (i, plane) in planes.iter().enumerate() {
        check_plane(path, &format!("plane {i}"), plane, width * height)?;
    }
    match ImageFormat::of(path) {
        Some(ImageFormat::Tiff) => {
            tiff(path, (width, height), planes, options.samples.unwrap_or(Samples::Float))
        }
        Some(ImageFormat::Png) => {
            let depth =
                if options.samples == Some(Samples::Short) { BitDepth::Sixteen } else { BitDepth::Eight };
            let ChannelOptions { transfer, software, .. } = options;
            png_bytes(path, width, height, planes, PngOptions { transfer, depth, software })
        }
        Some(ImageFormat::Jpeg) => jpeg(path, (width, height), planes, options.transfer),
        _ => Err(ImageError::input(path, "the name must end in .exr, .tif, .png or .jpg")),
    }
}

fn channel(index: usize, of: usize) -> String {
    match (index, of) {
        (0, 1) => "Y".to_string(),
        (0..=3, _) => ["R", "G", "B", "A"].get(index).map_or_else(String::new, ToString::to_string),
        _ => format!("channel{index}"),
    }
}

fn exr(
    path: &Path,
    (width, height): (usize, usize),
    planes: &[&[f32]],
    samples: Option<Samples>,
) -> Result<Unsaved, ImageError> {
    let names: Vec<String> = (0..planes.len()).map(|i| channel(i, planes.len())).collect();
    let layers: Vec<Layer<'_>> = names
        .iter()
        .zip(planes)
        .map(|(name, plane)| Layer { name, kind: LayerKind::Scalar, planes: vec![plane] })
        .collect();
    // EXR has no bytes or shorts: OpenImageIO stores half floats for both.
    let samples =
        if matches!(samples, None | Some(Samples::Float)) { SampleType::Float } else { SampleType::Half };
    exr_file(path, width, height, &layers, ExrOptions { samples, ..ExrOptions::default() })
}

/// The samples pixel by pixel.
fn pixels<S: Copy, T>(planes: &[&[S]], n_pixels: usize, convert: impl Fn(S) -> T) -> Vec<T> {
    (0..n_pixels).flat_map(|at| planes.iter().map(move |plane| plane[at])).map(convert).collect()
}

fn jpeg(
    path: &Path,
    (width, height): (usize, usize),
    planes: &[&[f32]],
    transfer: Transfer,
) -> Result<Vec<u8>, ImageError> {
    let color = match planes.len() {
        1 => ExtendedColorType::L8,
        3 => ExtendedColorType::Rgb8,
        n => return Err(ImageError::input(path, format!("a JPEG takes 1 or 3 channels, not {n}"))),
    };
    if width.max(height) > usize::from(u16::MAX) {
        return Err(ImageError::input(path, "a JPEG has at most 65535 pixels a side"));
    }
    let stored = pixels(planes, width * height, |x| transfer.byte(x));
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, 98);
    let encoded = encoder.write_image(&stored, width as u32, height as u32, color);
    encoded.map_err(|e| ImageError::format(path, format!("cannot encode JPEG: {e}")))?;
    Ok(bytes)
}

fn tiff(
    path: &Path,
    size: (usize, usize),
    planes: &[&[f32]],
    samples: Samples,
) -> Result<Vec<u8>, ImageError> {
    let n = size.0 * size.1;
    let write = |stored, bytes: &[u8]| tiff_bytes(path, size, planes.len(), stored, bytes);
    match samples {
        Samples::Byte => write(Stored::Byte, &pixels(planes, n, |x| Transfer::Linear.byte(x))),
        Samples::Short => {
            let short = |x| Transfer::Linear.quantize(x, 65535).to_ne_bytes();
            write(Stored::Short, pixels(planes, n, short).as_flattened())
        }
        Samples::Half | Samples::Float => {
            write(Stored::Float, pixels(planes, n, f32::to_ne_bytes).as_flattened())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::read_image;

    #[test]
    fn what_is_written_is_read_again() {
        let dir = tempfile::tempdir().expect("a folder");
        let planes: Vec<Vec<f32>> =
            (0..3).map(|c| (0..6).map(|i| (c * 6 + i) as f32 / 17.0).collect()).collect();
        for (name, samples, off) in [
            ("a.exr", None, 0.0),
            ("a.tif", None, 0.0),
            ("b.exr", Some(Samples::Half), 1e-3),
            ("b.tif", Some(Samples::Byte), 2.1e-3),
            ("c.tif", Some(Samples::Short), 1e-5),
        ] {
            for count in [1, 2, 3] {
                let path = dir.path().join(name);
                let slices: Vec<&[f32]> = planes.iter().take(count).map(Vec::as_slice).collect();
                write_channels(&path, (3, 2), &slices, samples).expect(name).save().expect("saved");
                let read = read_image(&path).expect(name);
                assert_eq!((read.width, read.height), (3, 2), "{name}");
                for (c, plane) in slices.iter().enumerate() {
                    for (got, wanted) in read.plane(c).iter().zip(*plane) {
                        assert!((got - wanted).abs() <= off, "{name} {count} {c}: {got} for {wanted}");
                    }
                }
            }
        }
        let gray: Vec<&[f32]> = planes.iter().take(1).map(Vec::as_slice).collect();
        for name in ["a.png", "a.jpg"] {
            write_channels(&dir.path().join(name), (3, 2), &gray, None).expect(name).save().expect("saved");
        }
        assert!(write_channels(&dir.path().join("a.gif"), (3, 2), &gray, None).is_err());
    }

    #[test]
    fn ints_are_exact_in_a_tiff_and_fractions_elsewhere() {
        let dir = tempfile::tempdir().expect("a folder");
        let plane = [0, 1, -1, 16_777_217, i32::MAX, i32::MIN];
        let path = dir.path().join("a.tif");
        write_ints(&path, (3, 2), &[&plane], None).expect("a TIFF").save().expect("saved");
        let bytes = std::fs::read(&path).expect("a file");
        let stored: Vec<i32> = bytes
            .get(8..32)
            .expect("samples")
            .chunks_exact(4)
            .map(|c| i32::from_le_bytes(c.try_into().expect("four bytes")))
            .collect();
        assert_eq!(stored, plane);
        for (name, samples, expected) in [
            ("a.exr", None, [0.0, 0.0, 0.0, 0.007_812_5, 1.0, -1.0]),
            ("b.exr", Some(Samples::Float), [0.0, 4.656_613e-10, -4.656_613e-10, 0.007_812_5, 1.0, -1.0]),
            ("b.tif", Some(Samples::Byte), [0.0, 0.0, 0.0, 2.0 / 255.0, 1.0, 0.0]),
        ] {
            let path = dir.path().join(name);
            write_ints(&path, (3, 2), &[&plane], samples).expect(name).save().expect("saved");
            let read = read_image(&path).expect(name);
            for (got, wanted) in read.plane(0).iter().zip(expected) {
                assert!((got - wanted).abs() <= 1e-6 * f32::abs(wanted), "{name}: {got} for {wanted}");
            }
        }
        assert!(write_ints(&path, (3, 3), &[&plane], None).is_err());
    }
}
