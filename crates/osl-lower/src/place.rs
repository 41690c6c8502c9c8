//! Places: reading, writing and copying variables and their parts.

use super::flow::RETURNED;
use super::{Lowerer, Storage, Val};
use osl_hir::hir::{Init, Lvalue, Step};
use osl_hir::storage::Subscript;
use osl_ir::ir::{Const, Kernel, Kind, LaneOp, SlotId, ValueId};
use osl_ir::types::{Base, Type};
use std::sync::Arc;

/// A place whose indices have been evaluated.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    storage: Storage,
    element: Option<ValueId>,
    part: Subscript<ValueId>,
    /// Name and type of the variable, if reads of it are checked.
    checked: Option<(Arc<str>, Type)>,
    /// The name at this place and its type, if the storage has another name now.
    told: Option<(String, Base)>,
}

impl Spot {
    /// Whether it is an element or component of a variable, rather than the variable itself.
    pub(super) fn is_part(&self) -> bool {
        self.element.is_some() || !matches!(self.part, Subscript::Whole)
    }

    /// The whole of a storage.
    pub(super) fn whole(storage: Storage) -> Spot {
        Spot { storage, element: None, part: Subscript::Whole, checked: None, told: None }
    }

    /// Its storage.
    pub(super) fn storage(&self) -> &Storage {
        &self.storage
    }
}

