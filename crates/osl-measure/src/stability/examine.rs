//! The examination of a shader: the given setting, the sweeps around it, and the lines to blame in each.

use super::Report;
use super::discontinuities::FUNCTIONS;
use super::lines::{Culprit, culprits};
use super::oracle::{NotEnough, not_enough};
use super::subject::{Base, Planes, Subject};
use super::sweep::{Finding, NOTABLE, measure, percent, sweep};
use super::trial::{SAFE, Setting, Trial};
use crate::words::{listed, short};
use osl_exec::RunError;
use osl_scene::Grid;
use osl_syntax::source::SourceMap;

/// A parameter that is swept.
#[derive(Clone, Debug)]
pub struct Knob {
    /// Its name.
    pub name: String,
    /// Values to try, as on the command line.
    pub values: Vec<String>,
    /// Values that a user may choose, with which repairs are tested; see [`Knob::between`].
    pub near: Vec<String>,
}

impl Knob {
    /// Evenly spaced values between two numbers: each hundredth of the range has one.
    pub fn between([low, high]: [f64; 2], whole: bool) -> Vec<String> {
        let at = |i: usize| low + (high - low) * (i as f64 + 0.5) / BETWEEN as f64;
        let mut list: Vec<f64> = (0..BETWEEN).map(at).map(|x| if whole { x.round() } else { x }).collect();
        list.dedup();
        list.into_iter().map(|x| x.to_string()).collect()
    }
}

/// Number of values between the ends of a parameter's range.
const BETWEEN: usize = 128;

/// The results of an examination.
pub struct Examined {
    /// The report.
    pub report: Report,
    /// The outputs at the given setting.
    pub given: Planes,
    /// The outputs at the first decade of offsets beyond the right range, and that offset.
    pub far: Option<(f64, Planes)>,
    /// The settings just beyond the right ranges, at which the lines beyond them are blamed.
    pub beyond: Vec<Setting>,
}

/// The name of the lines to blame at the given setting among what was not examined.
pub(super) const LINES: &str = "some lines";

/// What is swept: the settings, their name, and the decade of the given setting, unless that is 0.
type Knobs = (fn(f64) -> Setting, &'static str, Option<i32>);

const OFFSET: Knobs = (|by| Setting::Offset { by }, "offset", None);
const SCALE: Knobs = (|by| Setting::Scale { by }, "scale", Some(0));
const FOOTPRINT: Knobs = (|by| Setting::Footprint { by }, "footprint", Some(0));

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
    let (mut examined, skipped) = at_given(subject, grid, tolerance, sources, shader);
    if let Some(finding) = too_long(subject, grid) {
        examined.report.findings.extend(not_followed(skipped).into_iter().chain([finding]));
        return examined;
    }
    let mut sweeps = Sweeps { subject, grid, examined, skipped };
    sweeps.is_over(LINES);
    for knobs in [OFFSET, SCALE] {
        sweeps.coordinates(knobs, sources);
    }
    sweeps.examined.report.findings.push(resolution(grid));
    if subject.base.differentiates {
        sweeps.sweep(FOOTPRINT);
    }
    sweeps.parameters(knobs, variant);
    let Sweeps { mut examined, skipped, .. } = sweeps;
    let report = &mut examined.report;
    report.findings.extend(not_followed(skipped));
    // Each line once, without those that are named at the given setting.
    for line in std::mem::take(&mut report.beyond) {
        let mut named = report.culprits.iter().chain(&report.noticed).chain(&report.beyond);
        if !named.any(|other| (&other.file, other.line) == (&line.file, line.line)) {
            report.beyond.push(line);
        }
    }
    examined
}

/// The examination of the given setting alone: what [`examine`] finds there, without any sweep.
pub fn examine_given(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    sources: &SourceMap,
    shader: &str,
) -> Examined {
    let (mut examined, skipped) = at_given(subject, grid, tolerance, sources, shader);
    examined.report.findings.extend(not_followed(skipped));
    examined
}

/// The sweeps of an examination, and what they found so far. The first trial is that of the given setting.
struct Sweeps<'a> {
    subject: &'a Subject<'a>,
    grid: &'a Grid,
    examined: Examined,
    /// The number of points that were not followed.
    skipped: usize,
}

