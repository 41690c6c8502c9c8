//! Texts near real shaders: what parses is checked, linted, lowered, compiled in two ways, and run under tight budgets.
//!
//! A panic, a hang or a broken rule of the IR is a bug.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osl_ir::ir::validate;
use osl_ir::params::ParamValues;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_tests::laws;
use oslrun::pipeline;

/// Values of a body that is run; larger ones are compiled alone.
const MAX_VALUES: usize = 20_000;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let options = Options {
        max_expansion: 2000,
        max_tokens: 20_000,
        max_diagnostics: 12,
        max_repair_work: 1 << 10,
        ..Options::default()
    };
    let checked = pipeline::check("fuzz.osl", &text, &NoFiles, &options);
    let _ = pipeline::lint(&checked, &osl_ir::lint::Options::default());
    let Some(program) = &checked.program else { return };
    let Ok(body) = osl_ir::lower::lower(program, &ParamValues::default()) else { return };
    validate::validate(&body).unwrap();
    let elements: u64 = body.slots.iter().filter_map(|slot| slot.len).map(u64::from).sum();
    if body.values.len() > MAX_VALUES || elements > 1 << 14 {
        return;
    }
    let without = if data.len() % 2 == 0 { Vec::new() } else { laws::SWITCHABLE.to_vec() };
    let compiled = pipeline::finish(body, &passes::Options { without, ..passes::Options::default() });
    let options = osl_exec::RunOptions { batch: Some(16), max_steps: 1 << 12, ..osl_exec::RunOptions::default() };
    let _ = osl_exec::run(&compiled.program, laws::services(), &Grid::new(3, 2), &options, &|_| ());
});
