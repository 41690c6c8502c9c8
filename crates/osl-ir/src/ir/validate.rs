//! The rules that hold for every body. They are checked after lowering, from source as from `.oso`, and in
//! debug builds after each pass.
//!
//! 1. Every value is defined once, before its uses and on every path to them. Blocks and slots exist, and a
//!    block is part of one instruction only.
//! 2. The arguments of a lane operation have the kinds of its shape, and its one result follows from them.
//!    The arguments and results of a kernel have the numbers and kinds that its description states.
//! 3. An `If` has as many yields on each side as results, of equal kinds; a `Loop` has as many initial and
//!    next values as parameters and results, of equal kinds.
//! 4. Conditions and indices are ints. Scalar slots are used as scalars, array slots as arrays. What is read
//!    from a slot or written to it has the slot's kind.
//! 5. A constant has one result of its kind; a global and its derivative have one of the global's kind, and
//!    the derivative of a value one of the value's kind. What is stored has no result.
//! 6. A value per cell is computed from uniform values and from values per cell of the same group.

mod kernel;

use super::{BlockId, Body, Inst, Kind, LaneOp, Op, Rate, SlotId, Source, ValueId};
use crate::global::Global;

/// Checks a body.
///
/// # Errors
/// The first violated rule, as text.
pub fn validate(body: &Body) -> Result<(), String> {
    let mut check = Check {
        body,
        defined: vec![false; body.values.len()],
        entered: vec![false; body.blocks.len()],
        scope: Vec::new(),
    };
    check.block(body.entry)?;
    for output in &body.outputs {
        match output.source {
            Source::Value(v) => check.used(v)?,
            Source::Slot(s) if s.index() >= body.slots.len() => {
                return Err(format!("output of unknown slot {s:?}"));
            }
            Source::Slot(_) => {}
        }
    }
    Ok(())
}

/// The kind of a global's value.
fn global_kind(global: Global) -> Kind {
    match global {
        Global::P
        | Global::I
        | Global::N
        | Global::Ng
        | Global::DPdu
        | Global::DPdv
        | Global::Ps
        | Global::DPdtime => Kind::Triple,
        Global::U | Global::V | Global::Time | Global::Dtime => Kind::Float,
        Global::SurfaceArea | Global::Backfacing | Global::LeftHanded => Kind::Float,
        Global::Ci => Kind::Closure,
    }
}

struct Check<'a> {
    body: &'a Body,
    /// Whether a value is defined and visible here.
    defined: Vec<bool>,
    /// Whether a block was found in an instruction.
    entered: Vec<bool>,
    scope: Vec<ValueId>,
}

