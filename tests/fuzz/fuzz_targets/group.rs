//! The door `group`: the text of a group, with a few shaders at hand.
#![no_main]

osl_fuzz::target!(group);
