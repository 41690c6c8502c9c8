//! Reads Radiance HDR files: three floats per pixel that share an exponent, in run-length encoded rows.
//!
//! Source of the format: Greg Ward, "Real Pixels" (Graphics Gems II), and the Radiance reference manual. Rows
//! must run from the top and pixels from the left (`-Y` before `+X`), as in nearly every file. This module
//! must not know other formats.

use std::io::{BufRead, Read, SeekFrom};
use std::path::Path;

use crate::admission::{Admission, Claim};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::image::{EncodedFile, StoredType, channel_names};
use crate::texels::Texels;

/// A stored pixel: red, green and blue, and their shared exponent.
type Rgbe = [u8; 4];

/// Decodes a file that starts with the signature of the format.
pub(crate) fn decode(file: EncodedFile<'_>, admission: &Admission<'_>) -> Result<Decoded, ImageError> {
    let EncodedFile { path, head, source, .. } = file;
    let bad = |what: &str| ImageError::format(path, what);
    let texts_end = head.windows(2).position(|pair| pair == b"\n\n");
    let start = texts_end.ok_or_else(|| bad("HDR file whose header does not end"))? + 2;
    let rest = head.get(start..).unwrap_or(&[]);
    let length = rest.iter().position(|byte| *byte == b'\n');
    let length = length.ok_or_else(|| bad("HDR file whose line of sizes does not end"))?;
    let (width, height) = sizes(rest.get(..length).unwrap_or(&[])).map_err(|what| bad(&what))?;
    let size = (width as usize, height as usize);
    let claim = Claim {
        size,
        full: size,
        n_channels: 3,
        kept: StoredType::Float,
        makes_levels: true,
        working: u64::from(width).saturating_mul(4),
    };
    admission.admit(path, &claim)?;
    let failed = |error| ImageError::io(path, "read the file", error);
    source.seek(SeekFrom::Start((start + length + 1) as u64)).map_err(failed)?;
    Ok(Decoded::plain(size, channel_names(3), (StoredType::Float, Texels::Float(rows(path, source, size)?))))
}

/// Width and height from the line after the header's texts.
fn sizes(line: &[u8]) -> Result<(u32, u32), String> {
    let line = String::from_utf8_lossy(line);
    let words: Vec<&str> = line.split_whitespace().take(4).collect();
    let [first, height, second, width] = words.as_slice() else {
        return Err("HDR file without a line of sizes".to_string());
    };
    if (*first, *second) != ("-Y", "+X") {
        return Err("HDR file whose rows do not run from the top and the left (-Y, +X)".to_string());
    }
    match (width.parse::<u32>(), height.parse::<u32>()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err("HDR file whose width or height is not a positive number".to_string()),
    }
}

fn rows(
    path: &Path,
    source: &mut (impl BufRead + ?Sized),
    (width, height): (usize, usize),
) -> Result<Vec<f32>, ImageError> {
    let mut row = vec![Rgbe::default(); width];
    let mut samples = Vec::with_capacity(width * height * 3);
    for _ in 0..height {
        read_row(source, &mut row).map_err(|error| match error {
            RowError::Io(error) => ImageError::io(path, "read the file", error),
            RowError::Run => ImageError::format(path, "HDR file with a run that does not fit its row"),
        })?;
        samples.extend(row.iter().flat_map(|pixel| floats(*pixel)));
    }
    Ok(samples)
}

/// An error in a row.
enum RowError {
    /// The file ends, or reading fails.
    Io(std::io::Error),
    /// A run has no pixel to repeat, or is longer than the rest of the row.
    Run,
}

impl From<std::io::Error> for RowError {
    fn from(error: std::io::Error) -> Self {
        RowError::Io(error)
    }
}

/// Reads one row. A row that starts with 2, 2 and a byte below 128 stores its four components in sequence.
fn read_row(source: &mut (impl BufRead + ?Sized), row: &mut [Rgbe]) -> Result<(), RowError> {
    let mut first = Rgbe::default();
    source.read_exact(&mut first)?;
    match first {
        [2, 2, 0..128, _] => (0..4).try_for_each(|component| read_component(source, row, component)),
        _ => read_pixels(source, first, row),
    }
}

/// One component of a row: a count above 128 repeats the next byte, a smaller one is followed by as many
/// bytes.
fn read_component(
    source: &mut (impl BufRead + ?Sized),
    row: &mut [Rgbe],
    component: usize,
) -> Result<(), RowError> {
    let mut bytes = [0; 128];
    let mut done = 0;
    while done < row.len() {
        let [count] = read_bytes(source)?;
        let repeats = count > 128;
        let count = usize::from(if repeats { count - 128 } else { count });
        let (Some(run), Some(bytes)) = (row.get_mut(done..done + count), bytes.get_mut(..count)) else {
            return Err(RowError::Run);
        };
        if repeats {
            let [byte] = read_bytes(source)?;
            bytes.fill(byte);
        } else {
            source.read_exact(bytes)?;
        }
        for (pixel, byte) in run.iter_mut().zip(bytes) {
            pixel[component] = *byte;
        }
        done += count;
    }
    Ok(())
}

