//! Values of requests, and how they are read from text.

use osl_exec::Isa;
use osl_image::{DataWindow, ExrCompression, ImageFormat};
use osl_ir::passes::Pass;
use osl_limits::SetError;
use osl_measure::sample::{FilterKind, Rate};
use osl_numeric::Arithmetic;
use osl_scene::glam::Vec3;
use osl_scene::render::Curve;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Reads `WIDTHxHEIGHT`.
pub fn grid(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("a grid is WIDTHxHEIGHT, such as 512x512, not `{text}`");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let (w, h): (usize, usize) = (w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?);
    match w.checked_mul(h) {
        Some(0) => Err("a grid has at least one point in each direction".to_string()),
        Some(_) => Ok((w, h)),
        None => Err("so many points cannot be counted".to_string()),
    }
}

/// Some columns and rows of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// Columns, from the left.
    pub columns: Range<usize>,
    /// Rows, from the top.
    pub rows: Range<usize>,
}

impl Crop {
    /// Its columns and rows with a border, for
    /// [`RenderOptions::crop`](osl_scene::render::RenderOptions::crop).
    pub fn with_border(&self, border: usize) -> [usize; 4] {
        let Crop { columns, rows } = self;
        let [x0, y0] = [columns.start, rows.start].map(|at| at.saturating_sub(border));
        [x0, columns.end.saturating_add(border), y0, rows.end.saturating_add(border)]
    }

    /// Where it is in a picture of this size, if that has more pixels.
    pub fn part(&self, of: (usize, usize)) -> Option<DataWindow> {
        let Crop { columns, rows } = self;
        let is_part = (columns.len(), rows.len()) != of;
        is_part.then_some(DataWindow { first: (columns.start, rows.start), of })
    }

    /// Fails if it is not in a picture of so many columns and rows.
    pub fn check(&self, (width, height): (usize, usize)) -> Result<(), String> {
        match self.columns.end > width || self.rows.end > height {
            true => Err(format!(
                "--crop: the picture has {width} columns and {height} rows, so X1 is at most {width} and Y1 at most {height}"
            )),
            false => Ok(()),
        }
    }
}

/// Reads `X0,X1,Y0,Y1`; the second of each pair is not part of the crop.
pub fn crop(text: &str) -> Result<Crop, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x0, x1, y0, y1]) if x0 < x1 && y0 < y1 => Ok(Crop { columns: *x0..*x1, rows: *y0..*y1 }),
        Some([_, _, _, _]) => {
            Err("a crop has at least one column and one row: X0,X1,Y0,Y1 with X0 below X1 and Y0 \
                                   below Y1"
                .to_string())
        }
        _ => Err(format!("four numbers X0,X1,Y0,Y1, such as 100,200,50,150, not `{text}`")),
    }
}

/// Two numbers separated by a comma.
pub fn pair(text: &str) -> Result<[f32; 2], String> {
    let wrong = || format!("two numbers separated by a comma, not `{text}`");
    let (u, v) = text.split_once(',').ok_or_else(wrong)?;
    let number = |t: &str| t.trim().parse::<f32>().ok().filter(|x| x.is_finite()).ok_or_else(wrong);
    Ok([number(u)?, number(v)?])
}

/// An output, and a factor on its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Gained {
    /// The name of the output.
    pub name: String,
    /// The factor.
    pub gain: f32,
}

/// Reads `OUTPUT` or `OUTPUT,GAIN`.
pub fn gained(text: &str) -> Result<Gained, String> {
    let (name, gain) = text.split_once(',').map_or((text, "1"), |(name, gain)| (name.trim(), gain.trim()));
    let number = gain.parse().ok().filter(|x: &f32| x.is_finite());
    let gain = number.ok_or_else(|| format!("a gain is a number, not `{gain}`"))?;
    if name.is_empty() {
        return Err("the name of an output, and a gain after a comma".to_string());
    }
    Ok(Gained { name: name.to_string(), gain })
}

/// A curve from radiance to display values.
pub fn curve(text: &str) -> Result<Curve, String> {
    Curve::from_name(text).ok_or_else(|| format!("one of {}", Curve::ALL.map(Curve::name).join(", ")))
}

/// Reads `NAME=VALUE`.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE"))?;
    Ok((name.trim().to_string(), value.to_string()))
}

/// Reads 16 numbers, row by row.
pub fn matrix(text: &str) -> Result<Box<[f32; 16]>, String> {
    let numbers: Result<Vec<f32>, _> =
        text.split([',', ' ']).filter(|p| !p.is_empty()).map(str::parse).collect();
    let numbers = numbers.map_err(|_| "a matrix is 16 numbers separated by commas".to_string())?;
    let count = numbers.len();
    numbers.try_into().map(Box::new).map_err(|_| format!("a matrix is 16 numbers, not {count}"))
}

/// Reads the name of a compression of EXR files.
pub fn compression(text: &str) -> Result<ExrCompression, String> {
    ExrCompression::from_name(text).ok_or_else(|| format!("one of {}", ExrCompression::NAMES.join(", ")))
}

/// Reads the name of an instruction set of this machine.
pub fn isa(text: &str) -> Result<Isa, String> {
    let names: Vec<&str> = Isa::all().into_iter().map(Isa::name).collect();
    Isa::from_name(text).ok_or_else(|| format!("this machine has {}", names.join(", ")))
}

