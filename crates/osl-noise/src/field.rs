//! The fields by name, for one point.

use crate::number::{Dual, Number};
use crate::unroll::{array, each};
use crate::{cell, perlin, simplex};

/// A noise field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Constant within each unit cell, 0 to 1.
    Cell,
    /// A different value at each float, 0 to 1.
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

/// A field as a type, so that a loop over it is compiled for it alone.
pub(crate) trait Field: Copy {
    /// One value.
    fn one<const D: usize>(self, p: [f32; D]) -> f32;
    /// Three values.
    fn three<const D: usize>(self, p: [f32; D]) -> [f32; 3];
    /// One value, the field repeated with the periods. Simplex noise has no periodic form and ignores them.
    fn one_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> f32;
    /// Three values, the field repeated.
    fn three_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> [f32; 3];
    /// One value with its partials along two directions.
    fn one_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> Dual;
    /// Three values with their partials.
    fn three_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> [Dual; 3];
}

#[inline(always)]
fn wrapped<const D: usize>(p: [f32; D], periods: [f32; D]) -> [f32; D] {
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
            #[inline(always)]
            fn one<const D: usize>(self, p: [f32; D]) -> f32 {
                cell::one($words(p))
            }
            #[inline(always)]
            fn three<const D: usize>(self, p: [f32; D]) -> [f32; 3] {
                cell::three($words(p))
            }
            #[inline(always)]
            fn one_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> f32 {
                self.one(wrapped(p, periods))
            }
            #[inline(always)]
            fn three_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> [f32; 3] {
                self.three(wrapped(p, periods))
            }
            #[inline(always)]
            fn one_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> Dual {
                let p: [f32; D] = array(
                    #[inline(always)]
                    |a| p[a].v,
                );
                Dual::constant(periods.map_or_else(|| self.one(p), |periods| self.one_periodic(p, periods)))
            }
            #[inline(always)]
            fn three_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> [Dual; 3] {
                let p: [f32; D] = array(
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

/// From −1..1 to 0..1, partials included.
#[inline(always)]
fn raise<N: Number>(x: N) -> N {
    x.with_value(x.value() + 1.0).scale(0.5)
}

#[derive(Clone, Copy)]
pub(crate) struct Perlin<const UNSIGNED: bool>;

impl<const UNSIGNED: bool> Perlin<UNSIGNED> {
    #[inline(always)]
    fn finish<N: Number>(self, x: N) -> N {
        if UNSIGNED { raise(x) } else { x }
    }

    #[inline(always)]
    fn finish3<N: Number>(self, [x, y, z]: [N; 3]) -> [N; 3] {
        [self.finish(x), self.finish(y), self.finish(z)]
    }
}

impl<const UNSIGNED: bool> Field for Perlin<UNSIGNED> {
    #[inline(always)]
    fn one<const D: usize>(self, p: [f32; D]) -> f32 {
        self.finish(perlin::one::<f32, D, false>(p, None))
    }
    #[inline(always)]
    fn three<const D: usize>(self, p: [f32; D]) -> [f32; 3] {
        self.finish3(perlin::three::<f32, D, false>(p, None))
    }
    #[inline(always)]
    fn one_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> f32 {
        self.finish(perlin::one::<f32, D, false>(p, Some(periods)))
    }
    #[inline(always)]
    fn three_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> [f32; 3] {
        self.finish3(perlin::three::<f32, D, false>(p, Some(periods)))
    }
    #[inline(always)]
    fn one_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> Dual {
        self.finish(perlin::one::<Dual, D, true>(p, periods))
    }
    #[inline(always)]
    fn three_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> [Dual; 3] {
        self.finish3(perlin::three::<Dual, D, true>(p, periods))
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Simplex<const UNSIGNED: bool>;

impl<const UNSIGNED: bool> Simplex<UNSIGNED> {
    #[inline(always)]
    fn value<const D: usize>(self, p: [f32; D], seed: u32) -> f32 {
        let v = simplex::field(p, seed).0;
        if UNSIGNED { 0.5 * (v + 1.0) } else { v }
    }

    #[inline(always)]
    fn dual<const D: usize>(self, p: [Dual; D], seed: u32) -> Dual {
        let (v, mut gradient) = simplex::field::<D>(
            array(
                #[inline(always)]
                |a| p[a].v,
            ),
            seed,
        );
        if UNSIGNED {
            gradient = array(
                #[inline(always)]
                |a| gradient[a] * 0.5,
            );
        }
        let along = |part: fn(Dual) -> f32| {
            let mut total = gradient[0] * part(p[0]);
            each(
                D - 1,
                #[inline(always)]
                |a| total += gradient[a + 1] * part(p[a + 1]),
            );
            total
        };
        Dual { v: if UNSIGNED { 0.5 * (v + 1.0) } else { v }, dx: along(|x| x.dx), dy: along(|x| x.dy) }
    }
}

impl<const UNSIGNED: bool> Field for Simplex<UNSIGNED> {
    #[inline(always)]
    fn one<const D: usize>(self, p: [f32; D]) -> f32 {
        self.value(p, 0)
    }
    #[inline(always)]
    fn three<const D: usize>(self, p: [f32; D]) -> [f32; 3] {
        [self.value(p, 0), self.value(p, 1), self.value(p, 2)]
    }
    #[inline(always)]
    fn one_periodic<const D: usize>(self, p: [f32; D], _: [f32; D]) -> f32 {
        self.one(p)
    }
    #[inline(always)]
    fn three_periodic<const D: usize>(self, p: [f32; D], _: [f32; D]) -> [f32; 3] {
        self.three(p)
    }
    #[inline(always)]
    fn one_dual<const D: usize>(self, p: [Dual; D], _: Option<[f32; D]>) -> Dual {
        self.dual(p, 0)
    }
    #[inline(always)]
    fn three_dual<const D: usize>(self, p: [Dual; D], _: Option<[f32; D]>) -> [Dual; 3] {
        [self.dual(p, 0), self.dual(p, 1), self.dual(p, 2)]
    }
}
