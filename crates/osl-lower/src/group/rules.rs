//! Which layers of a group run even if their values are not needed, and the meaning of unmarked parameters.

use osl_hir::hir::{MetaValue, Param};

/// Rules for running a group. By default the last layer runs, and every other layer where its values are
/// needed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rules {
    /// The layers that run, in this order, together with the layers that they need; `None` means the last one
    /// alone.
    pub entries: Option<Vec<usize>>,
    /// Layers that write shader globals run at every point.
    pub eager_globals: bool,
    /// Layers without outgoing connections run at every point.
    pub eager_unconnected: bool,
    /// Layers that may report a shader error run at every point.
    pub eager_errors: bool,
    /// Layers that may trace rays run at every point.
    pub eager_traces: bool,
    /// Parameters take user data of the point only if metadata or the group say so.
    pub lockgeom: bool,
    /// Parameters that may take user data count as connected.
    pub userdata_connected: bool,
    /// What the layers check while they run.
    pub checks: Checks,
}

/// Checks of a debugging run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    /// Infinite and NaN values are reported.
    pub finite: bool,
    /// Reads of uninitialised variables are reported.
    pub set: bool,
}

impl Checks {
    /// Whether any check is on.
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
            eager_traces: false,
            lockgeom: true,
            userdata_connected: false,
            checks: Checks::default(),
        }
    }
}

impl Rules {
    /// Whether a parameter takes the point's user data, if there is any, in place of its own value: by its
    /// metadata, else by `lockgeom`.
    pub fn interpolates(&self, param: &Param) -> bool {
        let says = |name: &str, value: f64| {
            param.metadata.iter().any(|(_, n, v)| &**n == name && *v == MetaValue::Numbers(vec![value]))
        };
        let open = !self.lockgeom && !says("lockgeom", 1.0) && !says("interpolated", 0.0);
        says("lockgeom", 0.0) || says("interpolated", 1.0) || open
    }

    /// Whether layers may run that no other layer needs. A list of entries excludes that.
    pub(crate) fn is_eager(&self) -> bool {
        let any = self.eager_globals || self.eager_unconnected || self.eager_errors || self.eager_traces;
        any && self.entries.is_none()
    }
}
