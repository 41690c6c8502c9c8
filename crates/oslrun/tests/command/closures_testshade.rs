//! Closures in the front end that replaces the reference's grid tool: known closures, messages, and ignored
//! calls.

use std::path::Path;
use std::process::Command;

/// Standard output and errors of a run in a folder.
fn run(dir: &Path, args: &[&str]) -> (String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).current_dir(dir).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

const UNKNOWN: &str = "closure color sheen(float a) [[ int builtin = 1 ]];
closure color pick(int i) { if (i == 1) { return sheen(1); } return diffuse(N); }
shader t(int which = 0, output float a = 0, output float b = 0, output float c = 0)
{
    a = 1;
    if (which == 0) { if (u > 0.5) { Ci = sheen(2); b = 2; } b += 1; }
    else if (which == 1) { { Ci = 2 * sheen(3); b = 7; } b = 8; }
    else if (which == 2) { Ci = pick(1); b = 4; }
    else if (which == 3) { for (int i = 0; i < 3; ++i) { b += 1; Ci += sheen(i); b += 10; } }
    else { closure color k = sheen(9); b = 1; }
    c = 3;
    printf(\"%g %g %g\\n\", a, b, c);
}
";

/// An unknown closure ends the list of operations that contains it: the rest of a branch, of an iteration, of
/// a function, or of the shader if the branch is known to be taken. An unknown closure without effect on an
/// output is ignored.
#[test]
fn unknown_closures_stop_what_follows() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("t.osl"), UNKNOWN).unwrap();
    std::fs::create_dir(dir.path().join("compiled")).unwrap();
    run(dir.path(), &["oslc", "-q", "-o", "compiled/t.oso", "t.osl"]);
    for (which, line, shown) in
        [("0", 6, "1 1 3\n"), ("1", 7, ""), ("2", 2, "1 4 3\n"), ("3", 9, "1 3 3\n"), ("4", 0, "1 1 3\n")]
    {
        for shader in ["t.osl", "compiled/t.oso"] {
            let (out, err) = run(dir.path(), &["testshade", "-param", "which", which, shader]);
            assert_eq!(out.trim_start_matches('\n').trim_end(), shown.trim_end(), "{which} {shader}");
            let said = format!(
                "ERROR: Closure 'sheen' is not supported by the current renderer, called from t.osl:{line} in shader \"t\", layer 0 "
            );
            assert_eq!(
                (err.lines().count(), err.starts_with(&said)),
                if line > 0 { (1, true) } else { (0, false) },
                "{err}"
            );
        }
    }
}

#[test]
fn keywords_are_those_that_the_tool_knows() {
    let dir = tempfile::tempdir().unwrap();
    let text = "closure color debug(string tag) [[ int builtin = 1 ]];
closure color oren_nayar(normal n) [[ int builtin = 1 ]];
shader t() {
    printf(\"%s\\n\", diffuse(N, \"label\", 1, \"label\", \"b\", \"label\", 2));
    printf(\"%s\\n\", diffuse(N, \"label\", \"c\", \"odd\"));
    printf(\"%s\\n\", oren_nayar(N));
    printf(\"%s\\n\", reflection(N) + microfacet(\"ggx\", N, 0.5, 1.5, 0) + debug(\"x\", \"y\", 1));
    closure color unused = phong(N, 2, \"nobody asks\", 1);
}
";
    std::fs::write(dir.path().join("t.osl"), text).unwrap();
    let (out, err) = run(dir.path(), &["testshade", "t.osl"]);
    let out: Vec<&str> = out.lines().filter(|line| !line.is_empty()).collect();
    assert_eq!(
        out,
        [
            "(1, 1, 1) * diffuse ((0, 0, 1), \"label\", \"b\")",
            "(1, 1, 1) * diffuse ((0, 0, 1), \"label\", \"c\")",
            "(1, 1, 1) * oren_nayar ((0, 0, 1), 0)",
            "(1, 1, 1) * reflection ((0, 0, 1), 0)",
            "\t+ (1, 1, 1) * microfacet (\"ggx\", (0, 0, 1), (0, 0, 0), 0.5, 0.5, 1.5, 0)",
            "\t+ (1, 1, 1) * debug (\"x\")",
        ]
    );
    let err: Vec<&str> = err.lines().collect();
    assert_eq!(
        err,
        [
            "WARNING: Unsupported closure keyword arg \"label\" for diffuse (t.osl:4)",
            "WARNING: Unsupported closure keyword arg \"y\" for debug (t.osl:7)",
        ]
    );
}
