//! Finds the forms that replace parts of a shader: the means of all outputs, from a size of a pixel on, and
//! changes in place.
//!
//! Everything is chosen on the fitted points and then judged on the points that were held out.

use super::errors::{Cause, Fault, Off};
use super::ground::{By, Sides, shapes};
use super::inputs::Inputs;
use super::judge::{FOOTPRINTS, Judge, LARGEST, Set, Variant};
use super::original::{Known, Original, Sizes, Verdict};
use super::words::{percent, samples, value};
use super::write::{Far, Form, Frame, Inner, Plan, Said, soft, write};
use super::{Build, edges, noise};
use crate::stability::fix::source::Source;
use osl_exec::RunError;
use osl_ir::types::{Base, Type};

/// Changes in place with their errors at the sizes at which the body runs.
#[derive(Default)]
struct TriedChanges {
    inner: Inner,
    offs: Vec<Off>,
}

/// The sum of the mean square errors.
fn sum(offs: &[Off]) -> f64 {
    offs.iter().map(Off::all).sum()
}

/// Those of two changes that have the smaller errors.
fn closer(best: Option<TriedChanges>, found: Option<TriedChanges>) -> Option<TriedChanges> {
    match (best, found) {
        (Some(best), Some(found)) => Some(if sum(&found.offs) < sum(&best.offs) { found } else { best }),
        (best, found) => best.or(found),
    }
}

/// The search for the forms of one shader.
pub(super) struct Search<'s, 'a> {
    pub(super) judge: &'s Judge<'a>,
    pub(super) source: &'s Source<'s>,
    pub(super) frame: &'s Frame,
    pub(super) inputs: &'s Inputs,
    pub(super) original: &'s Variant,
    pub(super) build: &'s Build<'s>,
    /// Samples per pixel, of the original and of everything that is compared with it.
    pub(super) samples: u32,
    pub(super) known: &'s Original,
    /// The size of a pixel at footprint 1, by each measure.
    pub(super) widths: [f64; 2],
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
    /// The body costs no more than the switch to its means.
    Cheap,
    /// The written shader.
    Written(Fault),
}

/// The shares of the size of a level at which its fade may begin.
pub(super) const BEGINS: [f64; 4] = [0.125, 0.25, 0.5, LATEST];
/// The last of them.
const LATEST: f64 = 0.75;
/// What the switch to a level costs without comparisons of parameters, in additions.
const SWITCH: f64 = 6.0;

impl Search<'_, '_> {
    /// The level at which nothing of the body runs, with the measure of a pixel's size that leaves the
    /// smaller errors.
    pub(super) fn far(&mut self) -> Result<Option<Far>, RunError> {
        let program = self.source.program;
        let mut outputs = program.shader.params.iter().filter(|param| param.output);
        let other = outputs.find_map(|param| {
            let var = program.vars.get(param.var.0 as usize)?;
            (!is_number(var.ty)).then(|| var.name.to_string())
        });
        if let Some(name) = other {
            self.failed.push(Failed::NoMean(name));
            return Ok(None);
        }
        // What the size of a pixel and its comparison with the parameters cost.
        let switch = SWITCH + self.inputs.guards.len() as f64;
        let planes: usize = self.judge.outputs.iter().map(|output| output.planes.len()).sum();
        if self.original.cost <= switch + planes as f64 {
            self.failed.push(Failed::Cheap);
            return Ok(None);
        }
        let mut best: Option<(f64, Far)> = None;
        let mut last = None;
        for by in [By::Side, By::Area] {
            // At footprint 1 the original always runs.
            match self.means_above(by, 1.0)? {
                Ok(far) => {
                    let (error, far) = self.faded(far, self.original)?;
                    if best.as_ref().is_none_or(|(least, _)| error < *least) {
                        best = Some((error, far));
                    }
                }
                Err(fault) => last = fault.or(last),
            }
        }
        if best.is_none() {
            self.failed.extend(last.map(Failed::Outputs));
        }
        Ok(best.map(|(_, far)| far))
    }

