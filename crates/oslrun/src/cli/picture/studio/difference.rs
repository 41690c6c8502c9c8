//! The layer that shows how the picture differs from a pinned one.
//!
//! It is computed from the values, so that a difference shows also where both pictures are black or white.
//! The numbers and the colors are those of `oslrun compare`.

use crate::cli::picture::compare::{At, Side, brief, color, measure};
use osl_exec::Plane;
use osl_job::Failure;

/// The values of a picture.
pub(super) struct Pinned {
    /// The name of its output.
    output: String,
    side: Side,
}

/// A picture of a difference.
pub(super) struct Differing {
    /// Red, green and blue of each pixel.
    pub(super) samples: Vec<u8>,
    /// The numbers, and how to read the colors.
    pub(super) words: String,
}

impl Pinned {
    /// The components of an output in a picture of this size.
    pub(super) fn of(output: &str, size: (usize, usize), components: &[&Plane]) -> Pinned {
        // Outputs with different names are compared, too.
        let channels = components.iter().map(|plane| (plane.component.to_string(), (*plane).clone()));
        Pinned { output: output.to_string(), side: Side::of_planes(output, size, channels) }
    }

    /// How another picture differs from this one.
    pub(super) fn difference(&self, now: &Pinned) -> Result<Differing, Failure> {
        let [before, after] = [self, now].map(|one| one.side.channels.len());
        if before != after {
            let parts = |n: usize| if n == 1 { "1 component".to_string() } else { format!("{n} components") };
            return Err(Failure::new(format!(
                "the pinned picture of `{}` has {}, and `{}` has {}: show an output of the same type, or pin this one",
                self.output,
                parts(before),
                now.output,
                parts(after)
            )));
        }
        let found = measure(&self.side, &now.side, 0.0).map_err(Failure::new)?;
        let (largest, pixels) = (found.largest(), found.worst.len());
        let samples =
            found.worst.iter().flat_map(|by| color(*by, largest)).map(|x| (x * 255.0).round() as u8);
        let samples = samples.collect();
        if found.is_equal() {
            let words = format!("every value is equal to that of the pinned picture, in {pixels} pixels");
            return Ok(Differing { samples, words });
        }
        let mut words = format!("{} of {pixels} pixels differ from the pinned picture", found.different);
        let worst = found.channels.iter().filter(|channel| channel.at.is_some());
        if let Some(channel) = worst.max_by(|a, b| a.largest.total_cmp(&b.largest))
            && let Some(At { pixel: [x, y], .. }) = channel.at
        {
            let rms: Vec<String> = found.channels.iter().map(|channel| brief(channel.rms)).collect();
            let of = if rms.len() == 1 { "" } else { " of the components" };
            words += &format!(
                ": the largest difference is {} at pixel ({x}, {y}), the rms{of} {}; black is 0, then purple, red and \
                 yellow, white the largest",
                brief(largest),
                rms.join(", ")
            );
        }
        let unlike: usize = found.channels.iter().map(|channel| channel.unlike).sum();
        if unlike > 0 {
            words +=
                &format!("; cyan: {unlike} values are NaN or infinite in one picture only, or not the same");
        }
        Ok(Differing { samples, words })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_ir::ir::Kind;
    use osl_ir::types::Type;

    fn pinned(values: &[f32]) -> Pinned {
        let words = values.iter().map(|x| x.to_bits()).collect();
        let plane = Plane {
            output: "f".into(),
            ty: Type::FLOAT,
            component: 0,
            kind: Kind::Float,
            words,
            wide: Vec::new(),
        };
        Pinned::of("f", (2, values.len() / 2), &[&plane])
    }

    #[test]
    fn numbers_say_how_much_differs_and_where() {
        let difference = |a: &[f32], b: &[f32]| pinned(a).difference(&pinned(b)).unwrap();
        let found = difference(&[0.0, 2.0, 3.0, f32::NAN], &[-0.0, 2.0, 3.0, f32::NAN]);
        assert_eq!(found.words, "every value is equal to that of the pinned picture, in 4 pixels");
        assert_eq!(found.samples, [0; 12]);
        let found = difference(&[0.0, 2.0, 3.0, 1.0], &[0.0, 2.0, 2.5, f32::NAN]);
        assert_eq!(
            found.words,
            "2 of 4 pixels differ from the pinned picture: the largest difference is 0.500 at pixel (0, 1), the rms \
             0.289; black is 0, then purple, red and yellow, white the largest; cyan: 1 values are NaN or infinite in \
             one picture only, or not the same"
        );
        assert_eq!(found.samples, [[0; 3], [0; 3], [255; 3], [0, 255, 255]].concat());
    }
}
