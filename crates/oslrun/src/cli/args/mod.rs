//! Options that several commands share: how a source is read, a group, and how a shader is run.
//!
//! A group of options whose values need more than a line has a module here: `bounds`, `display`, `globals`,
//! `levels`, `limits`. Options of one command are declared beside the command. This module must not know
//! commands.

pub(super) mod bounds;
pub(super) mod display;
pub(super) mod globals;
pub(super) mod levels;
pub(super) mod limits;
pub(super) mod values;

use bounds::{Bounds, bounds};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{ArgGroup, Args, ValueEnum};
use display::DisplayArgs;
use globals::GlobalArgs;
use levels::LintArgs;
use limits::LimitArgs;
use osl_exec::Isa;
use osl_image::{DataWindow, ExrCompression};
use osl_ir::passes::Pass;
use osl_lower::taps::TapPath;
use osl_measure::sample::{FilterKind, MAX_SAMPLES, Rate};
use osl_numeric::Arithmetic;
use osl_scene::glam::Vec3;
use osl_syntax::Version;
use std::path::PathBuf;
use std::time::Duration;
use values::{
    Crop, Gained, Pair, amount, arithmetic, assignment, compression, crop, duration, error, filter, gained,
    grid, image_file, isa, matrix, pair, pass, position, rate,
};

/// The headings under which `--help` lists the options.
pub(super) mod heading {
    pub(in crate::cli) const PICTURE: &str = "Picture";
    pub(in crate::cli) const DISPLAY: &str = "From values to colors (PNG and JPEG)";
    pub(in crate::cli) const VALUES: &str = "Values for the shader";
    pub(in crate::cli) const POINTS: &str = "Points";
    pub(in crate::cli) const SAMPLES: &str = "Samples and accuracy";
    pub(in crate::cli) const SURFACE: &str = "Surface";
    pub(in crate::cli) const PREVIEW: &str = "Preview with light";
    pub(in crate::cli) const GROUP: &str = "Group of shaders";
    pub(in crate::cli) const READING: &str = "Reading the source";
    pub(in crate::cli) const FILES: &str = "Files";
    pub(in crate::cli) const MESSAGES: &str = "Errors and warnings";
    pub(in crate::cli) const MEASURING: &str = "Statistics";
    pub(in crate::cli) const RUNNING: &str = "Running";
    pub(in crate::cli) const LIMITS: &str = "Limits";
}

/// How far an `#include` may lead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Reach {
    /// To the folder of the main file, the working directory, and the folders of `-I`.
    Folders,
    /// Also to the project of the main file.
    #[default]
    Project,
    /// Also to any file that is named relative to the including file, as in compilers.
    Relative,
}

/// How a source file is read.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct ReadArgs {
    /// Folder to search for #include files; may be repeated.
    #[arg(short = 'I', value_name = "DIR", help_heading = heading::READING)]
    pub(super) include: Vec<PathBuf>,
    /// Macro to define before reading, NAME or NAME=VALUE; may be repeated.
    #[arg(short = 'D', value_name = "NAME[=VALUE]", help_heading = heading::READING)]
    pub(super) define: Vec<String>,
    /// Accept exactly what the reference compiler accepts.
    #[arg(long, help_heading = heading::READING)]
    pub(super) strict_syntax: bool,
    /// Version of the language, 1.13 or 1.15 (default: 1.13): the value of OSL_VERSION, and what linearstep
    /// returns where its first edge is above the second.
    #[arg(long, value_name = "VERSION", value_parser = version, help_heading = heading::READING)]
    pub(super) osl_version: Option<Version>,
    /// How errors and warnings are printed.
    #[arg(long, value_enum, default_value_t, help_heading = heading::MESSAGES)]
    pub(super) message_format: MessageFormat,
    /// How far an #include may lead.
    #[arg(skip)]
    pub(super) reach: Reach,
    /// The limits of the command.
    #[command(flatten)]
    pub(super) limits: LimitArgs,
}

