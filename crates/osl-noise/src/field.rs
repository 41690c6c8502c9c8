//! The fields by name, for one point.

#[cfg(target_arch = "x86_64")]
use crate::coherent;
use crate::float::Float;
use crate::number::{Dual, Number};
use crate::range::Range;
use crate::unroll::{array, each};
use crate::{cell, perlin, simplex};
use osl_simd::Isa;

/// A noise field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Constant within each unit cell, 0 to 1.
    Cell,
    /// A different value for each float, 0 to 1.
    Hash,
    /// Gradient noise, about −1 to 1, zero at whole coordinates.
    Perlin,
    /// Gradient noise, about 0 to 1.
    UPerlin,
    /// Simplex noise, about −1 to 1.
    Simplex,
    /// Simplex noise, about 0 to 1.
    USimplex,
}

impl Kind {
    /// All fields.
    pub const ALL: [Kind; 6] =
        [Kind::Cell, Kind::Hash, Kind::Perlin, Kind::UPerlin, Kind::Simplex, Kind::USimplex];
}

/// A field as a type, so that each loop over it is compiled separately.
pub(crate) trait Field: Copy {
    /// Whether all partials are 0, since the field only steps. Such a field needs no loops for partials.
    const IS_STEPPED: bool = false;
    /// Whether the field has a periodic form. Without one, periods are ignored.
    const HAS_PERIODS: bool = true;
    /// Computes one value at each point as long as the points share few cells; returns the number of points
    /// done.
    fn shared<F: Float, const D: usize>(self, isa: Isa, coords: [&[F]; D], out: &mut [F]) -> usize {
        let _ = (isa, coords, out);
        0
    }
    /// The same with partials: values, then partials in the first direction, then in the second.
    fn shared_dual<F: Float, const D: usize>(
        self,
        isa: Isa,
        coords: [[&[F]; D]; 3],
        out: [&mut [F]; 3],
    ) -> usize {
        let _ = (isa, coords, out);
        0
    }
    /// One value.
    fn one<F: Float, const D: usize>(self, p: [F; D]) -> F;
    /// Three values.
    fn three<F: Float, const D: usize>(self, p: [F; D]) -> [F; 3];
    /// One value of the field repeated with the periods.
    fn one_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> F;
    /// Three values, the field repeated.
    fn three_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> [F; 3];
    /// One value with its partials along two directions.
    fn one_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], periods: Option<[F; D]>) -> Dual<F>;
    /// Three values with their partials.
    fn three_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], periods: Option<[F; D]>) -> [Dual<F>; 3];
}

#[inline(always)]
fn wrapped<F: Float, const D: usize>(p: [F; D], periods: [F; D]) -> [F; D] {
    array(
        #[inline(always)]
        |a| cell::wrap(p[a], periods[a]),
    )
}

macro_rules! stepped {
    ($name:ident, $words:path) => {
        #[derive(Clone, Copy)]
        pub(crate) struct $name;

        impl Field for $name {
            const IS_STEPPED: bool = true;
            #[inline(always)]
            fn one<F: Float, const D: usize>(self, p: [F; D]) -> F {
                cell::one($words(p))
            }
            #[inline(always)]
            fn three<F: Float, const D: usize>(self, p: [F; D]) -> [F; 3] {
                cell::three($words(p))
            }
            #[inline(always)]
            fn one_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> F {
                self.one(wrapped(p, periods))
            }
            #[inline(always)]
            fn three_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> [F; 3] {
                self.three(wrapped(p, periods))
            }
            #[inline(always)]
            fn one_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], periods: Option<[F; D]>) -> Dual<F> {
                let p: [F; D] = array(
                    #[inline(always)]
                    |a| p[a].v,
                );
                Dual::constant(periods.map_or_else(|| self.one(p), |periods| self.one_periodic(p, periods)))
            }
            #[inline(always)]
            fn three_dual<F: Float, const D: usize>(
                self,
                p: [Dual<F>; D],
                periods: Option<[F; D]>,
            ) -> [Dual<F>; 3] {
                let p: [F; D] = array(
                    #[inline(always)]
                    |a| p[a].v,
                );
                periods
                    .map_or_else(|| self.three(p), |periods| self.three_periodic(p, periods))
                    .map(Dual::constant)
            }
        }
    };
}

stepped!(Cell, cell::cells);
stepped!(Hash, cell::bits);

#[derive(Clone, Copy)]
pub(crate) struct Perlin(pub(crate) Range);

