//! `testrender`: renders an XML scene with the reference's path tracer.

use super::Console;
use super::folders::Folders;
use super::group::GroupBuilder;
use super::options::{self, Item, ToolOption};
use super::settings::{self, Settings};
use osl::stages;
use osl_exec::{PointSource, Services, Severity};
use osl_image::{Samples, TextureCache, write_channels};
use osl_ir::passes;
use osl_job::file::output;
use osl_job::picture::setup;
use osl_job::request::Reading;
use osl_job::source::input;
use osl_lower::Requests;
use osl_lower::group::text::Statement;
use osl_scene::mesh::{Mesh, read_obj_within};
use osl_scene::subdivide::{Detail, Scheme, tessellate_within};
use osl_scene::surface_points::SurfacePoints;
use osl_scene::testrender::shapes::Shape;
use osl_scene::testrender::{self, GroupText, RayServices, Scene, World, scene};
use osl_syntax::source::SourceMap;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

const fn o(name: &'static str, words: usize, help: &'static str) -> ToolOption {
    ToolOption { name, words, help }
}

/// The tool's options. Those without help text control a code generator or a graphics card, which do not
/// exist here.
const KNOWN: &[ToolOption] = &[
    o("help", 0, "Print this"),
    o("r", 2, "Width and height of the picture: 640 480"),
    o("res", 2, "The same"),
    o("aa", 1, "Paths for a pixel along x and along y: 1"),
    o("t", 1, "Threads (0: all cores)"),
    o("albedo", 1, "Show the albedo of what the camera sees, times a factor"),
    o("path", 1, "Folders to look for shaders in, with : between them"),
    o("iters", 1, "How often to render"),
    o("options", 1, "Settings KEY=VALUE,…: connection_error, searchpath:shader …"),
    o("texoptions", 1, "Settings KEY=VALUE,…: searchpath, folders to look for textures in"),
    o("runstats", 0, "Print times"),
    o("stats", 0, "The same"),
    o("profile", 0, "The same"),
    o("v", 0, ""),
    o("debug", 0, ""),
    o("debug2", 0, ""),
    o("debugnan", 0, ""),
    o("warmup", 0, ""),
    o("O0", 0, ""),
    o("O1", 0, ""),
    o("O2", 0, ""),
    o("llvm_opt", 1, ""),
    o("optix", 0, ""),
    o("optix_no_inline", 0, ""),
    o("optix_no_inline_layer_funcs", 0, ""),
    o("optix_merge_layer_funcs", 0, ""),
    o("optix_no_inline_rend_lib", 0, ""),
    o("optix_no_inline_thresh", 1, ""),
    o("optix_force_inline_thresh", 1, ""),
    o("optix_register_inline_funcs", 1, ""),
    o("saveptx", 0, ""),
];

const USAGE: &str = "testrender [options] scene.xml outputfilename\nRender a scene.";

/// What a command line requests.
struct Job {
    size: [usize; 2],
    samples: usize,
    threads: usize,
    albedo: Option<f32>,
    settings: Settings,
    texture_path: Vec<PathBuf>,
    iterations: usize,
    stats: bool,
    words: Vec<String>,
    help: bool,
}

/// Runs the tool.
pub(super) fn main(args: &[String], console: &mut Console<'_>) -> u8 {
    match run(args, console) {
        Ok(()) => 0,
        Err(why) => {
            if !why.is_empty() {
                let _ = writeln!(console.err, "{why}");
            }
            1
        }
    }
}

/// Reads the items of a command line; `most` is the maximum number of pixels of a picture.
fn read(items: Vec<Item>, most: u64) -> Result<Job, String> {
    let mut job = Job {
        size: [640, 480],
        samples: 1,
        threads: 0,
        albedo: None,
        settings: Settings::default(),
        texture_path: Vec::new(),
        iterations: 1,
        stats: false,
        words: Vec::new(),
        help: false,
    };
    for item in items {
        let (name, words) = match item {
            Item::Word(word) => {
                job.words.push(word);
                continue;
            }
            Item::Option { name, words, .. } => (name, words),
        };
        let text = |at: usize| words.get(at).map_or("", String::as_str);
        let wrong = |at: usize| format!("testrender: --{name} takes numbers, not {}", text(at));
        let count = |at: usize| text(at).parse::<usize>().map_err(|_| wrong(at));
        match name {
            "help" => job.help = true,
            "r" | "res" => job.size = [count(0)?.max(1), count(1)?.max(1)],
            "aa" => job.samples = count(0)?,
            "t" => job.threads = count(0)?.min(1024),
            "albedo" => job.albedo = Some(text(0).parse().map_err(|_| wrong(0))?),
            "path" => job.settings.shader_path = settings::folders(text(0)),
            "options" => job.settings.read(text(0)),
            "texoptions" => {
                let path = settings::pairs(text(0)).into_iter().filter(|(key, _)| key == "searchpath");
                job.texture_path.extend(path.flat_map(|(_, value)| settings::folders(&value)));
            }
            "iters" => job.iterations = count(0)?.max(1),
            "runstats" | "stats" | "profile" => job.stats = true,
            _ => {}
        }
    }
    if let Some(samples) = std::env::var("TESTRENDER_AA").ok().and_then(|text| text.parse().ok()) {
        job.samples = samples;
    }
    if job.size[0].saturating_mul(job.size[1]) as u64 > most {
        return Err(format!("testrender: a picture has at most {most} pixels (--limit scenes.pixels=N)"));
    }
    Ok(job)
}

