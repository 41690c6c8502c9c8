//! Lowering: from the resolved tree to IR.
//!
//! Functions are inlined (the language has no recursion), structs become one slot for each part, scalar
//! variables are slots that the `ssa` pass turns into values, and jumps become flags that guard what follows
//! them: only `If` and `Loop` remain. Parameter values are constants here, so that later passes specialise
//! the program on them. It must not know lanes or registers.

mod call;
mod expr;
mod flow;
mod place;
mod stmt;

use crate::hir::{self, Global, Init, Program, VarId, VarKind};
use crate::ir::{Body, Builder, Const, Inst, Kernel, Kind, Op, Output, SlotId, Source, ValueId};
use crate::params::ParamValues;
use crate::types::{Base, Extent, Type};
use flow::Flow;
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;

/// The program grows beyond its budget when functions are inlined.
pub const TOO_LARGE: Code = Code { id: "E0601", name: "program-too-large" };

/// Values that a program may have: far above any shader that people write, and some 150 megabytes.
const MAX_VALUES: usize = 500_000;
/// Words of arrays that a program may have, for each point: 4 MiB. Sixteen points are the least that run together.
const MAX_ARRAY_WORDS: u64 = 1 << 20;

/// Where `Ci` stands among the globals.
const CI: usize = hir::GLOBALS.len() - 1;

/// Lowers a program for the given parameter values.
///
/// # Errors
/// The program exceeds its budget or uses what cannot be run yet. Values that do not suit their parameter
/// are ignored: see [`crate::params`].
pub fn lower(program: &Program, params: &ParamValues) -> Result<Body, Vec<Diagnostic>> {
    let (mut b, mut diagnostics) = write(program, params, false);
    if b.messages_by_name && !b.messages.is_empty() {
        // Those before the first computed name are variables of the body, where it would not find them.
        (b, diagnostics) = write(program, params, true);
    }
    if diagnostics.is_empty() { Ok(b.body) } else { Err(diagnostics) }
}

/// Writes the body, with messages that are found by name from the start or from the first computed name on.
fn write(program: &Program, params: &ParamValues, messages_by_name: bool) -> (Builder, Vec<Diagnostic>) {
    let mut lowerer = Lowerer {
        program,
        b: Builder::new(program.shader.name.clone()),
        vars: vec![None; program.vars.len()],
        frames: Vec::new(),
        diagnostics: Vec::new(),
        array_words: 0,
        full: false,
        exits: 0,
        unsure: false,
    };
    lowerer.b.messages_by_name = messages_by_name;
    lowerer.globals();
    lowerer.shader(params);
    let Lowerer { b, diagnostics, .. } = lowerer;
    (b, diagnostics)
}

/// Where a variable lives: one slot for each part that is no struct.
#[derive(Clone, Debug)]
enum Storage {
    Leaf(SlotId),
    Struct(Vec<Storage>),
}

impl Storage {
    /// The slot of the first part.
    fn first(&self) -> Option<SlotId> {
        match self {
            Storage::Leaf(slot) => Some(*slot),
            Storage::Struct(parts) => parts.first()?.first(),
        }
    }
}

/// A loop that is being lowered.
#[derive(Clone, Copy, Debug)]
struct LoopFlags {
    broke: SlotId,
    continued: SlotId,
}

/// A function, or the shader, that is being lowered.
#[derive(Debug)]
struct Frame {
    /// Where the value of a `return` goes, and its type.
    ret: Option<(Storage, Type)>,
    returned: SlotId,
    loops: Vec<LoopFlags>,
}

/// The value of an expression.
#[derive(Clone, Debug)]
enum Val {
    /// A scalar, triple, matrix, string or closure.
    One(ValueId),
    /// A struct or array, where it lies; `None` is no element, else that of each leaf.
    Stored(Storage, Option<ValueId>),
    /// No value.
    Void,
}

struct Lowerer<'a> {
    program: &'a Program,
    b: Builder,
    vars: Vec<Option<Storage>>,
    frames: Vec<Frame>,
    diagnostics: Vec<Diagnostic>,
    array_words: u64,
    /// Set once the budget is used up: nothing more is lowered.
    full: bool,
    /// Calls of `exit` so far.
    exits: u32,
    /// Whether some points may have ended the shader within the statement that is being lowered.
    unsure: bool,
}

impl<'a> Lowerer<'a> {
    /// Reports that the budget is used up, and lowers nothing more.
    fn too_large(&mut self, span: Span, what: &str) {
        self.full = true;
        self.diagnostics.push(Diagnostic::error(TOO_LARGE, span, what));
    }

