//! The pictures of a page: of an output, a tap or a surface, with light, with marks, or the difference of
//! two.
//!
//! They have the samples of the PNG file that the command line writes, because the same functions make them.
//! If a picture takes long, a small one comes first.

use super::difference::Pinned;
use super::told::{Told, answer, stop, told, watch};
use super::{cost, line, outside, rounding, samples};
use crate::cli::measure::Clock;
use osl_exec::Plane;
use osl_image::{BitDepth, ImageFormat, PngOptions, png_samples};
use osl_ir::ir::{Body, Kind};
use osl_ir::types::{Base, StructTable, Type};
use osl_job::file::output;
use osl_job::picture::{self, Extras};
use osl_job::request::bounds::bounds;
use osl_job::request::{Light, Sampling};
use osl_job::source::load::{self, Request};
use osl_job::source::reads::Reads;
use osl_job::{Done, Failure, Image, NoSink};
use osl_limits::Cancel;
use osl_studio::{Files, First, Output, Picture, State, Stop};
use serde_json::json;
use std::cell::RefCell;
use std::time::Instant;

/// The name of a picture with light.
const LIGHT: &str = "light";
/// The layer over a picture that marks values that it does not show.
const OUTSIDE: &str = "outside";
/// The layer that shows how much the picture differs from the pinned one.
const DIFFERENCE: &str = "difference";
/// The layer that shows where the samples are.
const SAMPLES: &str = "samples";
/// The layer that shows the work of each pixel.
const COST: &str = "cost";
/// The layer that shows the digits lost to rounding.
const ROUNDING: &str = "rounding";
/// The part of the time in which the shader runs.
pub(super) const RUN: &str = "run";

/// What covers a picture.
#[derive(Clone, Copy)]
enum Cover<'a> {
    Nothing,
    /// Marks of the values that the picture does not show.
    Marks,
    /// The difference to another picture.
    Difference(&'a Pinned),
    /// The number of samples of each pixel.
    Samples,
    /// The work of each pixel.
    Cost,
    /// The digits that each pixel has lost to rounding.
    Rounding,
}

/// A picture to make.
pub(super) struct Job<'a> {
    image: Image,
    state: &'a State,
    cover: Cover<'a>,
    cancel: &'a Cancel,
}

impl<'a> Job<'a> {
    /// The picture of a state, with the options that all commands have.
    pub(super) fn new(
        image: Image,
        state: &'a State,
        pinned: Option<&'a Pinned>,
        cancel: &'a Cancel,
    ) -> Result<Job<'a>, Stop> {
        let mut job = Job { cover: cover(state, pinned)?, image: chosen(image, state)?, state, cancel };
        job.image.running.steps = matches!(job.cover, Cover::Cost) && job.is_plain();
        Ok(job)
    }

    /// Whether the picture has one sample for each pixel of the patch.
    pub(super) fn is_plain(&self) -> bool {
        self.is_patch() && !self.image.sampling.is_given()
    }

    /// Whether the picture shows the patch.
    pub(super) fn is_patch(&self) -> bool {
        !self.state.lit && self.image.points.surface.on.is_none()
    }

    /// Makes the picture; with `first`, a small one before it.
    pub(super) fn picture(self, first: Option<First<'_>>, files: &mut Files) -> Result<Picture, Stop> {
        // A small picture has no difference to a pinned one of another size, and one sample for each pixel.
        let first = first.filter(|_| !matches!(self.cover, Cover::Difference(_) | Cover::Samples));
        // The program of a grid runs both pictures; that of a surface is compiled for each.
        let is_grid = self.is_patch();
        match first {
            Some(first) if is_grid && !matches!(self.cover, Cover::Rounding) => self.flat(Some(first), files),
            Some(First { step, show }) => {
                let small = Job { image: smaller(&self.image, step), ..self };
                show(small.made(files)?);
                self.made(files)
            }
            None => self.made(files),
        }
    }

    /// The values of the picture.
    pub(super) fn pinned(mut self) -> Result<Pinned, Stop> {
        answer(self.cancel, |sink| {
            self.image.shader.outputs = one_output(&self.image)?;
            let done = picture::run(&self.image, Extras::default(), sink)?;
            let components = components(&done)?;
            let name = components.first().map(|plane| &*plane.output).unwrap_or_default();
            Ok(Pinned::of(name, self.image.size(), &components))
        })
    }

    fn made(&self, files: &mut Files) -> Result<Picture, Stop> {
        match self.cover {
            Cover::Rounding => self.rounding(files),
            _ if self.state.lit => self.lit(files),
            _ => self.flat(None, files),
        }
    }

    /// The picture of the digits lost to rounding.
    fn rounding(&self, files: &mut Files) -> Result<Picture, Stop> {
        if self.image.points.surface.on.is_some() || !self.image.shader.taps.is_empty() {
            return Err(Stop::error("the layer of rounding errors is for an output on the patch"));
        }
        let clock = Clock::of(self.cancel.clone(), rounding::BUDGET);
        let mut reads = Reads::default();
        let (told, found) = told(|sink| {
            let mut image = self.image.clone();
            image.shader.outputs = one_output(&image)?;
            rounding::picture(&image, &mut reads, sink)
        });
        watch(reads, files);
        if clock.is_over() && found.is_none() {
            let (width, height) = self.image.points.grid;
            return Err(Stop::error(format!(
                "the rounding errors of {width} x {height} points take more than {} s and were given up: -g makes a \
                 smaller picture",
                rounding::BUDGET
            )));
        }
        finished(found, told, self.cancel)
    }

    /// The picture of an output or a tap.
    fn flat(&self, first: Option<First<'_>>, files: &mut Files) -> Result<Picture, Stop> {
        let mut reads = Reads::default();
        let (told, found) = told(|sink| {
            let mut image = self.image.clone();
            image.shader.outputs = one_output(&image)?;
            let reads = Some(&mut reads);
            let done = match first {
                None => picture::run(&image, Extras { reads, ..Extras::default() }, sink)?,
                Some(First { step, show }) => {
                    let small = smaller(&image, step);
                    let show = RefCell::new(show);
                    let show = |done: Done| {
                        if let Ok(picture) = shown(&done, &small, self.cover) {
                            (show.borrow_mut())(picture);
                        }
                    };
                    let first = Some(picture::First { grid: small.points.grid, show: &show });
                    picture::run(&image, Extras { first, reads, more_taps: None }, sink)?
                }
            };
            let picture = shown(&done, &image, self.cover)?;
            done.samples.iter().for_each(|samples| samples.send(sink));
            Ok(picture)
        });
        watch(reads, files);
        finished(found, told, self.cancel)
    }

    /// The picture with light. The chosen output is the base color if it is one.
    fn lit(&self, files: &mut Files) -> Result<Picture, Stop> {
        let mut reads = Reads::default();
        let (told, found) = told(|sink| {
            let mut image = self.image.clone();
            let loaded = load::load(&Request::of(&image), &mut NoSink)?;
            let colors = || loaded.body.outputs.iter().filter(|output| output.ty == Type::COLOR);
            let base = self.state.output.clone();
            let base = base.filter(|name| colors().any(|output| *output.name == **name));
            image.light = Some(Light { base, ..Light::default() });
            image.shader.outputs = None;
            let extras = Extras { reads: Some(&mut reads), ..Extras::default() };
            let done = picture::run(&image, extras, sink)?;
            let ((width, height), (channels, samples)) = (image.size(), done.light.unwrap_or_default());
            Ok(Picture { output: LIGHT.to_string(), width, height, channels, samples, ..Picture::default() })
        });
        watch(reads, files);
        finished(found, told, self.cancel)
    }
}

