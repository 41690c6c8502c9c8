//! From the values of an output to the colors of a PNG or JPEG file: which values become black and white.
//!
//! A color is shown as light, through the sRGB curve; a normal as the colors of a normal map, in which -1 is
//! black and 1 is white; every other number as it is, with 0 black and 1 white. The options change the range,
//! and a note says how many values are outside of it. EXR and TIFF files hold the values themselves.

use crate::Failure;
use crate::request::Display;
use crate::request::values::{STDOUT, ValueRange, value_range};
use osl_image::{ImageFormat, Transfer};
use osl_ir::types::Type;
use osl_numeric::real::Real;
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The values of an output, ready to be stored as integers.
pub struct Shown<'a> {
    /// The planes.
    pub planes: Vec<Cow<'a, [f32]>>,
    /// The curve from values to integers.
    pub transfer: Transfer,
    /// The values of black and white.
    pub range: (f32, f32),
    /// What the picture does not show.
    pub note: Option<String>,
}

impl Display {
    /// A path that says the format: `-` gets the ending of `--format`.
    pub fn named(&self, path: &Path) -> Result<PathBuf, Failure> {
        if path.as_os_str() == STDOUT {
            return Ok(PathBuf::from(format!("picture.{}", self.format.as_deref().unwrap_or("png"))));
        }
        match self.format {
            Some(_) => {
                Err(Failure::usage("--format is for `-o -`: the ending of a file's name is its format"))
            }
            None => Ok(path.to_owned()),
        }
    }

    /// The options with another range, given as text.
    pub fn with_range(&self, text: &str) -> Result<Display, String> {
        let range = Some(value_range(text)?);
        Ok(Display { range, signed: false, exposure: None, ..self.clone() })
    }

    /// The exposure in stops.
    pub fn stops(&self) -> f32 {
        self.exposure.unwrap_or(0.0)
    }

    /// Whether an option is given that changes colors.
    pub fn is_given(&self) -> bool {
        self.range.is_some() || self.signed || self.exposure.is_some()
    }

    /// Fails if options are given that have no effect on a file.
    pub fn check(&self, path: Option<&Path>) -> Result<(), Failure> {
        let given = self.is_given();
        let path = path.map(|path| self.named(path)).transpose()?;
        match path.and_then(|path| ImageFormat::of(&path)) {
            Some(ImageFormat::Png | ImageFormat::Jpeg) => Ok(()),
            _ if !given => Ok(()),
            Some(_) => Err(Failure::usage(
                "--range, --signed and --exposure are for PNG and JPEG; EXR and TIFF files hold the values themselves",
            )),
            None => {
                Err(Failure::usage("--range, --signed and --exposure are for a picture: name one with -o"))
            }
        }
    }

    /// The planes of an output as they are stored in a file of this format. `covered` is 0 at pixels that do
    /// not count.
    pub fn shown<'a>(
        &self,
        format: Option<ImageFormat>,
        (name, ty): (&str, Type),
        mut planes: Vec<Cow<'a, [f32]>>,
        covered: Option<&[f32]>,
    ) -> Shown<'a> {
        let transfer = if ty == Type::COLOR { Transfer::Srgb } else { Transfer::Linear };
        if !matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Shown { planes, transfer, range: (0.0, 1.0), note: None };
        }
        let is_auto = matches!(self.range, Some(ValueRange::Auto));
        let is_chosen = self.range.is_some() || self.exposure.is_some();
        let is_signed = self.signed || ty == Type::NORMAL;
        // The values of a picture from 0 to 1 are counted only if there is a note about them.
        let found = (is_auto || (is_signed && !is_chosen)).then(|| FiniteRange::of(&planes, covered));
        let (low, high) = match (self.range, self.exposure, &found) {
            (Some(ValueRange::From(low, high)), ..) => (low, high),
            (Some(ValueRange::Auto), _, Some(found)) if found.low < found.high => (found.low, found.high),
            // A constant stays visible.
            (Some(ValueRange::Auto), _, Some(found)) => (0.0_f32.min(found.low), 1.0_f32.max(found.high)),
            (_, Some(stops), _) => (0.0, Real::exp2(-stops)),
            _ if is_signed => (-1.0, 1.0),
            _ => (0.0, 1.0),
        };
        if (low, high) != (0.0, 1.0) {
            let scale = f64::from(high) - f64::from(low);
            let map = |x: &mut f32| *x = ((f64::from(*x) - f64::from(low)) / scale) as f32;
            planes.par_iter_mut().for_each(|plane| plane.to_mut().iter_mut().for_each(map));
        }
        let note = match is_chosen {
            true => None,
            false => match FiniteRange::outside(&planes, covered) {
                [0, 0, 0] => None,
                outside => found.unwrap_or_else(|| FiniteRange::of(&planes, covered)).note(
                    name,
                    outside,
                    (low, high),
                ),
            },
        };
        Shown { planes, transfer, range: (low, high), note }
    }
}

/// The range of the finite values of an output, and how many values there are.
struct FiniteRange {
    low: f32,
    high: f32,
    values: usize,
    /// Whether some of them are infinite.
    infinite: bool,
}

