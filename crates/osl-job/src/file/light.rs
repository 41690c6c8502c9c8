//! Writes rendered pictures: the light as displayed, or the light and all layers.

use super::software::{self, SOFTWARE};
use crate::Failure;
use osl_files::Unsaved;
use osl_image::{
    BitDepth, DataWindow, ExrCompression, ExrOptions, ImageFormat, Layer, LayerKind, PngOptions, SampleType,
    Transfer, png_samples,
};
use osl_ir::types::Type;
use osl_numeric::real::Real;
use osl_scene::render::{Curve, Picture};
use std::path::Path;

/// How the values of a picture are stored.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stored<'a> {
    /// The curve of PNG and JPEG files.
    pub curve: Curve,
    /// Stops, for PNG and JPEG files.
    pub exposure: f32,
    /// Whether EXR files have 16-bit floats.
    pub half: bool,
    /// The compression of EXR files.
    pub compression: ExrCompression,
    /// The larger picture that EXR files are a part of.
    pub part: Option<DataWindow>,
    /// The command line, for EXR files.
    pub command: Option<&'a str>,
}

impl Stored<'_> {
    /// The bytes or the file of a picture. `named` says its format, `path` its place; without a place, it
    /// stays in memory.
    pub fn file(self, picture: &Picture, named: &Path, path: Option<&Path>) -> Result<Unsaved, Failure> {
        if ImageFormat::of(named) == Some(ImageFormat::Exr) {
            return self.exr(picture, path);
        }
        let bytes = self.flat(picture, named)?;
        let file = path.map_or_else(|| Ok(Unsaved::in_memory()), Unsaved::new);
        file.and_then(|file| file.with(&bytes)).map_err(Failure::new)
    }

    fn exr(self, picture: &Picture, path: Option<&Path>) -> Result<Unsaved, Failure> {
        let layers: Vec<Layer<'_>> = picture
            .layers
            .iter()
            .map(|layer| Layer {
                name: &layer.name,
                kind: kind(layer.ty),
                planes: layer.planes.iter().map(Vec::as_slice).collect(),
            })
            .collect();
        let samples = if self.half { SampleType::Half } else { SampleType::Float };
        let options = ExrOptions {
            samples,
            compression: self.compression,
            part: self.part,
            software: Some(SOFTWARE),
            command: self.command,
        };
        let (width, height) = (picture.width, picture.height);
        let file = match path {
            None => osl_image::exr_in_memory(width, height, &layers, options),
            Some(path) => osl_image::exr_file(path, width, height, &layers, options),
        };
        file.map_err(Failure::new)
    }

    /// The light as it is displayed; in a TIFF, the light itself.
    fn flat(self, picture: &Picture, named: &Path) -> Result<Vec<u8>, Failure> {
        let is_shown = matches!(ImageFormat::of(named), Some(ImageFormat::Png | ImageFormat::Jpeg));
        let planes = self.planes(picture, is_shown)?;
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        let size = (picture.width, picture.height);
        osl_image::channel_bytes(named, size, &planes, software::named(Transfer::Srgb)).map_err(Failure::new)
    }

    /// The channels of the light, and the samples that a PNG file stores.
    pub fn samples(self, picture: &Picture) -> Result<(usize, Vec<u8>), Failure> {
        let planes = self.planes(picture, true)?;
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        let options = PngOptions { transfer: Transfer::Srgb, depth: BitDepth::Eight, software: None };
        Ok((planes.len(), png_samples(&planes, picture.width * picture.height, options)))
    }

    /// The planes of the light, as it is or as it is displayed.
    fn planes(self, picture: &Picture, is_shown: bool) -> Result<Vec<Vec<f32>>, Failure> {
        let Some(light) = picture.layers.first() else {
            return Err(Failure::new("the picture has no light"));
        };
        let factor = Real::exp2(self.exposure);
        let shown = |x: &f32| if is_shown { self.curve.apply(x * factor) } else { *x };
        Ok(light.planes.iter().map(|plane| plane.iter().map(shown).collect()).collect())
    }
}

fn kind(ty: Type) -> LayerKind {
    match ty {
        Type::COLOR => LayerKind::Color,
        Type::MATRIX => LayerKind::Matrix,
        ty if ty.is_triple() => LayerKind::Triple,
        _ => LayerKind::Scalar,
    }
}
