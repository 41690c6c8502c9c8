//! Compresses the blocks of an EXR file with Zip: the bytes at even positions are followed by those at odd
//! positions, each is replaced by its difference from the previous one, and the result is deflated (OpenEXR
//! file layout, "ZIP compression").
//!
//! The library that writes the files deflates four times as slowly to save a thirtieth of the bytes, and
//! writing took most of an image's time.

use half::f16;

/// How a sample is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleType {
    /// 32 bits, exactly as given (under a lossless compression).
    #[default]
    Float,
    /// 16 bits, rounded to nearest; values beyond 65504 become infinite.
    Half,
}

/// The compression level, from 0 to 10.
const LEVEL: u8 = 1;

/// The contents of a block: the samples of some lines, compressed, or uncompressed where that is not longer.
/// `rows` are those of all channels, line by line.
pub(crate) fn block(rows: &[&[f32]], samples: SampleType) -> Vec<u8> {
    let each = if samples == SampleType::Half { 2 } else { 4 };
    let bytes = each * rows.iter().map(|row| row.len()).sum::<usize>();
    let mut apart = vec![0; bytes];
    // Bytes at even and at odd positions of the file.
    let (mut even, mut odd) = apart.split_at_mut(bytes / 2);
    for row in rows {
        let (even_row, even_rest) = std::mem::take(&mut even).split_at_mut(each / 2 * row.len());
        let (odd_row, odd_rest) = std::mem::take(&mut odd).split_at_mut(each / 2 * row.len());
        (even, odd) = (even_rest, odd_rest);
        let places = even_row.chunks_exact_mut(each / 2).zip(odd_row.chunks_exact_mut(each / 2)).zip(*row);
        for ((even, odd), value) in places {
            if samples == SampleType::Half {
                let [low, high] = f16::from_f32(*value).to_le_bytes();
                (even[0], odd[0]) = (low, high);
            } else {
                let [a, b, c, d] = value.to_le_bytes();
                (even[0], odd[0], even[1], odd[1]) = (a, b, c, d);
            }
        }
    }
    // The first byte is stored unchanged.
    let mut differences = Vec::with_capacity(bytes);
    differences.extend(apart.first());
    let pairs = apart.iter().zip(apart.get(1..).unwrap_or_default());
    differences.extend(pairs.map(|(before, byte)| byte.wrapping_sub(*before).wrapping_add(128)));
    let deflated = miniz_oxide::deflate::compress_to_vec_zlib(&differences, LEVEL);
    if deflated.len() < bytes { deflated } else { together(&apart) }
}

/// Restores the order of the bytes.
fn together(apart: &[u8]) -> Vec<u8> {
    let (first, second) = apart.split_at(apart.len() / 2);
    first.iter().zip(second).flat_map(|(a, b)| [*a, *b]).collect()
}
