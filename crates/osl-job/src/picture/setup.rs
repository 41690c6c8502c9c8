//! What each run needs: the points of the grid, the services of the renderer, and threads; and the message
//! for a run that stops early.

use crate::Failure;
use crate::report::profile;
use crate::request::Image;
use crate::request::Trust;
use crate::source::load::TextureFiles;
use osl_exec::{Isa, RunError, RunOptions, Services, Spaces};
use osl_scene::{Crop, Grid, set_screen_spaces};
use osl_syntax::source::SourceMap;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::error::Error;
use std::sync::OnceLock;

/// The points of the grid.
pub fn grid(image: &Image) -> Grid {
    Grid {
        width: image.points.grid.0,
        height: image.points.grid.1,
        scale: image.points.uv_scale,
        offset: image.points.uv_offset,
        center: image.points.center,
    }
}

/// The points of the picture: those of the crop, or of the whole grid.
pub fn points(image: &Image) -> Crop {
    match &image.points.crop {
        Some(crop) => Crop::new(grid(image), crop.columns.clone(), crop.rows.clone()),
        None => Crop::none(grid(image)),
    }
}

/// The spaces of a grid, with those of the image.
pub fn grid_spaces(image: &Image) -> Spaces {
    let mut spaces = Spaces::default();
    set_screen_spaces(&mut spaces, image.points.grid.0, image.points.grid.1);
    spaces
}

/// The spaces of a scene, and those of the command line, which take precedence.
pub fn spaces(image: &Image, mut spaces: Spaces) -> Spaces {
    for (name, matrix) in [("shader", &image.provided.shader_space), ("object", &image.provided.object_space)]
    {
        if let Some(matrix) = matrix {
            spaces.set(name, **matrix);
        }
    }
    spaces
}

/// The services of the renderer, with the spaces of a scene.
pub fn services(image: &Image, files: TextureFiles, scene: Spaces) -> Services {
    let mut folders = vec![files.folder];
    folders.extend(image.provided.texture_path.iter().cloned());
    let mut limits = image.limits().clone();
    if let Some(mebibytes) = image.provided.texture_memory {
        limits.images.texture_memory = mebibytes.saturating_mul(1 << 20);
    }
    let is_typed = |text: &String| match &image.trust {
        Trust::All => true,
        Trust::Only(typed) => typed.contains(text),
    };
    let userdata = image.provided.userdata.iter().map(|(_, value)| value.clone());
    let typed: Vec<String> = files.typed.into_iter().filter(is_typed).chain(userdata).collect();
    // What decides which texture a name stands for, and how many are kept.
    let key =
        || format!("{folders:?} {typed:?} {} {}", image.shader.allow_files, limits.images.texture_memory);
    let snapshot = image.snapshot();
    let textures = snapshot.textures(key, &limits, || {
        let textures = snapshot.host().textures(folders.clone(), &limits);
        textures.allow_files(image.shader.allow_files).trusting(typed.iter().cloned())
    });
    Services {
        ray: image.provided.ray.clone(),
        spaces: spaces(image, scene),
        textures,
        ..Services::default()
    }
}

/// The run options of the command line.
pub fn options(image: &Image) -> RunOptions {
    let mut limits = image.limits().clone();
    if let Some(steps) = image.running.max_steps {
        limits.running.point_steps = steps;
    }
    RunOptions {
        limits,
        batch: image.running.batch.map(|n| n as usize),
        isa: image.running.isa.unwrap_or_else(Isa::detect),
        closures: image.wanted.closures,
        weights: true,
        profile: image.running.profile.then_some(profile::CLOCK),
        steps: image.running.steps,
        ..RunOptions::default()
    }
}

/// Runs the work on the requested number of threads; all cores without a number.
pub fn on_threads<T: Send>(threads: Option<u16>, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let Some(threads) = threads else {
        start_threads()?;
        return Ok(work());
    };
    let pool = pool(usize::from(threads)).map_err(Failure::new)?;
    Ok(pool.install(work))
}

/// Starts a thread for each core, once for the process. Otherwise the first parallel loop starts them, and
/// panics if it cannot.
fn start_threads() -> Result<(), Failure> {
    static STARTED: OnceLock<Option<String>> = OnceLock::new();
    // Without a source, the error is that they have been started.
    let start = || {
        let failed = ThreadPoolBuilder::new().build_global().err()?;
        failed.source().map(ToString::to_string)
    };
    match STARTED.get_or_init(start) {
        None => Ok(()),
        Some(why) => Err(Failure::new(format!(
            "cannot start a thread for each core: {why}; --threads sets their number"
        ))),
    }
}

/// A pool of threads; 0 means all cores.
pub fn pool(threads: usize) -> Result<ThreadPool, String> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|why| format!("cannot start {threads} threads: {why}"))
}

/// The message for a run that stopped early.
pub fn stopped(stop: &RunError, sources: &SourceMap) -> Failure {
    let (span, hint) = match stop {
        RunError::TooManySteps { span, .. } => (*span, "; --max-steps sets the limit".to_string()),
        RunError::TooMuchMemory { span, .. } => {
            (*span, "; --limit running.point_memory=N sets the limit".to_string())
        }
        RunError::TooMuch { limit, .. } => (None, format!("; --limit {limit}=N sets the limit")),
        RunError::Halted(_)
        | RunError::VariesMore(_)
        | RunError::DerivsVaryMore(_)
        | RunError::Traces
        | RunError::NotAffine(_) => (None, String::new()),
    };
    let place = span
        .and_then(|span| sources.place(span))
        .map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
    Failure::new(format!("{place}{stop}{hint}"))
}
