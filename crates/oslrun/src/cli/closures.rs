//! The closures of a frame: as text, and their weights as layers.

use osl_exec::{Component, Frame, Plane, show_closure};
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use std::io::Write;
use std::sync::Arc;

/// The largest frame whose closures are shown point by point.
const EACH: usize = 64;

/// Shows the closures of a picture whose first pixel is `corner`. In a small frame, those of each point;
/// else, for each name, the number of points, the range of weights, and an example.
pub(super) fn show(frame: &Frame, width: usize, corner: (usize, usize), out: &mut dyn Write) {
    for closures in &frame.closures {
        if closures.points.len() <= EACH {
            for (point, list) in closures.points.iter().enumerate() {
                let text: Vec<String> = list.iter().map(show_closure).collect();
                let text = if text.is_empty() { "null".to_string() } else { text.join("\n    + ") };
                let (x, y) = (corner.0 + point % width.max(1), corner.1 + point / width.max(1));
                let _ = writeln!(out, "{} at ({x}, {y}):\n      {text}", closures.output);
            }
            continue;
        }
        let names = names(&closures.points);
        if names.is_empty() {
            let _ = writeln!(out, "{}: null at every point", closures.output);
        }
        for name in names {
            let all: Vec<&Component> = closures.points.iter().flatten().filter(|c| c.name == name).collect();
            let count = closures.points.iter().filter(|list| list.iter().any(|c| c.name == name)).count();
            let share = 100.0 * count as f64 / closures.points.len() as f64;
            let sum = |channel: usize| all.iter().map(|c| f64::from(c.weight[channel])).sum::<f64>();
            let [r, g, b] = [0, 1, 2].map(|channel| sum(channel) / closures.points.len() as f64);
            let _ = writeln!(
                out,
                "{}: {name} at {share:.1} % of the points, mean weight ({r:.6}, {g:.6}, {b:.6})",
                closures.output
            );
            if let Some(first) = all.first() {
                let _ = writeln!(out, "    such as {}", show_closure(first));
            }
        }
    }
}

/// Adds the summed weights of each closure name as color planes `Ci.diffuse`.
pub(super) fn layers(frame: &mut Frame) {
    for closures in &frame.closures {
        for name in names(&closures.points) {
            for component in 0..3 {
                let weight = |list: &Vec<Component>| {
                    list.iter()
                        .filter(|c| c.name == name)
                        .fold(0.0, |sum, c| sum + c.weight[component])
                        .to_bits()
                };
                frame.planes.push(Plane {
                    output: format!("{}.{name}", closures.output).into(),
                    ty: Type::COLOR,
                    component,
                    kind: Kind::Float,
                    words: closures.points.iter().map(weight).collect(),
                    wide: Vec::new(),
                });
            }
        }
    }
}

/// The names of closures in the order in which they first occur.
fn names(points: &[Vec<Component>]) -> Vec<Arc<str>> {
    let mut names: Vec<Arc<str>> = Vec::new();
    for component in points.iter().flatten() {
        if !names.contains(&component.name) {
            names.push(component.name.clone());
        }
    }
    names
}
