//! `oslrun compile`, `oslrun info`, and compiled shaders in place of sources.

use oslrun::cli;
use std::path::Path;

/// Exit code, output and errors of a command.
fn command(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["oslrun"].iter().chain(args).map(|a| (*a).into());
    let code = cli::main(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn file(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path).display().to_string()
}

#[test]
fn a_compiled_shader_is_the_same_image() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let source = file("osl/Cobbled.osl");
    let (oso, first, second) = (path("c.oso"), path("a.exr"), path("b.exr"));
    let (code, out, err) = command(&["compile", &source, "-o", &oso]);
    assert_eq!((code, out), (0, format!("wrote {oso}\n")), "{err}");
    for (shader, image) in [(&source, &first), (&oso, &second)] {
        let (code, _, err) =
            command(&[shader, "-g", "40x30", "-p", "radius=0.2", "--no-command", "-o", image]);
        assert_eq!(code, 0, "{err}");
    }
    assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    let (code, out, _) = command(&["compile", &source, "-o", "-"]);
    assert_eq!((code, out), (0, std::fs::read_to_string(&oso).unwrap()));
    // The commands that read shaders accept it too; those that rewrite sources do not.
    assert_eq!(command(&["check", &oso]).0, 0);
    assert!(command(&["ir", &oso]).1.contains("# after the passes"));
    for (args, expected) in [(&["fmt", &oso][..], 1), (&[&oso, "--repair"], 2)] {
        let (code, _, err) = command(args);
        assert!(code == expected && err.contains("compiled shader"), "{err}");
    }
}

#[test]
fn what_is_wrong_with_a_compiled_shader_is_said_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.oso").display().to_string();
    let text = "OpenShadingLanguage 1.00\nshader bad\noparam\tfloat\tr\t0\ncode ___main___\n\tassign\t\tr x\n\tend\n";
    std::fs::write(&path, text).unwrap();
    let (code, _, err) = command(&["check", &path, "--message-format", "json"]);
    assert_eq!(code, 1);
    assert!(err.contains("\"E0702\"") && err.contains("\"line\":5,\"column\":12"), "{err}");
    let (code, _, err) = command(&["compile", &path]);
    assert!(code == 1 && err.contains("is not declared"), "{err}");
}

/// Files that no compiler has written, with values computed from the rules of the operations.
#[test]
fn operations_give_the_values_of_their_rules() {
    for name in ["transforms", "operations"] {
        let made = |ending: &str| file(&format!("tests/data/oso_made/{name}.{ending}"));
        let expected = std::fs::read_to_string(made("txt")).unwrap();
        let outputs = expected.lines().filter_map(|line| line.split(' ').next());
        let outputs = outputs.flat_map(|output| ["-o", output, "null"]);
        let args: Vec<&str> = ["testshade", "-g", "1", "1", "--print"].into_iter().chain(outputs).collect();
        let (code, out, err) = command(&[&args[..], &[&made("oso")]].concat());
        assert_eq!((code, err.as_str()), (0, ""), "{out}");
        let got = out.lines().filter_map(|line| line.strip_prefix("  ")?.split_once(" : "));
        let numbers = |text: &str| text.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f32>>();
        let mut count = 0;
        for (line, (output, values)) in expected.lines().zip(got) {
            let (expected_name, expected_values) = line.split_once(' ').unwrap();
            assert_eq!(output, expected_name);
            let (values, expected) = (numbers(values), numbers(expected_values));
            let near = values.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e-5 * b.abs().max(0.1));
            assert!(near && values.len() == expected.len(), "{output}: {values:?}, not {expected:?}");
            count += 1;
        }
        assert_eq!(count, expected.lines().count(), "{out}");
        if name == "operations" {
            assert!(out.contains("(2, -2, 4) * emission ()"), "{out}");
        }
    }
}

