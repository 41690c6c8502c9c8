//! The numbers that decide how much is spent on finding out, and how sure a decision must be. They were
//! chosen with `cargo bench -p oslrun --bench max_error`, which shows what a change is worth.

/// Share of the pixels whose error may exceed the bound.
pub const PROMISED: f64 = 1e-3;
/// The share that planning aims for, to leave a margin.
pub(super) const ALLOWED: f32 = 7e-4;
/// The aim when few pixels are left.
pub(super) const ALLOWED_OF_FEW: f32 = 0.02;
/// A probe or a pilot pixel whose error exceeds this share of the bound counts as a failure.
pub(super) const CLOSE: f32 = 0.9;

/// Distance between the pixels of the coarsest lattice. When a probe fails where a lattice was trusted,
/// pixels up to this distance along each axis become pending again.
pub(super) const COARSE: usize = 4;
/// The widest filter for which lattices are used. **Units:** pixels.
pub(super) const WIDEST: f32 = 4.0;
/// One in so many pixels gets a probe, to judge the lattices of every fourth, every second and every pixel,
/// and all of them once more before sampling starts. Probes cost about a tenth of the work. A small image has
/// all of its probes at once.
pub(super) const PROBE: [usize; 4] = [96, 48, 16, 8];
/// An image of fewer pixels is *small*: a thousandth of it is a few pixels, which a share of its pixels does
/// not show. No image has more probes, and no pilot more pixels.
pub(super) const SMALL_IMAGE: usize = 16_384;
/// Random pixels that show by themselves whether one in a thousand is wrong: the probes of the lattice of all
/// pixels, and the smallest pilot.
pub(super) const SURE_PROBES: usize = 2048;
/// The number of probes around which a finer lattice is tried.
pub(super) const TRIALS: usize = 48;
/// Where a probe failed, the mean of its pixel may still be right. If at most one in so many probes failed,
/// so many samples show the mean. The second pair is for the lattice of all pixels alone: there, the centre
/// of a pixel is often right although no other place in the pixel has its value.
pub(super) const SECOND_LOOKS: [(usize, u32); 2] = [(50, 32), (6, 16)];
/// The largest estimates that are trusted without further evidence, as shares of the bound, because the
/// probes may have missed rare features. The first value is for lattices, the second for a pixel's centre,
/// which may be on either side of an edge.
pub(super) const TRUSTED: [f32; 2] = [1.0, 0.25];
/// Good probes above `TRUSTED` that raise the trusted estimate.
pub(super) const EVIDENCE: usize = 40;
/// Minimum number of probes to learn from.
pub(super) const FEW: usize = 16;
/// Share of the pixels below which a finer lattice is not worth a trial.
pub(super) const ROUGH: f32 = 0.02;

/// One in so many pixels of the image belongs to the pilot.
pub(super) const PILOT: usize = 16;
/// If at most this share of the probes or of the pilot fails, a lattice or a number of samples is nearly good
/// enough.
pub(super) const NEARLY: f32 = 0.005;
/// Samples needed to hit any feature large enough to matter: a factor on the range of values in units of the
/// bound, and the limits.
pub(super) const MIN_SAMPLES: (f32, [f32; 2]) = (3.0, [8.0, 256.0]);
/// Squared errors that fall no faster than this power of the number of samples indicate edges.
pub(super) const EDGES: f32 = 1.5;
/// A pixel that the later half of its samples moved so far that its error probably exceeds this share of the
/// bound gets as many samples again.
pub(super) const LAST_LOOK: f32 = 0.8;
