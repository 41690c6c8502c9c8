//! The variance of values that a loop adds up, as the mean of squares minus the square of the mean: instead,
//! the loop adds up the squares of the differences from the mean so far (B. P. Welford, 1962).
//!
//! This module must not know whether a rewrite helps.

use super::candidates::{Candidate, DEPTH, insertion, placed};
use super::loops::{Adding, additions, is_zero, outermost};
use super::matching::{PatternMatch, find};
use super::source::{Site, Source};
use super::substitution::Opening;
use super::term::{Head, Term, parse, product, word};
use super::writing::{show, with_factors, with_rest};
use osl_hir::hir::{StmtKind, VarId};
use osl_ir::types::Type;
use osl_syntax::diagnostic::Edit;
use std::collections::BTreeSet;

/// The variance times the number of values, or the variance itself, with the sum of the squares `q`, the sum
/// `s`, and the number `n`; and whether the squares of the differences have to be divided by `n`.
const FORMS: [(&str, bool); 2] = [("q / n - s * s / (n * n)", true), ("q - s * s / n", false)];

/// The sum of some values and the sum of their squares.
struct Sums<'l, 'p> {
    values: &'l Adding<'p>,
    squares: &'l Adding<'p>,
    value: Term,
}

/// All rewrites of variances.
pub(super) fn candidates(source: &Source<'_>) -> Vec<Candidate> {
    let all = additions(source);
    let mut out: Vec<Candidate> = Vec::new();
    for values in &all {
        for squares in &all {
            let Some(sums) = pair(source, values, squares) else { continue };
            for site in source.sites() {
                let is_real = site.expr.ty == Type::FLOAT || site.expr.ty.is_triple();
                let Some(term) = source.reader.term(site.expr).filter(|_| is_real) else { continue };
                let forms = (0..=DEPTH).map(|depth| source.opened(&term, Opening::All, depth));
                let found = forms.flat_map(|form| matches(source, &sums, &form)).next();
                out.extend(found.and_then(|(found, divides)| rewrite(source, &sums, &site, &found, divides)));
            }
        }
    }
    out
}

/// The sums, if the one adds the squares of what the other adds, in the same rounds and from 0 on.
fn pair<'l, 'p>(
    source: &Source<'p>,
    values: &'l Adding<'p>,
    squares: &'l Adding<'p>,
) -> Option<Sums<'l, 'p>> {
    let is_plain = |adding: &Adding<'_>| {
        let var = adding.place.var;
        let starts_at_zero = source.value(var).is_some_and(is_zero);
        adding.in_every_round && !adding.is_subtracted && starts_at_zero && source.writes(var).count() == 1
    };
    let same_rounds = values.rounds.last()?.stmt.span == squares.rounds.last()?.stmt.span
        && outermost(source, values)?.stmt.span == outermost(source, squares)?.stmt.span;
    let (value, square) = (source.reader.term(values.step)?, source.reader.term(squares.step)?);
    let is_square = square.same(&product(vec![(false, value.clone()), (false, value.clone())]));
    let fits = is_plain(values) && is_plain(squares) && same_rounds && is_square && value.is_pure;
    fits.then_some(Sums { values, squares, value })
}

/// How a form of a variance matches a term, and whether it is divided by the number of values.
fn matches(source: &Source<'_>, sums: &Sums<'_, '_>, term: &Term) -> Vec<(PatternMatch, bool)> {
    let is = |found: &PatternMatch, letter: char, var: VarId| {
        let name = source.program.vars.get(var.0 as usize).map(|v| v.name.to_string());
        let head = found.get(letter).map(|term| &term.head);
        matches!((head, name), (Some(Head::Leaf(text)), Some(name)) if **text == *name)
    };
    let of_form = |(form, divides): &(&str, bool)| {
        let found = parse(form).map_or_else(Vec::new, |form| find(&form, term));
        let (q, s) = (sums.squares.place.var, sums.values.place.var);
        let fitting = found.into_iter().filter(|found| is(found, 'q', q) && is(found, 's', s));
        fitting.map(|found| (found, *divides)).collect::<Vec<_>>()
    };
    FORMS.iter().flat_map(of_form).collect()
}

fn rewrite(
    source: &Source<'_>,
    sums: &Sums<'_, '_>,
    site: &Site<'_>,
    found: &PatternMatch,
    divides: bool,
) -> Option<Candidate> {
    let squares = sums.squares;
    let StmtKind::Expr(adding) = &squares.stmt.kind else { return None };
    // The addition becomes several statements, so that it must stand in braces.
    source.start(squares.stmt)?;
    let before = source.start(outermost(source, squares)?.stmt)?;
    let ty = word(squares.place.ty)?;
    let names = ["count", "average", "apart", "spread"].map(|name| source.unused(name));
    let [count, average, apart, spread] = &names;
    let value = show(&sums.value).0;
    let first =
        [format!("float {count} = 0;"), format!("{ty} {average} = 0;"), format!("{ty} {spread} = 0;")];
    let own = [
        format!("{count} += 1;"),
        format!("{ty} {apart} = {value} - {average};"),
        format!("{average} += {apart} / {count};"),
        format!("{spread} += {apart} * ({value} - {average})"),
    ];
    let indent = source.indent(squares.stmt.span.start as usize);
    let is_first = source.is_first(squares.stmt.span.start as usize);
    let between = if is_first { format!("\n{indent}") } else { " ".to_string() };
    let leaf =
        |name: &str| Term { text: Some(name.into()), ..Term::new(Head::Leaf(name.into()), Vec::new()) };
    let term = match divides {
        true => product(vec![(false, leaf(spread)), (true, found.get('n')?.clone())]),
        false => leaf(spread),
    };
    let term = with_factors(with_rest(term, true, found), found);
    let new = placed(source, site, &term)?;
    let text = source.reader.text;
    let old = text.get(site.expr.span.start as usize..site.expr.span.end as usize)?;
    let line = source.line(site.expr.span)?;
    let mut lines: BTreeSet<u32> = found.covers.iter().filter_map(|span| source.line(*span)).collect();
    lines.extend([Some(line), source.line(adding.span)].into_iter().flatten());
    let mut edits = vec![
        insertion(source, Some(before), &first)?,
        Edit { span: adding.span, text: own.join(&between) },
        Edit { span: site.expr.span, text: new.clone() },
    ];
    edits.sort_by_key(|edit| edit.span.start);
    let changed = osl_syntax::repair::apply(text, &edits)?;
    let why = "two large numbers nearly cancel; the squares of the differences from the mean so far do not";
    let name = "squares of differences";
    Some(Candidate { name, why, lines, line, old: old.to_string(), new, text: changed })
}
