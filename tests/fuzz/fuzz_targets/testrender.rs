//! The door `testrender`: the XML of a scene of `testrender`.
#![no_main]

osl_fuzz::target!(testrender);
