//! `--samples` and related options, and `tradeoff`, on the command line.

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
    ok(&folder, &["@/s.osl", "-g", "40x30", "--no-command", "-o", "@/a.exr"]);
    for option in
        [&["--samples", "1"][..], &["--shading-rate", "1x1"], &["--samples", "1", "--filter", "gaussian"]]
    {
        let mut args = vec!["@/s.osl", "-g", "40x30", "--no-command", "-o", "@/b.exr"];
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
    let (_, err) = ok(&folder, &["@/s.osl", "-g", "24x20", "-o", "@/a.exr", "--max-error", "0.1", "--stats"]);
    assert!(err.contains("error at all 480 pixels") && err.contains("% of them are within 0.1\n"), "{err}");
}

#[test]
fn an_error_may_be_a_share_of_the_range_and_differ_by_output() {
    let folder = folder();
    let text =
        "shader s(output float r = 0, output float w = 0) { r = step(0.437, u + 0.3 * v); w = 100 * r; }";
    std::fs::write(folder.path().join("w.osl"), text).unwrap();
    let file = |shader: &str, error: &str| {
        let (_, err) =
            ok(&folder, &[shader, "-g", "96x80", "--no-command", "-o", "@/a.exr", "--max-error", error]);
        (bytes(&folder, "a.exr"), err)
    };
    let (shares, notes) = file("@/w.osl", "10%");
    assert!(
        notes.contains("note: 10 % of the range of w (0 to 100 at 1024 pixels) is an error of 10\n"),
        "{notes}"
    );
    let (numbers, silence) = file("@/w.osl", "r=0.1,w=10");
    assert!(shares == numbers && silence.is_empty(), "{silence}");
    assert!(file("@/w.osl", "w=10,0.1").0 == shares && file("@/w.osl", "10 %, r=0.1").0 == shares);
    assert!(file("@/w.osl", "0.5").0 != shares);
    assert!(file("@/s.osl", "0.1").0 == file("@/s.osl", "c=0.1,r=0.1").0);
    let (_, notes) = file("@/w.osl", "w=10");
    assert!(notes.contains("note: the error of r has no bound"), "{notes}");
    // Of a picture with light, the range is that of a screen.
    let lit = |error: &str| {
        ok(&folder, &["@/s.osl", "--preview", "-g", "24x16", "-o", "@/a.png", "--max-error", error]);
        bytes(&folder, "a.png")
    };
    assert!(lit("50%") == lit("0.5"));
}

#[test]
fn an_error_bound_that_is_missed_is_a_warning_and_an_exit_code() {
    let folder = folder();
    let text = "shader s(float k = 1, output float r = 0) { r = k * noise(\"hash\", P * 1e4); }";
    std::fs::write(folder.path().join("rough.osl"), text).unwrap();
    let run = |most: &str, more: &[&str]| {
        let args = ["@/rough.osl", "-g", "24x24", "--max-error", "10%", "--samples", most];
        oslrun(folder.path(), &[&args, more].concat())
    };
    for more in [&[][..], &["--stats"]] {
        let (code, out, err) = run("4", &[&["-o", "@/a.exr"], more].concat());
        assert_eq!(code, 1, "{err}");
        assert!(err.contains("warning: the error bound") && err.contains("is missed"), "{err}");
        assert!(err.contains("at most 4 samples, and --samples N sets this limit"), "{err}");
        assert!(out.contains("wrote") && !bytes(&folder, "a.exr").is_empty(), "{out}");
        std::fs::remove_file(folder.path().join("a.exr")).unwrap();
        let (code, _, err) = run("4096", more);
        assert!(code == 0 && !err.contains("warning"), "{err}");
    }
    let (code, json, _) = run("4", &["--json"]);
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &value["max_error"]["kept"]), (1, &false.into()), "{value}");
    let bound = value["max_error"]["bounds"][0]["bound"].as_f64().unwrap();
    assert!((0.09..0.11).contains(&bound), "{value}");
    // All pictures of a command are written.
    let (code, _, _) = run("4", &["--frames", "1-2", "-o", "@/f.#.png"]);
    assert_eq!((code, bytes(&folder, "f.2.png").is_empty()), (1, false));
    let (code, _, _) = run("4", &["-p", "k=1:2:2", "-o", "@/sheet.png"]);
    assert_eq!((code, bytes(&folder, "sheet.png").is_empty()), (1, false));
}

