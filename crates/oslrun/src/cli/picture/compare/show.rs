//! Shows how two pictures differ: as a table, as JSON, and as a picture.

use super::differ::{At, Difference, Measured, Value};
use super::side::Side;
use osl_files::Unsaved;
use osl_image::{ExrOptions, ImageFormat, Layer, LayerKind, Transfer, channel_bytes, exr_file};
use osl_job::Failure;
use osl_job::file::software::{self, SOFTWARE};
use osl_syntax::escape::shown;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Two pictures and how they differ.
pub(super) struct Report<'a> {
    pub(super) left: &'a Side,
    pub(super) right: &'a Side,
    pub(super) measured: &'a Measured,
    pub(super) tolerance: f64,
}

/// The report as data.
#[derive(Serialize)]
struct Json<'a> {
    pictures: [&'a str; 2],
    size: [usize; 2],
    tolerance: f64,
    equal: bool,
    different_pixels: usize,
    channels: &'a [Difference],
}

impl Report<'_> {
    pub(super) fn json(&self) -> Result<String, Failure> {
        let (width, height) = self.left.size;
        let report = Json {
            pictures: [&self.left.name, &self.right.name],
            size: [width, height],
            tolerance: self.tolerance,
            equal: self.measured.is_equal(),
            different_pixels: self.measured.different,
            channels: &self.measured.channels,
        };
        Ok(serde_json::to_string_pretty(&report).map_err(Failure::new)? + "\n")
    }

    /// A table with a row for each channel, and a line with the result.
    pub(super) fn text(&self) -> String {
        let (width, height) = self.left.size;
        let pixels = width * height;
        let mut text = format!(
            "first:  {}\nsecond: {}\n{width}x{height} pixels\n\n",
            shown(&self.left.name),
            shown(&self.right.name)
        );
        let mut rows =
            vec![["channel", "largest", "at pixel", "first", "second", "rms", "pixels"].map(String::from)];
        rows.extend(self.measured.channels.iter().map(|channel| row(channel, pixels)));
        text += &aligned(&rows);
        text.push('\n');
        for channel in &self.measured.channels {
            text += &not_finite(channel);
        }
        let channels = self.measured.channels.iter().filter(|channel| channel.different > 0).count();
        let within =
            if self.tolerance > 0.0 { format!(" by more than {}", self.tolerance) } else { String::new() };
        let _ = match self.measured.different {
            0 if self.tolerance > 0.0 => writeln!(text, "equal within {}", self.tolerance),
            0 => writeln!(text, "equal"),
            n => writeln!(
                text,
                "different: {} of the pixels differ{within}, in {channels} of {} channels",
                share(n, pixels),
                self.measured.channels.len()
            ),
        };
        text
    }
}

fn row(channel: &Difference, pixels: usize) -> [String; 7] {
    let name = shown(&channel.channel).into_owned();
    let Some(At { pixel: [x, y], values: [first, second] }) = channel.at else {
        let none = String::new;
        let pixels = if channel.different > 0 { share(channel.different, pixels) } else { none() };
        return [name, "0".to_string(), none(), none(), none(), "0".to_string(), pixels];
    };
    [
        name,
        brief(channel.largest),
        format!("({x}, {y})"),
        exact(first),
        exact(second),
        brief(channel.rms),
        share(channel.different, pixels),
    ]
}

