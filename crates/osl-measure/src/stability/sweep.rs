//! Sweeps over extreme settings, and what is found at them.

use super::rerun::difference;
use super::safe_range::{Reach, reach};
use super::subject::{Base, Planes, Subject};
use super::trial::{Outcome, Setting, Trial};
pub(super) use crate::words::percent;
use crate::words::short;
use osl_exec::RunError;
use osl_limits::Halt;
use osl_scene::Grid;
use serde::Serialize;

/// A sentence about a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The sweep: `offset`, `scale`, `footprint` or a parameter.
    pub sweep: String,
    /// The smallest value for which the points are right, if they are wrong for smaller ones.
    pub from: Option<f64>,
    /// The largest value for which the points are right, if they are wrong for larger ones.
    pub limit: Option<f64>,
    /// The finding in words.
    pub text: String,
}

impl Finding {
    /// A sentence without limits.
    pub(super) fn said(sweep: &str, text: String) -> Finding {
        Finding { sweep: sweep.to_string(), from: None, limit: None, text }
    }
}

/// Smallest error at the given setting for which lines are blamed, as a share of the range: about a thousand
/// roundings of single operations.
pub(super) const NOTABLE: f64 = 1e-4;

/// Runs a setting.
///
/// # Errors
/// A budget of the run is used up.
pub fn measure(
    subject: &Subject<'_>,
    base: &Base,
    grid: &Grid,
    setting: Setting,
    tolerance: f64,
) -> (Trial, Planes) {
    match subject.run(base, &setting.points(grid), setting != Setting::AsGiven) {
        Ok(planes) => {
            let outcomes = outcomes(&planes, tolerance);
            (Trial { setting, outcomes, stopped: None }, planes)
        }
        Err(stop) => {
            let stopped = Some(stop_text(&stop));
            (Trial { setting, outcomes: Vec::new(), stopped }, Planes::default())
        }
    }
}

fn stop_text(stop: &RunError) -> String {
    match stop {
        RunError::Halted(Halt::Cancelled) => "the time is over".to_string(),
        _ => stop.to_string(),
    }
}

/// A plane whose values vary by less than this share of their size counts as flat.
const NEARLY_FLAT: f64 = 1e-3;

/// The range of a plane in double precision, in which errors are measured. If all values are nearly the same,
/// it is their size, or 1 if they are 0.
pub(super) fn range(exact: &[f64]) -> f64 {
    let finite = || exact.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let size = low.abs().max(high.abs());
    match high - low {
        span if span > size * NEARLY_FLAT && span.is_finite() => span,
        _ if size > 0.0 && size.is_finite() => size,
        _ => 1.0,
    }
}

/// The error of each point as a share of the range; 1 if only one of the two values is a number.
pub(super) fn errors(planes: &Planes, plane: usize) -> Vec<f64> {
    let (strict, exact) = (&planes.strict[plane], &planes.exact[plane]);
    errors_in(strict, exact, range(exact))
}

/// The same of values in a given range.
pub(super) fn errors_in(values: &[f64], truth: &[f64], range: f64) -> Vec<f64> {
    let error = |(value, truth): (&f64, &f64)| match difference(*value, *truth).abs() {
        error if error.is_finite() => error / range,
        _ => 1.0,
    };
    values.iter().zip(truth).map(error).collect()
}

