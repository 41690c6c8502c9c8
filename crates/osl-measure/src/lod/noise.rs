//! Candidates: calls of noise that fade to the mean of the noise where a pixel covers its cells. In a sum of
//! octaves, this leaves out the octaves that a pixel cannot show.
//!
//! Such a fade depends on the argument of the noise alone, so it is right for all values of parameters as
//! long as the result is used linearly.

use super::write::Frame;
use crate::stability::fix::source::Source;
use crate::words::trimmed;
use osl_hir::hir::{Expr, ExprKind};
use osl_ir::ir::NoiseField;
use osl_ir::types::Type;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;
use std::collections::BTreeSet;

/// A call of noise at a point or a number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Call {
    span: Span,
    /// Its kind as an expression.
    kind: String,
    /// Whether it is constant in each cell.
    is_cell: bool,
    /// The text of its argument.
    argument: String,
    at_point: bool,
    is_triple: bool,
}

/// The mean of noise by its kind.
const MEAN: &str = "    // Noise between -1 and 1 has the mean 0, noise between 0 and 1 the mean 0.5.\n    \
                    float mean = kind == \"perlin\" || kind == \"snoise\" || kind == \"simplex\" || kind == \"gabor\" ? 0 : 0.5;\n";
/// The widths of a pixel in cells of the noise from which on it may fade. Below, it keeps its bits.
pub(super) const STARTS: [f64; 5] = [0.12, 0.25, 0.5, 1.0, 2.0];
/// How fast noise fades with the squares of a pixel's sides in cells: it is gone where their sum is one over
/// this, for square pixels at 1 cell (simplex noise) and 1.8 cells. A box filter leaves of a sample of noise
/// what the correlation of the noise says; that of simplex noise falls within fewer cells. Measured for noise
/// in a plane, exp(-1.5 w²) of a sample of simplex noise and exp(-0.54 w²) of the others, at a pixel w cells
/// wide, have the smallest mean square error. The square of what is left is near that, and ends.
const RATE: &str = "kind == \"simplex\" || kind == \"usimplex\" ? 0.52 : 0.15";
/// Maximum number of calls.
const MOST: usize = 24;

/// The calls of noise that can fade.
pub(super) fn calls(source: &Source<'_>) -> Vec<Call> {
    let mut out: Vec<Call> = Vec::new();
    for site in source.sites() {
        let found = call(source, site.expr);
        out.extend(found.filter(|call| !out.iter().any(|other| overlap(other.span, call.span))));
    }
    // Most cells are looked up at whole numbers, which have no width; they are tried only by themselves.
    if out.iter().any(|call| !call.is_cell) {
        out.retain(|call| !call.is_cell);
    }
    out.truncate(MOST);
    out
}

fn overlap(a: Span, b: Span) -> bool {
    a.start < b.end && b.start < a.end
}

fn call(source: &Source<'_>, e: &Expr) -> Option<Call> {
    let ExprKind::Builtin(call) = &e.kind else { return None };
    if e.ty != Type::FLOAT && !e.ty.is_triple() {
        return None;
    }
    let function = NoiseField::from_name(call.row.name, false)?;
    let (field, kind, rest) = match &call.args[..] {
        [kind, at] if kind.ty == Type::STRING => {
            let field = match &kind.kind {
                ExprKind::Str(name) => Some(NoiseField::from_name(name, false)?),
                _ => None,
            };
            (field, source.reader.source(kind)?.0, at)
        }
        [at] => (Some(function), format!("\"{}\"", called(function)), at),
        _ => return None,
    };
    let kind = field.map_or(kind, |field| format!("\"{}\"", called(field)));
    let is_cell = matches!(field, Some(NoiseField::Cell | NoiseField::Hash));
    let written = source.reader.text.get(e.span.start as usize..e.span.end as usize)?;
    let begins = written.strip_prefix(call.row.name).is_some_and(|rest| rest.trim_start().starts_with('('));
    let at_point = rest.ty.is_triple();
    let (argument, _) = source.reader.source(rest)?;
    // An int is no coordinate that can be filtered.
    let fits = begins && written.ends_with(')') && (at_point || rest.ty == Type::FLOAT);
    fits.then(|| Call { span: e.span, kind, is_cell, argument, at_point, is_triple: e.ty.is_triple() })
}

/// The name of a field in `noise(name, p)`.
fn called(field: NoiseField) -> &'static str {
    match field {
        NoiseField::Cell => "cell",
        NoiseField::Hash => "hash",
        NoiseField::Perlin => "perlin",
        NoiseField::UPerlin => "uperlin",
        NoiseField::Simplex => "simplex",
        NoiseField::USimplex => "usimplex",
    }
}

/// The edits that let these calls fade from a width on, with the functions that they need.
pub(super) fn edits(source: &Source<'_>, frame: &Frame, list: &[&Call], start: f64) -> Vec<Edit> {
    let mut forms: BTreeSet<(bool, bool)> = BTreeSet::new();
    let mut out = Vec::new();
    for call in list {
        let Call { span, kind, argument, at_point, is_triple, .. } = call;
        forms.insert((*at_point, *is_triple));
        let name = function(source, *is_triple);
        out.push(Edit { span: *span, text: format!("{name}({kind}, {argument})") });
    }
    let at = before_functions(source, frame) as u32;
    let mut text = String::new();
    for (at_point, is_triple) in forms {
        let name = function(source, is_triple);
        let result = if is_triple { "color" } else { "float" };
        let (point, size) = match at_point {
            true => ("point p", "dot(Dx(p), Dx(p)) + dot(Dy(p), Dy(p))"),
            false => ("float p", "Dx(p) * Dx(p) + Dy(p) * Dy(p)"),
        };
        // The squares of both sides of the pixel at which it begins.
        let begin = format!("{:.4}", 2.0 * start * start);
        let begin = trimmed(&begin);
        text += &format!(
            "// Noise that fades to its mean where a pixel covers its cells, by oslrun lod.\n\
             {result} {name}(string kind, {point})\n{{\n    float size = {size};\n    \
             float rate = {RATE};\n    \
             float left = 1 - clamp(rate * (size - {begin}), 0, 1);\n{MEAN}    \
             {result} value = {mean};\n    if (left > 0)\n        \
             value = mix(value, noise(kind, p), left * left);\n    return value;\n}}\n\n",
            mean = if is_triple { "color(mean)" } else { "mean" },
        );
    }
    if !text.is_empty() {
        out.push(Edit { span: Span::new(at, at), text });
    }
    out.sort_by_key(|edit| edit.span.start);
    out
}

fn function(source: &Source<'_>, is_triple: bool) -> String {
    source.unused(if is_triple { "faded_color_noise" } else { "faded_noise" })
}

/// Where a function can be declared before all others: above the comment of the first one, unless that is
/// the comment of the whole file.
fn before_functions(source: &Source<'_>, frame: &Frame) -> usize {
    let text = source.reader.text;
    let starts = |at: usize| text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
    let functions = source.program.functions.iter().map(|f| f.span.start as usize);
    let first = functions.filter(|at| *at < text.len()).map(starts).fold(frame.shader, usize::min);
    let mut at = first;
    while at > 0 {
        let line = starts(at - 1);
        if !text.get(line..at).is_some_and(|line| line.trim_start().starts_with("//")) {
            break;
        }
        at = line;
    }
    if at == 0 { first } else { at }
}
