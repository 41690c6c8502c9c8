//! Built-in functions by name. Elementary functions of one number, noise and the text of values come from the
//! libraries that recorded vectors check; everything else is the language's definition.

use super::expr::is_literal;
use super::{Stop, Value, Walker, math};
use osl_hir::hir::{BuiltinCall, ExprKind};
use osl_ir::ir::Const;
use osl_ir::text::{self, Flavour, TextFn};
use osl_ir::types::Type;
use osl_noise::Kind;
use osl_numeric::{matrix, strict};
use osl_simd::Isa;
use std::sync::Arc;

/// The functions that the walker knows.
pub const KNOWN: &[&str] = &[
    "abs",
    "acos",
    "arraylength",
    "asin",
    "atan",
    "atan2",
    "cbrt",
    "ceil",
    "cellnoise",
    "clamp",
    "concat",
    "cos",
    "cosh",
    "cross",
    "degrees",
    "determinant",
    "distance",
    "dot",
    "endswith",
    "erf",
    "erfc",
    "error",
    "exp",
    "exp2",
    "expm1",
    "fabs",
    "faceforward",
    "floor",
    "fmod",
    "format",
    "getchar",
    "hashnoise",
    "hypot",
    "isfinite",
    "isinf",
    "isnan",
    "length",
    "linearstep",
    "log",
    "log10",
    "log2",
    "logb",
    "luminance",
    "max",
    "min",
    "mix",
    "mod",
    "noise",
    "normalize",
    "pow",
    "printf",
    "radians",
    "reflect",
    "refract",
    "round",
    "select",
    "sign",
    "sin",
    "sincos",
    "sinh",
    "smoothstep",
    "snoise",
    "sqrt",
    "startswith",
    "step",
    "stof",
    "stoi",
    "strlen",
    "substr",
    "tan",
    "tanh",
    "transpose",
    "trunc",
    "warning",
    "inversesqrt",
    "exit",
];

impl Walker<'_> {
    pub(super) fn builtin(&mut self, call: &BuiltinCall) -> Result<Value, Stop> {
        let mut operands = Vec::new();
        let mut places = Vec::new();
        for (e, place) in call.args.iter().zip(&call.outputs) {
            match place {
                // The indices of an output are evaluated once.
                Some(place) => {
                    let spot = self.spot(place)?;
                    let held = self.read(&spot);
                    places.push(Some(spot));
                    operands.push(super::expr::Operand::Now(held));
                }
                None => {
                    places.push(None);
                    operands.push(self.operand(e)?);
                }
            }
        }
        let args: Vec<Value> = operands.into_iter().map(|o| self.settled(o)).collect();
        let literal = call.args.last().is_some_and(is_literal);
        match call.row.name {
            "exit" => return Err(Stop::Exit),
            "format"
                if call
                    .args
                    .iter()
                    .all(|e| matches!(e.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_))) =>
            {
                return Ok(Value::Text(formatted(&args, Flavour::Folded)?.into()));
            }
            "printf" => {
                let text = formatted(&args, Flavour::Print)?;
                self.outcome.printed += &text;
                return Ok(Value::Nothing);
            }
            "error" | "warning" => {
                let text = formatted(&args, Flavour::Print)?;
                let (kind, shader) = (call.row.name, &self.program.shader.name);
                self.outcome.messages.insert(format!("Shader {kind} [{shader}]: {text}"));
                return Ok(Value::Nothing);
            }
            "sincos" => {
                for (at, f) in [(1, strict::sin as fn(f32) -> f32), (2, strict::cos)] {
                    if let Some(Some(spot)) = places.get(at) {
                        let value = each(&args[0], f);
                        self.write(spot, value);
                    }
                }
                return Ok(Value::Nothing);
            }
            _ => {}
        }
        let ret = call.row.signatures()[call.overload].ret;
        function(call.row.name, ret, &args, literal)
    }
}

fn each(a: &Value, f: impl Fn(f32) -> f32) -> Value {
    match a {
        Value::Triple(t) => Value::Triple(t.map(f)),
        a => Value::Float(f(a.float())),
    }
}

/// A function of each component; a number next to triples is used for every component.
fn each_of(args: &[Value], f: impl Fn(&[f32]) -> Result<f32, Stop>) -> Result<Value, Stop> {
    if !args.iter().any(|a| matches!(a, Value::Triple(_))) {
        let numbers: Vec<f32> = args.iter().map(Value::float).collect();
        return Ok(Value::Float(f(&numbers)?));
    }
    let mut result = [0.0; 3];
    for (at, number) in result.iter_mut().enumerate() {
        let numbers: Vec<f32> = args.iter().map(|a| a.triple()[at]).collect();
        *number = f(&numbers)?;
    }
    Ok(Value::Triple(result))
}

/// Maximum length of a string in bytes, as in the usual limits.
const MAX_STRING: u64 = 1 << 20;

