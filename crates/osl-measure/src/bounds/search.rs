//! Splits the domain until the bounds are tight, or the effort is spent.
//!
//! The tiles in hand cover the domain, so the hull of their enclosures holds everywhere. In each round, those
//! that matter most are split: those whose enclosures exceed the values that were reached the most, and those
//! with statements that are open. The number of tiles in a round is fixed, so the result does not depend on
//! the number of threads.

use super::calls::Calls;
use super::defs::Defs;
use super::domain::{Domain, Tile};
use super::numbers::Numbers;
use super::paths::Paths;
use super::sites::{ProofSite, Sites, Watched, What};
use super::state::{Program, Walk};
use super::walk::apart;
use super::{Claim, Output, Report, Verdict};
use crate::quote::Quote;
use crate::sanitize::{Subject, is_written};
use osl_exec::{PointSource, Services};
use osl_ir::Span;
use osl_ir::ir::{Inst, Op};
use osl_numeric::interval::Enclosure;
use osl_syntax::source::SourceMap;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How much a search may do besides its time, which the limits of the subject bound.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Maximum number of tiles.
    pub tiles: usize,
    /// A bound is tight if it exceeds the reached values by at most this share of their range.
    pub tight: f64,
}

impl Default for Effort {
    fn default() -> Effort {
        Effort { tiles: 20_000, tight: 1e-3 }
    }
}

/// Tiles that are split in one round.
const ROUND: usize = 32;

/// From this score on, a tile is walked path by path.
const POOR: f64 = 0.25;

/// What a tile shows.
struct Walked {
    tile: Tile,
    /// The components of the outputs.
    numbers: Vec<Numbers>,
    seen: BTreeMap<ProofSite, super::sites::Seen>,
}

/// What was found at computed points.
struct Reached {
    numbers: Vec<Numbers>,
    wrong: BTreeMap<ProofSite, Vec<f32>>,
    points: usize,
}

/// Proves what it can about a shader at all points of a domain. `points` gives what is the same at all of
/// them.
pub fn prove(
    subject: &Subject,
    (services, points, sources): (&Services, &dyn PointSource, &SourceMap),
    domain: &Domain,
    effort: Effort,
    shader: &str,
) -> Report {
    let body = &subject.body;
    let defs = Defs::of(body);
    let is_own = |inst: &Inst| {
        let Op::Lane(op, _) = inst.op else { return false };
        inst.span != Span::default()
            && inst.results.first().is_none_or(|value| value.index() < subject.written)
            && is_written(op, sources.text(inst.span))
    };
    let watched = Arc::new(Watched::of(body, &defs, is_own));
    let calls = Calls::new(body, services, points, &subject.limits);
    let program = Program { body, defs: &defs, points, calls: &calls };
    let search = Search { program, watched, domain, effort };
    let mut tiles = vec![search.walk(domain.whole())];
    if search.is_over() {
        tiles = vec![Walked::unknown(program, domain.whole(), &search.watched)];
    }
    let mut walked = 1;
    let mut reached = Reached::none(&tiles[0]);
    for point in std::iter::once(domain.whole().middle(domain)).chain(domain.corners()) {
        let point = search.walk(point);
        if search.is_over() {
            break;
        }
        reached.add(&point);
    }
    let is_cut = search.refine(&mut tiles, &mut reached, &mut walked);
    report(&tiles, reached, (domain, sources, subject), (walked, is_cut), shader)
}

/// The search of a program over a domain.
struct Search<'a> {
    program: Program<'a>,
    watched: Arc<Watched>,
    domain: &'a Domain,
    effort: Effort,
}

