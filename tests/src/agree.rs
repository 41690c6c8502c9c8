//! Checks that the product agrees with the walker (crate osl-walker): at every point a program has the same
//! outputs, to the bit, the same printed text and the same errors and warnings, compiled from its source or
//! from the `.oso` that is written from it.

use crate::{laws, run};
use osl::stages;
use osl_exec::{Frame, RunOptions};
use osl_hir::hir::{Global, Program};
use osl_ir::ir::Kind;
use osl_ir::passes;
use osl_ir::types::{Base, Extent, Type};
use osl_lower::params::ParamValues;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_walker::{Outcome, Value};
use std::collections::{BTreeMap, BTreeSet};

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Both agree.
    Same,
    /// Nothing was compared, for this reason.
    Open(String),
}

/// Six points, some of them outside the unit square.
fn grid() -> Grid {
    Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(3, 2) }
}

/// The results at a point, in a form to compare: bits of each plane, and the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Seen {
    planes: BTreeMap<(String, usize), u32>,
    printed: String,
}

/// The text without the signs of NaN, which are unspecified.
fn unsigned(text: &str) -> String {
    text.replace("-nan", "nan").replace("-NaN", "NaN")
}

/// The value of a global on a grid of unit patches.
fn global(global: Global, [u, v]: [f32; 2]) -> Value {
    match global {
        Global::U => Value::Float(u),
        Global::V => Value::Float(v),
        Global::P => Value::Triple([u, v, 1.0]),
        Global::N | Global::Ng => Value::Triple([0.0, 0.0, 1.0]),
        Global::I => Value::Triple([0.0, 0.0, -1.0]),
        Global::DPdu => Value::Triple([1.0, 0.0, 0.0]),
        Global::DPdv => Value::Triple([0.0, 1.0, 0.0]),
        Global::Time | Global::Dtime => Value::Float(0.0),
        _ => Value::Triple([0.0; 3]),
    }
}

fn walked(program: &Program, outcome: &Outcome) -> Seen {
    let mut seen = Seen { printed: unsigned(&outcome.printed), ..Seen::default() };
    for (var, value) in &outcome.outputs {
        let var = &program.vars[var.0 as usize];
        seen.add(program, var.ty, var.name.to_string(), value);
    }
    seen
}

impl Seen {
    /// Adds the planes of an output: `a`, `s.m0`, `a[2]`; a field of an array of structs is `s.a[2]`.
    fn add(&mut self, program: &Program, ty: Type, name: String, value: &Value) {
        match (ty.base, ty.extent, value) {
            (Base::Struct(id), extent, Value::Aggregate(parts)) => {
                for (index, field) in program.structs.get(id).fields.iter().enumerate() {
                    let name = format!("{name}.{}", field.name);
                    if extent == Extent::One {
                        self.add(program, field.ty, name, &parts[index]);
                        continue;
                    }
                    let of = |element: &Value| match element {
                        Value::Aggregate(fields) => fields[index].clone(),
                        _ => Value::Void,
                    };
                    let values = Value::Aggregate(parts.iter().map(of).collect());
                    self.add(program, Type { extent, ..field.ty }, name, &values);
                }
            }
            (_, _, Value::Aggregate(elements)) => {
                for (index, element) in elements.iter().enumerate() {
                    self.put(&format!("{name}[{index}]"), element);
                }
            }
            (_, _, value) => self.put(&name, value),
        }
    }

    fn put(&mut self, name: &str, value: &Value) {
        for (component, word) in words(value).into_iter().enumerate() {
            self.planes.insert((name.to_string(), component), word);
        }
    }
}

/// The bits of a value in planes, with one bit pattern for all NaNs; none for strings.
fn words(value: &Value) -> Vec<u32> {
    let bits = |x: &f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
    match value {
        Value::Int(n) => vec![n.cast_unsigned()],
        Value::Float(x) => vec![bits(x)],
        Value::Triple(t) => t.iter().map(bits).collect(),
        Value::Matrix(m) => m.iter().map(bits).collect(),
        Value::String(_) | Value::Aggregate(_) | Value::Void => Vec::new(),
    }
}

/// The results of the product at each point, and its messages.
fn run(program: &Program, grid: &Grid) -> Result<(Vec<Seen>, BTreeSet<String>), String> {
    let body = osl_lower::lower(program, &ParamValues::default()).map_err(|e| format!("{e:?}"))?;
    let compiled = stages::finish(body, &passes::Options::default());
    let options = RunOptions { limits: run::steps(1 << 26), ..RunOptions::default() };
    let frame = osl_exec::run(&compiled.program, laws::services(), grid, &options, &|_| ());
    let frame = frame.map_err(|stop| format!("stopped: {stop}"))?;
    Ok((seen(&frame, grid.width * grid.height), said(&frame)))
}

