//! `testshade`: which layers run, and which messages are printed, for cases that the recordings do not
//! contain.

use std::path::Path;
use std::process::Command;

/// A node that prints its name, and passes a number on.
const NODE: &str = "shader node(string name = \"\", float in = 0 [[ int lockgeom = 0 ]], output float out = 0)\n{\n    printf(\"%s\\n\", name);\n    out = in + 1;\n}\n";
/// A shader that needs its first input at half of the points only.
const HALF: &str = "shader half(float a = 0, float b = 0, output float Cout = 0)\n{\n    printf(\"half\\n\");\n    if (u > 0.5)\n        Cout = a;\n    Cout += b;\n}\n";

/// A folder with the two shaders.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("node.osl"), NODE).unwrap();
    std::fs::write(dir.path().join("half.osl"), HALF).unwrap();
    dir
}

/// Exit code, and what was printed and said.
fn testshade(dir: &Path, line: &str) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_oslrun"))
        .arg("testshade")
        .args(line.split(' '))
        .current_dir(dir)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// The printed text of a successful run.
fn prints(dir: &Path, line: &str) -> String {
    let (code, out, err) = testshade(dir, line);
    assert_eq!((code, err.as_str()), (0, ""), "{line}\n{out}");
    out
}

/// Three nodes, and one that needs the first at some points only and the second everywhere.
const LAYERS: &str = "-param name A --shader node A -param name B --shader node B -param name C --shader node C --shader half H --connect A out H a --connect B out H b";

#[test]
fn a_layer_runs_where_it_is_needed() {
    let dir = folder();
    let text = prints(dir.path(), &format!("-g 2 1 {LAYERS}"));
    assert_eq!(text, "Connect A.out to H.a\nConnect B.out to H.b\nhalf\nB\nhalf\nA\nB\n\n");
}

#[test]
fn entries_run_in_their_order_and_once() {
    let dir = folder();
    let text = |more: &str| {
        let text = prints(dir.path(), &format!("{LAYERS} {more}"));
        text.strip_prefix("Connect A.out to H.a\nConnect B.out to H.b\n").unwrap().to_string()
    };
    assert_eq!(text("--entry C --entry C"), "Entry layers: C(2) C(2)\nC\n\n");
    assert_eq!(text("--entry B --entry H"), "Entry layers: B(1) H(3)\nB\nhalf\n\n");
    // An entry that an earlier one needs has run already.
    assert_eq!(text("--entry H --entry C --entry B"), "Entry layers: H(3) C(2) B(1)\nhalf\nB\nC\n\n");
    // One that an earlier entry needs at some points only runs at all points.
    let both = prints(dir.path(), &format!("-g 2 1 {LAYERS} --entry H --entry A"));
    assert_eq!(both.matches("A\n").count(), 2, "{both}");
    // A name that no layer has is not an entry.
    assert_eq!(text("--entry nosuch --entry C"), "Entry layers: nosuch(-1) C(2)\nC\n\n");
    assert_eq!(
        text("--entry A --entry C --entryoutput A.out"),
        "Entry layers: A(0) C(2)\nEntry outputs: A.out\nA\n\n"
    );
    let (code, out, _) = testshade(dir.path(), &format!("{LAYERS} --entryoutput A.nosuch"));
    assert!(
        code == 1 && out.ends_with("Entry outputs:\nEntry output A.nosuch not found. Abording.\n"),
        "{out}"
    );
}

#[test]
fn images_of_layers_that_do_not_run_are_black() {
    let dir = folder();
    let text = prints(dir.path(), &format!("{LAYERS} --entry A -o A.out a.exr -o C.out c.exr"));
    assert!(
        text.ends_with("\nEntry layers: A(0)\nOutput A.out to a.exr\nOutput C.out to c.exr\nA\n"),
        "{text}"
    );
    let value = |name: &str| osl_image::read_image(&dir.path().join(name)).unwrap().plane(0)[0];
    assert_eq!([value("a.exr"), value("c.exr")], [1.0, 0.0]);
}

