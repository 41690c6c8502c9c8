//! The time of whole commands by the clock, as a user sees it: start, compilation, the range of the outputs,
//! the image on all threads, and the file. This module must not know what the results mean.

use crate::Selection;
use crate::shaders::{Shader, root};
use crate::table::Measured;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// The two commands run in turns, so many times each; the fastest run of each counts.
const RUNS: usize = 9;
/// If both together take longer than this, they run once. **Units:** milliseconds.
const LONG: f64 = 1000.0;

/// Where the times are kept.
pub(crate) fn file(wanted: &Selection) -> PathBuf {
    wanted.file.with_extension("commands.tsv")
}

/// Measures those cases of a shader that were measured already, as commands. A command has one sample
/// pattern, that of seed 0.
pub(crate) fn measure(shader: &Shader, wanted: &Selection) {
    let file = file(wanted);
    let done = crate::table::read(&std::fs::read_to_string(&file).unwrap_or_default());
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("shader.osl");
    std::fs::write(&source, shader.text()).expect("a shader");
    for case in wanted.results().into_iter().filter(|case| case.name == shader.name && case.seed == 0) {
        if done.iter().any(|one| one.key() == case.key()) || wanted.side.is_some_and(|side| side != case.side)
        {
            continue;
        }
        let Some((best, evaluations, _)) = case.best.clone() else { continue };
        let common = || {
            let mut arguments: Vec<OsString> = vec![source.clone().into(), "-g".into()];
            arguments.push(format!("{0}x{0}", case.side).into());
            arguments.extend(shader.arguments().into_iter().map(OsString::from));
            arguments
        };
        let own = [format!("--max-error={}%", 100.0 * case.error)];
        let fixed = match best.as_str() {
            "1x1" => Vec::new(),
            rate if rate.contains('x') => vec![format!("--shading-rate={rate}")],
            samples => vec![format!("--samples={samples}")],
        };
        let run = |options: &[String]| {
            let mut arguments = common();
            arguments.extend(options.iter().map(OsString::from));
            timed(arguments, &folder.path().join("picture.exr"))
        };
        let (mut time, mut fixed_time) = (run(&own), run(&fixed));
        for _ in 1..if time + fixed_time > LONG { 1 } else { RUNS } {
            time = time.min(run(&own));
            fixed_time = fixed_time.min(run(&fixed));
        }
        let found = Measured { time, best: Some((best, evaluations, fixed_time)), ..case };
        crate::append(&file, &found.line());
    }
}

/// The time of a command in milliseconds. A command whose picture misses its bound ends with status 1.
fn timed(arguments: Vec<OsString>, picture: &Path) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    command.args(arguments).arg("-o").arg(picture).current_dir(root());
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let status = command.status().expect("the command");
    let time = 1e3 * start.elapsed().as_secs_f64();
    assert!(matches!(status.code(), Some(0 | 1)), "{command:?}: {status}");
    time
}
