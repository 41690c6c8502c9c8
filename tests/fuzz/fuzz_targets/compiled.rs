//! The door `compiled`: the same choices; the program, written as a compiled shader and loaded again, gives
//! the same bits.
#![no_main]

osl_fuzz::target!(compiled);