impl FiniteRange {
    fn of(planes: &[Cow<'_, [f32]>], covered: Option<&[f32]>) -> FiniteRange {
        let start = FiniteRange { low: f32::INFINITY, high: f32::NEG_INFINITY, values: 0, infinite: false };
        counted(planes, covered).fold(start, |found, x| {
            let values = found.values + 1;
            match x.is_finite() {
                true => FiniteRange { low: found.low.min(x), high: found.high.max(x), values, ..found },
                false => FiniteRange { values, infinite: found.infinite || x.is_infinite(), ..found },
            }
        })
    }

    /// The numbers of values below 0 and above 1, and of NaN.
    fn outside(planes: &[Cow<'_, [f32]>], covered: Option<&[f32]>) -> [usize; 3] {
        let piece = |(at, values): (usize, &[f32])| {
            let covered = covered.map(|covered| covered.get(at * PIECE..).unwrap_or_default());
            let mut found = [0; 3];
            for (at, x) in values.iter().enumerate() {
                if counts(covered, at) {
                    found[0] += usize::from(*x < 0.0);
                    found[1] += usize::from(*x > 1.0);
                    found[2] += usize::from(x.is_nan());
                }
            }
            found
        };
        let pieces = planes.par_iter().flat_map(|plane| plane.par_chunks(PIECE).enumerate());
        pieces.map(piece).reduce(|| [0; 3], |[a, b, c], [x, y, z]| [a + x, b + y, c + z])
    }

    fn note(&self, name: &str, [below, above, nan]: [usize; 3], (low, high): (f32, f32)) -> Option<String> {
        let values = self.values.max(1) as f64;
        let share = |n: usize| {
            let percent = 100.0 * n as f64 / values;
            if percent < 0.1 { "less than 0.1 %".to_string() } else { format!("{percent:.1} %") }
        };
        let mut parts = Vec::new();
        if below > 0 {
            parts.push(format!("{} are below {low} and become black", share(below)));
        }
        if above > 0 {
            parts.push(format!("{} are above {high} and become white", share(above)));
        }
        if nan > 0 {
            parts.push(format!("{} are NaN and become black", share(nan)));
        }
        if parts.is_empty() {
            return None;
        }
        // The range is that of the finite values.
        let more = if self.infinite { ", and infinite ones" } else { "" };
        let range = if self.low <= self.high {
            format!(" ({} to {}{more})", self.low, self.high)
        } else {
            String::new()
        };
        Some(format!(
            "of the values of `{name}`{range}, {} in the picture; --range auto shows all; --range A,B, --signed or \
             --exposure N choose what is shown",
            parts.join(", ")
        ))
    }
}

/// Values of a plane that one thread counts.
const PIECE: usize = 1 << 14;

/// Whether a pixel counts.
fn counts(covered: Option<&[f32]>, at: usize) -> bool {
    covered.is_none_or(|c| c.get(at).is_some_and(|c| *c > 0.0))
}

/// The values at the pixels that count.
fn counted<'a>(planes: &'a [Cow<'_, [f32]>], covered: Option<&'a [f32]>) -> impl Iterator<Item = f32> + 'a {
    planes.iter().flat_map(move |plane| {
        plane.iter().enumerate().filter(move |(at, _)| counts(covered, *at)).map(|(_, x)| *x)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(image: &Display, ty: Type, values: &[f32]) -> (Vec<f32>, Option<String>) {
        let shown = image.shown(Some(ImageFormat::Png), ("x", ty), vec![values.into()], None);
        (shown.planes.into_iter().flat_map(Cow::into_owned).collect(), shown.note)
    }

    #[test]
    fn ranges_become_0_to_1() {
        let values = [-1.0, 0.0, 3.0];
        let with = |range| Display { range: Some(range), ..Display::default() };
        assert_eq!(shown(&with(ValueRange::Auto), Type::FLOAT, &values), (vec![0.0, 0.25, 1.0], None));
        assert_eq!(shown(&with(ValueRange::From(0.0, 2.0)), Type::FLOAT, &values).0, [-0.5, 0.0, 1.5]);
        let signed = Display { signed: true, ..Display::default() };
        assert_eq!(shown(&signed, Type::FLOAT, &values).0, [0.0, 0.5, 2.0]);
        assert_eq!(shown(&Display::default(), Type::NORMAL, &values).0, [0.0, 0.5, 2.0]);
        let bright = Display { exposure: Some(1.0), ..Display::default() };
        assert_eq!(shown(&bright, Type::COLOR, &values).0, [-2.0, 0.0, 6.0]);
        assert_eq!(shown(&with(ValueRange::Auto), Type::FLOAT, &[0.5]).0, [0.5], "a constant stays");
    }

    #[test]
    fn what_is_clipped_is_said() {
        let note = |values: &[f32]| shown(&Display::default(), Type::FLOAT, values).1;
        let infinite = note(&[0.0, 1.0, f32::INFINITY]).unwrap_or_default();
        assert!(infinite.starts_with("of the values of `x` (0 to 1, and infinite ones), 33.3 % are above 1"));
        assert_eq!(note(&[0.0, 1.0]), None);
        assert_eq!(
            note(&[-0.5, 0.5, 2.0, f32::NAN]).as_deref(),
            Some(
                "of the values of `x` (-0.5 to 2), 25.0 % are below 0 and become black, 25.0 % are above 1 and become \
                 white, 25.0 % are NaN and become black in the picture; --range auto shows all; --range A,B, \
                 --signed or --exposure N choose what is shown"
            )
        );
    }
}
