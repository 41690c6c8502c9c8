//! The door `generate`: choices of the generator of valid programs: every way to compile and run yields the same bits.
#![no_main]

osl_fuzz::target!(generate);