/// The version with a name.
pub(super) fn version(name: &str) -> Result<Version, String> {
    Version::named(name)
        .ok_or_else(|| format!("the versions of the language are 1.13 and 1.15, not `{name}`"))
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
#[derive(Clone, Debug, Args)]
pub(super) struct RunArgs {
    /// The shader file: a source, a compiled shader (.oso), or the text of a group (.group, .oslgroup, .txt).
    #[arg(required_unless_present_any = ["group", "layer"], value_name = "FILE.osl")]
    pub(super) file: Option<PathBuf>,
    /// A group of shaders.
    #[command(flatten)]
    pub(super) network: NetworkArgs,
    /// Image to write: .exr holds all outputs; with .png, .tif or .jpg, each output has its own file. One
    /// output is written to FILE itself; several are written to `name.OUTPUT.png`. `{output}` in the name
    /// stands for the output. `-` is the standard output.
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(image_file), help_heading = heading::PICTURE)]
    pub(super) output: Option<PathBuf>,
    /// Outputs to compute and write, separated by commas (default: all; of a group, all of the last layer).
    /// Outputs of other layers are named LAYER.OUTPUT.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', help_heading = heading::PICTURE)]
    pub(super) outputs: Option<Vec<String>>,
    /// Make an output of a variable at a line: its value after the statement on LINE. If a point reaches the
    /// line several times, the last value counts, or with @N the value of the Nth time. VAR may be a field or
    /// an element: s.x, list[2]. CALL/LINE:VAR is inside a function, as called on line CALL; FILE:LINE:VAR is
    /// in an included file or in another layer. The output is called lineLINE.VAR, or lineLINE.VAR.roundN
    /// with @N. A second output, with .reached after this name, is 1 where a point reached the line (with @N:
    /// at least N times) and 0 elsewhere. Without --outputs, only taps are shown. May be repeated.
    #[arg(long, value_name = "LINE:VAR", value_parser = TapPath::parse, help_heading = heading::PICTURE)]
    pub(super) tap: Vec<TapPath>,
    /// Points of the grid, or pixels of the view.
    #[arg(short, long, value_name = "WxH", default_value = "512x512", value_parser = grid, help_heading = heading::POINTS)]
    pub(super) grid: (usize, usize),
    /// Place points at pixel centres instead of from border to border.
    #[arg(long, help_heading = heading::POINTS)]
    pub(super) center: bool,
    /// Compute only these columns and rows of the grid, from X0 up to but not including X1, and Y0 up to Y1.
    /// The pixels have the values that they have in the whole picture. An EXR file says where in the whole
    /// picture they are.
    #[arg(long, value_name = "X0,X1,Y0,Y1", value_parser = crop, allow_hyphen_values = true, help_heading = heading::POINTS)]
    pub(super) crop: Option<Crop>,
    /// Factors for u and v, to show more of the pattern.
    #[arg(long, value_name = "U,V", default_value = "1,1", value_parser = pair, allow_hyphen_values = true, help_heading = heading::POINTS)]
    pub(super) uv_scale: Pair,
    /// Offsets that are added to u and v.
    #[arg(long, value_name = "U,V", default_value = "0,0", value_parser = pair, allow_hyphen_values = true, help_heading = heading::POINTS)]
    pub(super) uv_offset: Pair,
    /// How values become colors.
    #[command(flatten)]
    pub(super) display: DisplayArgs,
    /// A surface to shade instead of the grid.
    #[command(flatten)]
    pub(super) on: OnArgs,
    /// The samples of each pixel.
    #[command(flatten)]
    pub(super) sampling: SampleArgs,
    /// Value of a parameter; may be repeated: radius=0.3, tint=1,0.5,0, tint=#ff8800 (converted from sRGB to
    /// linear, as color pickers mean it), spacename=object, and for an int with the metadata `mapper` a name
    /// in it, as in mode=Radial. In a group, the
    /// parameter belongs to the last layer; LAYER.NAME=VALUE sets one of another layer. Of a number,
    /// radius=0.1:0.5:5 are 5 values from 0.1 to 0.5: the run makes a sheet of pictures, a row for one such
    /// parameter and a table for two.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment, help_heading = heading::VALUES)]
    pub(super) params: Vec<(String, String)>,
    /// Matrix from shader to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true, help_heading = heading::VALUES)]
    pub(super) shader_space: Option<Box<[f32; 16]>>,
    /// Matrix from object to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true, help_heading = heading::VALUES)]
    pub(super) object_space: Option<Box<[f32; 16]>>,
    /// Data that the surface provides by name: attributes, and values of parameters with `lockgeom = 0` or
    /// `interpolated = 1`. The value is read as the type that the shader requests: numbers and elements of
    /// arrays are separated by commas, one number is also a color, text in quotes is a string only; may be
    /// repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment, help_heading = heading::VALUES)]
    pub(super) userdata: Vec<(String, String)>,
    /// JSON file of attributes: {"name": value, "object": {"name": value}}. 3 is an int, 3.0 a float, [r, g,
    /// b] a triple.
    #[arg(long, value_name = "FILE", help_heading = heading::VALUES)]
    pub(super) attributes: Option<PathBuf>,
    /// The globals of the shader.
    #[command(flatten)]
    pub(super) globals: GlobalArgs,
    /// Write 16-bit floats (EXR).
    #[arg(long, help_heading = heading::PICTURE)]
    pub(super) half: bool,
    /// Compression of EXR files: none, rle, zip1, zip16, piz, pxr24.
    #[arg(long, value_name = "NAME", default_value = "zip16", value_parser = compression, help_heading = heading::PICTURE)]
    pub(super) compression: ExrCompression,
    /// Do not write the command line into EXR files.
    #[arg(long, help_heading = heading::PICTURE)]
    pub(super) no_command: bool,
    /// Insert missing brackets before running, also in the shaders of a group; the edits are shown.
    #[arg(long, help_heading = heading::READING)]
    pub(super) repair: bool,
    /// With --repair: save the repaired source here. It may be the shader file itself.
    #[arg(long, value_name = "FILE.osl", requires = "repair", help_heading = heading::READING)]
    pub(super) write: Option<PathBuf>,
    /// Print times, points per second, and what each pass did.
    #[arg(long, help_heading = heading::MEASURING)]
    pub(super) stats: bool,
    /// Add an output `steps`: the work that each point takes, in steps as the limit --max-steps counts them.
    /// In some shaders it also depends on --batch.
    #[arg(long, conflicts_with_all = ["on", "samples", "filter", "shading_rate", "adaptive", "max_error", "within"], help_heading = heading::MEASURING)]
    pub(super) steps: bool,
    /// Print how the values of each output are distributed: range, mean, standard deviation, and a bar for
    /// each sixteenth of the range.
    #[arg(long, help_heading = heading::MEASURING)]
    pub(super) histogram: bool,
    /// Print the processor time spent in each instruction and line, the least of five runs; with a file, also
    /// write a flame graph: an image (.svg), or its folded stacks.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, help_heading = heading::MEASURING)]
    pub(super) profile: Option<Option<PathBuf>>,
    /// Threads (default: all cores).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = heading::RUNNING)]
    pub(super) threads: Option<u16>,
    /// Points per batch: each instruction runs on so many at once (default: chosen for the shader).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536), help_heading = heading::RUNNING)]
    pub(super) batch: Option<u32>,
    /// Instruction set (default: the widest that this machine has).
    #[arg(long, value_name = "NAME", value_parser = isa, help_heading = heading::RUNNING)]
    pub(super) isa: Option<Isa>,
    /// Arithmetic: strict, the same bits on every machine; fast, cheaper approximations in single precision;
    /// f64, double precision (default: strict).
    #[arg(long, value_name = "NAME", value_parser = arithmetic, help_heading = heading::RUNNING)]
    pub(super) arithmetic: Option<Arithmetic>,
    /// Show the closures of the surface, and write their weights as layers.
    #[arg(long, help_heading = heading::PICTURE)]
    pub(super) closures: bool,
    /// Kind of ray for which the shader runs.
    #[arg(long, value_name = "NAME", default_value = "camera", help_heading = heading::VALUES)]
    pub(super) raytype: String,
    /// Folder to search for textures, after the working directory and the shader's own folder; may be
    /// repeated.
    #[arg(long, value_name = "DIR", help_heading = heading::FILES)]
    pub(super) texture_path: Vec<PathBuf>,
    /// Memory for textures (default: 1024); the same as `--limit images.texture_memory`.
    #[arg(long, value_name = "MIB", help_heading = heading::RUNNING)]
    pub(super) texture_memory: Option<u64>,
    /// Let the shader include, open and append to any file, not only those below the working directory, the
    /// shader's own folder, and the folders of -I and the paths.
    #[arg(long, help_heading = heading::FILES)]
    pub(super) allow_files: bool,
    /// Maximum number of steps per point, such as 100M: the same as --limit running.point_steps=N.
    #[arg(long, value_name = "N", value_parser = amount, help_heading = heading::RUNNING)]
    pub(super) max_steps: Option<u64>,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass, help_heading = heading::RUNNING)]
    pub(super) without_pass: Vec<Pass>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
    /// The command line for EXR files.
    #[arg(skip)]
    pub(super) command: Option<String>,
    /// Set if the values come from a page.
    #[arg(skip)]
    pub(super) live: Option<Live>,
}

