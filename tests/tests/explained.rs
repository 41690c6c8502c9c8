//! What `explain` tells is what happens: values, outcomes of conditions and rounds of loops equal those of an
//! instrumented source, which prints them in an ordinary run; what a run reports is told; the text has the
//! values of the JSON; derivatives are central differences, except where a reason is given.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_tests::instrument::{self, Differences, Outcome};
use osl_tests::{generate, run};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// Why a derivative of the language may differ from a central difference.
const EXCEPTIONS: [&str; 17] = [
    "a number that is read from a string has no derivative",
    "a color of a space that is unknown, or known only at run time, has no derivative",
    "the filter of `gabor` noise has no derivative",
    "a period has no derivative",
    "`texture3d` has no derivative",
    "`texture` takes the changes of s and t from its arguments",
    "steps of large numbers look like a slope",
    "the sign of the derivative of `atan2` is reversed, as in the reference",
    "a color in a named space has no derivative",
    "a derivative has none itself",
    "a matrix has no derivative",
    "a message has no derivative",
    "`hash` noise has no derivative",
    "`fmod` has the derivative of its first argument only",
    "`blackbody` has no derivative",
    "`wavelength_color` has no derivative",
    "`environment` has no derivative",
];

/// Single differences: the source, how the law that it breaks begins, and the cause.
const KNOWN: [(&str, &str); 3] = [
    // `round(x * 0.5) * 2` of large numbers: 0 in the language, and a step of 8192 by differences.
    ("large_coords.osl", "`e`, line 2: derivative 0 along X"),
    // 1.25 in the language; -8e-41 by differences, between which numbers of 1e38 cancel.
    ("2544", "`r6[1]`, line 18: derivative 1.25 along Y"),
    // 1.25 in the language, and 0 by differences. The cause is not known.
    ("2321", "`r10`, line 45: derivative 1.25 along Y"),
];

fn text(seed: u64) -> String {
    generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100))
}

/// Compares all sources; at most this share may be left open. Of every `more`-th source, the reasons, the
/// derivatives and the calls of functions of the language are compared too.
fn hold(sources: impl Iterator<Item = (String, String)>, most_open: f64, more: usize) {
    let (mut n, mut open, mut compared, mut broken) = (0, 0, 0, Vec::new());
    let mut others = [0; 3];
    let (mut reported, mut texted, mut differences) = (0, 0, Differences::default());
    for (name, text) in sources {
        n += 1;
        match catch_unwind(|| instrument::hold(&text, n % more == 0)) {
            Ok(Ok(outcome)) => {
                compared += outcome.compared;
                open += usize::from(outcome.open);
                let Outcome { reasons, slopes, builtins, .. } = outcome;
                (reported, texted) = (reported + outcome.reports, texted + outcome.texts);
                differences.add(outcome.differences);
                others.iter_mut().zip([reasons, slopes, builtins]).for_each(|(sum, n)| *sum += n);
            }
            Ok(Err(law)) => {
                let is_known = KNOWN.iter().any(|(of, how)| name.ends_with(of) && law.starts_with(how));
                if !is_known {
                    broken.push((name, law));
                }
            }
            Err(_) => broken.push((name, "panics".to_string())),
        }
    }
    let [reasons, slopes, builtins] = others;
    println!("{n} sources, {open} open, {compared} facts compared");
    println!("{reasons} reasons, {slopes} derivatives, {builtins} calls of functions of the language");
    println!("{reported} reports of runs, {texted} values of texts");
    println!("{} derivatives are differences; {:?} are not", differences.same, differences.excepted);
    for (name, law) in broken.iter().take(8) {
        println!("--- {name}: {}", law.chars().take(3000).collect::<String>());
    }
    assert!(broken.is_empty(), "{} of {n}", broken.len());
    assert!(texted > n && differences.same * more > n, "hardly anything was compared");
    let unknown = differences.excepted.keys().find(|why| !EXCEPTIONS.contains(&why.as_str()));
    assert_eq!(unknown, None, "a derivative differs for a reason that is not listed");
    assert!(compared > n && others.iter().all(|sum| sum * more > n), "hardly anything was compared");
    assert!(f64::from(open as u32) <= most_open * f64::from(n as u32), "{open} of {n} are open");
}

fn generated(seeds: std::ops::Range<u64>) -> impl Iterator<Item = (String, String)> {
    seeds.map(|seed| (seed.to_string(), text(seed)))
}

/// The shaders of the project, and those below the folders in the environment variable `OSL_SHADERS`.
fn sources() -> Vec<PathBuf> {
    fn collect(folder: &Path, out: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, out);
            } else if path.extension().is_some_and(|e| e == "osl") {
                out.push(path);
            }
        }
    }
    let mut out = Vec::new();
    ["tests/data", "osl", "examples"].iter().for_each(|folder| collect(&run::root().join(folder), &mut out));
    let more = std::env::var_os("OSL_SHADERS").unwrap_or_default();
    let more = std::env::split_paths(&more).filter(|folder| !folder.as_os_str().is_empty());
    more.for_each(|folder| collect(&folder, &mut out));
    out.sort();
    out
}

fn files(every: usize) -> impl Iterator<Item = (String, String)> {
    let list = sources().into_iter().step_by(every);
    list.filter_map(|path| Some((path.display().to_string(), std::fs::read_to_string(&path).ok()?)))
}

#[test]
fn of_generated_programs() {
    // The last ones were once told wrong: formatted closures, a variable that is also an argument, regular
    // expressions.
    hold(
        generated(0..300).chain([166, 180, 213, 380, 383].map(|seed| (seed.to_string(), text(seed)))),
        0.2,
        4,
    );
}

#[test]
fn of_files() {
    hold(files(16), 0.6, 4);
}

/// Run it with `cargo test --release -p osl-tests --test explained -- --ignored`. The variable `OSL_SHADERS`
/// adds folders with shaders.
#[test]
#[ignore = "takes minutes"]
fn of_many_programs() {
    hold(generated(0..3000), 0.2, 1);
}

#[test]
#[ignore = "takes minutes"]
fn of_all_files() {
    hold(files(1), 0.6, 1);
}
