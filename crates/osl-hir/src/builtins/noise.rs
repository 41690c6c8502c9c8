//! Noise: pseudo-random fields over space. The overloads differ by return type, chosen by the expected type.

use super::{Builtin, Emitted, Site};
use osl_ir::ir::{Builder, GaborOption, Kernel, Kind, LaneOp, NoiseField};
use osl_ir::types::Type;

const PLAIN: &[&str] = &[
    "f(f)",
    "f(f,f)",
    "f(p p)",
    "f(p p,f t)",
    "c(f)",
    "c(f,f)",
    "c(p p)",
    "c(p p,f t)",
    "v(f)",
    "v(f,f)",
    "v(p p)",
    "v(p p,f t)",
];

const NAMED: &[&str] = &[
    "f(s,f,*)",
    "f(s,f,f,*)",
    "f(s,p p,*)",
    "f(s,p p,f t,*)",
    "c(s,f,*)",
    "c(s,f,f,*)",
    "c(s,p p,*)",
    "c(s,p p,f t,*)",
    "v(s,f,*)",
    "v(s,f,f,*)",
    "v(s,p p,*)",
    "v(s,p p,f t,*)",
    "f(f u)",
    "f(f u,f v)",
    "f(p p)",
    "f(p p,f t)",
    "c(f u)",
    "c(f u,f v)",
    "c(p p)",
    "c(p p,f t)",
    "v(f u)",
    "v(f u,f v)",
    "v(p p)",
    "v(p p,f t)",
];

const PERIODIC: &[&str] = &[
    "f(f u,f uperiod)",
    "f(f u,f v,f uperiod,f vperiod)",
    "f(p p,p pperiod)",
    "f(p p,f t,p pperiod,f tperiod)",
    "c(f u,f uperiod)",
    "c(f u,f v,f uperiod,f vperiod)",
    "c(p p,p pperiod)",
    "c(p p,f t,p pperiod,f tperiod)",
    "v(f u,f uperiod)",
    "v(f u,f v,f uperiod,f vperiod)",
    "v(p p,p pperiod)",
    "v(p p,f t,p pperiod,f tperiod)",
];

