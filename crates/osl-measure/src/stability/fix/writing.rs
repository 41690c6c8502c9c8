//! Simplification and printing: puts terms in place of the letters of a rule, removes what cancels, and
//! writes the result as source text.

use super::matching::PatternMatch;
use super::polynomial;
use super::substitution::named;
use super::term::{COMPONENTS, Head, Term, binds, negative, sum};
use osl_syntax::ast::BinaryOp;

/// The replacement with the terms of the letters; `None` if a letter has no term.
pub(super) fn filled(row: &Term, found: &PatternMatch) -> Option<Term> {
    let parts = || row.parts.iter().map(|part| filled(part, found)).collect::<Option<Vec<Term>>>();
    Some(match &row.head {
        Head::Any(letter) => found.get(*letter)?.clone(),
        Head::Sum(flags) => short_sum(flags.iter().copied().zip(parts()?).collect()),
        Head::Product(flags) => short_product(flags.iter().copied().zip(parts()?).collect()),
        Head::Group => {
            let inner = parts()?.pop()?;
            let is_sum = matches!(&inner.head, Head::Sum(flags) if flags.len() > 1) && inner.text.is_none();
            if is_sum { Term::new(Head::Group, vec![inner]) } else { inner }
        }
        Head::Call(name) => called(name, parts()?)?,
        Head::Compare(op) => compared(*op, parts()?),
        Head::Choose => {
            let parts = parts()?;
            match &parts[..] {
                [Term { head: Head::Number(truth), .. }, yes, no] => {
                    if *truth != 0.0 {
                        yes.clone()
                    } else {
                        no.clone()
                    }
                }
                _ => Term::new(Head::Choose, parts),
            }
        }
        _ => Term::new(row.head.clone(), parts()?),
    })
}

/// A comparison; of numbers its truth.
fn compared(op: BinaryOp, parts: Vec<Term>) -> Term {
    match &parts[..] {
        [Term { head: Head::Number(a), .. }, Term { head: Head::Number(b), .. }] => {
            let truth = match op {
                BinaryOp::Lt => a < b,
                BinaryOp::Le => a <= b,
                BinaryOp::Gt => a > b,
                BinaryOp::Ge => a >= b,
                BinaryOp::Ne => a != b,
                _ => a == b,
            };
            Term::number(f64::from(u8::from(truth)))
        }
        _ => Term::new(Head::Compare(op), parts),
    }
}

/// A call; of numbers its value, where the table needs that. `wrapped`, an angle without whole turns, exists
/// for numbers alone.
fn called(name: &str, parts: Vec<Term>) -> Option<Term> {
    let numbers: Vec<f64> =
        parts.iter().filter_map(|t| if let Head::Number(x) = t.head { Some(x) } else { None }).collect();
    Some(match (name, &numbers[..]) {
        ("wrapped", [x]) => {
            let turn = std::f64::consts::TAU;
            Term::number(x - turn * (x / turn).round())
        }
        ("wrapped", _) => return None,
        _ if let Some(index) = COMPONENTS.iter().position(|own| *own == name) => {
            return named(index, parts.first()?);
        }
        ("abs", [x]) => Term::number(x.abs()),
        ("floor", [x]) => Term::number(x.floor()),
        ("mod", [x, y]) if *y != 0.0 => Term::number(x - y * (x / y).floor()),
        _ => Term::new(Head::Call(name.into()), parts),
    })
}

/// The replacement together with the parts of the sum or product that the pattern left.
pub(super) fn with_rest(term: Term, is_sum: bool, found: &PatternMatch) -> Term {
    let rest = found.rest.iter().cloned();
    if is_sum {
        let whole = short_sum(std::iter::once((false, term)).chain(rest).collect());
        if found.is_negative { negated(whole) } else { whole }
    } else {
        short_product(std::iter::once((false, term)).chain(rest).collect())
    }
}

/// The replacement times the factors that were taken out before the pattern was looked for.
pub(super) fn with_factors(term: Term, found: &PatternMatch) -> Term {
    if found.factors.is_empty() {
        return term;
    }
    let term = match term.head {
        Head::Choose => Term::new(Head::Group, vec![term]),
        _ => term,
    };
    short_product(found.factors.iter().cloned().chain([(false, term)]).collect())
}

/// The negated term; a sum changes the signs of its parts, and a choice those of its results.
fn negated(term: Term) -> Term {
    match (&term.head, &term.parts[..]) {
        (Head::Sum(_), _) if term.text.is_none() => {
            let mut items: Vec<_> = term.items(true).into_iter().map(|(flag, part)| (!flag, part)).collect();
            // Two parts may change places; the order of more is that of the additions.
            if items.len() == 2 {
                items.sort_by_key(|(flag, _)| *flag);
            }
            sum(items)
        }
        (Head::Choose, [condition, yes, no]) if term.text.is_none() => {
            Term::new(Head::Choose, vec![condition.clone(), negated(yes.clone()), negated(no.clone())])
        }
        _ => positive(&term).unwrap_or_else(|| negative(term)),
    }
}

