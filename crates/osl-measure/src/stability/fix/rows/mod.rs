//! The table of rewrites: a pattern, what to write instead, and the reason.
//!
//! The texts are expressions of the language in which a single letter stands for any term. The rows are facts
//! of mathematics and know nothing of accuracy: whether a rewrite helps is measured. Sources: the conjugates,
//! half angles and logarithms of any textbook on numerical analysis (N. J. Higham, *Accuracy and Stability of
//! Numerical Algorithms*), W. Kahan's formulas for thin triangles and for the logarithm near 1.

mod angles;
mod places;
mod powers;
mod products;
mod roots;
mod series;

/// A rewrite.
#[derive(Debug)]
pub(super) struct Row {
    /// Its name.
    pub(super) name: &'static str,
    /// The pattern.
    pub(super) find: &'static str,
    /// Values that are computed first, each with its letter. They may use earlier ones.
    pub(super) with: &'static [(char, &'static str)],
    /// What is written instead.
    pub(super) write: &'static str,
    /// Why it loses fewer digits.
    pub(super) why: &'static str,
}

/// The rewrites. More special ones come first.
pub(super) fn rows() -> impl Iterator<Item = &'static Row> {
    let tables = [roots::ROWS, products::ROWS, angles::ROWS, powers::ROWS, places::ROWS, series::ROWS];
    tables.into_iter().flatten()
}
