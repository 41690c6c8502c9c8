//! The closures of a run as text: at each point of a small image, else a summary by name.

use osl_exec::{Closures, Component, show_closure};
use std::io::Write;
use std::sync::Arc;

/// The largest number of points whose closures are shown point by point.
const EACH: usize = 64;

/// The closures of a run, added piece by piece and not kept.
#[derive(Default)]
pub struct Summary(Vec<OfOutput>);

/// The closures of an output.
#[derive(Default)]
struct OfOutput {
    output: Arc<str>,
    points: usize,
    /// The components of the first points.
    first: Vec<Vec<Component>>,
    /// In the order in which the names first occur.
    names: Vec<OfName>,
}

/// The components with a name.
struct OfName {
    name: Arc<str>,
    sum: [f64; 3],
    /// The number of points that have any, and the last of them.
    points: usize,
    last: usize,
    example: Option<Component>,
}

impl Summary {
    /// Adds the closures of the next points.
    pub fn add(&mut self, closures: &[Closures]) {
        let known = self.0.len();
        self.0.extend(
            closures
                .iter()
                .skip(known)
                .map(|of| OfOutput { output: of.output.clone(), ..OfOutput::default() }),
        );
        for (all, here) in self.0.iter_mut().zip(closures) {
            for point in 0..here.len() {
                all.add(here, point);
            }
        }
    }

    /// Shows the closures of a picture with rows of `width` pixels, whose first pixel is `corner`. In a small
    /// picture, those of each point; else, for each name, the number of points, the mean weight, and an
    /// example.
    pub fn show(&self, width: usize, corner: (usize, usize), out: &mut dyn Write) {
        for OfOutput { output, points, first, names } in &self.0 {
            if *points <= EACH {
                for (point, list) in first.iter().enumerate() {
                    let text: Vec<String> = list.iter().map(show_closure).collect();
                    let text = if text.is_empty() { "null".to_string() } else { text.join("\n    + ") };
                    let (x, y) = (corner.0 + point % width.max(1), corner.1 + point / width.max(1));
                    let _ = writeln!(out, "{output} at ({x}, {y}):\n      {text}");
                }
                continue;
            }
            if names.is_empty() {
                let _ = writeln!(out, "{output}: null at every point");
            }
            for OfName { name, sum, points: some, example, .. } in names {
                let share = 100.0 * *some as f64 / *points as f64;
                let [r, g, b] = sum.map(|sum| sum / *points as f64);
                let _ = writeln!(
                    out,
                    "{output}: {name} at {share:.1} % of the points, mean weight ({r:.6}, {g:.6}, {b:.6})"
                );
                if let Some(example) = example {
                    let _ = writeln!(out, "    such as {}", show_closure(example));
                }
            }
        }
    }
}

impl OfOutput {
    fn add(&mut self, closures: &Closures, point: usize) {
        self.points += 1;
        if self.first.len() < EACH {
            self.first.push(closures.point(point));
        }
        for (name, weight) in closures.weights(point) {
            let at = self.names.iter().position(|own| own.name == *name).unwrap_or_else(|| {
                let example = closures.point(point).into_iter().find(|component| component.name == *name);
                self.names.push(OfName { name: name.clone(), sum: [0.0; 3], points: 0, last: 0, example });
                self.names.len() - 1
            });
            let Some(own) = self.names.get_mut(at) else { continue };
            own.sum.iter_mut().zip(weight).for_each(|(sum, x)| *sum += f64::from(x));
            if own.last != self.points {
                (own.points, own.last) = (own.points + 1, self.points);
            }
        }
    }
}