#[test]
fn units_are_converted() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let expressions = [
        ("transformu(\"cm\", \"m\", 250.0)", 2.5),
        ("transformu(\"mi\", \"km\", 2)", 3.218688),
        ("transformu(\"ft\", 0.3048)", 1.0),
        ("transformu(\"in\", \"common\", 100)", 2.54),
        ("transformu(\"s\", \"frames\", 0.5)", 12.0),
        ("transformu(\"frames\", \"common\", 12)", 0.5),
        ("transformu(\"object\", \"m\", 3)", 6.0),
        ("transformu(u > 2 ? \"mm\" : \"km\", \"cm\", 0.01)", 1000.0),
        ("transformu(\"nosuch\", \"m\", 5)", 5.0),
        ("transformu(\"s\", \"m\", 5)", 5.0),
    ];
    let body: String = expressions.iter().enumerate().map(|(i, (e, _))| format!("r[{i}] = {e};\n")).collect();
    let text = format!("shader units(output float r[10] = {{}}) {{\n{body} }}\n");
    std::fs::write(path("units.osl"), text).unwrap();
    let (code, out, err) =
        command(&[&path("units.osl"), "-g", "2x2", "--object-space", "2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1"]);
    assert_eq!(code, 0, "{err}");
    for (at, (expression, value)) in expressions.iter().enumerate() {
        assert!(out.contains(&format!("r[{at}]: {value} to {value}")), "{expression}: {out}");
    }
    for unknown in ["nosuch", "s"] {
        assert!(err.contains(&format!("Unknown transformation \"{unknown}\"")), "{err}");
    }
    let (_, text, _) = command(&["doc", "transformu"]);
    assert!(text.contains("known renderer runs this"), "{text}");
}

#[test]
fn information_as_text() {
    let (code, source, err) = command(&["info", &file("tests/data/values/struct/params.osl")]);
    assert_eq!(code, 0, "{err}");
    insta::assert_snapshot!("info-struct", source);
    // The same for the file from the reference, and for the file that is written here.
    assert_eq!(command(&["info", &file("tests/data/oso/struct__params.oso")]).1, source);
    insta::assert_snapshot!("info-chaosmosaic", command(&["info", &file("osl/chaosmosaic.osl")]).1);
}

#[test]
fn information_as_json() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("all.osl").display().to_string();
    let text = "struct pair { float a; string b[2]; };
