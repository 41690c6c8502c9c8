//! Image files, read by a shader.

use super::data::Place;
use super::{contents, message};
use crate::{laws, textures as chance};
use image::{ExtendedColorType, ImageFormat};
use osl::stages;
use osl_exec::{Program, RunOptions, Services};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_limits::Limits;
use osl_scene::Grid;
use std::collections::BTreeSet;
use std::io::Cursor;
use std::sync::LazyLock;

/// Words of the headers of files of all formats, and names of their parts.
pub(super) const WORDS: &[&str] = &[
    "channels",
    "chlist",
    "compression",
    "dataWindow",
    "displayWindow",
    "box2i",
    "lineOrder",
    "pixelAspectRatio",
    "tiles",
    "tiledesc",
    "type",
    "scanlineimage",
    "tiledimage",
    "deepscanline",
    "deeptile",
    "chunkCount",
    "name",
    "string",
    "wrapmodes",
    "worldToCamera",
    "m44f",
    "IHDR",
    "IDAT",
    "IEND",
    "PLTE",
    "tRNS",
    "iCCP",
    "gAMA",
    "sRGB",
    "II*\0",
    "MM\0*",
    "#?RADIANCE\n",
    "FORMAT=32-bit_rle_rgbe\n",
    "-Y 2 +X 2\n",
    "EXPOSURE=1\n",
    "\u{7f}\u{7f}",
    "GIF89a",
    "!\u{0}",
    "BM",
    "DDS ",
    "DXT1",
    "DXT5",
    "DX10",
    "P1\n2 2\n",
    "P6 2 2 255\n",
    "P7\nWIDTH 2\nHEIGHT 2\nDEPTH 2\nMAXVAL 255\nENDHDR\n",
    "TUPLTYPE RGB_ALPHA\n",
    "RIFF",
    "WEBP",
    "VP8 ",
    "VP8L",
    "VP8X",
    "ALPH",
    "ANIM",
    "ANMF",
];

/// Files of every format, and choices.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds: Vec<Vec<u8>> = FORMATS.iter().flat_map(|format| of(format)).collect();
    seeds.extend((0..24_u32).map(|n| {
        let choice = |at: u32| (at + 300 * n).wrapping_mul(2_654_435_761).to_be_bytes()[0];
        std::iter::once(CHOICES).chain((0..300).map(choice)).collect()
    }));
    seeds
}

/// The formats. Each also has a door of its own.
const FORMATS: [&str; 11] = ["exr", "png", "jpeg", "tiff", "hdr", "tga", "bmp", "gif", "webp", "pnm", "dds"];

/// Small files of a format.
pub(super) fn of(format: &str) -> Vec<Vec<u8>> {
    use ExtendedColorType::{L8, L16, La8, Rgb8, Rgb32F, Rgba8};
    let suite = |endings: &[&str]| contents("tests/data/suite/gettextureinfo", endings);
    let (format, colors, mut seeds): (_, &[ExtendedColorType], _) = match format {
        "png" => (ImageFormat::Png, &[L8, Rgb8, Rgba8, L16], Vec::new()),
        "jpeg" => (ImageFormat::Jpeg, &[L8, Rgb8], Vec::new()),
        "tiff" => (ImageFormat::Tiff, &[Rgb32F], suite(&["tif", "tx", "env"])),
        // Rows shorter than 8 pixels are stored without compression, longer ones as runs.
        "hdr" => (ImageFormat::Hdr, &[Rgb32F], vec![short_hdr()]),
        "tga" => (ImageFormat::Tga, &[L8, Rgb8, Rgba8], Vec::new()),
        "bmp" => (ImageFormat::Bmp, &[L8, Rgb8, Rgba8], Vec::new()),
        "gif" => (ImageFormat::Gif, &[Rgba8], Vec::new()),
        "webp" => {
            (ImageFormat::WebP, &[Rgb8, Rgba8], contents("crates/osl-image/tests/data/webp", &["webp"]))
        }
        "pnm" => (ImageFormat::Pnm, &[L8, La8, Rgb8, L16], vec![b"P3 2 1 7 1 2 3 4 5 6\n".to_vec()]),
        "dds" => return [b"DXT1", b"DXT3", b"DXT5", b"DX10"].map(dds).to_vec(),
        _ => return suite(&["exr"]),
    };
    for color in colors {
        let n_bytes = 9 * 6 * usize::from(color.bits_per_pixel()) / 8;
        let pixels: Vec<u8> = (0..n_bytes).map(|n| (n * 37 % 251) as u8).collect();
        let mut file = Cursor::new(Vec::new());
        if image::write_buffer_with_format(&mut file, &pixels, 9, 6, *color, format).is_ok() {
            seeds.push(file.into_inner());
        }
    }
    seeds
}

