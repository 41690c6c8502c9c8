//! `-p radius=0.1:0.5:5`: a sheet of pictures, one for each value of a parameter, or of two.
//!
//! `sheet` arranges the pictures and writes the values beside them in the letters of `font`. Only numbers
//! sweep: a colon in the value of a string is a part of the string.

mod font;
mod sheet;

use crate::cli::print::{Console, done};
use osl_image::ImageFormat;
use osl_ir::types::{Base, Type};
use osl_job::picture::Extras;
use osl_job::source::load::{self, Request};
use osl_job::source::reads::Reads;
use osl_job::{Done, Failure, Image, NoSink, Sink, picture};
use std::collections::HashSet;

/// What remains to be done after a run was printed.
pub(super) struct Shown {
    /// The picture for the standard output.
    pub(super) piped: Vec<u8>,
    /// Whether the picture misses its error bound.
    pub(super) misses: bool,
}

/// Maximum number of values of a sweep.
const MOST: usize = 100;

/// A parameter with several values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sweep {
    /// Its position among the options `-p`.
    at: usize,
    name: String,
    /// The values, as they could be typed.
    values: Vec<String>,
}

/// The sweeps of a command line.
pub(super) fn find(image: &Image) -> Result<Vec<Sweep>, Failure> {
    let may_sweep = |value: &str| value.contains(':');
    if !image.shader.params.iter().any(|(_, value)| may_sweep(value)) {
        return Ok(Vec::new());
    }
    // The types of the parameters decide, so the shader is read without these values first.
    let plain: Vec<(String, String)> =
        image.shader.params.iter().filter(|(_, value)| !may_sweep(value)).cloned().collect();
    let request =
        Request { params: &plain, repair: image.shader.repair.then_some(None), ..Request::of(image) };
    // What is wrong with the shader is said when it runs.
    let Ok(loaded) = load::load(&request, &mut NoSink) else { return Ok(Vec::new()) };
    let mut sweeps = Vec::new();
    for (at, (name, value)) in
        image.shader.params.iter().enumerate().filter(|(_, (_, value))| may_sweep(value))
    {
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

/// Runs the shader for all values, and writes a sheet for each output.
pub(super) fn all(
    image: &Image,
    sweeps: &[Sweep],
    mut reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<Shown, Failure> {
    if image.light.is_some() {
        return Err(Failure::usage("--preview and --json are for a run with one value of each parameter"));
    }
    let Some(path) = &image.output.path else {
        return Err(Failure::usage(
            "several values make a sheet of pictures: name it with -o, such as -o sheet.png",
        ));
    };
    if image.wanted.stats || image.wanted.histogram || image.running.profile {
        return Err(Failure::usage(
            "--stats, --histogram and --profile are for a run with one value of each parameter",
        ));
    }
    let format = ImageFormat::of(&image.output.display.named(path)?);
    if !matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err(Failure::usage("a sheet of pictures with the values beside them is a .png or .jpg"));
    }
    let columns = sweeps.first().map_or(&[][..], |sweep| &sweep.values);
    let rows = sweeps.get(1).map(|sweep| sweep.values.as_slice());
    let (width, height) = image.size();
    let count = columns.len() * rows.map_or(1, <[String]>::len);
    let points = width.saturating_mul(height).saturating_mul(count) as u64;
    let most = image.limits().running.points;
    if points > most {
        return Err(Failure::new(format!(
            "{count} pictures of {width}x{height} are {points} points, more than {most} (--limit running.points=N); -g \
             sets the size of each picture"
        )));
    }
    let mut pictures: Vec<Done> = Vec::new();
    let mut known = HashSet::new();
    for row in 0..rows.map_or(1, <[String]>::len) {
        for column in 0..columns.len() {
            let mut cell = image.clone();
            cell.output.path = None;
            cell.wanted.values = true;
            for (sweep, at) in sweeps.iter().zip([column, row]) {
                if let (Some(param), Some(value)) =
                    (cell.shader.params.get_mut(sweep.at), sweep.values.get(at))
                {
                    param.1.clone_from(value);
                }
            }
            pictures.push(one(&cell, reads.as_deref_mut(), &mut known, console)?);
        }
    }
    let named = |sweep: &Sweep| sweep.values.iter().map(|value| format!("{}={value}", sweep.name)).collect();
    let labels: Vec<Vec<String>> = sweeps.iter().map(named).collect();
    let sheet = sheet::Sheet { labels: &labels, pictures: &pictures, size: (width, height) };
    console.settle()?;
    let (files, piped) = sheet.write(path, image)?.save(path, console)?;
    for file in &files {
        let _ = writeln!(console.aside(), "wrote {}: {count} pictures", file.display());
    }
    Ok(Shown { piped, misses: pictures.iter().any(Done::misses) })
}

/// One picture of a sheet. Most pictures have the same messages, which are printed once.
fn one(
    cell: &Image,
    reads: Option<&mut Reads>,
    known: &mut HashSet<Vec<u8>>,
    console: &mut Console<'_>,
) -> Result<Done, Failure> {
    let (mut printed, mut said) = (Vec::new(), Vec::new());
    let mut own = console.to(&mut printed, &mut said);
    let done = picture::run(cell, Extras { reads, ..Extras::default() }, &mut own);
    if let Ok(done) = &done {
        done::values(done, cell, &mut own);
    }
    let _ = console.out.write_all(&printed);
    if done.is_err() || known.insert(said.clone()) {
        console.again(&said);
    }
    done
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
