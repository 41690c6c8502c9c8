//! What the HTML pages of all reports share: the frame, prose, tables, figures and plots.
//!
//! A page is one file that loads nothing and has no scripts. All text of a shader is escaped.

use osl_syntax::escape::shown;
use pxfm::{f_exp10, f_log10};
use std::fmt::{Display, Write};

/// Encodes three planes with values 0 to 1 as a picture in a data URL; `None` if that fails.
pub type Encode<'a> = &'a dyn Fn(usize, usize, &[Vec<f32>]) -> Option<String>;

/// The rules of reports. `.wide` scrolls by itself what is wider than the screen.
const REPORT: &str = "\
body{font:14px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff;\
overflow-wrap:anywhere}\n\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}h3{font-size:1rem}\n\
pre,code{font:12px/1.4 ui-monospace,monospace;background:#f6f8fb}pre{padding:.6rem;overflow-x:auto;overflow-wrap:normal}\n\
.wide{overflow-x:auto}.wide>svg{max-width:100%;min-width:32rem;height:auto}\n\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin-top:.6rem}\
td,th{padding:.15rem .7rem;text-align:right;white-space:nowrap}\
td:first-child,th:first-child{text-align:left}tr.front{background:#eef4ff;font-weight:600}\n\
figure{display:inline-block;margin:.4rem 1rem .4rem 0;vertical-align:top}figcaption{font-size:12px}\
img{image-rendering:pixelated;max-width:100%}\n\
svg text{font:11px system-ui,sans-serif;fill:#1c2430}\n";

/// Escapes a text for HTML and SVG, also inside quotes of either kind. Control characters are written out as
/// in messages, since XML permits most of them nowhere.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in shown(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// The start of a page up to its body: the language, the title, and the rules.
pub fn start(title: &str, rules: &[&str]) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" content=\"default-src \
         'none'; img-src data:; style-src 'unsafe-inline'\"><title>{}</title><style>\n{}</style></head>\n<body>",
        escape(title),
        rules.concat()
    )
}

/// The end of a page.
pub const END: &str = "</body></html>\n";

/// A text for HTML, in which parts between backticks are code.
pub(crate) fn prose(text: &str) -> String {
    let escaped = escape(text);
    let mut parts = escaped.split('`');
    let mut out = parts.next().unwrap_or_default().to_string();
    while let Some(code) = parts.next() {
        match parts.next() {
            Some(after) => out.extend(["<code>", code, "</code>", after]),
            // Alone, a backtick is a backtick.
            None => out.extend(["`", code]),
        }
    }
    out
}

/// The page of a report, part by part.
pub(crate) struct Page {
    /// The page so far.
    pub(crate) text: String,
}

impl Page {
    /// A page with a title, and rules besides those of all reports.
    pub(crate) fn new(title: &str, rules: &str) -> Page {
        Page { text: format!("{}<h1>{}</h1>\n", start(title, &[REPORT, rules]), escape(title)) }
    }

    /// The whole page.
    pub(crate) fn ended(self) -> String {
        self.text + END
    }

    pub(crate) fn heading(&mut self, level: u8, text: &str) {
        let _ = writeln!(self.text, "<h{level}>{}</h{level}>", escape(text));
    }

    /// A paragraph of prose.
    pub(crate) fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.text, "<p>{}</p>", prose(text));
    }

    /// A paragraph for each line.
    pub(crate) fn paragraphs(&mut self, text: &str) {
        text.lines().map(str::trim).filter(|line| !line.is_empty()).for_each(|line| self.paragraph(line));
    }

    /// Items of prose.
    pub(crate) fn list<'t>(&mut self, items: impl Iterator<Item = &'t str>) {
        let items: String = items.map(|item| format!("<li>{}</li>", prose(item))).collect();
        let _ = writeln!(self.text, "<ul>{items}</ul>");
    }

    /// Lines with a fixed pitch. An escaped text has no line ends, so each line is escaped by itself.
    pub(crate) fn lines(&mut self, text: &str) {
        let lines: Vec<String> = text.lines().map(escape).collect();
        let _ = writeln!(self.text, "<pre>{}</pre>", lines.join("\n"));
    }

    /// A table: its titles, and rows that may be marked.
    pub(crate) fn table<T: Display>(
        &mut self,
        titles: impl IntoIterator<Item = T>,
        rows: impl Iterator<Item = (bool, Vec<String>)>,
    ) {
        self.text.push_str("<div class=wide><table>");
        self.row("", "th", titles);
        rows.for_each(|(is_marked, row)| self.row(if is_marked { " class=front" } else { "" }, "td", row));
        self.text.push_str("</table></div>\n");
    }

    fn row<T: Display>(&mut self, class: &str, name: &str, cells: impl IntoIterator<Item = T>) {
        let cells = cells.into_iter().map(|cell| format!("<{name}>{}</{name}>", escape(&cell.to_string())));
        let _ = write!(self.text, "<tr{class}>{}</tr>", cells.collect::<String>());
    }

    /// A picture with its caption, and what it shows for those who do not see it.
    pub(crate) fn picture(&mut self, url: &str, caption: &str, shows: &str) {
        let (caption, shows) = (escape(caption), escape(shows));
        let _ = writeln!(
            self.text,
            "<figure><img alt=\"{shows}\" src=\"{url}\"><figcaption>{caption}</figcaption></figure>"
        );
    }

    /// Begins a plot of a size; its title tells what it shows.
    pub(crate) fn plot(&mut self, [width, height]: [f64; 2], title: &str) {
        let _ = write!(
            self.text,
            "<div class=wide><svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" role=\"img\" aria-label=\"{}\">",
            escape(title)
        );
    }

    pub(crate) fn end_plot(&mut self) {
        self.text.push_str("</svg></div>\n");
    }

    /// A text in a plot: where, how it is anchored (`start`, `middle`, `end`), and what.
    pub(crate) fn label(&mut self, [x, y]: [f64; 2], anchor: &str, text: &str) {
        let _ = write!(
            self.text,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escape(text)
        );
    }

    /// A line of the grid at a mark of the horizontal axis, from the top to the bottom.
    pub(crate) fn mark_x(&mut self, x: f64, [top, bottom]: [f64; 2], text: &str) {
        self.grid_line([x, x], [top, bottom]);
        self.label([x, bottom + 16.0], "middle", text);
    }

    /// A line of the grid at a mark of the vertical axis, from the left to the right.
    pub(crate) fn mark_y(&mut self, y: f64, [left, right]: [f64; 2], text: &str) {
        self.grid_line([left, right], [y, y]);
        self.label([left - 6.0, y + 4.0], "end", text);
    }

    fn grid_line(&mut self, [x1, x2]: [f64; 2], [y1, y2]: [f64; 2]) {
        let _ = write!(
            self.text,
            "<line x1=\"{x1:.1}\" x2=\"{x2:.1}\" y1=\"{y1:.1}\" y2=\"{y2:.1}\" stroke=\"#dde3ec\"/>"
        );
    }

    /// A line through points.
    pub(crate) fn curve(&mut self, points: impl Iterator<Item = (f64, f64)>, color: &str) {
        let points: Vec<String> = points.map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let points = points.join(" ");
        let _ = write!(
            self.text,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>"
        );
    }
}

