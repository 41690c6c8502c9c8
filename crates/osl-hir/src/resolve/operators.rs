//! Result types of the built-in operators (OSL language specification, chapter on expressions).

use osl_ir::types::{Base, Type};
use osl_syntax::ast::{BinaryOp as B, UnaryOp as U};

/// Type of `left op right`, or `None` if the operator does not take these operands.
pub(crate) fn binary(op: B, left: Type, right: Type) -> Option<Type> {
    if left.is_array() || right.is_array() {
        return None;
    }
    match op {
        B::Add | B::Sub => sum(op, left, right),
        B::Mul | B::Div => product(op, left, right),
        B::Mod | B::Shl | B::Shr | B::BitAnd | B::BitXor | B::BitOr => {
            (left == Type::INT && right == Type::INT).then_some(Type::INT)
        }
        B::Lt | B::Le | B::Gt | B::Ge => (left.is_number() && right.is_number()).then_some(Type::INT),
        B::Eq | B::Ne => comparable(left, right).then_some(Type::INT),
        B::And | B::Or => (has_truth(left) && has_truth(right)).then_some(Type::INT),
    }
}

fn numbers(left: Type, right: Type) -> Type {
    if left == Type::INT && right == Type::INT { Type::INT } else { Type::FLOAT }
}

fn sum(op: B, left: Type, right: Type) -> Option<Type> {
    if left.is_number() && right.is_number() {
        return Some(numbers(left, right));
    }
    if left == Type::CLOSURE || right == Type::CLOSURE {
        return (left == right && op == B::Add).then_some(Type::CLOSURE);
    }
    match (left.is_triple(), right.is_triple()) {
        (true, true) if left == Type::POINT && right == Type::POINT && op == B::Sub => Some(Type::VECTOR),
        (true, true) if left == Type::POINT || right == Type::POINT => Some(Type::POINT),
        (true, true) => Some(left),
        (true, false) => right.is_number().then_some(left),
        (false, true) => left.is_number().then_some(right),
        _ => None,
    }
}

fn product(op: B, left: Type, right: Type) -> Option<Type> {
    if left.is_number() && right.is_number() {
        return Some(numbers(left, right));
    }
    if left == Type::CLOSURE || right == Type::CLOSURE {
        let factor = if left == Type::CLOSURE { right } else { left };
        return (op == B::Mul && (factor.is_number() || factor == Type::COLOR)).then_some(Type::CLOSURE);
    }
    let matrix_like = |t: Type| t == Type::MATRIX || t.is_number();
    if left == Type::MATRIX || right == Type::MATRIX {
        return (matrix_like(left) && matrix_like(right)).then_some(Type::MATRIX);
    }
    match (left.is_triple(), right.is_triple()) {
        (true, true) => Some(left),
        (true, false) => right.is_number().then_some(left),
        (false, true) => left.is_number().then_some(right),
        _ => None,
    }
}

fn comparable(left: Type, right: Type) -> bool {
    let numeric = |t: Type| t.is_number() || t.is_triple() || t == Type::MATRIX;
    (left == Type::STRING && right == Type::STRING)
        || (left.is_triple() && right.is_triple())
        || (left == Type::MATRIX && right == Type::MATRIX)
        || (left.is_number() && numeric(right))
        || (right.is_number() && numeric(left))
}

