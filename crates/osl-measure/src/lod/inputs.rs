//! What a shader's outputs depend on: the coordinate in which it repeats, the parameters whose values a mean
//! is made for, and inputs for which no mean can stand.

use crate::stability::fix::source::Source;
use crate::stability::fix::term::{binds, word};
use osl_hir::builtins::Emit;
use osl_hir::hir::{Expr, ExprKind, FunctionId, Global, Init, Program, Stmt, StmtKind, VarId, VarKind};
use osl_hir::lint::each_stmt;
use osl_ir::ir::Const;
use osl_ir::types::{Base, Extent, Type};
use std::collections::BTreeSet;

/// A value that was given for a parameter: its name and its elements.
pub type GivenParam = (String, Vec<Const>);

/// The coordinate whose filter width says how large a pixel is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Coordinate {
    /// A point: `P`, or a parameter that is made of P or of u and v.
    Point(String),
    /// `u` and `v`.
    Uv,
}

impl Coordinate {
    /// Its name in a sentence.
    pub(super) fn name(&self) -> &str {
        match self {
            Coordinate::Point(name) => name,
            Coordinate::Uv => "u and v",
        }
    }
}

/// The inputs of a shader.
#[derive(Clone, Debug)]
pub(super) struct Inputs {
    pub(super) coordinate: Coordinate,
    /// Conditions that hold if the parameters have the values of this run.
    pub(super) guards: Vec<String>,
    /// The globals that depend on the surface and the view instead of the coordinate.
    pub(super) turned: Vec<Global>,
    /// Whether a shader ends before its last statement: with `return` or `exit`.
    pub(super) leaves: bool,
}

/// Globals that are given random values, if a shader reads them.
const TURNED: [Global; 6] = [Global::N, Global::Ng, Global::I, Global::DPdu, Global::DPdv, Global::Time];

impl Inputs {
    /// Finds the inputs of a shader; an error says why no mean can stand for its outputs.
    pub(super) fn of(source: &Source<'_>, given: &[GivenParam]) -> Result<Inputs, String> {
        let program = source.program;
        let found = Reads::of(program);
        if let Some(call) = found.outside {
            return Err(format!(
                "the shader calls `{call}`, whose result depends on the object or the scene, so no mean of \
                 the outputs holds for all objects"
            ));
        }
        let set = program.vars.iter().enumerate().find(|(at, var)| {
            matches!(var.kind, VarKind::Global(_)) && source.writes(VarId(*at as u32)).next().is_some()
        });
        if let Some((_, var)) = set {
            return Err(format!("the shader sets `{}`; only output parameters can be replaced", var.name));
        }
        let mut globals = BTreeSet::new();
        let mut params = Vec::new();
        for var in &found.vars {
            match program.vars.get(var.0 as usize).map(|v| v.kind) {
                Some(VarKind::Global(global)) => {
                    globals.insert(global);
                }
                Some(VarKind::Param { index, output: false }) => params.push(index),
                _ => {}
            }
        }
        let known = [Global::P, Global::U, Global::V];
        if let Some(other) = globals.iter().find(|g| !known.contains(g) && !TURNED.contains(g)) {
            return Err(format!("the shader uses `{}`, for which no mean can stand", other.name()));
        }
        let is_given = |name: &str| given.iter().find(|(given, _)| given == name);
        let (mut guards, mut points) = (Vec::new(), Vec::new());
        for index in params {
            let Some(param) = program.shader.params.get(index as usize) else { continue };
            let Some(var) = program.vars.get(param.var.0 as usize) else { continue };
            if let Some((_, values)) = is_given(&var.name) {
                guards.extend(given_guard(&var.name, var.ty, values)?);
            } else if let Some(globals) = globals_of(program, &param.init) {
                // A point that is made of u alone has no size along the other axis.
                let has = |global: Global| globals.contains(&global);
                if var.ty.is_triple() && (has(Global::P) || has(Global::U) && has(Global::V)) {
                    points.push(var.name.to_string());
                }
            } else {
                guards.extend(default_guard(source, &var.name, var.ty, &param.init)?);
            }
        }
        let coordinate = match points.into_iter().next() {
            Some(name) => Coordinate::Point(name),
            None if globals.contains(&Global::P) => Coordinate::Point("P".to_string()),
            None if globals.contains(&Global::U) || globals.contains(&Global::V) => Coordinate::Uv,
            None => {
                return Err(
                    "the shader uses neither P nor u nor v, so it is the same at every footprint".to_string()
                );
            }
        };
        let turned = TURNED.into_iter().filter(|global| globals.contains(global)).collect();
        Ok(Inputs { coordinate, guards, turned, leaves: found.leaves })
    }
}

/// What the statements of a shader read and call.
#[derive(Default)]
struct Reads {
    vars: BTreeSet<VarId>,
    outside: Option<&'static str>,
    leaves: bool,
}