impl Sweeps<'_> {
    /// Whether the time is over. What ran out of time is left out as a whole.
    fn is_over(&mut self, what: &str) -> bool {
        let is_over = self.subject.is_over();
        if is_over {
            self.examined.report.not_examined.push(what.to_string());
        }
        is_over
    }

    /// Sweeps one number: the value next to the right range at which points are wrong.
    fn sweep(&mut self, (setting, name, decade): Knobs) -> Option<f64> {
        if self.is_over(name) {
            return None;
        }
        let report = &self.examined.report;
        let first = report.trials.first()?;
        let swept = sweep(self.subject, self.grid, report.tolerance, (setting, name), (decade, first));
        if self.is_over(name) {
            return None;
        }
        self.examined.report.trials.extend(swept.trials);
        self.examined.report.findings.push(swept.finding);
        swept.wrong
    }

    /// Sweeps a change of the coordinates, and blames lines just beyond the right range, where errors still
    /// have single causes.
    fn coordinates(&mut self, knobs: Knobs, sources: &SourceMap) {
        let (setting, name, _) = knobs;
        let Some(by) = self.sweep(knobs) else { return };
        self.examined.beyond.push(setting(by));
        let (base, tolerance) = (&self.subject.base, self.examined.report.tolerance);
        let (_, planes) = measure(self.subject, base, self.grid, setting(by), tolerance);
        let found = culprits(self.subject, self.grid, &setting(by), &planes, sources, true);
        self.skipped += found.skipped;
        self.examined.report.beyond.extend(found.blamed.into_iter().chain(found.noticed));
        if name == OFFSET.1 {
            self.examined.far = Some((by, planes));
        }
    }

    /// Tries the values of all parameters.
    fn parameters(&mut self, knobs: &[Knob], variant: &dyn Fn(&str, &str) -> Option<Base>) {
        let mut passed_on: Vec<&str> = Vec::new();
        for knob in knobs {
            if self.is_over(&knob.name) {
                continue;
            }
            let report = &self.examined.report;
            let Some(first) = report.trials.first() else { return };
            let turned = turn((self.subject, self.grid), report.tolerance, knob, variant, first);
            if self.is_over(&knob.name) {
                continue;
            }
            if turned.passes_on {
                passed_on.push(&knob.name);
            }
            self.examined.report.trials.extend(turned.trials);
            self.examined.report.findings.extend(turned.finding);
        }
        self.examined.report.findings.extend(passing_on(&passed_on));
    }
}

/// What is found at the given setting, and the number of points that were not followed.
fn at_given(
    subject: &Subject<'_>,
    grid: &Grid,
    tolerance: f64,
    sources: &SourceMap,
    shader: &str,
) -> (Examined, usize) {
    let (first, given) = measure(subject, &subject.base, grid, Setting::AsGiven, tolerance);
    let blames = largest_error(&first) >= NOTABLE;
    let mut found = culprits(subject, grid, &Setting::AsGiven, &given, sources, blames);
    // Where no line loses digits, a numeric event is all that can have made the error; a derivative of what
    // jumps is alike in both arithmetics.
    if blames && found.blamed.is_empty() {
        let is_event = |line: &mut Culprit| !FUNCTIONS.contains(&line.what.as_str());
        found.blamed = found.noticed.extract_if(.., is_event).collect();
    }
    let not_enough = not_enough(subject, grid, &given, sources);
    let report = Report {
        shader: shader.to_string(),
        tolerance,
        findings: [as_given(&first)].into_iter().chain(unknown(not_enough.as_ref())).collect(),
        trials: vec![first],
        culprits: found.blamed,
        noticed: found.noticed,
        beyond: Vec::new(),
        not_enough,
        not_examined: Vec::new(),
        left_out: subject.base.left_out.clone(),
        repair: None,
    };
    (Examined { report, given, far: None, beyond: Vec::new() }, found.skipped)
}

/// Says that no other setting is tried, if a point takes too long for that as given.
fn too_long(subject: &Subject<'_>, grid: &Grid) -> Option<Finding> {
    let stop = subject.run(&subject.base, &Setting::AsGiven.points(grid), true).err();
    let stop = stop.filter(|stop| matches!(stop, RunError::TooManySteps { .. }))?;
    let text = format!("no other setting was tried, since {stop} (--limit running.tried_steps)");
    Some(Finding::said("not tried", text))
}

/// The sentence about a truth that is none.
fn unknown(not_enough: Option<&NotEnough>) -> Option<Finding> {
    let text = not_enough?.text();
    Some(Finding::said("double precision", text))
}

/// The sentence about points that were not followed.
fn not_followed(points: usize) -> Option<Finding> {
    let text = format!(
        "{points} points were not followed to their lines, since that takes too long (--limit running.traces)"
    );
    (points > 0).then_some(Finding::said("not followed", text))
}

