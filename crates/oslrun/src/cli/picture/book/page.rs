//! The page of a picture book: the source, line by line, with the pictures of what each line sets.
//!
//! The page is one file without scripts: pictures are data URLs. All text of a shader is escaped.

use super::highlight;
use crate::cli::picture::figures::Figure;
use crate::cli::picture::words;
use crate::cli::source::info::{Metadatum, Shader};
use osl_measure::page::escape;
use osl_measure::page::{END, start};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A message at a line.
pub(super) struct Warning {
    pub(super) text: String,
    pub(super) is_error: bool,
}

/// What the page says about a line.
#[derive(Default)]
pub(super) struct Line {
    pub(super) figures: Vec<Figure>,
    /// Its share of the time, from 0 to 1.
    pub(super) cost: f64,
    /// Decimal digits that are wrong in its values, of about seven.
    pub(super) lost: f64,
    pub(super) warnings: Vec<Warning>,
}

/// What a page shows.
pub(super) struct Book<'a> {
    pub(super) shader: &'a Shader,
    pub(super) file: &'a str,
    /// Values of parameters from the command line.
    pub(super) given: &'a [(String, String)],
    pub(super) text: &'a str,
    pub(super) lines: BTreeMap<u32, Line>,
    /// Width and height of the pictures.
    pub(super) size: (usize, usize),
    /// Pictures of the outputs.
    pub(super) outputs: Vec<Figure>,
    /// The start of the command that makes one of its pictures.
    pub(super) tapping: String,
    /// How the page was made.
    pub(super) command: String,
    /// What the page leaves out.
    pub(super) left_out: Vec<String>,
}

/// The largest number of lines on a page.
const LINES: usize = 5000;
/// The width of a picture on the page, and of one of a round, in pixels. The height is at most twice as
/// large.
const WIDTH: usize = 112;
const ROUND: usize = 56;

/// What is the same on all pages.
const RULES: &str = "\
:root{color-scheme:light dark;--ink:#1c2430;--paper:#fff;--dim:#5d6675;--rule:#e1e5ea;--row:#f7f8fa;--a:#d3d8df;--b:#eef0f3;\
--k:#a0309a;--t:#1f6fb2;--g:#a34a08;--f:#2b6b9a;--n:#12805c;--s:#a3531f;--c:#6d7786;--p:#7a6a10;--w:#8a5a00;--e:#b03010}\n\
@media screen and (prefers-color-scheme:dark){:root{--ink:#dde3ea;--paper:#15181d;--dim:#98a2b0;--rule:#2a2f37;--row:#1b1f25;\
--a:#31363f;--b:#23272e;--k:#e29be0;--t:#7fc0f5;--g:#f2b27c;--f:#9ad0f5;--n:#7fdcb8;--s:#f0b58c;--c:#8a94a3;--p:#d8c96a;\
--w:#f0c060;--e:#ff9a80}}\n\
body{font:14px/1.45 system-ui,sans-serif;max-width:84rem;margin:1.5rem auto;padding:0 1rem;color:var(--ink);background:var(--paper)}\n\
h1{font-size:1.5rem;margin:0}h2{font-size:1.1rem;margin:1.6rem 0 .4rem}p{margin:.3rem 0}.dim{color:var(--dim)}\n\
table{border-collapse:collapse}td,th{vertical-align:top;text-align:left;padding:.1rem .5rem}\n\
th{font-weight:400;font-size:12px;color:var(--dim)}\n\
.src{width:100%;table-layout:fixed}.src td,.src th{padding:0 .4rem}.src .has td{border-top:1px solid var(--rule);background:var(--row)}\n\
.src .m{width:6px;padding:0}.src .no{width:2.6rem;text-align:right;color:var(--dim);font:12px/1.5 ui-monospace,monospace}\n\
.src .code{width:42%;font:12px/1.5 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere;tab-size:4}\n\
.src th{font:12px/1.5 system-ui,sans-serif}.say{display:block;color:var(--dim);font:11px/1.4 system-ui,sans-serif}\n\
i{font-style:normal}.k{color:var(--k)}.t{color:var(--t)}.g{color:var(--g)}.f{color:var(--f)}.n{color:var(--n)}.s{color:var(--s)}\
.c{color:var(--c);font-style:italic}.p{color:var(--p)}\n\
figure{display:inline-block;margin:.3rem .8rem .4rem 0;vertical-align:top;max-width:min(15rem,100%)}\n\
figcaption,details{font-size:11.5px;line-height:1.3;overflow-wrap:anywhere}details{color:var(--dim)}summary{cursor:pointer}\
figcaption b{font-family:ui-monospace,monospace}\n\
img{image-rendering:pixelated;border:1px solid var(--rule);display:block;print-color-adjust:exact;-webkit-print-color-adjust:exact;\
background:repeating-linear-gradient(45deg,var(--a) 0 3px,var(--b) 3px 6px)}\n\
.rounds{display:flex;flex-wrap:wrap;gap:3px;align-items:end;font-size:10px;color:var(--dim);margin-top:2px}\n\
.w{color:var(--w);font:12px/1.4 system-ui,sans-serif;display:block}.e{color:var(--e)}\n\
.wide{overflow-x:auto}.params td{border-top:1px solid var(--rule);font-size:13px}\
.params td:nth-child(n+3){overflow-wrap:anywhere}code{font:12px ui-monospace,monospace;overflow-wrap:anywhere}\n\
@media screen and (max-width:40rem){.src,.src tbody{display:block}.src colgroup{display:none}.src tr{display:grid;grid-template-columns:6px 6px 2.6rem 1fr}.src .no,.src .code{width:auto}\
.src td:last-child,.src th:last-child{grid-column:1/-1}}\n\
@media print{body{max-width:none;margin:0;font-size:11px}tr,figure{break-inside:avoid}.src .has td{background:none}\
.m{print-color-adjust:exact;-webkit-print-color-adjust:exact}details{display:none}}\n";

