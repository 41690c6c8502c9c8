//! Notes about the source for the follower of a point: values of variables, and calls of functions.
//!
//! A note uses the names that the source uses at its place: a formal that is an alias for a variable of the
//! caller has its own name within the function. Without notes this module writes nothing.

use super::{Lowerer, Storage};
use osl_hir::builtins::Array;
use osl_hir::hir::{CHAIN, FunctionId, Lvalue, Step, VarId, VarKind};
use osl_ir::ir::{Axis, Kind, Note, SlotId, ValueId, note_text};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The state of lowering for its notes.
#[derive(Debug, Default)]
pub(super) struct Telling {
    /// The statement that is being lowered: values that it sets belong to its line.
    pub(super) here: Span,
    /// The names of slots, where they differ from those of their variables.
    names: FxHashMap<SlotId, Arc<str>>,
    /// Whether values have their derivatives.
    derivs: bool,
}

impl Telling {
    pub(super) fn new(derivs: bool) -> Telling {
        Telling { derivs, ..Telling::default() }
    }
}

/// Names that a function had replaced.
pub(super) type Replaced = Vec<(SlotId, Option<Arc<str>>)>;

/// The name of the value that a function returns, in the notes of its statements.
const RETURNED: &str = "return";

/// The longest array whose elements are recorded after a call wrote it.
const MAX_WRITTEN: u32 = 256;

/// The most elements of an array that are told as arguments of a call.
const MAX_TOLD: u32 = 16;

