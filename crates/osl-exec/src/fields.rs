//! Noise fields over lanes of floats, in single and double precision.
//!
//! Gabor noise is computed in single precision in every arithmetic.

use bytemuck::Pod;
use osl_noise::gabor::{self, Options};
use osl_noise::hash::NAN_WORD;
use osl_noise::{BatchFloat, Float, Kind};
use osl_simd::{Isa, Kernel};

/// Maximum number of results in floats: a triple and its derivatives along two axes.
pub(crate) const MAX_OUTPUTS: usize = 9;
/// Maximum number of arguments in floats: four coordinates, their periods, and their derivatives along two
/// axes.
pub(crate) const MAX_INPUTS: usize = 16;

/// The evaluation of a field at some coordinates.
pub(crate) struct FieldCall<'a> {
    pub(crate) field: Field<'a>,
    /// Number of coordinates, 1 to 4. They are followed by the periods, if any, then by the derivatives of
    /// the coordinates.
    pub(crate) dims: usize,
    /// Whether derivatives of the coordinates are given.
    pub(crate) has_derivs: bool,
    /// Whether derivatives of the values are computed: three values are then one value and its derivatives.
    pub(crate) dual: bool,
}

/// A field with its parameters.
#[derive(Clone, Copy)]
pub(crate) enum Field<'a> {
    Lattice(Kind),
    /// The lanes to compute, and the options, one for each or one for all. Other lanes stay unchanged.
    Gabor(&'a [usize], &'a [Options]),
}

/// Calls `field` with the lanes as floats of the same size.
pub(crate) fn cast<W: Pod, F: Pod>(
    inputs: &[&[W]],
    outs: &mut [&mut [W]],
    field: impl FnOnce(&[&[F]], &mut [&mut [F]]),
) {
    let mut floats: [&[F]; MAX_INPUTS] = [&[]; MAX_INPUTS];
    let (count, found) = (inputs.len().min(MAX_INPUTS), outs.len().min(MAX_OUTPUTS));
    floats.iter_mut().zip(inputs).for_each(|(to, from)| *to = bytemuck::cast_slice(from));
    let mut results: [&mut [F]; MAX_OUTPUTS] = Default::default();
    results.iter_mut().zip(outs).for_each(|(to, from)| *to = bytemuck::cast_slice_mut(from));
    field(&floats[..count], &mut results[..found]);
}

/// A field in single precision.
pub(crate) fn single(isa: Isa, call: &FieldCall<'_>, inputs: &[&[f32]], outs: &mut [&mut [f32]]) {
    match call.field {
        Field::Lattice(kind) => lattice(isa, call, kind, inputs, outs),
        Field::Gabor(lanes, options) => gabor(isa, call, (lanes, options), inputs, outs),
    }
}

/// A field in double precision, except Gabor noise.
pub(crate) fn double(isa: Isa, call: &FieldCall<'_>, inputs: &[&[f64]], outs: &mut [&mut [f64]]) {
    match call.field {
        Field::Lattice(kind) => lattice(isa, call, kind, inputs, outs),
        Field::Gabor(lanes, options) => {
            let singles: Vec<Vec<f32>> =
                inputs.iter().map(|lanes| lanes.iter().map(|x| *x as f32).collect()).collect();
            let singles: Vec<&[f32]> = singles.iter().map(Vec::as_slice).collect();
            let mut results: Vec<Vec<f32>> = outs.iter().map(|lanes| vec![0.0; lanes.len()]).collect();
            let mut singles_out: Vec<&mut [f32]> = results.iter_mut().map(Vec::as_mut_slice).collect();
            gabor(isa, call, (lanes, options), &singles, &mut singles_out);
            for (to, from) in outs.iter_mut().zip(results) {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = f64::from(from));
            }
        }
    }
}

