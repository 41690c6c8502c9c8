//! The door `told`: the same choices: what `explain` and `stability` say of the program.
#![no_main]

osl_fuzz::target!(told);
