//! Places: reading, writing and copying variables and their parts.

use super::flow::RETURNED;
use super::{Element, Lowerer, Storage, Val};
use osl_hir::hir::{Init, Lvalue, Step};
use osl_hir::storage::Subscript;
use osl_ir::ir::{Const, Kernel, Kind, LaneOp, SlotId, ValueId};
use osl_ir::types::Type;
use std::sync::Arc;

/// A place whose indices have been evaluated.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    storage: Storage,
    element: Option<Element>,
    /// Whether it is an array.
    array: bool,
    part: Subscript<ValueId>,
    /// Name and type of the variable, if reads of it are checked.
    checked: Option<(Arc<str>, Type)>,
    /// The name at this place and its type, if the storage has another name now.
    told: Option<(String, Type)>,
}

impl Spot {
    /// Whether it is an element or component of a variable, rather than the variable itself.
    pub(super) fn is_part(&self) -> bool {
        self.element.is_some() || !matches!(self.part, Subscript::Whole)
    }

    /// The whole of a storage.
    pub(super) fn whole(storage: Storage) -> Spot {
        Spot { storage, element: None, array: false, part: Subscript::Whole, checked: None, told: None }
    }

    /// Its storage.
    pub(super) fn storage(&self) -> &Storage {
        &self.storage
    }

    /// Whether it is an array that is a part of an element of another.
    pub(super) fn is_inner_array(&self) -> bool {
        self.array && self.element.is_some()
    }
}

impl Lowerer<'_> {
    /// Evaluates the indices of a place.
    pub(super) fn spot(&mut self, place: &Lvalue) -> Option<Spot> {
        let mut spot = Spot { array: place.ty.is_array(), ..Spot::whole(self.storage(place.var)?) };
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
                    let len = spot.storage.first().map_or(1, |slot| self.len_at(slot, spot.element));
                    let index = self.within(index, len, &name);
                    spot.element = Some(self.deeper(&spot.storage, spot.element, index));
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

    /// The lengths of the arrays within the elements of a slot at a depth of at least 1, from the outermost.
    fn lens_within(&self, slot: SlotId, depth: usize) -> &[u32] {
        self.inner.get(&slot).and_then(|lens| lens.get(depth.saturating_sub(1)..)).unwrap_or(&[])
    }

    /// The number of values that a place has in a slot; `None` if it is one value, and no array.
    fn values_at(&self, slot: SlotId, element: Option<Element>) -> Option<u32> {
        match element {
            None => self.b.body.slot(slot).len,
            Some(e) => self.lens_within(slot, e.depth).iter().copied().reduce(u32::saturating_mul),
        }
    }

    /// The length of an array at a place that has a slot.
    pub(super) fn len_at(&self, slot: SlotId, element: Option<Element>) -> u32 {
        let depth = element.map_or(0, |e| e.depth);
        let each: u32 = self.lens_within(slot, depth + 1).iter().product();
        self.values_at(slot, element).unwrap_or(1) / each.max(1)
    }

    /// An element of the array at a place.
    pub(super) fn deeper(&mut self, storage: &Storage, of: Option<Element>, index: ValueId) -> Element {
        let Some(of) = of else { return Element { index, depth: 1 } };
        let len = storage.first().map_or(1, |slot| self.len_at(slot, Some(of)));
        let index = match (self.b.known_int(of.index), self.b.known_int(index)) {
            (Some(n), Some(m)) => self.b.int(n.saturating_mul(len as i32).saturating_add(m)),
            _ => {
                let len = self.b.int(len as i32);
                let before = self.b.lane(LaneOp::IMul, &[of.index, len]);
                self.b.lane(LaneOp::IAdd, &[before, index])
            }
        };
        Element { index, depth: of.depth + 1 }
    }

    /// The number in a slot of one of the values at a place.
    fn number_in(&mut self, slot: SlotId, element: Option<Element>, at: u32) -> ValueId {
        let at = self.b.int(at as i32);
        let Some(element) = element else { return at };
        let each = self.values_at(slot, Some(element)).unwrap_or(1);
        let each = self.b.int(each as i32);
        let start = self.b.lane(LaneOp::IMul, &[element.index, each]);
        self.b.lane(LaneOp::IAdd, &[start, at])
    }

    /// The value at a spot. An array within an element of another is copied.
    pub(super) fn read(&mut self, spot: &Spot) -> Val {
        if let Some(element) = spot.element.filter(|_| spot.array) {
            return Val::Stored(self.kept(&spot.storage, element), None);
        }
        let Storage::Leaf(slot) = spot.storage else {
            return Val::Stored(spot.storage.clone(), spot.element);
        };
        if self.values_at(slot, spot.element).is_some() {
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
                Some(element) => self.b.store_element(slot, element.index, stored),
                None => self.b.store(slot, stored),
            }
        }
        if op.is_some() {
            self.count_op();
        }
        found
    }

    pub(super) fn read_leaf(&mut self, slot: SlotId, element: Option<Element>) -> ValueId {
        match element {
            Some(element) => self.b.load_element(slot, element.index),
            None => self.b.load(slot),
        }
    }

    fn write_leaf(&mut self, slot: SlotId, element: Option<Element>, value: ValueId) {
        if std::mem::take(&mut self.unsure) {
            // A call in this statement may have ended the shader: then nothing is written.
            self.guarded(RETURNED, |l| l.write_leaf(slot, element, value));
            self.unsure = true;
            return;
        }
        match element {
            Some(element) => self.b.store_element(slot, element.index, value),
            None => self.b.store(slot, value),
        }
        self.note_set(slot, element.map(|element| element.index), value);
    }

    /// Stores a value at a spot.
    pub(super) fn write(&mut self, spot: &Spot, value: Val) {
        let Some((name, ty)) = &spot.told else { return self.write_as_named(spot, value) };
        let outer = self.rename(&spot.storage, *ty, name);
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
        to_element: Option<Element>,
        from: &Storage,
        from_element: Option<Element>,
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
                match (self.values_at(*to, to_element), self.values_at(*from, from_element)) {
                    (Some(n), Some(m)) => self.where_live(|l| {
                        for at in 0..n.min(m) {
                            if !l.has_room() {
                                return;
                            }
                            let index = l.number_in(*from, from_element, at);
                            let value = l.b.load_element(*from, index);
                            let index = match (to_element, from_element) {
                                (None, None) => index,
                                _ => l.number_in(*to, to_element, at),
                            };
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

    /// A copy of an element: one value, a struct, or an array within another.
    pub(super) fn kept(&mut self, storage: &Storage, element: Element) -> Storage {
        let copy = self.like(storage, element);
        self.copy(&copy, None, storage, Some(element));
        copy
    }

    /// New storage for the value of an element.
    fn like(&mut self, storage: &Storage, element: Element) -> Storage {
        match storage {
            Storage::Struct(parts) => {
                Storage::Struct(parts.iter().map(|part| self.like(part, element)).collect())
            }
            Storage::Leaf(slot) => {
                let kind = self.b.body.slot(*slot).kind;
                let lens = self.lens_within(*slot, element.depth).to_vec();
                Storage::Leaf(self.array_slot(kind, &lens, "kept"))
            }
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

    fn store_list(&mut self, storage: &Storage, element: Option<Element>, ty: Type, items: &[Init]) {
        for (index, item) in items.iter().enumerate() {
            if !self.has_room() {
                return;
            }
            let Some((part, part_ty, is_element)) = storage.item(&self.program.structs, ty, index) else {
                return;
            };
            let element = match is_element {
                true => {
                    let index = self.b.int(index as i32);
                    Some(self.deeper(storage, element, index))
                }
                false => element,
            };
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
