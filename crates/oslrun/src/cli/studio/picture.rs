//! The pictures of a page: of an output, a tap or a surface, with light, with marks, or the difference of
//! two.
//!
//! They have the samples of the PNG file that the command line writes, because the same functions make them.
//! If a picture takes long, a small one comes first. This module must not know connections, nor which files a
//! page may read.

use super::difference::Pinned;
use super::told::{stop, told, watch};
use super::{cost, line, outside, rounding, samples};
use crate::cli::args::bounds::bounds;
use crate::cli::args::{RunArgs, SampleArgs};
use crate::cli::clock::Clock;
use crate::cli::load::{self, Request};
use crate::cli::preview::PreviewArgs;
use crate::cli::reads::Reads;
use crate::cli::{Failure, output, run, streams};
use osl_exec::Plane;
use osl_image::{BitDepth, ImageFormat, PngOptions, png_samples};
use osl_ir::ir::{Body, Kind};
use osl_ir::types::{StructTable, Type};
use osl_limits::Cancel;
use osl_studio::{Files, First, Output, Picture, State, Stop};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::io::Write;
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
/// How much printed text a page shows, in bytes.
const MAX_TEXT: usize = 64 << 10;

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
    args: RunArgs,
    state: &'a State,
    cover: Cover<'a>,
    cancel: &'a Cancel,
}

impl<'a> Job<'a> {
    /// The picture of a state, with the options that all commands have.
    pub(super) fn new(
        args: RunArgs,
        state: &'a State,
        pinned: Option<&'a Pinned>,
        cancel: &'a Cancel,
    ) -> Result<Job<'a>, Stop> {
        let mut job = Job { cover: cover(state, pinned)?, args: chosen(args, state)?, state, cancel };
        job.args.steps = matches!(job.cover, Cover::Cost) && job.is_plain();
        Ok(job)
    }

    /// Whether the picture has one sample for each pixel of the patch.
    pub(super) fn is_plain(&self) -> bool {
        self.is_patch() && !self.args.sampling.is_given()
    }

    /// Whether the picture shows the patch.
    pub(super) fn is_patch(&self) -> bool {
        !self.state.lit && self.args.on.on.is_none()
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
                let small = Job { args: smaller(&self.args, step), ..self };
                show(small.made(files)?);
                self.made(files)
            }
            None => self.made(files),
        }
    }

    /// The values of the picture.
    pub(super) fn pinned(mut self) -> Result<Pinned, Stop> {
        let mut pinned = None;
        let (messages, failed) = told(|err| {
            self.args.outputs = one_output(&self.args)?;
            let kept = run::values(&self.args, None, &mut std::io::sink(), err)?;
            let components = components(&kept)?;
            let name = components.first().map(|plane| &*plane.output).unwrap_or_default();
            pinned = Some(Pinned::of(name, self.args.size(), &components));
            Ok(())
        });
        pinned.filter(|_| !failed && !self.cancel.is_cancelled()).ok_or_else(|| stop(messages, self.cancel))
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
        if self.args.on.on.is_some() || !self.args.tap.is_empty() {
            return Err(Stop::error("the layer of rounding errors is for an output on the patch"));
        }
        let clock = Clock::of(self.cancel.clone(), rounding::BUDGET);
        let (mut reads, mut picture) = (Reads::default(), Picture::default());
        let answer = told(|err| {
            let args = RunArgs { outputs: one_output(&self.args)?, ..self.args.clone() };
            picture = rounding::picture(&args, &mut reads, err)?;
            Ok(())
        });
        watch(reads, files);
        if clock.is_over() && answer.1 {
            let (width, height) = self.args.grid;
            return Err(Stop::error(format!(
                "the rounding errors of {width} x {height} points take more than {} s and were given up: -g makes a \
                 smaller picture",
                rounding::BUDGET
            )));
        }
        finished(picture, answer, Vec::new(), self.cancel)
    }

    /// The picture of an output or a tap.
    fn flat(&self, first: Option<First<'_>>, files: &mut Files) -> Result<Picture, Stop> {
        let (mut reads, mut text, mut picture) = (Reads::default(), Vec::new(), Picture::default());
        let work = |err: &mut dyn Write| {
            let args = RunArgs { outputs: one_output(&self.args)?, ..self.args.clone() };
            let Some(First { step, show }) = first else {
                picture = shown(&run::values(&args, Some(&mut reads), &mut text, err)?, &args, self.cover)?;
                return Ok(());
            };
            let small = smaller(&args, step);
            let show = RefCell::new(show);
            let show = |kept: streams::Kept| {
                if let Ok(picture) = shown(&kept, &small, self.cover) {
                    (show.borrow_mut())(picture);
                }
            };
            let first = streams::First { grid: small.grid, show: &show };
            let kept = run::values_after(Some(first), &args, &mut reads, &mut text, err)?;
            picture = shown(&kept, &args, self.cover)?;
            Ok(())
        };
        let answer = told(work);
        watch(reads, files);
        finished(picture, answer, text, self.cancel)
    }

    /// The picture with light. The chosen output is the base color if it is one.
    fn lit(&self, files: &mut Files) -> Result<Picture, Stop> {
        let (mut reads, mut text, mut picture) = (Reads::default(), Vec::new(), Picture::default());
        let args = &self.args;
        let answer = told(|err| {
            let loaded = load::load(&Request::of(args), &mut std::io::sink())?;
            let colors = || loaded.body.outputs.iter().filter(|output| output.ty == Type::COLOR);
            let base = self.state.output.clone();
            let base = base.filter(|name| colors().any(|output| *output.name == **name));
            let lit = PreviewArgs { preview: true, base, ..PreviewArgs::default() };
            let args = RunArgs { outputs: None, ..args.clone() };
            let kept = run::kept(&args, &lit, Some(&mut reads), &mut text, err)?;
            let ((width, height), (channels, samples)) = (args.size(), kept.lit);
            picture =
                Picture { output: LIGHT.to_string(), width, height, channels, samples, ..Picture::default() };
            Ok(())
        });
        watch(reads, files);
        finished(picture, answer, text, self.cancel)
    }
}

