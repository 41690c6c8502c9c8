//! `--prefilter` decided for each pixel: where a pixel is filtered, and whether its neighbourhood confirms
//! it.
//!
//! The mean that a filtered program computes is right for a straight edge, and wrong where the edge folds
//! within the pixel. The plain program around the pixel tells the two apart. A straight edge through a pixel
//! separates its corners, and it separates the centres of its four neighbours. So a pixel stays plain where
//! these centres agree. Where they differ, the plain program also computes the corners of the pixel, which
//! neighbours share. Where these differ too, the pixel is filtered. Its filtered value of an output counts if
//! all these points are consistent with a straight edge, the value may be its mean, and it is not almost the
//! plain value.
//!
//! This module must not know what is filtered, or what is done with its answers.

use super::bounds::outputs;
use super::image::{Guard, Image, Shading, TOGETHER, not_finite};
use super::points::PlacedPoints;
use super::surface::PixelPosition;
use osl_exec::{Frame, RunError, RunOptions};
use std::ops::Range;

/// A difference that can be seen, as a share of the output's range. Values agree up to it.
pub(super) const SEEN: f64 = 0.01;
/// A difference that does not matter, as a share of the output's range.
pub(super) const CHANGED: f64 = 0.002;
/// The smallest change of a pixel that is worth the risk of a mean that is wrong, as a share of the range.
const WORTH: f64 = 0.05;
/// Scattered pixels are computed by squares with this side, in pixels, and in small batches, because a batch
/// of neighbours has few cells of a pattern and is quicker.
const SQUARE: usize = 32;
/// Points of such a batch.
const BATCH: usize = 256;

/// A plane in and around a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    /// The centre of the pixel.
    pub(super) centre: f32,
    /// The centres of the neighbours above, on the right, below and on the left.
    pub(super) sides: [f32; 4],
    /// The corners, clockwise from the left one above.
    pub(super) corners: [f32; 4],
}

/// The largest share of a pixel on one side of a straight edge, by the number of corners on this side. With
/// one corner, it is that of the triangle between this corner and its neighbours.
const LARGEST: [f64; 5] = [0.0, 0.5, 1.0, 1.0, 1.0];

/// Whether some values are the same as another one, as far as one can see. A NaN differs from everything.
fn agree(values: [f32; 4], with: f32, range: f64) -> bool {
    let most = (SEEN * range) as f32;
    values.iter().all(|value| (value - with).abs() <= most)
}

impl Around {
    /// Whether an edge may pass: the neighbours differ.
    pub(super) fn sides_differ(&self, range: f64) -> bool {
        !agree(self.sides, self.centre, range)
    }

    /// Whether an edge passes: the corners differ.
    pub(super) fn corners_differ(&self, range: f64) -> bool {
        !agree(self.corners, self.corners[0], range)
    }

    /// Whether a filtered value may be the mean of the pixel: the points around it are consistent with a
    /// straight edge between the lowest and the highest corner, and the value with this edge.
    fn confirms(&self, filtered: f32, range: f64) -> bool {
        if self.corners.iter().any(|corner| corner.is_nan()) {
            return false;
        }
        let low = self.corners.iter().copied().fold(f32::INFINITY, f32::min);
        let high = self.corners.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let is_high = |value: f32| value > 0.5 * (low + high);
        let (corners, sides) = (self.corners.map(is_high), self.sides.map(is_high));
        let count = corners.iter().filter(|corner| **corner).count();

        let [low, height] = [f64::from(low), f64::from(high) - f64::from(low)];
        let is_flat = height <= SEEN * range;
        let [least, most] = if is_flat { [0.0, 1.0] } else { [1.0 - LARGEST[4 - count], LARGEST[count]] };
        let small = CHANGED * range;
        let means = low + least * height - small..=low + most * height + small;
        means.contains(&f64::from(filtered)) && (is_flat || is_straight(corners, sides))
    }
}

/// Whether the filtered values of an output count, each with what is around the pixel in its plane and with
/// the range of the output: they are confirmed, and one of them is worth it.
pub(super) fn count(values: impl Iterator<Item = Option<(Around, f32, f64)>>) -> bool {
    let mut is_worth_it = false;
    for value in values {
        let Some((around, own, range)) = value else { return false };
        if !around.confirms(own, range) {
            return false;
        }
        is_worth_it |= f64::from((own - around.centre).abs()) >= WORTH * range;
    }
    is_worth_it
}

