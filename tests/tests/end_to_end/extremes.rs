//! Results of functions and operators at the edges of their domains: `data/extremes.txt`, computed in three
//! ways: at compile time, in a run with uniform values, and in a run with varying values, on every
//! instruction set.

use osl_exec::{Isa, Native, RunOptions};
use osl_ir::ir::Kind;
use osl_ir::passes::{self, Pass};
use osl_tests::points::Points;
use osl_tests::run;
use std::fmt::Write;

/// A value in the notation of the table: `3i`, `(0, 0, 1)` or `-1e-45`.
#[derive(Clone, Debug)]
struct Value {
    ty: &'static str,
    parts: Vec<f32>,
    /// For ints, which a float cannot hold exactly.
    int: i32,
}

impl Value {
    fn parse(text: &str) -> Value {
        let text = text.trim();
        if let Some(int) = text.strip_suffix('i') {
            return Value { ty: "int", parts: Vec::new(), int: int.parse().expect(text) };
        }
        let triple = text.strip_prefix('(').and_then(|t| t.strip_suffix(')'));
        let ty = if triple.is_some() { "vector" } else { "float" };
        let parts = triple.unwrap_or(text).split(',').map(|x| x.trim().parse().expect(text)).collect();
        Value { ty, parts, int: 0 }
    }

    /// As a parameter value.
    fn text(&self) -> String {
        let parts: Vec<String> = self.parts.iter().map(f32::to_string).collect();
        if self.ty == "int" { self.int.to_string() } else { parts.join(",") }
    }

    fn words(&self) -> Vec<u32> {
        if self.ty == "int" {
            vec![self.int as u32]
        } else {
            self.parts.iter().map(|x| x.to_bits()).collect()
        }
    }
}

/// A line of the table below the expression it belongs to.
struct Case {
    line: usize,
    expression: String,
    args: Vec<Value>,
    result: Value,
    /// The result for arguments that are known at compile time, if it is different.
    known: Option<Value>,
}

/// The table: expressions of a, b, c, d, each followed by indented lines of `arguments = result`, or of
/// arguments = result
/// | result of known arguments`. Arguments are separated by blanks.
fn table() -> Vec<Case> {
    let text = std::fs::read_to_string(run::root().join("tests/data/extremes.txt")).unwrap();
    let (mut expression, mut cases) = (String::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if !line.starts_with(' ') {
            expression = line.trim().to_string();
            continue;
        }
        let (args, result) = line.split_once('=').expect(line);
        let args = args.replace(", ", ",");
        let args = args.split_whitespace().map(Value::parse).collect();
        let (result, known) = match result.split_once('|') {
            Some((result, known)) => (result, Some(Value::parse(known))),
            None => (result, None),
        };
        let (expression, result) = (expression.clone(), Value::parse(result));
        cases.push(Case { line: index + 1, expression, args, result, known });
    }
    cases
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Folded,
    Uniform,
    Varying,
}

/// The shader of a case: parameters `pa`, `pb` … with the values, copied to `a`, `b` …
fn shader(case: &Case, form: Form) -> String {
    let mut text = String::from("shader extremes(");
    let names = || ["a", "b", "c", "d", "e"].into_iter().zip(&case.args);
    for (name, value) in names() {
        let _ = write!(text, "{} p{name} = 0, ", value.ty);
    }
    let _ = writeln!(text, "output {} r = 0) {{", case.result.ty);
    for (name, value) in names() {
        let _ = writeln!(text, "{} {name} = p{name};", value.ty);
        if form == Form::Varying {
            // Never true, but that is only known at each point.
            let _ = writeln!(text, "if (u > 1e6) {name} = 7;");
        }
    }
    let statement = if case.expression.contains("r =") { "" } else { "r = " };
    let _ = writeln!(text, "{statement}{};\n}}", case.expression);
    text
}

fn same(kind: Kind, expected: u32, got: u32) -> bool {
    let nan = |word| f32::from_bits(word).is_nan();
    expected == got || (kind != Kind::Int && nan(expected) && nan(got))
}

