//! Candidates: statements of the shader's body whose value can be replaced by its mean, and the measured
//! means.
//!
//! A mean is measured by a changed source with a further output for each candidate. Statements in loops are
//! left out, since their value differs from round to round. This module must not know errors.

use super::Build;
use super::frame::Frame;
use super::ground::Ground;
use super::judge::{Judge, Set, Variant};
use crate::sample::{Pattern, some_pixels};
use crate::stability::fix::source::{Source, each};
use crate::stability::fix::term::word;
use osl_exec::RunError;
use osl_hir::hir::{Arg, Expr, ExprKind, Init, Stmt, StmtKind};
use osl_ir::types::Type;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// A statement `x = value;` or `float x = value;`.
#[derive(Clone, Debug)]
pub(super) struct Statement {
    /// From its first character to the semicolon.
    pub(super) span: Span,
    /// The value.
    pub(super) value: Span,
    /// The type of the variable, if the statement declares it.
    pub(super) declares: Option<&'static str>,
    pub(super) name: String,
    /// The text of the value.
    text: String,
    pub(super) ty: Type,
    /// The mean of the value, once it is measured, as text.
    pub(super) mean: String,
}

/// Maximum number of statements that are tried.
const MOST: usize = 60;
/// Pixels of each footprint over which a mean is taken.
const MEASURED: usize = 8192;
/// Marks a value that was not computed.
const NONE: f32 = -1.0e30;
/// The footprints over which a mean is taken.
const OVER: [f64; 3] = [16.0, 64.0, 256.0];

/// The statements of the body that assign a float or a triple to a whole variable.
pub(super) fn statements(source: &Source<'_>, frame: &Frame) -> Vec<Statement> {
    let mut out = Vec::new();
    outside_loops(&source.program.shader.body, &mut |stmt| {
        out.extend(statement(source, frame, stmt));
    });
    out.truncate(MOST);
    out
}

fn outside_loops<'p>(list: &'p [Stmt], visit: &mut dyn FnMut(&'p Stmt)) {
    for stmt in list {
        visit(stmt);
        match &stmt.kind {
            StmtKind::Block(inner) => outside_loops(inner, visit),
            StmtKind::If(_, then, otherwise) => {
                outside_loops(then, visit);
                outside_loops(otherwise, visit);
            }
            _ => {}
        }
    }
}

fn statement(source: &Source<'_>, frame: &Frame, stmt: &Stmt) -> Option<Statement> {
    let (var, value, is_new) = match &stmt.kind {
        StmtKind::Declare(var, Some(Init::Value(value))) => (*var, value, true),
        StmtKind::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) if place.path.is_empty() => {
            let Init::Value(value) = &**value else { return None };
            (place.var, value, false)
        }
        _ => return None,
    };
    let own = source.program.vars.get(var.0 as usize)?;
    let name = own.name.to_string();
    let kind = word(own.ty)?;
    let inner = match &value.kind {
        ExprKind::Convert(inner) => &**inner,
        _ => value,
    };
    if !is_worth(source, inner) {
        return None;
    }
    let start = source.start(stmt)?;
    let bare = source.bare();
    let (from, to) = (value.span.start as usize, value.span.end as usize);
    let end = to + bare.get(to..)?.find(|c: char| !c.is_whitespace() && c != ')')?;
    // Only the variable, the value and a semicolon, so that the statement does nothing else.
    let head: String = bare.get(start..from)?.split_whitespace().collect::<Vec<_>>().join(" ");
    let wanted = if is_new { format!("{kind} {name} =") } else { format!("{name} =") };
    let fits = head
        .replace('=', " =")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .trim_end_matches('(')
        .trim_end()
        == wanted;
    if !fits || !bare.get(end..)?.starts_with(';') || start < frame.open || end > frame.close {
        return None;
    }
    let equals = start + bare.get(start..from)?.find('=')? + 1;
    let text = source.reader.text.get(equals..end)?.trim();
    let lead =
        source.reader.text.get(equals..end)?.len() - source.reader.text.get(equals..end)?.trim_start().len();
    let value = Span::new((equals + lead) as u32, (equals + lead + text.len()) as u32);
    if text.contains("//") || text.contains("/*") || text.contains('#') {
        return None;
    }
    Some(Statement {
        span: Span::new(start as u32, end as u32 + 1),
        value,
        declares: is_new.then_some(kind),
        name,
        text: text.to_string(),
        ty: own.ty,
        mean: String::new(),
    })
}

/// Whether an expression computes something and has no other effect.
fn is_worth(source: &Source<'_>, e: &Expr) -> bool {
    let (mut fits, mut computes) = (true, false);
    each(e, &mut |part| match &part.kind {
        ExprKind::Assign(..) | ExprKind::Step { .. } | ExprKind::Operation(_) | ExprKind::Comma(_) => {
            fits = false;
        }
        ExprKind::Call(id, args) => {
            computes = true;
            for (at, arg) in args.iter().enumerate() {
                fits &= match arg {
                    Arg::Alias(_) => !source.is_output(*id, at),
                    Arg::Copy { back, .. } => back.is_none(),
                };
            }
        }
        ExprKind::Builtin(call) => {
            computes = true;
            fits &= call.outputs.iter().all(Option::is_none) && call.row.name != "printf";
        }
        ExprKind::Binary(..) | ExprKind::Ternary(..) => computes = true,
        _ => {}
    });
    fits && computes
}