#[test]
fn eager_layers_run_before_the_body_of_the_last() {
    let dir = folder();
    let text = |more: &str| prints(dir.path(), &format!("{more} {LAYERS}"));
    let connects = "Connect A.out to H.a\nConnect B.out to H.b\n";
    assert_eq!(text("--options lazyunconnected=0"), format!("{connects}C\nhalf\nB\n\n"));
    // An eager layer runs the layers that it needs.
    std::fs::write(
        dir.path().join("loud.osl"),
        "shader loud(float in = 0, output float out = 0)\n{\n    out = in;\n    if (in > 5)\n        error(\"no\\n\");\n    printf(\"loud\\n\");\n}\n",
    )
    .unwrap();
    let chain = "-param name A --shader node A --shader loud L --shader node E --connect A out L in";
    assert_eq!(prints(dir.path(), &format!("-param name E {chain}")).matches("loud").count(), 0);
    let eager = prints(dir.path(), &format!("--options lazyerror=0 {chain}"));
    assert_eq!(eager, "Connect A.out to L.in\nA\nloud\n\n\n");
    // With entries, nothing else runs.
    let options = "lazyunconnected=0,lazyglobals=0,lazyerror=0,lazytrace=0";
    let entry = text(&format!("--entry C --options {options}"));
    assert_eq!(entry, format!("{connects}Entry layers: C(2)\nC\n\n"));
    std::fs::write(
        dir.path().join("ray.osl"),
        "shader ray(output float out = 0)\n{\n    printf(\"ray %d\\n\", trace(P, N));\n}\n",
    )
    .unwrap();
    let ray = "--shader ray R -param name E --shader node E";
    assert_eq!(prints(dir.path(), ray), "E\n\n");
    assert_eq!(prints(dir.path(), &format!("--options lazytrace=0 {ray}")), "ray 0\nE\n\n");
    // Settings without effect, and an invalid list, change nothing.
    assert_eq!(text("--options llvm_debug=1,nonsense,,=3,lazyglobals=0"), text("--options lazylayers=1"));
}

#[test]
fn unmarked_parameters_take_data_if_told_so() {
    let dir = folder();
    let shader = "shader data(float s = 7, float t = 8 [[ int lockgeom = 1 ]], output float o = 0) { o = 10 * s + t; }";
    std::fs::write(dir.path().join("data.osl"), shader).unwrap();
    let value = |more: &str| prints(dir.path(), &format!("-g 1 1 --print -o o null {more}data"));
    assert!(value("").contains("o : 78"), "{}", value(""));
    assert!(value("--options lockgeom=0 ").contains("o : 13"), "{}", value("--options lockgeom=0 "));
    let asks = "shader asks(float a = 1 [[ int lockgeom = 0 ]], float b = 1, output int o = 0) { o = 10 * isconnected(a) + isconnected(b); }";
    std::fs::write(dir.path().join("asks.osl"), asks).unwrap();
    let value = |more: &str| prints(dir.path(), &format!("-g 1 1 --print -o o null {more}asks"));
    assert!(value("").contains("o : 0"));
    for option in ["--userdata_isconnected ", "--options userdata_isconnected=1 "] {
        assert!(value(option).contains("o : 10"), "{}", value(option));
    }
}

#[test]
fn shaders_are_found_in_folders_that_a_setting_names() {
    let dir = folder();
    std::fs::create_dir(dir.path().join("lib")).unwrap();
    std::fs::rename(dir.path().join("node.osl"), dir.path().join("lib/node.osl")).unwrap();
    assert!(testshade(dir.path(), "node").2.contains("Could not find shader \"node\""));
    assert_eq!(prints(dir.path(), "--options searchpath:shader=no:lib -param name x node"), "x\n\n");
}

#[test]
fn connections_that_fail_may_be_warnings() {
    let dir = folder();
    let line = "--shader node A --shader node B --connect A nosuch B in";
    let (code, _, err) = testshade(dir.path(), line);
    assert!(code == 1 && err.starts_with("ERROR: ConnectShaders: \"nosuch\" is not a parameter"), "{err}");
    let (code, out, err) = testshade(dir.path(), &format!("--options connection_error=0 {line}"));
    assert!(code == 0 && err.starts_with("WARNING: ConnectShaders: "), "{out}{err}");
}

#[test]
fn a_group_is_archived_and_read_again() {
    let dir = folder();
    let first = prints(dir.path(), &format!("{LAYERS} --archivegroup kept.group"));
    let text = std::fs::read_to_string(dir.path().join("kept.group")).unwrap();
    assert_eq!(
        text,
        "param string name \"A\" ;\nshader node A ;\nparam string name \"B\" ;\nshader node B ;\nparam string name \"C\" ;\nshader node C ;\nshader half H ;\nconnect A.out H.a ;\nconnect B.out H.b ;\n"
    );
    let again = prints(dir.path(), "--group kept.group");
    assert!(first.ends_with(&again), "{first}{again}");
}

