//! What the README and `docs/usage.md` state: their commands and options, the outputs that they show, and
//! facts that no other test has.

use super::in_process;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).unwrap()
}

/// The page with the details behind the README.
fn usage() -> String {
    std::fs::read_to_string(root().join("docs/usage.md")).unwrap()
}

fn both() -> String {
    readme() + &usage()
}

/// The code blocks of a page.
fn blocks(page: &str) -> impl Iterator<Item = &str> {
    page.split("```").skip(1).step_by(2)
}

/// A folder with this shader as `s.osl`.
fn shader(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    folder
}

/// `--help` answers only if the words before it are right.
#[test]
fn every_command_is_one() {
    let page = both();
    let commands = blocks(&page).filter_map(|block| block.strip_prefix("sh\n")).flat_map(str::lines);
    let commands = commands.filter_map(|line| line.split(" # ").next()?.trim().strip_prefix("oslrun "));
    let mut seen = 0;
    for command in commands {
        // A shell removes the quotes around the text of a group.
        let words: Vec<&str> = match command.split_once('\'') {
            Some((before, rest)) => {
                let (quoted, after) = rest.split_once('\'').unwrap();
                before.split_whitespace().chain([quoted]).chain(after.split_whitespace()).collect()
            }
            None => command.split_whitespace().collect(),
        };
        let (code, _, err) = in_process::oslrun(&[&words[..], &["--help"]].concat());
        assert_eq!((code, err.as_str()), (0, ""), "{command}");
        seen += 1;
    }
    assert!(seen > 50, "{seen} commands");
}

#[test]
fn every_option_exists() {
    let commands = ["explain", "stability", "sanitize", "lod", "bounds", "tradeoff", "check", "fmt", "info"];
    let more = ["compare", "render", "studio", "picture-book", "explain-error"].into_iter();
    let mut help = in_process::oslrun(&["--help"]).1;
    commands.into_iter().chain(more).for_each(|name| help += &in_process::oslrun(&[name, "--help"]).1);
    for option in both().split(|c: char| !(c.is_ascii_lowercase() || c == '-')) {
        let is_option =
            option.strip_prefix("--").is_some_and(|name| name.len() > 1 && !name.starts_with('-'));
        // Options of other programs.
        let other = ["--workspace", "--release", "--path"].contains(&option);
        assert!(!is_option || other || help.contains(option), "{option}");
    }
}

#[test]
fn the_readme_is_short_and_its_code_is_narrow() {
    let page = readme();
    let words = page.split_whitespace().count();
    assert!(words <= 1200, "{words} words");
    for line in blocks(&page).flat_map(str::lines) {
        assert!(line.chars().count() <= 100, "{line}");
    }
}

#[test]
fn the_outputs_that_it_shows_are_real() {
    let page = both();
    let mut seen = 0;
    for block in blocks(&page).filter_map(|block| block.strip_prefix("\n$ oslrun ")) {
        let (command, shown) = block.split_once('\n').unwrap();
        // A shader that is made up for the example.
        if command.starts_with("palette.osl") {
            continue;
        }
        let run = Command::new(env!("CARGO_BIN_EXE_oslrun"))
            .args(command.split_whitespace())
            .current_dir(root())
            .output()
            .unwrap();
        assert_eq!(String::from_utf8_lossy(&run.stdout), shown, "{command}");
        seen += 1;
    }
    assert_eq!(seen, 2);
}

#[test]
fn the_built_in_nodes_are_those_of_the_folder() {
    let page = usage();
    let (_, list) = page.split_once("are\nbuilt in: ").unwrap();
    let (list, _) = list.split_once(". A file of the same name").unwrap();
    let mut named: Vec<&str> = list.split('`').skip(1).step_by(2).collect();
    named.sort_unstable();
    let files = std::fs::read_dir(root().join("osl/nodes")).unwrap();
    let mut there: Vec<String> =
        files.map(|file| file.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned()).collect();
    there.sort_unstable();
    assert_eq!(named, there);
}

