//! The command line: commands and their options.

use super::explain::ExplainArgs;
use super::levels::LintArgs;
use super::limits::LimitArgs;
use super::on::OnArgs;
use super::sampling::SampleArgs;
use super::stability::StabilityArgs;
use super::tradeoff::TradeoffArgs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use osl_exec::{Arithmetic, Isa};
use osl_image::ExrCompression;
use osl_ir::passes::Pass;
use std::path::PathBuf;

/// Compile and run Open Shading Language files on the CPU.
#[derive(Debug, Parser)]
#[command(name = "oslrun", version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Cli {
    /// A command other than running a shader.
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    /// Running a shader.
    #[command(flatten)]
    pub(super) run: RunArgs,
}

/// The commands other than running a shader.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Report errors and warnings of shader files.
    Check(CheckArgs),
    /// Print the intermediate representation of a shader before and after the passes.
    Ir(IrArgs),
    /// Explain an error or warning by its code, with a wrong and a right example.
    ExplainError(ExplainErrorArgs),
    /// Show what a shader does at one point, line by line, or what each output costs.
    Explain(Box<ExplainArgs>),
    /// Find inputs for which a shader becomes inaccurate, and the lines that cause it.
    Stability(Box<StabilityArgs>),
    /// Compile a shader to the text form that renderers load, .oso.
    Compile(CompileArgs),
    /// Show what a shader is: its kind, its parameters with types, defaults and metadata.
    Info(InfoArgs),
    /// Rewrite shader files in one style.
    Fmt(FmtArgs),
    /// Describe the built-in functions: signatures, derivatives, extremes, an example.
    Doc(DocArgs),
    /// Measure what more and fewer samples of a shader cost, and how large their errors are.
    Tradeoff(Box<TradeoffArgs>),
    /// Render a picture of a scene file: lighting, with the shaders of its materials.
    Render(RenderArgs),
}

/// How a source file is read.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct ReadArgs {
    /// Folder to search for #include files; may be repeated.
    #[arg(short = 'I', value_name = "DIR")]
    pub(super) include: Vec<PathBuf>,
    /// Macro to define before reading, NAME or NAME=VALUE; may be repeated.
    #[arg(short = 'D', value_name = "NAME[=VALUE]")]
    pub(super) define: Vec<String>,
    /// Accept exactly what the reference compiler accepts.
    #[arg(long)]
    pub(super) strict_syntax: bool,
    /// How errors and warnings are printed.
    #[arg(long, value_enum, default_value_t)]
    pub(super) message_format: MessageFormat,
    /// The limits of the command.
    #[command(flatten)]
    pub(super) limits: LimitArgs,
}

/// How errors and warnings are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum MessageFormat {
    /// With excerpts of the source.
    #[default]
    Human,
    /// One JSON object per line.
    Json,
}