/// Pixels one by one. A pixel of 1, 1, 1 repeats the previous one as often as its exponent says; if several
/// such pixels follow each other, each counts 256 times as much as the one before.
fn read_pixels(source: &mut (impl BufRead + ?Sized), first: Rgbe, row: &mut [Rgbe]) -> Result<(), RowError> {
    let (mut done, mut weight) = (0, 1);
    let (mut last, mut next) = (None, Some(first));
    while done < row.len() {
        let pixel = match next.take() {
            Some(pixel) => pixel,
            None => read_bytes(source)?,
        };
        let ([1, 1, 1, count], Some(repeated)) = (pixel, last) else {
            // A file cannot start with a run.
            if pixel[..3] == [1, 1, 1] {
                return Err(RowError::Run);
            }
            if let Some(place) = row.get_mut(done) {
                *place = pixel;
            }
            (done, last, weight) = (done + 1, Some(pixel), 1);
            continue;
        };
        let count = usize::from(count).saturating_mul(weight);
        let run = row.get_mut(done..done.saturating_add(count)).ok_or(RowError::Run)?;
        run.fill(repeated);
        (done, weight) = (done + count, weight.saturating_mul(256));
    }
    Ok(())
}

fn read_bytes<const N: usize>(source: &mut (impl Read + ?Sized)) -> Result<[u8; N], std::io::Error> {
    let mut bytes = [0; N];
    source.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// The floats of a pixel: its bytes times 2^(e - 136), or 0 if the exponent `e` is 0.
fn floats([r, g, b, e]: Rgbe) -> [f32; 3] {
    // 2^(e - 128), below the smallest normal float at e = 1.
    let power = f32::from_bits(if e > 1 { u32::from(e - 1) << 23 } else { u32::from(e) << 22 });
    [r, g, b].map(|byte| power / 256.0 * f32::from(byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(bytes: &[u8], width: usize) -> Option<Vec<Rgbe>> {
        let mut row = vec![Rgbe::default(); width];
        read_row(&mut &*bytes, &mut row).ok().map(|()| row)
    }

    #[test]
    fn rows_are_stored_in_three_ways() {
        let (a, b) = ([7, 8, 9, 130], [1, 2, 3, 128]);
        assert_eq!(row(&[a, b].concat(), 2), Some(vec![a, b]), "pixels");
        assert_eq!(row(&[a, [1, 1, 1, 2], b].concat(), 4), Some(vec![a, a, a, b]), "old runs");
        let long = row(&[a, [1, 1, 1, 1], [1, 1, 1, 1], b].concat(), 259);
        assert_eq!(long.map(|row| (row[257], row[258])), Some((a, b)), "old runs add up");
        let runs = [2, 2, 0, 3, 131, 5, 3, 1, 2, 3, 1, 9, 130, 4, 131, 129];
        assert_eq!(row(&runs, 3), Some(vec![[5, 1, 9, 129], [5, 2, 4, 129], [5, 3, 4, 129]]), "runs");
    }

    #[test]
    fn runs_that_do_not_fit_are_refused() {
        assert_eq!(row(&[1, 1, 1, 1, 1, 1, 1, 1], 2), None, "nothing to repeat");
        assert_eq!(row(&[7, 8, 9, 130, 1, 1, 1, 9], 4), None, "beyond the row");
        assert_eq!(row(&[2, 2, 0, 3, 132, 5], 3), None, "a run beyond the row");
        assert_eq!(row(&[2, 2, 0, 3, 131], 3), None, "the file ends");
    }

    #[test]
    fn exponents_reach_both_ends() {
        assert_eq!(floats([128, 1, 255, 128]), [0.5, 1.0 / 256.0, 255.0 / 256.0]);
        assert_eq!(floats([255; 4])[0], 255.0 * 2_f32.powi(119));
        assert_eq!(floats([128, 128, 128, 0]), [0.0; 3]);
        assert_eq!(floats([128, 0, 0, 1])[0], f32::from_bits(1 << 21));
    }

    #[test]
    fn sizes_are_checked() {
        assert_eq!(sizes(b"-Y 3 +X 4"), Ok((4, 3)));
        for wrong in [&b"-Y 3"[..], b"+X 4 -Y 3", b"-Y 0 +X 4", b"-Y a +X 4", b"-Y 4294967296 +X 4"] {
            assert!(sizes(wrong).is_err(), "{}", String::from_utf8_lossy(wrong));
        }
    }
}
