//! The formats of the crate image: what its encoders write is what a lookup finds, and hand-made files of the
//! kinds that they do not write.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::path::Path;

use image::ExtendedColorType::{self, L8, L16, La8, La16, Rgb8, Rgb16, Rgb32F, Rgba8, Rgba16};
use image::ImageFormat;
use osl_image::{
    Footprint, ImageData, ImageError, Interp, LookupOptions, StoredType, SubImage, TextureCache, decode_part,
    lookup_values,
};
use osl_limits::Limits;

const SIZE: (u32, u32) = (5, 4);

fn decode(bytes: &[u8]) -> Result<ImageData, ImageError> {
    decode_part(Path::new("in memory"), bytes, &Limits::default(), SubImage::default())
}

/// Bytes that are all different, at the usual alignment of samples.
fn samples(color: ExtendedColorType) -> Vec<u8> {
    let n_bytes = usize::from(color.bits_per_pixel()) / 8 * (SIZE.0 * SIZE.1) as usize;
    if color == Rgb32F {
        return (0..n_bytes / 4).flat_map(|i| (0.5 + i as f32 / 128.0).to_ne_bytes()).collect();
    }
    (0..n_bytes).map(|i| (i * 37 % 256) as u8).collect()
}

fn encoded(format: ImageFormat, color: ExtendedColorType) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut file, &samples(color), SIZE.0, SIZE.1, color, format).unwrap();
    file.into_inner()
}

/// The values of these samples, which the formats without grey repeat in three channels.
fn values(format: ImageFormat, color: ExtendedColorType) -> Vec<f32> {
    let bytes = samples(color);
    let byte = |byte: &u8| f32::from(*byte) * (1.0 / 255.0);
    match (format, color) {
        (ImageFormat::Bmp | ImageFormat::WebP, L8) => bytes.iter().flat_map(|grey| [byte(grey); 3]).collect(),
        (_, L16 | La16 | Rgb16 | Rgba16) => {
            let short = |pair: &[u8]| f32::from(u16::from_ne_bytes(pair.try_into().unwrap()));
            bytes.chunks(2).map(|pair| short(pair) * (1.0 / 65535.0)).collect()
        }
        (_, Rgb32F) => bytes.chunks(4).map(|four| f32::from_ne_bytes(four.try_into().unwrap())).collect(),
        _ => bytes.iter().map(byte).collect(),
    }
}

/// What each encoder writes, and by how much a value may be off.
const WRITTEN: &[(ImageFormat, &[ExtendedColorType], f32)] = &[
    (ImageFormat::Png, &[L8, La8, Rgb8, Rgba8, L16, La16, Rgb16, Rgba16], 0.0),
    (ImageFormat::Tiff, &[L8, Rgb8, Rgba8, L16, Rgb16, Rgba16, Rgb32F], 0.0),
    (ImageFormat::Tga, &[L8, Rgb8, Rgba8], 0.0),
    (ImageFormat::Bmp, &[L8, Rgb8, Rgba8], 0.0),
    (ImageFormat::WebP, &[L8, Rgb8, Rgba8], 0.0),
    (ImageFormat::Pnm, &[L8, La8, Rgb8, Rgba8, L16, Rgb16], 0.0),
    // A common exponent of three floats leaves eight bits to the largest.
    (ImageFormat::Hdr, &[Rgb32F], 1.0 / 128.0),
];

#[test]
fn what_is_encoded_is_looked_up() {
    let dir = tempfile::tempdir().unwrap();
    let cache = TextureCache::new(vec![dir.path().to_owned()]);
    let closest = LookupOptions { interp: Interp::Closest, ..LookupOptions::default() };
    for (format, colors, off) in WRITTEN {
        for color in *colors {
            let expected = values(*format, *color);
            let near = |got: &[f32]| got.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= *off);
            // The name does not matter.
            let name = format!("{format:?}{color:?}.png");
            std::fs::write(dir.path().join(&name), encoded(*format, *color)).unwrap();
            let texture = cache.get(&name).unwrap();
            let n_channels = texture.channels().len();
            let mut found = Vec::new();
            for y in 0..SIZE.1 {
                for x in 0..SIZE.0 {
                    let (s, t) = ((x as f32 + 0.5) / SIZE.0 as f32, (y as f32 + 0.5) / SIZE.1 as f32);
                    let at = lookup_values(&texture, s, t, &Footprint::default(), n_channels, &closest);
                    found.extend_from_slice(&at[..n_channels]);
                }
            }
            assert_eq!(found.len(), expected.len(), "{name}");
            assert!(near(&found), "{name}: {found:?} for {expected:?}");
        }
    }
}

