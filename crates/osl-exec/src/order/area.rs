//! Areas of an image: the points of a tile, and the part of a plane that they write.
//!
//! The blocks of a row are divided among several tiles if there would be few tiles otherwise.

use super::{Blocks, SIDE};
use smallvec::SmallVec;
use std::ops::Range;

/// Points that follow each other: of an image, whole rows of blocks, or neighbouring blocks of one row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    /// The points.
    pub(crate) points: Range<usize>,
    /// The first column and row, and the size, in pixels; 0 if the points have no blocks.
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

/// The part of a plane that the points of an area write: one slice with all rows if the area is as wide as
/// the image, else a slice for each row.
#[derive(Debug)]
pub(crate) struct PlaneArea<'a, W> {
    slices: SmallVec<[&'a mut [W]; 1]>,
}

impl<W> Default for PlaneArea<'_, W> {
    fn default() -> Self {
        PlaneArea { slices: SmallVec::new() }
    }
}

impl<'a, W> PlaneArea<'a, W> {
    /// All words of some points, in one slice.
    pub(crate) fn of(words: &'a mut [W]) -> PlaneArea<'a, W> {
        PlaneArea { slices: smallvec::smallvec![words] }
    }

    /// Whether nothing is to be written.
    pub(crate) fn is_empty(&self) -> bool {
        self.slices.is_empty()
    }

    /// The words from one on, if they are in one slice.
    pub(crate) fn after(&mut self, at: usize) -> Option<&mut [W]> {
        self.slices.first_mut()?.get_mut(at..)
    }

    /// The words from a column of a row on, in an area of some width and height.
    fn line(&mut self, (x, y): (usize, usize), (width, height): (usize, usize)) -> Option<&mut [W]> {
        // A single row needs no other treatment.
        let is_one = self.slices.len() == 1 && height > 1;
        let (slice, at) = if is_one { (0, y * width + x) } else { (y, x) };
        self.slices.get_mut(slice)?.get_mut(at..)
    }
}

/// Areas of points without blocks.
pub(crate) fn areas(points: Range<usize>, size: usize) -> Vec<Area> {
    let starts = points.clone().step_by(size.max(1));
    let area = |start: usize| {
        let end = points.end.min(start.saturating_add(size.max(1)));
        Area { points: start..end, x: 0, y: 0, width: 0, height: 0 }
    };
    starts.map(area).collect()
}

/// Cuts a plane, which may be empty, into the parts of areas without blocks.
pub(crate) fn cut<'p, W>(areas: &[Area], mut plane: &'p mut [W]) -> Vec<PlaneArea<'p, W>> {
    let part =
        |area: &Area| PlaneArea { slices: plane.split_off_mut(..area.points.len()).into_iter().collect() };
    areas.iter().map(part).collect()
}

impl Blocks {
    /// Areas of the points of whole rows of blocks. Each has at least `size` points, in whole rows of blocks;
    /// a single row is divided into `apart` areas.
    pub(crate) fn areas(&self, points: Range<usize>, size: usize, apart: usize) -> Vec<Area> {
        let (period, all) = (self.period(), self.width.max(1));
        let step = size.max(1).next_multiple_of(period);
        let columns = match step == period {
            true => all.div_ceil(SIDE).div_ceil(apart.max(1)) * SIDE,
            false => all,
        };
        let mut areas = Vec::new();
        for start in points.clone().step_by(step) {
            let (y, height) = (start / period * SIDE, (points.end.min(start + step) - start) / all);
            areas.extend((0..all).step_by(columns).map(|x| {
                let (width, first) = (columns.min(all - x), start + x * height);
                Area { points: first..first + width * height, x, y, width, height }
            }));
        }
        areas
    }

