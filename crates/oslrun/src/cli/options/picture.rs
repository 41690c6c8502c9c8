//! The file of a picture, and how values become its colors.

use super::heading;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl_image::ExrCompression;
use osl_job::request::values::{ValueRange, compression, curve, ending, image_file, stops, value_range};
use osl_job::request::{Display, Output};
use osl_scene::render::Curve;
use std::path::PathBuf;

/// The file of a picture.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct OutputArgs {
    /// Image to write: .exr holds all outputs; with .png, .tif or .jpg, each output has its own file. One
    /// output is written to FILE itself; several are written to `name.OUTPUT.png`. `{output}` in the name
    /// stands for the output. `-` is the standard output.
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(image_file), help_heading = heading::PICTURE)]
    output: Option<PathBuf>,
    /// Format of the picture with `-o -`: png, exr, tif or jpg (default: png).
    #[arg(long, value_name = "NAME", value_parser = ending, requires = "output", help_heading = heading::PICTURE)]
    format: Option<String>,
    /// Write 16-bit floats (EXR).
    #[arg(long, help_heading = heading::PICTURE)]
    half: bool,
    /// Compression of EXR files: none, rle, zip1, zip16, piz, pxr24.
    #[arg(long, value_name = "NAME", default_value = "zip16", value_parser = compression, help_heading = heading::PICTURE)]
    compression: ExrCompression,
    /// Do not write the command line into EXR files.
    #[arg(long, help_heading = heading::PICTURE)]
    no_command: bool,
}

impl OutputArgs {
    /// The file, with these colors and this command line.
    pub(in crate::cli) fn output(&self, display: &DisplayArgs, command: Option<String>) -> Output {
        let display = Display { format: self.format.clone(), ..display.display() };
        let command = command.filter(|_| !self.no_command);
        let OutputArgs { output, half, compression, .. } = self;
        Output { path: output.clone(), display, half: *half, compression: *compression, command }
    }
}

/// How values become colors.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct DisplayArgs {
    /// The values that become black and white: A,B, or `auto` for the smallest and the largest value of each
    /// output.
    #[arg(long, value_name = "auto|A,B", value_parser = value_range, allow_hyphen_values = true, help_heading = heading::DISPLAY)]
    range: Option<ValueRange>,
    /// The same as `--range -1,1`: zero becomes grey. Normals are always shown like this.
    #[arg(long, conflicts_with = "range", help_heading = heading::DISPLAY)]
    signed: bool,
    /// Multiply the values by two to this power: 1 is twice as bright.
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_hyphen_values = true, conflicts_with_all = ["range", "signed"], help_heading = heading::DISPLAY)]
    exposure: Option<f32>,
}

impl DisplayArgs {
    /// How values become colors.
    pub(in crate::cli) fn display(&self) -> Display {
        Display { format: None, range: self.range, signed: self.signed, exposure: self.exposure }
    }
}

/// How light becomes the colors of a display.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct ViewArgs {
    /// Curve from light to the colors of a PNG: soft, which compresses what is brighter than 0.7; srgb, which
    /// cuts off at 1; filmic, with the contrast of film (default: soft).
    #[arg(long, value_name = "NAME", value_parser = curve, help_heading = heading::PREVIEW)]
    view: Option<Curve>,
}

impl ViewArgs {
    /// The curve, if one is chosen.
    pub(in crate::cli) fn curve(&self) -> Option<Curve> {
        self.view
    }
}
