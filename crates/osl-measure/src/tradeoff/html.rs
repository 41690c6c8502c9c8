//! A trade-off as one self-contained HTML page: for each output a plot, the table and pictures of the errors.

use super::advice::{HINT, advice, short};
use super::{Error, Output, Row, Trade};
use crate::markup::escape;
use crate::page::{END, REPORT, prose, start};
use pxfm::{f_exp10, f_log10, f_log10f};
use std::fmt::Write;

/// Encodes three planes with values 0 to 1 as a picture in a data URL; `None` if that fails.
pub type Encode<'a> = &'a dyn Fn(usize, usize, &[Vec<f32>]) -> Option<String>;

/// The page.
pub fn html(trade: &Trade, encode: Encode<'_>) -> String {
    let mut page = start(&format!("{}: speed and accuracy", trade.name), &[REPORT, RULES]);
    let _ = write!(
        page,
        "<h1>{name}: speed and accuracy</h1>\
         <p>{}×{} pixels. Errors are against {} samples a pixel ({}), whose own standard error is subtracted. Times are \
         medians of {} interleaved rounds, and the spread is how far the fastest round is below. Filled dots and marked \
         rows are the front: none of them is better than another one without being worse too, and for each other setting \
         there is one of them that is not worse; differences within the spread of the times do not count.</p>",
        trade.size.0,
        trade.size.1,
        trade.oracle_samples,
        escape(&trade.oracle),
        trade.repeats,
        name = escape(&trade.name),
    );
    let _ = write!(page, "<p>{}:</p><ul>", prose(HINT));
    for line in advice(trade).lines().chain(trade.idle.iter().map(String::as_str)) {
        let _ = write!(page, "<li>{}</li>", prose(line));
    }
    page.push_str("</ul>");
    for output in &trade.outputs {
        let _ = write!(page, "<h2>{}</h2>", escape(&output.name));
        plot(trade, output, &mut page);
        table(trade, output, &mut page);
        pictures(trade, output, encode, &mut page);
    }
    page.push_str(END);
    page
}

const RULES: &str = "figure img{width:160px}\n";

/// The width of a plot, and the place of the title of its vertical axis: left, right, top, bottom.
const WIDTH: f64 = 820.0;
const TITLE: [f64; 4] = [62.0, 220.0, 4.0, 18.0];

/// Positions of names in a plot: beside their dots, without overlapping each other or the dots.
struct Labels {
    /// Left, right, top, bottom.
    taken: Vec<[f64; 4]>,
}

impl Labels {
    /// No names yet; the dots are taken, and so is the title of the vertical axis.
    fn beside(dots: impl Iterator<Item = (f64, f64)>) -> Labels {
        let dots = dots.map(|(x, y)| [x - 5.0, x + 5.0, y - 5.0, y + 5.0]);
        Labels { taken: dots.chain([TITLE]).collect() }
    }

    /// The position of a dot's name, if there is room for it.
    fn place(&mut self, x: f64, y: f64, letters: usize) -> Option<(f64, f64)> {
        let width = 6.0 * letters as f64;
        let beside = [(7.0, 3.5), (-width - 7.0, 3.5), (7.0, -8.0), (7.0, 15.0), (-width - 7.0, -8.0)];
        let free = |(left, base): &(f64, f64)| {
            let own = [*left, left + width, base - 9.0, base + 2.0];
            let apart = |other: &[f64; 4]| {
                own[0] > other[1] || own[1] < other[0] || own[2] > other[3] || own[3] < other[2]
            };
            let fits = *left > 60.0 && left + width < WIDTH && *base > 20.0 && *base < 300.0;
            fits && self.taken.iter().all(apart)
        };
        let found = beside.map(|(dx, dy)| (x + dx, y + dy)).into_iter().find(free)?;
        self.taken.push([found.0, found.0 + width, found.1 - 9.0, found.1 + 2.0]);
        Some(found)
    }
}

/// A logarithmic axis over some values. Values that are 0 have a place of their own before it.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    zero: Option<f64>,
}

impl Axis {
    /// Whole decades around the values, mapped to an interval of the plot.
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Axis {
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
        Axis { low, high, from, to, zero }
    }

