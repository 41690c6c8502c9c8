//! Pattern matching modulo commutativity and associativity: finds the pattern of a rule in a term.
//!
//! The parts of sums and products may be in any order. A letter stands for any term, and for the same term
//! wherever it occurs. A pattern that is a sum or product also matches a part of a longer one: the rest is
//! kept.

use super::term::{COMMUTE, Head, Term, negative, product, sum};
use osl_syntax::span::Span;

/// Maximum number of ways in which a pattern is matched with one term.
const MOST: usize = 12;

/// The largest number of parts of a sum or product that are put in other orders.
const PARTS: usize = 8;

/// A pattern found in a term.
#[derive(Clone, Debug, Default)]
pub(super) struct PatternMatch {
    /// The terms for the letters.
    pub(super) letters: Vec<(char, Term)>,
    /// The places of the source that the pattern itself covers, without those of the letters.
    pub(super) covers: Vec<Span>,
    /// The parts of the sum or product that the pattern leaves.
    pub(super) rest: Vec<(bool, Term)>,
    /// The factors by which the whole is multiplied.
    pub(super) factors: Vec<(bool, Term)>,
    /// Whether the term is the pattern with the opposite sign.
    pub(super) is_negative: bool,
}

impl PatternMatch {
    /// The term for a letter.
    pub(super) fn get(&self, letter: char) -> Option<&Term> {
        self.letters.iter().find(|(name, _)| *name == letter).map(|(_, term)| term)
    }
}

/// All ways in which the pattern matches the term or a part of a sum or product.
pub(super) fn find(pattern: &Term, term: &Term) -> Vec<PatternMatch> {
    let mut out = Vec::new();
    let is_list = |t: &Term| match t.head {
        Head::Sum(_) => Some(true),
        Head::Product(_) => Some(false),
        _ => None,
    };
    match (is_list(pattern), is_list(term)) {
        (Some(is_sum), own) if own == Some(is_sum) => {
            for flip in [false, true] {
                if flip && !is_sum {
                    continue;
                }
                let target: Vec<(bool, Term)> =
                    term.items(is_sum).into_iter().map(|(flag, part)| (flag != flip, part)).collect();
                let list =
                    List { is_sum, pattern: ordered(pattern, is_sum), target: &target, keeps_rest: true };
                let mut found = Vec::new();
                let start = PatternMatch {
                    covers: term.covers.clone(),
                    is_negative: flip,
                    ..PatternMatch::default()
                };
                list.place(0, &mut vec![false; target.len()], &start, &mut found);
                out.extend(found);
            }
        }
        (Some(_), _) => {}
        (None, _) => matched(pattern, term, &PatternMatch::default(), &mut out),
    }
    out.truncate(MOST);
    out
}

/// The parts of a pattern: those that say most first, letters last.
fn ordered(pattern: &Term, is_sum: bool) -> Vec<(bool, Term)> {
    let mut items = pattern.items(is_sum);
    items.sort_by_key(|(_, part)| match part.head {
        Head::Any(_) => 2,
        Head::Number(_) => 0,
        _ => 1,
    });
    items
}

fn matched(pattern: &Term, term: &Term, found: &PatternMatch, out: &mut Vec<PatternMatch>) {
    if out.len() >= MOST {
        return;
    }
    match (&pattern.head, &term.head) {
        (Head::Any(letter), _) => out.extend(bind(*letter, term, found)),
        (Head::Number(a), Head::Number(b)) if a == b => out.push(found.clone()),
        (Head::Call(a), Head::Call(b)) if a == b && pattern.parts.len() == term.parts.len() => {
            let mut found = found.clone();
            found.covers.extend(term.covers.iter().copied());
            in_order(&pattern.parts.iter().collect::<Vec<_>>(), &term.parts, &found, out);
            if COMMUTE.contains(&&**a)
                && let [x, y] = &pattern.parts[..]
            {
                in_order(&[y, x], &term.parts, &found, out);
            }
        }
        (Head::Sum(_), Head::Sum(_)) | (Head::Product(_), Head::Product(_)) => {
            let is_sum = matches!(pattern.head, Head::Sum(_));
            let target = term.items(is_sum);
            let list = List { is_sum, pattern: ordered(pattern, is_sum), target: &target, keeps_rest: false };
            let mut found = found.clone();
            found.covers.extend(term.covers.iter().copied());
            list.place(0, &mut vec![false; target.len()], &found, out);
        }
        // A single term as the sum of its negation, or a number with its sign.
        (Head::Sum(flags), Head::Number(x)) if flags == &[true] => {
            if let [part] = &pattern.parts[..] {
                matched(part, &Term::number(-x), found, out);
            }
        }
        _ => {}
    }
}