#[test]
fn jpeg_is_grey_or_color() {
    for (color, n_channels) in [(L8, 1), (Rgb8, 3)] {
        let flat = vec![100; (SIZE.0 * SIZE.1) as usize * n_channels];
        let mut file = Cursor::new(Vec::new());
        image::write_buffer_with_format(&mut file, &flat, SIZE.0, SIZE.1, color, ImageFormat::Jpeg).unwrap();
        let image = decode(file.get_ref()).unwrap();
        assert_eq!((image.channels.len(), image.stored), (n_channels, StoredType::U8));
        assert!(
            image.samples.iter().all(|value| (value * 255.0 - 100.0).abs() <= 1.0),
            "{:?}",
            image.samples
        );
    }
}

fn bytes(image: &ImageData) -> Vec<u8> {
    image.samples.iter().map(|value| (value * 255.0).round() as u8).collect()
}

fn read(file: &[&[u8]]) -> Vec<u8> {
    bytes(&decode(&file.concat()).unwrap())
}

/// The first picture of an animation. What is not drawn has neither color nor alpha.
#[test]
fn a_gif_is_its_first_frame() {
    let frame = |color: [u8; 4], size: (u32, u32), at: (u32, u32)| {
        let buffer = image::RgbaImage::from_fn(size.0, size.1, |x, y| {
            image::Rgba(if x == 1 && y == 0 { [9, 9, 9, 0] } else { color })
        });
        image::Frame::from_parts(buffer, at.0, at.1, image::Delay::from_numer_denom_ms(10, 1))
    };
    let mut file = Vec::new();
    let mut encoder = image::codecs::gif::GifEncoder::new(&mut file);
    encoder.encode_frame(frame([10, 20, 30, 255], (3, 2), (0, 0))).unwrap();
    encoder.encode_frame(frame([200, 20, 30, 255], (3, 2), (0, 0))).unwrap();
    drop(encoder);
    let image = decode(&file).unwrap();
    assert_eq!((image.width, image.height, image.n_parts), (3, 2, 1));
    let (ink, none) = ([10, 20, 30, 255], [0; 4]);
    assert_eq!(bytes(&image), [ink, none, ink, ink, ink, ink].concat());
    // A larger screen around the frame: its size is in the bytes 6 to 9, the frame's after the color table.
    file[6] = 5;
    let image = decode(&file).unwrap();
    assert_eq!(bytes(&image)[..20], *[ink, none, ink, none, none].as_flattened());
}

#[test]
fn webp_is_decoded_as_by_its_library() {
    for (webp, expected) in [
        (include_bytes!("data/webp/lossy.webp").as_slice(), include_bytes!("data/webp/lossy.pam").as_slice()),
        (include_bytes!("data/webp/alpha.webp"), include_bytes!("data/webp/alpha.pam")),
        (include_bytes!("data/webp/animated.webp"), include_bytes!("data/webp/animated.pam")),
    ] {
        assert_eq!(decode(webp).unwrap(), decode(expected).unwrap());
        for n in 0..webp.len() {
            let _ = decode(&webp[..n]);
        }
    }
}

/// Kinds of TGA that the encoder does not write. The colors are stored as blue, green, red.
#[test]
fn kinds_of_tga() {
    let head = |kind: u8, map: u8, bits: u8, flags: u8| {
        [0, map, kind, 0, 0, map * 2, 0, map * 24, 0, 0, 0, 0, 2, 0, 2, 0, bits, flags]
    };
    let map = [1, 2, 3, 4, 5, 6];
    assert_eq!(read(&[&head(1, 1, 8, 0x20), &map, &[0, 1, 1, 0]]), [3, 2, 1, 6, 5, 4, 6, 5, 4, 3, 2, 1]);
    assert_eq!(read(&[&head(9, 1, 8, 0x20), &map, &[0x83, 1]]), [6, 5, 4].repeat(4), "runs of indices");
    assert_eq!(read(&[&head(3, 0, 8, 0), &[1, 2, 3, 4]]), [3, 4, 1, 2], "rows from the bottom");
    assert_eq!(read(&[&head(3, 0, 8, 0x10), &[1, 2, 3, 4]]), [4, 3, 2, 1], "and from the right");
    let short = [0x1f, 0, 0xe0, 3, 0, 0x7c, 0xff, 0x7f];
    assert_eq!(read(&[&head(2, 0, 16, 0x20), &short]), [0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255]);
    assert_eq!(read(&[&head(10, 0, 24, 0x20), &[0x80, 1, 2, 3, 2, 4, 5, 6, 7, 8, 9, 1, 1, 1]]).len(), 12);
}

