//! Compares an explanation with what the instrumented source printed.

use super::Instrumented;
use super::case::FILE;
use osl_ir::ir::Const;
use osl_measure::explain::{Called, Explanation, Shown, What};
use std::collections::{BTreeMap, BTreeSet};

/// The number of a call, a line, and a name or condition.
pub(super) type Key = (usize, u32, String);

/// What the instrumented run printed.
#[derive(Default)]
pub(super) struct Seen {
    pub(super) sets: BTreeMap<Key, Vec<String>>,
    pub(super) branches: BTreeMap<Key, Vec<bool>>,
    /// For each value of `sets`, the rounds of the loops around it, if they are known.
    pub(super) in_rounds: BTreeMap<Key, Vec<Option<Vec<i32>>>>,
    /// The same for each outcome of `branches`.
    pub(super) branch_rounds: BTreeMap<Key, Vec<Option<Vec<i32>>>>,
    /// The functions that were called, in order.
    pub(super) entered: Vec<String>,
    rounds: BTreeMap<(usize, u32), Vec<usize>>,
    /// The arguments of each call, and its outputs.
    given: BTreeMap<(usize, String), String>,
    outputs: BTreeMap<(usize, String), String>,
    /// The last value that each call returned.
    returned: BTreeMap<usize, String>,
}

impl Seen {
    pub(super) fn read(lines: &[&str], written: &Instrumented) -> Seen {
        let mut seen = Seen::default();
        let (mut stack, mut calls) = (vec![0], 0);
        let mut current: BTreeMap<usize, i32> = BTreeMap::new();
        for line in lines {
            let call = stack.last().copied().unwrap_or(0);
            let rounds = |at: u32, current: &BTreeMap<usize, i32>| {
                let inside = written.inside.get(&at).cloned().flatten();
                let round = |id: &usize| current.get(id).copied().unwrap_or(0);
                inside.map(|loops| loops.iter().map(round).collect())
            };
            let mut words = line.splitn(2, ' ');
            let (word, rest) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
            match word {
                "@E" => {
                    calls += 1;
                    stack.push(calls);
                    seen.entered.push(rest.to_string());
                }
                "@X" => drop(stack.pop()),
                "@S" => {
                    let mut parts = rest.splitn(3, ' ');
                    let at: u32 = parts.next().and_then(|n| n.parse().ok()).unwrap_or(0);
                    let name = parts.next().unwrap_or_default().to_string();
                    let value = parts.next().unwrap_or_default().to_string();
                    if name == "return" {
                        seen.returned.insert(call, value.clone());
                    }
                    seen.in_rounds.entry((call, at, name.clone())).or_default().push(rounds(at, &current));
                    seen.sets.entry((call, at, name)).or_default().push(value);
                }
                "@G" | "@R" => {
                    let mut parts = rest.splitn(3, ' ').skip(1);
                    let name = parts.next().unwrap_or_default().to_string();
                    let value = parts.next().unwrap_or_default().to_string();
                    let list = if word == "@G" { &mut seen.given } else { &mut seen.outputs };
                    list.insert((call, name), value);
                }
                "@T" => {
                    let (id, truth) = rest.split_once(' ').unwrap_or_default();
                    let Some((at, text)) = id.parse().ok().and_then(|id: usize| written.conditions.get(id))
                    else {
                        continue;
                    };
                    let key = (call, *at, bare(text));
                    seen.branch_rounds.entry(key.clone()).or_default().push(rounds(*at, &current));
                    seen.branches.entry(key).or_default().push(truth != "0");
                }
                "@P" | "@O" => {
                    let id: usize = rest.parse().unwrap_or(0);
                    let line = written.loops.get(id).copied().unwrap_or(0);
                    let count = current.entry(id).or_default();
                    *count = if word == "@O" { *count + 1 } else { 0 };
                    let counts = seen.rounds.entry((call, line)).or_default();
                    match (word, counts.last_mut()) {
                        ("@O", Some(last)) => *last += 1,
                        _ => counts.push(0),
                    }
                }
                _ => {}
            }
        }
        seen
    }
}

/// The text of a condition without spaces and outer brackets.
pub(super) fn bare(text: &str) -> String {
    let mut text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    while let Some(inner) = text.strip_prefix('(').and_then(|t| t.strip_suffix(')')) {
        let mut depth = 0;
        let balanced = inner.chars().all(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth >= 0
        });
        if !balanced {
            break;
        }
        text = inner.trim().to_string();
    }
    text
}

