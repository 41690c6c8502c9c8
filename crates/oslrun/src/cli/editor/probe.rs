//! The values of variables at a pixel, beside the lines that set them: from the record of `oslrun explain`.

use super::desk::Desk;
use super::settings::Probe;
use crate::cli::measure::explain;
use osl::stages::{self, Checked};
use osl_job::Image;
use osl_measure::explain::{Explanation, What};

/// Maximum number of shown values of a variable on a line.
const MOST_VALUES: usize = 3;

/// Maximum number of pixels of a side.
const MOST_PIXELS: usize = 1 << 16;

/// Texts for the lines of a source, by their numbers from 1; none for a text with errors, or without a point.
pub(super) fn values(desk: &Desk<'_>, name: &str, text: &str, probe: Probe) -> Vec<(u32, String)> {
    let Checked { program, sources, .. } = desk.checked(name, text);
    let inside = probe.size <= MOST_PIXELS && probe.x < probe.size && probe.y < probe.size;
    let Some(program) = program.filter(|_| inside) else { return Vec::new() };
    let Ok(body) = stages::lower_noted(&program, &[]) else { return Vec::new() };
    let mut image = Image::default();
    image.points.grid = (probe.size, probe.size);
    image.shader.file = Some(name.into());
    image.shader.read = desk.settings.reading.clone();
    let explanation = explain::of_body(&image, body, &sources, (probe.x, probe.y));
    explanation.map(|explanation| shown(&explanation, name)).unwrap_or_default()
}

fn shown(explanation: &Explanation, name: &str) -> Vec<(u32, String)> {
    let mut list = Vec::new();
    for line in explanation.lines.iter().filter(|line| line.file == name) {
        let mut parts: Vec<String> = Vec::new();
        for fact in &line.facts {
            let What::Set { name, values, .. } = &fact.what else { continue };
            let first: Vec<String> = values.iter().take(MOST_VALUES).map(|value| value.value()).collect();
            let more = if values.len() > MOST_VALUES { ", …" } else { "" };
            let part = format!("{name} = {}{more}", first.join(", "));
            if !parts.contains(&part) && parts.len() < MOST_VALUES {
                parts.push(part);
            }
        }
        if !parts.is_empty() {
            list.push((line.number, parts.join("; ")));
        }
    }
    list
}
