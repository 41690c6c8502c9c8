//! TIFF and HDR files, and files with several images: written files read back, and damage is refused.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;

use osl_image::{ImageData, ImageError, StoredType, SubImage, Texture, Wrap, decode_part};
use osl_limits::Limits;
use proptest::prelude::*;
use tiff::encoder::colortype::{self, ColorType};
use tiff::encoder::{Compression, TiffEncoder, TiffValue};
use tiff::tags::Tag;

const LIMIT: u64 = 1 << 20;

fn limits(samples: u64) -> Limits {
    let mut limits = Limits::default();
    limits.images.samples = samples;
    limits
}

fn decode(bytes: &[u8]) -> Result<ImageData, ImageError> {
    decode_part(Path::new("in memory"), bytes, &limits(LIMIT), SubImage::default())
}

fn decode_nth(bytes: &[u8], n: usize) -> Result<ImageData, ImageError> {
    decode_part(Path::new("in memory"), bytes, &limits(LIMIT), SubImage::Index(n))
}

/// One page: its pixels, and its tags of numbers and of text.
struct Page<'a, T> {
    size: (u32, u32),
    samples: &'a [T],
    kind: u32,
    texts: &'a [(u16, &'a str)],
}

fn tiff<C: ColorType>(pages: &[Page<'_, C::Inner>], compression: Compression) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap().with_compression(compression);
    for page in pages {
        let mut image = encoder.new_image::<C>(page.size.0, page.size.1).unwrap();
        image.encoder().write_tag(Tag::NewSubfileType, page.kind).unwrap();
        for (tag, text) in page.texts {
            image.encoder().write_tag(Tag::Unknown(*tag), *text).unwrap();
        }
        image.write_data(page.samples).unwrap();
    }
    file.into_inner()
}

fn one_page<C: ColorType>(size: (u32, u32), samples: &[C::Inner], compression: Compression) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    tiff::<C>(&[Page { size, samples, kind: 0, texts: &[] }], compression)
}

/// A TIFF with one strip, built by hand: tags of 16-bit values, then the data.
fn bare_tiff(tags: &[(u16, u16)], data: &[u8]) -> Vec<u8> {
    let mut tags = tags.to_vec();
    let n_tags = tags.len() + 2;
    let data_at = 8 + 2 + n_tags * 12 + 4;
    tags.extend([(273, data_at as u16), (279, data.len() as u16)]);
    tags.sort_unstable();
    let mut file = [b"II*\0".as_slice(), &8_u32.to_le_bytes(), &(n_tags as u16).to_le_bytes()].concat();
    for (tag, value) in tags {
        file.extend([tag, 3].map(u16::to_le_bytes).concat());
        file.extend([1, u32::from(value)].map(u32::to_le_bytes).concat());
    }
    file.extend([0; 4]);
    file.extend(data);
    file
}

