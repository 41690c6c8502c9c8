//! The door `bounds`: the same choices; what `bounds` proves about the program.
#![no_main]

osl_fuzz::target!(bounds);