surface all [[ string help = \"a \\\"quoted\\\" word\", int version = 3 ]]
    (float x = 0.1 [[ float min = 0, float range[2] = { 0, 1 } ]], int list[] = { 1, 2, 3 }, color c = 0.5,
     matrix m = 2, point p = P, string s = \"text\", pair q = { -1, { \"one\" } },
     output closure color k = 0, output float big = 1e30) { big = x; }";
    std::fs::write(&path, text).unwrap();
    let (code, json, err) = command(&["info", "--json", &path]);
    assert_eq!(code, 0, "{err}");
    insta::assert_snapshot!("info-json", json);
    let oso = dir.path().join("all.oso").display().to_string();
    assert_eq!(command(&["compile", &path, "-o", &oso]).0, 0);
    assert_eq!(command(&["info", "--json", &oso]).1, json);
}

#[test]
fn compiled_shaders_are_checked_for_run_times() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str, text: &str| {
        std::fs::write(dir.path().join(name), text).unwrap();
        dir.path().join(name).display().to_string()
    };
    let source = path(
        "turned.osl",
        "shader turned(float a = 90, output point p = 0) { p = rotate(transform(\"object\", P), radians(a), vector(0, 0, 1)); }",
    );
    let (code, out, err) = command(&["info", &source, "--check-oso"]);
    assert_eq!((code, out.as_str(), err.as_str()), (0, "turned.oso: no violations\n", ""));
    let oso = path(
        "bad.oso",
        "OpenShadingLanguage 1.00\nshader bad\nparam\tfloat\ta\tinf\noparam\tfloat\tr\t0\ncode ___main___\n\
         \tradians\t\tr a\n\treturn\n\tend\n",
    );
    let (code, out, err) = command(&["info", &oso, "--check-oso"]);
    let expected = [
        "3: literal: `a`: this is no literal of the symbol's type; infinity is written 1e39",
        "6: operand: `radians`: it does not take (float, float): it needs a constant operand",
        "7: flow: `return`: it is not in a function: write `exit`",
    ];
    let expected: String = expected.iter().map(|line| format!("{oso}:{line}\n")).collect();
    assert_eq!((code, out, err.as_str()), (1, expected, ""));
    let (code, out, _) = command(&["info", &oso, "--check-oso", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (code, json.as_array().map(Vec::len), &json[2]["rule"], &json[2]["line"]),
        (1, Some(3), &"flow".into(), &7.into())
    );
}

#[cfg(unix)]
#[test]
fn a_command_does_not_write_over_what_it_reads() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.osl"), "shader a(output float o = 0) { o = u; }").unwrap();
    let run = |args: &[&str]| {
        let oslrun = std::process::Command::new(env!("CARGO_BIN_EXE_oslrun"));
        let output = { oslrun }.current_dir(dir.path()).args(args).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(run(&["compile", "./a.osl"]), (Some(0), String::new()));
    let old = std::fs::read(dir.path().join("a.oso")).unwrap();
    std::fs::create_dir(dir.path().join("sub")).unwrap();
    for (command, expected) in [("compile", 2), ("oslc", 1)] {
        for input in ["a.oso", "./a.oso", "sub/../a.oso"] {
            let (code, err) = run(&[command, input]);
            assert!(
                code == Some(expected) && err.contains("name another one with -o"),
                "{command} {input}: {err}"
            );
            assert_eq!(std::fs::read(dir.path().join("a.oso")).unwrap(), old);
        }
    }
    // No output of any command replaces a file that it reads, by whatever name.
    std::os::unix::fs::symlink("a.osl", dir.path().join("link.osl")).unwrap();
    std::fs::hard_link(dir.path().join("a.osl"), dir.path().join("second.osl")).unwrap();
    let text = std::fs::read(dir.path().join("a.osl")).unwrap();
    for (line, expected) in [
        ("compile a.osl -o a.osl", 2),
        ("compile a.osl -o ./a.osl", 2),
        ("compile a.osl -o link.osl", 2),
        ("compile a.osl -o second.osl", 2),
        ("compile a.oso -o a.oso", 2),
        ("compile -", 2),
        ("oslc a.osl -o a.osl", 1),
        ("oslc a.osl -o c.oso -MD -MF a.osl", 1),
        ("stability a.osl --html a.osl --no-params --points 4x4", 1),
        ("a.osl -g 4x4 --profile=second.osl", 1),
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let (code, err) = run(&words);
        assert!(
            code == Some(expected) && (err.contains("name another one") || line == "compile -"),
            "{line}: {err}"
        );
        assert_eq!(std::fs::read(dir.path().join("a.osl")).unwrap(), text, "{line}");
        assert_eq!(std::fs::read(dir.path().join("a.oso")).unwrap(), old, "{line}");
    }
    // An image over a texture that it shows.
    let shows = "shader t(string file = \"t.png\", output color o = 0) { o = texture(file, u, v); }";
    std::fs::write(dir.path().join("t.osl"), shows).unwrap();
    assert_eq!(run(&["a.osl", "-g", "4x4", "-o", "t.png"]).0, Some(0));
    let texture = std::fs::read(dir.path().join("t.png")).unwrap();
    for args in [&["t.osl", "-g", "8x8", "-o", "t.png"][..], &["compare", "t.png", "t.png", "-o", "t.png"]] {
        let (code, err) = run(args);
        assert!(code == Some(1) && err.contains("t.png: this would replace a file that is read"), "{err}");
    }
    assert_eq!(std::fs::read(dir.path().join("t.png")).unwrap(), texture);
    // The source itself is changed if the user says so.
    let broken = "shader b(output float o = 0) { o = u + (v; }";
    std::fs::write(dir.path().join("b.osl"), broken).unwrap();
    assert_eq!(run(&["b.osl", "-g", "4x4", "--repair", "--write", "b.osl"]).0, Some(0));
    assert_ne!(std::fs::read_to_string(dir.path().join("b.osl")).unwrap(), broken);
    assert_eq!(run(&["fmt", "b.osl"]).0, Some(0));
    // The user may name any file and any folder.
    assert_eq!(run(&["compile", "./a.oso", "-o", "b.oso"]), (Some(0), String::new()));
    std::fs::rename(dir.path().join("b.oso"), dir.path().join("sub/b.oso")).unwrap();
    assert_eq!(run(&["compile", "sub/b.oso"]), (Some(0), String::new()));
}
