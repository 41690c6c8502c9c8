//! Blocks of an EXR file as Zip compresses them: bytes of a kind side by side, each as its difference to the one before,
//! deflated (OpenEXR file layout, "ZIP compression").
//!
//! The library that writes our files deflates four times as slowly to save a thirtieth of the bytes, and writing was
//! most of the time that an image took. It must not know files or layers.

use half::f16;

use crate::exr_out::SampleType;

/// The effort of deflating, from 0 to 10.
const LEVEL: u8 = 1;

/// The samples of some lines, compressed, or plainly where that is no shorter: what a block of the file holds. `rows` are
/// those of all channels, line by line.
pub(crate) fn block(rows: &[&[f32]], samples: SampleType) -> Vec<u8> {
    let count: usize = rows.iter().map(|row| row.len()).sum();
    let bytes = count * if samples == SampleType::Half { 2 } else { 4 };
    let mut apart = Vec::with_capacity(bytes);
    match samples {
        SampleType::Float => {
            let words = || rows.iter().flat_map(|row| row.iter()).map(|v| v.to_bits());
            apart.extend(words().flat_map(|w| [w as u8, (w >> 16) as u8]));
            apart.extend(words().flat_map(|w| [(w >> 8) as u8, (w >> 24) as u8]));
        }
        SampleType::Half => {
            let words: Vec<u16> =
                rows.iter().flat_map(|row| row.iter()).map(|v| f16::from_f32(*v).to_bits()).collect();
            apart.extend(words.iter().map(|w| *w as u8));
            apart.extend(words.iter().map(|w| (*w >> 8) as u8));
        }
    }
    // The first byte stays as it is.
    let before = std::iter::once(&128).chain(&apart);
    let differences: Vec<u8> =
        apart.iter().zip(before).map(|(byte, before)| byte.wrapping_sub(*before).wrapping_add(128)).collect();
    let deflated = miniz_oxide::deflate::compress_to_vec_zlib(&differences, LEVEL);
    if deflated.len() < bytes { deflated } else { together(&apart) }
}

/// The bytes in their order, from those at even places and those at odd ones.
fn together(apart: &[u8]) -> Vec<u8> {
    let (first, second) = apart.split_at(apart.len() / 2);
    first.iter().zip(second).flat_map(|(a, b)| [*a, *b]).collect()
}