/// Functions whose result has the sign of their argument, also for NaN. The sign of a NaN is unspecified.
const SHOW_SIGN: &[&str] = &["asin", "atan", "atan2", "cbrt", "erf", "erfc", "expm1", "pow", "sinh", "tanh"];

fn function(name: &str, ret: Type, args: &[Value], literal: bool) -> Result<Value, Stop> {
    let a = args.first().unwrap_or(&Value::Nothing);
    let triple = |at: usize| args.get(at).map_or([0.0; 3], Value::triple);
    let ints = ret == Type::INT;
    let one = |f: fn(f32) -> f32| Ok(each(a, f));
    let two = |f: fn(f32, f32) -> f32| each_of(args, |n| Ok(f(n[0], n[1])));
    let three = |f: fn(f32, f32, f32) -> f32| each_of(args, |n| Ok(f(n[0], n[1], n[2])));
    let numbers = args.iter().filter(|a| matches!(a, Value::Float(_) | Value::Triple(_)));
    if SHOW_SIGN.contains(&name) && numbers.flat_map(Value::triple).any(f32::is_nan) {
        return Err(Stop::Open("the sign of a NaN"));
    }
    match name {
        "arraylength" => Ok(Value::Int(match a {
            Value::Many(elements) => elements.len() as i32,
            _ => 0,
        })),
        "degrees" => one(|x| x * 57.295_776),
        "radians" => one(|x| x * 0.017_453_292),
        "cos" => one(strict::cos),
        "sin" => one(strict::sin),
        "tan" => one(strict::tan),
        "acos" => one(strict::acos),
        "asin" => one(strict::asin),
        "atan" => one(strict::atan),
        "cosh" => one(strict::cosh),
        "sinh" => one(strict::sinh),
        "tanh" => one(strict::tanh),
        "exp" => one(strict::exp),
        "exp2" => one(strict::exp2),
        "expm1" => one(strict::expm1),
        "log2" => one(strict::log2),
        "log10" => one(strict::log10),
        "logb" => one(strict::logb),
        "cbrt" => one(strict::cbrt),
        "erf" => one(strict::erf),
        "erfc" => one(strict::erfc),
        "log" if args.len() == 1 => one(strict::log),
        "log" => each_of(args, |n| math::quotient(strict::log(n[0]), strict::log(n[1]), false)),
        "sqrt" => one(math::sqrt),
        "inversesqrt" => one(math::inversesqrt),
        "sign" => one(math::sign),
        "floor" => one(f32::floor),
        "ceil" => one(f32::ceil),
        "trunc" => one(f32::trunc),
        "round" => one(math::round),
        "atan2" => two(strict::atan2),
        "pow" => two(strict::pow),
        "hypot" => each_of(args, |n| {
            let squares = n.iter().map(|x| x * x).reduce(|sum, square| sum + square);
            Ok(math::sqrt(squares.unwrap_or(0.0)))
        }),
        "fmod" | "mod" if !ints && math::is_mixed(args[1].triple()) => {
            Err(Stop::Open("a triple of divisors with a zero"))
        }
        "fmod" => each_of(args, |n| math::fmod(n[0], n[1], literal)),
        "abs" | "fabs" if ints => Ok(Value::Int(a.int().wrapping_abs())),
        "abs" | "fabs" => one(f32::abs),
        "mod" if ints => {
            let (a, b) = (a.int(), args[1].int());
            let quotient = if b == 0 { 0 } else { a.wrapping_div(b) };
            Ok(Value::Int(a.wrapping_sub(b.wrapping_mul(quotient))))
        }
        "mod" => each_of(args, |n| math::modulo(n[0], n[1])),
        "min" if ints => Ok(Value::Int(a.int().min(args[1].int()))),
        "min" => two(math::min),
        "max" if ints => Ok(Value::Int(a.int().max(args[1].int()))),
        "max" => two(math::max),
        "clamp" if ints => Ok(Value::Int(a.int().min(args[2].int()).max(args[1].int()))),
        "clamp" => three(math::clamp),
        "mix" => three(math::mix),
        "select" => three(math::select),
        "step" => two(math::step),
        "smoothstep" => three(math::smoothstep),
        "linearstep" => each_of(args, |n| math::linearstep(n[0], n[1], n[2])),
        "isnan" => Ok(Value::Int(a.float().is_nan().into())),
        "isinf" => Ok(Value::Int(a.float().is_infinite().into())),
        "isfinite" => Ok(Value::Int(a.float().is_finite().into())),
        "dot" => Ok(Value::Float(math::dot(triple(0), triple(1)))),
        "cross" => Ok(Value::Triple(math::cross(triple(0), triple(1)))),
        "length" => Ok(Value::Float(math::length(triple(0)))),
        "distance" if args.len() == 2 => Ok(Value::Float(math::distance(triple(0), triple(1)))),
        "normalize" if math::dot(triple(0), triple(0)).is_nan() => Err(Stop::Open("the direction of a NaN")),
        "normalize" => Ok(Value::Triple(math::normalize(triple(0)))),
        "faceforward" if args.len() == 3 => {
            Ok(Value::Triple(math::faceforward(triple(0), triple(1), triple(2))))
        }
        "reflect" => Ok(Value::Triple(math::reflect(triple(0), triple(1)))),
        "refract" => Ok(Value::Triple(math::refract(triple(0), triple(1), args[2].float()))),
        "luminance" => Ok(Value::Float(math::luminance(triple(0)))),
        "determinant" => Ok(Value::Float(matrix::determinant(a.matrix()))),
        "transpose" => {
            let m = a.matrix();
            Ok(Value::Matrix(std::array::from_fn(|at| m[at % 4 * 4 + at / 4])))
        }
        "noise" | "snoise" | "cellnoise" | "hashnoise" => noise(name, ret, args),
        "format" => Ok(Value::Text(formatted(args, Flavour::Format)?.into())),
        _ => strings(name, args),
    }
}

