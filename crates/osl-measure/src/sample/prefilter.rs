//! Which steps and noises of a program are filtered, decided by measurement before the image is computed.
//!
//! The mean that `prefilter` writes is exact for a straight edge, and wrong where the footprint contains a
//! fold, a second edge, or more waves than the derivatives at its centre show. It may also cost more than it
//! saves. So the *pilot*, pixels spread over the image, is computed without and with filtering. Where both
//! differ, many samples tell which is right. All places are filtered if this makes no pixel of the pilot
//! worse. Otherwise, those groups of places are filtered that help alone and together, or all places in those
//! pixels whose neighbourhood confirms it (`guard`), whichever is worth more. The cost is counted in
//! operations and not by the clock, because an image must not depend on it.
//!
//! A pixel is *worse* if its error exceeds both that of the plain pixel and the standard deviation of the
//! plain pixel when its samples move within it, by more than [`SEEN`] of the output's range. (A plain sample
//! that is right by chance is not held against the mean: what it shows of noise, for instance.) This module
//! must not know what the pass writes.

use super::bounds::{Reach, outputs};
use super::guard::{self, AROUND, Around, CHANGED, SEEN};
use super::image::Shading;
use super::operations::operations;
use super::oracle::some_pixels;
use super::pattern::Pattern;
use osl_exec::{Frame, Program, RunError};
use osl_ir::passes::FilterSite;
use rustc_hash::FxHashMap;

/// The pixels of the pilot: one in so many, and the minimum and maximum.
const PILOT: (usize, usize, usize) = (16, 4096, 16384);
/// The pixels whose truth is computed: one in so many of the image, and the minimum and maximum.
const JUDGED: (usize, usize, usize) = (64, 1024, 4096);
/// Samples of the truth, and of the truth of a pixel that seems to be worse.
const TRUTH: [u32; 2] = [64, 1024];
const TRUTH_SEED: u32 = 0x7247;
/// The number of pixels that are looked at again for each form of the program.
const AGAIN: usize = 16;
/// The groups of places that are tried one by one. Neighbours in the program share a group.
const GROUPS: usize = 12;
/// Groups are tried until so many evaluations are used up: a multiple of the pixels of the image, which has
/// at least so many.
const SPENT: (f64, usize) = (1.5, 1 << 16);
/// The pixels at which the share of the pixels that would be filtered is measured.
const SHARES: usize = 1024;
/// Corners to compute for each pixel whose neighbours differ. Those pixels share most of their corners.
const CORNERS: f64 = 1.5;
/// The cost of a scattered point, relative to one in a row.
const SCATTERED: f64 = 2.0;
/// What it costs, in additions, to look at the neighbours of a pixel, at its corners, and at its filtered
/// value.
const LOOKED: [f64; 3] = [12.0, 40.0, 120.0];
/// What it costs, in additions, to start a few runs over scattered points.
const STARTED: f64 = 2e6;
/// A form must have at most this share of the plain squared error.
const HELPS: f64 = 0.95;
/// The largest cost of a form relative to the plain program, in counted operations. A pixel must not cost
/// more than three samples, and the count is not exact.
const DEARER: f64 = 2.5;
/// The points at which operations are counted.
const COUNTED: usize = 256;

/// What was decided.
#[derive(Clone, Debug, Default)]
pub struct Filtered {
    /// The number of places that could be filtered.
    pub places: usize,
    /// Those that are not.
    pub left: Vec<FilterSite>,
    /// Evaluations of the shader that the decision took.
    pub evaluations: u64,
    /// Pixels whose truth was computed.
    pub judged: usize,
    /// The cost of the filtered program relative to the plain one, in operations.
    pub cost: f64,
    /// The squared error at these pixels relative to that of the plain program.
    pub error: f64,
    /// The range of each plane, if pixels are filtered only where their neighbourhood confirms it.
    pub guard: Option<Vec<f64>>,
}

impl Filtered {
    /// The number of places that are filtered.
    pub fn kept(&self) -> usize {
        self.places - self.left.len()
    }

