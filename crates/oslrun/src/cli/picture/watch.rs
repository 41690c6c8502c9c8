//! `--watch`: makes the picture again when the shader, a header or a texture changes.
//!
//! The files are the ones that the last run read or looked for. Their times and sizes are compared a few
//! times per second. A run that fails leaves the last picture in place.

use super::frames::{self, FrameArgs};
use super::once::Way;
use crate::cli::options::heading;
use crate::cli::print::Console;
use clap::Args;
use osl_files::{Stamp, stamp};
use osl_job::request::values::STDOUT;
use osl_job::source::reads::Reads;
use osl_job::{Failure, Image, Sink};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// The interval between looks at the files.
const EVERY: Duration = Duration::from_millis(150);

/// Whether to watch.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct WatchArgs {
    /// Make the picture again whenever the shader, an included header or a texture changes, until Ctrl-C. A
    /// shader with errors leaves the last picture in place.
    #[arg(long, conflicts_with = "json", help_heading = heading::RUNNING)]
    watch: bool,
}

/// The stamp of each file; none if there is no such file.
type Looks = BTreeMap<PathBuf, Option<Stamp>>;

/// Runs a shader, and again after each change. `image` makes the picture, each time with limits of its own.
pub(super) fn run(
    wanted: &WatchArgs,
    film: &FrameArgs,
    way: &Way,
    image: impl Fn() -> Image,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    if !wanted.watch {
        return frames::run(&image(), film, way, None, console);
    }
    let wait = || {
        std::thread::sleep(EVERY);
        true
    };
    watched((film, way), image, wait, console)
}

/// Runs a shader now and after each change, until `wait` returns false. A mistake on the command line ends
/// the watch at once.
fn watched(
    (film, way): (&FrameArgs, &Way),
    image: impl Fn() -> Image,
    mut wait: impl FnMut() -> bool,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let mut known = Looks::new();
    loop {
        let image = image();
        let is_stream = |path: &Option<PathBuf>| path.as_ref().is_some_and(|path| path.as_os_str() == STDOUT);
        if is_stream(&image.shader.file) || is_stream(&image.output.path) {
            return Err(Failure::usage("--watch is for files: the standard streams do not change"));
        }
        // The picture of one run may be a texture of the next.
        osl_files::forget_inputs();
        let mut reads = Reads::default();
        reads.named(&image);
        for path in std::mem::take(&mut reads.0) {
            known.entry(path.clone()).or_insert_with(|| stamp(&path));
        }
        let result = frames::run(&image, film, way, Some(&mut reads), console);
        for path in reads.0 {
            known.entry(path.clone()).or_insert_with(|| stamp(&path));
        }
        match result {
            Err(failure) if failure.code == 2 => return Err(failure),
            Err(Failure { text, .. }) if !text.is_empty() => console.error(&text),
            _ => {}
        }
        drop(image);
        let files = known.values().flatten().count();
        let s = if files == 1 { "" } else { "s" };
        console.note(&format!("watching {files} file{s}; Ctrl-C ends the command"));
        console.flush_messages();
        console.settle()?;
        let Some(changed) = next_change(&mut known, &mut wait) else { return Ok(()) };
        console.note(&format!("{} has changed", changed.display()));
    }
}

/// Waits for a change, and then until the files rest: editors write in several steps. `None` if the watch
/// ends.
fn next_change(known: &mut Looks, wait: &mut impl FnMut() -> bool) -> Option<PathBuf> {
    let mut changed = None;
    while wait() {
        let mut rests = true;
        for (path, before) in known.iter_mut() {
            let now = stamp(path);
            if now != *before {
                *before = now;
                rests = false;
                changed = Some(path.clone());
            }
        }
        // A file that is gone is mostly about to be replaced.
        let is_there = changed.as_ref().is_none_or(|path| stamp(path).is_some());
        if rests && is_there && changed.is_some() {
            return changed;
        }
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use crate::cli::print::Manner;
    use std::path::Path;

    const GOOD: &str = "#include \"k.h\"\nshader s(output float f = 0) { f = K * u; }";

    /// Watches a shader while a list of steps changes its files. Returns the messages and the picture after
    /// each step.
    fn steps(list: &[&dyn Fn(&Path)]) -> (String, Vec<Vec<u8>>) {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        std::fs::write(path("k.h"), "#define K 1\n").unwrap();
        std::fs::write(path("s.osl"), GOOD).unwrap();
        let image = || {
            let mut image = Image::default();
            image.shader.file = Some(path("s.osl"));
            image.points.grid = (4, 4);
            image.output.path = Some(path("s.png"));
            image
        };
        let way = Way { json: false, flames: None, line: Vec::new() };
        let (mut out, mut err, mut pictures, mut at) = (Vec::new(), Vec::new(), Vec::new(), 0);
        // Two looks without a change follow each step: the first one finds it, the next one sees it rest.
        let wait = || {
            if at % 3 == 0 {
                pictures.push(std::fs::read(path("s.png")).unwrap_or_default());
                let Some(step) = list.get(at / 3) else { return false };
                step(dir.path());
            }
            at += 1;
            true
        };
        watched(
            (&FrameArgs::default(), &way),
            image,
            wait,
            &mut Console::new(&mut out, &mut err, Manner::default()),
        )
        .unwrap();
        let said = String::from_utf8(err).unwrap();
        (said.replace(&dir.path().display().to_string(), "@"), pictures)
    }

    #[test]
    fn the_shader_and_its_headers_are_watched_and_errors_keep_the_picture() {
        let broken = |dir: &Path| {
            std::fs::write(dir.join("s.osl"), "shader s(output float f = 0) { f = x; }").unwrap()
        };
        let good = |dir: &Path| std::fs::write(dir.join("s.osl"), GOOD).unwrap();
        let header = |dir: &Path| std::fs::write(dir.join("k.h"), "#define K 0.25\n").unwrap();
        let gone = |dir: &Path| std::fs::remove_file(dir.join("k.h")).unwrap();
        let (said, pictures) = steps(&[&broken, &good, &header, &gone, &header]);
        assert!(!pictures[0].is_empty(), "{said}");
        assert_eq!(pictures[1], pictures[0], "an error keeps the picture");
        assert_eq!(pictures[2], pictures[0]);
        assert_ne!(pictures[3], pictures[0], "the header counts");
        assert_eq!(pictures[4], pictures[3], "a file that is gone is not yet a change");
        assert!(said.contains("@/s.osl:1") && said.contains("@/k.h has changed"), "{said}");
    }

    #[test]
    fn a_texture_that_comes_later_is_found() {
        let shader = |dir: &Path| {
            let text = "shader s(string file = \"t.png\", output color f = 0) { f = texture(file, u, v); }";
            std::fs::write(dir.join("s.osl"), text).unwrap();
        };
        let texture = |dir: &Path| {
            let options = osl_image::PngOptions {
                transfer: osl_image::Transfer::Linear,
                depth: osl_image::BitDepth::Eight,
                software: None,
            };
            osl_image::write_png(&dir.join("t.png"), 1, 1, &[&[1.0]], options).unwrap();
        };
        let (said, pictures) = steps(&[&shader, &texture]);
        assert!(said.contains("t.png has changed"), "{said}");
        assert_ne!(pictures[2], pictures[1], "{said}");
    }
}
