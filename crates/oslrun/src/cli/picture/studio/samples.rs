//! What the samples of a picture took, and the layer that shows where they are.

use crate::cli::picture::compare::color;
use osl_job::report::samples::Samples;

/// A picture of the number of samples.
pub(super) struct Counted {
    /// Red, green and blue of each pixel.
    pub(super) samples: Vec<u8>,
    /// How to read the colors.
    pub(super) words: String,
}

/// The cost of a picture, and whether it keeps its error bound. If the bound is missed, the run says so.
pub(super) fn notes(said: &Samples) -> Vec<String> {
    let mut notes: Vec<String> = said.text.lines().map(str::to_string).collect();
    if said.max_error.is_some() && said.missed.is_none() {
        notes.push(
            "the error bound is kept, as estimated from the samples: at most 0.1 % of the pixels exceed it"
                .to_string(),
        );
    }
    notes
}

/// How far up the colors a number of samples is: a step for each doubling.
fn level(samples: u32) -> f64 {
    if samples == 0 { 0.0 } else { 1.0 + f64::from(samples.ilog2()) }
}

/// The picture of the samples of each pixel; none if they are not known.
pub(super) fn shown(said: &Samples) -> Option<Counted> {
    let counts = &said.samples;
    let most = counts.iter().copied().max()?;
    let largest = level(most).max(1.0);
    let colors = counts.iter().flat_map(|n| color(level(*n), largest));
    let samples = colors.map(|x| (x * 255.0).round() as u8).collect();
    let none = counts.iter().filter(|n| **n == 0).count();
    let words = format!(
        "samples of each pixel: black 0 ({:.1} % are interpolated), then purple, red and yellow, white {most}; a step \
         of the same size for each doubling",
        100.0 * none as f64 / counts.len() as f64
    );
    Some(Counted { samples, words })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn colors_are_those_of_doublings() {
        let said = |samples: &[u32]| Samples { samples: samples.to_vec(), ..Samples::default() };
        let found = shown(&said(&[0, 1, 4, 0])).unwrap();
        assert_eq!((&found.samples[..3], &found.samples[6..9]), (&[0; 3][..], &[255; 3][..]));
        assert!(found.samples[3..6].iter().any(|byte| *byte > 0) && found.samples[3..6] != [255; 3]);
        assert!(
            found.words.contains("50.0 % are interpolated") && found.words.contains("white 4"),
            "{}",
            found.words
        );
        assert_eq!(shown(&said(&[0, 0])).unwrap().samples, [0; 6]);
        assert!(shown(&said(&[])).is_none());
    }
}
