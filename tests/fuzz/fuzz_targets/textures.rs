//! The door `textures`: the bytes of an image of any format.
#![no_main]

osl_fuzz::target!(textures);