    /// The means from the first size above one on from which they hold, or the last test that fails.
    fn means_above(&self, by: By, size: f64) -> Result<Result<Far, Option<Fault>>, RunError> {
        let mut last = None;
        for full in FOOTPRINTS.into_iter().filter(|full| *full > size) {
            let Some((planes, forms)) = self.means(by, full) else { continue };
            let mut errors = |known: &Known| Ok(self.constant(&planes, known));
            let sizes = Sizes { by, from: full, to: f64::INFINITY };
            match self.known.verdict(&mut errors, (sizes, true))? {
                Ok(_) => return Ok(Ok(Far { by, full, begin: LATEST, forms, planes })),
                Err(fault) => last = Some(fault),
            }
        }
        Ok(Err(last))
    }

    /// The means of all outputs over the square pixels from a size on, for each plane and as expressions:
    /// a shader that filters by itself may have other means at larger sizes. `None` if one is not finite.
    fn means(&self, by: By, from: f64) -> Option<(Vec<f64>, Vec<Form>)> {
        let over = self.known.of_set(Set::Fitted, Sizes { by, from, to: f64::INFINITY });
        let truths: Vec<_> = over.map(|known| &known.truth).collect();
        let mut planes = self.judge.means(&truths);
        let mut forms = Vec::new();
        for output in &self.judge.outputs {
            let own = planes.get_mut(output.planes.clone())?;
            let is_int = output.ty == Type::INT;
            if is_int {
                own.iter_mut().for_each(|x| *x = x.round());
            }
            let text = value(output.ty, own, output.range)?;
            forms.push(Form { name: output.name.clone(), text, is_int });
        }
        Some((planes, forms))
    }

    /// The errors of planes that have the same value everywhere.
    fn constant(&self, planes: &[f64], known: &Known) -> Off {
        let count = known.original.squares.first().map_or(0, Vec::len);
        let values: Vec<Vec<f32>> = planes.iter().map(|x| vec![*x as f32; count]).collect();
        self.judge.compare(&values, &known.truth)
    }