impl Search<'_> {
    /// Whether the time is over. A walk that it ends shows nothing, so no walk counts from then on.
    fn is_over(&self) -> bool {
        self.program.calls.limits.halted().is_some()
    }

    fn walk(&self, tile: Tile) -> Walked {
        let mut sites = Sites::new(self.watched.clone());
        let outputs = Walk::run(self.program, &tile, &mut sites, &mut Paths::joined()).unwrap_or_default();
        Walked { numbers: components(&outputs), seen: sites.seen, tile }
    }

    /// Walking each case takes many walks, so only a tile with poor bounds is walked this way.
    fn walk_well(&self, tile: Tile, reached: &Reached) -> Walked {
        let mut walked = self.walk(tile);
        if walked.score(reached) >= POOR
            && let Some((outputs, sites)) = apart(self.program, &walked.tile, &self.watched)
        {
            walked.meet(&components(&outputs), &sites);
        }
        walked
    }

    /// Splits tiles, round by round; `walked` counts them. Returns whether the search ended early.
    fn refine(&self, tiles: &mut Vec<Walked>, reached: &mut Reached, walked: &mut usize) -> bool {
        loop {
            let chosen = open_tiles(tiles, reached, self.domain, self.effort);
            let chosen: Vec<usize> = chosen.into_iter().take(ROUND).collect();
            if chosen.is_empty() {
                return false;
            }
            if self.is_over() || *walked + 2 * chosen.len() > self.effort.tiles {
                return true;
            }
            let halves = chosen.into_iter().filter_map(|at| Some((at, self.domain.halves(&tiles[at].tile)?)));
            let halves: Vec<(usize, [Tile; 2])> = halves.collect();
            let found: Vec<(usize, [Walked; 2], [Walked; 2])> = halves
                .into_par_iter()
                .map(|(at, halves)| {
                    let middles = halves.each_ref().map(|half| self.walk(half.middle(self.domain)));
                    (at, halves.map(|half| self.walk_well(half, reached)), middles)
                })
                .collect();
            if self.is_over() {
                return true;
            }
            *walked += 2 * found.len();
            for (at, [first, second], middles) in found {
                middles.iter().for_each(|middle| reached.add(middle));
                let seen = std::mem::replace(&mut tiles[at], first);
                tiles.push(second);
                // A half is enclosed by the whole too.
                let last = tiles.len() - 1;
                for half in [at, last] {
                    tiles[half].inherit(&seen);
                }
            }
        }
    }
}

impl Walked {
    /// A tile for which nothing is proven yet.
    fn unknown(program: Program<'_>, tile: Tile, watched: &Arc<Watched>) -> Walked {
        let numbers = components(&Walk::unknown(program.body));
        Walked { tile, numbers, seen: Sites::unknown(program.body, watched).seen }
    }

    /// How much more could be known: by how much an enclosure exceeds the numbers that were reached, at least
    /// one half if a statement is open.
    fn score(&self, reached: &Reached) -> f64 {
        let by_numbers = self.numbers.iter().zip(&reached.numbers).map(|(x, known)| excess(*x, *known));
        let most = by_numbers.fold(0.0, f64::max);
        let is_open = |(place, seen): (&ProofSite, &super::sites::Seen)| {
            !seen.is_safe && !reached.wrong.contains_key(place)
        };
        if self.seen.iter().any(is_open) { most.max(0.5) } else { most }
    }

    /// Adds what other walks of the same tile showed. They saw every place that a point reaches.
    fn meet(&mut self, numbers: &[Numbers], sites: &Sites) {
        for (own, other) in self.numbers.iter_mut().zip(numbers) {
            *own = own.meet(*other);
        }
        for (place, seen) in &mut self.seen {
            match sites.seen.get(place) {
                Some(other) => {
                    seen.is_safe |= other.is_safe;
                    seen.values = seen.values.meet(other.values);
                }
                None => (seen.is_safe, seen.values) = (true, Numbers::NONE),
            }
        }
    }

    /// Keeps the bounds of the larger tile that contains this one.
    fn inherit(&mut self, whole: &Walked) {
        for (own, of_whole) in self.numbers.iter_mut().zip(&whole.numbers) {
            *own = own.meet(*of_whole);
        }
        for (place, seen) in &mut self.seen {
            if whole.seen.get(place).is_some_and(|of_whole| of_whole.is_safe) {
                seen.is_safe = true;
            }
        }
    }
}

impl Reached {
    /// Nothing, for the outputs of a tile.
    fn none(tile: &Walked) -> Reached {
        let numbers = vec![Numbers::NONE; tile.numbers.len()];
        Reached { numbers, wrong: BTreeMap::new(), points: 0 }
    }

    fn add(&mut self, point: &Walked) {
        self.points += 1;
        for (reached, number) in self.numbers.iter_mut().zip(&point.numbers) {
            // What is not known exactly is not known to be reached.
            if number.is_known() {
                *reached = reached.hull(*number);
            }
        }
        for (place, seen) in &point.seen {
            if seen.is_wrong && !self.wrong.contains_key(place) {
                self.wrong.insert(place.clone(), point.tile.sides.iter().map(|side| side[0]).collect());
            }
        }
    }
}

/// The tiles that should be split, the most important first.
fn open_tiles(tiles: &[Walked], reached: &Reached, domain: &Domain, effort: Effort) -> Vec<usize> {
    let mut open: Vec<(f64, f64, usize)> = Vec::new();
    for (at, walked) in tiles.iter().enumerate() {
        let score = walked.score(reached);
        if score > effort.tight && domain.longest(&walked.tile).is_some() {
            open.push((score, walked.tile.volume(domain), at));
        }
    }
    open.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
    open.into_iter().map(|(.., at)| at).collect()
}

