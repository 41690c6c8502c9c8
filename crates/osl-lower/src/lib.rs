//! Lowering: from the resolved tree to IR, one body for a shader or a whole [`group`].
//!
//! Functions are inlined (the language has no recursion), structs become one slot for each part, scalar
//! variables become slots that the `ssa` pass turns into values, and jumps become flags that guard the code
//! after them: only `If` and `Loop` remain. Values of parameters ([`params`]) are constants here, so that
//! later passes specialise the program for them; only live parameters become inputs of the body.
//! [`components`] lowers closures for particular renderers. This crate must not know lanes or registers.

mod call;
mod checks;
pub mod components;
mod expr;
mod first_use;
mod flow;
pub mod group;
mod joins;
mod layers;
mod notes;
pub mod params;
mod place;
mod placement;
mod stmt;
pub mod taps;
mod wiring;

use crate::group::{Group, Layer, Rules};
use crate::params::ParamValues;
use crate::taps::{Tap, Tapping};
use osl_hir::hir::{Init, Program, TOO_LARGE, VarId, VarKind};
use osl_ir::ir::Names;
use osl_ir::ir::{Body, Builder, Const, Excess, Input, Kind, Slot, SlotId, ValueId};
use osl_ir::types::{Base, Extent, Type};
use osl_limits::{Compiling, Limits};
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::rc::Rc;
use std::sync::Arc;

/// A call of an operation that only another renderer knows.
pub const NO_OPERATION: Code = Code { id: "E0602", name: "no-operation" };

/// The name of a group without a name.
const UNNAMED: &str = "unnamed_group_1";

/// What a renderer requires of a shader or a group.
#[derive(Clone, Debug, Default)]
pub struct Requests {
    /// Outputs of layers before the last: `layer.output` of one layer, which becomes an output of the body,
    /// or `output` of each layer that has one. Such a layer runs at every point, before the last.
    pub outputs: Vec<Arc<str>>,
    /// Outputs of the last layer.
    pub last: Last,
    /// Whether the body gets [`Note`](osl_ir::ir::Note)s of what its source does.
    pub notes: bool,
    /// Whether the notes of variables have their derivatives. They may change the last bits of values.
    pub note_derivs: bool,
    /// Variables at a line that become outputs.
    pub taps: Vec<Tap>,
    /// The limits on the size of the body.
    pub limits: Limits,
}

/// The outputs of the last layer that a renderer takes: they count as connected.
#[derive(Clone, Debug, Default)]
pub enum Last {
    /// All.
    #[default]
    All,
    /// Those with these names: `output`, `output.field`, with or without `layer.` before. Others are not
    /// outputs of the body, and layers that only they need do not run.
    Named(Vec<Arc<str>>),
    /// None is taken, but all are outputs of the body.
    None,
}

/// Lowers a program for the given parameter values, without requirements of a renderer.
///
/// # Errors
/// The program exceeds its budget or uses an operation that cannot run. Values that do not fit their
/// parameter are ignored: see [`crate::params`].
pub fn lower(program: &Program, params: &ParamValues) -> Result<Body, Vec<Diagnostic>> {
    lower_for(program, params, &Requests { last: Last::None, ..Requests::default() })
}

/// Lowers a program for a renderer's requirements.
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

/// Lowers a group to one body: all outputs of its last layer, and those of other layers that `outputs` names,
/// as in [`Requests`].
///
/// # Errors
/// The group exceeds its budget.
pub fn lower_group(group: &Group, outputs: &[Arc<str>]) -> Result<Body, Vec<Diagnostic>> {
    lower_group_for(group, &Requests { outputs: outputs.to_vec(), ..Requests::default() })
}

/// Lowers a group to one body for a renderer's requirements. A layer runs where its values are needed, at
/// most once. The rules of the group determine which other layers run.
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

/// A layer, as seen by lowering.
struct View<'a> {
    program: &'a Program,
    values: &'a ParamValues,
    names: Names,
    /// The offset to add to spans of the program.
    base: u32,
}

/// The storage of a variable: one slot for each part that is not a struct.
type Storage = osl_hir::storage::Storage<SlotId>;

/// A loop that is being lowered.
#[derive(Clone, Copy, Debug)]
struct LoopFlags {
    broke: SlotId,
    continued: SlotId,
}

/// A function, or the shader, that is being lowered.
#[derive(Debug)]
struct Frame {
    /// The destination of a `return`'s value, and its type.
    ret: Option<(Storage, Type)>,
    returned: SlotId,
    loops: Vec<LoopFlags>,
}

/// An element of an array, or of arrays within arrays.
#[derive(Clone, Copy, Debug)]
struct Element {
    /// The number of the element among those of all arrays that surround it.
    index: ValueId,
    /// The number of indices that lead to it.
    depth: usize,
}

