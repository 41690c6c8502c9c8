//! Noise: pseudo-random fields over space. The forms differ by return type, chosen by what is expected.

use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Kernel, Kind, NoiseField};
use crate::types::Type;

const PLAIN: &[&str] = &[
    "f(f)", "f(f,f)", "f(p)", "f(p,f)", "c(f)", "c(f,f)", "c(p)", "c(p,f)", "v(f)", "v(f,f)", "v(p)",
    "v(p,f)",
];

const NAMED: &[&str] = &[
    "f(s,f,*)",
    "f(s,f,f,*)",
    "f(s,p,*)",
    "f(s,p,f,*)",
    "c(s,f,*)",
    "c(s,f,f,*)",
    "c(s,p,*)",
    "c(s,p,f,*)",
    "v(s,f,*)",
    "v(s,f,f,*)",
    "v(s,p,*)",
    "v(s,p,f,*)",
    "f(f)",
    "f(f,f)",
    "f(p)",
    "f(p,f)",
    "c(f)",
    "c(f,f)",
    "c(p)",
    "c(p,f)",
    "v(f)",
    "v(f,f)",
    "v(p)",
    "v(p,f)",
];

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "cellnoise",
        PLAIN,
        |b, s| plain(b, s, NoiseField::Cell),
        "One random value, 0 to 1, for each unit cell; zero derivatives.",
    ),
    Builtin::compose(
        "hashnoise",
        PLAIN,
        |b, s| plain(b, s, NoiseField::Hash),
        "Another random value, 0 to 1, at every point; zero derivatives.",
    ),
    Builtin::compose(
        "snoise",
        PLAIN,
        |b, s| plain(b, s, NoiseField::Perlin),
        "Gradient noise, -1 to 1, zero at whole coordinates.",
    ),
    Builtin::compose(
        "noise",
        NAMED,
        noise,
        "Gradient noise, 0 to 1, or the field named by the first argument: perlin, uperlin, simplex, usimplex, cell, hash.",
    ),
];

fn plain(b: &mut Builder, s: &Site<'_>, field: NoiseField) -> Emitted {
    let (dims, kind) = form(b, s, 0);
    let kernel = Kernel::Noise { field, dims, triple: kind == Kind::Triple, periodic: false };
    b.kernel(kernel, s.args, kind).into()
}

fn noise(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.args.first().is_some_and(|a| b.body.kind(*a) != Kind::Str) {
        return plain(b, s, NoiseField::UPerlin);
    }
    let (dims, kind) = form(b, s, 1);
    let args = s.args.get(..s.signature.params.len()).unwrap_or(s.args);
    // Options belong to gabor noise alone, and are ignored by the others.
    b.kernel(Kernel::NamedNoise { dims, triple: kind == Kind::Triple, periodic: false }, args, kind).into()
}

/// Dimensions and kind of the result, from the coordinates behind the first `skip` arguments.
fn form(b: &Builder, s: &Site<'_>, skip: usize) -> (u8, Kind) {
    let count = s.signature.params.len() - skip;
    let point = b.body.kind(s.arg(skip)) == Kind::Triple;
    let dims = if point { 2 + count as u8 } else { count as u8 };
    (dims, if s.signature.ret == Type::FLOAT { Kind::Float } else { Kind::Triple })
}
