//! The commands `oslrun explain` and `oslrun stability`.

use std::path::Path;
use std::process::Command;

/// The exit code, the standard output and the standard error.
fn oslrun(args: &[&str]) -> (i32, String, String) {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout), text(&result.stderr))
}

fn shader(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl").join(name).display().to_string()
}

#[test]
fn a_point_is_told_line_by_line() {
    let (code, out, err) = oslrun(&["explain", &shader("strips.osl"), "--at", "3,5", "-g", "16x16"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("at pixel (3, 5) of 16 by 16"), "{out}");
    assert!(out.contains("u = 0.2"), "{out}");
    let (_, by_uv, _) = oslrun(&["explain", &shader("strips.osl"), "--uv", "0.2,0.33", "-g", "16x16"]);
    assert_eq!(out, by_uv, "the same point");
}

#[test]
fn tools_get_json() {
    let (code, out, _) = oslrun(&["explain", &shader("flakes.osl"), "--at", "0,0", "-g", "8x8", "--json"]);
    assert_eq!(code, 0);
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(value["shader"], "flakes");
    assert!(value["lines"].as_array().unwrap().iter().any(|l| l["facts"].to_string().contains("rounds")));
}

#[test]
fn numbers_are_numbers_for_tools() {
    let args = ["explain", &shader("strips.osl"), "--at", "3,5", "-g", "16x16", "--json"];
    let value: serde_json::Value = serde_json::from_str(&oslrun(&args).1).unwrap();
    let output = &value["outputs"][0];
    assert_eq!(output[0], "UV");
    assert!(output[1]["value"].as_array().is_some_and(|t| t.len() == 3 && t[0].is_f64()), "{output}");
    assert!(value["calls"].as_array().is_some_and(|calls| calls.len() > 2));
}

#[test]
fn parts_of_an_explanation() {
    let strips = shader("strips.osl");
    let at = |more: &[&str]| {
        let mut args = vec!["explain", &strips, "--at", "3,5", "-g", "16x16"];
        args.extend(more);
        oslrun(&args)
    };
    let (_, var, _) = at(&["--var", "strip"]);
    assert!(var.contains("strip = 1") && !var.contains("strip_random"), "{var}");
    let (_, line, _) = at(&["--line", "70"]);
    assert!(line.contains("70 | int strip") && line.lines().count() < 12, "{line}");
    let (_, call, _) = at(&["--call", "1"]);
    assert!(call.contains("within_slot = ") && !call.contains("(call "), "{call}");
    let (_, own, _) = at(&["--depth", "0"]);
    assert!(own.contains("Fac = ") && !own.contains("float position"), "{own}");
    for wrong in [["--var", "nobody"], ["--line", "1"], ["--call", "99"]] {
        let (code, out, err) = at(&wrong);
        assert_eq!((code, out.as_str(), err.starts_with("error: ")), (1, "", true), "{err}");
    }
}

#[test]
fn variables_have_derivatives() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    let text = "shader s(output float r = 0) {\n    float x = u * 3;\n    r = x * x + 2 * v;\n}\n";
    std::fs::write(&file, text).unwrap();
    let file = file.display().to_string();
    let args = ["explain", &file, "--uv", "0.5,0.5", "-g", "3x3", "--derivatives"];
    let (code, out, err) = oslrun(&args);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("d/du = 3, d/dv = 0; to the next pixel 1.5 in x, 0 in y; through u"), "{out}");
    assert!(
        out.contains("d/du = 9, d/dv = 2; to the next pixel 4.5 in x, 1 in y; through v, x (line 2)"),
        "{out}"
    );
    let (_, json, _) = oslrun(&[&args[..], &["--json"]].concat());
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json.contains("derivatives"), "{value}");
}

