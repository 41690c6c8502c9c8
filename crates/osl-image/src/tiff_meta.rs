//! Reads the tags of a TIFF page, under the names that texture tools use.

use osl_limits::Images;
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

use crate::attributes::{Attribute, Attributes};
use crate::image::{Header, Source};

/// The form of a tag's value.
#[derive(Clone, Copy)]
enum Form {
    Text,
    Int,
    Float,
    Matrix,
}

const TAGS: [(u16, &str, Form); 26] = [
    (258, "oiio:BitsPerSample", Form::Int),
    (259, "tiff:Compression", Form::Int),
    (262, "tiff:PhotometricInterpretation", Form::Int),
    (269, "DocumentName", Form::Text),
    (270, "ImageDescription", Form::Text),
    (271, "Make", Form::Text),
    (272, "Model", Form::Text),
    (274, "Orientation", Form::Int),
    (278, "tiff:RowsPerStrip", Form::Int),
    (282, "XResolution", Form::Float),
    (283, "YResolution", Form::Float),
    (284, "tiff:PlanarConfiguration", Form::Int),
    (285, "tiff:PageName", Form::Text),
    (297, "tiff:PageNumber", Form::Int),
    (305, "Software", Form::Text),
    (306, "DateTime", Form::Text),
    (315, "Artist", Form::Text),
    (316, "HostComputer", Form::Text),
    (33302, "textureformat", Form::Text),
    (33303, "wrapmodes", Form::Text),
    (33304, "fovcot", Form::Float),
    (33305, "worldtoscreen", Form::Matrix),
    (33306, "worldtocamera", Form::Matrix),
    (33432, "Copyright", Form::Text),
    (33434, "ExposureTime", Form::Float),
    (33437, "FNumber", Form::Float),
];

const X_POSITION: Tag = Tag::Unknown(286);
const Y_POSITION: Tag = Tag::Unknown(287);
const RESOLUTION_UNIT: Tag = Tag::Unknown(296);
const FULL_WIDTH: Tag = Tag::Unknown(33300);
const FULL_HEIGHT: Tag = Tag::Unknown(33301);
/// The tag in which texture tools state the purpose of a file. If it is present, all pages are levels of one
/// image.
const TEXTURE_FORMAT: Tag = Tag::Unknown(33302);

type Tiff<'a> = Decoder<&'a mut dyn Source>;

/// Whether the pages of a file are the levels of one texture. The decoder must be at the first page.
pub(crate) fn is_texture(decoder: &mut Tiff<'_>) -> bool {
    tag(decoder, TEXTURE_FORMAT).is_some()
}

/// The metadata of the decoder's current page, without its coarser levels.
pub(crate) fn header(decoder: &mut Tiff<'_>, (width, height): (usize, usize), limits: &Images) -> Header {
    let mut attributes = Attributes::within(limits);
    for (number, name, form) in TAGS {
        if let Some(value) = tag(decoder, Tag::from_u16_exhaustive(number))
            && let Some(value) = told(value, form)
        {
            attributes.set(name, value);
        }
    }
    let int = |attributes: &Attributes, name: &str| match attributes.get(name) {
        Some(Attribute::Ints(list)) => list.first().copied(),
        _ => None,
    };
    attributes.set_int("tiff:Compression", int(&attributes, "tiff:Compression").unwrap_or(1));
    if let Some(name) = int(&attributes, "tiff:Compression").and_then(compression) {
        attributes.set_text("compression", name);
    }
    let planar = int(&attributes, "tiff:PlanarConfiguration").unwrap_or(1);
    attributes.set_int("tiff:PlanarConfiguration", planar);
    attributes.set_text("planarconfig", if planar == 2 { "separate" } else { "contig" });
    attributes.set_int("Orientation", int(&attributes, "Orientation").unwrap_or(1));
    let float = |attributes: &Attributes, name: &str| attributes.numbers(name)?.first().copied();
    let density = (float(&attributes, "XResolution"), float(&attributes, "YResolution"));
    if let (Some(x), Some(y)) = density {
        let unit = tag(decoder, RESOLUTION_UNIT).and_then(|value| value.into_u32().ok());
        attributes.set_text(
            "ResolutionUnit",
            match unit {
                Some(1) => "none",
                Some(3) => "cm",
                _ => "in",
            },
        );
        if x > 0.0 && y > 0.0 {
            attributes.set_float("PixelAspectRatio", y / x);
        }
    }
    attributes.take_from_description();
    let mut at = |which: Tag, density: Option<f32>| {
        let place = tag(decoder, which).and_then(number).unwrap_or(0.0);
        (place * density.unwrap_or(1.0)).round() as i32
    };
    let data_origin = (at(X_POSITION, density.0), at(Y_POSITION, density.1));
    let mut size = |which| tag(decoder, which).and_then(|value| value.into_u32().ok());
    let full = (size(FULL_WIDTH), size(FULL_HEIGHT));
    let last = |full: Option<u32>, own: usize| {
        full.map_or(own as i64, i64::from).clamp(0, i64::from(i32::MAX)) as i32 - 1
    };
    let display_window = [0, 0, last(full.0, width), last(full.1, height)];
    let apart = full != (None, None) || data_origin != (0, 0);
    let tile = decoder.get_chunk_type() == tiff::decoder::ChunkType::Tile;
    let (columns, rows) = decoder.chunk_dimensions();
    Header {
        data_origin,
        display_window: apart.then_some(display_window),
        tile: tile.then_some((columns as usize, rows as usize)),
        coarser: Vec::new(),
        attributes,
    }
}

fn tag(decoder: &mut Tiff<'_>, which: Tag) -> Option<Value> {
    decoder.find_tag(which).ok().flatten()
}

fn told(value: Value, form: Form) -> Option<Attribute> {
    Some(match form {
        Form::Text => Attribute::Text(value.into_string().ok()?),
        Form::Float => Attribute::Floats(vec![number(value)?]),
        Form::Matrix => Attribute::Matrix(value.into_f32_vec().ok()?.try_into().ok()?),
        Form::Int => {
            let first = match value {
                // One for each channel, or a page and the number of pages.
                Value::List(list) => list.into_iter().next()?,
                one => one,
            };
            Attribute::Ints(vec![i32::try_from(first.into_u32().ok()?).ok()?])
        }
    })
}

fn number(value: Value) -> Option<f32> {
    match value {
        Value::Rational(above, below) if below != 0 => Some((f64::from(above) / f64::from(below)) as f32),
        Value::Rational(..) => None,
        other => other.into_f32().ok(),
    }
}

fn compression(number: i32) -> Option<&'static str> {
    Some(match number {
        1 => "none",
        2 => "ccittrle",
        3 => "ccittfax3",
        4 => "ccittfax4",
        5 => "lzw",
        6 => "ojpeg",
        7 => "jpeg",
        8 | 32946 => "zip",
        32773 => "packbits",
        34712 => "jp2000",
        50000 => "zstd",
        _ => return None,
    })
}
