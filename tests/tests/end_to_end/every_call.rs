//! Every built-in with every combination of extreme arguments, including derivatives: no panic, and the same
//! bits on every instruction set and for every batch size.

use osl_exec::{Frame, Isa, Native, RunOptions};
use osl_hir::builtins::{self, Builtin, ParamType, Signature, Tail};
use osl_ir::ir::Kind;
use osl_ir::passes;
use osl_ir::types::{Base, Extent, Type};
use osl_tests::points::Points;
use osl_tests::run;
use rayon::prelude::*;
use std::fmt::Write;

const FLOATS: [&str; 14] = [
    "0",
    "-0",
    "1",
    "-1",
    "0.5",
    "-2.5",
    "1e-45",
    "-1e-39",
    "3.4028235e38",
    "2147483648",
    "1e30",
    "inf",
    "-inf",
    "nan",
];
const TRIPLES: [&str; 12] = [
    "0 0 0",
    "-0 0 -0",
    "1 2 3",
    "0 0 1",
    "-0.3 0.7 -0.2",
    "1e-45 0 1e-30",
    "1e20 -1e20 1",
    "3e9 -3e9 0.5",
    "inf 0 0",
    "inf -inf 1",
    "nan 0 1",
    "nan nan nan",
];
const INTS: [&str; 7] = ["0", "1", "-1", "3", "100", "2147483647", "-2147483648"];
const STRINGS: [&str; 6] = ["", "a", "ab12 cd", "-17x", "1e99", "%d"];

/// Maximum number of points of a run: larger products are sampled.
const MOST: usize = 2_500;

/// Strings that a function knows, and one that it does not.
fn words(row: &Builtin) -> &'static [&'static str] {
    match row.name {
        "noise" => &["perlin", "uperlin", "simplex", "usimplex", "cell", "hash", "gabor"],
        "pnoise" => &["perlin", "uperlin", "cell", "hash", "gabor"],
        "transformc" | "color in space" => &["rgb", "hsv", "hsl", "YIQ", "XYZ", "xyY", "sRGB", "nowhere"],
        "spline" | "splineinverse" => {
            &["catmull-rom", "bezier", "bspline", "hermite", "linear", "constant", "another"]
        }
        "texture" | "environment" | "gettextureinfo" | "texture3d" => &["tex64.png", "missing.png"],
        "printf" | "format" | "error" | "warning" | "fprintf" => &["%g"],
        "setmessage" | "getmessage" => &["message"],
        "regex_search" | "regex_match" => &["", "a*b", "([0-9]+)", "("],
        name if name.contains("matrix") || name.contains("space") || name == "transform" => {
            &["common", "shader", "myspace", "nowhere"]
        }
        _ => &["", "camera", "u"],
    }
}

/// A call with its declarations, and the number of points for all combinations.
struct Call {
    text: String,
    points: usize,
}

/// Writes the shader of a call.
struct Writer {
    body: String,
    args: Vec<String>,
    points: usize,
}

impl Writer {
    /// An element of a list that the point's number chooses.
    fn pick(&mut self, list: &str, len: usize) -> String {
        let text = format!("{list}[at / {} % {len}]", self.points.min(1 << 23));
        self.points = self.points.saturating_mul(len);
        text
    }

    fn declare(&mut self, ty: &str, value: &str) -> String {
        let name = format!("x{}", self.args.len());
        let _ = writeln!(self.body, "{ty} {name} = {value};");
        name
    }

    fn array(&mut self, ty: &str, len: usize) -> String {
        let name = format!("x{}", self.args.len());
        let _ = writeln!(self.body, "{ty} {name}[{len}];");
        for element in 0..len {
            let value = match ty {
                "float" => format!("floats[(at + {}) % 14]", element * 5),
                "int" => format!("{element}"),
                "string" => "\"\"".to_string(),
                _ => format!("triples[(at + {}) % 12]", element * 5),
            };
            let _ = writeln!(self.body, "{name}[{element}] = {value};");
        }
        name
    }

