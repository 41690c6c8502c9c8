//! The field at a point: the kernels of all impulses near it, summed.

use super::cells::{CAPACITY, Cells, Impulses, WIDTH};
use super::filter::Filter;
use super::kernel::{careful, contribution, seen};
use super::params::Waves;
use super::site::Site;
use super::waves::Drawn;
use super::{LANES, Lanes};
use crate::math::NEAR;
use crate::number::{Dual, Number};
use crate::unroll::array;

impl Site {
    /// The field with a seed there. The contents of `cells` do not matter.
    #[inline(always)]
    pub(super) fn field<N: Number<Float = f32>>(&self, cells: &mut Cells, seed: u32) -> N {
        let params = &self.params;
        cells.visit(&self.place(seed));
        let [dx, dy] = self.derivs;
        // The offsets from all impulses have the same partials.
        let derivs: [N; 3] = array(
            #[inline(always)]
            |a| N::from_dual(Dual { v: 0.0, dx: dx[a], dy: dy[a] }),
        );
        let mut totals = [N::constant(0.0); WIDTH];
        cells.near(
            params,
            self.way,
            #[inline(always)]
            |impulses| self.add(impulses, derivs, &mut totals),
        );
        let mut sum = N::constant(0.0);
        for total in totals {
            sum = sum.add(total);
        }
        sum.scale(params.scales[0]).scale(params.scales[1])
    }

    /// Adds kernels to the totals of their cells.
    #[inline(always)]
    fn add<N: Number<Float = f32>>(&self, impulses: &Impulses, derivs: [N; 3], totals: &mut [N; WIDTH]) {
        let len = impulses.len.min(CAPACITY);
        for start in (0..len).step_by(LANES) {
            let group = Group::new(impulses, start, self.params.waves, derivs);
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
    waves: Waves,
    r: [Lanes; 3],
    derivs: [N; 3],
    drawn: Drawn,
}

impl<N: Number<Float = f32>> Group<N> {
    #[inline(always)]
    fn new(impulses: &Impulses, start: usize, waves: Waves, derivs: [N; 3]) -> Group<N> {
        let (mut r, mut seeds) = ([[0.0; LANES]; 3], [1; LANES]);
        for (to, from) in r.iter_mut().zip(&impulses.r) {
            to.copy_from_slice(&from[start..start + LANES]);
        }
        seeds.copy_from_slice(&impulses.seeds[start..start + LANES]);
        Group { waves, r, derivs, drawn: waves.draw(&seeds) }
    }

    #[inline(always)]
    fn offset(&self, i: usize) -> [N; 3] {
        array(
            #[inline(always)]
            |axis| self.derivs[axis].with_value(self.r[axis][i]),
        )
    }

    #[inline(always)]
    fn omega(&self, i: usize) -> [f32; 3] {
        self.waves.omega(self.drawn.direction(i))
    }

    #[inline(always)]
    fn values(&self, filter: Option<&Filter>, a: f32) -> [N; LANES] {
        let mut values = [N::constant(0.0); LANES];
        let mut plain = true;
        for (i, value) in values.iter_mut().enumerate() {
            let seen = seen(filter, self.omega(i));
            let one = contribution::<N, false>(filter, a, self.offset(i), seen, self.drawn.phase[i]);
            *value = one.value;
            plain &= (one.angle.abs() <= NEAR) & one.value.value().is_finite();
        }
        if !plain {
            for (i, value) in values.iter_mut().enumerate() {
                *value = careful(filter, a, self.offset(i), self.omega(i), self.drawn.phase[i]);
            }
        }
        values
    }
}