/// What a term with a leading minus is the negative of.
fn positive(term: &Term) -> Option<Term> {
    match (&term.head, &term.parts[..]) {
        (Head::Sum(flags), [part]) if flags == &[true] => Some(part.clone()),
        (Head::Product(flags), [first, rest @ ..]) if flags.first() == Some(&false) => {
            let parts = std::iter::once(positive(first)?).chain(rest.iter().cloned()).collect();
            Some(Term::new(term.head.clone(), parts))
        }
        _ => None,
    }
}

/// The parts of sums (or products) among the items, if those have no text of their own, or in any case.
fn opened(items: Vec<(bool, Term)>, is_sum: bool, in_any_case: bool) -> Vec<(bool, Term)> {
    let mut out = Vec::new();
    for (flag, term) in items {
        let term = match (&term.head, term.parts.first()) {
            (Head::Group, Some(inner)) if in_any_case && is_sum => inner.clone(),
            _ => term,
        };
        let is_list = matches!((&term.head, is_sum), (Head::Sum(_), true) | (Head::Product(_), false));
        if is_list && (in_any_case || term.text.is_none()) {
            let inner = term.items(is_sum).into_iter().map(|(own, part)| (own != flag, part)).collect();
            out.extend(opened(inner, is_sum, in_any_case));
        } else {
            out.push((flag, term));
        }
    }
    out
}

/// Removes pairs of equal items with opposite flags. Returns whether there were any.
fn cancel(items: &mut Vec<(bool, Term)>) -> bool {
    let before = items.len();
    let mut at = 0;
    while let Some((flag, term)) = items.get(at) {
        let other = items.iter().skip(at + 1).position(|(f, t)| f != flag && t.same(term));
        match other {
            Some(further) => {
                items.remove(at + 1 + further);
                items.remove(at);
            }
            None => at += 1,
        }
    }
    items.len() < before
}

/// Whether the sum of the numbers among the items is much smaller than the largest of them.
fn numbers_cancel(items: &[(bool, Term)]) -> bool {
    let (mut total, mut largest) = (0.0, 0.0_f64);
    for (flag, term) in items {
        if let Head::Number(x) = term.head {
            total += if *flag { -x } else { x };
            largest = largest.max(x.abs());
        }
    }
    f64::abs(total) < 0.5 * largest
}

/// The term without what cancels in it, at any depth; `None` if nothing does.
pub(super) fn tidied(term: &Term) -> Option<Term> {
    let parts: Vec<Option<Term>> = term.parts.iter().map(tidied).collect();
    let mut changes = parts.iter().any(Option::is_some);
    let parts = parts.into_iter().zip(&term.parts).map(|(new, old)| new.unwrap_or_else(|| old.clone()));
    match &term.head {
        Head::Sum(flags) => {
            let mut items: Vec<(bool, Term)> = flags.iter().copied().zip(parts).collect();
            changes |= numbers_cancel(&items);
            changes |= cancel(&mut items);
            changes.then(|| short_sum(items))
        }
        Head::Product(flags) => {
            let mut items: Vec<(bool, Term)> = flags.iter().copied().zip(parts).collect();
            changes |= cancel(&mut items);
            changes.then(|| short_product(items))
        }
        Head::Call(name) if !COMPONENTS.contains(&&**name) => {
            changes.then(|| Term::new(term.head.clone(), parts.collect()))
        }
        _ => None,
    }
}

/// A sum without parts that cancel, and with its numbers added up.
fn short_sum(items: Vec<(bool, Term)>) -> Term {
    let mut plain = opened(items.clone(), true, false);
    let mut open = opened(items, true, true);
    // A sum of the source is taken apart only where something cancels.
    let numbers =
        |list: &[(bool, Term)]| list.iter().filter(|(_, t)| matches!(t.head, Head::Number(_))).count();
    let gains = numbers(&open) > numbers(&plain) && numbers_cancel(&open);
    let mut list = if cancel(&mut open) || gains {
        open
    } else {
        cancel(&mut plain);
        // Products of sums cancel only when they are expanded.
        if plain.len() > 1
            && let Some(short) = polynomial::expanded(&sum_of(plain.clone())).into_iter().next()
        {
            return short;
        }
        plain
    };
    if numbers(&list) > 1 {
        let mut total = 0.0;
        list.retain(|(flag, term)| match term.head {
            Head::Number(x) => {
                total += if *flag { -x } else { x };
                false
            }
            _ => true,
        });
        list.push((total < 0.0, Term::number(f64::abs(total))));
    }
    if list.len() > 1 {
        list.retain(|(_, term)| term.head != Head::Number(0.0));
    }
    if list.is_empty() {
        return Term::number(0.0);
    }
    // What is subtracted as a negative is added.
    for (flag, term) in list.iter_mut().filter(|(flag, _)| *flag) {
        if let Some(part) = positive(term) {
            (*flag, *term) = (false, part);
        }
    }
    // A part that is not subtracted comes first.
    list.sort_by_key(|(flag, _)| *flag);
    sum_of(list)
}

