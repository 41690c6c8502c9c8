//! The door `lod`: the same choices; what `lod` writes for the program.
#![no_main]

osl_fuzz::target!(lod);
