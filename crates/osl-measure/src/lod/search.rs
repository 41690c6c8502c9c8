//! Finds the levels: from which footprint on all outputs may be replaced by their means, and which statements
//! before that, greedily, the dearest first.
//!
//! Everything is chosen on the fitted points and then judged on the points that were held out; a level that
//! does not hold there begins at a larger footprint or is dropped. This module must not know how the text is
//! written.

use super::Build;
use super::frame::Frame;
use super::inputs::Inputs;
use super::judge::{FOOTPRINTS, Judge, Off, Set, Truth, Variant};
use super::means::{Statement, value};
use super::write::{BEGIN, Far, Inner, Mean, Near, Plan, Said, soft, write};
use super::{edges, noise};
use crate::stability::fix::source::Source;
use osl_exec::RunError;
use osl_hir::hir::Param;
use osl_ir::types::{Base, Type};
use osl_syntax::diagnostic::Edit;

/// What is known of a footprint in one of the sets.
pub(super) struct FootprintErrors {
    pub(super) truth: Truth,
    /// The errors of the original with the number of samples that a level must match.
    pub(super) original: Off,
}

/// Measures the original at some footprints.
pub(super) fn known(
    judge: &Judge<'_>,
    original: &Variant,
    footprints: &[f64],
    (set, samples): (Set, u32),
) -> Result<Vec<FootprintErrors>, RunError> {
    let one = |footprint: &f64| {
        let truth = judge.truth(original, *footprint, set)?;
        let original = judge.off(original, &truth, samples)?;
        Ok(FootprintErrors { truth, original })
    };
    footprints.iter().map(one).collect()
}

/// Changes in place with their errors at the footprints at which the body runs, in both sets.
#[derive(Default)]
struct TriedChanges {
    inner: Inner,
    offs: Vec<Off>,
}

impl TriedChanges {
    /// The sum of the mean square errors.
    fn sum(&self) -> f64 {
        self.offs.iter().map(|off| off.all().mean).sum()
    }
}

/// The search for levels of one shader.
pub(super) struct Search<'s, 'a> {
    pub(super) judge: &'s Judge<'a>,
    pub(super) source: &'s Source<'s>,
    pub(super) frame: &'s Frame,
    pub(super) inputs: &'s Inputs,
    pub(super) original: &'s Variant,
    pub(super) build: &'s Build<'s>,
    /// Samples per pixel, of the original and of everything that is compared with it.
    pub(super) samples: u32,
    pub(super) tolerance: f64,
    pub(super) fitted: &'s [FootprintErrors],
    pub(super) held: &'s [FootprintErrors],
    /// The width of a pixel at footprint 1.
    pub(super) width: f64,
    /// Number of programs that were tried.
    pub(super) tried: usize,
}

/// How much cheaper a near level must be than the one before it.
const CHEAPER: f64 = 0.9;
/// The footprints at which near levels may begin to be complete.
const NEAR: [usize; 3] = [2, 4, 6];

impl Search<'_, '_> {
    /// The level at which all outputs are their means. A shader that filters by itself may have other means
    /// at larger footprints, so the means are those of the footprints at which they are used.
    pub(super) fn far(&self) -> Option<Far> {
        let is_number = |base: Base| matches!(base, Base::Int | Base::Float) || base.is_triple();
        let program = self.source.program;
        let mut outputs = program.shader.params.iter().filter(|param| param.output);
        let is_one =
            |param: &Param| program.vars.get(param.var.0 as usize).is_some_and(|var| is_number(var.ty.base));
        if !outputs.all(is_one) {
            return None;
        }
        // At footprint 1 the original always runs.
        'next: for (from, full) in FOOTPRINTS.into_iter().enumerate().skip(1) {
            let over: Vec<&Truth> = self.fitted.iter().skip(from).map(|known| &known.truth).collect();
            let mut planes = self.judge.means(&over);
            let mut means = Vec::new();
            for output in &self.judge.outputs {
                let own = planes.get_mut(output.planes.clone())?;
                let is_int = output.ty == Type::INT;
                if is_int {
                    own.iter_mut().for_each(|x| *x = x.round());
                }
                let Some(text) = value(output.ty, own, output.range) else { continue 'next };
                means.push(Mean { name: output.name.clone(), text, is_int });
            }
            let is_good = |known: &FootprintErrors| {
                self.constant(&planes, known).is_good(&known.original, self.tolerance)
            };
            if [self.fitted, self.held].into_iter().all(|set| set.iter().skip(from).all(is_good)) {
                return Some(Far { full, means, planes });
            }
        }
        None
    }