fn run(args: &[String], console: &mut Console<'_>) -> Result<(), String> {
    let job = read(options::parse("testrender", args, KNOWN)?, console.limits.limits().scenes.pixels)?;
    if job.help {
        let _ = write!(console.out, "{}", options::help(USAGE, KNOWN));
        return Ok(());
    }
    let missing = |what: &str| format!("testrender: Must specify {what}\n{}", options::help(USAGE, KNOWN));
    let file = job.words.first().ok_or_else(|| missing("an xml scene file to open"))?;
    let image = job.words.get(1).ok_or_else(|| missing("a filename for output render"))?;
    let started = Instant::now();
    let limits = console.limits.limits();
    // An argument that is not a file is the text of the scene.
    let path = Path::new(file);
    let text = match file.ends_with(".xml") && path.is_file() {
        true => input::read_text(path, &Reading::within(limits))?,
        false => file.clone(),
    };
    let scene = scene::read(&text, limits).map_err(|why| format!("SEVERE ERROR: {why}"))?;
    scene.warnings.iter().for_each(|text| console.warning(text));
    if scene.groups.is_empty() {
        return Err("SEVERE ERROR: No shaders in scene".to_string());
    }
    let folder = path.parent().filter(|_| path.is_file()).unwrap_or(Path::new(""));
    let (world, sources) = world(scene, folder, &job, console)?;
    let prepared = started.elapsed();
    let pool = setup::pool(job.threads).map_err(|why| format!("testrender: {why}"))?;
    let options = world.1;
    let mut picture = testrender::Picture::default();
    for _ in 0..job.iterations {
        picture = pool
            .install(|| testrender::render(&world.0, &options, &|_| ()))
            .map_err(|stop| format!("ERROR: {stop}"))?;
        said(&picture.notes, &sources, console)?;
    }
    let planes: Vec<&[f32]> = picture.planes.iter().map(Vec::as_slice).collect();
    write_channels(Path::new(image), (job.size[0], job.size[1]), &planes, Some(Samples::Half))
        .and_then(|file| Ok(file.save()?))
        .map_err(|why| format!("ERROR: {why}"))?;
    if job.stats {
        let total = started.elapsed();
        let _ = writeln!(
            console.out,
            "Prepare: {:.3} s\nRender: {:.3} s",
            prepared.as_secs_f64(),
            (total - prepared).as_secs_f64()
        );
    }
    Ok(())
}