#[test]
fn points_lie_on_the_unit_patch() {
    let folder = shader(
        "shader s(output point p = 0, output normal n = 0, output vector i = 0, output float area = 0,
                  output float st = 0, output point ndc = 0, output point raster = 0)
         {
             float s, t;
             int known = getattribute(\"s\", s) && getattribute(\"t\", t);
             p = P; n = N; i = I; area = surfacearea();
             st = known && s == u && t == v;
             ndc = transform(\"NDC\", P);
             raster = transform(\"raster\", P);
         }",
    );
    let (_, out, _) = in_process::oslrun_at(folder.path(), "@/s.osl -g 256x256");
    for range in [
        "p.X: 0 to 1,",
        "p.Y: 0 to 1,",
        "p.Z: 1 to 1,",
        "n.Z: 1 to 1,",
        "i.Z: -1 to -1,",
        "area: 1 to 1,",
        "st: 1 to 1,",
        "ndc.X: 0.5 to 1,",
        "ndc.Y: 0.5 to 1,",
        "raster.X: 128 to 256,",
        "raster.Y: 128 to 256,",
    ] {
        assert!(out.contains(range), "{range}\n{out}");
    }
    let (_, out, _) = in_process::oslrun_at(folder.path(), "@/s.osl -g 1x2 --crop 0,1,0,1 --outputs p");
    assert!(out.contains("p.Y: 0 to 0,"), "row 0 is v = 0\n{out}");
    let (_, out, _) = in_process::oslrun_at(folder.path(), "@/s.osl -g 64x64 --on sphere --outputs area");
    assert!(out.contains("to 12.566371,"), "{out}");
}

#[test]
fn the_exit_code_tells_the_command_line_from_everything_else() {
    let folder = shader("shader s(float a = 1, output float r = 0) { r = a * u; }");
    let code = |rest: &str| in_process::oslrun_at(folder.path(), &format!("@/s.osl -g 4x4 {rest}")).0;
    for wrong in ["--nonsense", "-g 0x1", "--samples x", "--samples 4 --within 1s"] {
        assert_eq!(code(wrong), 2, "{wrong}");
    }
    for unknown in ["-p b=1", "--outputs q", "--tap 1:q", "--max-error q=0.1"] {
        assert_eq!(code(unknown), 1, "{unknown}");
    }
    for line in
        ["@/none.osl", "bounds @/s.osl --over b=0:1", "testshade --nonsense", "compare @/s.osl @/none.exr"]
    {
        assert_eq!(in_process::oslrun_at(folder.path(), line).0, 1, "{line}");
    }
}

#[test]
fn names_of_files_are_those_of_the_option_or_have_the_output() {
    let folder = shader("shader s(output float r = 0, output float mask = 0) { r = u; mask = v; }");
    for (rest, files) in [
        ("-o @/out.png --outputs mask", &["out.png"][..]),
        ("-o @/out.{output}.png --outputs mask", &["out.mask.png"]),
        ("-o @/out.png", &["out.r.png", "out.mask.png"]),
        ("-o @/out.exr", &["out.exr"]),
    ] {
        let (_, out, _) = in_process::oslrun_at(folder.path(), &format!("@/s.osl -g 4x4 {rest}"));
        let all: String = files.iter().map(|file| format!("wrote @/{file}\n")).collect();
        assert_eq!(out, all, "{rest}");
    }
}

#[test]
fn ints_are_rounded_with_a_word() {
    let folder = shader("shader s(output int n = 0) { n = 16777216 + (int)(u + 0.5); }");
    let (_, _, err) = in_process::oslrun_at(folder.path(), "@/s.osl -g 2x1 -o @/a.exr");
    assert!(
        err.contains("warning: 1 ints of `n` are rounded in the image, whose floats hold all up to 16777216")
    );
    let (_, _, err) = in_process::oslrun_at(folder.path(), "@/s.osl -g 2x1 --half -o @/a.exr");
    assert!(err.contains("whose floats hold all up to 2048"), "{err}");
}

#[test]
fn taps_outside_of_branches_have_no_mask() {
    let folder = tempfile::tempdir().unwrap();
    let cobbled = root().join("osl/Cobbled.osl").display().to_string();
    let run = |tap: &str| {
        let file = folder.path().join("d.png").display().to_string();
        let args = [&cobbled, "-g", "8x8", "--tap", tap, "--range", "auto", "-o", &file];
        let (_, out, _) = in_process::oslrun(&args);
        out.lines().filter_map(|line| line.rsplit('/').next()).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(run("110:d"), "d.png");
    let third = "d.line34.dist.round3.png d.line34.dist.round3.reached.png";
    assert_eq!(run("34:dist@3"), third);
}

#[test]
fn slips_of_published_files_are_warnings_or_errors() {
    for (name, code, strict) in [("flakes", "W0102", "E0102"), ("Cobbled", "W0101", "W0101")] {
        let file = root().join(format!("osl/{name}.osl")).display().to_string();
        let (exit, _, err) = in_process::oslrun(&["check", &file, "--message-format", "json"]);
        assert!(exit == 0 && err.contains(&format!("\"code\":\"{code}\"")), "{err}");
        let (exit, _, err) =
            in_process::oslrun(&["check", &file, "--strict-syntax", "--message-format", "json"]);
        let error = err.contains(&format!("\"code\":\"{strict}\"")) && err.contains("\"severity\":\"error\"");
        assert!(exit == 1 && error, "{err}");
    }
}
