//! Variables and parts of them at constant paths: `a`, `hit.t`, `list[2]`, `p[0]`.

use osl_hir::hir::{ExprKind, Step, VarId};

/// A variable, or the part of it at a constant path of fields, elements and components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) var: VarId,
    /// The indices of the path, the outermost first.
    path: [Option<u32>; 3],
}

impl From<VarId> for Place {
    fn from(var: VarId) -> Place {
        Place { var, path: [None; 3] }
    }
}

impl Place {
    /// The smallest place that is known to hold a path, and whether it is the path itself.
    pub(super) fn around(var: VarId, path: &[Step]) -> (Place, bool) {
        let mut place = Place::from(var);
        for step in path {
            let index = match step {
                Step::Field(index) => Some(*index),
                Step::Element(e) | Step::Component(e) => match e.kind {
                    ExprKind::Int(index) => u32::try_from(index).ok(),
                    _ => None,
                },
                Step::Cell(..) => None,
            };
            let Some(part) = index.and_then(|index| place.part(index)) else { return (place, false) };
            place = part;
        }
        (place, true)
    }

    /// The part of the place with this index; `None` if the path becomes too long.
    pub(super) fn part(mut self, index: u32) -> Option<Place> {
        *self.path.iter_mut().find(|step| step.is_none())? = Some(index);
        Some(self)
    }

    /// Whether two places have a part in common.
    pub(super) fn overlaps(self, other: Place) -> bool {
        let same = |(a, b): (Option<u32>, Option<u32>)| a.zip(b).is_none_or(|(a, b)| a == b);
        self.var == other.var && self.path.into_iter().zip(other.path).all(same)
    }
}
