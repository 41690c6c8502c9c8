//! Printing: text from a format string, to the run's output, to strings, to files, as errors and warnings.

use super::{Builtin, Emitted, Site};
use osl_ir::ir::{Builder, Const, Kernel, Kind, Shape, Sink, ValueId};
use osl_ir::text::{self, Flavour, Value};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "printf",
        &["x(s,…)"],
        "format",
        |b, s| print(b, s, Sink::Print),
        "Prints values to the run's output. One conversion in `format` prints a whole triple, matrix \
         or array.",
    )
    .format(0)
    .derivatives("none: there is no result")
    .extremes(
        "Infinities print as inf and -inf, nan as nan or -nan depending on its sign bit, and -0 as \
         -0. If `format` is a literal, a conversion that does not suit its value, too few values and \
         too many values are compile-time errors.",
    )
    .example("printf(\"P = %g, u = %.3f\\n\", P, u);"),
    Builtin::compose(
        "fprintf",
        &["x(s,s,…)"],
        "filename, format",
        |b, s| print(b, s, Sink::File),
        "Appends text to the file `filename`, if the run allows files.",
    )
    .format(1)
    .derivatives("none: there is no result")
    .extremes("Nothing is written unless the run allows files. Otherwise it works as printf.")
    .example("fprintf(\"log.txt\", \"u = %g\\n\", u);"),
    Builtin::compose(
        "error",
        &["x(s,…)"],
        "format",
        |b, s| print(b, s, Sink::Error),
        "Reports an error of the shader.",
    )
    .format(0)
    .derivatives("none: there is no result")
    .extremes(
        "The same text is reported only once in a run. The shader goes on. Otherwise it works as \
         printf.",
    )
    .example("if (u > 2) error(\"u is %g\", u);"),
    Builtin::compose(
        "warning",
        &["x(s,…)"],
        "format",
        |b, s| print(b, s, Sink::Warning),
        "Reports a warning of the shader.",
    )
    .format(0)
    .derivatives("none: there is no result")
    .extremes("The same text is reported only once in a run. Otherwise it works as printf.")
    .example("if (u > 2) warning(\"u is %g\", u);"),
    Builtin::compose(
        "format",
        &["s(s,…)"],
        "format",
        format,
        "Returns the text that a format string and values make.",
    )
    .format(0)
    .derivatives("none: the result is a string")
    .extremes(
        "The text is that of printf, except that strings shorter than their width are aligned to the \
         right, and that `%%` stays if all arguments are literals.",
    )
    .example("string name = format(\"tile_%04d.png\", 7);"),
];

/// The values from argument `from` on, arrays element by element, with their shapes.
pub(super) fn values(b: &mut Builder, s: &Site<'_>, from: usize) -> (Vec<ValueId>, Vec<Shape>) {
    let (mut values, mut shapes) = (Vec::new(), Vec::new());
    for (index, arg) in s.args.iter().enumerate().skip(from) {
        match s.array(index) {
            Some(array) => {
                for element in 0..array.len {
                    let at = b.int(element as i32);
                    values.push(b.load_element(array.slot, at));
                }
                let kind = b.body.slot(array.slot).kind;
                shapes.push(Shape { kind, count: array.len, key: None });
            }
            None => {
                values.push(*arg);
                shapes.push(Shape { kind: b.body.kind(*arg), count: 1, key: None });
            }
        }
    }
    (values, shapes)
}

fn print(b: &mut Builder, s: &Site<'_>, sink: Sink) -> Emitted {
    let head = if sink == Sink::File { 2 } else { 1 };
    let mut args: Vec<ValueId> = s.args.iter().take(head).copied().collect();
    let (mut rest, shapes) = values(b, s, head);
    args.append(&mut rest);
    b.kernel_of(Kernel::Print { sink, shapes }, &args, &[]);
    Emitted::default()
}

/// Bytes of a text that is made at compile time.
const MAX_FOLDED: u64 = 64 << 10;

fn format(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let mut args = vec![s.arg(0)];
    let (mut rest, shapes) = values(b, s, 1);
    args.append(&mut rest);
    let known: Option<Vec<Const>> = args.iter().map(|arg| b.known(*arg, args.len()).cloned()).collect();
    match known.as_deref() {
        // The reference formats literals while it optimises.
        Some([Const::Str(format), values @ ..]) => {
            let values: Vec<Value> = values.iter().map(|value| Value::Consts(vec![value.clone()])).collect();
            let text = text::format(format, &values, Flavour::Folded, MAX_FOLDED);
            b.constant(Const::Str(text.into())).into()
        }
        _ => b.kernel(Kernel::Format(shapes), &args, Kind::Str).into(),
    }
}