fn short_hdr() -> Vec<u8> {
    [b"#?RGBE\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n".as_slice(), &[128; 24]].concat()
}

/// A DDS of 8 x 4 pixels in two blocks.
fn dds(code: &[u8; 4]) -> Vec<u8> {
    let word = |n: u32| n.to_le_bytes();
    let mut file = [b"DDS ".to_owned(), word(124), word(0x1007), word(4), word(8)].concat();
    file.resize(76, 0);
    file.extend([word(32), word(4), *code].as_flattened());
    file.resize(128, 0);
    if code == b"DX10" {
        file.extend([word(77), word(3), word(0), word(1), word(0)].as_flattened());
    }
    file.extend((0..32).map(|n: u8| n.wrapping_mul(37)));
    file
}

/// The first byte of an input that drives the generator of image files, instead of being a file: headers that
/// are almost right, absurd sizes, bombs, files that end too early. Among the formats only a TGA with an
/// unusually long text begins with this byte.
const CHOICES: u8 = 0xfe;

const SHADER: &str = r#"shader looks(string f = "t.img", output color o = 0, output float a = 0) {
    o = (color)texture(f, u * 1.5, v, "alpha", a, "missingcolor", color(0.5), "wrap", "periodic");
    o += (color)texture(f, u, v * 2 - 1, "interp", "cubic", "firstchannel", 1, "subimage", 1, "missingcolor", color(0.25));
    if (u > 0.5) o += (color)environment(f, vector(u - 0.5, v - 0.5, 0.3), "missingcolor", color(0.25));
    int size[2]; int channels; string kind; float average[4]; matrix m;
    a += gettextureinfo(f, "resolution", size) + gettextureinfo(f, "channels", channels) + gettextureinfo(f, "averagecolor", average);
    a += gettextureinfo(f, "datawindow", size) + gettextureinfo(f, "worldtocamera", m) + gettextureinfo(f, "textureformat", kind);
    a += size[0] + channels + average[0] + m[0][0] + strlen(kind);
}
"#;

static PROGRAM: LazyLock<Program> = LazyLock::new(|| {
    let body = laws::lower(SHADER).unwrap_or_else(|why| super::broken(SHADER, &why));
    stages::finish(body, &passes::Options::default()).program
});

/// The bytes of an image file, or choices from which one is generated. A shader looks the image up in every
/// way and queries its metadata. The result is a value or a message.
pub fn textures(bytes: &[u8]) -> u64 {
    let made = bytes.strip_prefix(&[CHOICES]).map(|choices| chance::texture(choices).1);
    let bytes = made.as_deref().unwrap_or(bytes);
    let place = Place::get();
    place.file("t.img", bytes);
    let mut limits = Limits::default();
    (limits.images.texture_memory, limits.images.working_memory) = (1 << 24, 1 << 24);
    let textures = TextureCache::within(vec![place.path().to_path_buf()], &limits);
    let services = Services { textures, ..Services::default() };
    let options = RunOptions { batch: Some(16), ..RunOptions::default() };
    match osl_exec::run(&PROGRAM, &services, &Grid::new(5, 3), &options, &|_| ()) {
        Ok(frame) => {
            let kind = |text: &str| message(text.split('"').next_back().unwrap_or(""));
            let kinds: BTreeSet<u64> = frame.messages.iter().map(|said| kind(&said.message.text)).collect();
            let kinds = kinds.into_iter().fold(0, |sum: u64, kind| sum.rotate_left(7) ^ kind);
            kinds.wrapping_add(bytes.first().copied().map_or(0, u64::from))
        }
        Err(stop) => message(&stop.to_string()),
    }
}
