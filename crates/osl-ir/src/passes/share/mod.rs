//! Finds work that neighbouring points share because they are in the same cell of a pattern.
//!
//! A value is *stepped* if it takes few different values among neighbours: the result of `floor`, an int, and
//! all values computed from such values only, also by loads from an array that is the same for all points.
//! Noise of stepped values is worth computing once for each of their combinations instead of once for each
//! point, and so is the polynomial of a spline's segment from its knots. The pass groups the instructions
//! that can be computed in this way; a group's *roots* are the stepped values of single points on which it
//! depends. It writes one [`Op::Share`] for each group, after the roots and before all other instructions of
//! the group, and marks the group's values with [`Rate::PerCell`]. The number of combinations in a batch of
//! points is known only at run time.
//!
//! [`find`] determines the groups; `arrange` moves instructions. Needs the rates.

mod arrange;
mod find;

use crate::ir::Body;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let groups = find::find(body);
    if groups.is_worth_it() {
        arrange::arrange(body, &groups);
    }
}
