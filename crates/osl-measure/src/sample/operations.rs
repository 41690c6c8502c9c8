//! The cost of an evaluation, counted in operations and not measured by the clock, because an image must not
//! depend on it. This module must not know what is decided by the cost.

use super::image::Shading;
use osl_exec::{Frame, RunError, RunOptions};

/// What a point takes besides its operations, in additions.
const POINT: f64 = 20.0;
/// What a sample takes besides its operations, and each of its values. **Units:** nanoseconds.
const POINT_TIME: f64 = 0.8;
const PLANE_TIME: f64 = 1.0;

/// The operations of an evaluation, in additions: the mean over the centres of some pixels.
///
/// # Errors
/// A loop exceeds its budget.
pub(super) fn operations(shading: &Shading<'_>, pixels: &[u32]) -> Result<f64, RunError> {
    Ok(POINT + mean(shading, pixels, weight)?)
}

/// The time of an evaluation on one thread, as the operations of some pixels predict it. **Units:**
/// nanoseconds.
///
/// # Errors
/// A loop exceeds its budget.
pub(super) fn nanoseconds(shading: &Shading<'_>, pixels: &[u32]) -> Result<f64, RunError> {
    let planes = shading.planes().len() as f64;
    Ok(POINT_TIME + PLANE_TIME * planes + mean(shading, pixels, time)?)
}

/// The mean over some pixels of what their operations take.
fn mean(shading: &Shading<'_>, pixels: &[u32], of: impl Fn(&str) -> f64) -> Result<f64, RunError> {
    let options = RunOptions { profile: Some(|| std::time::Duration::ZERO), ..shading.options.clone() };
    let mut said = Frame::default();
    Shading { options: &options, ..shading.clone() }.centres(pixels, &mut said)?;
    let own: f64 = said.profile.iter().map(|entry| entry.lanes as f64 * of(&entry.name)).sum();
    Ok(own / pixels.len().max(1) as f64)
}

/// The time of an operation, in additions, by its name. Measured with `--profile`.
fn weight(name: &str) -> f64 {
    if name.starts_with("texture") || name.starts_with("environment") {
        return 150.0;
    }
    // A point of a batch may be alone in a branch or in a round.
    match name {
        "if" => return 10.0,
        "loop" => return 100.0,
        _ => {}
    }
    if !["noise", "pnoise"].iter().any(|start| name.starts_with(start)) {
        return 1.0;
    }
    let has = |part: &str| name.contains(part);
    let (is_triple, has_derivs) = (has("triple"), has("derivs"));
    let of_size = |sizes: [f64; 3]| match () {
        () if has("4d") => sizes[2],
        () if has("3d") => sizes[1],
        () => sizes[0],
    };
    match () {
        () if has("gabor") => 700.0,
        // Three noises with derivatives are not computed in vectors.
        () if is_triple && has_derivs => of_size([400.0, 750.0, 1700.0]),
        () if is_triple || has_derivs => of_size([10.0, 20.0, 45.0]),
        () => of_size([6.0, 12.0, 25.0]),
    }
}

/// The time of an operation in machine code, by its name. **Units:** nanoseconds. Fitted to the shaders of
/// the bench `max_error`.
fn time(name: &str) -> f64 {
    let is = |start: &str| name.starts_with(start);
    let has = |part: &str| name.contains(part);
    let axes = || match () {
        () if has("4d") => 4.0,
        () if has("3d") => 2.0,
        () => 1.0,
    };
    let is_of = |names: &[&str]| names.contains(&name.split('.').next().unwrap_or(name));
    match () {
        () if is("texture") || is("environment") => 200.0,
        () if is("spline") => 26.0,
        () if has("gabor") || is("noise.named") => 300.0,
        () if is("noise") && has("derivs") => 2.5 * axes(),
        () if is("noise.cell") || is("noise.hash") => 0.1 * axes(),
        () if is("noise") || is("pnoise") => 1.7 * axes() * if has("triple") { 2.0 } else { 1.0 },
        () if is("if") => 1.6,
        () if is("loop") => 0.9,
        () if is_of(&["sin", "cos", "tan", "asin", "acos", "atan2", "exp", "log", "pow"]) => 0.3,
        () => 0.01,
    }
}
