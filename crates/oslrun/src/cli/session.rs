//! How a run is set up from its options: the grid, the services, the threads and the progress bar; and the
//! message for a run that stops early. This module must not know what is computed or where results go.

use super::Failure;
use super::args::RunArgs;
use super::load::TextureFiles;
use super::profile;
use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use osl_exec::{Isa, RunError, RunOptions, Services, Spaces};
use osl_image::TextureCache;
use osl_scene::{Crop, Grid, set_screen_spaces};
use osl_syntax::source::SourceMap;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::error::Error;
use std::io::IsTerminal;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The points of the grid.
pub(super) fn grid(args: &RunArgs) -> Grid {
    Grid {
        width: args.grid.0,
        height: args.grid.1,
        scale: args.uv_scale.0,
        offset: args.uv_offset.0,
        center: args.center,
    }
}

/// The points of the picture: those of the crop, or of the whole grid.
pub(super) fn points(args: &RunArgs) -> Crop {
    match &args.crop {
        Some(crop) => Crop::new(grid(args), crop.columns.clone(), crop.rows.clone()),
        None => Crop::none(grid(args)),
    }
}

/// The spaces of a grid, with those of the image.
pub(super) fn grid_spaces(args: &RunArgs) -> Spaces {
    let mut spaces = Spaces::default();
    set_screen_spaces(&mut spaces, args.grid.0, args.grid.1);
    spaces
}

/// The spaces of a scene, and those of the command line, which take precedence.
pub(super) fn spaces(args: &RunArgs, mut spaces: Spaces) -> Spaces {
    for (name, matrix) in [("shader", &args.shader_space), ("object", &args.object_space)] {
        if let Some(matrix) = matrix {
            spaces.set(name, **matrix);
        }
    }
    spaces
}

/// The services of the renderer, with the spaces of a scene.
pub(super) fn services(args: &RunArgs, files: TextureFiles, scene: Spaces) -> Services {
    let mut folders = vec![files.folder];
    folders.extend(args.texture_path.iter().cloned());
    let mut limits = args.read.limits.limits().clone();
    if let Some(mebibytes) = args.texture_memory {
        limits.images.texture_memory = mebibytes.saturating_mul(1 << 20);
    }
    let is_typed = |text: &String| args.live.as_ref().is_none_or(|live| live.typed.contains(text));
    let typed =
        files.typed.into_iter().filter(is_typed).chain(args.userdata.iter().map(|(_, value)| value.clone()));
    let textures = TextureCache::within(folders, &limits).allow_files(args.allow_files).trusting(typed);
    Services { ray: args.raytype.clone(), spaces: spaces(args, scene), textures, ..Services::default() }
}

/// The run options of the command line.
pub(super) fn options(args: &RunArgs) -> RunOptions {
    let mut limits = args.read.limits.limits().clone();
    if let Some(steps) = args.max_steps {
        limits.running.point_steps = steps;
    }
    RunOptions {
        limits,
        batch: args.batch.map(|n| n as usize),
        isa: args.isa.unwrap_or_else(Isa::detect),
        closures: args.closures,
        weights: true,
        profile: args.profile.as_ref().map(|_| profile::CLOCK),
        steps: args.steps,
        ..RunOptions::default()
    }
}

/// Runs the work on the requested number of threads; all cores without a number.
pub(super) fn on_threads<T: Send>(
    threads: Option<u16>,
    work: impl FnOnce() -> T + Send,
) -> Result<T, Failure> {
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
pub(super) fn pool(threads: usize) -> Result<ThreadPool, String> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|why| format!("cannot start {threads} threads: {why}"))
}

/// The message for a run that stopped early.
pub(super) fn stopped(stop: &RunError, sources: &SourceMap) -> Failure {
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

/// How long a command runs before it shows progress.
const PATIENCE: Duration = Duration::from_millis(500);

/// A progress bar on a terminal, for work that takes more than a moment; nothing in logs. `unit` is the name
/// of what is counted, or empty if that is only a share of the work.
pub(super) fn progress(total: u64, unit: &'static str) -> Progress {
    let template = match unit {
        "" => "{bar:40} {percent:>3}% {elapsed} {eta}",
        _ => "{bar:40} {percent:>3}% {rate} {eta}",
    };
    let rate = move |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        let _ = write!(text, "{} {unit}/s", HumanCount(state.per_sec() as u64));
    };
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("rate", rate));
    }
    Progress { bar, is_shown: AtomicBool::new(!std::io::stderr().is_terminal()), started: Instant::now() }
}

/// A progress bar that appears after half a second.
pub(super) struct Progress {
    bar: ProgressBar,
    is_shown: AtomicBool,
    started: Instant,
}

impl Progress {
    /// Sets how much is done.
    pub(super) fn at(&self, done: u64) {
        self.bar.set_position(done);
        self.appear();
    }

    /// Adds to what is done.
    pub(super) fn add(&self, more: u64) {
        self.bar.inc(more);
        self.appear();
    }

    fn appear(&self) {
        if self.started.elapsed() >= PATIENCE && !self.is_shown.swap(true, Ordering::Relaxed) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(Duration::from_millis(200));
        }
    }

    /// Removes the bar.
    pub(super) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

/// A line on a terminal that says what a command does for about `seconds`; nothing in logs.
pub(super) fn busy(what: &'static str, seconds: f64) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner().with_message(format!("{what}, about {seconds} s"));
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}: {elapsed} so far") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
