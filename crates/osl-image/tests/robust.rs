//! Hostile files and coordinates: error values or plain numbers, never a panic, and the same answer twice.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::LazyLock;

use image::ImageEncoder;
use osl_image::{
    ExrCompression, ExrOptions, Footprint, ImageData, ImageError, Interp, Layer, LayerKind, LookupOptions,
    SampleType, StoredType, SubImage, Texture, Wrap, decode_part, lookup, lookup_values, read_image,
    write_exr,
};
use osl_limits::Limits;
use proptest::prelude::*;

/// Small enough that damaged headers request no more than a few megabytes.
const LIMIT: u64 = 1 << 20;

fn limits(samples: u64) -> Limits {
    let mut limits = Limits::default();
    limits.images.samples = samples;
    limits
}

fn decode(bytes: &[u8]) -> Result<ImageData, ImageError> {
    decode_part(Path::new("in memory"), bytes, &limits(LIMIT), SubImage::default())
}

fn textures() -> Vec<Vec<u8>> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/textures");
    let names = ["tex3x2gray.png", "tex4rgba.exr", "tex64.png", "tex64f.exr"];
    let mut files: Vec<Vec<u8>> = names.iter().map(|name| std::fs::read(dir.join(name)).unwrap()).collect();
    files.push(jpeg());
    files.extend(ExrCompression::NAMES.into_iter().map(exr));
    files
}

/// An EXR with this compression, half of them with 16-bit samples. It is so low that most compressions make a
/// single block of it, so that their data can be exchanged.
fn exr(compression: &str) -> Vec<u8> {
    let compression = ExrCompression::from_name(compression).unwrap();
    let short = compression as usize % 2 == 1;
    let samples = if short { SampleType::Half } else { SampleType::Float };
    let plane: Vec<f32> = (0..24 * 16).map(|i| (i % 7) as f32 + 1.0 / i as f32).collect();
    let layer = Layer { name: "a", kind: LayerKind::Color, planes: vec![&plane; 3] };
    let path = tempfile::NamedTempFile::new().unwrap();
    write_exr(
        path.path(),
        24,
        16,
        &[layer],
        ExrOptions { samples, compression, part: None, software: None, command: None },
    )
    .unwrap();
    std::fs::read(path.path()).unwrap()
}

fn jpeg() -> Vec<u8> {
    let pixels: Vec<u8> = (0..16 * 16 * 3).map(|i| (i * 7 % 256) as u8).collect();
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 75);
    encoder.write_image(&pixels, 16, 16, image::ExtendedColorType::Rgb8).unwrap();
    bytes
}

#[test]
fn jpeg_is_read() {
    let image = decode(&jpeg()).unwrap();
    assert_eq!((image.width, image.height, image.channels.len()), (16, 16, 3));
    assert_eq!(image.stored, StoredType::U8);
}

#[test]
fn every_beginning_of_a_file_is_refused_or_read() {
    for file in textures() {
        assert!(decode(&file).is_ok());
        for n in 0..file.len().min(600) {
            let text = decode(&file[..n]).map(|_| String::new()).unwrap_or_else(|e| e.to_string());
            assert!(!text.contains('\n'), "{text:?}");
        }
    }
}

/// Data of one compression under the name of another, which made the decoder of B44 panic.
#[test]
fn a_wrong_compression_is_refused_or_read() {
    let key = b"compression\0compression\0\x01\0\0\0";
    for mut file in ExrCompression::NAMES.map(exr) {
        let place = file.windows(key.len()).position(|window| window == key).unwrap() + key.len();
        for claimed in 0..=10 {
            file[place] = claimed;
            let _ = decode(&file);
        }
    }
}

#[test]
fn too_large_images_are_refused_by_their_header() {
    for file in textures() {
        let error = decode_part(Path::new("big.exr"), &file, &limits(5), SubImage::default()).unwrap_err();
        assert!(matches!(error, ImageError::TooLarge { limit: 5, .. }), "{error}");
    }
}

/// A PNG with one chunk before the pixels, whose data inflate to this many bytes.
fn png(side: u32, chunk: &[u8; 4], inflated: usize, n_pixel_bytes: usize) -> Vec<u8> {
    let packed = |n: usize| miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; n], 6);
    let head = [&side.to_be_bytes()[..], &side.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let profile = [b"x\0\0".as_slice(), &packed(inflated)].concat();
    chunks(&[(b"IHDR", head), (chunk, profile), (b"IDAT", packed(n_pixel_bytes)), (b"IEND", Vec::new())])
}