/// The page.
pub(super) fn html(book: &Book<'_>) -> String {
    let mut page = start(&format!("{}: picture book", book.shader.name), &[RULES]);
    let (name, kind) = (escape(&book.shader.name), book.shader.kind);
    let (width, height) = book.size;
    let _ = write!(
        page,
        "<h1>{name}</h1><p class=dim>{kind} in {}: the numbers, colors, points and vectors that each line sets, at {width} × \
         {height} points; u grows to the right, v downwards. Matrices, strings and closures have no picture.</p>",
        escape(book.file),
    );
    if !book.shader.metadata.is_empty() {
        page.push_str("<p>");
        metadata(&book.shader.metadata, &mut page);
        page.push_str("</p>");
    }
    if !book.outputs.is_empty() {
        page.push_str("<h2>Outputs</h2>");
        book.outputs.iter().for_each(|one| figure(one, book, &mut page));
    }
    parameters(book, &mut page);
    page.push_str(
        "<h2>Source</h2><p class=dim>A picture shows a variable after the line; in a loop or a function, the last time \
         that a point gets there, with the first times below in the same colors. Striped points do not get there. The \
         left margin is red where time goes, the next one blue where digits are lost in single precision. Below a picture \
         is the command that shows its values.</p><table class=src><colgroup><col class=m><col class=m><col class=no><col \
         class=code><col></colgroup><tr><th class=m aria-label=time></th><th class=m aria-label=\"digits lost\"></th><th \
         class=no>line</th><th class=code>source</th><th>what it sets</th></tr>",
    );
    let mut state = highlight::State::default();
    let none = Line::default();
    for (at, text) in book.text.lines().take(LINES).enumerate() {
        let number = at as u32 + 1;
        let line = book.lines.get(&number).unwrap_or(&none);
        row(number, &highlight::line(text, &mut state), line, book, &mut page);
    }
    page.push_str("</table>");
    let more = book.text.lines().count().saturating_sub(LINES);
    let more = (more > 0).then(|| format!("{more} more lines are left out"));
    for text in book.left_out.iter().chain(&more) {
        let _ = write!(page, "<p class=dim>{}</p>", escape(text));
    }
    let (command, version) = (escape(&book.command), env!("CARGO_PKG_VERSION"));
    let _ = write!(page, "<p class=dim>Made with oslrun {version}: <code>{command}</code></p>{END}");
    page
}

fn row(number: u32, code: &str, line: &Line, book: &Book<'_>, page: &mut String) {
    let has = if line.figures.is_empty() { "" } else { " class=has" };
    let _ = write!(page, "<tr{has} id=L{number}>");
    // The last digit is never sure.
    let lost = if line.lost < 1.0 { 0.0 } else { line.lost / 7.0 };
    let shares = [([200, 40, 20], line.cost), ([30, 90, 220], lost)];
    shares.into_iter().for_each(|(color, share)| margin(color, share, page));
    let _ = write!(page, "<td class=no>{number}</td><td class=code>{code}");
    let time = (line.cost >= LEAST).then(|| format!("{:.0} % of the time", 100.0 * line.cost));
    let digits = (lost >= LEAST).then(|| format!("about {:.1} of 7 digits lost", line.lost));
    let said: Vec<String> = time.into_iter().chain(digits).collect();
    if !said.is_empty() {
        let _ = write!(page, "<span class=say>{}</span>", said.join("; "));
    }
    for warning in &line.warnings {
        let class = if warning.is_error { "w e" } else { "w" };
        let _ = write!(page, "<span class=\"{class}\">⚠ {}</span>", escape(&warning.text));
    }
    page.push_str("</td><td>");
    line.figures.iter().for_each(|one| figure(one, book, page));
    page.push_str("</td></tr>\n");
}

