//! `testshade`: runs a shader or a group on a grid, prints what it prints, writes images.

mod job;
mod show;

use super::Console;
use super::options::{self, Known};
use crate::cli::args::ReadArgs;
use crate::cli::input;
use crate::pipeline::{self, ShaderFiles};
use job::{Job, Order};
use osl_exec::{Frame, PointSource, RunOptions, Services, Stop};
use osl_image::TextureCache;
use osl_ir::group::Group;
use osl_ir::group::text::Statement;
use osl_ir::params::{self, ParamValues};
use osl_ir::{lower, passes};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::{SourceMap, SourceProvider};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

const fn o(name: &'static str, words: usize, help: &'static str) -> Known {
    Known { name, words, help }
}

/// The tool's options. Those without help steer a code generator that is not here.
const KNOWN: &[Known] = &[
    o("help", 0, "Print this"),
    o("v", 0, "Say more"),
    o("t", 1, "Threads (0: all cores)"),
    o("g", 2, "Points in a row, and rows"),
    o("res", 2, "The same"),
    o("center", 0, "Points at pixel centres rather than from border to border"),
    o("scaleuv", 2, "Factors of u and v"),
    o("scalest", 2, "The same"),
    o("offsetuv", 2, "Added to u and v"),
    o("offsetst", 2, "The same"),
    o("param", 2, "NAME VALUE for the next shader; settings type=, lockgeom=, interpolated=, interactive="),
    o("shader", 2, "A layer: SHADER LAYER"),
    o("layer", 1, "Name of the layer of the next shader"),
    o("connect", 4, "LAYER OUTPUT LAYER PARAM"),
    o("group", 1, "The text of a group, or a file with it"),
    o("groupname", 1, "Name of the group"),
    o("expr", 1, "An expression, computed as output `result`"),
    o("reparam", 3, "Value from the second iteration on: LAYER NAME VALUE"),
    o("o", 2, "Output, and the file to write it to; `null` computes it only"),
    o("d", 1, "How samples are stored: uint8, uint16, half, float"),
    o("od", 1, "The same"),
    o("print", 0, "Print the outputs of each point instead of writing them"),
    o("raytype", 1, "Kind of ray"),
    o("userdata", 2, "Data of the primitive: NAME VALUE; setting type="),
    o("vary_pdxdy", 0, "Slopes of P that differ from point to point"),
    o("vary_udxdy", 0, "Slopes of u that differ from point to point"),
    o("vary_vdxdy", 0, "Slopes of v that differ from point to point"),
    o("entry", 1, "A layer that runs by itself"),
    o("entryoutput", 1, "An output whose layer runs by itself"),
    o("iters", 1, "How often to run"),
    o("runstats", 0, "Print times"),
    o("stats", 0, "The same"),
    o("colorspace", 1, "Color space of the shaders: Rec709 (others are not there)"),
    o("batched", 0, ""),
    o("options", 1, ""),
    o("texoptions", 1, ""),
    o("O0", 0, ""),
    o("O1", 0, ""),
    o("O2", 0, ""),
    o("debug", 0, ""),
    o("debug2", 0, ""),
    o("debugnan", 0, ""),
    o("debuguninit", 0, ""),
    o("groupoutputs", 0, ""),
    o("inbuffer", 0, ""),
    o("jbufferMB", 1, ""),
    o("llvm_debug", 0, ""),
    o("llvm_opt", 1, ""),
    o("locale", 1, ""),
    o("no-output-placement", 0, ""),
    o("noshadeimage", 0, ""),
    o("oslquery", 0, ""),
    o("print-groupdata", 0, ""),
    o("profile", 0, ""),
    o("raytype_opt", 0, ""),
    o("shadeimage", 0, ""),
    o("use_rs_bitcode", 0, ""),
    o("userdata_isconnected", 0, ""),
    o("warmup", 0, ""),
];

const USAGE: &str = "testshade [options] shader\nRun a shader or a group of shaders on a grid.";

/// Runs the tool.
pub(super) fn main(args: &[String], console: &mut Console<'_>) -> u8 {
    match shade(args, console) {
        Ok(()) => 0,
        Err(why) => {
            if !why.is_empty() {
                let _ = writeln!(console.err, "{why}");
            }
            1
        }
    }
}

