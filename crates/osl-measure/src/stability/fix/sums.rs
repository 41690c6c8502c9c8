//! Rewrites of sums that a loop adds up: a multiple of the step where the step never changes, a compensated
//! sum otherwise (W. Kahan, 1965), and a variance by the squares of the differences from the mean so far
//! (B. P. Welford, 1962) instead of the sum of squares.

use super::candidates::{Candidate, DEPTH, insertion, placed};
use super::matching::{PatternMatch, find};
use super::source::{Site, Source};
use super::term::{Head, Term, binds, parse, product, word};
use super::writing::{show, with_factors, with_rest};
use osl_hir::hir::{Expr, ExprKind, Init, Lvalue, Stmt, StmtKind, VarId};
use osl_hir::lint::bodies;
use osl_ir::types::Type;
use osl_syntax::ast::BinaryOp;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// A loop around a statement.
#[derive(Clone, Copy)]
pub(super) struct Round<'p> {
    pub(super) stmt: &'p Stmt,
    /// The int that counts its rounds up by one from a literal.
    counter: Option<(VarId, i32)>,
}

/// `sum += step` in a loop.
pub(super) struct Adding<'p> {
    pub(super) stmt: &'p Stmt,
    pub(super) place: &'p Lvalue,
    pub(super) step: &'p Expr,
    pub(super) is_subtracted: bool,
    /// The loops around it, the outermost first.
    pub(super) rounds: Vec<Round<'p>>,
    /// Whether it runs once in every round of the innermost loop.
    pub(super) in_every_round: bool,
}

/// All rewrites of sums in loops.
pub(super) fn candidates(source: &Source<'_>) -> Vec<Candidate> {
    let mut out = Vec::new();
    for adding in &additions(source) {
        out.extend(multiple(source, adding));
        out.extend(compensated(source, adding));
    }
    out.extend(variances(source));
    out
}

/// All additions in loops.
pub(super) fn additions<'p>(source: &Source<'p>) -> Vec<Adding<'p>> {
    let mut found = Vec::new();
    for body in bodies(source.program) {
        list(source, body, &[], true, &mut found);
    }
    found
}

/// The outermost loop in which a sum goes on.
pub(super) fn outermost<'a, 'p>(source: &Source<'p>, adding: &'a Adding<'p>) -> Option<&'a Round<'p>> {
    let declared = source.program.vars.get(adding.place.var.0 as usize)?.span;
    let holds = |stmt: &Stmt| stmt.span.start <= declared.start && declared.end <= stmt.span.end;
    adding.rounds.iter().find(|round| !holds(round.stmt))
}

/// Collects the additions in a list of statements.
fn list<'p>(
    source: &Source<'p>,
    stmts: &'p [Stmt],
    rounds: &[Round<'p>],
    always: bool,
    out: &mut Vec<Adding<'p>>,
) {
    // A round may end before what follows a `continue`.
    let mut always = always;
    for (index, stmt) in stmts.iter().enumerate() {
        match &stmt.kind {
            StmtKind::Expr(e) => {
                if let Some((place, step, is_subtracted)) = addition(e)
                    && !rounds.is_empty()
                {
                    let rounds = rounds.to_vec();
                    out.push(Adding { stmt, place, step, is_subtracted, rounds, in_every_round: always });
                }
            }
            StmtKind::Block(inner) => list(source, inner, rounds, always, out),
            StmtKind::If(_, then, otherwise) => {
                list(source, then, rounds, false, out);
                list(source, otherwise, rounds, false, out);
            }
            StmtKind::Loop { iter, body, .. } => {
                let counter = iter.as_ref().and_then(|iter| counter(source, iter, &stmts[..index]));
                let inner: Vec<Round<'p>> = rounds.iter().copied().chain([Round { stmt, counter }]).collect();
                list(source, body, &inner, true, out);
            }
            _ => {}
        }
        always &= !may_skip(stmt);
    }
}

/// Whether a statement may end a round of the loop around it early.
fn may_skip(stmt: &Stmt) -> bool {
    match &stmt.kind {
        StmtKind::Continue => true,
        StmtKind::Block(inner) => inner.iter().any(may_skip),
        StmtKind::If(_, then, otherwise) => then.iter().chain(otherwise).any(may_skip),
        _ => false,
    }
}