/// The sum of these parts, as they are.
fn sum_of(mut list: Vec<(bool, Term)>) -> Term {
    if list.len() == 1
        && let Some((flag, term)) = list.pop()
    {
        return if flag { negative(term) } else { term };
    }
    let (flags, parts) = list.into_iter().unzip();
    Term::new(Head::Sum(flags), parts)
}

/// A product without factors that cancel, and with its numbers multiplied.
fn short_product(items: Vec<(bool, Term)>) -> Term {
    let mut list = opened(items, false, false);
    cancel(&mut list);
    let mut minus = false;
    let mut number = 1.0;
    let mut factors = Vec::new();
    let count = list.iter().filter(|(_, t)| matches!(t.head, Head::Number(_))).count();
    for (divides, term) in list {
        match &term.head {
            Head::Number(x) if !divides && (count > 1 || x.abs() == 1.0 || *x == 0.0) => number *= x,
            Head::Number(x) if *x != 0.0 && (count > 1 || x.abs() == 1.0) => number /= x,
            Head::Number(x) if *x < 0.0 => {
                minus = !minus;
                factors.push((divides, Term::number(-x)));
            }
            Head::Sum(flags) if flags == &[true] => {
                minus = !minus;
                factors.extend(term.parts.first().cloned().map(|part| (divides, part)));
            }
            _ => factors.push((divides, term)),
        }
    }
    if number == 0.0 {
        return Term::number(0.0);
    }
    minus ^= number < 0.0;
    let number = number.abs();
    if number != 1.0 || factors.is_empty() {
        factors.insert(0, (false, Term::number(number)));
    }
    let whole = match &factors[..] {
        [(false, only)] => only.clone(),
        _ => {
            let (flags, parts) = factors.into_iter().unzip();
            Term::new(Head::Product(flags), parts)
        }
    };
    if minus { negative(whole) } else { whole }
}

/// The text of a term, and how tightly it binds.
pub(super) fn show(term: &Term) -> (String, u8) {
    if let Some(text) = &term.text {
        return (text.to_string(), term.binds);
    }
    let part =
        |index: usize, least: u8| term.parts.get(index).map_or_else(String::new, |t| at_least(t, least));
    match &term.head {
        Head::Number(x) => {
            let text = number(*x);
            let own = if text.starts_with('-') { binds::NEGATIVE } else { binds::WHOLE };
            (text, own)
        }
        Head::Leaf(text) => (text.to_string(), term.binds),
        Head::Any(letter) => (letter.to_string(), binds::WHOLE),
        Head::Call(name) => {
            let args: Vec<String> = term.parts.iter().map(|t| at_least(t, binds::LOOSE)).collect();
            (format!("{name}({})", args.join(", ")), binds::WHOLE)
        }
        Head::Compare(op) => {
            let sides = (part(0, binds::SUM), part(1, binds::SUM));
            (format!("{} {} {}", sides.0, compare(*op), sides.1), binds::COMPARE)
        }
        Head::Choose => {
            let parts = [part(0, binds::COMPARE), part(1, binds::SUM), part(2, binds::SUM)];
            (format!("{} ? {} : {}", parts[0], parts[1], parts[2]), binds::LOOSE)
        }
        Head::Group => term.parts.first().map_or_else(|| (String::new(), binds::WHOLE), show),
        Head::Sum(flags) => show_sum(flags, &term.parts),
        Head::Product(flags) => show_product(flags, &term.parts),
    }
}

fn at_least(term: &Term, least: u8) -> String {
    let (text, own) = show(term);
    if own < least { format!("({text})") } else { text }
}

fn show_sum(flags: &[bool], parts: &[Term]) -> (String, u8) {
    let mut text = String::new();
    for (index, (minus, part)) in flags.iter().zip(parts).enumerate() {
        // A negative number after an operator changes the operator.
        let turned = match part.head {
            Head::Number(x) if index > 0 && x < 0.0 && part.text.is_none() => Some(Term::number(-x)),
            _ => None,
        };
        let (minus, part) = (*minus != turned.is_some(), turned.as_ref().unwrap_or(part));
        text += match (index, minus) {
            (0, true) => "-",
            (0, false) => "",
            (_, true) => " - ",
            (_, false) => " + ",
        };
        text += &at_least(part, if index == 0 && !minus { binds::SUM } else { binds::PRODUCT });
    }
    let own = if flags == [true] { binds::NEGATIVE } else { binds::SUM };
    (text, own)
}