/// The match in which a letter stands for the term, if it does not stand for another one.
fn bind(letter: char, term: &Term, found: &PatternMatch) -> Option<PatternMatch> {
    match found.get(letter) {
        Some(known) => known.same(term).then(|| found.clone()),
        None => {
            let mut found = found.clone();
            found.letters.push((letter, term.clone()));
            Some(found)
        }
    }
}

/// Matches the arguments of a call one by one.
fn in_order(patterns: &[&Term], terms: &[Term], found: &PatternMatch, out: &mut Vec<PatternMatch>) {
    match (patterns.split_first(), terms.split_first()) {
        (Some((pattern, patterns)), Some((term, terms))) => {
            let mut first = Vec::new();
            matched(pattern, term, found, &mut first);
            first.iter().for_each(|found| in_order(patterns, terms, found, out));
        }
        _ => out.push(found.clone()),
    }
}

/// A sum or product whose parts are matched in any order.
struct List<'a> {
    is_sum: bool,
    pattern: Vec<(bool, Term)>,
    target: &'a [(bool, Term)],
    /// Whether the target may have more parts than the pattern.
    keeps_rest: bool,
}

impl List<'_> {
    fn place(&self, at: usize, used: &mut Vec<bool>, found: &PatternMatch, out: &mut Vec<PatternMatch>) {
        if out.len() >= MOST || self.target.len() > PARTS {
            return;
        }
        let left = || self.target.iter().zip(used.iter()).filter(|(_, used)| !**used).map(|(item, _)| item);
        let Some((flag, pattern)) = self.pattern.get(at) else {
            let rest: Vec<(bool, Term)> = left().cloned().collect();
            if rest.is_empty() {
                out.push(found.clone());
            } else if self.keeps_rest {
                out.push(PatternMatch { rest, ..found.clone() });
            }
            return;
        };
        let is_last = at + 1 == self.pattern.len();
        if let Head::Any(letter) = pattern.head
            && is_last
            && found.get(letter).is_none()
        {
            // The last letter may stand for everything that is left, whatever its signs.
            let all: Vec<(bool, Term)> = left().map(|(own, part)| (own != flag, part.clone())).collect();
            let is_plain = matches!(&all[..], [(false, _)]);
            // A divisor is not the inverse of a factor.
            let suits = self.is_sum || !*flag || all.iter().any(|(other, _)| !other);
            if !all.is_empty() && !is_plain && suits {
                let group = match (self.is_sum, &all[..]) {
                    (true, [(true, only)]) => negative(only.clone()),
                    (true, _) => sum(all),
                    (false, _) => product(all),
                };
                out.extend(bind(letter, &group, found));
                if !self.keeps_rest {
                    return;
                }
            }
        }
        for index in 0..self.target.len() {
            let Some((own, part)) = self.target.get(index) else { continue };
            if used[index] {
                continue;
            }
            let mut first = Vec::new();
            if own == flag {
                matched(pattern, part, found, &mut first);
            } else if self.is_sum
                && let (Head::Number(_), Head::Number(_)) = (&pattern.head, &part.head)
            {
                matched(pattern, &negative(part.clone()), found, &mut first);
            }
            for found in first {
                used[index] = true;
                self.place(at + 1, used, &found, out);
                used[index] = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::term::parse;
    use super::*;

    /// The number of matches of a pattern with the term of another text of the table's language, whose
    /// letters are terms like all others.
    fn count(pattern: &str, term: &str) -> usize {
        find(&parse(pattern).unwrap(), &frozen(parse(term).unwrap())).len()
    }

    fn frozen(mut term: Term) -> Term {
        term.parts = term.parts.into_iter().map(frozen).collect();
        if let Head::Any(letter) = term.head {
            term.head = Head::Leaf(letter.to_string().as_str().into());
        }
        term
    }

    #[test]
    fn sums_and_products_match_in_any_order() {
        assert!(count("a * b - a * c", "y * x - z * y") > 0);
        assert!(count("a * b - a * c", "y * x - z * w") == 0);
        assert!(count("a + b - a", "3 + x - y - x") > 0);
        assert!(count("sqrt(a) - b", "-(p + q) + sqrt(r)") > 0);
    }

    #[test]
    fn a_sum_matches_with_the_opposite_sign() {
        let found = find(&parse("1 - cos(x)").unwrap(), &frozen(parse("cos(t) - 1 + k").unwrap()));
        assert!(found.iter().any(|f| f.is_negative && f.rest.len() == 1));
    }

    #[test]
    fn a_letter_stands_for_one_term() {
        assert!(count("x / (x + 1)", "p / (1 + p)") > 0);
        assert!(count("x / (x + 1)", "p / (1 + q)") == 0);
        assert!(count("log(1 + x)", "log(1 - p * q)") > 0);
    }
}
