//! What holds of every valid program: the IR is valid after every pass, and no way of compiling or running changes
//! what comes out.

use crate::run;
use osl_exec::{Frame, Isa, RunOptions, Services};
use osl_ir::ir::{Body, validate};
use osl_ir::params::ParamValues;
use osl_ir::passes::{self, Pass};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use oslrun::pipeline;
use std::fmt::Write;
use std::sync::OnceLock;

/// Passes that can be switched off.
pub const SWITCHABLE: [Pass; 6] =
    [Pass::Slice, Pass::Fold, Pass::Cse, Pass::Dce, Pass::Rate, Pass::Flatten];

/// A way of compiling and running.
#[derive(Clone, Debug)]
pub struct Way {
    /// Passes that do not run.
    pub without: Vec<Pass>,
    /// Points of a batch.
    pub batch: usize,
    /// The instruction set.
    pub isa: Isa,
}

/// The way that others are compared with: all passes, small batches.
pub fn plain() -> Way {
    Way { without: Vec::new(), batch: 16, isa: Isa::detect() }
}

/// All other ways: without each pass, without all, with large batches, on each instruction set.
pub fn ways() -> Vec<Way> {
    let mut ways: Vec<Way> = SWITCHABLE.iter().map(|p| Way { without: vec![*p], ..plain() }).collect();
    ways.push(Way { without: SWITCHABLE.to_vec(), ..plain() });
    ways.push(Way { batch: 256, ..plain() });
    ways.push(Way { without: SWITCHABLE.to_vec(), batch: 256, isa: Isa::baseline() });
    ways.extend(Isa::all().into_iter().map(|isa| Way { isa, ..plain() }));
    ways
}

/// The body of a program before the passes.
///
/// # Errors
/// The program's own errors, as text: it is no valid program, or too large.
pub fn lower(text: &str) -> Result<Body, String> {
    let checked = pipeline::check("generated.osl", text, &NoFiles, &Options::default());
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
    osl_ir::lower::lower(&program, &ParamValues::default()).map_err(|e| format!("{e:?}"))
}

fn services() -> &'static Services {
    static SERVICES: OnceLock<Services> = OnceLock::new();
    SERVICES.get_or_init(run::services)
}

/// The points: more than a batch of 16, some of them outside the unit square.
fn grid() -> Grid {
    Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(7, 3) }
}

/// All that a run yields, bit by bit, as text.
///
/// # Errors
/// The body is not valid, before or after the passes.
pub fn shown(body: &Body, way: &Way) -> Result<String, String> {
    let grid = grid();
    let options = passes::Options { without: way.without.clone(), ..passes::Options::default() };
    let compiled = pipeline::finish(body.clone(), &options);
    validate::validate(&compiled.body)?;
    let options = RunOptions {
        batch: way.batch,
        isa: way.isa,
        max_rounds: 1 << 16,
        closures: true,
        ..RunOptions::default()
    };
    Ok(match osl_exec::run(&compiled.program, services(), &grid, &options, &|_| ()) {
        Ok(frame) => show(&frame),
        Err(stop) => format!("stopped: {stop}"),
    })
}

fn show(frame: &Frame) -> String {
    let mut text = String::new();
    for plane in &frame.planes {
        let _ = writeln!(text, "{} {}: {:08x?}", plane.output, plane.component, plane.words);
    }
    for closures in &frame.closures {
        let _ = writeln!(text, "{}: {:?}", closures.output, closures.points);
    }
    for message in &frame.messages {
        let _ = writeln!(text, "{message:?}");
    }
    for printed in &frame.printed {
        let _ = writeln!(text, "{printed:?}");
    }
    text
}

/// Holds a program against the laws.
///
/// # Errors
/// The first law that is broken, in words.
pub fn hold(text: &str, ways: &[Way]) -> Result<(), String> {
    let body = lower(text)?;
    validate::validate(&body)?;
    let expected = shown(&body, &plain())?;
    for way in ways {
        let got = shown(&body, way)?;
        if got != expected {
            let line = expected.lines().zip(got.lines()).find(|(a, b)| a != b);
            return Err(match line {
                Some((a, b)) => format!("{way:?}\n plain {a}\n  this {b}"),
                None => format!("{way:?}\n plain {expected}\n  this {got}"),
            });
        }
    }
    Ok(())
}
