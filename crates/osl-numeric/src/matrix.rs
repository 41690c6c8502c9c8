//! 4×4 matrices in OSL's convention: row vectors, `p' = p · M`, the translation in the last row.
//!
//! A matrix is sixteen numbers, row by row, so element `[row][column]` has the index `4 * row + column`.

use super::geometry::{Triple, select};
use super::int::Mask;
use super::real::Real;

/// Sixteen numbers, row by row.
pub type Matrix<R> = [R; 16];

/// `k` on the diagonal, 0 elsewhere; `k` = 1 is the identity.
#[inline(always)]
pub fn diagonal<R: Real>(k: R) -> Matrix<R> {
    let mut m = [R::lit(0.0); 16];
    for i in 0..4 {
        m[5 * i] = k;
    }
    m
}

/// The product: applies `a` first, then `b`.
#[inline(always)]
pub fn multiply<R: Real>(a: Matrix<R>, b: Matrix<R>) -> Matrix<R> {
    let mut product = [R::lit(0.0); 16];
    for row in 0..4 {
        for column in 0..4 {
            let at = 4 * row;
            product[at + column] = (a[at] * b[column])
                .plus_product(a[at + 1], b[4 + column])
                .plus_product(a[at + 2], b[8 + column])
                .plus_product(a[at + 3], b[12 + column]);
        }
    }
    product
}

/// Every element times `k`.
#[inline(always)]
pub fn scale<R: Real>(m: Matrix<R>, k: R) -> Matrix<R> {
    let mut scaled = m;
    for element in &mut scaled {
        *element = *element * k;
    }
    scaled
}

/// Rows and columns exchanged.
#[inline(always)]
pub fn transpose<R: Real>(m: Matrix<R>) -> Matrix<R> {
    let mut t = m;
    for row in 0..4 {
        for column in 0..4 {
            t[4 * row + column] = m[4 * column + row];
        }
    }
    t
}

/// The determinant, by cofactors of the first row, each expanded along its own first row.
#[inline(always)]
pub fn determinant<R: Real>(m: Matrix<R>) -> R {
    let minor = |a: usize, b: usize, c: usize| {
        let two = |left: usize, right: usize| m[8 + left] * m[12 + right] - m[12 + left] * m[8 + right];
        m[4 + a] * two(b, c) - m[4 + b] * two(a, c) + m[4 + c] * two(a, b)
    };
    m[0] * minor(1, 2, 3) - m[1] * minor(0, 2, 3) + m[2] * minor(0, 1, 3) - m[3] * minor(0, 1, 2)
}

/// The inverse; the identity if there is none.
///
/// A matrix with the last column (0, 0, 0, 1) is inverted by cofactors of its upper left part, any other by
/// elimination. If it is not known which it is, both are computed. A quotient that would overflow counts as
/// singular.
#[inline(always)]
pub fn inverse<R: Real>(m: Matrix<R>) -> Matrix<R> {
    let zero = R::lit(0.0);
    let is_affine = m[3].eq(zero) & m[7].eq(zero) & m[11].eq(zero) & m[15].eq(R::lit(1.0));
    match is_affine.known() {
        Some(true) => inverse_affine(&m),
        Some(false) => inverse_by_elimination(m),
        None => {
            let (affine, general) = (inverse_affine(&m), inverse_by_elimination(m));
            std::array::from_fn(|at| R::select(is_affine, affine[at], general[at]))
        }
    }
}

/// A matrix, or the identity if the mask is false.
#[inline(always)]
fn if_regular<R: Real>(is_regular: R::Mask, m: Matrix<R>) -> Matrix<R> {
    let identity = diagonal(R::lit(1.0));
    std::array::from_fn(|at| R::select(is_regular, m[at], identity[at]))
}

/// The inverse of a matrix with last column (0, 0, 0, 1); the identity if there is none.
#[inline(always)]
fn inverse_affine<R: Real>(m: &Matrix<R>) -> Matrix<R> {
    let minor = |a: usize, b: usize, c: usize, d: usize| m[a] * m[b] - m[c] * m[d];
    let adjugate = [
        [minor(5, 10, 9, 6), minor(9, 2, 1, 10), minor(1, 6, 5, 2)],
        [minor(8, 6, 4, 10), minor(0, 10, 8, 2), minor(4, 2, 0, 6)],
        [minor(4, 9, 8, 5), minor(8, 1, 0, 9), minor(0, 5, 4, 1)],
    ];
    let determinant = m[0] * adjugate[0][0] + m[1] * adjugate[1][0] + m[2] * adjugate[2][0];
    let magnitude = determinant.abs();
    let largest_safe = magnitude / R::lit(f32::MIN_POSITIVE);
    let mut is_safe = largest_safe.gt(adjugate[0][0].abs());
    for at in 1..9 {
        is_safe = is_safe & largest_safe.gt(adjugate[at / 3][at % 3].abs());
    }
    let is_invertible = magnitude.ge(R::lit(1.0)) | is_safe;
    let mut inverse = diagonal(R::lit(1.0));
    for column in 0..3 {
        let part = [
            adjugate[0][column] / determinant,
            adjugate[1][column] / determinant,
            adjugate[2][column] / determinant,
        ];
        for row in 0..3 {
            inverse[4 * row + column] = part[row];
        }
        inverse[12 + column] = -m[12] * part[0] - m[13] * part[1] - m[14] * part[2];
    }
    if_regular(is_invertible, inverse)
}

