//! The reference of the built-ins: the page is current, every example compiles and runs without diagnostics,
//! and the command finds entries and close names.

use osl::{reference, stages};
use osl_exec::{RunOptions, Services};
use osl_hir::builtins;
use osl_image::TextureCache;
use osl_ir::passes;
use osl_lower::params::ParamValues;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use oslrun::cli;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Exit code, output and errors of a command.
fn command(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["oslrun"].iter().chain(args).map(|a| (*a).into());
    let code = cli::main(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

#[test]
fn the_page_is_current() {
    let path = root().join("docs/builtins.md");
    let (code, page, _) = command(&["doc", "--markdown"]);
    assert_eq!(code, 0);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let held = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(held == page, "docs/builtins.md is not current: run this test with UPDATE_DOCS=1");
}

/// Compiled with all passes and run on a few points, an example has no diagnostic, and no message except its
/// own.
#[test]
fn every_example_runs() {
    let mut wrong = String::new();
    for row in builtins::all() {
        // All globals and closures may be used in a surface shader.
        let text = format!("surface example(output float result = 0) {{\n{}\n}}\n", row.example);
        if let Err(why) = run(&text) {
            wrong.push_str(&format!("{}: {why}\n{text}\n", row.name));
        }
    }
    for topic in reference::topics() {
        // A struct is declared before the shader.
        let is_struct = topic.example.starts_with("struct");
        let end = topic.example.find("}; ").filter(|_| is_struct).map_or(0, |end| end + 3);
        let (before, body) = topic.example.split_at(end);
        let text = format!("{before}surface example(output float result = 0) {{\n{body}\n}}\n");
        if let Err(why) = run(&text) {
            wrong.push_str(&format!("{}: {why}\n{text}\n", topic.name));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

fn run(text: &str) -> Result<(), String> {
    let checked = stages::check("example.osl", text, &NoFiles, &Options::default());
    if !checked.diagnostics.is_empty() {
        return Err(format!("{:#?}", checked.diagnostics));
    }
    let program = checked.program.ok_or("no program")?;
    let body = osl_lower::lower(&program, &ParamValues::default()).map_err(|e| format!("{e:#?}"))?;
    let grid = Grid::new(4, 4);
    let services = Services {
        spaces: osl_scene::reference_spaces(4, 4),
        textures: TextureCache::new(vec![root().join("tests/data/textures")]),
        ..Services::default()
    };
    // Once with all passes and once without any: the results of the examples are not used, so the passes
    // remove most of the code.
    for without in [Vec::new(), passes::Pass::ALL.to_vec()] {
        let options = passes::Options { without, ..passes::Options::default() };
        let compiled = stages::finish(body.clone(), &options);
        let frame = osl_exec::run(&compiled.program, &services, &grid, &RunOptions::default(), &|_| ())
            .map_err(|e| e.to_string())?;
        let said = frame.said(|_| "example.osl".to_string());
        if !said.is_empty() {
            return Err(format!("{said:?}"));
        }
    }
    Ok(())
}

#[test]
fn the_command_finds() {
    let (code, list, _) = command(&["doc"]);
    assert_eq!(code, 0);
    for row in builtins::all() {
        assert!(list.contains(&format!("  {} ", row.name)), "{}", row.name);
    }
    let (code, entry, _) = command(&["doc", "smoothstep"]);
    assert_eq!(code, 0);
    for part in
        ["float smoothstep(float edge0, float edge1, float x)", "Derivatives: ", "Extremes: ", "Example:"]
    {
        assert!(entry.contains(part), "{entry}");
    }
    assert!(entry.lines().all(|line| line.chars().count() <= 100), "{entry}");
    // A constructor with a space is found by its plain name.
    let (code, entry, _) = command(&["doc", "matrix"]);
    assert_eq!(code, 0);
    assert!(entry.contains("matrix in space") && entry.contains("matrix from spaces"), "{entry}");
}

#[test]
fn the_command_suggests() {
    let (code, out, err) = command(&["doc", "smothstep"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(err.contains("did you mean `smoothstep`?"), "{err}");
    let (code, _, err) = command(&["doc", "quaternion_multiplication"]);
    assert_eq!(code, 1);
    assert!(err.contains("`oslrun doc` lists all names"), "{err}");
    // A name that has the beginning is closer than one that is spelt similarly.
    let (_, _, err) = command(&["doc", "cellno"]);
    assert!(err.contains("did you mean `cellnoise`?"), "{err}");
    let (_, _, err) = command(&["doc", "normall"]);
    assert!(err.contains("did you mean `normal`?"), "{err}");
    assert_eq!(command(&["doc", "sin", "--markdown"]).0, 2);
}

#[test]
fn words_of_other_languages_are_answered() {
    for (word, says, entry) in [
        ("lerp", "OSL calls it `mix(a, b, x)`.", "float mix(float x"),
        ("fract", "in OSL it is `mod(x, 1)`.", "float mod(float a"),
        ("vec3", "OSL has `vector`, ", "vector (type)"),
        ("cell", "OSL calls it `cellnoise`.", "float cellnoise(point p"),
        ("PI", "OSL calls it `M_PI`.", "M_PI (word)"),
        ("bool", "use `int`, where 0 is false.", "int (type)"),
        ("uv", "two floats, `u` and `v`.", ""),
    ] {
        let (code, text, err) = command(&["doc", word]);
        assert_eq!((code, err.as_str()), (0, ""), "{word}");
        assert!(text.starts_with(&format!("`{word}` is not a name in OSL: ")), "{text}");
        assert!(text.contains(says) && text.contains(entry), "{text}");
        let (code, text, _) = command(&["doc", word, "--json"]);
        assert!(code == 0 && serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{text}");
    }
}

#[test]
fn words_and_nodes_have_entries() {
    let mut all = String::new();
    for name in ["P", "point", "for", "remap", "clamp", "transform", "noise"] {
        let (code, entry, err) = command(&["doc", name]);
        assert_eq!(code, 0, "{err}");
        all += &format!("$ oslrun doc {name}\n{entry}\n");
    }
    insta::assert_snapshot!("words", all);
    let (_, list, _) = command(&["doc"]);
    for topic in reference::topics() {
        assert!(list.contains(&format!("  {} ", topic.name)), "{}", topic.name);
        assert_eq!(command(&["doc", topic.name]).0, 0, "{}", topic.name);
    }
    // Every global and every node has one.
    for (_, name, ..) in osl_ir::global::GLOBALS {
        assert_eq!(reference::topic(name).map(|topic| topic.kind), Some("global"), "{name}");
    }
    for node in oslrun::nodes::names() {
        assert!(command(&["doc", node]).1.contains(&format!("{node} (built-in node)")), "{node}");
        assert_eq!(command(&["info", node]).0, 0, "{node}");
    }
}

#[test]
fn the_ranges_of_noise_are_those_of_the_fields() {
    for (field, range, _) in reference::NOISE_FIELDS {
        let text = format!("shader s(output float f = 0) {{ f = noise(\"{field}\", 40 * P); }}");
        let checked = stages::check("s.osl", &text, &NoFiles, &Options::default());
        let body = osl_lower::lower(&checked.program.unwrap(), &ParamValues::default()).unwrap();
        let compiled = stages::finish(body, &passes::Options::default());
        let (services, options) = (Services::default(), RunOptions::default());
        let frame =
            osl_exec::run(&compiled.program, &services, &Grid::new(128, 128), &options, &|_| ()).unwrap();
        let values = frame.planes[0].floats();
        let (low, high) = values.iter().fold((9.0_f32, -9.0_f32), |(l, h), x| (l.min(*x), h.max(*x)));
        let least = if range.starts_with('0') { 0.0 } else { -1.0 };
        assert!(least <= low && high <= 1.0, "{field}: {low} to {high}");
        assert!(low < least + 0.5 && high > 0.5, "{field}: {low} to {high} is not {range}");
    }
}

#[test]
fn entries_are_data() {
    for args in [
        &["doc", "--json"][..],
        &["doc", "noise", "--json"],
        &["doc", "P", "--json"],
        &["doc", "mix", "--json"],
    ] {
        let (code, text, _) = command(args);
        assert_eq!(code, 0);
        let all: serde_json::Value = serde_json::from_str(&text).unwrap();
        let count = |key: &str| all[key].as_array().unwrap().len();
        assert!(count("functions") + count("words") + count("nodes") > 0, "{text}");
    }
}

#[test]
fn names_of_the_table_are_found_by_themselves() {
    for row in builtins::all() {
        assert!(reference::find(row.name).iter().any(|r| r.name == row.name), "{}", row.name);
    }
}