/// A run whose values do not come from the command line: it appends to no files, and reads no others for the
/// names that it was given.
#[derive(Clone, Debug, Default)]
pub(super) struct Live {
    /// Values of parameters on the command line, which may name any file.
    pub(super) typed: Vec<String>,
}

impl RunArgs {
    /// Columns and rows of the picture: of the crop, or of the whole grid.
    pub(super) fn size(&self) -> (usize, usize) {
        self.crop.as_ref().map_or(self.grid, |crop| (crop.columns.len(), crop.rows.len()))
    }

    /// Where the picture is in the whole one, if it is a part of it.
    pub(super) fn part(&self) -> Option<DataWindow> {
        self.crop.as_ref()?.part(self.grid)
    }
}

/// A group of shaders, and how its layers are connected.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct NetworkArgs {
    /// The text of a group: "shader noisy n; shader mixer m; connect n.out m.a".
    #[arg(long, value_name = "TEXT", help_heading = heading::GROUP)]
    pub(super) group: Option<String>,
    /// A layer; may be repeated. If FILE is given, it is the last layer.
    #[arg(long, value_name = "NAME=SHADER", value_parser = assignment, help_heading = heading::GROUP)]
    pub(super) layer: Vec<(String, String)>,
    /// A connection from an earlier layer to a later one; may be repeated.
    #[arg(long, value_name = "LAYER.OUTPUT=LAYER.PARAM", value_parser = assignment, help_heading = heading::GROUP)]
    pub(super) connect: Vec<(String, String)>,
    /// Folder to search for the shaders of a group, after the folder of FILE and the working directory; may
    /// be repeated.
    #[arg(long, value_name = "DIR", help_heading = heading::FILES)]
    pub(super) shader_path: Vec<PathBuf>,
    /// Name of the group; shaders can ask for it.
    #[arg(long, value_name = "NAME", default_value = "unnamed_group_1", help_heading = heading::GROUP)]
    pub(super) group_name: String,
}

