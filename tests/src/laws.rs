//! Properties of every valid program: the IR is valid after every pass, and all ways to compile and run give
//! the same results.

use crate::run;
use osl::stages;
use osl_exec::{Frame, Isa, Native, PointSource, RunOptions, Services};
use osl_ir::ir::{Body, print, read::read, validate};
use osl_ir::passes::{self, Pass};
use osl_lower::params::ParamValues;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::fmt::Write;
use std::sync::OnceLock;

/// Passes that can be switched off.
pub const SWITCHABLE: [Pass; 10] = [
    Pass::Slice,
    Pass::Fold,
    Pass::Unroll,
    Pass::Cse,
    Pass::Dce,
    Pass::Rate,
    Pass::Flatten,
    Pass::Algebra,
    Pass::Share,
    Pass::Fuse,
];

/// A way of compiling and running.
#[derive(Clone, Debug)]
pub struct Way {
    /// Passes to skip.
    pub without: Vec<Pass>,
    /// Points per batch.
    pub batch: usize,
    /// Which operations become machine code.
    pub native: Native,
    /// The instruction set.
    pub isa: Isa,
    /// Whether the program is compiled for the grid: with fewer globals that vary, and affine spaces.
    pub for_grid: bool,
}

/// The way with which others are compared: all passes, small batches.
pub fn plain() -> Way {
    Way { without: Vec::new(), batch: 16, native: Native::Never, isa: Isa::detect(), for_grid: false }
}

/// All other ways: without each pass, without any, for the grid, with large batches, on each instruction set.
pub fn ways() -> Vec<Way> {
    let mut ways: Vec<Way> = SWITCHABLE.iter().map(|p| Way { without: vec![*p], ..plain() }).collect();
    ways.push(Way { without: SWITCHABLE.to_vec(), ..plain() });
    ways.push(Way { batch: 256, ..plain() });
    ways.push(Way { without: SWITCHABLE.to_vec(), batch: 256, isa: Isa::baseline(), ..plain() });
    let loops = vec![Pass::Unroll, Pass::Flatten];
    ways.push(Way { without: loops, batch: 32, native: Native::Always, ..plain() });
    let for_grid = Way { for_grid: true, ..plain() };
    ways.push(Way { native: Native::Always, batch: 32, ..for_grid.clone() });
    ways.push(Way { without: vec![Pass::Unroll, Pass::Flatten, Pass::Fold], ..for_grid.clone() });
    ways.push(for_grid);
    ways.extend(Isa::all().into_iter().map(|isa| Way { batch: 64, native: Native::Always, isa, ..plain() }));
    ways.extend(Isa::all().into_iter().map(|isa| Way { isa, ..plain() }));
    ways
}

/// The body of a program before the passes.
///
/// # Errors
/// The program's own errors, as text: it is invalid or too large.
pub fn lower(text: &str) -> Result<Body, String> {
    let checked = stages::check("generated.osl", text, &NoFiles, &Options::default());
    let program = checked.program.ok_or_else(|| {
        let errors: Vec<String> = checked
            .diagnostics
            .iter()
            .filter(|d| d.is_error())
            .map(|d| {
                let at = text.get(d.span.start as usize..d.span.end as usize).unwrap_or("");
                format!("{} {} at `{at}`", d.code.id, d.message)
            })
            .collect();
        errors.join("\n")
    })?;
    osl_lower::lower(&program, &ParamValues::default()).map_err(|e| format!("{e:?}"))
}

/// Shared by all runs, so that files are opened once.
pub fn services() -> &'static Services {
    static SERVICES: OnceLock<Services> = OnceLock::new();
    SERVICES.get_or_init(run::services)
}

/// The points: more than a batch of 16, some of them outside the unit square.
fn grid() -> Grid {
    Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(7, 3) }
}

/// What a run yields.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Planes, closures and printed text, bit by bit.
    pub values: String,
    /// Errors and warnings, in order.
    pub messages: Vec<String>,
    /// The messages with their places and the points that report them.
    pub counted: Vec<String>,
}

