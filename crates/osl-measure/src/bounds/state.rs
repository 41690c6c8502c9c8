//! The state of a walk: what is known of each value, of the arrays and of the path so far. `walk` drives, and
//! `assume` and `paths` narrow values.

use super::calls::Calls;
use super::defs::Defs;
use super::domain::Tile;
use super::paths::Paths;
use super::sites::Sites;
use osl_exec::PointSource;
use osl_ir::ir::{Body, ValueId};
use osl_numeric::interval::Enclosure;

/// What a walk needs to know.
#[derive(Clone, Copy)]
pub(super) struct Program<'a> {
    pub(super) body: &'a Body,
    pub(super) defs: &'a Defs,
    pub(super) points: &'a dyn PointSource,
    pub(super) calls: &'a Calls<'a>,
}

/// The arrays of a program, element by element.
pub(super) type Arrays = Vec<Vec<Enclosure>>;

/// One walk.
pub(super) struct Walk<'a> {
    pub(super) program: Program<'a>,
    pub(super) tile: &'a Tile,
    pub(super) values: Vec<Option<Enclosure>>,
    pub(super) arrays: Arrays,
    pub(super) sites: &'a mut Sites,
    pub(super) paths: &'a mut Paths,
    /// The number of loops and of branches with joined sides around the instruction.
    pub(super) joined: usize,
    /// Whether no point takes this path, or the walk has to stop.
    pub(super) is_dead: bool,
    /// The number of instructions that may still be walked.
    pub(super) steps: usize,
}

/// The values before they were narrowed, the last one first to be restored.
#[derive(Default)]
pub(super) struct Undo(Vec<(ValueId, Option<Enclosure>)>);

impl Walk<'_> {
    /// The enclosure of a value; every value of its kind if its definition was not walked.
    pub(super) fn of(&self, value: ValueId) -> Enclosure {
        let known = self.values.get(value.index()).and_then(Option::as_ref);
        known.cloned().unwrap_or_else(|| Enclosure::any(self.program.body.kind(value)))
    }

    pub(super) fn set(&mut self, value: ValueId, enclosure: Enclosure) {
        if let Some(place) = self.values.get_mut(value.index()) {
            *place = Some(enclosure);
        }
    }

    pub(super) fn set_all(&mut self, values: &[ValueId], enclosures: &[Enclosure]) {
        for (value, enclosure) in values.iter().zip(enclosures) {
            self.set(*value, enclosure.clone());
        }
    }

    pub(super) fn all(&self, values: &[ValueId]) -> Vec<Enclosure> {
        values.iter().map(|value| self.of(*value)).collect()
    }

    /// Replaces a value by a part of it.
    pub(super) fn narrow(&mut self, value: ValueId, to: Enclosure, undo: &mut Undo) {
        if let Some(place) = self.values.get_mut(value.index()) {
            undo.0.push((value, place.replace(to)));
        }
    }

    /// Takes back what was narrowed.
    pub(super) fn restore(&mut self, undo: Undo) {
        for (value, before) in undo.0.into_iter().rev() {
            if let Some(place) = self.values.get_mut(value.index()) {
                *place = before;
            }
        }
    }
}
