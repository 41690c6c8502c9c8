//! The result of a run: as text for people, or as the object of `--json`.

use super::Console;
use osl_job::report::histogram::{self, Histogram};
use osl_job::report::profile;
use osl_job::report::ranges::{Output, summary};
use osl_job::report::samples::{Kept, Reached};
use osl_job::report::stats::Stats;
use osl_job::{Done, Failure, Image};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The result of a run as an object.
#[derive(Serialize)]
struct About<'a> {
    outputs: Vec<Output>,
    files: &'a [PathBuf],
    errors: usize,
    warnings: usize,
    /// The text that the shader printed.
    printed: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    stats: Option<&'a Stats>,
    /// The bounds of `--max-error`, and whether the picture keeps them.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_error: Option<&'a Kept>,
    /// What the time of `--within` was enough for.
    #[serde(skip_serializing_if = "Option::is_none")]
    within: Option<&'a Reached>,
    #[serde(skip_serializing_if = "Option::is_none")]
    histograms: Option<&'a [Histogram]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    profile: Option<profile::Tables>,
}

/// The result of a run as an object. `printed` is the text that the shader printed.
pub(in crate::cli) fn object(done: &Done, printed: &str, console: &mut Console<'_>) -> Result<(), Failure> {
    let samples = done.samples.as_ref();
    console.object(&About {
        outputs: done.ranges.outputs(),
        files: &done.files,
        errors: done.messages.errors,
        warnings: done.messages.warnings,
        printed,
        stats: done.stats.as_ref(),
        max_error: samples.and_then(|samples| samples.max_error.as_ref()),
        within: samples.and_then(|samples| samples.within.as_ref()),
        histograms: done.histograms.as_deref(),
        profile: (!done.profile.is_empty()).then(|| profile::tables(&done.profile, &done.sources)),
    })
}

/// Prints what is wanted of a run: closures, ranges, times, distributions, samples and the names of files.
/// `flames` is the file of a flame graph.
pub(in crate::cli) fn text(
    done: &Done,
    image: &Image,
    flames: Option<&Path>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    closures(done, image, console);
    let is_table = image.wanted.stats || image.wanted.histogram || image.running.profile;
    if image.output.path.is_none() && !is_table {
        summary(&done.ranges, console.out);
    }
    histogram::print(done.histograms.as_deref().unwrap_or_default(), console.out);
    let times = done.stats.as_ref().map(Stats::text);
    times.iter().chain(&done.cost).for_each(|text| console.text(text));
    if let Some(samples) = &done.samples {
        samples.send(console);
        match image.wanted.stats {
            true => console.text(&samples.text),
            false => console.report(&samples.text),
        }
    }
    if image.running.profile {
        profile::print(&done.profile, &done.sources, console.out);
        if let Some(path) = flames {
            profile::write(&done.profile, &done.name, &done.sources, path)?;
            console.wrote(path);
        }
    }
    done.messages.wrote(&done.files, console.aside());
    Ok(())
}

/// Prints what belongs to the values of a picture that is not written by itself: closures and samples.
pub(in crate::cli) fn values(done: &Done, image: &Image, console: &mut Console<'_>) {
    closures(done, image, console);
    if let Some(samples) = &done.samples {
        samples.send(console);
        console.report(&samples.text);
    }
}

fn closures(done: &Done, image: &Image, console: &mut Console<'_>) {
    if let Some(closures) = &done.closures {
        closures.show(image.size().0, image.part().map_or((0, 0), |part| part.first), console.out);
    }
}