impl Lowerer<'_> {
    /// Evaluates the indices of a place.
    pub(super) fn spot(&mut self, place: &Lvalue) -> Option<Spot> {
        let mut spot = Spot::whole(self.storage(place.var)?);
        let outer = std::mem::replace(&mut self.b.span, place.span.moved(self.layer.base));
        let mut ty = self.program.vars.get(place.var.0 as usize).map(|v| v.ty);
        let mut name =
            self.program.vars.get(place.var.0 as usize).map_or_else(|| "".into(), |v| v.name.clone());
        for step in &place.path {
            match step {
                Step::Field(index) => {
                    spot.storage = spot.storage.field(*index as usize)?.clone();
                    ty = ty.and_then(|ty| ty.as_struct()).and_then(|id| {
                        self.program.structs.get(id).fields.get(*index as usize).map(|field| field.ty)
                    });
                    // The name of the part is that of its slot.
                    if let Some(slot) = spot.storage.first() {
                        name = self.b.body.slot(slot).name.clone();
                    }
                }
                Step::Element(index) => {
                    let index = self.value(index);
                    let len = spot.storage.first().and_then(|slot| self.b.body.slot(slot).len);
                    spot.element = Some(self.within(index, len.unwrap_or(1), &name));
                }
                Step::Component(index) => {
                    let index = self.value(index);
                    spot.part = Subscript::Component(self.within(index, 3, &name));
                }
                Step::Cell(row, column) => {
                    let row = self.value(row);
                    let row_span = self.b.span;
                    let column = self.value(column);
                    let column_span = std::mem::replace(&mut self.b.span, row_span);
                    let row = self.within(row, 4, &name);
                    self.b.span = column_span;
                    spot.part = Subscript::Cell(row, self.within(column, 4, &name));
                }
            }
        }
        self.b.span = outer;
        spot.told = self.told_at(place, &spot.storage);
        if self.checking.on.set && !self.is_constant(place.var) {
            spot.checked = ty.map(|ty| (name, ty));
        }
        Some(spot)
    }

    /// An index clamped to `0..len`; an index outside is reported at run time.
    fn within(&mut self, index: ValueId, len: u32, name: &Arc<str>) -> ValueId {
        if let Some(n) = self.b.known_int(index)
            && n.cast_unsigned() < len
        {
            return index;
        }
        let limit = self.b.int(len as i32);
        self.where_live(|l| {
            l.b.kernel_of(Kernel::CheckIndex { name: name.clone() }, &[index, limit], &[]);
        });
        self.b.clamp_int(index, len.saturating_sub(1) as i32)
    }

    /// The value at a spot.
    pub(super) fn read(&mut self, spot: &Spot) -> Val {
        let Storage::Leaf(slot) = spot.storage else {
            return Val::Stored(spot.storage.clone(), spot.element);
        };
        if self.b.body.slot(slot).len.is_some() && spot.element.is_none() {
            return Val::Stored(spot.storage.clone(), None);
        }
        let whole = self.read_leaf(slot, spot.element);
        let value = match spot.part {
            Subscript::Whole => whole,
            Subscript::Component(index) => self.b.lane(LaneOp::Get, &[whole, index]),
            Subscript::Cell(row, column) => self.b.lane(LaneOp::MGet, &[whole, row, column]),
        };
        Val::One(self.checked(spot, slot, whole, value))
    }

    /// The value that was read, checked if requested: an uninitialised value is zero from then on.
    fn checked(&mut self, spot: &Spot, slot: SlotId, whole: ValueId, value: ValueId) -> ValueId {
        let op = match (spot.part, spot.element) {
            (Subscript::Component(_), _) => Some("compref"),
            (Subscript::Cell(..), _) => Some("mxcompref"),
            (Subscript::Whole, Some(_)) => Some("aref"),
            (Subscript::Whole, None) => None,
        };
        let mut found = value;
        if let Some((name, ty)) = spot.checked.as_ref().filter(|_| self.b.body.kind(value) != Kind::Closure) {
            found = self.check_set(name, *ty, value, op);
            let stored = match spot.part {
                Subscript::Whole => found,
                Subscript::Component(index) => self.b.lane(LaneOp::Set, &[whole, index, found]),
                Subscript::Cell(row, column) => self.b.lane(LaneOp::MSet, &[whole, row, column, found]),
            };
            match spot.element {
                Some(index) => self.b.store_element(slot, index, stored),
                None => self.b.store(slot, stored),
            }
        }
        if op.is_some() {
            self.count_op();
        }
        found
    }

    fn read_leaf(&mut self, slot: SlotId, element: Option<ValueId>) -> ValueId {
        match element {
            Some(index) => self.b.load_element(slot, index),
            None => self.b.load(slot),
        }
    }

    fn write_leaf(&mut self, slot: SlotId, element: Option<ValueId>, value: ValueId) {
        if std::mem::take(&mut self.unsure) {
            // A call in this statement may have ended the shader: then nothing is written.
            self.guarded(RETURNED, |l| l.write_leaf(slot, element, value));
            self.unsure = true;
            return;
        }
        match element {
            Some(index) => self.b.store_element(slot, index, value),
            None => self.b.store(slot, value),
        }
        self.note_set(slot, element, value);
    }

    /// Stores a value at a spot.
    pub(super) fn write(&mut self, spot: &Spot, value: Val) {
        let Some((name, base)) = &spot.told else { return self.write_as_named(spot, value) };
        let outer = self.rename(&spot.storage, *base, name);
        self.write_as_named(spot, value);
        self.end_names(outer);
    }

    fn write_as_named(&mut self, spot: &Spot, value: Val) {
        match (&spot.storage, value) {
            (Storage::Leaf(slot), Val::One(value)) => {
                let op = match (spot.part, spot.element) {
                    (Subscript::Component(_), _) => Some("compassign"),
                    (Subscript::Cell(..), _) => Some("mxcompassign"),
                    (Subscript::Whole, Some(_)) => Some("aassign"),
                    (Subscript::Whole, None) => None,
                };
                if let Some(op) = op {
                    let name = self.b.body.slot(*slot).name.clone();
                    self.made(Some(name), value, op);
                }
                let value = match spot.part {
                    Subscript::Whole => value,
                    Subscript::Component(index) => {
                        let old = self.read_leaf(*slot, spot.element);
                        self.b.lane(LaneOp::Set, &[old, index, value])
                    }
                    Subscript::Cell(row, column) => {
                        let old = self.read_leaf(*slot, spot.element);
                        self.b.lane(LaneOp::MSet, &[old, row, column, value])
                    }
                };
                self.write_leaf(*slot, spot.element, value);
            }
            (_, Val::Stored(from, element)) => self.copy(&spot.storage, spot.element, &from, element),
            (Storage::Struct(_), Val::One(_)) | (_, Val::Void) => {}
        }
    }

    /// Copies part by part and element by element. Both sides have the same structure.
    pub(super) fn copy(
        &mut self,
        to: &Storage,
        to_element: Option<ValueId>,
        from: &Storage,
        from_element: Option<ValueId>,
    ) {
        match (to, from) {
            (Storage::Struct(to), Storage::Struct(from)) => {
                for (to, from) in to.iter().zip(from.iter()) {
                    if !self.has_room() {
                        return;
                    }
                    self.copy(to, to_element, from, from_element);
                }
            }
            (Storage::Leaf(to), Storage::Leaf(from)) => {
                let len = |l: &Self, slot: SlotId| l.b.body.slot(slot).len;
                match (len(self, *to), to_element, len(self, *from), from_element) {
                    (Some(n), None, Some(m), None) => self.where_live(|l| {
                        for index in 0..n.min(m) {
                            if !l.has_room() {
                                return;
                            }
                            let index = l.b.int(index as i32);
                            let value = l.b.load_element(*from, index);
                            l.b.store_element(*to, index, value);
                            l.note_set(*to, Some(index), value);
                        }
                    }),
                    _ => {
                        let value = self.read_leaf(*from, from_element);
                        self.write_leaf(*to, to_element, value);
                    }
                }
            }
            _ => {}
        }
    }

    /// Zero, empty or null for every scalar part. Arrays are zero when a point starts and stay unchanged.
    pub(super) fn store_zero(&mut self, storage: &Storage) {
        match storage {
            Storage::Struct(parts) => {
                for part in parts.iter() {
                    if !self.has_room() {
                        return;
                    }
                    self.store_zero(part);
                }
            }
            Storage::Leaf(slot) => {
                let slot_of = self.b.body.slot(*slot);
                if slot_of.len.is_none() {
                    let zero = self.b.constant(Const::zero(slot_of.kind));
                    self.b.store(*slot, zero);
                }
            }
        }
    }

    /// Initialises storage of a type.
    pub(super) fn store_init(&mut self, storage: &Storage, ty: Type, init: &Init) {
        let spot = Spot::whole(storage.clone());
        match init {
            Init::Value(e) => {
                let value = self.eval_into(storage, e);
                self.write(&spot, value);
            }
            Init::List(items) => {
                // Evaluated in order; missing ones are zero.
                self.store_zero(storage);
                self.store_list(storage, None, ty, items);
            }
        }
    }

    fn store_list(&mut self, storage: &Storage, element: Option<ValueId>, ty: Type, items: &[Init]) {
        for (index, item) in items.iter().enumerate() {
            if !self.has_room() {
                return;
            }
            let Some((part, part_ty, is_element)) = storage.item(&self.program.structs, ty, index) else {
                return;
            };
            let element = if is_element { Some(self.b.int(index as i32)) } else { element };
            match item {
                Init::Value(e) => {
                    let value = self.eval(e);
                    self.write(&Spot { element, ..Spot::whole(part) }, value);
                }
                Init::List(inner) => self.store_list(&part, element, part_ty, inner),
            }
        }
    }
}
