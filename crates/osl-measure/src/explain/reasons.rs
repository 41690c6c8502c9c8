//! Why a line does not run, or is not needed, in words.

use super::Subject;
use super::sites::{FoldedResult, Gate, Site};
use super::source::{line_at, snippet};
use osl_ir::Span;
use osl_syntax::source::SourceMap;
use rustc_hash::FxHashMap;

/// The most outputs that are named.
const MAX_NAMED: usize = 3;

/// What is known about a point.
pub(super) struct Reasons<'a> {
    pub(super) subject: &'a Subject,
    pub(super) sources: &'a SourceMap,
    /// The sites that the point reaches.
    pub(super) reached: &'a FxHashMap<u32, usize>,
    /// The truths that a condition had: true, false.
    pub(super) truths: &'a FxHashMap<u32, [bool; 2]>,
}

impl Reasons<'_> {
    /// Why the values of a line are not needed.
    pub(super) fn not_needed(&self) -> String {
        let names: Vec<String> = self.subject.outputs.iter().map(|name| format!("`{name}`")).collect();
        match &names[..] {
            [one] => format!("the output {one} does not depend on it"),
            several if (2..=MAX_NAMED).contains(&several.len()) => {
                format!("none of the outputs {} depends on it", several.join(", "))
            }
            _ => "no requested output depends on it".to_string(),
        }
    }

    /// Why values are not needed that are replaced.
    pub(super) fn again(names: &[String]) -> String {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        match &names[..] {
            [one] => format!("{one} is assigned again before anything reads it"),
            [rest @ .., last] if names.len() <= MAX_NAMED => {
                format!("{} and {last} are assigned again before anything reads them", rest.join(", "))
            }
            _ => "its variables are assigned again before anything reads them".to_string(),
        }
    }

    /// Why the point does not reach a site. `gone` tells that the compiler removed the code.
    pub(super) fn skipped(&self, site: &Site, gone: bool) -> Option<String> {
        let mut left = false;
        let mut next = site.inside;
        while let Some(around) = next.and_then(|at| self.subject.sites.around.get(at)) {
            match around.gate {
                Gate::Branch(test, wanted) if self.reached.contains_key(&test) => {
                    let had = self.truths.get(&test).copied().unwrap_or_default();
                    if had[usize::from(!wanted)] {
                        // The point came this far, and then left.
                        break;
                    }
                    let known =
                        matches!(self.subject.passed.made.get(&test), Some(FoldedResult::Constant(_)));
                    let span = self.subject.sites.by_number.get(&test)?.span;
                    return Some(self.condition(span, !wanted, known && gone));
                }
                Gate::Loop { round, .. } if self.reached.contains_key(&round) => break,
                Gate::Loop { entered, .. } if self.reached.contains_key(&entered) => {
                    return Some("the loop around it has no rounds here".to_string());
                }
                Gate::Branch(..) | Gate::Loop { .. } => {}
                Gate::Left => left = true,
            }
            next = around.outer;
        }
        left.then(|| "a `break`, `continue`, `return` or `exit` leaves before it".to_string())
    }

    fn condition(&self, span: Span, truth: bool, always: bool) -> String {
        let line =
            line_at(span, self.sources).map_or_else(String::new, |(_, line)| format!(" (line {line})"));
        let verb = if always { "is always" } else { "is" };
        format!("`{}`{line} {verb} {truth}", snippet(span, self.sources))
    }
}