    /// Cuts the rows of a plane, which may be empty, into the parts of areas.
    pub(crate) fn cut<'p, W>(&self, areas: &[Area], mut plane: &'p mut [W]) -> Vec<PlaneArea<'p, W>> {
        let mut parts: Vec<PlaneArea<'p, W>> = areas.iter().map(|_| PlaneArea::default()).collect();
        let mut left = &mut parts[..];
        for row in areas.chunk_by(|a, b| a.y == b.y) {
            let height = row.first().map_or(0, |area| area.height);
            let lines = plane.split_off_mut(..self.width * height);
            let (Some(lines), Some(own)) = (lines, left.split_off_mut(..row.len())) else { break };
            // An area that is as wide as the image has one slice.
            let together = if row.len() == 1 { lines.len() } else { self.width };
            for mut line in lines.chunks_mut(together.max(1)) {
                for (area, part) in row.iter().zip(&mut *own) {
                    let count = if row.len() == 1 { line.len() } else { area.width };
                    part.slices.extend(line.split_off_mut(..count));
                }
            }
        }
        parts
    }

    /// Sorts the words of the points from `first` on into their part of a plane.
    pub(crate) fn scatter<W: Copy>(
        &self,
        first: usize,
        words: &[W],
        area: &Area,
        part: &mut PlaneArea<'_, W>,
    ) {
        let mut done = 0;
        while done < words.len() {
            let piece = self.piece(first + done);
            let here = piece.left.min(words.len() - done);
            let corner = (piece.x.saturating_sub(area.x), piece.y.saturating_sub(area.y));
            // Row by row: the rest of the first row, then whole ones.
            let mut at = 0;
            while at < here {
                let (x, y) = piece.inside(piece.first + at);
                let count = (piece.width - x).min(here - at);
                let from = &words[done + at..done + at + count];
                let line = part.line((corner.0 + x, corner.1 + y), (area.width, area.height));
                if let Some(to) = line.and_then(|line| line.get_mut(..count)) {
                    // Most rows are as long as a block is wide, which takes no call.
                    match (to.as_chunks_mut::<SIDE>().0, from.as_chunks::<SIDE>().0) {
                        ([to], [from]) if count == SIDE => *to = *from,
                        _ => to.copy_from_slice(from),
                    }
                }
                at += count;
            }
            done += here;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_land_at_their_pixels_whatever_the_areas_and_batches() {
        for (width, height) in [(37, 50), (1, 1), (5, 3), (128, 64), (200, 33), (64, 1), (33, 97)] {
            let (blocks, count) = (Blocks::new(width, height), width * height);
            for (size, apart) in [(1, 1), (1, 2), (1, 3), (1, 100), (5000, 4), (usize::MAX / 2, 1)] {
                let areas = blocks.areas(0..count, size, apart);
                let follow = areas.windows(2).all(|two| two[0].points.end == two[1].points.start);
                assert!(follow, "{areas:?}");
                let ends = areas.first().zip(areas.last()).map(|(a, b)| (a.points.start, b.points.end));
                assert_eq!(ends, Some((0, count)));
                for batch in [1, 7, 256, 300] {
                    let mut image = vec![u32::MAX; count];
                    for (area, part) in areas.iter().zip(&mut blocks.cut(&areas, &mut image)) {
                        for first in area.points.clone().step_by(batch) {
                            let points = first..(first + batch).min(area.points.end);
                            let words: Vec<u32> = points.map(|p| blocks.position(p) as u32).collect();
                            blocks.scatter(first, &words, area, part);
                        }
                    }
                    let wrong = image.iter().enumerate().find(|(at, word)| *at as u32 != **word);
                    assert_eq!(wrong, None, "{width}x{height}, size {size}, {apart}, batch {batch}");
                }
            }
        }
    }

    #[test]
    fn later_rows_of_an_image_and_no_plane_are_cut_alike() {
        let blocks = Blocks::new(70, 100);
        let (start, end) = (blocks.period(), 7000);
        let areas = blocks.areas(start..end, 1, 2);
        assert_eq!(areas.len(), 2 * 3);
        let mut image = vec![0_u32; end - start];
        for (area, part) in areas.iter().zip(&mut blocks.cut(&areas, &mut image)) {
            let words: Vec<u32> = area.points.clone().map(|p| blocks.position(p) as u32).collect();
            blocks.scatter(area.points.start, &words, area, part);
        }
        assert!(image.iter().enumerate().all(|(at, word)| (start + at) as u32 == *word));
        assert!(blocks.cut::<f64>(&areas, &mut []).iter().all(PlaneArea::is_empty));
        assert_eq!(blocks.cut::<f64>(&areas, &mut []).len(), areas.len());
    }

    #[test]
    fn points_without_blocks_are_cut_in_their_order() {
        let areas = areas(10..35, 10);
        assert_eq!(areas.iter().map(|a| a.points.clone()).collect::<Vec<_>>(), [10..20, 20..30, 30..35]);
        let mut words: Vec<u32> = (10..35).collect();
        for (area, part) in areas.iter().zip(&mut cut(&areas, &mut words)) {
            assert_eq!(
                part.after(2).and_then(|words| words.first().copied()),
                Some(area.points.start as u32 + 2)
            );
        }
        assert!(cut::<f64>(&areas, &mut []).iter_mut().all(|part| part.after(0).is_none()));
    }
}
