//! Wording of a finding: why a line is blamed, as a sentence with its factor, its partner line and its error.

use super::pairs::{self, Pairs, Partner, Side};
use super::rerun::Broken;
use super::sensitivity::LineKey;
use super::statistics::{Blame, INEXACT, InstSite, ROUNDING};
use super::sweep::percent;
use super::trial::Setting;
use crate::quote::Quote;
use crate::sanitize::Kind;
use crate::words::short;
use osl_ir::Span;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::BTreeMap;

/// A source line to blame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Culprit {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The column of the instruction with the highest score, from 1.
    pub column: u32,
    /// The text of the line.
    pub text: String,
    /// The text of that instruction.
    pub code: String,
    /// Its operation, in the words of the IR; or the kind of the numeric event.
    pub what: String,
    /// The setting at which it happens.
    pub setting: String,
    /// What lines are ranked by: the error that the instruction magnifies, and with less weight the error of
    /// its rounding.
    pub score: f64,
    /// The error of its rounding, or that which it magnifies or makes otherwise, as a share of an output's
    /// range: the mean over the followed points, which have the largest errors. For numeric events, the share
    /// of the points.
    pub error: f64,
    /// The explanation, in words.
    pub why: String,
    /// Whether it is a numeric event, or a derivative of what jumps, rather than a loss of digits.
    pub is_event: bool,
    /// The line whose rounding the instruction magnifies, if most of it is from one line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnifies: Option<Partner>,
    /// The line that magnifies the instruction's rounding the most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnified_by: Option<Partner>,
}

/// An instruction comes before one that magnifies less only if it would magnify this part of that one's error
/// for right arguments too, which are rounded once.
const ITSELF: f64 = 0.03;

/// An instruction that runs so often at a point is in a loop.
const LOOP: f64 = 4.0;

/// What was found at all followed points.
pub(super) struct Found {
    /// The blame of each instruction.
    pub(super) places: BTreeMap<InstSite, Blame>,
    /// Instructions that magnify what others round.
    pub(super) pairs: Pairs,
    /// Instructions that magnify much more what others magnify first.
    pub(super) chains: Pairs,
    /// Instructions in loops that add up the error of others.
    pub(super) repeats: Pairs,
    /// The error of all roundings together that an instruction magnifies.
    pub(super) together: BTreeMap<InstSite, f64>,
    /// The error of all roundings of a line together.
    pub(super) lines: BTreeMap<LineKey, f64>,
}

/// An instruction with its score and its error.
#[derive(Default)]
pub(super) struct Charge {
    pub(super) place: InstSite,
    pub(super) score: f64,
    pub(super) error: f64,
    /// Whether the error is one of the outputs, and not a share of the points.
    pub(super) is_error: bool,
    /// Whether it is charged with its own rounding, or with what it magnifies.
    pub(super) rounds: bool,
    pub(super) loses: bool,
    /// Whether its own rounding adds up in a loop.
    pub(super) sums: bool,
    why: String,
    magnifies: Option<Partner>,
    pub(super) magnified_by: Option<Partner>,
}

impl Charge {
    /// Adds the roundings of other instructions of the line; `all` is the error of them together.
    pub(super) fn together_with(&mut self, more: usize, all: f64) {
        self.error = all;
        self.why += &match more {
            0 => String::new(),
            1 => " (with another rounding of the line)".to_string(),
            more => format!(" (with {more} more roundings of the line)"),
        };
    }

    /// A numeric event.
    pub(super) fn seen(span: Span, what: &str, share: f64, why: String) -> Charge {
        let place = InstSite { span, what: what.to_string() };
        Charge { place, score: share, error: share, why, ..Charge::default() }
    }

    pub(super) fn told(self, setting: &Setting, sources: &SourceMap) -> Option<Culprit> {
        let Quote { file, line, column, text, code } = Quote::of(self.place.span, sources)?;
        Some(Culprit {
            file,
            line,
            column,
            text,
            code,
            what: self.place.what,
            setting: setting.text(),
            score: self.score,
            error: self.error,
            why: self.why,
            is_event: !self.is_error,
            magnifies: self.magnifies,
            magnified_by: self.magnified_by,
        })
    }
}

/// What an instruction is blamed for at `points` points.
pub(super) fn charge(
    place: &InstSite,
    blame: &Blame,
    points: f64,
    found: &Found,
    sources: &SourceMap,
) -> Charge {
    let mut charge = Charge {
        place: place.clone(),
        score: blame.score() / points,
        error: blame.amplified.max(blame.rounded) / points,
        is_error: true,
        ..Charge::default()
    };
    let is_left = blame.left > 0.0 && blame.left >= (0.5 * blame.amplified).max(ROUNDING * blame.rounded);
    if let Some(broken) = blame.broken.filter(|_| is_left) {
        charge.why = leaves(broken).to_string();
        return charge;
    }
    let added = found.repeats.all(Side::Magnifies, place);
    if added > blame.amplified.max(blame.rounded) {
        adds(&mut charge, added, blame, points, found, sources);
        return charge;
    }
    // An instruction that hardly magnifies has lost nothing but its own rounding.
    let magnifies = blame.flips > 0 || !(0.0..pairs::LEAST).contains(&blame.factor) || blame.rounded == 0.0;
    if blame.amplified >= ROUNDING * blame.rounded && (magnifies || blame.factor == 0.0) {
        loses(&mut charge, blame, points, found, sources);
    } else {
        rounds(&mut charge, blame, points, found, sources);
    }
    charge
}

