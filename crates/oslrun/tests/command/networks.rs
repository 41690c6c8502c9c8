//! The networks of `examples`: each command of their page runs, on fewer points, and produces finite values.

use osl_image::read_image;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_command_of_the_page_runs() {
    let page = std::fs::read_to_string(root().join("examples/README.md")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let mut seen = BTreeSet::new();
    for command in page.split('`').filter(|text| text.starts_with("oslrun examples/networks/")) {
        let words: Vec<&str> = command.split(' ').collect();
        let option = |name: &str| words.iter().position(|w| *w == name).unwrap() + 1;
        let picture = words[option("-o")];
        assert!(root().join(picture).is_file(), "{command} was run");
        let out = dir.path().join("out.exr");
        let mut args: Vec<String> = words[1..].iter().map(|w| w.to_string()).collect();
        args[option("-o") - 1] = out.display().to_string();
        args[option("-g") - 1] = "16x16".to_string();
        let done =
            Command::new(env!("CARGO_BIN_EXE_oslrun")).args(&args).current_dir(root()).output().unwrap();
        assert!(done.status.success(), "{command}: {}", String::from_utf8_lossy(&done.stderr));
        let image = read_image(&out).unwrap();
        assert!(image.samples.iter().all(|x| x.is_finite()), "{command}");
        let (low, high) = image.samples.iter().fold((f32::MAX, f32::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        assert!(low < high, "{command}: something is to be seen");
        seen.insert(root().join(words[1]).file_name().unwrap().to_owned());
    }
    let files = std::fs::read_dir(root().join("examples/networks")).unwrap();
    let files: BTreeSet<_> = files.map(|e| e.unwrap().file_name()).collect();
    assert_eq!(seen, files, "each network has a picture");
}

#[test]
fn nodes_are_found_anywhere_and_files_go_before_them() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
        let out = command.args(args).args(["-g", "4x4"]).current_dir(dir.path()).output().unwrap();
        (
            out.status.success(),
            String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr),
        )
    };
    let (done, text) = run(&["--group", "shader fractal f"]);
    assert!(done && text.contains("result: 0."), "{text}");
    let (done, text) = run(&["--group", "param floot frequency 3; shader fractal f"]);
    assert!(!done && text.contains("<group>"), "{text}");
    let (done, text) = run(&["--group", "shader fractle f"]);
    assert!(!done && text.contains("nor is it built in"), "{text}");
    std::fs::write(dir.path().join("fractal.osl"), "shader fractal(output float mine = 1) {}").unwrap();
    let (done, text) = run(&["--group", "shader fractal f"]);
    assert!(done && text.contains("mine: 1 to 1"), "{text}");
    std::fs::write(dir.path().join("torn.osl"), "shader torn(output float o = 0) { o = 1;").unwrap();
    assert!(!run(&["--group", "shader torn t"]).0);
    let (done, text) = run(&["--group", "shader torn t", "--repair"]);
    assert!(done && text.contains("torn.osl (repaired)"), "{text}");
}

#[test]
fn nodes_are_strict_osl_without_a_warning_and_in_the_style() {
    let nodes = oslrun::nodes::names().map(|name| format!("osl/nodes/{name}.osl"));
    let files: Vec<String> = nodes.chain(["examples/networks/wood.osl".to_string()]).collect();
    for args in [&["check", "--strict-syntax", "--deny", "warnings"][..], &["fmt", "--check"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
        let done = command.args(args).args(&files).current_dir(root()).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&[done.stdout, done.stderr].concat()));
    }
}
