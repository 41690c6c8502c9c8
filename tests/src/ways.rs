//! Runs one shader in several ways: from its source with all passes, without the optional passes, and through
//! the text of a compiled shader.

#![allow(clippy::panic, reason = "what the tests check is checked here")]

use crate::run;
use osl::stages;
use osl_exec::RunOptions;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

/// Checks the text that a shader prints at one point, in each of the ways, and that it reports nothing.
///
/// # Panics
/// It does not compile, prints a different text, or reports a message.
pub fn prints(text: &str, expected: &str) {
    let checked = stages::check("s.osl", text, &NoFiles, &Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{text}: {:#?}", checked.diagnostics));
    let written = osl_hir::oso::write(&program, &checked.sources, &Default::default())
        .unwrap_or_else(|e| panic!("{text}: {e:#?}"));
    let grid = Grid::new(1, 1);
    let none = passes::Options { without: passes::Pass::ALL.to_vec(), ..passes::Options::default() };
    for (name, text, options) in [
        ("s.osl", text, passes::Options::default()),
        ("s.osl", text, none),
        ("s.oso", &written, passes::Options::default()),
    ] {
        let varying = osl_exec::PointSource::varying(&grid).to_vec();
        let options = passes::Options { varying, ..options };
        let compiled =
            run::compile(name, text, &[], &options).unwrap_or_else(|e| panic!("{name}: {text}: {e}"));
        let frame =
            osl_exec::run(&compiled.program, &run::services(), &grid, &RunOptions::default(), &|_| ())
                .unwrap_or_else(|e| panic!("{name}: {text}: {e}"));
        let printed: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
        assert_eq!(printed, expected, "{name}: {text}");
        assert!(frame.messages.is_empty(), "{name}: {text}: {:?}", frame.messages);
    }
}
