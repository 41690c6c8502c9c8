//! One of two pictures: an image file, or the values of a shader, as named channels.
//!
//! The channels of a shader have the names that they have in an EXR file.

use crate::cli::print::{Console, done};
use osl_exec::Plane;
use osl_image::{DataWindow, ImageData, ImageError, read_image_within};
use osl_ir::ir::Kind;
use osl_job::file::output;
use osl_job::picture::{self, Extras};
use osl_job::report::ranges;
use osl_job::{Done, Failure, Image};
use osl_syntax::escape::shown;
use std::path::Path;
use std::sync::Arc;

/// Endings of files that are run.
const RUN: [&str; 6] = ["osl", "oso", "group", "oslgroup", "txt", "-"];

/// A picture.
pub(in crate::cli) struct Side {
    /// The file, or what is run.
    pub(super) name: String,
    /// Columns and rows.
    pub(super) size: (usize, usize),
    /// Column and row of its first pixel, and the window of the whole image if this is a part.
    window: ((i32, i32), Option<[i32; 4]>),
    pub(in crate::cli) channels: Vec<Channel>,
}

/// A channel of a picture.
pub(in crate::cli) struct Channel {
    pub(super) name: String,
    values: Values,
}

enum Values {
    /// A channel of an image.
    Image(Arc<ImageData>, usize),
    /// A component of an output.
    Plane(Plane),
}

impl Channel {
    /// The value at a pixel, counted row by row. Ints are exact.
    pub(super) fn at(&self, pixel: usize) -> f64 {
        let value = match &self.values {
            Values::Image(image, channel) => {
                image.samples.get(pixel * image.channels.len() + channel).copied().map(f64::from)
            }
            Values::Plane(plane) => match plane.wide.get(pixel) {
                Some(wide) => Some(*wide),
                None => plane.words.get(pixel).map(|word| match plane.kind {
                    Kind::Int => f64::from(*word as i32),
                    _ => f64::from(f32::from_bits(*word)),
                }),
            },
        };
        value.unwrap_or(f64::NAN)
    }
}

/// Whether a file is run rather than read as an image.
pub(super) fn is_shader(path: &Path) -> bool {
    let ending = path.extension().unwrap_or(path.as_os_str());
    ending.to_str().is_some_and(|ending| RUN.contains(&ending.to_ascii_lowercase().as_str()))
}

/// The picture of a file, or of a group without a file.
pub(super) fn of(request: &Image, console: &mut Console<'_>) -> Result<Side, Failure> {
    match &request.shader.file {
        Some(path) if !is_shader(path) => image(path, request),
        _ => shader(request, console),
    }
}

fn image(path: &Path, request: &Image) -> Result<Side, Failure> {
    let image = read_image_within(path, request.limits()).map_err(|error| match error {
        ImageError::Missing { .. } => Failure::new(format!("cannot read {error}")),
        error => Failure::new(error),
    })?;
    let name = path.display().to_string();
    if image.n_parts > 1 {
        let parts = image.n_parts;
        return Err(Failure::new(format!("{name}: the file holds {parts} images; a comparison is for one")));
    }
    let image = Arc::new(image);
    let channel = |(at, name): (usize, &String)| Channel {
        name: name.clone(),
        values: Values::Image(image.clone(), at),
    };
    let mut channels: Vec<Channel> = image.channels.iter().enumerate().map(channel).collect();
    if let Some(asked) = &request.shader.outputs {
        let fits = |name: &str, asked: &str| {
            name == asked || name.strip_prefix(asked).is_some_and(|rest| rest.starts_with('.'))
        };
        if let Some(missing) = asked.iter().find(|asked| !channels.iter().any(|c| fits(&c.name, asked))) {
            let all: Vec<&str> = image.channels.iter().map(String::as_str).collect();
            return Err(Failure::new(format!(
                "{name} has no channel or layer `{missing}`; it has {}",
                all.join(", ")
            )));
        }
        channels.retain(|channel| asked.iter().any(|asked| fits(&channel.name, asked)));
    }
    let window = (image.header.data_origin, image.header.display_window);
    Ok(Side { name, size: (image.width, image.height), window, channels })
}

fn shader(request: &Image, console: &mut Console<'_>) -> Result<Side, Failure> {
    let file = request.shader.file.as_ref();
    let name = file.map_or_else(|| "the group".to_string(), |path| path.display().to_string());
    // The standard output is for the report.
    let mut text = Vec::new();
    let mut own = console.with_out(&mut text);
    let found = picture::run(request, Extras::default(), &mut own);
    if let Ok(found) = &found {
        done::values(found, request, &mut own);
    }
    console.again(&text);
    let Done { frame, covered, .. } = found?;
    // As in an image, alpha is compared unless the outputs are named.
    let planes = frame.planes.into_iter().chain(covered.filter(|_| request.shader.outputs.is_none()));
    let mut channels = Vec::new();
    for plane in planes.filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure)) {
        let name = ranges::channel(&plane.output, plane.ty, plane.component);
        channels.push(Channel { name, values: Values::Plane(plane) });
    }
    if channels.is_empty() {
        return Err(Failure::new(format!("{}: {}", shown(&name), output::EMPTY)));
    }
    let window =
        request.part().map_or(((0, 0), None), |DataWindow { first: (x, y), of: (width, height) }| {
            // The run has checked that these are sizes of an image.
            ((x as i32, y as i32), Some([0, 0, width as i32 - 1, height as i32 - 1]))
        });
    Ok(Side { name, size: request.size(), window, channels })
}

impl Side {
    /// A picture of this size whose channels are planes with names.
    pub(in crate::cli) fn of_planes(
        name: &str,
        size: (usize, usize),
        planes: impl Iterator<Item = (String, Plane)>,
    ) -> Side {
        let channels = planes.map(|(name, plane)| Channel { name, values: Values::Plane(plane) }).collect();
        Side { name: name.to_string(), size, window: ((0, 0), None), channels }
    }

    /// Why this picture cannot be compared with another one.
    pub(super) fn mismatch(&self, other: &Side) -> Option<String> {
        let (a, b) = (&self.name, &other.name);
        if self.size != other.size {
            let ((w, h), (x, y)) = (self.size, other.size);
            return Some(format!("the sizes differ: {a} has {w}x{h} pixels, {b} has {x}x{y}"));
        }
        if self.window != other.window {
            let place = |side: &Side| {
                let ((x, y), whole) = side.window;
                let part = if whole.is_some() { "a part of a larger image, " } else { "" };
                format!("{} is {part}from pixel ({x}, {y}) on", side.name)
            };
            return Some(format!("the pictures show different parts: {}, {}", place(self), place(other)));
        }
        let only = |a: &Side, b: &Side| -> Vec<String> {
            let is_known = |name: &str| b.channels.iter().any(|channel| channel.name == name);
            a.channels.iter().filter(|c| !is_known(&c.name)).map(|c| c.name.clone()).collect()
        };
        let alone: Vec<String> = [(self, other), (other, self)]
            .into_iter()
            .map(|(side, other)| (side, only(side, other)))
            .filter(|(_, names)| !names.is_empty())
            .map(|(side, names)| format!("only {} has {}", side.name, names.join(", ")))
            .collect();
        if alone.is_empty() {
            return None;
        }
        Some(format!("the channels differ: {}; --outputs NAME,… chooses those of both", alone.join("; ")))
    }
}
