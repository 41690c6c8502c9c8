//! Closures of any vendor: declared under metadata named `builtin`, called with keywords, shown, compiled and
//! read back.

use oslrun::cli;
use std::path::Path;

/// Exit code, output and errors of a command.
fn command(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["oslrun"].iter().chain(args).map(|a| (*a).into());
    let code = cli::main(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn write(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

const DECLARED: &str = r#"closure color glitter(normal N, float roughness) [[ string builtin = "whatever" ]];
closure color fog() [[ int builtin = 0 ]] { return emission(); }
closure color reflection(normal N, string how) [[ int builtin = 1 ]];
shader declared(output closure matrix bsdf = 0)
{
    float list[2] = { 1, u };
    string key = "density";
    closure vector all = glitter(N, 1, "tint", color(u, v, 0), "list", list) + fog("base", fog(), "odd") + fog(key, 2)
        + reflection(N) + reflection(N, "sharp", "label", "r") + microfacet("ggx", N, 0.1, 1.5, 0);
    bsdf = 0.5 * all;
}
"#;

#[test]
fn closures_of_any_name_are_data_and_come_back_from_compiled_shaders() {
    let dir = tempfile::tempdir().unwrap();
    let source = write(dir.path(), "declared.osl", DECLARED);
    let (code, shown, err) = command(&[&source, "-g", "1x1", "--closures"]);
    assert_eq!(code, 0, "{err}");
    insta::assert_snapshot!("declared", shown);
    let oso = dir.path().join("declared.oso").display().to_string();
    assert_eq!(command(&["compile", &source, "-o", &oso]).0, 0);
    let (code, again, err) = command(&[&oso, "-g", "1x1", "--closures"]);
    assert_eq!((code, again), (0, shown), "{err}");
    // Renderers know the long forms only.
    let text = std::fs::read_to_string(&oso).unwrap();
    let names =
        text.lines().filter(|line| line.contains("\"reflection\"") || line.contains("\"microfacet\""));
    assert_eq!(names.count(), 2);
    let words = |line: &str| line.split("\t%").next().unwrap_or("").split_whitespace().count();
    let calls: Vec<usize> = text.lines().filter(|line| line.starts_with("\tclosure\t")).map(words).collect();
    assert_eq!(calls, [9, 3, 6, 5, 5, 7, 10], "{text}");
}

#[test]
fn what_closures_take() {
    let dir = tempfile::tempdir().unwrap();
    let head = "closure color fog(float x) [[ int builtin = 1 ]];\nclosure color later(float x);\n\
                struct Pair { float a; float b; };\n";
    for (call, code) in [
        ("fog(1)", None),
        ("fog(1, \"a\", 2, 3, 4)", None),
        ("fog(1, \"a\")", Some("E0401")),
        ("fog(1, 2, 3)", Some("E0401")),
        ("fog(\"a\", 1)", Some("E0401")),
        ("fog(1, \"a\", p)", Some("E0401")),
        ("diffuse(N, \"label\", \"a\", \"odd\")", None),
        ("diffuse(N, \"label\")", Some("E0401")),
        ("later(1)", Some("E0403")),
    ] {
        let text = format!("{head}shader s() {{ Pair p = {{ 1, 2 }}; Ci = {call}; }}\n");
        let source = write(dir.path(), "s.osl", &text);
        let (exit, _, err) = command(&["check", &source]);
        assert_eq!(exit == 0, code.is_none(), "{call}: {err}");
        assert!(code.is_none_or(|code| err.contains(code)), "{call}: {err}");
    }
}

#[test]
fn library_functions_may_be_declared_as_renderers_headers_do() {
    let dir = tempfile::tempdir().unwrap();
    let text = "#define BUILTIN [[ int builtin = 1 ]]\nfloat sqrt(float x) BUILTIN;\nvector cross(vector a, vector b) BUILTIN;\n\
                int getattribute(string name, output float x) BUILTIN { return 7; }\nvoid nothing(float x);\n\
                shader s(output float r = 0, output int found = 5, output float w = 0) {\n\
                float x = 3; r = sqrt(4) + cross(vector(1, 0, 0), vector(0, 1, 0)).z;\n\
                found = getattribute(\"none\", x); nothing(w = x);\n}\n";
    let text = text.replace(
        "cross(vector(1, 0, 0), vector(0, 1, 0)).z",
        "dot(cross(vector(1, 0, 0), vector(0, 1, 0)), vector(0, 0, 1))",
    );
    let source = write(dir.path(), "s.osl", &text);
    let (code, out, err) = command(&[&source, "-g", "1x1", "-A", "W0204"]);
    assert_eq!(code, 0, "{err}");
    insta::assert_snapshot!("declared_library", out.replace(&dir.path().display().to_string(), "DIR"));
}

/// Code that only closures need is not computed if the closures are not shown.
#[test]
fn closures_that_nobody_asks_for_cost_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let text = "surface s(output closure color surf = 0, output float r = 0) {\n\
                surf = noise(P) * layer(diffuse(N), emission()); Ci = surf; r = u; printf(\"x\"); }\n";
    let source = write(dir.path(), "s.osl", text);
    // Number of instructions for the requested outputs, as --stats prints it.
    let instructions = |args: &[&str]| {
        let (code, _, err) = command(&[&[source.as_str(), "-g", "4x4", "--stats"][..], args].concat());
        assert_eq!(code, 0, "{err}");
        let line = err.lines().find_map(|line| line.strip_prefix("all asked for")).unwrap();
        line.split_whitespace().next().unwrap().parse::<usize>().unwrap()
    };
    let (plain, closures) = (instructions(&[]), instructions(&["--closures"]));
    assert!(plain + 5 < closures, "{plain} {closures}");
    assert_eq!(instructions(&["--outputs", "r"]), plain);
    // If they are the only output, the image shows their weights.
    let (code, out, err) = command(&[&source, "-g", "4x4", "--outputs", "surf"]);
    assert!(code == 0 && out.contains("surf"), "{out} {err}");
}
