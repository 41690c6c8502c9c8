//! Derivatives: those of an explanation are those that the source prints with `Dx` and `Dy`, and central
//! differences.

use super::case::Case;
use super::compare::{Seen, base};
use super::differences::{self, Differences};
use osl_measure::explain::{self, What};

/// Derivatives may be computed in another order, as which of them are requested differs.
const TOLERANCE: f64 = 1e-4;

/// Compares the derivatives at a pixel; returns how many values were compared.
pub(super) fn hold(case: &Case, pixel: (usize, usize), seen: &Seen) -> Result<(usize, Differences), String> {
    let none = Ok((0, Differences::default()));
    let (Some(subject), Some(sloped)) = (case.subject(false), case.subject(true)) else { return none };
    let Some(point) = case.point(pixel) else { return none };
    let plain = case.trace(&subject, point);
    let mut told = explain::explain(&plain, &subject, &case.checked.sources);
    if told.cut {
        return none;
    }
    let with = case.trace(&sloped, point);
    explain::derivatives(&mut told, (&plain, &subject), &with, point, &case.checked.sources);
    let mut compared = 0;
    for line in &told.lines {
        for fact in &line.facts {
            let What::Set { name, derivatives, .. } = &fact.what else { continue };
            // Numbers of calls may differ from those of the instrumented source.
            if fact.call != 0 || case.written.open.contains(&(line.number, base(name))) {
                continue;
            }
            let Some(printed) = seen.sets.get(&(0, line.number, name.clone())) else { continue };
            if printed.len() != derivatives.len() {
                continue;
            }
            for (slope, printed) in derivatives.iter().zip(printed) {
                let told: Vec<f64> = slope.dx.iter().chain(&slope.dy).copied().collect();
                let printed: Vec<f64> =
                    printed.split_whitespace().skip(1).filter_map(|word| word.parse().ok()).collect();
                if told.len() != printed.len() || !told.iter().zip(&printed).all(|(a, b)| is_close(*a, *b)) {
                    let line = line.number;
                    return Err(format!("derivatives of `{name}`, line {line}: {told:?}, not {printed:?}"));
                }
                compared += told.len();
            }
        }
    }
    Ok((compared, differences::hold(case, &subject, &told, point)?))
}

fn is_close(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()).max(1e-3)
}
