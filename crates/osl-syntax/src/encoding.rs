//! The bytes of a source as text: UTF-8, single bytes of Latin-1 among it, or UTF-16 with a byte order mark.
//!
//! Compilers pass the bytes of comments and strings through, so published files have any encoding.

/// The text of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decoded {
    /// The text.
    pub text: String,
    /// How the file has it, unless it is UTF-8.
    pub foreign: Option<Foreign>,
}

/// An encoding other than UTF-8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// Bytes that are not UTF-8 are the characters of these codes.
    Latin1 {
        /// The offset in the text of the first one.
        first: usize,
        /// Whether the file also has characters in UTF-8, other than ASCII.
        mixed: bool,
    },
    /// UTF-16, the high or the low byte of a unit first.
    Utf16 {
        /// Whether the high byte comes first.
        big_endian: bool,
    },
}

/// Why bytes are no text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotText {
    /// The byte at this offset is zero.
    Zero(usize),
    /// UTF-16 with half a character at this offset.
    Half(usize),
}

impl std::fmt::Display for NotText {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            NotText::Zero(at) => write!(f, "it is not text (byte {at} is zero)"),
            NotText::Half(at) => write!(f, "it is not text (UTF-16, with half a character at byte {at})"),
        }
    }
}

const LOW_FIRST: [u8; 2] = [0xff, 0xfe];
const HIGH_FIRST: [u8; 2] = [0xfe, 0xff];

/// The text of a file.
///
/// # Errors
/// It has a zero byte, or is UTF-16 with half a character.
pub fn decode(bytes: Vec<u8>) -> Result<Decoded, NotText> {
    let decoded = match &bytes[..] {
        [0xff, 0xfe, units @ ..] => utf16(units, false)?,
        [0xfe, 0xff, units @ ..] => utf16(units, true)?,
        _ => match String::from_utf8(bytes) {
            Ok(text) => Decoded { text, foreign: None },
            Err(bytes) => mixed(bytes.as_bytes()),
        },
    };
    match decoded.text.find('\0') {
        Some(at) => Err(NotText::Zero(at)),
        None => Ok(decoded),
    }
}

/// UTF-8 with other bytes in it.
fn mixed(bytes: &[u8]) -> Decoded {
    let (mut text, mut first, mut mixed) = (String::with_capacity(bytes.len()), None, false);
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        mixed |= !chunk.valid().is_ascii();
        if !chunk.invalid().is_empty() {
            first.get_or_insert(text.len());
            text.extend(chunk.invalid().iter().map(|byte| char::from(*byte)));
        }
    }
    Decoded { text, foreign: first.map(|first| Foreign::Latin1 { first, mixed }) }
}

fn utf16(units: &[u8], big_endian: bool) -> Result<Decoded, NotText> {
    let (pairs, rest) = units.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(NotText::Half(units.len() + 1));
    }
    let unit =
        |pair: &[u8; 2]| if big_endian { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
    let (mut text, mut at) = (String::with_capacity(units.len()), 2);
    for found in char::decode_utf16(pairs.iter().map(unit)) {
        let found = found.map_err(|_| NotText::Half(at))?;
        text.push(found);
        at += 2 * found.len_utf16();
    }
    Ok(Decoded { text, foreign: Some(Foreign::Utf16 { big_endian }) })
}

/// A changed text in the encoding of its file. `None` if the file mixes two, if the text has characters that
/// this encoding cannot hold, or if the bytes would be read as another text.
pub fn encode(text: &str, foreign: Option<Foreign>) -> Option<Vec<u8>> {
    let bytes: Vec<u8> = match foreign {
        None => return Some(text.as_bytes().to_vec()),
        Some(Foreign::Latin1 { mixed: true, .. }) => return None,
        Some(Foreign::Latin1 { .. }) => text.chars().map(|c| u8::try_from(c).ok()).collect::<Option<_>>()?,
        Some(Foreign::Utf16 { big_endian: true }) => {
            HIGH_FIRST.into_iter().chain(text.encode_utf16().flat_map(u16::to_be_bytes)).collect()
        }
        Some(Foreign::Utf16 { big_endian: false }) => {
            LOW_FIRST.into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect()
        }
    };
    let again = decode(bytes.clone()).ok()?;
    (again.text == text).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) -> Decoded {
        decode(bytes.to_vec()).unwrap()
    }

    const fn latin1(first: usize, mixed: bool) -> Option<Foreign> {
        Some(Foreign::Latin1 { first, mixed })
    }

    #[test]
    fn bytes_that_are_not_utf8_are_the_characters_of_their_codes() {
        assert_eq!(read("café".as_bytes()), Decoded { text: "café".into(), foreign: None });
        assert_eq!(read(b"caf\xe9 \xff"), Decoded { text: "café ÿ".into(), foreign: latin1(3, false) });
        assert_eq!(encode("é ÿÿ", latin1(0, false)), Some(b"\xe9 \xff\xff".to_vec()));
        assert_eq!(encode("\u{2014}", latin1(0, false)), None);
        // These two characters would be read as one.
        assert_eq!(encode("\u{c3}\u{a9}", latin1(0, false)), None);
        // Which of two characters had which form is not known.
        let both = read(b"\xc3\xa9 \xe9");
        assert_eq!(both, Decoded { text: "é é".into(), foreign: latin1(3, true) });
        assert_eq!(encode(&both.text, both.foreign), None);
    }

    #[test]
    fn utf16_has_two_orders() {
        for big_endian in [false, true] {
            let foreign = Some(Foreign::Utf16 { big_endian });
            let bytes = encode("é \u{1f600}\n", foreign).unwrap();
            assert_eq!(read(&bytes), Decoded { text: "é \u{1f600}\n".into(), foreign });
        }
        assert_eq!(decode(b"\xff\xfea".to_vec()), Err(NotText::Half(2)));
        assert_eq!(decode(b"\xff\xfea\0\x00\xd8b\0".to_vec()), Err(NotText::Half(4)));
        assert_eq!(decode(b"a\0".to_vec()), Err(NotText::Zero(1)));
        assert_eq!(decode(b"\xff\xfe\0\0".to_vec()), Err(NotText::Zero(0)));
    }

    proptest! {
        #[test]
        fn what_is_written_back_is_read_as_the_same_text(bytes in prop::collection::vec(1u8.., 0..40)) {
            if let Ok(Decoded { text, foreign }) = decode(bytes)
                && let Some(bytes) = encode(&text, foreign)
            {
                prop_assert_eq!(decode(bytes).unwrap().text, text);
            }
        }
    }
}
