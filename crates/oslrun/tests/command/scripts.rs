//! Users' scripts, run unchanged: the tools are links to this program. A folder of `tests/data/scripts`
//! contains the files of a project with its `run.sh`, and `expected.txt` with its printed text, both streams
//! in order.

#![cfg(unix)]
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::write(&target, fs::read(entry.path()).unwrap()).unwrap();
        }
    }
}

/// The text that the script of a folder prints, with its exit code, in a copy of the folder.
fn run(name: &str) -> (String, String) {
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/scripts").join(name);
    let dir = tempfile::tempdir().unwrap();
    let (project, tools) = (dir.path().join("project"), dir.path().join("tools"));
    copy(&source, &project);
    fs::create_dir(&tools).unwrap();
    for tool in ["oslc", "oslinfo", "testshade"] {
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_oslrun"), tools.join(tool)).unwrap();
    }
    let path = std::env::var("PATH").unwrap_or_default();
    let output = Command::new("bash")
        .args(["-c", "exec 2>&1; bash run.sh"])
        .env("PATH", format!("{}:{path}", tools.display()))
        // A `make` that runs this test would set them.
        .env_remove("MAKEFLAGS")
        .env_remove("MAKELEVEL")
        .env("LC_ALL", "C")
        .current_dir(&project)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let code = output.status.code().unwrap_or(-1);
    let printed = format!("{}[exit {code}]\n", String::from_utf8_lossy(&output.stdout));
    (printed, fs::read_to_string(source.join("expected.txt")).unwrap())
}

#[test]
fn make_builds_a_folder_of_shaders() {
    if Command::new("make").arg("--version").stdout(Stdio::null()).status().is_err() {
        println!("skipped: there is no make");
        return;
    }
    let (printed, expected) = run("make");
    assert_eq!(printed, expected);
}

#[test]
fn a_batch_writes_images_and_reads_them() {
    let (printed, expected) = run("batch");
    assert_eq!(printed, expected);
}

#[test]
fn a_set_of_udim_tiles() {
    let (printed, expected) = run("udim");
    assert_eq!(printed, expected);
}

#[test]
fn nodes_with_the_headers_of_a_vendor() {
    let (printed, expected) = run("vendor");
    assert_eq!(printed, expected);
}
