//! A report as one self-contained HTML file: findings, curves, lines to blame, maps of lost digits.

use super::subject::{Planes, digits_lost};
use super::text::{errors_are, is_decade, not_examined, nothing, wrong_is};
use super::{Culprit, Examined, List, Report, Setting};
use crate::explain::short;
use crate::markup::escape;
use crate::page::{END, REPORT, prose, start};
use std::fmt::Write;

/// The report of an examination on a grid of `width` by `height` points. `repair` says what was found to
/// repair the lines, if that was requested.
pub fn html(examined: &Examined, (width, height): (usize, usize), repair: Option<&str>) -> String {
    let report = &examined.report;
    let title = format!("{}: numerical stability", report.shader);
    let mut out = start(&title, &[REPORT, RULES]);
    let _ = write!(
        out,
        "<h1>{}</h1>\n<p>Points are wrong that are {}.</p>\n<ul>",
        escape(&title),
        wrong_is(report)
    );
    for finding in &report.findings {
        let _ = write!(out, "<li>{}</li>", prose(&finding.text));
    }
    out.push_str("</ul>\n");
    for said in not_examined(report).into_iter().chain(nothing(report).map(str::to_string)) {
        let _ = writeln!(out, "<p>{}</p>", prose(&capital(&said)));
    }
    for List { title, lines, are_errors } in report.lists() {
        let _ = writeln!(out, "<h2>{title}</h2>");
        if are_errors {
            let _ = writeln!(out, "<p>Here {}.</p>", errors_are());
        }
        for culprit in lines.iter().take(12) {
            let error = if are_errors {
                format!("; error {} of the range", short(culprit.error, 2))
            } else {
                String::new()
            };
            line(culprit, &error, &mut out);
        }
    }
    if let Some(text) = repair {
        // Line by line: an escaped text has no line ends.
        let lines: Vec<String> = text.trim().lines().map(escape).collect();
        let _ = writeln!(out, "<h2>Repair</h2><pre class=said>{}</pre>", lines.join("\n"));
    }
    for (name, axis) in [
        ("offset", "offset that is added to the coordinates"),
        ("scale", "factor of the coordinates"),
        ("footprint", "factor of the width of a pixel"),
    ] {
        curve(report, (name, axis), &mut out);
    }
    // A run that was stopped has no values.
    if !examined.given.names.is_empty() {
        let _ = writeln!(
            out,
            "<h2>Digits lost</h2><p>Black: none; white: {WHITE} or more, which is all that a float has. u grows to the right, v \
             downwards.</p>"
        );
        maps("as given", &examined.given, (width, height), &mut out);
    }
    if let Some((by, planes)) = &examined.far {
        maps(&Setting::Offset { by: *by }.text(), planes, (width, height), &mut out);
    }
    out.push_str(END);
    out
}

const RULES: &str = ".said{white-space:pre-wrap}.map{border:1px solid #9aa4b2;max-width:100%;height:auto}\n";

/// The number of lost digits that is white, here and in a picture of lost digits.
pub const WHITE: f32 = 8.0;

/// A sentence with a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn line(c: &Culprit, error: &str, out: &mut String) {
    let _ = writeln!(
        out,
        "<p><b>{}:{}</b> <code>{}</code> {} ({}{error})</p><pre>{}</pre>",
        escape(&c.file),
        c.line,
        escape(&c.code),
        prose(&c.why),
        escape(&c.setting),
        escape(c.text.trim())
    );
}

/// The positions of the lines for the largest and the smallest share of a curve, and for no wrong point.
const LINES: [f64; 3] = [20.0, 180.0, 200.0];
/// The smallest share of a curve, as a power of ten.
const SMALLEST: f64 = -4.0;