/// The largest error of a trial among its outputs, as a share of their ranges.
fn largest_error(trial: &Trial) -> f64 {
    trial.outcomes.iter().map(|outcome| outcome.worst).fold(0.0, f64::max)
}

/// Where the coordinates themselves run out of digits, whatever the shader does: their spacing in single
/// precision exceeds the step from point to point.
fn resolution(grid: &Grid) -> Finding {
    let steps = [(0, grid.width), (1, grid.height)].map(|(axis, n)| grid.scale[axis].abs() / n.max(2) as f32);
    let limit = f64::from(steps[0].min(steps[1])) / f64::from(f32::EPSILON);
    let text = format!(
        "from an offset of {} on, neighbouring points are the same in single precision, before the shader begins",
        short(limit, 2)
    );
    Finding { limit: Some(limit), ..Finding::said("coordinates", text) }
}

fn as_given(trial: &Trial) -> Finding {
    let text = match &trial.stopped {
        Some(why) => format!("as given, the run stops: {why}"),
        None => {
            let mut text = format!(
                "as given, the largest error is {} of the range, and {} of the points are wrong",
                short(largest_error(trial), 2),
                percent(trial.wrong())
            );
            if trial.not_finite() > 0.0 {
                text += &format!("; {} are no finite numbers", percent(trial.not_finite()));
            }
            text
        }
    };
    Finding::said("as given", text)
}

/// The sentence about parameters whose NaN or infinity reaches an output.
fn passing_on(names: &[&str]) -> Option<Finding> {
    let text = format!("NaN or infinity as the value of {} reaches an output", listed(names, "or"));
    (!names.is_empty()).then(|| Finding::said("not finite", text))
}

/// What the values of a parameter add to the given setting.
struct Turned {
    trials: Vec<Trial>,
    finding: Option<Finding>,
    /// Whether NaN or infinity as its value makes such outputs.
    passes_on: bool,
}

/// How much more likely a wrong point must be than a right one before a value is told, if points are wrong as
/// given: with other values the same error shows at a few more or fewer points.
const MORE: f64 = 1.5;

/// Whether a value of a parameter makes points wrong, by the shares that are wrong with it and as given.
fn makes_wrong(now: f64, given: f64) -> bool {
    let odds = |share: f64| share / (1.0 - share).max(1e-9);
    now > given + SAFE && (given <= SAFE || odds(now) > MORE * odds(given))
}

/// Tries the values of a parameter.
fn turn(
    (subject, grid): (&Subject<'_>, &Grid),
    tolerance: f64,
    knob: &Knob,
    variant: &dyn Fn(&str, &str) -> Option<Base>,
    given: &Trial,
) -> Turned {
    let mut turned = Turned { trials: Vec::new(), finding: None, passes_on: false };
    let mut bad: Vec<String> = Vec::new();
    for value in &knob.values {
        let Some(base) = variant(&knob.name, value) else { continue };
        let setting = Setting::Param { name: knob.name.clone(), value: value.clone() };
        let (trial, _) = measure(subject, &base, grid, setting, tolerance);
        let is_number = value.parse::<f64>().is_ok_and(f64::is_finite);
        match &trial.stopped {
            Some(why) => bad.push(format!("{value} stops the run ({why})")),
            None if trial.not_finite() > given.not_finite() && !is_number => turned.passes_on = true,
            None if trial.not_finite() > given.not_finite() => {
                bad.push(format!(
                    "{value} makes {} of the points NaN or infinite",
                    percent(trial.not_finite())
                ));
            }
            None if makes_wrong(trial.wrong(), given.wrong()) => {
                let mut text = format!("{value} makes {} of the points wrong", percent(trial.wrong()));
                if given.wrong() > SAFE {
                    text += &format!(" instead of {}", percent(given.wrong()));
                }
                bad.push(text);
            }
            None => {}
        }
        turned.trials.push(trial);
    }
    let text = format!("{}: {}", knob.name, bad.join("; "));
    turned.finding = (!bad.is_empty()).then(|| Finding::said(&knob.name, text));
    turned
}

#[cfg(test)]
mod tests {
    use super::makes_wrong;

    #[test]
    fn a_value_is_told_if_it_makes_points_wrong() {
        assert!(makes_wrong(0.0015, 0.0) && makes_wrong(1.0, 0.9) && makes_wrong(0.52, 0.29));
        assert!(!makes_wrong(0.001, 0.0) && !makes_wrong(0.0015, 0.001));
        // The same fault at other points.
        assert!(!makes_wrong(0.18, 0.17) && !makes_wrong(0.74, 0.72) && !makes_wrong(0.47, 0.46));
    }
}
