//! What each output asks of a program: only that is run.

use osl_ir::ir::{Body, Kernel, Op};
use osl_ir::passes::{self, Pass};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// What an output needs, of what the program has for all of its outputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// The output, or `all`.
    pub output: String,
    /// Instructions after the passes.
    pub instructions: usize,
    /// Layers whose source they come from.
    pub layers: usize,
    /// Instructions that compute derivatives: slopes of globals, and kernels in their form with tangents.
    pub derivatives: usize,
    /// Globals that are read.
    pub globals: usize,
    /// Texture lookups.
    pub textures: usize,
    /// Evaluations of noise fields: one for each place in the program.
    pub noises: usize,
}

/// The costs of all outputs together and of each by itself.
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
        passes::run(&mut body, &passes::Options { outputs: Some(outputs), ..options.clone() });
        count(title, &body)
    };
    let mut costs = vec![of("all", names.clone())];
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
    };
    let (mut globals, mut layers) = (BTreeSet::new(), BTreeSet::new());
    let mut blocks = vec![body.entry];
    while let Some(block) = blocks.pop() {
        for inst in &body.block(block).insts {
            layers.extend(body.names(inst.span).map(|(layer, _)| layer));
            match &inst.op {
                Op::Global(global) => {
                    globals.insert(*global);
                }
                Op::Slope(..) => cost.derivatives += 1,
                Op::Kernel(kernel, _) => {
                    cost.derivatives += usize::from(kernel.tangents());
                    cost.noises +=
                        usize::from(matches!(kernel, Kernel::Noise { .. } | Kernel::NamedNoise { .. }));
                    cost.textures +=
                        usize::from(matches!(kernel, Kernel::Texture { .. } | Kernel::Environment { .. }));
                }
                Op::If { then, otherwise, .. } => blocks.extend([*then, *otherwise]),
                Op::Loop { body, .. } => blocks.push(*body),
                _ => {}
            }
        }
    }
    (cost.globals, cost.layers) = (globals.len(), layers.len());
    cost
}

/// The costs as a table.
pub fn table(costs: &[Cost]) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<20} {:>12} {:>7} {:>12} {:>8} {:>9} {:>7}",
        "output", "instructions", "layers", "derivatives", "globals", "textures", "noises"
    );
    for c in costs {
        let _ = writeln!(
            out,
            "{:<20} {:>12} {:>7} {:>12} {:>8} {:>9} {:>7}",
            c.output, c.instructions, c.layers, c.derivatives, c.globals, c.textures, c.noises
        );
    }
    out
}

/// The passes that tell what outputs need, and change nothing else.
pub fn only_needed(mut body: Body, options: &passes::Options) -> Body {
    let keep = [Pass::Ssa, Pass::Slice, Pass::Derive, Pass::Dce, Pass::Rate];
    let without = Pass::ALL.into_iter().filter(|p| !keep.contains(p)).collect();
    passes::run(&mut body, &passes::Options { without, ..options.clone() });
    body
}
