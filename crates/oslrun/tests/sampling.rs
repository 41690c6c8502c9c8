//! `--samples` and related options, and `tradeoff`, on the command line.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use std::path::Path;
use tempfile::TempDir;

/// Exit code, standard output and standard error of a command line.
fn oslrun(folder: &Path, args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["oslrun"].iter().chain(args).map(|a| a.replace("@", folder.to_str().unwrap()).into());
    let code = oslrun::cli::main(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(output float r = 0, output color c = 0) {
        r = step(0.437, u + 0.3 * v);
        c = color(u, v, noise(9 * P));
    }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    std::fs::write(
        folder.path().join("nan.osl"),
        "shader s(output float r = 0) { r = u > 0.5 ? pow(10, 30) * pow(10, 30) : u; }",
    )
    .unwrap();
    folder
}

fn ok(folder: &TempDir, args: &[&str]) -> (String, String) {
    let (code, out, err) = oslrun(folder.path(), args);
    assert_eq!(code, 0, "{args:?}: {err}");
    (out, err)
}

fn bytes(folder: &TempDir, name: &str) -> Vec<u8> {
    std::fs::read(folder.path().join(name)).unwrap()
}

#[test]
fn one_sample_writes_the_same_file() {
    let folder = folder();
    ok(&folder, &["@/s.osl", "-g", "40x30", "-o", "@/a.exr"]);
    for option in
        [&["--samples", "1"][..], &["--shading-rate", "1x1"], &["--samples", "1", "--filter", "gaussian"]]
    {
        let mut args = vec!["@/s.osl", "-g", "40x30", "-o", "@/b.exr"];
        args.extend(option);
        ok(&folder, &args);
        assert_eq!(bytes(&folder, "a.exr"), bytes(&folder, "b.exr"), "{option:?}");
    }
}

#[test]
fn every_way_writes_every_kind_of_file_again_the_same() {
    let folder = folder();
    let ways: [&[&str]; 8] = [
        &["--samples", "5"],
        &["--samples", "4", "--filter", "mitchell"],
        &["--samples", "4", "--filter", "blackman-harris,2.5"],
        &["--shading-rate", "4x4"],
        &["--adaptive", "0.05", "--samples", "32"],
        &["--max-error", "0.1"],
        &["--samples", "4", "--prefilter"],
        &["--prefilter"],
    ];
    for way in ways {
        for (first, second) in [("a.exr", "b.exr"), ("a.png", "b.png")] {
            for name in [first, second] {
                let (file, threads) = (format!("@/{name}"), if name == first { "1" } else { "2" });
                let mut args = vec!["@/s.osl", "-g", "70x50", "-o", &file, "--threads", threads];
                args.extend(way);
                ok(&folder, &args);
            }
            let names =
                |name: &str| if name.ends_with("png") { name.replace(".png", ".c.png") } else { name.into() };
            assert_eq!(bytes(&folder, &names(first)), bytes(&folder, &names(second)), "{way:?}");
        }
    }
}

#[test]
fn what_an_image_took_is_said_and_checked() {
    let folder = folder();
    let (out, _) = ok(&folder, &["@/s.osl", "-g", "64x64", "-o", "@/a.exr", "--max-error", "0.1"]);
    assert!(out.contains("evaluations a pixel"), "{out}");
    let (_, err) = ok(&folder, &["@/s.osl", "-g", "64x64", "-o", "@/a.exr", "--max-error", "0.1", "--stats"]);
    assert!(err.contains("error at 256 pixels") && err.contains("% of them are within 0.1"), "{err}");
}

#[test]
fn values_that_are_no_numbers_are_counted() {
    let folder = folder();
    for way in [["--samples", "4"], ["--max-error", "0.1"], ["--adaptive", "0.1"]] {
        let (out, _) = ok(&folder, &["@/nan.osl", "-g", "20x20", way[0], way[1]]);
        assert!(out.contains("not a number or infinite"), "{way:?}: {out}");
    }
}

#[test]
fn nonsense_is_refused_in_words() {
    let folder = folder();
    let cases: [(&[&str], &str); 11] = [
        (&["--samples", "0"], "1..=65536"),
        (&["--samples", "99999999"], "1..=65536"),
        (&["--samples", "-3"], "-3"),
        (&["--filter", "tent"], "blackman-harris"),
        (&["--filter", "box,0"], "0.01 to 64"),
        (&["--shading-rate", "3x3"], "4x4"),
        (&["--shading-rate", "2x2", "--samples", "4"], "cannot be used with"),
        (&["--max-error", "0"], "above 0"),
        (&["--max-error", "nan"], "above 0"),
        (&["--max-error", "0.1", "--adaptive", "0.1"], "cannot be used with"),
        (&["--closures", "--samples", "4"], "one sample"),
    ];
    for (args, word) in cases {
        let mut all = vec!["@/s.osl", "-g", "8x8"];
        all.extend(args);
        let (code, _, err) = oslrun(folder.path(), &all);
        assert!(code != 0 && err.contains(word), "{args:?}: {err}");
    }
}

#[test]
fn a_trade_off_comes_as_text_values_and_a_page() {
    let folder = folder();
    let shader = ["tradeoff", "@/s.osl", "-g", "24x24", "--budget"];
    fn with<'a>(common: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
        [common, more].concat()
    }
    let common = with(&shader, &["0.3"]);
    // The first rows are measured even where this test shares its processors with many others.
    let (table, _) = ok(&folder, &with(&shader, &["6"]));
    for row in ["strict, 1 sample", "fast, 1 sample", "f64, 1 sample", "prefilter, 1 sample"] {
        assert!(table.contains(row), "{row}: {table}");
    }
    let (json, _) = ok(&folder, &with(&common, &["--json"]));
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["outputs"][0]["name"], "r");
    let (values, _) = ok(&folder, &with(&common, &["--csv", "--outputs", "c"]));
    assert!(values.lines().skip(1).all(|line| line.starts_with("c,")), "{values}");
    ok(&folder, &with(&common, &["--html", "@/page.html"]));
    let page = String::from_utf8(bytes(&folder, "page.html")).unwrap();
    assert!(page.contains("data:image/png;base64,") && page.contains("<svg"));
    let (code, _, err) = oslrun(folder.path(), &with(&common, &["--samples", "4"]));
    assert!(code == 2 && err.contains("--samples has no effect in `tradeoff`"), "{err}");
    let (code, _, err) = oslrun(folder.path(), &["tradeoff", "@/s.osl", "--budget", "0"]);
    assert!(code == 2 && err.contains("number of seconds"), "{err}");
}
