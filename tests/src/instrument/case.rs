//! A source, its instrumented form, and runs of both.

use super::compare::{Seen, compare};
use super::{Differences, Instrumented, calls, instrument, reasons, reports, slopes, texts};
use crate::{laws, run};
use osl::stages::{self, Checked};
use osl_exec::{Frame, PointSource, RunOptions};
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_limits::Limits;
use osl_lower::params::ParamValues;
use osl_measure::explain::{self, Explanation};
use osl_measure::trace::{OnePoint, Trace, follow};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

/// What a comparison found besides mistakes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Values, outcomes and counts that were compared.
    pub compared: usize,
    /// Reasons, derivatives and calls of functions of the language that were compared.
    pub reasons: usize,
    /// The same.
    pub slopes: usize,
    /// The same.
    pub builtins: usize,
    /// Reports of a run that were compared.
    pub reports: usize,
    /// Values of the text that were compared with those of the JSON.
    pub texts: usize,
    /// Derivatives that were compared with differences.
    pub differences: Differences,
    /// Whether the instrumented source was rejected or stopped, so that nothing was compared.
    pub open: bool,
}

/// The name of the source.
pub(super) const FILE: &str = "generated.osl";

const SIZE: (usize, usize) = (5, 3);

/// The pixels that are explained.
const PIXELS: [(usize, usize); 3] = [(0, 0), (3, 1), (4, 2)];

/// A source that compiles, and its instrumented form with what that printed.
pub(super) struct Case {
    pub(super) text: String,
    pub(super) checked: Checked,
    pub(super) written: Instrumented,
    pub(super) grid: Grid,
    pub(super) options: passes::Options,
    frame: Frame,
}

impl Case {
    /// None if one of the two does not compile or does not end.
    fn of(text: &str, slopes: bool) -> Option<Case> {
        let checked = stages::check(FILE, text, &NoFiles, &Options::default());
        checked.program.as_ref()?;
        let written = instrument(text, &checked.ast, slopes);
        let grid = Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(SIZE.0, SIZE.1) };
        let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
        let mut case =
            Case { text: text.to_string(), checked, written, grid, options, frame: Frame::default() };
        case.frame = case.run(&case.written.text)?;
        Some(case)
    }

    /// Runs a source on the grid.
    pub(super) fn run(&self, text: &str) -> Option<Frame> {
        let checked = stages::check(FILE, text, &NoFiles, &Options::default());
        let compiled = stages::finish(stages::lower(checked.program.as_ref()?, &[]).ok()?, &self.options);
        let options = RunOptions { limits: run::steps(1 << 22), ..RunOptions::default() };
        osl_exec::run(&compiled.program, laws::services(), &self.grid, &options, &|_| ()).ok()
    }

    /// What the instrumented source printed at a point.
    pub(super) fn seen(&self, point: usize) -> Seen {
        let here = self.frame.printed.iter().filter(|p| p.point == point && p.file.is_none());
        let lines: Vec<&str> = here.map(|p| p.text.as_str()).collect();
        Seen::read(&lines, &self.written)
    }

    pub(super) fn points() -> std::ops::Range<usize> {
        0..SIZE.0 * SIZE.1
    }

    pub(super) fn lowered(&self, note_derivs: bool) -> Option<Body> {
        let last = osl_lower::Last::None;
        let requests = osl_lower::Requests { last, notes: true, note_derivs, ..Default::default() };
        let program = self.checked.program.as_ref()?;
        osl_lower::lower_for(program, &ParamValues::default(), &requests).ok()
    }

    /// The program that is explained.
    pub(super) fn subject(&self, note_derivs: bool) -> Option<explain::Subject> {
        Some(explain::Subject::new(self.lowered(note_derivs)?, &self.options, &self.checked.sources))
    }

    pub(super) fn point(&self, (x, y): (usize, usize)) -> Option<OnePoint<'_>> {
        let point = OnePoint::at_pixel(&self.grid, SIZE.0, SIZE.1, x, y)?;
        Some(OnePoint { source: &self.grid, point })
    }

    pub(super) fn trace(&self, subject: &explain::Subject, point: OnePoint<'_>) -> Trace {
        follow(&subject.body, laws::services(), point, &Limits::default())
    }

    /// Adds where a difference is.
    fn at(&self, (x, y): (usize, usize), law: &str) -> String {
        format!("{law}\nat ({x}, {y})\n{}\n--- instrumented\n{}", self.text, self.written.text)
    }
}

/// Compares the explanation of a few points with the instrumented run. `more` also compares the reasons, the
/// derivatives, and the calls of functions of the language.
///
/// # Errors
/// The first difference, as text.
pub fn hold(text: &str, more: bool) -> Result<Outcome, String> {
    let mut outcome = Outcome::default();
    let open = Ok(Outcome { open: true, ..Outcome::default() });
    let Some(case) = Case::of(text, false) else { return open };
    let Some(subject) = case.subject(false) else { return open };
    let mut told: Vec<(usize, Explanation)> = Vec::new();
    for (x, y) in PIXELS {
        let Some(point) = case.point((x, y)) else { continue };
        let explanation = explain::explain(&case.trace(&subject, point), &subject, &case.checked.sources);
        if explanation.cut || calls::hashes_nan(&explanation) {
            outcome.open = true;
            continue;
        }
        let seen = case.seen(y * SIZE.0 + x);
        outcome.compared +=
            compare(&explanation, &seen, &case.written).map_err(|law| case.at((x, y), &law))?;
        told.push((y * SIZE.0 + x, explanation));
    }
    outcome.reports = reports::hold(&case, &mut told).map_err(|law| case.at((0, 0), &law))?;
    for (_, explanation) in &told {
        outcome.texts += texts::hold(explanation).map_err(|law| case.at((0, 0), &law))?;
    }
    if more {
        outcome.reasons = reasons::hold(&case, &told).map_err(|law| case.at((0, 0), &law))?;
        outcome.builtins = calls::hold(&case, &told).map_err(|law| case.at((0, 0), &law))?;
        if let Some(sloped) = Case::of(text, true) {
            for (x, y) in PIXELS {
                let seen = sloped.seen(y * SIZE.0 + x);
                let (same, differences) =
                    slopes::hold(&sloped, (x, y), &seen).map_err(|law| sloped.at((x, y), &law))?;
                outcome.slopes += same;
                outcome.differences.add(differences);
            }
        }
    }
    Ok(outcome)
}