/// A BMP of 3 x 2 pixels with two colors, rows from the bottom.
fn bmp(compression: u8, bits: u8, data: &[u8]) -> Vec<u8> {
    let mut file =
        [b"BM".as_slice(), &[0; 8], &[62, 0, 0, 0, 40, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 1, 0]].concat();
    file.extend([bits, 0, compression, 0, 0, 0]);
    file.extend([0; 12]);
    file.extend([2, 0, 0, 0, 2, 0, 0, 0, 10, 20, 30, 0, 40, 50, 60, 0]);
    [&file, data].concat()
}

#[test]
fn indices_of_bmp() {
    let (a, b) = ([30, 20, 10], [60, 50, 40]);
    let expected = [a, b, b, b, a, a].concat();
    assert_eq!(read(&[&bmp(0, 1, &[0x80, 0, 0, 0, 0x60, 0, 0, 0])]), expected, "bits");
    assert_eq!(read(&[&bmp(0, 4, &[0x10, 0, 0, 0, 0x01, 0x10, 0, 0])]), expected, "halves of bytes");
    assert_eq!(read(&[&bmp(0, 8, &[1, 0, 0, 0, 0, 1, 1, 0])]), expected, "bytes");
    assert_eq!(read(&[&bmp(1, 8, &[1, 1, 2, 0, 0, 0, 1, 0, 2, 1, 0, 1])]), expected, "runs");
}

#[test]
fn kinds_of_pnm() {
    assert_eq!(read(&[b"P1\n# a comment\n3 2\n0 1 0\n1 1 0\n"]), [255, 0, 255, 0, 0, 255]);
    assert_eq!(read(&[b"P4 3 2\n", &[0x40, 0xc0]]), [255, 0, 255, 0, 0, 255]);
    assert_eq!(read(&[b"P2 2 1 15\n0 5\n"]), [0, 85]);
    assert_eq!(read(&[b"P3 1 1 255\n1 2 3\n"]), [1, 2, 3]);
    let image = decode(b"P5 2 1 65535\n\x12\x34\xff\xff").unwrap();
    assert_eq!((image.stored, image.channels), (StoredType::U16, vec!["Y".to_owned()]));
    assert_eq!(image.samples, [f32::from(0x1234_u16) * (1.0 / 65535.0), 1.0]);
}

/// A DDS of blocks of 4 x 4 pixels.
fn dds(code: &[u8; 4], (width, height): (u32, u32), data: &[u8]) -> Vec<u8> {
    let word = |n: u32| n.to_le_bytes();
    let mut file = [b"DDS ".to_owned(), word(124), word(0x1007), word(height), word(width)].concat();
    file.resize(76, 0);
    file.extend([word(32), word(4), *code].as_flattened());
    file.resize(128, 0);
    [&file, data].concat()
}

/// A block from red to blue whose pixels take the four colors of the block in turn.
const COLORS: [u8; 8] = [0x00, 0xf8, 0x1f, 0x00, 0xe4, 0xe4, 0xe4, 0xe4];

