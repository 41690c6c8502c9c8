//! The points of a picture, and the data that they have.

use super::heading;
use clap::{ArgGroup, Args};
use osl_job::Image;
use osl_job::request::globals::{GlobalValue, GlobalValues, global, seconds};
use osl_job::request::values::{Crop, Gained, assignment, crop, gained, grid, matrix, pair, position};
use osl_job::request::{Points, Provided, Shader, Surface};
use osl_scene::glam::Vec3;
use std::path::PathBuf;

/// The grid.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct GridArgs {
    /// Points of the grid, or pixels of the view.
    #[arg(short, long, value_name = "WxH", default_value = "512x512", value_parser = grid, help_heading = heading::POINTS)]
    grid: (usize, usize),
    #[command(flatten)]
    place: PlaceArgs,
}

impl GridArgs {
    /// The points of the grid.
    pub(in crate::cli) fn points(&self) -> Points {
        Points { grid: self.grid, ..self.place.points() }
    }
}

/// Where the points of the grid are.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct PlaceArgs {
    /// Place points at pixel centres instead of from border to border.
    #[arg(long, help_heading = heading::POINTS)]
    center: bool,
    /// Factors for u and v, to show more of the pattern.
    #[arg(long, value_name = "U,V", default_value = "1,1", value_parser = both, allow_hyphen_values = true, help_heading = heading::POINTS)]
    uv_scale: Pair,
    /// Offsets that are added to u and v.
    #[arg(long, value_name = "U,V", default_value = "0,0", value_parser = both, allow_hyphen_values = true, help_heading = heading::POINTS)]
    uv_offset: Pair,
}

/// Numbers for u and v. A bare array would be an option with several values.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Pair(pub(in crate::cli) [f32; 2]);

pub(in crate::cli) fn both(text: &str) -> Result<Pair, String> {
    pair(text).map(Pair)
}

impl PlaceArgs {
    /// Points of a grid of the usual size.
    pub(in crate::cli) fn points(&self) -> Points {
        let PlaceArgs { center, uv_scale: Pair(uv_scale), uv_offset: Pair(uv_offset) } = *self;
        Points { center, uv_scale, uv_offset, ..Points::default() }
    }
}

/// A part of the picture.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct CropArgs {
    /// Compute only these columns and rows of the grid, from X0 up to but not including X1, and Y0 up to Y1.
    /// The pixels have the values that they have in the whole picture. An EXR file says where in the whole
    /// picture they are.
    #[arg(long, value_name = "X0,X1,Y0,Y1", value_parser = crop, allow_hyphen_values = true, help_heading = heading::POINTS)]
    crop: Option<Crop>,
}

impl CropArgs {
    /// The columns and rows.
    pub(in crate::cli) fn part(&self) -> Option<Crop> {
        self.crop.clone()
    }
}

/// A surface to shade.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("seen").multiple(true))]
pub(in crate::cli) struct OnArgs {
    /// Shade what a camera sees of a surface: sphere, cylinder, torus, plane, cube, or a mesh from a file
    /// (.obj).
    #[arg(long, value_name = "SURFACE", group = "seen", conflicts_with_all = ["center"], help_heading = heading::SURFACE)]
    on: Option<String>,
    /// Displace the surface by this output first: a float moves along the normal, a vector is an offset, a
    /// point is the new position. A gain multiplies the movement (default: 1).
    #[arg(long, value_name = "OUTPUT[,GAIN]", requires = "seen", value_parser = gained, allow_hyphen_values = true, help_heading = heading::SURFACE)]
    displace: Option<Gained>,
    /// Maximum length in pixels of an edge in the picture, for a displaced or smooth surface (default: 1, or
    /// 5 with --preview).
    #[arg(long, value_name = "N", requires = "seen", help_heading = heading::SURFACE)]
    edge_pixels: Option<f64>,
    /// Split each face into four this many times, regardless of its size in the picture.
    #[arg(long, value_name = "N", requires = "seen", help_heading = heading::SURFACE)]
    level: Option<u32>,
    /// Treat the mesh as the control mesh of a smooth surface (Catmull-Clark).
    #[arg(long, requires = "seen", help_heading = heading::SURFACE)]
    catmull_clark: bool,
    /// Position of the camera; it looks at the middle of the surface.
    #[arg(long, value_name = "X,Y,Z", requires = "seen", value_parser = position, allow_hyphen_values = true, help_heading = heading::SURFACE)]
    eye: Option<Vec3>,
}

