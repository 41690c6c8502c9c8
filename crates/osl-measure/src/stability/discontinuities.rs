//! Derivatives across discontinuities: places where the change of a function from one pixel to the next has
//! nothing to do with the derivative that the shader was given.

use crate::trace::{Trace, What};
use osl_ir::Span;
use osl_ir::ir::{Kernel, Note};
use std::collections::BTreeMap;

/// The calls of functions with derivatives: for each place the argument and the result of each call.
type Calls = BTreeMap<(Span, &'static str), Vec<(Vec<f64>, Vec<f64>)>>;

/// The functions whose derivatives are compared with differences.
pub(super) const FUNCTIONS: [&str; 3] = ["Dx", "Dy", "filterwidth"];

fn calls(trace: &Trace) -> Calls {
    let mut calls = Calls::default();
    for node in &trace.nodes {
        let What::Note(kernel) = &node.what else { continue };
        let Kernel::Note { note: Note::Call { form, .. }, .. } = &**kernel else { continue };
        let called = form.split('(').next().and_then(|head| head.split(' ').next_back());
        let Some(function) = FUNCTIONS.into_iter().find(|f| Some(*f) == called) else { continue };
        if let [argument, result] = node.args[..] {
            let both = (trace.node(argument).numbers(), trace.node(result).numbers());
            calls.entry((node.span, function)).or_default().push(both);
        }
    }
    calls
}

/// Share of a change that a derivative may miss.
const MISSED: f64 = 0.5;
/// The smallest change that counts, as a share of the value.
const SMALL: f64 = 0.01;

/// The places where the change to the neighbour in the row (`along_x`) or in the column disagrees with the
/// derivative at the point; each place once.
pub(super) fn jumps(here: &Trace, next: &Trace, along_x: bool) -> Vec<(Span, &'static str)> {
    let (a, b) = (calls(here), calls(next));
    let mut found = Vec::new();
    for ((span, function), list) in &a {
        let suits = match *function {
            "Dx" => along_x,
            "Dy" => !along_x,
            _ => true,
        };
        let Some(other) = b.get(&(*span, *function)).filter(|o| suits && o.len() == list.len()) else {
            continue;
        };
        let jump = list.iter().zip(other).any(|((v, deriv), (w, _))| {
            v.iter().zip(deriv).zip(w).any(|((v, deriv), w)| {
                let change = w - v;
                let known = if *function == "filterwidth" {
                    change.abs() > deriv * (1.0 + MISSED)
                } else {
                    (change - deriv).abs() > MISSED * change.abs().max(deriv.abs())
                };
                known && change.abs().max(deriv.abs()) > SMALL * v.abs().max(w.abs())
            })
        });
        if jump {
            found.push((*span, *function));
        }
    }
    found
}
