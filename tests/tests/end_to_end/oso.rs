//! Compiled shaders: those from the reference run like their sources, and those written here can be read
//! again.

use osl_exec::{Component, Param, RunOptions};
use osl_ir::ir::{Const, Kind};
use osl_tests::golden::{Golden, compare, ulps};
use osl_tests::run;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The files below a folder with an extension, in order.
pub(super) fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            found.extend(files(&entry, extension));
        } else if entry.extension().is_some_and(|e| e == extension) {
            found.push(entry);
        }
    }
    found.sort();
    found
}

pub(super) fn data(folder: &str) -> PathBuf {
    run::root().join("tests/data").join(folder)
}

/// Whether a value is near enough, by the rule of the source tests.
fn near(expected: f32, got: f32) -> bool {
    expected == got
        || (expected.is_nan() && got.is_nan())
        || (expected - got).abs() <= 1e-6
        || ulps(expected, got) <= 2
}

/// Runs a compiled shader of the reference under the conditions of a recorded run; returns the differences.
fn recorded(oso: &Path, csv: &Path, seed: bool) -> Vec<String> {
    let name = oso.file_name().unwrap().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(oso).unwrap();
    let mut golden = Golden::load(csv).unwrap();
    let frame = match run::like(&name, &text, &golden, &RunOptions::default()) {
        Ok((frame, _)) => frame,
        Err(e) => return vec![e],
    };
    let is_int = |output: &str| {
        let of = |p: &osl_exec::Plane| p.output.split('[').next() == Some(output) && p.kind == Kind::Int;
        frame.planes.iter().any(of)
    };
    if !seed {
        golden.untangle(is_int);
    }
    let unopt = csv.with_extension("").with_extension("unopt.csv");
    let mut other = Golden::load(&unopt).unwrap_or_default();
    other.untangle(is_int);
    let columns = run::columns(&frame);
    let mut wrong = Vec::new();
    for (column, expected) in golden.columns.iter().skip(2) {
        let Some((_, got)) = columns.iter().find(|(n, _)| n == column) else {
            wrong.push(format!("no column {column}"));
            continue;
        };
        if seed {
            let c = compare(expected, got, 1e-5);
            if c.total != expected.len() || c.within * 1000 < c.total * 999 {
                wrong.push(format!("{column}: {c:?}"));
            }
            continue;
        }
        let second = other.columns.iter().find(|(n, _)| n == column).map(|(_, v)| v);
        let fits = |e: &Vec<f32>| e.iter().zip(got).all(|(e, g)| near(*e, *g));
        if !fits(expected) && !second.is_some_and(fits) {
            let first = expected.iter().zip(got).enumerate().find(|(_, (e, g))| !near(**e, **g));
            wrong.push(format!("{column}: {first:?}"));
        }
    }
    wrong
}

/// The recorded runs for the source of a sample.
fn runs_of(sample: &Path) -> (Vec<PathBuf>, bool) {
    let stem = sample.file_stem().unwrap().to_string_lossy().into_owned();
    let (area, case) = stem.split_once("__").unwrap();
    if area == "seeds" {
        let prefix = format!("{}.", case.trim_end_matches(".repaired"));
        let mut all = files(&data("seeds"), "gz");
        all.retain(|p| p.file_name().unwrap().to_string_lossy().starts_with(&prefix));
        return (all, true);
    }
    let csv = data("values").join(area).join(format!("{case}.csv"));
    (vec![if csv.exists() { csv } else { csv.with_extension("csv.gz") }], false)
}

#[test]
fn samples_of_the_reference_run_as_recorded() {
    let samples = files(&data("oso"), "oso");
    assert_eq!(samples.len(), 83);
    let check = |sample: &PathBuf| {
        let (runs, seed) = runs_of(sample);
        assert!(!runs.is_empty(), "{}", sample.display());
        runs.iter().flat_map(|csv| recorded(sample, csv, seed)).collect::<Vec<String>>()
    };
    let outcomes: Vec<Vec<String>> = samples.par_iter().map(check).collect();
    let bad: Vec<String> = samples
        .iter()
        .zip(&outcomes)
        .filter(|(_, wrong)| !wrong.is_empty())
        .map(|(sample, wrong)| format!("{}: {}", sample.file_stem().unwrap().display(), wrong.join("\n  ")))
        .collect();
    assert!(bad.is_empty(), "{} of {}:\n{}", bad.len(), samples.len(), bad.join("\n"));
}

/// Parts of the results of a run, by name.
type Outcome = Vec<(String, String)>;