impl Reads {
    fn of(program: &Program) -> Reads {
        let mut found = Reads::default();
        let mut todo: Vec<&[Stmt]> = vec![&program.shader.body];
        let mut entered = BTreeSet::new();
        each_stmt(&program.shader.body, &mut |stmt| {
            found.leaves |= matches!(stmt.kind, StmtKind::Return(_));
        });
        while let Some(body) = todo.pop() {
            let mut calls: Vec<FunctionId> = Vec::new();
            each_stmt(body, &mut |stmt| {
                stmt.exprs().into_iter().for_each(|e| found.expr(e, &mut calls));
            });
            for call in calls {
                if entered.insert(call.0)
                    && let Some(function) = program.functions.get(call.0 as usize)
                {
                    todo.push(&function.body);
                }
            }
            // The defaults of parameters that are read are read too.
            let inits = program.shader.params.iter().filter(|p| found.vars.contains(&p.var));
            let mut calls = Vec::new();
            let mut more = Reads::default();
            inits.flat_map(|param| param.init.exprs()).for_each(|e| more.expr(e, &mut calls));
            found.outside = found.outside.or(more.outside);
            found.vars.extend(more.vars);
            for call in calls {
                if entered.insert(call.0)
                    && let Some(function) = program.functions.get(call.0 as usize)
                {
                    todo.push(&function.body);
                }
            }
        }
        found
    }

    fn expr(&mut self, e: &Expr, calls: &mut Vec<FunctionId>) {
        e.each(&mut |e| match &e.kind {
            ExprKind::Read(place) => {
                self.vars.insert(place.var);
            }
            ExprKind::Call(id, args) => {
                calls.push(*id);
                for arg in args {
                    if let osl_hir::hir::Arg::Alias(place) = arg {
                        self.vars.insert(place.var);
                    }
                }
            }
            ExprKind::Builtin(call) => {
                self.leaves |= matches!(call.row.emit, Emit::Exit);
                self.outside = self.outside.or(call.row.facts.scene.then_some(call.row.name));
            }
            _ => {}
        });
    }
}

/// The globals that a default reads; `None` if it reads none.
fn globals_of(program: &Program, init: &Init) -> Option<Vec<Global>> {
    let mut found = Vec::new();
    for e in init.exprs() {
        e.each(&mut |e| {
            if let ExprKind::Read(place) = &e.kind
                && let Some(VarKind::Global(global)) = program.vars.get(place.var.0 as usize).map(|v| v.kind)
            {
                found.push(global);
            }
        });
    }
    (!found.is_empty()).then_some(found)
}

/// The longest array whose elements are compared one by one.
const ARRAY: u32 = 16;

fn too_complex(name: &str) -> String {
    format!("the outputs depend on the parameter `{name}`, whose value cannot be compared in one expression")
}

/// Conditions that a parameter has its default.
fn default_guard(source: &Source<'_>, name: &str, ty: Type, init: &Init) -> Result<Vec<String>, String> {
    let one = |name: &str, init: &Init| {
        let Init::Value(e) = init else { return Err(too_complex(name)) };
        let (text, own) = source.reader.source(e).ok_or_else(|| too_complex(name))?;
        let is_whole = own >= binds::NEGATIVE || matches!(e.kind, ExprKind::Str(_));
        let text = if !is_whole { format!("({text})") } else { text };
        Ok(format!("{name} == {text}"))
    };
    let base = Type { extent: Extent::One, ..ty };
    if word(base).is_none() && ty.base != Base::String && ty.base != Base::Int {
        return Err(too_complex(name));
    }
    match (ty.extent, init) {
        (Extent::One, init) => Ok(vec![one(name, init)?]),
        (Extent::Array(n), Init::List(items)) if n <= ARRAY && items.len() == n as usize => {
            items.iter().enumerate().map(|(at, item)| one(&format!("{name}[{at}]"), item)).collect()
        }
        _ => Err(too_complex(name)),
    }
}

/// Conditions that a parameter has a given value.
fn given_guard(name: &str, ty: Type, values: &[Const]) -> Result<Vec<String>, String> {
    let one = |name: &str, value: &Const| {
        let text = match value {
            Const::Int(n) => n.to_string(),
            Const::Float(x) if x.is_finite() => x.to_string(),
            Const::Triple(xs) if xs.iter().all(|x| x.is_finite()) => {
                let word = word(Type { extent: Extent::One, ..ty }).ok_or_else(|| too_complex(name))?;
                let [x, y, z] = xs;
                format!("{word}({x}, {y}, {z})")
            }
            Const::Str(text) => format!("{:?}", &**text),
            _ => return Err(too_complex(name)),
        };
        Ok(format!("{name} == {text}"))
    };
    match values {
        [value] => Ok(vec![one(name, value)?]),
        _ if values.len() <= ARRAY as usize && ty.is_array() => {
            values.iter().enumerate().map(|(at, value)| one(&format!("{name}[{at}]"), value)).collect()
        }
        _ => Err(too_complex(name)),
    }
}