impl NetworkArgs {
    /// Whether only a file is given.
    pub(super) fn is_empty(&self) -> bool {
        self.group.is_none() && self.layer.is_empty() && self.connect.is_empty()
    }
}

/// A surface to shade.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("seen").multiple(true))]
pub(super) struct OnArgs {
    /// Shade what a camera sees of a surface: sphere, cylinder, torus, plane, cube, or a mesh from a file
    /// (.obj).
    #[arg(long, value_name = "SURFACE", group = "seen", conflicts_with_all = ["center", "closures", "profile"], help_heading = heading::SURFACE)]
    pub(super) on: Option<String>,
    /// Displace the surface by this output first: a float moves along the normal, a vector is an offset, a
    /// point is the new position. A gain multiplies the movement (default: 1).
    #[arg(long, value_name = "OUTPUT[,GAIN]", requires = "seen", value_parser = gained, allow_hyphen_values = true, help_heading = heading::SURFACE)]
    pub(super) displace: Option<Gained>,
    /// Maximum length in pixels of an edge in the picture, for a displaced or smooth surface (default: 1, or
    /// 5 with --preview).
    #[arg(long, value_name = "N", requires = "seen", help_heading = heading::SURFACE)]
    pub(super) edge_pixels: Option<f64>,
    /// Split each face into four this many times, regardless of its size in the picture.
    #[arg(long, value_name = "N", requires = "seen", help_heading = heading::SURFACE)]
    pub(super) level: Option<u32>,
    /// Treat the mesh as the control mesh of a smooth surface (Catmull-Clark).
    #[arg(long, requires = "seen", help_heading = heading::SURFACE)]
    pub(super) catmull_clark: bool,
    /// Position of the camera; it looks at the middle of the surface.
    #[arg(long, value_name = "X,Y,Z", requires = "seen", value_parser = position, allow_hyphen_values = true, help_heading = heading::SURFACE)]
    pub(super) eye: Option<Vec3>,
}

