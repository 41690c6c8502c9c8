//! The ranges of the outputs of a run, which are added up piece by piece.

use osl_exec::Plane;
use osl_image::LayerKind;
use osl_ir::ir::Kind;
use osl_ir::types::{StructTable, Type};
use osl_measure::range::{Range, Values};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

/// What the planes of an output mean.
pub fn layer_kind(plane: &Plane) -> LayerKind {
    kind_of(plane.ty)
}

/// The name of a component of an output: `Col.R`, `place.X`, `m.m00`, or the output alone. Files, texts and
/// JSON have the same.
pub fn channel(output: &str, ty: Type, component: usize) -> String {
    kind_of(ty).channels(output).into_iter().nth(component).unwrap_or_else(|| output.to_string())
}

fn kind_of(ty: Type) -> LayerKind {
    match ty {
        Type::COLOR => LayerKind::Color,
        Type::MATRIX => LayerKind::Matrix,
        ty if ty.is_triple() => LayerKind::Triple,
        _ => LayerKind::Scalar,
    }
}

/// The ranges of an output, for `--json`.
#[derive(Debug, Serialize)]
pub struct Output {
    name: String,
    #[serde(rename = "type")]
    ty: String,
    /// The names of the components, as the channels of files have them.
    channels: Vec<String>,
    components: Vec<Range>,
}

/// The ranges of the planes of a frame, piece by piece.
#[derive(Debug, Default)]
pub struct Ranges(Vec<(Arc<str>, Type, usize, Range)>);

/// The ranges of planes, tile by tile: joined in the order of the tiles' numbers, since a mean depends on the
/// order, and kept only until their turn comes.
#[derive(Debug, Default)]
pub struct InOrder {
    joined: Vec<Range>,
    /// The number of tiles that are joined.
    next: usize,
    early: BTreeMap<usize, Vec<Range>>,
}

impl InOrder {
    /// Adds the ranges of a tile.
    pub fn add(&mut self, tile: usize, ranges: Vec<Range>) {
        self.early.insert(tile, ranges);
        while let Some(ranges) = self.early.remove(&self.next) {
            self.joined.resize(ranges.len(), Range::default());
            self.joined.iter_mut().zip(ranges).for_each(|(all, here)| all.join(here));
            self.next += 1;
        }
    }
}

impl Ranges {
    /// Adds the values of these planes.
    pub fn add(&mut self, planes: &[Plane]) {
        let shown: Vec<&Plane> =
            planes.iter().filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure)).collect();
        if self.0.is_empty() {
            let start = |plane: &&Plane| (plane.output.clone(), plane.ty, plane.component, Range::default());
            self.0 = shown.iter().map(start).collect();
        }
        let mut ranges: Vec<Range> = self.0.iter().map(|(.., range)| *range).collect();
        let values = shown.iter().map(|plane| Values { words: &plane.words, ints: plane.kind == Kind::Int });
        Range::add_all(&mut ranges, &values.collect::<Vec<_>>());
        self.0.iter_mut().zip(ranges).for_each(|((.., to), range)| *to = range);
    }

    /// Adds the ranges of the tiles of planes.
    pub fn join(&mut self, planes: &[Plane], tiles: InOrder) {
        if self.0.is_empty() {
            self.add(planes);
        }
        self.0.iter_mut().zip(tiles.joined).for_each(|((.., all), here)| all.join(here));
    }

    /// The outputs with their components.
    pub fn outputs(&self) -> Vec<Output> {
        let mut outputs: Vec<Output> = Vec::new();
        for (name, ty, component, range) in &self.0 {
            match outputs.last_mut() {
                Some(last) if *component > 0 => {
                    last.channels.push(channel(name, *ty, *component));
                    last.components.push(*range);
                }
                _ => outputs.push(Output {
                    name: name.to_string(),
                    ty: StructTable::default().show(*ty),
                    channels: vec![channel(name, *ty, 0)],
                    components: vec![*range],
                }),
            }
        }
        outputs
    }
}

/// The summary of a run without an image: the range of each output, so that a first run shows something.
pub fn summary(ranges: &Ranges, out: &mut dyn Write) {
    for (output, ty, component, range) in &ranges.0 {
        let _ = writeln!(out, "{}: {}", channel(output, *ty, *component), described(range));
    }
    let _ = writeln!(out, "(no image written: name one with -o)");
}

fn described(Range { min, max, mean, .. }: &Range) -> String {
    // Without any number, the smallest value is positively infinite and the largest negatively.
    if min > max {
        return if mean.is_nan() { "NaN everywhere".into() } else { "no values".into() };
    }
    // Infinities of both signs also give such a mean.
    let some = mean.is_nan() && !(min.is_infinite() && max.is_infinite() && min != max);
    format!("{min} to {max}, mean {mean:.6}{}", if some { " (some values are NaN)" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_said() {
        let of = |values: &[f32]| {
            let words: Vec<u32> = values.iter().map(|x| x.to_bits()).collect();
            let mut ranges = [Range::default()];
            Range::add_all(&mut ranges, &[Values { words: &words, ints: false }]);
            described(&ranges[0])
        };
        assert_eq!(of(&[0.0, 1.0]), "0 to 1, mean 0.500000");
        assert_eq!(of(&[f32::NAN, f32::NAN]), "NaN everywhere");
        assert_eq!(of(&[0.0, f32::NAN, 1.0]), "0 to 1, mean NaN (some values are NaN)");
        assert_eq!(of(&[f32::NEG_INFINITY, f32::INFINITY]), "-inf to inf, mean NaN");
    }
}