/// By how much an enclosure exceeds the reached numbers, as a share of their range; at most 1.
fn excess(x: Numbers, reached: Numbers) -> f64 {
    let new_nan = x.may_be_nan() && !reached.may_be_nan();
    if x.is_empty() {
        return if new_nan { 1.0 } else { 0.0 };
    }
    if reached.is_empty() || new_nan {
        return 1.0;
    }
    let (lo, hi) = (reached.lo(), reached.hi());
    let size = (hi - lo).max(1e-6 * lo.abs().max(hi.abs())).max(1e-30);
    let beyond = (lo - x.lo()).max(x.hi() - hi);
    // Infinities that are reached are no excess.
    if beyond.is_nan() { 0.0 } else { (beyond / size).clamp(0.0, 1.0) }
}

/// The numbers of all outputs, one after the other.
fn components(outputs: &[Vec<Enclosure>]) -> Vec<Numbers> {
    outputs.iter().flatten().flat_map(Numbers::of).collect()
}

fn report(
    tiles: &[Walked],
    reached: Reached,
    (domain, sources, subject): (&Domain, &SourceMap, &Subject),
    (walked, is_cut): (usize, bool),
    shader: &str,
) -> Report {
    let mut bounds = vec![Numbers::NONE; reached.numbers.len()];
    for tile in tiles {
        for (bound, number) in bounds.iter_mut().zip(&tile.numbers) {
            *bound = bound.hull(*number);
        }
    }
    let names = names(subject);
    let output =
        |((name, component, is_int), (bound, known)): (&(String, String, bool), (&Numbers, &Numbers))| {
            Output {
                name: name.clone(),
                component: component.clone(),
                lowest: bound.lo(),
                highest: bound.hi(),
                reached: known.ends(),
                never_nan: match (bound.may_be_nan(), known.may_be_nan()) {
                    (false, _) => Verdict::Proven,
                    (true, true) => Verdict::Wrong,
                    (true, false) => Verdict::NotProven,
                },
                is_finite: !bound.has_infinity(),
                is_int: *is_int,
            }
        };
    let outputs = names.iter().zip(bounds.iter().zip(&reached.numbers)).map(output).collect();
    let mut places: BTreeMap<ProofSite, (bool, Numbers)> = BTreeMap::new();
    for (place, seen) in tiles.iter().flat_map(|tile| &tile.seen) {
        let known = places.entry(place.clone()).or_insert((true, Numbers::NONE));
        *known = (known.0 && seen.is_safe, known.1.hull(seen.values));
    }
    let claim = |((span, what), (is_safe, values)): (ProofSite, (bool, Numbers))| {
        let at = reached.wrong.get(&(span, what.clone())).cloned();
        Some(Claim {
            kind: what.kind(),
            quote: Quote::of(span, sources)?,
            verdict: match (is_safe, &at) {
                (true, _) => Verdict::Proven,
                (false, Some(_)) => Verdict::Wrong,
                (false, None) => Verdict::NotProven,
            },
            values: values.ends(),
            at: at.filter(|_| !is_safe),
            what,
        })
    };
    Report {
        shader: shader.to_string(),
        left_out: subject.left_out.clone(),
        domain: domain.ranges.clone(),
        tiles: walked,
        points: reached.points,
        is_cut,
        outputs,
        claims: places.into_iter().filter_map(claim).collect(),
    }
}

/// The name, the component and whether it is an int, of each number of the outputs.
fn names(subject: &Subject) -> Vec<(String, String, bool)> {
    use osl_ir::ir::{Kind, Source};
    let body = &subject.body;
    let mut names = Vec::new();
    for output in &body.outputs {
        let (kind, count) = match output.source {
            Source::Value(value) => (body.kind(value), None),
            Source::Slot(slot) => (body.slot(slot).kind, body.slot(slot).len),
        };
        let is_color = output.ty.base == osl_ir::types::Base::Color;
        for element in 0..count.unwrap_or(1) {
            let name = match count {
                Some(_) => format!("{}[{element}]", output.name),
                None => output.name.to_string(),
            };
            let mut push = |component: String| names.push((name.clone(), component, kind == Kind::Int));
            match kind {
                Kind::Int | Kind::Float => push(String::new()),
                Kind::Triple => {
                    let letters = if is_color { ["r", "g", "b"] } else { ["x", "y", "z"] };
                    letters.into_iter().for_each(|letter| push(letter.to_string()));
                }
                Kind::Matrix => (0..16).for_each(|at| push(format!("{}{}", at / 4, at % 4))),
                Kind::Str | Kind::Closure => {}
            }
        }
    }
    names
}

/// Whether a statement proves that an int does not wrap around. There are many, so the report counts them.
pub(super) fn is_minor(claim: &Claim) -> bool {
    claim.what == What::Overflow && claim.verdict == Verdict::Proven
}