/// The picture with the output and the range of a state. A picture with light has all outputs and no range.
fn chosen(mut image: Image, state: &State) -> Result<Image, Stop> {
    if let Some(error) = &state.max_error {
        if state.lit {
            return Err(Stop::error("an error bound is for a picture without light"));
        }
        let max_error = Some(bounds(error).map_err(Stop::error)?);
        let Sampling { samples, filter, .. } = image.sampling;
        image.sampling = Sampling { max_error, samples, filter, ..Sampling::default() };
    }
    if state.lit {
        return Ok(image);
    }
    if let Some(range) = &state.range {
        image.output.display = image.output.display.with_range(range).map_err(Stop::error)?;
    }
    let shader = &mut image.shader;
    match state.output.as_deref().and_then(line::tap) {
        Some(tap) => {
            shader.taps = vec![tap.map_err(Stop::error)?];
            shader.outputs = None;
        }
        None => {
            let asked = state.output.clone().map(|output| vec![output]);
            let given = || shader.outputs.as_ref().map(|list| list.iter().take(1).cloned().collect());
            shader.outputs = asked.or_else(given);
        }
    }
    Ok(image)
}

/// Outputs that a picture can show: numbers and triples, then closures, which are shown with light.
pub(super) fn outputs(body: &Body) -> Vec<Output> {
    let (mut shown, mut lit) = (Vec::new(), Vec::new());
    // None of these types is a struct.
    let types = StructTable::default();
    for output in &body.outputs {
        let list = match output.ty {
            ty if ty.is_number() || ty.is_triple() => &mut shown,
            ty if ty.base == Base::Closure && !ty.is_array() => &mut lit,
            _ => continue,
        };
        list.push(Output { name: output.name.to_string(), ty: types.show(output.ty) });
    }
    shown.extend(lit);
    shown
}

/// The only output that is computed; none for a tap.
fn one_output(image: &Image) -> Result<Option<Vec<String>>, Failure> {
    if image.shader.outputs.is_some() || !image.shader.taps.is_empty() {
        return Ok(image.shader.outputs.clone());
    }
    let loaded = load::load(&Request::of(image), &mut NoSink)?;
    Ok(outputs(&loaded.body).into_iter().next().map(|output| vec![output.name]))
}

