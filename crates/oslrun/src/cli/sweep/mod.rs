//! `-p radius=0.1:0.5:5`: a sheet of pictures, one for each value of a parameter, or of two.
//!
//! `sheet` arranges the pictures and writes the values beside them in the letters of `font`. Only numbers
//! sweep: a colon in the value of a string is a part of the string. This module must not know how a shader
//! runs.

mod font;
mod sheet;

use super::Failure;
use super::args::RunArgs;
use super::load::{self, Request};
use super::preview::PreviewArgs;
use super::run;
use super::streams::{Kept, Streams};
use super::summary::About;
use osl_image::ImageFormat;
use osl_ir::types::{Base, Type};
use std::collections::HashSet;
use std::path::PathBuf;

/// Maximum number of values of a sweep.
const MOST: usize = 100;

/// A parameter with several values.
#[derive(Clone, Debug, PartialEq)]
struct Sweep {
    /// Its position among the options `-p`.
    at: usize,
    name: String,
    /// The values, as they could be typed.
    values: Vec<String>,
}

/// The sweeps of a command line.
fn find(args: &RunArgs) -> Result<Vec<Sweep>, Failure> {
    let may_sweep = |value: &str| value.contains(':');
    if !args.params.iter().any(|(_, value)| may_sweep(value)) {
        return Ok(Vec::new());
    }
    // The types of the parameters decide, so the shader is read without these values first.
    let plain: Vec<(String, String)> =
        args.params.iter().filter(|(_, value)| !may_sweep(value)).cloned().collect();
    let request = Request { params: &plain, repair: args.repair.then_some(None), ..Request::of(args) };
    // What is wrong with the shader is said when it runs.
    let Ok(loaded) = load::load(&request, &mut std::io::sink()) else { return Ok(Vec::new()) };
    let mut sweeps = Vec::new();
    for (at, (name, value)) in args.params.iter().enumerate().filter(|(_, (_, value))| may_sweep(value)) {
        let Some(ty) = loaded.type_of(name).filter(|ty| is_numeric(*ty)) else { continue };
        let values = values(ty, value).map_err(|why| Failure::usage(format!("-p {name}={value}: {why}")))?;
        sweeps.push(Sweep { at, name: name.clone(), values });
    }
    match sweeps.len() {
        0..=2 => Ok(sweeps),
        n => {
            Err(Failure::usage(format!("a sheet has two directions, and {n} parameters have several values")))
        }
    }
}

fn is_numeric(ty: Type) -> bool {
    !ty.is_array() && (matches!(ty.base, Base::Int | Base::Float) || ty.base.is_triple())
}

/// The values of `FROM:TO:COUNT`.
fn values(ty: Type, text: &str) -> Result<Vec<String>, String> {
    let example = match ty.base {
        Base::Int => "1:9:5",
        Base::Float => "0.1:0.5:5",
        _ => "0,0,0:1,0.5,0:5",
    };
    let wrong = || format!("several values are FROM:TO:COUNT, such as {example}");
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let [from, to, count] = parts.as_slice() else { return Err(wrong()) };
    let count: usize = count.parse().map_err(|_| wrong())?;
    if !(2..=MOST).contains(&count) {
        return Err(format!("the number of values is from 2 to {MOST}, not {count}"));
    }
    let each = if matches!(ty.base, Base::Int | Base::Float) { 1 } else { 3 };
    let (from, to) = (numbers(from, each).ok_or_else(wrong)?, numbers(to, each).ok_or_else(wrong)?);
    if ty.base == Base::Int && from.iter().chain(&to).any(|x| x.fract() != 0.0) {
        return Err("the parameter is an int, so its values begin and end at whole numbers".to_string());
    }
    let value = |at: usize| {
        let part = at as f64 / (count - 1) as f64;
        let mixed = from.iter().zip(&to).map(|(from, to)| {
            let x = from + (to - from) * part;
            if ty.base == Base::Int { x.round().to_string() } else { (x as f32).to_string() }
        });
        mixed.collect::<Vec<String>>().join(",")
    };
    Ok((0..count).map(value).collect())
}

/// One number, or three.
fn numbers(text: &str, each: usize) -> Option<Vec<f64>> {
    let list: Vec<f64> = text.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    let is_finite = list.iter().all(|x| x.is_finite() && (*x as f32).is_finite());
    match list.as_slice() {
        [x] if is_finite => Some(vec![*x; each]),
        _ => (is_finite && list.len() == each).then_some(list),
    }
}

