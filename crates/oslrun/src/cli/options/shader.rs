//! The shader, its parameters and its outputs.

use super::heading;
use super::reading::{LintArgs, ReadArgs};
use clap::Args;
use osl_job::request::values::assignment;
use osl_job::request::{Network, Shader};
use osl_limits::{Cancel, Limits};
use osl_lower::taps::TapPath;
use std::path::{Path, PathBuf};

/// The shader, and how it is read.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct ShaderArgs {
    /// The shader file: a source, a compiled shader (.oso), or the text of a group (.group, .oslgroup, .txt).
    #[arg(required = true, value_name = "FILE.osl")]
    file: Option<PathBuf>,
    /// Value of a parameter; may be repeated: radius=0.3, tint=1,0.5,0, tint=#ff8800 (converted from sRGB to
    /// linear, as color pickers mean it), spacename=object, and for an int with the metadata `mapper` a name
    /// in it, as in mode=Radial. In a group, the
    /// parameter belongs to the last layer; LAYER.NAME=VALUE sets one of another layer. Of a number,
    /// radius=0.1:0.5:5 are 5 values from 0.1 to 0.5: the run makes a sheet of pictures, a row for one such
    /// parameter and a table for two.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment, help_heading = heading::VALUES)]
    params: Vec<(String, String)>,
    /// Insert missing brackets before running, also in the shaders of a group; the edits are shown.
    #[arg(long, help_heading = heading::READING)]
    repair: bool,
    /// Let the shader include, open and append to any file, not only those below the working directory, the
    /// shader's own folder, and the folders of -I and the paths.
    #[arg(long, help_heading = heading::FILES)]
    allow_files: bool,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
}

impl ShaderArgs {
    /// The shader; of a group with these options.
    pub(in crate::cli) fn shader(&self, network: Option<&NetworkArgs>) -> Shader {
        Shader {
            file: self.file.clone(),
            network: network.map(NetworkArgs::network).unwrap_or_default(),
            params: self.params.clone(),
            repair: self.repair,
            allow_files: self.allow_files,
            lints: self.lints.lints(),
            read: self.read.reading(),
            ..Shader::default()
        }
    }

    /// The file.
    pub(in crate::cli) fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Makes limits for pieces of work that can be cancelled.
    pub(in crate::cli) fn limits_until(&self) -> impl Fn(&Cancel) -> Limits + Clone + Send + 'static {
        self.read.limits_until()
    }
}

/// A group of shaders, and how its layers are connected. A command with these options has them after the
/// file, which then may be missing.
#[derive(Clone, Debug, Default, Args)]
#[command(mut_arg("file", |arg| arg.required(false).required_unless_present_any(["group", "layer"])))]
pub(in crate::cli) struct NetworkArgs {
    /// The text of a group: "shader noisy n; shader mixer m; connect n.out m.a".
    #[arg(long, value_name = "TEXT", help_heading = heading::GROUP)]
    group: Option<String>,
    /// A layer; may be repeated. If FILE is given, it is the last layer.
    #[arg(long, value_name = "NAME=SHADER", value_parser = assignment, help_heading = heading::GROUP)]
    layer: Vec<(String, String)>,
    /// A connection from an earlier layer to a later one; may be repeated.
    #[arg(long, value_name = "LAYER.OUTPUT=LAYER.PARAM", value_parser = assignment, help_heading = heading::GROUP)]
    connect: Vec<(String, String)>,
    /// Folder to search for the shaders of a group, after the folder of FILE and the working directory; may
    /// be repeated.
    #[arg(long, value_name = "DIR", help_heading = heading::FILES)]
    shader_path: Vec<PathBuf>,
    /// Name of the group; shaders can ask for it.
    #[arg(long, value_name = "NAME", default_value = "unnamed_group_1", help_heading = heading::GROUP)]
    group_name: String,
}

impl NetworkArgs {
    /// The group.
    pub(in crate::cli) fn network(&self) -> Network {
        Network {
            group: self.group.clone(),
            layer: self.layer.clone(),
            connect: self.connect.clone(),
            shader_path: self.shader_path.clone(),
            name: self.group_name.clone(),
        }
    }
}

/// The outputs to compute.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct OutputsArgs {
    /// Outputs to compute and write, separated by commas (default: all; of a group, all of the last layer).
    /// Outputs of other layers are named LAYER.OUTPUT.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', help_heading = heading::PICTURE)]
    outputs: Option<Vec<String>>,
}

impl OutputsArgs {
    /// The names; none if all outputs are wanted.
    pub(in crate::cli) fn names(&self) -> Option<Vec<String>> {
        self.outputs.clone()
    }
}

/// Variables that become outputs.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct TapArgs {
    /// Make an output of a variable at a line: its value after the statement on LINE. If a point reaches the
    /// line several times, the last value counts, or with @N the value of the Nth time. VAR may be a field or
    /// an element: s.x, list[2]. CALL/LINE:VAR is inside a function, as called on line CALL; FILE:LINE:VAR is
    /// in an included file or in another layer. The output is called lineLINE.VAR, or lineLINE.VAR.roundN
    /// with @N. A second output, with .reached after this name, is 1 where a point reached the line (with @N:
    /// at least N times) and 0 elsewhere. Without --outputs, only taps are shown. May be repeated.
    #[arg(long, value_name = "LINE:VAR", value_parser = TapPath::parse, help_heading = heading::PICTURE)]
    tap: Vec<TapPath>,
}

impl TapArgs {
    /// The taps.
    pub(in crate::cli) fn taps(&self) -> Vec<TapPath> {
        self.tap.clone()
    }
}

/// Where a repaired source is saved.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct WriteArgs {
    /// With --repair: save the repaired source here. It may be the shader file itself.
    #[arg(long, value_name = "FILE.osl", requires = "repair", help_heading = heading::READING)]
    write: Option<PathBuf>,
}

impl WriteArgs {
    /// The file.
    pub(in crate::cli) fn path(&self) -> Option<PathBuf> {
        self.write.clone()
    }
}

/// A shader or group that is examined, and which of its outputs.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct SubjectArgs {
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    write: WriteArgs,
}

impl SubjectArgs {
    /// The shader.
    pub(in crate::cli) fn shader(&self) -> Shader {
        let shader = self.shader.shader(Some(&self.network));
        Shader { outputs: self.outputs.names(), write: self.write.path(), ..shader }
    }
}
