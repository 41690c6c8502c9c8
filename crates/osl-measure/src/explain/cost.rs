//! The cost of each output: what remains of the program if only that output is requested.

use crate::quote::{At, line_at, text_of};
use osl_ir::ir::{Body, Kernel, Op};
use osl_ir::passes::{self, Pass};
use osl_syntax::source::SourceMap;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The part of the program that an output needs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// The name of the output, or of a group of outputs.
    pub output: String,
    /// Instructions after the passes.
    pub instructions: usize,
    /// Layers that these instructions come from.
    pub layers: usize,
    /// Instructions that compute derivatives: derivatives of globals, and kernels in their form with
    /// derivatives.
    pub derivatives: usize,
    /// Globals that are read.
    pub globals: usize,
    /// Texture lookups.
    pub textures: usize,
    /// Evaluations of noise fields, each place in the program counted once.
    pub noises: usize,
    /// The lines of the source that cost most, if they are requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<LineCost>,
}

/// A line of the source, and what it costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineCost {
    /// Its file.
    pub file: String,
    /// Its number, from 1.
    pub number: u32,
    /// Its text.
    pub text: String,
    /// Its cost in additions, by the table of operations.
    pub cost: f64,
    /// Its share of the whole cost, from 0 to 1.
    pub share: f64,
}

/// The most lines of a ranking.
const MOST_LINES: usize = 5;
/// A line with a smaller share is not worth a sentence.
const WORTH: f64 = 0.05;

/// The lines that cost most if all requested outputs are computed, by what all passes leave of them.
pub fn lines(lowered: &Body, options: &passes::Options, sources: &SourceMap) -> Vec<LineCost> {
    let mut body = lowered.clone();
    passes::run(&mut body, options);
    let (mut total, mut sums): (f64, BTreeMap<At, f64>) = (0.0, BTreeMap::new());
    crate::cost::each(&body, &mut |inst, cost| {
        total += cost;
        if let Some(at) = line_at(inst.span, sources) {
            *sums.entry(at).or_default() += cost;
        }
    });
    let mut sums: Vec<(At, f64)> = sums.into_iter().collect();
    sums.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let line = |(at, cost): (At, f64)| {
        let ((file, text), share) = (text_of(at, sources)?, cost / total.max(1.0));
        (share >= WORTH).then_some(LineCost { file, number: at.1, text, cost, share })
    };
    sums.into_iter().take(MOST_LINES).filter_map(line).collect()
}

/// The lines that cost most, in words.
pub fn ranking(lines: &[LineCost]) -> String {
    let mut out = String::new();
    for (at, line) in lines.iter().enumerate() {
        let LineCost { file, number, text, share, .. } = line;
        let share = crate::words::percent(*share);
        out += &match at {
            0 => format!("Most of the estimated cost is that of {file}:{number}, {share}:  {text}\n"),
            _ => format!("Then {file}:{number}, {share}:  {text}\n"),
        };
    }
    if !out.is_empty() {
        let rounds = crate::cost::ROUNDS;
        out += &format!(
            "(by the operations that the passes leave; a loop that stays a loop counts {rounds} rounds)\n"
        );
    }
    out
}

/// The costs of the lowered program, of all requested outputs together, and of each output by itself.
pub fn cost(lowered: &Body, options: &passes::Options) -> Vec<Cost> {
    let mut names: Vec<Arc<str>> = Vec::new();
    for output in &lowered.outputs {
        let wanted = options.outputs.as_ref().is_none_or(|wanted| wanted.contains(&output.name));
        if wanted && !names.contains(&output.name) {
            names.push(output.name.clone());
        }
    }
    let of = |title: &str, outputs: Vec<Arc<str>>| {
        let mut body = lowered.clone();
        // Passes that expand or rearrange code for speed would distort the counts; only removal counts here.
        let without = vec![Pass::Unroll, Pass::Flatten, Pass::Algebra, Pass::Share];
        passes::run(&mut body, &passes::Options { outputs: Some(outputs), without, ..options.clone() });
        count(title, &body)
    };
    let mut whole = lowered.clone();
    let keep = [Pass::Ssa, Pass::Derive, Pass::Rate];
    let without = Pass::ALL.into_iter().filter(|p| !keep.contains(p)).collect();
    passes::run(&mut whole, &passes::Options { outputs: None, without, ..options.clone() });
    let mut costs = vec![count("whole program", &whole), of("all asked for", names.clone())];
    if names.len() > 1 {
        costs.extend(names.iter().map(|name| of(name, vec![name.clone()])));
    }
    costs
}

fn count(title: &str, body: &Body) -> Cost {
    let mut cost = Cost {
        output: title.to_string(),
        instructions: body.count(),
        layers: 0,
        derivatives: 0,
        globals: 0,
        textures: 0,
        noises: 0,
        lines: Vec::new(),
    };
    let (mut globals, mut layers) = (BTreeSet::new(), BTreeSet::new());
    for inst in body.insts_from(body.entry) {
        layers.extend(body.names(inst.span).map(|(layer, _)| layer));
        match &inst.op {
            Op::Global(global) => {
                globals.insert(*global);
            }
            Op::GlobalDeriv(..) => cost.derivatives += 1,
            Op::Kernel(kernel, _) => {
                cost.derivatives += usize::from(kernel.has_derivs());
                cost.noises +=
                    usize::from(matches!(kernel, Kernel::Noise { .. } | Kernel::NamedNoise { .. }));
                cost.textures +=
                    usize::from(matches!(kernel, Kernel::Texture { .. } | Kernel::Environment { .. }));
            }
            _ => {}
        }
    }
    (cost.globals, cost.layers) = (globals.len(), layers.len());
    cost
}

/// The costs as a table; instruction counts are followed by their share of the whole program.
pub fn table(costs: &[Cost]) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    let whole = costs.first().map_or(1, |c| c.instructions.max(1));
    let _ = writeln!(
        out,
        "{:<20} {:>12} {:>6} {:>7} {:>12} {:>8} {:>9} {:>7}",
        "output", "instructions", "share", "layers", "derivatives", "globals", "textures", "noises"
    );
    for c in costs {
        let _ = writeln!(
            out,
            "{:<20} {:>12} {:>4} % {:>7} {:>12} {:>8} {:>9} {:>7}",
            c.output,
            c.instructions,
            c.instructions * 100 / whole,
            c.layers,
            c.derivatives,
            c.globals,
            c.textures,
            c.noises
        );
    }
    out
}