/// A suggestion for operands that an operator does not take, if the language has an alternative.
pub(super) fn instead(op: B, left: Type, right: Type) -> Option<&'static str> {
    let has_parts = |t: Type| t.is_number() || t.is_triple();
    let strings = left == Type::STRING && right == Type::STRING;
    Some(match op {
        B::Mod if has_parts(left) && has_parts(right) => {
            "`%` is for ints: `mod(a, b)` takes floats and triples"
        }
        B::BitXor if has_parts(left) && has_parts(right) => {
            "`^` is the exclusive or of ints: a power is `pow(a, b)`"
        }
        B::Mul if left == Type::CLOSURE && right == Type::CLOSURE => {
            "closures are added, and scaled by a color or a float: `c * diffuse(N) + emission()`"
        }
        B::Add if strings => "strings are joined by `concat(a, b)`",
        B::Lt | B::Le | B::Gt | B::Ge if strings => "strings have no order: `==` and `!=` compare them",
        B::Lt | B::Le | B::Gt | B::Ge if left.is_triple() || right.is_triple() => {
            "triples have no order: compare components, or `length(v)`, or `luminance(c)`"
        }
        B::Mul if left == Type::MATRIX && right.is_triple() => "a matrix is applied by `transform(m, p)`",
        B::Mul if left.is_triple() && right == Type::MATRIX => "a matrix is applied by `transform(m, p)`",
        _ => return None,
    })
}

/// Whether a value can be a condition (closures included).
pub(crate) fn has_truth(ty: Type) -> bool {
    !ty.is_array() && !matches!(ty.base, Base::Struct(_) | Base::Void)
}

/// Type of `op operand`, or `None`.
pub(crate) fn unary(op: U, operand: Type) -> Option<Type> {
    match op {
        U::Neg => (operand.is_number()
            || operand.is_triple()
            || operand == Type::MATRIX
            || operand == Type::CLOSURE)
            .then_some(operand),
        U::Not => has_truth(operand).then_some(Type::INT),
        U::Compl => (operand == Type::INT).then_some(Type::INT),
    }
}

/// Common type of the branches of `?:`, or `None`. Of two kinds of triples, the last one counts.
pub(super) fn ternary(a: Type, b: Type) -> Option<Type> {
    if a.is_array() || b.is_array() {
        return None;
    }
    if a.is_number() && b.is_number() {
        return Some(numbers(a, b));
    }
    if a == Type::STRING || b == Type::STRING {
        return (a == b).then_some(a);
    }
    if a == Type::MATRIX || b == Type::MATRIX {
        let ok = |t: Type| t == Type::MATRIX || t.is_number();
        return (ok(a) && ok(b)).then_some(Type::MATRIX);
    }
    match (a.is_triple(), b.is_triple()) {
        (_, true) => (a.is_number() || a.is_triple()).then_some(b),
        (true, false) => b.is_number().then_some(a),
        _ => None,
    }
}

/// The spelling of the operator.
pub(super) fn symbol(op: B) -> &'static str {
    match op {
        B::Mul => "*",
        B::Div => "/",
        B::Mod => "%",
        B::Add => "+",
        B::Sub => "-",
        B::Shl => "<<",
        B::Shr => ">>",
        B::Lt => "<",
        B::Le => "<=",
        B::Gt => ">",
        B::Ge => ">=",
        B::Eq => "==",
        B::Ne => "!=",
        B::BitAnd => "&",
        B::BitXor => "^",
        B::BitOr => "|",
        B::And => "&&",
        B::Or => "||",
    }
}

/// Name of the function that overloads the operator; `&&` and `||` have none.
pub(super) fn overload_name(op: B) -> Option<&'static str> {
    Some(match op {
        B::Mul => "__operator__mul__",
        B::Div => "__operator__div__",
        B::Mod => "__operator__mod__",
        B::Add => "__operator__add__",
        B::Sub => "__operator__sub__",
        B::Shl => "__operator__shl__",
        B::Shr => "__operator__shr__",
        B::Lt => "__operator__lt__",
        B::Le => "__operator__le__",
        B::Gt => "__operator__gt__",
        B::Ge => "__operator__ge__",
        B::Eq => "__operator__eq__",
        B::Ne => "__operator__neq__",
        B::BitAnd => "__operator__bitand__",
        B::BitXor => "__operator__xor__",
        B::BitOr => "__operator__bitor__",
        B::And | B::Or => return None,
    })
}

/// Name of the function that overloads the prefix operator.
pub(super) fn unary_overload_name(op: U) -> &'static str {
    match op {
        U::Neg => "__operator__neg__",
        U::Not => "__operator__not__",
        U::Compl => "__operator__compl__",
    }
}
