//! Reasons: what an explanation says about the compiler, checked by runs of changed sources and at all
//! points.
//!
//! A value that is "not needed" may be any value: changing it leaves all outputs. What is "known when the
//! shader is compiled", or "always" so, is so at every point, in the same call and in the same rounds of
//! loops.
//! Calls are numbered by point, so they are compared only with points that make the same calls; changes are
//! made in the shader itself.

use super::case::{Case, FILE};
use super::compare::{Key, Seen, bare, base, is_value, numbers};
use osl_exec::Frame;
use osl_measure::explain::{Compiled, Explanation, Line, Shown, State, What};
use std::collections::{BTreeMap, BTreeSet};

/// Checks all reasons; returns how many were checked.
pub(super) fn hold(case: &Case, told: &[(usize, Explanation)]) -> Result<usize, String> {
    let seen: Vec<Seen> = Case::points().map(|point| case.seen(point)).collect();
    let mut checked = unneeded(case, told, &seen)?;
    for (point, explanation) in told {
        let numbers = numbers(explanation, &case.written);
        for line in explanation.lines.iter().filter(|line| line.file == FILE) {
            checked += known(case, line, (&seen, *point), &numbers)?;
            checked += skipped(line, &seen)? + same(explanation, line)?;
        }
    }
    Ok(checked)
}

/// The values of an assignment that are told as not needed.
#[derive(Debug)]
enum Needless {
    /// In every round.
    Always,
    /// In these rounds of the loops around it, and whether no explanation tells otherwise.
    Rounds(BTreeMap<Vec<i32>, bool>),
    /// In none.
    Never,
}

/// The rounds in which a value of the shader itself is not needed; `before` is what other points tell.
fn rounds_of(fact: &What, rounds: Option<&Vec<Option<Vec<i32>>>>, before: Option<Needless>) -> Needless {
    let What::Set { values, compiled, each, .. } = fact else { return Needless::Never };
    let status = |at: usize| each.get(at).unwrap_or(compiled);
    if *compiled == Compiled::NotNeeded && matches!(before, None | Some(Needless::Always)) {
        return Needless::Always;
    }
    let mut all = match before {
        None => BTreeMap::new(),
        Some(Needless::Rounds(all)) => all,
        _ => return Needless::Never,
    };
    let Some(rounds) = rounds.filter(|rounds| rounds.len() == values.len()) else { return Needless::Never };
    for (at, rounds) in rounds.iter().enumerate() {
        let Some(rounds) = rounds.clone().filter(|rounds| !rounds.is_empty()) else { return Needless::Never };
        *all.entry(rounds).or_insert(true) &= *status(at) == Compiled::NotNeeded;
    }
    Needless::Rounds(all)
}

