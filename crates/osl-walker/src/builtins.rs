//! The library: one table with the name and the definition of each function.
//!
//! Functions of floats also take triples, and work component by component; a float among triples stands for
//! three equal components. The definitions are in `math` and `strings`, or in the table itself where they
//! are short. Elementary functions come from osl-numeric and noise from osl-noise, as in the engine.
//!
//! ```
//! use osl_walker::printed;
//! assert_eq!(printed(r#"printf("%g %g", sqrt(-1), mod(-3, 2.0));"#), "0 1");
//! assert_eq!(printed(r#"printf("%g", max(color(1, 2, 3), 2));"#), "2 2 3");
//! ```

use crate::expressions::{Operand, is_literal};
use crate::math;
use crate::operators::is_partly_zero;
use crate::state::{Location, Stop, Walker, undefined, unsupported};
use crate::strings::{self, Flavour};
use crate::value::Value;
use Body::{Floats, Ints, One, Three, Two, Whole};
use osl_hir::hir::{BuiltinCall, ExprKind};
use osl_ir::types::Type;
use osl_noise::Kind;
use osl_numeric::{matrix, strict};
use osl_simd::Isa;

/// A call with evaluated arguments.
struct Call<'a> {
    name: &'static str,
    args: Vec<Value>,
    /// The locations of the arguments that are outputs.
    outputs: Vec<Option<Location>>,
    ret: Type,
    source: &'a BuiltinCall,
}

/// A definition.
enum Body {
    /// On ints; it is taken if all arguments are ints.
    Ints(fn(&[i32]) -> i32),
    /// On one float.
    One(fn(f32) -> f32),
    /// On two floats.
    Two(fn(f32, f32) -> f32),
    /// On three floats.
    Three(fn(f32, f32, f32) -> f32),
    /// On floats, with a result that may be undefined.
    Floats(fn(&[f32]) -> Result<f32, Stop>),
    /// On whole values, perhaps with an effect.
    Whole(fn(&mut Walker<'_>, &Call<'_>) -> Result<Value, Stop>),
}

/// The definition of each function.
const LIBRARY: &[(&str, Body)] = &[
    // Functions of one number.
    ("abs", Ints(|n| n[0].wrapping_abs())),
    ("abs", One(f32::abs)),
    ("fabs", Ints(|n| n[0].wrapping_abs())),
    ("fabs", One(f32::abs)),
    ("sign", One(math::sign)),
    ("floor", One(f32::floor)),
    ("ceil", One(f32::ceil)),
    ("trunc", One(f32::trunc)),
    // Halves are rounded away from zero.
    ("round", One(f32::round)),
    ("degrees", One(|x| x * 57.295_776)),
    ("radians", One(|x| x * 0.017_453_292)),
    ("sqrt", One(math::sqrt)),
    ("inversesqrt", One(math::inversesqrt)),
    ("cbrt", One(strict::cbrt)),
    ("cos", One(strict::cos)),
    ("sin", One(strict::sin)),
    ("tan", One(strict::tan)),
    ("acos", One(strict::acos)),
    ("asin", One(strict::asin)),
    ("atan", One(strict::atan)),
    ("cosh", One(strict::cosh)),
    ("sinh", One(strict::sinh)),
    ("tanh", One(strict::tanh)),
    ("exp", One(strict::exp)),
    ("exp2", One(strict::exp2)),
    ("expm1", One(strict::expm1)),
    ("log2", One(strict::log2)),
    ("log10", One(strict::log10)),
    ("logb", One(strict::logb)),
    ("erf", One(strict::erf)),
    ("erfc", One(strict::erfc)),
    ("isnan", Whole(|_, c| int(c.float(0).is_nan()))),
    ("isinf", Whole(|_, c| int(c.float(0).is_infinite()))),
    ("isfinite", Whole(|_, c| int(c.float(0).is_finite()))),
    // Functions of several numbers.
    ("atan2", Two(strict::atan2)),
    ("pow", Two(strict::pow)),
    ("log", Floats(math::log)),
    ("hypot", Floats(math::hypot)),
    ("mod", Ints(|n| math::int_modulo(n[0], n[1]))),
    ("mod", Whole(|_, c| c.remainder(|a, b, _| math::modulo(a, b)))),
    ("fmod", Whole(|_, c| c.remainder(math::fmod))),
    ("min", Ints(|n| n[0].min(n[1]))),
    ("min", Two(math::min)),
    ("max", Ints(|n| n[0].max(n[1]))),
    ("max", Two(math::max)),
    ("clamp", Ints(|n| n[0].min(n[2]).max(n[1]))),
    ("clamp", Three(math::clamp)),
    ("mix", Three(|a, b, t| a * (1.0 - t) + b * t)),
    // The second argument if the third is not 0.
    ("select", Three(|a, b, condition| if condition != 0.0 { b } else { a })),
    ("step", Two(math::step)),
    ("smoothstep", Three(math::smoothstep)),
    ("linearstep", Floats(|n| math::linearstep(n[0], n[1], n[2]))),
    // Vectors and matrices.
    ("dot", Whole(|_, c| float(math::dot(c.triple(0), c.triple(1))))),
    ("cross", Whole(|_, c| triple(math::cross(c.triple(0), c.triple(1))))),
    ("length", Whole(|_, c| float(math::length(c.triple(0))))),
    ("distance", Whole(|_, c| c.with(2, || float(math::distance(c.triple(0), c.triple(1)))))),
    ("normalize", Whole(|_, c| triple(math::normalize(c.triple(0))?))),
    ("faceforward", Whole(faceforward)),
    ("reflect", Whole(|_, c| triple(math::reflect(c.triple(0), c.triple(1))))),
    ("refract", Whole(|_, c| triple(math::refract(c.triple(0), c.triple(1), c.float(2))))),
    ("luminance", Whole(|_, c| float(math::luminance(c.triple(0))))),
    ("determinant", Whole(|_, c| float(matrix::determinant(c.args[0].matrix())))),
    ("transpose", Whole(|_, c| Ok(Value::Matrix(math::transpose(c.args[0].matrix()))))),
    ("arraylength", Whole(arraylength)),
    ("sincos", Whole(sincos)),
    // Noise.
    ("noise", Whole(|_, c| noise(Kind::UPerlin, c))),
    ("snoise", Whole(|_, c| noise(Kind::Perlin, c))),
    ("cellnoise", Whole(|_, c| noise(Kind::Cell, c))),
    ("hashnoise", Whole(|_, c| noise(Kind::Hash, c))),
    // Strings.
    ("concat", Whole(|_, c| strings::concat(&c.args))),
    ("strlen", Whole(|_, c| Ok(Value::Int(c.args[0].string().len() as i32)))),
    ("startswith", Whole(|_, c| int(c.args[0].string().starts_with(&*c.args[1].string())))),
    ("endswith", Whole(|_, c| int(c.args[0].string().ends_with(&*c.args[1].string())))),
    ("substr", Whole(|_, c| Ok(strings::substr(&c.args)))),
    ("getchar", Whole(|_, c| Ok(strings::getchar(&c.args)))),
    ("stoi", Whole(|_, c| strings::parsed(&c.args, false))),
    ("stof", Whole(|_, c| strings::parsed(&c.args, true))),
    ("format", Whole(|_, c| Ok(Value::String(strings::format(&c.args, c.flavour())?.into())))),
    // Effects.
    ("printf", Whole(printf)),
    ("error", Whole(report)),
    ("warning", Whole(report)),
    ("exit", Whole(|_, _| Err(Stop::Exit))),
];

