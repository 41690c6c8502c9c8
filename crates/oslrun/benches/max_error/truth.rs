//! What is known of a case before it is measured: the true values of its pixels, and the best fixed setting.
//! Both take most of the time and do not change with the driver, so they are kept in files.

use crate::shaders::Shader;
use osl_measure::sample::{
    Image, Oracle, PROMISED, Pattern, Rate, Shading, Watch, at_rate, check, oracle, reaches,
};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A truth is enough if its standard error is below this share of the smallest bound.
const ENOUGH: f32 = 0.02;

/// A fixed setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fixed {
    Rate(Rate),
    Samples(u32),
}

impl Fixed {
    pub(crate) fn image(self, shading: &Shading<'_>) -> Image {
        let rows = 0..shading.surface.size().1;
        match self {
            Fixed::Rate(rate) => at_rate(shading, rows, rate).expect("an image"),
            Fixed::Samples(samples) => shading.rows(rows, samples).expect("an image"),
        }
    }

    fn from_name(name: &str) -> Option<Fixed> {
        Rate::from_name(name).map(Fixed::Rate).or_else(|| Some(Fixed::Samples(name.parse().ok()?)))
    }

    pub(crate) fn name(self) -> String {
        match self {
            Fixed::Rate(rate) => rate.to_string(),
            Fixed::Samples(samples) => samples.to_string(),
        }
    }
}

/// The truth of an image, and the bounds.
pub(crate) struct Truth {
    pub(crate) oracle: Oracle,
    /// The size of the range of each plane.
    ranges: Vec<f32>,
    file: PathBuf,
}

impl Truth {
    /// Reads the truth of an image, or computes it. `smallest` is the smallest bound as a share. The last
    /// arguments are the folder, the number of pixels with a known truth, its samples, and those of pixels
    /// where these are not enough.
    pub(crate) fn of(
        shader: &Shader,
        shading: &Shading<'_>,
        smallest: f32,
        (folder, [pixels, few, many]): (&Path, [u32; 3]),
    ) -> Truth {
        let size = shading.surface.size();
        let pixels = pixels as usize;
        let mut hasher = DefaultHasher::new();
        (shader.identity(), size, pixels, few, many, smallest.to_bits()).hash(&mut hasher);
        let file = folder.join(format!("{:016x}.truth", hasher.finish()));
        let mut ranges = vec![1.0; shading.planes().len()];
        for reach in reaches(shading).expect("ranges") {
            ranges[reach.planes.clone()].fill(reach.size());
        }
        let watched = Watch::new(size.0 * size.1, pixels).pixels().to_vec();
        let oracle = read(&file, &watched, (ranges.len(), few)).unwrap_or_else(|| {
            let mut found = oracle(shading, &watched, few).expect("a truth");
            let unsure = |at: &usize| {
                let mut planes = found.errors.iter().zip(&ranges);
                planes.any(|(errors, range)| errors[*at] > ENOUGH * smallest * range)
            };
            let again: Vec<usize> = (0..watched.len()).filter(unsure).collect();
            let some: Vec<u32> = again.iter().map(|at| watched[*at]).collect();
            if few < many && !some.is_empty() {
                let better = osl_measure::sample::oracle(shading, &some, many).expect("a truth");
                let pairs = found.values.iter_mut().zip(&better.values);
                for (own, better) in pairs.chain(found.errors.iter_mut().zip(&better.errors)) {
                    again.iter().zip(better).for_each(|(at, value)| own[*at] = *value);
                }
            }
            write(&file, &found);
            found
        });
        Truth { oracle, ranges, file }
    }

    /// The bounds of the planes for an error that is a share of the range.
    pub(crate) fn bounds(&self, error: f32) -> Vec<f32> {
        self.ranges.iter().map(|range| (error * range).max(f32::MIN_POSITIVE)).collect()
    }

    /// The share of pixels above an error.
    pub(crate) fn above(&self, image: &Image, error: f32) -> f64 {
        let planes: Vec<Vec<f32>> = image.frame.planes.iter().map(|p| p.floats()).collect();
        self.share(&planes, error, |pixel| pixel as usize)
    }

    fn share(&self, planes: &[Vec<f32>], error: f32, position: impl Fn(u32) -> usize) -> f64 {
        let bounds: Vec<f64> = self.bounds(error).into_iter().map(f64::from).collect();
        let found = check(planes, &self.oracle, &bounds, position);
        found.above as f64 / found.pixels.max(1) as f64
    }

    /// Whether the truth is more accurate than an error at almost all pixels.
    pub(crate) fn is_known(&self, error: f32) -> bool {
        let bounds = self.bounds(error);
        let unknown =
            |at: &usize| self.oracle.errors.iter().zip(&bounds).any(|(plane, bound)| plane[*at] > *bound);
        let count = self.oracle.pixels.len();
        (0..count).filter(unknown).count() as f64 <= PROMISED * count as f64
    }

    /// For each error, the fixed setting with the fewest evaluations that keeps it, if any does: a rate, or a
    /// power of two of samples.
    pub(crate) fn best(
        &self,
        shading: &Shading<'_>,
        errors: &[f32],
        (seed, most): (u32, u32),
    ) -> Vec<Option<Fixed>> {
        let file = self.file.with_extension(format!("{seed}.best"));
        if let Ok(text) = std::fs::read_to_string(&file) {
            return text.lines().map(Fixed::from_name).collect();
        }
        let mut best: Vec<Option<Fixed>> = vec![None; errors.len()];
        let mut note = |fixed: Fixed, planes: &[Vec<f32>], position: &dyn Fn(u32) -> usize| {
            for (best, error) in best.iter_mut().zip(errors) {
                if best.is_none() && self.share(planes, *error, position) <= PROMISED {
                    *best = Some(fixed);
                }
            }
            best.iter().all(Option::is_some)
        };
        let mut done = false;
        for rate in [[4, 4], [2, 2], [2, 1], [1, 1]].map(|rate| Fixed::Rate(Rate(rate))) {
            let planes: Vec<Vec<f32>> = rate.image(shading).frame.planes.iter().map(|p| p.floats()).collect();
            done = done || note(rate, &planes, &|pixel| pixel as usize);
        }
        let shading = Shading { pattern: Pattern::new(most, seed), ..shading.clone() };
        let pixels = &self.oracle.pixels;
        for samples in (1..).map(|level| 1_u32 << level).take_while(|n| *n <= most) {
            if !done {
                // The checked pixels are enough to see whether the setting is good.
                let some = shading.chosen(pixels, samples).expect("samples");
                let position = |pixel: u32| pixels.binary_search(&pixel).expect("a checked pixel");
                done = note(Fixed::Samples(samples), &some, &position);
            }
        }
        let lines: Vec<String> = best.iter().map(|b| b.map_or("-".into(), Fixed::name)).collect();
        std::fs::write(file, lines.join("\n") + "\n").expect("a file");
        best
    }
}

fn write(file: &Path, oracle: &Oracle) {
    let all = oracle.values.iter().chain(&oracle.errors).flatten();
    std::fs::write(file, all.flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()).expect("a file");
}

fn read(file: &Path, pixels: &[u32], (planes, samples): (usize, u32)) -> Option<Oracle> {
    let bytes = std::fs::read(file).ok()?;
    let all: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let lists: Vec<Vec<f32>> = all.chunks(pixels.len()).map(<[f32]>::to_vec).collect();
    (lists.len() == 2 * planes).then(|| Oracle {
        pixels: pixels.to_vec(),
        samples,
        values: lists[..planes].to_vec(),
        errors: lists[planes..].to_vec(),
        ..Oracle::default()
    })
}
