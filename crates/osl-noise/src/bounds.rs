//! The range of each field and its steepest slope, for proofs.
//!
//! The bounds hold for every choice of gradients at the corners of a cell, so they do not depend on the hash.
//! The tests prove them for the formulas of the fields in double precision; the last bits of single precision
//! fit into the room that the numbers leave.

use crate::field::Kind;

/// Values of signed Perlin noise, by dimension. In one dimension, the exact bound is 1.
const PERLIN: [f32; 5] = [0.0, 1.000_01, 1.001, 1.03, 1.33];
/// Its slopes along an axis.
const PERLIN_SLOPE: [f32; 5] = [0.0, 2.8, 3.3, 4.1, 5.4];
/// Values of signed simplex noise.
const SIMPLEX: [f32; 5] = [0.0, 0.93, 0.94, 0.93, 0.93];
/// Its slopes along an axis.
const SIMPLEX_SLOPE: [f32; 5] = [0.0, 3.3, 6.4, 6.8, 6.0];

/// The smallest and the largest value of a field with this number of dimensions, for coordinates that fit an
/// int; `None` for other numbers of dimensions.
pub fn largest(field: Kind, dims: usize) -> Option<(f32, f32)> {
    if !(1..=4).contains(&dims) {
        return None;
    }
    let signed = |most: f32| (-most, most);
    let unsigned = |most: f32| (0.5 - 0.5 * most, 0.5 + 0.5 * most);
    Some(match field {
        Kind::Cell | Kind::Hash => (0.0, 1.0),
        Kind::Perlin => signed(PERLIN[dims]),
        Kind::UPerlin => unsigned(PERLIN[dims]),
        Kind::Simplex => signed(SIMPLEX[dims]),
        Kind::USimplex => unsigned(SIMPLEX[dims]),
    })
}

/// The largest change of a field per unit along an axis; `None` if the field jumps.
pub fn steepest(field: Kind, dims: usize) -> Option<f32> {
    if !(1..=4).contains(&dims) {
        return None;
    }
    match field {
        Kind::Cell | Kind::Hash => None,
        Kind::Perlin => Some(PERLIN_SLOPE[dims]),
        Kind::UPerlin => Some(0.5 * PERLIN_SLOPE[dims]),
        Kind::Simplex => Some(SIMPLEX_SLOPE[dims]),
        Kind::USimplex => Some(0.5 * SIMPLEX_SLOPE[dims]),
    }
}
