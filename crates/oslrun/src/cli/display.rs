//! From the values of an output to the colors of a PNG or JPEG file: which values become black and white.
//!
//! A color is shown as light, through the sRGB curve; a normal as the colors of a normal map, in which -1 is
//! black and 1 is white; every other number as it is, with 0 black and 1 white. The options change the range,
//! and a note says how many values are outside of it. EXR and TIFF files hold the values themselves. This
//! module must not know files.

use super::Failure;
use super::args::heading;
use super::args::values::{STDOUT, ValueRange, ending, stops, value_range};
use clap::Args;
use osl_image::{ImageFormat, Transfer};
use osl_ir::types::Type;
use osl_numeric::real::Real;
use std::path::{Path, PathBuf};

/// The options for the picture.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct DisplayArgs {
    /// Format of the picture with `-o -`: png, exr, tif or jpg (default: png).
    #[arg(long, value_name = "NAME", value_parser = ending, requires = "output", help_heading = heading::PICTURE)]
    format: Option<String>,
    /// The values that become black and white: A,B, or `auto` for the smallest and the largest value of each
    /// output.
    #[arg(long, value_name = "auto|A,B", value_parser = value_range, allow_hyphen_values = true, help_heading = heading::DISPLAY)]
    range: Option<ValueRange>,
    /// The same as `--range -1,1`: zero becomes grey. Normals are always shown like this.
    #[arg(long, conflicts_with = "range", help_heading = heading::DISPLAY)]
    signed: bool,
    /// Multiply the values by two to this power: 1 is twice as bright.
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_hyphen_values = true, conflicts_with_all = ["range", "signed"], help_heading = heading::DISPLAY)]
    exposure: Option<f32>,
}

/// The values of an output, ready to be stored as integers.
pub(super) struct Shown {
    /// The planes.
    pub(super) planes: Vec<Vec<f32>>,
    /// The curve from values to integers.
    pub(super) transfer: Transfer,
    /// The values of black and white.
    pub(super) range: (f32, f32),
    /// What the picture does not show.
    pub(super) note: Option<String>,
}

impl DisplayArgs {
    /// A path that says the format: `-` gets the ending of `--format`.
    pub(super) fn named(&self, path: &Path) -> Result<PathBuf, Failure> {
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
    pub(super) fn with_range(&self, text: &str) -> Result<DisplayArgs, String> {
        let range = Some(value_range(text)?);
        Ok(DisplayArgs { range, signed: false, exposure: None, ..self.clone() })
    }

    /// The exposure in stops.
    pub(super) fn stops(&self) -> f32 {
        self.exposure.unwrap_or(0.0)
    }

    /// Whether an option is given that changes colors.
    pub(super) fn is_given(&self) -> bool {
        self.range.is_some() || self.signed || self.exposure.is_some()
    }

    /// Fails if options are given that have no effect on a file.
    pub(super) fn check(&self, path: Option<&Path>) -> Result<(), Failure> {
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
    pub(super) fn shown(
        &self,
        format: Option<ImageFormat>,
        (name, ty): (&str, Type),
        mut planes: Vec<Vec<f32>>,
        covered: Option<&[f32]>,
    ) -> Shown {
        let transfer = if ty == Type::COLOR { Transfer::Srgb } else { Transfer::Linear };
        if !matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Shown { planes, transfer, range: (0.0, 1.0), note: None };
        }
        let found = Found::of(&planes, covered);
        let (low, high) = match (self.range, self.exposure) {
            (Some(ValueRange::From(low, high)), _) => (low, high),
            (Some(ValueRange::Auto), _) if found.low < found.high => (found.low, found.high),
            // A constant stays visible.
            (Some(ValueRange::Auto), _) => (0.0_f32.min(found.low), 1.0_f32.max(found.high)),
            (None, Some(stops)) => (0.0, Real::exp2(-stops)),
            (None, None) if self.signed || ty == Type::NORMAL => (-1.0, 1.0),
            (None, None) => (0.0, 1.0),
        };
        if (low, high) != (0.0, 1.0) {
            let scale = f64::from(high) - f64::from(low);
            let map = |x: &mut f32| *x = ((f64::from(*x) - f64::from(low)) / scale) as f32;
            planes.iter_mut().flatten().for_each(map);
        }
        let chosen = self.range.is_some() || self.exposure.is_some();
        let note =
            if chosen { None } else { found.note(name, &Found::outside(&planes, covered), (low, high)) };
        Shown { planes, transfer, range: (low, high), note }
    }
}

/// The range of the finite values of an output, and how many values there are.
struct Found {
    low: f32,
    high: f32,
    values: usize,
}

impl Found {
    fn of(planes: &[Vec<f32>], covered: Option<&[f32]>) -> Found {
        let start = Found { low: f32::INFINITY, high: f32::NEG_INFINITY, values: 0 };
        counted(planes, covered).fold(start, |found, x| {
            let values = found.values + 1;
            match x.is_finite() {
                true => Found { low: found.low.min(x), high: found.high.max(x), values },
                false => Found { values, ..found },
            }
        })
    }

