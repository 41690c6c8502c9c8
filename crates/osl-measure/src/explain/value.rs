//! The values of a point, as text and for tools.

use super::closure;
use super::show::{show, show_exact};
use crate::trace::{Exact, Node, NodeId, Trace};
use osl_ir::ir::Const;
use pxfm::f_log10;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use std::fmt::Display;

/// A value of a point: as a run computes it, and in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    strict: Option<Const>,
    exact: Option<Exact>,
    /// The text of a closure.
    closure: Option<String>,
    /// Whether the value is the first element of an array, and stands for it.
    is_array: bool,
    /// Decimal digits that the two values share, in the worst component. Absent if all digits of single
    /// precision agree, or if the value is NaN or infinite.
    pub digits: Option<f64>,
}

impl Shown {
    /// The value of a node of a trace.
    pub fn of(id: NodeId, trace: &Trace) -> Shown {
        let node = trace.node(id);
        let is_closure = matches!(node.exact, Some(Exact::Closure(_)));
        let closure = is_closure.then(|| closure::text(id, trace));
        Shown {
            strict: node.strict.clone(),
            exact: node.exact.clone(),
            closure,
            is_array: false,
            digits: node_digits(node),
        }
    }

    /// The value as the first element of an array.
    pub(super) fn of_array(self) -> Shown {
        Shown { is_array: true, ..self }
    }

    /// The value as a run computes it; none if only the double-precision arithmetic gets there. The value of
    /// a closure is a number of no meaning.
    pub fn single(&self) -> Option<&Const> {
        self.strict.as_ref()
    }

    /// The value as a run computes it, as text.
    pub fn value(&self) -> String {
        match (&self.closure, &self.strict) {
            (Some(text), _) => text.clone(),
            (None, Some(value)) if self.is_array => format!("{{{}, …}}", show(value)),
            (None, Some(value)) => show(value),
            (None, None) => "(not computed)".to_string(),
        }
    }

    /// The value in double precision, as text.
    pub fn exactly(&self) -> String {
        match (&self.closure, &self.exact) {
            (Some(text), _) => text.clone(),
            (None, Some(value)) => show_exact(value),
            (None, None) => "(not computed)".to_string(),
        }
    }

    /// The number, if the value is one.
    pub(super) fn number(&self) -> Option<f64> {
        match self.strict {
            Some(Const::Int(n)) if self.closure.is_none() => Some(f64::from(n)),
            Some(Const::Float(x)) => Some(f64::from(x)),
            _ => None,
        }
    }
}

/// A number for tools; NaN and infinities, which JSON does not have, are text.
fn json<T: Copy + Into<f64> + Display + Serialize>(x: T) -> serde_json::Value {
    let number = if x.into().is_finite() { serde_json::to_value(x).ok() } else { None };
    number.unwrap_or_else(|| x.to_string().into())
}

fn json_list<T: Copy + Into<f64> + Display + Serialize>(list: &[T]) -> serde_json::Value {
    list.iter().map(|x| json(*x)).collect()
}

/// A value for tools: a number, an array of numbers, a text, or null.
pub(crate) fn json_of(value: &Const) -> serde_json::Value {
    match value {
        Const::Int(n) => (*n).into(),
        Const::Float(x) => json(*x),
        Const::Triple(t) => json_list(t),
        Const::Matrix(m) => json_list(&m[..]),
        Const::Str(text) => text.to_string().into(),
        Const::Null => serde_json::Value::Null,
    }
}

impl Serialize for Shown {
    /// `value` and `exact`: a number, an array of numbers, or a text; and `digits`. The text of a closure is
    /// marked by `closure`, and the first element of an array by `array`.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let value = match (&self.closure, &self.strict) {
            (Some(text), _) => text.as_str().into(),
            (_, Some(value)) => json_of(value),
            (_, None) => serde_json::Value::Null,
        };
        let exact = match (&self.closure, &self.exact) {
            (Some(text), _) => text.as_str().into(),
            (_, Some(Exact::Int(n))) => (*n).into(),
            (_, Some(Exact::Float(x))) => json(*x),
            (_, Some(Exact::Triple(t))) => json_list(t),
            (_, Some(Exact::Matrix(m))) => json_list(&m[..]),
            (_, Some(Exact::Str(text))) => text.to_string().into(),
            (_, Some(Exact::Closure(_)) | None) => serde_json::Value::Null,
        };
        let is_closure = self.closure.is_some();
        let more = usize::from(is_closure) + usize::from(self.is_array);
        let mut fields = serializer.serialize_struct("Shown", 3 + more)?;
        fields.serialize_field("value", &value)?;
        fields.serialize_field("exact", &exact)?;
        fields.serialize_field("digits", &self.digits)?;
        if is_closure {
            fields.serialize_field("closure", &true)?;
        }
        if self.is_array {
            fields.serialize_field("array", &true)?;
        }
        fields.end()
    }
}

/// The fewest shared decimal digits of any component; `None` if all agree to single precision.
fn node_digits(node: &Node) -> Option<f64> {
    let (strict, exact) = (node.strict.as_ref()?, node.exact.as_ref()?);
    let (a, b) = (Exact::widen(strict).numbers(), exact.numbers());
    if matches!(exact, Exact::Int(_)) {
        return (a != b).then_some(0.0);
    }
    let least = a.iter().zip(&b).filter_map(|(a, b)| digits(*a, *b));
    least.reduce(f64::min)
}

/// Decimal digits that a single-precision value shares with the exact one; `None` if it is one of the two
/// neighbours of the exact value, so that nothing is lost.
pub fn digits(strict: f64, exact: f64) -> Option<f64> {
    if strict == exact || (strict.is_nan() && exact.is_nan()) {
        return None;
    }
    if !strict.is_finite() || !exact.is_finite() {
        return Some(0.0);
    }
    let error = (strict - exact).abs();
    let size = strict.abs().max(exact.abs());
    if error <= size * f64::from(f32::EPSILON) / 2.0 {
        return None;
    }
    Some((-f_log10(error / size)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_in_common_are_of_the_larger() {
        assert_eq!(digits(1.0, 1.0), None);
        assert_eq!(digits(1.0, 1.0 + 1e-9), None);
        assert!((digits(1.0, 1.001).unwrap() - 3.0).abs() < 0.01);
        assert_eq!(digits(f64::NAN, 1.0), Some(0.0));
        assert_eq!(digits(0.0, 1e-20), Some(0.0));
    }
}
