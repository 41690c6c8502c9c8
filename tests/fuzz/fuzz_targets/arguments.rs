//! The door `arguments`: a command line, a word a line.
#![no_main]

osl_fuzz::target!(arguments);
