//! Candidates for a repair: every place of the source where a rule matches, as edits of the text.

use super::matching::{PatternMatch, find};
use super::polynomial::{self, common_factor};
use super::rules::{Rule, rules};
use super::source::{Site, Source, words};
use super::substitution::is_name;
use super::term::{Head, Term, binds, word};
use super::writing::{filled, show, tidied, with_factors, with_rest};
use osl_ir::types::Type;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;
use std::collections::BTreeSet;

/// A changed text.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// The name of the rewrite.
    pub(super) name: &'static str,
    /// Why it loses fewer digits.
    pub(super) why: &'static str,
    /// The lines whose expressions it replaces.
    pub(super) lines: BTreeSet<u32>,
    /// The line that it changes.
    pub(super) line: u32,
    /// The replaced text.
    pub(super) old: String,
    /// What stands there instead.
    pub(super) new: String,
    /// The whole text after it.
    pub(super) text: String,
}

impl Candidate {
    /// The text with another one for a span, and further edits. It replaces the lines of these spans.
    pub(super) fn new(
        source: &Source<'_>,
        (name, why): (&'static str, &'static str),
        (span, new): (Span, String),
        mut edits: Vec<Edit>,
        spans: impl Iterator<Item = Span>,
    ) -> Option<Candidate> {
        let old = source.reader.text.get(span.start as usize..span.end as usize)?;
        if *old == new {
            return None;
        }
        edits.push(Edit { span, text: new.clone() });
        edits.sort_by_key(|edit| edit.span.start);
        let text = osl_syntax::repair::apply(source.reader.text, &edits)?;
        let (line, lines) = (source.line(span)?, spans.filter_map(|span| source.line(span)).collect());
        Some(Candidate { name, why, lines, line, old: old.to_string(), new, text })
    }
}

/// Variables that are left when all others are opened.
const VARIABLES: usize = 6;
/// How deep variables are opened all together.
pub(super) const DEPTH: usize = 3;

/// The rewrites of a shader that take part in one of these lines.
pub(super) fn candidates(source: &Source<'_>, blamed: &[u32]) -> Vec<Candidate> {
    let mut out: Vec<Candidate> = Vec::new();
    for site in source.sites() {
        let is_real = site.expr.ty == Type::FLOAT || site.expr.ty.is_triple();
        let Some(term) = source.reader.term(site.expr).filter(|_| is_real) else { continue };
        if matches!(term.head, Head::Leaf(_) | Head::Number(_)) {
            continue;
        }
        let known = source.known(&term);
        let mut forms = vec![term.clone()];
        // What several values have in common may be a variable.
        let first = source.opened(&term, None, 1);
        let common = source.known(&first).into_iter().filter(|var| known.contains(var));
        forms.extend(common.take(VARIABLES).map(|var| source.opened(&term, Some(var), DEPTH)));
        if !known.is_empty() || source.calls(&term) {
            forms.extend((1..=DEPTH).map(|depth| source.opened(&term, None, depth)));
        }
        let mut put = |candidate: Option<Candidate>| {
            let new = candidate.filter(|c| !out.iter().any(|other| other.text == c.text));
            out.extend(new);
        };
        let is_blamed = |span: &Span| source.line(*span).is_some_and(|line| blamed.contains(&line));
        for form in &forms {
            let mut takes_part = false;
            form.each(&mut |part| takes_part |= part.covers.iter().any(is_blamed));
            if !takes_part {
                continue;
            }
            put(cancelled(source, &site, form));
            by_polynomial(source, &site, form).into_iter().for_each(|candidate| put(Some(candidate)));
            // A difference of products is matched without their common factors, too.
            let inner = common_factor(form);
            for rule in rules() {
                for found in find(&rule.find, form) {
                    put(rewrite(source, &site, rule, &found));
                }
                if let Some((factors, inner)) = &inner {
                    for found in find(&rule.find, inner) {
                        put(rewrite(
                            source,
                            &site,
                            rule,
                            &PatternMatch { factors: factors.clone(), ..found },
                        ));
                    }
                }
            }
        }
    }
    out
}

/// The expression without terms and factors that cancel.
fn cancelled(source: &Source<'_>, site: &Site<'_>, form: &Term) -> Option<Candidate> {
    let new = placed(source, site, &tidied(form)?)?;
    let covers = form.all_covers();
    let why = "terms or factors cancel, but what is between them rounds everything else away";
    made(source, site, ("terms that cancel", why), &covers, &[], new)
}

