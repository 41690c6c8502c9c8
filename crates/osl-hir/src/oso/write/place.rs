//! Places: reading, writing and copying variables and their parts; storage for new ones.

use super::constant;
use super::table::{Class, Sym};
use super::{Leaf, Storage, Val, Writer};
use crate::hir::{Expr, ExprKind, Init, Lvalue, Step, VarId};
use crate::storage::Subscript;
use osl_ir::types::{Base, Extent, Type};

/// A place whose indices have been evaluated.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    pub(super) storage: Storage,
    pub(super) element: Option<Sym>,
    part: Subscript<Sym>,
}

impl Spot {
    pub(super) fn whole(storage: Storage) -> Spot {
        Spot { storage, element: None, part: Subscript::Whole }
    }

    /// Whether it is a variable, without any index.
    pub(super) fn is_plain(&self) -> bool {
        self.element.is_none() && matches!(self.part, Subscript::Whole)
    }
}

impl Writer<'_> {
    /// Evaluates the indices of a place. With `hold`, they keep their values whatever follows.
    pub(super) fn spot(&mut self, place: &Lvalue, hold: bool) -> Option<Spot> {
        let mut spot = Spot::whole(self.storage(place.var)?);
        for (at, step) in place.path.iter().enumerate() {
            let more = place.path.get(at + 1..).unwrap_or(&[]);
            let hold = hold || more.iter().flat_map(Step::indices).any(|index| !is_pure(index));
            match step {
                Step::Field(index) => {
                    spot.storage = spot.storage.field(*index as usize)?.clone();
                }
                Step::Element(index) => spot.element = Some(self.index(index, hold)),
                Step::Component(index) => spot.part = Subscript::Component(self.index(index, hold)),
                Step::Cell(row, column) => {
                    let row = self.index(row, hold || !is_pure(column));
                    spot.part = Subscript::Cell(row, self.index(column, hold));
                }
            }
        }
        Some(spot)
    }

    fn index(&mut self, e: &Expr, hold: bool) -> Sym {
        let value = self.value(e);
        if hold { self.settled(value) } else { value }
    }

    /// The value in a form that later operations do not change.
    pub(super) fn settled(&mut self, value: Sym) -> Sym {
        if !self.table.is_variable(value) {
            return value;
        }
        let ty = self.table.ty(value);
        self.emit_value("assign", ty, &[value])
    }

    /// The value at a spot.
    pub(super) fn read(&mut self, spot: &Spot) -> Val {
        let Some(leaf) = self.leaf(&spot.storage) else {
            return Val::Stored(spot.storage.clone(), spot.element);
        };
        let ty = self.table.ty(leaf);
        if ty.is_array() && spot.element.is_none() {
            return Val::Stored(spot.storage.clone(), None);
        }
        let whole = match spot.element {
            Some(index) => self.emit_value("aref", ty.element(), &[leaf, index]),
            None => leaf,
        };
        Val::One(match spot.part {
            Subscript::Whole => whole,
            Subscript::Component(index) => self.emit_value("compref", Type::FLOAT, &[whole, index]),
            Subscript::Cell(row, column) => self.emit_value("mxcompref", Type::FLOAT, &[whole, row, column]),
        })
    }

    /// Stores a value at a spot.
    pub(super) fn write(&mut self, spot: &Spot, value: Val) {
        let value = match (value, self.leaf(&spot.storage)) {
            (Val::One(value), Some(leaf)) => return self.write_leaf(leaf, spot, value),
            (Val::Stored(from, element), _) => (from, element),
            _ => return,
        };
        self.copy(&spot.storage, spot.element, &value.0, value.1);
    }

    fn write_leaf(&mut self, leaf: Sym, spot: &Spot, value: Sym) {
        let ty = self.table.ty(leaf).element();
        match (spot.part, spot.element) {
            (Subscript::Whole, None) => self.assign(leaf, value),
            (Subscript::Whole, Some(index)) => self.emit_to("aassign", leaf, &[index, value]),
            (part, None) => self.write_part(leaf, part, value),
            (part, Some(index)) => {
                let element = self.emit_value("aref", ty, &[leaf, index]);
                self.write_part(element, part, value);
                self.emit_to("aassign", leaf, &[index, element]);
            }
        }
    }

    fn write_part(&mut self, of: Sym, part: Subscript<Sym>, value: Sym) {
        match part {
            Subscript::Whole => self.assign(of, value),
            Subscript::Component(index) => self.emit_to("compassign", of, &[index, value]),
            Subscript::Cell(row, column) => self.emit_to("mxcompassign", of, &[row, column, value]),
        }
    }

    /// Copies part by part; arrays as a whole if both have the same length, else element by element.
    pub(super) fn copy(
        &mut self,
        to: &Storage,
        to_element: Option<Sym>,
        from: &Storage,
        from_element: Option<Sym>,
    ) {
        if let (Storage::Struct(to), Storage::Struct(from)) = (to, from) {
            for (to, from) in to.iter().zip(from.iter()) {
                if self.is_full() {
                    return;
                }
                self.copy(to, to_element, from, from_element);
            }
            return;
        }
        let (Some(target), Some(source)) = (self.leaf(to), self.leaf(from)) else { return };
        let length = |w: &Self, sym| match w.table.ty(sym).extent {
            Extent::Array(n) => Some(n),
            _ => None,
        };
        match (length(self, target), to_element, length(self, source), from_element) {
            (Some(n), None, Some(m), None) if n == m => self.emit_to("arraycopy", target, &[source]),
            (Some(n), None, Some(m), None) => {
                let ty = self.table.ty(source).element();
                for index in 0..n.min(m) {
                    if self.is_full() {
                        return;
                    }
                    let index = self.table.int(index as i32);
                    let value = self.emit_value("aref", ty, &[source, index]);
                    self.emit_to("aassign", target, &[index, value]);
                }
            }
            _ => {
                let value = match from_element {
                    Some(index) => {
                        let ty = self.table.ty(source).element();
                        self.emit_value("aref", ty, &[source, index])
                    }
                    None => source,
                };
                match to_element {
                    Some(index) => self.emit_to("aassign", target, &[index, value]),
                    None => self.assign(target, value),
                }
            }
        }
    }

    /// The initial constant of a variable; a closure takes an int.
    fn zero(&mut self, base: Base) -> Sym {
        match constant::zero(base) {
            values if values.is_empty() => self.table.int(0),
            values => self.table.constant(Type::one(base), values),
        }
    }

    /// Zero, empty or null for every scalar part. Arrays stay as they are.
    pub(super) fn store_zero(&mut self, storage: &Storage) {
        if let Storage::Struct(parts) = storage {
            for part in parts.iter() {
                if self.is_full() {
                    return;
                }
                self.store_zero(part);
            }
        } else if let Some(leaf) = self.leaf(storage) {
            let ty = self.table.ty(leaf);
            if !ty.is_array() {
                let zero = self.zero(ty.base);
                self.assign(leaf, zero);
            }
        }
    }

    /// Initialises storage of a type.
    pub(super) fn store_init(&mut self, storage: &Storage, ty: Type, init: &Init) {
        match init {
            Init::Value(e) => {
                if let Some(leaf) = self.leaf(storage)
                    && !ty.is_array()
                {
                    return self.value_into(e, leaf);
                }
                let value = self.eval(e);
                self.write(&Spot::whole(storage.clone()), value);
            }
            Init::List(items) => {
                if !fills(self, ty, items) {
                    self.store_zero(storage);
                }
                self.store_list(storage, None, ty, items);
            }
        }
    }

    fn store_list(&mut self, storage: &Storage, element: Option<Sym>, ty: Type, items: &[Init]) {
        for (index, item) in items.iter().enumerate() {
            if self.is_full() {
                return;
            }
            let Some((part, part_ty, is_element)) = storage.item(&self.program.structs, ty, index) else {
                return;
            };
            let element = if is_element { Some(self.table.int(index as i32)) } else { element };
            match item {
                Init::Value(e) => {
                    let value = self.eval(e);
                    self.write(&Spot { storage: part, element, part: Subscript::Whole }, value);
                }
                Init::List(inner) => self.store_list(&part, element, part_ty, inner),
            }
        }
    }

    /// The storage of a variable. One that was never declared on this path gets new storage.
    pub(super) fn storage(&mut self, var: VarId) -> Option<Storage> {
        if let Some(Some(storage)) = self.vars.get(var.0 as usize) {
            return Some(storage.clone());
        }
        let decl = self.program.vars.get(var.0 as usize)?;
        let storage = self.allocate(decl.ty, &decl.name);
        self.bind(var, storage.clone());
        Some(storage)
    }

    /// New storage for a variable of the source.
    pub(super) fn allocate(&mut self, ty: Type, name: &str) -> Storage {
        let name = self.table.local_name(name);
        self.allocate_as(Class::Local, ty.base, length(ty), name)
    }

    /// New storage for a value without a name.
    pub(super) fn allocate_temp(&mut self, ty: Type) -> Storage {
        let name = self.table.temp_name();
        self.allocate_as(Class::Temp, ty.base, length(ty), name)
    }

    fn allocate_as(&mut self, class: Class, base: Base, len: Option<u32>, name: String) -> Storage {
        if let Base::Struct(id) = base {
            let program = self.program;
            let mut parts = Vec::new();
            for (at, field) in program.structs.get(id).fields.iter().enumerate() {
                // Nothing more is written, so the missing parts are never used.
                if !self.has_room() {
                    break;
                }
                let inner = length(field.ty).or(len);
                let part = self.allocate_as(class, field.ty.base, inner, format!("{name}.{}", field.name));
                if let Storage::Leaf(Leaf::Symbol(sym)) = part
                    && let Some(symbol) = self.table.get_mut(sym)
                {
                    symbol.parent = Some((name.clone(), at));
                }
                parts.push(part);
            }
            return Storage::Struct(parts.into());
        }
        let extent = len.map_or(Extent::One, Extent::Array);
        Storage::Leaf(Leaf::Symbol(self.table.add(class, Type { base, extent }, name)))
    }
}

