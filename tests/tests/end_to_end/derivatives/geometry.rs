//! Models of the functions of vectors, of matrices and spaces, and of light at a boundary.

use super::case::{Case, In, Model, Piece, even, sizes};

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn add(a: V, b: V) -> V {
    [0, 1, 2].map(|i| a[i] + b[i])
}

fn scale(a: V, k: f64) -> V {
    a.map(|x| x * k)
}

/// The length, scaled by the largest component so that nothing underflows.
fn length(a: V) -> f64 {
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 { 0.0 } else { largest * dot(scale(a, 1.0 / largest), scale(a, 1.0 / largest)).sqrt() }
}

fn normalize(a: V) -> V {
    let size = length(a);
    if size == 0.0 { [0.0; 3] } else { a.map(|x| x / size) }
}

fn reflect(i: V, n: V) -> V {
    add(i, scale(n, -2.0 * dot(n, i)))
}

fn refract(i: V, n: V, eta: f64, p: &mut Piece) -> V {
    let facing = dot(i, n);
    let k = 1.0 - eta * eta * (1.0 - facing * facing);
    if p.is(k < 0.0) { [0.0; 3] } else { add(scale(i, eta), scale(n, -(eta * facing + k.sqrt()))) }
}

/// The reflected and transmitted fractions (Fresnel's equations for unpolarised light).
fn fresnel(i: V, n: V, eta: f64, p: &mut Piece) -> (f64, f64) {
    let facing = dot(i, n);
    let c = if p.is(facing < 0.0) { -facing } else { facing };
    let g = 1.0 / (eta * eta) - 1.0 + c * c;
    if p.is(g < 0.0) {
        return (1.0, 0.0);
    }
    let g = g.sqrt();
    let f = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    let kr = 0.5 * (1.0 + f * f) * ((g - c) / (g + c)).powi(2);
    (kr, (1.0 - kr) * eta * eta)
}

/// A point rotated around an axis (Rodrigues).
fn turn(x: V, angle: f64, axis: V) -> V {
    let u = normalize(axis);
    let (s, c) = angle.sin_cos();
    add(add(scale(x, c), scale(cross(u, x), s)), scale(u, dot(u, x) * (1.0 - c)))
}

fn first(x: f64) -> V {
    [x, 0.0, 0.0]
}

fn metal(x: &In, p: &mut Piece) -> [V; 2] {
    let mut n = [0.0; 3];
    let mut k = [0.0; 3];
    for c in 0..3 {
        let r = x.0[c];
        let r = if p.is(r < 0.0) { 0.0 } else { r };
        let r = if p.is(r > 0.99) { 0.99 } else { r };
        let edge = x.0[3 + c];
        n[c] = edge * (1.0 - r) / (1.0 + r) + (1.0 - edge) * (1.0 + r.sqrt()) / (1.0 - r.sqrt());
        let (above, below) = (r * (n[c] + 1.0).powi(2), (n[c] - 1.0).powi(2));
        k[c] = if p.positive(above - below, above) { ((above - below) / (1.0 - r)).sqrt() } else { 0.0 };
    }
    [n, k]
}