    /// The numbers of values below 0 and above 1, and of NaN.
    fn outside(planes: &[Vec<f32>], covered: Option<&[f32]>) -> [usize; 3] {
        counted(planes, covered).fold([0; 3], |[below, above, nan], x| {
            [below + usize::from(x < 0.0), above + usize::from(x > 1.0), nan + usize::from(x.is_nan())]
        })
    }

    fn note(&self, name: &str, outside: &[usize; 3], (low, high): (f32, f32)) -> Option<String> {
        let [below, above, nan] = *outside;
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
        let range =
            if self.low <= self.high { format!(" ({} to {})", self.low, self.high) } else { String::new() };
        Some(format!(
            "of the values of `{name}`{range}, {} in the picture; --range auto shows all; --range A,B, --signed or \
             --exposure N choose what is shown",
            parts.join(", ")
        ))
    }
}

/// The values at the pixels that count.
fn counted<'a>(planes: &'a [Vec<f32>], covered: Option<&'a [f32]>) -> impl Iterator<Item = f32> + 'a {
    let counts = move |at: usize| covered.is_none_or(|c| c.get(at).is_some_and(|c| *c > 0.0));
    planes
        .iter()
        .flat_map(move |plane| plane.iter().enumerate().filter(move |(at, _)| counts(*at)).map(|(_, x)| *x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(args: &DisplayArgs, ty: Type, values: &[f32]) -> (Vec<f32>, Option<String>) {
        let shown = args.shown(Some(ImageFormat::Png), ("x", ty), vec![values.to_vec()], None);
        (shown.planes.into_iter().flatten().collect(), shown.note)
    }

    #[test]
    fn ranges_become_0_to_1() {
        let values = [-1.0, 0.0, 3.0];
        let with = |range| DisplayArgs { range: Some(range), ..DisplayArgs::default() };
        assert_eq!(shown(&with(ValueRange::Auto), Type::FLOAT, &values), (vec![0.0, 0.25, 1.0], None));
        assert_eq!(shown(&with(ValueRange::From(0.0, 2.0)), Type::FLOAT, &values).0, [-0.5, 0.0, 1.5]);
        let signed = DisplayArgs { signed: true, ..DisplayArgs::default() };
        assert_eq!(shown(&signed, Type::FLOAT, &values).0, [0.0, 0.5, 2.0]);
        assert_eq!(shown(&DisplayArgs::default(), Type::NORMAL, &values).0, [0.0, 0.5, 2.0]);
        let bright = DisplayArgs { exposure: Some(1.0), ..DisplayArgs::default() };
        assert_eq!(shown(&bright, Type::COLOR, &values).0, [-2.0, 0.0, 6.0]);
        assert_eq!(shown(&with(ValueRange::Auto), Type::FLOAT, &[0.5]).0, [0.5], "a constant stays");
    }

    #[test]
    fn what_is_clipped_is_said() {
        let note = |values: &[f32]| shown(&DisplayArgs::default(), Type::FLOAT, values).1;
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
