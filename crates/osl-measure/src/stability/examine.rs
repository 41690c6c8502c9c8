//! The whole examination: all sweeps, their findings, and the lines to blame.

use super::Report;
use super::lines::{Culprit, culprits};
use super::subject::{Base, Planes, Subject};
use super::sweep::{Finding, Setting, Trial, measure, percent, sweep};
use osl_scene::Grid;
use osl_syntax::source::SourceMap;

/// A parameter that is swept.
#[derive(Clone, Debug)]
pub struct Knob {
    /// Its name.
    pub name: String,
    /// Values to try, as on the command line.
    pub values: Vec<String>,
}

/// The results of an examination.
pub struct Examined {
    /// The report.
    pub report: Report,
    /// The outputs at the given setting.
    pub given: Planes,
    /// The outputs at the first offset a decade beyond the safe range, and that offset.
    pub far: Option<(f64, Planes)>,
}

/// A sweep of the coordinates: its name, and its settings.
type Sweep = (&'static str, fn(f64) -> Setting);

/// Smallest error worth reporting at the given setting: a few hundred roundings of single operations.
const NOTABLE: f64 = 2e-5;

/// Examines a shader on a grid. `variant` compiles it with another value of a parameter, or says why that is
/// impossible.
pub fn examine(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    knobs: &[Knob],
    variant: &dyn Fn(&str, &str) -> Option<Base>,
    sources: &SourceMap,
    shader: &str,
) -> Examined {
    let (first, given) = measure(subject, &subject.base, grid, Setting::AsGiven, tolerance);
    let mut trials = vec![first];
    let mut findings = vec![as_given(&trials[0])];
    let mut blamed: Vec<(f64, Vec<Culprit>)> = Vec::new();
    let own = culprits(subject, grid, &Setting::AsGiven, &given, sources);
    let notable = own.iter().any(|c| c.score > NOTABLE);
    blamed.push((if notable { 1.0 } else { 0.0 }, own));
    let mut far = None;
    let coordinates: [Sweep; 2] =
        [("offset", |by| Setting::Offset { by }), ("scale", |by| Setting::Scale { by })];
    for (name, setting) in coordinates {
        let (tried, finding) = sweep(subject, grid, tolerance, setting, name);
        if let Some(limit) = finding.limit {
            // A decade beyond the safe range, errors are frequent and still have single causes.
            let by = limit * 10.0;
            let (_, planes) = measure(subject, &subject.base, grid, setting(by), tolerance);
            blamed.push((0.5, culprits(subject, grid, &setting(by), &planes, sources)));
            if name == "offset" {
                far = Some((by, planes));
            }
        }
        trials.extend(tried.into_iter().map(|(trial, _)| trial));
        findings.push(finding);
    }
    findings.push(resolution(grid));
    if subject.base.differentiates {
        let (tried, finding) = sweep(subject, grid, tolerance, |by| Setting::Footprint { by }, "footprint");
        trials.extend(tried.into_iter().map(|(trial, _)| trial));
        findings.push(finding);
    }
    for knob in knobs {
        let (tried, finding) = turn(subject, grid, tolerance, knob, variant);
        trials.extend(tried);
        findings.extend(finding);
    }
    blamed.sort_by(|a, b| b.0.total_cmp(&a.0));
    let culprits = merged(blamed.into_iter().map(|(_, list)| list));
    let report = Report { shader: shader.to_string(), tolerance, trials, findings, culprits };
    Examined { report, given, far }
}

/// Merges lists of lines in their order, each line once.
fn merged(lists: impl Iterator<Item = Vec<Culprit>>) -> Vec<Culprit> {
    let mut all: Vec<Culprit> = Vec::new();
    for culprit in lists.flatten() {
        if !all.iter().any(|c| (&c.file, c.line) == (&culprit.file, culprit.line)) {
            all.push(culprit);
        }
    }
    all
}

/// Where the coordinates themselves run out of digits, whatever the shader does: their spacing in single
/// precision exceeds the step from point to point.
fn resolution(grid: &Grid) -> Finding {
    let steps = [(0, grid.width), (1, grid.height)].map(|(axis, n)| grid.scale[axis].abs() / n.max(2) as f32);
    let limit = f64::from(steps[0].min(steps[1])) / f64::from(f32::EPSILON);
    let text = format!(
        "from an offset of {} on, neighbouring points are the same in single precision, before the shader begins",
        crate::explain::short(limit, 2)
    );
    Finding { sweep: "coordinates".to_string(), limit: Some(limit), text }
}

fn as_given(trial: &Trial) -> Finding {
    let text = match &trial.stopped {
        Some(why) => format!("as given, the run stops: {why}"),
        None => {
            let worst = trial.outcomes.iter().map(|o| o.worst).fold(0.0, f64::max);
            let mut text = format!(
                "as given, the largest error is {} of the range, and {} of the points are wrong",
                crate::explain::short(worst, 2),
                percent(trial.wrong())
            );
            if trial.not_finite() > 0.0 {
                text += &format!("; {} are no finite numbers", percent(trial.not_finite()));
            }
            text
        }
    };
    Finding { sweep: "as given".to_string(), limit: None, text }
}

/// Tries the values of a parameter.
fn turn(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    knob: &Knob,
    variant: &dyn Fn(&str, &str) -> Option<Base>,
) -> (Vec<Trial>, Option<Finding>) {
    let mut trials = Vec::new();
    let mut bad: Vec<String> = Vec::new();
    for value in &knob.values {
        let Some(base) = variant(&knob.name, value) else { continue };
        let setting = Setting::Param { name: knob.name.clone(), value: value.clone() };
        let (trial, _) = measure(subject, &base, grid, setting, tolerance);
        match &trial.stopped {
            Some(why) => bad.push(format!("{value} stops the run ({why})")),
            None if trial.not_finite() > 0.0 => {
                bad.push(format!(
                    "{value} makes {} of the points NaN or infinite",
                    percent(trial.not_finite())
                ));
            }
            None if trial.wrong() > super::sweep::SAFE => {
                bad.push(format!("{value} makes {} of the points wrong", percent(trial.wrong())));
            }
            None => {}
        }
        trials.push(trial);
    }
    let finding = (!bad.is_empty()).then(|| Finding {
        sweep: knob.name.clone(),
        limit: None,
        text: format!("{}: {}", knob.name, bad.join("; ")),
    });
    (trials, finding)
}