fn shade(args: &[String], console: &mut Console<'_>) -> Result<(), String> {
    let items = options::parse("testshade", args, KNOWN)?;
    let job = match job::read(items)? {
        Order::Help => {
            let _ = write!(console.out, "{}", options::help(USAGE, KNOWN));
            return Ok(());
        }
        Order::Shade(job) => *job,
    };
    for line in &job.said {
        let _ = writeln!(console.out, "{line}");
    }
    let pool = match job.threads {
        0 => None,
        n => Some(
            rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .map_err(|why| format!("testshade: cannot start {n} threads: {why}"))?,
        ),
    };
    let started = Instant::now();
    let library =
        Folders { expr: job.expr.clone(), includes: input::includes(Path::new(""), &ReadArgs::default()) };
    let options = osl_syntax::Options::default();
    let mut checked =
        pipeline::link(SourceMap::default(), &job.statements, &job.group_name, &library, &options);
    told(&checked.diagnostics, &checked.sources, console);
    let Some(mut group) = checked.group.take() else {
        return Err("ERROR: Invalid shader group. Exiting testshade.".to_string());
    };
    if group.layers().is_empty() {
        return Err("testshade: no shader was named".to_string());
    }
    let outputs = show::outputs(&group, &job);
    // The tool parts what it says from what the shaders print by an empty line: before its list of outputs, or at the end
    // where there is none.
    let silent = matches!(&job.outputs[..], [(_, file)] if file == "null");
    if !silent {
        let _ = writeln!(console.out);
    }
    for output in &outputs {
        if let Some(file) = &output.file {
            let _ = writeln!(console.out, "Output {} to {}", output.asked, file.display());
        }
    }
    let renderer = job.renderer();
    let services = Services {
        ray: job.raytype.clone(),
        spaces: renderer.spaces(),
        textures: TextureCache::new(vec![PathBuf::new()]),
    };
    let mut last = None;
    for round in 0..job.iterations {
        if round == 1 {
            reparam(&mut group, &job)?;
        }
        let frame = frame(&group, &job, &renderer, &services, &outputs, &checked.sources, pool.as_ref())?;
        show::said(&frame.0, &frame.1, &checked.sources, console)?;
        last = Some(frame.0);
    }
    let Some(frame) = last else { return Ok(()) };
    if job.print {
        show::points(&frame, &outputs, job.grid.width, console);
    }
    if silent {
        let _ = writeln!(console.out);
    }
    if !job.print {
        show::write(&frame, &outputs, &job)?;
    }
    if job.stats {
        let _ = writeln!(console.out, "Run: {:.3} s", started.elapsed().as_secs_f64());
    }
    Ok(())
}

/// Compiles the group and runs it on all points.
fn frame(
    group: &Group,
    job: &Job,
    renderer: &osl_scene::ReferenceRenderer,
    services: &Services,
    outputs: &[show::Output],
    sources: &SourceMap,
    pool: Option<&rayon::ThreadPool>,
) -> Result<(Frame, osl_exec::Program), String> {
    let asked: Vec<Arc<str>> =
        outputs.iter().flat_map(|o| o.names.iter().cloned()).chain(show::entries(group, job)).collect();
    let body = lower::lower_group(group, &asked)
        .map_err(|list| render(&list, sources, RenderStyle { color: false }))?;
    let wanted = outputs.iter().map(|o| o.plane.clone()).collect();
    let options = passes::Options {
        outputs: Some(wanted),
        varying: renderer.varying().to_vec(),
        slopes: renderer.varying_slopes().to_vec(),
        ..passes::Options::default()
    };
    let compiled = pipeline::finish(body, &options);
    let run = || osl_exec::run(&compiled.program, services, renderer, &RunOptions::default(), &|_| ());
    let result = match pool {
        Some(pool) => pool.install(run),
        None => run(),
    };
    let frame = result.map_err(|stop: Stop| format!("ERROR: {stop}"))?;
    Ok((frame, compiled.program))
}

/// Sets the values that `--reparam` gives.
fn reparam(group: &mut Group, job: &Job) -> Result<(), String> {
    for (layer, statement) in &job.reparams {
        let Statement::Param { ty, name, values, .. } = statement else { continue };
        let index = group.find(layer).ok_or_else(|| format!("testshade: there is no layer \"{layer}\""))?;
        let Some(layer) = group.layer_mut(index) else { continue };
        let words: Vec<Arc<str>> = values.iter().map(|w| w.text.clone()).collect();
        let mut given: ParamValues = layer.values.clone();
        params::set_words(&layer.program, &mut given, *ty, &name.text, &words)
            .map_err(|e| format!("testshade: {e}"))?;
        layer.values = given;
    }
    Ok(())
}

fn told(list: &[Diagnostic], sources: &SourceMap, console: &mut Console<'_>) {
    for d in list {
        let kind = if d.is_error() { "ERROR" } else { "WARNING" };
        // What the command line says has no place in a file.
        let place = sources.place(d.span).filter(|_| d.span != osl_syntax::span::Span::default());
        let place = place.map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
        let _ = writeln!(console.err, "{kind}: {place}{}", d.message);
    }
}

/// Where shaders are looked for: compiled ones first, as the reference does, and their sources.
struct Folders {
    /// The text of the shader that `--expr` makes.
    expr: Option<(String, String)>,
    includes: input::Files,
}

impl ShaderFiles for Folders {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        if let Some((_, text)) = self.expr.as_ref().filter(|(name, _)| name == shader) {
            return Ok((format!("{shader}.osl"), text.clone()));
        }
        let stem = shader.strip_suffix(".osl").or_else(|| shader.strip_suffix(".oso")).unwrap_or(shader);
        for ending in ["oso", "osl"] {
            let path = PathBuf::from(format!("{stem}.{ending}"));
            if path.is_file() {
                return Ok((path.display().to_string(), input::read_text(&path)?));
            }
        }
        Err("no compiled shader nor source of that name was found".to_string())
    }

    fn includes(&self) -> &dyn SourceProvider {
        &self.includes
    }
}