    /// Whether there is room for more; reports once where there is not.
    fn has_room(&mut self) -> bool {
        if !self.full && (self.b.body.values.len() > MAX_VALUES || self.array_words > MAX_ARRAY_WORDS) {
            self.full = true;
            let d = Diagnostic::error(
                TOO_LARGE,
                self.b.span,
                "the program is too large once its functions are inlined",
            )
            .note(format!(
                "it may have {MAX_VALUES} values and {MAX_ARRAY_WORDS} words of arrays for each point"
            ));
            self.diagnostics.push(d);
        }
        !self.full
    }

    fn globals(&mut self) {
        for (index, (global, name, ty, _)) in hir::GLOBALS.iter().enumerate() {
            let kind = kind_of(ty.base);
            let slot = self.b.slot(kind, None, (*name).into());
            let value = if *global == Global::Ci {
                self.b.constant(Const::Null)
            } else {
                self.b.global(*global, kind)
            };
            self.b.store(slot, value);
            self.bind(VarId(index as u32), Storage::Leaf(slot));
        }
    }

    fn shader(&mut self, params: &ParamValues) {
        let program = self.program;
        let returned = self.flag("returned");
        self.frames.push(Frame { ret: None, returned, loops: Vec::new() });
        for param in &program.shader.params {
            let var = &program.vars[param.var.0 as usize];
            self.b.span = var.span;
            let ty = self.param_type(param, var, params);
            let storage = self.allocate(ty, &var.name);
            self.param(&storage, ty, &var.name, &param.init, params);
            if is_interpolated(param) || params.is_interpolated(&var.name) {
                self.interpolate(&storage, ty, &var.name);
            }
            self.bind(param.var, storage);
        }
        self.unsure = false;
        if self.exits == 0 {
            self.stmts(&program.shader.body);
        } else {
            self.guarded(Flow { returns: true, ..Flow::default() }, |l| l.stmts(&program.shader.body));
        }
        for param in program.shader.params.iter().filter(|p| p.output) {
            let var = &program.vars[param.var.0 as usize];
            if let Some(storage) = self.storage(param.var) {
                self.output(&storage, var.ty, var.name.to_string());
            }
        }
        self.light();
    }

    /// The type of a parameter; an open array has the length of its value.
    fn param_type(&self, param: &hir::Param, var: &hir::Var, params: &ParamValues) -> Type {
        match params.get(&var.name) {
            Some(values) if param.open => {
                Type { extent: Extent::Array(values.len().max(1) as u32), ..var.ty }
            }
            _ => var.ty,
        }
    }

    /// Takes the value that the point has for a parameter's name and type, where it has one.
    fn interpolate(&mut self, storage: &Storage, ty: Type, name: &str) {
        let Storage::Leaf(slot) = storage else { return };
        let kind = kind_of(ty.base);
        if ty.is_array() || kind == Kind::Closure {
            return;
        }
        let (object, whole) = (self.b.constant(Const::Str("".into())), self.b.int(-1));
        let name = self.b.constant(Const::Str(name.into()));
        let kernel = Kernel::Attribute { kind, count: 0, tangents: false };
        let found = self.b.kernel_of(kernel, &[object, name, whole], &[kind, Kind::Int]);
        if let [value, found] = found[..] {
            let own = self.b.load(*slot);
            let value = self.b.choose(found, value, own);
            self.b.store(*slot, value);
        }
    }

    /// The closure of the surface is an output of shaders that write it.
    fn light(&mut self) {
        let Some(Some(Storage::Leaf(slot))) = self.vars.get(CI).cloned() else { return };
        let writes = |inst: &Inst| matches!(inst.op, Op::Store(to, _) if to == slot);
        // The first write is its null to start with.
        let count = self.b.body.blocks.iter().flat_map(|b| &b.insts).filter(|i| writes(i)).count();
        if count > 1 {
            let output = Output { name: "Ci".into(), ty: Type::CLOSURE, source: Source::Slot(slot) };
            self.b.body.outputs.push(output);
        }
    }

