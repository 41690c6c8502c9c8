//! How the variables of an explanation change with u and v, and from pixel to pixel.
//!
//! The changes come from a second trace, of a body whose notes have derivatives: asking for derivatives may
//! change the last bits of values, so the values stay those of the first trace.

use super::lines::{element, set_args};
use super::through::{Found, Known, SetAt, ValueOrigin};
use super::{Explanation, Subject, What};
use crate::quote::line_at;
use crate::trace::{Node, NodeId, OnePoint, Trace, What as Kind};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Kernel, Note};
use osl_syntax::source::SourceMap;
use rustc_hash::FxHashMap;
use serde::Serialize;

/// How a value changes; a triple by component.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Derivatives {
    /// The change to the next pixel along x.
    pub dx: Vec<f64>,
    /// The change to the next pixel along y.
    pub dy: Vec<f64>,
    /// The derivative by u; empty where u and v do not tell the pixels apart.
    pub du: Vec<f64>,
    /// The derivative by v.
    pub dv: Vec<f64>,
    /// The variables and globals from which the value directly gets its change, with the line that set them.
    pub through: Vec<(String, Option<u32>)>,
    /// Those from which it is made too, and which do not change here.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub still: Vec<(String, Option<u32>)>,
    /// Why the derivative of the language is not the one of mathematics.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<String>,
    /// What is known about the value besides.
    pub made: ValueOrigin,
}

/// Adds the changes to the values of an explanation. `plain` is the trace of its subject, and `with_derivs`
/// that of the body whose notes have derivatives.
pub fn derivatives(
    explanation: &mut Explanation,
    (plain, subject): (&Trace, &Subject),
    with_derivs: &Trace,
    point: OnePoint<'_>,
    sources: &SourceMap,
) {
    let by_uv = inverse(point);
    let mut found_derivs: FxHashMap<(u32, usize), [Vec<f64>; 2]> = FxHashMap::default();
    let mut times: FxHashMap<u32, usize> = FxHashMap::default();
    for (site, node) in sets(with_derivs) {
        let n = times.entry(site).or_default();
        if let (_, [_, dx, dy]) = set_args(&node.args) {
            found_derivs.insert(
                (site, *n),
                [*dx, *dy].map(|id| {
                    with_derivs.node(id).numbers().into_iter().map(|x| x + 0.0).collect::<Vec<f64>>()
                }),
            );
        }
        *n += 1;
    }
    // The same walk over the first trace, with the calls that it enters.
    let mut found: FxHashMap<(usize, u32, String), Vec<Derivatives>> = FxHashMap::default();
    let mut known: FxHashMap<NodeId, SetAt> = FxHashMap::default();
    let (mut stack, mut calls) = (vec![0_usize], 0);
    times.clear();
    for node in &plain.nodes {
        let Kind::Note(kernel) = &node.what else { continue };
        let Kernel::Note { site, note } = &**kernel else { continue };
        match note {
            _ if node.strict.is_none() => {}
            Note::Enter { .. } => {
                calls += 1;
                stack.push(calls);
            }
            Note::Leave => drop(stack.pop()),
            Note::Set(name) => {
                let n = times.entry(*site).or_default();
                let changes = found_derivs.remove(&(*site, *n));
                *n += 1;
                let (index, [value, ..]) = set_args(&node.args) else { continue };
                let name = index.map_or_else(|| name.to_string(), |i| element(name, plain.node(*i)));
                let Some((_, line)) = line_at(node.span, sources) else { continue };
                let in_source = Known { trace: plain, point, sources, set: &known, values: subject.values };
                let of = Found::of(*value, in_source);
                let changes = changes.unwrap_or_default();
                let set = SetAt { line, name: name.clone(), changes: changes.clone(), why: of.why.clone() };
                let [dx, dy] = changes;
                if !dx.is_empty() {
                    let (du, dv) = by_uv.map_or_else(Default::default, |inverse| along(&inverse, &dx, &dy));
                    let [through, still] = [of.through, of.still].map(|set| set.into_iter().collect());
                    let derivs = Derivatives { dx, dy, du, dv, through, still, why: of.why, made: of.made };
                    let call = stack.last().copied().unwrap_or(0);
                    found.entry((call, line, name)).or_default().push(derivs);
                }
                known.entry(*value).or_insert(set);
            }
            _ => {}
        }
    }
    for line in &mut explanation.lines {
        for fact in &mut line.facts {
            if let What::Set { name, values, derivatives, .. } = &mut fact.what
                && let Some(found_derivs) = found.remove(&(fact.call, line.number, name.clone()))
                && found_derivs.len() == values.len()
            {
                *derivatives = found_derivs;
            }
        }
    }
}

/// The notes of variables that the strict arithmetic passes.
fn sets(trace: &Trace) -> impl Iterator<Item = (u32, &Node)> {
    trace.nodes.iter().filter_map(|node| match &node.what {
        Kind::Note(kernel) if node.strict.is_some() => match &**kernel {
            Kernel::Note { site, note: Note::Set(_) } => Some((*site, node)),
            _ => None,
        },
        _ => None,
    })
}

/// The matrix that turns changes by pixels into changes by u and v.
fn inverse(point: OnePoint<'_>) -> Option<[[f64; 2]; 2]> {
    let of = |global, axis| f64::from(point.deriv_of(global, axis)[0]);
    let [ux, vx] = [Global::U, Global::V].map(|global| of(global, Axis::X));
    let [uy, vy] = [Global::U, Global::V].map(|global| of(global, Axis::Y));
    let det = ux * vy - uy * vx;
    (det != 0.0 && det.is_finite()).then(|| [[vy / det, -vx / det], [-uy / det, ux / det]])
}

/// The derivatives by u and by v.
fn along(inverse: &[[f64; 2]; 2], dx: &[f64], dy: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let by = |row: [f64; 2]| dx.iter().zip(dy).map(|(x, y)| row[0] * x + row[1] * y).collect();
    (by(inverse[0]), by(inverse[1]))
}
