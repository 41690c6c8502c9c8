//! The door `fmt`: texts near real shaders, to the formatter.
#![no_main]

osl_fuzz::target!(fmt);