impl Field for Perlin {
    #[cfg(target_arch = "x86_64")]
    fn shared<F: Float, const D: usize>(self, isa: Isa, coords: [&[F]; D], out: &mut [F]) -> usize {
        let Some((coords, out)) = F::singles(coords, out) else { return 0 };
        match coords[..] {
            [x, y] => coherent::fill::<coherent::Perlin, 2>(isa, self.0, [x, y], out),
            [x, y, z] => coherent::fill::<coherent::Perlin, 3>(isa, self.0, [x, y, z], out),
            _ => 0,
        }
    }
    #[cfg(target_arch = "x86_64")]
    fn shared_dual<F: Float, const D: usize>(
        self,
        isa: Isa,
        coords: [[&[F]; D]; 3],
        out: [&mut [F]; 3],
    ) -> usize {
        let [v, dx, dy] = out;
        let [first, second, third] = coords;
        let parts = (F::singles(first, v), F::singles(second, dx), F::singles(third, dy));
        let (Some((p, v)), Some((px, dx)), Some((py, dy))) = parts else { return 0 };
        let three = |c: [_; D]| <[_; 3]>::try_from(&c[..]).ok();
        let (Some(p), Some(px), Some(py)) = (three(p), three(px), three(py)) else { return 0 };
        coherent::fill_dual::<coherent::Perlin, 3>(isa, self.0, [p, px, py], [v, dx, dy])
    }
    #[inline(always)]
    fn one<F: Float, const D: usize>(self, p: [F; D]) -> F {
        self.0.of(perlin::one(p, None))
    }
    #[inline(always)]
    fn three<F: Float, const D: usize>(self, p: [F; D]) -> [F; 3] {
        self.0.of3(perlin::three(p, None))
    }
    #[inline(always)]
    fn one_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> F {
        self.0.of(perlin::one(p, Some(periods)))
    }
    #[inline(always)]
    fn three_periodic<F: Float, const D: usize>(self, p: [F; D], periods: [F; D]) -> [F; 3] {
        self.0.of3(perlin::three(p, Some(periods)))
    }
    #[inline(always)]
    fn one_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], periods: Option<[F; D]>) -> Dual<F> {
        self.0.of(perlin::one(p, periods))
    }
    #[inline(always)]
    fn three_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], periods: Option<[F; D]>) -> [Dual<F>; 3] {
        self.0.of3(perlin::three(p, periods))
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Simplex(pub(crate) Range);

impl Simplex {
    #[inline(always)]
    fn value<F: Float, const D: usize>(self, p: [F; D], seed: u32) -> F {
        self.0.of(simplex::field(p, seed).0)
    }

    #[inline(always)]
    fn dual<F: Float, const D: usize>(self, p: [Dual<F>; D], seed: u32) -> Dual<F> {
        let (v, gradient) = simplex::field::<F, D>(
            array(
                #[inline(always)]
                |a| p[a].v,
            ),
            seed,
        );
        let gradient: [F; D] = array(
            #[inline(always)]
            |a| gradient[a] * F::lit(self.0.factor),
        );
        let along = |part: fn(Dual<F>) -> F| {
            let mut total = gradient[0] * part(p[0]);
            each(
                D - 1,
                #[inline(always)]
                |a| total = total + gradient[a + 1] * part(p[a + 1]),
            );
            total
        };
        Dual { v: self.0.of(v), dx: along(|x| x.dx), dy: along(|x| x.dy) }
    }
}

impl Field for Simplex {
    const HAS_PERIODS: bool = false;
    #[cfg(target_arch = "x86_64")]
    fn shared<F: Float, const D: usize>(self, isa: Isa, coords: [&[F]; D], out: &mut [F]) -> usize {
        let Some((coords, out)) = F::singles(coords, out) else { return 0 };
        match coords[..] {
            [x, y, z] => coherent::fill::<coherent::Simplex, 3>(isa, self.0, [x, y, z], out),
            _ => 0,
        }
    }
    #[inline(always)]
    fn one<F: Float, const D: usize>(self, p: [F; D]) -> F {
        self.value(p, 0)
    }
    #[inline(always)]
    fn three<F: Float, const D: usize>(self, p: [F; D]) -> [F; 3] {
        [self.value(p, 0), self.value(p, 1), self.value(p, 2)]
    }
    #[inline(always)]
    fn one_periodic<F: Float, const D: usize>(self, p: [F; D], _: [F; D]) -> F {
        self.one(p)
    }
    #[inline(always)]
    fn three_periodic<F: Float, const D: usize>(self, p: [F; D], _: [F; D]) -> [F; 3] {
        self.three(p)
    }
    #[inline(always)]
    fn one_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], _: Option<[F; D]>) -> Dual<F> {
        self.dual(p, 0)
    }
    #[inline(always)]
    fn three_dual<F: Float, const D: usize>(self, p: [Dual<F>; D], _: Option<[F; D]>) -> [Dual<F>; 3] {
        [self.dual(p, 0), self.dual(p, 1), self.dual(p, 2)]
    }
}