fn show_product(flags: &[bool], parts: &[Term]) -> (String, u8) {
    let side = |divides: bool| -> Vec<String> {
        let chosen = flags.iter().zip(parts).filter(|(flag, _)| **flag == divides);
        let factors = chosen.enumerate().map(|(index, (_, part))| {
            at_least(part, if index == 0 && !divides { binds::PRODUCT } else { binds::WHOLE })
        });
        factors.collect()
    };
    let (above, below) = (side(false), side(true));
    let above = if above.is_empty() { "1".to_string() } else { above.join(" * ") };
    let text = match &below[..] {
        [] => above,
        [one] => format!("{above} / {one}"),
        several => format!("{above} / ({})", several.join(" * ")),
    };
    (text, binds::PRODUCT)
}

fn compare(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Lt => "<",
        BinaryOp::Le => "<=",
        BinaryOp::Gt => ">",
        BinaryOp::Ge => ">=",
        BinaryOp::Ne => "!=",
        _ => "==",
    }
}

/// A number as the source has it: whole numbers without a point.
fn number(x: f64) -> String {
    let text = format!("{:?}", x as f32);
    text.strip_suffix(".0").map_or(text.clone(), str::to_string)
}

#[cfg(test)]
mod tests {
    use super::super::matching::find;
    use super::super::term::{parse, parse_grouped};
    use super::*;

    fn rewritten(pattern: &str, write: &str, term: &str) -> String {
        fn named(mut term: Term) -> Term {
            term.parts = term.parts.into_iter().map(named).collect();
            if let Head::Any(letter) = term.head {
                let name = letter.to_string();
                term = Term {
                    text: Some(name.as_str().into()),
                    ..Term::new(Head::Leaf(name.as_str().into()), Vec::new())
                };
            }
            term
        }
        let found = find(&parse(pattern).unwrap(), &named(parse(term).unwrap()));
        let is_sum = matches!(parse(pattern).unwrap().head, Head::Sum(_));
        let filled = filled(&parse_grouped(write).unwrap(), &found[0]).unwrap();
        show(&with_rest(filled, is_sum, &found[0])).0
    }

    #[test]
    fn what_cancels_is_left_out() {
        let conjugate = ("sqrt(a) - sqrt(b)", "(a - b) / (sqrt(a) + sqrt(b))");
        assert_eq!(
            rewritten(conjugate.0, conjugate.1, "sqrt(x + 1) - sqrt(x)"),
            "1 / (sqrt(x + 1) + sqrt(x))"
        );
        assert_eq!(rewritten("a - a", "0", "x + y - x"), "y");
        assert_eq!(
            rewritten("1 / a - 1 / b", "(b - a) / (a * b)", "1 / x - 1 / (x + 1)"),
            "1 / (x * (x + 1))"
        );
    }

    #[test]
    fn the_order_of_additions_is_kept() {
        assert_eq!(rewritten("atan2(x, y)", "x + (1 - (y - 2))", "atan2(p, q)"), "p + (1 - (q - 2))");
        assert_eq!(rewritten("sin(a + b)", "sin(a + wrapped(b))", "sin(p + 7)"), "sin(p + 0.7168147)");
        assert_eq!(rewritten("mod(a + b, c)", "mod(a + mod(b, c), c)", "mod(p + 3000, 1)"), "mod(p, 1)");
    }

    #[test]
    fn a_minus_is_not_written_twice() {
        let quotient = rewritten("exp(a) / exp(b)", "exp(a - b)", "exp(-p * p * q) / exp(-p * p * r)");
        assert_eq!(quotient, "exp(p * p * r - p * p * q)");
        let choice = rewritten(
            "sqrt(a) - b",
            "b > 0 ? (a - b * b) / (sqrt(a) + b) : sqrt(a) - b",
            "p - sqrt(p * p - q * q)",
        );
        assert!(!choice.starts_with('-'), "{choice}");
    }

    #[test]
    fn parentheses_are_where_they_are_needed() {
        assert_eq!(rewritten("a * a - b * b", "(a - b) * (a + b)", "p * p - q * q"), "(p - q) * (p + q)");
        assert_eq!(rewritten("1 - cos(x)", "2 * sin(0.5 * x) * sin(0.5 * x)", "cos(p + q) - 1"), {
            "-2 * sin(0.5 * (p + q)) * sin(0.5 * (p + q))"
        });
    }
}
