//! Whether `--within` keeps its time: ten shaders with two times each, by the clock and on all threads, as a
//! user runs them. Expect: the picture and its measured error take 0.9 to 1.1 times the time. Prints a
//! table; takes half a minute.
//!
//! ```sh
//! cargo bench -p oslrun --bench within
//! ```

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench says what it finds"
)]

use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Arguments of the command, separated by spaces, and the times. **Units:** seconds.
const CASES: [(&str, [f64; 2]); 10] = [
    ("osl/Cobbled.osl -g 256x256", [0.5, 2.0]),
    ("osl/flakes.osl -g 512x512", [0.5, 2.0]),
    ("osl/strips.osl -g 128x128", [0.2, 1.0]),
    ("osl/nonlinear_noise.osl -p type=recursive -g 512x512", [0.5, 2.0]),
    ("osl/chaosmosaic.osl -p Image=tests/data/textures/tex64.png -g 256x256", [1.0, 3.0]),
    ("crates/oslrun/benches/shaders/gabor.osl -g 128x128", [1.0, 3.0]),
    ("crates/oslrun/benches/shaders/suite/mandelbrot.osl -g 256x256", [0.5, 2.0]),
    ("crates/oslrun/benches/shaders/suite/worley.osl -g 512x512", [1.0, 3.0]),
    ("crates/oslrun/benches/shaders/suite/marble.osl -g 64x64 --filter mitchell", [0.2, 1.0]),
    ("crates/oslrun/benches/shaders/suite/bricks.osl -g 1024x1024", [1.0, 3.0]),
];

fn main() {
    // `cargo test` and `cargo bench -- --quick` only check that it works.
    let quick = std::env::args().any(|a| a == "--test" || a == "--quick")
        || !std::env::args().any(|a| a == "--bench");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().expect("a folder");
    println!("| shader | time | taken | share | whole command | samples |\n|---|---:|---:|---:|---:|---:|");
    let mut kept = 0;
    for (case, times) in CASES.iter().take(if quick { 1 } else { CASES.len() }) {
        for time in times {
            let started = Instant::now();
            let output = Command::new(env!("CARGO_BIN_EXE_oslrun"))
                .args(case.split(' '))
                .args(["--within", &format!("{time}s"), "--json", "-o"])
                .arg(folder.path().join("picture.exr"))
                .current_dir(&root)
                .output()
                .expect("the command");
            let whole = started.elapsed().as_secs_f64();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a report");
            let taken = report["within"]["seconds"].as_f64().expect("seconds");
            kept += u32::from((0.9..=1.1).contains(&(taken / time)));
            let name = case.split(' ').find_map(|word| word.strip_suffix(".osl")).unwrap_or(case);
            let name = name.rsplit('/').next().unwrap_or(name);
            let size = case.split(' ').skip_while(|word| *word != "-g").nth(1).unwrap_or("");
            println!(
                "| {name}, {size} | {time} s | {taken:.3} s | {:.2} | {whole:.2} s | {} |",
                taken / time,
                report["within"]["samples"]
            );
        }
    }
    println!("{kept} within a tenth");
}