/// Runs a shader once, or for several values of parameters.
pub(super) fn run(
    args: &RunArgs,
    lit: &PreviewArgs,
    about: Option<&mut About>,
    streams: &mut Streams<'_>,
) -> Result<(), Failure> {
    let sweeps = find(args)?;
    if sweeps.is_empty() {
        return run::run(args, lit, about, streams);
    }
    if lit.preview || about.is_some() {
        return Err(Failure::usage("--preview and --json are for a run with one value of each parameter"));
    }
    all(args, &sweeps, streams)
}

/// Runs the shader for all values, and writes a sheet for each output.
fn all(args: &RunArgs, sweeps: &[Sweep], streams: &mut Streams<'_>) -> Result<(), Failure> {
    let Some(path) = &args.output else {
        return Err(Failure::usage(
            "several values make a sheet of pictures: name it with -o, such as -o sheet.png",
        ));
    };
    if args.stats || args.histogram || args.profile.is_some() {
        return Err(Failure::usage(
            "--stats, --histogram and --profile are for a run with one value of each parameter",
        ));
    }
    let format = ImageFormat::of(&args.display.named(path)?);
    if !matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err(Failure::usage("a sheet of pictures with the values beside them is a .png or .jpg"));
    }
    let columns = sweeps.first().map_or(&[][..], |sweep| &sweep.values);
    let rows = sweeps.get(1).map(|sweep| sweep.values.as_slice());
    let (width, height) = args.size();
    let count = columns.len() * rows.map_or(1, <[String]>::len);
    let (points, most) = (width.saturating_mul(height).saturating_mul(count) as u64, limit(args));
    if points > most {
        return Err(Failure::new(format!(
            "{count} pictures of {width}x{height} are {points} points, more than {most} (--limit running.points=N); -g \
             sets the size of each picture"
        )));
    }
    let mut pictures: Vec<Kept> = Vec::new();
    let mut known = HashSet::new();
    for row in 0..rows.map_or(1, <[String]>::len) {
        for column in 0..columns.len() {
            let mut cell = RunArgs { output: None, ..args.clone() };
            for (sweep, at) in sweeps.iter().zip([column, row]) {
                if let (Some(param), Some(value)) = (cell.params.get_mut(sweep.at), sweep.values.get(at)) {
                    param.1.clone_from(value);
                }
            }
            let mut said = Vec::new();
            let kept = run::values(&cell, streams.reads.as_deref_mut(), &mut *streams.out, &mut said);
            // Most pictures have the same messages.
            if kept.is_err() || known.insert(said.clone()) {
                let _ = streams.err.write_all(&said);
            }
            pictures.push(kept?);
        }
    }
    let named = |sweep: &Sweep| sweep.values.iter().map(|value| format!("{}={value}", sweep.name)).collect();
    let labels: Vec<Vec<String>> = sweeps.iter().map(named).collect();
    let sheet = sheet::Sheet { labels: &labels, pictures: &pictures, size: (width, height) };
    super::flushed(streams.out)?;
    let written: Vec<PathBuf> = sheet.write(path, args)?.save(path, streams.picture, streams.err)?;
    for file in &written {
        let _ = writeln!(streams.out, "wrote {}: {count} pictures", file.display());
    }
    if pictures.iter().any(|picture| picture.missed) { Err(Failure::missed()) } else { Ok(()) }
}

fn limit(args: &RunArgs) -> u64 {
    args.read.limits.limits().running.points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(ty: Type, text: &str) -> Vec<String> {
        values(ty, text).unwrap_or_else(|why| vec![why])
    }

    #[test]
    fn values_run_from_end_to_end() {
        assert_eq!(of(Type::FLOAT, "0.1:0.5:5"), ["0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(of(Type::FLOAT, "1:-1:3"), ["1", "0", "-1"]);
        assert_eq!(of(Type::INT, "1:4:3"), ["1", "3", "4"]);
        assert_eq!(of(Type::COLOR, "0:1,0.5,0:3"), ["0,0,0", "0.5,0.25,0", "1,0.5,0"]);
    }

    #[test]
    fn other_forms_are_told() {
        for (ty, text) in
            [(Type::FLOAT, "1:2"), (Type::FLOAT, "1:2:x"), (Type::FLOAT, ":2:3"), (Type::FLOAT, "1:2:3:4")]
        {
            assert!(of(ty, text)[0].contains("FROM:TO:COUNT, such as 0.1:0.5:5"), "{text}");
        }
        assert!(of(Type::FLOAT, "1:inf:3")[0].contains("FROM:TO:COUNT"));
        assert!(of(Type::FLOAT, "0:1:1")[0].contains("from 2 to 100"));
        assert!(of(Type::INT, "0:0.5:3")[0].contains("whole numbers"));
        assert!(of(Type::COLOR, "0,1:1:3")[0].contains("0,0,0:1,0.5,0:5"));
    }
}