/// Compares all that both tell; returns how much that was.
pub(super) fn compare(told: &Explanation, seen: &Seen, written: &Instrumented) -> Result<usize, String> {
    let mut compared = 0;
    // A condition that stands twice on a line cannot be told apart by its text.
    let mut once = BTreeSet::new();
    let twice: BTreeSet<(u32, String)> = written
        .conditions
        .iter()
        .map(|(line, text)| (*line, bare(text)))
        .filter(|key| !once.insert(key.clone()))
        .collect();
    let mut loops = BTreeSet::new();
    let two_loops: BTreeSet<u32> = written.loops.iter().copied().filter(|l| !loops.insert(*l)).collect();
    let mut left: BTreeSet<Key> = seen.sets.keys().cloned().collect();
    let mut conditions: BTreeSet<Key> = seen.branches.keys().cloned().collect();
    let mut counted: BTreeSet<(usize, u32)> = seen.rounds.keys().copied().collect();
    let numbers = numbers(told, written);
    compared += calls(&told.calls, &numbers, seen)?;
    for line in &told.lines {
        for fact in &line.facts {
            let Some(call) = numbers.get(fact.call).copied().flatten().filter(|_| line.file == FILE) else {
                continue;
            };
            match &fact.what {
                What::Set { name, values, .. } => {
                    let key = (call, line.number, name.clone());
                    left.remove(&key);
                    if written.open.contains(&(line.number, base(name))) {
                        continue;
                    }
                    let Some(expected) = seen.sets.get(&key) else { continue };
                    if expected.len() != values.len()
                        || !expected.iter().zip(values).all(|(a, b)| is_value(a, b))
                    {
                        let values: Vec<String> = values.iter().map(Shown::value).collect();
                        return Err(format!("{key:?} is told as {values:?}, and is {expected:?}"));
                    }
                    compared += values.len();
                }
                What::Branch { condition, taken, .. } => {
                    let key = (call, line.number, bare(condition));
                    conditions.remove(&key);
                    if condition.ends_with('…') || twice.contains(&(line.number, bare(condition))) {
                        continue;
                    }
                    if seen.branches.get(&key) != Some(taken) {
                        let got = seen.branches.get(&key);
                        return Err(format!("{key:?} is told as {taken:?}, and is {got:?}"));
                    }
                    compared += taken.len();
                }
                What::Unevaluated { condition } => {
                    let key = (call, line.number, bare(condition));
                    if seen.branches.contains_key(&key) && !twice.contains(&(key.1, key.2.clone())) {
                        return Err(format!("{key:?} is told as not evaluated"));
                    }
                }
                What::Rounds { counts } => {
                    let key = (call, line.number);
                    counted.remove(&key);
                    if two_loops.contains(&line.number) {
                        continue;
                    }
                    if seen.rounds.get(&key) != Some(counts) {
                        let got = seen.rounds.get(&key);
                        return Err(format!("rounds {key:?} are told as {counts:?}, and are {got:?}"));
                    }
                    compared += counts.len();
                }
                What::Call { .. } | What::Enter { .. } => {}
            }
        }
    }
    left.retain(|(_, line, name)| !written.open.contains(&(*line, base(name))));
    conditions.retain(|(_, line, text)| !twice.contains(&(*line, text.clone())) && text.len() < 70);
    counted.retain(|(_, line)| !two_loops.contains(line));
    if let Some(missing) = left.first().or(conditions.first()) {
        return Err(format!("{missing:?} is not told"));
    }
    match counted.first() {
        Some(missing) => Err(format!("rounds {missing:?} are not told")),
        None => Ok(compared),
    }
}

/// The number of each call, counting only functions that were rewritten; those of headers were not.
pub(super) fn numbers(told: &Explanation, written: &Instrumented) -> Vec<Option<usize>> {
    let mut next = 0;
    let mut numbers = vec![Some(0)];
    for called in &told.calls {
        let name = called.form.split('(').next().and_then(|head| head.split(' ').next_back());
        let known = name.is_some_and(|name| written.functions.contains(name));
        next += usize::from(known);
        numbers.push(known.then_some(next));
    }
    numbers
}

/// A variable without fields and indices.
pub(super) fn base(name: &str) -> String {
    name.split(['.', '[']).next().unwrap_or_default().to_string()
}

/// Compares the arguments and results of the calls; `numbers` has the number that the instrumented run gives
/// each of them.
fn calls(told: &[Called], numbers: &[Option<usize>], seen: &Seen) -> Result<usize, String> {
    let mut compared = 0;
    for (called, number) in told.iter().zip(numbers.iter().skip(1)) {
        let Some(number) = *number else { continue };
        let mut hold = |what: &str, name: &str, value: &Shown, printed: Option<&String>| match printed {
            Some(printed) if !is_value(printed, value) => {
                let value = value.value();
                Err(format!("{what} `{name}` of call {number} is told as {value}, and is {printed}"))
            }
            Some(_) => {
                compared += 1;
                Ok(())
            }
            None => Ok(()),
        };
        for (name, value) in &called.given {
            hold("argument", name, value, seen.given.get(&(number, name.clone())))?;
        }
        for (name, value) in &called.results {
            let printed = match &name[..] {
                "" => seen.returned.get(&number),
                name => seen.outputs.get(&(number, name.to_string())),
            };
            hold("result", name, value, printed)?;
        }
    }
    Ok(compared)
}

/// Whether a printed value is the one that is told, to the bit; NaNs are equal.
pub(super) fn is_value(printed: &str, told: &Shown) -> bool {
    let (kind, rest) = printed.split_at(printed.len().min(2));
    let numbers = |list: &[f32]| {
        let printed: Option<Vec<f32>> = rest.split_whitespace().map(|word| word.parse().ok()).collect();
        printed.is_some_and(|printed| {
            printed.len() == list.len()
                && printed
                    .iter()
                    .zip(list)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()))
        })
    };
    match (kind.trim(), told.single()) {
        ("i", Some(Const::Int(n))) => rest.trim().parse() == Ok(*n),
        ("f", Some(Const::Float(x))) => numbers(&[*x]),
        ("f", Some(Const::Triple(t))) => numbers(t),
        ("f", Some(Const::Matrix(m))) => numbers(&m[..]),
        ("s", Some(Const::Str(text))) => rest == &**text,
        _ => false,
    }
}
