//! The door `attributes`: the JSON of `--attributes`.
#![no_main]

osl_fuzz::target!(attributes);
