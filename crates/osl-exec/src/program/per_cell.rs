//! Which values exist once per cell, which of those single points read, and what they depend on.

use crate::step::{Location, Operand, Seed, Step};
use osl_ir::ir::{BlockId, Body, Inst, Kernel, Op, Rate, Source, ValueId};

/// The group whose cells have one value each.
pub(super) fn group(body: &Body, v: ValueId) -> Option<u16> {
    match body.value(v).rate {
        Rate::PerCell(group) => Some(group),
        _ => None,
    }
}

/// The group in which an instruction is computed.
pub(super) fn group_of(body: &Body, inst: &Inst) -> Option<u16> {
    if matches!(inst.op, Op::Share(..)) {
        return None;
    }
    inst.results.first().and_then(|r| group(body, *r))
}

/// How many groups a body has.
pub(super) fn groups(body: &Body) -> usize {
    let numbers = body.values.iter().filter_map(|v| match v.rate {
        Rate::PerCell(group) => Some(usize::from(group) + 1),
        _ => None,
    });
    numbers.max().unwrap_or(0)
}

/// For each value, whether it exists once per cell and is read by an instruction outside its group: such
/// values are copied to all lanes. `views`: the values into whose registers views point, which count in their
/// place.
pub(super) fn exported(body: &Body, views: &[Option<(ValueId, u32)>]) -> Vec<bool> {
    let mut exported = vec![false; body.values.len()];
    if groups(body) == 0 {
        return exported;
    }
    let mut read = |v: ValueId| {
        if group(body, v).is_some() {
            let root = views.get(v.index()).copied().flatten().map_or(v, |(root, _)| root);
            exported[root.index()] = true;
        }
    };
    block(body, body.entry, &mut read);
    for output in &body.outputs {
        if let Source::Value(v) = output.source {
            read(v);
        }
    }
    exported
}

fn block(body: &Body, id: BlockId, read: &mut dyn FnMut(ValueId)) {
    for inst in &body.block(id).insts {
        if group_of(body, inst).is_some() {
            continue;
        }
        inst.op.for_each_use(&mut *read);
        inst.op.blocks().for_each(|id| block(body, id, read));
    }
}

/// The words of the uniform file, constants excepted, that the steps of a group read. `None` if their values
/// depend on more than these words and the group's cells, or if running the steps has further effects.
pub(super) fn inputs(group: u16, steps: &[Step], seeds: &[Seed]) -> Option<Vec<u32>> {
    let mut words = Vec::new();
    for step in steps {
        let (args, outs): (&[Operand], &[Operand]) = match step {
            Step::Lane(step) => (step.args(), std::slice::from_ref(&step.out)),
            Step::Kernel(step) if matches!(step.kernel, Kernel::Noise { .. }) => (&step.args, &step.outs),
            _ => return None,
        };
        let is_ours = |operand: &Operand| matches!(operand.location, Location::Lanes { cells: Some(cells), .. } if cells.group == group);
        for arg in args {
            match arg.location {
                Location::Words(at) => words.extend(at..at + arg.words),
                Location::Lanes { .. } if !is_ours(arg) => return None,
                Location::Lanes { .. } => {}
            }
        }
        if !outs.iter().all(is_ours) {
            return None;
        }
    }
    words.sort_unstable();
    words.dedup();
    words.retain(|at| matches!(seeds.get(*at as usize), None | Some(Seed::Computed)));
    Some(words)
}