/// How a shader is run.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// The shader file: a source, a compiled shader (.oso), or the text of a group (.group, .oslgroup, .txt).
    #[arg(required_unless_present_any = ["group", "layer"], value_name = "FILE.osl")]
    pub(super) file: Option<PathBuf>,
    /// A group of shaders.
    #[command(flatten)]
    pub(super) network: NetworkArgs,
    /// Image to write: .exr holds all outputs; with .png, each output has its own file.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Outputs to compute and write, separated by commas (default: all; of a group, all of the last layer).
    /// Outputs of other layers are named LAYER.OUTPUT.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
    /// Points of the grid, or pixels of the view.
    #[arg(short, long, value_name = "WxH", default_value = "512x512", value_parser = grid)]
    pub(super) grid: (usize, usize),
    /// Place points at pixel centres instead of from border to border.
    #[arg(long)]
    pub(super) center: bool,
    /// Factors for u and v, to show more of the pattern.
    #[arg(long, value_name = "U,V", default_value = "1,1", value_parser = pair, allow_hyphen_values = true)]
    pub(super) uv_scale: Pair,
    /// Offsets that are added to u and v.
    #[arg(long, value_name = "U,V", default_value = "0,0", value_parser = pair, allow_hyphen_values = true)]
    pub(super) uv_offset: Pair,
    /// A surface to shade instead of the grid.
    #[command(flatten)]
    pub(super) on: OnArgs,
    /// The samples of each pixel.
    #[command(flatten)]
    pub(super) sampling: SampleArgs,
    /// Value of a parameter; may be repeated: radius=0.3, tint=1,0.5,0, spacename=object. In a group, the
    /// parameter belongs to the last layer; LAYER.NAME=VALUE sets one of another layer.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) params: Vec<(String, String)>,
    /// Matrix from shader to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true)]
    pub(super) shader_space: Option<Box<[f32; 16]>>,
    /// Matrix from object to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true)]
    pub(super) object_space: Option<Box<[f32; 16]>>,
    /// Data that the surface provides by name: attributes, and values of parameters with `lockgeom = 0` or
    /// `interpolated = 1`. One number is a float, three are a triple, everything else is a string; may be
    /// repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) userdata: Vec<(String, String)>,
    /// JSON file of attributes: {"name": value, "object": {"name": value}}. 3 is an int, 3.0 a float, [r, g,
    /// b] a triple.
    #[arg(long, value_name = "FILE")]
    pub(super) attributes: Option<PathBuf>,
    /// Write 16-bit floats (EXR).
    #[arg(long)]
    pub(super) half: bool,
    /// Compression of EXR files: none, rle, zip1, zip16, piz, pxr24.
    #[arg(long, value_name = "NAME", default_value = "zip16", value_parser = compression)]
    pub(super) compression: ExrCompression,
    /// Insert missing brackets before running, also in the shaders of a group; the edits are shown.
    #[arg(long)]
    pub(super) repair: bool,
    /// With --repair: save the repaired source here.
    #[arg(long, value_name = "FILE.osl", requires = "repair")]
    pub(super) write: Option<PathBuf>,
    /// Print times, points per second, and what each pass did.
    #[arg(long)]
    pub(super) stats: bool,
    /// Print the time spent in each instruction and line; with a file, also write a flame graph: an image
    /// (.svg), or its folded stacks.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    pub(super) profile: Option<Option<PathBuf>>,
    /// Threads (default: all cores).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Points per batch: each instruction runs on so many at once (default: chosen for the shader).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(super) batch: Option<u32>,
    /// Instruction set (default: the widest that this machine has).
    #[arg(long, value_name = "NAME", value_parser = isa)]
    pub(super) isa: Option<Isa>,
    /// Arithmetic: strict, the same bits on every machine; fast, cheaper approximations in single precision;
    /// f64, double precision (default: strict).
    #[arg(long, value_name = "NAME", value_parser = arithmetic)]
    pub(super) arithmetic: Option<Arithmetic>,
    /// Show the closures of the surface, and write their weights as layers.
    #[arg(long)]
    pub(super) closures: bool,
    /// Kind of ray for which the shader runs.
    #[arg(long, value_name = "NAME", default_value = "camera")]
    pub(super) raytype: String,
    /// Folder to search for textures, after the working directory and the shader's own folder; may be
    /// repeated.
    #[arg(long, value_name = "DIR")]
    pub(super) texture_path: Vec<PathBuf>,
    /// Memory for textures (default: 1024); the same as `--limit images.texture_memory`.
    #[arg(long, value_name = "MIB")]
    pub(super) texture_memory: Option<u64>,
    /// Let the shader include, open and append to any file, not only those below the working directory, the
    /// shader's own folder, and the folders of -I and the paths.
    #[arg(long)]
    pub(super) allow_files: bool,
    /// Maximum number of steps per point: --limit running.point_steps=N.
    #[arg(long, value_name = "N")]
    pub(super) max_steps: Option<u64>,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass)]
    pub(super) without_pass: Vec<Pass>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// A group of shaders, and how its layers are connected.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct NetworkArgs {
    /// The text of a group: "shader noisy n; shader mixer m; connect n.out m.a".
    #[arg(long, value_name = "TEXT")]
    pub(super) group: Option<String>,
    /// A layer; may be repeated. If FILE is given, it is the last layer.
    #[arg(long, value_name = "NAME=SHADER", value_parser = assignment)]
    pub(super) layer: Vec<(String, String)>,
    /// A connection from an earlier layer to a later one; may be repeated.
    #[arg(long, value_name = "LAYER.OUTPUT=LAYER.PARAM", value_parser = assignment)]
    pub(super) connect: Vec<(String, String)>,
    /// Folder to search for the shaders of a group, after the folder of FILE and the working directory; may
    /// be repeated.
    #[arg(long, value_name = "DIR")]
    pub(super) shader_path: Vec<PathBuf>,
    /// Name of the group; shaders can ask for it.
    #[arg(long, value_name = "NAME", default_value = "unnamed_group_1")]
    pub(super) group_name: String,
}

