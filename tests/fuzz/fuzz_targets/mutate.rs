//! The door `mutate`: texts near real shaders: checked, linted, compiled and run.
#![no_main]

osl_fuzz::target!(mutate);
