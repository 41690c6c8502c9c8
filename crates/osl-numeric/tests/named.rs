//! Named color spaces: published matrices and values, inverses, slopes.

use osl_numeric::named::{is_raw, names, number, of_plain};
use osl_numeric::spaces::Path;
use proptest::prelude::*;

/// The conversion between two named spaces, in double precision.
fn between(from: &str, to: &str, c: [f64; 3]) -> [f64; 3] {
    let to_rgb = number(from, true).map_or(c, |number| of_plain(c, [0.0; 3], number).0);
    number(to, false).map_or(to_rgb, |number| of_plain(to_rgb, [0.0; 3], number).0)
}

/// Three rows for column vectors: each color of the source is a column.
fn matrix(from: &str, to: &str) -> [[f64; 3]; 3] {
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| between(from, to, c));
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row]))
}

/// The matrices that OpenColorIO's built-in configurations and the Academy publish.
#[test]
fn matrices_are_the_published_ones() {
    let known = [
        (
            "lin_rec709",
            "ACEScg",
            [
                [0.613_097_402_4, 0.339_523_146_2, 0.047_379_451_4],
                [0.070_193_722_5, 0.916_353_879_1, 0.013_452_398_5],
                [0.020_615_592_9, 0.109_569_772_9, 0.869_814_634_2],
            ],
        ),
        (
            "ACES2065-1",
            "Linear Rec.709 (sRGB)",
            [
                [2.521_686_186_743_88, -1.134_130_988_239_72, -0.387_555_198_504_164],
                [-0.276_479_914_229_922, 1.372_719_087_668_26, -0.096_239_173_438_334],
                [-0.015_378_064_966_034_2, -0.152_975_335_867_399, 1.168_353_400_833_43],
            ],
        ),
        (
            "ACES - ACES2065-1",
            "lin_ap1",
            [
                [1.451_439_316_145_67, -0.236_510_746_893_74, -0.214_928_569_251_925],
                [-0.076_553_773_396_020_6, 1.176_229_699_833_57, -0.099_675_926_437_552_2],
                [0.008_316_148_425_697_72, -0.006_032_449_791_021_02, 0.997_716_301_365_323],
            ],
        ),
        (
            "lin_ap0",
            "Linear P3-D65",
            [
                [2.024_905_285_966_79, -0.689_069_761_034_766, -0.335_835_524_932_019],
                [-0.183_597_032_256_178, 1.289_506_207_759_02, -0.105_909_175_502_841],
                [0.009_058_561_122_347_66, -0.059_279_684_057_552_2, 1.050_221_122_935_2],
            ],
        ),
        (
            "lin_ap0",
            "Linear Rec.2020",
            [
                [1.490_409_520_541_72, -0.266_170_919_266_13, -0.224_238_601_275_593],
                [-0.080_167_499_872_255_8, 1.182_167_121_097_57, -0.101_999_621_225_31],
                [0.003_227_631_191_622_16, -0.034_776_475_745_057_6, 1.031_548_844_553_44],
            ],
        ),
        (
            "CIE XYZ-D65 - Scene-referred",
            "lin_ap0",
            [
                [1.063_495_491_494_2, 0.006_408_910_197_117_89, -0.015_806_786_617_605_4],
                [-0.492_074_127_923_892, 1.368_223_407_473_33, 0.091_337_088_314_473_6],
                [-0.002_816_461_639_253_51, 0.004_644_171_056_800_67, 0.916_418_574_593_656],
            ],
        ),
        // Adobe RGB (1998) color image encoding, 4.3.6.1, to XYZ with the white of D65.
        (
            "Linear AdobeRGB",
            "CIE-XYZ-D65",
            [[0.576_67, 0.185_56, 0.188_23], [0.297_34, 0.627_36, 0.075_29], [0.027_03, 0.070_69, 0.991_34]],
        ),
    ];
    for (from, to, published) in known {
        let digits = if from == "Linear AdobeRGB" { 5e-4 } else { 1e-9 };
        for (own, published) in matrix(from, to).iter().flatten().zip(published.iter().flatten()) {
            assert!((own - published).abs() < digits, "{from} to {to}: {own} {published}");
        }
    }
}

