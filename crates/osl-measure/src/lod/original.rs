//! Errors of the unchanged shader by the shape of a pixel and the set of points; what replaces the shader
//! must match them.

use super::errors::{Bounds, Fault, Off};
use super::ground::{By, Sides};
use super::judge::{Judge, Set, Truth, Variant};
use osl_exec::RunError;

/// What is known of pixels of one shape in one of the sets.
pub(super) struct Known {
    pub(super) truth: Truth,
    /// The errors of the original with the number of samples that a level must match.
    pub(super) original: Off,
}

/// Pixels from one size on and below another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    pub(super) by: By,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Sizes {
    /// All pixels.
    pub(super) const ALL: Sizes = Sizes { by: By::Side, from: 0.0, to: f64::INFINITY };

    fn has(self, known: &Known) -> bool {
        let size = self.by.of(known.truth.sides);
        size >= self.from && size < self.to
    }
}

/// The errors of something else in all sets with some sizes, or the first test that it fails.
pub(super) type Verdict = Result<Vec<Off>, Fault>;

/// What is known of the original: for square pixels at the points that were held out, at those on which
/// levels are made, and in the given image; for elongated ones at points that were held out.
pub(super) struct Original {
    list: Vec<Known>,
    pub(super) bounds: Bounds,
}

impl Original {
    /// Measures the original.
    pub(super) fn of(
        (judge, original): (&Judge<'_>, &Variant),
        shapes: &[Sides],
        (samples, bounds): (u32, Bounds),
    ) -> Result<Original, RunError> {
        let mut list = Vec::new();
        for sides in shapes {
            let is_square = sides[0] == sides[1];
            let sets: &[Set] =
                if is_square { &[Set::HeldOut, Set::Fitted, Set::Home] } else { &[Set::HeldOut] };
            for set in sets {
                let truth = judge.truth(original, *sides, *set)?;
                let original = judge.off(original, &truth, samples)?;
                list.push(Known { truth, original });
            }
        }
        Ok(Original { list, bounds })
    }

    /// What is known of pixels of these sizes.
    pub(super) fn within(&self, sizes: Sizes) -> impl Iterator<Item = &Known> {
        self.list.iter().filter(move |known| sizes.has(known))
    }

    /// The same in one of the sets.
    pub(super) fn of_set(&self, set: Set, sizes: Sizes) -> impl Iterator<Item = &Known> {
        self.within(sizes).filter(move |known| known.truth.set == set)
    }

    /// Whether something with these errors may replace the original at some sizes. `is_constant` is something
    /// that never runs the original: its error has a bound.
    pub(super) fn verdict(
        &self,
        errors: &mut dyn FnMut(&Known) -> Result<Off, RunError>,
        (sizes, is_constant): (Sizes, bool),
    ) -> Result<Verdict, RunError> {
        // Far away, an output may look unchanged because no pixel's centre lies on an object.
        let near = match self.of_set(Set::Home, Sizes::ALL).next().filter(|_| is_constant) {
            Some(known) => Some(errors(known)?.changed(&known.original)),
            None => None,
        };
        let bounds = if is_constant { self.bounds } else { self.bounds.without_error() };
        let mut offs: Vec<Off> = Vec::new();
        let mut held = None;
        for known in self.within(sizes) {
            let (off, sides) = (errors(known)?, known.truth.sides);
            let fault = match (known.truth.set, held) {
                (Set::Home, Some((at, original))) => {
                    let changed = near.clone().unwrap_or_else(|| off.changed(&known.original));
                    let elsewhere = [offs.get(at).unwrap_or(&off), original];
                    off.fault_at_home(&known.original, elsewhere, (bounds.tolerance, sides, &changed))
                }
                _ => off.fault(&known.original, bounds, sides),
            };
            if let Some(fault) = fault {
                return Ok(Err(fault));
            }
            if known.truth.set == Set::HeldOut {
                held = Some((offs.len(), &known.original));
            }
            offs.push(off);
        }
        Ok(Ok(offs))
    }
}
