//! Writing: written files read back, and a failure leaves the old file unchanged.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

use osl_image::{
    BitDepth, ExrCompression, ExrOptions, ImageError, Layer, LayerKind, PngOptions, SampleType, StoredType,
    Transfer, read_image, write_exr, write_png,
};
use proptest::prelude::*;

const ODD: [f32; 6] = [0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-45];

const FLOAT: ExrOptions<'static> = ExrOptions {
    samples: SampleType::Float,
    compression: ExrCompression::Zip16,
    part: None,
    software: None,
    command: None,
};
const PNG8: PngOptions = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn scalar<'a>(name: &'a str, plane: &'a [f32]) -> Layer<'a> {
    Layer { name, kind: LayerKind::Scalar, planes: vec![plane] }
}

/// The names of the files in a directory: no temporary one may remain.
fn names_in(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn every_kind_gets_its_channel_names() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let planes: Vec<Vec<f32>> = (0..23).map(|i| vec![i as f32; 6]).collect();
    let of = |range: std::ops::Range<usize>| planes[range].iter().map(Vec::as_slice).collect();
    let layers = [
        Layer { name: "resultRGB", kind: LayerKind::Color, planes: of(0..3) },
        Layer { name: "dir", kind: LayerKind::Triple, planes: of(3..6) },
        Layer { name: "resultMask", kind: LayerKind::Scalar, planes: of(6..7) },
        Layer { name: "m", kind: LayerKind::Matrix, planes: of(7..23) },
    ];
    write_exr(&path, 3, 2, &layers, FLOAT).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!((back.width, back.height, back.stored), (3, 2, StoredType::Float));
    let value = |name: &str| {
        let channel = back.channels.iter().position(|c| c == name).unwrap();
        back.plane(channel)[5]
    };
    assert_eq!(value("resultRGB.R"), 0.0);
    assert_eq!(value("resultRGB.B"), 2.0);
    assert_eq!(value("dir.X"), 3.0);
    assert_eq!(value("dir.Z"), 5.0);
    assert_eq!(value("resultMask"), 6.0);
    assert_eq!(value("m.m00"), 7.0);
    assert_eq!(value("m.m12"), 7.0 + 6.0);
    assert_eq!(value("m.m33"), 22.0);
    assert_eq!(back.channels.len(), 23);
}

#[test]
fn a_nameless_color_has_the_bare_channels() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let (r, g, b) = ([1.0_f32], [2.0_f32], [3.0_f32]);
    let color = Layer { name: "", kind: LayerKind::Color, planes: vec![&r, &g, &b] };
    write_exr(&path, 1, 1, &[color], FLOAT).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!(back.channels, ["R", "G", "B"]);
    assert_eq!(back.samples, [1.0, 2.0, 3.0]);
}

#[test]
fn all_lossless_compressions_keep_every_bit() {
    let dir = tempfile::tempdir().unwrap();
    let plane: Vec<f32> = (0..37 * 21).map(|i| ODD.get(i).copied().unwrap_or(i as f32 * 0.37)).collect();
    for name in ExrCompression::NAMES {
        let compression = ExrCompression::from_name(name).unwrap();
        let path = dir.path().join(format!("{name}.exr"));
        write_exr(&path, 37, 21, &[scalar("a", &plane)], ExrOptions { compression, ..FLOAT }).unwrap();
        let back = read_image(&path).unwrap().samples;
        if compression != ExrCompression::Pxr24 {
            assert_eq!(bits(&back), bits(&plane), "{name}");
        } else {
            let close = |(a, b): (&f32, &f32)| a.is_nan() && b.is_nan() || a == b || (a - b).abs() < b * 1e-4;
            assert!(back.iter().zip(&plane).skip(6).all(close), "{name}");
        }
    }
    assert_eq!(ExrCompression::from_name("dwaa"), None);
}