/// A picture that has a pixel for so many columns and rows of the whole one.
fn smaller(image: &Image, step: usize) -> Image {
    let (width, height) = image.points.grid;
    let mut small = image.clone();
    small.points.grid = (width.div_ceil(step.max(1)), height.div_ceil(step.max(1)));
    small
}

/// A picture with the messages and the text of its run; or why there is none.
fn finished(picture: Option<Picture>, told: Told, cancel: &Cancel) -> Result<Picture, Stop> {
    let Told { mut messages, printed } = told;
    let Some(mut picture) = picture.filter(|_| !cancel.is_cancelled()) else {
        return Err(stop(messages, cancel));
    };
    // What `check` says has a code, and is at its line already.
    messages.retain(|message| message["code"].as_str().unwrap_or_default().is_empty());
    picture.text = printed;
    picture.messages.extend(messages);
    Ok(picture)
}

/// What covers the picture of a state.
fn cover<'a>(state: &State, pinned: Option<&'a Pinned>) -> Result<Cover<'a>, Stop> {
    match state.layer.as_deref() {
        None => Ok(Cover::Nothing),
        Some(_) if state.lit => Err(Stop::error("a picture with light has no layers: switch Lit off")),
        Some(OUTSIDE) => Ok(Cover::Marks),
        Some(DIFFERENCE) => match pinned {
            Some(pinned) => Ok(Cover::Difference(pinned)),
            None => {
                Err(Stop::error("no values are pinned: choose no layer, switch Lit off, and pin the picture"))
            }
        },
        Some(SAMPLES) => Ok(Cover::Samples),
        Some(COST) => Ok(Cover::Cost),
        Some(ROUNDING) => Ok(Cover::Rounding),
        Some(layer) => Err(Stop::error(format!("a page has no layer {layer}"))),
    }
}

/// The components of the first output that a picture can show.
fn components(done: &Done) -> Result<Vec<&Plane>, Failure> {
    let mut found: Vec<Vec<&Plane>> = Vec::new();
    for plane in done.frame.planes.iter().filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure)) {
        match found.last_mut() {
            Some(components) if plane.component > 0 => components.push(plane),
            _ => found.push(vec![plane]),
        }
    }
    let shown = found.into_iter().find(|components| matches!(components.len(), 1 | 3));
    shown.ok_or_else(|| Failure::new(output::EMPTY))
}

/// The picture of the first output, with the samples that its PNG file would have; or with what covers it.
fn shown(done: &Done, image: &Image, cover: Cover<'_>) -> Result<Picture, Failure> {
    let started = Instant::now();
    let components = components(done)?;
    let [first, ..] = components[..] else { return Err(Failure::new(output::EMPTY)) };
    let values = components.iter().map(|plane| plane.as_floats()).collect();
    let covered = done.covered.as_ref().map(Plane::as_floats);
    let (name, ty) = (&*first.output, first.ty);
    let shown = image.output.display.shown(Some(ImageFormat::Png), (name, ty), values, covered.as_deref());
    let mut planes: Vec<&[f32]> = shown.planes.iter().map(AsRef::as_ref).collect();
    planes.extend(covered.as_deref());
    let (width, height) = image.size();
    let options = PngOptions { transfer: shown.transfer, depth: BitDepth::Eight, software: None };
    let samples = png_samples(&planes, width * height, options);
    let mut picture = Picture {
        output: name.to_string(),
        width,
        height,
        channels: planes.len(),
        samples,
        ..Picture::default()
    };
    let mut notes: Vec<String> = shown.note.into_iter().collect();
    match cover {
        // The picture of rounding errors is made elsewhere.
        Cover::Nothing | Cover::Rounding => {}
        Cover::Marks => {
            let marked = outside::marked(&shown.planes, covered.as_deref(), &picture.samples, shown.range);
            (picture.samples, picture.channels) = (marked.samples, marked.channels);
            notes = vec![marked.words];
        }
        Cover::Difference(pinned) => {
            let differing = pinned.difference(&Pinned::of(name, (width, height), &components))?;
            (picture.samples, picture.channels) = (differing.samples, 3);
            notes = vec![differing.words];
        }
        Cover::Cost => {
            let counted = cost::shown(&done.frame);
            let counted = counted.ok_or_else(|| {
                Failure::new("the layer of the cost is for the patch, with one sample for each pixel")
            })?;
            (picture.samples, picture.channels) = (counted.samples, 3);
            notes = vec![counted.words];
        }
        Cover::Samples => {
            let counted = done.samples.as_ref().and_then(samples::shown);
            let counted = counted
                .ok_or_else(|| Failure::new("every pixel has the same number of samples: choose an error"))?;
            (picture.samples, picture.channels) = (counted.samples, 3);
            notes = vec![counted.words];
        }
    }
    notes.extend(done.samples.iter().flat_map(samples::notes));
    picture.messages = notes.iter().map(|note| json!({ "severity": "note", "message": note })).collect();
    let [compile, run] = done.times;
    let phases = [("compile", compile), (RUN, run), ("samples", started.elapsed())];
    picture.phases = phases.map(|(name, time)| (name, time.as_secs_f64())).into();
    Ok(picture)
}