/// A PNG of these chunks.
fn chunks(list: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in list {
        file.extend((data.len() as u32).to_be_bytes());
        let start = file.len();
        file.extend(*kind);
        file.extend(data);
        let sum = crc(&file[start..]);
        file.extend(sum.to_be_bytes());
    }
    file
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 * (sum & 1)))
    })
}

/// A small file for a huge image is refused by its header, and the message names the limit.
#[test]
fn bombs_are_refused_by_their_headers() {
    let mut limits = Limits::default();
    limits.images.texture_memory = 16 << 20;
    let decode = |file: &[u8]| decode_part(Path::new("b.png"), file, &limits, SubImage::default());
    let error = decode(&png(16384, b"gAMA", 4, 1000)).unwrap_err();
    assert!(error.to_string().contains("takes 342 MiB, and the limit is 16 MiB"), "{error}");
    assert!(matches!(error, ImageError::Memory { limit: "texture_memory", .. }));
    assert_eq!(decode(&png(64, b"gAMA", 4, 65 * 64)).unwrap().samples.len(), 64 * 64);
}

/// Unused data such as a color profile or a text is not decompressed.
#[test]
fn profiles_and_texts_are_passed_over() {
    for chunk in [b"iCCP", b"zTXt", b"iTXt"] {
        let image = decode(&png(8, chunk, 32 << 20, 9 * 8)).unwrap();
        assert_eq!(image.samples, vec![0.0; 64]);
    }
}