/// The share of an axis between 0 and the smallest decade.
const ZERO: f64 = 0.12;

/// A logarithmic axis. Values that are 0 have a place of their own before it.
pub(crate) struct Axis {
    /// The powers of ten at its ends.
    pub(crate) decades: [f64; 2],
    /// The positions of its ends in the plot.
    pub(crate) ends: [f64; 2],
    /// The position of 0, if it has one.
    pub(crate) zero: Option<f64>,
}

impl Axis {
    /// Whole decades around some values, mapped to an interval of the plot.
    pub(crate) fn around(values: impl Iterator<Item = f64>, [from, to]: [f64; 2]) -> Axis {
        let (mut low, mut high, mut has_zero) = (f64::INFINITY, 0.0_f64, false);
        for value in values.filter(|value| value.is_finite()) {
            match value > 0.0 {
                true => (low, high) = (low.min(value), high.max(value)),
                false => has_zero = true,
            }
        }
        let (zero, from) = if has_zero { (Some(from), from + ZERO * (to - from)) } else { (None, from) };
        // Without a value above 0 there is nothing but 0.
        let (low, high) =
            if low.is_finite() { (f_log10(low).floor(), f_log10(high).ceil()) } else { (0.0, -1.0) };
        let high = if low == high { low + 1.0 } else { high };
        Axis { decades: [low, high], ends: [from, to], zero }
    }

    /// The position of a value.
    pub(crate) fn place(&self, value: f64) -> f64 {
        if let Some(zero) = self.zero.filter(|_| value <= 0.0) {
            return zero;
        }
        let ([low, high], [from, to]) = (self.decades, self.ends);
        let share = (f_log10(value.max(f64::MIN_POSITIVE)) - low) / (high - low);
        from + share.clamp(0.0, 1.0) * (to - from)
    }

    /// The values that have a line.
    pub(crate) fn marks(&self) -> impl Iterator<Item = f64> + use<> {
        let [low, high] = self.decades;
        let decades = (low as i32..=high as i32).map(|e| f_exp10(f64::from(e)));
        self.zero.map(|_| 0.0).into_iter().chain(decades)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_between_backticks_are_code() {
        assert_eq!(
            prose("take `--samples 4`, or `a<b`."),
            "take <code>--samples 4</code>, or <code>a&lt;b</code>."
        );
        assert_eq!(prose("none"), "none");
        assert_eq!(prose("`a` and ` alone"), "<code>a</code> and ` alone");
        assert_eq!(prose("`"), "`");
    }

    #[test]
    fn a_title_is_text() {
        assert!(start("<b>", &["a{}", "b{}"]).contains("<title>&lt;b&gt;</title><style>\na{}b{}</style>"));
    }

    #[test]
    fn values_of_0_have_a_place_of_their_own() {
        let axis = Axis::around([0.02, 0.0, 0.5].into_iter(), [300.0, 20.0]);
        assert_eq!(axis.marks().collect::<Vec<_>>(), [0.0, 0.01, 0.1, 1.0]);
        assert!(axis.place(0.0) == 300.0 && axis.place(0.01) < 270.0 && axis.place(1.0) == 20.0);
        let nothing = Axis::around([0.0, 0.0].into_iter(), [300.0, 20.0]);
        assert_eq!((nothing.marks().collect::<Vec<_>>(), nothing.place(0.0)), (vec![0.0], 300.0));
        let positive = Axis::around([0.1, 0.1].into_iter(), [60.0, 660.0]);
        assert_eq!((positive.marks().count(), positive.place(0.1)), (2, 60.0));
    }
}