fn check(case: &Case, form: Form, wrong: &mut String) {
    let text = shader(case, form);
    let params: Vec<_> = ["pa", "pb", "pc", "pd", "pe"]
        .into_iter()
        .zip(&case.args)
        .map(|(name, value)| (name.to_string(), value.text()))
        .collect();
    let without = if form == Form::Uniform { vec![Pass::Fold] } else { Vec::new() };
    let points = Points::new(19);
    let options = passes::Options { without, ..passes::Options::default() };
    let compiled = match run::compile("extremes.osl", &text, &params, &options) {
        Ok(compiled) => compiled,
        Err(why) => {
            let _ = writeln!(wrong, "{}: {why}\n{text}", case.line);
            return;
        }
    };
    let expected = match form {
        Form::Varying => &case.result,
        Form::Folded | Form::Uniform => case.known.as_ref().unwrap_or(&case.result),
    };
    let mut found: Vec<String> = Vec::new();
    let ways = Isa::all().into_iter().flat_map(|isa| [(isa, Native::Never), (isa, Native::Always)]);
    for (isa, native) in ways {
        let options = RunOptions { isa, native, ..RunOptions::default() };
        let frame = osl_exec::run(&compiled.program, &run::services(), &points, &options, &|_| ()).unwrap();
        let got: Vec<u32> = frame.planes.iter().map(|p| p.words[0]).collect();
        let alike = frame.planes.iter().all(|p| p.words.iter().all(|w| *w == p.words[0]));
        let kind = frame.planes[0].kind;
        let right = expected.words().len() == got.len()
            && expected.words().iter().zip(&got).all(|(e, g)| same(kind, *e, *g));
        if !right || !alike {
            let shown: Vec<String> = match kind {
                Kind::Int => got.iter().map(|w| (*w as i32).to_string()).collect(),
                _ => got.iter().map(|w| format!("{:?}", f32::from_bits(*w))).collect(),
            };
            let spread = if alike { "" } else { ", and not the same at all points" };
            found.push(format!("{}{spread} ({})", shown.join(","), isa.name()));
        }
    }
    if !found.is_empty() {
        let args: Vec<String> = case.args.iter().map(Value::text).collect();
        let (expression, line, text) = (&case.expression, case.line, expected.text());
        let _ = writeln!(wrong, "{line}: {expression} of {args:?}: {found:?} rather than {text}, {form:?}");
    }
}

#[test]
fn every_line_holds_in_every_way() {
    let cases = table();
    assert!(cases.len() > 200, "{}", cases.len());
    let mut wrong = String::new();
    for case in &cases {
        for form in [Form::Folded, Form::Uniform, Form::Varying] {
            check(case, form, &mut wrong);
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// A varying value divided by a known number other than 0 is a plain quotient, with an exact remainder, as in
/// the reference.
#[test]
fn a_known_divisor_is_not_guarded() {
    let of = |expression: &str, value: &str| {
        let text =
            format!("shader s(float a = 0, output float r = 0) {{ float x = a + v; r = {expression}; }}");
        let params = [("a".to_string(), value.to_string())];
        let compiled = run::compile("s.osl", &text, &params, &passes::Options::default()).unwrap();
        let options = RunOptions::default();
        let frame = osl_exec::run(&compiled.program, &run::services(), &Points::new(3), &options, &|_| ());
        f32::from_bits(frame.unwrap().planes[0].words[0])
    };
    assert_eq!(of("x / 1e-10", "1e38"), f32::INFINITY);
    assert_eq!(of("x / 2", "inf"), f32::INFINITY);
    assert!(of("x / 2", "nan").is_nan());
    assert_eq!(of("x / 0", "1"), 0.0);
    assert_eq!(of("fmod(x, 3)", "1e30"), 1e30 % 3.0);
    assert_eq!(of("fmod(x, 0)", "1"), 0.0);
    assert_eq!(of("mod(x, 1e-10)", "1e38"), f32::NEG_INFINITY);
}