    /// The position of a value.
    fn place(&self, value: f64) -> f64 {
        if let Some(zero) = self.zero.filter(|_| value <= 0.0) {
            return zero;
        }
        let share = (f_log10(value.max(f64::MIN_POSITIVE)) - self.low) / (self.high - self.low);
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// The values that have a line.
    fn marks(&self) -> impl Iterator<Item = f64> {
        let decades = (self.low as i32..=self.high as i32).map(|e| f_exp10(f64::from(e)));
        self.zero.map(|_| 0.0).into_iter().chain(decades)
    }
}

/// The share of an axis between 0 and the smallest decade.
const ZERO: f64 = 0.12;

fn plot(trade: &Trade, output: &Output, page: &mut String) {
    let x = Axis::new(trade.rows.iter().map(|row| row.ns_per_pixel), 60.0, 660.0);
    let y = Axis::new(output.errors.iter().map(|error| error.rms), 300.0, 20.0);
    let name = escape(&output.name);
    let _ = write!(
        page,
        "<div class=wide><svg viewBox=\"0 0 {WIDTH} 340\" width=\"{WIDTH}\" role=\"img\" aria-label=\"Error of {name} against \
         time, of each setting; the table below has the numbers\">"
    );
    for at in x.marks() {
        let p = x.place(at);
        let _ = write!(
            page,
            "<line x1=\"{p:.1}\" x2=\"{p:.1}\" y1=\"20\" y2=\"300\" stroke=\"#dde3ec\"/>\
             <text x=\"{p:.1}\" y=\"316\" text-anchor=\"middle\">{at}</text>"
        );
    }
    for at in y.marks() {
        let p = y.place(at);
        let _ = write!(
            page,
            "<line x1=\"60\" x2=\"660\" y1=\"{p:.1}\" y2=\"{p:.1}\" stroke=\"#dde3ec\"/>\
             <text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            p + 4.0,
            if at > 0.0 { format!("{at:e}") } else { "0".to_string() }
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
    page.push_str("</svg></div>");
}

fn table(trade: &Trade, output: &Output, page: &mut String) {
    let _ = write!(
        page,
        "<p>Range {}. The oracle's own standard error: {:.1e}.</p><div class=wide><table><tr><th>setting</th><th>ns/pixel</th><th>spread</th>\
         <th>speed-up</th><th>samples</th><th>rms error</th><th>of range</th><th>99.9 %</th><th>of range</th><th>largest</th></tr>",
        short(output.range),
        output.oracle_error
    );
    for (at, (row, error)) in trade.rows.iter().zip(&output.errors).enumerate() {
        let class = if output.front.contains(&at) { " class=\"front\"" } else { "" };
        let _ = write!(
            page,
            "<tr{class}><td>{}, {}</td><td>{:.1}</td><td>{:.0} %</td><td>{:.2}×</td><td>{:.3}</td><td>{:.1e}</td>\
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
    page.push_str("</table></div>");
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
                "<figure><img alt=\"errors of {} with {name}\" src=\"{url}\"><figcaption>{name}</figcaption></figure>",
                escape(&output.name)
            );
            any = true;
        }
    }
    if any {
        page.push_str("<p>Errors of the front: black 10⁻⁴ or less, red, yellow, white 1 or more.</p>");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_0_have_a_place_of_their_own() {
        let axis = Axis::new([0.02, 0.0, 0.5].into_iter(), 300.0, 20.0);
        assert_eq!(axis.marks().collect::<Vec<_>>(), [0.0, 0.01, 0.1, 1.0]);
        assert!(axis.place(0.0) == 300.0 && axis.place(0.01) < 270.0 && axis.place(1.0) == 20.0);
        let nothing = Axis::new([0.0, 0.0].into_iter(), 300.0, 20.0);
        assert_eq!((nothing.marks().collect::<Vec<_>>(), nothing.place(0.0)), (vec![0.0], 300.0));
        let positive = Axis::new([0.1, 0.1].into_iter(), 60.0, 660.0);
        assert_eq!((positive.marks().count(), positive.place(0.1)), (2, 60.0));
    }

    #[test]
    fn names_leave_room_for_the_title_of_the_axis_and_stay_inside() {
        let mut labels = Labels::beside([(150.0, 20.0), (790.0, 100.0)].into_iter());
        let [left, right, top, bottom] = TITLE;
        let (x, y) = labels.place(150.0, 20.0, 10).expect("there is room below");
        assert!(x > right || x + 60.0 < left || y - 9.0 > bottom || y + 2.0 < top, "{x} {y}");
        let (x, _) = labels.place(790.0, 100.0, 20).expect("there is room on the left");
        assert!(x + 120.0 < WIDTH, "{x}");
    }
}