/// Specks that are smaller than a pixel, in few cells: hardly any probe hits one.
const DUST: &str = "shader dust(output float mask = 0)
{
    point p = point(u, v, 0) * 200;
    point cell = floor(p);
    if (noise(\"hash\", cell + 31) < 0.006)
        mask = distance(p, cell + vector(0.5, 0.5, 0)) < 0.2;
}";

#[test]
fn a_promise_is_tested_without_statistics_too() {
    let folder = folder();
    std::fs::write(folder.path().join("dust.osl"), DUST).unwrap();
    for more in [&[][..], &["--stats"]] {
        let args = [&["@/dust.osl", "-g", "512x512", "--max-error", "2%", "-o", "@/a.exr"], more].concat();
        let (code, _, err) = oslrun(folder.path(), &args);
        assert_eq!(code, 1, "{err}");
        assert!(err.contains("% of the compared pixels exceed it, and 0.1 % may"), "{err}");
    }
}

#[test]
fn a_time_gives_the_picture_of_the_samples_that_it_names() {
    let folder = folder();
    for (time, more) in [("1ms", &[][..]), ("600ms", &["--filter", "mitchell"])] {
        for name in ["a.exr", "a.c.png"] {
            let path = if name == "a.exr" { "@/a.exr" } else { "@/a.png" };
            let run = |plan: &[&str]| {
                let (out, _) = ok(
                    &folder,
                    &[&["@/s.osl", "-g", "40x30", "--no-command", "-o", path], plan, more].concat(),
                );
                (bytes(&folder, name), out)
            };
            let (timed, out) = run(&["--within", time]);
            let named = out.split_once("--samples ").unwrap().1.split_once(' ').unwrap().0;
            assert!(run(&["--samples", named]).0 == timed, "{out}");
            assert!(out.contains("error at ") && out.contains(" rms "), "{out}");
        }
    }
    // So many noises take longer than that.
    let text = "shader s(output float r = 0) { for (int i = 0; i < 400; ++i) r += noise(i * P); }";
    std::fs::write(folder.path().join("slow.osl"), text).unwrap();
    let (json, err) = ok(&folder, &["@/slow.osl", "-g", "128x128", "--within", "1ms", "--json"]);
    assert!(err.contains("warning: 1ms of --within are too short for one sample"), "{err}");
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&value["within"]["samples"], &value["within"]["fits"]),
        (&1.into(), &false.into()),
        "{value}"
    );
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
    let cases: [(&[&str], &str); 26] = [
        (&["--samples", "0"], "1..=65536"),
        (&["--samples", "99999999"], "1..=65536"),
        (&["--samples", "-3"], "-3"),
        (&["--filter", "tent"], "blackman-harris"),
        (&["--filter", "box,0"], "0.01 to 64"),
        (&["--shading-rate", "3x3"], "4x4"),
        (&["--shading-rate", "2x2", "--samples", "4"], "cannot be used with"),
        (&["--max-error", "0"], "above 0"),
        (&["--max-error", "nan"], "above 0"),
        (&["--within", "0"], "a time from 1ms"),
        (&["--within", "-5s"], "-5s"),
        (&["--within", "soon"], "such as 5s, 0.5s or 500ms, not `soon`"),
        (&["--within", "1s", "--samples", "4"], "cannot be used with"),
        (&["--within", "1s", "--max-error", "2%"], "cannot be used with"),
        (&["--within", "1s", "--adaptive", "0.1"], "cannot be used with"),
        (&["--within", "1s", "--preview", "-o", "@/a.png"], "cannot be used with"),
        (&["--within", "1s", "--on", "sphere"], "are for the grid"),
        (&["--max-error", "-2%"], "a share of the range is above 0 %"),
        (&["--max-error", "abc%"], "a share of the range is above 0 %"),
        (&["--max-error", "200%"], "up to 100 %"),
        (&["--max-error", "r=1%,r=2%"], "`r` is named twice"),
        (&["--max-error", "x=1%"], "`x` is no output of this picture; its outputs are r, c"),
        (&["--max-error", "x=2%", "--on", "sphere"], "`x` is no output of this picture"),
        (&["--max-error", "r=2%", "--preview", "-o", "@/a.png"], "it is one number for all"),
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
fn what_is_filtered_is_said() {
    let folder = folder();
    let common = ["@/s.osl", "-g", "64x64", "--stats", "-o", "@/a.exr", "--prefilter"];
    let (_, err) = ok(&folder, &common);
    assert!(err.contains("prefilter: 2 steps and noises are filtered"), "{err}");
    let text = "shader cells(output float r = 0) { r = floor(3 * step(0.5, u)) + noise(\"cell\", 9 * P); }";
    std::fs::write(folder.path().join("cells.osl"), text).unwrap();
    let (_, err) = ok(
        &folder,
        &["@/cells.osl", "-g", "64x64", "--stats", "--no-command", "-o", "@/b.exr", "--prefilter"],
    );
    assert!(err.contains("prefilter: no step or noise of this shader can be filtered"), "{err}");
    ok(&folder, &["@/cells.osl", "-g", "64x64", "--no-command", "-o", "@/c.exr"]);
    assert_eq!(bytes(&folder, "b.exr"), bytes(&folder, "c.exr"));
    let (out, _) = ok(&folder, &[&common[..], &["--json"]].concat());
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    let said = value["stats"]["prefilter"].as_str().unwrap();
    assert_eq!(said, "prefilter: 2 steps and noises are filtered");
}

#[test]
fn where_fast_is_said_to_change_nothing_the_picture_is_the_same() {
    let folder = folder();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [root.join("../../osl"), root.join("benches/shaders/suite")];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let (mut same, mut all) = (0, 0);
    for file in
        files.map(|file| file.unwrap().path()).filter(|file| file.extension().is_some_and(|e| e == "osl"))
    {
        let common = [file.to_str().unwrap(), "-g", "16x16", "--no-command", "--allow-files"];
        let with = |more: &[&str]| {
            let (code, _, err) = oslrun(folder.path(), &[&common[..], more].concat());
            (code, err)
        };
        let (code, err) = with(&["--arithmetic", "fast", "--stats", "-o", "@/fast.exr"]);
        if code != 0 {
            continue;
        }
        all += 1;
        if err.contains("`--arithmetic fast` changes nothing here") {
            same += 1;
            let _ = with(&["-o", "@/strict.exr"]);
            assert_eq!(bytes(&folder, "fast.exr"), bytes(&folder, "strict.exr"), "{}", file.display());
        }
    }
    assert!(same > 0 && same < all, "{same} of {all}");
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
    for row in ["strict, 1 sample", "f64, 1 sample", "prefilter, 1 sample"] {
        assert!(table.contains(row), "{row}: {table}");
    }
    // What changes nothing is said, and not measured.
    let text = "shader plain(output float r = 0) { r = floor(3 * u) + floor(2 * v); }";
    std::fs::write(folder.path().join("plain.osl"), text).unwrap();
    let (plain, _) = ok(&folder, &["tradeoff", "@/plain.osl", "-g", "24x24", "--budget", "0.3"]);
    assert!(!plain.contains("fast, ") && !plain.contains("prefilter, "), "{plain}");
    for said in
        ["fast` changes nothing here: the program has no operation", "`--prefilter` changes nothing here"]
    {
        assert!(plain.contains(said), "{said}: {plain}");
    }
    let (_, end) = table.split_once("What to take for an error at 999 of 1000 pixels").unwrap();
    for start in
        ["For 5 % of the range of r (0.05): ", "For 1 % of the range of c (0.01): ", "`--arithmetic fast` "]
    {
        assert!(end.lines().any(|line| line.starts_with(start)), "{start}: {table}");
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
