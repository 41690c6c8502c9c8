//! The points and parameters for which a statement is proved: a box, and its parts, the tiles.

use osl_exec::PointSource;
use osl_ir::global::Global;
use osl_ir::ir::{Body, Const, Kind};
use osl_numeric::interval::{Enclosure, Interval, Whole};
use serde::Serialize;
use std::sync::Arc;

/// A number that may have any value between two.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Range {
    /// `u`, `v`, or the name of a parameter, with the component of a triple.
    pub name: String,
    /// The smallest value.
    pub from: f32,
    /// The largest value.
    pub to: f32,
    /// Whether only whole numbers count.
    #[serde(skip)]
    pub is_int: bool,
}

/// A parameter that is not fixed: an input of the program, and the number of its first range.
#[derive(Clone, Debug, PartialEq)]
pub struct Open {
    /// The name of the input in the program.
    pub input: Arc<str>,
    /// Its first range in [`Domain::ranges`]; a triple has three.
    pub first: usize,
}

/// A box of points and parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    /// The ranges of u, of v, then of the open parameters.
    pub ranges: Vec<Range>,
    /// The open parameters.
    pub open: Vec<Open>,
}

impl Domain {
    /// The points of the unit patch, scaled and moved: all of them, not only those of a grid.
    pub fn of_patch(scale: [f32; 2], offset: [f32; 2]) -> Domain {
        let range = |axis: usize, name: &str| {
            let (a, b) = (offset[axis], scale[axis] + offset[axis]);
            Range { name: name.into(), from: a.min(b), to: a.max(b), is_int: false }
        };
        Domain { ranges: vec![range(0, "u"), range(1, "v")], open: Vec::new() }
    }

    /// All of it.
    pub(super) fn whole(&self) -> Tile {
        Tile {
            sides: self.ranges.iter().map(|range| [range.from, range.to]).collect(),
            inputs: self.open.clone(),
        }
    }

    /// The corners, as tiles: those of up to six ranges.
    pub(super) fn corners(&self) -> Vec<Tile> {
        let whole = self.whole();
        let corner = |bits: usize| {
            let mut tile = whole.clone();
            for (at, side) in tile.sides.iter_mut().enumerate() {
                let end = side[(bits >> at.min(5)) & 1];
                *side = [end, end];
            }
            tile
        };
        (0..1 << self.ranges.len().min(6)).map(corner).collect()
    }

    /// The side of a tile that is the longest part of its range and can be split.
    pub(super) fn longest(&self, tile: &Tile) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (at, (range, side)) in self.ranges.iter().zip(&tile.sides).enumerate() {
            let width = f64::from(side[1]) - f64::from(side[0]);
            let share = width / (f64::from(range.to) - f64::from(range.from));
            let step = if range.is_int { 1.0 } else { f64::from(side[0].abs().max(side[1].abs())) * 2.4e-7 };
            if width > step && share.is_finite() && best.is_none_or(|(_, most)| share > most * 1.000_001) {
                best = Some((at, share));
            }
        }
        best.map(|(at, _)| at)
    }

    /// The two halves of a tile; `None` if it is a single point already, or almost.
    pub(super) fn halves(&self, tile: &Tile) -> Option<[Tile; 2]> {
        let at = self.longest(tile)?;
        let [from, to] = tile.sides[at];
        let middle = (f64::from(from) / 2.0 + f64::from(to) / 2.0) as f32;
        let (end, start) = match self.ranges[at].is_int {
            true => (middle.floor(), middle.floor() + 1.0),
            // The halves share their border.
            false => (middle, middle),
        };
        let with = |side: [f32; 2]| {
            let mut half = tile.clone();
            half.sides[at] = side;
            half
        };
        Some([with([from, end]), with([start, to])])
    }
}

/// The globals that a tile gives.
const OF_TILE: [Global; 3] = [Global::P, Global::U, Global::V];

/// A part of a domain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tile {
    /// Both ends along each range.
    pub(super) sides: Vec<[f32; 2]>,
    inputs: Vec<Open>,
}

impl Tile {
    /// The point in the middle, as a tile.
    pub(super) fn middle(&self, domain: &Domain) -> Tile {
        let mut tile = self.clone();
        for (side, range) in tile.sides.iter_mut().zip(&domain.ranges) {
            let middle = (f64::from(side[0]) / 2.0 + f64::from(side[1]) / 2.0) as f32;
            let middle = if range.is_int { middle.floor().max(side[0]) } else { middle };
            *side = [middle, middle];
        }
        tile
    }

    /// The product of its widths, relative to the domain's.
    pub(super) fn volume(&self, domain: &Domain) -> f64 {
        let share = |(range, side): (&Range, &[f32; 2])| {
            let whole = f64::from(range.to) - f64::from(range.from);
            if whole > 0.0 { (f64::from(side[1]) - f64::from(side[0])) / whole } else { 1.0 }
        };
        domain.ranges.iter().zip(&self.sides).map(share).product()
    }

    /// The numbers along a range.
    pub(super) fn side(&self, at: usize) -> Interval {
        let [from, to] = self.sides.get(at).copied().unwrap_or([f32::NEG_INFINITY, f32::INFINITY]);
        Interval::new(from, to)
    }

    /// The values of a global.
    pub(super) fn global(&self, points: &dyn PointSource, global: Global, kind: Option<Kind>) -> Enclosure {
        if !points.varying().contains(&global) {
            return shaped(points.uniform(global), kind);
        }
        match global {
            _ if !OF_TILE.contains(&global) => Enclosure::any(kind.unwrap_or(Kind::Float)),
            Global::U => Enclosure::Float(self.side(0)),
            Global::V => Enclosure::Float(self.side(1)),
            _ => Enclosure::Triple([self.side(0), self.side(1), Interval::point(1.0)]),
        }
    }

    /// The values of an input of the program.
    pub(super) fn input(&self, body: &Body, index: u32) -> Enclosure {
        let Some(input) = body.inputs.get(index as usize) else { return Enclosure::any(Kind::Float) };
        let Some(open) = self.inputs.iter().find(|open| open.input == input.name) else {
            return Enclosure::point(&input.value);
        };
        match input.value {
            Const::Int(_) => {
                let [from, to] = self.sides.get(open.first).copied().unwrap_or([f32::MIN, f32::MAX]);
                Enclosure::Int(Whole { lo: from as i32, hi: to as i32 })
            }
            Const::Triple(_) => Enclosure::Triple([0, 1, 2].map(|i| self.side(open.first + i))),
            _ => Enclosure::Float(self.side(open.first)),
        }
    }
}

/// A datum of the points, as a value of a kind.
pub(super) fn shaped(value: [f32; 3], kind: Option<Kind>) -> Enclosure {
    match kind {
        Some(Kind::Triple) => Enclosure::Triple(value.map(Interval::point)),
        Some(Kind::Int) => Enclosure::Int(Whole::point(value[0] as i32)),
        _ => Enclosure::Float(Interval::point(value[0])),
    }
}