#[test]
fn color_spaces_hold_for_names_that_are_computed_and_for_slopes() {
    let dir = folder();
    let shader = "shader cs(string to = \"\", output float same = 0, output float slope = 0, output float own = 0)\n{\n    color c = color(u, 0.7, v);\n    string computed = u < 5 ? to : \"rgb\";\n    same = length(vector(transformc(computed, \"rgb\", c) - transformc(\"XYZ\", \"rgb\", c)));\n    slope = Dx(luminance(c)) / Dx(u) - luminance(color(1, 0, 0));\n    own = length(vector(transformc(\"rgb\", \"ACEScg\", c) - c));\n}\n";
    std::fs::write(dir.path().join("cs.osl"), shader).unwrap();
    let values = |more: &str| -> Vec<f32> {
        let text = prints(
            dir.path(),
            &format!(
                "{more} -param to XYZ -g 2 2 --center --print -o same null -o slope null -o own null cs"
            ),
        );
        text.lines().filter_map(|l| l.split_once(" : ")?.1.parse().ok()).collect()
    };
    for more in ["--colorspace ACEScg", "--options colorspace=ACEScg"] {
        let found = values(more);
        assert!(found.len() == 12 && found.iter().all(|x| x.abs() < 1e-6), "{more}: {found:?}");
    }
}

#[test]
fn settings_silence_messages_and_name_spaces() {
    let dir = folder();
    let shader = "shader noisy(int i = 7, output point o = 0)\n{\n    float a[2] = { 1, 2 };\n    o = a[i] + transform(\"home\", \"nowhere\", P);\n}\n";
    std::fs::write(dir.path().join("noisy.osl"), shader).unwrap();
    let err = |more: &str| testshade(dir.path(), &format!("{more} -param:lockgeom=0 i 7 -o o null noisy")).2;
    assert!(err("-v").contains("Index [7]") && err("-v").contains("Unknown transformation"), "{}", err("-v"));
    let less = err("--options range_checking=0,commonspace=home");
    assert!(
        less.starts_with("ERROR: Unknown transformation \"nowhere\"") && less.lines().count() == 1,
        "{less}"
    );
    assert_eq!(err("--options range_checking=0,unknown_coordsys_error=0"), "");
    // Each unknown space is reported once.
    let shader = "shader lost(output point o = 0)\n{\n    o = transform(\"a\", \"b\", P);\n    o += transform(\"b\", P) + transform(\"a\", P);\n    o += point(\"b\", 1, 2, 3);\n}\n";
    std::fs::write(dir.path().join("lost.osl"), shader).unwrap();
    let (_, _, err) = testshade(dir.path(), "-g 3 3 -o o null lost");
    assert_eq!(err, "ERROR: Unknown transformation \"a\"\nERROR: Unknown transformation \"b\"\n");
}

#[test]
fn what_later_versions_take_is_accepted() {
    let dir = folder();
    let line =
        "--print-group-stats --options lazytrace=1,opt_batched_analysis=1 --userdata:type=int face_idx 3";
    let shader = "shader face(int face_idx = 0 [[ int lockgeom = 0 ]]) { printf(\"face %d\\n\", face_idx); }";
    std::fs::write(dir.path().join("face.osl"), shader).unwrap();
    assert_eq!(prints(dir.path(), &format!("{line} face")), "face 3\n\n");
}

#[test]
fn a_missing_tile_answers_what_all_tiles_share() {
    let dir = folder();
    let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/suite/udim_info");
    for tile in ["t.1001.tif", "t.1002.tif", "t.1011.tif"] {
        std::fs::copy(suite.join(tile), dir.path().join(tile)).unwrap();
    }
    let shader = "shader udim(string f = \"t.<UDIM>.tif\")\n{\n    int n = -7; int m = -7; int r[2] = { -7, -7 }; string t = \"no\"; string g = \"no\";\n    int a = gettextureinfo(f, 2.5, 0.5, \"channels\", n);\n    int b = gettextureinfo(f, 2.5, 0.5, \"texturetype\", t);\n    int c = gettextureinfo(f, 2.5, 0.5, \"textureformat\", g);\n    int d = gettextureinfo(f, 2.5, 0.5, \"subimages\", m);\n    int e = gettextureinfo(f, 2.5, 0.5, \"resolution\", r);\n    printf(\"%d %d, %d %s, %d %s, %d %d, %d %d\\n\", a, n, b, t, c, g, d, m, e, r);\n}\n";
    std::fs::write(dir.path().join("udim.osl"), shader).unwrap();
    let text = prints(dir.path(), "udim");
    assert_eq!(text, "1 3, 1 Plain Texture, 1 Plain Texture, 1 1, 0 -7 -7\n\n");
}

#[test]
fn layers_have_the_names_of_their_shaders() {
    let dir = folder();
    std::fs::create_dir_all(dir.path().join("a/folder")).unwrap();
    let shader =
        "shader t_0()\n{\n    string l; getattribute(\"shader:layername\", l); printf(\"%s\\n\", l);\n}\n";
    std::fs::write(dir.path().join("a/folder/t.osl"), shader).unwrap();
    for name in ["a/folder/t", "a/folder/t.osl"] {
        assert_eq!(prints(dir.path(), name), "t_0_0\n\n");
    }
}
