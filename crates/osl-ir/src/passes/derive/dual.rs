//! Values with their derivatives (tangents), and the arithmetic on them in which the rules are written.
//!
//! Operations follow the OSL language specification, chapter on derivatives: the value is computed as in the
//! plain operation, and both derivatives in a fixed order of products and sums. A tangent of `None` is zero;
//! products with it are omitted.

use super::super::rewrite::Rewrite;
use super::Writer;
use crate::ir::{LaneOp, ValueId};

/// A value and its derivatives along x and y.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual {
    pub(super) v: ValueId,
    pub(super) d: [Option<ValueId>; 2],
}

/// A derivative; `None` is zero.
pub(super) type Tangent = Option<ValueId>;

/// The operation whose derivative is written.
#[derive(Clone, Copy)]
pub(super) struct Call {
    pub(super) op: LaneOp,
    /// Its result, which was computed already.
    pub(super) result: ValueId,
}

impl Call {
    /// The result with derivatives.
    pub(super) fn with(self, d: [Tangent; 2]) -> Dual {
        Dual { v: self.result, d }
    }
}

impl Writer<'_> {
    /// A constant.
    pub(super) fn constant_dual(&mut self, x: f32) -> Dual {
        Dual { v: self.float(x), d: [None; 2] }
    }

    pub(super) fn sum(&mut self, a: Tangent, b: Tangent) -> Tangent {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.lane(LaneOp::FAdd, &[a, b])),
            (a, b) => a.or(b),
        }
    }

    pub(super) fn difference(&mut self, a: Tangent, b: Tangent) -> Tangent {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.lane(LaneOp::FSub, &[a, b])),
            (None, Some(b)) => Some(self.lane(LaneOp::FNeg, &[b])),
            (a, None) => a,
        }
    }

    /// A tangent times a value.
    pub(super) fn scaled(&mut self, a: Tangent, by: ValueId) -> Tangent {
        a.map(|a| self.lane(LaneOp::FMul, &[a, by]))
    }

    /// The function with value `v` and a derivative at `x`.
    pub(super) fn chain(&mut self, v: ValueId, derivative: ValueId, x: Dual) -> Dual {
        Dual { v, d: x.d.map(|d| d.map(|d| self.lane(LaneOp::FMul, &[derivative, d]))) }
    }

    pub(super) fn add(&mut self, a: Dual, b: Dual) -> Dual {
        let v = self.lane(LaneOp::FAdd, &[a.v, b.v]);
        Dual { v, d: [0, 1].map(|i| self.sum(a.d[i], b.d[i])) }
    }

    pub(super) fn sub(&mut self, a: Dual, b: Dual) -> Dual {
        let v = self.lane(LaneOp::FSub, &[a.v, b.v]);
        Dual { v, d: [0, 1].map(|i| self.difference(a.d[i], b.d[i])) }
    }

    pub(super) fn mul(&mut self, a: Dual, b: Dual) -> Dual {
        let v = self.lane(LaneOp::FMul, &[a.v, b.v]);
        self.mul_with(v, a, b)
    }

    /// The product `v` of two values.
    pub(super) fn mul_with(&mut self, v: ValueId, a: Dual, b: Dual) -> Dual {
        let tangent = |w: &mut Self, i: usize| {
            let left = w.scaled(b.d[i], a.v);
            let right = w.scaled(a.d[i], b.v);
            w.sum(left, right)
        };
        Dual { v, d: [tangent(self, 0), tangent(self, 1)] }
    }

    /// A quotient `v` with the language's guarded division.
    pub(super) fn guarded_with(&mut self, v: ValueId, a: Dual, b: Dual) -> Dual {
        let one = self.float(1.0);
        let reciprocal = self.lane(LaneOp::FDiv, &[one, b.v]);
        let tangent = |w: &mut Self, i: usize| {
            let change = w.scaled(b.d[i], v);
            let numerator = w.difference(a.d[i], change);
            w.scaled(numerator, reciprocal)
        };
        Dual { v, d: [tangent(self, 0), tangent(self, 1)] }
    }

    pub(super) fn guarded(&mut self, a: Dual, b: Dual) -> Dual {
        let v = self.lane(LaneOp::FDiv, &[a.v, b.v]);
        self.guarded_with(v, a, b)
    }

    /// A quotient inside a built-in, without guard.
    pub(super) fn plain_quotient(&mut self, a: Dual, b: Dual) -> Dual {
        let one = self.float(1.0);
        let reciprocal = self.lane(LaneOp::FDivBy, &[one, b.v]);
        let v = self.lane(LaneOp::FDivBy, &[a.v, b.v]);
        let minus = self.lane(LaneOp::FNeg, &[v]);
        let tangent = |w: &mut Self, i: usize| {
            let change = w.scaled(b.d[i], minus);
            let numerator = w.sum(change, a.d[i]);
            w.scaled(numerator, reciprocal)
        };
        Dual { v, d: [tangent(self, 0), tangent(self, 1)] }
    }

    /// The square root; zero with zero derivatives if the value is not positive.
    pub(super) fn root(&mut self, v: ValueId, x: Dual) -> Dual {
        let half = self.float(0.5);
        let derivative = self.lane(LaneOp::FDivBy, &[half, v]);
        let derivative = self.where_positive(x.v, derivative);
        self.chain(v, derivative, x)
    }

    /// `value` where `x` is positive, else zero.
    pub(super) fn where_positive(&mut self, x: ValueId, value: ValueId) -> ValueId {
        let zero = self.float(0.0);
        let not = self.lane(LaneOp::Step, &[x, zero]);
        self.select(value, zero, not)
    }

    /// `a`, or `b` where `c` is not 0; per component.
    pub(super) fn select(&mut self, a: ValueId, b: ValueId, c: ValueId) -> ValueId {
        self.lane(LaneOp::Select, &[a, b, c])
    }

    /// The derivatives of `a`, or those of `b` where `c` is not 0.
    pub(super) fn select_tangents(&mut self, a: [Tangent; 2], b: [Tangent; 2], c: ValueId) -> [Tangent; 2] {
        [0, 1].map(|i| {
            if a[i].is_none() && b[i].is_none() {
                return None;
            }
            let zero = self.float(0.0);
            Some(self.select(a[i].unwrap_or(zero), b[i].unwrap_or(zero), c))
        })
    }
}
