//! Derivatives against central differences: the shader is followed in double precision at points beside the
//! explained one. Where an explanation gives no reason for another derivative, they must agree.

use super::case::{Case, FILE};
use osl_exec::{Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use osl_measure::explain::{self, Explanation, What};
use osl_measure::trace::OnePoint;
use std::collections::BTreeMap;

/// How far the points are, in pixels. If the difference over half of it is another one, the function is too
/// rough to tell.
const STEP: f32 = 1.0 / 1024.0;
/// The largest error, relative and absolute: coordinates are single precision.
const RELATIVE: f64 = 0.02;
const ABSOLUTE: f64 = 2e-3;
/// Below so many digits, a derivative in single precision says nothing.
const DIGITS: f64 = 4.0;

/// Steps of whole numbers look like a slope if the numbers are as large as this.
const LARGE: f64 = 1e4;
const STEPS: &str = "steps of large numbers look like a slope";

/// From here on, squares overflow in single precision.
const HUGE: f64 = 1e12;

/// What was compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Differences {
    /// Derivatives that agree.
    pub same: usize,
    /// Derivatives that differ, by the reason that is given.
    pub excepted: BTreeMap<String, usize>,
}

impl Differences {
    /// Adds others.
    pub fn add(&mut self, others: Differences) {
        self.same += others.same;
        for (why, count) in others.excepted {
            *self.excepted.entry(why).or_default() += count;
        }
    }
}

/// A point that is moved along an axis of the image.
struct Moved<'a> {
    point: OnePoint<'a>,
    axis: Axis,
    by: f32,
}

impl PointSource for Moved<'_> {
    fn count(&self) -> usize {
        1
    }

    fn varying(&self) -> &[Global] {
        &[]
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        let (value, change) = (self.point.global(global), self.point.deriv_of(global, self.axis));
        std::array::from_fn(|i| (f64::from(value[i]) + f64::from(change[i]) * f64::from(self.by)) as f32)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.point.deriv_of(global, axis)
    }

    fn fill(&self, global: Global, _: usize, width: usize, lanes: &mut [f32]) {
        let value = self.uniform(global);
        lanes.chunks_mut(width.max(1)).zip(value).for_each(|(lanes, x)| lanes.fill(x));
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, _: usize) -> Option<Datum> {
        self.point.source.attribute(object, name, element, self.point.point)
    }
}

/// The call, the line and the name of a variable.
type Key = (usize, u32, String);

/// For each value, the numbers of each component.
type Numbers = BTreeMap<Key, Vec<Vec<f64>>>;

/// The values in double precision, NaN where single precision has few of their digits, and the outcomes of
/// all conditions.
fn exact(told: &Explanation) -> (Numbers, Vec<Vec<bool>>) {
    let (mut values, mut outcomes) = (BTreeMap::new(), Vec::new());
    for line in told.lines.iter().filter(|line| line.file == FILE) {
        for fact in &line.facts {
            match &fact.what {
                What::Set { name, values: list, .. } => {
                    let list = list.iter().map(|value| {
                        if value.digits.is_some_and(|digits| digits < DIGITS) {
                            return vec![f64::NAN];
                        }
                        let json = serde_json::to_value(value).unwrap_or_default();
                        match &json["exact"] {
                            serde_json::Value::Array(list) => {
                                list.iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
                            }
                            one => vec![one.as_f64().unwrap_or(f64::NAN)],
                        }
                    });
                    values.insert((fact.call, line.number, name.clone()), list.collect());
                }
                What::Branch { taken, .. } => outcomes.push(taken.clone()),
                What::Rounds { counts } => outcomes.push(counts.iter().map(|n| *n > 0).collect()),
                _ => {}
            }
        }
    }
    (values, outcomes)
}

/// Compares the derivatives of an explanation.
pub(super) fn hold(
    case: &Case,
    subject: &explain::Subject,
    told: &Explanation,
    point: OnePoint<'_>,
) -> Result<Differences, String> {
    let mut found = Differences::default();
    // The attributes of the grid do not move with the point.
    if case.text.contains("getattribute") || case.text.contains("lockgeom") {
        return Ok(found);
    }
    let (here, outcomes) = exact(told);
    for axis in Axis::BOTH {
        let beside = [STEP, STEP / 2.0].map(|step| {
            [-step, step].map(|by| {
                let moved = Moved { point, axis, by };
                let trace = case.trace(subject, OnePoint { source: &moved, point: 0 });
                exact(&explain::explain(&trace, subject, &case.checked.sources))
            })
        });
        if beside.iter().flatten().any(|(_, other)| *other != outcomes) {
            continue;
        }
        for line in told.lines.iter().filter(|line| line.file == FILE) {
            for fact in &line.facts {
                let What::Set { name, derivatives, .. } = &fact.what else { continue };
                let key = (fact.call, line.number, name.clone());
                for (at, derivs) in derivatives.iter().enumerate() {
                    let changes = if axis == Axis::X { &derivs.dx } else { &derivs.dy };
                    let value = |list: &BTreeMap<Key, Vec<Vec<f64>>>, part: usize| {
                        list.get(&key).and_then(|list| list.get(at)?.get(part).copied())
                    };
                    for (part, change) in changes.iter().enumerate() {
                        let sides =
                            beside.each_ref().map(|both| both.each_ref().map(|(list, _)| value(list, part)));
                        // Where single precision overflows, the derivative may be NaN.
                        let found_here = difference(value(&here, part), sides).filter(|_| change.is_finite());
                        let Some(difference) = found_here else { continue };
                        let scale = value(&here, part).unwrap_or(0.0).abs().max(1.0);
                        let most = difference.abs().max(change.abs());
                        if (difference - change).abs() <= RELATIVE * most + ABSOLUTE * scale {
                            found.same += 1;
                        } else if *change == 0.0 && derivs.through.is_empty() && scale > LARGE {
                            *found.excepted.entry(STEPS.to_string()).or_default() += 1;
                        } else if let Some(why) = derivs.why.first() {
                            *found.excepted.entry(why.clone()).or_default() += 1;
                        } else {
                            return Err(format!(
                                "`{name}`, line {}: derivative {change} along {axis:?} without a reason, and {difference} by differences; through {:?}",
                                line.number, derivs.through
                            ));
                        }
                    }
                }
            }
        }
    }
    Ok(found)
}

/// The central difference; none if it depends on the step or the side.
fn difference(here: Option<f64>, sides: [[Option<f64>; 2]; 2]) -> Option<f64> {
    let here = here.filter(|x| x.abs() < HUGE)?;
    let scale = here.abs().max(1.0);
    let step = f64::from(STEP);
    let mut all = Vec::new();
    for ([before, after], step) in sides.into_iter().zip([step, step / 2.0]) {
        let (before, after) = (before?, after?);
        all.extend([(after - before) / (2.0 * step), (after - here) / step, (here - before) / step]);
    }
    let is_close = |x: &f64| (x - all[0]).abs() <= 0.05 * all[0].abs() + 1e-3 * scale;
    // The error of a central difference falls with the square of the step.
    let limit = (4.0 * all[3] - all[0]) / 3.0;
    (all.iter().all(|x| x.is_finite()) && all.iter().all(is_close)).then_some(limit)
}
