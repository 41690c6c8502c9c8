//! A real client: the one that is built into Neovim.

use std::path::Path;
use std::process::Command;

/// Neovim opens a published shader and asks for everything that a user does; its script checks the results.
#[test]
fn neovim_is_served() {
    let is_there = Command::new("nvim").arg("--version").output().is_ok_and(|run| run.status.success());
    if !is_there {
        println!("left out: nvim is not installed");
        return;
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let shader = folder.path().join("flakes.osl");
    std::fs::copy(here.join("../../osl/flakes.osl"), &shader).unwrap();
    let run = Command::new("nvim")
        .args(["--headless", "--clean", "-n", "-i", "NONE"])
        .arg(&shader)
        .arg("-S")
        .arg(here.join("tests/editor/neovim.lua"))
        .env("OSLRUN", env!("CARGO_BIN_EXE_oslrun"))
        .env("XDG_STATE_HOME", folder.path())
        .env("HOME", folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.contains("all served"), "{said}");
}