/// All results of a run, as text: bits of all planes, closures, printed text, messages.
fn outcome(frame: &osl_exec::Frame, sources: &osl_syntax::source::SourceMap) -> Outcome {
    let place = |span| sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut all = Vec::new();
    for (name, values) in run::columns(frame) {
        let bits: Vec<u32> = values.iter().map(|x| x.to_bits()).collect();
        all.push((name, format!("{bits:x?}")));
    }
    let printed: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    all.push(("printed".to_string(), printed));
    // A compiled shader knows the lines of its operations but not the columns, so equal messages of one line
    // may have another order.
    let mut said = frame.said(place);
    said.sort();
    all.push(("messages".to_string(), format!("{said:#?}")));
    let of_output = |closures: &osl_exec::Closures| {
        let point = |at: usize| closures.point(at).iter().map(as_compiled).collect::<Vec<_>>();
        let points = (0..closures.len()).map(point);
        format!("{}: {:?}", closures.output, points.collect::<Vec<_>>())
    };
    all.push(("closures".to_string(), frame.closures.iter().map(of_output).collect()));
    all
}

/// A component in the form that a compiled shader can represent. For a closure that only the renderer knows,
/// such a file does not tell where keywords begin: keys count as parameters before their values, which print
/// alike.
fn as_compiled(component: &Component) -> Component {
    let mut component = component.clone();
    let is_known = osl_hir::builtins::names().any(|name| name == &*component.name);
    let mut params = Vec::new();
    for param in component.params.iter().cloned() {
        let key = match param.key {
            Some(key) if !is_known => {
                params.push(Param {
                    key: None,
                    values: [Const::Str(key)].into_iter().collect(),
                    closure: Vec::new(),
                });
                None
            }
            key => key,
        };
        let closure = param.closure.iter().map(as_compiled).collect();
        params.push(Param { key, closure, ..param });
    }
    component.params = params.into();
    component
}

/// Compiles a source to text and runs both; returns the differences. `None` if the source is not accepted.
fn round_trip(source: &Path) -> Option<Vec<String>> {
    let name = source.file_name().unwrap().to_string_lossy().into_owned();
    round_trip_text(&name, &std::fs::read_to_string(source).unwrap())
}

fn round_trip_text(name: &str, text: &str) -> Option<Vec<String>> {
    round_trip_by(name, text, &|_| ())
}

