//! Models of the color functions.

use super::case::{Case, Model, Piece, even};

type V = [f64; 3];

fn transformed(c: V, rows: [V; 3]) -> V {
    [0, 1, 2].map(|i| c[0] * rows[0][i] + c[1] * rows[1][i] + c[2] * rows[2][i])
}

/// Inverse by Cramer's rule.
fn inverse(m: [V; 3]) -> [V; 3] {
    let cross =
        |a: V, b: V| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let columns = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant = (0..3).map(|i| m[0][i] * columns[0][i]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| columns[j][i] / determinant))
}

/// The XYZ of red, green and blue of Rec. 709 from their chromaticities and white D65.
fn rec709() -> [V; 3] {
    let primaries = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]].map(|[x, y]| [x, y, 1.0 - x - y]);
    let white = [0.3127 / 0.3291, 1.0, (1.0 - 0.3127 - 0.3291) / 0.3291];
    let amounts = transformed(white, inverse(primaries));
    [0, 1, 2].map(|i| primaries[i].map(|x| x * amounts[i]))
}

fn hsv_to_rgb([h, s, v]: V, p: &mut Piece) -> V {
    if p.is(s < 0.0001) {
        return [v; 3];
    }
    let turns = 6.0 * (h - p.floor(h));
    let sixth = p.floor(turns);
    let f = turns - sixth;
    let (low, down, up) = (v * (1.0 - s), v * (1.0 - s * f), v * (1.0 - s * (1.0 - f)));
    match sixth as i32 {
        0 => [v, up, low],
        1 => [down, v, low],
        2 => [low, v, up],
        3 => [low, down, v],
        4 => [up, low, v],
        _ => [v, low, down],
    }
}

/// Hue, largest and smallest.
fn hue([r, g, b]: V, p: &mut Piece) -> V {
    let order = [r >= g, g >= b, b >= r, r >= b].map(|is| p.is(is));
    let (largest, smallest) = (r.max(g).max(b), r.min(g).min(b));
    let range = largest - smallest;
    if p.is(range == 0.0) {
        return [0.0, largest, smallest];
    }
    let h = match order {
        [true, _, _, true] => (g - b) / range,
        [false, true, ..] => 2.0 + (b - r) / range,
        _ => 4.0 + (r - g) / range,
    };
    let h = if p.is(h < 0.0) { h + 6.0 } else { h };
    [h / 6.0, largest, smallest]
}

fn rgb_to_hsv(c: V, p: &mut Piece) -> V {
    let [h, largest, smallest] = hue(c, p);
    if p.is(largest > 0.0) { [h, (largest - smallest) / largest, largest] } else { [0.0, 0.0, largest] }
}

fn rgb_to_hsl(c: V, p: &mut Piece) -> V {
    let [h, largest, smallest] = hue(c, p);
    let sum = largest + smallest;
    let below = p.is(sum <= 1.0);
    [h, (largest - smallest) / if below { sum } else { 2.0 - sum }, sum / 2.0]
}

fn hsl_to_rgb([h, s, l]: V, p: &mut Piece) -> V {
    let v = if p.is(l <= 0.5) { l * (1.0 + s) } else { l * (1.0 - s) + s };
    if p.is(v <= 0.0) {
        return [0.0; 3];
    }
    hsv_to_rgb([h, (2.0 * v - 2.0 * l) / v, v], p)
}

/// IEC 61966-2-1.
fn srgb_to_linear(x: f64, p: &mut Piece) -> f64 {
    if p.is(x <= 0.04045) { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

fn linear_to_srgb(x: f64, p: &mut Piece) -> f64 {
    if p.is(x <= 0.003_130_8) { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

fn xyz_to_xyy([x, y, z]: V, p: &mut Piece) -> V {
    let sum = x + y + z;
    if p.is(sum >= 1e-6) { [x / sum, y / sum, y] } else { [0.0, 0.0, y] }
}

fn xyy_to_xyz([x, y, luminance]: V, p: &mut Piece) -> V {
    let k = if p.is(y > 1e-6) { luminance / y } else { 0.0 };
    [k * x, luminance, k * (1.0 - x - y)]
}

/// Rows of "Color".
pub(crate) fn colors() -> Vec<Case> {
    let yiq = [[0.299, 0.596, 0.212], [0.587, -0.275, -0.523], [0.114, -0.321, 0.311]];
    let back = [[1.0, 1.0, 1.0], [0.9557, -0.2716, -1.1082], [0.6199, -0.6469, 1.7051]];
    let (xyz, rgb) = (rec709(), inverse(rec709()));
    let share = even(0.02, 1.0).edges(-3.0, 10.0);
    let ways: Vec<(&str, Model)> = vec![
        ("\"rgb\", \"hsv\"", Box::new(|x, p| rgb_to_hsv(x.a(), p))),
        ("\"hsv\", \"rgb\"", Box::new(|x, p| hsv_to_rgb(x.a(), p))),
        ("\"rgb\", \"hsl\"", Box::new(|x, p| rgb_to_hsl(x.a(), p))),
        ("\"hsl\", \"rgb\"", Box::new(|x, p| hsl_to_rgb(x.a(), p))),
        (
            "\"hsv\", \"hsl\"",
            Box::new(|x, p| {
                let rgb = hsv_to_rgb(x.a(), p);
                rgb_to_hsl(rgb, p)
            }),
        ),
        ("\"YIQ\"", Box::new(move |x, _| transformed(x.a(), yiq))),
        ("\"YIQ\", \"rgb\"", Box::new(move |x, _| transformed(x.a(), back))),
        ("\"XYZ\"", Box::new(move |x, _| transformed(x.a(), xyz))),
        ("\"XYZ\", \"rgb\"", Box::new(move |x, _| transformed(x.a(), rgb))),
        ("\"xyY\"", Box::new(move |x, p| xyz_to_xyy(transformed(x.a(), xyz), p))),
        ("\"xyY\", \"rgb\"", Box::new(move |x, p| transformed(xyy_to_xyz(x.a(), p), rgb))),
        ("\"sRGB\"", Box::new(|x, p| x.a().map(|c| linear_to_srgb(c, p)))),
        ("\"sRGB\", \"linear\"", Box::new(|x, p| x.a().map(|c| srgb_to_linear(c, p)))),
    ];
    let mut cases: Vec<Case> = ways
        .into_iter()
        .map(|(spaces, model)| {
            // Two conversions in a row: the hue of what is nearly grey is lost between them.
            let share = if spaces.contains("hsv\", \"hsl") { even(0.2, 1.0).edges(0.5, 10.0) } else { share };
            let code = format!("(vector)transformc({spaces}, (color)a)");
            Case {
                inside: (32.0, "differences of components round like the largest of them, and like 1"),
                ..Case::new("transformc", &code, true, model).on(&[share])
            }
        })
        .collect();
    let luminance: Model = Box::new(move |x, _| [(0..3).map(|i| x.0[i] * xyz[i][1]).sum(), 0.0, 0.0]);
    cases.push(Case::new("luminance", "luminance((color)a)", false, luminance));
    cases.push(Case::zero("blackbody", "(vector)blackbody(1000 + 500 * s)", true));
    cases.push(Case::zero("wavelength_color", "(vector)wavelength_color(500 + 50 * s)", true));
    cases.push(Case::zero("color in space", "(vector)color(\"hsv\", s, t, s)", true));
    cases
}
