//! The fields by name, for one point.

#[cfg(target_arch = "x86_64")]
use crate::coherent;
use crate::number::{Dual, Number};
use crate::simd::Isa;
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
    /// Computes one value at each point as far as points come in few cells; tells how many it has done.
    fn shared<const D: usize>(self, isa: Isa, coords: [&[f32]; D], out: &mut [f32]) -> usize {
        let _ = (isa, coords, out);
        0
    }
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

/// The range of a field as numbers, so that both ranges are one machine code.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    /// Added first.
    pub(crate) shift: f32,
    pub(crate) factor: f32,
}

impl Range {
    /// −1 to 1. Adding −0 keeps every number, 0 included.
    pub(crate) const SIGNED: Range = Range { shift: -0.0, factor: 1.0 };
    /// 0 to 1.
    pub(crate) const UNSIGNED: Range = Range { shift: 1.0, factor: 0.5 };

    /// A number from −1 to 1 in the range, partials included.
    #[inline(always)]
    fn of<N: Number>(self, x: N) -> N {
        x.with_value(x.value() + self.shift).scale(self.factor)
    }

    #[inline(always)]
    fn of3<N: Number>(self, [x, y, z]: [N; 3]) -> [N; 3] {
        [self.of(x), self.of(y), self.of(z)]
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Perlin(pub(crate) Range);

impl Field for Perlin {
    #[cfg(target_arch = "x86_64")]
    fn shared<const D: usize>(self, isa: Isa, coords: [&[f32]; D], out: &mut [f32]) -> usize {
        match coords[..] {
            [x, y] => coherent::fill::<coherent::Perlin, 2>(isa, self.0, [x, y], out),
            [x, y, z] => coherent::fill::<coherent::Perlin, 3>(isa, self.0, [x, y, z], out),
            _ => 0,
        }
    }
    #[inline(always)]
    fn one<const D: usize>(self, p: [f32; D]) -> f32 {
        self.0.of(perlin::one::<f32, D, false>(p, None))
    }
    #[inline(always)]
    fn three<const D: usize>(self, p: [f32; D]) -> [f32; 3] {
        self.0.of3(perlin::three::<f32, D, false>(p, None))
    }
    #[inline(always)]
    fn one_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> f32 {
        self.0.of(perlin::one::<f32, D, false>(p, Some(periods)))
    }
    #[inline(always)]
    fn three_periodic<const D: usize>(self, p: [f32; D], periods: [f32; D]) -> [f32; 3] {
        self.0.of3(perlin::three::<f32, D, false>(p, Some(periods)))
    }
    #[inline(always)]
    fn one_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> Dual {
        self.0.of(perlin::one::<Dual, D, true>(p, periods))
    }
    #[inline(always)]
    fn three_dual<const D: usize>(self, p: [Dual; D], periods: Option<[f32; D]>) -> [Dual; 3] {
        self.0.of3(perlin::three::<Dual, D, true>(p, periods))
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Simplex(pub(crate) Range);

impl Simplex {
    #[inline(always)]
    fn value<const D: usize>(self, p: [f32; D], seed: u32) -> f32 {
        self.0.of(simplex::field(p, seed).0)
    }

    #[inline(always)]
    fn dual<const D: usize>(self, p: [Dual; D], seed: u32) -> Dual {
        let (v, gradient) = simplex::field::<D>(
            array(
                #[inline(always)]
                |a| p[a].v,
            ),
            seed,
        );
        let gradient: [f32; D] = array(
            #[inline(always)]
            |a| gradient[a] * self.0.factor,
        );
        let along = |part: fn(Dual) -> f32| {
            let mut total = gradient[0] * part(p[0]);
            each(
                D - 1,
                #[inline(always)]
                |a| total += gradient[a + 1] * part(p[a + 1]),
            );
            total
        };
        Dual { v: self.0.of(v), dx: along(|x| x.dx), dy: along(|x| x.dy) }
    }
}

impl Field for Simplex {
    #[cfg(target_arch = "x86_64")]
    fn shared<const D: usize>(self, isa: Isa, coords: [&[f32]; D], out: &mut [f32]) -> usize {
        match coords[..] {
            [x, y, z] => coherent::fill::<coherent::Simplex, 3>(isa, self.0, [x, y, z], out),
            _ => 0,
        }
    }
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
