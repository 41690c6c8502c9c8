//! A report as one self-contained HTML file: findings, curves, lines to blame, maps of lost digits.

use super::subject::{Planes, digits_lost};
use super::text::{errors_are, is_decade, not_examined, nothing, wrong_is};
use super::{Culprit, Examined, List, Report, Setting};
use crate::page::{Axis, Page, escape, prose};
use crate::words::short;
use std::fmt::Write;

/// The number of lost digits that is white, here and in a picture of lost digits.
pub const WHITE: f32 = 8.0;

/// The report of an examination on a grid of `width` by `height` points. `repair` says what was found to
/// repair the lines, if that was requested.
pub fn html(examined: &Examined, (width, height): (usize, usize), repair: Option<&str>) -> String {
    let report = &examined.report;
    let rules = "pre{white-space:pre-wrap}.map{border:1px solid #9aa4b2;max-width:100%;height:auto}\n";
    let mut page = Page::new(&format!("{}: numerical stability", report.shader), rules);
    page.paragraph(&format!("Points are wrong that are {}.", wrong_is(report)));
    page.list(report.findings.iter().map(|finding| &*finding.text));
    for said in not_examined(report).into_iter().chain(nothing(report).map(str::to_string)) {
        page.paragraph(&capital(&said));
    }
    for List { title, lines, are_errors } in report.lists() {
        page.heading(2, title);
        if are_errors {
            page.paragraph(&format!("Here {}.", errors_are()));
        }
        for culprit in lines.iter().take(12) {
            line(culprit, are_errors, &mut page);
        }
    }
    if let Some(text) = repair {
        page.heading(2, "Repair");
        page.lines(text.trim());
    }
    for (name, axis) in [
        ("offset", "offset that is added to the coordinates"),
        ("scale", "factor of the coordinates"),
        ("footprint", "factor of the width of a pixel"),
    ] {
        curve(report, (name, axis), &mut page);
    }
    // A run that was stopped has no values.
    if !examined.given.names.is_empty() {
        page.heading(2, "Digits lost");
        page.paragraph(&format!(
            "Black: none; white: {WHITE} or more, which is all that a float has. u grows to the right, v downwards."
        ));
        maps("as given", &examined.given, (width, height), &mut page);
    }
    if let Some((by, planes)) = &examined.far {
        maps(&Setting::Offset { by: *by }.text(), planes, (width, height), &mut page);
    }
    page.ended()
}

/// A sentence with a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn line(c: &Culprit, is_error: bool, page: &mut Page) {
    let error = if is_error { format!("; error {} of the range", short(c.error, 2)) } else { String::new() };
    let _ = writeln!(
        page.text,
        "<p><b>{}:{}</b> <code>{}</code> {} ({}{error})</p>",
        escape(&c.file),
        c.line,
        escape(&c.code),
        prose(&c.why),
        escape(&c.setting)
    );
    page.lines(c.text.trim());
}

/// The axis of shares of points, with a place for 0.
const SHARES: Axis = Axis { decades: [-4.0, 0.0], ends: [180.0, 20.0], zero: Some(200.0) };

/// The share of wrong points against the swept number; both axes are logarithmic.
fn curve(report: &Report, (name, axis): (&str, &str), page: &mut Page) {
    let by = Axis { decades: [-12.0, 12.0], ends: [58.0, 574.0], zero: None };
    let of_sweep = report.trials.iter().filter_map(|trial| Some((is_decade(&trial.setting)?, trial)));
    let points: Vec<(f64, f64)> = of_sweep
        .filter(|((swept, _), _)| *swept == name)
        .map(|((_, x), trial)| (by.place(x), SHARES.place(trial.wrong())))
        .collect();
    if points.is_empty() {
        return;
    }
    page.heading(2, &format!("Points that are wrong, by {name}"));
    page.plot([600.0, 246.0], &format!("Share of the points that are wrong, by {name}"));
    page.label([4.0, 12.0], "start", "points that are wrong");
    page.label([316.0, 238.0], "middle", axis);
    by.marks().step_by(3).for_each(|at| page.mark_x(by.place(at), [20.0, 200.0], &format!("{at:e}")));
    for (share, label) in [(0.0, "0"), (1e-4, "0.01 %"), (1e-2, "1 %"), (1.0, "100 %")] {
        page.mark_y(SHARES.place(share), [58.0, 574.0], label);
    }
    page.curve(points.into_iter(), "#c33");
    page.end_plot();
}