    /// The level with the fade that leaves the smallest errors, and the sum of the mean square errors over
    /// pixels of all shapes.
    pub(super) fn faded(&self, far: Far, body: &Variant) -> Result<(f64, Far), RunError> {
        let mut values = Vec::new();
        for known in self.known.of_set(Set::HeldOut, Sizes::ALL) {
            values.push((known, self.judge.values(body, &known.truth, self.samples)?));
        }
        let mut best: Option<(f64, Far)> = None;
        // At footprint 1 the original runs.
        for begin in BEGINS.into_iter().filter(|begin| begin * far.full >= 1.0) {
            let far = Far { begin, ..far.clone() };
            let (mut error, mut fits) = (0.0, true);
            for (known, values) in &values {
                let off = self.blended(&far, known, values);
                let is_changed =
                    far.by.of(known.truth.sides) < far.full && off.squares != known.original.squares;
                let bounds = self.known.bounds.without_error();
                fits &= !is_changed || off.fault(&known.original, bounds, known.truth.sides).is_none();
                error += off.all();
            }
            if (fits || begin == LATEST) && best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, far));
            }
        }
        Ok(best.unwrap_or((f64::INFINITY, far)))
    }

    /// The errors of values of the body that fade to the means with the size of a pixel.
    fn blended(&self, far: &Far, known: &Known, values: &[Vec<f32>]) -> Off {
        let size = far.by.of(known.truth.sides) / far.full;
        let begin = if self.inputs.leaves { 1.0 } else { far.begin };
        let t = if size >= 1.0 { 1.0 } else { ((size - begin) / (1.0 - begin)).max(0.0) };
        let weight = t * t * (3.0 - 2.0 * t);
        let is_int = |plane: usize| {
            self.judge.outputs.iter().any(|own| own.planes.contains(&plane) && own.ty == Type::INT)
        };
        let mixed = |(at, (values, mean)): (usize, (&Vec<f32>, &f64))| {
            let weight = if is_int(at) { weight.round() } else { weight };
            let mix =
                |x: &f32| if weight < 1.0 { f64::from(*x) * (1.0 - weight) + mean * weight } else { *mean };
            values.iter().map(|x| mix(x) as f32).collect()
        };
        let mixed: Vec<Vec<f32>> = values.iter().zip(&far.planes).enumerate().map(mixed).collect();
        self.judge.compare(&mixed, &known.truth)
    }

    /// The far level from a larger size on, if the changes in place err less than it up to there, and with a
    /// fade that suits them.
    pub(super) fn after(&mut self, inner: &Inner, mut far: Far) -> Result<Far, RunError> {
        let plan = Plan { inner: inner.clone(), far: None, by: far.by };
        let built = self.unguarded(&plan).and_then(|text| (self.build)(&text));
        let Some(built) = built.filter(|_| !inner.is_empty()) else { return Ok(far) };
        let changed = self.judge.variant(built.plain);
        while let Some(later) = self.later(&changed, &far)? {
            far = later;
        }
        Ok(self.faded(far, &changed)?.1)
    }

    /// The level from the next size on, if the changes in place err less than it up to there: in an output by
    /// a fifth beyond doubt, and less in all.
    fn later(&self, changed: &Variant, far: &Far) -> Result<Option<Far>, RunError> {
        let Ok(later) = self.means_above(far.by, far.full)? else { return Ok(None) };
        let sizes = Sizes { by: far.by, from: far.full, to: later.full };
        let Ok(offs) = self.holds(changed, sizes)? else { return Ok(None) };
        let means: Vec<Off> =
            self.known.within(sizes).map(|known| self.constant(&far.planes, known)).collect();
        let is_better = offs.iter().zip(&means).any(|(own, mean)| own.is_better(mean));
        Ok((is_better && sum(&offs) < sum(&means)).then_some(later))
    }

    /// Changes in place that bring the body closer at a size at which it runs: noise that fades, then edges
    /// that become softer.
    pub(super) fn inner(&mut self, far: Option<&Far>) -> Result<Inner, RunError> {
        let by = far.map_or(By::default(), |far| far.by);
        let sizes = Sizes { by, from: 0.0, to: far.map_or(f64::INFINITY, |far| far.full) };
        let offs = self.known.within(sizes).map(|known| known.original.clone()).collect();
        let mut now = TriedChanges { inner: Inner::default(), offs };
        self.noise(&mut now, sizes)?;
        self.edges(&mut now, sizes)?;
        Ok(now.inner)
    }

    fn noise(&mut self, now: &mut TriedChanges, sizes: Sizes) -> Result<(), RunError> {
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
            let found = self.attempt(inner(&all, start), now, sizes)?;
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
                    let before = last.as_ref().unwrap_or(now);
                    if let Some(found) = self.attempt(inner(&more, start), before, sizes)? {
                        (taken, last) = (more, Some(found));
                    }
                }
                best = closer(best, last);
            }
        }
        *now = best.unwrap_or_else(|| std::mem::take(now));
        Ok(())
    }

    fn edges(&mut self, now: &mut TriedChanges, sizes: Sizes) -> Result<(), RunError> {
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
                best = closer(best, self.attempt(inner, now, sizes)?);
            }
            *now = best.unwrap_or_else(|| std::mem::take(now));
        }
        Ok(())
    }

    /// Tries changes in place. `None` if they change the image at footprint 1, are worse than the original at
    /// a size at which the body runs, or closer than what is known already at none.
    fn attempt(
        &mut self,
        inner: Inner,
        now: &TriedChanges,
        sizes: Sizes,
    ) -> Result<Option<TriedChanges>, RunError> {
        let plan = Plan { inner, far: None, by: sizes.by };
        let Some(built) = self.unguarded(&plan).and_then(|text| (self.build)(&text)) else { return Ok(None) };
        self.tried += 1;
        let variant = self.judge.variant(built.plain);
        let Ok(offs) = self.holds(&variant, sizes)? else { return Ok(None) };
        let is_near = |known: &Known| known.truth.sides == [1.0; 2];
        let known = self.known.within(sizes);
        if known.zip(&offs).any(|(known, off)| is_near(known) && off.squares != known.original.squares) {
            return Ok(None);
        }
        let is_better = offs.iter().zip(&now.offs).any(|(off, earlier)| off.is_better(earlier));
        Ok(is_better.then_some(TriedChanges { inner: plan.inner, offs }))
    }

    /// The text of a plan without what its comment says of errors.
    fn unguarded(&self, plan: &Plan) -> Option<String> {
        let width = self.width(plan.by);
        let said = Said { errors: [0.0; 2], samples: self.samples, given: false, largest: width };
        write(self.source, self.frame, self.inputs, plan, (width, &said))
    }

    /// The size of a pixel at footprint 1.
    pub(super) fn width(&self, by: By) -> f64 {
        match by {
            By::Side => self.widths[0],
            By::Area => self.widths[1],
        }
    }

    /// Whether a program is good at these sizes.
    fn holds(&self, variant: &Variant, sizes: Sizes) -> Result<Verdict, RunError> {
        let mut errors = |known: &Known| self.judge.off(variant, &known.truth, self.samples);
        self.known.verdict(&mut errors, (sizes, false))
    }

    /// Whether the written shader is good at all sizes and in the middle of the fade. If not, returns the
    /// test that failed and whether the far level is to blame, not a change in place.
    pub(super) fn check(
        &self,
        written: &Variant,
        plan: &Plan,
    ) -> Result<Result<(), (bool, Fault)>, RunError> {
        if let Err(fault) = self.holds(written, Sizes::ALL)? {
            let is_far = plan.far.as_ref().is_some_and(|far| far.full * far.begin < far.by.of(fault.sides));
            return Ok(Err((is_far, fault)));
        }
        let Some(far) = &plan.far else { return Ok(Ok(())) };
        let middle = shapes(far.full * (0.5 + 0.5 * far.begin), far.by, LARGEST);
        let known = Original::of((self.judge, self.original), &middle, (self.samples, self.known.bounds))?;
        let mut errors = |known: &Known| self.judge.off(written, &known.truth, self.samples);
        Ok(known.verdict(&mut errors, (Sizes::ALL, false))?.map(|_| ()).map_err(|fault| (true, fault)))
    }
}

