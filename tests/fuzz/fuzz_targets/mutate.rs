//! The door `mutate`: texts similar to real shaders are checked, linted, compiled and run.
#![no_main]

osl_fuzz::target!(mutate);
