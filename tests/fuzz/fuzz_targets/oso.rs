//! The door `oso`: the text of a compiled shader: read, compiled, run, written again.
#![no_main]

osl_fuzz::target!(oso);