    /// The errors of planes that have the same value everywhere.
    pub(super) fn constant(&self, planes: &[f64], known: &FootprintErrors) -> Off {
        let count = known.original.squares.first().map_or(0, Vec::len);
        let values: Vec<Vec<f32>> = planes.iter().map(|x| vec![*x as f32; count]).collect();
        self.judge.compare(&values, &known.truth)
    }

    /// Changes in place that bring the body closer at a footprint at which it runs: noise that fades, then
    /// edges that become softer.
    pub(super) fn inner(&mut self, far: Option<&Far>) -> Result<Inner, RunError> {
        let mut now =
            TriedChanges { inner: Inner { cost: self.original.cost, ..Inner::default() }, offs: Vec::new() };
        now.offs = self.before(far).map(|known| known.original.clone()).collect();
        self.noise(&mut now, far)?;
        self.edges(&mut now, far)?;
        Ok(now.inner)
    }

    /// The footprints in both sets at which the body runs.
    fn before(&self, far: Option<&Far>) -> impl Iterator<Item = &FootprintErrors> {
        let end = far.map_or(f64::INFINITY, |far| far.full);
        self.fitted.iter().chain(self.held).filter(move |known| known.truth.footprint < end)
    }

    fn noise(&mut self, now: &mut TriedChanges, far: Option<&Far>) -> Result<(), RunError> {
        let calls = noise::calls(self.source);
        if calls.is_empty() {
            return Ok(());
        }
        let (source, frame) = (self.source, self.frame);
        let inner = |list: &[&noise::Call], fade: [&str; 2]| Inner {
            calls: list.len(),
            fade: fade.map(str::to_string),
            edits: noise::edits(source, frame, list, fade),
            ..Inner::default()
        };
        let all: Vec<&noise::Call> = calls.iter().collect();
        for fade in noise::FADES {
            if let Some(found) = self.attempt(inner(&all, fade), now, far)? {
                *now = found;
                return Ok(());
            }
        }
        for fade in noise::FADES {
            let mut taken: Vec<&noise::Call> = Vec::new();
            for call in &calls {
                let mut more = taken.clone();
                more.push(call);
                if let Some(found) = self.attempt(inner(&more, fade), now, far)? {
                    (taken, *now) = (more, found);
                }
            }
            if !taken.is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn edges(&mut self, now: &mut TriedChanges, far: Option<&Far>) -> Result<(), RunError> {
        let name = soft(self.source);
        for edge in edges::edges(self.source, self.frame) {
            if now.inner.edits.iter().any(|edit| edges::excludes(&edge, edit)) {
                continue;
            }
            let mut best: Option<TriedChanges> = None;
            for slope in edges::SLOPES {
                let mut inner = Inner { edges: now.inner.edges + 1, ..now.inner.clone() };
                inner.edits.extend(edges::soften(&edge, slope, &name));
                inner.edits.sort_by_key(|edit| edit.span.start);
                let Some(found) = self.attempt(inner, now, far)? else { continue };
                if best.as_ref().is_none_or(|best| found.sum() < best.sum()) {
                    best = Some(found);
                }
            }
            *now = best.unwrap_or_else(|| std::mem::take(now));
        }
        Ok(())
    }

    /// Tries changes in place. `None` if they change the image at footprint 1, are worse than the original at
    /// a footprint before the far level, or closer than what is known already at none.
    fn attempt(
        &mut self,
        inner: Inner,
        now: &TriedChanges,
        far: Option<&Far>,
    ) -> Result<Option<TriedChanges>, RunError> {
        let plan = Plan { inner, ..Plan::default() };
        let said = Said { errors: &[], samples: self.samples, given: false, largest: self.width };
        let text = write(self.source, self.frame, self.inputs, &plan, (self.width, &said));
        let Some(built) = text.and_then(|text| (self.build)(&text)) else { return Ok(None) };
        self.tried += 1;
        let variant = self.judge.variant(built.plain);
        let mut offs = Vec::new();
        let mut is_better = false;
        for (known, earlier) in self.before(far).zip(&now.offs) {
            let off = self.judge.off(&variant, &known.truth, self.samples)?;
            let is_changed = known.truth.footprint == 1.0 && off.squares != known.original.squares;
            if is_changed || !off.is_good(&known.original, self.tolerance) {
                return Ok(None);
            }
            is_better |= off.is_better(earlier);
            offs.push(off);
        }
        let inner = Inner { cost: variant.cost, ..plan.inner };
        Ok(is_better.then_some(TriedChanges { inner, offs }))
    }

    /// The text in which these statements have their means at every footprint.
    pub(super) fn replaced(&self, list: &[&Statement], inner: &Inner) -> Option<String> {
        let edit = |own: &&Statement| {
            let declared = own.declares.map(|ty| format!("{ty} ")).unwrap_or_default();
            Edit { span: own.span, text: format!("{declared}{} = {};", own.name, own.mean) }
        };
        let edits: Vec<Edit> = list.iter().map(edit).chain(inner.outside(list)).collect();
        let plan = Plan { inner: Inner { edits, ..inner.clone() }, ..Plan::default() };
        let said = Said { errors: &[], samples: self.samples, given: false, largest: self.width };
        write(self.source, self.frame, self.inputs, &plan, (self.width, &said))
    }

    /// Levels before the far one, each with more statements replaced.
    pub(super) fn near(
        &mut self,
        statements: &[Statement],
        (inner, far): (&Inner, Option<&Far>),
    ) -> Result<Vec<Near>, RunError> {
        let first = inner.cost;
        let mut out: Vec<Near> = Vec::new();
        // The dearest statements come first.
        let mut order = Vec::new();
        // Where noise in a value fades by itself, another fade around it gains little.
        let fades = |own: &&Statement| inner.outside(&[own]).len() == inner.edits.len();
        for own in statements.iter().filter(fades) {
            let Some(built) = self.replaced(&[own], inner).and_then(|text| (self.build)(&text)) else {
                continue;
            };
            self.tried += 1;
            let cost = self.judge.variant(built.plain).cost;
            if cost < first * 0.98 {
                order.push((cost, own));
            }
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut taken: Vec<&Statement> = Vec::new();
        let mut cost = first;
        for from in NEAR {
            let Some(full) = FOOTPRINTS.get(from).copied() else { continue };
            if far.is_some_and(|far| full >= far.full) {
                break;
            }
            let mut now = taken.clone();
            let mut now_cost = cost;
            for (_, own) in &order {
                if now.iter().any(|other| other.span == own.span) {
                    continue;
                }
                let mut more = now.clone();
                more.push(own);
                let Some(built) = self.replaced(&more, inner).and_then(|text| (self.build)(&text)) else {
                    continue;
                };
                self.tried += 1;
                let variant = self.judge.variant(built.plain);
                if variant.cost < now_cost * 0.99 && self.holds(&variant, from, far)? {
                    now = more;
                    now_cost = variant.cost;
                }
            }
            if now_cost < cost * CHEAPER {
                let statements: Vec<Statement> = now
                    .iter()
                    .filter(|own| !taken.iter().any(|other| other.span == own.span))
                    .map(|own| (*own).clone())
                    .collect();
                out.push(Near { full, statements });
                taken = now;
                cost = now_cost;
            }
        }
        Ok(out)
    }

    /// Whether a program is good from the footprint with this index on, up to the far level, in both sets.
    fn holds(&self, variant: &Variant, from: usize, far: Option<&Far>) -> Result<bool, RunError> {
        for known in [self.fitted, self.held].into_iter().flat_map(|set| set.iter().skip(from)) {
            if far.is_some_and(|far| known.truth.footprint >= far.full) {
                continue;
            }
            if !self.judge.off(variant, &known.truth, self.samples)?.is_good(&known.original, self.tolerance)
            {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether the written shader is good at all footprints and in the middle of each fade, on the points
    /// that were held out. If not, returns the level to blame, or none if a change in place is to blame.
    pub(super) fn check(
        &self,
        written: &Variant,
        plan: &Plan,
    ) -> Result<Result<(), Option<usize>>, RunError> {
        let fulls: Vec<f64> =
            plan.near.iter().map(|near| near.full).chain(plan.far.iter().map(|far| far.full)).collect();
        for known in self.held {
            if !self.judge.off(written, &known.truth, self.samples)?.is_good(&known.original, self.tolerance)
            {
                let level = fulls.iter().rposition(|full| full * BEGIN < known.truth.footprint);
                return Ok(Err(level));
            }
        }
        for (level, full) in fulls.iter().enumerate() {
            let middle = [full * (0.5 + 0.5 * BEGIN)];
            for known in known(self.judge, self.original, &middle, (Set::HeldOut, self.samples))? {
                if !self
                    .judge
                    .off(written, &known.truth, self.samples)?
                    .is_good(&known.original, self.tolerance)
                {
                    return Ok(Err(Some(level)));
                }
            }
        }
        Ok(Ok(()))
    }
}
