//! What a client asks for: an [`Image`] and its parts.
//!
//! Each part says what its values mean, not which option sets them. Values that come as text are read by the
//! functions beside their types, so that all clients accept the same forms.

pub mod bounds;
pub mod globals;
pub mod lints;
pub mod values;

pub use lints::Lints;

use crate::Snapshot;
use bounds::Bounds;
use globals::GlobalValues;
use osl_exec::Isa;
use osl_image::{DataWindow, ExrCompression};
use osl_ir::passes::Pass;
use osl_limits::Limits;
use osl_lower::taps::TapPath;
use osl_measure::sample::{FilterKind, Rate};
use osl_numeric::Arithmetic;
use osl_scene::glam::Vec3;
use osl_scene::render::Curve;
use osl_syntax::Version;
use std::path::PathBuf;
use std::time::Duration;
use values::{Crop, Gained, ValueRange};

/// How far an `#include` may lead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// To the folder of the main file, the working directory, and the folders of the search path.
    Folders,
    /// Also to the project of the main file.
    #[default]
    Project,
    /// Also to any file that is named relative to the including file, as in compilers.
    Relative,
}

/// How source files are read.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// Folders to search for included files.
    pub include: Vec<PathBuf>,
    /// Macros that are defined before reading: `NAME` or `NAME=VALUE`.
    pub define: Vec<String>,
    /// Whether exactly what the reference compiler accepts is accepted.
    pub strict_syntax: bool,
    /// The version of the language.
    pub version: Option<Version>,
    /// How far an `#include` may lead.
    pub reach: Reach,
    /// The dialect of all files; without it, the one that each file shows.
    pub dialect: Option<String>,
    /// Folders of further dialects.
    pub dialect_path: Vec<PathBuf>,
    /// The limits of all work for the request.
    pub limits: Limits,
    /// Where files come from, and what was read before.
    pub snapshot: Snapshot,
}

impl Reading {
    /// Files of the disk, within limits.
    pub fn within(limits: &Limits) -> Reading {
        Reading { limits: limits.clone(), ..Reading::default() }
    }

    /// The same without any dialect, as the reference's tools read.
    #[must_use]
    pub fn plain(self) -> Reading {
        Reading { dialect: Some(osl_dialects::NONE.to_string()), ..self }
    }
}

/// A group of shaders, and how its layers are connected.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// The text of a group.
    pub group: Option<String>,
    /// Names and shaders of layers; a main file is the last layer.
    pub layer: Vec<(String, String)>,
    /// Connections, from `LAYER.OUTPUT` to `LAYER.PARAM`.
    pub connect: Vec<(String, String)>,
    /// Folders to search for shaders, after the folder of the main file and the working directory.
    pub shader_path: Vec<PathBuf>,
    /// Name of the group; shaders can ask for it.
    pub name: String,
}

impl Network {
    /// Whether only a file is given.
    pub fn is_empty(&self) -> bool {
        self.group.is_none() && self.layer.is_empty() && self.connect.is_empty()
    }
}

/// The shader, the values of its parameters, and what is wanted of it.
#[derive(Clone, Debug, Default)]
pub struct Shader {
    /// A source, a compiled shader, or the text of a group.
    pub file: Option<PathBuf>,
    /// A group of shaders.
    pub network: Network,
    /// Values of parameters, as text.
    pub params: Vec<(String, String)>,
    /// Outputs to compute; all if not given.
    pub outputs: Option<Vec<String>>,
    /// Variables at lines that become outputs.
    pub taps: Vec<TapPath>,
    /// Whether missing brackets are inserted.
    pub repair: bool,
    /// The file for a changed source, which may be the source itself.
    pub write: Option<PathBuf>,
    /// Whether the shader may open any file, not only those below the permitted folders.
    pub allow_files: bool,
    /// The warnings to report.
    pub lints: Lints,
    /// How source files are read.
    pub read: Reading,
}

