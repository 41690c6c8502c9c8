//! Pictures of a number at each point: EXR with a channel for each layer, TIFF with the largest of all
//! layers, PNG and JPEG with the largest as grey.

use super::software::{self, SOFTWARE};
use crate::Failure;
use osl_image::{ExrOptions, ImageFormat, Layer, LayerKind, Transfer, channel_bytes, write_exr};
use std::path::Path;

/// Writes named layers of a picture of this size. PNG and JPEG show the number `white` as white.
pub fn write(
    path: &Path,
    (width, height): (usize, usize),
    layers: &[(&str, Vec<f32>)],
    white: f32,
) -> Result<(), Failure> {
    if ImageFormat::of(path) == Some(ImageFormat::Exr) {
        let layers: Vec<Layer<'_>> = layers
            .iter()
            .map(|(name, values)| Layer { name, kind: LayerKind::Scalar, planes: vec![values] })
            .collect();
        let options = ExrOptions { software: Some(SOFTWARE), ..ExrOptions::default() };
        return write_exr(path, width, height, &layers, options).map_err(Failure::new);
    }
    let white = if ImageFormat::of(path) == Some(ImageFormat::Tiff) { 1.0 } else { white };
    let worst: Vec<f32> = largest(layers).iter().map(|number| number / white).collect();
    let bytes = channel_bytes(path, (width, height), &[&worst], software::named(Transfer::Linear))
        .map_err(Failure::new)?;
    osl_files::replace(path, &bytes).map_err(Failure::new)
}

/// The largest number of all layers at each point.
pub fn largest<Name>(layers: &[(Name, Vec<f32>)]) -> Vec<f32> {
    let points = layers.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
    let at = |point: usize| layers.iter().filter_map(move |(_, values)| values.get(point));
    (0..points).map(|point| at(point).fold(0.0_f32, |a, b| a.max(*b))).collect()
}
