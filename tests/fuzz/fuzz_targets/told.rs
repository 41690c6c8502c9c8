//! The door `told`: the same choices; the output of `explain` and `stability` for the program.
#![no_main]

osl_fuzz::target!(told);