fn lattice<F: BatchFloat>(
    isa: Isa,
    call: &FieldCall<'_>,
    kind: Kind,
    inputs: &[&[F]],
    outs: &mut [&mut [F]],
) {
    let (dims, has_derivs) = (call.dims, call.has_derivs);
    // Coordinates, then periods if any, then the derivatives.
    let (plain, derivs) =
        inputs.split_at(inputs.len() - if has_derivs { (2 * dims).min(inputs.len()) } else { 0 });
    let numbers: Vec<Vec<F>>;
    let mut canonical: [&[F]; 8] = [&[]; 8];
    let plain = if kind == Kind::Hash && plain.iter().any(|lanes| lanes.iter().any(|x| x.is_nan())) {
        numbers = plain.iter().map(|lanes| with_one_nan(lanes)).collect();
        canonical.iter_mut().zip(&numbers).for_each(|(to, from)| *to = from);
        &canonical[..numbers.len().min(8)]
    } else {
        plain
    };
    let (coords, periods) = plain.split_at(dims.min(plain.len()));
    let mut duals: [&[F]; 12] = [&[]; 12];
    let moving = coords.iter().chain(derivs);
    duals.iter_mut().zip(moving).for_each(|(to, from)| *to = from);
    let duals = &duals[..(coords.len() + derivs.len()).min(12)];
    match outs {
        [x] if periods.is_empty() => osl_noise::eval(isa, kind, coords, x),
        [x] => osl_noise::eval_periodic(isa, kind, coords, periods, x),
        [v, dx, dy] if call.dual => osl_noise::eval_dual(isa, kind, duals, periods, [v, dx, dy]),
        [x, y, z] if periods.is_empty() => osl_noise::eval3(isa, kind, coords, [x, y, z]),
        [x, y, z] => osl_noise::eval3_periodic(isa, kind, coords, periods, [x, y, z]),
        [a, b, c, d, e, f, g, h, i] => {
            osl_noise::eval3_dual(isa, kind, duals, periods, [a, b, c, d, e, f, g, h, i]);
        }
        _ => {}
    }
    // The results of hashes are never NaN.
    if !matches!(kind, Kind::Cell | Kind::Hash) {
        outs.iter_mut().for_each(|lanes| isa.dispatch(OneNan(lanes)));
    }
}

/// Gabor noise, whose options may differ between lanes. It is computed lane by lane, only for the active
/// lanes.
fn gabor(
    isa: Isa,
    call: &FieldCall<'_>,
    (lanes, options): (&[usize], &[Options]),
    inputs: &[&[f32]],
    outs: &mut [&mut [f32]],
) {
    let all = outs.first().map_or(0, |out| out.len());
    if lanes.len() == all {
        return gabor_all(isa, call, options, inputs, outs);
    }
    let gather = |from: &&[f32]| lanes.iter().map(|lane| from.get(*lane).copied().unwrap_or(0.0)).collect();
    let gathered: Vec<Vec<f32>> = inputs.iter().map(gather).collect();
    let gathered: Vec<&[f32]> = gathered.iter().map(Vec::as_slice).collect();
    let mut results = vec![vec![0.0; lanes.len()]; outs.len()];
    let mut targets: Vec<&mut [f32]> = results.iter_mut().map(Vec::as_mut_slice).collect();
    gabor_all(isa, call, options, &gathered, &mut targets);
    for (out, result) in outs.iter_mut().zip(&results) {
        for (lane, value) in lanes.iter().zip(result) {
            if let Some(place) = out.get_mut(*lane) {
                *place = *value;
            }
        }
    }
}

fn gabor_all(
    isa: Isa,
    call: &FieldCall<'_>,
    options: &[Options],
    inputs: &[&[f32]],
    outs: &mut [&mut [f32]],
) {
    let (plain, partials) = inputs.split_at(inputs.len() - (2 * call.dims).min(inputs.len()));
    let (coords, periods) = plain.split_at(call.dims.min(plain.len()));
    let points = gabor::Points { coords, partials, periods };
    match outs {
        [x] => gabor::eval(isa, points, options, x),
        [v, dx, dy] if call.dual => gabor::eval_dual(isa, points, options, [v, dx, dy]),
        [x, y, z] => gabor::eval3(isa, points, options, [x, y, z]),
        [a, b, c, d, e, f, g, h, i] => {
            gabor::eval3_dual(isa, points, options, [a, b, c, d, e, f, g, h, i]);
        }
        _ => {}
    }
    outs.iter_mut().for_each(|lanes| isa.dispatch(OneNan(lanes)));
}

/// Coordinates of hash noise, with one canonical NaN: hash noise uses their bits, and the payload of a NaN
/// depends on the instruction set.
fn with_one_nan<F: Float>(lanes: &[F]) -> Vec<F> {
    let one = F::lit(f32::from_bits(NAN_WORD));
    lanes.iter().map(|x| if x.is_nan() { one } else { *x }).collect()
}

/// Replaces every NaN by one canonical NaN, because the payload for NaN coordinates depends on the
/// instruction set.
struct OneNan<'a, F>(&'a mut [F]);

impl<F: Float> Kernel for OneNan<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for x in self.0 {
            *x = if x.is_nan() { F::lit(f32::NAN) } else { *x };
        }
    }
}