fn seen(frame: &Frame, points: usize) -> Vec<Seen> {
    let mut all = vec![Seen::default(); points];
    for plane in frame.planes.iter().filter(|plane| plane.kind != Kind::Str) {
        for (point, word) in all.iter_mut().zip(&plane.words) {
            let nan = plane.kind != Kind::Int && f32::from_bits(*word).is_nan();
            let word = if nan { f32::NAN.to_bits() } else { *word };
            point.planes.insert((plane.output.to_string(), plane.component), word);
        }
    }
    for printed in &frame.printed {
        if let Some(point) = all.get_mut(printed.point) {
            point.printed += &unsigned(&printed.text);
        }
    }
    all
}

/// The messages without positions and names: a formal parameter may have the name of its argument.
fn said(frame: &Frame) -> BTreeSet<String> {
    let plain = |said: &osl_exec::Said| {
        let text = unsigned(&said.message.text);
        if let Some((head, rest)) = text.split_once(" out of range ")
            && let Some((_, range)) = rest.split_once("[0..")
            && let Some((last, _)) = range.split_once(']')
        {
            return format!("{head} out of range [0..{last}]");
        }
        text
    };
    crate::laws::told(frame).map(plain).collect()
}

fn compare(expected: &Seen, got: &Seen) -> Option<String> {
    let names: BTreeSet<&(String, usize)> = expected.planes.keys().chain(got.planes.keys()).collect();
    for name in names {
        let (walker, product) = (expected.planes.get(name), got.planes.get(name));
        if walker != product {
            let show = |word: Option<&u32>| {
                word.map_or("nothing".to_string(), |w| {
                    format!("{} = {w:#010x} = {}", *w as i32, f32::from_bits(*w))
                })
            };
            return Some(format!(
                "{}, {}: walker {}, product {}",
                name.0,
                name.1,
                show(walker),
                show(product)
            ));
        }
    }
    (expected.printed != got.printed)
        .then(|| format!("printed: walker {:?}, product {:?}", expected.printed, got.printed))
}

/// Compares the product with the walker at every point; through `.oso` too if that is asked for.
///
/// # Errors
/// The first difference, in words, or that the program does not compile.
pub fn hold(text: &str, through_oso: bool) -> Result<Verdict, String> {
    let checked = stages::check("generated.osl", text, &NoFiles, &Options::default());
    let Some(program) = checked.program else {
        return Ok(Verdict::Open(format!(
            "does not compile: {}",
            laws::lower(text).err().unwrap_or_default()
        )));
    };
    let grid = grid();
    let (mut expected, mut messages) = (Vec::new(), BTreeSet::new());
    for y in 0..grid.height {
        for x in 0..grid.width {
            let (u, v) = (grid.coordinate(0, x, grid.width), grid.coordinate(1, y, grid.height));
            match osl_walker::walk(&program, &|name| global(name, [u, v])) {
                Ok(outcome) => {
                    expected.push(walked(&program, &outcome));
                    messages.extend(outcome.messages.iter().map(|m| unsigned(m)));
                }
                Err(why) => return Ok(Verdict::Open(why.to_string())),
            }
        }
    }
    let mut programs = vec![("source", program.clone())];
    if through_oso {
        let written = osl_hir::oso::write(&program, &checked.sources, &Default::default())
            .map_err(|d| format!("cannot be written to .oso: {d:?}"))?;
        let read = osl_hir::oso::read("generated.oso", &written, &Default::default());
        let program =
            read.program.ok_or_else(|| format!("cannot be read from .oso: {:?}", read.diagnostics))?;
        programs.push((".oso", program));
    }
    for (from, program) in programs {
        let (got, said) = run(&program, &grid)?;
        for (point, (expected, got)) in expected.iter().zip(&got).enumerate() {
            if let Some(difference) = compare(expected, got) {
                return Err(format!("from {from}, point {point}: {difference}"));
            }
        }
        if messages != said {
            let only =
                |a: &BTreeSet<String>, b: &BTreeSet<String>| a.difference(b).cloned().collect::<Vec<_>>();
            let (walker, product) = (only(&messages, &said), only(&said, &messages));
            return Err(format!(
                "from {from}: only the walker says {walker:?}, only the product {product:?}"
            ));
        }
    }
    Ok(Verdict::Same)
}