/// Reads the name of an arithmetic.
pub fn arithmetic(text: &str) -> Result<Arithmetic, String> {
    let names: Vec<&str> = Arithmetic::ALL.into_iter().map(Arithmetic::name).collect();
    Arithmetic::from_name(text).ok_or_else(|| format!("one of {}", names.join(", ")))
}

/// Reads the name of a pass.
pub fn pass(text: &str) -> Result<Pass, String> {
    let names: Vec<&str> = Pass::ALL.iter().map(|p| p.name()).collect();
    Pass::from_name(text).ok_or_else(|| format!("the passes are {}", names.join(", ")))
}

/// Reads `X,Y,Z`.
pub fn position(text: &str) -> Result<Vec3, String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y, z]) if [x, y, z].iter().all(|n| n.is_finite()) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err(format!("three numbers separated by commas, not `{text}`")),
    }
}

/// Reads `NAME` or `NAME,WIDTH`; the width is in pixels.
pub fn filter(text: &str) -> Result<(FilterKind, f32), String> {
    let (name, width) = text.split_once(',').map_or((text, None), |(name, width)| (name, Some(width)));
    let names = FilterKind::ALL.map(FilterKind::name);
    let kind = FilterKind::from_name(name).ok_or_else(|| format!("one of {}", names.join(", ")))?;
    let width = match width {
        None => kind.usual_width(),
        Some(width) => {
            let number = width.trim().parse().ok().filter(|w: &f32| (0.01..=64.0).contains(w));
            number.ok_or_else(|| format!("a width is from 0.01 to 64 pixels, not `{width}`"))?
        }
    };
    Ok((kind, width))
}

/// Reads the pixels that share a sample: 2x1, 2x2 or 4x4.
pub fn rate(text: &str) -> Result<Rate, String> {
    let names = Rate::ALL.map(|rate| rate.to_string());
    Rate::from_name(text).ok_or_else(|| format!("one of {}", names.join(", ")))
}

/// Reads an error, a number above 0.
pub fn error(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|e: &f32| *e > 0.0 && e.is_finite());
    number.ok_or_else(|| format!("an error is a number above 0, not `{text}`"))
}

/// A time: `5s`, `500ms`, or a number of seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let (number, unit) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => (text, 1.0),
    };
    let seconds = number.trim().parse().ok().map(|number: f64| number * unit);
    let seconds = seconds.filter(|seconds| (0.001..=1e6).contains(seconds));
    let seconds = seconds
        .ok_or_else(|| format!("a time from 1ms to 1000000s, such as 5s, 0.5s or 500ms, not `{text}`"))?;
    Ok(Duration::from_secs_f64(seconds))
}

/// The time of a measurement: a number of seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s| (0.01..=1e6).contains(s));
    number.ok_or_else(|| format!("a number of seconds from 0.01 to 1000000, not `{text}`"))
}

/// The name of the standard output as an output file.
pub const STDOUT: &str = "-";

/// A file for the outputs of a run; its ending names the format. `-` is the standard output.
pub fn image_file(path: PathBuf) -> Result<PathBuf, String> {
    if path.as_os_str() == STDOUT { Ok(path) } else { image_path(path) }
}

/// An image file; its ending names the format.
pub fn image_path(path: PathBuf) -> Result<PathBuf, String> {
    match ImageFormat::of(&path) {
        Some(_) => Ok(path),
        None => Err("the name must end in .exr, .png, .tif or .jpg".to_string()),
    }
}

/// A file for a rendered picture.
pub fn picture_file(path: PathBuf) -> Result<PathBuf, String> {
    match ImageFormat::of(&path) {
        _ if path.as_os_str() == STDOUT => Ok(path),
        Some(ImageFormat::Exr | ImageFormat::Png) => Ok(path),
        _ => Err("the name must end in .exr or .png".to_string()),
    }
}

/// Reads the value of a limit.
pub fn amount(text: &str) -> Result<u64, String> {
    osl_limits::number(text).ok_or_else(|| SetError::NoNumber.to_string())
}

/// Reads the ending of an image file.
pub fn ending(text: &str) -> Result<String, String> {
    match ImageFormat::of(Path::new(&format!("picture.{text}"))) {
        Some(_) => Ok(text.to_string()),
        None => Err("one of png, exr, tif, jpg".to_string()),
    }
}

/// The values that are shown as black and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueRange {
    /// The smallest and the largest value of each output.
    Auto,
    /// These.
    From(f32, f32),
}

/// Reads `auto` or `A,B`.
pub fn value_range(text: &str) -> Result<ValueRange, String> {
    if text == "auto" {
        return Ok(ValueRange::Auto);
    }
    match pair(text) {
        Ok([low, high]) if low < high => Ok(ValueRange::From(low, high)),
        Ok(_) => Err("the second number must be larger than the first".to_string()),
        Err(_) => Err(format!("`auto`, or two numbers separated by a comma, not `{text}`")),
    }
}

/// Reads a number of stops.
pub fn stops(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| (-64.0..=64.0).contains(x));
    number.ok_or_else(|| format!("a number of stops from -64 to 64, not `{text}`"))
}
