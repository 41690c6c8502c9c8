//! Arranges pictures in a table, with a label above each column and beside each row.
//!
//! The values of all pictures become colors together, so that equal values have equal colors.

use super::font;
use osl_exec::Plane;
use osl_image::{ImageFormat, channel_bytes};
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use osl_job::file::output::{self, ImageSet, Written};
use osl_job::file::software;
use osl_job::request::values::STDOUT;
use osl_job::{Done, Failure, Image};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// The width of a picture for which a dot of a letter is one pixel.
const SMALL: usize = 240;
/// The largest dot.
const LARGEST: usize = 4;
/// The gap between pictures, in dots.
const GAP: usize = 4;
/// The colors of the paper and the letters.
const PAPER: f32 = 1.0;
const INK: f32 = 0.0;

/// Pictures, row by row.
pub(super) struct Sheet<'a> {
    /// The labels of the columns, and those of the rows if there are several.
    pub(super) labels: &'a [Vec<String>],
    pub(super) pictures: &'a [Done],
    /// Columns and rows of each picture.
    pub(super) size: (usize, usize),
}

/// Where the parts of a sheet are.
struct Places {
    /// Pixels of a dot.
    dot: usize,
    /// The corner of the first picture, and the step to the next one.
    corner: (usize, usize),
    step: (usize, usize),
    whole: (usize, usize),
}

impl Sheet<'_> {
    fn labels(&self, direction: usize) -> &[String] {
        self.labels.get(direction).map_or(&[], Vec::as_slice)
    }

    fn places(&self) -> Places {
        let (width, height) = self.size;
        let dot = (width / SMALL).clamp(1, LARGEST);
        let gap = GAP * dot;
        let widest =
            |labels: &[String]| labels.iter().map(|label| font::size(label).0 * dot).max().unwrap_or(0);
        let line = font::size("").1 * dot;
        let (columns, rows) = (self.labels(0).len().max(1), self.labels(1).len().max(1));
        let side = if self.labels(1).is_empty() { 0 } else { widest(self.labels(1)) + gap };
        let corner = (gap + side, gap + line + gap);
        let step = (width.max(widest(self.labels(0))) + gap, height.max(line) + gap);
        Places { dot, corner, step, whole: (corner.0 + columns * step.0, corner.1 + rows * step.1) }
    }

    /// The corner of a picture.
    fn corner(places: &Places, at: usize, columns: usize) -> (usize, usize) {
        let (column, row) = (at % columns.max(1), at / columns.max(1));
        (places.corner.0 + column * places.step.0, places.corner.1 + row * places.step.1)
    }

    /// The files of the sheets, one for each output that the first picture has.
    pub(super) fn write(&self, path: &Path, image: &Image) -> Result<Written, Failure> {
        let outputs = outputs(self.pictures);
        if outputs.is_empty() {
            return Err(Failure::new(output::EMPTY));
        }
        if path.as_os_str() == STDOUT && outputs.len() > 1 {
            let names: Vec<&str> = outputs.iter().map(|(name, ..)| &**name).collect();
            return Err(Failure::new(format!(
                "a sheet shows one output, and there are {}: --outputs NAME chooses",
                names.join(", ")
            )));
        }
        let named = image.output.display.named(path)?;
        let mut set = ImageSet::new(path, outputs.len() > 1);
        let mut notes = Vec::new();
        let places = self.places();
        for (name, ty, components) in &outputs {
            let (planes, covered) = self.planes(name, *components, &places);
            let planes = planes.into_iter().map(Cow::Owned).collect();
            let shown =
                image.output.display.shown(ImageFormat::of(&named), (name, *ty), planes, Some(&covered));
            let mut planes: Vec<Vec<f32>> = shown.planes.into_iter().map(Cow::into_owned).collect();
            for plane in &mut planes {
                for (value, covered) in plane.iter_mut().zip(&covered) {
                    if *covered == 0.0 {
                        *value = PAPER;
                    }
                }
                self.write_labels(plane, &places);
            }
            let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
            let bytes = channel_bytes(&named, places.whole, &planes, software::named(shown.transfer))
                .map_err(Failure::new)?;
            set.add(name, &bytes)?;
            notes.extend(shown.note);
        }
        Ok(Written { files: set.files, notes })
    }

    /// The values of an output in all pictures, and 1 at the pixels that have values.
    fn planes(&self, name: &str, components: usize, places: &Places) -> (Vec<Vec<f32>>, Vec<f32>) {
        let (width, height) = self.size;
        let sheet = places.whole.0 * places.whole.1;
        let (mut planes, mut covered) = (vec![vec![0.0; sheet]; components], vec![0.0; sheet]);
        for (at, kept) in self.pictures.iter().enumerate() {
            let (x, y) = Sheet::corner(places, at, self.labels(0).len());
            let copy = |from: &[f32], to: &mut [f32]| {
                for row in 0..height {
                    let start = (y + row) * places.whole.0 + x;
                    let target = to.get_mut(start..start + width);
                    let source = from.get(row * width..(row + 1) * width);
                    if let (Some(target), Some(source)) = (target, source) {
                        target.copy_from_slice(source);
                    }
                }
            };
            let own: Vec<&Plane> = kept.frame.planes.iter().filter(|plane| *plane.output == *name).collect();
            if own.is_empty() {
                continue;
            }
            for (plane, to) in own.iter().zip(&mut planes) {
                copy(&plane.floats(), to);
            }
            let shown = kept.covered.as_ref().map_or_else(|| vec![1.0; width * height], Plane::floats);
            copy(&shown, &mut covered);
        }
        (planes, covered)
    }

    fn write_labels(&self, plane: &mut [f32], places: &Places) {
        let (width, height) = self.size;
        let dot = places.dot;
        let mut write = |text: &str, (x, y): (usize, usize)| {
            font::draw(text, |column, row| {
                for line in 0..dot {
                    let start = (y + row * dot + line) * places.whole.0 + x + column * dot;
                    if let Some(dots) = plane.get_mut(start..start + dot) {
                        dots.fill(INK);
                    }
                }
            });
        };
        for (column, label) in self.labels(0).iter().enumerate() {
            // Centred over the picture, or from its edge if it is wider.
            let inset = width.saturating_sub(font::size(label).0 * dot) / 2;
            write(label, (places.corner.0 + column * places.step.0 + inset, GAP * dot));
        }
        for (row, label) in self.labels(1).iter().enumerate() {
            let inset = height.saturating_sub(font::size(label).1 * dot) / 2;
            write(label, (GAP * dot, places.corner.1 + row * places.step.1 + inset));
        }
    }
}

/// The outputs that can be shown: name, type and number of components.
fn outputs(pictures: &[Done]) -> Vec<(Arc<str>, Type, usize)> {
    let mut found: Vec<(Arc<str>, Type, usize)> = Vec::new();
    for plane in pictures.iter().flat_map(|kept| &kept.frame.planes) {
        if matches!(plane.kind, Kind::Str | Kind::Closure) {
            continue;
        }
        match found.iter_mut().find(|(name, ..)| *name == plane.output) {
            Some((.., components)) => *components = (*components).max(plane.component + 1),
            None => found.push((plane.output.clone(), plane.ty, plane.component + 1)),
        }
    }
    found.retain(|(.., components)| matches!(components, 1 | 3));
    found
}