/// The points of a picture.
#[derive(Clone, Debug)]
pub struct Points {
    /// Columns and rows of the grid, or pixels of the view.
    pub grid: (usize, usize),
    /// Whether points are at pixel centres instead of from border to border.
    pub center: bool,
    /// The columns and rows to compute, if not all.
    pub crop: Option<Crop>,
    /// Factors for u and v.
    pub uv_scale: [f32; 2],
    /// Offsets that are added to u and v.
    pub uv_offset: [f32; 2],
    /// A surface to shade instead of the grid.
    pub surface: Surface,
}

impl Default for Points {
    fn default() -> Points {
        Points {
            grid: (512, 512),
            center: false,
            crop: None,
            uv_scale: [1.0; 2],
            uv_offset: [0.0; 2],
            surface: Surface::default(),
        }
    }
}

/// A surface that a camera sees.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The name of a shape, or the file of a mesh; none for the grid.
    pub on: Option<String>,
    /// The output that displaces the surface, and the factor on the movement.
    pub displace: Option<Gained>,
    /// Maximum length in pixels of an edge of a displaced or smooth surface.
    pub edge_pixels: Option<f64>,
    /// How often each face is split into four, regardless of its size in the picture.
    pub level: Option<u32>,
    /// Whether the mesh is the control mesh of a smooth surface.
    pub catmull_clark: bool,
    /// Position of the camera.
    pub eye: Option<Vec3>,
}

/// Data that the surface and the renderer provide.
#[derive(Clone, Debug)]
pub struct Provided {
    /// Values by name that parameters and attributes take, as text.
    pub userdata: Vec<(String, String)>,
    /// JSON file of attributes.
    pub attributes: Option<PathBuf>,
    /// Globals with a value of their own.
    pub globals: GlobalValues,
    /// Matrix from shader to common space, row by row, for row vectors.
    pub shader_space: Option<Box<[f32; 16]>>,
    /// Matrix from object to common space, row by row, for row vectors.
    pub object_space: Option<Box<[f32; 16]>>,
    /// Kind of ray.
    pub ray: String,
    /// Folders to search for textures, after the working directory and the shader's own folder.
    pub texture_path: Vec<PathBuf>,
    /// Memory for textures in mebibytes.
    pub texture_memory: Option<u64>,
}

impl Default for Provided {
    fn default() -> Provided {
        Provided {
            userdata: Vec::new(),
            attributes: None,
            globals: GlobalValues::default(),
            shader_space: None,
            object_space: None,
            ray: "camera".to_string(),
            texture_path: Vec::new(),
            texture_memory: None,
        }
    }
}

/// The samples of each pixel.
#[derive(Clone, Debug, Default)]
pub struct Sampling {
    /// Samples per pixel, or the most of them.
    pub samples: Option<u32>,
    /// Filter of the pixels, and its width in pixels.
    pub filter: Option<(FilterKind, f32)>,
    /// One sample for several pixels.
    pub shading_rate: Option<Rate>,
    /// The standard error that each pixel may have, in the units of the outputs.
    pub adaptive: Option<f32>,
    /// The errors that nearly all pixels are to keep.
    pub max_error: Option<Bounds>,
    /// The time that the picture may take.
    pub within: Option<Duration>,
    /// Whether steps, comparisons and noise are filtered over the area of a sample.
    pub prefilter: bool,
}

/// How the program runs.
#[derive(Clone, Debug, Default)]
pub struct Running {
    /// Threads; all cores if not given.
    pub threads: Option<u16>,
    /// Points per batch; chosen for the shader if not given.
    pub batch: Option<u32>,
    /// Instruction set; the widest of the machine if not given.
    pub isa: Option<Isa>,
    /// Arithmetic; strict if not given.
    pub arithmetic: Option<Arithmetic>,
    /// Maximum number of steps per point.
    pub max_steps: Option<u64>,
    /// Passes to skip.
    pub without_pass: Vec<Pass>,
    /// Whether the work of each point is an output.
    pub steps: bool,
    /// Whether the time of each line is measured.
    pub profile: bool,
}

