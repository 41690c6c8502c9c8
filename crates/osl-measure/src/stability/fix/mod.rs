//! Repairs of the lines to blame: rewrites of the source that are tried on the points of the examination.
//!
//! `candidates` and `sums` find the places where a known rewrite matches (`rules` is the table of them), and
//! `judge` runs the changed source. A repair is proposed only if it cuts the error tenfold against the
//! original source in double precision, computes the same function there, leaves right what was right (each
//! component of each output by itself: `reference`; also with other values of the parameters: `variants`),
//! and costs less than 1.2 times, or 1.5 times if the error falls more than a thousandfold. `greedy` adds
//! others to the best rewrite if one is not enough. [`check`] repeats all tests.

mod candidates;
mod greedy;
mod judge;
mod matching;
mod polynomial;
mod reference;
mod rules;
pub(crate) mod source;
mod substitution;
mod sums;
pub(crate) mod term;
pub mod text;
mod variants;
mod writing;

pub use reference::Errors;

use super::examine::{Examined, Knob};
use super::subject::Subject;
use super::trial::Setting;
use greedy::{Search, worst_lines};
use judge::Judge;
use osl_hir::hir::Program;
use osl_ir::ir::Body;
use osl_scene::Grid;
use osl_syntax::source::SourceMap;
use serde::Serialize;
use variants::Variants;

/// A source that was compiled again.
pub struct Built {
    /// The resolved program.
    pub program: Program,
    /// Its files; the main file comes first.
    pub sources: SourceMap,
    /// The lowered body.
    pub plain: Body,
    /// The body with notes, if they were requested.
    pub noted: Option<Body>,
}

/// What is compiled again.
pub struct Changed<'a> {
    /// The text of the main file.
    pub text: &'a str,
    /// Whether the body with notes is needed.
    pub notes: bool,
    /// A parameter with another value than the given one, as on the command line. It becomes the only input
    /// of the body, so that further values need no compilation.
    pub param: Option<(&'a str, &'a str)>,
}

impl<'a> Changed<'a> {
    /// A text with the given values of the parameters, without notes.
    pub fn plain(text: &'a str) -> Changed<'a> {
        Changed { text, notes: false, param: None }
    }
}

/// Compiles a changed text of the main file; `None` if it has errors.
pub type Build<'a> = dyn Fn(&Changed<'_>) -> Option<Built> + 'a;

/// A rewrite that belongs to a repair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// The name of the rewrite.
    pub name: String,
    /// The line that it changes, in the source before it.
    pub line: u32,
    /// The replaced text.
    pub old: String,
    /// What stands there instead.
    pub new: String,
    /// Why it loses fewer digits.
    pub why: String,
    /// The errors with this rewrite and those before it.
    pub errors: Errors,
    /// The cost with it and those before it, relative to the original.
    pub cost: f64,
}

/// What was found to repair the lines to blame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Repair {
    /// The setting that it is for.
    pub setting: String,
    /// The errors of the original there.
    pub before: Option<Errors>,
    /// The rewrites, in the order in which they were chosen. Empty if none helps enough.
    pub steps: Vec<Step>,
    /// The largest difference between both sources in double precision, as a share of the range. If it is not
    /// small against the error after the repair, double precision loses digits in the original too, and the
    /// error after the repair is not better known than that.
    pub doubt: f64,
    /// Rewrites that help as much, but cost too much: the best one.
    pub dear: Option<Step>,
    /// A rewrite that helps at the given values, with the option of the command line or the value of a
    /// parameter, as `b = -2`, at which it makes points wrong that were right.
    pub harmful: Option<(Step, String)>,
    /// The test that the repaired source as a whole fails. It then has no text.
    pub refused: Option<String>,
    /// The best rewrite that does not help enough, with how many times smaller its error is.
    pub nearly: Option<(Step, f64)>,
    /// Number of rewrites that were tried.
    pub tried: usize,
    /// Number of matching rewrites that were not tried, since the work or the time was used up.
    pub not_tried: usize,
    /// Whether the time was over before the examination or the search ended.
    pub cut_short: bool,
    /// The differences as a unified diff; the caller makes it.
    pub diff: String,
    /// The repaired source.
    #[serde(skip)]
    pub text: Option<String>,
}

/// Looks for a repair of the lines to blame in the main file with this text. It must do no harm at the values
/// of `knobs` either.
pub fn repair(
    subject: &Subject<'_>,
    grid: &Grid,
    examined: &Examined,
    knobs: &[Knob],
    (text, program): (&str, &Program),
    build: &Build<'_>,
) -> Repair {
    if examined.report.not_enough.is_some() {
        let why = "double precision is not enough here to judge a repair".to_string();
        return Repair { refused: Some(why), ..nothing(&Setting::AsGiven.text()) };
    }
    let settings = settings(examined);
    let variants = Variants::new((subject, grid), knobs, text);
    let mut last: Option<Repair> = None;
    for index in 0..settings.len() {
        let Some((setting, lines)) = settings.get(index).filter(|(_, lines)| !lines.is_empty()) else {
            continue;
        };
        if last.is_some() && subject.is_over() {
            break;
        }
        // The setting to repair comes first; at the others nothing may become worse.
        let mut order = settings.clone();
        order.swap(0, index);
        let Some(judge) = Judge::new(subject, grid, &order) else { continue };
        let search = Search { subject, grid, judge, variants: &variants, setting: setting.clone(), build };
        let found = search.run(text, program, lines.clone());
        let is_done = !found.steps.is_empty();
        // The first setting with a result of any kind is reported, unless a later one can be repaired.
        if is_done || last.is_none() {
            last = Some(found);
        }
        if is_done || index == 0 {
            break;
        }
    }
    let cut_short = subject.is_over() || !examined.report.not_examined.is_empty();
    Repair { cut_short, ..last.unwrap_or_else(|| nothing("as given")) }
}

/// The given setting and those just beyond the right ranges, with the lines that are blamed there.
fn settings(examined: &Examined) -> Vec<(Setting, Vec<u32>)> {
    let mut settings = vec![Setting::AsGiven];
    settings.extend(examined.beyond.iter().cloned());
    let blamed = |setting: &Setting| -> Vec<u32> {
        let name = setting.text();
        let list =
            if *setting == Setting::AsGiven { &examined.report.culprits } else { &examined.report.beyond };
        worst_lines(list.iter().filter(|culprit| culprit.setting == name))
    };
    settings.into_iter().map(|setting| (setting.clone(), blamed(&setting))).collect()
}

/// Tests whether a changed text is a repair of the given setting of a shader with this text: all that
/// [`repair`] requires of one.
///
/// # Errors
/// The test that fails, in words.
pub fn check(
    subject: &Subject<'_>,
    grid: &Grid,
    examined: &Examined,
    knobs: &[Knob],
    (text, changed): (&str, &str),
    build: &Build<'_>,
) -> Result<(), String> {
    let settings = settings(examined);
    let lines: Vec<u32> = settings.iter().flat_map(|(_, lines)| lines.iter().copied()).collect();
    let judge = Judge::new(subject, grid, &settings).ok_or("it does not run to its end")?;
    greedy::check(&judge, &Variants::new((subject, grid), knobs, text), (changed, &lines), build)
}

fn nothing(setting: &str) -> Repair {
    Repair { setting: setting.to_string(), ..Repair::default() }
}