/// The options for samples.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct SampleArgs {
    /// Samples per pixel (default: 1, at its centre); with --adaptive and --max-error the maximum per pixel
    /// (default: 1024 and 4096).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)), allow_negative_numbers = true, help_heading = heading::SAMPLES)]
    pub(super) samples: Option<u32>,
    /// Filter of the pixels: box, gaussian, blackman-harris or mitchell, and its width in pixels (default: 1,
    /// 2, 3, 4). A single sample is always at the centre.
    #[arg(long, value_name = "NAME[,WIDTH]", value_parser = filter, help_heading = heading::SAMPLES)]
    pub(super) filter: Option<(FilterKind, f32)>,
    /// Compute one pixel of 2x1, 2x2 or 4x4, and interpolate the others.
    #[arg(long, value_name = "WxH", value_parser = rate, conflicts_with_all = ["samples", "filter", "adaptive", "max_error", "within"], help_heading = heading::SAMPLES)]
    pub(super) shading_rate: Option<Rate>,
    /// Take samples until the standard error of a pixel is at most this, in the units of the outputs.
    #[arg(long, value_name = "ERROR", value_parser = error, allow_negative_numbers = true, conflicts_with = "max_error", help_heading = heading::SAMPLES)]
    pub(super) adaptive: Option<f32>,
    /// Keep the error of 999 in 1000 pixels below this with as little work as possible: pixels are
    /// interpolated where the shader is smooth, and have many samples where it is not. 0.01 is in the units
    /// of the outputs; 2% is a share of the range of each output, which is measured first. color=2%,mask=0.01
    /// sets the error of single outputs. The fast arithmetic is used if its error is much smaller, unless
    /// --arithmetic is given. With --stats the error is checked. If the bound is missed, a warning says so,
    /// and the exit code is 1. With --preview, it is the standard error of the light, which a screen shows
    /// from 0 to 1.
    #[arg(long, value_name = "ERROR", value_parser = bounds, allow_hyphen_values = true, help_heading = heading::SAMPLES)]
    pub(super) max_error: Option<Bounds>,
    /// Take as many samples in each pixel as fit into this time: 5s, 0.5s, 500ms. It is the time from the
    /// start of the command until the picture is computed. A report shows the number of samples and the
    /// error; --samples with this number makes the same picture.
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true, conflicts_with_all = ["samples", "adaptive", "max_error", "prefilter"], help_heading = heading::SAMPLES)]
    pub(super) within: Option<Duration>,
    /// Filter steps, comparisons and noise over the area of a sample, so that fewer samples are needed. Some
    /// pixels show beforehand which of them to filter: those that help there, make none of these pixels
    /// worse, and do not cost more than two other samples. With --stats, a sentence says what is filtered.
    #[arg(long, conflicts_with_all = ["adaptive", "max_error"], help_heading = heading::SAMPLES)]
    pub(super) prefilter: bool,
}
