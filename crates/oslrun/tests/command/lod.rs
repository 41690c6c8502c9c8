//! The command `oslrun lod`.

use crate::in_process::oslrun_at;
use std::path::Path;

const DOTS: &str = "\
shader dots(float size = 0.3, output float mask = 0)
{
    point p = point(mod(u * 20, 1) - 0.5, mod(v * 20, 1) - 0.5, 0);
    float grain = noise(\"uperlin\", P * 30);
    mask = (1 - step(size, length(p))) * (0.8 + 0.2 * grain);
}
";
const RAMP: &str = "shader ramp(output float r = 0) { r = u * v; }";
const LIT: &str = "surface lit() { Ci = diffuse(N); }";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("dots.osl", DOTS), ("ramp.osl", RAMP), ("lit.osl", LIT)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn run(folder: &Path, args: &str) -> (u8, String, String) {
    oslrun_at(folder, &format!("lod {args} --budget 600"))
}

#[test]
fn the_shader_is_written_and_its_compiled_file_gives_the_same_values() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let (code, out, err) = run(folder.path(), "@/dots.osl -o @/far.osl --html @/far.html");
    assert_eq!((code, err.as_str()), (0, "wrote @/far.html\nwrote @/far.osl\n"));
    assert!(out.starts_with("dots: levels of detail by the larger side of a pixel in P"), "{out}");
    let page = std::fs::read_to_string(at("far.html")).unwrap();
    assert_eq!(page.matches("<img ").count(), 15, "three pictures at five footprints");
    let (code, out, err) = oslrun_at(folder.path(), "compile @/far.osl -o @/far.oso");
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    for scale in ["1", "6", "12", "20", "64"] {
        let one = |file: &str| {
            let line = format!("@/far.{file} -g 64x64 --uv-scale {scale},{scale} -o @/{file}.exr");
            let (code, _, err) = oslrun_at(folder.path(), &line);
            assert_eq!((code, err.as_str()), (0, ""));
        };
        one("osl");
        one("oso");
        let (code, out, _) = oslrun_at(folder.path(), "compare @/osl.exr @/oso.exr");
        assert_eq!(code, 0, "{scale}: {out}");
    }
}

#[test]
fn tools_get_numbers() {
    let folder = folder();
    let (_, out, _) = run(folder.path(), "@/dots.osl --json");
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((value["name"].as_str(), value["coordinate"].as_str()), (Some("dots"), Some("P")));
    assert_eq!(value["cut_short"], serde_json::json!(false));
    let rows = value["rows"].as_array().unwrap();
    let footprints: Vec<f64> = rows.iter().filter_map(|row| row["footprint"].as_f64()).collect();
    assert_eq!(footprints, [1.0, 4.0, 16.0, 64.0, 256.0]);
    let level = &value["level"];
    assert!(level["error"].as_f64() < level["original_error"].as_f64());
}

#[test]
fn without_levels_nothing_is_written() {
    let folder = folder();
    let (code, out, err) = run(folder.path(), "@/ramp.osl -o @/far.osl");
    assert_eq!((code, err.as_str()), (0, "note: there are no levels, so @/far.osl is not written\n"));
    assert!(out.starts_with("ramp: no simpler level"), "{out}");
    assert!(!folder.path().join("far.osl").exists());
}

#[test]
fn what_cannot_be_simplified_is_refused() {
    let folder = folder();
    for (args, code, why) in [
        ("@/lit.osl", 1, "the shader sets `Ci`"),
        ("@/dots.osl -o @/far.png", 2, "the name must end in .osl"),
        ("@/dots.osl --samples 65", 2, "65 is not in 1..=64"),
        ("@/dots.osl --tolerance 2", 2, "--tolerance must be a share"),
        ("@/dots.osl --outputs mask", 2, "--outputs has no effect in `lod`"),
        ("@/dots.osl --error 20", 2, "--error must be a share"),
        ("@/dots.oso", 2, "the source of a single shader"),
        ("--layer a=dots", 2, "--layer has no effect"),
    ] {
        let (got, out, err) = run(folder.path(), args);
        assert_eq!(got, code, "{args}: {err}");
        assert!(err.contains(why), "{args}: {err}");
        assert_eq!(out, "");
    }
}

/// The root mean square difference of a channel, from the table of `compare`.
fn rms(table: &str, channel: &str) -> f64 {
    let line = table.lines().find(|line| line.starts_with(&format!("{channel} ")));
    let words: Vec<&str> = line.unwrap_or_else(|| panic!("{table}")).split_whitespace().collect();
    words[words.len() - 3].parse().unwrap()
}

#[test]
fn a_plane_to_the_horizon_is_nearer_to_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let strips = concat!(env!("CARGO_MANIFEST_DIR"), "/../../osl/strips.osl");
    std::fs::copy(strips, folder.path().join("strips.osl")).unwrap();
    let (code, out, err) = run(folder.path(), "@/strips.osl -o @/far.osl");
    assert_eq!(code, 0, "{out}{err}");
    // The errors of docs/lod.md, with fewer samples for the truth.
    for (scale, most, least) in [(8, 0.080, 0.076), (40, 0.116, 0.160)] {
        let view = format!("--on plane --eye 0,0.2,1.6 -g 480x200 --uv-scale {scale},{scale} --outputs Fac");
        for (file, samples, image) in [("strips", 64, "truth"), ("strips", 1, "one"), ("far", 1, "far")] {
            let line = format!("@/{file}.osl {view} --samples {samples} -o @/{image}.exr");
            let (code, _, err) = oslrun_at(folder.path(), &line);
            assert_eq!(code, 0, "{err}");
        }
        let error = |image: &str| {
            rms(&oslrun_at(folder.path(), &format!("compare @/{image}.exr @/truth.exr")).1, "Fac")
        };
        let (one, far) = (error("one"), error("far"));
        assert!(far < one && far < most && one > least, "{scale}: {far}, one sample of the original {one}");
    }
}

#[test]
fn the_time_can_be_too_short() {
    let folder = folder();
    let (code, out, err) = oslrun_at(folder.path(), "lod @/dots.osl --budget 0.01");
    assert_eq!((code, out.as_str()), (1, ""));
    assert_eq!(err, "error: the time was over before any level was found; --budget SECONDS sets it\n");
}
