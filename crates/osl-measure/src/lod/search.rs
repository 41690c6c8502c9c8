//! Finds the levels before the far one: changes in place, and statements that are replaced by their means,
//! greedily, the dearest first.
//!
//! Everything is chosen on the fitted points and then judged on the points that were held out; a level that
//! does not hold there begins at a larger footprint or is dropped. This module must not know how the text is
//! written.

use super::Build;
use super::frame::Frame;
use super::inputs::Inputs;
use super::judge::{FOOTPRINTS, Judge, Output, Truth, Variant};
use super::known::{FootprintErrors, Known, Verdict};
use super::means::{Statement, value};
use super::off::{Fault, Off};
use super::place::Place;
use super::write::{BEGIN, Far, Form, Inner, Near, Plan, Said, at_end, soft, write};
use super::{edges, noise};
use crate::stability::fix::source::Source;
use osl_exec::RunError;
use osl_ir::types::{Base, Type};
use osl_syntax::diagnostic::Edit;

/// Changes in place with their errors at the footprints at which the body runs, in both sets.
#[derive(Default)]
struct TriedChanges {
    inner: Inner,
    offs: Vec<Off>,
}

impl TriedChanges {
    /// The sum of the mean square errors.
    fn sum(&self) -> f64 {
        self.offs.iter().map(Off::all).sum()
    }
}