/// Functions that give a NaN the sign of their argument, or change it: the sign of a NaN is unspecified, and
/// `printf` shows it.
const SHOW_SIGN: &[&str] = &["asin", "atan", "atan2", "cbrt", "erf", "erfc", "expm1", "pow", "sinh", "tanh"];

/// Whether the walker knows a function of the library.
pub fn knows(function: &str) -> bool {
    LIBRARY.iter().any(|(name, _)| *name == function)
}

impl Walker<'_> {
    /// Calls a function of the library.
    pub(crate) fn builtin(&mut self, call: &BuiltinCall) -> Result<Value, Stop> {
        let mut operands = Vec::new();
        let mut outputs = Vec::new();
        for (e, place) in call.args.iter().zip(&call.outputs) {
            // The indices of an output are evaluated once.
            let output = place.as_ref().map(|place| self.locate(place)).transpose()?;
            operands.push(match &output {
                Some(location) => Operand::Value(self.read(location)),
                None => self.operand(e)?,
            });
            outputs.push(output);
        }
        let args: Vec<Value> = operands.into_iter().map(|operand| self.value_of(operand)).collect();
        let ret = call.row.signatures()[call.overload].ret;
        let call = Call { name: call.row.name, args, outputs, ret, source: call };
        let are_ints = call.args.iter().all(|a| matches!(a, Value::Int(_)));
        let is_row =
            |(name, body): &&(&str, Body)| *name == call.name && (are_ints || !matches!(body, Ints(_)));
        let (_, body) = LIBRARY.iter().find(is_row).ok_or(unsupported("this function"))?;
        let numbers = call.args.iter().filter(|a| matches!(a, Value::Float(_) | Value::Triple(_)));
        if SHOW_SIGN.contains(&call.name) && numbers.flat_map(Value::triple).any(f32::is_nan) {
            return Err(undefined("the sign of a NaN"));
        }
        match body {
            Ints(f) => Ok(Value::Int(f(&call.args.iter().map(Value::int).collect::<Vec<_>>()))),
            One(f) => call.each(|n| Ok(f(n[0]))),
            Two(f) => call.each(|n| Ok(f(n[0], n[1]))),
            Three(f) => call.each(|n| Ok(f(n[0], n[1], n[2]))),
            Floats(f) => call.each(f),
            Whole(f) => f(self, &call),
        }
    }
}