/// The target and the step of `sum += step`, `sum = sum + step` and the same with a minus.
fn addition(e: &Expr) -> Option<(&Lvalue, &Expr, bool)> {
    let ExprKind::Assign(place, value) = &e.kind else { return None };
    let Init::Value(value) = &**value else { return None };
    let ExprKind::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), left, right) = &value.kind else {
        return None;
    };
    let is_sum =
        |e: &Expr| matches!(&e.kind, ExprKind::Read(read) if read.var == place.var && read.path.is_empty());
    let is_plain = place.path.is_empty() && (place.ty == Type::FLOAT || place.ty.is_triple());
    if !is_plain {
        None
    } else if is_sum(left) && !reads(right, place.var) {
        Some((place, right, *op == BinaryOp::Sub))
    } else if is_sum(right) && *op == BinaryOp::Add && !reads(left, place.var) {
        Some((place, left, false))
    } else {
        None
    }
}

fn reads(e: &Expr, var: VarId) -> bool {
    matches!(&e.kind, ExprKind::Read(place) if place.var == var)
        || e.parts().into_iter().any(|part| reads(part, var))
}

/// The int that a loop counts up by one, with its first value, a literal.
fn counter(source: &Source<'_>, iter: &Expr, before: &[Stmt]) -> Option<(VarId, i32)> {
    let var = match &iter.kind {
        ExprKind::Step { increment: true, place, .. } if place.path.is_empty() => place.var,
        ExprKind::Assign(place, _) if matches!(addition_of_one(iter), Some(true)) => place.var,
        _ => return None,
    };
    let is_int = source.program.vars.get(var.0 as usize).is_some_and(|v| v.ty == Type::INT);
    let mut first = None;
    let mut own_writes = 0;
    for stmt in before {
        match &stmt.kind {
            StmtKind::Declare(id, Some(Init::Value(value))) if *id == var => first = literal(value),
            StmtKind::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) if place.var == var => {
                first = match &**value {
                    Init::Value(value) => literal(value),
                    Init::List(_) => None,
                };
                own_writes += 1;
            }
            _ => {}
        }
    }
    // Nothing but the loop itself counts.
    let is_alone = source.writes(var).count() == own_writes + 1;
    first.filter(|_| is_int && is_alone).map(|first| (var, first))
}

/// Whether an assignment adds the int 1 to its target.
fn addition_of_one(e: &Expr) -> Option<bool> {
    let ExprKind::Assign(place, value) = &e.kind else { return None };
    let Init::Value(value) = &**value else { return None };
    let ExprKind::Binary(BinaryOp::Add, left, right) = &value.kind else { return None };
    let is_own = matches!(&left.kind, ExprKind::Read(read) if read.var == place.var);
    Some(is_own && literal(right) == Some(1))
}

/// Whether an expression is the number 0.
pub(super) fn is_zero(e: &Expr) -> bool {
    matches!(e.kind, ExprKind::Int(0)) || matches!(e.kind, ExprKind::Float(x) if x == 0.0)
}

fn literal(e: &Expr) -> Option<i32> {
    match &e.kind {
        ExprKind::Int(n) => Some(*n),
        _ => None,
    }
}

/// `start + count * step` instead of `start + step + step + …`.
fn multiple(source: &Source<'_>, adding: &Adding<'_>) -> Option<Candidate> {
    let round = adding.rounds.last()?;
    let (counter, first) = round.counter?;
    let var = adding.place.var;
    let start = source.value(var)?;
    // The sum begins anew whenever the loop begins: its declaration is outside of this loop, and inside of
    // all others.
    let holds = |stmt: &Stmt| stmt.span.start <= start.span.start && start.span.end <= stmt.span.end;
    let outer = adding.rounds.len() - 1;
    let begins_anew = adding.rounds.iter().take(outer).all(|round| holds(round.stmt)) && !holds(round.stmt);
    let is_alone = source.writes(var).count() == 1;
    let at = adding.stmt.span;
    if !(adding.in_every_round && begins_anew && is_alone && source.lasts(start, at)) {
        return None;
    }
    // The step is the same in all rounds.
    let body = Span::new(round.stmt.span.start, round.stmt.span.start);
    let lasting = |e: &Expr| {
        let term = source.reader.term(e)?;
        let mut fits = term.is_pure;
        e.each(&mut |part| {
            let ExprKind::Read(Lvalue { var, .. }) = part.kind else { return };
            fits &= source.writes(var).all(|w| w.end <= body.start || w.start >= round.stmt.span.end);
            let declared = source.program.vars.get(var.0 as usize).map(|v| v.span);
            fits &=
                declared.is_some_and(|d| d.end <= round.stmt.span.start || d.start >= round.stmt.span.end);
        });
        fits.then_some(term)
    };
    let step = lasting(adding.step)?;
    let (start_text, start_binds) = source.reader.source(start)?;
    let (step_text, step_binds) = show(&step);
    let name = &source.program.vars.get(counter.0 as usize)?.name;
    let count = match 1 - first {
        0 => name.to_string(),
        n if n > 0 => format!("({name} + {n})"),
        n => format!("({name} - {})", -n),
    };
    let step_text = if step_binds < binds::WHOLE { format!("({step_text})") } else { step_text };
    let product = format!("{count} * {step_text}");
    let start_text = if start_binds < binds::SUM { format!("({start_text})") } else { start_text };
    let value = match (is_zero(start), adding.is_subtracted) {
        (true, false) => product,
        (true, true) => format!("-{product}"),
        (false, false) => format!("{start_text} + {product}"),
        (false, true) => format!("{start_text} - {product}"),
    };
    let target = &source.program.vars.get(var.0 as usize)?.name;
    let why =
        "each addition of the step rounds, and the roundings add up; a multiple of the step rounds once";
    replaced(source, adding, ("multiple of the step", why), format!("{target} = {value}"), None)
}

