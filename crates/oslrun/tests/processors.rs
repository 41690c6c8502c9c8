//! Results are the same to the bit on other processors: an emulator runs the command with fewer instruction
//! sets than this machine has, and the system denies it memory for machine code. `tests/aarch64.sh` does the
//! same for another architecture.
//!
//! A test that cannot run here says so: the emulator is `qemu-x86_64` (Debian's `qemu-user`).

#![cfg(all(target_os = "linux", target_arch = "x86_64"))]
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a test says what must hold")]

use std::path::Path;
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Shaders that together use noise, elementary functions, loops and colors.
const SHADERS: [&str; 4] =
    ["osl/flakes.osl", "osl/chaosmosaic.osl", "osl/strips.osl", "osl/nonlinear_noise.osl"];

/// The image of a shader, as bytes; `before` is a command line that starts the command.
fn image(before: &[&str], shader: &str, arithmetic: &str, dir: &Path) -> Vec<u8> {
    let out = dir.join("out.exr");
    let this = env!("CARGO_BIN_EXE_oslrun");
    let mut words = before.iter().copied().chain([this]);
    let mut command = Command::new(words.next().unwrap());
    command.args(words).arg(Path::new(ROOT).join(shader));
    command.args(["-g", "24x20", "--threads", "1", "--compression", "none", "--arithmetic", arithmetic]);
    let run = command.arg("-o").arg(&out).output().unwrap();
    assert!(run.status.success(), "{before:?} {shader}: {}", String::from_utf8_lossy(&run.stderr));
    std::fs::read(&out).unwrap()
}

/// Compares this way to run the command with a plain run.
fn same_bits(before: &[&str], shaders: &[&str], arithmetics: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    for shader in shaders {
        for arithmetic in arithmetics {
            let expected = image(&[], shader, arithmetic, dir.path());
            let got = image(before, shader, arithmetic, dir.path());
            assert!(expected == got, "{before:?}: {shader}, {arithmetic}: other bits");
        }
    }
}

/// Whether a program can be started.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|run| run.status.success())
}

#[test]
fn processors_without_wide_vectors() {
    if !is_there("qemu-x86_64") {
        println!("left out: no qemu-x86_64 (apt-get install qemu-user)");
        return;
    }
    // SSE4.2 only, and AVX2 with fused multiply-add: neither has AVX-512.
    for cpu in ["Nehalem", "Haswell"] {
        same_bits(&["qemu-x86_64", "-cpu", cpu], &SHADERS, &["strict", "f64"]);
    }
}

#[test]
fn a_system_that_refuses_memory_for_code() {
    // `prctl(PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN)` of Linux 6.3: no page becomes executable.
    let refuse = "import ctypes, os, sys\n\
        if ctypes.CDLL(None).prctl(65, 1, 0, 0, 0): sys.exit(77)\n\
        os.execvp(sys.argv[1], sys.argv[1:])";
    let before = ["python3", "-c", refuse];
    match Command::new("python3").args(["-c", refuse, "true"]).status() {
        Ok(status) if status.success() => same_bits(&before, &SHADERS, &["strict", "fast"]),
        _ => println!("left out: no python3, or a system without PR_SET_MDWE"),
    }
}