/// Measures the mean of each statement's value. Statements that never run, or whose value is not finite,
/// are dropped.
pub(super) fn measured(
    list: Vec<Statement>,
    source: &Source<'_>,
    frame: &Frame,
    judge: &Judge<'_>,
    build: &Build<'_>,
) -> Result<Vec<Statement>, RunError> {
    if list.is_empty() {
        return Ok(list);
    }
    let base = source.unused("probe");
    let names: Vec<String> = (0..list.len()).map(|at| format!("{base}_{at}")).collect();
    let output = |(name, own): (&String, &Statement)| Some(format!("{} {name} = {NONE:e}", word(own.ty)?));
    let outputs: Vec<String> = names.iter().zip(&list).filter_map(output).collect();
    let mut edits = vec![frame.outputs(&outputs)];
    for (name, own) in names.iter().zip(&list) {
        edits.push(Edit { span: own.value, text: format!("({name} = {})", own.text) });
    }
    edits.sort_by_key(|edit| edit.span.start);
    let text = osl_syntax::repair::apply(source.reader.text, &edits);
    let Some(built) = text.and_then(|text| build(&text)) else { return Ok(Vec::new()) };
    let variant = judge.variant(built.plain);
    let mut values: Vec<Vec<Vec<f32>>> = Vec::new();
    let mut planes = Vec::new();
    for footprint in OVER {
        let ground = judge.ground(footprint, Set::Fitted);
        let (found, run) = run(judge, &variant, &ground)?;
        planes = found;
        values.push(run);
    }
    let mean = |plane: usize| {
        let all = values.iter().filter_map(|run| run.get(plane)).flatten();
        let list: Vec<f64> = all.filter(|x| **x != NONE && x.is_finite()).map(|x| f64::from(*x)).collect();
        (!list.is_empty()).then(|| list.iter().sum::<f64>() / list.len() as f64)
    };
    let spread = |plane: usize| {
        let all = values.iter().filter_map(|run| run.get(plane)).flatten();
        let (low, high) = all
            .filter(|x| **x != NONE && x.is_finite())
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        f64::from(high - low)
    };
    let mut out = Vec::new();
    for (name, mut own) in names.iter().zip(list) {
        let Some(first) = planes.iter().position(|plane| plane == name) else { continue };
        let parts = first..first + if own.ty.is_triple() { 3 } else { 1 };
        let means: Option<Vec<f64>> = parts.clone().map(mean).collect();
        let Some(means) = means else { continue };
        let widest = parts.map(spread).fold(0.0, f64::max);
        let Some(text) = value(own.ty, &means, widest) else { continue };
        own.mean = text;
        out.push(own);
    }
    Ok(out)
}

/// The names of the planes' outputs and their values, one sample for each pixel.
fn run(
    judge: &Judge<'_>,
    variant: &Variant,
    ground: &Ground,
) -> Result<(Vec<String>, Vec<Vec<f32>>), RunError> {
    let pattern = Pattern::new(1, judge.seed);
    let shading = judge.shading(variant, ground, &pattern);
    let names = shading.planes().iter().map(|plane| plane.output.to_string()).collect();
    let pixels = some_pixels(judge.grid.width * judge.grid.height, MEASURED, judge.seed);
    Ok((names, shading.chosen(&pixels, 1)?))
}

/// A value as an expression of this type: with so many digits that they lose nothing of a range. None if the
/// value is not finite.
pub(super) fn value(ty: Type, means: &[f64], range: f64) -> Option<String> {
    if !means.iter().all(|x| x.is_finite()) {
        return None;
    }
    Some(match (word(ty), means) {
        (Some(word), [x, y, z]) => {
            let [x, y, z] = [x, y, z].map(|x| number(*x, range));
            if x == y && y == z { format!("{word}({x})") } else { format!("{word}({x}, {y}, {z})") }
        }
        (_, [x, ..]) if ty == Type::INT => {
            let most = f64::from(i32::MAX);
            format!("{:.0}", x.clamp(-most, most))
        }
        (_, [x, ..]) => number(*x, range),
        (_, []) => "0".to_string(),
    })
}

/// A constant, and for each slope the number, what it is multiplied with, and how large that may be.
type Sum<'a> = (f64, Vec<(f64, &'a str, f64)>);

