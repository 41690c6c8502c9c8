//! The policy: every number that decides how much is spent on finding out, and how sure a decision must be.
//! All were chosen with `cargo bench -p oslrun --bench max_error`, whose tables show what a change is worth.
//! This module must not know how anything is computed.

/// When a probe fails where the lattice was trusted, pixels up to this distance along each axis become
/// pending again.
pub(super) const REACH: usize = 4;
/// Distance between the pixels of the coarsest lattice.
pub(super) const COARSE: usize = 4;
/// Share of the pixels whose error may exceed the bound.
pub const PROMISED: f64 = 1e-3;
/// The share that planning aims for, to leave a margin.
pub(super) const ALLOWED: f32 = 7e-4;
/// The aim when few pixels are left.
pub(super) const ALLOWED_OF_FEW: f32 = 0.02;
/// One in so many pixels gets a probe, to judge the lattices of every fourth, every second and every pixel,
/// and all of them once more before sampling starts. Probes cost about a tenth of the work.
pub(super) const PROBE: [usize; 4] = [168, 48, 16, 8];
/// The minimum and maximum number of probes.
pub(super) const PEEKS: (usize, usize) = (64, 16384);
/// The number of probes around which a finer lattice is tried; the share of them that it must settle; the
/// share that may exceed the bound.
pub(super) const TRIALS: usize = 48;
pub(super) const WORTH: [f32; 2] = [0.25, 0.6];
/// The next finer lattice has to prove itself only up to this estimate, as a multiple of the bound.
pub(super) const NEAR: f32 = 2.0;
/// Where a probe failed, the mean of its pixel may still be right. If at most one in so many probes failed,
/// so many samples show the mean. The second pair is for the lattice of all pixels alone: there, the centre
/// of a pixel is often right although no other place in the pixel has its value.
pub(super) const SECOND_LOOKS: [(usize, u32); 2] = [(50, 32), (6, 16)];
/// If a settled probe of the coarsest lattice has an error above this share of the bound, there are a third
/// more probes, because a few pixels that fail were probably missed. More probes would cost more than a
/// tenth.
pub(super) const NEAR_FAILURE: f32 = 0.8;
/// Share of the probes that may fail if a lattice is to do for all pixels.
pub(super) const FAILED: f32 = 0.005;
/// The largest estimates that are trusted without further evidence, as shares of the bound, because the
/// probes may have missed rare features. The first value is for lattices, the second for a pixel's centre,
/// which may be on either side of an edge.
pub(super) const TRUSTED: [f32; 2] = [1.0, 0.25];
/// Good probes above `TRUSTED` that raise the trusted estimate.
pub(super) const EVIDENCE: usize = 40;
/// A lattice that settles at most this share of the pixels, and fails at most probes, is not tried again.
pub(super) const USEFUL: f32 = 0.05;
/// Share of the pixels below which a finer lattice is not worth its cost.
pub(super) const ROUGH: f32 = 0.02;
/// Minimum number of probes to learn from.
pub(super) const FEW: usize = 16;
/// A probe or a pilot pixel whose error exceeds this share of the bound counts as a failure.
pub(super) const CLOSE: f32 = 0.9;
pub(super) const BOLD: f32 = 0.95;
/// The threshold used when adaptive sampling costs less than `THRIFT` of sampling every pixel equally.
pub(super) const CAREFUL: f32 = 0.8;
/// The factor on the permitted share with this threshold.
pub(super) const CARE: f32 = 0.5;
/// The threshold and the factor on the permitted share for limits from a pilot of fewer pixels than this.
pub(super) const MANY_PIXELS: f32 = 4096.0;
pub(super) const SMALL: [f32; 2] = [0.85, 0.5];
pub(super) const THRIFT: f32 = 0.75;
/// If a few pixels exceed the bound even with the maximum of samples, so many times as many may exceed it.
pub(super) const UNAVOIDABLE: f32 = 1.1;
/// If at most this share of the pilot exceeds the bound, the next sample count needs no trial.
pub(super) const NEARLY: f32 = 0.005;
/// A trusted estimate is at most this multiple of the smallest estimate at which a probe failed.
pub(super) const BELOW_FAILED: f32 = 0.9;
/// Size of the pilot: one in so many pixels of the image, one in so many pixels that need samples, and the
/// minimum.
pub(super) const PILOT: (usize, usize, usize) = (16, 4, 64);
/// The largest pilot: 16 of its pixels may exceed the bound. More pixels teach nothing.
pub(super) const LARGEST_PILOT: usize = 16_384;
/// Where that is less, one in `0` of the pixels, up to `1` pixels, because fewer show too little.
pub(super) const SMALL_PILOT: (usize, usize) = (10, 2048);
/// An image of fewer pixels is *small*. A thousandth of it is a few pixels, which a share of its pixels does
/// not show, and all of it costs little: its pilot has `SMALL_PILOT.1` pixels, or all that need samples, and
/// one in `SMALL_PROBE` of its pixels gets a probe, at least `SURE_PROBES` or all.
pub(super) const SMALL_IMAGE: usize = 16_384;
pub(super) const SMALL_PROBE: usize = 4;
/// What estimating a pixel's error after a round counts for: for any pixel, and for each plane.
/// **Units:** nanoseconds. If limits save less, all pixels get the same number of samples. It takes about
/// half as long again, but then fewer evaluations would be saved.
pub(super) const ESTIMATING: [f64; 2] = [14.0, 9.0];
/// If estimating a pixel's error takes as long as this many evaluations, two samples are not tried: a pixel
/// for which they are enough costs little more with four.
pub(super) const DEAR_ESTIMATE: f64 = 2.0;
/// The number of pixels that a thread samples together with limits, so that their sums stay in a cache.
pub(super) const TOGETHER: usize = 4096;
/// The number of pixels at which operations are counted, which predict the time of an evaluation. An image
/// must not depend on the clock, so that this is not measured.
pub(super) const COUNTED: usize = 64;
/// The same number of samples for all pixels is never taken if it is more than this multiple of the samples
/// with limits, because the predicted time of an evaluation may be far too small.
pub(super) const DEARER: f64 = 1.5;
/// Samples with the best limits relative to those of pixels that know when they are done.
pub(super) const LEARNED: f64 = 1.3;
/// A pixel that the later half of its samples moved so far that its error probably exceeds this share of the
/// bound gets as many samples again.
pub(super) const LAST_LOOK: f32 = 0.8;
/// Samples needed to hit any feature large enough to matter: a factor on the range of values in units of the
/// bound, the minimum and the maximum.
pub(super) const MIN_SAMPLES: (f32, f32, f32) = (3.0, 8.0, 256.0);
/// Limits on the rate at which squared errors fall, as powers of the sample count.
pub(super) const SLOWEST: f32 = 1.0;
pub(super) const FASTEST: f32 = 3.0;
/// Factor on the allowed failures when error sizes predict them, since counting failures is less precise.
pub(super) const SCALED: f32 = 1.2;
/// A convergence slower than this indicates edges.
pub(super) const EDGES: f32 = 1.5;
/// Convergence is measured at this quantile of the pixel changes, because the largest changes matter.
pub(super) const LARGE: f32 = 0.95;
/// The largest changes are those of one in so many pixels, and of at least so many pixels.
pub(super) const TAIL: usize = 100;
pub(super) const FEWEST_IN_TAIL: usize = 8;
/// The smallest share of the expected changes that is believed.
pub(super) const LEAST_TAIL: f32 = 0.7;
/// A pilot pixel with enough samples is dropped when its error is below this share of the bound.
pub(super) const DROPPED: f32 = 0.2;
/// A pixel has enough samples when the bound is at least this many standard errors.
pub(super) const SURE: f32 = 2.0;
/// The widest filter for which lattices are used. **Units:** pixels.
pub(super) const WIDEST: f32 = 4.0;
/// If more than this share of the pixels is pending, a lattice is computed as a whole.
pub(super) const WHOLE: f32 = 0.5;
/// If more than this share of the pixels is pending after the coarsest lattice, a finer one is tried for all
/// pixels.
pub(super) const UNIFORM: f32 = 0.1;
/// Of `TRIALS` probes, at most so many may fail for a lattice to be computed as a whole.
pub(super) const TRIED: usize = 1;
/// One in so many of the trials is made before the others, which are not made if more of them fail than this.
pub(super) const FIRST_TRIALS: (usize, usize) = (4, 4);
/// If more of them fail in the lattice of all pixels, its other probes are not compared with it.
pub(super) const HOPELESS: usize = 6;
/// One in so many pixels gets a probe if the lattice of every second pixel is computed as a whole.
pub(super) const PROBE_WHOLE: usize = 36;
/// Probes that show by themselves whether one in a thousand pixels is wrong.
pub(super) const SURE_PROBES: usize = 2048;
/// In images of fewer pixels that are not small, too few probes lie between the pixels of the coarsest
/// lattice to show features that are smaller than a pixel. There the lattice itself is searched for *spikes*.
pub(super) const SPIKES_BELOW: usize = 80_000;
/// A pixel of the lattice is a spike if it differs by more than the first multiple of the bound from the
/// mean of its neighbours in the lattice, and of the pixels beside it, and the neighbours differ from their
/// mean by at most the second multiple.
pub(super) const SPIKE: [f32; 2] = [2.0, 1.0];
/// The number of pixels that are examined so.
pub(super) const SPIKES: usize = 64;
