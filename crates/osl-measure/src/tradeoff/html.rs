//! A trade-off as one self-contained HTML page: for each output a plot, the table and pictures of the errors.

use super::advice::{advice, short};
use super::{Error, Output, Row, Trade};
use crate::markup::escape;
use pxfm::{f_exp10, f_log10, f_log10f};
use std::fmt::Write;

/// Encodes three planes with values 0 to 1 as a picture in a data URL; `None` if that fails.
pub type Encode<'a> = &'a dyn Fn(usize, usize, &[Vec<f32>]) -> Option<String>;

/// The page.
pub fn html(trade: &Trade, encode: Encode<'_>) -> String {
    let mut page = String::from(HEAD);
    let _ = write!(
        page,
        "<title>{name}: speed and accuracy</title></head><body><h1>{name}: speed and accuracy</h1>\
         <p>{}×{} pixels. Errors are against {} samples a pixel ({}), whose own standard error is subtracted. Times are \
         medians of {} interleaved rounds. Filled dots: nothing else is quicker and as close, or closer and as quick; differences within \
         the spread of the times do not count.</p>",
        trade.size.0,
        trade.size.1,
        trade.oracle_samples,
        escape(&trade.oracle),
        trade.repeats,
        name = escape(&trade.name),
    );
    for output in &trade.outputs {
        let _ = write!(page, "<h2>{}</h2>", escape(&output.name));
        plot(trade, output, &mut page);
        table(trade, output, &mut page);
        pictures(trade, output, encode, &mut page);
    }
    page.push_str("</body></html>\n");
    page
}

