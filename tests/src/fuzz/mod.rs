//! Mutated inputs for the [doors](crate::doors), and a loop that runs them in a test.
//!
//! `mutate` changes inputs; the targets of cargo-fuzz in `tests/fuzz` use it too. `drive` runs a fixed number
//! of inputs, which are the same for the same seed. This module must not know what a door does with its
//! bytes.

pub mod drive;
pub mod mutate;
