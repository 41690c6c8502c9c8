//! `--histogram`: how the values of each output are distributed.

use super::ranges::channel;
use osl_exec::Plane;
use osl_ir::ir::Kind;
use serde::Serialize;
use std::io::Write;

/// The number of bars.
const BARS: usize = 16;
/// The length of the longest bar, in characters.
const LONGEST: usize = 40;

/// The distribution of a component of an output.
#[derive(Debug, Serialize)]
pub struct Histogram {
    output: String,
    /// The component, as the channels of files have it.
    channel: String,
    /// The range of the finite values; none if there are no such values.
    range: Option<[f64; 2]>,
    mean: Option<f64>,
    /// The standard deviation.
    deviation: Option<f64>,
    /// How many values are in each part of the range, from the smallest on. All parts have the same width,
    /// and each value at a border counts in the upper part, except the largest value.
    counts: Vec<u64>,
    /// Values that are NaN or infinite.
    nan: u64,
    infinite: u64,
}

/// The histograms of the planes that hold numbers. `covered` is 0 at pixels that do not count.
pub fn of(planes: &[Plane], covered: Option<&Plane>) -> Vec<Histogram> {
    let covered = covered.map(Plane::floats);
    let numbers = planes.iter().filter(|plane| !matches!(plane.kind, Kind::Str | Kind::Closure));
    numbers.map(|plane| one(plane, covered.as_deref())).collect()
}

fn one(plane: &Plane, covered: Option<&[f32]>) -> Histogram {
    let counts_at = |at: usize| covered.is_none_or(|covered| covered.get(at).is_some_and(|c| *c > 0.0));
    let all = plane.doubles();
    let values = || all.iter().enumerate().filter(|(at, _)| counts_at(*at)).map(|(_, x)| *x);
    let finite = || values().filter(|x| x.is_finite());
    let (mut low, mut high, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0_u64);
    for x in finite() {
        (low, high) = (low.min(x), high.max(x));
        sum += x;
        count += 1;
    }
    let found = Histogram {
        output: plane.output.to_string(),
        channel: channel(&plane.output, plane.ty, plane.component),
        range: None,
        mean: None,
        deviation: None,
        counts: Vec::new(),
        nan: values().filter(|x| x.is_nan()).count() as u64,
        infinite: values().filter(|x| x.is_infinite()).count() as u64,
    };
    if count == 0 {
        return found;
    }
    let mean = sum / count as f64;
    let deviation = (finite().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count as f64).sqrt();
    // A constant is one bar.
    let mut counts = vec![0; if low < high { BARS } else { 1 }];
    let last = counts.len() - 1;
    for x in finite() {
        let part = (x - low) / (high - low);
        let bar = if part.is_nan() { 0 } else { ((part * BARS as f64) as usize).min(last) };
        if let Some(count) = counts.get_mut(bar) {
            *count += 1;
        }
    }
    Histogram { range: Some([low, high]), mean: Some(mean), deviation: Some(deviation), counts, ..found }
}

/// Prints them for people.
pub fn print(list: &[Histogram], out: &mut dyn Write) {
    for Histogram { channel: name, range, mean, deviation, counts, nan, infinite, .. } in list {
        let (Some([low, high]), Some(mean), Some(deviation)) = (range, mean, deviation) else {
            let _ = writeln!(out, "{name}: no finite value, {nan} NaN, {infinite} infinite");
            continue;
        };
        let bad =
            if nan + infinite > 0 { format!(", {nan} NaN, {infinite} infinite") } else { String::new() };
        let _ = writeln!(
            out,
            "{name}: {} to {}, mean {mean:.6}, standard deviation {deviation:.6}{bad}",
            short(*low),
            short(*high)
        );
        let most = counts.iter().copied().max().unwrap_or(0).max(1);
        let total = counts.iter().sum::<u64>().max(1);
        for (at, count) in counts.iter().enumerate() {
            let from = low + (high - low) * at as f64 / counts.len() as f64;
            let length = (*count as f64 / most as f64 * LONGEST as f64).ceil() as usize;
            let share = 100.0 * *count as f64 / total as f64;
            let _ = writeln!(out, "  {from:>12.5} {:<LONGEST$} {share:>6.2} %", "#".repeat(length));
        }
    }
}

/// The shortest number that is read as the same float.
fn short(x: f64) -> String {
    if f64::from(x as f32) == x { (x as f32).to_string() } else { x.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_ir::types::Type;

    fn plane(values: &[f32]) -> Plane {
        Plane {
            output: "x".into(),
            ty: Type::FLOAT,
            component: 0,
            kind: Kind::Float,
            words: values.iter().map(|x| x.to_bits()).collect(),
            wide: Vec::new(),
        }
    }

    #[test]
    fn values_are_counted_by_size() {
        let values: Vec<f32> = (0..=16).map(|i| i as f32 / 16.0).chain([f32::NAN, f32::INFINITY]).collect();
        let found = one(&plane(&values), None);
        assert_eq!((found.range, found.mean), (Some([0.0, 1.0]), Some(0.5)));
        assert_eq!((found.nan, found.infinite), (1, 1));
        let mut counts = vec![1; 16];
        counts[15] = 2;
        assert_eq!(found.counts, counts, "the largest value is in the last bar");
    }

    #[test]
    fn constants_and_uncovered_pixels_have_their_bars() {
        let found = one(&plane(&[0.5; 4]), None);
        assert_eq!((found.counts, found.deviation), (vec![4], Some(0.0)));
        let found = one(&plane(&[0.5, 9.0]), Some(&[1.0, 0.0]));
        assert_eq!((found.counts, found.range), (vec![1], Some([0.5, 0.5])));
        let found = one(&plane(&[f32::NAN]), None);
        assert_eq!((found.counts, found.range), (Vec::new(), None));
        let found = one(&plane(&[f32::MIN, f32::MAX]), None);
        assert_eq!((found.counts[0], found.counts[15]), (1, 1));
    }
}