/// Those of two changes that have the smaller errors.
fn closer(best: Option<TriedChanges>, found: Option<TriedChanges>) -> Option<TriedChanges> {
    match (best, found) {
        (Some(best), Some(found)) => Some(if found.sum() < best.sum() { found } else { best }),
        (best, found) => best.or(found),
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
    pub(super) known: &'s Known,
    pub(super) place: &'s Place,
    /// The width of a pixel at footprint 1.
    pub(super) width: f64,
    /// Number of programs that were tried.
    pub(super) tried: usize,
    /// What was tried without success, with the last test that failed.
    pub(super) failed: Vec<Failed>,
}

/// Why there is no level of some kind.
#[derive(Clone, Debug)]
pub(super) enum Failed {
    /// All outputs, because this one has no mean.
    NoMean(String),
    /// All outputs by their means.
    Outputs(Fault),
    /// All outputs by their means, or by linear forms where these fail.
    Linear(Fault),
    /// The body costs no more than the switch to its means.
    Cheap,
    /// No statement's value can be replaced.
    NoStatements,
    /// The value of this variable, and the number of other values.
    Value(String, Fault, usize),
    /// Values gain too little.
    NoGain,
    /// The written shader.
    Written(Fault),
}

/// A footprint above the first one.
const NEXT: f64 = 1.5;
/// How much cheaper a near level must be than the one before it, and an output by its mean than without.
const CHEAPER: f64 = 0.9;
/// The footprints at which near levels may begin to be complete.
const NEAR: [usize; 3] = [2, 4, 6];

impl Search<'_, '_> {
    /// Changes in place that bring the body closer at a footprint at which it runs: noise that fades, then
    /// edges that become softer.
    pub(super) fn inner(&mut self, far: Option<&Far>) -> Result<Inner, RunError> {
        let mut now =
            TriedChanges { inner: Inner { cost: self.original.cost, ..Inner::default() }, offs: Vec::new() };
        now.offs = self.known.originals(0.0, end(far));
        self.noise(&mut now, far)?;
        self.edges(&mut now, far)?;
        Ok(now.inner)
    }

    fn noise(&mut self, now: &mut TriedChanges, far: Option<&Far>) -> Result<(), RunError> {
        let calls = noise::calls(self.source);
        if calls.is_empty() {
            return Ok(());
        }
        let (source, frame) = (self.source, self.frame);
        let inner = |list: &[&noise::Call], start: f64| Inner {
            calls: list.len(),
            start,
            edits: noise::edits(source, frame, list, start),
            ..Inner::default()
        };
        let all: Vec<&noise::Call> = calls.iter().collect();
        let mut best: Option<TriedChanges> = None;
        for start in noise::STARTS {
            let found = self.attempt(inner(&all, start), now, far)?;
            best = closer(best, found);
        }
        // Otherwise those calls that may fade by themselves.
        if best.is_none() && calls.len() > 1 {
            for start in noise::STARTS {
                let mut taken: Vec<&noise::Call> = Vec::new();
                let mut last = None;
                for call in &calls {
                    let mut more = taken.clone();
                    more.push(call);
                    if let Some(found) =
                        self.attempt(inner(&more, start), last.as_ref().unwrap_or(now), far)?
                    {
                        (taken, last) = (more, Some(found));
                    }
                }
                best = closer(best, last);
            }
        }
        *now = best.unwrap_or_else(|| std::mem::take(now));
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
                best = closer(best, self.attempt(inner, now, far)?);
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
        let Ok(offs) = self.holds(&variant, (0.0, end(far)), false)? else { return Ok(None) };
        let originals = self.known.originals(0.0, NEXT);
        if offs.iter().zip(&originals).any(|(off, original)| off.squares != original.squares) {
            return Ok(None);
        }
        let is_better = offs.iter().zip(&now.offs).any(|(off, earlier)| off.is_better(earlier));
        let inner = Inner { cost: variant.cost, ..plan.inner };
        Ok(is_better.then_some(TriedChanges { inner, offs }))
    }

    /// The text in which these statements and outputs have their means at every footprint.
    pub(super) fn replaced(
        &self,
        (list, outputs): (&[&Statement], &[Form]),
        inner: &Inner,
    ) -> Option<String> {
        let edit = |own: &&Statement| {
            let declared = own.declares.map(|ty| format!("{ty} ")).unwrap_or_default();
            Edit { span: own.span, text: format!("{declared}{} = {};", own.name, own.mean) }
        };
        let mut edits: Vec<Edit> = list.iter().map(edit).chain(inner.outside(list)).collect();
        edits.extend(at_end(self.frame, outputs));
        let plan = Plan { inner: Inner { edits, ..inner.clone() }, ..Plan::default() };
        let said = Said { errors: &[], samples: self.samples, given: false, largest: self.width };
        write(self.source, self.frame, self.inputs, &plan, (self.width, &said))
    }

    /// Levels before the far one, each with more statements and outputs replaced.
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
            let Some(built) = self.replaced((&[own], &[]), inner).and_then(|text| (self.build)(&text)) else {
                continue;
            };
            self.tried += 1;
            let cost = self.judge.variant(built.plain).cost;
            if cost < first * 0.98 {
                order.push((cost, own));
            }
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut last = None;
        let mut taken: Vec<&Statement> = Vec::new();
        let mut taken_outputs: Vec<Form> = Vec::new();
        let mut cost = first;
        for from in NEAR {
            let Some(full) = FOOTPRINTS.get(from).copied() else { continue };
            if far.is_some_and(|far| full >= far.full) {
                break;
            }
            let mut now = taken.clone();
            let mut now_cost = cost;
            let mut first_failed = None;
            for (_, own) in &order {
                if now.iter().any(|other| other.span == own.span) {
                    continue;
                }
                let mut more = now.clone();
                more.push(own);
                let text = self.replaced((&more, &taken_outputs), inner);
                let Some(built) = text.and_then(|text| (self.build)(&text)) else { continue };
                self.tried += 1;
                let variant = self.judge.variant(built.plain);
                if variant.cost >= now_cost * 0.99 {
                    continue;
                }
                match self.holds(&variant, (full, end(far)), true)? {
                    Ok(_) => {
                        now = more;
                        now_cost = variant.cost;
                    }
                    // The dearest value at the largest footprint says most.
                    Err(fault) => first_failed = first_failed.or(Some((*own, fault))),
                }
            }
            last = first_failed.or(last);
            // Changes in place may cost more than what a level saves.
            if now_cost >= (cost * CHEAPER).min(self.original.cost) {
                now.clone_from(&taken);
            }
            let outputs = self.outputs((&now, &taken_outputs), (from, inner), far)?;
            let is_new = |own: &&&Statement| !taken.iter().any(|other| other.span == own.span);
            let statements: Vec<Statement> = now.iter().filter(is_new).map(|own| (*own).clone()).collect();
            if !statements.is_empty() || !outputs.is_empty() {
                taken = now;
                taken_outputs.extend(outputs.iter().cloned());
                let text = self.replaced((&taken, &taken_outputs), inner);
                if let Some(built) = text.and_then(|text| (self.build)(&text)) {
                    cost = self.judge.variant(built.plain).cost;
                }
                out.push(Near { full, statements, outputs });
            }
        }
        if out.is_empty() {
            self.failed.push(match last {
                Some((own, fault)) => Failed::Value(own.name.clone(), fault, order.len() - 1),
                None if statements.is_empty() => Failed::NoStatements,
                None => Failed::NoGain,
            });
        }
        Ok(out)
    }

    /// The means of all outputs over the footprints from one on, for each plane and as expressions. `None` if
    /// one is not finite.
    pub(super) fn means(&self, from: usize) -> Option<(Vec<f64>, Vec<Form>)> {
        let over: Vec<&Truth> = self.known.sets.iter().skip(from).map(|sets| &sets.fitted.truth).collect();
        let mut planes = self.judge.means(&over);
        let mut forms = Vec::new();
        for output in &self.judge.outputs {
            let own = planes.get_mut(output.planes.clone())?;
            let is_int = output.ty == Type::INT;
            if is_int {
                own.iter_mut().for_each(|x| *x = x.round());
            }
            let text = value(output.ty, own, output.range)?;
            forms.push(Form { name: output.name.clone(), text, is_int, along: Vec::new() });
        }
        Some((planes, forms))
    }

    /// The outputs whose means are closer than the original from a footprint on, although other outputs keep
    /// the body from being skipped.
    fn outputs(
        &mut self,
        (statements, taken): (&[&Statement], &[Form]),
        (from, inner): (usize, &Inner),
        far: Option<&Far>,
    ) -> Result<Vec<Form>, RunError> {
        let Some(full) = FOOTPRINTS.get(from).copied().filter(|_| !self.inputs.leaves) else {
            return Ok(Vec::new());
        };
        let mut all = taken.to_vec();
        let text = self.replaced((statements, &all), inner);
        let Some(built) = text.and_then(|text| (self.build)(&text)) else { return Ok(Vec::new()) };
        let now = self.judge.variant(built.plain);
        let mut cost = now.cost;
        let Ok(mut offs) = self.holds(&now, (full, end(far)), true)? else { return Ok(Vec::new()) };
        for form in self.means(from).unwrap_or_default().1 {
            let is_other = |output: &Output| output.name == form.name && !is_number(output.ty);
            if taken.iter().any(|other| other.name == form.name) || self.judge.outputs.iter().any(is_other) {
                continue;
            }
            all.push(form);
            let text = self.replaced((statements, &all), inner);
            let found = match text.and_then(|text| (self.build)(&text)) {
                Some(built) => {
                    self.tried += 1;
                    let variant = self.judge.variant(built.plain);
                    let is_cheaper = variant.cost < CHEAPER * cost;
                    let errors = self.holds(&variant, (full, end(far)), true)?;
                    errors.ok().filter(|_| is_cheaper).map(|errors| (variant.cost, errors))
                }
                None => None,
            };
            match found {
                Some((less, errors)) if errors.iter().zip(&offs).any(|(new, old)| new.is_better(old)) => {
                    (cost, offs) = (less, errors);
                }
                _ => {
                    all.pop();
                }
            }
        }
        Ok(all.split_off(taken.len()))
    }

    /// Whether a program is good at the footprints from one on and below another.
    pub(super) fn holds(
        &self,
        variant: &Variant,
        footprints: (f64, f64),
        alone: bool,
    ) -> Result<Verdict, RunError> {
        let mut errors = |known: &FootprintErrors| self.judge.off(variant, &known.truth, self.samples);
        self.known.verdict(&mut errors, (footprints, alone))
    }

    /// Whether the written shader is good at all footprints and in the middle of each fade. If not, returns
    /// the level to blame, or none if a change in place is to blame.
    pub(super) fn check(
        &self,
        written: &Variant,
        plan: &Plan,
    ) -> Result<Result<(), (Option<usize>, Fault)>, RunError> {
        let fulls: Vec<f64> =
            plan.near.iter().map(|near| near.full).chain(plan.far.iter().map(|far| far.full)).collect();
        let mut errors = |known: &FootprintErrors| self.judge.off(written, &known.truth, self.samples);
        if let Err(fault) = self.known.verdict(&mut errors, ((0.0, f64::INFINITY), false))? {
            let level = fulls.iter().rposition(|full| full * BEGIN < fault.footprint);
            return Ok(Err((level, fault)));
        }
        for (level, full) in fulls.iter().enumerate() {
            let far = plan.far.as_ref().filter(|_| level == plan.near.len());
            let begin = far.map_or(BEGIN, |far| far.begin);
            let middle = [full * (0.5 + 0.5 * begin)];
            let original = (self.judge, self.original);
            let known = Known::of(original, &middle, (self.samples, self.known.tolerance))?;
            let mut errors = |known: &FootprintErrors| self.judge.off(written, &known.truth, self.samples);
            if let Err(fault) = known.verdict(&mut errors, ((0.0, f64::INFINITY), false))? {
                return Ok(Err((Some(level), fault)));
            }
        }
        Ok(Ok(()))
    }
}

/// Whether a value of this type has a mean that can be blended, or rounded.
pub(super) fn is_number(ty: Type) -> bool {
    matches!(ty.base, Base::Int | Base::Float) || ty.base.is_triple()
}

/// The footprint from which on the body does not run.
fn end(far: Option<&Far>) -> f64 {
    far.map_or(f64::INFINITY, |far| far.full)
}
