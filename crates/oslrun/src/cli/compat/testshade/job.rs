//! What a command line of `testshade` asks for.

use super::super::options::Item;
use crate::cli::input;
use osl_exec::Datum;
use osl_image::Samples;
use osl_ir::group::text::{self, Statement, Word};
use osl_ir::hir::Global;
use osl_ir::ir::Const;
use osl_ir::types::{Base, Extent, Type};
use osl_scene::{Grid, ReferenceRenderer};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use std::path::Path;

/// What to do.
pub(super) enum Order {
    Help,
    Shade(Box<Job>),
}

/// A run.
pub(super) struct Job {
    pub(super) grid: Grid,
    pub(super) vary: Vec<Global>,
    pub(super) data: Vec<(String, Datum)>,
    pub(super) raytype: String,
    pub(super) statements: Vec<Statement>,
    /// Name and text of the shader that `--expr` makes.
    pub(super) expr: Option<(String, String)>,
    pub(super) group_name: String,
    /// Layer and value.
    pub(super) reparams: Vec<(String, Statement)>,
    /// Output and file, as given.
    pub(super) outputs: Vec<(String, String)>,
    pub(super) samples: Option<Samples>,
    pub(super) entries: Vec<String>,
    pub(super) entry_outputs: Vec<String>,
    pub(super) print: bool,
    pub(super) stats: bool,
    pub(super) iterations: usize,
    pub(super) threads: usize,
    /// Lines to print before anything else.
    pub(super) said: Vec<String>,
}

impl Job {
    /// The points, and what the renderer answers there.
    pub(super) fn renderer(&self) -> ReferenceRenderer {
        let mut renderer = ReferenceRenderer::new(self.grid.clone());
        renderer.vary.clone_from(&self.vary);
        renderer.data.clone_from(&self.data);
        renderer
    }
}

/// Points that a grid may have.
const MAX_POINTS: usize = 1 << 28;
/// Iterations of a run.
const MAX_ITERATIONS: usize = 1 << 16;

/// Reads the items of a command line.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn read(items: Vec<Item>) -> Result<Order, String> {
    let mut job = Job {
        grid: Grid::new(1, 1),
        vary: Vec::new(),
        data: Vec::new(),
        raytype: "camera".to_string(),
        statements: Vec::new(),
        expr: None,
        group_name: "unnamed_group_1".to_string(),
        reparams: Vec::new(),
        outputs: Vec::new(),
        samples: None,
        entries: Vec::new(),
        entry_outputs: Vec::new(),
        print: false,
        stats: false,
        iterations: 1,
        threads: 0,
        said: Vec::new(),
    };
    let mut layer: Option<String> = None;
    // Layers are connected when all are there.
    let mut connections = Vec::new();
    for item in items {
        match item {
            Item::Word(shader) => job.statements.push(declared(&shader, layer.take())),
            Item::Option { name: "help", .. } => return Ok(Order::Help),
            Item::Option { name: "layer", words, .. } => layer = words.into_iter().next(),
            Item::Option { name: "connect", words, .. } => {
                let [a, output, b, input] = &words[..] else { continue };
                job.said.push(format!("Connect {a}.{output} to {b}.{input}"));
                connections.push(Statement::Connect {
                    from: (word(a), word(output)),
                    to: (word(b), word(input)),
                    span: Span::default(),
                });
            }
            Item::Option { name, settings, words } => option(&mut job, name, &settings, &words)?,
        }
    }
    job.statements.extend(connections);
    if !job.statements.iter().any(|s| matches!(s, Statement::Shader { .. })) {
        return Err("ERROR: No shader or group was specified.\nTry `testshade --help`".to_string());
    }
    if job.outputs.is_empty() {
        job.outputs.push(("Cout".to_string(), "null".to_string()));
    }
    if job.grid.width.saturating_mul(job.grid.height) > MAX_POINTS {
        return Err(format!("testshade: a grid has at most {MAX_POINTS} points"));
    }
    Ok(Order::Shade(Box::new(job)))
}

fn word(text: &str) -> Word {
    Word { text: text.into(), span: Span::default() }
}

/// The layer of a shader; the name of a file stands for the shader in it.
fn declared(shader: &str, layer: Option<String>) -> Statement {
    let stem = Path::new(shader).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = if shader.ends_with(".oso") || shader.ends_with(".osl") { shader } else { shader.trim() };
    let layer = layer.map(|l| word(&l)).or_else(|| (stem != name).then(|| word(&format!("{stem}_0"))));
    Statement::Shader { shader: word(name), layer }
}

