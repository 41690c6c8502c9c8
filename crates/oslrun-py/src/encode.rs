//! Arrays as the bytes of image files: textures for shaders, and pictures for notebooks.

use numpy::PyReadonlyArray1;
use osl_image::{
    BitDepth, ExrCompression, ExrOptions, Layer, LayerKind, PngOptions, Transfer, exr_in_memory, png_bytes,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::Path;

type Planes<'py> = Vec<PyReadonlyArray1<'py, f32>>;

fn slices<'a>(planes: &'a Planes<'_>) -> PyResult<Vec<&'a [f32]>> {
    planes
        .iter()
        .map(|plane| plane.as_slice().map_err(|why| PyValueError::new_err(why.to_string())))
        .collect()
}

/// A texture file in memory with the channels R; R, G, B; or R, G, B, A. Row 0 is on top.
#[pyfunction]
pub(crate) fn texture<'py>(
    py: Python<'py>,
    width: usize,
    height: usize,
    planes: Planes<'py>,
) -> PyResult<Bound<'py, PyBytes>> {
    let slices = slices(&planes)?;
    let (color, rest) = slices.split_at(if slices.len() >= 3 { 3 } else { 0 });
    let scalars = rest.iter().zip(if color.is_empty() { ["R"] } else { ["A"] });
    let mut layers: Vec<Layer<'_>> =
        scalars.map(|(plane, name)| Layer { name, kind: LayerKind::Scalar, planes: vec![plane] }).collect();
    if !color.is_empty() {
        layers.insert(0, Layer { name: "", kind: LayerKind::Color, planes: color.to_vec() });
    }
    let options = ExrOptions { compression: ExrCompression::None, ..ExrOptions::default() };
    let file = exr_in_memory(width, height, &layers, options);
    let file = file.map_err(|why| PyValueError::new_err(why.to_string()))?;
    Ok(PyBytes::new(py, &file.into_bytes()))
}

/// A PNG file of one plane as grey, or of three as the sRGB colors of linear values.
#[pyfunction]
pub(crate) fn png<'py>(
    py: Python<'py>,
    width: usize,
    height: usize,
    planes: Planes<'py>,
) -> PyResult<Bound<'py, PyBytes>> {
    let transfer = if planes.len() == 1 { Transfer::Linear } else { Transfer::Srgb };
    let options = PngOptions { transfer, depth: BitDepth::Eight, software: None };
    let bytes = png_bytes(Path::new("the picture"), width, height, &slices(&planes)?, options);
    Ok(PyBytes::new(py, &bytes.map_err(|why| PyValueError::new_err(why.to_string()))?))
}
