//! The lines on which a file suppresses warnings.

use crate::diagnostic::Diagnostic;
use crate::span::Span;

/// The lines on which `#pragma osl nowarn` suppresses warnings.
#[derive(Clone, Debug, Default)]
pub struct Silenced {
    /// In order, and apart from each other.
    lines: Vec<Span>,
}

impl Silenced {
    /// From the spans of lines in any order; they may overlap.
    pub(crate) fn new(mut spans: Vec<Span>) -> Silenced {
        spans.sort_unstable_by_key(|line| line.start);
        let mut lines: Vec<Span> = Vec::with_capacity(spans.len());
        for span in spans {
            match lines.last_mut() {
                Some(last) if span.start < last.end => last.end = last.end.max(span.end),
                _ => lines.push(span),
            }
        }
        Silenced { lines }
    }

    /// Whether warnings at a place are suppressed.
    pub fn holds(&self, span: Span) -> bool {
        let before = self.lines.partition_point(|line| line.start <= span.start);
        let line = before.checked_sub(1).and_then(|at| self.lines.get(at));
        line.is_some_and(|line| span.start < line.end)
    }

    /// Whether a diagnostic is suppressed. Errors never are.
    pub fn hides(&self, diagnostic: &Diagnostic) -> bool {
        !diagnostic.is_error() && self.holds(diagnostic.span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_within_a_whole_file() {
        let silenced = Silenced::new(vec![Span::new(40, 50), Span::new(0, 100), Span::new(120, 130)]);
        for (at, hidden) in [(0, true), (45, true), (60, true), (99, true), (100, false), (125, true)] {
            assert_eq!(silenced.holds(Span::new(at, at + 1)), hidden, "{at}");
        }
    }
}