/// The options with the output and the range of a state. A picture with light has all outputs and no range.
fn chosen(mut args: RunArgs, state: &State) -> Result<RunArgs, Stop> {
    if let Some(error) = &state.max_error {
        if state.lit {
            return Err(Stop::error("an error bound is for a picture without light"));
        }
        let max_error = Some(bounds(error).map_err(Stop::error)?);
        let SampleArgs { samples, filter, .. } = args.sampling;
        args.sampling = SampleArgs { max_error, samples, filter, ..SampleArgs::default() };
    }
    if state.lit {
        return Ok(args);
    }
    if let Some(range) = &state.range {
        args.display = args.display.with_range(range).map_err(Stop::error)?;
    }
    match state.output.as_deref().and_then(line::tap) {
        Some(tap) => {
            args.tap = vec![tap.map_err(Stop::error)?];
            args.outputs = None;
        }
        None => {
            let asked = state.output.clone().map(|output| vec![output]);
            let given = || args.outputs.as_ref().map(|list| list.iter().take(1).cloned().collect());
            args.outputs = asked.or_else(given);
        }
    }
    Ok(args)
}

/// Outputs that a picture can show. Closures are shown only if there is nothing else, as the weights that a
/// picture of the command has.
pub(super) fn outputs(body: &Body) -> Vec<Output> {
    let shown = body.outputs.iter().filter(|output| output.ty.is_number() || output.ty.is_triple());
    // None of these types is a struct.
    let types = StructTable::default();
    shown.map(|output| Output { name: output.name.to_string(), ty: types.show(output.ty) }).collect()
}

/// The only output that is computed; none for a tap.
fn one_output(args: &RunArgs) -> Result<Option<Vec<String>>, Failure> {
    if args.outputs.is_some() || !args.tap.is_empty() {
        return Ok(args.outputs.clone());
    }
    let loaded = load::load(&Request::of(args), &mut std::io::sink())?;
    Ok(outputs(&loaded.body).into_iter().next().map(|output| vec![output.name]))
}

/// The options of a picture that has a pixel for so many columns and rows of the whole one.
fn smaller(args: &RunArgs, step: usize) -> RunArgs {
    let (width, height) = args.grid;
    RunArgs { grid: (width.div_ceil(step.max(1)), height.div_ceil(step.max(1))), ..args.clone() }
}

/// A picture with the messages and the text of its run; or why there is none.
fn finished(
    mut picture: Picture,
    (mut messages, failed): (Vec<Value>, bool),
    mut text: Vec<u8>,
    cancel: &Cancel,
) -> Result<Picture, Stop> {
    if failed || cancel.is_cancelled() {
        return Err(stop(messages, cancel));
    }
    // What `check` says has a code, and is at its line already.
    messages.retain(|message| message["code"].as_str().unwrap_or_default().is_empty());
    text.truncate(MAX_TEXT);
    picture.text = String::from_utf8_lossy(&text).into_owned();
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
fn components(kept: &streams::Kept) -> Result<Vec<&Plane>, Failure> {
    let mut found: Vec<Vec<&Plane>> = Vec::new();
    for plane in kept.frame.planes.iter().filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure)) {
        match found.last_mut() {
            Some(components) if plane.component > 0 => components.push(plane),
            _ => found.push(vec![plane]),
        }
    }
    let shown = found.into_iter().find(|components| matches!(components.len(), 1 | 3));
    shown.ok_or_else(|| Failure::new(output::EMPTY))
}

/// The picture of the first output, with the samples that its PNG file would have; or with what covers it.
fn shown(kept: &streams::Kept, args: &RunArgs, cover: Cover<'_>) -> Result<Picture, Failure> {
    let started = Instant::now();
    let components = components(kept)?;
    let [first, ..] = components[..] else { return Err(Failure::new(output::EMPTY)) };
    let values = components.iter().map(|plane| plane.as_floats()).collect();
    let covered = kept.covered.as_ref().map(Plane::as_floats);
    let (name, ty) = (&*first.output, first.ty);
    let shown = args.display.shown(Some(ImageFormat::Png), (name, ty), values, covered.as_deref());
    let mut planes: Vec<&[f32]> = shown.planes.iter().map(AsRef::as_ref).collect();
    planes.extend(covered.as_deref());
    let (width, height) = args.size();
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
            let counted = cost::shown(&kept.frame);
            let counted = counted.ok_or_else(|| {
                Failure::new("the layer of the cost is for the patch, with one sample for each pixel")
            })?;
            (picture.samples, picture.channels) = (counted.samples, 3);
            notes = vec![counted.words];
        }
        Cover::Samples => {
            let counted = kept.said.as_ref().and_then(samples::shown);
            let counted = counted
                .ok_or_else(|| Failure::new("every pixel has the same number of samples: choose an error"))?;
            (picture.samples, picture.channels) = (counted.samples, 3);
            notes = vec![counted.words];
        }
    }
    notes.extend(kept.said.iter().flat_map(samples::notes));
    picture.messages = notes.iter().map(|note| json!({ "severity": "note", "message": note })).collect();
    let [compile, run] = kept.times;
    let phases = [("compile", compile), (RUN, run), ("samples", started.elapsed())];
    picture.phases = phases.map(|(name, time)| (name, time.as_secs_f64())).into();
    Ok(picture)
}