/// Rows of "Geometry" and "Light at a boundary", and the ramp of "Derivatives and antialiasing".
pub(crate) fn vectors() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut case = |row: &'static str, code: &str, triple: bool, model: Model| {
        cases.push(Case::new(row, code, triple, model).on(&[even(-3.0, 3.0).edges(-1e6, 1e6).least(1e-16)]));
    };
    case("dot", "dot(a, b)", false, Box::new(|x, _| first(dot(x.a(), x.b()))));
    case("cross", "cross((vector)a, b)", true, Box::new(|x, _| cross(x.a(), x.b())));
    case("length", "length(b)", false, Box::new(|x, _| first(length(x.b()))));
    case("distance", "distance(a, c)", false, Box::new(|x, _| first(length(add(x.a(), scale(x.c(), -1.0))))));
    case("normalize", "normalize(b)", true, Box::new(|x, _| normalize(x.b())));
    case(
        "faceforward",
        "faceforward((vector)a, b, (vector)c)",
        true,
        Box::new(|x, p| if p.is(dot(x.c(), x.b()) > 0.0) { scale(x.a(), -1.0) } else { x.a() }),
    );
    case("reflect", "reflect(b, (vector)a)", true, Box::new(|x, _| reflect(x.b(), x.a())));
    let unit = even(-0.6, 0.6).edges(-1.0, 1.0);
    let eta = even(0.5, 1.5).edges(0.5, 2.0);
    let mut light = |code: &str, triple: bool, model: Model| {
        let row = if code.contains("fresnel") { "fresnel" } else { "refract" };
        cases.push(Case::new(row, code, triple, model).on(&[unit, unit, unit, eta, eta]));
    };
    light("refract(b, (vector)a, s)", true, Box::new(|x, p| refract(x.b(), x.a(), x.s(), p)));
    light(
        "float x = 0; fresnel(b, (normal)a, s, f, x);",
        false,
        Box::new(|x, p| first(fresnel(x.b(), x.a(), x.s(), p).0)),
    );
    light(
        "float x = 0; vector y; vector z; fresnel(b, (normal)a, s, x, f, y, z);",
        false,
        Box::new(|x, p| first(fresnel(x.b(), x.a(), x.s(), p).1)),
    );
    light(
        "float x = 0; float y; vector z; fresnel(b, (normal)a, s, x, y, f, z);",
        true,
        Box::new(|x, _| reflect(x.b(), x.a())),
    );
    light(
        "float x = 0; float y; vector z; fresnel(b, (normal)a, s, x, y, z, f);",
        true,
        Box::new(|x, p| {
            fresnel(x.b(), x.a(), x.s(), p);
            refract(x.b(), x.a(), x.s(), p)
        }),
    );
    // The angle and the axis become a matrix, which has no derivatives.
    let near = even(-3.0, 3.0).edges(-1e4, 1e4).least(1e-16);
    cases.push(
        Case::new("rotate", "(vector)rotate(a, s, b)", true, Box::new(|x, _| turn(x.a(), x.s(), x.b())))
            .on(&[near])
            .still(&[3, 4, 5, 9]),
    );
    cases.push(
        Case::new(
            "rotate",
            "(vector)rotate(a, 0.5, (point)b, (point)b + vector(1, 2, 2))",
            true,
            Box::new(|x, _| add(x.b(), turn(add(x.a(), scale(x.b(), -1.0)), 0.5, [1.0, 2.0, 2.0]))),
        )
        .on(&[even(-3.0, 3.0).edges(-3.0, 3.0)]),
    );
    let share = even(0.0, 1.0).edges(-1.0, 1.0);
    cases.push(
        Case::new(
            "artistic_ior",
            "color x = 0, y = 0; artistic_ior((color)a, (color)b, x, y); f = (vector)x;",
            true,
            Box::new(|x, p| metal(x, p)[0]),
        )
        .on(&[share]),
    );
    cases.push(
        Case::new(
            "artistic_ior",
            "color x = 0, y = 0; artistic_ior((color)a, (color)b, x, y); f = (vector)y;",
            true,
            Box::new(|x, p| metal(x, p)[1]),
        )
        .on(&[share])
        .within(
            2e-4,
            "1.3e-4 measured: at a reflectance of 0.99 the terms under the root are some thousand times their difference",
        ),
    );
    // Edge, value and both widths given.
    let width = sizes(0.05, 3.0).edges(0.5, 3.0);
    cases.push(
        Case::new(
            "aastep",
            "aastep(a[0], a[1], s, t)",
            false,
            Box::new(|x, p| {
                let size = |x: f64, p: &mut Piece| if p.is(x < 0.0) { -x } else { x };
                let span = size(x.s(), p) + size(x.t(), p);
                let ramp = (x.0[1] - (x.0[0] - 0.5 * span)) / span;
                first(match (p.is(ramp <= 0.0), p.is(ramp >= 1.0)) {
                    (true, _) => 0.0,
                    (_, true) => 1.0,
                    _ => ramp,
                })
            }),
        )
        .on(&[even(-2.0, 2.0).edges(-3.0, 3.0), width]),
    );
    for case in &mut cases {
        case.inside = (8.0, "sums of products of components round like the largest of them");
    }
    for code in ["Dx(s * t)", "Dy(s * t)", "Dz(s * t)", "filterwidth(s * t)", "area(a * s)"] {
        let row = code.split('(').next().unwrap_or_default();
        cases.push(Case::zero(row, code, false));
    }
    cases.push(Case::zero("calculatenormal", "calculatenormal(a * s)", true));
    cases
}

