//! Valid programs: the bytes are the choices of the generator. Every way of compiling and running yields the same bits.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osl_tests::{generate, laws};
use std::sync::OnceLock;

fuzz_target!(|data: &[u8]| {
    static WAYS: OnceLock<Vec<laws::Way>> = OnceLock::new();
    let ways = WAYS.get_or_init(laws::ways);
    let text = generate::program(data);
    // The few programs that the generator gets wrong still must not panic.
    let Ok(body) = laws::lower(&text) else { return };
    // One other way each time: compiling takes longer than all the rest.
    let sum = data.iter().fold(0_usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(usize::from(*byte)));
    let at = sum % ways.len();
    if let Err(law) = laws::hold_body(&body, &ways[at..=at]) {
        panic!("{text}\nbreaks {law}");
    }
});
