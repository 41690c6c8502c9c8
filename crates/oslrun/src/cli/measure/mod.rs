//! Commands that measure, explain or prove what a shader does.

pub(super) mod bounds;
mod clock;
pub(super) mod explain;
mod fail_on;
pub(super) mod lod;
mod repair;
pub(super) mod sanitize;
pub(super) mod stability;
pub(super) mod tradeoff;

pub(super) use clock::Clock;