    /// The decision in a sentence.
    pub fn sentence(&self) -> String {
        let Filtered { places, judged, .. } = self;
        match (self.kept(), places) {
            (_, 0) => "prefilter: no step or noise of this shader can be filtered".to_string(),
            (0, _) => format!(
                "prefilter: 0 of {places} places filtered: it does not help, makes pixels worse, or costs too much \
                 ({judged} pixels compared)"
            ),
            (kept, _) => format!(
                "prefilter: {kept} of {places} places filtered{}: {:.0} % of the error of a sample, {:.1} times its operations \
                 ({judged} pixels compared)",
                if self.guard.is_some() { " where the neighbourhood of a pixel confirms it" } else { "" },
                100.0 * self.error.sqrt(),
                self.cost
            ),
        }
    }
}

/// Decides which places are filtered. `plain` runs the program without filtering, and its pattern has the
/// samples of a pixel. `compile` makes a program in which the given places are left alone. Each pixel may be
/// decided on its own if `may_guard` is set and a pixel has one sample.
///
/// # Errors
/// A loop exceeds its budget.
pub fn filtered(
    plain: &Shading<'_>,
    (places, may_guard): (&[FilterSite], bool),
    compile: Compile<'_>,
) -> Result<Filtered, RunError> {
    let nothing = Filtered {
        places: places.len(),
        left: places.to_vec(),
        cost: 1.0,
        error: 1.0,
        ..Filtered::default()
    };
    let count = plain.surface.size().0 * plain.surface.size().1;
    if places.is_empty() || count == 0 || plain.planes().is_empty() {
        return Ok(nothing);
    }
    let mut judge = Judge::new(plain, count)?;
    let mut whole = judge.form(&compile(&[]), Vec::new())?;
    judge.know(&mut whole, count)?;
    let best = match judge.accepts(&mut whole)? {
        true => Some(whole),
        false if judge.pixels.is_empty() => None,
        false => {
            let groups = judge.groups(places, compile)?;
            let guarded = match may_guard && plain.pattern.count() == 1 {
                true => judge.guarded(&whole, count)?,
                false => None,
            };
            // The error that is left at the same cost; samples halve its square if the cost doubles.
            let worth = |a: &Form, b: &Form| (a.error * a.cost).total_cmp(&(b.error * b.cost));
            groups.into_iter().chain(guarded).min_by(worth)
        }
    };
    let (evaluations, judged) = (judge.evaluations, judge.pixels.len());
    Ok(match best {
        Some(form) => {
            let Form { left, cost, error, is_guarded, .. } = form;
            let guard = is_guarded.then_some(judge.ranges);
            Filtered { left, cost, error, evaluations, judged, guard, ..nothing }
        }
        None => Filtered { evaluations, judged, ..nothing },
    })
}

/// Makes the program in which some places are left alone.
type Compile<'a> = &'a dyn Fn(&[FilterSite]) -> Program;

/// What is known of a pixel: for each plane the mean, the standard error and the standard deviation.
type Truth = Vec<[f64; 3]>;

/// A form of the program, with its values at the pixels.
struct Form {
    left: Vec<FilterSite>,
    /// For each plane.
    values: Vec<Vec<f32>>,
    /// In multiples of the plain program's operations.
    cost: f64,
    /// The squared error relative to the plain one.
    error: f64,
    /// Whether pixels are filtered only where their neighbourhood confirms it.
    is_guarded: bool,
}

/// The pilot, and what is known of it.
struct Judge<'a> {
    plain: &'a Shading<'a>,
    /// The pilot; later those of its pixels that are judged.
    pixels: Vec<u32>,
    values: Vec<Vec<f32>>,
    /// The range of each plane.
    ranges: Vec<f64>,
    /// Operations of the plain program, and the sum of its squared errors.
    operations: f64,
    error: f64,
    truths: Vec<Truth>,
    /// Truths from many samples, by the position of the pixel.
    better: FxHashMap<usize, Truth>,
    evaluations: u64,
}

fn within(count: usize, (share, least, most): (usize, usize, usize)) -> usize {
    (count / share).clamp(least, most)
}

