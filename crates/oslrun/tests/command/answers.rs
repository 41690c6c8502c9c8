//! The first twelve questions of `docs/questions.md`, for shaders that are not in it. Each answer is checked
//! against something else: an inserted `printf`, a changed shader, a finite difference, or a number worked
//! out by hand.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const GRID: (usize, usize) = (16, 16);
/// The pixel that is asked for.
const AT: (usize, usize) = (5, 9);

/// A shader, and what is asked about it.
struct Subject {
    name: &'static str,
    /// A text, what a slip makes of it, and the help of the message.
    slip: [&'static str; 3],
    /// A call of an overloaded function, the same with its type, and the form.
    call: [&'static str; 3],
    /// A variable, and the statement after which it has its value.
    value: [&'static str; 2],
    /// A condition, the statement that it decides, and the same with a place for more.
    branch: [&'static str; 3],
    /// A noise field, with its range.
    field: (&'static str, [f64; 2]),
    /// What the matrix of [`SPACE`] makes of a triple.
    space: [&'static str; 2],
    /// A smooth variable.
    smooth: &'static str,
    /// A variable whose derivative is not the one of mathematics, why, and the factor between them.
    strange: Option<(&'static str, &'static str, f64)>,
    /// An output that is asked for alone, and variables that it does not need.
    alone: (&'static str, &'static [&'static str]),
    /// All outputs that are no closures.
    values: &'static str,
    /// The most expensive text of them, and a cheap one for it.
    dear: [&'static str; 2],
    /// A statement, and a line after it that loses digits.
    lossy: [&'static str; 2],
    /// A statement, a line after it with an event, and the condition of the event.
    event: [&'static str; 3],
    /// An output for which samples are counted.
    sampled: &'static str,
}

const SPACE: &str = "2,0,0,0,0,0.5,0,0,0,0,1,0,5,0,0,1";

const SUBJECTS: [Subject; 3] = [
    Subject {
        name: "wall",
        slip: ["height = brick;", "height = brik;", "brick"],
        call: [
            "noise(\"simplex\", 40 * P)",
            "(float)noise(\"simplex\", 40 * P)",
            "float noise(string noisetype, point p",
        ],
        value: ["brick", "float brick = across * along;"],
        branch: ["row % 2 == 1", "        x += 0.5;", "{ x += 0.5;@ }"],
        field: ("simplex", [-1.0, 1.0]),
        space: ["a normal: by the transposed inverse of the matrix", "= (0.15 0 1)"],
        smooth: "y",
        strange: Some(("clay", "a color in a named space has no derivative", 0.0)),
        alone: ("height", &["clay", "tint", "up", "slope", "grit"]),
        values: "height,tint",
        dear: ["cellnoise(floor(x), row)", "0.5"],
        lossy: ["float y = v * rows;", "y = (y + 90000) - 90000;"],
        event: ["float brick = across * along;", "brick += 0 * sqrt(along - 0.5);", "along < 0.5"],
        sampled: "height",
    },
    Subject {
        name: "paint",
        slip: ["shine > amount", "shine > amoun", "amount"],
        call: [
            "noise(\"perlin\", 6 * P)",
            "(float)noise(\"perlin\", 6 * P)",
            "float noise(string noisetype, point p",
        ],
        value: ["coat", "float coat = pow(1 - 0.5 * u, 5);"],
        branch: [
            "shine > amount",
            "            glitter += shine / (i + 1);",
            "{ glitter += shine / (i + 1);@ }",
        ],
        field: ("cell", [0.0, 1.0]),
        space: ["a point: with the translation of the matrix", "= (7 1 3)"],
        smooth: "coat",
        strange: Some(("angle", "the sign of the derivative of `atan2` is reversed", -1.0)),
        alone: ("glitter", &["angle", "coat", "grime", "shade", "corner"]),
        values: "glitter,shade,angle",
        dear: ["(vector)noise(\"cell\", cell + 7)", "vector(0.1)"],
        lossy: ["float coat = pow(1 - 0.5 * u, 5);", "coat = (coat + 90000) - 90000;"],
        event: ["float coat = pow(1 - 0.5 * u, 5);", "coat += 0 * log(coat - 0.5);", "coat <= 0.5"],
        sampled: "shade",
    },
    Subject {
        name: "hills",
        slip: ["amplitude /= 2;", "amplitud /= 2;", "amplitude"],
        call: ["amplitude * noise(place)", "amplitude * (float)noise(place)", "float noise(point p)"],
        value: ["height", "height = spline(\"catmull-rom\", total, bands);"],
        branch: ["height < sea", "        height = sea + ripple;", "{ height = sea + ripple;@ }"],
        field: ("uperlin", [0.0, 1.0]),
        space: ["a vector: without the translation of the matrix", "= (2 0 0.5)"],
        smooth: "ripple",
        strange: None,
        alone: ("height", &["snow", "ground", "east", "wind"]),
        values: "height,ground,wind",
        dear: ["noise(place)", "place[0]"],
        lossy: ["height = spline(\"catmull-rom\", total, bands);", "height = (height + 90000) - 90000;"],
        event: ["height = spline(\"catmull-rom\", total, bands);", "height += 0 * asin(3 * u);", "3 * u > 1"],
        sampled: "height",
    },
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/questions")
}

fn oslrun(args: &[&str]) -> (i32, String, String) {
    let result = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (result.status.code().unwrap(), text(&result.stdout), text(&result.stderr))
}

impl Subject {
    fn text(&self) -> String {
        std::fs::read_to_string(folder().join(self.name).with_extension("osl")).unwrap()
    }

    fn file(&self) -> String {
        folder().join(self.name).with_extension("osl").display().to_string()
    }

    /// The text with one replacement, which must be possible.
    fn changed(&self, from: &str, to: &str) -> String {
        let text = self.text();
        assert!(text.contains(from), "{}: `{from}`", self.name);
        text.replacen(from, to, 1)
    }

    /// The line with a text.
    fn line(&self, text: &str) -> u64 {
        1 + self.text().lines().position(|line| line.contains(text)).unwrap() as u64
    }

    fn explained(&self, file: &str, more: &[&str]) -> Value {
        let (grid, at) = (format!("{}x{}", GRID.0, GRID.1), format!("{},{}", AT.0, AT.1));
        let args = ["explain", file, "-g", &grid, "--at", &at, "--json"];
        let (code, out, err) = oslrun(&[&args[..], more].concat());
        assert_eq!(code, 0, "{}: {err}", self.name);
        serde_json::from_str(&out).unwrap()
    }
}

/// A file with a text, for as long as the folder lives.
struct Written {
    _folder: tempfile::TempDir,
    file: String,
}

fn written(text: &str) -> Written {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.osl");
    std::fs::write(&path, text).unwrap();
    Written { file: path.display().to_string(), _folder: folder }
}

/// The ranges that a run prints for these outputs.
fn ranges(text: &str, outputs: &[&str]) -> String {
    let file = written(text);
    let mut args = vec![file.file.as_str(), "-g", "24x24"];
    let list = outputs.join(",");
    if !outputs.is_empty() {
        args.extend(["--outputs", list.as_str()]);
    }
    let (code, out, err) = oslrun(&args);
    assert_eq!(code, 0, "{err}\n{text}");
    out
}

fn facts<'a>(json: &'a Value, kind: &'a str) -> impl Iterator<Item = (u64, &'a Value)> {
    let lines = json["lines"].as_array().unwrap().iter();
    let of_line = move |line: &'a Value| {
        let number = line["number"].as_u64().unwrap();
        line["facts"].as_array().unwrap().iter().map(move |fact| (number, fact))
    };
    lines.flat_map(of_line).filter(move |(_, fact)| fact["fact"] == kind)
}

/// The last value of a variable of the shader itself.
fn set<'a>(json: &'a Value, name: &str) -> (u64, &'a Value) {
    facts(json, "set").filter(|(_, fact)| fact["name"] == name && fact["call"] == 0).last().unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().map(|x| x.as_f64().unwrap()).collect(),
        one => vec![one.as_f64().unwrap()],
    }
}

#[test]
fn an_error_has_its_place_and_its_repair() {
    for subject in &SUBJECTS {
        let [from, to, help] = subject.slip;
        let file = written(&subject.changed(from, to));
        let (code, out, err) = oslrun(&["check", &file.file]);
        let said = format!("{out}{err}");
        let place = format!("changed.osl:{}:", subject.line(from));
        assert!(code != 0 && said.contains(&place) && said.contains(&format!("`{help}`")), "{said}");
        let (_, _, json) = oslrun(&["check", &file.file, "--message-format", "json"]);
        let found: Value = serde_json::from_str(json.lines().next().unwrap()).unwrap();
        let edit = &found["fixes"][0]["edits"][0];
        let number = |key: &str| edit[key].as_u64().unwrap() as usize;
        let mut lines: Vec<String> =
            std::fs::read_to_string(&file.file).unwrap().lines().map(str::to_string).collect();
        let range = number("column") - 1..number("end_column") - 1;
        lines[number("line") - 1].replace_range(range, edit["text"].as_str().unwrap());
        assert_eq!(lines.join("\n") + "\n", subject.text(), "{}", subject.name);
    }
}

#[test]
fn the_overload_is_the_one_that_runs() {
    for subject in &SUBJECTS {
        let [call, same, form] = subject.call;
        let json = subject.explained(&subject.file(), &[]);
        let line = subject.line(call);
        // A call that does not run has no form; the parameters decide.
        let on = match subject.name {
            "wall" => subject.explained(&subject.file(), &["-p", "worn=1"]),
            "paint" => subject.explained(&subject.file(), &["-p", "layers=0"]),
            _ => json,
        };
        let found = facts(&on, "call")
            .find(|(at, fact)| *at == line && fact["form"].as_str().unwrap().starts_with(form));
        assert!(found.is_some(), "{}: {form}", subject.name);
        assert_eq!(ranges(&subject.text(), &[]), ranges(&subject.changed(call, same), &[]));
    }
}

#[test]
fn a_value_is_the_one_that_is_printed() {
    for subject in &SUBJECTS {
        let [name, after] = subject.value;
        let print = format!("{after} printf(\"@ %.9g\\n\", {name});");
        let file = written(&subject.changed(after, &print));
        let (_, out, err) = oslrun(&[&file.file, "-g", "16x16"]);
        let printed: Vec<&str> = out.lines().filter_map(|line| line.strip_prefix("@ ")).collect();
        assert_eq!(printed.len(), GRID.0 * GRID.1, "{err}");
        let printed: f32 = printed[AT.1 * GRID.0 + AT.0].parse().unwrap();
        let json = subject.explained(&subject.file(), &[]);
        let line = subject.line(after);
        let (_, fact) = facts(&json, "set").find(|(at, fact)| *at == line && fact["name"] == name).unwrap();
        assert_eq!(fact["values"][0]["value"].as_f64().unwrap() as f32, printed, "{}", subject.name);
    }
}

#[test]
fn branches_and_rounds_are_counted() {
    for subject in &SUBJECTS {
        let [condition, from, to] = subject.branch;
        let print = "printf(\"@ %d %d\\n\", int(u * 15 + 0.5), int(v * 15 + 0.5));";
        let file = written(&subject.changed(from, &to.replace('@', print)));
        let (_, out, _) = oslrun(&[&file.file, "-g", "16x16"]);
        for (x, y) in [AT, (11, 2), (3, 14)] {
            let times = out.lines().filter(|line| **line == format!("@ {x} {y}")).count();
            let at = format!("{x},{y}");
            let (_, json, _) = oslrun(&["explain", &subject.file(), "-g", "16x16", "--at", &at, "--json"]);
            let json: Value = serde_json::from_str(&json).unwrap();
            let (_, fact) = facts(&json, "branch").find(|(_, fact)| fact["condition"] == condition).unwrap();
            let taken = fact["taken"].as_array().unwrap().iter().filter(|truth| **truth == true).count();
            assert_eq!(taken, times, "{} at {at}", subject.name);
        }
    }
}

#[test]
fn a_noise_stays_in_its_range() {
    for subject in &SUBJECTS {
        let (field, [least, most]) = subject.field;
        let (_, doc, _) = oslrun(&["doc", "noise"]);
        let row = doc.lines().find(|line| line.trim().starts_with(&format!("\"{field}\""))).unwrap();
        assert!(row.contains(&format!("{least} to {most}")), "{row}");
        let text = format!("shader n(output float r = 0) {{ r = noise(\"{field}\", 40 * P); }}");
        let out = ranges(&text, &[]);
        let range = out.lines().find(|line| line.starts_with("r")).unwrap();
        let words: Vec<f64> = range.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
        let inside = words[0] >= least && words[1] <= most && words[1] - words[0] > 0.5 * (most - least);
        assert!(inside, "{range}");
    }
}

#[test]
fn transformations_are_those_of_the_matrix() {
    for subject in &SUBJECTS {
        let [how, result] = subject.space;
        let (_, out, err) = oslrun(&["explain", &subject.file(), "-g", "16x16", "--object-space", SPACE]);
        let line = out.lines().find(|line| line.contains("transform(\"object\"")).expect(&err);
        assert!(out.contains(how) && line.ends_with(result) || out.contains(&format!(") {result}")), "{out}");
    }
}

#[test]
fn derivatives_are_differences_or_have_a_reason() {
    let fine = |subject: &Subject, x: usize, name: &str, more: &[&str]| {
        let at = format!("{x},600");
        let args = ["explain", &subject.file(), "-g", "1024x1024", "--at", &at, "--json"];
        let (_, out, err) = oslrun(&[&args[..], more].concat());
        let json: Value = serde_json::from_str(&out).expect(&err);
        set(&json, name).1.clone()
    };
    for subject in &SUBJECTS {
        let compare = |name: &str, factor: f64| {
            let exact = |x| numbers(&fine(subject, x, name, &[])["values"][0]["exact"]);
            let (before, after) = (exact(399), exact(401));
            let fact = fine(subject, 400, name, &["--derivatives"]);
            let told = numbers(&fact["derivatives"][0]["dx"]);
            for (told, (before, after)) in told.iter().zip(before.iter().zip(after)) {
                let difference = factor * (after - before) / 2.0;
                let close = (told - difference).abs() <= 0.01 * difference.abs() + 1e-9;
                assert!(close, "{}: {name}: {told}, not {difference}", subject.name);
            }
            fact["derivatives"][0].clone()
        };
        assert_eq!(compare(subject.smooth, 1.0)["why"], Value::Null);
        if let Some((name, why, factor)) = subject.strange {
            let given = compare(name, factor);
            assert!(given["why"][0].as_str().unwrap().contains(why), "{given}");
            let text = oslrun(&["explain", &subject.file(), "-g", "16x16", "--derivatives"]).1;
            assert!(text.contains(why), "{text}");
        }
    }
}

#[test]
fn what_is_thrown_away_may_have_any_value() {
    for subject in &SUBJECTS {
        let (output, needless) = subject.alone;
        let json = subject.explained(&subject.file(), &["--outputs", output]);
        let before = ranges(&subject.text(), &[output]);
        let mut needed: BTreeMap<bool, Vec<String>> = BTreeMap::new();
        for line in json["lines"].as_array().unwrap() {
            let text = line["text"].as_str().unwrap();
            let facts: Vec<&Value> =
                line["facts"].as_array().unwrap().iter().filter(|f| f["fact"] == "set").collect();
            let [fact] = facts[..] else { continue };
            let name = fact["name"].as_str().unwrap();
            let types = ["float ", "color ", "point ", "vector ", "normal "];
            let starts = types.iter().any(|ty| text.starts_with(&format!("{ty}{name} =")));
            if !starts || fact["call"] != 0 || !text.ends_with(';') {
                continue;
            }
            let is_needed = line["state"] == "runs";
            assert!(is_needed || line["why"].as_str().unwrap().contains(output), "{line}");
            let change = format!("{text} {name} = {name} * -3 + 17.25;");
            let after = ranges(&subject.changed(text, &change), &[output]);
            assert_eq!(before != after, is_needed, "{}: {text}", subject.name);
            needed.entry(is_needed).or_default().push(name.to_string());
        }
        for name in needless {
            let states: Vec<&Value> = json["lines"]
                .as_array()
                .unwrap()
                .iter()
                .filter(|line| line["text"].as_str().unwrap().contains(&format!("{name} =")))
                .map(|line| &line["state"])
                .collect();
            assert!(!states.is_empty() && states.iter().all(|state| **state != "runs"), "{name}: {states:?}");
        }
        assert!(needed.values().all(|names| !names.is_empty()) && needed.len() == 2, "{needed:?}");
    }
}

#[test]
fn the_most_expensive_line_is_the_one_whose_loss_saves_most() {
    for subject in &SUBJECTS {
        let (outputs, [dear, cheap]) = (subject.values, subject.dear);
        let costs = |text: &str| -> Value {
            let file = written(text);
            let (_, out, err) = oslrun(&["explain", &file.file, "--cost", "--json", "--outputs", outputs]);
            let json: Value = serde_json::from_str(&out).expect(&err);
            json[1]["lines"][0].clone()
        };
        let of = |line: &Value| (line["cost"].as_f64().unwrap(), line["share"].as_f64().unwrap());
        let line = costs(&subject.text());
        assert_eq!(line["number"], subject.line(dear), "{}: {line}", subject.name);
        let ((cost, share), (now, now_share)) = (of(&line), of(&costs(&subject.changed(dear, cheap))));
        let (before, after) = (cost / share, now / now_share);
        let saved = (before - after) / before;
        assert!((saved - share).abs() < 0.15, "{}: {share} of {before}, but {after} are left", subject.name);
    }
}

#[test]
fn lost_digits_are_blamed_on_their_line() {
    for subject in &SUBJECTS {
        let [after, lossy] = subject.lossy;
        let text = subject.changed(after, &format!("{after}\n    {lossy}"));
        let file = written(&text);
        let line = subject.line(after) + 1;
        let args = ["stability", &file.file, "--points", "16x16", "--no-params", "--budget", "600"];
        let (code, out, err) = oslrun(&args);
        let blamed = out.split("Lines to blame").nth(1).unwrap_or_default();
        // Another line may be to blame as well, such as a `floor` that jumps.
        let is_blamed = blamed
            .lines()
            .any(|text| text.contains(&format!("changed.osl:{line}:")) && text.contains("loses digits"));
        assert!(code == 0 && is_blamed, "{}: {out}{err}", subject.name);
        let json = subject.explained(&file.file, &[]);
        let (name, _) = lossy.split_once(' ').unwrap();
        let (_, fact) = facts(&json, "set").find(|(at, fact)| *at == line && fact["name"] == name).unwrap();
        let [value, exact] = ["value", "exact"].map(|key| fact["values"][0][key].as_f64().unwrap());
        assert!((value - exact).abs() > 1e-4 || value == exact, "{}: {value} {exact}", subject.name);
    }
}

#[test]
fn events_are_counted_where_they_happen() {
    for subject in &SUBJECTS {
        let [after, wrong, condition] = subject.event;
        let text = subject.changed(after, &format!("{after}\n    {wrong}"));
        let file = written(&text);
        let line = subject.line(after) + 1;
        let (code, out, err) = oslrun(&["sanitize", &file.file, "-g", "16x16", "--budget", "600"]);
        let head =
            out.lines().find(|text| text.contains(&format!("changed.osl:{line}:"))).unwrap_or_default();
        let print = format!("{after} if ({condition}) printf(\"@\\n\");");
        let counting = written(&subject.changed(after, &print));
        let (_, printed, _) = oslrun(&[&counting.file, "-g", "16x16"]);
        let count = printed.lines().filter(|line| *line == "@").count();
        let said =
            head.contains("outside of the domain") && head.contains(&format!("at {count} of 256 points"));
        assert!(count > 0 && said, "{}: {count}, {code}: {out}{err}", subject.name);
    }
}

#[test]
fn the_advised_samples_keep_the_bound() {
    for subject in &SUBJECTS {
        let name = subject.sampled;
        let args = ["tradeoff", &subject.file(), "--outputs", name, "-g", "8x8", "--budget", "30"];
        let (code, out, err) = oslrun(&args);
        assert_eq!(code, 0, "{}: {err}", subject.name);
        let advice = out.lines().find(|line| line.starts_with("For 5 %")).unwrap_or_else(|| panic!("{out}"));
        let bound: f64 = advice.split(['(', ')']).nth(1).unwrap().parse().unwrap();
        let option = |name: &str| Some(advice.split_once(name)?.1.split(['`', ' ', ',']).next()?.to_string());
        let Some(samples) = option("--samples ") else {
            assert!(
                advice.contains("--max-error") || advice.contains("no tried setting keeps it"),
                "{advice}"
            );
            continue;
        };
        let folder = tempfile::tempdir().unwrap();
        let [few, many] = ["few.exr", "many.exr"].map(|file| folder.path().join(file).display().to_string());
        for (samples, file) in [(&samples[..], &few), ("1024", &many)] {
            let args = [&subject.file(), "--outputs", name, "-g", "8x8", "--samples", samples, "-o", file];
            let (code, _, err) = oslrun(&args);
            assert_eq!(code, 0, "{err}");
        }
        let (_, out, err) = oslrun(&["compare", &few, &many, "--json"]);
        let json: Value = serde_json::from_str(&out).expect(&err);
        let largest = json["channels"][0]["largest"].as_f64().unwrap_or_else(|| panic!("{json:#}"));
        assert!(largest <= 1.5 * bound, "{}: {advice}: {largest}", subject.name);
    }
}
