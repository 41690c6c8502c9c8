//! The report as one self-contained HTML page: the levels, the table, the pictures of each footprint side by
//! side, and the fronts.

use super::report::{MANY, Picture, Report};
use super::text::text;
use crate::explain::short;
use crate::markup::escape;
use crate::tradeoff::Encode;
use std::fmt::Write;

/// The page.
pub fn html(report: &Report, encode: Encode<'_>) -> String {
    let mut page = String::from(HEAD);
    let name = escape(&report.name);
    let _ = write!(
        page,
        "<title>{name}: levels of detail</title></head><body><h1>{name}: levels of detail</h1><pre>{}</pre>",
        text(report).lines().map(escape).collect::<Vec<String>>().join("\n")
    );
    for row in &report.rows {
        let _ = write!(page, "<h2>Footprint {}</h2>", row.footprint);
        let own = report.pictures.iter().filter(|picture| picture.footprint == row.footprint);
        own.for_each(|picture| side_by_side(picture, encode, &mut page));
        page.push_str(
            "<table><tr><th>way</th><th>cost in additions</th><th>error of the worst output</th></tr>",
        );
        for way in &row.front {
            let _ = write!(
                page,
                "<tr{}><td>{}</td><td>{}</td><td>{} %</td></tr>",
                if way.is_best { " class=\"front\"" } else { "" },
                escape(&way.name),
                short(way.cost, 3),
                short(100.0 * way.error, 2)
            );
        }
        page.push_str("</table>");
    }
    page.push_str("<p>Marked rows are the front: nothing else is as cheap and as close.</p>");
    if let Some(source) = &report.text {
        page.push_str("<h2>The written shader</h2><pre>");
        for line in source.lines() {
            let _ = writeln!(page, "{}", escape(line));
        }
        page.push_str("</pre>");
    }
    page.push_str("</body></html>\n");
    page
}

const HEAD: &str = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><style>\
body{font:14px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff}\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}\
pre{font:12px/1.4 ui-monospace,monospace;overflow-x:auto;background:#f6f8fb;padding:.6rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin-top:.6rem}td,th{padding:.15rem .7rem;text-align:right}\
td:first-child,th:first-child{text-align:left}tr.front{background:#eef4ff;font-weight:600}\
figure{display:inline-block;margin:.4rem 1rem 0 0}figcaption{font-size:12px}img{image-rendering:pixelated;width:192px}</style>\n";

fn side_by_side(picture: &Picture, encode: Encode<'_>, page: &mut String) {
    let many = format!("{}, {} samples", picture.output, MANY);
    let names = [many, "original, 1 sample".to_string(), "with levels, 1 sample".to_string()];
    page.push_str("<div>");
    for (planes, name) in picture.images.iter().zip(names) {
        if let Some(url) = encode(picture.size, picture.size, planes) {
            let name = escape(&name);
            let _ = write!(
                page,
                "<figure><img alt=\"{name}\" src=\"{url}\"><figcaption>{name}</figcaption></figure>"
            );
        }
    }
    page.push_str("</div>");
}
