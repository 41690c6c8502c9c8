//! Lowering: from the resolved tree to IR.
//!
//! Functions are inlined (the language has no recursion), structs become one slot for each part, scalar
//! variables are slots that the `ssa` pass turns into values, and jumps become flags that guard what follows
//! them: only `If` and `Loop` remain. Parameter values are constants here, so that later passes specialise
//! the program on them. It must not know lanes or registers.

mod call;
mod checks;
mod expr;
mod first_use;
mod flow;
mod joins;
mod layers;
mod place;
mod placement;
mod stmt;
mod wiring;

use crate::builtins::Names;
use crate::group::{Group, Layer, Rules};
use crate::hir::{Init, Program, VarId, VarKind};
use crate::ir::{Body, Builder, Const, Excess, Kind, Slot, SlotId, ValueId};
use crate::params::ParamValues;
use crate::types::{Base, Extent, Type};
use osl_limits::{Compiling, Limits};
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::rc::Rc;
use std::sync::Arc;

/// The program grows beyond its budget when functions are inlined.
pub const TOO_LARGE: Code = Code { id: "E0601", name: "program-too-large" };
/// A call of an operation that only another renderer knows.
pub const NO_OPERATION: Code = Code { id: "E0602", name: "no-operation" };

/// What a group is called that has no name.
const UNNAMED: &str = "unnamed_group_1";

/// What a renderer asks of a shader or a group.
#[derive(Clone, Debug, Default)]
pub struct Requests {
    /// Outputs of layers before the last: `layer.output` of one layer, which becomes an output of the body, `output` of
    /// each layer that has one. Such a layer runs at every point, before the last.
    pub outputs: Vec<Arc<str>>,
    /// Outputs of the last layer.
    pub last: Last,
    /// Whether the body gets [`Note`](crate::ir::Note)s of what its source does.
    pub notes: bool,
    /// How large the body may become.
    pub limits: Limits,
}

/// Which outputs of the last layer a renderer takes: they count as connected.
#[derive(Clone, Debug, Default)]
pub enum Last {
    /// All.
    #[default]
    All,
    /// Those of these names: `output`, `output.field`, with or without `layer.` before. Others are no outputs of the
    /// body, and layers that only they need do not run.
    Named(Vec<Arc<str>>),
    /// Nobody says that it takes any, yet all are outputs of the body.
    None,
}

/// Lowers a program for the given parameter values; nothing is asked of it.
///
/// # Errors
/// The program exceeds its budget or uses what cannot be run yet. Values that do not suit their parameter
/// are ignored: see [`crate::params`].
pub fn lower(program: &Program, params: &ParamValues) -> Result<Body, Vec<Diagnostic>> {
    lower_for(program, params, &Requests { last: Last::None, ..Requests::default() })
}

/// Lowers a program for what a renderer asks of it.
///
/// # Errors
/// Those of [`lower`].
pub fn lower_for(
    program: &Program,
    params: &ParamValues,
    requests: &Requests,
) -> Result<Body, Vec<Diagnostic>> {
    let shader = program.shader.name.clone();
    let names = Names { layer: format!("{shader}_0").into(), group: UNNAMED.into(), shader };
    layers::lower(&[View { program, values: params, names, base: 0 }], &[], &Rules::default(), requests)
}

/// Lowers a group to one body: all outputs of its last layer, and those of other layers that `outputs` names, as in
/// [`Requests`].
///
/// # Errors
/// The group exceeds its budget.
pub fn lower_group(group: &Group, outputs: &[Arc<str>]) -> Result<Body, Vec<Diagnostic>> {
    lower_group_for(group, &Requests { outputs: outputs.to_vec(), ..Requests::default() })
}

/// Lowers a group to one body for what a renderer asks of it. A layer runs where its values are needed, once at most. The
/// rules of the group say what else runs.
///
/// # Errors
/// Those of [`lower_group`].
pub fn lower_group_for(group: &Group, requests: &Requests) -> Result<Body, Vec<Diagnostic>> {
    let mut views = Vec::new();
    for Layer { name, program, values, base } in &group.layers {
        let (shader, layer) = (program.shader.name.clone(), name.clone());
        views.push(View {
            program,
            values,
            names: Names { shader, layer, group: group.name.clone() },
            base: *base,
        });
    }
    layers::lower(&views, &group.connections, &group.rules, requests)
}

/// A layer as lowering sees it.
struct View<'a> {
    program: &'a Program,
    values: &'a ParamValues,
    names: Names,
    /// What to add to spans of the program.
    base: u32,
}

