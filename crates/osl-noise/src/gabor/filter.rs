//! The filter of a call: which waves the spacing of the points can resolve, from the partials of the
//! coordinates.

use super::waves::TWO_PI;
use super::{LANES, Lanes};
use crate::math::normalize;

/// A 2×2 matrix by rows, applied to row vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Matrix([[f32; 2]; 2]);

impl Matrix {
    fn diagonal(d: f32) -> Matrix {
        // The off-diagonal entries are d · 0, which keeps NaN.
        Matrix([[d * 1.0, d * 0.0], [d * 0.0, d * 1.0]])
    }

    fn transposed(self) -> Matrix {
        let [[p, q], [r, s]] = self.0;
        Matrix([[p, r], [q, s]])
    }

    fn times(self, other: Matrix) -> Matrix {
        // Sums start from zero, so that none of them is −0.
        let entry = |i: usize, j: usize| (0.0 + self.0[i][0] * other.0[0][j]) + self.0[i][1] * other.0[1][j];
        Matrix([[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]])
    }

    fn plus(self, other: Matrix) -> Matrix {
        let entry = |i: usize, j: usize| self.0[i][j] + other.0[i][j];
        Matrix([[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]])
    }

    fn scaled(self, k: f32) -> Matrix {
        Matrix(self.0.map(|row| row.map(|x| x * k)))
    }

    fn determinant(self) -> f32 {
        let [[p, q], [r, s]] = self.0;
        p * s - q * r
    }

    /// The inverse; the identity if its entries would overflow.
    fn inverse(self) -> Matrix {
        let [[p, q], [r, s]] = self.0;
        let entries = [[s, -q], [-r, p]];
        let d = p * s - r * q;
        let large = d.abs() >= 1.0;
        let limit = d.abs() / f32::MIN_POSITIVE;
        if large || entries.iter().flatten().all(|x| limit > x.abs()) {
            Matrix(entries.map(|row| row.map(|x| x / d)))
        } else {
            Matrix([[1.0, 0.0], [0.0, 1.0]])
        }
    }

    /// The row vector times the matrix.
    #[inline(always)]
    pub(super) fn row(&self, v: [f32; 2]) -> [f32; 2] {
        let [[p, q], [r, s]] = self.0;
        [v[0] * p + v[1] * r, v[0] * q + v[1] * s]
    }
}

/// Data shared by all filtered kernels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filter {
    /// Two axes in the plane that the partials span, and its normal.
    pub(super) frame: [[f32; 3]; 3],
    /// Weight of the footprint's Gaussian.
    pub(super) footprint: f32,
    /// Weight of the product of both Gaussians in frequency.
    pub(super) overlap: f32,
    /// Inverse of the sum of both covariances in frequency.
    pub(super) inverse_sum: Matrix,
    /// Maps a kernel's frequency to the filtered one.
    pub(super) shift: Matrix,
    /// Width of the filtered Gaussian.
    pub(super) a: f32,
}

fn cross(u: [f32; 3], v: [f32; 3]) -> [f32; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

impl Filter {
    /// The filter for the partials of a point in both directions and kernels of width `a`; `None` if the
    /// partials span almost no area.
    pub(super) fn new([px, py]: [[f32; 3]; 2], a: f32) -> Option<Filter> {
        let n = cross(px, py);
        if n[0] * n[0] + n[1] * n[1] + n[2] * n[2] < 1e-6 {
            return None;
        }
        let n = normalize(n);
        let t = normalize(if n[0].abs() < 0.9 { [0.0, n[2], -n[1]] } else { [-n[2], 0.0, n[0]] });
        let b = cross(n, t);
        // These are not the partials in the frame (t, b), but all implementations agree on them.
        let entry = |axis: usize, v: [f32; 3]| px[axis] * v[0] + py[axis] * v[1] + 0.0 * v[2];
        let m = Matrix([[entry(0, t), entry(0, b)], [entry(1, t), entry(1, b)]]);
        let spread = m.transposed().times(Matrix([[0.25, 0.0], [0.0, 0.25]])).times(m);
        if spread.determinant() < 1e-18 {
            return None;
        }
        let gabor = Matrix::diagonal((a * a) / TWO_PI);
        let footprint = spread.inverse().scaled(f32::from_bits(0x3ccf_817b));
        let sum = gabor.plus(footprint);
        let inverse_gabor = gabor.inverse();
        let product = footprint.inverse().plus(inverse_gabor).inverse();
        let area = f64::from(product.determinant().sqrt());
        Some(Filter {
            frame: [t, b, n],
            footprint: 1.0 / (TWO_PI * spread.determinant().sqrt()),
            overlap: 1.0 / (TWO_PI * sum.determinant().sqrt()),
            inverse_sum: sum.inverse(),
            shift: product.times(inverse_gabor),
            a: ((std::f64::consts::TAU * area) as f32).sqrt(),
        })
    }
}

/// A filter for each point of a cluster, in columns.
pub(super) struct Filters([Lanes; 20]);

impl Filters {
    /// The same filter in all lanes.
    pub(super) fn new(filter: &Filter) -> Filters {
        Filters(filter.words().map(|word| [word; LANES]))
    }

    /// Changes the filter of a lane.
    pub(super) fn set(&mut self, lane: usize, filter: &Filter) {
        for (lanes, word) in self.0.iter_mut().zip(filter.words()) {
            lanes[lane % LANES] = word;
        }
    }

    /// The filter of a lane.
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> Filter {
        let word = |i: usize| self.0[i][lane];
        let matrix = |i: usize| Matrix([[word(i), word(i + 1)], [word(i + 2), word(i + 3)]]);
        let axis = |i: usize| [word(i), word(i + 1), word(i + 2)];
        Filter {
            frame: [axis(0), axis(3), axis(6)],
            footprint: word(9),
            overlap: word(10),
            inverse_sum: matrix(11),
            shift: matrix(15),
            a: word(19),
        }
    }
}

impl Filter {
    fn words(&self) -> [f32; 20] {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.frame;
        let Matrix([[p, q], [r, s]]) = self.inverse_sum;
        let Matrix([[t, u], [v, w]]) = self.shift;
        [a, b, c, d, e, f, g, h, i, self.footprint, self.overlap, p, q, r, s, t, u, v, w, self.a]
    }
}
