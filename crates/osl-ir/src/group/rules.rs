//! Which layers of a group run other than where their values are needed, and what unmarked parameters do.

use crate::hir::{MetaValue, Param};

/// Rules for running a group. By default the last layer runs, and each other one where its values are needed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rules {
    /// The layers that run, in this order, with what they need of others; the last one alone if there is no list.
    pub entries: Option<Vec<usize>>,
    /// Layers that write shader globals run at every point.
    pub eager_globals: bool,
    /// Layers that no connection leaves run at every point.
    pub eager_unconnected: bool,
    /// Layers that may report an error of the shader run at every point.
    pub eager_errors: bool,
    /// Parameters take the data of the point only if metadata or the group say so.
    pub lockgeom: bool,
    /// Parameters that may take the data of the point count as connected.
    pub userdata_connected: bool,
    /// What the layers check while they run.
    pub checks: Checks,
}

/// Checks of a debugging run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    /// Values that are infinite or no number are reported.
    pub finite: bool,
    /// Reads of variables without a value are reported.
    pub set: bool,
}

impl Checks {
    /// Whether there is any.
    pub(crate) fn any(self) -> bool {
        self.finite || self.set
    }
}

impl Default for Rules {
    fn default() -> Rules {
        Rules {
            entries: None,
            eager_globals: false,
            eager_unconnected: false,
            eager_errors: false,
            lockgeom: true,
            userdata_connected: false,
            checks: Checks::default(),
        }
    }
}

impl Rules {
    /// Whether a parameter takes the data of the point before its own value, where the point has some: by its metadata,
    /// else by `lockgeom`.
    pub fn interpolates(&self, param: &Param) -> bool {
        let says = |name: &str, value: f64| {
            param.metadata.iter().any(|(_, n, v)| &**n == name && *v == MetaValue::Numbers(vec![value]))
        };
        let open = !self.lockgeom && !says("lockgeom", 1.0) && !says("interpolated", 0.0);
        says("lockgeom", 0.0) || says("interpolated", 1.0) || open
    }

    /// Whether layers may run that no other layer needs.
    pub(crate) fn is_eager(&self) -> bool {
        self.eager_globals || self.eager_unconnected || self.eager_errors
    }
}