    fn arg(&mut self, ty: Type, output: bool, literal: Option<&str>) -> String {
        let name = match ty.base {
            Base::Int => "int",
            Base::Float => "float",
            Base::Color => "color",
            Base::Point => "point",
            Base::Vector => "vector",
            Base::Normal => "normal",
            Base::Matrix => "matrix",
            Base::String => "string",
            _ => return "diffuse(N)".to_string(),
        };
        if ty.extent != Extent::One {
            return self.array(name, 5);
        }
        if output {
            let zero = if name == "string" { "\"\"" } else { "0" };
            return self.declare(name, zero);
        }
        let value = match name {
            "int" => self.pick("ints", INTS.len()),
            "float" => self.pick("floats", FLOATS.len()) + " + v",
            "string" => match literal {
                Some(literal) => return format!("\"{literal}\""),
                None => self.pick("strings", STRINGS.len()),
            },
            "matrix" => {
                let (a, b) = (self.pick("floats", FLOATS.len()), self.pick("floats", FLOATS.len()));
                format!("matrix({a}, {b}, 0, 0, 1, {a}, 0, 0, 0, 0, 1, {b}, 2, 0, {b}, {a})")
            }
            _ => format!("({name})({} + vector(P))", self.pick("triples", TRIPLES.len())),
        };
        self.declare(name, &value)
    }
}

/// The shader that calls a function by a signature with these strings; an empty list means varying ones.
fn call(row: &'static Builtin, signature: &'static Signature, literals: &[&str]) -> Call {
    let mut w = Writer { body: String::new(), args: Vec::new(), points: 1 };
    let mut literals = literals.iter().copied();
    for param in &signature.params {
        let arg = match param.ty {
            ParamType::Any { array: false } => w.arg(Type::FLOAT, param.output, None),
            ParamType::Any { array: true } => w.array("float", 2),
            ParamType::Of(ty) => {
                let literal = if ty == Type::STRING { literals.next() } else { None };
                w.arg(ty, param.output, literal)
            }
        };
        w.args.push(arg);
    }
    if signature.tail == Tail::Any {
        let arg = w.arg(Type::FLOAT, false, None);
        w.args.push(arg);
    }
    let name = match row.name.split_once(' ') {
        Some((name, _)) => {
            if let Some(last) =
                w.args.last_mut().filter(|_| signature.params.len() == 2 && row.name != "matrix from spaces")
            {
                *last = components(last, name);
            }
            name
        }
        None => row.name,
    };
    let call = format!("{name}({})", w.args.join(", "));
    let mut results = String::new();
    match signature.ret.base {
        Base::Void => {
            let _ = writeln!(w.body, "{call};");
        }
        Base::Closure => {
            let _ = writeln!(w.body, "Ci = {call};");
        }
        Base::String => {
            let _ = writeln!(w.body, "string s = {call}; i = hash(s);");
        }
        Base::Int => {
            let _ = writeln!(w.body, "i = {call};");
        }
        Base::Matrix => {
            let _ = writeln!(w.body, "m = {call};");
        }
        Base::Float => results.push_str("float"),
        _ => results.push_str("vector"),
    }
    if !results.is_empty() {
        let cast = if results == "vector" { "(vector)" } else { "" };
        let ty = if results == "vector" { shown(signature.ret) } else { "float" };
        let _ = writeln!(w.body, "{ty} y = {call}; r = {cast}y; dx = Dx({cast}y); dy = Dy({cast}y);");
    }
    outputs(&mut w, signature);
    let text = format!(
        "surface every_call(float floats[14] = {{0}}, vector triples[12] = {{0}}, int ints[7] = {{0}}, \
         string strings[6] = {{\"\"}}, output vector r = 0, output vector dx = 0, output vector dy = 0, \
         output int i = 0, output matrix m = 0, output vector o = 0, output vector d = 0)\n{{\nint at = (int)u;\n{}}}\n",
        w.body
    );
    Call { text, points: w.points }
}

/// The sum of the output arguments, with derivatives.
fn outputs(w: &mut Writer, signature: &Signature) {
    for (param, name) in signature.params.iter().zip(w.args.clone()) {
        let ParamType::Of(ty) = param.ty else { continue };
        if !param.output || ty.extent != Extent::One {
            continue;
        }
        if ty == Type::FLOAT || ty.is_triple() {
            let _ = writeln!(w.body, "o = o * 2 + (vector){name}; d = d * 2 + Dx((vector){name});");
        } else if ty == Type::MATRIX {
            let _ = writeln!(w.body, "m = {name};");
        }
    }
}

fn shown(ty: Type) -> &'static str {
    match ty.base {
        Base::Color => "color",
        Base::Point => "point",
        Base::Normal => "normal",
        _ => "vector",
    }
}

/// The numbers that a constructor takes in place of a value.
fn components(value: &str, ty: &str) -> String {
    let parts: Vec<String> = match ty {
        "matrix" => (0..16).map(|k| format!("{value}[{}][{}]", k / 4, k % 4)).collect(),
        _ => (0..3).map(|k| format!("{value}[{k}]")).collect(),
    };
    parts.join(", ")
}