/// Where a variable lives: one slot for each part that is no struct.
#[derive(Clone, Debug)]
enum Storage {
    Leaf(SlotId),
    /// Shared: each use of a variable asks for its storage, and a struct may have very many parts.
    Struct(Rc<[Storage]>),
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
    /// The layer that is being lowered, and its program.
    layer: &'a View<'a>,
    rules: &'a Rules,
    program: &'a Program,
    /// How parts of its parameters are connected: 1 from upstream, 2 downstream or to the renderer, 3 both.
    connected: FxHashMap<SlotId, i32>,
    b: Builder,
    vars: Vec<Option<Storage>>,
    frames: Vec<Frame>,
    diagnostics: Vec<Diagnostic>,
    /// Set once the budget is used up: nothing more is lowered.
    full: bool,
    /// Calls of `exit` so far.
    exits: u32,
    /// Blocks around the code that is being lowered.
    depth: u32,
    /// Whether some points may have ended the shader within the statement that is being lowered.
    unsure: bool,
    /// What checks have to know.
    checking: checks::Checking,
}

impl<'a> Lowerer<'a> {
    /// Says where in the source the next instructions come from.
    fn at(&mut self, span: Span) {
        self.b.span = span.moved(self.layer.base);
    }

    /// Reports that the budget is used up, and lowers nothing more.
    fn too_large(&mut self, what: &str) {
        self.full = true;
        self.diagnostics.push(Diagnostic::error(TOO_LARGE, self.b.span, what));
    }

    /// Whether there is room for more; reports once where there is not.
    fn has_room(&mut self) -> bool {
        if !self.full
            && let Some(excess) = self.b.excess()
        {
            self.full = true;
            let Compiling { values, variables, array_words, name_bytes, .. } = self.b.limits;
            let may = match excess {
                Excess::Size => format!("{values} values and {variables} variables"),
                Excess::Arrays => format!("{array_words} words of arrays for each point"),
                Excess::Names => format!("{name_bytes} bytes of names of variables"),
            };
            let message = "the program is too large once its functions are inlined";
            let d = Diagnostic::error(TOO_LARGE, self.b.span, message).note(format!("it may have {may}"));
            self.diagnostics.push(d);
        }
        !self.full
    }

    /// Gives a parameter its instance value, or else its default. Fields are set by name, `s.a`.
    fn param(&mut self, storage: &Storage, ty: Type, name: &str, init: &Init, params: &ParamValues) {
        if let (Storage::Struct(parts), Base::Struct(id)) = (storage, ty.base) {
            self.store_init(storage, ty, init);
            let program = self.program;
            for (part, field) in parts.iter().zip(&program.structs.get(id).fields) {
                let name = format!("{name}.{}", field.name);
                if params.get(&name).is_some() {
                    // What the values leave out is zero, not the default.
                    self.clear(part);
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

    /// Makes the elements of an array zero.
    fn clear(&mut self, storage: &Storage) {
        let Storage::Leaf(slot) = storage else { return };
        let Slot { kind, len, .. } = self.b.body.slot(*slot).clone();
        for index in 0..len.unwrap_or(0) {
            if !self.has_room() {
                return;
            }
            let (index, zero) = (self.b.int(index as i32), self.b.constant(Const::zero(kind)));
            self.b.store_element(*slot, index, zero);
        }
    }

    fn store_constants(&mut self, slot: SlotId, ty: Type, values: &[Const]) {
        for (index, value) in values.iter().enumerate() {
            if !self.has_room() {
                return;
            }
            let value = self.b.constant(value.clone());
            let element = ty.is_array().then(|| self.b.int(index as i32));
            match element {
                Some(index) => self.b.store_element(slot, index, value),
                None => self.b.store(slot, value),
            }
            self.note_set(slot, element, value);
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
            let program = self.program;
            let mut parts = Vec::new();
            for field in &program.structs.get(id).fields {
                // Nothing more is lowered, so that nobody misses the parts that are left out.
                if !self.has_room() {
                    break;
                }
                let inner = match field.ty.extent {
                    Extent::Array(n) => Some(n),
                    _ => len,
                };
                parts.push(self.allocate_base(field.ty.base, inner, &format!("{name}.{}", field.name)));
            }
            return Storage::Struct(parts.into());
        }
        Storage::Leaf(self.b.slot(kind_of(base), len, name.into()))
    }
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