/// The file of a picture.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// Its name, whose ending is the format; `-` is the standard output. None if no file is written.
    pub path: Option<PathBuf>,
    /// How values become colors.
    pub display: Display,
    /// Whether EXR files have 16-bit floats.
    pub half: bool,
    /// The compression of EXR files.
    pub compression: ExrCompression,
    /// The command line, for EXR files.
    pub command: Option<String>,
}

/// How values become the colors of a picture.
#[derive(Clone, Debug, Default)]
pub struct Display {
    /// Format of the picture on the standard output.
    pub format: Option<String>,
    /// The values that become black and white.
    pub range: Option<ValueRange>,
    /// The same as a range from -1 to 1: zero becomes grey. Normals are always shown like this.
    pub signed: bool,
    /// The values are multiplied by two to this power.
    pub exposure: Option<f32>,
}

/// What is wanted of a run besides its picture.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Times, rates, and what each pass did; for a picture with samples, its error.
    pub stats: bool,
    /// The distribution of the values.
    pub histogram: bool,
    /// The closures as text, and their weights as layers.
    pub closures: bool,
    /// The range of each output.
    pub ranges: bool,
    /// The values of all planes.
    pub values: bool,
    /// The number of samples of each pixel.
    pub samples: bool,
}

/// A picture with light.
#[derive(Clone, Debug, Default)]
pub struct Light {
    /// Output for the base color.
    pub base: Option<String>,
    /// Output for the height of bumps, and a factor on it.
    pub bump: Option<Gained>,
    /// Output for the normal.
    pub normal: Option<String>,
    /// Output for the roughness of highlights.
    pub roughness: Option<String>,
    /// File of a drawing of the camera's rays, for a camera shader.
    pub rays: Option<PathBuf>,
    /// Whether noise is left in, and the light of single paths is not limited.
    pub raw: bool,
    /// The curve from light to colors.
    pub view: Option<Curve>,
}

/// Where values of parameters come from that name files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Trust {
    /// The user typed all of them, so they may name any file, and the shader may append to files.
    #[default]
    All,
    /// Only these texts; other values come from a page. The shader appends to no files.
    Only(Vec<String>),
}

/// One picture: what to shade, where, and how.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// The shader and its parameters.
    pub shader: Shader,
    /// Its points.
    pub points: Points,
    /// Data that the surface and the renderer provide.
    pub provided: Provided,
    /// The samples of each pixel.
    pub sampling: Sampling,
    /// How the program runs.
    pub running: Running,
    /// The file.
    pub output: Output,
    /// With light; without, the picture shows the outputs.
    pub light: Option<Light>,
    /// What is wanted besides the picture.
    pub wanted: Wanted,
    /// Which values of parameters may name any file.
    pub trust: Trust,
}

impl Image {
    /// The same picture of a session's state: work on it ends when the session changes.
    #[must_use]
    pub fn on(mut self, snapshot: Snapshot) -> Image {
        self.shader.read.limits = self.limits().until(snapshot.cancel());
        self.shader.read.snapshot = snapshot;
        self
    }

    /// The state of the session that the picture is made of.
    pub fn snapshot(&self) -> &Snapshot {
        &self.shader.read.snapshot
    }

    /// Columns and rows of the picture: of the crop, or of the whole grid.
    pub fn size(&self) -> (usize, usize) {
        self.points.crop.as_ref().map_or(self.points.grid, |crop| (crop.columns.len(), crop.rows.len()))
    }

    /// Where the picture is in the whole one, if it is a part of it.
    pub fn part(&self) -> Option<DataWindow> {
        self.points.crop.as_ref()?.part(self.points.grid)
    }

    /// The limits of all work for the picture.
    pub fn limits(&self) -> &Limits {
        &self.shader.read.limits
    }
}
