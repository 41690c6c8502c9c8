//! Places: variables and their parts, and references to them.

use super::{Stop, Value, Walker};
use osl_hir::hir::{Lvalue, Step, VarId};

/// A place with evaluated indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Spot {
    cell: usize,
    /// The fields and elements that lead to it.
    path: Vec<usize>,
    /// The index of a component in a triple or a matrix.
    number: Option<usize>,
}

impl Spot {
    /// A whole variable.
    pub(super) fn cell(cell: usize) -> Spot {
        Spot { cell, path: Vec::new(), number: None }
    }
}

impl Walker<'_> {
    /// The place of a variable. A variable whose declaration has not been executed is empty.
    pub(super) fn variable(&mut self, var: VarId) -> Spot {
        if let Some(Some(spot)) = self.places.get(var.0 as usize) {
            return spot.clone();
        }
        let zero = self.zero(self.program.vars[var.0 as usize].ty);
        self.bring_to_life(var, zero);
        Spot::cell(self.cells.len() - 1)
    }

    /// Makes a variable refer to a place.
    pub(super) fn bind(&mut self, var: VarId, spot: Spot) {
        self.places[var.0 as usize] = Some(spot);
    }

    /// Evaluates the indices of a place, each once and from left to right.
    pub(super) fn spot(&mut self, place: &Lvalue) -> Result<Spot, Stop> {
        let mut spot = self.variable(place.var);
        for step in &place.path {
            match step {
                Step::Field(index) => spot.path.push(*index as usize),
                Step::Element(index) => {
                    let index = self.eval(index)?.int();
                    let len = match self.read(&spot) {
                        Value::Many(elements) => elements.len(),
                        _ => 1,
                    };
                    let index = self.held(index, len);
                    spot.path.push(index);
                }
                Step::Component(index) => {
                    let index = self.eval(index)?.int();
                    spot.number = Some(self.held(index, 3));
                }
                Step::Cell(row, column) => {
                    let (row, column) = (self.eval(row)?.int(), self.eval(column)?.int());
                    let (row, column) = (self.held(row, 4), self.held(column, 4));
                    spot.number = Some(4 * row + column);
                }
            }
        }
        Ok(spot)
    }

    /// An index outside `0..len` is clamped to the range and reported.
    fn held(&mut self, index: i32, len: usize) -> usize {
        let last = len as i32 - 1;
        if index < 0 || index > last {
            self.outcome.messages.insert(format!("Index [{index}] out of range [0..{last}]"));
        }
        index.clamp(0, last) as usize
    }

    /// The value at a place.
    pub(super) fn read(&self, spot: &Spot) -> Value {
        let mut value = &self.cells[spot.cell];
        for step in &spot.path {
            let Value::Many(parts) = value else { return Value::Nothing };
            let Some(part) = parts.get(*step) else { return Value::Nothing };
            value = part;
        }
        match (spot.number, value) {
            (Some(n), Value::Triple(t)) => Value::Float(t[n]),
            (Some(n), Value::Matrix(m)) => Value::Float(m[n]),
            _ => value.clone(),
        }
    }

    /// Stores a value at a place.
    pub(super) fn write(&mut self, spot: &Spot, from: Value) {
        let mut value = &mut self.cells[spot.cell];
        for step in &spot.path {
            let Value::Many(parts) = value else { return };
            let Some(part) = parts.get_mut(*step) else { return };
            value = part;
        }
        match (spot.number, value) {
            (Some(n), Value::Triple(t)) => t[n] = from.float(),
            (Some(n), Value::Matrix(m)) => m[n] = from.float(),
            (_, value) => value.assign(from),
        }
    }
}