/// The smallest share that a margin shows.
const LEAST: f64 = 0.01;

/// A cell of a margin.
fn margin([r, g, b]: [u8; 3], share: f64, page: &mut String) {
    if share < LEAST {
        page.push_str("<td class=m></td>");
        return;
    }
    let alpha = (0.15 + 0.85 * share.min(1.0).sqrt()).min(1.0);
    let _ = write!(page, "<td class=m style=\"background:rgba({r},{g},{b},{alpha:.2})\"></td>");
}

/// Adds the command that shows the values of a picture, if there is one, and how its picture differs.
fn command(figure: &Figure, book: &Book<'_>, page: &mut String) {
    if figure.tap.is_empty() || figure.url.is_none() {
        return;
    }
    let (tap, typed) = (words::quoted(&figure.tap), &figure.typed);
    let command = format!("{} --tap {tap}{} -o picture.png", book.tapping, typed.options);
    let _ = write!(page, "<details><summary>command</summary><code>{}</code>", escape(&command));
    if !typed.differs.is_empty() {
        let _ = write!(page, " <span>shows the values: {}</span>", escape(&typed.differs));
    }
    if typed.has_mask {
        page.push_str(" <span>writes two files: the second one is white at the points that get there</span>");
    }
    page.push_str("</details>");
}

/// The size of a picture on the page, with so many pixels per row unless it is too high then.
fn size((columns, rows): (usize, usize), width: usize) -> String {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let width = width.min((2 * width * columns / rows).max(1));
    format!("width={width} height={}", (width * rows / columns).max(1))
}

fn figure(figure: &Figure, book: &Book<'_>, page: &mut String) {
    let Figure { name, ty, url, words, rounds, .. } = figure;
    let (name, ty, words) = (escape(name), escape(ty), escape(words));
    page.push_str("<figure>");
    if let Some(url) = url {
        let _ = write!(page, "<img src=\"{url}\" {} alt=\"{name}: {words}\">", size(book.size, WIDTH));
    }
    let ty = if ty.is_empty() { ty } else { format!("<span class=dim>{ty}</span> ") };
    let _ = write!(page, "<figcaption>{ty}<b>{name}</b> <span class=dim>{words}</span></figcaption>");
    if !rounds.is_empty() {
        let first = if rounds.len() == 1 {
            "the first time".to_string()
        } else {
            format!("the first {}", rounds.len())
        };
        let _ = write!(page, "<div class=rounds><span>{first}:</span>");
        for (at, url) in rounds.iter().enumerate() {
            let size = size(book.size, ROUND);
            let _ = write!(page, "<img src=\"{url}\" {size} alt=\"{name}, time {}\">", at + 1);
        }
        page.push_str("</div>");
    }
    command(figure, book, page);
    page.push_str("</figure>");
}

/// A value of JSON as text.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

fn metadata(list: &[Metadatum], page: &mut String) {
    for datum in list {
        let value = escape(&plain(&datum.value));
        let _ = match datum.name.as_str() {
            "help" => write!(page, "{value} "),
            name => write!(page, "<span class=dim>{} {value}</span> ", escape(name)),
        };
    }
}

fn parameters(book: &Book<'_>, page: &mut String) {
    if book.shader.parameters.is_empty() {
        return;
    }
    page.push_str(
        "<h2>Parameters</h2><div class=wide><table class=params><tr><th>type</th><th>name</th><th>value</th><th>about</th></tr>",
    );
    for param in &book.shader.parameters {
        let given = book.given.iter().rev().find(|(name, _)| *name == param.name);
        let value = match (given, &param.default) {
            (Some((_, value)), _) => format!("{value} (given)"),
            (None, Value::Null) => "computed".to_string(),
            (None, value) => value.to_string(),
        };
        let output = if param.output { "output " } else { "" };
        let _ = write!(
            page,
            "<tr><td class=dim>{output}{}</td><td><code>{}</code></td><td><code>{}</code></td><td>",
            escape(&param.ty),
            escape(&param.name),
            escape(&value)
        );
        metadata(&param.metadata, page);
        page.push_str("</td></tr>");
    }
    page.push_str("</table></div>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_picture_is_much_higher_than_wide() {
        assert_eq!(size((64, 64), 112), "width=112 height=112");
        assert_eq!(size((128, 4), 112), "width=112 height=3");
        assert_eq!(size((4, 128), 112), "width=7 height=224");
        assert_eq!(size((1, 128), 56), "width=1 height=128");
    }
}