/// All combinations of strings for a signature.
fn texts(row: &'static Builtin, signature: &Signature) -> Vec<Vec<&'static str>> {
    let is_text = |p: &&builtins::Param| p.ty == ParamType::Of(Type::STRING) && !p.output;
    let count = signature.params.iter().filter(is_text).count();
    let varying = ["concat", "strlen", "substr", "getchar", "startswith", "endswith", "stoi", "stof", "hash"];
    if varying.contains(&row.name) {
        return vec![Vec::new()];
    }
    let mut all: Vec<Vec<&str>> = vec![Vec::new()];
    for _ in 0..count {
        let longer = |list: Vec<&'static str>| {
            words(row).iter().map(move |w| list.iter().copied().chain([*w]).collect::<Vec<&str>>())
        };
        all = all.into_iter().flat_map(longer).collect();
    }
    if row.name.ends_with("message") {
        // Also names that differ from point to point.
        all.push(Vec::new());
    }
    all
}

/// All results of a run. All NaNs are equal: the bits of a NaN are not defined.
fn all_of(frame: &Frame) -> Vec<(String, Vec<u32>)> {
    let plain = |kind: Kind, word: u32| {
        if kind != Kind::Int && f32::from_bits(word).is_nan() { 0x7fc0_0000 } else { word }
    };
    let plane = |p: &osl_exec::Plane| {
        (format!("{}.{}", p.output, p.component), p.words.iter().map(|w| plain(p.kind, *w)).collect())
    };
    frame.planes.iter().map(plane).collect()
}

fn check(row: &'static Builtin, signature: &'static Signature, literals: &[&str]) -> Result<(), String> {
    let call = call(row, signature, literals);
    let params: Vec<(String, String)> = [
        ("floats", FLOATS.join(",")),
        ("triples", TRIPLES.join(" ").replace(' ', ",")),
        ("ints", INTS.join(",")),
        ("strings", STRINGS.join(",")),
    ]
    .map(|(name, text)| (name.to_string(), text))
    .to_vec();
    let options = passes::Options::default();
    let compiled = run::compile("every_call.osl", &call.text, &params, &options)
        .map_err(|e| format!("{e}\n{}", call.text))?;
    let all = call.points.min(1 << 23);
    // A step without common factors visits points in all directions of the product.
    let points = match all <= MOST {
        true => Points::new(all),
        false => Points { count: MOST, step: 7_919, modulus: all },
    };
    let mut first: Option<Vec<(String, Vec<u32>)>> = None;
    for isa in Isa::all() {
        for (batch, native) in [(256, Native::Never), (1, Native::Recurring), (1000, Native::Always)] {
            let options = RunOptions {
                isa,
                batch: Some(batch),
                native,
                tile: 1_900,
                closures: true,
                ..RunOptions::default()
            };
            let frame = osl_exec::run(&compiled.program, &run::services(), &points, &options, &|_| ())
                .map_err(|e| format!("{e}\n{}", call.text))?;
            let got = all_of(&frame);
            let expected = first.get_or_insert_with(|| got.clone());
            for ((name, want), (_, have)) in expected.iter().zip(&got) {
                if let Some(at) = want.iter().zip(have).position(|(a, b)| a != b) {
                    let number = at * points.step % points.modulus;
                    let (a, b) = (f32::from_bits(want[at]), f32::from_bits(have[at]));
                    let way = format!("{} with batches of {batch}", isa.name());
                    return Err(format!("{name} at {number}: {a:?}, but {b:?} on {way}\n{}", call.text));
                }
            }
        }
    }
    Ok(())
}

#[test]
fn every_built_in_is_the_same_everywhere() {
    let calls: Vec<(&Builtin, &Signature, Vec<&str>)> = builtins::all()
        // It would write files if the run allowed that.
        .filter(|row| row.name != "fprintf")
        .flat_map(|row| row.signatures().iter().map(move |s| (row, s)))
        .flat_map(|(row, s)| texts(row, s).into_iter().map(move |t| (row, s, t)))
        .collect();
    assert!(calls.len() > 1_000, "{}", calls.len());
    let wrong: Vec<String> = calls
        .par_iter()
        .filter_map(|(row, signature, literals)| {
            let checked = std::panic::catch_unwind(|| check(row, signature, literals));
            let why = checked.unwrap_or_else(|_| Err(format!("it panics with {literals:?}"))).err()?;
            Some(format!("{}: {why}", signature.show(row.name)))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {}\n{}", wrong.len(), calls.len(), wrong.join("\n"));
}