/// A line about NaN and infinities, if a picture has some.
fn not_finite(channel: &Difference) -> String {
    let counted = |[first, second]: [usize; 2], what: &str| match (first, second) {
        (0, 0) => None,
        _ => Some(format!("{what} at {first} pixels of the first picture and {second} of the second")),
    };
    let counts = [counted(channel.nan, "NaN"), counted(channel.infinite, "infinite")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    if counts.is_empty() {
        return String::new();
    }
    let unlike = match channel.unlike_at {
        Some(At { pixel: [x, y], values: [first, second] }) => format!(
            "; unlike at {} pixels, first at ({x}, {y}): {} and {}",
            channel.unlike, first.0, second.0
        ),
        None => "; the same in both".to_string(),
    };
    format!("{}: {}{unlike}\n", shown(&channel.channel), counts.join(", "))
}

/// A value as it is stored: the shortest number that is read as the same one.
fn exact(Value(x): Value) -> String {
    if f64::from(x as f32) == x { (x as f32).to_string() } else { x.to_string() }
}

/// A difference with three digits.
pub(in crate::cli) fn brief(x: f64) -> String {
    let text = format!("{x:.2e}");
    let exponent = text.split_once('e').and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    match exponent {
        _ if x == 0.0 => "0".to_string(),
        Some(exponent @ -3..=2) => format!("{x:.*}", (2 - exponent) as usize),
        _ => text,
    }
}

fn share(n: usize, of: usize) -> String {
    let percent = 100.0 * n as f64 / of.max(1) as f64;
    match n {
        0 => "0 %".to_string(),
        _ if n == of => "all".to_string(),
        _ if percent < 0.01 => format!("{n} of {of}"),
        _ => format!("{percent:.2} %"),
    }
}

/// Rows with aligned columns: names to the left, numbers to the right.
fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (column, cell) in row.iter().enumerate() {
            let width = rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
            let width = width.unwrap_or(0);
            let _ =
                if column == 0 { write!(line, "{cell:<width$}") } else { write!(line, "  {cell:>width$}") };
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

/// A picture of a difference, and what it shows.
pub(super) struct Picture {
    pub(super) file: Unsaved,
    pub(super) legend: String,
}

/// The picture of the difference, in the format of the file's name.
pub(super) fn picture(report: &Report<'_>, path: &Path) -> Result<Picture, Failure> {
    match ImageFormat::of(path) {
        Some(ImageFormat::Exr) => signed(report, path),
        _ => heat(report, path),
    }
}

/// The second picture minus the first one, for each channel. Equal values give 0, also if they are infinite
/// or NaN.
fn signed(report: &Report<'_>, path: &Path) -> Result<Picture, Failure> {
    let (width, height) = report.left.size;
    let mut planes: Vec<(&str, Vec<f32>)> = Vec::new();
    for first in &report.left.channels {
        let Some(second) = report.right.channels.iter().find(|other| other.name == first.name) else {
            continue;
        };
        let minus = |pixel: usize| {
            let (a, b) = (first.at(pixel), second.at(pixel));
            let is_same = a == b || (a.is_nan() && b.is_nan());
            if is_same { 0.0 } else { (b - a) as f32 }
        };
        planes.push((&first.name, (0..width * height).map(minus).collect()));
    }
    let layers: Vec<Layer<'_>> = planes
        .iter()
        .map(|(name, plane)| Layer { name, kind: LayerKind::Scalar, planes: vec![plane.as_slice()] })
        .collect();
    let options = ExrOptions { software: Some(SOFTWARE), ..ExrOptions::default() };
    let file = exr_file(path, width, height, &layers, options).map_err(Failure::new)?;
    Ok(Picture { file, legend: "the second picture minus the first, for each channel".to_string() })
}

/// The colors of differences, from none to the largest.
const HEAT: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [0.35, 0.0, 0.45], [0.9, 0.1, 0.1], [1.0, 0.75, 0.0], [1.0, 1.0, 1.0]];
/// The color of pixels where one value is NaN or infinite.
const UNLIKE: [f32; 3] = [0.0, 1.0, 1.0];

/// The largest difference of each pixel, as a color.
fn heat(report: &Report<'_>, path: &Path) -> Result<Picture, Failure> {
    let largest = report.measured.largest();
    let colors: Vec<[f32; 3]> = report.measured.worst.iter().map(|by| color(*by, largest)).collect();
    let planes = [0, 1, 2].map(|at: usize| colors.iter().map(|color| color[at]).collect::<Vec<f32>>());
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    // These are colors of the display already.
    let bytes = channel_bytes(path, report.left.size, &planes, software::named(Transfer::Linear))
        .map_err(Failure::new)?;
    let file = Unsaved::new(path).and_then(|file| file.with(&bytes)).map_err(Failure::new)?;
    let unlike = report.measured.channels.iter().any(|channel| channel.unlike > 0);
    let unlike = if unlike { "; cyan where one value is NaN or infinite" } else { "" };
    let legend = match largest {
        0.0 => format!("black where the pictures are equal{unlike}"),
        _ => format!(
            "the largest difference of each pixel, from black (0) over purple, red and yellow to white ({}){unlike}",
            brief(largest)
        ),
    };
    Ok(Picture { file, legend })
}

/// The color of a difference, with the largest one; an infinite one is unlike.
pub(in crate::cli) fn color(by: f64, largest: f64) -> [f32; 3] {
    if by.is_infinite() {
        return UNLIKE;
    }
    if by <= 0.0 {
        return HEAT[0];
    }
    let at = (by / largest).clamp(0.0, 1.0) as f32 * (HEAT.len() - 1) as f32;
    let below = (at as usize).min(HEAT.len() - 2);
    let part = at - below as f32;
    [0, 1, 2].map(|c| HEAT[below][c] + part * (HEAT[below + 1][c] - HEAT[below][c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_values_exact() {
        assert_eq!(
            [0.0, 0.012_345, 0.5, 9.999, 12.345, 999.4, 1e-7, 12345.0].map(brief),
            ["0", "0.0123", "0.500", "10.0", "12.3", "999", "1.00e-7", "1.23e4"]
        );
        assert_eq!(exact(Value(f64::from(0.1_f32))), "0.1");
        assert_eq!(exact(Value(0.1)), "0.1");
        assert_eq!(exact(Value(16_777_217.0)), "16777217");
        assert_eq!(
            [(0, 9), (9, 9), (1, 1_000_000), (1, 4)].map(|(n, of)| share(n, of)),
            ["0 %", "all", "1 of 1000000", "25.00 %"]
        );
    }

    #[test]
    fn differences_become_colors() {
        assert_eq!(color(0.0, 2.0), [0.0; 3]);
        assert_eq!(color(2.0, 2.0), [1.0; 3]);
        assert_eq!(color(1.0, 2.0), HEAT[2]);
        assert_eq!(color(f64::INFINITY, 2.0), UNLIKE);
    }
}