/// Whether a straight edge may separate those corners and neighbours for which a number is true from the
/// others. The neighbour with a number lies between the corner with this number and the next one.
fn is_straight(corners: [bool; 4], sides: [bool; 4]) -> bool {
    let on = |at: usize, by: usize| (at + by) % 4;
    let count = corners.iter().filter(|corner| **corner).count();
    let odd = count != 3;
    let begins = |at: &usize| corners[*at] == odd && (count != 2 || corners[on(*at, 3)] != odd);
    (0..4).find(begins).is_some_and(|at| match count {
        // Only this corner is odd. So is one of the neighbours beside it, and neither of the other two.
        1 | 3 => {
            let beside = [sides[at], sides[on(at, 3)]];
            beside.contains(&odd) && sides[on(at, 1)] != odd && sides[on(at, 2)] != odd
        }
        // This corner and the next are odd. So is the neighbour between them, and the opposite one is not.
        _ => corners[on(at, 1)] == odd && sides[at] == odd && sides[on(at, 2)] != odd,
    })
}

/// A line or column of pixels as the nearest one inside of an image, and the offset from it.
fn inside(at: isize, count: usize) -> (u32, f32) {
    match usize::try_from(at) {
        Err(_) => (0, at as f32),
        Ok(at) if at < count => (at as u32, 0.0),
        Ok(at) => (count.saturating_sub(1) as u32, (at + 1 - count) as f32),
    }
}

/// The centre of a pixel of an image of this size, which may lie beside the image.
fn centre([x, y]: [isize; 2], (width, height): (usize, usize)) -> PixelPosition {
    let ((x, right), (y, down)) = (inside(x, width), inside(y, height));
    PixelPosition { pixel: [x, y], offset: [right, down] }
}

/// The corner above and on the left of a pixel.
fn corner([x, y]: [usize; 2], size: (usize, usize)) -> PixelPosition {
    let PixelPosition { pixel, offset } = centre([x as isize, y as isize], size);
    PixelPosition { pixel, offset: offset.map(|offset| offset - 0.5) }
}

/// Positions of a rectangle, square by square, for which something holds.
fn by_squares((width, height): (usize, usize), holds: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut found = Vec::new();
    for top in (0..height).step_by(SQUARE) {
        for left in (0..width).step_by(SQUARE) {
            for y in top..(top + SQUARE).min(height) {
                let row = y * width;
                found.extend((row + left..row + (left + SQUARE).min(width)).filter(|at| holds(*at)));
            }
        }
    }
    found
}

impl Shading<'_> {
    /// The values of the program at some places, plane by plane.
    fn placed(&self, places: &[PixelPosition], said: &mut Frame) -> Result<Vec<Vec<f32>>, RunError> {
        self.values(&PlacedPoints { surface: self.surface, places }, said)
    }

    /// What is around some pixels, for each plane. It takes [`AROUND`] evaluations for each.
    pub(super) fn around(&self, pixels: &[u32]) -> Result<Vec<Vec<Around>>, RunError> {
        let size = self.surface.size();
        let of = |pixel: &u32| -> [PixelPosition; AROUND] {
            let [x, y] = [*pixel as usize % size.0.max(1), *pixel as usize / size.0.max(1)];
            let own = |right: isize, down: isize| centre([x as isize + right, y as isize + down], size);
            let corner = |right: usize, down: usize| corner([x + right, y + down], size);
            let ([a, b, c, d], [e, f, g, h]) = (
                [own(0, -1), own(1, 0), own(0, 1), own(-1, 0)],
                [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)],
            );
            [own(0, 0), a, b, c, d, e, f, g, h]
        };
        let places: Vec<PixelPosition> = pixels.iter().flat_map(of).collect();
        let values = self.placed(&places, &mut Frame::default())?;
        let one = |[centre, a, b, c, d, e, f, g, h]: &[f32; AROUND]| Around {
            centre: *centre,
            sides: [*a, *b, *c, *d],
            corners: [*e, *f, *g, *h],
        };
        Ok(values.iter().map(|plane| plane.as_chunks().0.iter().map(one).collect()).collect())
    }

    /// Some rows of an image with one sample in each pixel, filtered where the neighbourhood confirms it.
    pub(super) fn guarded(&self, guard: Guard<'_>, rows: Range<usize>) -> Result<Image, RunError> {
        let (width, height) = self.surface.size();
        let rows = rows.start.min(height)..rows.end.min(height);
        let batch = Some(self.options.batch.map_or(BATCH, |batch| batch.min(BATCH)));
        let options = RunOptions { batch, ..self.options.clone() };
        let rows_of = Shading { program: guard.plain, guard: None, ..self.clone() };
        let plain = Shading { options: &options, ..rows_of.clone() };
        let filtered = Shading { options: &options, guard: None, ..self.clone() };
        let mut image = Image::default();
        let mut values = vec![Vec::with_capacity(rows.len() * width); self.planes().len()];
        // The profile of the filtered program.
        let mut aside = Frame::default();
        let at_once = (TOGETHER / (width + 2)).saturating_sub(2).max(1);
        let mut first = rows.start;
        while first < rows.end {
            let some = first..(first + at_once).min(rows.end);
            let centres = rows_of.centres(&rows_of.pixels(some.clone()), &mut image.frame)?;
            image.tally.evaluations += (some.len() * width) as u64;
            let piece =
                Piece { filtered: &filtered, plain: &plain, ranges: guard.ranges, rows: some.clone() };
            let (own, evaluations) = piece.values(centres, [&mut image.frame, &mut aside])?;
            values.iter_mut().zip(own).for_each(|(all, own)| all.extend(own));
            image.tally.evaluations += evaluations;
            first = some.end;
        }
        image.frame.profile.extend(aside.profile);
        image.tally.pixels = (rows.len() * width) as u64;
        image.tally.note(1, image.tally.pixels);
        image.tally.not_finite = not_finite(&values);
        image.frame.planes = self.filled(values);
        Ok(image)
    }
}