/// Changes all values that are told as not needed, at once.
fn unneeded(case: &Case, told: &[(usize, Explanation)], seen: &[Seen]) -> Result<usize, String> {
    let mut needless: BTreeMap<(u32, String), Needless> = BTreeMap::new();
    for (point, explanation) in told {
        for line in explanation.lines.iter().filter(|line| line.file == FILE) {
            for fact in line.facts.iter().filter(|fact| fact.call == 0) {
                let What::Set { name, .. } = &fact.what else { continue };
                let of = (line.number, base(name));
                let key = (0, line.number, name.clone());
                let rounds = seen.get(*point).and_then(|seen| seen.in_rounds.get(&key));
                let now = rounds_of(&fact.what, rounds, needless.remove(&of));
                needless.insert(of, now);
            }
        }
    }
    let mut edits: Vec<(usize, String)> = Vec::new();
    let mut changed = BTreeSet::new();
    for set in &case.written.sets {
        let of = (set.line, set.name.clone());
        if case.written.open.contains(&of) {
            continue;
        }
        match needless.get(&of) {
            Some(Needless::Always) => edits.push((set.end, set.change.clone())),
            Some(Needless::Rounds(rounds)) => {
                let rounds =
                    rounds.iter().filter(|(rounds, always)| **always && rounds.len() == set.loops.len());
                let before = edits.len();
                for (rounds, _) in rounds {
                    let test = |(id, n): (&usize, &i32)| format!("l{id}_ == {n}");
                    let tests: Vec<String> = set.loops.iter().zip(rounds).map(test).collect();
                    edits.push((set.end, format!(" if ({}) {{{} }}", tests.join(" && "), set.change)));
                }
                if edits.len() == before {
                    continue;
                }
            }
            _ => continue,
        }
        changed.insert(of);
    }
    if edits.is_empty() {
        return Ok(0);
    }
    let mut by_place: Vec<(usize, usize, String)> =
        edits.into_iter().map(|(at, text)| (at, 1, text)).collect();
    for (id, [(start, end), (inner, inner_end)]) in case.written.spans.iter().enumerate() {
        by_place.push((*start, 2, format!("{{ int l{id}_ = 0; ")));
        by_place.push((*inner, 3, format!("{{ l{id}_ += 1; ")));
        by_place.push((*inner_end, 0, " }".to_string()));
        by_place.push((*end, 0, " }".to_string()));
    }
    by_place.sort_by_key(|(at, order, _)| (*at, *order));
    let mut text = case.text.clone();
    by_place.iter().rev().for_each(|(at, _, new)| text.insert_str(*at, new));
    let (Some(before), Some(after)) = (case.run(&case.text), case.run(&text)) else { return Ok(0) };
    match planes(&before) == planes(&after) {
        true => Ok(changed.len()),
        false => Err(format!("one of these is needed: {changed:?}\n--- changed\n{text}")),
    }
}

/// The words of all outputs; all NaN are equal.
fn planes(frame: &Frame) -> Vec<Vec<u32>> {
    let word = |x: &f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
    let is_text =
        |plane: &&osl_exec::Plane| matches!(plane.kind, osl_ir::ir::Kind::Str | osl_ir::ir::Kind::Closure);
    let shown = frame.planes.iter().filter(|plane| !is_text(plane));
    shown.map(|plane| plane.floats().iter().map(word).collect()).collect()
}

/// Values and conditions that are told as known when the shader is compiled are so at all points.
fn known(
    case: &Case,
    line: &Line,
    (seen, point): (&[Seen], usize),
    numbers: &[Option<usize>],
) -> Result<usize, String> {
    let mut checked = 0;
    let Some(own) = seen.get(point) else { return Ok(0) };
    for fact in &line.facts {
        let Some(call) = numbers.get(fact.call).copied().flatten() else { continue };
        let others = || seen.iter().filter(|other| call == 0 || other.entered == own.entered);
        match &fact.what {
            What::Set { name, values, compiled, each, .. } => {
                let key: Key = (call, line.number, name.clone());
                // Of several statements on a line, each may have a known value of its own.
                let is_one = line.text.matches(';').count() <= 1;
                if !is_one || case.written.open.contains(&(line.number, base(name))) {
                    continue;
                }
                let rounds = own.in_rounds.get(&key).filter(|rounds| rounds.len() == values.len());
                for (at, value) in values.iter().enumerate() {
                    if *each.get(at).unwrap_or(compiled) != Compiled::Constant {
                        continue;
                    }
                    let rounds = rounds.and_then(|rounds| rounds.get(at)?.as_ref());
                    for other in others() {
                        let (Some(printed), Some(there)) = (other.sets.get(&key), other.in_rounds.get(&key))
                        else {
                            continue;
                        };
                        for (printed, there) in printed.iter().zip(there) {
                            // Without rounds, any of the values may be the one.
                            let is_it = match rounds {
                                Some(_) if there.as_ref() != rounds => continue,
                                Some(rounds) if !rounds.is_empty() => is_value(printed, value),
                                _ => values.iter().any(|value| is_value(printed, value)),
                            };
                            if !is_it {
                                return Err(format!(
                                    "{key:?} in {rounds:?} is told as known, {}, and is also {printed}",
                                    value.value()
                                ));
                            }
                            checked += 1;
                        }
                    }
                }
            }
            What::Branch { condition, taken, known: true, .. } => {
                let key = (call, line.number, bare(condition));
                let Some(rounds) = own.branch_rounds.get(&key).filter(|own| own.len() == taken.len()) else {
                    continue;
                };
                for other in others() {
                    let there = (other.branches.get(&key), other.branch_rounds.get(&key));
                    let (Some(truths), Some(there)) = there else { continue };
                    for (truth, there) in truths.iter().zip(there) {
                        // An outcome belongs to the rounds in which it was found.
                        let mut same =
                            rounds.iter().zip(taken).filter(|(own, _)| own.is_some() && *own == there);
                        let Some((_, first)) = same.next() else { continue };
                        if first != truth && same.all(|(_, own)| own != truth) {
                            return Err(format!(
                                "{key:?} in {there:?} is told as known, and is also {truth}"
                            ));
                        }
                        checked += 1;
                    }
                }
            }
            _ => {}
        }
    }
    Ok(checked)
}

