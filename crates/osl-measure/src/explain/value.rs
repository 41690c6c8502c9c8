//! The values of a point, as text and for tools. A closure has no value that could be printed; its text
//! follows the nodes that made it: `0.5 * diffuse(N = …)`.

use crate::trace::{Exact, Node, NodeId, Trace, What};
use crate::words::short;
use osl_ir::ir::{Const, Kernel, LaneOp};
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
        let closure = is_closure.then(|| closure_text(id, trace));
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
            (None, Some(value)) => written(value, |x| short(x, 10)),
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

/// Characters of a string that are shown.
const MAX_TEXT: usize = 200;

/// A string in quotes, cut if it is too long to read.
fn quoted(text: &str) -> String {
    match text.char_indices().nth(MAX_TEXT) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// A value as text, in which `number` writes the numbers.
pub(crate) fn written(value: &Exact, number: impl Fn(f64) -> String) -> String {
    let list = |list: &[f64]| list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ");
    match value {
        Exact::Int(n) => n.to_string(),
        Exact::Str(s) => quoted(s),
        Exact::Closure(some) => if *some { "closure" } else { "null" }.to_string(),
        Exact::Float(x) => number(*x),
        Exact::Triple(t) => format!("({})", list(t)),
        Exact::Matrix(m) => format!("[{}]", list(&m[..])),
    }
}

pub(super) fn show(value: &Const) -> String {
    written(&Exact::widen(value), number)
}

/// A number in single precision: six digits, or all before the point as long as a float has them.
pub(super) fn number(x: f64) -> String {
    if (1e6..1e8).contains(&x.abs()) { format!("{x:.0}") } else { short(x, 6) }
}

/// The longest text; the rest of a sum of very many terms is cut.
const MAX_TERMS: usize = 2_000;
/// The largest number of nested terms.
const MAX_DEPTH: usize = 100;

/// The closure of a node, as a run has it.
fn closure_text(id: NodeId, trace: &Trace) -> String {
    let mut out = String::new();
    write_closure(id, trace, MAX_DEPTH, &mut out);
    if out.is_empty() { "null".to_string() } else { out }
}

fn write_closure(id: NodeId, trace: &Trace, depth: usize, out: &mut String) {
    if out.len() > MAX_TERMS || depth == 0 {
        if !out.ends_with('…') {
            out.push('…');
        }
        return;
    }
    let node = trace.node(id);
    if node.strict == Some(Const::Null) {
        return;
    }
    let inner = |id: NodeId, out: &mut String| write_closure(id, trace, depth - 1, out);
    match (&node.what, &node.args[..]) {
        (What::Kernel(kernel, _), args) => match (&**kernel, args) {
            (Kernel::ClosureSum, [a, b]) => {
                inner(*a, out);
                let middle = out.len();
                inner(*b, out);
                if middle > 0 && out.len() > middle {
                    out.insert_str(middle, " + ");
                }
            }
            (Kernel::ClosureScale, [closure, by]) => {
                let mut term = String::new();
                inner(*closure, &mut term);
                if term.is_empty() {
                    return;
                }
                let by = trace.node(*by).strict.as_ref().map_or_else(String::new, show);
                let term = if term.contains(" + ") { format!("({term})") } else { term };
                out.push_str(&format!("{by} * {term}"));
            }
            (Kernel::Component { name, shapes }, args) => {
                let mut parts = Vec::new();
                let mut rest = args.iter();
                // Parameters of the language's closures have names; those that a renderer adds have none.
                let fixed = shapes.iter().filter(|shape| shape.key.is_none()).count();
                let mut names = osl::reference::parameter_names(name, fixed).into_iter();
                for shape in shapes {
                    let values: Vec<String> = rest
                        .by_ref()
                        .take(shape.count as usize)
                        .map(|id| argument(*id, trace, depth))
                        .collect();
                    let value = match &values[..] {
                        [one] => one.clone(),
                        several => format!("{{{}}}", several.join(", ")),
                    };
                    match &shape.key {
                        // Built-in closures have a label, also where the source gives none.
                        Some(key) if &**key == "label" && value == "\"\"" => {}
                        Some(key) => parts.push(format!("{key} = {value}")),
                        None => match names.next().filter(|name| !name.is_empty()) {
                            Some(key) => parts.push(format!("{key} = {value}")),
                            None => parts.push(value),
                        },
                    }
                }
                out.push_str(&format!("{name}({})", parts.join(", ")));
            }
            _ => {}
        },
        (What::Lane(LaneOp::KChoose), [cond, yes, no]) => {
            let truth = matches!(trace.node(*cond).strict, Some(Const::Int(n)) if n != 0);
            inner(if truth { *yes } else { *no }, out);
        }
        // The value is the last argument, or the one before it where the arithmetics differ.
        (What::Element, [.., value]) => inner(*value, out),
        (What::Meet, [.., strict, _]) => inner(*strict, out),
        _ => {}
    }
}

fn argument(id: NodeId, trace: &Trace, depth: usize) -> String {
    let node: &Node = trace.node(id);
    if matches!(node.exact, Some(crate::trace::Exact::Closure(_))) {
        let mut out = String::new();
        write_closure(id, trace, depth - 1, &mut out);
        return if out.is_empty() { "null".to_string() } else { out };
    }
    node.strict.as_ref().map_or_else(String::new, show)
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

#[cfg(test)]
mod show_tests {
    use super::*;
    use crate::words::plain;

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.5, "0.5"),
            (1.0 / 3.0, "0.333333"),
            (-2.0, "-2"),
            (1e-7, "1e-7"),
            (123_456_789.0, "1.23457e8"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x, 6), text);
        }
        assert_eq!(short(f64::NAN, 6), "NaN");
        assert_eq!(
            [1e6, -1_000_000.625, 16_777_216.0, 1e8].map(number),
            ["1000000", "-1000001", "16777216", "1e8"]
        );
        assert_eq!([173.2, 8.24, -2817.0, 1.0e7].map(|x| plain(x, 2)), ["170", "8.2", "-2800", "1e7"]);
    }
}
