//! Records the commit for `oslrun --version`; sources outside of a repository have none, which is no error.
//! And it makes the binary for users smaller: it strips one without debug information (Cargo forgets `strip`
//! of a profile for a package that has its own `opt-level`), and uses what the linker and the system support.

#![allow(clippy::print_stdout, reason = "this is how a build script answers")]

use std::env::var;
use std::path::Path;
use std::process::Command;

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(text.trim().to_string()).filter(|text| !text.is_empty())
}

/// Options of linkers that make a binary smaller: a packed form for the addresses that the system adjusts at
/// the start, which not every system can read, and one copy of functions with the same code.
const SMALLER: [&str; 2] = ["-Wl,-z,pack-relative-relocs", "-Wl,--icf=all"];

/// Whether an empty program can be linked with an option, and runs.
fn works(option: &str) -> bool {
    let attempt = || {
        let folder = var("OUT_DIR").ok()?;
        let (source, program) = (Path::new(&folder).join("empty.rs"), Path::new(&folder).join("empty"));
        std::fs::write(&source, "fn main() {}").ok()?;
        let mut rustc = Command::new(var("RUSTC").ok()?);
        if let Ok(linker) = var("RUSTC_LINKER") {
            rustc.arg(format!("-Clinker={linker}"));
        }
        rustc.args(var("CARGO_ENCODED_RUSTFLAGS").ok()?.split('\x1f').filter(|flag| !flag.is_empty()));
        rustc.arg(format!("-Clink-arg={option}")).arg(&source).arg("-o").arg(&program);
        let is_linked = rustc.output().ok()?.status.success();
        (is_linked && Command::new(&program).status().ok()?.success()).then_some(())
    };
    attempt().is_some()
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |name: &str, value: &str| var(name).is_ok_and(|found| found == value);
    if is("PROFILE", "release") && is("DEBUG", "false") && is("CARGO_CFG_TARGET_OS", "linux") {
        println!("cargo::rustc-link-arg-bins=-Wl,--strip-all");
        let runs_here = var("HOST").is_ok_and(|host| is("TARGET", &host));
        for option in SMALLER.into_iter().filter(|option| runs_here && works(option)) {
            println!("cargo::rustc-link-arg-bins={option}");
        }
    }
    // The log of HEAD changes with each commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    if let Some(commit) = git(&["log", "-1", "--format=%h, %cs"]) {
        println!("cargo::rustc-env=OSLRUN_COMMIT={commit}");
    }
}
