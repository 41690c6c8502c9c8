//! The rewrite rules of [`rules.txt`](rules.txt): a pattern, what to write instead, and the reason.
//!
//! The texts are expressions of the language in which a single letter stands for any term. The rules are
//! identities of mathematics and know nothing of accuracy: whether a rewrite helps is measured. Sources: the
//! conjugates, half angles and logarithms of any textbook on numerical analysis (N. J. Higham, *Accuracy and
//! Stability of Numerical Algorithms*), W. Kahan's formulas for thin triangles and for the logarithm near 1.
//! A rule stays only if a planted fault needs it or a form beside it.

use super::term::{Term, parse, parse_grouped};
use std::sync::OnceLock;

/// One form of a rewrite rule.
#[derive(Debug)]
pub(super) struct Rule {
    /// The name of the rule.
    pub(super) name: String,
    /// Why it loses fewer digits.
    pub(super) why: String,
    /// The pattern.
    pub(super) find: Term,
    /// Values that are computed first, each with its letter. They may use earlier ones.
    pub(super) with: Vec<(char, Term)>,
    /// What is written instead.
    pub(super) write: Term,
}

/// All rules, in the order of the file; one that cannot be read is left out, which a test excludes.
pub(super) fn rules() -> &'static [Rule] {
    static RULES: OnceLock<Vec<Rule>> = OnceLock::new();
    RULES.get_or_init(|| blocks(include_str!("rules.txt")).into_iter().flatten().collect())
}

/// The forms of a text in the format of `rules.txt`: blocks of `name: reason`, and below it indented forms
/// `pattern  ->  replacement  where letter = value; letter = value`. A line that is indented further goes on.
fn blocks(text: &str) -> Vec<Option<Rule>> {
    let mut out = Vec::new();
    for block in text.split("\n\n") {
        let (mut head, mut forms) = (String::new(), Vec::<String>::new());
        for line in block.lines() {
            let depth = line.len() - line.trim_start().len();
            match forms.last_mut() {
                Some(form) if depth > 4 => *form += &format!(" {}", line.trim_start()),
                _ if depth > 0 => forms.push(line.trim_start().to_string()),
                _ => head += &format!("{}{line}", if head.is_empty() { "" } else { " " }),
            }
        }
        out.extend(forms.iter().map(|form| rule(&head, form)));
    }
    out
}

fn rule(head: &str, form: &str) -> Option<Rule> {
    let (name, why) = head.split_once(": ")?;
    let (find, rest) = form.split_once(" -> ")?;
    let (write, with) = rest.split_once(" where ").unwrap_or((rest, ""));
    let value = |text: &str| {
        let (letter, value) = text.split_once('=')?;
        Some((letter.trim().chars().next()?, parse_grouped(value.trim())?))
    };
    let with = with.split(';').filter(|text| !text.trim().is_empty()).map(value).collect::<Option<_>>()?;
    let (find, write) = (parse(find.trim())?, parse_grouped(write.trim())?);
    Some(Rule { name: name.to_string(), why: why.to_string(), find, with, write })
}

#[cfg(test)]
mod tests {
    use super::super::term::Head;
    use super::*;

    #[test]
    fn all_rules_can_be_read() {
        let read = blocks(include_str!("rules.txt"));
        assert!(read.len() > 90 && read.iter().all(Option::is_some));
        for rule in rules() {
            let letter = |t: &Term| if let Head::Any(letter) = t.head { Some(letter) } else { None };
            let mut letters: Vec<char> = Vec::new();
            rule.find.each(&mut |t| letters.extend(letter(t)));
            for (own, term) in &rule.with {
                term.each(&mut |t| assert!(letter(t).is_none_or(|l| letters.contains(&l)), "{rule:?}"));
                letters.push(*own);
            }
            rule.write.each(&mut |t| assert!(letter(t).is_none_or(|l| letters.contains(&l)), "{rule:?}"));
        }
    }
}