fn option(job: &mut Job, name: &str, settings: &[(String, String)], words: &[String]) -> Result<(), String> {
    let text = |at: usize| words.get(at).map_or("", String::as_str);
    let float = |at: usize| {
        text(at).parse::<f32>().map_err(|_| format!("testshade: --{name} takes numbers, not {}", text(at)))
    };
    let count = |at: usize| {
        text(at)
            .parse::<usize>()
            .map_err(|_| format!("testshade: --{name} takes numbers of things, not {}", text(at)))
    };
    match name {
        "t" => job.threads = count(0)?.min(1024),
        "g" | "res" => (job.grid.width, job.grid.height) = (count(0)?.max(1), count(1)?.max(1)),
        "center" => job.grid.center = true,
        "scaleuv" | "scalest" => job.grid.scale = [float(0)?, float(1)?],
        "offsetuv" | "offsetst" => job.grid.offset = [float(0)?, float(1)?],
        "vary_pdxdy" => job.vary.push(Global::P),
        "vary_udxdy" => job.vary.push(Global::U),
        "vary_vdxdy" => job.vary.push(Global::V),
        "param" => job.statements.push(value(text(0), text(1), settings)?),
        "shader" => job.statements.push(declared(text(0), Some(text(1).to_string()))),
        "group" => group(job, text(0))?,
        "groupname" => job.group_name = text(0).to_string(),
        "expr" => {
            let source = format!("shader expr_0 (output color result = 0) {{ result = {}; }}", text(0));
            job.expr = Some(("expr_0".to_string(), source));
            job.statements.push(Statement::Shader { shader: word("expr_0"), layer: Some(word("expr_0")) });
        }
        "reparam" => job.reparams.push((text(0).to_string(), value(text(1), text(2), settings)?)),
        "o" => job.outputs.push((text(0).to_string(), text(1).to_string())),
        "d" | "od" => {
            let samples = Samples::from_name(text(0));
            job.samples =
                Some(samples.ok_or_else(|| format!("testshade: no samples are called {}", text(0)))?);
        }
        "print" => job.print = true,
        "raytype" => job.raytype = text(0).to_string(),
        "userdata" => {
            let Statement::Param { ty, values, .. } = value(text(0), text(1), settings)? else {
                return Ok(());
            };
            job.data.extend(datum(ty, &values).map(|datum| (text(0).to_string(), datum)));
        }
        "entry" => job.entries.push(text(0).to_string()),
        "entryoutput" => job.entry_outputs.push(text(0).to_string()),
        "iters" => job.iterations = count(0)?.clamp(1, MAX_ITERATIONS),
        "runstats" | "stats" => job.stats = true,
        "colorspace" if text(0) != "Rec709" => {
            return Err(format!("testshade: color space {} is not there, only Rec709", text(0)));
        }
        _ => {}
    }
    Ok(())
}

/// The statements of a group's text, or of a file with it.
fn group(job: &mut Job, given: &str) -> Result<(), String> {
    let path = Path::new(given);
    let text = if !given.contains([';', ',']) && path.is_file() {
        input::read_text(path)?
    } else {
        given.to_string()
    };
    let (statements, diagnostics) = text::parse(&text, 0);
    if let Some(first) = diagnostics.iter().find(|d| d.is_error()) {
        return Err(malformed(&text, first));
    }
    // Places in this text are not those of the group.
    job.statements.extend(statements.into_iter().map(placeless));
    Ok(())
}

fn malformed(text: &str, d: &Diagnostic) -> String {
    let start = text.get(..d.span.start as usize).and_then(|t| t.rfind([';', ','])).map_or(0, |at| at + 1);
    let near = text.get(start..).unwrap_or("").split_inclusive([';', ',']).next().unwrap_or("").trim();
    format!(
        "ERROR: error parsing group description: {}\n        problem might be here: {near}\nERROR: Invalid shader group. Exiting testshade.",
        d.message
    )
}

fn placeless(statement: Statement) -> Statement {
    let bare = |w: Word| Word { span: Span::default(), ..w };
    match statement {
        Statement::Param { ty, name, values, interpolated, .. } => Statement::Param {
            ty,
            name: bare(name),
            values: values.into_iter().map(bare).collect(),
            interpolated,
            span: Span::default(),
        },
        Statement::Shader { shader, layer } => {
            Statement::Shader { shader: bare(shader), layer: layer.map(bare) }
        }
        Statement::Connect { from, to, .. } => Statement::Connect {
            from: (bare(from.0), bare(from.1)),
            to: (bare(to.0), bare(to.1)),
            span: Span::default(),
        },
    }
}

/// A value whose type is given, or told by its form: sixteen numbers are a matrix, three a vector, one an int or float; all
/// else is a string.
fn value(name: &str, text: &str, settings: &[(String, String)]) -> Result<Statement, String> {
    let setting = |key: &str| settings.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
    let parts: Vec<&str> = text.split([',', ' ']).filter(|p| !p.is_empty()).collect();
    let numbers = !parts.is_empty() && parts.iter().all(|p| p.parse::<f32>().is_ok());
    let ty = match setting("type") {
        Some(ty) => Type::parse(ty).ok_or_else(|| format!("testshade: there is no type {ty}"))?,
        None => match (numbers, parts.len()) {
            (true, 16) => Type::MATRIX,
            (true, 3) => Type::VECTOR,
            (true, 1) if text.trim().parse::<i32>().is_ok() => Type::INT,
            (true, 1) => Type::FLOAT,
            _ => Type::STRING,
        },
    };
    let values = match (ty.base, ty.extent) {
        (Base::String, Extent::One) => vec![word(text)],
        (Base::String, _) => text.split(',').map(word).collect(),
        _ => parts.iter().map(|p| word(p)).collect(),
    };
    let interpolated = setting("lockgeom") == Some("0") || setting("interpolated").is_some_and(|v| v != "0");
    Ok(Statement::Param { ty, name: word(name), values, interpolated, span: Span::default() })
}

/// The value of user data.
fn datum(ty: Type, words: &[Word]) -> Option<Datum> {
    let number = |at: usize| words.get(at).and_then(|w| w.text.parse::<f32>().ok()).unwrap_or(0.0);
    let one = |first: usize| {
        Some(match ty.base {
            Base::Int => Const::Int(words.get(first)?.text.parse().ok()?),
            Base::Float => Const::Float(number(first)),
            Base::String => Const::Str(words.get(first)?.text.clone()),
            Base::Matrix => Const::Matrix(Box::new(std::array::from_fn(|c| number(first + c)))),
            base if base.is_triple() => Const::Triple([number(first), number(first + 1), number(first + 2)]),
            _ => return None,
        })
    };
    if !ty.is_array() {
        return one(0).map(Datum::one);
    }
    let each = match ty.base {
        Base::Matrix => 16,
        base if base.is_triple() => 3,
        _ => 1,
    };
    (0..words.len() / each).map(|at| one(at * each)).collect::<Option<Vec<_>>>().map(Datum::array)
}
