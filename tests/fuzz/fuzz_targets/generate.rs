//! The door `generate`: choices of the generator of valid programs; all ways to compile and run give the same
//! bits.
#![no_main]

osl_fuzz::target!(generate);