/// The expression as a polynomial: without what cancels when products are expanded, or around the centre of
/// its powers.
fn by_polynomial(source: &Source<'_>, site: &Site<'_>, form: &Term) -> Vec<Candidate> {
    let covers = form.all_covers();
    let candidate = |said: (&'static str, &'static str), inserted: &[String], term: &Term| {
        made(source, site, said, &covers, inserted, placed(source, site, term)?)
    };
    let cancels = (
        "products expanded",
        "parts of the products cancel; without them, what is left is rounded by its own size",
    );
    let mut out: Vec<Candidate> =
        polynomial::expanded(form).iter().filter_map(|term| candidate(cancels, &[], term)).collect();
    let name = source.unused("off");
    if site.before.is_some()
        && let Some((term, distance)) = polynomial::around_centre(form, &name)
        && let Some(ty) = word(type_of(&distance))
    {
        let local = format!("{ty} {name} = {};", show(&distance).0);
        let centre = (
            "powers around their centre",
            "large terms of the polynomial nearly cancel; powers of the distance from its roots do not",
        );
        out.extend(candidate(centre, &[local], &term));
    }
    out
}

/// A letter with the local variable that holds it.
struct Local {
    letter: char,
    name: String,
    /// Its type and value.
    value: Term,
    ty: &'static str,
}

fn rewrite(
    source: &Source<'_>,
    site: &Site<'_>,
    rule: &'static Rule,
    found: &PatternMatch,
) -> Option<Candidate> {
    let chooses = contains(&rule.write, &|t| t.head == Head::Choose);
    if chooses && site.expr.ty != Type::FLOAT {
        return None;
    }
    // Letters that occur several times become variables, if they are long; so do values that are computed
    // first. What is used only once after all stands in its place.
    let mut wanted: Vec<char> =
        found.letters.iter().map(|(letter, _)| *letter).filter(|l| is_long(rule, found, *l)).collect();
    wanted.extend(rule.with.iter().map(|(letter, _)| *letter));
    if site.before.is_none() {
        wanted.clear();
    }
    let (mut locals, mut new) = written(source, site, rule, found, &wanted)?;
    let uses = |name: &str, locals: &[Local], new: &str| {
        let texts = locals.iter().map(|l| show(&l.value).0).chain([new.to_string()]);
        texts.map(|text| words(&text).filter(|word| *word == name).count()).sum::<usize>()
    };
    let rare: Vec<char> =
        locals.iter().filter(|l| uses(&l.name, &locals, &new) < 2).map(|l| l.letter).collect();
    if !rare.is_empty() {
        wanted.retain(|letter| !rare.contains(letter));
        (locals, new) = written(source, site, rule, found, &wanted)?;
    }
    let inserted: Vec<String> =
        locals.iter().map(|l| format!("{} {} = {};", l.ty, l.name, show(&l.value).0)).collect();
    made(source, site, (&*rule.name, &*rule.why), &found.covers, &inserted, new)
}

/// The candidate with this text in place of an expression, after these statements.
fn made(
    source: &Source<'_>,
    site: &Site<'_>,
    said: (&'static str, &'static str),
    covers: &[Span],
    inserted: &[String],
    new: String,
) -> Option<Candidate> {
    let edits: Vec<Edit> = insertion(source, site.before, inserted).into_iter().collect();
    let spans = covers.iter().copied().chain([site.expr.span]);
    let mut made = Candidate::new(source, said, (site.expr.span, new), edits, spans)?;
    made.new = inserted.iter().map(|statement| format!("{statement} ")).collect::<String>() + &made.new;
    Some(made)
}

/// The edit that puts statements before the one at a position.
pub(super) fn insertion(source: &Source<'_>, before: Option<usize>, statements: &[String]) -> Option<Edit> {
    let at = before.filter(|_| !statements.is_empty())?;
    let between = if source.is_first(at) { format!("\n{}", source.indent(at)) } else { " ".to_string() };
    let text = statements.iter().map(|s| format!("{s}{between}")).collect();
    Some(Edit { span: Span::new(at as u32, at as u32), text })
}

