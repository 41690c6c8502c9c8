//! A plain fuzzer: it changes inputs, hands them to the [doors](crate::doors), and says what broke.
//!
//! `mutate` changes inputs, `corpus` keeps those worth changing again, `measure` asks the system for time and memory,
//! `drive` runs the loop of one process, and `parent` runs processes, so that an input that kills one is found as well. Every
//! run with the same seed makes the same inputs. This module must not know what a door does with its bytes.

pub mod corpus;
pub mod drive;
pub mod measure;
pub mod mutate;
pub mod parent;
