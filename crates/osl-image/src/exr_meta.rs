//! Reads the attributes of an EXR part, under the names that texture tools use.
//!
//! The attributes are read from the bytes of the header, which is a list of name, type, size and value.

use osl_limits::Images;

use crate::attributes::{Attribute, Attributes};

/// The longest name of an attribute or of its type, as the format has it.
const MAX_NAME: usize = 255;

/// The compressions by their numbers.
const COMPRESSIONS: [&str; 10] =
    ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"];
const LINE_ORDERS: [&str; 3] = ["increasingY", "decreasingY", "randomY"];
const LAYOUTS: [&str; 2] = ["LatLong Environment", "CubeFace Environment"];

/// Names for which texture tools use other words.
const NAMES: [(&str, &str); 13] = [
    ("worldToCamera", "worldtocamera"),
    ("worldToNDC", "worldtoscreen"),
    ("capDate", "DateTime"),
    ("comments", "ImageDescription"),
    ("owner", "Copyright"),
    ("pixelAspectRatio", "PixelAspectRatio"),
    ("xDensity", "XResolution"),
    ("expTime", "ExposureTime"),
    ("aperture", "FNumber"),
    ("isoSpeed", "Exif:ISOSpeedRatings"),
    ("lineOrder", "openexr:lineOrder"),
    ("chunkCount", "openexr:chunkCount"),
    ("name", "oiio:subimagename"),
];

/// The attributes of one part of a file, up to the first damage.
pub(crate) fn attributes(bytes: &[u8], part: usize, limits: &Images) -> Attributes {
    let mut attributes = Attributes::within(limits);
    let multipart = bytes.get(5).is_some_and(|flags| flags & 0x10 != 0);
    let mut rest = bytes.get(8..).unwrap_or_default();
    for index in 0..=part {
        while let Some((name, kind, value, after)) = next(rest) {
            rest = after;
            if index == part {
                set(&mut attributes, name, kind, value);
            }
        }
        // An empty name ends a part.
        match rest.split_first() {
            Some((0, after)) if multipart => rest = after,
            _ => break,
        }
    }
    attributes.set_text("oiio:ColorSpace", "Linear");
    if let (Some([x]), Some([aspect])) =
        (attributes.numbers("XResolution").as_deref(), attributes.numbers("PixelAspectRatio").as_deref())
    {
        attributes.set_float("YResolution", x * aspect);
        attributes.set_text("ResolutionUnit", "in");
    }
    attributes
}

/// The next attribute: name, type, value, and what follows.
fn next(bytes: &[u8]) -> Option<(&str, &str, &[u8], &[u8])> {
    let (name, rest) = word(bytes)?;
    let (kind, rest) = word(rest)?;
    let (size, rest) = rest.split_first_chunk::<4>()?;
    let (value, rest) = rest.split_at_checked(usize::try_from(u32::from_le_bytes(*size)).ok()?)?;
    Some((name, kind, value, rest))
}

/// A nonempty word that ends with a zero byte.
fn word(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().take(MAX_NAME + 1).position(|byte| *byte == 0).filter(|end| *end > 0)?;
    let (word, rest) = bytes.split_at_checked(end)?;
    Some((std::str::from_utf8(word).ok()?, rest.get(1..)?))
}

fn set(attributes: &mut Attributes, name: &str, kind: &str, value: &[u8]) {
    // These are available in other ways.
    if matches!(name, "channels" | "dataWindow" | "displayWindow" | "tiles" | "version" | "type" | "preview")
    {
        return;
    }
    let pick = |list: &[&str]| value.first().and_then(|n| list.get(usize::from(*n))).map(|s| (*s).to_owned());
    let told = match kind {
        "compression" => pick(&COMPRESSIONS).map(Attribute::Text),
        "lineOrder" => pick(&LINE_ORDERS).map(Attribute::Text),
        "envmap" => {
            if let Some(layout) = pick(&LAYOUTS) {
                attributes.set_text("textureformat", layout);
            }
            return;
        }
        "string" => std::str::from_utf8(value).ok().map(|text| Attribute::Text(text.to_owned())),
        "int" | "v2i" | "v3i" | "box2i" => {
            Some(Attribute::Ints(words(value).map(i32::from_le_bytes).collect()))
        }
        "float" | "v2f" | "box2f" | "chromaticities" => Some(Attribute::Floats(floats(value))),
        "v3f" => <[f32; 3]>::try_from(floats(value)).ok().map(Attribute::Triple),
        "m44f" => <[f32; 16]>::try_from(floats(value)).ok().map(Attribute::Matrix),
        "double" => {
            value.try_into().ok().map(|bytes| Attribute::Floats(vec![f64::from_le_bytes(bytes) as f32]))
        }
        _ => None,
    };
    let Some(told) = told else { return };
    let name = NAMES.iter().find(|(own, _)| *own == name).map_or(name, |(_, common)| common);
    attributes.set(name, told);
}

fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 4]> {
    bytes.chunks_exact(4).map(|chunk| [chunk[0], chunk[1], chunk[2], chunk[3]])
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    words(bytes).map(f32::from_le_bytes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, kind: &str, value: &[u8]) -> Vec<u8> {
        let size = (value.len() as u32).to_le_bytes();
        [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &size, value].concat()
    }

    #[test]
    fn attributes_of_each_part() {
        let mut bytes = b"\x76\x2f\x31\x01\x02\x10\0\0".to_vec();
        bytes.extend(entry("capDate", "string", b"now"));
        bytes.extend(entry("frames", "v2i", &[1, 0, 0, 0, 255, 255, 255, 255]));
        bytes.push(0);
        bytes.extend(entry("compression", "compression", &[3]));
        bytes.extend(entry("envmap", "envmap", &[0]));
        bytes.extend(entry("broken", "string", b"x"));
        bytes.pop();
        let first = attributes(&bytes, 0, &Images::default());
        assert_eq!(first.text("DateTime"), Some("now"));
        assert_eq!(first.get("frames"), Some(&Attribute::Ints(vec![1, -1])));
        let second = attributes(&bytes, 1, &Images::default());
        assert_eq!(second.text("compression"), Some("zip"));
        assert_eq!(second.text("textureformat"), Some("LatLong Environment"));
        assert_eq!((second.get("broken"), second.get("DateTime")), (None, None));
        assert_eq!(attributes(&bytes, 7, &Images::default()).get("compression"), None);
    }
}