/// Evaluations that show what is around a pixel: its centre, those of four neighbours, and four corners.
pub(super) const AROUND: usize = 9;

/// Some rows that are computed at once.
struct Piece<'a> {
    filtered: &'a Shading<'a>,
    plain: &'a Shading<'a>,
    ranges: &'a [f64],
    rows: Range<usize>,
}

/// What the plain program computed in and around some rows.
struct PlainValues {
    width: usize,
    /// For each plane the centres, with a pixel more at all ends of rows and columns.
    centres: Vec<Vec<f32>>,
    /// For each plane the corners.
    corners: Vec<Vec<f32>>,
    /// For each corner of the rows, its number in the planes.
    numbers: Vec<u32>,
}

impl PlainValues {
    /// What is around a pixel of the rows. The corners may be missing.
    fn around(&self, plane: usize, at: usize) -> Around {
        let (x, y) = (at % self.width, at / self.width);
        let line = self.width + 2;
        let own = (y + 1) * line + x + 1;
        let centres = self.centres.get(plane).map_or(&[][..], |plane| plane);
        let of = |at: usize| centres.get(at).copied().unwrap_or(f32::NAN);
        let corner = |right: usize, down: usize| {
            let number = self.numbers.get((y + down) * (self.width + 1) + x + right);
            let value = number.and_then(|number| self.corners.get(plane)?.get(*number as usize));
            value.copied().unwrap_or(f32::NAN)
        };
        Around {
            centre: of(own),
            sides: [of(own - line), of(own + 1), of(own + line), of(own - 1)],
            corners: [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)],
        }
    }

    /// For each pixel of some rows whether its neighbours differ in any plane.
    fn sides_differ(&self, rows: usize, ranges: &[f64]) -> Vec<bool> {
        let mut differ = vec![false; self.width * rows];
        for (plane, range) in self.centres.iter().zip(ranges) {
            let most = (SEEN * range) as f32;
            let lines = plane.chunks(self.width + 2);
            let three = lines.clone().zip(lines.clone().skip(1)).zip(lines.skip(2));
            for (((above, own), below), differ) in three.zip(differ.chunks_mut(self.width.max(1))) {
                let columns = own.windows(3).zip(above.iter().zip(below).skip(1));
                for ((row, (above, below)), differ) in columns.zip(differ) {
                    let [left, centre, right] = row else { continue };
                    let is_same = |value: &f32| (value - centre).abs() <= most;
                    // A NaN is the same as nothing. All are compared, because that is quicker.
                    *differ |= !(is_same(left) & is_same(right) & is_same(above) & is_same(below));
                }
            }
        }
        differ
    }
}