/// All results of a run, to the bit, as text.
///
/// # Errors
/// The body is invalid, before or after the passes.
pub fn shown(body: &Body, way: &Way) -> Result<Shown, String> {
    let grid = grid();
    let mut options = passes::Options { without: way.without.clone(), ..passes::Options::default() };
    if way.for_grid {
        options.varying = grid.varying().to_vec();
        options.derivs = grid.varying_derivs().to_vec();
        options.affine = services().spaces.affine();
    }
    let stages::Compiled { body: passed, program, .. } = stages::finish(body.clone(), &options);
    validate::validate(&passed)?;
    // Without some passes it can be large.
    drop(passed);
    let options = RunOptions {
        batch: Some(way.batch),
        isa: way.isa,
        native: way.native,
        // Generated loops end; the number of steps depends on the passes.
        limits: run::steps(1 << 26),
        closures: true,
        ..RunOptions::default()
    };
    Ok(match osl_exec::run(&program, services(), &grid, &options, &|_| ()) {
        Ok(frame) => show(&frame),
        Err(stop) => Shown { values: format!("stopped: {stop}"), messages: Vec::new(), counted: Vec::new() },
    })
}

/// The start of the values of a run that stopped early. The cost of a program depends on the passes: without
/// some of them, a limit may or may not be reached, or another point may reach it.
const STOPPED: &str = "stopped: ";

fn show(frame: &Frame) -> Shown {
    let mut values = String::new();
    for plane in &frame.planes {
        let _ = writeln!(values, "{} {}: {:08x?}", plane.output, plane.component, plane.words);
    }
    for closures in &frame.closures {
        let points: Vec<_> = (0..closures.len()).map(|at| closures.point(at)).collect();
        let _ = writeln!(values, "{}: {points:?}", closures.output);
    }
    for printed in &frame.printed {
        let _ = writeln!(values, "{}", unsigned(&format!("{printed:?}")));
    }
    let mut messages: Vec<String> = Vec::new();
    for said in told(frame) {
        let osl_exec::Message { severity, text, places, .. } = &said.message;
        let message = unsigned(&format!("{severity:?} {text} {places:?}"));
        if !messages.contains(&message) {
            messages.push(message);
        }
    }
    Shown { values, messages, counted: counted(frame) }
}

/// The messages without notes, which tell of queries that a pass may remove.
pub(crate) fn told(frame: &Frame) -> impl Iterator<Item = &osl_exec::Said> {
    frame.messages.iter().filter(|said| said.message.severity != osl_exec::Severity::Note)
}

/// The messages with the numbers of points that report them and the first of these. Points whose messages
/// differ by the sign of a NaN count together.
fn counted(frame: &osl_exec::Frame) -> Vec<String> {
    let mut all: Vec<(String, Option<u64>, usize)> = Vec::new();
    for said in told(frame) {
        let message = unsigned(&format!("{:?}", said.message));
        match all.iter_mut().find(|(have, ..)| *have == message) {
            Some((_, points, first)) => {
                *points = points.zip(said.points).map(|(a, b)| a + b);
                *first = said.first.min(*first);
            }
            None => all.push((message, said.points, said.first)),
        }
    }
    all.iter().map(|said| format!("{said:?}")).collect()
}

/// The text without the signs of NaN, which are unspecified: they depend on the instruction set and, in a
/// vector loop, on whether a lane is in the last iterations.
fn unsigned(text: &str) -> String {
    let mut text = text.replace("-nan", "nan");
    while text.contains(" nan") {
        text = text.replace(" nan", "nan");
    }
    text
}

/// Whether a run may have these messages if the plain run has the messages `plain`. The shader's own
/// messages, which start with `=` in generated programs, keep their order. The passes decide which lookups
/// are unnecessary or duplicates: without some passes, further lookups may report errors, if the program
/// reports them as lowered.
fn says(way: &Way, plain: &[String], got: &[String], lowered: impl FnOnce() -> Vec<String>) -> bool {
    if way.without.is_empty() || plain == got {
        return plain == got;
    }
    let own = |m: &&String| m.contains("]: =");
    let lowered = lowered();
    got.iter().filter(own).eq(plain.iter().filter(own))
        && got.iter().chain(plain).all(|m| lowered.contains(m))
}

/// Checks the properties for a program.
///
/// # Errors
/// The first violated property, as text.
pub fn hold(text: &str, ways: &[Way]) -> Result<(), String> {
    hold_body(&lower(text)?, ways)
}