/// The value of an expression.
#[derive(Clone, Debug)]
enum Val {
    /// A scalar, triple, matrix, string or closure.
    One(ValueId),
    /// A struct or array, in its storage; `Some` is an element, applied to each part.
    Stored(Storage, Option<Element>),
    /// No value.
    Void,
}

struct Lowerer<'a> {
    /// The layer that is being lowered, and its program.
    layer: &'a View<'a>,
    rules: &'a Rules,
    program: &'a Program,
    /// How parts of its parameters are connected: 1 upstream, 2 downstream or to the renderer, 3 both.
    connected: FxHashMap<SlotId, i32>,
    b: Builder,
    vars: Vec<Option<Storage>>,
    /// The lengths of arrays within the elements of a slot, from the outermost.
    inner: FxHashMap<SlotId, Rc<[u32]>>,
    frames: Vec<Frame>,
    diagnostics: Vec<Diagnostic>,
    /// Set when the budget is used up: then nothing more is lowered.
    full: bool,
    /// Number of calls of `exit` so far.
    exits: u32,
    /// Nesting depth of blocks around the current code.
    depth: u32,
    /// Whether some points may have ended the shader within the current statement.
    unsure: bool,
    /// The state of the checks.
    checking: checks::Checking,
    /// The state of the notes.
    telling: notes::Telling,
    /// The taps.
    tapping: Tapping,
    /// All layers.
    views: &'a [View<'a>],
}

impl<'a> Lowerer<'a> {
    /// The program of a layer.
    fn program_of(&self, layer: usize) -> &'a Program {
        self.views.get(layer).map_or(self.program, |view| view.program)
    }

    /// Sets the source location of the next instructions.
    fn at(&mut self, span: Span) {
        self.b.span = span.moved(self.layer.base);
    }

    /// Reports that the budget is used up, and lowers nothing more.
    fn too_large(&mut self, what: &str) {
        self.full = true;
        self.diagnostics.push(Diagnostic::error(TOO_LARGE, self.b.span, what));
    }

    /// Whether there is room for more; reports an error once if there is not.
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
                    // Missing values are zero, not the default.
                    self.clear(part);
                    self.param(part, field.ty, &name, &Init::List(Vec::new()), params);
                }
            }
            return;
        }
        match (storage, params.get(name)) {
            (Storage::Leaf(slot), Some(values))
                if params.is_live(name) && !matches!(ty.base, Base::String | Base::Closure) =>
            {
                self.store_inputs(*slot, name, values);
            }
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

    /// Lets a parameter take its value when the program runs. All elements of an array do so, also those that
    /// have no value yet.
    fn store_inputs(&mut self, slot: SlotId, name: &str, values: &[Const]) {
        let Slot { kind, len, .. } = self.b.body.slot(slot).clone();
        let name: Arc<str> = format!("{}.{name}", self.layer.names.layer).into();
        for index in 0..len.unwrap_or(1) {
            if !self.has_room() {
                return;
            }
            let value = values.get(index as usize).cloned().unwrap_or_else(|| Const::zero(kind));
            let value = self.b.input(Input { name: name.clone(), element: len.map(|_| index), value });
            let element = len.map(|_| self.b.int(index as i32));
            match element {
                Some(index) => self.b.store_element(slot, index, value),
                None => self.b.store(slot, value),
            }
            self.note_set(slot, element, value);
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

    /// The storage of a variable. A variable that was never declared on this path gets new storage.
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
        let storage = self.allocate_within(ty, &[], name);
        self.name_arrays(&storage, ty, name);
        storage
    }

    /// New storage for a part of arrays with these lengths, from the outermost.
    fn allocate_within(&mut self, ty: Type, around: &[u32], name: &str) -> Storage {
        let mut lens = around.to_vec();
        match ty.extent {
            Extent::Array(n) => lens.push(n),
            // An open array is an alias for its argument, whose storage has the length.
            Extent::Unsized => lens.push(1),
            Extent::One => {}
        }
        if let Base::Struct(id) = ty.base {
            let program = self.program;
            let mut parts = Vec::new();
            for field in &program.structs.get(id).fields {
                // Nothing more is lowered, so the missing parts are never used.
                if !self.has_room() {
                    break;
                }
                parts.push(self.allocate_within(field.ty, &lens, &format!("{name}.{}", field.name)));
            }
            return Storage::Struct(parts.into());
        }
        Storage::Leaf(self.array_slot(kind_of(ty.base), &lens, name))
    }

    /// A new slot for arrays within arrays of these lengths, or for one value. The elements of the innermost
    /// array are side by side.
    fn array_slot(&mut self, kind: Kind, lens: &[u32], name: &str) -> SlotId {
        let len = lens.iter().copied().reduce(u32::saturating_mul);
        let slot = self.b.slot(kind, len, name.into());
        if let [_, inner @ ..] = lens
            && !inner.is_empty()
        {
            self.inner.insert(slot, inner.into());
        }
        slot
    }
}

/// How values of a type are stored. Structs have no kind and must not be passed.
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