/// A sum that carries the rounding of each addition to the next one (W. Kahan, 1965).
fn compensated(source: &Source<'_>, adding: &Adding<'_>) -> Option<Candidate> {
    let var = adding.place.var;
    let ty = word(adding.place.ty)?;
    let declared = source.program.vars.get(var.0 as usize)?;
    let before = source.start(outermost(source, adding)?.stmt)?;
    // The statement itself must stand in braces, since it becomes several.
    let own = source.start(adding.stmt);
    let term = source.reader.term(adding.step)?;
    let (step, step_binds) = show(&term);
    let step = match (adding.is_subtracted, step_binds < binds::PRODUCT) {
        (true, true) => format!("-({step})"),
        (true, false) => format!("-{step}"),
        (false, _) => step,
    };
    let lost = source.unused("lost");
    let add = source.unused("addend");
    let next = source.unused("next");
    let sum = &declared.name;
    let statements = [
        format!("{ty} {add} = {step} - {lost};"),
        format!("{ty} {next} = {sum} + {add};"),
        format!("{lost} = ({next} - {sum}) - {add};"),
        format!("{sum} = {next}"),
    ];
    let indent = source.indent(adding.stmt.span.start as usize);
    let breaks = if source.is_first(adding.stmt.span.start as usize) {
        format!("\n{indent}")
    } else {
        " ".to_string()
    };
    let text =
        if own.is_some() { statements.join(&breaks) } else { format!("{{ {}; }}", statements.join(" ")) };
    let zero = format!("{ty} {lost} = 0;");
    let why =
        "each addition rounds, and the roundings add up; a compensated sum carries them to the next addition";
    let first = insertion(source, Some(before), &[zero])?;
    replaced(source, adding, ("compensated sum", why), text, Some(first))
}

/// The text with another statement for the addition.
fn replaced(
    source: &Source<'_>,
    adding: &Adding<'_>,
    said: (&'static str, &'static str),
    new: String,
    first: Option<Edit>,
) -> Option<Candidate> {
    let StmtKind::Expr(e) = &adding.stmt.kind else { return None };
    // A block needs no semicolon.
    let mut span = e.span;
    if new.ends_with('}') {
        let after = source.reader.text.get(span.end as usize..)?;
        let at = after
            .find(|c: char| !c.is_whitespace())
            .filter(|at| after.get(*at..).is_some_and(|t| t.starts_with(';')))?;
        span.end += at as u32 + 1;
    }
    Candidate::new(source, said, (span, new), first.into_iter().collect(), std::iter::once(e.span))
}

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
fn variances(source: &Source<'_>) -> Vec<Candidate> {
    let all = additions(source);
    let mut out: Vec<Candidate> = Vec::new();
    for values in &all {
        for squares in &all {
            let Some(sums) = pair(source, values, squares) else { continue };
            for site in source.sites() {
                let is_real = site.expr.ty == Type::FLOAT || site.expr.ty.is_triple();
                let Some(term) = source.reader.term(site.expr).filter(|_| is_real) else { continue };
                let forms = (0..=DEPTH).map(|depth| source.opened(&term, None, depth));
                let found = forms.flat_map(|form| matches(source, &sums, &form)).next();
                out.extend(found.and_then(|(found, divides)| welford(source, &sums, &site, &found, divides)));
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

fn welford(
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
    let edits =
        vec![insertion(source, Some(before), &first)?, Edit { span: adding.span, text: own.join(&between) }];
    let why = "two large numbers nearly cancel; the squares of the differences from the mean so far do not";
    let spans = found.covers.iter().copied().chain([site.expr.span, adding.span]);
    Candidate::new(source, ("squares of differences", why), (site.expr.span, new), edits, spans)
}
