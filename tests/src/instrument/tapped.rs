//! Compares taps with a run of the instrumented source.

use super::instrument;
use crate::{laws, run};
use osl::stages;
use osl_exec::{Frame, PointSource, RunOptions};
use osl_ir::ir::Kind;
use osl_ir::passes;
use osl_lower::taps::{self, Tap, TapPath};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::collections::BTreeMap;

const FILE: &str = "tapped.osl";
const SIZE: (usize, usize) = (5, 3);

/// The values that a point printed for a line and a name, in order.
type Printed = BTreeMap<(u32, String), Vec<Vec<String>>>;

/// Compares the taps of all plain assignments with what the instrumented source prints, and the outputs with
/// those of a run without taps. Returns the number of compared values; `None` if the source cannot be used.
///
/// # Errors
/// The first difference, as text.
pub fn taps_hold(text: &str) -> Result<Option<usize>, String> {
    let checked = stages::check(FILE, text, &NoFiles, &Options::default());
    let Some(program) = &checked.program else { return Ok(None) };
    let written = instrument(text, &checked.ast, false);
    let again = stages::check(FILE, &written.text, &NoFiles, &Options::default());
    let Some(second) = &again.program else { return Ok(None) };
    let Some(frame) = frame(second, Vec::new())? else { return Ok(None) };
    let printed = read(&frame);
    let alone: Vec<&(u32, String)> = printed
        .keys()
        .filter(|(line, name)| {
            let source = text.lines().nth(*line as usize - 1).unwrap_or_default();
            let base = name.split('.').next().unwrap_or_default().to_string();
            is_one_statement(source) && name != "return" && !written.open.contains(&(*line, base))
        })
        .collect();
    let mut wanted: Vec<(TapPath, &(u32, String))> = Vec::new();
    for key in alone {
        for round in ["", "@2"] {
            wanted.push((TapPath::parse(&format!("{}:{}{round}", key.0, key.1))?, key));
        }
    }
    let find = |wanted: &TapPath| {
        taps::find(wanted, program, (&checked.sources, 0), 0)
            .map_err(|why| format!("{wanted:?}: {why}\n{text}"))
    };
    let list = wanted.iter().map(|(wanted, _)| find(wanted)).collect::<Result<Vec<Tap>, String>>()?;
    let (Some(plain), Some(tapped)) =
        (self::frame(program, Vec::new())?, self::frame(program, list.clone())?)
    else {
        return Ok(None);
    };
    same_outputs(&plain, &tapped).map_err(|why| format!("{why}\n{text}"))?;
    let mut compared = 0;
    for ((wanted, key), tap) in wanted.iter().zip(&list) {
        let visits = &printed[*key];
        compared += compare(&tapped, tap, wanted.round, visits)
            .map_err(|why| format!("{why}\n{text}\n--- instrumented\n{}", written.text))?;
    }
    Ok(Some(compared))
}

/// Whether a line of the source is one plain statement.
fn is_one_statement(line: &str) -> bool {
    let words = ["for", "if", "else", "while", "do", "return"];
    let has_word = line.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| words.contains(&word));
    line.matches(';').count() == 1 && !line.contains(['{', '}', '[']) && !has_word
}

fn frame(program: &stages::ResolvedProgram, taps: Vec<Tap>) -> Result<Option<Frame>, String> {
    let grid = Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(SIZE.0, SIZE.1) };
    let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
    let requests = stages::Requests { taps, last: stages::Last::None, ..stages::Requests::default() };
    let Ok(body) = stages::lower_for(program, &[], &requests) else { return Ok(None) };
    let compiled = stages::finish(body, &options);
    let run_options = RunOptions { limits: run::steps(1 << 22), ..RunOptions::default() };
    Ok(osl_exec::run(&compiled.program, laws::services(), &grid, &run_options, &|_| ()).ok())
}

/// What each point printed: for each line and name, the visits of all points.
fn read(frame: &Frame) -> Printed {
    let mut printed = Printed::new();
    for said in frame.printed.iter().filter(|said| said.file.is_none()) {
        let Some(rest) = said.text.strip_prefix("@S ") else { continue };
        let mut parts = rest.splitn(3, ' ');
        let Some(line) = parts.next().and_then(|n| n.parse().ok()) else { continue };
        let (name, value) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        if name.contains(['[', '|']) {
            continue;
        }
        let visits = printed.entry((line, name.to_string()));
        let visits = visits.or_insert_with(|| vec![Vec::new(); SIZE.0 * SIZE.1]);
        if let Some(own) = visits.get_mut(said.point) {
            own.push(value.to_string());
        }
    }
    printed
}

/// The outputs that both have are the same to the bit.
fn same_outputs(plain: &Frame, tapped: &Frame) -> Result<(), String> {
    for plane in &plain.planes {
        let same =
            |other: &&osl_exec::Plane| other.output == plane.output && other.component == plane.component;
        let Some(other) = tapped.planes.iter().find(same) else {
            return Err(format!("output `{}` is missing", plane.output));
        };
        if plane.kind != Kind::Str && plane.words != other.words {
            return Err(format!("output `{}` differs with taps", plane.output));
        }
    }
    Ok(())
}

fn compare(frame: &Frame, tap: &Tap, round: Option<u32>, visits: &[Vec<String>]) -> Result<usize, String> {
    let planes: Vec<&osl_exec::Plane> = frame.planes.iter().filter(|p| p.output == tap.name).collect();
    let mask = frame.planes.iter().find(|p| p.output == tap.mask);
    let mut compared = 0;
    for (point, values) in visits.iter().enumerate() {
        let expected = match round {
            None => values.last(),
            Some(round) => values.get(round as usize - 1),
        };
        let reached = mask.map_or(1, |mask| mask.words[point]);
        if (reached == 1) != expected.is_some() {
            return Err(format!(
                "{}: point {point} is reached {reached}, and printed {expected:?}",
                tap.name
            ));
        }
        let Some(expected) = expected else { continue };
        let words: Vec<u32> = planes.iter().map(|plane| plane.words[point]).collect();
        if !is_value(expected, &planes, &words) {
            return Err(format!("{}: point {point} is {words:x?}, and printed {expected}", tap.name));
        }
        compared += 1;
    }
    Ok(compared)
}

/// Whether a printed value has these bits; NaNs are equal. Strings are not planes of numbers.
fn is_value(printed: &str, planes: &[&osl_exec::Plane], words: &[u32]) -> bool {
    let (kind, rest) = printed.split_at(printed.len().min(2));
    match kind.trim() {
        "i" => words.len() == 1 && rest.trim().parse() == Ok(words[0] as i32),
        "f" => {
            let numbers: Vec<f32> = rest.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let same =
                |(a, b): (&f32, &u32)| a.to_bits() == *b || (a.is_nan() && f32::from_bits(*b).is_nan());
            numbers.len() == words.len() && numbers.iter().zip(words).all(same)
        }
        _ => planes.iter().all(|plane| plane.kind == Kind::Str),
    }
}
