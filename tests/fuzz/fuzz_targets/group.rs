//! The door `group`: the text of a group, with a few available shaders.
#![no_main]

osl_fuzz::target!(group);