impl Check<'_> {
    fn used(&self, v: ValueId) -> Result<(), String> {
        if self.defined.get(v.index()).copied().unwrap_or(false) {
            Ok(())
        } else {
            Err(format!("{v:?} is not defined here"))
        }
    }

    fn define(&mut self, v: ValueId) -> Result<(), String> {
        match self.defined.get_mut(v.index()) {
            Some(defined) if !*defined => *defined = true,
            _ => return Err(format!("{v:?} is defined twice or unknown")),
        }
        self.scope.push(v);
        Ok(())
    }

    fn kind(&self, v: ValueId) -> Kind {
        self.body.kind(v)
    }

    fn kinds(&self, a: &[ValueId], b: &[ValueId], what: &str) -> Result<(), String> {
        let same = a.len() == b.len() && a.iter().zip(b).all(|(a, b)| self.kind(*a) == self.kind(*b));
        if same { Ok(()) } else { Err(format!("{what}: {a:?} against {b:?}")) }
    }

    fn int(&self, v: ValueId, what: &str) -> Result<(), String> {
        self.used(v)?;
        if self.kind(v) == Kind::Int { Ok(()) } else { Err(format!("{what} {v:?} is no int")) }
    }

    /// Whether all values are in the list of the body.
    fn known(&self, values: &[ValueId]) -> Result<(), String> {
        match values.iter().find(|v| v.index() >= self.body.values.len()) {
            Some(v) => Err(format!("{v:?} is unknown")),
            None => Ok(()),
        }
    }

    fn results(&self, inst: &Inst, kinds: &[Kind]) -> Result<(), String> {
        self.known(&inst.results)?;
        match inst.results.iter().map(|v| self.kind(*v)).eq(kinds.iter().copied()) {
            true => Ok(()),
            false => Err(format!("results {:?} are not {kinds:?}", inst.results)),
        }
    }

    fn stored(&self, s: SlotId, v: ValueId) -> Result<(), String> {
        self.used(v)?;
        match self.kind(v) == self.body.slot(s).kind {
            true => Ok(()),
            false => Err(format!("{v:?} is not of the kind of {s:?}")),
        }
    }

    fn array(&self, s: SlotId, is: bool) -> Result<(), String> {
        match self.body.slots.get(s.index()) {
            Some(slot) if slot.len.is_some() == is => Ok(()),
            _ => Err(format!("{s:?} is not used as what it is")),
        }
    }

    fn block(&mut self, id: BlockId) -> Result<(), String> {
        let Some(block) = self.body.blocks.get(id.index()) else { return Err(format!("no block {id:?}")) };
        if std::mem::replace(&mut self.entered[id.index()], true) {
            return Err(format!("{id:?} is in two places"));
        }
        for inst in &block.insts {
            self.inst(inst).map_err(|e| format!("{e} (in {:?})", inst.op))?;
        }
        Ok(())
    }

    /// Checks a nested block with the yields that it defines, then hides its definitions.
    fn nested(&mut self, id: BlockId, params: &[ValueId], yields: &[ValueId]) -> Result<(), String> {
        let mark = self.scope.len();
        params.iter().try_for_each(|p| self.define(*p))?;
        self.block(id)?;
        yields.iter().try_for_each(|v| self.used(*v))?;
        for v in self.scope.split_off(mark) {
            self.defined[v.index()] = false;
        }
        Ok(())
    }

    fn inst(&mut self, inst: &Inst) -> Result<(), String> {
        match &inst.op {
            Op::Const(value) => self.results(inst, &[value.kind()])?,
            Op::Global(global) | Op::GlobalDeriv(global, _) => self.results(inst, &[global_kind(*global)])?,
            Op::Input(index) => match self.body.inputs.get(*index as usize) {
                Some(input) => self.results(inst, &[input.value.kind()])?,
                None => return Err(format!("no input {index}")),
            },
            Op::Lane(op, args) => {
                args.iter().try_for_each(|a| self.used(*a))?;
                self.lane(*op, args, &inst.results)?;
            }
            Op::Kernel(kernel, args) => {
                args.iter().try_for_each(|a| self.used(*a))?;
                kernel.reads().into_iter().chain(kernel.writes()).try_for_each(|s| self.array(s, true))?;
                self.known(&inst.results)?;
                if !kernel::fits(kernel, args, &inst.results, |v| self.kind(v)) {
                    let kinds = |list: &[ValueId]| list.iter().map(|v| self.kind(*v)).collect::<Vec<_>>();
                    let (args, results) = (kinds(args), kinds(&inst.results));
                    return Err(format!("the kernel does not take {args:?} for {results:?}"));
                }
            }
            Op::Share(_, roots) => {
                roots.iter().try_for_each(|v| self.used(*v))?;
                self.kinds(roots, &inst.results, "values per cell")?;
            }
            Op::Derivative(of, _) => {
                self.used(*of)?;
                self.results(inst, &[self.kind(*of)])?;
            }
            Op::Load(s) => {
                self.array(*s, false)?;
                self.results(inst, &[self.body.slot(*s).kind])?;
            }
            Op::Store(s, v) => {
                self.array(*s, false)?;
                self.stored(*s, *v)?;
                self.results(inst, &[])?;
            }
            Op::LoadElement(s, i) => {
                self.array(*s, true)?;
                self.int(*i, "index")?;
                self.results(inst, &[self.body.slot(*s).kind])?;
            }
            Op::StoreElement(s, i, v) => {
                self.array(*s, true)?;
                self.int(*i, "index")?;
                self.stored(*s, *v)?;
                self.results(inst, &[])?;
            }
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                self.int(*cond, "condition")?;
                self.nested(*then, &[], then_yields)?;
                self.nested(*otherwise, &[], else_yields)?;
                self.kinds(then_yields, else_yields, "yields")?;
                self.kinds(then_yields, &inst.results, "results")?;
            }
            Op::Loop { init, params, body, cond, next } => {
                init.iter().try_for_each(|v| self.used(*v))?;
                let mut yields = next.clone();
                yields.push(*cond);
                self.nested(*body, params, &yields)?;
                if self.kind(*cond) != Kind::Int {
                    return Err(format!("condition {cond:?} is no int"));
                }
                self.kinds(init, params, "first values")?;
                self.kinds(next, params, "next values")?;
                self.kinds(params, &inst.results, "results")?;
            }
        }
        self.per_cell(inst)?;
        inst.results.iter().try_for_each(|r| self.define(*r))
    }

    fn per_cell(&self, inst: &Inst) -> Result<(), String> {
        let group = inst.results.iter().find_map(|r| match self.body.value(*r).rate {
            Rate::PerCell(group) => Some(group),
            _ => None,
        });
        let (Some(group), false) = (group, matches!(inst.op, Op::Share(..))) else { return Ok(()) };
        let mut fits = true;
        inst.op.for_each_use(|v| {
            fits &= match self.body.value(v).rate {
                Rate::Uniform => true,
                Rate::PerCell(of) => of == group,
                Rate::Varying => false,
            };
        });
        if fits { Ok(()) } else { Err("made of more than what points share".to_string()) }
    }

    fn lane(&self, op: LaneOp, args: &[ValueId], results: &[ValueId]) -> Result<(), String> {
        let shape = op.shape();
        let fits = |want: Kind, have: Kind| {
            want == have || (shape.per_component && want == Kind::Float && have == Kind::Triple)
        };
        let args_fit = args.len() == shape.args.len()
            && args.iter().zip(shape.args).all(|(a, k)| fits(*k, self.kind(*a)));
        let result = op.result_kind(args.iter().map(|a| self.kind(*a)));
        let ok = args_fit && results.len() == 1 && results.iter().all(|r| self.kind(*r) == result);
        if ok { Ok(()) } else { Err(format!("`{}` does not take these", op.text())) }
    }
}
