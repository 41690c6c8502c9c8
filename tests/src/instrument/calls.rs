//! Calls of functions of the language: called again with the arguments that an explanation shows, they give
//! the results that it shows.

use super::case::Case;
use osl_ir::ir::Const;
use osl_measure::explain::{Explanation, Shown, What};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Functions whose result depends on more than their arguments.
const MORE: [&str; 20] = [
    // The quotient in these depends on whether the divisor is known to the compiler.
    "mod",
    "fmod",
    "Dx",
    "Dy",
    "Dz",
    "area",
    "filterwidth",
    "calculatenormal",
    "aastep",
    "transform",
    "transformu",
    "raytype",
    "backfacing",
    "surfacearea",
    "trace",
    "isconnected",
    "texture",
    "texture3d",
    "environment",
    "getmatrix",
];

/// Functions that need derivatives of their arguments.
const DERIVING: [&str; 10] =
    ["Dx", "Dy", "Dz", "area", "filterwidth", "calculatenormal", "aastep", "texture", "environment", "gabor"];

/// The sizes of arguments. Quotients that overflow depend on whether the divisor is known to the compiler.
const RANGE: std::ops::Range<f32> = 1e-12..1e12;

/// The most calls that are repeated for a source.
const MOST: usize = 40;

/// Repeats the calls; returns how many results were compared.
pub(super) fn hold(case: &Case, told: &[(usize, Explanation)]) -> Result<usize, String> {
    let mut calls: Vec<(String, Shown)> = Vec::new();
    let mut known: BTreeSet<String> = BTreeSet::new();
    for fact in told.iter().flat_map(|(_, told)| &told.lines).flat_map(|line| &line.facts) {
        let What::Call { form, calls: made, .. } = &fact.what else { continue };
        for (args, result) in made.iter().take(2) {
            let Some(result) = result else { continue };
            if let Some(text) = repeated(form, args).filter(|text| known.insert(text.clone())) {
                calls.push((text, result.clone()));
            }
        }
    }
    calls.truncate(MOST);
    if calls.is_empty() {
        return Ok(0);
    }
    let mut text = String::from("shader again(output float r_ = 0) {\n");
    for (call, result) in &calls {
        let form = match result.single() {
            Some(Const::Int(_)) => "%d",
            _ => "%.9g",
        };
        let _ = writeln!(text, "    printf(\"{form}\\n\", {call});");
    }
    text += "}\n";
    let frame = case.run(&text).ok_or_else(|| format!("does not run:\n{text}"))?;
    let printed: Vec<&str> = frame.printed.iter().filter(|p| p.point == 0).map(|p| p.text.trim()).collect();
    if printed.len() != calls.len() {
        return Err(format!("{} results, not {}:\n{text}", printed.len(), calls.len()));
    }
    // Where derivatives are requested, some functions compute their value in another way.
    let tolerance = if DERIVING.iter().any(|name| case.text.contains(name)) { 1e-5 } else { 0.0 };
    for ((call, result), printed) in calls.iter().zip(printed) {
        if !is_result(printed, result, tolerance) {
            return Err(format!("{call} is told as {}, and is {printed}", result.value()));
        }
    }
    Ok(calls.len())
}

/// Whether a printed value is the one that is told; zeros of both signs are equal.
fn is_result(printed: &str, told: &Shown, tolerance: f32) -> bool {
    let numbers = |list: &[f32]| {
        let mut words = printed.split_whitespace();
        let close = |x: f32, y: f32| {
            x == y || (x.is_nan() && y.is_nan()) || (x - y).abs() <= tolerance * x.abs().max(1e-3)
        };
        let is = |x: &f32, word: Option<&str>| {
            word.and_then(|word| word.parse::<f32>().ok()).is_some_and(|y| close(*x, y))
        };
        list.iter().all(|x| is(x, words.next()))
    };
    match told.single() {
        Some(Const::Int(n)) => printed.parse() == Ok(*n),
        Some(Const::Float(x)) => numbers(&[*x]),
        Some(Const::Triple(t)) => numbers(t),
        _ => false,
    }
}

/// Whether a hash is taken of a NaN, whose bits may differ between two runs.
pub(super) fn hashes_nan(told: &Explanation) -> bool {
    let is_nan = |value: &Shown| match value.single() {
        Some(Const::Float(x)) => x.is_nan(),
        Some(Const::Triple(t)) => t.iter().any(|x| x.is_nan()),
        _ => false,
    };
    told.lines.iter().flat_map(|line| &line.facts).any(|fact| match &fact.what {
        What::Call { form, calls, .. } => {
            form.contains("hash") && calls.iter().any(|(args, _)| args.iter().any(is_nan))
        }
        _ => false,
    })
}

/// The source text of a call with these arguments.
fn repeated(form: &str, args: &[Shown]) -> Option<String> {
    let (head, rest) = form.split_once('(')?;
    let (ret, name) = head.rsplit_once(' ')?;
    let params = rest.strip_suffix(')')?;
    let is_constructor = ["color", "point", "vector", "normal", "matrix"].contains(&name);
    if is_constructor
        || MORE.contains(&name)
        || params.contains("output ")
        || params.contains("...")
        || params.contains('[')
    {
        return None;
    }
    let types: Vec<&str> = match params {
        "" => Vec::new(),
        some => some.split(", ").map(|param| param.split(' ').next().unwrap_or_default()).collect(),
    };
    if types.len() != args.len() {
        return None;
    }
    // From a space to itself, the color is left as it is only where the compiler knows both names.
    if name == "transformc" && matches!(args, [from, to, _] if from.value() == to.value()) {
        return None;
    }
    let args: Option<Vec<String>> = types.iter().zip(args).map(|(ty, arg)| literal(ty, arg)).collect();
    let call = format!("{name}({})", args?.join(", "));
    match ret {
        "float" | "color" | "vector" | "point" | "normal" => Some(format!("({ret}) {call}")),
        "int" => Some(call),
        _ => None,
    }
}

/// A literal of a type.
fn literal(ty: &str, value: &Shown) -> Option<String> {
    let number = |x: f32| (x == 0.0 || RANGE.contains(&x.abs())).then(|| format!("{x:.9e}"));
    match (ty, value.single()?) {
        ("int", Const::Int(n)) if *n != i32::MIN => Some(format!("({n})")),
        ("float", Const::Float(x)) => Some(format!("({})", number(*x)?)),
        ("color" | "vector" | "point" | "normal", Const::Triple(t)) => {
            Some(format!("{ty}({}, {}, {})", number(t[0])?, number(t[1])?, number(t[2])?))
        }
        ("string", Const::Str(text))
            if text.chars().all(|c| c.is_ascii_alphanumeric()) && &**text != "gabor" =>
        {
            Some(format!("\"{text}\""))
        }
        _ => None,
    }
}
