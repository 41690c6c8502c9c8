//! `--frames LIST`: a run for each frame of a film, with the time and the name of the picture from its
//! number.

use super::numbers::{self, Numbers};
use super::once::{self, Way};
use super::openjd::{self, JobArgs};
use crate::cli::options::heading;
use crate::cli::print::Console;
use clap::Args;
use osl_job::file::output::is_there;
use osl_job::request::globals::FPS;
use osl_job::source::reads::Reads;
use osl_job::{Failure, Image, Sink};
use std::path::{Path, PathBuf};

/// The frames to make.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct FrameArgs {
    /// Make a picture for each of these frames: 1-24, or a list as farms write it, 1-3,5,7-11:2 (each second
    /// one from 7 to 11). The time is the number of the frame divided by --fps. `####` in the name after -o
    /// becomes the number with at least four digits: out.0007.png.
    #[arg(long, value_name = "LIST", value_parser = numbers::frames, conflicts_with = "time", help_heading = heading::VALUES)]
    frames: Option<Numbers>,
    /// Frames per second (default: 24).
    #[arg(long, value_name = "N", value_parser = fps, requires = "frames", help_heading = heading::VALUES)]
    fps: Option<f64>,
    /// Leave out frames whose picture is there, so that a film that was stopped goes on. Of several outputs
    /// in files of their own, the files of all must be there.
    #[arg(long, requires = "frames", help_heading = heading::VALUES)]
    skip_existing: bool,
    #[command(flatten)]
    job: JobArgs,
}

fn fps(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|n: &f64| *n > 0.0 && n.is_finite());
    number.ok_or_else(|| format!("a number of frames per second above 0, not `{text}`"))
}

/// Runs a shader, once or for each frame.
pub(super) fn run(
    image: &Image,
    wanted: &FrameArgs,
    way: &Way,
    mut reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let Some(frames) = wanted.frames.clone() else {
        if wanted.job.file().is_some() {
            return Err(Failure::usage("--openjd is for a run with --frames, whose frames are the tasks"));
        }
        return once::once(image, way, reads, console);
    };
    if way.json {
        return Err(Failure::usage("--json is for a run without --frames"));
    }
    if image.provided.globals.has_time() {
        return Err(Failure::usage("--frames sets the time, so --global time=T has no effect"));
    }
    let Some(path) = image.output.path.as_deref().filter(|path| numbered(path, 0).is_some()) else {
        return Err(Failure::usage("--frames needs a picture with a place for the number: -o out.####.png"));
    };
    if let Some(file) = wanted.job.file() {
        let task = openjd::Task { option: "--frames", name: "Frame", numbers: &frames };
        return openjd::write(file, &task, &wanted.job, &way.line, console);
    }
    // All frames have the same limits, and share the time of the command.
    let mut missed = Ok(());
    for frame in frames.iter() {
        let mut image = image.clone();
        image.provided.globals.time = Some((f64::from(frame) / wanted.fps.unwrap_or(FPS)) as f32);
        image.provided.globals.frame = Some(frame);
        image.output.path = numbered(path, frame);
        if let Some(path) = image.output.path.as_deref().filter(|path| wanted.skip_existing && is_there(path))
        {
            console.note(&format!("frame {frame} is left out: {} is there", path.display()));
            continue;
        }
        match once::once(&image, way, reads.as_deref_mut(), console) {
            Err(failure) if failure.wrote => missed = Err(failure),
            result => result?,
        }
        console.settle()?;
    }
    missed
}

/// The path with the number of a frame in place of the first row of `#` in the file's name.
fn numbered(path: &Path, frame: u32) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let start = name.find('#')?;
    let (before, rest) = name.split_at(start);
    let after = rest.trim_start_matches('#');
    let digits = rest.len() - after.len();
    Some(path.with_file_name(format!("{before}{frame:0digits$}{after}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_hold_the_number() {
        let name =
            |path: &str, frame| numbered(Path::new(path), frame).map(|path| path.display().to_string());
        assert_eq!(name("a/out.####.png", 7).as_deref(), Some("a/out.0007.png"));
        assert_eq!(name("#.exr", 123).as_deref(), Some("123.exr"));
        assert_eq!(name("a##b#.exr", 5).as_deref(), Some("a05b#.exr"));
        assert_eq!(name("a#b/out.png", 5), None);
    }
}
