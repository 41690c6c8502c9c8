//! Finds work that neighbouring points share because they see the same cell of a pattern.
//!
//! A value is *stepped* where it takes few different values among neighbours: what `floor` yields, an int, and all that
//! is made of such alone. Noise of stepped values is worth computing once for each of their combinations instead of
//! once for each point. The pass groups the instructions that can be computed so; a group's *roots* are the stepped
//! values of single points that it starts from. It writes one [`Op::Share`] for each group, behind the roots and before
//! all else of the group, and marks the group's values with [`Rate::Shared`]. How many combinations a batch of points
//! really has is seen when it runs.
//!
//! [`find`] decides who belongs to what; `arrange` moves instructions. Needs the rates.

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