#[test]
fn half_rounds_to_nearest() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("h.exr");
    let plane = [1.0, 1.0 + 0.000_6, 65504.0, 1e6, f32::NEG_INFINITY, f32::NAN];
    let options = ExrOptions { samples: SampleType::Half, ..FLOAT };
    write_exr(&path, 6, 1, &[scalar("a", &plane)], options).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!(back.stored, StoredType::Half);
    let expected = [1.0, 1.000_976_6, 65504.0, f32::INFINITY, f32::NEG_INFINITY];
    assert_eq!(back.samples[..5], expected);
    assert!(back.samples[5].is_nan());
}

#[test]
fn halves_come_back_whether_they_compress_or_not() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("h.exr");
    let options = ExrOptions { samples: SampleType::Half, ..FLOAT };
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 17) as f32;
    for plane in
        [(0..50 * 40).map(|i| (i % 50) as f32).collect::<Vec<f32>>(), (0..50 * 40).map(noise).collect()]
    {
        write_exr(&path, 50, 40, &[scalar("a", &plane), scalar("b", &plane)], options).unwrap();
        let rounded = plane.iter().map(|v| half::f16::from_f32(*v).to_f32());
        let back = read_image(&path).unwrap().samples;
        assert!(back.chunks(2).map(|pixel| (pixel[0], pixel[1])).eq(rounded.map(|v| (v, v))));
    }
}

#[test]
fn the_same_values_give_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let plane: Vec<f32> = (0..200 * 200).map(|i| (i as f32).sqrt()).collect();
    let write = |name: &str| {
        let path = dir.path().join(name);
        write_exr(&path, 200, 200, &[scalar("a", &plane)], FLOAT).unwrap();
        fs::read(path).unwrap()
    };
    assert_eq!(write("a.exr"), write("b.exr"));
}

#[test]
fn unsuitable_input_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let plane = [0.0_f32; 4];
    let text = |layers: &[Layer<'_>], width| {
        let error = write_exr(&path, width, 2, layers, FLOAT).unwrap_err();
        assert!(error.to_string().starts_with(&path.display().to_string()));
        error.to_string().split_once(": ").unwrap().1.to_owned()
    };
    assert_eq!(text(&[scalar("a", &plane)], 3), "channel `a` has 4 values for 6 pixels");
    assert_eq!(text(&[scalar("a", &plane)], 0), "0 x 2 is not a size an image can have");
    assert_eq!(text(&[scalar("a", &plane), scalar("a", &plane)], 2), "two channels are called `a`");
    assert_eq!(text(&[scalar("", &plane)], 2), "\"\" cannot be a channel name");
    assert_eq!(text(&[scalar("a\nb", &plane)], 2), "\"a\\nb\" cannot be a channel name");
    assert_eq!(text(&[], 2), "no channels to write");
    let color = Layer { name: "c", kind: LayerKind::Color, planes: vec![&plane] };
    assert_eq!(text(&[color], 2), "`c` has 1 planes, not 3");
    assert_eq!(names_in(dir.path()), Vec::<String>::new());
}

#[test]
fn png_bytes_follow_the_transfer() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let (r, g, b) = ([0.0, 0.5, 2.0_f32], [0.18, -1.0, f32::NAN], [1.0, 0.002, f32::INFINITY]);
    let srgb = PngOptions { transfer: Transfer::Srgb, depth: BitDepth::Eight, software: None };
    write_png(&path, 3, 1, &[&r, &g, &b], srgb).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!((back.stored, back.channels), (StoredType::U8, ["R", "G", "B"].map(str::to_owned).to_vec()));
    let bytes: Vec<u8> = back.samples.iter().map(|v| (v * 255.0).round() as u8).collect();
    assert_eq!(bytes, [0, 118, 255, 188, 0, 7, 255, 0, 255]);

    let grey = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Sixteen, software: None };
    write_png(&path, 3, 1, &[&r], grey).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!((back.stored, back.channels), (StoredType::U16, vec!["Y".to_owned()]));
    assert_eq!(back.samples, [0.0, 32768.0 / 65535.0, 1.0]);
    assert!(write_png(&path, 3, 1, &[&r[..]; 5], grey).is_err());
}

