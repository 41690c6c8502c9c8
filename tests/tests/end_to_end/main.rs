//! Whole shaders from text to values: each module holds one promise. They are one program because a program
//! of their own for each takes longer to link than to run. Programs beside this one are those that run alone
//! for a long time, or that measure their own process.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs,
    reason = "a test says what must hold"
)]

mod arithmetic;
mod assumptions;
mod branches;
mod calls;
mod circles;
mod composed;
mod data;
mod derivatives;
mod every_call;
mod exact_traces;
mod extremes;
mod groups;
mod lenient;
mod live;
mod made_of_chance;
mod maps;
mod nested_arrays;
mod nodes;
mod oso;
mod oso_format;
mod proven_bounds;
mod regions;
mod reject;
mod rooms;
mod rules;
mod same_bits;
mod searches;
mod sharing;
mod snapshots;
mod string_hashes;
mod struct_arguments;
mod taps;
mod text;
