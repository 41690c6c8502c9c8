//! Amplification: pairs of an instruction that rounds and a later one that magnifies this rounding.
//!
//! The error of an output is followed from the output back to the roundings that made it. On the way, each
//! part of the error remembers the instruction that magnifies it the most. Where parts with different
//! memories join, the memory of the largest part counts.

use super::statistics::{Blame, InstSite};
use crate::trace::NodeId;
use osl_ir::Span;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;

/// Instructions with smaller factors pass an error on rather than magnify it: the largest factor at any point
/// counts.
const NOTABLE: f64 = 8.0;

/// An instruction that magnifies less than this at a point is not looked at.
pub(super) const LEAST: f64 = 2.0;

/// An instruction that magnifies, and its factor; infinite for a jump.
type Magnifier = (NodeId, f64);

/// What each node of a trace has on the path from it to the outputs.
pub(super) struct Paths {
    /// The instruction that magnifies the most, and the part of the error that goes to it.
    nodes: Vec<(Option<Magnifier>, f64)>,
}

impl Paths {
    /// The paths of a trace with this number of nodes.
    pub(super) fn new(nodes: usize) -> Paths {
        Paths { nodes: vec![(None, 0.0); nodes] }
    }

    /// The instruction after a node that magnifies its error the most, and its factor.
    pub(super) fn after(&self, id: usize) -> Option<Magnifier> {
        self.nodes.get(id)?.0
    }

    /// The same, unless it hardly magnifies at this point.
    pub(super) fn magnifier(&self, id: usize) -> Option<Magnifier> {
        self.after(id).filter(|(_, factor)| *factor >= LEAST)
    }

    /// Tells the arguments of a node what magnifies the parts of the error that come from them.
    pub(super) fn pass_on(&mut self, id: usize, blame: &Blame, args: &[NodeId], parts: &[f64]) {
        let after = self.nodes.get(id).and_then(|node| node.0);
        let factor = match blame.amplified > 0.0 {
            true if blame.flips > 0 => f64::INFINITY,
            true => blame.factor,
            false => 0.0,
        };
        let is_more = factor > 1.0 && after.is_none_or(|(_, most)| factor > most);
        let magnifier = if is_more { Some((id as NodeId, factor)) } else { after };
        for (arg, part) in args.iter().zip(parts) {
            if let Some(node) = self.nodes.get_mut(*arg as usize).filter(|node| *part > node.1) {
                *node = (magnifier, *part);
            }
        }
    }
}

/// The pairs of all followed points, with the error that came through each as a share of the output's range.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    /// By the instruction that magnifies, then by the one that rounds.
    found: BTreeMap<(InstSite, InstSite), f64>,
}

/// One instruction of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// The one that magnifies.
    Magnifies,
    /// The one whose rounding is magnified.
    Rounds,
}

/// The other line of a pair of lines.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Partner {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The text of its instruction.
    pub code: String,
    /// The instruction.
    #[serde(skip)]
    pub place: InstSite,
}

impl Pairs {
    pub(super) fn add(&mut self, magnifies: InstSite, rounds: InstSite, error: f64) {
        if error > 0.0 {
            *self.found.entry((magnifies, rounds)).or_default() += error;
        }
    }

    pub(super) fn merge(&mut self, other: Pairs) {
        for ((magnifies, rounds), error) in other.found {
            self.add(magnifies, rounds, error);
        }
    }

    /// The errors times a factor.
    pub(super) fn scaled(mut self, by: f64) -> Pairs {
        self.found.values_mut().for_each(|error| *error *= by);
        self
    }

    /// The error of all pairs that have an instruction on this side.
    pub(super) fn all(&self, side: Side, of: &InstSite) -> f64 {
        let own = |(by, rounds): &(InstSite, InstSite)| {
            if side == Side::Magnifies { by == of } else { rounds == of }
        };
        self.found.iter().filter(|(pair, _)| own(pair)).map(|(_, error)| error).sum()
    }

