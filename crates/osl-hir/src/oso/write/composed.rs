//! Library functions for which renderers have no operation, written as the few operations that they consist
//! of.
//!
//! Each follows the formula by which its lane operation computes, product by product and sum by sum.
//! Functions with long formulas (`rotate`, `fresnel`, `smooth_linearstep` …) stay operations with their own
//! name, which only this project reads.

use super::Writer;
use super::table::Sym;
use crate::builtins::Composed;
use osl_ir::types::{Base, Type};

impl Writer<'_> {
    /// Writes such a function; `false` for a form of it that is an operation.
    pub(super) fn composed(&mut self, function: Composed, ty: Type, to: Sym, args: &[Sym]) -> bool {
        use Composed as C;
        match (function, args) {
            // The operation `mod` is the operator `%`, which returns 0 if the divisor is 0.
            (C::Mod, [a, b]) => {
                let quotient = self.emit_value("div", ty, &[*a, *b]);
                let whole = match ty.base {
                    Base::Int => quotient,
                    _ => self.emit_value("floor", ty, &[quotient]),
                };
                let product = self.emit_value("mul", ty, &[*b, whole]);
                self.emit_to("sub", to, &[*a, product]);
            }
            // x (1 - t) + y t; for other types there is an operation.
            (C::Mix, [x, y, t]) if ty == Type::CLOSURE => {
                let one = self.table.float(1.0);
                let t_ty = self.table.ty(*t);
                let rest = self.emit_value("sub", t_ty, &[one, *t]);
                let first = self.emit_value("mul", ty, &[*x, rest]);
                let second = self.emit_value("mul", ty, &[*y, *t]);
                self.emit_to("add", to, &[first, second]);
            }
            (C::Log, [x, base]) => {
                let (x_ty, base_ty) = (self.table.ty(*x), self.table.ty(*base));
                let above = self.emit_value("log", x_ty, &[*x]);
                let below = self.emit_value("log", base_ty, &[*base]);
                self.emit_to("div", to, &[above, below]);
            }
            (C::Hypot, [first, more @ ..]) => {
                let mut sum = self.emit_value("mul", Type::FLOAT, &[*first, *first]);
                for other in more {
                    let square = self.emit_value("mul", Type::FLOAT, &[*other, *other]);
                    sum = self.emit_value("add", Type::FLOAT, &[sum, square]);
                }
                self.emit_to("sqrt", to, &[sum]);
            }
            (C::Reflect, [i, n]) => self.reflect(to, *i, *n),
            (C::Refract, [i, n, eta]) => self.refract(to, *i, *n, *eta),
            (C::FaceForward, [n, i, more @ ..]) => {
                let reference = match more.first() {
                    Some(reference) => *reference,
                    None => crate::oso::text::global("Ng").map_or(*n, |index| self.table.global(index)),
                };
                self.faceforward(to, *n, *i, reference);
            }
            (C::AaStep, [edge, s, widths @ ..]) => self.aastep(to, *edge, *s, widths),
            (C::Substr, [text, start]) => {
                let length = self.emit_value("strlen", Type::INT, &[*text]);
                self.emit_to("substr", to, &[*text, *start, length]);
            }
            (C::Concat, [first, middle @ .., last]) if !middle.is_empty() => {
                let mut joined = *first;
                for next in middle {
                    joined = self.emit_value("concat", Type::STRING, &[joined, *next]);
                }
                self.emit_to("concat", to, &[joined, *last]);
            }
            (C::RayKind(kind), []) => {
                let kind = self.table.text(kind.into());
                self.emit_to("raytype", to, &[kind]);
            }
            // Other forms are operations.
            (
                C::Mod
                | C::Mix
                | C::Log
                | C::Hypot
                | C::Reflect
                | C::Refract
                | C::FaceForward
                | C::AaStep
                | C::Substr
                | C::Concat
                | C::RayKind(_),
                _,
            ) => return false,
        }
        true
    }

    /// i - n (2 n·i)
    fn reflect(&mut self, to: Sym, i: Sym, n: Sym) {
        let along = self.emit_value("dot", Type::FLOAT, &[n, i]);
        let two = self.table.float(2.0);
        let twice = self.emit_value("mul", Type::FLOAT, &[two, along]);
        let back = self.emit_value("mul", Type::VECTOR, &[n, twice]);
        self.emit_to("sub", to, &[i, back]);
    }

    /// i eta - n (eta c + sqrt(k)) with c = i·n and k = 1 - eta² (1 - c²); 0 if k is negative
    fn refract(&mut self, to: Sym, i: Sym, n: Sym, eta: Sym) {
        let float = Type::FLOAT;
        let (one, zero) = (self.table.float(1.0), self.table.float(0.0));
        let cosine = self.emit_value("dot", float, &[i, n]);
        let squared = self.emit_value("mul", float, &[eta, eta]);
        let across = self.emit_value("mul", float, &[cosine, cosine]);
        let across = self.emit_value("sub", float, &[one, across]);
        let bent = self.emit_value("mul", float, &[squared, across]);
        let k = self.emit_value("sub", float, &[one, bent]);
        let total = self.emit_value("lt", Type::INT, &[k, zero]);
        let branch = self.emit("if", &[total], "r");
        self.assign(to, zero);
        self.part_ends(branch);
        let along = self.emit_value("mul", Type::VECTOR, &[i, eta]);
        let factor = self.emit_value("mul", float, &[eta, cosine]);
        let root = self.emit_value("sqrt", float, &[k]);
        let factor = self.emit_value("add", float, &[factor, root]);
        let down = self.emit_value("mul", Type::VECTOR, &[n, factor]);
        self.emit_to("sub", to, &[along, down]);
        self.part_ends(branch);
    }

    /// -n if i·reference is positive, else n
    fn faceforward(&mut self, to: Sym, n: Sym, i: Sym, reference: Sym) {
        let facing = self.emit_value("dot", Type::FLOAT, &[i, reference]);
        let zero = self.table.float(0.0);
        let away = self.emit_value("gt", Type::INT, &[facing, zero]);
        let turned = self.emit_value("neg", Type::VECTOR, &[n]);
        let branch = self.emit("if", &[away], "r");
        self.assign(to, turned);
        self.part_ends(branch);
        self.assign(to, n);
        self.part_ends(branch);
    }

    /// A ramp around the edge that is as wide as both widths together; widths that are not given are
    /// measured.
    fn aastep(&mut self, to: Sym, edge: Sym, s: Sym, widths: &[Sym]) {
        let float = Type::FLOAT;
        let (first, second) = match widths {
            [first, second] => (*first, *second),
            [second] => (self.emit_value("filterwidth", float, &[edge]), *second),
            _ => {
                let first = self.emit_value("filterwidth", float, &[edge]);
                (first, self.emit_value("filterwidth", float, &[s]))
            }
        };
        let first = self.emit_value("fabs", float, &[first]);
        let second = self.emit_value("fabs", float, &[second]);
        let span = self.emit_value("add", float, &[first, second]);
        let half = self.table.float(0.5);
        let half = self.emit_value("mul", float, &[half, span]);
        let low = self.emit_value("sub", float, &[edge, half]);
        let high = self.emit_value("add", float, &[edge, half]);
        let (zero, one) = (self.table.float(0.0), self.table.float(1.0));
        let before = self.emit_value("le", Type::INT, &[s, low]);
        let outer = self.emit("if", &[before], "r");
        self.assign(to, zero);
        self.part_ends(outer);
        let behind = self.emit_value("ge", Type::INT, &[s, high]);
        let inner = self.emit("if", &[behind], "r");
        self.assign(to, one);
        self.part_ends(inner);
        let above = self.emit_value("sub", float, &[s, low]);
        self.emit_to("div", to, &[above, span]);
        self.part_ends(inner);
        self.part_ends(outer);
    }
}