    /// Gives a parameter its instance value, or else its default. Fields are set by name, `s.a`.
    fn param(&mut self, storage: &Storage, ty: Type, name: &str, init: &Init, params: &ParamValues) {
        if let (Storage::Struct(parts), Base::Struct(id)) = (storage, ty.base) {
            self.store_init(storage, ty, init);
            let fields = self.program.structs.get(id).fields.clone();
            for (part, field) in parts.iter().zip(&fields) {
                let name = format!("{name}.{}", field.name);
                if params.get(&name).is_some() {
                    self.param(part, field.ty, &name, &Init::List(Vec::new()), params);
                }
            }
            return;
        }
        match (storage, params.get(name)) {
            (Storage::Leaf(slot), Some(values)) => self.store_constants(*slot, ty, values),
            _ => self.store_init(storage, ty, init),
        }
    }

    fn store_constants(&mut self, slot: SlotId, ty: Type, values: &[Const]) {
        for (index, value) in values.iter().enumerate() {
            let value = self.b.constant(value.clone());
            if ty.is_array() {
                let index = self.b.int(index as i32);
                self.b.store_element(slot, index, value);
            } else {
                self.b.store(slot, value);
            }
        }
    }

    fn output(&mut self, storage: &Storage, ty: Type, name: String) {
        match (storage, ty.base) {
            (Storage::Struct(parts), Base::Struct(id)) => {
                for (part, field) in parts.iter().zip(&self.program.structs.get(id).fields.clone()) {
                    self.output(part, field.ty, format!("{name}.{}", field.name));
                }
            }
            (Storage::Leaf(slot), _) => {
                self.b.body.outputs.push(Output { name: name.into(), ty, source: Source::Slot(*slot) });
            }
            _ => {}
        }
    }

    fn bind(&mut self, var: VarId, storage: Storage) {
        if let Some(place) = self.vars.get_mut(var.0 as usize) {
            *place = Some(storage);
        }
    }

    /// Where a variable lives. A variable that was never declared on this path gets storage of its own.
    fn storage(&mut self, var: VarId) -> Option<Storage> {
        if let Some(Some(storage)) = self.vars.get(var.0 as usize) {
            return Some(storage.clone());
        }
        let decl = &self.program.vars[var.0 as usize];
        debug_assert!(!matches!(decl.kind, VarKind::Global(_)));
        let storage = self.allocate(decl.ty, &decl.name);
        self.bind(var, storage.clone());
        Some(storage)
    }

    fn flag(&mut self, name: &str) -> SlotId {
        let slot = self.b.slot(Kind::Int, None, name.into());
        self.set_flag(slot, 0);
        slot
    }

    fn set_flag(&mut self, slot: SlotId, value: i32) {
        let value = self.b.int(value);
        self.b.store(slot, value);
    }

    /// New storage for a variable of a type.
    fn allocate(&mut self, ty: Type, name: &str) -> Storage {
        let len = match ty.extent {
            Extent::Array(n) => Some(n),
            // An open array is bound to its argument, whose storage has the length.
            Extent::Unsized => Some(1),
            Extent::One => None,
        };
        self.allocate_base(ty.base, len, name)
    }

    fn allocate_base(&mut self, base: Base, len: Option<u32>, name: &str) -> Storage {
        if let Base::Struct(id) = base {
            let fields = self.program.structs.get(id).fields.clone();
            let part = |l: &mut Self, f: &crate::types::Field| {
                let inner = match f.ty.extent {
                    Extent::Array(n) => Some(n),
                    _ => len,
                };
                l.allocate_base(f.ty.base, inner, &format!("{name}.{}", f.name))
            };
            return Storage::Struct(fields.iter().map(|f| part(self, f)).collect());
        }
        self.array_words += u64::from(len.unwrap_or(0)) * u64::from(kind_of(base).words());
        Storage::Leaf(self.b.slot(kind_of(base), len, name.into()))
    }
}

/// Whether metadata let the point's own value go before the parameter's.
fn is_interpolated(param: &hir::Param) -> bool {
    let says = |name: &str, value: f64| {
        param.metadata.iter().any(|(_, n, v)| &**n == name && *v == hir::MetaValue::Numbers(vec![value]))
    };
    says("lockgeom", 0.0) || says("interpolated", 1.0)
}

/// How values of a type are stored. Structs have no kind of their own and are never asked for.
pub(crate) fn kind_of(base: Base) -> Kind {
    match base {
        Base::Int | Base::Void | Base::Error | Base::Struct(_) => Kind::Int,
        Base::Float => Kind::Float,
        Base::Color | Base::Point | Base::Vector | Base::Normal => Kind::Triple,
        Base::Matrix => Kind::Matrix,
        Base::String => Kind::Str,
        Base::Closure => Kind::Closure,
    }
}
