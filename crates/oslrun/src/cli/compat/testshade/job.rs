//! The parsed command line of `testshade`.

use super::super::options::Item;
use super::super::settings::{self, Settings};
use crate::cli::options::reading::version;
use osl_exec::Datum;
use osl_image::Samples;
use osl_ir::global::Global;
use osl_ir::ir::Const;
use osl_ir::types::{Base, Extent, Type};
use osl_lower::group::text::{Statement, Word};
use osl_scene::{Grid, ReferenceRenderer};
use osl_syntax::Version;
use osl_syntax::span::Span;
use std::path::PathBuf;

/// The requested action.
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
    /// The steps that build the group, in order.
    pub(super) steps: Vec<Step>,
    /// Layer, output, layer, parameter. Connections are made after all layers exist.
    pub(super) connections: Vec<[String; 4]>,
    /// The name that the command line gives the group.
    pub(super) group_name: Option<String>,
    pub(super) settings: Settings,
    /// The version of the language.
    pub(super) version: Version,
    /// Folders to search for textures.
    pub(super) texture_path: Vec<PathBuf>,
    /// Where to write the text of the group.
    pub(super) archive: Option<String>,
    pub(super) verbose: bool,
    /// Whether to list the parameters of the layers.
    pub(super) query: bool,
    /// Layer and value.
    pub(super) reparams: Vec<(String, Statement)>,
    /// Output and file, as written.
    pub(super) outputs: Vec<(String, String)>,
    pub(super) samples: Option<Samples>,
    pub(super) entries: Vec<String>,
    pub(super) entry_outputs: Vec<String>,
    pub(super) print: bool,
    pub(super) stats: bool,
    pub(super) iterations: usize,
    pub(super) threads: usize,
}

/// A step in building a group.
pub(super) enum Step {
    /// A value for the next shader.
    Value(Statement),
    /// A layer with a shader from a file.
    Shader { shader: String, layer: Option<String> },
    /// A layer with a shader whose body is this text.
    Expr { text: String, layer: Option<String> },
    /// A group that replaces the current one: its text, or the file that contains it.
    Group(String),
}

impl Job {
    /// The renderer: the points, and its answers to the shader's questions.
    pub(super) fn renderer(&self) -> ReferenceRenderer {
        let mut renderer = ReferenceRenderer::new(self.grid.clone());
        renderer.vary.clone_from(&self.vary);
        renderer.data.clone_from(&self.data);
        renderer.version = self.version.number() as i32;
        renderer
    }
}

/// Reads the items of a command line; `most` is the maximum number of points of a grid.
///
/// # Errors
/// What is wrong, as text.
pub(super) fn read(items: Vec<Item>, most: u64) -> Result<Order, String> {
    let mut job = Job {
        grid: Grid::new(1, 1),
        vary: Vec::new(),
        data: Vec::new(),
        raytype: "camera".to_string(),
        steps: Vec::new(),
        connections: Vec::new(),
        group_name: None,
        settings: Settings::default(),
        version: Version::default(),
        texture_path: Vec::new(),
        archive: None,
        verbose: false,
        query: false,
        reparams: Vec::new(),
        outputs: Vec::new(),
        samples: None,
        entries: Vec::new(),
        entry_outputs: Vec::new(),
        print: false,
        stats: false,
        iterations: 1,
        threads: 0,
    };
    let mut layer: Option<String> = None;
    for item in items {
        match item {
            Item::Word(shader) => job.steps.push(declared(&shader, layer.take())),
            Item::Option { name: "help", .. } => return Ok(Order::Help),
            Item::Option { name: "layer", words, .. } => layer = words.into_iter().next(),
            Item::Option { name: "expr", words, .. } => {
                let text = words.into_iter().next().unwrap_or_default();
                job.steps.push(Step::Expr { text, layer: layer.take() });
            }
            Item::Option { name: "connect", words, .. } => job.connections.extend(words.try_into().ok()),
            Item::Option { name, settings, words } => option(&mut job, name, &settings, &words)?,
        }
    }
    if !job.steps.iter().any(|step| !matches!(step, Step::Value(_))) {
        return Err("ERROR: No shader or group was specified.\n\nTry `testshade --help` for an explanation of all arguments".to_string());
    }
    if job.outputs.is_empty() {
        job.outputs.push(("Cout".to_string(), "null".to_string()));
    }
    if job.grid.width.saturating_mul(job.grid.height) as u64 > most {
        return Err(format!("testshade: a grid has at most {most} points (--limit running.points=N)"));
    }
    Ok(Order::Shade(Box::new(job)))
}

fn word(text: &str) -> Word {
    Word { text: text.into(), span: Span::default() }
}

/// The step for a shader; a file name stands for the shader in it.
fn declared(shader: &str, layer: Option<String>) -> Step {
    Step::Shader { shader: shader.trim().to_string(), layer }
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
        "offsetst" => job.grid.offset = [float(0)?, float(1)?],
        "vary_pdxdy" => job.vary.push(Global::P),
        "vary_udxdy" => job.vary.push(Global::U),
        "vary_vdxdy" => job.vary.push(Global::V),
        "param" => job.steps.push(Step::Value(value(text(0), text(1), settings)?)),
        "shader" => job.steps.push(declared(text(0), Some(text(1).to_string()))),
        "group" => job.steps.push(Step::Group(text(0).to_string())),
        "groupname" => job.group_name = Some(text(0).to_string()),
        "archivegroup" => job.archive = Some(text(0).to_string()),
        "path" => job.settings.shader_path = settings::folders(text(0)),
        "v" => job.verbose = true,
        "oslquery" => job.query = true,
        "options" => job.settings.read(text(0)),
        "texoptions" => {
            let mut paths = settings::pairs(text(0)).into_iter().filter(|(key, _)| key == "searchpath");
            if let Some((_, path)) = paths.next_back() {
                job.texture_path = settings::folders(&path);
            }
        }
        "colorspace" => job.settings.color_space = text(0).to_string(),
        "osl-version" => {
            job.version = version(text(0)).map_err(|why| format!("testshade: {why}"))?;
        }
        "userdata_isconnected" => job.settings.userdata_isconnected = true,
        "debugnan" => job.settings.debug_nan = true,
        "debuguninit" => job.settings.debug_uninit = true,
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
        "iters" => job.iterations = count(0)?.max(1),
        "runstats" | "stats" => job.stats = true,
        _ => {}
    }
    Ok(())
}

/// A value with its given type, or the type that its form implies: sixteen numbers are a matrix, three a
/// vector, one an int or float; everything else is a string.
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
