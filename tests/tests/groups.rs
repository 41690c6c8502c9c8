//! Shader groups against recorded runs: `tests/data/groups/CASE/`, with `group.txt`, the layers' sources, the values of the
//! last layer's outputs in `out.csv` and what was printed in `out.txt`.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_exec::{PointSource, RunOptions};
use osl_ir::passes;
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};
use osl_tests::golden::{Golden, compare};
use osl_tests::host;
use osl_tests::run;
use oslrun::pipeline::{self, ShaderFiles};
use std::path::{Path, PathBuf};

/// The shaders of a folder.
struct Folder(PathBuf);

impl ShaderFiles for Folder {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let file = format!("{shader}.osl");
        let text = std::fs::read_to_string(self.0.join(&file)).map_err(|e| e.to_string())?;
        Ok((file, text))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// How far values may be off, absolutely or relatively: noise, and what goes through approximations.
const TOLERANCE: f32 = 5e-6;

fn case(folder: &Path) -> Result<String, String> {
    let text = std::fs::read_to_string(folder.join("group.txt")).unwrap();
    let files = Folder(folder.to_path_buf());
    let checked = pipeline::check_group("group.txt", &text, "unnamed_group_1", &files, &Options::default());
    let group = checked.group.ok_or_else(|| format!("{:#?}", checked.diagnostics))?;
    let csv = [folder.join("out.csv"), folder.join("out.csv.gz")].into_iter().find(|p| p.is_file()).unwrap();
    let mut golden = Golden::load(&csv)?;
    golden.untangle(|_| false);
    let host = host::renderer(&golden);
    // The recorder asked for the outputs of the last layer by their names, whatever layer has them.
    let last = group.layers().last().unwrap().program.clone();
    let outputs = last.shader.params.iter().filter(|p| p.output);
    let outputs: Vec<_> = outputs.map(|p| last.vars[p.var.0 as usize].name.clone()).collect();
    let body = osl_ir::lower::lower_group(&group, &outputs).map_err(|e| format!("{e:?}"))?;
    let passes = passes::Options {
        varying: host.varying().to_vec(),
        slopes: host.varying_slopes().to_vec(),
        ..passes::Options::default()
    };
    let compiled = pipeline::finish(body, &passes);
    let frame = osl_exec::run(
        &compiled.program,
        &host::services(&golden, &host),
        &host,
        &RunOptions::default(),
        &|_| (),
    );
    let frame = frame.map_err(|e| e.to_string())?;
    let columns = run::columns(&frame);
    let (mut total, mut exact) = (0, 0);
    for (name, expected) in golden.columns.iter().filter(|(name, _)| name != "u" && name != "v") {
        let got = &columns.iter().find(|(n, _)| n == name).ok_or_else(|| format!("no output {name}"))?.1;
        let c = compare(expected, got, TOLERANCE);
        total += c.total;
        exact += c.exact;
        if c.within != c.total {
            return Err(format!("{name}: {} of {} differ, worst {:?}", c.total - c.within, c.total, c.worst));
        }
    }
    let place =
        |span| checked.sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut said: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    for (error, line) in frame.said(place) {
        said += &format!("{}: {line}\n", if error { "ERROR" } else { "WARNING" });
    }
    let expected = std::fs::read_to_string(folder.join("out.txt")).unwrap_or_default();
    if said != expected {
        return Err(format!("printed\n{said}for\n{expected}"));
    }
    Ok(format!("{exact} of {total} values exact"))
}

#[test]
fn recorded_groups() {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(run::root().join("tests/data/groups"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 40);
    let mut failed = 0;
    for folder in &folders {
        let name = folder.file_name().unwrap().to_string_lossy();
        match case(folder) {
            Ok(done) => println!("{name}: {done}"),
            Err(why) => {
                failed += 1;
                println!("FAILED {name}: {}", why.chars().take(1500).collect::<String>());
            }
        }
    }
    assert_eq!(failed, 0);
}
