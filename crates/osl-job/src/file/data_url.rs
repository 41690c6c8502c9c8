//! Pictures inside of pages: PNG files as data URLs.

use base64::Engine;
use osl_image::{BitDepth, PngOptions, Transfer, png_bytes};
use std::path::Path;

/// A PNG of one to four planes; nothing if no PNG has this size.
pub fn png((width, height): (usize, usize), planes: &[Vec<f32>], transfer: Transfer) -> Option<String> {
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let options = PngOptions { transfer, depth: BitDepth::Eight, software: None };
    let bytes = png_bytes(Path::new("picture"), width, height, &planes, options).ok()?;
    Some(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes)))
}