const HEAD: &str = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><style>\
body{font:14px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff}\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}td,th{padding:.15rem .7rem;text-align:right}\
td:first-child,th:first-child{text-align:left}tr.front{background:#eef4ff;font-weight:600}\
figure{display:inline-block;margin:.8rem 1rem 0 0}figcaption{font-size:12px}img{image-rendering:pixelated;width:160px}\
svg text{font:11px system-ui,sans-serif;fill:#1c2430}</style>\n";

/// Positions of names in a plot: beside their dots, without overlapping each other or the dots.
struct Labels {
    /// Left, right, top, bottom.
    taken: Vec<[f64; 4]>,
}

impl Labels {
    /// No names yet; the dots are taken.
    fn beside(dots: impl Iterator<Item = (f64, f64)>) -> Labels {
        Labels { taken: dots.map(|(x, y)| [x - 5.0, x + 5.0, y - 5.0, y + 5.0]).collect() }
    }

    /// The position of a dot's name, if there is room for it.
    fn place(&mut self, x: f64, y: f64, letters: usize) -> Option<(f64, f64)> {
        let width = 6.0 * letters as f64;
        let beside = [(7.0, 3.5), (-width - 7.0, 3.5), (7.0, -7.0), (7.0, 14.0), (-width - 7.0, -7.0)];
        let free = |(left, base): &(f64, f64)| {
            let own = [*left, left + width, base - 9.0, base + 2.0];
            let apart = |other: &[f64; 4]| {
                own[0] > other[1] || own[1] < other[0] || own[2] > other[3] || own[3] < other[2]
            };
            *left > 60.0 && *base > 20.0 && *base < 300.0 && self.taken.iter().all(apart)
        };
        let found = beside.map(|(dx, dy)| (x + dx, y + dy)).into_iter().find(free)?;
        self.taken.push([found.0, found.0 + width, found.1 - 9.0, found.1 + 2.0]);
        Some(found)
    }
}

/// A logarithmic axis over some values.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// Whole decades around the values, mapped to an interval of the plot.
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Axis {
        let (low, high) = values
            .filter(|v| v.is_finite() && *v > 0.0)
            .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) =
            if low.is_finite() { (f_log10(low).floor(), f_log10(high).ceil()) } else { (0.0, 1.0) };
        Axis { low, high: high.max(low + 1.0), from, to }
    }

    /// The position of a value; values that are not positive lie at the start.
    fn place(&self, value: f64) -> f64 {
        let share = (f_log10(value.max(f64::MIN_POSITIVE)) - self.low) / (self.high - self.low);
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    fn decades(&self) -> impl Iterator<Item = f64> {
        (self.low as i32..=self.high as i32).map(|e| f_exp10(f64::from(e)))
    }
}

fn plot(trade: &Trade, output: &Output, page: &mut String) {
    let x = Axis::new(trade.rows.iter().map(|row| row.ns_per_pixel), 60.0, 660.0);
    let y = Axis::new(output.errors.iter().map(|error| error.rms), 300.0, 20.0);
    page.push_str(
        "<svg viewBox=\"0 0 820 340\" width=\"820\" role=\"img\" aria-label=\"error against time\">",
    );
    for at in x.decades() {
        let p = x.place(at);
        let _ = write!(
            page,
            "<line x1=\"{p:.1}\" x2=\"{p:.1}\" y1=\"20\" y2=\"300\" stroke=\"#dde3ec\"/>\
             <text x=\"{p:.1}\" y=\"316\" text-anchor=\"middle\">{at}</text>"
        );
    }
    for at in y.decades() {
        let p = y.place(at);
        let _ = write!(
            page,
            "<line x1=\"60\" x2=\"660\" y1=\"{p:.1}\" y2=\"{p:.1}\" stroke=\"#dde3ec\"/>\
             <text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">{at:e}</text>",
            p + 4.0
        );
    }
    page.push_str(
        "<text x=\"360\" y=\"334\" text-anchor=\"middle\">nanoseconds a pixel</text>\
         <text x=\"62\" y=\"14\">root mean square error</text>",
    );
    let mut line = String::new();
    for row in &output.front {
        if let (Some(times), Some(error)) = (trade.rows.get(*row), output.errors.get(*row)) {
            let _ = write!(line, "{:.1},{:.1} ", x.place(times.ns_per_pixel), y.place(error.rms));
        }
    }
    let _ =
        write!(page, "<polyline points=\"{line}\" fill=\"none\" stroke=\"#2f6fde\" stroke-width=\"1.5\"/>");
    let dots = || trade.rows.iter().zip(&output.errors).enumerate();
    let place = |row: &Row, error: &Error| (x.place(row.ns_per_pixel), y.place(error.rms));
    let mut labels = Labels::beside(dots().map(|(_, (row, error))| place(row, error)));
    // Names of settings on the front are placed first.
    let on_front = |(at, _): &(usize, _)| output.front.contains(at);
    for (at, (row, error)) in dots().filter(on_front).chain(dots().filter(|dot| !on_front(dot))) {
        let fill = if output.front.contains(&at) { "#2f6fde" } else { "#fff" };
        let name = escape(&format!("{}, {}", row.variant, row.setting));
        let (px, py) = place(row, error);
        let _ = write!(
            page,
            "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4\" fill=\"{fill}\" stroke=\"#2f6fde\"><title>{name}</title></circle>"
        );
        if let Some((x, y)) = labels.place(px, py, name.len()) {
            let _ = write!(page, "<text x=\"{x:.1}\" y=\"{y:.1}\">{name}</text>");
        }
    }
    page.push_str("</svg>");
}

fn table(trade: &Trade, output: &Output, page: &mut String) {
    let _ = write!(
        page,
        "<p>Range {}. The oracle's own standard error: {:.1e}.</p><table><tr><th>setting</th><th>ns/pixel</th><th>spread</th>\
         <th>speed-up</th><th>evaluations a pixel</th><th>rms error</th><th>of range</th><th>99.9 %</th><th>of range</th><th>largest</th></tr>",
        short(output.range),
        output.oracle_error
    );
    for (at, (row, error)) in trade.rows.iter().zip(&output.errors).enumerate() {
        let class = if output.front.contains(&at) { " class=\"front\"" } else { "" };
        let _ = write!(
            page,
            "<tr{class}><td>{}, {}</td><td>{:.1}</td><td>±{:.0} %</td><td>{:.2}×</td><td>{:.3}</td><td>{:.1e}</td>\
             <td>{:.2} %</td><td>{:.1e}</td><td>{:.2} %</td><td>{:.1e}</td></tr>",
            escape(&row.variant),
            escape(&row.setting),
            row.ns_per_pixel,
            100.0 * row.spread,
            row.speed_up,
            row.evaluations,
            error.rms,
            100.0 * error.rms / output.range,
            error.nearly_all,
            100.0 * error.nearly_all / output.range,
            error.largest
        );
    }
    page.push_str("</table><p>What to take for an error at 999 of 1000 pixels:</p><ul>");
    let advice = advice(trade, output);
    for line in advice.lines().chain(trade.idle.iter().map(String::as_str)) {
        let _ = write!(page, "<li>{}</li>", escape(line));
    }
    page.push_str("</ul>");
}

/// Errors as colors from black over red and yellow to white, by decades: white is 1 or more, black 0.0001 or
/// less.
fn pictures(trade: &Trade, output: &Output, encode: Encode<'_>, page: &mut String) {
    let mut any = false;
    for (row, picture) in output.front.iter().zip(&output.pictures) {
        let height = picture.values.len() / picture.width.max(1);
        let heat = |shift: f32| {
            let one = |error: &f32| ((1.0 + f_log10f(error.max(1e-4)) / 4.0) * 3.0 - shift).clamp(0.0, 1.0);
            picture.values.iter().map(one).collect::<Vec<f32>>()
        };
        let url = encode(picture.width, height, &[heat(0.0), heat(1.0), heat(2.0)]);
        if let (Some(url), Some(row)) = (url, trade.rows.get(*row)) {
            let name = escape(&format!("{}, {}", row.variant, row.setting));
            let _ = write!(
                page,
                "<figure><img alt=\"errors\" src=\"{url}\"><figcaption>{name}</figcaption></figure>"
            );
            any = true;
        }
    }
    if any {
        page.push_str("<p>Errors of the front: black 10⁻⁴ or less, red, yellow, white 1 or more.</p>");
    }
}
