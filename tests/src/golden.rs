//! Reference data: values recorded on a grid, as comma-separated text.

use flate2::read::GzDecoder;
use std::io::Read;
use std::path::Path;

/// A recorded run.
#[derive(Clone, Debug, Default)]
pub struct Golden {
    /// Points in a row and rows.
    pub size: (usize, usize),
    /// Factors of u and v.
    pub scale: [f32; 2],
    /// Offsets of u and v.
    pub offset: [f32; 2],
    /// Whether points are at pixel centres.
    pub center: bool,
    /// Parameter values: type, name and text.
    pub params: Vec<(String, String, String)>,
    /// Parameters that take the point's own value.
    pub interpolated: Vec<String>,
    /// Keys that this reader does not interpret.
    pub other: Vec<String>,
    /// `u`, `v`, then `f`, `c.r`, `a[0]` …: a name, and a value for each point.
    pub columns: Vec<(String, Vec<f32>)>,
}

impl Golden {
    /// Reads a file, compressed or not.
    ///
    /// # Errors
    /// The file is missing or not in the format.
    pub fn load(path: &Path) -> Result<Golden, String> {
        let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut text = String::new();
        if path.extension().is_some_and(|e| e == "gz") {
            GzDecoder::new(&bytes[..]).read_to_string(&mut text).map_err(|e| e.to_string())?;
        } else {
            text = String::from_utf8(bytes).map_err(|e| e.to_string())?;
        }
        Golden::parse(&text).ok_or_else(|| format!("{}: not a recorded run", path.display()))
    }

    /// The conditions in the `//@` lines of a shader, without values.
    pub fn conditions(shader: &str) -> Golden {
        let mut golden = Golden { scale: [1.0; 2], size: (1, 1), ..Golden::default() };
        for key in shader.lines().filter_map(|line| line.strip_prefix("//@ ")) {
            let _ = golden.key(key.trim());
        }
        golden
    }

    fn parse(text: &str) -> Option<Golden> {
        let mut lines = text.lines();
        let mut golden = Golden { scale: [1.0; 2], ..Golden::default() };
        for key in lines.next()?.strip_prefix("# ")?.split("; ") {
            golden.key(key)?;
        }
        let names: Vec<&str> = lines.next()?.split(',').collect();
        golden.columns = names.iter().map(|n| (n.to_string(), Vec::new())).collect();
        for line in lines {
            for ((_, values), text) in golden.columns.iter_mut().zip(line.split(',')) {
                values.push(text.parse().ok()?);
            }
        }
        golden.columns.drain(..2);
        Some(golden)
    }

    /// Renames the columns of an output with more than ten components to match their contents, unless
    /// `is_int` says that the output was recorded in order. The recorder wrote floats in the alphabetical
    /// order of their numbers (4, then 10 before 5), except for the first four, under names in numerical
    /// order.
    pub fn untangle(&mut self, is_int: impl Fn(&str) -> bool) {
        let stem = |name: &str| name.split_once('[').map_or(String::new(), |(stem, _)| stem.to_string());
        for group in self.columns.chunk_by_mut(|(a, _), (b, _)| stem(a) == stem(b) && !stem(a).is_empty()) {
            if group.first().is_some_and(|(name, _)| is_int(&stem(name))) {
                continue;
            }
            let names: Vec<String> = group.iter().map(|(name, _)| name.clone()).collect();
            let mut held: Vec<usize> = (0..names.len()).collect();
            if let Some(rest) = held.get_mut(4..) {
                rest.sort_by_key(usize::to_string);
            }
            group.iter_mut().zip(held).for_each(|((name, _), index)| name.clone_from(&names[index]));
        }
    }

    fn key(&mut self, key: &str) -> Option<()> {
        let words: Vec<&str> = key.split_whitespace().collect();
        let pair = |at: usize| Some([words.get(at)?.parse().ok()?, words.get(at + 1)?.parse().ok()?]);
        match words.first().copied()? {
            "grid" => self.size = (words.get(1)?.parse().ok()?, words.get(2)?.parse().ok()?),
            "scaleuv" => self.scale = pair(1)?,
            "offsetuv" => self.offset = pair(1)?,
            "center" => self.center = true,
            word @ ("param" | "interp-param") => {
                let (ty, name) = (words.get(1)?.to_string(), words.get(2)?.to_string());
                if word == "interp-param" {
                    self.interpolated.push(name.clone());
                }
                self.params.push((ty, name, words.get(3..)?.join(" ").trim_matches('"').to_string()));
            }
            _ => self.other.push(key.to_string()),
        }
        Some(())
    }
}

/// The differences between two columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Comparison {
    /// Number of compared values.
    pub total: usize,
    /// Equal, or both NaN.
    pub exact: usize,
    /// Number within the tolerance, absolute or relative.
    pub within: usize,
    /// The largest absolute difference, and its point.
    pub worst: (f32, usize),
}

/// Compares two columns.
pub fn compare(expected: &[f32], got: &[f32], tolerance: f32) -> Comparison {
    let mut c = Comparison { total: expected.len().max(got.len()), ..Comparison::default() };
    for (at, (e, g)) in expected.iter().zip(got).enumerate() {
        let difference = (e - g).abs();
        if e == g || (e.is_nan() && g.is_nan()) {
            c.exact += 1;
            c.within += 1;
        } else if difference <= tolerance * e.abs().max(1.0) {
            c.within += 1;
        }
        if difference > c.worst.0 {
            c.worst = (difference, at);
        }
    }
    c
}

/// The distance of two values in units in the last place.
pub fn ulps(a: f32, b: f32) -> u32 {
    let order = |x: f32| {
        let bits = x.to_bits() as i32;
        i64::from(if bits < 0 { i32::MIN.wrapping_sub(bits) } else { bits })
    };
    u32::try_from((order(a) - order(b)).abs()).unwrap_or(u32::MAX)
}