#[test]
fn the_last_of_two_or_four_planes_is_alpha() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let (grey, alpha) = ([1.0, 0.5_f32], [0.0, 0.5_f32]);
    write_png(&path, 2, 1, &[&grey, &alpha], PNG8).unwrap();
    let back = read_image(&path).unwrap();
    assert_eq!(back.channels, ["Y", "A"].map(str::to_owned).to_vec());
    let bytes: Vec<u8> = back.samples.iter().map(|v| (v * 255.0).round() as u8).collect();
    assert_eq!((bytes[1], bytes[3]), (0, 128), "alpha has no curve");
    write_png(&path, 2, 1, &[&grey, &grey, &grey, &alpha], PNG8).unwrap();
    assert_eq!(read_image(&path).unwrap().channels.len(), 4);
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    write_png(&path, 1, 1, &[&[0.5]], PNG8).unwrap();
    let before = fs::read(&path).unwrap();
    write_png(&path, 2, 1, &[&[0.5]], PNG8).unwrap_err();
    assert_eq!(fs::read(&path).unwrap(), before);
    assert_eq!(names_in(dir.path()), ["a.png"]);
}

#[test]
fn places_that_cannot_be_written_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let reason = |path: &Path| {
        let text = write_png(path, 1, 1, &[&[0.5]], PNG8).unwrap_err().to_string();
        assert!(text.starts_with(&format!("{}: ", path.display())) && !text.contains('\n'), "{text}");
        text
    };
    assert!(reason(dir.path()).ends_with("it is a folder, not a file"));
    let missing = dir.path().join("none");
    assert!(reason(&missing.join("a.png")).ends_with(&format!("there is no folder {}", missing.display())));
    fs::write(dir.path().join("plain"), "").unwrap();
    reason(&dir.path().join("plain").join("a.png"));
    assert_eq!(names_in(dir.path()), ["plain"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn permissions_are_those_of_any_new_file_or_of_the_old_one() {
        let dir = tempfile::tempdir().unwrap();
        let (plain, image) = (dir.path().join("plain"), dir.path().join("a.png"));
        fs::write(&plain, "").unwrap();
        write_png(&image, 1, 1, &[&[0.5]], PNG8).unwrap();
        assert_eq!(mode(&image), mode(&plain));
        fs::set_permissions(&image, fs::Permissions::from_mode(0o640)).unwrap();
        write_png(&image, 1, 1, &[&[0.25]], PNG8).unwrap();
        assert_eq!(mode(&image), 0o640);
    }

    #[test]
    fn a_link_stays_a_link() {
        let dir = tempfile::tempdir().unwrap();
        let (link, image) = (dir.path().join("link.png"), dir.path().join("a.png"));
        write_png(&image, 1, 1, &[&[0.0]], PNG8).unwrap();
        symlink(&image, &link).unwrap();
        write_png(&link, 1, 1, &[&[1.0]], PNG8).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(read_image(&image).unwrap().samples, [1.0]);
    }

    #[test]
    fn devices_survive() {
        write_png(Path::new("/dev/null"), 1, 1, &[&[0.0]], PNG8).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn a_directory_without_write_permission_is_named() {
        let dir = tempfile::tempdir().unwrap();
        fs::set_permissions(dir.path(), fs::Permissions::from_mode(0o555)).unwrap();
        // The superuser may write everywhere, so there is nothing to test.
        if fs::write(dir.path().join("probe"), "").is_ok() {
            return;
        }
        let error = write_png(&dir.path().join("a.png"), 1, 1, &[&[0.0]], PNG8).unwrap_err();
        assert!(matches!(error, ImageError::Io { .. }));
        assert!(error.to_string().contains("cannot create a file in"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any bit pattern, including NaN payloads, survives a round trip.
    #[test]
    fn exr_round_trip_is_exact(width in 1_usize..20, height in 1_usize..20, seed: u32) {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from_bits(state ^ state.rotate_left(15))
        };
        let plane: Vec<f32> = (0..width * height).map(|_| next()).collect();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        write_exr(&path, width, height, &[scalar("a", &plane)], FLOAT).unwrap();
        prop_assert_eq!(bits(&read_image(&path).unwrap().samples), bits(&plane));
    }
}