impl Piece<'_> {
    /// The values of the pixels, plane by plane, from those of the plain program, and the number of further
    /// evaluations. The first frame gets the profile of the plain program, the second one that of the
    /// filtered program.
    fn values(
        &self,
        mut values: Vec<Vec<f32>>,
        [said, aside]: [&mut Frame; 2],
    ) -> Result<(Vec<Vec<f32>>, u64), RunError> {
        let Piece { filtered, plain, ranges, rows } = self;
        let (width, _) = plain.surface.size();
        let size = (width, rows.len());
        let limits = &plain.options.limits.running;
        // Each pixel has its messages once.
        let profile = |frame: Frame, said: &mut Frame| {
            said.add(Frame { profile: frame.profile, ..Frame::default() }, limits);
        };
        let mut frame = Frame::default();
        let mut known = self.beside(&values, &mut frame)?;
        let mut evaluations = 2 * (width + rows.len());
        profile(frame, said);

        let differ = known.sides_differ(rows.len(), ranges);
        let open = by_squares(size, |at| differ.get(at) == Some(&true));
        let mut frame = Frame::default();
        evaluations += self.compute_corners(&open, &mut known, &mut frame)?;
        profile(frame, said);

        let has_edge = |at: &usize| {
            let mut planes = ranges.iter().enumerate();
            planes.any(|(plane, range)| known.around(plane, *at).corners_differ(*range))
        };
        let wanted: Vec<usize> = open.into_iter().filter(has_edge).collect();
        let pixels: Vec<u32> = wanted.iter().map(|at| (rows.start * width + at) as u32).collect();
        let mut frame = Frame::default();
        let own = filtered.centres(&pixels, &mut frame)?;
        evaluations += wanted.len();
        profile(frame, aside);

        for output in outputs(&plain.planes()) {
            let own = own.get(output.clone()).unwrap_or(&[]);
            let values = values.get_mut(output.clone()).unwrap_or(&mut []);
            for (index, at) in wanted.iter().enumerate() {
                let of_plane = |(plane, own): (usize, &Vec<f32>)| {
                    Some((known.around(plane, *at), *own.get(index)?, *ranges.get(plane)?))
                };
                if count(output.clone().zip(own).map(of_plane)) {
                    put(values, *at, own, index);
                }
            }
        }
        Ok((values, evaluations as u64))
    }

    /// The centres of the pixels, and those of the pixels beside them.
    fn beside(&self, values: &[Vec<f32>], said: &mut Frame) -> Result<PlainValues, RunError> {
        let (plain, rows) = (self.plain, &self.rows);
        let size = plain.surface.size();
        let (width, line) = (size.0, size.0 + 2);
        let lines = [rows.start as isize - 1, rows.end as isize];
        let across = lines.into_iter().flat_map(|y| (0..width as isize).map(move |x| [x, y]));
        let ends = [-1, width as isize];
        let along = rows.clone().flat_map(|y| ends.map(|x| [x, y as isize]));
        let positions: Vec<[isize; 2]> = across.chain(along).collect();
        let places: Vec<PixelPosition> = positions.iter().map(|at| centre(*at, size)).collect();
        let beside = plain.placed(&places, said)?;
        let whole = |(own, beside): (&Vec<f32>, &Vec<f32>)| {
            let mut plane = vec![f32::NAN; line * (rows.len() + 2)];
            let mut rows_of = plane.chunks_mut(line).skip(1);
            for own in own.chunks(width.max(1)) {
                if let Some(row) = rows_of.next().and_then(|row| row.get_mut(1..=own.len())) {
                    row.copy_from_slice(own);
                }
            }
            for ([x, y], value) in positions.iter().zip(beside) {
                let at = (y + 1 - rows.start as isize) * line as isize + x + 1;
                if let Some(own) = usize::try_from(at).ok().and_then(|at| plane.get_mut(at)) {
                    *own = *value;
                }
            }
            plane
        };
        let centres = values.iter().zip(&beside).map(whole).collect();
        Ok(PlainValues { width, centres, corners: Vec::new(), numbers: Vec::new() })
    }

    /// Computes the corners of some pixels. Returns how many there are.
    fn compute_corners(
        &self,
        pixels: &[usize],
        known: &mut PlainValues,
        said: &mut Frame,
    ) -> Result<usize, RunError> {
        let size = self.plain.surface.size();
        let line = size.0 + 1;
        let mut numbers = vec![u32::MAX; line * (self.rows.len() + 1)];
        for at in pixels {
            let first = at + at / size.0.max(1);
            for corner in [first, first + 1, first + line, first + line + 1] {
                if let Some(number) = numbers.get_mut(corner) {
                    *number = 0;
                }
            }
        }
        let wanted = by_squares((line, self.rows.len() + 1), |at| numbers.get(at) == Some(&0));
        let place = |at: &usize| corner([at % line, self.rows.start + at / line], size);
        let places: Vec<PixelPosition> = wanted.iter().map(place).collect();
        for (number, at) in wanted.iter().enumerate() {
            if let Some(own) = numbers.get_mut(*at) {
                *own = number as u32;
            }
        }
        known.corners = self.plain.placed(&places, said)?;
        known.numbers = numbers;
        Ok(places.len())
    }
}