/// Whether a value of this type has a mean that can be blended, or rounded.
fn is_number(ty: Type) -> bool {
    matches!(ty.base, Base::Int | Base::Float) || ty.base.is_triple()
}

/// A sentence for each kind of level that was tried. `count` is the number of samples that levels are
/// compared with.
pub(super) fn sentences(failed: &[Failed], outputs: &[String], count: u32) -> Vec<String> {
    failed.iter().map(|failed| sentence(failed, (outputs, count))).collect()
}

fn sentence(failed: &Failed, compared: (&[String], u32)) -> String {
    match failed {
        Failed::NoMean(name) => {
            format!("all outputs: `{name}` is no number and no triple, so it has no mean")
        }
        Failed::Cheap => {
            "all outputs: the shader costs no more than the test of how large a pixel is".to_string()
        }
        Failed::Outputs(fault) => format!("all outputs by their means: {}", reason(fault, compared)),
        Failed::Written(fault) => format!("the written shader: {}", reason(fault, compared)),
    }
}

/// The sides of pixels in words.
fn shape([x, y]: Sides) -> String {
    if x == y { format!("footprint {x}") } else { format!("pixels of {x} by {y}") }
}

fn reason(fault: &Fault, (outputs, count): (&[String], u32)) -> String {
    let Fault { cause, output, sides, shares } = fault;
    let (name, at) = (outputs.get(*output).map_or("", String::as_str), shape(*sides));
    let [own, other] = shares.map(percent);
    let original = format!("{} of the original", samples(count));
    match cause {
        Cause::Larger => format!("`{name}` has a larger error at {at}: {own}, and {other} with {original}"),
        Cause::Unsure => format!(
            "the error of `{name}` at {at} is not certain to be smaller: {own}, and {other} with {original}"
        ),
        Cause::Above => {
            format!("the error of `{name}` at {at} is {own}, above the bound of {other} (--error)")
        }
        Cause::Shifted => format!(
            "the mean of `{name}` over the picture would be off by {own} at {at}; {other} is within the \
             tolerance and chance"
        ),
        Cause::Unlike => format!(
            "a pixel of the given image would be off by {own} in `{name}` at {at}, and no pixel elsewhere by \
             more than {other}: the shader does not look the same everywhere"
        ),
    }
}
