//! Functions of strings. A string is UTF-8, and its length and offsets count bytes.
//!
//! How a number is read from text and printed as text is shared with the engine: `osl_ir::text` has it, and
//! values recorded from the reference implementation check it.

use crate::state::{Stop, unsupported};
use crate::value::Value;
use osl_ir::ir::Const;
pub(crate) use osl_ir::text::Flavour;
use osl_ir::text::{self, TextFn};

/// The longest string in bytes. A loop that doubles a string would need all memory.
const LONGEST: usize = 10_000;

/// The strings joined.
pub(crate) fn concat(args: &[Value]) -> Result<Value, Stop> {
    let text: String = args.iter().map(|a| a.string().to_string()).collect();
    if text.len() > LONGEST { Err(unsupported("long strings")) } else { Ok(Value::String(text.into())) }
}

/// `substr(s, start, length)`: a negative start counts from the end; no length means all that follows. A
/// character that is cut becomes a replacement character.
pub(crate) fn substr(args: &[Value]) -> Value {
    let (text, start) = (args[0].string(), i64::from(args[1].int()));
    let n = text.len() as i64;
    let start = (if start < 0 { start + n } else { start }).clamp(0, n);
    let length = args.get(2).map_or(n, |length| i64::from(length.int())).clamp(0, n - start);
    let bytes = text.as_bytes().get(start as usize..(start + length) as usize).unwrap_or(&[]);
    Value::String(String::from_utf8_lossy(bytes).into())
}

/// The byte at an index as a signed number; 0 outside the string.
pub(crate) fn getchar(args: &[Value]) -> Value {
    let text = args[0].string();
    let byte = usize::try_from(args[1].int()).ok().and_then(|index| text.as_bytes().get(index));
    Value::Int(byte.map_or(0, |byte| i32::from(byte.cast_signed())))
}

/// `stoi` and `stof`: the number at the beginning of a string.
pub(crate) fn parsed(args: &[Value], as_float: bool) -> Result<Value, Stop> {
    let function = if as_float { TextFn::ToFloat } else { TextFn::ToInt };
    match function.eval(&[Const::Str(args[0].string())], LONGEST as u64) {
        Const::Int(n) => Ok(Value::Int(n)),
        Const::Float(x) => Ok(Value::Float(x)),
        _ => Ok(Value::Void),
    }
}

/// The text of `printf` and its kin: the first argument with the others in place of its conversions.
pub(crate) fn format(args: &[Value], flavour: Flavour) -> Result<String, Stop> {
    let [template, values @ ..] = args else { return Ok(String::new()) };
    let mut list = Vec::new();
    for value in values {
        list.push(text::Value::Consts(constants(value).ok_or(unsupported("closures"))?));
    }
    let text = text::format(&template.string(), &list, flavour, 2 * LONGEST as u64);
    if text.len() > LONGEST { Err(unsupported("long strings")) } else { Ok(text) }
}

/// The numbers and strings of a value in order; none if it has no text.
fn constants(value: &Value) -> Option<Vec<Const>> {
    Some(match value {
        Value::Int(n) => vec![Const::Int(*n)],
        Value::Float(x) => vec![Const::Float(*x)],
        Value::Triple(t) => vec![Const::Triple(*t)],
        Value::Matrix(m) => vec![Const::Matrix(Box::new(*m))],
        Value::String(text) => vec![Const::Str(text.clone())],
        Value::Aggregate(elements) => elements.iter().map(constants).collect::<Option<Vec<_>>>()?.concat(),
        Value::Void => return None,
    })
}
