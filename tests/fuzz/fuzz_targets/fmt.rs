//! The door `fmt`: texts similar to real shaders, for the formatter.
#![no_main]

osl_fuzz::target!(fmt);