const REPORTING: &str =
    "shader s(string Filename = \"\", string Other = \"none.png\", string Space = \"nowhere\",
    output float r = 0, output color c = 0, output point p = 0)
{
    float pal[5] = { 1, 2, 3, 4, 5 };
    int i = int(u * 10) + 5;
    r = pal[i];
    c = texture(Filename, u, v);
    c += texture(Other, u, v);
    p = transform(Space, P);
    p += transform(\"common\", \"elsewhere\", P);
    if (u < 2)
        error(\"u is %g\", u);
    warning(\"row %g\", v);
    c = color(\"hsvv\", c[0], c[1], c[2]);
    r += noise(\"perlinn\", P);
}
";

/// Each message of a run of the point stands at its line, in the same words.
#[test]
fn what_a_run_reports_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    std::fs::write(&file, REPORTING).unwrap();
    let file = file.display().to_string();
    let (_, _, run) = oslrun(&[&file, "-g", "1x1"]);
    let (code, out, err) = oslrun(&["explain", &file, "-g", "1x1"]);
    assert_eq!(code, 0, "{err}");
    let (_, json, _) = oslrun(&["explain", &file, "-g", "1x1", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let mut count = 0;
    for said in run.lines().filter(|line| line.contains(", at 1 of 1 points")) {
        let (severity, rest) = said.split_once(": ").unwrap();
        let (line, rest) = rest.strip_prefix(&format!("{file}:")).unwrap().split_once(": ").unwrap();
        let (message, rest) = rest.split_once(", at 1 of 1 points, first at pixel (0, 0)").unwrap();
        let line: u64 = line.parse().unwrap();
        let mut below =
            out.lines().skip_while(|text| !text.trim().starts_with(&format!("{line} | "))).skip(1);
        let told = format!(":   {severity}: {message}{rest}");
        assert!(
            below.by_ref().take_while(|text| text.trim().starts_with(':')).any(|text| text.trim() == told),
            "{told}\n{out}"
        );
        let lines = json["lines"].as_array().unwrap();
        let reports = &lines.iter().find(|own| own["number"] == line).unwrap()["reports"];
        let has = reports
            .as_array()
            .unwrap()
            .iter()
            .any(|own| own["message"] == message && own["severity"] == severity);
        assert!(has, "{reports}");
        count += 1;
    }
    assert_eq!(count, 9, "{run}");
    assert!(!out.contains("with the translation of the matrix"), "{out}");
}

#[test]
fn names_arrays_and_large_numbers_are_those_of_the_source() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    let text = "struct Layer { color albedo; float w[2]; };
struct Stack { Layer layers[3]; float k; };
float two(vector a, float b) { return a[0] + b; }
float two(color a, float b) { return a[0] - b; }
shader s(output float r = 0, output color c = 0)
{
    float knots[5] = { 0, 0.5, 1, 0.5, 0 };
    r = spline(\"catmull-rom\", 0.47, knots);
    float big = 1000000.625;
    Stack all[2];
    all[1].layers[2].albedo = color(u, v, 0);
    all[1].layers[2].w[1] = 3;
    Stack s = all[1];
    s.layers[1].albedo = 2;
    c = color(\"hsv\", u, v, 1) + s.layers[2].albedo * big * s.layers[2].w[1];
    r += two(N, 1);
    printf(\"%g\\n\", knots);
}
";
    std::fs::write(&file, text).unwrap();
    let (code, out, err) = oslrun(&["explain", &file.display().to_string(), "-g", "4x4"]);
    assert_eq!(code, 0, "{err}");
    for told in [
        "spline(\"catmull-rom\", 0.47, {0, …}) = ",
        "big = 1000001",
        "all[1].layers[2].albedo = (0.666667 0.666667 0)",
        "all[1].layers[2].w[1] = 3",
        "s.layers[1].albedo = (2 2 2)",
        "calls color color(string space, color C)\n",
        "color(\"hsv\", (0.666667 0.666667 1)) = ",
        "not float two(color a, float b): it would convert argument 1 from normal to color, which is further than to vector",
        "printf(\"%g\\n\", 0, 0.5, 1, 0.5, 0)",
    ] {
        assert!(out.contains(told), "{told}\n{out}");
    }
    assert!(!out.contains("in space") && !out.contains("layers.albedo"), "{out}");
}

/// Rounds of a loop differ in what the compiler makes of them, and a needed parameter may share a line with
/// an output that is not.
#[test]
fn each_round_has_its_status_and_each_value_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    let text = "shader s(float k = 2, output float r = 0, output float q = 0)
{
    for (int i = 0; i < 4; i++) {
        float a = noise(P * (i + k));
        if (i == 1)
            r = a;
        q += a;
    }
    for (int i = 0; i < 100; i++)
        r += u;
}
";
    std::fs::write(&file, text).unwrap();
    let args = ["explain", &file.display().to_string(), "-g", "4x4", "--outputs", "r"];
    let (_, out, _) = oslrun(&args);
    for told in [
        "q = 0 (not needed)",
        "not needed: the output `r` does not depend on `q`",
        "(values 1, 3 to 4 not needed)",
        "not needed: the output `r` does not depend on these values of `a`",
        "i = 0, 1, 2, 3, 4 (known when the shader is compiled)",
        "i = 0, 1, 2, 3, … 100 (101 values from 0 to 100)\n",
    ] {
        assert!(out.contains(told), "{told}\n{out}");
    }
    let (_, json, _) = oslrun(&[&args[..], &["--json"]].concat());
    assert!(json.contains("\"each\""), "{json}");
}

/// Where the language's derivative is not the one of mathematics, the reason is given; the variables that
/// contribute nothing are not named.
#[test]
fn derivatives_have_their_reasons() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    let text = "shader s(output float r = 0, output color c = 0)
{
    float wave = sin(6 * u);
    float s = sign(wave) * v;
    float a = atan2(v - 0.5, u - 0.5);
    float b = 2 * a;
    c = color(\"hsv\", wave, v, 1);
    float m = min(u + 1, v + 3);
    float f = floor(9.5 * u);
    float n = N[0];
    float d = Dx(wave) * v;
    float k = 3;
    color t = transformc(\"hsv\", \"rgb\", color(u, v, 1));
    r = s + b + m + f + n + d + k + t[0];
}
";
    std::fs::write(&file, text).unwrap();
    let args = ["explain", &file.display().to_string(), "-g", "256x256", "--at", "101,100", "--derivatives"];
    let (_, out, err) = oslrun(&args);
    let reversed =
        "as the language defines it: the sign of the derivative of `atan2` is reversed, as in the reference";
    for (line, told) in [
        (4, "in y; through v".to_string()),
        (5, format!("{reversed}; through u, v")),
        (6, format!("{reversed}; through a (line 5)")),
        (7, "derivative 0 in the language: a color in a named space has no derivative".to_string()),
        (8, "in y; through u".to_string()),
        (9, "derivative 0: it stays the same around this point".to_string()),
        (10, "derivative 0; through N, which has none".to_string()),
        (11, "as the language defines it: a derivative has none itself; through v".to_string()),
        (12, "derivative 0: a constant here".to_string()),
        (13, "in y; through u, v".to_string()),
    ] {
        let mut below =
            out.lines().skip_while(|text| !text.trim().starts_with(&format!("{line} | "))).skip(1);
        let found =
            below.by_ref().take_while(|text| text.trim().starts_with(':')).any(|text| text.ends_with(&told));
        assert!(found, "{line}: {told}\n{out}{err}");
    }
}

#[test]
fn a_pixel_of_a_surface() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    std::fs::write(&file, "shader s(output normal n = 0) { n = N; }").unwrap();
    let file = file.display().to_string();
    let (code, out, err) = oslrun(&["explain", &file, "--on", "sphere", "--at", "20,20", "-g", "40x40"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("on sphere") && !out.contains("n = (0 0 1)"), "{out}");
    for args in [["--on", "spere"], ["--on", "sphere"]] {
        let (code, _, err) = oslrun(&["explain", &file, args[0], args[1], "--at", "0,0", "-g", "40x40"]);
        assert_eq!((code, err.is_empty()), (1, false), "neither a surface, nor a pixel that shows it");
    }
}

#[test]
fn options_without_an_effect_are_refused() {
    let strips = shader("strips.osl");
    // Also with their default values.
    let of_a_picture = ["-o x.exr", "--compression zip16", "--signed", "--exposure 0", "--range 0,1"];
    let of_a_run = ["--samples 4", "--closures", "--arithmetic fast", "--prefilter", "--profile", "--stats"];
    for command in ["explain", "stability", "tradeoff"] {
        for more in of_a_picture.into_iter().chain(of_a_run) {
            let args: Vec<&str> = [command, &strips].into_iter().chain(more.split(' ')).collect();
            let (code, out, err) = oslrun(&args);
            assert_eq!((code, out.as_str()), (2, ""), "{more}");
            let option = if more.starts_with("-o") { "--output" } else { args[2] };
            assert!(err.contains(&format!("{option} has no effect")), "{more}: {err}");
        }
    }
    for (command, more) in
        [("explain", "--max-steps=5"), ("stability", "--on=sphere"), ("tradeoff", "--on=sphere")]
    {
        assert_eq!(oslrun(&[command, &strips, more]).0, 2, "{command} {more}");
    }
}

#[test]
fn a_point_that_is_not_there_is_an_error() {
    let (code, out, err) = oslrun(&["explain", &shader("flakes.osl"), "--at", "8,0", "-g", "8x8"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("8 by 8 points") && err.contains("the last is 7,7"), "{err}");
}

#[test]
fn costs_are_by_output() {
    let (code, out, err) = oslrun(&["explain", &shader("Cobbled.osl"), "--cost"]);
    assert_eq!((code, out.lines().count() > 3), (0, true), "{err}");
    assert!(out.contains("resultMask"), "{out}");
}

#[test]
fn stability_writes_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let [html, map] = ["r.html", "lost.exr"].map(|name| folder.path().join(name));
    let file = folder.path().join("s.osl");
    std::fs::write(&file, "shader s(output float r = 0) { r = cellnoise(u * 9) + noise(P * 4); }").unwrap();
    let [file, html_text, map_text] = [&file, &html, &map].map(|p| p.display().to_string());
    let (html_option, map_option) = (["--html", &html_text], ["--error-map", &map_text]);
    let args = ["stability", &file, "--points", "16x16", "--budget", "600"];
    let (code, out, err) = oslrun(&[&args[..], &html_option, &map_option].concat());
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("right for offset up to"), "{out}");
    assert!(std::fs::read_to_string(&html).unwrap().contains("Digits lost"));
    assert!(map.metadata().unwrap().len() > 100);
    let (_, out, _) = oslrun(&["stability", &file, "--points", "16x16", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(value["trials"][0]["setting"], "as_given");
}

#[test]
fn a_tolerance_is_a_number_above_0() {
    let (code, _, err) = oslrun(&["stability", &shader("strips.osl"), "--tolerance", "0"]);
    assert_eq!(code, 2);
    assert!(err.contains("--tolerance"), "{err}");
}

/// A folder with a shader whose cosine loses its digits.
fn pendulum() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    let text = "shader s(output float r = 0)\n{\n    float swing = 0.002 * u + 0.0005;\n    \
                r = 100000 * (1 - cos(swing));\n}\n";
    std::fs::write(&file, text).unwrap();
    (folder, file.display().to_string())
}

const FIX: [&str; 6] = ["--fix", "--points", "16x16", "--no-params", "--budget", "600"];

#[test]
fn stability_repairs_a_line() {
    let (folder, file) = pendulum();
    let before = std::fs::read_to_string(&file).unwrap();
    let fixed = folder.path().join("fixed.osl").display().to_string();
    let args: Vec<&str> = ["stability", &file, "--write", &fixed].into_iter().chain(FIX).collect();
    let (code, out, err) = oslrun(&args);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("half angle: ") && out.contains("+    float sine = sin(0.5 * swing);"), "{out}");
    assert!(err.contains("wrote"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), before);
    let (code, out, _) =
        oslrun(&["stability", &fixed, "--points", "16x16", "--no-params", "--budget", "600"]);
    assert_eq!(code, 0);
    assert!(out.contains("Nothing to blame."), "{out}");
    // Into its own file only if that is named.
    let args: Vec<&str> = ["stability", &file, "--write", &file].into_iter().chain(FIX).collect();
    assert_eq!(oslrun(&args).0, 0);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), std::fs::read_to_string(&fixed).unwrap());
    // Nothing is left to repair, and then nothing is written.
    let none = folder.path().join("none.osl").display().to_string();
    let args: Vec<&str> = ["stability", &file, "--write", &none].into_iter().chain(FIX).collect();
    let (code, out, err) = oslrun(&args);
    assert_eq!(code, 0);
    assert!(!out.contains("Repair (") && err.contains("not written"), "{out}{err}");
    assert!(!Path::new(&none).exists());
}

#[test]
fn a_repair_is_data_too() {
    let (_folder, file) = pendulum();
    let args: Vec<&str> = ["stability", &file, "--json"].into_iter().chain(FIX).collect();
    let (_, out, _) = oslrun(&args);
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    let repair = &value["repair"];
    assert_eq!(repair["steps"][0]["name"], "half angle");
    assert!(repair["diff"].as_str().unwrap().contains("(repaired)"));
    let error = |which: &serde_json::Value| which["largest"].as_f64().unwrap();
    assert!(error(&repair["before"]) > 10.0 * error(&repair["steps"][0]["errors"]));
}

#[test]
fn a_repair_does_no_harm_with_other_values() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sag.osl");
    // With a negative radius, the sum below the conjugate's bar cancels instead.
    let text = "shader sag(float radius = 60, output float r = 0)\n{\n    float x = 0.5 * u;\n    \
                r = 100 * (radius - sqrt(radius * radius - x * x)) + 0.1 * noise(4 * u, 4 * v);\n}\n";
    std::fs::write(&file, text).unwrap();
    let file = file.display().to_string();
    let name = |more: &[&str]| {
        let args = ["stability", &file, "--fix", "--json", "--points", "16x16", "--budget", "600"];
        let (_, out, err) = oslrun(&args.iter().chain(more).copied().collect::<Vec<&str>>());
        let value: serde_json::Value = serde_json::from_str(&out).expect(&err);
        value["repair"]["steps"][0]["name"].as_str().map(str::to_string)
    };
    assert_eq!(name(&["--no-params"]).as_deref(), Some("conjugate"));
    assert_eq!(name(&[]).as_deref(), Some("conjugate by sign"));
}

/// Looks for a repair of a shader and saves it: the exit code, the report, the messages, and the saved text.
fn saved(text: &str) -> (i32, String, String, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let [file, fixed] = ["s.osl", "fixed.osl"].map(|name| folder.path().join(name));
    std::fs::write(&file, text).unwrap();
    let [file, fixed] = [file, fixed].map(|path| path.display().to_string());
    let args = ["stability", &file, "--fix", "--write", &fixed, "--budget", "600"];
    let (code, out, err) = oslrun(&args);
    (code, out, err, std::fs::read_to_string(&fixed).ok())
}

/// The sum of the exponents leaves the power without the factor that kept the product finite.
#[test]
fn a_repair_makes_nothing_infinite() {
    let (code, out, err, text) = saved(
        "shader s(output float r = 0)\n{\n    float x = 55 + 10 * u;\n    float k = 60;\n    \
         r = pow(x, k) * exp(-x) / pow(60.0, k) * exp(60.0);\n}\n",
    );
    assert!(out.contains("No repair (as given)") && text.is_none(), "{out}{err}");
    assert_eq!(code, 0, "{err}");
}

/// An output that is wrong everywhere hides no harm to another one.
#[test]
fn a_repair_is_judged_by_each_output() {
    let shader = |more: &str, phase: &str| {
        format!(
            "shader s(float b = 2000, output float root = 0{more})\n{{\n    float c = 1 + u;\n    \
             float disc = b * b - 4 * c;\n    float r = (sqrt(disc) - b) / 2;\n    root = r * b;\n{phase}}}\n"
        )
    };
    let (code, out, err, text) = saved(&shader("", ""));
    assert_eq!(code, 0, "{out}{err}");
    assert!(text.is_some_and(|text| text.contains("b > 0 ? ")), "{out}");
    let (code, out, err, text) =
        saved(&shader(", output float phase = 0", "    phase = mod(r * b * 600, 1);\n"));
    match text {
        Some(text) => assert!(text.contains("b > 0 ? "), "{text}"),
        None => {
            assert!(code == 1 && err.contains("is not written: the repair makes points worse"), "{out}{err}")
        }
    }
}

/// A recurrence of J.-M. Muller: every arithmetic with rounding ends at 100, and the limit is 6.
#[test]
fn double_precision_is_not_always_the_truth() {
    let text = "shader s(float gain = 0.75, output float r = 0)\n{\n    float a = 2 + 0.0 * u;\n    \
                float b = -4;\n    for (int i = 0; i < 24; ++i) {\n        \
                float c = 111 - 1130 / b + 3000 / (a * b);\n        a = b;\n        b = c;\n    }\n    \
                r = gain * (b + 0.1 * u);\n}\n";
    let (code, out, err, saved) = saved(text);
    let says = "double precision is not enough here, so that these errors are not known: ";
    assert!(out.contains(says) && out.contains("s.osl:6, `") && !out.contains("Nothing to"), "{out}");
    assert!(code == 1 && saved.is_none() && err.contains("double precision is not enough"), "{err}");
    let folder = tempfile::tempdir().unwrap();
    let [file, page] = ["s.osl", "s.html"].map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&file, text).unwrap();
    let (_, out, err) = oslrun(&["stability", &file, "--json", "--html", &page, "--budget", "600"]);
    let json = out.lines().filter(|line| !line.starts_with("wrote ")).collect::<Vec<_>>().join("\n");
    let value: serde_json::Value = serde_json::from_str(&json).expect(&err);
    assert_eq!(value["not_enough"]["place"]["line"], 6, "{value}");
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.contains(&says[1..]) && !page.contains("Nothing to blame"), "{page}");
}

#[test]
fn a_repair_goes_through_functions_and_leaves_nothing_unused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("slope.osl");
    let text = "float ridge(float x)\n{\n    float s = sin(6.0 * x);\n    return 1.0 + 0.2 * s;\n}\n\
                shader slope(float h = 0.000002, output float r = 0)\n{\n    float here = ridge(u);\n    \
                float next = ridge(u + h);\n    r = (next - here) / h;\n}\n";
    std::fs::write(&file, text).unwrap();
    let fixed = folder.path().join("fixed.osl").display().to_string();
    let file = file.display().to_string();
    let args: Vec<&str> = ["stability", &file, "--write", &fixed].into_iter().chain(FIX).collect();
    let (code, out, err) = oslrun(&args);
    assert_eq!((code, out.contains("Repair (as given)")), (0, true), "{out}{err}");
    let text = std::fs::read_to_string(&fixed).unwrap();
    assert!(!text.contains("float here") && !text.contains("float next"), "{text}");
    // A function stays, since it may be there for other shaders.
    let (code, _, err) = oslrun(&["check", "--deny", "warnings", "-A", "unused-function", &fixed]);
    assert_eq!(code, 0, "{err}");
}

#[test]
fn a_repair_needs_a_source() {
    let (_folder, file) = pendulum();
    let (code, _, err) = oslrun(&["stability", &file, "--write", "x.osl"]);
    assert_eq!((code, err.contains("--fix or --repair")), (2, true), "{err}");
    let (code, _, err) = oslrun(&["stability", "--group", "shader s s;", "--fix"]);
    assert_eq!((code, err.contains("--fix is for the source")), (2, true), "{err}");
    let (code, _, err) = oslrun(&[&file, "--write", "x.osl", "-g", "2x2"]);
    assert_eq!((code, err.contains("--repair")), (2, true), "{err}");
}

#[test]
fn a_report_that_is_cut_short_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("long.osl");
    let text =
        "shader s(float a = 1, output float r = 0) { for (int i = 0; i < 20000; i++) r += sin(a * i + u); }";
    std::fs::write(&file, text).unwrap();
    let (code, out, err) = oslrun(&["stability", &file.display().to_string(), "--budget", "0.05"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("the time was over (--budget)") && out.contains("scale"), "{out}");
    let (code, out, err) = oslrun(&["stability", &file.display().to_string(), "--budget", "0.05", "--fix"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("time was over") && !out.contains("Nothing to"), "{out}");
}

/// A call that writes a part of an array leaves the rest: `split` with a limit.
#[test]
fn what_a_call_does_not_write_keeps_its_value() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s.osl");
    let text = "shader s(output string list[2] = { \"a b\", \"c\" }, output int k = 0) {\n    \
                for (int i = 0; i < 3; i++)\n        k = split(list[0], list, \"zz\", i);\n}\n";
    std::fs::write(&path, text).unwrap();
    let (code, out, err) = oslrun(&["explain", path.to_str().unwrap(), "-g", "2x2", "--at", "0,0"]);
    assert!(
        code == 0 && out.contains("list[1] = \"c\", 3 times") && out.contains("k = 0, 1, 1"),
        "{out}{err}"
    );
}
