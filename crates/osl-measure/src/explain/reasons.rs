//! Why a line does not run, or is not needed, in words.

use super::sites::{FoldedResult, Gate, Site};
use super::{Compiled, Fact, Subject, What};
use crate::quote::{line_at, snippet};
use crate::words::listed;
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
    /// Why values are not needed that `it` names.
    pub(super) fn not_needed(&self, it: &str) -> String {
        let names: Vec<String> = self.subject.outputs.iter().map(|name| format!("`{name}`")).collect();
        match &names[..] {
            [one] => format!("the output {one} does not depend on {it}"),
            several if (2..=MAX_NAMED).contains(&several.len()) => {
                format!("none of the outputs {} depends on {it}", several.join(", "))
            }
            _ => format!("no requested output depends on {it}"),
        }
    }

    /// Why some values of a line are not needed, while others are; `again` has the variables of the line, and
    /// whether each is assigned again before anything reads it.
    pub(super) fn partly_needed(&self, facts: &[Fact], again: &[(String, bool)]) -> Option<String> {
        let unneeded = |name: &str| {
            let of_name = facts.iter().filter_map(|fact| match &fact.what {
                What::Set { name: own, compiled, each, .. } if own == name => Some((compiled, each)),
                _ => None,
            });
            let (mut any, mut all) = (false, true);
            for (compiled, each) in of_name {
                let all_of_fact = *compiled == Compiled::NotNeeded;
                any |= all_of_fact || each.contains(&Compiled::NotNeeded);
                all &= all_of_fact;
            }
            any.then_some(all)
        };
        let (mut replaced, mut whole, mut part) = (Vec::new(), Vec::new(), Vec::new());
        for (name, is_again) in again {
            let shown = if name == "return" { "the result".to_string() } else { format!("`{name}`") };
            match unneeded(name) {
                Some(true) if *is_again => replaced.push(name.clone()),
                Some(true) => whole.push(shown),
                Some(false) => part.push(shown),
                None => {}
            }
        }
        let list = |names: &[String], values: &str| {
            let named =
                if names.len() <= MAX_NAMED { listed(names, "or") } else { "these values".to_string() };
            let values = if names.len() <= MAX_NAMED { values } else { "" };
            (!names.is_empty()).then(|| self.not_needed(&format!("{values}{named}")))
        };
        let replaced = (!replaced.is_empty()).then(|| Reasons::again(&replaced));
        let all = [replaced, list(&whole, ""), list(&part, "these values of ")];
        let all: Vec<String> = all.into_iter().flatten().collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// Why values are not needed that are replaced.
    pub(super) fn again(names: &[String]) -> String {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        match names.len() {
            1 => format!("{} is assigned again before anything reads it", names[0]),
            2..=MAX_NAMED => {
                format!("{} are assigned again before anything reads them", listed(&names, "and"))
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