/// A sum for each component, as an expression of this type. Ints are rounded to the nearest. `None` if a
/// number is not finite.
pub(super) fn linear(ty: Type, components: &[Sum<'_>], range: f64) -> Option<String> {
    let is_int = ty == Type::INT;
    let one = |(constant, slopes): &Sum<'_>| {
        let mut text = match number(constant + if is_int { 0.5 } else { 0.0 }, range) {
            zero if zero == "0" => String::new(),
            other => other,
        };
        for (slope, name, reach) in slopes.iter().filter(|(slope, ..)| *slope != 0.0) {
            if !(constant.is_finite() && slope.is_finite() && *reach > 0.0) {
                return None;
            }
            let size = number(slope.abs(), range / reach);
            let term = if size == "1" { (*name).to_string() } else { format!("{size} * {name}") };
            text += match (text.is_empty(), *slope < 0.0) {
                (true, true) => "-",
                (true, false) => "",
                (false, true) => " - ",
                (false, false) => " + ",
            };
            text += &term;
        }
        Some(if text.is_empty() { "0".to_string() } else { text })
    };
    let texts: Option<Vec<String>> = components.iter().map(one).collect();
    let texts = texts?;
    Some(match (word(ty), &texts[..]) {
        (Some(word), [_, _, _]) => format!("{word}({})", texts.join(", ")),
        (_, [text, ..]) if is_int => format!("(int)floor({text})"),
        (_, [text, ..]) => text.clone(),
        (_, []) => "0".to_string(),
    })
}

/// A number with about four digits of a range, and with at most the digits of a float.
fn number(x: f64, range: f64) -> String {
    let mut text = trimmed(format!("{:?}", x as f32));
    if range > 0.0 && range.is_finite() {
        let mut digits = 0;
        let mut unit = 1e-3 * range;
        while unit < 1.0 && digits < 30 {
            unit *= 10.0;
            digits += 1;
        }
        let rounded = trimmed(format!("{x:.digits$}"));
        if rounded.len() <= text.len() {
            text = rounded;
        }
    }
    let is_int_text = !text.contains(['.', 'e']);
    if is_int_text && x.abs() > f64::from(i32::MAX) {
        // Without a point, this would be an int out of range.
        text.push_str(".0");
    }
    if text == "-0" { "0".to_string() } else { text }
}

/// Without zeros at the end of a fraction.
pub(super) fn trimmed(mut text: String) -> String {
    if text.contains('.') && !text.contains('e') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_have_enough_digits_for_large_coordinates() {
        let text = |ty: Type, list: &[Sum<'_>], range: f64| linear(ty, list, range).unwrap();
        let row = (-0.5, vec![(10.0, "u", 1024.0), (0.0, "v", 1024.0)]);
        assert_eq!(text(Type::INT, &[row], 160.0), "(int)floor(10 * u)");
        let tilted = (0.25, vec![(-0.333_333, "P[0]", 1000.0), (1.0, "pixel", 2.0)]);
        assert_eq!(text(Type::FLOAT, std::slice::from_ref(&tilted), 10.0), "0.25 - 0.33333 * P[0] + pixel");
        let flat = (0.0, vec![(0.0, "P[0]", 1.0)]);
        let turned = (0.0, vec![(-2.0, "P[0]", 1.0)]);
        assert_eq!(
            text(Type::COLOR, &[tilted, flat, turned], 10.0),
            "color(0.25 - 0.33333 * P[0] + pixel, 0, -2 * P[0])"
        );
        assert_eq!(linear(Type::FLOAT, &[(0.0, vec![(f64::NAN, "u", 1.0)])], 1.0), None);
    }

    #[test]
    fn values_are_short_and_lose_nothing_of_the_range() {
        let cases: [(Type, &[f64], f64, &str); 13] = [
            (Type::FLOAT, &[0.123_456], 1.0, "0.123"),
            (Type::FLOAT, &[-0.000_01], 1.0, "0"),
            (Type::FLOAT, &[123.456], 500.0, "123.5"),
            (Type::FLOAT, &[0.001_234_56], 0.01, "0.00123"),
            (Type::COLOR, &[0.5, 0.5, 0.5], 1.0, "color(0.5)"),
            (Type::COLOR, &[0.5, 0.25, 0.0], 1.0, "color(0.5, 0.25, 0)"),
            (Type::FLOAT, &[f64::from(1e30_f32)], 0.0, "1e30"),
            (Type::FLOAT, &[f64::from(1.234_567e30_f32)], 1e33, "1.234567e30"),
            (Type::FLOAT, &[f64::from(-3e9_f32)], 0.0, "-3000000000.0"),
            (Type::FLOAT, &[f64::from(0.1_f32)], 1e-30, "0.1"),
            (Type::FLOAT, &[f64::from(1.5e-45_f32)], 0.0, "1e-45"),
            (Type::INT, &[1e10], 5.0, "2147483647"),
            (Type::INT, &[-7.0], 0.0, "-7"),
        ];
        for (ty, means, range, text) in cases {
            assert_eq!(value(ty, means, range).as_deref(), Some(text), "{means:?} in {range}");
        }
        assert_eq!(value(Type::FLOAT, &[f64::NAN], 1.0), None);
        assert_eq!(value(Type::COLOR, &[0.0, f64::INFINITY, 0.0], 1.0), None);
    }
}