impl Lowerer<'_> {
    /// Records that a variable has a new value. It follows the store directly.
    pub(super) fn note_set(&mut self, slot: SlotId, element: Option<ValueId>, value: ValueId) {
        if !self.b.notes {
            return;
        }
        let args = [element, Some(value)];
        let mut args: Vec<ValueId> = args.into_iter().flatten().collect();
        let name = self.told_name(slot);
        if name.is_empty() || &*name == CHAIN {
            return;
        }
        if self.telling.derivs && matches!(self.b.body.kind(value), Kind::Float | Kind::Triple) {
            args.extend([Axis::X, Axis::Y].map(|axis| self.b.derivative(value, axis)));
        }
        let outer = self.b.span;
        if self.telling.here != Span::default() {
            self.b.span = self.telling.here;
        }
        self.b.note(&args, |_| Note::Set(name));
        self.b.span = outer;
    }

    /// Records the values of a variable that a call wrote. It stores each value again, since a note follows
    /// its store.
    pub(super) fn note_written(&mut self, storage: &Storage) {
        if !self.b.notes {
            return;
        }
        match storage {
            Storage::Struct(parts) => parts.iter().for_each(|part| self.note_written(part)),
            Storage::Leaf(slot) => {
                let len = self.b.body.slot(*slot).len;
                if len.is_some_and(|len| len > MAX_WRITTEN) {
                    return;
                }
                self.where_live(|l| {
                    for index in 0..len.unwrap_or(1) {
                        if !l.has_room() {
                            return;
                        }
                        let element = len.map(|_| l.b.int(index as i32));
                        let value = match element {
                            Some(element) => l.b.load_element(*slot, element),
                            None => l.b.load(*slot),
                        };
                        match element {
                            Some(element) => l.b.store_element(*slot, element, value),
                            None => l.b.store(*slot, value),
                        }
                        l.note_set(*slot, element, value);
                    }
                });
            }
        }
    }

    /// Names the parts of arrays of structs as the source does: `a[].x` is the part `x` of all elements.
    pub(super) fn name_arrays(&mut self, storage: &Storage, ty: Type, name: &str) {
        if self.b.notes {
            let mut parts = Vec::new();
            self.parts(storage, ty, name, &mut parts);
            parts.retain(|(_, name)| name.contains('['));
            self.name_all(parts);
        }
    }

    /// The arguments of a call as they are told. Each array after the first `fixed` arguments stands for its
    /// elements, since the call gets these; any other array is told by its first element.
    pub(super) fn told_arguments(
        &mut self,
        (args, arrays): (&[ValueId], &[Option<Array>]),
        fixed: usize,
    ) -> Vec<ValueId> {
        let mut told = Vec::new();
        for (at, (arg, array)) in args.iter().zip(arrays).enumerate() {
            match array {
                Some(array) if at >= fixed => {
                    for index in 0..array.len.min(MAX_TOLD) {
                        let index = self.b.int(index as i32);
                        told.push(self.b.load_element(array.slot, index));
                    }
                }
                _ => told.push(*arg),
            }
        }
        told.truncate(u8::MAX.into());
        told
    }

    /// The name of a slot, followed by the lengths of arrays within its elements. In the name of a part of
    /// structs, `[]` stands where the index of the outermost array belongs, and the lengths in their places.
    fn told_name(&self, slot: SlotId) -> Arc<str> {
        let own = self.telling.names.get(&slot).unwrap_or(&self.b.body.slot(slot).name);
        match self.inner.get(&slot) {
            Some(lens) if !own.is_empty() && !own.contains('[') => {
                let lens: String = lens.iter().map(|len| format!("[{len}]")).collect();
                format!("{own}{lens}").into()
            }
            _ => own.clone(),
        }
    }

    /// Keeps the storage of an argument silent: the note of the call tells its value.
    pub(super) fn silence(&mut self, storage: &Storage) {
        match storage {
            _ if !self.b.notes => {}
            Storage::Struct(parts) => parts.iter().for_each(|part| self.silence(part)),
            Storage::Leaf(slot) => drop(self.telling.names.insert(*slot, "".into())),
        }
    }

    /// Gives the storage of formals, and of the result, the names that they have in the function.
    pub(super) fn begin_names(
        &mut self,
        formals: &[(VarId, Storage)],
        result: Option<(&Storage, Type)>,
    ) -> Replaced {
        let mut parts = Vec::new();
        if self.b.notes {
            for (formal, storage) in formals {
                let var = &self.program.vars[formal.0 as usize];
                self.parts(storage, var.ty, &var.name, &mut parts);
            }
            if let Some((storage, ty)) = result {
                self.parts(storage, ty, RETURNED, &mut parts);
            }
        }
        self.name_all(parts)
    }

    /// The name that a place has in the source, with its type, if its storage goes by another name now: a
    /// function inside the shader may write a variable that is also its argument.
    pub(super) fn told_at(&self, place: &Lvalue, storage: &Storage) -> Option<(String, Type)> {
        let slot = storage.first().filter(|_| self.b.notes)?;
        self.telling.names.get(&slot)?;
        let var = self.program.vars.get(place.var.0 as usize)?;
        let (mut name, mut ty) = (var.name.to_string(), var.ty);
        for step in &place.path {
            if let Step::Field(index) = step {
                let field = self.program.structs.get(ty.as_struct()?).fields.get(*index as usize)?;
                name = format!("{}.{}", indexed(name, ty), field.name);
                ty = field.ty;
            }
        }
        Some((name, ty))
    }

    /// Gives storage another name.
    pub(super) fn rename(&mut self, storage: &Storage, ty: Type, name: &str) -> Replaced {
        let mut parts = Vec::new();
        self.parts(storage, ty, name, &mut parts);
        self.name_all(parts)
    }

    fn name_all(&mut self, parts: Vec<(SlotId, String)>) -> Replaced {
        let names = &mut self.telling.names;
        parts.into_iter().map(|(slot, name)| (slot, names.insert(slot, name.into()))).collect()
    }

    /// Ends the names of a function.
    pub(super) fn end_names(&mut self, replaced: Replaced) {
        for (slot, name) in replaced.into_iter().rev() {
            match name {
                Some(name) => self.telling.names.insert(slot, name),
                None => self.telling.names.remove(&slot),
            };
        }
    }

    /// The slots of a variable, with the names of its parts.
    fn parts(&self, storage: &Storage, ty: Type, name: &str, out: &mut Vec<(SlotId, String)>) {
        match (storage, ty.base) {
            (Storage::Leaf(slot), _) if name.contains('[') => out.push((*slot, indexed(name.into(), ty))),
            (Storage::Leaf(slot), _) => out.push((*slot, name.to_string())),
            (Storage::Struct(parts), Base::Struct(id)) => {
                let name = indexed(name.into(), ty);
                for (part, field) in parts.iter().zip(&self.program.structs.get(id).fields) {
                    self.parts(part, field.ty, &format!("{name}.{}", field.name), out);
                }
            }
            (Storage::Struct(_), _) => {}
        }
    }

    /// The values of the parts of variables that are not arrays, with their names.
    fn values_of(&mut self, list: Vec<(SlotId, String)>) -> (Vec<ValueId>, Arc<str>) {
        let (mut values, mut names) = (Vec::new(), Vec::new());
        for (slot, name) in list {
            if self.b.body.slot(slot).len.is_none() && self.has_room() {
                values.push(self.b.load(slot));
                names.push(Arc::from(name));
            }
        }
        (values, note_text(&names))
    }

    /// Records that a function is entered.
    pub(super) fn note_enter(&mut self, id: FunctionId, formals: &[(VarId, Storage)], call: Span) {
        if !self.b.notes {
            return;
        }
        let mut parts = Vec::new();
        for (formal, storage) in formals {
            let var = &self.program.vars[formal.0 as usize];
            if var.kind != (VarKind::Formal { output: true }) {
                self.parts(storage, var.ty, &var.name, &mut parts);
            }
        }
        let (values, names) = self.values_of(parts);
        let form = self.form_of(id).into();
        let why = self.chosen(call).into();
        self.b.note(&values, |_| Note::Enter { form, why, names });
    }

    /// Records the result of a function and the values of its outputs.
    pub(super) fn note_result(&mut self, formals: &[(VarId, Storage)], result: Option<(&Storage, Type)>) {
        if !self.b.notes {
            return;
        }
        let mut parts = Vec::new();
        if let Some((storage, ty)) = result {
            self.parts(storage, ty, "", &mut parts);
        }
        for (formal, storage) in formals {
            let var = &self.program.vars[formal.0 as usize];
            if var.kind == (VarKind::Formal { output: true }) {
                self.parts(storage, var.ty, &var.name, &mut parts);
            }
        }
        let (values, names) = self.values_of(parts);
        self.b.note(&values, |_| Note::Result { names });
    }

    /// Why a call takes its function, if there was a choice; a line for each function that is not taken
    /// follows.
    pub(super) fn chosen(&self, call: Span) -> String {
        let Some(choice) = self.program.choices.get(&call.start) else { return String::new() };
        let mut why = match choice.by_result {
            Some((equal, ty)) => {
                format!("{equal} of them fit, and the expected result is {}", self.program.structs.show(ty))
            }
            None => String::new(),
        };
        for (other, reason) in &choice.others {
            why += &format!("\nnot {other}: {reason}");
        }
        why
    }

    /// A function as it was declared.
    fn form_of(&self, id: FunctionId) -> String {
        let Some(function) = self.program.functions.get(id.0 as usize) else { return String::new() };
        let formals = function.formals.iter().map(|formal| {
            let var = &self.program.vars[formal.0 as usize];
            let output = if var.kind == (VarKind::Formal { output: true }) { "output " } else { "" };
            format!("{output}{} {}", self.program.structs.show(var.ty), var.name)
        });
        let formals: Vec<String> = formals.collect();
        format!("{} {}({})", self.program.structs.show(function.ret), function.name, formals.join(", "))
    }
}

/// The name of an array, with a place for its index: `[]` for the outermost array, and the length otherwise.
fn indexed(name: String, ty: Type) -> String {
    match ty.extent {
        Extent::One => name,
        Extent::Array(len) if name.contains('[') => format!("{name}[{len}]"),
        _ => name + "[]",
    }
}
