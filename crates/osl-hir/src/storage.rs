//! Where the value of a variable is held: a leaf for each part that is not a struct, as the type is a tree of
//! fields.
//!
//! Lowering and the writer of compiled shaders walk places alike; what a leaf is (a slot, a symbol) is
//! theirs.

use osl_ir::types::{Base, Extent, StructTable, Type};
use std::rc::Rc;

/// The storage of a variable.
#[derive(Clone, Debug)]
pub enum Storage<L> {
    /// A part that is not a struct, or an array of such parts.
    Leaf(L),
    /// The fields of a struct. They are shared, since each use of a variable needs its storage, and a struct
    /// may have very many fields.
    Struct(Rc<[Storage<L>]>),
}

/// The part of a triple or matrix that a place names, by the values of its indices.
#[derive(Clone, Copy, Debug)]
pub enum Subscript<V> {
    /// All of it.
    Whole,
    /// A component of a triple.
    Component(V),
    /// Row and column of a matrix.
    Cell(V, V),
}

impl<L: Copy> Storage<L> {
    /// The first leaf; `None` for a struct without fields.
    pub fn first(&self) -> Option<L> {
        match self {
            Storage::Leaf(leaf) => Some(*leaf),
            Storage::Struct(fields) => fields.iter().find_map(Storage::first),
        }
    }

    /// All leaves in order.
    pub fn leaves(&self) -> Vec<L> {
        match self {
            Storage::Leaf(leaf) => vec![*leaf],
            Storage::Struct(fields) => fields.iter().flat_map(Storage::leaves).collect(),
        }
    }

    /// The storage of a field; `None` if this is no struct with so many fields.
    pub fn field(&self, index: usize) -> Option<&Storage<L>> {
        match self {
            Storage::Struct(fields) => fields.get(index),
            Storage::Leaf(_) => None,
        }
    }

    /// What an item of a list of initial values sets, if the list is for a value of type `ty` in this
    /// storage: the storage, the type, and whether it is an element of an array instead of a field.
    pub fn item(&self, structs: &StructTable, ty: Type, index: usize) -> Option<(Storage<L>, Type, bool)> {
        match (ty.extent, ty.base, self) {
            (Extent::One, Base::Struct(id), Storage::Struct(fields)) => {
                let field = structs.get(id).fields.get(index)?;
                Some((fields.get(index)?.clone(), field.ty, false))
            }
            _ => Some((self.clone(), ty.element(), true)),
        }
    }
}
