//! Splines over arrays of knots. In bases that step by one knot, the first and last knots are phantom end
//! points.

use super::{Array, Builtin, Emitted, Site};
use osl_ir::ir::{Builder, Const, Kernel, Kind, LaneOp, ValueId};
use osl_numeric::basis::{BASES, CONSTANT, SIXTH, basis};
use osl_numeric::library_constants::LibraryConstant;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "spline",
        &[
            "f(s,f,f[])",
            "c(s,f,c[])",
            "p(s,f,p[])",
            "v(s,f,v[])",
            "n(s,f,n[])",
            "f(s,f,i,f[])",
            "c(s,f,i,c[])",
            "p(s,f,i,p[])",
            "v(s,f,i,v[])",
            "n(s,f,i,n[])",
        ],
        "basis, x, nknots, y | basis, x, y",
        spline,
        "Returns the value at `x`, from 0 to 1, of the curve through the knots `y`. The basis is \
         catmull-rom, bezier, bspline, hermite, linear or constant.",
    )
    .derivatives("those of x and of the knots; zero for the basis constant")
    .extremes(
        "`x` is clamped to 0 to 1, and nan counts as 0. Reads beyond the knots take the nearest knot, \
         so fewer than four knots are no error. Any other basis is linear. The bases that advance by \
         one knot do not reach the first and the last knot. A single point, vector or normal may be \
         given instead of the knots; it counts as an array of one.",
    )
    .example("float knots[5] = {0, 0, 0.2, 1, 1}; float y = spline(\"catmull-rom\", u, knots);"),
    Builtin::compose(
        "splineinverse",
        &["f(s,f,f[])", "f(s,f,i,f[])"],
        "basis, v, nknots, y | basis, v, y",
        inverse,
        "Returns the x, from 0 to 1, at which a spline has the value `v`. The spline must only rise \
         or only fall.",
    )
    .derivatives("those of the value v only, carried through the last step of the search; 0 beyond the ends")
    .extremes(
        "Values beyond the ends give 0 or 1. The search stops after 32 steps, within about 1e-6. If \
         the curve turns, the result is one of the places with the value. nan gives a number from 0 \
         to 1.",
    )
    .example("float knots[5] = {0, 0, 0.2, 1, 1}; float x = splineinverse(\"linear\", v, knots);"),
];

/// Knots and their number.
fn knots(b: &mut Builder, s: &Site<'_>) -> Option<(Array, ValueId)> {
    let array = s.array(s.args.len().checked_sub(1)?)?;
    let count = if s.args.len() == 4 { s.arg(2) } else { b.int(array.len as i32) };
    Some((array, count))
}

fn spline(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let Some((array, count)) = knots(b, s) else { return Emitted::default() };
    let (step, rows) = chosen(b, s);
    let (zero, one) = (b.float(0.0), b.float(1.0));
    // Not `clamp`: at both ends x keeps its derivatives.
    let (below, above) = (b.lane(L::FLt, &[s.arg(1), zero]), b.lane(L::FGt, &[s.arg(1), one]));
    let x = b.lane(L::Choose, &[above, one, s.arg(1)]);
    let x = b.lane(L::Choose, &[below, zero, x]);
    // (count - 4) / step + 1 segments.
    let (four, first, none) = (b.int(4), b.int(1), b.int(0));
    let extra = b.lane(L::ISub, &[count, four]);
    let extra = b.lane(L::IDiv, &[extra, step]);
    let segments = b.lane(L::IAdd, &[extra, first]);
    let scale = b.lane(L::ToFloat, &[segments]);
    let x = b.lane(L::FMul, &[x, scale]);
    let last = b.lane(L::ISub, &[segments, first]);
    let segment = b.lane(L::ToInt, &[x]);
    let segment = b.lane(L::IMin, &[segment, last]);
    let segment = b.lane(L::IMax, &[segment, none]);
    let start = b.lane(L::ToFloat, &[segment]);
    let t = b.lane(L::FSub, &[x, start]);
    let start = b.lane(L::IMul, &[segment, step]);
    let points: [ValueId; 4] = std::array::from_fn(|k| {
        let k = b.int(k as i32);
        let at = b.lane(L::IAdd, &[start, k]);
        b.load_element(array.slot, at)
    });
    let mut value: Option<ValueId> = None;
    for row in rows {
        let mut term: Option<ValueId> = None;
        for (weight, point) in row.into_iter().zip(points) {
            let product = b.lane(L::FMul, &[point, weight]);
            term = Some(term.map_or(product, |sum| b.lane(L::FAdd, &[sum, product])));
        }
        value = match (value, term) {
            (Some(value), Some(term)) => {
                let higher = b.lane(L::FMul, &[value, t]);
                Some(b.lane(L::FAdd, &[higher, term]))
            }
            (value, term) => value.or(term),
        };
    }
    Emitted { result: value.map(|value| still_if_constant(b, s, value)), outputs: Vec::new() }
}

/// The value without derivatives if the basis is "constant".
fn still_if_constant(b: &mut Builder, s: &Site<'_>, value: ValueId) -> ValueId {
    if let Some(name) = s.literal(0) {
        return if &**name == CONSTANT { b.lane(LaneOp::Still, &[value]) } else { value };
    }
    let name = b.constant(Const::Str(CONSTANT.into()));
    let is = b.lane(LaneOp::SEq, &[s.arg(0), name]);
    let still = b.lane(LaneOp::Still, &[value]);
    b.lane(LaneOp::Choose, &[is, still, value])
}

/// A coefficient of a basis. Those that are not exactly floats are sixths.
fn weight(b: &mut Builder, c: f32) -> ValueId {
    let known = [
        (SIXTH, LibraryConstant::Sixth),
        (-SIXTH, LibraryConstant::MinusSixth),
        (4.0 * SIXTH, LibraryConstant::TwoThirds),
    ];
    match known.into_iter().find(|(single, _)| *single == c) {
        Some((_, known)) => b.library_constant(known),
        None => b.float(c),
    }
}

/// Step and coefficients of the basis; selected at run time if the name is not a literal.
fn chosen(b: &mut Builder, s: &Site<'_>) -> (ValueId, [[ValueId; 4]; 4]) {
    if let Some(name) = s.literal(0) {
        let basis = basis(name);
        return (b.int(basis.step), basis.rows.map(|row| row.map(|c| weight(b, c))));
    }
    let [rest @ .., linear] = &BASES;
    let mut step = b.int(linear.step);
    let mut rows = linear.rows.map(|row| row.map(|c| weight(b, c)));
    for basis in rest {
        let name = b.constant(Const::Str(basis.name.into()));
        let is = b.lane(LaneOp::SEq, &[s.arg(0), name]);
        let own = b.int(basis.step);
        step = b.lane(LaneOp::IChoose, &[is, own, step]);
        for (row, own) in rows.iter_mut().zip(&basis.rows) {
            for (value, own) in row.iter_mut().zip(own) {
                let own = weight(b, *own);
                *value = b.lane(LaneOp::Choose, &[is, own, *value]);
            }
        }
    }
    (step, rows)
}

fn inverse(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let Some((array, count)) = knots(b, s) else { return Emitted::default() };
    b.kernel(
        Kernel::SplineInverse { knots: array.slot, has_derivs: false },
        &[s.arg(0), s.arg(1), count],
        Kind::Float,
    )
    .into()
}
