//! The door `textures`: the bytes of a texture: EXR, PNG, JPEG, TIFF, HDR.
#![no_main]

osl_fuzz::target!(textures);