/// The larger side of a map on the page, in pixels.
const SIDE: usize = 240;
/// The shades of a map, besides black: one digit of a color.
const SHADES: f32 = 15.0;

/// A map of the digits lost for each component.
fn maps(title: &str, planes: &Planes, (width, height): (usize, usize), page: &mut Page) {
    page.heading(3, title);
    let larger = width.max(height).max(1);
    let side = |points: usize| (points * SIDE / larger).max(1);
    for (plane, name) in planes.names.iter().enumerate() {
        let name = escape(name);
        let _ = write!(
            page.text,
            "<figure><svg class=\"map\" viewBox=\"0 0 {width} {height}\" width=\"{}\" height=\"{}\" \
             preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\" role=\"img\" aria-label=\"digits lost of {name}, {}\">\
             <rect width=\"{width}\" height=\"{height}\"/>",
            side(width),
            side(height),
            escape(title)
        );
        for y in 0..height {
            row(planes, plane, (y, width), page);
        }
        let _ = writeln!(page.text, "</svg><figcaption>{name}</figcaption></figure>");
    }
}

/// A row of a map: each run of one shade becomes one rectangle. The first row is at the top, as in a picture.
fn row(planes: &Planes, plane: usize, (y, width): (usize, usize), page: &mut Page) {
    let shade = |x: usize| {
        let at = y * width + x;
        let value = |list: &[Vec<f64>]| list.get(plane).and_then(|p| p.get(at)).copied().unwrap_or(0.0);
        let digits = digits_lost(value(&planes.strict), value(&planes.exact)) as f32;
        ((digits / WHITE).min(1.0) * SHADES).round() as u8
    };
    let mut x = 0;
    while x < width {
        let here = shade(x);
        let end = (x + 1..width).find(|i| shade(*i) != here).unwrap_or(width);
        if here > 0 {
            let _ = write!(
                page.text,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"1\" fill=\"#{here:x}{here:x}{here:x}\"/>",
                end - x
            );
        }
        x = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_wrong_points_have_their_own_line() {
        assert_eq!(
            [0.0, 1e-9, 1e-4, 1e-2, 1.0].map(|share| SHARES.place(share)),
            [200.0, 180.0, 180.0, 100.0, 20.0]
        );
    }

    /// As in a picture, the first row is at the top, and what is lost is light.
    #[test]
    fn a_map_has_the_first_row_at_the_top() {
        let planes = Planes {
            names: vec!["r".into()],
            strict: vec![vec![1.0, 1.0, 9.0, 1.0]],
            exact: vec![vec![1.0, 1.0, 1.0, 1.0]],
        };
        let mut page = Page { text: String::new() };
        maps("as given", &planes, (2, 2), &mut page);
        let rects: Vec<&str> = page.text.split("<rect ").skip(1).collect();
        assert_eq!(rects.len(), 2, "{}", page.text);
        assert!(rects[0].starts_with("width=\"2\" height=\"2\"/>"), "black: {}", page.text);
        // No digit is right: 7.2 of 8 are lost.
        let place = "x=\"0\" y=\"1\" width=\"1\" height=\"1\" fill=\"#";
        let fill = rects[1].strip_prefix(place).expect("it is in the second row");
        assert!(fill.starts_with("ddd") || fill.starts_with("eee"), "light: {}", page.text);
        let mut wide = Page { text: String::new() };
        maps("as given", &planes, (4, 1), &mut wide);
        assert!(wide.text.contains("width=\"240\" height=\"60\""), "{}", wide.text);
    }
}