/// A long text is kept by the decoder, within its memory.
#[test]
fn long_texts_are_passed_over() {
    let head = [&8_u32.to_be_bytes()[..], &8_u32.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let pixels = miniz_oxide::deflate::compress_to_vec_zlib(&[0; 9 * 8], 6);
    let file = |n: usize| {
        let text = [b"Comment\0".as_slice(), &vec![b'x'; n]].concat();
        chunks(&[(b"IHDR", head.clone()), (b"tEXt", text), (b"IDAT", pixels.clone()), (b"IEND", Vec::new())])
    };
    assert_eq!(decode(&file(3 << 20)).unwrap().samples, vec![0.0; 64]);
    let error = decode(&file(40 << 20)).unwrap_err().to_string();
    assert!(error.contains("--limit images.working_memory"), "{error}");
}

/// Detectable damage in a B44 block is an error, and never a NaN.
#[test]
fn damaged_b44_is_no_picture() {
    let file = {
        use exr::prelude::*;
        let plane = |n: usize| {
            let value = |i: usize| f16::from_f32(((i + n) as f32 * 0.37).sin() * 100.0);
            AnyChannel::new(["B", "G", "R"][n], FlatSamples::F16((0..64 * 64).map(value).collect()))
        };
        let encoding = Encoding {
            compression: Compression::B44,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let channels = AnyChannels::sort((0..3).map(plane).collect());
        let layer = exr::prelude::Layer::new((64, 64), LayerAttributes::default(), encoding, channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    assert!(decode(&file).is_ok());
    let mut refused = 0;
    for at in (500..file.len()).step_by(31) {
        for damage in [0xff, 0x80] {
            let mut damaged = file.clone();
            damaged[at] ^= damage;
            match decode(&damaged) {
                Ok(image) => assert!(image.samples.iter().all(|v| v.is_finite()), "byte {at}"),
                Err(error) => {
                    assert!(!error.to_string().contains("the decoder failed"), "byte {at}: {error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 5, "{refused}");
}

#[test]
fn other_files_are_named() {
    let text = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
    let none = "in memory: not an EXR, PNG, JPEG, TIFF, HDR, TGA, BMP, GIF, WebP, PNM or DDS file";
    assert_eq!(text(b"qoif plus something"), none);
    assert_eq!(text(b""), none);
    let missing = read_image(Path::new("no/such.exr")).unwrap_err().to_string();
    assert!(missing == "no/such.exr: no such file", "{missing}");
    assert!(read_image(Path::new(".")).is_err());
}

fn small_texture(seed: u32, width: usize, height: usize, n_channels: usize) -> Texture {
    let value = |i: usize| (i as u32).wrapping_mul(seed | 1).rotate_left(7) as f32 * 2.0_f32.powi(-32);
    Texture::new(ImageData {
        width,
        height,
        channels: vec!["c".to_owned(); n_channels],
        stored: StoredType::Float,
        wraps: (Wrap::File, Wrap::File),
        n_parts: 1,
        header: Default::default(),
        samples: (0..width * height * n_channels).map(value).collect(),
    })
}

fn any_wrap() -> impl Strategy<Value = Wrap> {
    prop::sample::select(vec![Wrap::File, Wrap::Black, Wrap::Clamp, Wrap::Periodic, Wrap::Mirror])
}

fn any_interp() -> impl Strategy<Value = Interp> {
    prop::sample::select(vec![Interp::Closest, Interp::Linear, Interp::Cubic, Interp::SmartCubic])
}

prop_compose! {
    /// Any float in every position that takes one.
    fn any_options()(
        wrap_s in any_wrap(),
        wrap_t in any_wrap(),
        interp in any_interp(),
        first_channel in prop_oneof![0_usize..5, Just(usize::MAX)],
        fill: f32,
        width: (f32, f32),
        blur: (f32, f32),
    ) -> LookupOptions {
        LookupOptions { wrap_s, wrap_t, interp, first_channel, fill, width, blur }
    }
}

/// A float with any bit pattern: NaN, infinite, subnormal and huge ones are as likely as others.
fn any_bits() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -3.0_f32..3.0, Just(f32::NAN), Just(f32::INFINITY)]
}

/// An EXR texture may specify its wrap; a lookup may override it.
#[test]
fn wraps_of_the_file_are_the_default() {
    use exr::prelude::*;
    let samples = FlatSamples::F32(vec![0.25, 0.5, 0.75, 1.0]);
    let channels = AnyChannels::sort([AnyChannel::new("Y", samples)].into_iter().collect());
    let wrap_mode_name = Text::new_or_none("periodic,clamp");
    let attributes = LayerAttributes { wrap_mode_name, ..LayerAttributes::default() };
    let layer = exr::prelude::Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    let texture = Texture::new(decode(bytes.get_ref()).unwrap());
    assert_eq!(texture.wraps(), (Wrap::Periodic, Wrap::Clamp));
    let closest = LookupOptions { interp: Interp::Closest, ..LookupOptions::default() };
    let look = |s, t, options| lookup_values(&texture, s, t, &Footprint::default(), 1, &options)[0];
    assert_eq!(look(1.25, 1.75, closest), 0.75);
    assert_eq!(look(1.25, 1.75, LookupOptions { wrap_s: Wrap::Black, ..closest }), 0.0);
}

/// Black is zero, not minus zero, also in channels that the file does not have.
#[test]
fn black_has_no_sign() {
    let texture = small_texture(5, 4, 4, 1);
    for (interp, fill) in [(Interp::Closest, 0.5), (Interp::Linear, 0.0), (Interp::Cubic, 0.5)] {
        let options = LookupOptions { interp, fill, ..LookupOptions::default() };
        let value = lookup_values(&texture, 7.0, 0.5, &Footprint::default(), 4, &options);
        assert_eq!(value.map(f32::to_bits), [0; 4]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn any_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..400), magic in 0_usize..4) {
        let magics: [&[u8]; 4] = [b"", b"\x76\x2f\x31\x01\x02\0\0\0", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"];
        let file = [magics[magic], &bytes].concat();
        let _ = decode(&file);
    }

    #[test]
    fn damaged_files_are_refused_or_read(
        file in 0_usize..11,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        header_only: bool,
    ) {
        static FILES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(textures);
        let mut bytes = FILES[file].clone();
        let reach = if header_only { bytes.len().min(380) } else { bytes.len() };
        for (place, byte) in damage {
            bytes[place.index(reach)] = byte;
        }
        if let Ok(image) = decode(&bytes) {
            prop_assert_eq!(image.samples.len(), image.width * image.height * image.channels.len());
        }
    }

    #[test]
    fn any_lookup_answers_and_answers_alike(
        size in (1_usize..9, 1_usize..9, 1_usize..5),
        s in any_bits(),
        t in any_bits(),
        steps in [any_bits(), any_bits(), any_bits(), any_bits()],
        n_channels in 0_usize..6,
        options in any_options(),
    ) {
        let texture = small_texture(77, size.0, size.1, size.2);
        let [ds_dx, dt_dx, ds_dy, dt_dy] = steps;
        let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
        let full = || lookup(&texture, s, t, &footprint, n_channels, &options);
        let values = lookup_values(&texture, s, t, &footprint, n_channels, &options);
        prop_assert_eq!(format!("{:?}", full()), format!("{:?}", full()));
        prop_assert_eq!(full().value.map(f32::to_bits), values.map(f32::to_bits));
    }

    /// Wraps other than black make a constant image constant everywhere, whatever the filter.
    #[test]
    fn a_constant_stays_constant(
        s in -3.0_f32..3.0,
        t in -3.0_f32..3.0,
        steps in prop::array::uniform4(-2.0_f32..2.0),
        wrap in prop::sample::select(vec![Wrap::Clamp, Wrap::Periodic, Wrap::Mirror]),
        interp in any_interp(),
        blur in 0.0_f32..0.5,
    ) {
        let texture = Texture::new(ImageData {
            width: 12,
            height: 5,
            channels: vec!["c".to_owned()],
            stored: StoredType::Float,
            wraps: (Wrap::File, Wrap::File),
            n_parts: 1,
            header: Default::default(),
            samples: vec![0.75; 60],
        });
        let [ds_dx, dt_dx, ds_dy, dt_dy] = steps;
        let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
        let options =
            LookupOptions { wrap_s: wrap, wrap_t: wrap, interp, blur: (blur, 0.0), ..LookupOptions::default() };
        let sample = lookup(&texture, s, t, &footprint, 1, &options);
        prop_assert!((sample.value[0] - 0.75).abs() < 1e-5, "{}", sample.value[0]);
        prop_assert!(sample.d_ds[0].abs() < 1e-4 && sample.d_dt[0].abs() < 1e-4);
    }

    /// The derivatives match the values inside one texel.
    #[test]
    fn derivatives_are_slopes(
        texel in (0_usize..8, 0_usize..8),
        at in (0.1_f32..0.9, 0.1_f32..0.9),
        interp in prop::sample::select(vec![Interp::Linear, Interp::Cubic]),
    ) {
        let texture = small_texture(12345, 8, 8, 1);
        let options =
            LookupOptions { interp, wrap_s: Wrap::Mirror, wrap_t: Wrap::Periodic, ..LookupOptions::default() };
        let look = |x: f32, y: f32| lookup(&texture, x, y, &Footprint::default(), 1, &options);
        let s = (texel.0 as f32 + 0.5 + at.0) / 8.0;
        let t = (texel.1 as f32 + 0.5 + at.1) / 8.0;
        let h = 1.0 / 256.0;
        let slope_s = (look(s + h, t).value[0] - look(s - h, t).value[0]) / (2.0 * h);
        let slope_t = (look(s, t + h).value[0] - look(s, t - h).value[0]) / (2.0 * h);
        let sample = look(s, t);
        prop_assert!((sample.d_ds[0] - slope_s).abs() < 0.02, "{} {slope_s}", sample.d_ds[0]);
        prop_assert!((sample.d_dt[0] - slope_t).abs() < 0.02, "{} {slope_t}", sample.d_dt[0]);
    }
}

/// Every decoder fails once the command has to stop, and says why.
#[test]
fn decoders_stop() {
    let limits = Limits::default();
    limits.halt(osl_limits::Halt::Time);
    let exr = {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let layer =
            osl_image::Layer { name: "Y", kind: osl_image::LayerKind::Scalar, planes: vec![&[0.5; 64]] };
        osl_image::write_exr(&path, 8, 8, &[layer], osl_image::ExrOptions::default()).unwrap();
        std::fs::read(path).unwrap()
    };
    let hdr = [b"#?RADIANCE\n\n-Y 2 +X 3\n".as_slice(), &[128; 24]].concat();
    for file in [png(64, b"gAMA", 4, 65 * 64), exr, hdr] {
        assert!(decode(&file).is_ok());
        let error = decode_part(Path::new("a"), &file, &limits, SubImage::default()).unwrap_err();
        assert!(error.to_string().contains("--max-time"), "{error}");
    }
}

/// The rows of the seven passes of an interlaced PNG come to their places.
#[test]
fn interlaced_rows_are_sorted() {
    let passes =
        [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)];
    let mut rows = Vec::new();
    for (x0, y0, dx, dy) in passes {
        for y in (y0..6_u8).step_by(dy) {
            rows.push(0);
            rows.extend((x0..8_u8).step_by(dx).map(|x| 8 * y + x));
        }
    }
    let head = [8_u32.to_be_bytes(), 6_u32.to_be_bytes()].concat();
    let pixels = miniz_oxide::deflate::compress_to_vec_zlib(&rows, 6);
    let file = chunks(&[
        (b"IHDR", [&head[..], &[8, 0, 0, 0, 1]].concat()),
        (b"IDAT", pixels.clone()),
        (b"IEND", Vec::new()),
    ]);
    let bytes = decode(&file).unwrap().samples.into_iter().map(|x| (x * 255.0).round() as u8);
    assert!(bytes.eq(0..48));
    let cut = chunks(&[
        (b"IHDR", [&head[..], &[8, 0, 0, 0, 1]].concat()),
        (b"IDAT", pixels[..pixels.len() / 2].to_vec()),
        (b"IEND", Vec::new()),
    ]);
    assert!(decode(&cut).is_err());
}
