//! `testshade`: runs a shader or a group on a grid, prints its text, and writes images.

mod closures;
mod job;
mod setup;
mod show;

use super::Console;
use super::options::{self, ToolOption};
use super::told::Teller;
use job::{Job, Order};
use osl::stages;
use osl_exec::{Frame, Keeping, PointSource, Program, Run, RunError, RunOptions, Services};
use osl_ir::passes;
use osl_job::picture::setup::pool;
use osl_lower::group::Group;
use osl_lower::group::text::Statement;
use osl_lower::params;
use osl_lower::{Last, Requests};
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceMap;
use std::sync::Arc;
use std::time::Instant;

const fn o(name: &'static str, words: usize, help: &'static str) -> ToolOption {
    ToolOption { name, words, help }
}

/// The tool's options. Those without help text control a code generator, which does not exist here.
const KNOWN: &[ToolOption] = &[
    o("help", 0, "Print this"),
    o("v", 0, "Print the group too"),
    o("oslquery", 0, "Print the group and the parameters of its layers"),
    o("t", 1, "Threads (0: all cores)"),
    o("g", 2, "Points in a row, and rows"),
    o("res", 2, "The same"),
    o("center", 0, "Points at pixel centres rather than from border to border"),
    o("scaleuv", 2, "Factors of u and v"),
    o("scalest", 2, "The same"),
    o("offsetst", 2, "Added to u and v"),
    o("param", 2, "NAME VALUE for the next shader; settings type=, lockgeom=, interpolated=, interactive="),
    o("shader", 2, "A layer: SHADER LAYER"),
    o("layer", 1, "Name of the layer of the next shader"),
    o("connect", 4, "LAYER OUTPUT LAYER PARAM"),
    o("group", 1, "The text of a group, or a file with it"),
    o("groupname", 1, "Name of the group"),
    o("expr", 1, "A layer whose shader has this body, with s, t and the outputs `result` and `alpha`"),
    o("path", 1, "Folders to look for shaders in, separated by colons"),
    o("archivegroup", 1, "Write the text of the group to a file"),
    o("reparam", 3, "Value from the second iteration on: LAYER NAME VALUE"),
    o("o", 2, "Output, and the file to write it to; `null` computes it only"),
    o("d", 1, "How samples are stored: uint8, uint16, half, float"),
    o("od", 1, "The same"),
    o("print", 0, "Print the outputs of each point instead of writing them"),
    o("raytype", 1, "Kind of ray"),
    o("userdata", 2, "Data of the primitive: NAME VALUE; setting type="),
    o("vary_pdxdy", 0, "Derivatives of P that differ from point to point"),
    o("vary_udxdy", 0, "Derivatives of u that differ from point to point"),
    o("vary_vdxdy", 0, "Derivatives of v that differ from point to point"),
    o("entry", 1, "A layer to run; only layers that are named so run, in this order, with what they need"),
    o("entryoutput", 1, "With --entry: an output whose layer is to run instead of the layers named there"),
    o("iters", 1, "How often to run"),
    o("runstats", 0, "Print times"),
    o("stats", 0, "The same"),
    o("colorspace", 1, "Color space of the shaders: Rec709, sRGB, ACEScg and ten others"),
    o("osl-version", 1, "Version of the language: 1.13 (the usual one) or 1.15"),
    o(
        "options",
        1,
        "Settings KEY=VALUE,…: lazyglobals, lazyunconnected, lazyerror, lazytrace, lockgeom, searchpath:shader …",
    ),
    o("texoptions", 1, "Settings KEY=VALUE,…: searchpath, folders to look for textures in"),
    o("userdata_isconnected", 0, "isconnected() counts parameters that may take data of the point"),
    o("batched", 0, ""),
    o("offsetuv", 2, ""),
    o("O0", 0, ""),
    o("O1", 0, ""),
    o("O2", 0, ""),
    o("debug", 0, ""),
    o("debug2", 0, ""),
    o("debugnan", 0, "Report values that are infinite or no number"),
    o("debuguninit", 0, "Report reads of variables without a value"),
    o("groupoutputs", 0, ""),
    o("inbuffer", 0, ""),
    o("jbufferMB", 1, ""),
    o("llvm_debug", 0, ""),
    o("llvm_opt", 1, ""),
    o("locale", 1, ""),
    o("no-output-placement", 0, ""),
    o("noshadeimage", 0, ""),
    o("optix", 0, ""),
    o("optix_force_inline_thresh", 1, ""),
    o("optix_no_inline", 0, ""),
    o("optix_no_inline_layer_funcs", 0, ""),
    o("optix_no_inline_rend_lib", 0, ""),
    o("optix_no_inline_thresh", 1, ""),
    o("optix_no_merge_layer_funcs", 0, ""),
    o("optix_no_rend_lib_bitcode", 0, ""),
    o("optix_register_inline_funcs", 0, ""),
    o("print-group-stats", 0, ""),
    o("print-groupdata", 0, ""),
    o("profile", 0, ""),
    o("raytype_opt", 0, ""),
    o("saveptx", 0, ""),
    o("shadeimage", 0, ""),
    o("use_rs_bitcode", 0, ""),
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
    let most = console.limits.limits().running.points;
    let job = match job::read(items, most)? {
        Order::Help => {
            let _ = write!(console.out, "{}", options::help(USAGE, KNOWN));
            return Ok(());
        }
        Order::Shade(job) => *job,
    };
    let pool = match job.threads {
        0 => None,
        n => Some(threads(n)?),
    };
    let started = Instant::now();
    let primaries = job.settings.primaries(console);
    let (limits, version) = (console.limits.limits().clone(), job.version);
    let options = osl_syntax::Options { limits, version, ..osl_syntax::Options::default() };
    let shaders = setup::folders(&job, console.limits);
    let (mut group, sources) = setup::group(&job, &shaders, &options, console)?;
    let outputs = show::outputs(&group, &job);
    // The tool separates its own lines from the shaders' text by an empty line: before its list of outputs,
    // or at the end if there is no list.
    let silent = matches!(&job.outputs[..], [(_, file)] if file == "null");
    if !silent {
        let _ = writeln!(console.out);
    }
    group.rules.entries = setup::entries(&group, &job, console)?;
    for output in &outputs {
        if let Some(file) = &output.file {
            let _ = writeln!(console.out, "Output {} to {}", output.asked, file.display());
        }
    }
    let renderer = job.renderer();
    let mut spaces = renderer.spaces();
    spaces.set(&job.settings.common_space, osl_numeric::matrix::diagonal(1.0));
    let textures = setup::textures(&job, console.limits.limits());
    let services = Services { ray: job.raytype.clone(), spaces, textures, reference_texts: true };
    let mut teller = Teller::new(&sources, &job.settings);
    let (mut last, mut compiled) = (None, None);
    let is_written = outputs.iter().any(|output| output.file.is_some());
    for round in 0..job.iterations {
        let mut silent = std::io::sink();
        let mut told = Console { out: &mut *console.out, err: &mut *console.err, limits: console.limits };
        if round == 1 && !job.reparams.is_empty() {
            reparam(&mut group, &job);
            compiled = None;
            told.err = &mut silent;
        }
        let program = match compiled.take() {
            Some(program) => program,
            None => compile(&group, primaries, &renderer, &outputs, &sources, &mut told)?,
        };
        let program = compiled.insert(program);
        // If lookups report errors to shaders, the first error of a file has a longer text. One thread makes
        // it the same in all runs.
        let alone = if program.has_error_messages() { Some(threads(1)?) } else { None };
        let machine = (&renderer, &services, alone.as_ref().or(pool.as_ref()));
        let is_kept = job.print || is_written && round + 1 == job.iterations;
        let mut frame = run(program, machine, is_kept, (!job.print).then_some(&mut teller), console)?;
        // The tool prints the values of all points before the messages of the shaders.
        if job.print {
            show::points(&frame, &outputs, job.grid.width, console);
            teller.tell(&std::mem::take(&mut frame.events), program, console)?;
        }
        last = Some(frame);
    }
    let Some(frame) = last else { return Ok(()) };
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

/// Minimum number of points in one piece of a run.
const PIECE: usize = 1 << 16;

/// Runs a program on all points. A teller prints the text and messages piece by piece; without one they stay
/// in the frame. The frame has values only if they are kept.
fn run(
    program: &Program,
    (renderer, services, pool): (&osl_scene::ReferenceRenderer, &Services, Option<&rayon::ThreadPool>),
    is_kept: bool,
    mut teller: Option<&mut Teller<'_>>,
    console: &mut Console<'_>,
) -> Result<Frame, String> {
    let keeping = Keeping { each: true, places: None };
    let options = RunOptions { keeping, limits: console.limits.limits().clone(), ..RunOptions::default() };
    let run = Run::new(program, services, renderer, &options);
    let piece = PIECE.next_multiple_of(renderer.blocks().map_or(1, |blocks| blocks.period()));
    let mut all = Frame::default();
    for first in (0..renderer.count()).step_by(piece) {
        let points = first..first.saturating_add(piece);
        let work = || match is_kept {
            true => run.points(points.clone(), &|_| ()),
            false => run.look(points.clone(), &|_| (), &|_, _| ()),
        };
        let found = match pool {
            Some(pool) => pool.install(work),
            None => work(),
        };
        let mut frame = found.map_err(|stop: RunError| format!("ERROR: {stop}"))?;
        if let Some(teller) = &mut teller {
            teller.tell(&std::mem::take(&mut frame.events), program, console)?;
        }
        all.add(frame, &options.limits.running);
    }
    Ok(all)
}

/// A pool of `n` threads.
fn threads(n: usize) -> Result<rayon::ThreadPool, String> {
    pool(n).map_err(|why| format!("testshade: {why}"))
}

/// Compiles the group, and reports calls of closures that are invalid in the tool.
fn compile(
    group: &Group,
    primaries: i32,
    renderer: &osl_scene::ReferenceRenderer,
    outputs: &[show::Output],
    sources: &SourceMap,
    console: &mut Console<'_>,
) -> Result<Program, String> {
    let asked: Vec<Arc<str>> = outputs.iter().flat_map(|o| o.names.iter().cloned()).collect();
    let wanted = outputs.iter().map(|o| o.plane.clone()).collect();
    let options = passes::Options {
        outputs: Some(wanted),
        varying: renderer.varying().to_vec(),
        derivs: renderer.varying_derivs().to_vec(),
        traces: renderer.traces(),
        limits: console.limits.limits().clone(),
        ..passes::Options::default()
    };
    let last = Last::Named(asked.clone());
    let requests = Requests { outputs: asked, last, limits: options.limits.clone(), ..Requests::default() };
    let lowered = |group: &Group| osl_lower::lower_group_for(group, &requests);
    let mut body = closures::lower(group, &options, sources, console, lowered)
        .map_err(|list| render(&list, sources, RenderStyle { color: false }))?;
    passes::set_primaries(&mut body, primaries);
    Ok(stages::finish(body, &options).program)
}

/// Sets the values of `--reparam`. Unknown parameters are ignored.
fn reparam(group: &mut Group, job: &Job) {
    for (layer, statement) in &job.reparams {
        let Statement::Param { ty, name, values, .. } = statement else { continue };
        let Some(layer) = group.find(layer).and_then(|index| group.layer_mut(index)) else { continue };
        let words: Vec<Arc<str>> = values.iter().map(|w| w.text.clone()).collect();
        let mut given = layer.values.clone();
        if params::set_words(&layer.program, &mut given, *ty, &name.text, &words).is_ok() {
            layer.values = given;
        }
    }
}