/// The share of wrong points against the swept number as SVG; both axes are logarithmic, with a line for 0.
fn curve(report: &Report, (name, axis): (&str, &str), out: &mut String) {
    let points: Vec<(f64, f64)> = report
        .trials
        .iter()
        .filter_map(|t| {
            is_decade(&t.setting).filter(|(n, _)| *n == name).map(|(_, by)| (pxfm::f_log10(by), t.wrong()))
        })
        .collect();
    if points.is_empty() {
        return;
    }
    let x = |decade: f64| 58.0 + (decade + 12.0) * 21.5;
    let _ = write!(
        out,
        "<h2>Points that are wrong, by {name}</h2>\n<div class=wide><svg viewBox=\"0 0 600 246\" width=\"600\" role=\"img\" \
         aria-label=\"Share of the points that are wrong, by {name}\"><text x=\"4\" y=\"12\">points that are wrong</text>\
         <text x=\"316\" y=\"238\" text-anchor=\"middle\">{axis}</text>"
    );
    let [top, _, zero] = LINES;
    for decade in (-12..=12).step_by(3) {
        let at = x(f64::from(decade));
        let _ = write!(
            out,
            "<line x1=\"{at}\" y1=\"{top}\" x2=\"{at}\" y2=\"{zero}\" stroke=\"#ddd\"/><text x=\"{at}\" y=\"218\" \
             text-anchor=\"middle\">1e{decade}</text>"
        );
    }
    for (share, label) in [(0.0, "0"), (1e-4, "0.01 %"), (1e-2, "1 %"), (1.0, "100 %")] {
        let at = height_of(share);
        let _ = write!(
            out,
            "<line x1=\"58\" y1=\"{at}\" x2=\"574\" y2=\"{at}\" stroke=\"#ddd\"/><text x=\"53\" y=\"{}\" \
             text-anchor=\"end\">{label}</text>",
            at + 4.0
        );
    }
    let line: Vec<String> =
        points.iter().map(|(d, s)| format!("{:.1},{:.1}", x(*d), height_of(*s))).collect();
    let _ = writeln!(
        out,
        "<polyline fill=\"none\" stroke=\"#c33\" stroke-width=\"2\" points=\"{}\"/></svg></div>",
        line.join(" ")
    );
}

/// The position of a share of the points in a curve.
fn height_of(share: f64) -> f64 {
    let [top, bottom, zero] = LINES;
    if share > 0.0 {
        bottom + (1.0 - pxfm::f_log10(share).max(SMALLEST) / SMALLEST) * (top - bottom)
    } else {
        zero
    }
}

/// The larger side of a map on the page, in pixels.
const SIDE: usize = 240;
/// The shades of a map, besides black: one digit of a color.
const SHADES: f32 = 15.0;

/// A map of the digits lost for each component.
fn maps(title: &str, planes: &Planes, (width, height): (usize, usize), out: &mut String) {
    let _ = writeln!(out, "<h3>{}</h3>", escape(title));
    let larger = width.max(height).max(1);
    let side = |points: usize| (points * SIDE / larger).max(1);
    for (plane, name) in planes.names.iter().enumerate() {
        let name = escape(name);
        let _ = write!(
            out,
            "<figure><svg class=\"map\" viewBox=\"0 0 {width} {height}\" width=\"{}\" height=\"{}\" \
             preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\" role=\"img\" aria-label=\"digits lost of {name}, {}\">\
             <rect width=\"{width}\" height=\"{height}\"/>",
            side(width),
            side(height),
            escape(title)
        );
        for y in 0..height {
            row(planes, plane, (y, width), out);
        }
        let _ = writeln!(out, "</svg><figcaption>{name}</figcaption></figure>");
    }
}

/// A row of a map: each run of one shade becomes one rectangle. The first row is at the top, as in a picture.
fn row(planes: &Planes, plane: usize, (y, width): (usize, usize), out: &mut String) {
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
                out,
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
        assert_eq!([0.0, 1e-9, 1e-4, 1e-2, 1.0].map(height_of), [200.0, 180.0, 180.0, 100.0, 20.0]);
    }

    /// As in a picture, the first row is at the top, and what is lost is light.
    #[test]
    fn a_map_has_the_first_row_at_the_top() {
        let planes = Planes {
            names: vec!["r".into()],
            strict: vec![vec![1.0, 1.0, 9.0, 1.0]],
            exact: vec![vec![1.0, 1.0, 1.0, 1.0]],
        };
        let mut out = String::new();
        maps("as given", &planes, (2, 2), &mut out);
        let rects: Vec<&str> = out.split("<rect ").skip(1).collect();
        assert_eq!(rects.len(), 2, "{out}");
        assert!(rects[0].starts_with("width=\"2\" height=\"2\"/>"), "black: {out}");
        // No digit is right: 7.2 of 8 are lost.
        let place = "x=\"0\" y=\"1\" width=\"1\" height=\"1\" fill=\"#";
        let fill = rects[1].strip_prefix(place).expect("it is in the second row");
        assert!(fill.starts_with("ddd") || fill.starts_with("eee"), "light: {out}");
        let mut wide = String::new();
        maps("as given", &planes, (4, 1), &mut wide);
        assert!(wide.contains("width=\"240\" height=\"60\""), "{wide}");
    }
}
