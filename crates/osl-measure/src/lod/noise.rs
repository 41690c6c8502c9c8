//! Candidates: calls of noise that fade to the mean of the noise where a pixel covers its cells. In a sum of
//! octaves, this leaves out the octaves that a pixel cannot show.
//!
//! Such a fade depends on the argument of the noise alone, so it is right for all values of parameters as
//! long as the result is used linearly. This module must not know errors.

use super::frame::Frame;
use crate::stability::fix::source::Source;
use osl_hir::hir::{Expr, ExprKind};
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

/// The kinds of noise that have a mean and one argument.
const KINDS: [&str; 8] = ["uperlin", "noise", "perlin", "snoise", "usimplex", "simplex", "cell", "hash"];
/// The mean of noise by its kind.
const MEAN: &str = "    // Noise between -1 and 1 has the mean 0, noise between 0 and 1 the mean 0.5.\n    \
                    float mean = kind == \"perlin\" || kind == \"snoise\" || kind == \"simplex\" || kind == \"gabor\" ? 0 : 0.5;\n";
/// The functions of one kind.
const FUNCTIONS: [(&str, &str); 4] =
    [("noise", "uperlin"), ("snoise", "perlin"), ("cellnoise", "cell"), ("hashnoise", "hash")];
/// The widths of a pixel in cells of the noise between which it may fade.
pub(super) const FADES: [[&str; 2]; 5] =
    [["0.125", "1"], ["0.25", "1"], ["0.5", "1.5"], ["1", "2"], ["2", "4"]];
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
    let (kind, rest) = match (&call.args[..], call.row.name) {
        ([kind, at], "noise") if kind.ty == Type::STRING => {
            if let ExprKind::Str(name) = &kind.kind
                && !KINDS.contains(&&**name)
            {
                return None;
            }
            (source.reader.source(kind)?.0, at)
        }
        ([at], function) => {
            let (_, kind) = FUNCTIONS.into_iter().find(|(name, _)| *name == function)?;
            (format!("\"{kind}\""), at)
        }
        _ => return None,
    };
    let is_cell = kind == "\"cell\"" || kind == "\"hash\"";
    let written = source.reader.text.get(e.span.start as usize..e.span.end as usize)?;
    let begins = FUNCTIONS
        .iter()
        .any(|(name, _)| written.strip_prefix(name).is_some_and(|rest| rest.trim_start().starts_with('(')));
    let at_point = rest.ty.is_triple();
    let (argument, _) = source.reader.source(rest)?;
    // An int is no coordinate that can be filtered.
    let fits = begins && written.ends_with(')') && (at_point || rest.ty == Type::FLOAT);
    fits.then(|| Call { span: e.span, kind, is_cell, argument, at_point, is_triple: e.ty.is_triple() })
}

/// The edits that let these calls fade between two widths, with the functions that they need.
pub(super) fn edits(source: &Source<'_>, frame: &Frame, list: &[&Call], fade: [&str; 2]) -> Vec<Edit> {
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
        let (point, width) = match at_point {
            true => (
                "point p",
                "    vector size = filterwidth(p);\n    float width = max(size[0], max(size[1], size[2]));\n",
            ),
            false => ("float p", "    float width = filterwidth(p);\n"),
        };
        let [begin, end] = fade;
        text += &format!(
            "// Noise that fades to its mean where a pixel covers its cells, by oslrun lod.\n\
             {result} {name}(string kind, {point})\n{{\n{width}    \
             float fade = smoothstep({begin}, {end}, width);\n{MEAN}    {result} value = mean;\n    \
             if (fade < 1)\n        value = noise(kind, p);\n    \
             if (fade > 0)\n        value = mix(value, {mean}, fade);\n    return value;\n}}\n\n",
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
