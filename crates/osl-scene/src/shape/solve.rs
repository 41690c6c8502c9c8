//! Roots of polynomials.

/// The roots of a polynomial between two bounds, in order; coefficients begin with the constant. A double
/// root may be missing.
///
/// Between two roots of its derivative a polynomial is monotonic, so each such interval has at most one root.
pub(super) fn roots(polynomial: &[f64], low: f64, high: f64) -> Vec<f64> {
    let value = |x: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = (1..).zip(&polynomial[1..]).map(|(n, c)| f64::from(n) * c).collect();
    let mut bounds = vec![low];
    bounds.extend(roots(&derivative, low, high));
    bounds.push(high);
    let pieces = bounds.windows(2).filter(|piece| (value(piece[0]) < 0.0) != (value(piece[1]) < 0.0));
    pieces.map(|piece| refine(&value, piece[0], piece[1])).collect()
}

/// Bisects the interval with the root until its ends are neighbours, using secant steps while these are
/// faster.
fn refine(value: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut at_low, mut at_high) = (value(low), value(high));
    for step in 0..200 {
        let middle = 0.5 * (low + high);
        let secant = (low * at_high - high * at_low) / (at_high - at_low);
        let x = if step % 2 == 0 && secant > low && secant < high { secant } else { middle };
        if middle <= low || middle >= high {
            break;
        }
        let y = value(x);
        if y == 0.0 {
            return x;
        }
        if (y < 0.0) == (at_low < 0.0) {
            (low, at_low) = (x, y);
        } else {
            (high, at_high) = (x, y);
        }
        if high - low <= 1e-15 * (low.abs() + high.abs()) {
            break;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_products_are_those_of_the_factors() {
        // (x + 2)(x + 0.5)(x − 1)(x − 1.25)
        let mut polynomial = vec![1.0];
        let factors = [-2.0, -0.5, 1.0, 1.25];
        for root in factors {
            let mut next = vec![0.0; polynomial.len() + 1];
            for (n, c) in polynomial.iter().enumerate() {
                next[n] -= c * root;
                next[n + 1] += c;
            }
            polynomial = next;
        }
        let found = roots(&polynomial, -10.0, 10.0);
        assert_eq!(found.len(), 4);
        assert!(found.iter().zip(factors).all(|(x, root)| (x - root).abs() < 1e-13), "{found:?}");
        assert_eq!(roots(&polynomial, 0.0, 1.1).len(), 1);
        assert!(roots(&[1.0, 0.0, 1.0], -5.0, 5.0).is_empty());
        assert!(roots(&[3.0], -5.0, 5.0).is_empty());
    }
}
