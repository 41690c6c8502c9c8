//! The door `parse`: any text, to the preprocessor and the parser with its recovery.
#![no_main]

osl_fuzz::target!(parse);
