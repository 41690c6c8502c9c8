//! Image files, read by a shader.

use super::data::Place;
use super::{contents, message, outcome};
use crate::{laws, textures as chance};
use osl::stages;
use osl_exec::{Program, RunOptions, Services};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_limits::Limits;
use osl_scene::Grid;
use std::sync::LazyLock;

/// Words of the headers of EXR, TIFF and HDR files, and names of parts of PNG files.
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
];

/// Small files of every format.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = contents("tests/data/suite/gettextureinfo", &["exr", "tif", "tx", "env"]);
    let pixels: Vec<u8> = (0..8 * 6 * 4).map(|n| (n * 37 % 251) as u8).collect();
    let first = |n_bytes: usize| pixels.get(..8 * 6 * n_bytes).unwrap_or(&[]);
    for (color, depth, n_bytes) in [
        (png::ColorType::Grayscale, png::BitDepth::Eight, 1),
        (png::ColorType::Rgb, png::BitDepth::Eight, 3),
        (png::ColorType::Rgba, png::BitDepth::Eight, 4),
        (png::ColorType::Grayscale, png::BitDepth::Sixteen, 2),
    ] {
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, 8, 6);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(first(n_bytes))?;
            writer.finish()
        });
        if written.is_ok() {
            seeds.push(png);
        }
    }
    for (color, n_bytes) in [(jpeg_encoder::ColorType::Luma, 1), (jpeg_encoder::ColorType::Rgb, 3)] {
        let mut jpeg = Vec::new();
        if jpeg_encoder::Encoder::new(&mut jpeg, 75).encode(first(n_bytes), 8, 6, color).is_ok() {
            seeds.push(jpeg);
        }
    }
    // Rows shorter than 8 pixels are stored without compression, longer ones as runs.
    seeds.push([b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n".as_slice(), &[128; 24]].concat());
    let row: &[u8] = &[2, 2, 0, 9, 137, 40, 137, 41, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9, 137, 129];
    seeds
        .push([b"#?RGBE\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 9\n".as_slice(), row, row].concat());
    seeds.extend((0..24_u32).map(|n| {
        let choice = |at: u32| (at + 300 * n).wrapping_mul(2_654_435_761).to_be_bytes()[0];
        std::iter::once(CHOICES).chain((0..300).map(choice)).collect()
    }));
    seeds
}

/// The first byte of an input that drives the generator of image files, instead of being a file: headers that
/// are almost right, absurd sizes, bombs, files that end too early. No image format begins with this byte.
const CHOICES: u8 = 0;

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
            outcome(frame.messages.iter().map(|said| said.message.text.split('"').next_back().unwrap_or("")))
                .wrapping_add(bytes.first().copied().map_or(0, u64::from))
        }
        Err(stop) => message(&stop.to_string()),
    }
}
