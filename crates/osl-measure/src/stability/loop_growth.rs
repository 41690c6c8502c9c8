//! Systematic error growth in loops: a rounding of a value from before the loop is small, but each round uses
//! the same wrong value. A rotation by a small angle that is applied a thousand times is an example.

use super::rerun::relative_error;
use super::sensitivity::LineOf;
use crate::trace::{NodeId, Trace, What};
use osl_ir::Span;
use std::collections::BTreeMap;

/// A loop uses a value at least so often.
const OFTEN: u32 = 16;

/// The relative error of what the loop makes of a value is at least so many times that of the value.
const GROWS: f64 = 4.0;

/// Instructions between a rounding and the value that the loop uses.
const STEPS: usize = 8;

/// Finds the users of nodes of a trace.
pub(super) struct Users<'a> {
    trace: &'a Trace,
    /// For each node the number of its users, and the last of them. Notes do not count.
    users: Vec<(u32, NodeId)>,
}

impl<'a> Users<'a> {
    pub(super) fn new(trace: &'a Trace) -> Users<'a> {
        let mut users = vec![(0, 0); trace.nodes.len()];
        for (id, node) in trace.nodes.iter().enumerate() {
            let args: &[NodeId] = if matches!(node.what, What::Note(_)) { &[] } else { &node.args };
            for arg in args {
                if let Some(user) = users.get_mut(*arg as usize) {
                    *user = (user.0 + 1, id as NodeId);
                }
            }
        }
        Users { trace, users }
    }

    /// A run of the instruction that uses the value of a node, or what follows from it, in each round of a
    /// loop, if the error grows there. The first such line of the source counts.
    pub(super) fn repeated(&self, mut id: NodeId, line: &LineOf<'_>) -> Option<NodeId> {
        let mut steps = 0;
        loop {
            match self.users.get(id as usize)? {
                (1, user) if steps < STEPS => {
                    id = *user;
                    steps += 1;
                }
                (count, _) if *count >= OFTEN => break,
                _ => return None,
            }
        }
        let own = relative(self.trace, id);
        if own == 0.0 || line(self.trace.node(id).span).is_none() {
            return None;
        }
        let mut places: BTreeMap<Span, (u32, f64, NodeId)> = BTreeMap::new();
        for (user, node) in self.trace.nodes.iter().enumerate().skip(id as usize) {
            if node.args.contains(&id) && matches!(node.what, What::Lane(_) | What::Kernel(..)) {
                let user = user as NodeId;
                let place = places.entry(node.span).or_insert((0, 0.0, user));
                place.0 += 1;
                place.1 = relative(self.trace, user).max(place.1);
            }
        }
        let grows = |(count, error, _): &&(u32, f64, NodeId)| *count >= OFTEN && *error >= GROWS * own;
        places.values().find(grows).map(|(.., user)| *user)
    }
}

/// The relative error of a node's value; 0 if it is not finite.
fn relative(trace: &Trace, id: NodeId) -> f64 {
    let node = trace.node(id);
    let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return 0.0 };
    Some(relative_error(strict, exact)).filter(|error| error.is_finite()).unwrap_or(0.0)
}
