//! The field at a point: the kernels of all impulses near it, summed.

use super::cells::{CAPACITY, Cells, Impulses, Place, WIDTH};
use super::filter::Filter;
use super::kernel::{Contribution, contribution};
use super::params::Params;
use super::waves::Wave;
use crate::hash::floor;
use crate::math::NEAR;
use crate::number::Number;
use crate::unroll::array;

/// Impulses processed in lockstep.
const GROUP: usize = 16;

/// Where and with which parameters a field is evaluated.
pub(super) struct Site<'a, N> {
    pub(super) params: &'a Params,
    pub(super) p: [N; 3],
    pub(super) periods: Option<[f32; 3]>,
    pub(super) filter: Option<Filter>,
}

impl<N: Number<Float = f32>> Site<'_, N> {
    /// The field with a seed there. The contents of `cells` do not matter.
    #[inline(always)]
    pub(super) fn field(&self, cells: &mut Cells, seed: u32) -> N {
        let params = self.params;
        let p: [N; 3] = array(
            #[inline(always)]
            |a| self.p[a].scale(params.rinv),
        );
        let corner = [floor(p[0].value()), floor(p[1].value()), floor(p[2].value())];
        let way = [p[0].value() - corner[0], p[1].value() - corner[1], p[2].value() - corner[2]];
        // The offsets from all impulses have the same partials.
        let slope: [N; 3] = array(
            #[inline(always)]
            |a| p[a].scale(params.radius),
        );
        cells.visit(&Place { corner, periods: self.periods, seed, empty: params.empty });
        let mut totals = [N::constant(0.0); WIDTH];
        cells.near(
            params,
            way,
            #[inline(always)]
            |impulses| self.add(impulses, slope, &mut totals),
        );
        let mut sum = N::constant(0.0);
        for total in totals {
            sum = sum.add(total);
        }
        sum.scale(params.scales[0]).scale(params.scales[1])
    }

    /// Adds kernels to the totals of their cells.
    #[inline(always)]
    fn add(&self, impulses: &Impulses, slope: [N; 3], totals: &mut [N; WIDTH]) {
        let len = impulses.len.min(CAPACITY);
        for start in (0..len).step_by(GROUP) {
            let group = Group::new(impulses, start, self.params, slope);
            let values = match &self.filter {
                None => group.values(None, self.params.a),
                Some(filter) => group.values(Some(filter), self.params.a),
            };
            for (cell, value) in impulses.cells[start..len].iter().zip(values) {
                let total = &mut totals[usize::from(*cell) % WIDTH];
                *total = total.add(value);
            }
        }
    }
}

/// Some impulses, processed in lockstep.
struct Group<N> {
    r: [[f32; GROUP]; 3],
    slope: [N; 3],
    omega: [[f32; GROUP]; 3],
    phase: [f32; GROUP],
}

impl<N: Number<Float = f32>> Group<N> {
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]
    fn new(impulses: &Impulses, start: usize, params: &Params, slope: [N; 3]) -> Group<N> {
        let mut group = Group { r: [[0.0; GROUP]; 3], slope, omega: [[0.0; GROUP]; 3], phase: [0.0; GROUP] };
        for (to, from) in group.r.iter_mut().zip(&impulses.r) {
            to.copy_from_slice(&from[start..start + GROUP]);
        }
        let seeds = &impulses.seeds[start..start + GROUP];
        for i in 0..GROUP {
            let wave = params.waves.wave(seeds[i]);
            group.phase[i] = wave.phase;
            (group.omega[0][i], group.omega[1][i], group.omega[2][i]) =
                (wave.omega[0], wave.omega[1], wave.omega[2]);
        }
        group
    }

    #[inline(always)]
    fn one<const FAR: bool>(&self, i: usize, filter: Option<&Filter>, a: f32) -> Contribution<N> {
        let r = array(
            #[inline(always)]
            |axis| self.slope[axis].with_value(self.r[axis][i]),
        );
        let wave =
            Wave { omega: [self.omega[0][i], self.omega[1][i], self.omega[2][i]], phase: self.phase[i] };
        contribution::<N, FAR>(filter, a, r, wave)
    }

    #[inline(always)]
    fn values(&self, filter: Option<&Filter>, a: f32) -> [N; GROUP] {
        let mut values = [N::constant(0.0); GROUP];
        let mut plain = true;
        for (i, value) in values.iter_mut().enumerate() {
            let one = self.one::<false>(i, filter, a);
            *value = one.value;
            plain &= (one.angle.abs() <= NEAR) & one.value.value().is_finite();
        }
        if !plain {
            self.with_care(filter, a, &mut values);
        }
        values
    }

    /// Handles what the lockstep loop does not: waves of extreme frequency, and the plain kernel in place of
    /// a filtered one that is not finite.
    #[cold]
    #[inline(never)]
    fn with_care(&self, filter: Option<&Filter>, a: f32, values: &mut [N; GROUP]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value = self.one::<true>(i, filter, a).value;
            if filter.is_some() && !value.value().is_finite() {
                *value = self.one::<true>(i, None, a).value;
            }
        }
    }
}
