//! Reasons: what an explanation says about the compiler, checked by runs of changed sources and at all
//! points.
//!
//! A value that is "not needed" may be any value: changing it leaves all outputs. What is "known when the
//! shader is compiled", or "always" so, is so at every point. Only assignments and conditions of the shader
//! itself are checked, since calls are numbered by point.

use super::case::{Case, FILE};
use super::compare::{Seen, bare, base, is_value};
use osl_exec::Frame;
use osl_measure::explain::{Compiled, Explanation, Line, Shown, State, What};
use std::collections::{BTreeMap, BTreeSet};

/// Checks all reasons; returns how many were checked.
pub(super) fn hold(case: &Case, told: &[Explanation]) -> Result<usize, String> {
    let seen: Vec<Seen> = Case::points().map(|point| case.seen(point)).collect();
    let mut checked = unneeded(case, told)?;
    for explanation in told {
        for line in explanation.lines.iter().filter(|line| line.file == FILE) {
            checked += known(case, line, &seen)? + skipped(line, &seen)? + same(explanation, line)?;
        }
    }
    Ok(checked)
}

/// Changes all values that are told as not needed, at once.
fn unneeded(case: &Case, told: &[Explanation]) -> Result<usize, String> {
    let mut needless: BTreeMap<(u32, String), bool> = BTreeMap::new();
    for line in told.iter().flat_map(|explanation| &explanation.lines) {
        for fact in line.facts.iter().filter(|fact| fact.call == 0) {
            if let What::Set { name, compiled, .. } = &fact.what {
                let flag = needless.entry((line.number, base(name))).or_insert(true);
                *flag &= *compiled == Compiled::NotNeeded && line.file == FILE;
            }
        }
    }
    let of = |line, name: &String| (line, name.clone());
    let sets: Vec<_> = case
        .written
        .sets
        .iter()
        .filter(|set| needless.get(&of(set.line, &set.name)) == Some(&true))
        .filter(|set| !case.written.open.contains(&of(set.line, &set.name)))
        .collect();
    if sets.is_empty() {
        return Ok(0);
    }
    let mut text = case.text.clone();
    let mut by_end = sets.clone();
    by_end.sort_by_key(|set| std::cmp::Reverse(set.end));
    by_end.iter().for_each(|set| text.insert_str(set.end, &set.change));
    let (Some(before), Some(after)) = (case.run(&case.text), case.run(&text)) else { return Ok(0) };
    match planes(&before) == planes(&after) {
        true => Ok(sets.len()),
        false => {
            let names: BTreeSet<(u32, &str)> = sets.iter().map(|set| (set.line, &*set.name)).collect();
            Err(format!("one of these is needed: {names:?}\n--- changed\n{text}"))
        }
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
fn known(case: &Case, line: &Line, seen: &[Seen]) -> Result<usize, String> {
    let mut checked = 0;
    for fact in line.facts.iter().filter(|fact| fact.call == 0) {
        match &fact.what {
            What::Set { name, values, compiled: Compiled::Constant, .. } => {
                let key = (0, line.number, name.clone());
                if case.written.open.contains(&(line.number, base(name))) {
                    continue;
                }
                let printed = seen.iter().filter_map(|seen| seen.sets.get(&key)).flatten();
                for printed in printed {
                    if !values.iter().any(|value| is_value(printed, value)) {
                        return Err(format!("{key:?} is told as known, and is also {printed}"));
                    }
                    checked += 1;
                }
            }
            What::Branch { condition, taken, known: true, .. } => {
                let key = (0, line.number, bare(condition));
                for truth in seen.iter().filter_map(|seen| seen.branches.get(&key)).flatten() {
                    if !taken.contains(truth) {
                        return Err(format!("{key:?} is told as known, and is also {truth}"));
                    }
                    checked += 1;
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
