//! One run of a shader, and what is printed about it.

use super::sweep::{self, Shown};
use crate::cli::print::{Console, checked, done};
use osl_job::picture::Extras;
use osl_job::request::values::STDOUT;
use osl_job::source::reads::Reads;
use osl_job::{Done, Failure, Image, picture};
use std::ffi::OsString;
use std::path::PathBuf;

/// What the command line says about a run besides its picture.
pub(super) struct Way {
    /// Whether the result is printed as an object.
    pub(super) json: bool,
    /// The file of the flame graph.
    pub(super) flames: Option<PathBuf>,
    /// The words of the command line.
    pub(super) line: Vec<OsString>,
}

/// Runs a shader once, or for several values of parameters, and prints the result. With `json`, the standard
/// output gets one object; if it gets the picture, text goes to the standard error.
pub(super) fn once(
    image: &Image,
    way: &Way,
    reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    image.output.display.check(image.output.path.as_deref())?;
    if image.light.is_some() && image.output.path.is_none() {
        return Err(Failure::new("a preview is a picture: name one with -o"));
    }
    let piped = image.output.path.as_deref().is_some_and(|path| path.as_os_str() == STDOUT);
    if piped && way.json {
        return Err(Failure::usage("--json and the picture of `-o -` do not fit on one standard output"));
    }
    if piped && checked::is_terminal() {
        return Err(Failure::usage(
            "`-o -` writes the bytes of a picture, which a terminal cannot show: pipe it, or name a file",
        ));
    }
    let mut text = Vec::new();
    let shown = if way.json {
        let found = values(image, reads, &mut console.with_out(&mut text))?;
        done::object(&found, &String::from_utf8_lossy(&text), console)?;
        Shown { piped: Vec::new(), misses: found.misses() }
    } else if piped {
        let shown = shown(image, way, reads, &mut console.with_out(&mut text));
        console.again(&text);
        shown?
    } else {
        shown(image, way, reads, console)?
    };
    let _ = console.out.write_all(&shown.piped);
    if shown.misses { Err(Failure::missed()) } else { Ok(()) }
}

/// Runs a shader with one value of each parameter.
fn values(image: &Image, reads: Option<&mut Reads>, console: &mut Console<'_>) -> Result<Done, Failure> {
    if !sweep::find(image)?.is_empty() {
        return Err(Failure::usage("--preview and --json are for a run with one value of each parameter"));
    }
    let done = picture::run(image, Extras { reads, ..Extras::default() }, console)?;
    if let Some(samples) = &done.samples {
        samples.send(console);
    }
    Ok(done)
}

/// Runs a shader once, or for several values of parameters, and prints the result.
fn shown(
    image: &Image,
    way: &Way,
    reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<Shown, Failure> {
    let sweeps = sweep::find(image)?;
    if !sweeps.is_empty() {
        return sweep::all(image, &sweeps, reads, console);
    }
    let done = picture::run(image, Extras { reads, ..Extras::default() }, console)?;
    done::text(&done, image, way.flames.as_deref(), console)?;
    Ok(Shown { misses: done.misses(), piped: done.piped })
}