/// The same; `plain` removes permitted differences from the results.
fn round_trip_by(name: &str, text: &str, plain: &dyn Fn(&mut Outcome)) -> Option<Vec<String>> {
    let checked = osl::stages::check(name, text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    let program = checked.program?;
    let written = match osl_hir::oso::write(&program, &checked.sources, &Default::default()) {
        Ok(written) => written,
        Err(list) => return Some(vec![format!("{list:?}")]),
    };
    let mut golden = Golden::conditions(text);
    golden.size = (golden.size.0.max(7), golden.size.1.max(5));
    let options = RunOptions { closures: true, ..RunOptions::default() };
    let mut expected = match run::like(name, text, &golden, &options) {
        Ok((frame, sources)) => outcome(&frame, &sources),
        // It is too large or does not end, and so is the compiled form.
        Err(why) => vec![("error".to_string(), why)],
    };
    let mut got = match run::like(&format!("{name}.oso"), &written, &golden, &options) {
        Ok((frame, sources)) => outcome(&frame, &sources),
        Err(why) if expected[0].0 == "error" => {
            vec![("error".to_string(), if why.is_empty() { why } else { expected[0].1.clone() })]
        }
        Err(why) => return Some(vec![format!("{why}\n{written}")]),
    };
    plain(&mut expected);
    plain(&mut got);
    let names = |list: &[(String, String)]| list.iter().map(|(n, _)| n.clone()).collect::<Vec<_>>();
    if names(&expected) != names(&got) {
        return Some(vec![format!("{:?} for {:?}", names(&got), names(&expected))]);
    }
    let differ = expected.iter().zip(&got).filter(|(e, g)| e != g);
    let short = |e: &str, g: &str| {
        let at = e.bytes().zip(g.bytes()).take_while(|(e, g)| e == g).count().saturating_sub(80);
        let part = |text: &str| text.chars().skip(at).take(300).collect::<String>();
        format!("{}\nfor {}", part(g), part(e))
    };
    Some(differ.map(|(e, g)| format!("{}: {}", e.0, short(&e.1, &g.1))).collect())
}

#[test]
fn what_is_written_comes_back() {
    let mut sources = files(&run::root().join("osl"), "osl");
    sources.extend(files(&run::root().join("tests/data"), "osl"));
    let outcomes: Vec<Option<Vec<String>>> = sources.par_iter().map(|s| round_trip(s)).collect();
    let accepted = outcomes.iter().flatten().count();
    let bad: Vec<String> = sources
        .iter()
        .zip(outcomes)
        .filter_map(|(source, wrong)| Some((source, wrong?)))
        .filter(|(_, wrong)| !wrong.is_empty())
        .map(|(source, wrong)| format!("{}:\n  {}", source.display(), wrong.join("\n  ")))
        .collect();
    println!("{accepted} sources accepted of {}", sources.len());
    assert!(bad.is_empty(), "{} of {accepted}:\n{}", bad.len(), bad.join("\n"));
    assert!(accepted > 500, "{accepted}");
}

/// The text that a source compiles to.
fn written(name: &str, text: &str) -> String {
    let checked = osl::stages::check(name, text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{name}: {:#?}", checked.diagnostics));
    osl_hir::oso::write(&program, &checked.sources, &Default::default()).unwrap()
}

/// Class, type, name, value, metadata and place in a struct of each parameter's line.
fn params(oso: &str) -> Vec<Vec<String>> {
    let is_param = |line: &&str| line.starts_with("param\t") || line.starts_with("oparam\t");
    let fields = |line: &str| {
        let keeps = |hint: &&str| {
            ["meta{", "mystruct", "struct", "initexpr"].iter().any(|kept| hint.starts_with(kept))
        };
        let (head, hints) = line.split_once('%').unwrap_or((line, ""));
        let mut all: Vec<String> = head.split('\t').map(|part| part.trim().to_string()).collect();
        all.extend(hints.split(" %").filter(keeps).map(|hint| hint.trim().to_string()));
        all
    };
    oso.lines().filter(is_param).map(fields).collect()
}

/// The source of a sample.
fn source_of(sample: &Path) -> PathBuf {
    let stem = sample.file_stem().unwrap().to_string_lossy().into_owned();
    let (area, case) = stem.split_once("__").unwrap();
    let inside = data("values").join(area).join(format!("{case}.osl"));
    if inside.exists() { inside } else { data("seeds").join(format!("{case}.osl")) }
}

#[test]
fn parameters_are_written_as_the_reference_writes_them() {
    let (mut compared, mut bad) = (0, Vec::new());
    let mut same_ops = 0;
    for sample in files(&data("oso"), "oso") {
        let source = source_of(&sample);
        let text = std::fs::read_to_string(&source).unwrap();
        let name = source.file_name().unwrap().to_string_lossy().into_owned();
        let (theirs, ours) = (std::fs::read_to_string(&sample).unwrap(), written(&name, &text));
        compared += 1;
        if params(&theirs) != params(&ours) {
            bad.push(format!("{name}: {:#?}\nfor {:#?}", params(&ours), params(&theirs)));
        }
        let ops = |text: &str| {
            let lines = text.lines().filter(|line| line.starts_with('\t'));
            lines.filter_map(|line| line.split_whitespace().next().map(str::to_string)).collect::<Vec<_>>()
        };
        same_ops += usize::from(ops(&theirs) == ops(&ours));
    }
    println!("{same_ops} of {compared} have the very operations of the reference");
    assert!(bad.is_empty(), "{} of {compared}:\n{}", bad.len(), bad.join("\n"));
    assert_eq!(compared, 83);
}

#[test]
fn every_function_of_the_library_comes_back() {
    let mut bad = Vec::new();
    let mut count = 0;
    for row in osl_hir::builtins::all() {
        let text = format!("surface example(output float result = 0) {{\n{}\n}}\n", row.example);
        if let Some(wrong) = round_trip_text("example.osl", &text) {
            count += 1;
            if !wrong.is_empty() {
                bad.push(format!("{}: {}", row.name, wrong.join("; ")));
            }
        }
    }
    assert!(bad.is_empty(), "{} of {count}:\n{}", bad.len(), bad.join("\n"));
    assert!(count > 150, "{count}");
}

#[test]
fn functions_that_are_written_out_keep_their_derivatives() {
    let text = "surface s(output float r[12] = {}, output vector w[4] = {}) {
        normal n = normalize(normal(u - 0.5, v + 0.1, 1)); vector i = normalize(vector(v, u * u, -1)); vector k = i;
        float x = hypot(u, v); r[0] = Dx(x); x = hypot(u, x, v); r[1] = Dy(x); x = mod(u * 7, v + 0.2); r[2] = Dx(x);
        x = log(u + 2, v + 3); r[3] = Dx(x) + Dy(x); r[4] = aastep(0.5, u); r[5] = aastep(v, u, 0.1);
        r[6] = aastep(0.3, v, -0.2, u); x = aastep(0.5, u, 0.1, 0.7); r[7] = Dx(x); r[8] = aastep(u, u);
        k = reflect(k, n); w[0] = Dx(k); k = refract(k, k, 1.5 + u); w[1] = Dx(k) + Dy(k); k = refract(i, -n, 0.7 * v); w[2] = k + Dy(k);
        k = faceforward(k, i); k = faceforward(n, k, i); w[3] = k + Dx(k); r[9] = iscameraray(); r[10] = mod(-7, 3);
        r[11] = strlen(concat(\"a\", \"bc\", format(\"%g\", u), \"d\")) + strlen(substr(\"abcdef\", -3)); }";
    assert_eq!(round_trip_text("written_out.osl", text), Some(Vec::new()));
}

#[test]
fn outputs_that_overlap_are_written_in_one_order_either_way() {
    let text = "shader s(output vector r = 7, output vector q[2] = { 1, 2 }, output float k = 0) {
        fresnel(vector(u, v, -1), normal(0.1, 0, 1), 1.5, r[1], r[2], r, r);
        fresnel(vector(u, v, -1), normal(0.1, 0, 1), 1.5, k, q[1][0], q[1], q[0]);
        sincos(u, q[0][1], k); }";
    assert_eq!(round_trip_text("overlap.osl", text), Some(Vec::new()));
}

#[test]
fn a_point_for_an_output_color_weights_a_closure_either_way() {
    let text =
        "void glow(output color a, output closure color c) { c = a * emission() + emission() * a; a = 2; }
        surface s(output point p = point(1, 2, 3)) { glow(p, Ci); }";
    assert_eq!(round_trip_text("weight.osl", text), Some(Vec::new()));
}

#[test]
fn mod_by_a_constant_has_no_guard_either_way() {
    let text = "shader s(output float r[4] = {}, output color c = 0, output int n[2] = {}) {
        r[0] = mod(1e38, 1e-3); r[1] = mod((1 + u) * 1e38, 1e-3); float x = 1e-3; r[2] = mod(v * 1e38 + 1e37, x);
        r[3] = mod(u * 1e38 + 1e37, v * 0 + 1e-3); c = mod(color(1e38, u, v), color(1e-3, 0, 0.3));
        n[0] = mod(-7, int(u * 0)); n[1] = mod(-7, 3); }";
    assert_eq!(round_trip_text("mod.osl", text), Some(Vec::new()));
}

#[test]
fn generated_programs_come_back() {
    let check = |seed: u64| {
        let bytes = osl_tests::generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100);
        let text = osl_tests::generate::program(&bytes);
        // A formal that refers to a variable is that variable, an element of an element has its own name, and
        // messages about indices contain these names.
        let unnamed = |outcome: &mut Outcome| {
            let named = |line: &str| match line.split_once(" out of range ") {
                Some((head, rest)) => format!("{head}{}", rest.trim_start_matches(|c| c != '[')),
                None => line.to_string(),
            };
            for (_, text) in outcome.iter_mut().filter(|(part, _)| part == "messages") {
                *text = text
                    .lines()
                    .map(named)
                    .collect::<std::collections::BTreeSet<String>>()
                    .into_iter()
                    .collect();
            }
        };
        let wrong = round_trip_by("generated.osl", &text, &unnamed)?;
        (!wrong.is_empty()).then(|| format!("{seed}: {}\n{text}", wrong.join("; ")))
    };
    let bad: Vec<String> = (0..600u64).into_par_iter().filter_map(check).collect();
    assert!(bad.is_empty(), "{} of 600:\n{}", bad.len(), bad[0]);
}

/// A file name cannot end its hint or its comment.
#[test]
fn names_of_files_are_read_again() {
    for name in ["a\"b.osl", "a\nend.osl", "a\\", "a}b.osl", "\"", "a\rb\tc.osl"] {
        let oso = written(name, "shader a(output float o = 0) { o = u; }");
        let again = osl::stages::check("a.oso", &oso, &osl_syntax::NoFiles, &osl_syntax::Options::default());
        assert_eq!(again.diagnostics, [], "{name:?}\n{oso}");
        assert!(again.program.is_some(), "{name:?}");
    }
}

/// A run time forgets the file and the line at the head of a section.
#[test]
fn each_section_begins_with_its_file_and_line() {
    let oso = written("a.osl", "shader a(float x = sqrt(u), output float o = 0) { o = x * v; }");
    let sections: Vec<&str> = oso.split("\ncode ").skip(1).collect();
    assert_eq!(sections.len(), 2, "{oso}");
    for section in sections {
        let first = section.lines().find(|line| line.starts_with('\t')).unwrap_or_default();
        assert!(first.contains("%filename{\"a.osl\"} %line{1}"), "{oso}");
    }
}

/// A name in quotes is read if it is one word, as it is written.
#[test]
fn names_of_shaders_are_words() {
    let read = |name: &str| {
        let oso =
            format!("OpenShadingLanguage 1.00\nshader {name}\noparam\tfloat\tr\t0\ncode ___main___\n\tend\n");
        let found = osl::stages::check("a.oso", &oso, &osl_syntax::NoFiles, &osl_syntax::Options::default());
        assert_eq!(found.program.is_some(), found.diagnostics.is_empty(), "{name}");
        found.program.is_some()
    };
    assert!(read("plain") && read("\"quoted\""));
    for name in ["\"two words\"", "\"20 $tmp18 \t%argrw{\"", "\"a#b\"", "\"\""] {
        assert!(!read(name), "{name}");
    }
}

/// A compiled shader may have parameters with the names that the writer gives to constants and temporaries.
#[test]
fn names_of_the_writer_may_be_taken() {
    let taken = "OpenShadingLanguage 1.00\nshader taken\nparam\tfloat\t$const1\t3\nparam\tfloat\t$tmp1\t4\n\
        oparam\tfloat\tr\t0\nglobal\tfloat\tu\nconst\tfloat\t$const2\t5\ntemp\tfloat\t$tmp2\n\
        code ___main___\n\tmul\t$tmp2 u $const1\n\tadd\t$tmp2 $tmp2 $tmp1\n\tmul\tr $tmp2 $const2\n\tend\n";
    assert_eq!(round_trip_text("taken.oso", taken), Some(Vec::new()));
}

#[test]
fn written_texts() {
    for case in [
        "loops/break_continue",
        "struct/params",
        "params/metadata_array",
        "params/closure_output",
        "logic/and_or_values",
        "deriv/arrays",
    ] {
        let path = data("values").join(format!("{case}.osl"));
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = written(&name, &std::fs::read_to_string(&path).unwrap());
        insta::assert_snapshot!(case.replace('/', "__"), text);
    }
}

/// Lines are removed, duplicated and exchanged, bytes overwritten: the result is read or refused, without a
/// panic.
#[test]
fn nothing_upsets_the_reader() {
    let samples = files(&data("oso"), "oso");
    samples.par_iter().enumerate().for_each(|(at, sample)| {
        let text = std::fs::read_to_string(sample).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let mut state = at as u64 + 1;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below.max(1)
        };
        for _ in 0..150 {
            let mut changed: Vec<String> = lines.iter().map(|l| (*l).to_string()).collect();
            for _ in 0..=random(3) {
                let (a, b) = (random(changed.len()), random(changed.len()));
                match random(5) {
                    0 => drop(changed.remove(a)),
                    1 => changed.swap(a, b),
                    2 => changed.insert(a, changed[b].clone()),
                    3 => {
                        // A word of one line replaces one of another line.
                        let word = changed[b].split_whitespace().nth(random(6)).unwrap_or("0").to_string();
                        let mut words: Vec<String> =
                            changed[a].split_inclusive(char::is_whitespace).map(str::to_string).collect();
                        if !words.is_empty() {
                            let place = random(words.len());
                            words[place] = format!("{word} ");
                        }
                        changed[a] = words.concat();
                    }
                    _ => {
                        let mut bytes = changed[a].clone().into_bytes();
                        if !bytes.is_empty() {
                            let place = random(bytes.len());
                            bytes[place] = b" \"%{},.$_-09az#\\"[random(16)];
                        }
                        changed[a] = String::from_utf8_lossy(&bytes).into_owned();
                    }
                }
            }
            let read = osl_hir::oso::read("changed.oso", &changed.join("\n"), &Default::default());
            assert_eq!(read.program.is_some(), read.diagnostics.is_empty());
            if let Some(program) = read.program {
                // A loop may have lost its end, so the shader is compiled, but not run.
                let _ = osl_lower::lower(&program, &osl_lower::params::ParamValues::default());
                let again = osl_hir::oso::write(&program, &read.sources, &Default::default()).unwrap();
                let third = osl_hir::oso::read("again.oso", &again, &Default::default());
                assert!(third.diagnostics.is_empty(), "{:#?}\n{again}", third.diagnostics);
            }
        }
    });
}
