//! `--time`, `--global`, `--frames` and `--histogram`.

use crate::in_process::oslrun_at;
use serde_json::Value;
use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(output float f = 0) { f = time * u;
        if (u == 0 && v == 0) printf(\"%g %g %g | %g | %g %g\\n\", time, dtime, dPdtime, N, I, Ps); }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    std::fs::write(folder.path().join("t.osl"), "shader t(output float f = 0) { f = N[0] + dtime; }")
        .unwrap();
    folder
}

#[test]
fn globals_have_the_given_values() {
    let folder = folder();
    let said = |more: &str| {
        let (code, out, err) = oslrun_at(folder.path(), &format!("@/s.osl -g 3x3 {more}"));
        assert_eq!((code, err.as_str()), (0, ""), "{more}");
        out.lines().next().unwrap_or_default().to_string()
    };
    assert_eq!(said(""), "0 0 0 0 0 | 0 0 1 | 0 0 -1 0 0 0");
    assert_eq!(said("--time 2.5"), "2.5 0 0 0 0 | 0 0 1 | 0 0 -1 0 0 0");
    assert_eq!(
        said("--time -1 --global dtime=0.5 --global dPdtime=1,2,3"),
        "-1 0.5 1 2 3 | 0 0 1 | 0 0 -1 0 0 0"
    );
    assert_eq!(
        said("--global N=0,-1,0 --global I=1,2,3 --global Ps=4,5,6"),
        "0 0 0 0 0 | 0 -1 0 | 1 2 3 4 5 6"
    );
    assert_eq!(said("--global time=3 --global time=4"), "4 0 0 0 0 | 0 0 1 | 0 0 -1 0 0 0");
    // Samples, an explanation and a surface have them too.
    let (code, out, _) = oslrun_at(folder.path(), "@/s.osl -g 3x3 --samples 4 --time 2.5");
    assert!(code == 0 && out.contains("f: ") && !out.contains(" to 0,"), "{out}");
    let (code, out, _) = oslrun_at(folder.path(), "explain @/s.osl -g 3x3 --at 1,1 --time 2.5");
    assert!(code == 0 && out.contains("time = 2.5"), "{out}");
    let (code, out, _) = oslrun_at(folder.path(), "@/s.osl -g 9x9 --on sphere --time 2.5");
    assert!(code == 0 && out.contains("f: 0 to 1.9"), "{out}");
}

#[test]
fn globals_that_cannot_be_set_are_refused_with_a_reason() {
    let folder = folder();
    for (args, word) in [
        ("@/s.osl --global P=1,2,3", "--uv-scale and --uv-offset"),
        ("@/s.osl --global tyme=1", "did you mean `time`?"),
        ("@/s.osl --global N=1", "three numbers"),
        ("@/s.osl --time soon", "a number, not `soon`"),
        ("@/s.osl --on sphere --global N=0,0,1", "differs from point to point"),
        ("@/s.osl --preview --time 1 -o @/a.png", "cannot be used with"),
        ("stability @/s.osl --time 1", "--time has no effect in `stability`"),
        ("@/s.osl --frames 1-3", "out.####.png"),
        ("@/s.osl --frames 1-3 -o @/a.png", "out.####.png"),
        ("@/s.osl --frames 3-1 -o @/a.#.png", "last frame comes before the first"),
        ("@/s.osl --frames 1-3 -o @/a.#.png --time 1", "cannot be used with"),
        ("@/s.osl --frames 1-3 -o @/a.#.png --global time=1", "sets the time"),
        ("@/s.osl --frames 1-3 -o @/a.#.png --json", "without --frames"),
        ("@/s.osl --fps 25", "--frames"),
        ("@/s.osl --frames 1-3 --fps 0 -o @/a.#.png", "above 0"),
    ] {
        let (code, _, err) = oslrun_at(folder.path(), args);
        assert!(code == 2 && err.contains(word), "{args}: {code} {err}");
    }
}

#[test]
fn frames_have_their_time_and_their_file() {
    let folder = folder();
    let run = |args: &str| {
        let (code, out, err) = oslrun_at(folder.path(), args);
        assert_eq!(code, 0, "{err}");
        out
    };
    let out = run("@/s.osl -g 3x3 --no-command --frames 11-13 -o @/film.####.exr");
    let wrote: Vec<&str> = out.lines().filter(|line| line.starts_with("wrote")).collect();
    assert_eq!(wrote, [11, 12, 13].map(|n| format!("wrote @/film.00{n}.exr")));
    run("@/s.osl -g 3x3 --no-command --time 0.5 -o @/one.exr");
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("film.0012.exr") == bytes("one.exr") && bytes("film.0011.exr") != bytes("one.exr"));
    run("@/s.osl -g 3x3 --no-command --frames 25 --fps 50 -o @/fast#.exr");
    assert!(bytes("fast25.exr") == bytes("one.exr"));
}

#[test]
fn histograms_count_values() {
    let folder = folder();
    let text = "shader h(output float f = 0, output color c = 0, output string s = \"\")
        { f = u > 0.5 ? 1 / (v - v) : u; c = color(u, 0.25, 0); s = \"x\"; }";
    std::fs::write(folder.path().join("h.osl"), text).unwrap();
    let run = |args: &str| {
        let (code, out, err) = oslrun_at(folder.path(), args);
        assert_eq!(code, 0, "{err}");
        out
    };
    let out = run("@/h.osl -g 17x4 --histogram");
    insta::assert_snapshot!("histogram", out);
    let with_file = run("@/h.osl -g 17x4 --histogram -o @/h.exr");
    assert_eq!(with_file, format!("{out}wrote @/h.exr\n"));
    // The file is the same as without a histogram.
    let bytes = || std::fs::read(folder.path().join("h.exr")).unwrap();
    let before = bytes();
    run("@/h.osl -g 17x4 -o @/h.exr");
    assert!(before == bytes());
    let about: Value = serde_json::from_str(&run("@/h.osl -g 17x4 --histogram --json")).unwrap();
    assert_eq!(about["histograms"][1]["output"], "c");
    assert_eq!(about["histograms"][1]["counts"].as_array().map(Vec::len), Some(16));
    assert_eq!(about["histograms"][2]["counts"][0], 68);
    // Pixels beside a surface do not count.
    let about: Value =
        serde_json::from_str(&run("@/t.osl -g 9x9 --on sphere --global dtime=5 --histogram --json")).unwrap();
    assert!(about["histograms"][0]["range"][0].as_f64().unwrap() > 3.0, "{about}");
}