/// The length of an array; an open one is an alias for its argument, which has its own length.
fn length(ty: Type) -> Option<u32> {
    match ty.extent {
        Extent::Array(n) => Some(n),
        Extent::Unsized => Some(1),
        Extent::One => None,
    }
}

/// Whether a list sets every scalar part, so that none has to be set to zero first.
fn fills(writer: &Writer<'_>, ty: Type, items: &[Init]) -> bool {
    match (ty.extent, ty.base) {
        (Extent::One, Base::Struct(id)) => {
            let fields = &writer.program.structs.get(id).fields;
            fields.len() == items.len()
                && fields.iter().zip(items).all(|(f, item)| match item {
                    Init::Value(_) => true,
                    Init::List(inner) => fills(writer, f.ty, inner),
                })
        }
        // Elements of arrays are never set to zero.
        _ => ty.is_array() && !matches!(ty.base, Base::Struct(_)),
    }
}

/// Whether evaluating it changes no variable.
pub(super) fn is_pure(e: &Expr) -> bool {
    let own = match &e.kind {
        ExprKind::Assign(..) | ExprKind::Step { .. } | ExprKind::Struct(_) | ExprKind::Call(..) => false,
        ExprKind::Operation(_) => e.ty == Type::CLOSURE,
        ExprKind::Builtin(call) => call.outputs.iter().all(Option::is_none),
        _ => true,
    };
    own && e.parts().into_iter().all(is_pure)
}
