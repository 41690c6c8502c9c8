//! Acceptance test of a changed shader: by how much its errors are smaller, whether it computes the same
//! function, whether points that were right are still right, and what it costs.
//!
//! `reference` compares the outputs at one setting, each component by itself.

use super::super::subject::{Planes, Programs, Subject, Swept};
use super::super::trial::Setting;
use super::reference::{Errors, ROUNDING, Reference, SAME};
use osl_ir::ir::Body;
use osl_scene::Grid;

/// The largest cost of a repair, relative to the original; and the largest one if the error falls more than
/// a thousandfold.
const DEAR: [f64; 2] = [1.2, 1.5];

/// How many times smaller the error must be for the second one.
const MANYFOLD: f64 = 1000.0;

/// The smallest gain for which anything else is tested.
const WORTHWHILE: f64 = 1.05;

/// What is known of a setting.
struct Level {
    points: Swept,
    tries: bool,
    reference: Reference,
    /// The lines that are blamed there.
    lines: Vec<u32>,
    /// Whether it is the given setting, at which no change may harm.
    is_given: bool,
}

/// The settings at which changes are judged. The first one is the one to repair.
pub(super) struct Judge<'a> {
    subject: &'a Subject<'a>,
    levels: Vec<Level>,
    cost: f64,
}

/// A change that passes all tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Good {
    /// The errors at the first setting.
    pub(super) errors: Errors,
    /// The cost relative to the original.
    pub(super) cost: f64,
    /// The largest difference of the two sources in double precision, as a share of the range.
    pub(super) doubt: f64,
}

/// Why a change does not pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bad {
    /// It does not run to its end.
    Stops,
    /// It helps too little: how many times smaller the error is.
    Little(f64),
    /// It makes other points wrong.
    Harms,
    /// It is another function, also in double precision.
    Differs,
}

impl Bad {
    /// The failed test in words.
    pub(super) fn text(&self) -> &'static str {
        match self {
            Bad::Stops => "it does not run to its end",
            Bad::Little(..) => "it helps too little",
            Bad::Harms => "points become worse",
            Bad::Differs => "it is another function, also in double precision",
        }
    }
}

impl Good {
    /// Whether the change costs more than other repairs may.
    pub(super) fn is_dear(&self) -> bool {
        self.cost >= DEAR[0]
    }

    /// Whether the change may cost that much, given the errors of the original.
    pub(super) fn is_worth_it(&self, before: &Errors) -> bool {
        !self.is_dear() || (self.cost < DEAR[1] && before.gain(&self.errors) > MANYFOLD)
    }
}

impl<'a> Judge<'a> {
    /// Prepares the settings. `None` if the original does not run at the first one.
    pub(super) fn new(
        subject: &'a Subject<'a>,
        grid: &Grid,
        settings: &[(Setting, Vec<u32>)],
    ) -> Option<Judge<'a>> {
        let mut levels = Vec::new();
        for (index, (setting, lines)) in settings.iter().enumerate() {
            let points = setting.points(grid);
            let tries = *setting != Setting::AsGiven;
            match subject.run(&subject.base, &points, tries) {
                Ok(Planes { strict, exact, .. }) => {
                    let size = (grid.width, grid.height);
                    let reference = Reference::new(&strict, exact, size, (ROUNDING, SAME[1]));
                    let (lines, is_given) = (lines.clone(), !tries);
                    levels.push(Level { points, tries, reference, lines, is_given });
                }
                Err(_) if index == 0 => return None,
                Err(_) => {}
            }
        }
        Some(Judge { subject, levels, cost: subject.base.programs.cost })
    }

    /// The programs of a changed source.
    pub(super) fn programs_of(&self, plain: Body) -> Programs {
        self.subject.base.programs_of(plain, self.subject.limits)
    }

    /// The errors before any change, at the first setting.
    pub(super) fn before(&self) -> Errors {
        self.levels.first().map_or(Errors { largest: 0.0, rms: 0.0 }, |level| level.reference.before)
    }

    /// Whether a changed program has exactly these errors at the first setting.
    pub(super) fn has_errors(&self, programs: &Programs, errors: &Errors) -> bool {
        let Some(level) = self.levels.first() else { return false };
        let values = self.subject.values(&programs.strict, &level.points, level.tries);
        values.is_ok_and(|(_, strict)| level.reference.errors(&strict) == *errors)
    }

    /// Judges a changed program against the original and against the errors of an earlier change. Besides the
    /// first setting, the given one counts, and those at which one of these lines is blamed.
    pub(super) fn judge(&self, programs: &Programs, lines: &[u32], earlier: &Errors) -> Result<Good, Bad> {
        let counts = |(index, level): &(usize, &Level)| {
            *index == 0 || level.is_given || level.lines.iter().any(|line| lines.contains(line))
        };
        let mut errors: Option<Errors> = None;
        for (_, level) in self.levels.iter().enumerate().filter(counts) {
            let values = self.subject.values(&programs.strict, &level.points, level.tries);
            let (_, strict) = values.map_err(|_| Bad::Stops)?;
            if !level.reference.has_size(&strict) {
                return Err(Bad::Differs);
            }
            if errors.is_none() {
                let own = level.reference.errors(&strict);
                let gain = earlier.gain(&own);
                if gain < WORTHWHILE {
                    return Err(Bad::Little(gain));
                }
                errors = Some(own);
            }
            if level.reference.harm(&strict).is_some() {
                return Err(Bad::Harms);
            }
        }
        let mut doubt: f64 = 0.0;
        for (index, level) in self.levels.iter().enumerate().filter(counts) {
            let values = self.subject.values(&programs.exact, &level.points, level.tries);
            let (_, exact) = values.map_err(|_| Bad::Stops)?;
            if level.reference.differs(&exact).is_some() {
                return Err(Bad::Differs);
            }
            if index == 0 {
                doubt = level.reference.doubt(&exact);
            }
        }
        let cost = programs.cost / self.cost.max(1.0);
        errors.map(|errors| Good { errors, cost, doubt }).ok_or(Bad::Stops)
    }
}
