//! A plain fuzzer: it mutates inputs, passes them to the [doors](crate::doors), and reports failures.
//!
//! `mutate` changes inputs, `corpus` keeps those worth changing again, `measure` gets time and memory from
//! the system, `drive` runs the loop of one process, and `parent` runs processes, so that it also finds an
//! input that kills a process. Runs with the same seed generate the same inputs. This module must not know
//! what a door does with its bytes.

pub mod corpus;
pub mod drive;
pub mod measure;
pub mod mutate;
pub mod parent;
