//! Small pictures of what a line of the source does, as in a picture book, for the state that the page shows.
//!
//! Also the tap as the output of the whole picture.

use crate::cli::picture::figures::{self, Figure, Pictures, Results};
use osl_hir::hir::Program;
use osl_job::picture::{self, Extras};
use osl_job::request::Sampling;
use osl_job::{Failure, Image, Sink};
use osl_lower::taps::{self, Doings, Most, TapPath};
use osl_studio::Thumbnail;
use osl_syntax::source::SourceMap;
use std::cell::RefCell;

/// The larger side of a picture in pixels.
const SIDE: usize = 80;
/// How many variables, conditions and loops of a line are shown.
const MOST: usize = 24;

/// The lines that do something.
pub(super) fn lines(program: &Program, sources: &SourceMap) -> Vec<u32> {
    taps::doing_lines(program, (sources, 0))
}

/// The tap that an output of a state names, if it is one: no output has a colon in its name.
pub(super) fn tap(output: &str) -> Option<Result<TapPath, String>> {
    output.contains(':').then(|| TapPath::parse(output))
}

/// Pictures of what a line does, and how many are left out.
pub(super) fn pictures(
    mut image: Image,
    line: u32,
    sink: &mut dyn Sink,
) -> Result<(Vec<Thumbnail>, usize), Failure> {
    image.points.grid = small(image.points.grid);
    image.sampling = Sampling::default();
    image.wanted.values = true;
    // Only the taps are computed.
    image.shader.outputs = Some(Vec::new());
    let most = Most { taps: MOST, rounds: figures::ROUNDS, line: Some(line) };
    let found = RefCell::new(Doings::default());
    let more_taps = |program: &Program, sources: &SourceMap| {
        let doings = taps::doings(program, (sources, 0), 0, most);
        let taps = figures::taps(&doings);
        *found.borrow_mut() = doings;
        taps
    };
    let done = picture::run(&image, Extras { more_taps: Some(&more_taps), ..Extras::default() }, sink)?;
    let results = Results::of(&done.frame, done.covered.as_ref());
    let doings = found.into_inner();
    let mut lines = Pictures { results: &results, size: image.points.grid }.lines(&doings);
    let figures = lines.remove(&line).unwrap_or_default();
    Ok((figures.into_iter().map(thumbnail).collect(), doings.more))
}

/// A smaller size of the same form.
fn small((width, height): (usize, usize)) -> (usize, usize) {
    let larger = width.max(height);
    if larger <= SIDE {
        return (width, height);
    }
    let scaled = |side: usize| ((side * SIDE + larger / 2) / larger).max(1);
    (scaled(width), scaled(height))
}

fn thumbnail(figure: Figure) -> Thumbnail {
    let Figure { name, ty, url, words, rounds, tap, range, .. } = figure;
    let (tap, range) = (Some(tap).filter(|tap| !tap.is_empty()), range.map(|(low, high)| [low, high]));
    Thumbnail { tap, name, ty, words, range, picture: url, rounds }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_have_the_form_of_the_large_one() {
        assert_eq!(small((512, 512)), (80, 80));
        assert_eq!(small((1000, 500)), (80, 40));
        assert_eq!(small((3, 4000)), (1, 80));
        assert_eq!(small((64, 48)), (64, 48));
        assert_eq!(small((0, 0)), (0, 0));
    }
}
