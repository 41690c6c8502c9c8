//! The door `parse`: any text, for the preprocessor and the parser with its recovery.
#![no_main]

osl_fuzz::target!(parse);