/// Compiles the shaders of a scene, and reads its meshes, which are relative to `folder`.
fn world(
    scene: Scene,
    folder: &Path,
    job: &Job,
    console: &mut Console<'_>,
) -> Result<((World, testrender::Options), SourceMap), String> {
    let files = Folders::new(job.settings.shader_path.clone(), Vec::new(), console.limits);
    let limits = console.limits.limits();
    let options = osl_syntax::Options { limits: limits.clone(), ..osl_syntax::Options::default() };
    let mut builder = GroupBuilder::new("", &files, &options, &job.settings);
    let mut programs = Vec::with_capacity(scene.groups.len());
    for group in &scene.groups {
        programs.push(compile(group, &mut builder, console)?);
    }
    let (_, sources) = builder.finish();
    let count =
        |name: &str, default: usize| scene.option(name).map_or(default, |n| usize::try_from(n).unwrap_or(0));
    let defaults = testrender::Options::default();
    let options = testrender::Options {
        samples: count("aa", job.samples),
        max_bounces: count("max_bounces", defaults.max_bounces),
        absorbed_from: count("rr_depth", defaults.absorbed_from),
        albedo: job.albedo.filter(|scale| *scale > 0.0),
    };
    // The user's own script names the texture files, so any path is allowed.
    let textures = || {
        let mut folders = vec![PathBuf::new()];
        folders.extend(job.texture_path.iter().cloned());
        TextureCache::within(folders, limits).allow_files(true)
    };
    let displacement = |group: Option<usize>| scene.groups.get(group?)?.displacement;
    let (moved, fixed): (Vec<Shape>, _) =
        scene.shapes.into_iter().partition(|shape| displacement(shape.group).is_some());
    let mut world = World {
        camera: scene.camera,
        size: job.size,
        shapes: fixed,
        groups: programs,
        services: RayServices::new(|| Services { textures: textures(), ..Services::default() }),
        background: scene.background.and_then(|b| b.group),
        resolution: scene.background.map_or(0, |b| b.resolution),
        limits: limits.clone(),
    };
    let mut notes = testrender::Notes::default();
    let (most, mut corners) = (limits.scenes.corners, 0_u64);
    // Counted over all meshes, and before they are made.
    let mut count = |more: u64| {
        corners = corners.saturating_add(more);
        let few = corners <= most;
        few.then_some(()).ok_or(format!(
            "ERROR: the meshes of the scene have more than {most} corners (--limit scenes.corners=N)"
        ))
    };
    let mut add = |mesh: &Mesh, group, is_light| {
        let found = tessellate_within(mesh, Scheme::Linear, &Detail::Level(0), limits)
            .map_err(|why| format!("ERROR: {why}"))?;
        let groups = [group, displacement(group)];
        world.add_mesh(found.triangles, groups, is_light, &mut notes).map_err(|stop| format!("ERROR: {stop}"))
    };
    for model in scene.models {
        let path = folder.join(&model.file);
        let wrong = |why: &dyn std::fmt::Display| format!("ERROR: model {}: {why}", path.display());
        let text = input::read_text(&path, &Reading::within(limits)).map_err(|why| wrong(&why))?;
        let mesh = read_obj_within(&text, limits).map_err(|why| wrong(&why))?;
        count(mesh.corners.len() as u64)?;
        add(&mesh, model.group, model.is_light)?;
    }
    for Shape { form, group, is_light, resolution } in moved {
        // A sphere has twice as many columns as rows.
        count(8 * u64::from(resolution).pow(2))?;
        if let Some(mesh) = form.mesh(resolution) {
            add(&mesh, group, is_light)?;
        }
    }
    said(&notes, &sources, console)?;
    Ok(((world, options), sources))
}

/// Compiles a shader group to a program that outputs `Ci`, or `P` if it is a displacement.
///
/// # Errors
/// The message to print before the tool ends; empty if it was printed already.
fn compile(
    text: &GroupText,
    builder: &mut GroupBuilder<'_>,
    console: &mut Console<'_>,
) -> Result<osl_exec::Program, String> {
    builder.restart(&text.name);
    if !builder.text(&text.commands, console) {
        return Err(String::new());
    }
    for statement in &text.statements {
        match statement {
            Statement::Param { .. } => builder.value(statement.clone()),
            Statement::Shader { shader, layer } => {
                builder.shader(&shader.text, layer.as_ref().map(|l| &*l.text), console);
            }
            Statement::Connect { from, to, .. } => {
                builder.connect((&from.0.text, &from.1.text), (&to.0.text, &to.1.text), console);
            }
        }
    }
    let limits = console.limits.limits();
    let requests = Requests { limits: limits.clone(), ..Requests::default() };
    let mut body = osl_lower::lower_group_for(&builder.take(), &requests).map_err(|list| {
        let why = list.first().map_or_else(String::new, |d| d.message.clone());
        format!("ERROR: {why}")
    })?;
    // The tool has no color management, so it knows the usual spaces only.
    passes::set_primaries(&mut body, 0);
    let (output, points) = match text.usage.as_str() {
        "displacement" => ("P", SurfacePoints::default()),
        _ => ("Ci", SurfacePoints::of_testrender()),
    };
    let options = passes::Options {
        outputs: Some(vec![output.into()]),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: limits.clone(),
        ..passes::Options::default()
    };
    Ok(stages::finish(body, &options).program)
}

/// Prints the text and the messages of shaders.
fn said(notes: &testrender::Notes, sources: &SourceMap, console: &mut Console<'_>) -> Result<(), String> {
    output::printed(&notes.printed, output::Appends::Anywhere, console)
        .map_err(|failure| format!("ERROR: {}", failure.text))?;
    for name in &notes.unknown {
        console.warning(&format!("the closure `{name}` is not known here, and reflects no light"));
    }
    let place = |span| sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut seen = HashSet::new();
    for said in &notes.messages {
        let (severity, line) = (said.message.severity, said.message.show(place));
        if !seen.insert((severity, line.clone())) {
            continue;
        }
        match severity {
            Severity::Error => console.error(&line),
            Severity::Warning => console.warning(&line),
            // The tool does not know them.
            Severity::Note => {}
        }
    }
    Ok(())
}
