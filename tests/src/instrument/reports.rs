//! Reports: what an explanation says that a run reports at a point, against a run of all points.

use super::case::Case;
use osl::stages;
use osl_exec::{Message, RunOptions, Said};
use osl_measure::explain::{Explanation, Reported};
use osl_measure::trace::OnePoint;
use std::collections::BTreeMap;

/// Runs each point by itself, as `explain` does. Each message of the whole run must come from as many points,
/// and the first one must be the same. Adds the messages of the explained points, each at its line.
pub(super) fn hold(case: &Case, told: &mut [(usize, Explanation)]) -> Result<usize, String> {
    let Some(whole) = case.run(&case.text) else { return Ok(0) };
    if whole.messages.iter().any(|said| said.points.is_none()) {
        return Ok(0);
    }
    let mut counted: BTreeMap<Message, (u64, usize)> = BTreeMap::new();
    for point in Case::points() {
        let Some(messages) = of_point(case, point) else { return Ok(0) };
        for said in &messages {
            let known = counted.entry(said.message.clone()).or_insert((0, point));
            known.0 += 1;
        }
        let Some((_, explanation)) = told.iter_mut().find(|(at, _)| *at == point) else { continue };
        at_their_lines(case, &messages, explanation)?;
    }
    let of_run: BTreeMap<Message, (u64, usize)> = whole
        .messages
        .iter()
        .map(|said| (said.message.clone(), (said.points.unwrap_or(0), said.first)))
        .collect();
    match counted == of_run {
        true => Ok(counted.len()),
        false => Err(format!("reports of single points: {counted:?}, and of the run: {of_run:?}")),
    }
}

fn of_point(case: &Case, point: usize) -> Option<Vec<Said>> {
    let program = case.checked.program.as_ref()?;
    let compiled = stages::finish(stages::lower(program, &[]).ok()?, &case.options);
    let options = RunOptions { limits: crate::run::steps(1 << 22), ..RunOptions::default() };
    let point = OnePoint { source: &case.grid, point };
    let frame = osl_exec::run(&compiled.program, crate::laws::services(), &point, &options, &|_| ()).ok()?;
    Some(frame.messages)
}

/// Each message is told once, at the line of its place, or without a line.
fn at_their_lines(case: &Case, messages: &[Said], explanation: &mut Explanation) -> Result<(), String> {
    let sources = &case.checked.sources;
    let text =
        |said: &Said| said.message.show(|span| format!("{:?}", sources.line(span).map(|(_, line)| line)));
    let reported = |said: &Said| Reported { severity: "error", message: text(said), help: None };
    let list = messages.iter().map(|said| (said.message.at, reported(said))).collect();
    explanation.report(list, sources);
    for said in messages {
        let line = said.message.at.and_then(|span| sources.line(span)).map(|(_, line)| line);
        let list = match line {
            Some(number) => {
                let found = explanation.lines.iter().find(|line| line.number == number);
                found.map(|line| &line.reports)
            }
            None => Some(&explanation.reports),
        };
        let count = list.map_or(0, |list| list.iter().filter(|one| one.message == text(said)).count());
        if count != 1 {
            return Err(format!("{said:?} is told {count} times at line {line:?}"));
        }
    }
    let numbers: Vec<(&str, u32)> = explanation.lines.iter().map(|line| (&*line.file, line.number)).collect();
    match numbers.is_sorted_by(|a, b| a.0 != b.0 || a.1 < b.1) {
        true => Ok(()),
        false => Err(format!("lines out of order: {numbers:?}")),
    }
}