const NAMED_PERIODIC: &[&str] = &[
    "f(s noisetype,f u,f uperiod,*)",
    "f(s noisetype,f u,f v,f uperiod,f vperiod,*)",
    "f(s noisetype,p p,p pperiod,*)",
    "f(s noisetype,p p,f t,p pperiod,f tperiod,*)",
    "c(s noisetype,f u,f uperiod,*)",
    "c(s noisetype,f u,f v,f uperiod,f vperiod,*)",
    "c(s noisetype,p p,p pperiod,*)",
    "c(s noisetype,p p,f t,p pperiod,f tperiod,*)",
    "v(s noisetype,f u,f uperiod,*)",
    "v(s noisetype,f u,f v,f uperiod,f vperiod,*)",
    "v(s noisetype,p p,p pperiod,*)",
    "v(s noisetype,p p,f t,p pperiod,f tperiod,*)",
    "f(f u,f uperiod)",
    "f(f u,f v,f uperiod,f vperiod)",
    "f(p p,p pperiod)",
    "f(p p,f t,p pperiod,f tperiod)",
    "c(f u,f uperiod)",
    "c(f u,f v,f uperiod,f vperiod)",
    "c(p p,p pperiod)",
    "c(p p,f t,p pperiod,f tperiod)",
    "v(f u,f uperiod)",
    "v(f u,f v,f uperiod,f vperiod)",
    "v(p p,p pperiod)",
    "v(p p,f t,p pperiod,f tperiod)",
];

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "cellnoise",
        PLAIN,
        "u, v",
        |b, s| plain(b, s, NoiseField::Cell, false),
        "Returns one random value, from 0 to 1, for each unit cell.",
    )
    .derivatives("zero")
    .extremes(
        "Coordinates that do not fit in an int (from 2147483648 on), inf and nan count as the cell \
         -2147483648, and the result is as random there as elsewhere. 0 and -0 lie in the same cell, \
         and -1e-45 lies in the cell -1.",
    )
    .example("float tint = cellnoise(8 * u, 8 * v); color tile = cellnoise(8 * P);"),
    Builtin::compose(
        "hashnoise",
        PLAIN,
        "u, v",
        |b, s| plain(b, s, NoiseField::Hash, false),
        "Returns a different random value, from 0 to 1, at every point.",
    )
    .derivatives("zero")
    .extremes(
        "Every bit of the coordinates counts: 0 and -0 give different values. Every nan counts as the \
         same number. inf is a coordinate like any other.",
    )
    .example("float grain = hashnoise(u, v);"),
    Builtin::compose(
        "snoise",
        PLAIN,
        "u, v",
        |b, s| plain(b, s, NoiseField::Perlin, false),
        "Returns gradient noise from -1 to 1, which is 0 at whole coordinates.",
    )
    .derivatives("analytic")
    .extremes(
        "The result is 0 at whole coordinates, and therefore everywhere from 8388608 on. If \
         coordinates do not fit in an int (from 2147483648 on), their fraction has no meaning: the \
         result may be inf or nan, and is the same on every processor. inf and -inf give inf or nan, \
         and nan gives nan.",
    )
    .example("float bumps = snoise(4 * P);"),
    Builtin::compose(
        "noise",
        NAMED,
        "noisetype, u, v",
        |b, s| noise(b, s, false),
        "Returns gradient noise from 0 to 1, or the noise that `noisetype` names. The names are \
         perlin, uperlin, simplex, usimplex, cell, hash and gabor.",
    )
    .derivatives("analytic; zero for cell and hash")
    .extremes(
        "At whole coordinates, and therefore everywhere from 8388608 on, Perlin noise is 0.5 \
         (uperlin) or 0 (perlin). If coordinates do not fit in an int (from 2147483648 on), it may be \
         inf or nan, the same on every processor; simplex noise of two and more dimensions is 0 there \
         (usimplex 0.5), and cell noise takes the cell -2147483648. Gabor noise is 0 for inf and nan. \
         An unknown name is a run-time error and gives 0.",
    )
    .example(
        "float clouds = noise(4 * P); float cells = noise(\"cell\", 8 * u); float stripes = \
         noise(\"gabor\", 4 * P, \"bandwidth\", 2.0);",
    ),
    Builtin::compose(
        "psnoise",
        PERIODIC,
        "",
        |b, s| plain(b, s, NoiseField::Perlin, true),
        "Returns gradient noise from -1 to 1 that repeats. The periods follow the coordinates.",
    )
    .derivatives("analytic, for the coordinates; the periods have none")
    .extremes(
        "Periods are rounded down to whole numbers. A period that is less than 1, does not fit in an \
         int, or is nan counts as 1. Coordinates that do not fit in an int may give inf or nan, the \
         same on every processor.",
    )
    .example("float tiling = psnoise(8 * u, 8);"),
    Builtin::compose(
        "pnoise",
        NAMED_PERIODIC,
        "",
        |b, s| noise(b, s, true),
        "Returns noise that repeats. The periods follow the coordinates; simplex noise has no \
         periodic form.",
    )
    .derivatives("analytic, for the coordinates; the periods have none; zero for cell and hash")
    .extremes(
        "Periods of Perlin and Gabor noise are rounded down to whole numbers. A period that is less \
         than 1, does not fit in an int, or is nan counts as 1. In cell noise, an infinite coordinate \
         or period selects the cell -2147483648. Coordinates that do not fit in an int may give inf \
         or nan, the same on every processor.",
    )
    .example("float tiling = pnoise(8 * P, point(8)); float cells = pnoise(\"cell\", 8 * u, 4);"),
];

fn plain(b: &mut Builder, s: &Site<'_>, field: NoiseField, periodic: bool) -> Emitted {
    let (dims, kind) = form(b, s, 0, periodic);
    let triple = kind == Kind::Triple;
    b.kernel(Kernel::Noise { field, dims, triple, periodic, has_derivs: false }, s.args, kind).into()
}

fn noise(b: &mut Builder, s: &Site<'_>, periodic: bool) -> Emitted {
    if s.args.first().is_some_and(|a| b.body.kind(*a) != Kind::Str) {
        return plain(b, s, NoiseField::UPerlin, periodic);
    }
    let (dims, kind) = form(b, s, 1, periodic);
    let params = s.signature.params.len();
    let mut args = s.args.get(..params).unwrap_or(s.args).to_vec();
    let mut options = Vec::new();
    for index in (params..s.args.len().saturating_sub(1)).step_by(2) {
        let Some((option, wanted)) = s.literal(index).and_then(|name| GaborOption::from_name(name)) else {
            continue;
        };
        let value = s.arg(index + 1);
        let value = match (b.body.kind(value), wanted) {
            (Kind::Int, Kind::Float) => b.lane(LaneOp::ToFloat, &[value]),
            _ => value,
        };
        if b.body.kind(value) == wanted {
            options.push(option);
            args.push(value);
        }
    }
    let triple = kind == Kind::Triple;
    b.kernel(Kernel::NamedNoise { dims, triple, periodic, options, has_derivs: false }, &args, kind).into()
}

/// Dimensions and kind of the result, from the coordinates after the first `skip` arguments.
fn form(b: &Builder, s: &Site<'_>, skip: usize, periodic: bool) -> (u8, Kind) {
    let count = (s.signature.params.len() - skip) / if periodic { 2 } else { 1 };
    let point = b.body.kind(s.arg(skip)) == Kind::Triple;
    let dims = if point { 2 + count as u8 } else { count as u8 };
    (dims, if s.signature.ret == Type::FLOAT { Kind::Float } else { Kind::Triple })
}