impl OnArgs {
    /// The surface.
    pub(in crate::cli) fn surface(&self) -> Surface {
        Surface {
            on: self.on.clone(),
            displace: self.displace.clone(),
            edge_pixels: self.edge_pixels,
            level: self.level,
            catmull_clark: self.catmull_clark,
            eye: self.eye,
        }
    }
}

/// Spaces, the kind of ray, and textures.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct SceneArgs {
    /// Matrix from shader to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true, help_heading = heading::VALUES)]
    shader_space: Option<Box<[f32; 16]>>,
    /// Matrix from object to common space: 16 numbers, row by row, for row vectors.
    #[arg(long, value_name = "M", value_parser = matrix, allow_hyphen_values = true, help_heading = heading::VALUES)]
    object_space: Option<Box<[f32; 16]>>,
    /// Kind of ray for which the shader runs.
    #[arg(long, value_name = "NAME", default_value = "camera", help_heading = heading::VALUES)]
    raytype: String,
    /// Folder to search for textures, after the working directory and the shader's own folder; may be
    /// repeated.
    #[arg(long, value_name = "DIR", help_heading = heading::FILES)]
    texture_path: Vec<PathBuf>,
    /// Memory for textures (default: 1024); the same as `--limit images.texture_memory`.
    #[arg(long, value_name = "MIB", help_heading = heading::RUNNING)]
    texture_memory: Option<u64>,
}

impl SceneArgs {
    /// What the renderer provides; with the data of points, if a command has any.
    pub(in crate::cli) fn provided(&self, data: Option<&DataArgs>) -> Provided {
        let (userdata, attributes, globals) = data.map(DataArgs::data).unwrap_or_default();
        Provided {
            userdata,
            attributes,
            globals,
            shader_space: self.shader_space.clone(),
            object_space: self.object_space.clone(),
            ray: self.raytype.clone(),
            texture_path: self.texture_path.clone(),
            texture_memory: self.texture_memory,
        }
    }
}

/// The data of the points: by name, and globals.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct DataArgs {
    /// Data that the surface provides by name: attributes, and values of parameters with `lockgeom = 0` or
    /// `interpolated = 1`. The value is read as the type that the shader requests: numbers and elements of
    /// arrays are separated by commas, one number is also a color, text in quotes is a string only; may be
    /// repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment, help_heading = heading::VALUES)]
    userdata: Vec<(String, String)>,
    /// JSON file of attributes: {"name": value, "object": {"name": value}}. 3 is an int, 3.0 a float, [r, g,
    /// b] a triple.
    #[arg(long, value_name = "FILE", help_heading = heading::VALUES)]
    attributes: Option<PathBuf>,
    /// Value of the global `time` (default: 0).
    #[arg(long, value_name = "T", value_parser = seconds, allow_hyphen_values = true, help_heading = heading::VALUES)]
    time: Option<f32>,
    /// Value of a global: dtime=0.04, N=0,0.6,0.8, I=0,0,-1. It is the same at all points, so on the grid it
    /// may be any global except P, u and v. May be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = global, help_heading = heading::VALUES)]
    global: Vec<GlobalValue>,
}

impl DataArgs {
    fn data(&self) -> (Vec<(String, String)>, Option<PathBuf>, GlobalValues) {
        let globals = GlobalValues { time: self.time, frame: None, global: self.global.clone() };
        (self.userdata.clone(), self.attributes.clone(), globals)
    }
}

/// The points of the patch, with all that the renderer provides there.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct PatchArgs {
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    data: DataArgs,
}

impl PatchArgs {
    /// A shader at these points.
    pub(in crate::cli) fn image(&self, shader: Shader) -> Image {
        let provided = self.scene.provided(Some(&self.data));
        Image { shader, points: self.grid.points(), provided, ..Image::default() }
    }
}
