//! Commands that make pictures.

pub(super) mod bake;
pub(super) mod book;
pub(super) mod compare;
mod figures;
mod frames;
mod numbers;
mod once;
mod openjd;
pub(super) mod render;
pub(super) mod run;
pub(super) mod studio;
mod sweep;
mod watch;
mod words;
