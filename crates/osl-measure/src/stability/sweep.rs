//! Extreme settings, and the outcome at each.

use super::subject::{Base, Planes, Subject, Swept};
use crate::explain::short;
use osl_exec::RunError;
use osl_scene::Grid;
use serde::Serialize;

/// What a setting changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "setting", rename_all = "snake_case")]
pub enum Setting {
    /// Nothing.
    AsGiven,
    /// The coordinates are multiplied.
    Scale {
        /// The factor.
        by: f64,
    },
    /// A number is added to the coordinates.
    Offset {
        /// The number.
        by: f64,
    },
    /// The change from pixel to pixel is multiplied.
    Footprint {
        /// The factor.
        by: f64,
    },
    /// A parameter has another value.
    Param {
        /// The parameter.
        name: String,
        /// The value, as on the command line.
        value: String,
    },
}

impl Setting {
    /// The points of a grid at this setting.
    pub fn points(&self, grid: &Grid) -> Swept {
        let mut swept = Swept { grid: grid.clone(), footprint: 1.0 };
        match self {
            Setting::Scale { by } => swept.grid.scale = grid.scale.map(|s| s * *by as f32),
            Setting::Offset { by } => swept.grid.offset = grid.offset.map(|o| o + *by as f32),
            Setting::Footprint { by } => swept.footprint = *by as f32,
            Setting::AsGiven | Setting::Param { .. } => {}
        }
        swept
    }

    /// The setting in words.
    pub fn text(&self) -> String {
        match self {
            Setting::AsGiven => "as given".to_string(),
            Setting::Scale { by } => format!("scale {}", short(*by, 3)),
            Setting::Offset { by } => format!("offset {}", short(*by, 3)),
            Setting::Footprint { by } => format!("footprint {}", short(*by, 3)),
            Setting::Param { name, value } => format!("{name} = {value}"),
        }
    }
}

/// The outcome for one component of an output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The output, with the component of a triple or matrix.
    pub output: String,
    /// Share of the points that are NaN.
    pub nan: f64,
    /// Share of the points that are infinite.
    pub infinite: f64,
    /// The smallest and the largest finite value.
    pub range: [f64; 2],
    /// Root mean square error, as a share of the range in double precision.
    pub rms: f64,
    /// The largest error, as a share of that range.
    pub worst: f64,
    /// Share of the points whose error exceeds the tolerance.
    pub wrong: f64,
    /// The share of the points whose error is a hundred times the median error: their values jump in one
    /// arithmetic and not in the other, rather than drift. They are among the wrong points.
    pub flipped: f64,
}

/// A setting with its outcomes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// The setting.
    #[serde(flatten)]
    pub setting: Setting,
    /// The outcomes by output; empty if the run was stopped.
    pub outcomes: Vec<Outcome>,
    /// Why the run was stopped, if it was.
    pub stopped: Option<String>,
}

impl Trial {
    /// The largest share of wrong points among the outputs.
    pub fn wrong(&self) -> f64 {
        self.outcomes.iter().map(|o| o.wrong).fold(0.0, f64::max)
    }

    /// The largest share of NaN or infinite points among the outputs.
    pub fn not_finite(&self) -> f64 {
        self.outcomes.iter().map(|o| o.nan + o.infinite).fold(0.0, f64::max)
    }
}

/// A sentence about a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The sweep: `offset`, `scale`, `footprint` or a parameter.
    pub sweep: String,
    /// The first unsafe value, if there is one.
    pub limit: Option<f64>,
    /// The finding in words.
    pub text: String,
}

/// A share as a percentage.
pub(super) fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent >= 10.0 { format!("{percent:.0} %") } else { format!("{} %", short(percent, 2)) }
}

/// Share of wrong points up to which a setting counts as safe.
pub(super) const SAFE: f64 = 0.001;

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
    stop.to_string()
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
    let range = range(exact);
    let error = |(s, e): (&f64, &f64)| match (s == e || (s.is_nan() && e.is_nan()), (s - e).is_finite()) {
        (true, _) => 0.0,
        (false, true) => (s - e).abs() / range,
        (false, false) => 1.0,
    };
    strict.iter().zip(exact).map(error).collect()
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

/// Sweeps one number. Returns its settings and the first unsafe value, to within a few percent.
pub(super) fn sweep(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    setting: impl Fn(f64) -> Setting,
    name: &str,
) -> (Vec<(Trial, Planes)>, Finding) {
    let mut trials = Vec::new();
    let is_safe =
        |trial: &Trial| trial.wrong() <= SAFE && trial.not_finite() <= SAFE && trial.stopped.is_none();
    let mut bounds: Option<(f64, f64)> = None;
    let mut last_safe = None;
    for decade in DECADES {
        let by = pxfm::f_exp10(f64::from(decade));
        let found = measure(subject, &subject.base, grid, setting(by), tolerance);
        let safe = is_safe(&found.0);
        if safe {
            last_safe = Some(by);
        } else if bounds.is_none()
            && let Some(below) = last_safe
        {
            bounds = Some((below, by));
        }
        trials.push(found);
    }
    let any_safe = last_safe.is_some();
    let Some((mut low, mut high)) = bounds else {
        let text = if any_safe {
            format!("safe at every {name} from 1e-12 to 1e12")
        } else {
            format!("not safe at any {name}")
        };
        return (trials, Finding { sweep: name.to_string(), limit: None, text });
    };
    while high / low > 1.1 {
        let middle = (low * high).sqrt();
        let (trial, _) = measure(subject, &subject.base, grid, setting(middle), tolerance);
        if is_safe(&trial) { low = middle } else { high = middle }
    }
    let text = format!("safe for {name} below {}", short(low, 2));
    (trials, Finding { sweep: name.to_string(), limit: Some(low), text })
}