/// The condition for which a line never runs has that truth at all points.
fn skipped(line: &Line, seen: &[Seen]) -> Result<usize, String> {
    let Some(why) = line.why.as_ref().filter(|_| line.state == State::Skipped) else { return Ok(0) };
    let Some((condition, rest)) = why.strip_prefix('`').and_then(|why| why.rsplit_once("` (line ")) else {
        return Ok(0);
    };
    let Some((number, truth)) = rest.split_once(") is always ") else { return Ok(0) };
    let (Ok(number), Ok(truth)) = (number.parse::<u32>(), truth.parse::<bool>()) else { return Ok(0) };
    let condition = bare(condition);
    for seen in seen {
        let of =
            |(call, line, text): &(usize, u32, String)| (*call, *line) == (0, number) && *text == condition;
        let outcomes = seen.branches.iter().filter(|(key, _)| of(key)).flat_map(|(_, outcomes)| outcomes);
        for outcome in outcomes {
            if *outcome != truth {
                return Err(format!("`{condition}`, line {number}, is told as always {truth}"));
            }
        }
        let ran = seen.sets.keys().find(|(_, at, _)| *at == line.number);
        if let Some(ran) = ran {
            return Err(format!("{ran:?} is told as never set"));
        }
    }
    Ok(1)
}

/// Where two lines that assign the same expression are told to compute the same, their values are equal.
fn same(explanation: &Explanation, line: &Line) -> Result<usize, String> {
    let right = |line: &Line| Some(line.text.split_once(" = ")?.1.trim_end_matches(';').to_string());
    let single = |line: &Line| -> Option<Shown> {
        let mut sets = line.facts.iter().filter_map(|fact| match &fact.what {
            What::Set { values, .. } if fact.call == 0 => Some(values.clone()),
            _ => None,
        });
        match (sets.next(), sets.next()) {
            (Some(values), None) => match &values[..] {
                [one] => Some(one.clone()),
                _ => None,
            },
            _ => None,
        }
    };
    let mut checked = 0;
    for fact in &line.facts {
        let What::Set { compiled: Compiled::SameAsLine(number), .. } = &fact.what else { continue };
        let found = explanation.lines.iter().find(|other| other.number == *number && other.file == FILE);
        let Some(other) = found else { return Err(format!("line {number} is not told")) };
        if other.state == State::Skipped {
            return Err(format!(
                "line {number} does not run, and is told to compute what line {} does",
                line.number
            ));
        }
        if right(line).is_none() || right(line) != right(other) {
            continue;
        }
        if let (Some(a), Some(b)) = (single(line), single(other)) {
            if a.single() != b.single() && a.value() != b.value() {
                return Err(format!(
                    "lines {} and {number} compute {} and {}",
                    line.number,
                    a.value(),
                    b.value()
                ));
            }
            checked += 1;
        }
    }
    Ok(checked)
}
