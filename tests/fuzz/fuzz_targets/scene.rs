//! The door `scene`: the text of a scene: read, built, and rendered in a few pixels.
#![no_main]

osl_fuzz::target!(scene);
