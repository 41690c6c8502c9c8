//! The name of the program in the pictures that it writes: the attribute `software` of an EXR file, and a text
//! `Software` in a PNG file.
//!
//! It is the version alone. So equal pictures are equal files, no matter which command, processor or number of
//! threads made them, and a file says nothing about the paths on the machine. This module must not know pixels.

use std::borrow::Cow;

/// The program and its version.
pub(super) const SOFTWARE: &str = concat!("oslrun ", env!("CARGO_PKG_VERSION"));

/// The first bytes of a PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// The length of these and of the first chunk, the header: its length, name, contents and checksum.
const HEAD: usize = 8 + 4 + 4 + 13 + 4;

/// The bytes of a picture with the name of the program after the header of a PNG; other files stay as they are.
pub(super) fn named(bytes: &[u8]) -> Cow<'_, [u8]> {
    match bytes.split_at_checked(HEAD) {
        Some((head, rest)) if head.starts_with(SIGNATURE) => {
            let mut named = head.to_vec();
            named.extend_from_slice(&text("Software", SOFTWARE));
            named.extend_from_slice(rest);
            Cow::Owned(named)
        }
        _ => Cow::Borrowed(bytes),
    }
}

/// A chunk with a text: the length of its contents, its name, the contents, and the checksum of both.
fn text(keyword: &str, value: &str) -> Vec<u8> {
    let mut named = b"tEXt".to_vec();
    named.extend_from_slice(keyword.as_bytes());
    named.push(0);
    named.extend_from_slice(value.as_bytes());
    let length = u32::try_from(named.len().saturating_sub(4)).unwrap_or(0);
    [&length.to_be_bytes()[..], &named, &checksum(&named).to_be_bytes()].concat()
}

/// The checksum of a chunk: CRC-32.
fn checksum(bytes: &[u8]) -> u32 {
    let bit = |rest: u32, _| if rest & 1 == 1 { (rest >> 1) ^ 0xedb8_8320 } else { rest >> 1 };
    !bytes.iter().fold(u32::MAX, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), bit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // The chunk that ends every PNG file, and the usual test value.
        assert_eq!(checksum(b"IEND"), 0xae42_6082);
        assert_eq!(checksum(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn only_a_png_is_named() {
        assert_eq!(named(b"v/1\x01"), &b"v/1\x01"[..]);
        assert_eq!(named(&[0; 100]), &[0; 100][..]);
        assert_eq!(named(SIGNATURE), SIGNATURE);
    }
}