fn outcomes(planes: &Planes, tolerance: f64) -> Vec<Outcome> {
    let of = |(plane, name): (usize, &String)| {
        let strict = &planes.strict[plane];
        let n = strict.len().max(1) as f64;
        let share = |count: usize| count as f64 / n;
        let errors = errors(planes, plane);
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let finite = strict.iter().copied().filter(|x| x.is_finite());
        let range = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
        Outcome {
            output: name.clone(),
            nan: share(strict.iter().filter(|x| x.is_nan()).count()),
            infinite: share(strict.iter().filter(|x| x.is_infinite()).count()),
            range: if range[0] <= range[1] { range } else { [0.0; 2] },
            rms: (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            worst: sorted.last().copied().unwrap_or(0.0),
            wrong: share(errors.iter().filter(|e| **e > tolerance).count()),
            flipped: share(errors.iter().filter(|e| **e > tolerance && **e > 100.0 * median).count()),
        }
    };
    planes.names.iter().enumerate().map(of).collect()
}

/// Decades covered by the sweeps of coordinates and footprints.
const DECADES: std::ops::RangeInclusive<i32> = -12..=12;

/// A sweep of one number.
pub(super) struct Sweep {
    /// The decades.
    pub(super) trials: Vec<Trial>,
    /// The range in which the points are right.
    pub(super) finding: Finding,
    /// The value next to that range where they are wrong: above it, or else below it.
    pub(super) wrong: Option<f64>,
}

/// Sweeps one number over all decades, and between them near the end of the right ones. Says in which range
/// around the given setting the points are right. `given` is the decade of the given setting; `None` if the
/// given setting is 0. `first` is its trial.
pub(super) fn sweep(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    (setting, name): (impl Fn(f64) -> Setting, &str),
    (given, first): (Option<i32>, &Trial),
) -> Sweep {
    let number = |decade: i32| pxfm::f_exp10(f64::from(decade));
    let at = |by: f64| measure(subject, &subject.base, grid, setting(by), tolerance).0;
    let trials: Vec<Trial> = DECADES.map(|decade| at(number(decade))).collect();
    let mut finding = Finding::said(name, String::new());
    let [least, most] = [DECADES.start(), DECADES.end()].map(|decade| short(number(*decade), 2));
    if !first.is_right() {
        finding.text = match trials.iter().filter(|trial| trial.is_right()).count() {
            0 => format!("wrong as given, and at every {name} that was tried, from {least} to {most}"),
            n => format!("wrong as given; right at {n} of the {} tried values of {name}", trials.len()),
        };
        return Sweep { trials, finding, wrong: None };
    }
    let start = given.map_or(0, |decade| (decade - DECADES.start()).max(0) as usize);
    let list: Vec<(f64, &Trial)> = DECADES.map(number).zip(&trials).collect();
    let (below, above) = list.split_at_checked(start).unwrap_or((&list, &[]));
    let origin = above.first().copied().filter(|_| given.is_some());
    let below: Vec<(f64, &Trial)> = origin.into_iter().chain(below.iter().rev().copied()).collect();
    let effort = (tolerance, if subject.is_long() { 4 } else { 1 });
    let upper = reach(above, true, effort, &at);
    let lower = given.map(|_| reach(&below, false, effort, &at)).filter(|lower| lower.wrong.is_some());
    finding.from = lower.as_ref().and_then(Reach::last);
    finding.limit = upper.last().filter(|_| upper.wrong.is_some());
    finding.text = match (finding.from, upper.wrong, finding.limit) {
        (None, None, _) => format!("right at every {name} from {least} to {most}"),
        (None, Some(wrong), None) => format!("right as given, and wrong at {name} {}", short(wrong, 2)),
        (None, _, Some(to)) => format!("right for {name} up to {}", short(to, 2)),
        (Some(from), None, _) => format!("right for {name} from {} to {most}", short(from, 2)),
        (Some(from), Some(_), to) => {
            format!("right for {name} from {} to {}", short(from, 2), short(to.unwrap_or(from), 2))
        }
    };
    // Single values between powers of ten may be wrong where points lie on an edge.
    for (end, way) in lower.iter().map(|end| (end, "down")).chain([(&upper, "up")]) {
        if let Some(by) = end.decade {
            finding.text += &format!(", also at the powers of ten {way} to {}", short(by, 2));
        }
    }
    for end in lower.iter().chain([&upper]) {
        if let (Some(by), Some(why)) = (end.wrong, &end.stopped) {
            finding.text += &format!("; at {name} {} the run stops: {why}", short(by, 2));
        }
    }
    let wrong = upper.wrong.or(lower.and_then(|lower| lower.wrong));
    Sweep { trials, finding, wrong }
}