/// The error of another line, as the object of a sentence.
fn error_of(partner: &Partner, place: &InstSite, found: &Found, sources: &SourceMap) -> String {
    let line = partner.words(place, sources);
    let is_inexact = found.places.get(&partner.place).is_some_and(|own| own.roundings() >= INEXACT);
    if is_inexact { format!("the error of {line}") } else { format!("what {line} rounds") }
}

/// Completes the charge of an instruction of a loop that adds up the error of a value from before the loop.
fn adds(charge: &mut Charge, added: f64, blame: &Blame, points: f64, found: &Found, sources: &SourceMap) {
    let place = &charge.place;
    charge.loses = true;
    charge.score = added / points;
    charge.error = added / points;
    charge.magnifies = found.repeats.partner(Side::Rounds, place, sources);
    let what = match &charge.magnifies {
        Some(partner) => error_of(partner, place, found, sources),
        None => "the errors of its operands".to_string(),
    };
    let times = f64::from(blame.runs.max(1)) / points;
    charge.why = format!("adds up {what}: it uses the same value {} times a point", short(times, 2));
}

/// Completes the charge of an instruction that magnifies, or jumps.
fn loses(charge: &mut Charge, blame: &Blame, points: f64, found: &Found, sources: &SourceMap) {
    let place = &charge.place;
    charge.loses = true;
    charge.error = charge.error.max(found.together.get(place).copied().unwrap_or(0.0) / points);
    charge.magnifies = found.pairs.partner(Side::Rounds, place, sources);
    charge.magnified_by = found.chains.partner(Side::Magnifies, place, sources).filter(|by| {
        let other = found.places.get(&by.place).map_or(0.0, |by| by.amplified);
        found.chains.all(Side::Rounds, place) >= 0.5 * blame.amplified && other >= ITSELF * blame.amplified
    });
    let what = charge.magnifies.as_ref().map(|partner| error_of(partner, place, found, sources));
    let factor = blame.factor;
    charge.why = match what {
        _ if blame.flips > 0 => {
            let at = what.map_or_else(String::new, |what| format!(" at {what}"));
            let share = percent(f64::from(blame.flips) / f64::from(blame.runs.max(1)));
            format!(
                "jumps{at}: its result is another than in double precision in {share} of its runs at the worst \
                 points"
            )
        }
        _ if !(factor > 1.0 && factor.is_finite()) => {
            "loses digits: a rounding of its arguments makes its result wrong".to_string()
        }
        Some(what) => format!("loses digits: it magnifies up to {} times {what}", short(factor, 2)),
        None => {
            format!("loses digits: it magnifies the error of its arguments up to {} times", short(factor, 2))
        }
    };
}

/// Completes the charge of an instruction whose own error counts.
fn rounds(charge: &mut Charge, blame: &Blame, points: f64, found: &Found, sources: &SourceMap) {
    let place = &charge.place;
    charge.rounds = true;
    charge.score = ROUNDING * blame.rounded / points;
    charge.error = blame.rounded / points;
    // A line is named if it has to do with at least half of the error.
    let has_half = |pairs: &Pairs| pairs.all(Side::Rounds, place) >= 0.5 * blame.rounded;
    let own = match blame.roundings() {
        n if n >= INEXACT => format!("is inexact, with {} times the error of a rounding", short(n, 2)),
        _ => "rounds its result".to_string(),
    };
    if has_half(&found.repeats)
        && let Some(by) = found.repeats.partner(Side::Magnifies, place, sources)
    {
        charge.why = format!("{own}, which {} adds up", by.words(place, sources));
        charge.magnified_by = Some(by);
        return;
    }
    charge.magnified_by =
        found.pairs.partner(Side::Magnifies, place, sources).filter(|_| has_half(&found.pairs));
    let by = charge.magnified_by.as_ref().and_then(|by| found.places.get(&by.place));
    let times = f64::from(blame.runs.max(1)) / points;
    if times >= LOOP {
        charge.sums = true;
        // What magnifies the sum after the loop is not the one to look at first.
        if !by.is_some_and(|by| f64::from(by.runs) >= LOOP * points) {
            charge.magnified_by = None;
        }
        charge.why = format!("{own} {} times a point, which adds up", short(times, 2));
        return;
    }
    let line = charge.magnified_by.as_ref().map(|partner| partner.words(place, sources));
    charge.why = match (line, by) {
        (Some(line), Some(by)) if by.flips > 0 => format!("{own}, at which {line} jumps"),
        (Some(line), Some(by)) => {
            format!("{own}, which {line} magnifies up to {} times", short(by.factor, 2))
        }
        _ => format!("{own}, which later lines make worse"),
    };
}

/// How a result leaves the range of floats, in words.
fn leaves(broken: Broken) -> &'static str {
    match broken {
        Broken::Overflow => "overflows: its result is larger than a float can hold",
        Broken::OverflowWithin => "overflows: a number within it is larger than a float can hold",
        Broken::Underflow => "underflows: its result is smaller than a float can hold, so that it becomes 0",
        Broken::UnderflowWithin => {
            "underflows: a number within it is smaller than a float can hold, so that it becomes 0"
        }
        Broken::Denormal => "underflows: its result is so small that a float holds only some of its digits",
        Broken::Nan => "makes a NaN where double precision has a number",
    }
}

/// What an instruction does at a numeric event; `None` for events of precision, for which lines are blamed.
pub(super) fn does(kind: Kind) -> Option<&'static str> {
    (kind != Kind::Cancellation).then(|| kind.verb())
}
