//! Reads recorded pictures and compares them.

use osl_image::{ImageData, read_image};
use std::path::Path;

/// The permitted difference of values, absolute and relative.
pub(crate) const NEAR: f32 = 1e-5;

/// How a picture differs from the recorded one: its size, the type of its samples, or its values.
pub(crate) fn difference(expected: &Path, got: &Path, tolerance: f32) -> Option<String> {
    let name = expected.file_name().unwrap_or_default().to_string_lossy();
    let (expected, got) = match (read_image(expected), read_image(got)) {
        (Ok(expected), Ok(got)) => (expected, got),
        (Err(error), _) | (_, Err(error)) => return Some(format!("{name}: {error}")),
    };
    let shape = |image: &ImageData| (image.width, image.height, image.channels.len(), image.stored);
    if shape(&expected) != shape(&got) {
        return Some(format!("{name} is {:?}, not {:?}", shape(&got), shape(&expected)));
    }
    let far = |(&a, &b): (&f32, &f32)| {
        !(a == b || (a - b).abs() <= tolerance + tolerance * a.abs() || (a.is_nan() && b.is_nan()))
    };
    let pairs = expected.samples.iter().zip(&got.samples);
    let worst = pairs
        .clone()
        .filter(|pair| far(*pair))
        .max_by(|(a, b), (c, d)| (*a - *b).abs().total_cmp(&(*c - *d).abs()));
    let count = pairs.filter(|pair| far(*pair)).count();
    worst.map(|(a, b)| format!("{name}: {count} samples differ, the most {b} from {a}"))
}