impl NetworkArgs {
    /// Whether only a file is given.
    pub(super) fn is_empty(&self) -> bool {
        self.group.is_none() && self.layer.is_empty() && self.connect.is_empty()
    }
}

/// Which files to check.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Shader files.
    #[arg(required = true, value_name = "FILE.osl")]
    pub(super) files: Vec<PathBuf>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the files.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Which IR to print.
#[derive(Debug, Args)]
pub(super) struct IrArgs {
    /// The shader file, or the text of a group.
    #[arg(required_unless_present_any = ["group", "layer"], value_name = "FILE.osl")]
    pub(super) file: Option<PathBuf>,
    /// A group of shaders.
    #[command(flatten)]
    pub(super) network: NetworkArgs,
    /// Value of a parameter; may be repeated.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) params: Vec<(String, String)>,
    /// Outputs to keep, separated by commas (default: all).
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
    /// Which stage to print.
    #[arg(long, value_enum, default_value_t)]
    pub(super) stage: Stage,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass)]
    pub(super) without_pass: Vec<Pass>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Which shader to compile.
#[derive(Debug, Args)]
pub(super) struct CompileArgs {
    /// The shader file.
    #[arg(value_name = "FILE.osl")]
    pub(super) file: PathBuf,
    /// File to write; - is the standard output (default: the shader file's name with .oso, in the working
    /// directory).
    #[arg(short, long, value_name = "FILE.oso")]
    pub(super) output: Option<PathBuf>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Which shader to show.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// The shader file, a source or compiled.
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    pub(super) json: bool,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Which diagnostic to explain.
#[derive(Debug, Args)]
pub(super) struct ExplainErrorArgs {
    /// A code such as E0201 or W0312, or a name such as integer-division.
    #[arg(value_name = "CODE", required_unless_present = "list")]
    pub(super) code: Option<String>,
    /// List all codes with their titles.
    #[arg(long)]
    pub(super) list: bool,
}

/// Which files to format.
#[derive(Debug, Args)]
pub(super) struct FmtArgs {
    /// Shader files; - formats the standard input to the standard output.
    #[arg(required = true, value_name = "FILE.osl")]
    pub(super) files: Vec<PathBuf>,
    /// Write nothing: list the files that would change, and fail if there are any.
    #[arg(long)]
    pub(super) check: bool,
    /// With --check, show what would change.
    #[arg(long, requires = "check")]
    pub(super) diff: bool,
    /// The options for reading the files.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Which function to describe.
#[derive(Debug, Args)]
pub(super) struct DocArgs {
    /// A function, such as smoothstep (default: list all).
    #[arg(value_name = "NAME")]
    pub(super) name: Option<String>,
    /// Print the whole reference as Markdown: docs/builtins.md.
    #[arg(long, conflicts_with = "name")]
    pub(super) markdown: bool,
}

/// What to render.
#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    /// The scene.
    #[arg(value_name = "SCENE.ass")]
    pub(super) file: PathBuf,
    /// Image to write: .exr holds the light and all layers, .png the light as displayed on a screen.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Size of the picture (default: the size in the scene).
    #[arg(long, value_name = "WxH", value_parser = grid)]
    pub(super) size: Option<(usize, usize)>,
    /// Paths per pixel (default: the number in the scene).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(super) samples: Option<u32>,
    /// Stop when the standard error of a pixel, as displayed (0 to 1), is at most this.
    #[arg(long, value_name = "E", value_parser = fraction)]
    pub(super) max_error: Option<f32>,
    /// Seed of the random numbers; another seed gives different noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u32,
    /// Threads (default: all cores); the picture does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Folder to search for shaders, textures and included scenes, after the scene's own folder; may be
    /// repeated.
    #[arg(long, value_name = "DIR")]
    pub(super) search_path: Vec<PathBuf>,
    /// Let the scene and its shaders open any file, not only those below the working directory and the search
    /// paths.
    #[arg(long)]
    pub(super) allow_files: bool,
    /// Insert missing brackets into shaders.
    #[arg(long)]
    pub(super) repair: bool,
    /// Write 16-bit floats (EXR).
    #[arg(long)]
    pub(super) half: bool,
    /// Print times, rays per second, and the mean error.
    #[arg(long)]
    pub(super) stats: bool,
    /// With `errors`: fail the run, and write no image, if a shader reports an error while it runs.
    #[arg(long, value_name = "errors", value_parser = ["errors"])]
    pub(super) deny: Option<String>,
    /// The options for reading shaders.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Stages of the IR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Stage {
    /// Before and after the passes.
    #[default]
    Both,
    /// As lowered.
    Before,
    /// After the passes.
    After,
}

pub(super) fn grid(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("a grid is WIDTHxHEIGHT, such as 512x512, not `{text}`");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let (w, h): (usize, usize) = (w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?);
    match w.checked_mul(h) {
        Some(0) => Err("a grid has at least one point in each direction".to_string()),
        Some(_) => Ok((w, h)),
        None => Err("so many points cannot be counted".to_string()),
    }
}

fn fraction(text: &str) -> Result<f32, String> {
    let wrong = || format!("a number above 0 and up to 1, not `{text}`");
    text.parse().ok().filter(|x| *x > 0.0 && *x <= 1.0).ok_or_else(wrong)
}

/// Two numbers, for u and v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair(pub(super) [f32; 2]);

pub(super) fn pair(text: &str) -> Result<Pair, String> {
    let wrong = || format!("two numbers separated by a comma, not `{text}`");
    let (u, v) = text.split_once(',').ok_or_else(wrong)?;
    let number = |t: &str| t.trim().parse::<f32>().ok().filter(|x| x.is_finite()).ok_or_else(wrong);
    Ok(Pair([number(u)?, number(v)?]))
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE"))?;
    Ok((name.trim().to_string(), value.to_string()))
}

fn matrix(text: &str) -> Result<Box<[f32; 16]>, String> {
    let numbers: Result<Vec<f32>, _> =
        text.split([',', ' ']).filter(|p| !p.is_empty()).map(str::parse).collect();
    let numbers = numbers.map_err(|_| "a matrix is 16 numbers separated by commas".to_string())?;
    let count = numbers.len();
    numbers.try_into().map(Box::new).map_err(|_| format!("a matrix is 16 numbers, not {count}"))
}

fn compression(text: &str) -> Result<ExrCompression, String> {
    ExrCompression::from_name(text).ok_or_else(|| format!("one of {}", ExrCompression::NAMES.join(", ")))
}

fn isa(text: &str) -> Result<Isa, String> {
    let names: Vec<&str> = Isa::all().into_iter().map(Isa::name).collect();
    Isa::from_name(text).ok_or_else(|| format!("this machine has {}", names.join(", ")))
}

fn arithmetic(text: &str) -> Result<Arithmetic, String> {
    let names: Vec<&str> = Arithmetic::ALL.into_iter().map(Arithmetic::name).collect();
    Arithmetic::from_name(text).ok_or_else(|| format!("one of {}", names.join(", ")))
}

fn pass(text: &str) -> Result<Pass, String> {
    let names: Vec<&str> = Pass::ALL.iter().map(|p| p.name()).collect();
    Pass::from_name(text).ok_or_else(|| format!("the passes are {}", names.join(", ")))
}