/// Copies a value of some planes.
fn put(values: &mut [Vec<f32>], at: usize, from: &[Vec<f32>], index: usize) {
    for (values, from) in values.iter_mut().zip(from) {
        if let (Some(value), Some(from)) = (values.get_mut(at), from.get(index)) {
            *value = *from;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is around a pixel of an image.
    fn around(image: impl Fn(f32, f32) -> f32) -> Around {
        Around {
            centre: image(0.0, 0.0),
            sides: [image(0.0, -1.0), image(1.0, 0.0), image(0.0, 1.0), image(-1.0, 0.0)],
            corners: [image(-0.5, -0.5), image(0.5, -0.5), image(0.5, 0.5), image(-0.5, 0.5)],
        }
    }

    #[test]
    fn all_straight_edges_are_confirmed_with_their_mean() {
        for turn in 0..64 {
            let (x, y) = (turn as f32 * 0.1).sin_cos();
            for step in -60..=60 {
                let edge = |u: f32, v: f32| f32::from(u8::from(u * x + v * y > step as f32 * 0.012 + 1e-4));
                let own = around(edge);
                let cells = (0..4096).map(|at| ((at % 64) as f32 / 64.0, (at / 64) as f32 / 64.0));
                let mean = cells.map(|(u, v)| edge(u - 0.492, v - 0.492)).sum::<f32>() / 4096.0;
                assert!(own.confirms(mean, 1.0), "turned by {turn}, at {step}: {mean} of {own:?}");
                assert!(own.sides_differ(1.0) || !own.corners_differ(1.0), "turned by {turn}, at {step}");
            }
        }
    }

    #[test]
    fn what_is_not_a_straight_edge_is_refused() {
        let flat = around(|_, _| 0.0);
        assert!(!flat.confirms(0.3, 1.0), "a fold that the pixel does not have");
        let tip = around(|u, v| f32::from(u8::from(u > 0.4 && (u - v).abs() < 0.2)));
        assert!(!tip.confirms(0.1, 1.0), "a tip in a corner");
        let saddle = around(|u, v| f32::from(u8::from(u * v > 0.0)));
        assert!(!saddle.confirms(0.5, 1.0), "opposite corners");
        let half = around(|u, v| f32::from(u8::from(u + v > 0.6)));
        assert!(half.confirms(0.1, 1.0) && !half.confirms(0.6, 1.0), "more than the corner may have");
        assert!(!around(|u, _| if u > 0.0 { 1.0 } else { f32::NAN }).confirms(0.5, 1.0));
        assert!(!around(|u, _| u).confirms(f32::NAN, 1.0));
    }

    #[test]
    fn a_small_change_of_all_planes_is_not_worth_it() {
        let edge = around(|u, _| f32::from(u8::from(u > 0.4)));
        let counts = |values: [f32; 2]| count(values.into_iter().map(|value| Some((edge, value, 1.0))));
        assert!(counts([0.04, 0.1]) && !counts([0.04, 0.03]));
    }

    #[test]
    fn slopes_are_confirmed() {
        for (x, y) in [(1.0, 0.0), (0.3, 0.4), (-0.2, 0.5), (0.7, -0.7)] {
            assert!(around(|u, v| 0.5 + x * u + y * v).confirms(0.5, 1.0), "{x} {y}");
        }
    }

    #[test]
    fn places_beside_the_image_belong_to_its_last_pixels() {
        let size = (3, 2);
        assert_eq!(corner([1, 0], size), PixelPosition { pixel: [1, 0], offset: [-0.5, -0.5] });
        assert_eq!(corner([3, 2], size), PixelPosition { pixel: [2, 1], offset: [0.5, 0.5] });
        assert_eq!(centre([-1, 1], size), PixelPosition { pixel: [0, 1], offset: [-1.0, 0.0] });
        assert_eq!(centre([2, 2], size), PixelPosition { pixel: [2, 1], offset: [0.0, 1.0] });
    }

    #[test]
    fn squares_have_all_positions_once() {
        let mut all = by_squares((70, 40), |_| true);
        assert_eq!(all[SQUARE], 70, "the second row of the first square");
        all.sort_unstable();
        assert_eq!(all, (0..2800).collect::<Vec<_>>());
        assert_eq!(by_squares((70, 40), |at| at == 2799), [2799]);
    }
}
