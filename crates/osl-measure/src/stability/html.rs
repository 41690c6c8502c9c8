//! A report as one self-contained HTML file: findings, curves, lines to blame, maps of lost digits.

use super::subject::{Planes, digits_lost};
use super::text::{errors_are, is_decade};
use super::{Culprit, Examined, List, Report};
use crate::explain::short;
use crate::markup::escape;
use std::fmt::Write;

/// The report of an examination on a grid of `width` by `height` points.
pub fn html(examined: &Examined, width: usize, height: usize) -> String {
    let report = &examined.report;
    let mut out = String::from(
        "<!doctype html><meta charset=\"utf-8\"><title>stability</title><style>\
         body{font:15px sans-serif;max-width:60em;margin:2em auto;padding:0 1em}pre{background:#f4f4f4;padding:.6em;overflow:auto}\
         table{border-collapse:collapse}td,th{padding:.2em .6em;border-bottom:1px solid #ddd;text-align:right}\
         td:first-child,th:first-child{text-align:left}svg.map{width:15em;height:15em;image-rendering:pixelated}</style>\n",
    );
    let _ = writeln!(out, "<h1>{}: numerical stability</h1>", escape(&report.shader));
    out.push_str("<ul>");
    for finding in &report.findings {
        let _ = write!(out, "<li>{}</li>", escape(&finding.text));
    }
    out.push_str("</ul>\n");
    if report.culprits.is_empty() {
        out.push_str("<p>Nothing to blame.</p>\n");
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
    for name in ["offset", "scale", "footprint"] {
        curve(report, name, &mut out);
    }
    let _ = writeln!(out, "<h2>Digits lost</h2><p>White: none; black: all seven.</p>");
    maps("as given", &examined.given, width, height, &mut out);
    if let Some((by, planes)) = &examined.far {
        maps(&format!("offset {by:.1e}"), planes, width, height, &mut out);
    }
    out
}

fn line(c: &Culprit, error: &str, out: &mut String) {
    let _ = writeln!(
        out,
        "<p><b>{}:{}</b> <code>{}</code> {} ({}{error})</p><pre>{}</pre>",
        escape(&c.file),
        c.line,
        escape(&c.code),
        escape(&c.why),
        escape(&c.setting),
        escape(c.text.trim())
    );
}

/// The share of wrong points against the swept number as SVG; both axes are logarithmic.
fn curve(report: &Report, name: &str, out: &mut String) {
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
    let x = |decade: f64| 50.0 + (decade + 12.0) * 22.0;
    let y = |share: f64| 180.0 - (pxfm::f_log10(share.max(1e-4)) + 4.0) * 40.0;
    let _ = write!(
        out,
        "<h2>Points that are wrong, by {name}</h2>\n<svg viewBox=\"0 0 600 215\" width=\"600\" font-size=\"11\" \
         font-family=\"sans-serif\">"
    );
    for decade in (-12..=12).step_by(3) {
        let at = x(f64::from(decade));
        let _ = write!(
            out,
            "<line x1=\"{at}\" y1=\"20\" x2=\"{at}\" y2=\"180\" stroke=\"#ddd\"/><text x=\"{at}\" y=\"198\" \
             text-anchor=\"middle\">1e{decade}</text>"
        );
    }
    for (share, label) in [(1e-4, "0.01 %"), (1e-2, "1 %"), (1.0, "100 %")] {
        let at = y(share);
        let _ = write!(
            out,
            "<line x1=\"50\" y1=\"{at}\" x2=\"578\" y2=\"{at}\" stroke=\"#ddd\"/><text x=\"45\" y=\"{}\" \
             text-anchor=\"end\">{label}</text>",
            at + 4.0
        );
    }
    let line: Vec<String> = points.iter().map(|(d, s)| format!("{:.1},{:.1}", x(*d), y(*s))).collect();
    let _ = writeln!(
        out,
        "<polyline fill=\"none\" stroke=\"#c33\" stroke-width=\"2\" points=\"{}\"/></svg>",
        line.join(" ")
    );
}

/// A map of the digits lost for each component.
fn maps(title: &str, planes: &Planes, width: usize, height: usize, out: &mut String) {
    let _ = writeln!(out, "<h3>{}</h3>", escape(title));
    for (plane, name) in planes.names.iter().enumerate() {
        let _ = write!(
            out,
            "<figure style=\"display:inline-block;margin:.4em\"><svg class=\"map\" viewBox=\"0 0 {width} {height}\" \
             shape-rendering=\"crispEdges\"><rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>"
        );
        for y in 0..height {
            row(planes, plane, y, (width, height), out);
        }
        let _ = writeln!(out, "</svg><figcaption>{}</figcaption></figure>", escape(name));
    }
}

/// A row of a map: each run of one shade becomes one rectangle. The first row of points is the lowest of the
/// picture.
fn row(planes: &Planes, plane: usize, y: usize, (width, height): (usize, usize), out: &mut String) {
    let shade = |x: usize| {
        let at = y * width + x;
        let value = |list: &[Vec<f64>]| list.get(plane).and_then(|p| p.get(at)).copied().unwrap_or(0.0);
        (digits_lost(value(&planes.strict), value(&planes.exact)) / 7.2 * 9.0).round() as u32
    };
    let mut x = 0;
    while x < width {
        let here = shade(x);
        let end = (x + 1..width).find(|i| shade(*i) != here).unwrap_or(width);
        if here > 0 {
            let grey = 255 - here * 28;
            let _ = write!(
                out,
                "<rect x=\"{x}\" y=\"{}\" width=\"{}\" height=\"1\" fill=\"rgb({grey},{grey},{grey})\"/>",
                height - 1 - y,
                end - x
            );
        }
        x = end;
    }
}