impl<'a> Judge<'a> {
    fn new(plain: &'a Shading<'a>, count: usize) -> Result<Judge<'a>, RunError> {
        let pixels = some_pixels(count, within(count, PILOT), 0xf117);
        let mut judge = Judge {
            plain,
            pixels,
            values: Vec::new(),
            ranges: Vec::new(),
            operations: 1.0,
            error: 0.0,
            truths: Vec::new(),
            better: FxHashMap::default(),
            evaluations: 0,
        };
        judge.values = judge.run(plain.program)?;
        judge.operations = judge.count(plain.program)?;
        let planes = plain.planes();
        judge.ranges = vec![1.0; planes.len()];
        for own in outputs(&planes) {
            let values = judge.values.get(own.clone()).unwrap_or(&[]).to_vec();
            let reach = Reach::of("".into(), own.clone(), values, judge.pixels.len());
            if let Some(ranges) = judge.ranges.get_mut(own) {
                ranges.fill(f64::from(reach.size()));
            }
        }
        Ok(judge)
    }

    /// The values of a program at the pixels.
    fn run(&mut self, program: &Program) -> Result<Vec<Vec<f32>>, RunError> {
        let samples = self.plain.pattern.count();
        self.evaluations += u64::from(samples) * self.pixels.len() as u64;
        let shading = Shading { program, ..self.plain.clone() };
        if samples == 1 {
            return shading.centres(&self.pixels, &mut Frame::default());
        }
        shading.chosen(&self.pixels, samples)
    }

    /// The operations that a program takes at some pixels, weighted.
    fn count(&mut self, program: &Program) -> Result<f64, RunError> {
        let every = (self.pixels.len() / COUNTED).max(1);
        let pixels: Vec<u32> = self.pixels.iter().copied().step_by(every).collect();
        self.evaluations += pixels.len() as u64;
        operations(&Shading { program, ..self.plain.clone() }, &pixels)
    }

    fn form(&mut self, program: &Program, left: Vec<FilterSite>) -> Result<Form, RunError> {
        let (values, cost) = (self.run(program)?, self.count(program)? / self.operations);
        Ok(Form { left, values, cost, error: f64::INFINITY, is_guarded: false })
    }

    /// Keeps the pixels that filtering changes, and computes their truth.
    fn know(&mut self, whole: &mut Form, count: usize) -> Result<(), RunError> {
        let changed = |at: &usize| {
            let mut planes = self.values.iter().zip(&whole.values).zip(&self.ranges);
            planes.any(|((plain, own), range)| {
                let pair = plain.get(*at).zip(own.get(*at));
                pair.is_some_and(|(a, b)| {
                    let is_small = f64::from((a - b).abs()) <= CHANGED * range;
                    a != b && !is_small
                })
            })
        };
        let changed: Vec<usize> = (0..self.pixels.len()).filter(changed).collect();
        let chosen = some_pixels(changed.len(), within(count, JUDGED), 0x9d6e);
        let chosen: Vec<usize> = chosen.iter().filter_map(|at| changed.get(*at as usize)).copied().collect();
        let pick = |plane: &mut Vec<f32>| {
            *plane = chosen.iter().filter_map(|at| plane.get(*at)).copied().collect();
        };
        self.values.iter_mut().for_each(pick);
        whole.values.iter_mut().for_each(pick);
        self.pixels = chosen.iter().filter_map(|at| self.pixels.get(*at)).copied().collect();
        self.truths = self.truths_of(&self.pixels.clone(), TRUTH[0])?;
        let plain = self.values.clone();
        self.error = self.squares(&plain);
        Ok(())
    }

    /// Means of many samples.
    fn truths_of(&mut self, pixels: &[u32], samples: u32) -> Result<Vec<Truth>, RunError> {
        let mut found = Vec::with_capacity(pixels.len());
        let own = Shading { pattern: Pattern::new(samples, TRUTH_SEED), ..self.plain.clone() };
        let each = samples as usize;
        let root = f64::from(self.plain.pattern.count()).sqrt();
        self.evaluations += u64::from(samples) * pixels.len() as u64;
        for pixels in pixels.chunks(256) {
            let values = own.samples(pixels, 0..samples, &mut Frame::default())?;
            let weights = own.signs(pixels, 0..samples);
            for at in 0..pixels.len() {
                let range = at * each..(at + 1) * each;
                let weights = weights.get(range.clone()).unwrap_or(&[]);
                let one = |plane: &Vec<f32>| {
                    let [mean, unsure, deviation] = known(plane.get(range.clone()).unwrap_or(&[]), weights);
                    [mean, unsure, deviation / root]
                };
                found.push(values.iter().map(one).collect());
            }
        }
        Ok(found)
    }

    /// The sum of the squared errors of values, in ranges.
    fn squares(&self, values: &[Vec<f32>]) -> f64 {
        let planes = values.iter().zip(&self.ranges).enumerate();
        let plane = |(at, (plane, range)): (usize, (&Vec<f32>, &f64))| {
            let pairs = plane.iter().zip(&self.truths);
            let off =
                pairs.filter_map(|(value, truth)| Some((f64::from(*value) - truth.get(at)?[0]) / range));
            off.filter(|off| !off.is_nan()).map(|off| off * off).sum::<f64>()
        };
        planes.map(plane).sum()
    }

    /// By how much a pixel of a form is worse than that of the plain program, in ranges; at most 0 if it is
    /// not.
    fn worse(&self, form: &Form, at: usize, truth: &Truth) -> f64 {
        let planes = form.values.iter().zip(&self.values).zip(self.ranges.iter().zip(truth));
        let excess = planes.map(|((own, plain), (range, [truth, unsure, deviation]))| {
            let [own, plain] = [own, plain].map(|plane| plane.get(at).copied().map_or(f64::NAN, f64::from));
            let [own, plain] = [own, plain].map(|value| (value - truth).abs());
            if own.is_nan() && !plain.is_nan() {
                return f64::INFINITY;
            }
            // The maximum is the other number if one is NaN.
            (own - plain.max(*deviation) - 2.0 * unsure) / range - SEEN
        });
        excess.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether a form is better than the plain program, makes no pixel worse, and is cheap enough.
    fn accepts(&mut self, form: &mut Form) -> Result<bool, RunError> {
        form.error = self.squares(&form.values) / self.error.max(f64::MIN_POSITIVE);
        // More plain samples help, too.
        let helps = form.error * if form.is_guarded { form.cost } else { 1.0 } <= HELPS;
        if self.pixels.is_empty() || form.cost > DEARER || !helps {
            return Ok(false);
        }
        let pixels = self.truths.iter().enumerate();
        let excess =
            pixels.map(|(at, truth)| (self.worse(form, at, self.better.get(&at).unwrap_or(truth)), at));
        let mut suspects: Vec<(f64, usize)> = excess.filter(|(excess, _)| *excess > 0.0).collect();
        suspects.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        suspects.truncate(AGAIN);
        let unknown: Vec<usize> =
            suspects.iter().map(|(_, at)| *at).filter(|at| !self.better.contains_key(at)).collect();
        if unknown.len() < suspects.len() {
            // One of them is worse for sure.
            return Ok(false);
        }
        let pixels: Vec<u32> = unknown.iter().filter_map(|at| self.pixels.get(*at)).copied().collect();
        let better = self.truths_of(&pixels, TRUTH[1])?;
        self.better.extend(unknown.iter().copied().zip(better));
        let is_worse =
            |at: &usize| self.better.get(at).is_some_and(|truth| self.worse(form, *at, truth) > 0.0);
        Ok(!unknown.iter().any(is_worse))
    }

    /// What is around some pixels.
    fn around(&mut self, pixels: &[u32]) -> Result<Vec<Vec<Around>>, RunError> {
        self.evaluations += (AROUND * pixels.len()) as u64;
        self.plain.around(pixels)
    }

    /// Whether any plane around a pixel differs in some way.
    fn differs(&self, planes: &[Vec<Around>], at: usize, differ: fn(&Around, f64) -> bool) -> bool {
        let mut planes = planes.iter().zip(&self.ranges);
        planes.any(|(plane, range)| plane.get(at).is_some_and(|around| differ(around, *range)))
    }

    /// The form in which each pixel is decided by what is around it, if it is accepted.
    fn guarded(&mut self, whole: &Form, count: usize) -> Result<Option<Form>, RunError> {
        let pixels = some_pixels(count, SHARES, 0xc042);
        let around = self.around(&pixels)?;
        let open: Vec<usize> =
            (0..pixels.len()).filter(|at| self.differs(&around, *at, Around::sides_differ)).collect();
        let has_edge = |at: &&usize| self.differs(&around, **at, Around::corners_differ);
        let filtered = open.iter().filter(has_edge).count();
        let [open, filtered] = [open.len(), filtered].map(|n| n as f64 / pixels.len().max(1) as f64);
        let more = SCATTERED * ((CORNERS * open).min(1.0) + filtered * whole.cost);
        let work = LOOKED[0] + LOOKED[1] * open + LOOKED[2] * filtered + STARTED / count as f64;
        let cost = 1.0 + more + work / self.operations;

        let around = self.around(&self.pixels.clone())?;
        let (ranges, outputs) = (&self.ranges, outputs(&self.plain.planes()));
        let mut values = self.values.clone();
        let differs = |at, differ| self.differs(&around, at, differ);
        for at in 0..self.pixels.len() {
            if !differs(at, Around::sides_differ) || !differs(at, Around::corners_differ) {
                continue;
            }
            for output in &outputs {
                let of_plane = |plane: usize| {
                    let (around, own) = (around.get(plane)?.get(at)?, whole.values.get(plane)?.get(at)?);
                    Some((*around, *own, *ranges.get(plane)?))
                };
                if guard::count(output.clone().map(of_plane)) {
                    for plane in output.clone() {
                        let value = values.get_mut(plane).and_then(|plane| plane.get_mut(at));
                        value.zip(of_plane(plane)).into_iter().for_each(|(value, (_, own, _))| *value = own);
                    }
                }
            }
        }
        let mut form = Form { left: Vec::new(), values, cost, error: f64::INFINITY, is_guarded: true };
        Ok(self.accepts(&mut form)?.then_some(form))
    }

    /// Whether the evaluations are used up.
    fn has_spent(&self) -> bool {
        let (width, height) = self.plain.surface.size();
        self.evaluations as f64 > SPENT.0 * (width * height).max(SPENT.1) as f64
    }

    /// The form with the groups of places that help alone and together, the most helpful first.
    fn groups(&mut self, places: &[FilterSite], compile: Compile<'_>) -> Result<Option<Form>, RunError> {
        let size = places.len().div_ceil(GROUPS);
        let groups: Vec<&[FilterSite]> = places.chunks(size).collect();
        if groups.len() < 2 {
            return Ok(None);
        }
        let without = |kept: &[usize]| -> Vec<FilterSite> {
            let left = groups.iter().enumerate().filter(|(at, _)| !kept.contains(at));
            left.flat_map(|(_, group)| group.iter().copied()).collect()
        };
        let mut single = Vec::new();
        for at in 0..groups.len() {
            if self.has_spent() {
                break;
            }
            let left = without(&[at]);
            let mut form = self.form(&compile(&left), left)?;
            if self.accepts(&mut form)? {
                single.push((form, at));
            }
        }
        single.sort_by(|a, b| a.0.error.total_cmp(&b.0.error));
        let mut single = single.into_iter();
        let Some((mut best, first)) = single.next() else { return Ok(None) };
        let mut kept = vec![first];
        for (_, at) in single {
            if self.has_spent() {
                break;
            }
            kept.push(at);
            let left = without(&kept);
            let mut form = self.form(&compile(&left), left)?;
            if self.accepts(&mut form)? && form.error < best.error {
                best = form;
            } else {
                kept.pop();
            }
        }
        Ok(Some(best))
    }
}

/// The mean of samples; half the difference of the means of both halves, as its standard error; and the
/// standard deviation of a sample.
fn known(values: &[f32], weights: &[f32]) -> [f64; 3] {
    let mean = |range: std::ops::Range<usize>| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (at, value) in values.iter().enumerate().take(range.end).skip(range.start) {
            let own = weights.get(at).copied().map_or(1.0, f64::from);
            sum += own * f64::from(*value);
            weight += own;
        }
        sum / weight
    };
    let count = values.len();
    let all = mean(0..count);
    let square = |value: &f32| (f64::from(*value) - all) * (f64::from(*value) - all);
    let squares: f64 = values.iter().map(square).sum();
    let halves = (mean(0..count / 2) - mean(count / 2..count)).abs();
    [all, 0.5 * halves, (squares / count as f64).sqrt()]
}
