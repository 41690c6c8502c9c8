//! The layer that shows rounding errors: the decimal digits that each pixel has lost, as
//! `oslrun stability --error-map` shows them.

use crate::cli::measure::stability::{self, WHITE};
use osl_image::{BitDepth, PngOptions, Transfer, png_samples};
use osl_job::file::output;
use osl_job::source::reads::Reads;
use osl_job::{Failure, Image, Sink};
use osl_studio::Picture;
use serde_json::json;

/// The seconds that a picture may take.
pub(super) const BUDGET: f64 = 10.0;

/// The picture of an output's lost digits.
pub(super) fn picture(image: &Image, reads: &mut Reads, sink: &mut dyn Sink) -> Result<Picture, Failure> {
    let Some([name, ..]) = image.shader.outputs.as_deref() else { return Err(Failure::new(output::EMPTY)) };
    let lost = stability::lost(image, reads, sink)?;
    let (width, height) = image.points.grid;
    let shown: Vec<f32> = lost.iter().map(|digits| digits / WHITE).collect();
    let options = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
    let samples = png_samples(&[&shown], width * height, options);
    let note = json!({ "severity": "note", "message": words(&lost, width) });
    Ok(Picture {
        output: name.clone(),
        width,
        height,
        channels: 1,
        samples,
        messages: vec![note],
        ..Picture::default()
    })
}

/// The largest number of digits, its pixel, and how to read the picture.
fn words(lost: &[f32], width: usize) -> String {
    let scale = format!("black is none, white {WHITE}; a float has 7.2");
    let worst = lost.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        Some((at, digits)) if digits > 0.0 => {
            let mean = lost.iter().map(|digits| f64::from(*digits)).sum::<f64>() / lost.len() as f64;
            let (x, y) = (at % width.max(1), at / width.max(1));
            format!(
                "decimal digits lost to rounding: at most {digits:.1}, at pixel ({x}, {y}), and {mean:.1} on average; {scale}"
            )
        }
        _ => format!("no digit is lost to rounding; {scale}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_loss_has_its_pixel() {
        assert_eq!(
            words(&[0.0, 1.0, 0.5, 2.5], 2),
            "decimal digits lost to rounding: at most 2.5, at pixel (1, 1), and 1.0 on average; black is none, white 8; \
             a float has 7.2"
        );
        assert_eq!(
            words(&[0.0; 4], 2),
            "no digit is lost to rounding; black is none, white 8; a float has 7.2"
        );
    }
}