/// Three planes of 2 x 1 bytes, each in a strip of its own; the tags point to lists after them.
fn planar_tiff() -> Vec<u8> {
    const LISTS_AT: u32 = 8 + 2 + 10 * 12 + 4;
    let inline = |tag: u16, value: u32| (tag, 1, value);
    let list = |tag: u16, place: u32| (tag, 3, LISTS_AT + place * 6);
    let tags = [
        inline(256, 2),
        inline(257, 1),
        list(258, 0),
        inline(259, 1),
        inline(262, 2),
        list(273, 1),
        inline(277, 3),
        inline(278, 1),
        list(279, 2),
        inline(284, 2),
    ];
    let mut file = [b"II*\0".as_slice(), &8_u32.to_le_bytes(), &(tags.len() as u16).to_le_bytes()].concat();
    for (tag, count, value) in tags {
        file.extend([tag, 3].map(u16::to_le_bytes).concat());
        file.extend([count, value].map(u32::to_le_bytes).concat());
    }
    file.extend([0; 4]);
    let data_at = LISTS_AT as u16 + 3 * 6;
    let lists = [[8; 3], [data_at, data_at + 2, data_at + 4], [2; 3]];
    file.extend(lists.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    file.extend([0, 51, 102, 153, 204, 255]);
    file
}

/// 12 × 9 pixels, of which pixel `i` is `(i, 0.5, 1 / (i + 1))`. The crate image 0.25 wrote the file.
fn hdr(signature: &str) -> Vec<u8> {
    let rest = include_bytes!("data/12x9.hdr").strip_prefix(b"#?RADIANCE").unwrap();
    [signature.as_bytes(), rest].concat()
}

/// Parts of 2 x 1 and 1 x 2 pixels, named, with one channel each.
fn exr_of_parts() -> Vec<u8> {
    use exr::prelude::*;
    let part = |name: &str, size: (usize, usize), samples: Vec<f32>| {
        let channel = AnyChannel::new("Y", FlatSamples::F32(samples));
        let channels = AnyChannels::sort([channel].into_iter().collect());
        let attributes = LayerAttributes::named(name);
        exr::prelude::Layer::new(size, attributes, Encoding::UNCOMPRESSED, channels)
    };
    let layers = vec![part("left", (2, 1), vec![1.0, 2.0]), part("right", (1, 2), vec![3.0, 4.0])];
    let display = IntegerBounds::from_dimensions((2, 2));
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_layers(ImageAttributes::new(display), layers);
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn three_pages() -> Vec<u8> {
    let page = |samples, kind, name| Page { size: (2, 1), samples, kind, texts: name };
    let pages = [
        page(&[10, 20], 0, [(285, "first"), (33303, "periodic,clamp")].as_slice()),
        page(&[15, 15], 1, &[]),
        page(&[30, 40], 2, &[(285, "second")]),
    ];
    tiff::<colortype::Gray8>(&pages, Compression::Uncompressed)
}

fn all_files() -> Vec<Vec<u8>> {
    let bytes: Vec<u8> = (0..12 * 9 * 3).map(|i| (i * 7 % 251) as u8).collect();
    let floats: Vec<f32> = (0..12 * 9).map(|i| i as f32 / 9.0).collect();
    vec![
        one_page::<colortype::RGB8>((12, 9), &bytes, Compression::Lzw),
        one_page::<colortype::RGB8>((12, 9), &bytes, Compression::Packbits),
        one_page::<colortype::Gray32Float>((12, 9), &floats, Compression::Deflate(Default::default())),
        three_pages(),
        planar_tiff(),
        hdr("#?RADIANCE"),
        exr_of_parts(),
    ]
}

#[test]
fn tiff_integers_are_fractions() {
    for compression in [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Packbits,
        Compression::Deflate(Default::default()),
    ] {
        let image =
            decode(&one_page::<colortype::RGB8>((2, 1), &[0, 51, 255, 1, 2, 3], compression)).unwrap();
        assert_eq!((image.width, image.height, image.stored), (2, 1, StoredType::U8));
        assert_eq!(image.channels, ["R", "G", "B"]);
        assert_eq!(image.samples[..3], [0.0, 51.0 * (1.0 / 255.0), 1.0]);
    }
    let words = one_page::<colortype::RGBA16>((1, 1), &[0, 13107, 65535, 1], Compression::Lzw);
    let image = decode(&words).unwrap();
    assert_eq!((image.stored, image.channels.len()), (StoredType::U16, 4));
    assert_eq!(image.samples[..3], [0.0, 13107.0 * (1.0 / 65535.0), 1.0]);
}

#[test]
fn tiff_floats_are_kept_bit_for_bit() {
    let values = [-0.0, 1.5e-42, 3.0e38, f32::INFINITY, -7.25, 0.1];
    let grey = decode(&one_page::<colortype::Gray32Float>((6, 1), &values, Compression::Lzw)).unwrap();
    assert_eq!((grey.stored, grey.channels.len()), (StoredType::Float, 1));
    assert_eq!(grey.samples.map_bits(), values.to_vec().map_bits());
    let color = decode(&one_page::<colortype::RGB32Float>((2, 1), &values, Compression::Lzw)).unwrap();
    assert_eq!(color.samples.map_bits(), values.to_vec().map_bits());
}

trait Bits {
    fn map_bits(&self) -> Vec<u32>;
}

impl Bits for Vec<f32> {
    fn map_bits(&self) -> Vec<u32> {
        self.iter().map(|value| value.to_bits()).collect()
    }
}

/// 16-bit floats and single bits, which the test's encoder does not write.
#[test]
fn rare_kinds_of_tiff() {
    let size = [(256, 3), (257, 2), (259, 1), (278, 2)];
    let with = |more: &[(u16, u16)]| [size.as_slice(), more].concat();

    let halves: Vec<u8> = (0..6).flat_map(|i| half::f16::from_f32(i as f32 / 4.0).to_le_bytes()).collect();
    let image = decode(&bare_tiff(&with(&[(258, 16), (262, 1), (277, 1), (339, 3)]), &halves)).unwrap();
    assert_eq!((image.stored, image.samples), (StoredType::Half, vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.25]));

    let image =
        decode(&bare_tiff(&with(&[(258, 1), (262, 1), (277, 1)]), &[0b1010_0000, 0b0110_0000])).unwrap();
    assert_eq!((image.stored, image.samples), (StoredType::U8, vec![1.0, 0.0, 1.0, 0.0, 1.0, 1.0]));

    let image =
        decode(&bare_tiff(&with(&[(258, 4), (262, 1), (277, 1)]), &[0x0f, 0x30, 0xf0, 0xc0])).unwrap();
    let fifths: Vec<f32> =
        [0, 5, 1, 5, 0, 4].iter().map(|&n| f32::from(n as u8 * 51) * (1.0 / 255.0)).collect();
    assert_eq!(image.samples, fifths);
}

#[test]
fn planes_of_a_tiff_are_joined() {
    let image = decode(&planar_tiff()).unwrap();
    assert_eq!((image.width, image.height, image.channels.len()), (2, 1, 3));
    let expected = [0, 102, 204, 51, 153, 255].map(|byte: u8| f32::from(byte) * (1.0 / 255.0));
    assert_eq!(image.samples, expected);
}

#[test]
fn pages_of_a_tiff_by_place_and_name() {
    let file = three_pages();
    let second = decode_nth(&file, 1).unwrap();
    assert_eq!(second.n_parts, 2, "the reduced copy is not counted");
    assert_eq!(second.samples, [30.0, 40.0].map(|v: f32| v * (1.0 / 255.0)));
    let path = Path::new("a.tif");
    let named = |name| decode_part(path, &file, &limits(LIMIT), SubImage::Name(name));
    assert_eq!(named("second").unwrap(), second);
    assert_eq!(named("").unwrap(), decode(&file).unwrap());
    assert_eq!(named("none").unwrap_err().to_string(), "a.tif: there is no subimage named \"none\"");
    assert_eq!(decode_nth(&file, 2).unwrap_err().to_string(), "in memory: there is no subimage 2, only 2");
    assert_eq!(decode(&file).unwrap().wraps, (Wrap::Periodic, Wrap::Clamp));
}

#[test]
fn parts_of_an_exr_by_place_and_name() {
    let file = exr_of_parts();
    let left = decode(&file).unwrap();
    let right = decode_nth(&file, 1).unwrap();
    assert_eq!((left.width, left.height, left.samples.as_slice()), (2, 1, [1.0, 2.0].as_slice()));
    assert_eq!((right.width, right.height, right.samples.as_slice()), (1, 2, [3.0, 4.0].as_slice()));
    let named = decode_part(Path::new("a.exr"), &file, &limits(LIMIT), SubImage::Name("right")).unwrap();
    assert_eq!(named, right);
    assert_eq!(Texture::new(named).n_parts(), 2);
    assert!(decode_nth(&file, 2).is_err());
    assert!(decode_nth(&hdr("#?RGBE"), 1).is_err());
}

#[test]
fn hdr_pixels_have_a_common_exponent() {
    for signature in ["#?RADIANCE", "#?RGBE"] {
        let image = decode(&hdr(signature)).unwrap();
        assert_eq!((image.width, image.height, image.stored), (12, 9, StoredType::Float));
        assert_eq!(image.channels, ["R", "G", "B"]);
        for (i, pixel) in image.samples.chunks(3).enumerate() {
            let largest = (i as f32).max(1.0);
            let expected = [i as f32, 0.5, 1.0 / (i + 1) as f32];
            let near = |(got, expected): (&f32, f32)| (got - expected).abs() <= largest / 128.0;
            assert!(pixel.iter().zip(expected).all(near), "{pixel:?}");
        }
    }
    let endless = [b"#?RADIANCE\n".as_slice(), &b"A=B\n".repeat(1 << 16)].concat();
    assert!(decode(&endless).unwrap_err().to_string().ends_with("header does not end"));
}

/// Headers that promise far more than the file contains are refused before memory is allocated.
#[test]
fn promises_of_huge_images_are_refused() {
    let huge = bare_tiff(
        &[(256, 65535), (257, 65535), (258, 8), (259, 1), (262, 1), (277, 1), (278, 65535)],
        &[0; 8],
    );
    assert!(matches!(decode(&huge), Err(ImageError::TooLarge { .. })));
    let deep = bare_tiff(
        &[(256, 64), (257, 64), (258, 8), (259, 1), (262, 1), (277, 65535), (278, 64), (284, 2)],
        &[0; 8],
    );
    assert!(decode(&deep).is_err());
    let tile = bare_tiff(
        &[
            (256, 4),
            (257, 4),
            (258, 8),
            (259, 1),
            (262, 1),
            (277, 1),
            (322, 65520),
            (323, 65520),
            (324, 8),
            (325, 8),
        ],
        &[0; 8],
    );
    assert!(decode(&tile).is_err());
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n";
    assert!(matches!(decode(hdr), Err(ImageError::TooLarge { .. })));
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4294967295 +X 4294967295\n";
    assert!(decode(hdr).is_err());
}

/// A circular chain of pages ends.
#[test]
fn pages_in_a_circle_end() {
    let mut file = bare_tiff(&[(256, 1), (257, 1), (258, 8), (259, 1), (262, 1), (277, 1), (278, 1)], &[9]);
    let next = 8 + 2 + 9 * 12;
    file[next] = 8;
    if let Ok(image) = decode(&file) {
        assert!(image.n_parts <= 1024);
    }
    let _ = decode_nth(&file, 1);
}

#[test]
fn every_beginning_is_refused_or_read() {
    for file in all_files() {
        assert!(decode(&file).is_ok());
        for n in 0..file.len() {
            for part in 0..2 {
                let text =
                    decode_nth(&file[..n], part).map(|_| String::new()).unwrap_or_else(|e| e.to_string());
                assert!(!text.contains('\n'), "{text:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2048))]

    #[test]
    fn damaged_files_are_refused_or_read(
        file in 0_usize..7,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        at_the_end: bool,
        part in 0_usize..2,
    ) {
        static FILES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(all_files);
        let mut bytes = FILES[file].clone();
        // The tags of a TIFF come last here, the headers of the other formats first.
        let reach = bytes.len().min(300);
        let from = if at_the_end { bytes.len() - reach } else { 0 };
        for (place, byte) in damage {
            bytes[from + place.index(reach)] = byte;
        }
        if let Ok(image) = decode_nth(&bytes, part) {
            prop_assert_eq!(image.samples.len(), image.width * image.height * image.channels.len());
        }
    }

    #[test]
    fn any_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..400), magic in 0_usize..5) {
        let magics: [&[u8]; 5] =
            [b"II*\0\x08\0\0\0", b"MM\0*\0\0\0\x08", b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0", b"#?RADIANCE\n\n", b"#?RGBE\n\n-Y 3 +X 9\n"];
        let _ = decode(&[magics[magic], &bytes].concat());
    }
}