/// Checks the properties for a lowered program.
///
/// # Errors
/// The first violated property, as text.
pub fn hold_body(body: &Body, ways: &[Way]) -> Result<(), String> {
    validate::validate(body)?;
    reads_back(body)?;
    {
        let mut passed = body.clone();
        passes::run(&mut passed, &passes::Options::default());
        reads_back(&passed)?;
    }
    let plain_way = plain();
    let expected = shown(body, &plain_way)?;
    for way in ways {
        let got = shown(body, way)?;
        let (plain, this) = (&expected.values, &got.values);
        if !way.without.is_empty() && [plain, this].iter().any(|values| values.starts_with(STOPPED)) {
            continue;
        }
        if plain != this {
            let line = plain.lines().zip(this.lines()).find(|(a, b)| a != b).unwrap_or((plain, this));
            return Err(format!("{way:?}\n plain {}\n  this {}", line.0, line.1));
        }
        let lowered = || {
            let bare = Way { without: SWITCHABLE.to_vec(), ..plain_way.clone() };
            shown(body, &bare).map(|shown| shown.messages).unwrap_or_default()
        };
        if way.without.is_empty() && got.counted != expected.counted {
            return Err(format!("{way:?}\n plain {:#?}\n  this {:#?}", expected.counted, got.counted));
        }
        if !says(way, &expected.messages, &got.messages, lowered) {
            return Err(format!("{way:?}\n plain {:#?}\n  this {:#?}", expected.messages, got.messages));
        }
    }
    Ok(())
}

/// Checks that the printed IR of a body reads back as a valid body that prints the same.
///
/// # Errors
/// How it does not, as text.
pub fn reads_back(body: &Body) -> Result<(), String> {
    let text = print(body);
    let again = read(&text).map_err(|e| format!("{e}\n{text}"))?;
    validate::validate(&again).map_err(|e| format!("as read: {e}\n{text}"))?;
    let printed = print(&again);
    drop(again);
    let differs = |(a, b): &(&str, &str)| a != b;
    match text.lines().zip(printed.lines()).find(differs) {
        Some((a, b)) => Err(format!("printed {a}\n as read {b}")),
        None if text != printed => Err(format!("as read it has another length:\n{text}")),
        None => Ok(()),
    }
}

/// A smaller program that violates a property like this one: lines are removed, and text in brackets is
/// replaced by simple values, as long as the program still compiles.
pub fn reduce(text: &str, ways: &[Way]) -> String {
    reduce_by(text, &|text| {
        lower(text).is_ok() && !matches!(std::panic::catch_unwind(|| hold(text, ways)), Ok(Ok(())))
    })
}

/// A smaller program for which `breaks` is true as for this one.
pub fn reduce_by(text: &str, breaks: &dyn Fn(&str) -> bool) -> String {
    let mut text = text.to_string();
    loop {
        let before = text.len();
        let mut count = text.lines().count();
        let mut length = count;
        while length > 0 {
            let mut at = 0;
            while at + length <= count {
                let kept: Vec<&str> = text
                    .lines()
                    .enumerate()
                    .filter(|(n, _)| !(at..at + length).contains(n))
                    .map(|(_, line)| line)
                    .collect();
                let shorter = kept.join("\n");
                if breaks(&shorter) {
                    text = shorter;
                    count -= length;
                } else {
                    at += 1;
                }
            }
            length /= 2;
        }
        text = reduce_brackets(text, breaks);
        if text.len() >= before {
            return text;
        }
    }
}

fn reduce_brackets(mut text: String, breaks: &dyn Fn(&str) -> bool) -> String {
    let mut from = 0;
    while let Some(open) = text[from..].find('(').map(|at| at + from) {
        from = open + 1;
        let mut depth = 0;
        let close = text[open..].char_indices().find(|(_, c)| {
            depth += i32::from(*c == '(') - i32::from(*c == ')');
            depth == 0
        });
        let Some(close) = close.map(|(at, _)| open + at) else { break };
        let start = text[..open].rfind(|c: char| !c.is_alphanumeric() && c != '_').map_or(0, |at| at + 1);
        for with in ["1", "1.0", "0", "2", "u"] {
            let [whole, inner] =
                [start, open].map(|at| format!("{}{with}{}", &text[..at], &text[close + 1..]));
            if let Some(shorter) = [whole, inner].into_iter().find(|t| t.len() < text.len() && breaks(t)) {
                text = shorter;
                from = start;
                break;
            }
        }
    }
    text
}