    /// For each instruction that magnifies: the ones whose roundings it magnifies, with their errors.
    pub(super) fn by_magnifier(&self) -> BTreeMap<&InstSite, BTreeMap<&InstSite, f64>> {
        let mut out: BTreeMap<&InstSite, BTreeMap<&InstSite, f64>> = BTreeMap::new();
        for ((by, rounds), error) in &self.found {
            *out.entry(by).or_default().entry(rounds).or_default() += error;
        }
        out
    }

    /// Without the pairs of instructions that pass errors on rather than magnify them.
    pub(super) fn notable(mut self, places: &BTreeMap<InstSite, Blame>) -> Pairs {
        self.found.retain(|(by, _), _| places.get(by).is_some_and(|by| by.flips > 0 || by.factor >= NOTABLE));
        self
    }

    /// The partner of an instruction on one side, if at least half of the error of its pairs has to do with
    /// one line. Its instruction is the one of that line with the largest part.
    pub(super) fn partner(&self, side: Side, of: &InstSite, sources: &SourceMap) -> Option<Partner> {
        let others = self.others(side, of, sources);
        let (partner, error) = others.largest(sources)?;
        (error >= 0.5 * others.all).then_some(partner)
    }

    /// The line that forms what an instruction magnifies, if it is another line: no line has more of the
    /// error, and the line of the instruction itself has less than a tenth.
    pub(super) fn forms(&self, of: &InstSite, sources: &SourceMap) -> Option<Partner> {
        let at = sources.place(of.span)?;
        let others = self.others(Side::Rounds, of, sources);
        let (partner, _) = others.largest(sources)?;
        let own = (at.file, at.line);
        let part = others.lines.get(&own).map_or(0.0, |line| line.error);
        ((&partner.file, partner.line) != (&own.0, own.1) && part < 0.1 * others.all).then_some(partner)
    }

    /// The lines on the other side of the pairs of an instruction.
    fn others(&self, side: Side, of: &InstSite, sources: &SourceMap) -> Others<'_> {
        let mut others = Others { all: 0.0, lines: BTreeMap::new() };
        for ((magnifies, rounds), error) in &self.found {
            let (own, other) = if side == Side::Rounds { (magnifies, rounds) } else { (rounds, magnifies) };
            if own != of {
                continue;
            }
            others.all += error;
            let Some(at) = sources.place(other.span).filter(|_| other.span != Span::default()) else {
                continue;
            };
            let new = Other { error: 0.0, largest: 0.0, place: other };
            let line = others.lines.entry((at.file, at.line)).or_insert(new);
            line.error += error;
            if *error > line.largest {
                (line.largest, line.place) = (*error, other);
            }
        }
        others
    }
}

/// The lines on the other side of pairs.
struct Others<'a> {
    /// The error of all pairs.
    all: f64,
    lines: BTreeMap<(String, u32), Other<'a>>,
}

impl Others<'_> {
    /// The line with the largest error, and this error.
    fn largest(&self, sources: &SourceMap) -> Option<(Partner, f64)> {
        let by_error = |a: &(&(String, u32), &Other<'_>), b: &(&(String, u32), &Other<'_>)| {
            a.1.error.total_cmp(&b.1.error).then(b.0.cmp(a.0))
        };
        let ((file, line), Other { error, place, .. }) = self.lines.iter().max_by(by_error)?;
        let code = sources.text(place.span).split_whitespace().collect::<Vec<_>>().join(" ");
        let code = code.chars().take(CODE).collect();
        Some((Partner { file: file.clone(), line: *line, code, place: (*place).clone() }, *error))
    }
}

struct Other<'a> {
    /// The error of all pairs with the line.
    error: f64,
    /// That of its instruction with the largest error, and this instruction.
    largest: f64,
    place: &'a InstSite,
}

/// Characters of a partner's text that are kept.
const CODE: usize = 40;

impl Partner {
    /// The partner as the noun of a sentence about another instruction.
    pub(super) fn words(&self, of: &InstSite, sources: &SourceMap) -> String {
        let Partner { file, line, code, .. } = self;
        match sources.place(of.span) {
            Some(at) if (&at.file, at.line) == (file, *line) => format!("`{code}` in the same line"),
            Some(at) if at.file == *file => format!("line {line}"),
            _ => format!("line {line} of {file}"),
        }
    }
}
