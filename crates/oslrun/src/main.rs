//! The `oslrun` command.
fn main() {}