#[test]
fn curves_have_the_published_values() {
    // S-2014-003 and S-2016-001: the number of 18 % grey, of 0, and of 1; IEC 61966-2-1; powers.
    let cct = 0.072_905_534_195_835_5;
    let known = [
        ("ACEScct", "ACEScg", 0.413_588_402_493_442, 0.18),
        ("acescct", "acescg", cct, 0.0),
        ("ACES - ACEScct", "lin_ap1", 0.554_794_520_547_945, 1.0),
        ("ACEScct", "ACEScg", cct - 10.540_237_741_654_5, -1.0),
        ("ACEScc", "ACEScg", 0.413_588_402_493_442, 0.18),
        ("ACEScc", "ACEScg", -0.358_447_488_584_475, 0.0),
        ("srgb_tx", "lin_rec709", 0.5, 0.214_041_140_482_232),
        ("sRGB - Texture", "lin_rec709", 1.0, 1.0),
        ("Utility - sRGB - Texture", "lin_rec709", 0.03, 0.03 / 12.923_210_180_787_86),
        ("srgb_rec709_scene", "lin_rec709", -2.0, -2.0 / 12.923_210_180_787_86),
        ("g22_rec709", "lin_rec709", 0.5, 0.217_637_640_824_031),
        ("g18_rec709", "lin_rec709", 0.5, 0.287_174_588_749_258),
        ("Gamma 2.4 Encoded Rec.709", "lin_rec709", 0.5, 0.189_464_570_813_8),
        ("g22_rec709_tx", "lin_rec709", -0.5, -0.5),
        ("Raw", "Raw", 0.25, 0.25),
    ];
    for (stored, linear, number, light) in known {
        for (from, to, x, y) in [(stored, linear, number, light), (linear, stored, light, number)] {
            // Grey stays grey between spaces with the same primaries.
            let found = between(from, to, [x; 3]);
            assert!(found.iter().all(|f| (f - y).abs() < 1e-9), "{from} to {to} of {x}: {found:?} {y}");
        }
    }
}

#[test]
fn names_are_found_in_any_case_and_mean_one_space() {
    let mut seen = std::collections::BTreeSet::new();
    for name in names() {
        assert!(seen.insert(name.to_lowercase()), "{name}");
        for written in [name.to_string(), name.to_lowercase(), name.to_uppercase()] {
            assert!(is_raw(&written) != number(&written, true).is_some(), "{written}");
            assert!(Path::between(&written, "RGB", None).is_some(), "{written}");
        }
    }
    for unknown in ["", "ACES", "scene_linear_2", "lin_rec709 "] {
        assert!(number(unknown, true).is_none() && !is_raw(unknown), "{unknown}");
        assert!(Path::between("Raw", unknown, None).is_none(), "{unknown}");
    }
    // With primaries of their own, tools without color management know the language's spaces only.
    assert!(Path::between("lin_ap1", "rgb", Some(0)).is_none());
    assert!(Path::between("ACEScg", "rgb", Some(12)).is_some());
    assert_eq!(of_plain([1.0, 2.0, 3.0], [4.0; 3], -1), ([1.0, 2.0, 3.0], [4.0; 3]));
}

proptest! {
    #[test]
    fn ways_there_and_back_are_inverses(
        which in 0..200_usize, c in prop::array::uniform3(-2.0..4.0_f64), near in prop::array::uniform3(0.0..0.01_f64),
    ) {
        let all: Vec<&str> = names().filter(|name| !is_raw(name)).collect();
        let name = all[which % all.len()];
        for c in [c, near] {
            // ACEScc ends at 0.
            let c = if name.to_lowercase().contains("acescc") { c.map(f64::abs) } else { c };
            let stored = between("", name, c);
            prop_assume!(!name.contains("cc") || stored.iter().all(|x| *x > -0.358));
            let back = between(name, "", stored);
            for (a, b) in back.iter().zip(c) {
                prop_assert!((a - b).abs() < 1e-9, "{name}: {c:?} {stored:?} {back:?}");
            }
        }
    }

    #[test]
    fn tangents_are_differences(
        which in 0..200_usize, to_rgb in any::<bool>(),
        c in prop::array::uniform3(-1.0..1.0_f64), d in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let all: Vec<&str> = names().filter(|name| !is_raw(name)).collect();
        let Some(number) = number(all[which % all.len()], to_rgb) else { return Ok(()) };
        let tangent = of_plain(c, d, number).1;
        let step = 1e-6;
        let at = |k: f64| of_plain([0, 1, 2].map(|i| c[i] + k * step * d[i]), d, number);
        let (low, high) = (at(-1.0), at(1.0));
        let slopes = low.1.iter().zip(high.1).zip(tangent);
        for ((before, after), ((a, b), own)) in low.0.iter().zip(high.0).zip(slopes) {
            // Near a bend or a steep place, both slopes count.
            let (least, most) = (a.min(b).min(own), a.max(b).max(own));
            let slope = (after - before) / (2.0 * step);
            let room = 1e-4 * (1.0 + slope.abs());
            prop_assert!(slope > least - room && slope < most + room, "{number} {c:?} {slope} {own}");
        }
    }
}
