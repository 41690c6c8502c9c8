//! `oslrun bake`: textures of squares, what is done again, and job templates.

use osl_image::{ImageData, read_image};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const PLACES: &str = "shader places(float k = 1, output color c = 0, output float f = 0, output string s = \"\")\n\
    { c = color(u, v, k); f = u + 10 * v; }\n";

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("places.osl"), PLACES).unwrap();
    dir
}

/// Runs the command in a folder.
fn run(dir: &Path, args: &str) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    let output = command.current_dir(dir).args(args.split_whitespace()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn image(dir: &Path, name: &str) -> ImageData {
    read_image(&dir.join(name)).unwrap()
}

#[test]
fn a_square_has_the_values_of_its_place_and_all_levels() {
    let dir = folder();
    let (code, out, err) =
        run(dir.path(), "bake places.osl --outputs c -g 32x16 --tile 8 --udim 1001,1012 -o t.<UDIM>.exr");
    assert_eq!((code, out.as_str(), err.as_str()), (0, "wrote t.1001.exr\nwrote t.1012.exr\n", ""));
    let found = image(dir.path(), "t.1012.exr");
    assert_eq!((found.width, found.height, found.header.tile), (32, 16, Some((8, 8))));
    let sizes: Vec<_> = found.header.coarser.iter().map(|(width, height, _)| (*width, *height)).collect();
    assert_eq!(sizes, [(16, 8), (8, 4), (4, 2), (2, 1), (1, 1)]);
    assert_eq!(found.channels, ["R", "G", "B"]);
    assert_eq!(
        found.samples[..3],
        [1.0 + 0.5 / 32.0, 1.0 + 0.5 / 16.0, 1.0],
        "the centre of the first texel"
    );
    // A shader reads them at the places where they were made.
    let reader = "shader reader(output float error = 0) { color c = texture(\"t.<UDIM>.exr\", u, v, \"interp\", \"closest\",\n\
        \"width\", 0); error = max(abs(c[0] - u), abs(c[1] - v)); }";
    std::fs::write(dir.path().join("reader.osl"), reader).unwrap();
    for offset in ["0,0", "1,1"] {
        let (code, out, _) = run(dir.path(), &format!("reader.osl -g 32x16 --center --uv-offset {offset}"));
        assert!(code == 0 && out.contains("error: 0 to 0,"), "{out}");
    }
    let (code, _, _) = run(dir.path(), "bake places.osl --outputs c -g 32x16 --flip-v -o f.exr");
    assert_eq!((code, image(dir.path(), "f.exr").samples[1]), (0, 1.0 - 0.5 / 16.0));
}

#[test]
fn outputs_share_a_file_or_have_one_each() {
    let dir = folder();
    assert_eq!(run(dir.path(), "bake places.osl -g 8x8 -o all.exr").0, 0);
    let mut channels = image(dir.path(), "all.exr").channels;
    channels.sort();
    assert_eq!(channels, ["c.B", "c.G", "c.R", "f"]);
    let (code, out, _) = run(dir.path(), "bake places.osl -g 8x8 -o {output}.<UDIM>.exr --half");
    assert_eq!((code, out.as_str()), (0, "wrote c.1001.exr\nwrote f.1001.exr\n"));
    assert_eq!(image(dir.path(), "f.1001.exr").channels, ["Y"]);
    for (args, word, expected) in [
        ("bake places.osl -o x.png", "textures are .exr files", 2),
        ("bake places.osl -o x.exr --udim 1001-1002", "-o set.<UDIM>.exr", 2),
        ("bake places.osl -o x.exr --udim 7", "from 1001 to 9999", 2),
        ("bake places.osl -o x.exr --tile 5", "from 8 to 4096", 2),
        ("bake places.osl -o x.exr --outputs s", "no output that an image can hold", 1),
        ("bake places.osl -o x.exr --outputs q", "`q`", 1),
        ("bake none.osl -o x.exr", "no such file", 1),
    ] {
        let (code, _, err) = run(dir.path(), args);
        assert!(code == expected && err.contains(word), "{args}: {code} {err}");
    }
}

#[test]
fn a_bake_that_was_stopped_goes_on_and_another_shader_is_seen() {
    let dir = folder();
    let bake = "bake places.osl -g 8x8 --udim 1001-1003 -o t.<UDIM>.exr";
    assert_eq!(run(dir.path(), bake).0, 0);
    let bytes =
        || ["1001", "1002", "1003"].map(|n| std::fs::read(dir.path().join(format!("t.{n}.exr"))).unwrap());
    let first = bytes();
    std::fs::remove_file(dir.path().join("t.1002.exr")).unwrap();
    let states = |args: &str| {
        let (code, out, _) = run(dir.path(), args);
        assert_eq!(code, 0);
        let list: Value = serde_json::from_str(&out).unwrap();
        list.as_array()
            .unwrap()
            .iter()
            .map(|one| one["state"].as_str().unwrap().to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(states(&format!("{bake} --dry-run")), ["done", "missing", "done"]);
    let (code, out, err) = run(dir.path(), bake);
    assert_eq!((code, out.as_str()), (0, "wrote t.1002.exr\n"));
    assert!(err.contains("2 of 3 textures are there already"), "{err}");
    assert_eq!(bytes(), first, "the same bits");
    assert_eq!(run(dir.path(), &format!("{bake} --threads 1 --batch 7")).1, "", "only values count");
    for more in ["-p k=2", "--half", "--samples 4", "--flip-v", "--userdata x=1"] {
        assert_eq!(states(&format!("{bake} --dry-run {more}")), ["stale"; 3], "{more}");
    }
    std::fs::write(dir.path().join("places.osl"), PLACES.replace("10 * v", "11 * v")).unwrap();
    let (code, out, err) = run(dir.path(), bake);
    assert_eq!((code, out.lines().count()), (0, 3), "{err}");
    assert!(err.contains("t.1001.exr was made by another command, and is made again"), "{err}");
    assert_ne!(bytes(), first);
}

#[test]
fn a_template_has_a_task_for_each_chunk() {
    let dir = folder();
    let (code, out, _) = run(
        dir.path(),
        "bake places.osl -g 8x8 --udim 1001-1012 -o t.<UDIM>.exr --openjd job.yaml --chunk 4",
    );
    assert_eq!((code, out.as_str()), (0, "wrote job.yaml\n"));
    let job: Value =
        serde_json::from_str(&std::fs::read_to_string(dir.path().join("job.yaml")).unwrap()).unwrap();
    let space = &job["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0];
    assert_eq!((&space["range"], &space["chunks"]["defaultTaskCount"]), (&"1001-1012".into(), &4.into()));
    assert!(!dir.path().join("t.1001.exr").exists());
    let (code, _, err) = run(dir.path(), "places.osl -g 8x8 -o t.exr --openjd job.yaml");
    assert!(code == 2 && err.contains("--frames"), "{err}");
    assert_eq!(run(dir.path(), "places.osl -g 8x8 --frames 1-9:2 -o t.##.exr --openjd film.yaml").0, 0);
    // The command of a task, with its numbers in place, makes them.
    let film: Value =
        serde_json::from_str(&std::fs::read_to_string(dir.path().join("film.yaml")).unwrap()).unwrap();
    let action = &film["steps"][0]["script"]["actions"]["onRun"];
    let words = action["args"].as_array().unwrap().iter().map(|word| word.as_str().unwrap());
    let words = words.map(|word| word.replace("{{Task.Param.Frame}}", "3,7"));
    let exe = Path::new(env!("CARGO_BIN_EXE_oslrun")).parent().unwrap().display().to_string();
    let path = format!("{exe}:{}", std::env::var("PATH").unwrap_or_default());
    let mut task = Command::new(action["command"].as_str().unwrap());
    assert!(task.args(words).env("PATH", path).current_dir("/").status().unwrap().success());
    let made = ["03", "07", "05"].map(|n| dir.path().join(format!("t.{n}.exr")).exists());
    assert_eq!(made, [true, true, false]);
}
