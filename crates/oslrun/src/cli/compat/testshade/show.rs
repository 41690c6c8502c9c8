//! The results of a `testshade` run: shader messages, values point by point, images.

use super::super::{Console, number};
use super::job::Job;
use osl_exec::{Frame, Plane};
use osl_hir::hir;
use osl_image::{write_channels, write_ints};
use osl_ir::ir::Kind;
use osl_ir::types::{Base, Extent};
use osl_lower::group::Group;
use osl_lower::params;
use std::path::PathBuf;
use std::sync::Arc;

/// A requested output that a layer has.
pub(super) struct Output {
    /// Its name in the request.
    pub(super) asked: String,
    /// The name of its planes.
    pub(super) plane: Arc<str>,
    /// Its names for the lowering.
    pub(super) names: Vec<Arc<str>>,
    /// Numbers per point, and whether they are ints.
    shape: (usize, bool),
    /// The file that it is written to.
    pub(super) file: Option<PathBuf>,
}

impl Output {
    /// The name without its layer.
    fn name(&self) -> &str {
        self.asked.split_once('.').map_or(&self.asked, |(_, name)| name)
    }
}

/// The requested outputs that exist. A plain name means the last layer that has such an output. Unknown names
/// are ignored.
pub(super) fn outputs(group: &Group, job: &Job) -> Vec<Output> {
    let mut found = Vec::new();
    for (asked, file) in &job.outputs {
        let (of, name) = asked.split_once('.').map_or((None, asked.as_str()), |(of, name)| (Some(of), name));
        let layers = group.layers().iter().enumerate().rev();
        let has = |l: &osl_lower::group::Layer| {
            of.is_none_or(|of| of == &*l.name) && names(&l.program).any(|output| output == name)
        };
        let Some((index, layer)) = layers.into_iter().find(|(_, l)| has(l)) else { continue };
        let last = index + 1 == group.layers().len();
        let path: Arc<str> = format!("{}.{name}", layer.name).into();
        // A name without a layer makes every layer with such an output run.
        let mut names: Vec<Arc<str>> = vec![path.clone()];
        names.extend(of.is_none().then(|| name.into()));
        found.push(Output {
            asked: asked.clone(),
            shape: shape(&layer.program, name),
            plane: if last { name.into() } else { path },
            names,
            file: (file != "null").then(|| file.into()),
        });
    }
    found
}

fn names(program: &hir::Program) -> impl Iterator<Item = &str> {
    program.shader.params.iter().filter(|p| p.output).map(|p| &*program.vars[p.var.0 as usize].name)
}

/// How many numbers an output has, and whether they are ints.
fn shape(program: &hir::Program, name: &str) -> (usize, bool) {
    let Some(ty) = params::type_of(program, name) else { return (0, false) };
    let each = match ty.base {
        Base::String | Base::Closure | Base::Void | Base::Struct(_) | Base::Error => 0,
        Base::Int | Base::Float => 1,
        Base::Matrix => 16,
        Base::Color | Base::Point | Base::Vector | Base::Normal => 3,
    };
    let elements = if let Extent::Array(n) = ty.extent { n as usize } else { 1 };
    (each * elements, ty.base == Base::Int)
}

/// The planes of an output, in order, except those that an image cannot hold.
fn planes<'a>(frame: &'a Frame, output: &Output) -> Vec<&'a Plane> {
    let part = |plane: &str| {
        plane.strip_prefix(&*output.plane).is_some_and(|rest| rest.is_empty() || rest.starts_with(['[', '.']))
    };
    let image = |p: &Plane| !matches!(p.kind, Kind::Str | Kind::Closure);
    frame.planes.iter().filter(|p| part(&p.output) && image(p)).collect()
}

/// Prints the outputs of each point. The tool prints no values of strings and closures.
pub(super) fn points(frame: &Frame, outputs: &[Output], width: usize, console: &mut Console<'_>) {
    let all: Vec<(&str, Vec<&Plane>)> = outputs.iter().map(|o| (o.name(), planes(frame, o))).collect();
    let shown = |plane: &Plane, at: usize| {
        let word = plane.words.get(at).copied().unwrap_or(0);
        if plane.kind == Kind::Int {
            format!(" {}", word as i32)
        } else {
            format!(" {}", number(f32::from_bits(word)))
        }
    };
    let count = all.iter().flat_map(|(_, planes)| planes.iter().map(|p| p.words.len())).max().unwrap_or(0);
    for point in 0..count {
        let _ = writeln!(console.out, "Pixel ({}, {}):", point % width, point / width);
        for (name, planes) in all.iter().filter(|(_, planes)| !planes.is_empty()) {
            let values: String = planes.iter().map(|p| shown(p, point)).collect();
            let _ = writeln!(console.out, "  {name} :{values}");
        }
    }
}

/// Writes each output to its file: all files or none.
pub(super) fn write(frame: &Frame, outputs: &[Output], job: &Job) -> Result<(), String> {
    let size = (job.grid.width, job.grid.height);
    let mut files = Vec::new();
    for output in outputs {
        let Some(file) = &output.file else { continue };
        let planes = planes(frame, output);
        let written = if planes.is_empty() {
            // Its layer does not run, so the image stays black.
            let ((channels, ints), points) = (output.shape, size.0 * size.1);
            match (channels, ints) {
                (0, _) => continue,
                (n, true) => write_ints(file, size, &vec![&vec![0; points][..]; n], job.samples),
                (n, false) => write_channels(file, size, &vec![&vec![0.0; points][..]; n], job.samples),
            }
        } else if planes.iter().all(|p| p.kind == Kind::Int) {
            let values: Vec<Vec<i32>> =
                planes.iter().map(|p| p.words.iter().map(|w| *w as i32).collect()).collect();
            let slices: Vec<&[i32]> = values.iter().map(Vec::as_slice).collect();
            write_ints(file, size, &slices, job.samples)
        } else {
            let values: Vec<Vec<f32>> = planes.iter().map(|p| p.floats()).collect();
            let slices: Vec<&[f32]> = values.iter().map(Vec::as_slice).collect();
            write_channels(file, size, &slices, job.samples)
        };
        files.push(written.map_err(|e| format!("ERROR: {e}"))?);
    }
    osl_files::save_all(files).map_err(|e| format!("ERROR: {e}"))
}