/// Rows of "Matrices and spaces". The reference's spaces: `shader` rotates by 45° around z and moves by 1 in
/// x, `myspace` scales by 1, 2 and 1.
pub(crate) fn spaces() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut case = |row: &'static str, code: &str, model: Model| {
        cases.push(Case::new(row, code, true, model).on(&[sizes(1e-3, 1e2).edges(-1e4, 1e4)]));
    };
    const MATRIX: &str = "matrix m = matrix(1, 2, 0.5, 0, -1, 1, 0, 0, 0.25, 0, 2, 0, 3, -2, 1, 1);";
    const ROWS: [V; 4] = [[1.0, 2.0, 0.5], [-1.0, 1.0, 0.0], [0.25, 0.0, 2.0], [3.0, -2.0, 1.0]];
    fn apply(v: V, rows: [V; 3]) -> V {
        add(add(scale(rows[0], v[0]), scale(rows[1], v[1])), scale(rows[2], v[2]))
    }
    const LINEAR: [V; 3] = [ROWS[0], ROWS[1], ROWS[2]];
    case(
        "transform",
        &format!("{MATRIX} f = (vector)transform(m, a);"),
        Box::new(|x, _| add(apply(x.a(), LINEAR), ROWS[3])),
    );
    case("transform", &format!("{MATRIX} f = transform(m, b);"), Box::new(|x, _| apply(x.b(), LINEAR)));
    case(
        "transform",
        &format!("{MATRIX} f = (vector)transform(m, (normal)b);"),
        Box::new(|x, _| {
            // By the transposed inverse: the cofactors divided by the determinant.
            let [r, s, t] = LINEAR;
            let cofactors = [cross(s, t), cross(t, r), cross(r, s)];
            scale(apply(x.b(), cofactors), 1.0 / dot(r, cross(s, t)))
        }),
    );
    // The matrix carries no derivatives, even if its numbers vary.
    case("transform", "f = transform(matrix(2), b);", Box::new(|x, _| scale(x.b(), 2.0)));
    let turned = |v: V| {
        let h = std::f64::consts::FRAC_1_SQRT_2;
        [h * (v[0] - v[1]), h * (v[0] + v[1]), v[2]]
    };
    case("transform", "transform(\"shader\", \"common\", b)", Box::new(move |x, _| turned(x.b())));
    case(
        "transform",
        "transform(\"myspace\", b)",
        Box::new(|x, _| {
            let [x, y, z] = x.b();
            [x, y / 2.0, z]
        }),
    );
    case(
        "point in space",
        "(vector)point(\"shader\", s, t, s * t)",
        Box::new(move |x, _| add(turned([x.s(), x.t(), x.s() * x.t()]), [1.0, 0.0, 0.0])),
    );
    case(
        "vector in space",
        "vector(\"shader\", s, t, s * t)",
        Box::new(move |x, _| turned([x.s(), x.t(), x.s() * x.t()])),
    );
    case(
        "normal in space",
        "(vector)normal(\"myspace\", s, t, s * t)",
        Box::new(|x, _| [x.s(), x.t() / 2.0, x.s() * x.t()]),
    );
    for case in &mut cases {
        case.inside = (8.0, "sums of products of coordinates round like the largest of them");
    }
    let projective = "matrix m = matrix(1, 0, 0, 0.1, 0, 2, 0, -0.2, 0.5, 0, 1, 0.05, 1, 2, 3, 4); f = (vector)transform(m, a);";
    cases.push(
        Case::new(
            "transform",
            projective,
            true,
            Box::new(|x, p| {
                let [x, y, z] = x.a();
                let w = 0.1 * x - 0.2 * y + 0.05 * z + 4.0;
                p.is(w > 0.0);
                scale([x + 0.5 * z + 1.0, 2.0 * y + 2.0, z + 3.0], 1.0 / w)
            }),
        )
        .on(&[even(-5.0, 5.0).edges(-3.0, 3.0)]),
    );
    cases.push(Case::zero("determinant", "determinant(matrix(s))", false));
    cases
}