/// The inverse by Gauss-Jordan elimination, with the largest element of each column as pivot; the identity if
/// there is none.
#[inline(always)]
fn inverse_by_elimination<R: Real>(m: Matrix<R>) -> Matrix<R> {
    let mut left = m;
    let mut right = diagonal(R::lit(1.0));
    let mut is_regular = !R::lit(0.0).ne(R::lit(0.0));
    for column in 0..4 {
        take_pivot(&mut left, &mut right, column);
        is_regular = is_regular & left[5 * column].ne(R::lit(0.0));
        for row in column + 1..4 {
            let factor = left[4 * row + column] / left[5 * column];
            subtract_row(&mut left, row, column, factor);
            subtract_row(&mut right, row, column, factor);
        }
    }
    for column in (0..4).rev() {
        let pivot = left[5 * column];
        for at in 4 * column..4 * column + 4 {
            left[at] = left[at] / pivot;
            right[at] = right[at] / pivot;
        }
        for row in 0..column {
            let factor = left[4 * row + column];
            subtract_row(&mut left, row, column, factor);
            subtract_row(&mut right, row, column, factor);
        }
    }
    if_regular(is_regular, right)
}

/// Exchanges a row with the first of the rows from it on that have the largest magnitude in its column.
#[inline(always)]
fn take_pivot<R: Real>(left: &mut Matrix<R>, right: &mut Matrix<R>, column: usize) {
    let mut largest = left[5 * column].abs();
    let never = R::lit(0.0).ne(R::lit(0.0));
    // Whether a row is larger than all rows before it: the last such row is the pivot.
    let mut is_larger = [never; 4];
    for row in column + 1..4 {
        let magnitude = left[4 * row + column].abs();
        is_larger[row] = magnitude.gt(largest);
        largest = R::select(is_larger[row], magnitude, largest);
    }
    // A lane alone exchanges the rows, or nothing; selections cost it more than a jump.
    if never.known().is_some() {
        let row = (column + 1..4).rev().find(|row| is_larger[*row].known() == Some(true));
        if let Some(row) = row {
            for at in 0..4 {
                left.swap(4 * column + at, 4 * row + at);
                right.swap(4 * column + at, 4 * row + at);
            }
        }
        return;
    }
    let mut is_pivot = is_larger;
    let mut is_last = !never;
    for row in (column + 1..4).rev() {
        is_pivot[row] = is_larger[row] & is_last;
        is_last = is_last & !is_larger[row];
    }
    for m in [left, right] {
        for at in 0..4 {
            let first = m[4 * column + at];
            let mut pivot = first;
            for row in column + 1..4 {
                let own = m[4 * row + at];
                pivot = R::select(is_larger[row], own, pivot);
                m[4 * row + at] = R::select(is_pivot[row], first, own);
            }
            m[4 * column + at] = pivot;
        }
    }
}

/// Row `row` minus `factor` times row `pivot`.
#[inline(always)]
fn subtract_row<R: Real>(m: &mut Matrix<R>, row: usize, pivot: usize, factor: R) {
    for column in 0..4 {
        m[4 * row + column] = m[4 * row + column] - factor * m[4 * pivot + column];
    }
}

/// The point (x, y, z, 1) · M, divided by its fourth coordinate; zero if that is 0.
#[inline(always)]
pub fn transform_point<R: Real>(m: Matrix<R>, p: Triple<R>) -> Triple<R> {
    let w = linear(&m, p, 3) + m[15];
    let [x, y, z] = [linear(&m, p, 0) + m[12], linear(&m, p, 1) + m[13], linear(&m, p, 2) + m[14]];
    select(w.ne(R::lit(0.0)), [x / w, y / w, z / w], [R::lit(0.0); 3])
}

/// The vector (x, y, z) times the upper left part of M.
#[inline(always)]
pub fn transform_vector<R: Real>(m: Matrix<R>, v: Triple<R>) -> Triple<R> {
    [linear(&m, v, 0), linear(&m, v, 1), linear(&m, v, 2)]
}

/// The vector times the first three elements of a column.
#[inline(always)]
fn linear<R: Real>(m: &Matrix<R>, v: Triple<R>, column: usize) -> R {
    (v[0] * m[column]).plus_product(v[1], m[4 + column]).plus_product(v[2], m[8 + column])
}

/// The normal times the transpose of the inverse of M, so that it stays perpendicular to transformed
/// tangents. Loops over many normals with one matrix compute [`normal_matrix`] once.
#[inline(always)]
pub fn transform_normal<R: Real>(m: Matrix<R>, n: Triple<R>) -> Triple<R> {
    transform_vector(normal_matrix(m), n)
}

/// The matrix that transforms normals if `m` transforms points.
#[inline(always)]
pub fn normal_matrix<R: Real>(m: Matrix<R>) -> Matrix<R> {
    transpose(inverse(m))
}
