//! The layer that marks pixels out of range: with values that are NaN or infinite, below black, or above
//! white.
//!
//! It is computed from the values, because the samples of the picture are black or white there.

/// The colors of the marks.
const BROKEN: [u8; 3] = [255, 0, 204];
const BELOW: [u8; 3] = [33, 84, 191];
const ABOVE: [u8; 3] = [217, 97, 15];
const BOTH: [u8; 3] = [128, 60, 170];
/// The grey of the other pixels: black, and the range to white.
const GREY: (u8, u8) = (72, 112);

/// What is wrong with the values of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    Fine,
    /// A value is NaN or infinite.
    Broken,
    Below,
    Above,
    /// One value is below and another one above.
    Both,
}

impl Mark {
    fn of(values: impl Iterator<Item = f32>) -> Mark {
        values.fold(Mark::Fine, |mark, x| match mark {
            _ if !x.is_finite() => Mark::Broken,
            Mark::Broken | Mark::Both => mark,
            Mark::Above if x < 0.0 => Mark::Both,
            Mark::Below if x > 1.0 => Mark::Both,
            _ if x < 0.0 => Mark::Below,
            _ if x > 1.0 => Mark::Above,
            _ => mark,
        })
    }

    fn color(self, samples: &[u8]) -> [u8; 3] {
        match self {
            Mark::Fine => {
                let sum: usize = samples.iter().map(|x| usize::from(*x)).sum();
                let mean = sum / samples.len().max(1);
                [(usize::from(GREY.0) + mean * usize::from(GREY.1) / 255) as u8; 3]
            }
            Mark::Broken => BROKEN,
            Mark::Below => BELOW,
            Mark::Above => ABOVE,
            Mark::Both => BOTH,
        }
    }
}

/// A picture with marks.
pub(super) struct Marked {
    /// Red, green and blue of each pixel, and its alpha if the picture has one.
    pub(super) samples: Vec<u8>,
    pub(super) channels: usize,
    /// How many pixels have each mark.
    pub(super) words: String,
}

/// Marks the pixels of a picture. `planes` are its values, with 0 for black and 1 for white, and `samples`
/// what the picture shows, with alpha after the color if `covered` is given. `range` are the values of black
/// and white.
pub(super) fn marked(
    planes: &[impl AsRef<[f32]>],
    covered: Option<&[f32]>,
    samples: &[u8],
    range: (f32, f32),
) -> Marked {
    let colors = planes.len();
    let channels = colors + usize::from(covered.is_some());
    let mut found = [0_usize; 5];
    let mut marked = Vec::with_capacity(samples.len() / channels.max(1) * 4);
    for (at, pixel) in samples.chunks_exact(channels.max(1)).enumerate() {
        let mark = Mark::of(planes.iter().filter_map(|plane| plane.as_ref().get(at).copied()));
        if covered.is_none_or(|covered| covered.get(at).is_some_and(|c| *c > 0.0))
            && let Some(count) = found.get_mut(mark as usize)
        {
            *count += 1;
        }
        let (color, alpha) = pixel.split_at_checked(colors).unwrap_or((pixel, &[]));
        marked.extend_from_slice(&mark.color(color));
        marked.extend_from_slice(alpha);
    }
    Marked { samples: marked, channels: 3 + channels - colors, words: words(found, range) }
}

fn words([fine, broken, below, above, both]: [usize; 5], (low, high): (f32, f32)) -> String {
    let count = fine + broken + below + above + both;
    let pixels = if count == 1 { "pixel" } else { "pixels" };
    let marks = [
        (broken, "NaN or infinite (pink)".to_string()),
        (below, format!("below {low} (blue)")),
        (above, format!("above {high} (orange)")),
        (both, format!("below {low} and above {high} in different components (violet)")),
    ];
    let found: Vec<String> =
        marks.iter().filter(|(n, _)| *n > 0).map(|(n, mark)| format!("{n} {mark}")).collect();
    if found.is_empty() {
        return format!("every value is from {low} to {high}, in {count} {pixels}");
    }
    format!("of {count} {pixels}: {}; {fine} from {low} to {high} (grey)", found.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_has_the_mark_of_its_values() {
        let mark = |values: [f32; 3]| Mark::of(values.into_iter());
        assert_eq!(mark([0.0, 1.0, 0.5]), Mark::Fine);
        assert_eq!(mark([0.0, -0.0, 0.5]), Mark::Fine, "a zero with a sign is a zero");
        assert_eq!(mark([-0.1, 1.0, 0.5]), Mark::Below);
        assert_eq!(mark([0.5, 1.0 + f32::EPSILON, 0.5]), Mark::Above);
        assert_eq!(mark([-0.1, 2.0, -0.5]), Mark::Both);
        assert_eq!(mark([2.0, 0.0, -0.5]), Mark::Both);
        assert_eq!(mark([-0.1, 2.0, f32::NAN]), Mark::Broken);
        assert_eq!(mark([f32::NEG_INFINITY, 2.0, 0.0]), Mark::Broken);
    }

    #[test]
    fn marks_are_counted_and_cover_the_picture() {
        let planes = [vec![0.5, -1.0, 2.0, f32::NAN]];
        let shown = marked(&planes, None, &[128, 0, 255, 0], (0.0, 1.0));
        assert_eq!(shown.channels, 3);
        assert_eq!(shown.samples, [[128, 128, 128], BELOW, ABOVE, BROKEN].concat());
        assert_eq!(
            shown.words,
            "of 4 pixels: 1 NaN or infinite (pink), 1 below 0 (blue), 1 above 1 (orange); 1 from 0 to 1 (grey)"
        );
        let covered = [1.0, 1.0, 0.0, 0.0];
        let shown = marked(&planes, Some(&covered), &[0, 255, 0, 255, 9, 0, 9, 0], (-1.0, 3.0));
        assert_eq!(shown.channels, 4);
        assert_eq!(shown.samples[..8], [72, 72, 72, 255, BELOW[0], BELOW[1], BELOW[2], 255]);
        assert_eq!(shown.words, "of 2 pixels: 1 below -1 (blue); 1 from -1 to 3 (grey)");
        assert_eq!(
            marked(&[vec![0.5]], None, &[1], (0.0, 1.0)).words,
            "every value is from 0 to 1, in 1 pixel"
        );
    }
}
