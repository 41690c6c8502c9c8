//! `--tap`: variables at a line as outputs.

use crate::in_process::oslrun;
use osl_image::{ImageData, read_image};
use std::path::Path;

const SHADER: &str = "struct pair { float a; color b; };
float half(float x)
{
    float h = x / 2;
    return h;
}
surface s(float k = 3, output float o = 0)
{
    float list[3] = {u, v, 7};
    pair p = {u, color(1, 2, 3)};
    float sum = 0;
    for (int i = 1; i <= 4; i++) {
        sum += i;
        if (u > 0.5) {
            list[1] = sum;
        }
    }
    o = half(sum) +
        half(k);
    Ci = 0.25 * diffuse(N);
}
";

fn file(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn tapped(dir: &Path, more: &[&str]) -> ImageData {
    let shader = file(dir, "s.osl", SHADER);
    let out = dir.join("out.exr").display().to_string();
    let args = [&[&shader, "-g", "2x2", "-o", &out], more].concat();
    let (code, _, err) = oslrun(&args);
    assert_eq!(code, 0, "{args:?}: {err}");
    read_image(Path::new(&out)).unwrap()
}

fn channel(image: &ImageData, name: &str) -> Vec<f32> {
    let at = image.channels.iter().position(|c| c == name);
    image.plane(at.unwrap_or_else(|| panic!("{name} of {:?}", image.channels)))
}

#[test]
fn a_tap_has_the_value_after_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let one = |tap: &str, channel_name: &str| channel(&tapped(dir.path(), &["--tap", tap]), channel_name);
    assert_eq!(one("13:sum", "line13.sum"), [10.0; 4]);
    assert_eq!(one("13:sum@2", "line13.sum.round2"), [3.0; 4]);
    assert_eq!(one("13:sum@2", "line13.sum.round2.reached"), [1.0; 4]);
    assert_eq!(one("13:sum@5", "line13.sum.round5.reached"), [0.0; 4]);
    assert_eq!(one("12:i", "line12.i"), [5.0; 4], "after the loop");
    assert_eq!(one("12:sum@3", "line12.sum.round3"), [6.0; 4], "at the end of a round");
    assert_eq!(one("15:list[1]", "line15.list.1"), [0.0, 10.0, 0.0, 10.0]);
    assert_eq!(one("15:list[1]", "line15.list.1.reached"), [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(one("10:p.b", "line10.p.b.G"), [2.0; 4]);
    assert_eq!(one("10:p.b[2]", "line10.p.b.2"), [3.0; 4]);
    assert_eq!(one("10:k", "line10.k"), [3.0; 4], "a parameter");
    assert_eq!(one("10:u", "line10.u"), [0.0, 1.0, 0.0, 1.0], "a global");
    assert_eq!(one("20:Ci", "line20.Ci.diffuse.R"), [0.25; 4], "the weight of a closure");
}

#[test]
fn calls_are_told_apart() {
    let dir = tempfile::tempdir().unwrap();
    let all = tapped(
        dir.path(),
        &["--tap", "4:h", "--tap", "18/4:h", "--tap", "19/4:h", "--tap", "4:h@1", "--tap", "5:return"],
    );
    assert_eq!(channel(&all, "line4.h"), [1.5; 4], "the last call");
    assert_eq!(channel(&all, "call18.line4.h"), [5.0; 4]);
    assert_eq!(channel(&all, "call19.line4.h"), [1.5; 4]);
    assert_eq!(channel(&all, "line4.h.round1"), [5.0; 4]);
    assert_eq!(channel(&all, "line5.return"), [1.5; 4]);
}

#[test]
fn outputs_stay_and_are_shown_if_named() {
    let dir = tempfile::tempdir().unwrap();
    let image = tapped(dir.path(), &["--tap", "13:sum", "--outputs", "o"]);
    assert_eq!(channel(&image, "o"), [6.5; 4]);
    let image = tapped(dir.path(), &["--tap", "11:sum"]);
    assert_eq!(image.channels, ["line11.sum"], "without conditions there is no mask");
    let on = tapped(dir.path(), &["--tap", "11:sum", "--on", "sphere"]);
    assert!(on.channels.iter().any(|name| name == "line11.sum"));
}

#[test]
fn mistakes_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let shader = file(dir.path(), "s.osl", SHADER);
    let said = |tap: &str| {
        let (code, _, err) = oslrun(&[&shader, "--tap", tap]);
        assert_ne!(code, 0, "{tap}");
        err
    };
    assert!(said("13").contains("a tap is LINE:VARIABLE"));
    assert!(said("99:sum").contains("no statement on line 99; the nearest is on line 20"));
    assert!(said("7:sum").contains("the nearest are on lines 5 and 9"));
    assert!(said("13:smu").contains("line 13 knows no variable `smu`; did you mean `sum`?"));
    assert!(said("9:sum").contains("knows no variable `sum`"), "it is declared later");
    assert!(said("10:p.c").contains("`p` has no part `c`"));
    assert!(said("9:list[3]").contains("`list` has no part [3]"));
    assert!(said("x.h:1:a").contains("there is no file `x.h`"));
    assert!(said("77/4:h").contains("line 77"));
}

/// Elements of arrays within arrays have their own names and values in what looks into a run.
#[test]
fn arrays_within_arrays_are_looked_into() {
    let dir = tempfile::tempdir().unwrap();
    let text = "struct S { float x; float w[2]; };\nfloat first(S s[2]) { return s[1].w[1]; }\nshader n(output float r = 0) {\n    \
                S h[2] = { { 1, { 2, 3 } }, { 4, { 5, u } } };\n    h[0].w[1] = 7 * v;\n    r = first(h);\n}\n";
    let name = file(dir.path(), "n.osl", text);
    let (code, out, err) = oslrun(&[&name, "-g", "1x1", "--tap", "5:h[0].w[1]", "--tap", "5:h[1].w"]);
    assert!(
        code == 0 && out.contains("line5.h.0.w.1: 3.5 to") && out.contains("line5.h.1.w[1]: 0.5 to"),
        "{out}{err}"
    );
    let (code, out, err) = oslrun(&["explain", &name, "-g", "2x2", "--at", "0,0"]);
    assert!(code == 0 && out.contains("h[1].w[0] = 5") && out.contains("h[0].w[1] = 0\n"), "{out}{err}");
    for command in ["bounds", "stability", "sanitize"] {
        let (code, out, err) = oslrun(&[command, &name, "-g", "2x2"]);
        assert_eq!(code, 0, "{command}: {out}{err}");
    }
    let (code, _, err) = oslrun(&["compile", &name]);
    assert!(code == 1 && err.contains("E0310"), "{err}");
}