#[test]
fn blocks_of_dds() {
    let row = [[255, 0, 0], [0, 0, 255], [170, 0, 85], [85, 0, 170]];
    let image = decode(&dds(b"DXT1", (4, 4), &COLORS)).unwrap();
    assert_eq!((image.width, image.height, image.channels.len()), (4, 4, 3));
    assert_eq!(bytes(&image), row.as_flattened().repeat(4));
    let (dx10, kind) = (b"DX10", [71, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(read(&[&dds(dx10, (4, 4), &kind), &COLORS]), row.as_flattened().repeat(4));

    let with_alpha = |alpha: [u8; 4]| {
        let pixel = |at: usize| [row[at][0], row[at][1], row[at][2], alpha[at]];
        (0..16).flat_map(|at| pixel(at % 4)).collect::<Vec<u8>>()
    };
    let alpha = [0xf0, 0x36, 0xf0, 0x36, 0xf0, 0x36, 0xf0, 0x36];
    assert_eq!(read(&[&dds(b"DXT3", (4, 4), &alpha), &COLORS]), with_alpha([0, 255, 102, 51]));
    // Indices 0, 1, 2, 7 of three bits each into 255, 0, six means.
    let indices = 0xe88_e88_e88_e88_u64.to_le_bytes();
    let alpha = [&[255, 0], &indices[..6]].concat();
    assert_eq!(read(&[&dds(b"DXT5", (4, 4), &alpha), &COLORS]), with_alpha([255, 0, 218, 36]));
    // Further levels follow the first one in a file, and are made from it.
    assert_eq!(read(&[&dds(b"DXT1", (4, 4), &COLORS), &[0; 24]]), row.as_flattened().repeat(4));
}

#[test]
fn what_is_not_read_is_named() {
    let text = |file: &[u8]| decode(file).unwrap_err().to_string();
    for (file, expected) in [
        (dds(b"DXT1", (6, 4), &COLORS), "DDS: width and height must be multiples of 4"),
        (dds(b"ATI2", (4, 4), &COLORS), "DDS: only DXT1, DXT3 and DXT5 (BC1 to BC3) are read"),
        (dds(b"DXT1", (4, 8), &COLORS), "DDS: the file ends too early"),
        (encoded(ImageFormat::Png, Rgb8)[..60].to_vec(), "PNG: the file ends too early"),
        (encoded(ImageFormat::Tga, Rgb8)[..40].to_vec(), "TGA: the file ends too early"),
        (encoded(ImageFormat::Bmp, Rgb8)[..80].to_vec(), "BMP: the file ends too early"),
        (bmp(4, 8, &[]), "BMP: The decoder for Bmp does not support the format features JPEG compression"),
        (b"P7\nWIDTH 3\n".to_vec(), "PNM file whose header does not end"),
        (b"P6 1 1 0\n".to_vec(), "PNM: Image MAXVAL is zero"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n".to_vec(), "HDR file whose header does not end"),
        (b"#?RADIANCE\n\n-Y 3 +X 4".to_vec(), "HDR file whose line of sizes does not end"),
        (b"#?RADIANCE\n\n-Y 3 +X 4\n".to_vec(), "HDR: the file ends too early"),
        (
            b"#?RADIANCE\n\n+Y 3 +X 4\n".to_vec(),
            "HDR: The decoder for Hdr does not support the format features Orientation +Y +X",
        ),
        (
            b"#?RGBE\n\n-Y 1 +X 2\n\x07\x08\x09\x82\x01\x01\x01\x09".to_vec(),
            "HDR: Wrong length of decoded scanline: got 10, expected 2",
        ),
        (b"RIFF\x0c\0\0\0WEBPJUNK".to_vec(), "WebP: the file ends too early"),
        (
            [b"#?RADIANCE\n".as_slice(), &b"A=B\n".repeat(1025), b"\n-Y 3 +X 4\n"].concat(),
            "HDR file with more than 1024 lines (--limit images.attributes=COUNT)",
        ),
    ] {
        assert_eq!(text(&file), format!("in memory: {expected}"));
    }
    let shown = text(&[b"P7\n".as_slice(), &b"x".repeat(9999), b"\nENDHDR\n"].concat());
    assert!(shown.len() < 250, "{shown}");
}

/// Small files that promise huge pictures: an error that names the limit, before memory is taken.
#[test]
fn promises_are_refused() {
    let mut limits = Limits::default();
    limits.images.texture_memory = 16 << 20;
    limits.images.working_memory = 16 << 20;
    let text = |file: &[u8]| {
        decode_part(Path::new("a"), file, &limits, SubImage::default()).unwrap_err().to_string()
    };
    let mut png = encoded(ImageFormat::Png, Rgb8);
    png[18] = 0x40;
    png.truncate(100);
    let mut gif = encoded(ImageFormat::Gif, Rgba8);
    gif[6..10].fill(0xff);
    let tga = [0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 24, 0x20, 0xff, 1, 2, 3];
    let mut bmp = bmp(0, 8, &[]);
    (bmp[19], bmp[23]) = (0x7f, 0x7f);
    let mut lossless = encoded(ImageFormat::WebP, Rgb8);
    lossless[21..25].copy_from_slice(&(16_382_u32 | 16_382 << 14).to_le_bytes());
    // So many bytes may describe tables of more memory than a texture has.
    let long = [encoded(ImageFormat::WebP, Rgb8), vec![0; 4 << 20]].concat();
    // The lossy frame is far larger than the picture around it.
    let mut frame = include_bytes!("data/webp/alpha.webp").to_vec();
    let at = frame.windows(3).position(|part| part == [0x9d, 0x01, 0x2a]).unwrap() + 3;
    frame[at..at + 4].copy_from_slice(&[0xff, 0x3f, 0xff, 0x3f]);
    for file in [
        &gif[..],
        &tga,
        &bmp,
        &lossless,
        &long,
        &frame,
        b"P6 60000 60000 255\n",
        b"P1 60000 60000\n",
        &dds(b"DXT5", (65536, 65536), &COLORS),
        b"#?RADIANCE\n\n-Y 30000 +X 30000\n",
    ] {
        let text = text(file);
        assert!(text.contains("--limit images."), "{text}");
    }
    // The sum of a chunk with sizes does not match.
    assert!(text(&png).starts_with("a: PNG: "), "{}", text(&png));
}