/// The local variables and the new text, if these letters become variables.
fn written(
    source: &Source<'_>,
    site: &Site<'_>,
    rule: &'static Rule,
    found: &PatternMatch,
    wanted: &[char],
) -> Option<(Vec<Local>, String)> {
    let mut found = found.clone();
    let mut locals: Vec<Local> = Vec::new();
    let put = |letter: char, term: Term, locals: &mut Vec<Local>| -> Option<Term> {
        if !wanted.contains(&letter) || is_word(&term) || matches!(term.head, Head::Number(_)) {
            return Some(term);
        }
        if !term.is_pure {
            return None;
        }
        let taken: Vec<&str> = locals.iter().map(|local| &*local.name).collect();
        let name = source.unused_but(name_of(&term), &taken);
        // The variable keeps the form of its value, so that it still cancels.
        let local = Term { text: Some(name.as_str().into()), binds: binds::WHOLE, var: None, ..term.clone() };
        locals.push(Local { letter, name, ty: word(type_of(&term))?, value: term });
        Some(local)
    };
    for (letter, term) in std::mem::take(&mut found.letters) {
        let term = put(letter, term, &mut locals)?;
        found.letters.push((letter, term));
    }
    for (letter, term) in &rule.with {
        let term = put(*letter, filled(term, &found)?, &mut locals)?;
        // What is computed first is rounded there, so it does not cancel with its parts.
        let term = match term.head {
            Head::Number(_) => term,
            _ => {
                let (text, own) = show(&term);
                Term {
                    text: Some(text.as_str().into()),
                    binds: own,
                    head: Head::Leaf(text.into()),
                    parts: Vec::new(),
                    ..term
                }
            }
        };
        found.letters.push((*letter, term));
    }
    let several = |letter: char| {
        count(&rule.write, letter) + rule.with.iter().map(|(_, t)| count(t, letter)).sum::<usize>() > 1
    };
    if found.letters.iter().any(|(letter, term)| !term.is_pure && several(*letter)) {
        return None;
    }
    let is_sum = matches!(rule.find.head, Head::Sum(_));
    let term = filled(&rule.write, &found)?;
    let is_list = matches!(rule.find.head, Head::Sum(_) | Head::Product(_));
    let term = if is_list { with_rest(term, is_sum, &found) } else { term };
    let term = with_factors(term, &found);
    Some((locals, placed(source, site, &term)?))
}

/// The text of a term in the place of an expression, with parentheses where it needs them.
pub(super) fn placed(source: &Source<'_>, site: &Site<'_>, term: &Term) -> Option<String> {
    let (text, own) = show(term);
    let written = |span: Span| source.reader.text.get(span.start as usize..span.end as usize);
    if let Some(target) = site.target {
        return Some(format!("{} = {text}", written(target)?));
    }
    let (inner, least) = source.reader.source(site.expr)?;
    let in_parentheses = written(site.expr.span)?.starts_with('(') && !inner.starts_with('(');
    let needs = !site.is_whole && own < binds::WHOLE && (in_parentheses || own < least);
    Some(if needs { format!("({text})") } else { text })
}

/// The name of a variable for a value.
fn name_of(term: &Term) -> &'static str {
    match (&term.head, &term.parts[..]) {
        (Head::Product(flags), [a, b]) if flags == &[false, false] && a.same(b) => "square",
        (Head::Call(name), _) if &**name == "sin" => "sine",
        (Head::Call(name), _) if &**name == "cos" => "cosine",
        _ => "part",
    }
}

/// Whether a letter occurs several times and its text is longer than a name.
fn is_long(rule: &'static Rule, found: &PatternMatch, letter: char) -> bool {
    let in_with = rule.with.iter().map(|(_, t)| count(t, letter)).sum::<usize>();
    let Some(term) = found.get(letter) else { return false };
    count(&rule.write, letter) + in_with > 1 && !is_word(term) && !matches!(term.head, Head::Number(_))
}

/// Whether the text of a term is a name or a part of a variable.
fn is_word(term: &Term) -> bool {
    let (text, own) = show(term);
    own == binds::WHOLE && is_name(&text)
}

fn count(term: &Term, letter: char) -> usize {
    let mut n = 0;
    term.each(&mut |t| n += usize::from(t.head == Head::Any(letter)));
    n
}

fn contains(term: &Term, test: &dyn Fn(&Term) -> bool) -> bool {
    let mut found = false;
    term.each(&mut |t| found |= test(t));
    found
}

/// The type of a term: a triple if it has one among its parts, else a float.
fn type_of(term: &Term) -> Type {
    if let Some(ty) = term.ty.filter(|ty| ty.is_triple()) {
        return ty;
    }
    if let Head::Call(name) = &term.head
        && ["dot", "length", "distance", "hypot", "luminance"].contains(&&**name)
    {
        return Type::FLOAT;
    }
    if term.text.is_some() && term.ty == Some(Type::FLOAT) {
        return Type::FLOAT;
    }
    term.parts.iter().map(type_of).find(|ty| ty.is_triple()).unwrap_or(Type::FLOAT)
}
