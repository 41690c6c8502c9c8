//! The command lines of the reference's tools, as scripts use them: by name, in a separate folder.

use std::path::Path;
use std::process::Command;

const NOISY: &str = "shader noisy\n    [[ string help = \"Some noise\" ]]\n(\n    float scale = 2 [[ float min = 0, string label = \"Scale\" ]],\n    color tint[2] = { color(1, 0.5, 0.25), 0 },\n    string name = \"n\",\n    output float out = 0,\n    output color both = 0\n)\n{\n    out = floor(u * scale);\n    both = out * tint[0];\n    printf(\"%s %g\\n\", name, out);\n}\n";
const ADD: &str = "shader add(float a = 1, float b = 2, output float sum = 0, output int more = 3)\n{\n    sum = a + b + isconnected(a);\n    more = raytype(\"shadow\");\n}\n";

/// A folder with the two shaders.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("noisy.osl"), NOISY).unwrap();
    std::fs::write(dir.path().join("add.osl"), ADD).unwrap();
    dir
}

/// Exit code, and what was printed and said.
fn tool(dir: &Path, name: &str, args: &[&str]) -> (i32, String, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_oslrun")).arg(name).args(args).current_dir(dir).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// The printed text of a successful run.
fn prints(dir: &Path, name: &str, args: &[&str]) -> String {
    let (code, out, err) = tool(dir, name, args);
    assert_eq!((code, err.as_str()), (0, ""), "{name} {args:?}\n{out}");
    out
}

#[test]
fn a_script_compiles_lists_and_shades() {
    let dir = folder();
    let dir = dir.path();
    assert_eq!(prints(dir, "oslc", &["noisy.osl"]), "Compiled noisy.osl -> noisy.oso\n");
    assert_eq!(prints(dir, "oslc", &["add.osl"]), "Compiled add.osl -> add.oso\n");
    std::fs::remove_file(dir.join("noisy.osl")).unwrap();
    std::fs::remove_file(dir.join("add.osl")).unwrap();
    assert_eq!(
        prints(dir, "oslinfo", &["-v", "noisy"]),
        "shader \"noisy\"\n\t\tmetadata: string help = \"Some noise\"\n    \"scale\" \"float\"\n\t\tDefault value: 2\n\
         \t\tmetadata: float min = 0\n\t\tmetadata: string label = \"Scale\"\n    \"tint\" \"color[2]\"\n\
         \t\tDefault value: [ 1 0.5 0.25 0 0 0 ]\n    \"name\" \"string\"\n\t\tDefault value: \"n\"\n\
         \x20   \"out\" \"output float\"\n\t\tDefault value: 0\n    \"both\" \"output color\"\n\t\tDefault value: [ 0 0 0 ]\n"
    );
    assert_eq!(prints(dir, "oslinfo", &["add.oso", "--param", "b"]), "float b 2\n");
    assert_eq!(
        prints(
            dir,
            "testshade",
            &[
                "-g",
                "2",
                "1",
                "--param",
                "scale",
                "3.0",
                "--shader",
                "noisy",
                "n1",
                "--shader",
                "add",
                "s",
                "--connect",
                "n1",
                "out",
                "s",
                "a",
                "-o",
                "sum",
                "null",
                "--print"
            ]
        ),
        "Connect n1.out to s.a\nPixel (0, 0):\n  sum : 3\nPixel (1, 0):\n  sum : 6\nn 0\nn 3\n\n"
    );
}

#[test]
fn the_binary_goes_by_the_tools_names() {
    let dir = folder();
    let link = dir.path().join("oslc");
    #[cfg(unix)]
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_oslrun"), &link).unwrap();
    #[cfg(not(unix))]
    std::fs::copy(env!("CARGO_BIN_EXE_oslrun"), &link).unwrap();
    let output =
        Command::new(link).args(["-q", "-o", "x.oso", "add.osl"]).current_dir(dir.path()).output().unwrap();
    assert!(output.status.success() && output.stdout.is_empty() && dir.path().join("x.oso").is_file());
}

#[test]
fn options_of_oslc() {
    let dir = folder();
    let dir = dir.path();
    std::fs::create_dir(dir.join("inc")).unwrap();
    std::fs::write(dir.join("inc/half.h"), "#define HALF(x) ((x) / K)\n").unwrap();
    std::fs::write(dir.join("h.osl"), "#include \"half.h\"\nshader h(output float r = 0) { r = HALF(u); }\n")
        .unwrap();
    let (code, out, err) = tool(dir, "oslc", &["h.osl"]);
    assert_eq!((code, out.as_str()), (1, "FAILED h.osl\n"));
    assert!(err.starts_with("h.osl:1: error: "), "{err}");
    let text = prints(dir, "oslc", &["-Iinc", "-DK=2.0", "-E", "h.osl"]);
    assert!(text.contains("r = ((u) / 2.0);"), "{text}");
    assert_eq!(
        prints(
            dir,
            "oslc",
            &["-Iinc", "-DK=3.0", "-UK", "-DK=2.0", "-MD", "-MT", "t", "-o", "o.oso", "h.osl"]
        ),
        "Compiled h.osl -> o.oso\n"
    );
    assert_eq!(std::fs::read_to_string(dir.join("h.d")).unwrap(), "t: h.osl \\\n  inc/half.h\n");
    assert_eq!(prints(dir, "oslc", &["-Iinc", "-DK=2.0", "-M", "-MF", "dep", "h.osl"]), "");
    assert!(dir.join("dep").is_file() && dir.join("h.oso").is_file());
    for quiet in [["-v", "-O2"], ["-d", "-O0"], ["-buffer", "-O1"], ["-embed-source", "-O"], ["-MMD", "-q"]] {
        prints(dir, "oslc", &[&quiet[..], &["-Iinc", "-DK=2.0", "h.osl"]].concat());
    }
    assert_eq!(prints(dir, "oslc", &["-MM", "-Iinc", "-DK=2.0", "h.osl"]), "h.oso: h.osl \\\n  inc/half.h\n");
    std::fs::write(dir.join("w.osl"), "shader w(output int r = 0) { r = 2.5; }\n").unwrap();
    let (code, _, err) = tool(dir, "oslc", &["w.osl"]);
    assert!(code == 0 && err.contains("w.osl:1: warning: "), "{err}");
    let (code, out, err) = tool(dir, "oslc", &["-Werror", "w.osl"]);
    assert!(code == 1 && out == "FAILED w.osl\n" && err.contains("w.osl:1: error: "), "{err}");
    let (code, out, err) = tool(dir, "oslc", &["w.osl", "--what"]);
    assert_eq!(
        (code, out.as_str(), err.as_str()),
        (1, "FAILED --what\n", "error: Input file \"--what\" not found\n")
    );
    let (code, out, _) = tool(dir, "oslc", &["--what", "-Wall", "h.osl", "w.osl"]);
    assert_eq!((code, out.as_str()), (0, "Compiled w.osl -> w.oso\n"));
    let (code, _, err) = tool(dir, "oslc", &["-q"]);
    assert_eq!((code, err.as_str()), (1, "error: no shader file is named\n"));
    let (code, _, err) = tool(dir, "oslc", &["-o"]);
    assert!(code == 1 && err.contains("needs a word"), "{err}");
    for help in ["--help", "-h"] {
        assert!(prints(dir, "oslc", &[help]).contains("-Werror"));
    }
}

#[test]
fn options_of_oslinfo() {
    let dir = folder();
    let dir = dir.path();
    assert_eq!(
        prints(dir, "oslinfo", &["--runstats", "noisy.osl"]),
        "shader noisy\nfloat scale 2\ncolor[2] tint [ 1 0.5 0.25 0 0 0 ]\nstring name \"n\"\noutput float out 0\noutput color both [ 0 0 0 ]\n"
    );
    std::fs::create_dir(dir.join("sub")).unwrap();
    std::fs::rename(dir.join("add.osl"), dir.join("sub/add.osl")).unwrap();
    for path in ["-p", "--path"] {
        assert!(prints(dir, "oslinfo", &[path, "no:sub", "add"]).starts_with("shader add\nfloat a 1\n"));
    }
    let (code, out, _) = tool(dir, "oslinfo", &["add"]);
    assert!(code == 1 && out.starts_with("ERROR opening shader \"add\""), "{out}");
    for help in ["--help", "-h"] {
        assert!(prints(dir, "oslinfo", &[help]).contains("--param"));
    }
}

#[test]
fn grids_of_testshade() {
    let dir = folder();
    let dir = dir.path();
    let text = |more: &[&str]| {
        prints(
            dir,
            "testshade",
            &[more, &["--expr", "result = u + 10 * v", "--print", "-o", "result", "null"]].concat(),
        )
    };
    let values = |text: &str| -> Vec<String> {
        text.lines()
            .filter_map(|l| l.strip_prefix("  result : "))
            .map(|l| l.split(' ').next().unwrap().to_string())
            .collect()
    };
    assert_eq!(values(&text(&[])), ["5.5"]);
    for grid in ["-g", "--res", "-res"] {
        assert_eq!(values(&text(&[grid, "2", "2"])), ["0", "1", "10", "11"]);
    }
    assert_eq!(values(&text(&["-g", "2", "1", "--center"])), ["5.25", "5.75"]);
    for scale in ["--scaleuv", "--scalest"] {
        assert_eq!(values(&text(&["-g", "2", "1", scale, "4", "0"])), ["0", "4"]);
    }
    assert_eq!(values(&text(&["-g", "2", "1", "--offsetst", "-1", "1"])), ["14", "15"]);
    // As in the reference, the other name has no effect.
    assert_eq!(values(&text(&["-g", "2", "1", "--offsetuv", "-1", "1"])), ["5", "6"]);
    for (vary, expr) in [
        ("--vary_pdxdy", "result = dot(Dx(P), vector(0, 1, 0))"),
        ("--vary_udxdy", "result = Dy(u)"),
        ("--vary_vdxdy", "result = Dy(v)"),
    ] {
        let varied = prints(
            dir,
            "testshade",
            &["-g", "3", "3", vary, "--expr", expr, "--print", "-o", "result", "null"],
        );
        let found: std::collections::BTreeSet<String> = values(&varied).into_iter().collect();
        assert_eq!(found.into_iter().collect::<Vec<_>>(), ["0", "0.5", "1"], "{vary}");
    }
}

#[test]
fn groups_of_testshade() {
    let dir = folder();
    let dir = dir.path();
    let group = "param float scale 3 ; param string name \"x\" ; shader noisy n1 ; shader add s ; connect n1.out s.a ;";
    std::fs::write(dir.join("net.txt"), group).unwrap();
    for given in [group, "net.txt"] {
        let text = prints(
            dir,
            "testshade",
            &[
                "--group",
                given,
                "--groupname",
                "g",
                "-g",
                "2",
                "1",
                "-o",
                "sum",
                "null",
                "-o",
                "n1.out",
                "null",
                "--print",
            ],
        );
        assert_eq!(
            text,
            "\nPixel (0, 0):\n  sum : 3\n  out : 0\nPixel (1, 0):\n  sum : 6\n  out : 3\nx 0\nx 3\n"
        );
    }
    // `--layer` names the next shader; a name alone is one too; an int is no float.
    let (code, out, err) = tool(
        dir,
        "testshade",
        &[
            "--layer",
            "L",
            "--param",
            "a",
            "4",
            "--param:type=float",
            "b",
            "5",
            "add",
            "--print",
            "-o",
            "L.sum",
            "null",
        ],
    );
    assert_eq!((code, out.as_str()), (0, "Pixel (0, 0):\n  sum : 6\n\n"));
    assert!(err.starts_with("WARNING: "), "{err}");
    // From the second iteration on, the value is different.
    let rounds = prints(
        dir,
        "testshade",
        &["--shader", "noisy", "n", "--iters", "3", "--reparam", "n", "name", "again", "-o", "out", "null"],
    );
    assert_eq!(rounds, "n 1\nagain 1\nagain 1\n\n");
    // A layer without connections to others does not run.
    let lonely = ["--shader", "noisy", "n", "--shader", "add", "s", "-o", "sum", "null"];
    assert_eq!(prints(dir, "testshade", &lonely), "\n");
    for (bad, says) in [
        ("shader nothere n;", "ERROR: Could not find shader \"nothere\"\n        group: unnamed_group_2\n"),
        ("shader add s; shader add s;", "there is a layer \"s\" already"),
        ("shader add s; connect s.sum t.a;", "ConnectShaders: destination layer \"t\" not found"),
        (
            "shader add s; shader add t; connect s.sum t.x;",
            "\"x\" is not a parameter or global of layer \"t\" (shader \"add\")",
        ),
        (
            "shader add s; shader add t; connect t.sum s.a;",
            "destination layer must follow source layer (tried to connect t.sum -> s.a)",
        ),
        (
            "shader add s; shader noisy t; connect s.sum t.name;",
            "ConnectShaders: cannot connect a float (sum) to a string (name)\n        group: unnamed_group_2\n",
        ),
    ] {
        let (code, _, err) = tool(dir, "testshade", &["--group", bad]);
        assert!(
            code == 1
                && err.contains(says)
                && err.ends_with("ERROR: Invalid shader group. Exiting testshade.\n"),
            "{bad}\n{err}"
        );
    }
    let (code, _, err) = tool(dir, "testshade", &["--group", "shader add s; nonsense here; shader add t;"]);
    assert!(code == 1 && err.contains("problem might be here: nonsense here;"), "{err}");
}

#[test]
fn images_of_testshade() {
    let dir = folder();
    let dir = dir.path();
    for (file, format) in [
        ("a.exr", "float"),
        ("b.exr", "half"),
        ("c.tif", "uint8"),
        ("d.png", "uint8"),
        ("e.jpg", "uint8"),
        ("f.tif", "uint16"),
    ] {
        for option in ["-d", "-od"] {
            let text =
                prints(dir, "testshade", &["-g", "8", "4", option, format, "-o", "both", file, "noisy"]);
            assert!(text.starts_with(&format!("\nOutput both to {file}\nn 0\n")), "{text}");
            let image = osl_image::read_image(&dir.join(file)).unwrap();
            assert_eq!((image.width, image.height, image.channels.len()), (8, 4, 3), "{file}");
        }
    }
    // An output that no layer has is ignored.
    assert_eq!(prints(dir, "testshade", &["-o", "nothing", "x.exr", "add"]), "\n");
    assert!(!dir.join("x.exr").exists());
    let (code, _, err) = tool(dir, "testshade", &["-o", "sum", "x.what", "add"]);
    assert!(code == 1 && err.contains("must end in .exr"), "{err}");
    let (code, _, err) = tool(dir, "testshade", &["-d", "uint12", "-o", "sum", "x.exr", "add"]);
    assert!(code == 1 && err.contains("no samples are called uint12"), "{err}");
}

#[test]
fn renderer_of_testshade() {
    let dir = folder();
    let dir = dir.path();
    let more =
        |args: &[&str]| prints(dir, "testshade", &[args, &["--print", "-o", "more", "null", "add"]].concat());
    assert_eq!(more(&[]), "Pixel (0, 0):\n  more : 0\n\n");
    assert_eq!(more(&["--raytype", "shadow", "--raytype_opt"]), "Pixel (0, 0):\n  more : 1\n\n");
    let data = |args: &[&str]| {
        prints(
            dir,
            "testshade",
            &[args, &["--param:lockgeom=0", "a", "1.0", "--print", "-o", "sum", "null", "add"]].concat(),
        )
    };
    assert_eq!(data(&[]), "Pixel (0, 0):\n  sum : 3\n\n");
    assert_eq!(data(&["--userdata", "a", "0.5"]), "Pixel (0, 0):\n  sum : 2.5\n\n");
    assert_eq!(data(&["--userdata:type=float", "a", "4"]), "Pixel (0, 0):\n  sum : 6\n\n");
    assert!(more(&["--runstats"]).contains("Run: ") && more(&["--stats"]).contains("Run: "));
    assert_eq!(more(&["-t", "1"]), more(&["-t", "2"]));
    assert_eq!(more(&["--colorspace", "Rec709"]), more(&[]));
    // Options for a code generator have no effect.
    for quiet in [
        &["--batched"][..],
        &["--options", "lazylayers=1"],
        &["--texoptions", "x=1"],
        &["-O0"],
        &["-O1"],
        &["-O2"],
        &["--debug"],
        &["--debug2"],
        &["--debugnan"],
        &["--debuguninit"],
        &["--groupoutputs"],
        &["--inbuffer"],
        &["--jbufferMB", "4"],
        &["--llvm_debug"],
        &["--llvm_opt", "2"],
        &["--locale", "C"],
        &["--no-output-placement"],
        &["--noshadeimage"],
        &["--optix"],
        &["--saveptx"],
        &["--print-groupdata"],
        &["--profile"],
        &["--shadeimage"],
        &["--use_rs_bitcode"],
        &["--userdata_isconnected"],
        &["--warmup"],
    ] {
        assert_eq!(more(quiet), more(&[]), "{quiet:?}");
    }
    assert!(prints(dir, "testshade", &["--help"]).contains("Accepted and without effect: "));
    for (bad, says) in [
        (&["--foo", "add"][..], "unknown option \"--foo\""),
        (&["-g", "2"], "needs 2 more words"),
        (&["-g", "2", "x", "add"], "takes numbers"),
        (&[], "No shader or group was specified"),
    ] {
        let (code, _, err) = tool(dir, "testshade", bad);
        assert!(code == 1 && err.contains(says), "{bad:?}\n{err}");
    }
}

/// A folder with files.
fn files(list: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in list {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    dir
}

#[test]
fn rules_for_make() {
    let dir = files(&[
        (
            "sub dir/s.osl",
            "#include \"a.h\"\n#include <vector2.h>\nshader made(output vector2 o = {A, 1}) {}\n",
        ),
        ("inc/a.h", "#include \"b.h\"\n#define A B\n"),
        ("inc/b.h", "#define B M_PI\n"),
        ("own/stdosl.h", "#define M_PI 3\n"),
        ("bad.osl", "shader bad() { nothing(); }\n"),
    ]);
    let dir = dir.path();
    let source = "sub dir/s.osl";
    // The standard header is listed only if it is a file.
    for (option, own, header) in [
        ("-M", "-Iown", "  own/stdosl.h \\\n"),
        ("-MM", "-Iown", ""),
        ("--dependencies", "-Iinc", ""),
        ("--user-dependencies", "-Iown", ""),
    ] {
        let text = format!("sub\\ dir/s.oso: sub\\ dir/s.osl \\\n{header}  inc/a.h \\\n  inc/b.h\n");
        assert_eq!(prints(dir, "oslc", &[option, own, "-Iinc", source]), text, "{option}");
    }
    assert!(dir.join("made.oso").is_file(), "a rule that is printed does not stop the compiler");
    for option in ["-MD", "-MMD", "--write-dependencies", "--write-user-dependencies"] {
        assert_eq!(
            prints(dir, "oslc", &[option, "-Iinc", source]),
            format!("Compiled {source} -> made.oso\n")
        );
        assert!(std::fs::read_to_string(dir.join("sub dir/s.d")).unwrap().starts_with("sub\\ dir/s.oso: "));
        std::fs::remove_file(dir.join("sub dir/s.d")).unwrap();
    }
    prints(dir, "oslc", &["-q", "-Iinc", "-MTa b", "-MFglued", "-MMD", source]);
    assert!(std::fs::read_to_string(dir.join("glued")).unwrap().starts_with("a b: "));
    let (code, out, _) = tool(dir, "oslc", &["-MMD", "bad.osl"]);
    assert_eq!((code, out.as_str()), (1, "FAILED bad.osl\n"));
    assert!(!dir.join("bad.d").exists());
}

#[test]
fn errors_as_often_as_the_reference_reports_them() {
    // The lines of errors and warnings, in order.
    for (text, lines) in [
        // Code before a syntax error is checked; code after it is not.
        (
            "float f() { return \"a\"; }\nfloat g() { return 1 }\nfloat h() { return \"a\"; }\nshader s() {}\n",
            "1e 2e",
        ),
        (
            "float f() { return \"a\"; }\nfloat g() { return f().x; }\nfloat h() { return \"a\"; }\nshader s() {}\n",
            "1e 2e",
        ),
        ("float f() { return }\nfloat g() { return }\nshader s() {}\n", "1e"),
        // Empty lists are not syntax errors.
        (
            "color f() { return {}; }\nfloat g() { return \"a\"; }\nshader s() { float x[2] = {}; }\n",
            "1e 2e 3e",
        ),
        // A failed expression is reported again if it is assigned, passed or returned; a name only within
        // functions.
        ("float f() { return none; }\nshader s() { float x = none; }\n", "1e 1e 2e"),
        ("shader s(output float o = 0) {\no = \"a\" * 2;\nprintf(\"%g\", \"a\" * 2);\n}\n", "2e 2e 3e 3e"),
        ("shader s() { color c = color(1, 2); }\n", "1e 1e"),
        // No lints.
        (
            "int n(int l[2]) { l[0] = 1; return l[0] / 0; }\nint m(int k) { k = 1; return k; }\nshader s() {}\n",
            "2w",
        ),
    ] {
        let dir = files(&[("s.osl", text)]);
        let (_, _, err) = tool(dir.path(), "oslc", &["s.osl"]);
        let place = |line: &str| {
            let mut parts = line.strip_prefix("s.osl:")?.split(": ");
            Some(format!("{}{}", parts.next()?, parts.next()?.get(..1)?))
        };
        assert_eq!(err.lines().filter_map(place).collect::<Vec<_>>().join(" "), lines, "{text}{err}");
    }
}