fn int(truth: bool) -> Result<Value, Stop> {
    Ok(Value::Int(truth.into()))
}

fn float(x: f32) -> Result<Value, Stop> {
    Ok(Value::Float(x))
}

fn triple(t: [f32; 3]) -> Result<Value, Stop> {
    Ok(Value::Triple(t))
}

impl Call<'_> {
    fn float(&self, at: usize) -> f32 {
        self.args.get(at).map_or(0.0, Value::float)
    }

    fn triple(&self, at: usize) -> [f32; 3] {
        self.args.get(at).map_or([0.0; 3], Value::triple)
    }

    /// A function of each component, or of the floats if no argument is a triple.
    fn each(&self, f: impl Fn(&[f32]) -> Result<f32, Stop>) -> Result<Value, Stop> {
        let component = |at: usize| f(&self.args.iter().map(|a| a.triple()[at]).collect::<Vec<_>>());
        if !self.args.iter().any(|a| matches!(a, Value::Triple(_))) {
            return float(component(0)?);
        }
        triple([component(0)?, component(1)?, component(2)?])
    }

    /// The remainder of a quotient; `f` is told whether the divisor is a literal.
    fn remainder(&self, f: fn(f32, f32, bool) -> Result<f32, Stop>) -> Result<Value, Stop> {
        if is_partly_zero(self.triple(1)) {
            return Err(undefined("a remainder of triples by a divisor that is partly zero"));
        }
        let literal = self.source.args.last().is_some_and(is_literal);
        self.each(|n| f(n[0], n[1], literal))
    }

    /// The value of the signature with so many parameters.
    fn with(&self, count: usize, value: impl Fn() -> Result<Value, Stop>) -> Result<Value, Stop> {
        if self.args.len() == count { value() } else { Err(unsupported("this signature")) }
    }

    /// How `format` prints: a call with literals only is executed by the compiler.
    fn flavour(&self) -> Flavour {
        let is_written =
            |kind: &ExprKind| matches!(kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_));
        if self.source.args.iter().all(|e| is_written(&e.kind)) { Flavour::Folded } else { Flavour::Format }
    }
}

fn arraylength(_: &mut Walker<'_>, call: &Call<'_>) -> Result<Value, Stop> {
    match &call.args[0] {
        Value::Aggregate(elements) => Ok(Value::Int(elements.len() as i32)),
        _ => Err(undefined("the length of what is no array")),
    }
}

fn faceforward(_: &mut Walker<'_>, call: &Call<'_>) -> Result<Value, Stop> {
    call.with(3, || triple(math::faceforward(call.triple(0), call.triple(1), call.triple(2))))
}

fn sincos(walker: &mut Walker<'_>, call: &Call<'_>) -> Result<Value, Stop> {
    for (output, f) in call.outputs.iter().skip(1).zip([strict::sin, strict::cos]) {
        if let Some(location) = output {
            let value = match &call.args[0] {
                Value::Triple(t) => Value::Triple(t.map(f)),
                number => Value::Float(f(number.float())),
            };
            walker.write(location, value);
        }
    }
    Ok(Value::Void)
}

/// Noise of one to four coordinates, as one value or three.
fn noise(kind: Kind, call: &Call<'_>) -> Result<Value, Stop> {
    let mut coords: Vec<f32> = Vec::new();
    for arg in &call.args {
        match arg {
            Value::Triple(t) => coords.extend(t),
            Value::String(_) => return Err(unsupported("noise by name")),
            number => coords.push(number.float()),
        }
    }
    if coords.iter().any(|x| !x.is_finite()) {
        return Err(undefined("noise at infinity or NaN"));
    }
    let slices: Vec<&[f32]> = coords.chunks(1).collect();
    let (mut x, mut y, mut z) = ([0.0], [0.0], [0.0]);
    if call.ret == Type::FLOAT {
        osl_noise::eval(Isa::baseline(), kind, &slices, &mut x);
        return float(x[0]);
    }
    osl_noise::eval3(Isa::baseline(), kind, &slices, [&mut x, &mut y, &mut z]);
    triple([x[0], y[0], z[0]])
}

fn printf(walker: &mut Walker<'_>, call: &Call<'_>) -> Result<Value, Stop> {
    walker.printed += &strings::format(&call.args, Flavour::Print)?;
    Ok(Value::Void)
}

/// `error` and `warning`.
fn report(walker: &mut Walker<'_>, call: &Call<'_>) -> Result<Value, Stop> {
    let text = strings::format(&call.args, Flavour::Print)?;
    let shader = &walker.program.shader.name;
    walker.messages.insert(format!("Shader {} [{shader}]: {text}", call.name));
    Ok(Value::Void)
}