fn strings(name: &str, args: &[Value]) -> Result<Value, Stop> {
    let function = match name {
        "concat" => {
            let text: String = args.iter().map(|a| a.text().to_string()).collect();
            // Programs may double strings; endless doubling is not worth the time.
            if text.len() > 10_000 {
                return Err(Stop::Open("a long string"));
            }
            return Ok(Value::Text(text.into()));
        }
        "strlen" => return Ok(Value::Int(args[0].text().len() as i32)),
        "startswith" => {
            return Ok(Value::Int(args[0].text().starts_with(&*args[1].text()).into()));
        }
        "endswith" => {
            return Ok(Value::Int(args[0].text().ends_with(&*args[1].text()).into()));
        }
        "getchar" => TextFn::Character,
        "stoi" => TextFn::ToInt,
        "stof" => TextFn::ToFloat,
        "substr" => {
            let (text, start) = (args[0].text(), args[1].int());
            let n = text.len() as i64;
            let start = i64::from(start);
            let start = (if start < 0 { start + n } else { start }).clamp(0, n);
            let most = args.get(2).map_or(n, |len| i64::from(len.int()));
            let end = start + most.clamp(0, n - start);
            return Ok(Value::Text(text[start as usize..end as usize].into()));
        }
        _ => return Err(Stop::Open("a function that the walker does not know")),
    };
    let consts: Vec<Const> = args.iter().flat_map(|a| consts(a).unwrap_or_default()).collect();
    Ok(match function.eval(&consts, MAX_STRING) {
        Const::Int(n) => Value::Int(n),
        Const::Float(x) => Value::Float(x),
        _ => Value::Nothing,
    })
}

fn consts(value: &Value) -> Option<Vec<Const>> {
    Some(match value {
        Value::Int(n) => vec![Const::Int(*n)],
        Value::Float(x) => vec![Const::Float(*x)],
        Value::Triple(t) => vec![Const::Triple(*t)],
        Value::Matrix(m) => vec![Const::Matrix(Box::new(*m))],
        Value::Text(text) => vec![Const::Str(text.clone())],
        Value::Many(elements) => elements.iter().map(consts).collect::<Option<Vec<_>>>()?.concat(),
        Value::Nothing => return None,
    })
}

fn formatted(args: &[Value], flavour: Flavour) -> Result<String, Stop> {
    let format: Arc<str> = args.first().map_or_else(|| "".into(), Value::text);
    let mut values = Vec::new();
    for arg in &args[1..] {
        values.push(text::Value::Consts(consts(arg).ok_or(Stop::Open("a closure"))?));
    }
    let text = text::format(&format, &values, flavour, MAX_STRING);
    if text.len() > 10_000 { Err(Stop::Open("a long string")) } else { Ok(text) }
}

/// Noise of one to four coordinates.
fn noise(name: &str, ret: Type, args: &[Value]) -> Result<Value, Stop> {
    let kind = match name {
        "noise" => Kind::UPerlin,
        "snoise" => Kind::Perlin,
        "cellnoise" => Kind::Cell,
        _ => Kind::Hash,
    };
    if args.iter().any(|a| matches!(a, Value::Text(_))) {
        return Err(Stop::Open("a noise by name"));
    }
    let mut coords: Vec<f32> = Vec::new();
    for arg in args {
        match arg {
            Value::Triple(t) => coords.extend(t),
            arg => coords.push(arg.float()),
        }
    }
    if coords.iter().any(|x| !x.is_finite()) {
        return Err(Stop::Open("noise of what is no number"));
    }
    let slices: Vec<&[f32]> = coords.chunks(1).collect();
    let (mut x, mut y, mut z) = ([0.0], [0.0], [0.0]);
    if ret == Type::FLOAT {
        osl_noise::eval(Isa::baseline(), kind, &slices, &mut x);
        return Ok(Value::Float(x[0]));
    }
    osl_noise::eval3(Isa::baseline(), kind, &slices, [&mut x, &mut y, &mut z]);
    Ok(Value::Triple([x[0], y[0], z[0]]))
}
