//! A trade-off as one self-contained HTML page: for each output a plot, the table and pictures of the errors.

use super::advice::{HINT, advice, short};
use super::report::{TITLES, cells};
use super::{Error, Output, Row, Trade};
use crate::page::{Axis, Encode, Page, escape};
use pxfm::f_log10f;
use std::fmt::Write;

/// The page.
pub fn html(trade: &Trade, encode: Encode<'_>) -> String {
    let mut page = Page::new(&format!("{}: speed and accuracy", trade.name), "figure img{width:160px}\n");
    page.paragraph(&format!(
        "{}×{} pixels. Errors are against {} samples a pixel ({}), whose own standard error is subtracted. Times are \
         medians of {} interleaved rounds, and the spread is how far the fastest round is below. Filled dots and marked \
         rows are the front: none of them is better than another one without being worse too, and for each other setting \
         there is one of them that is not worse; differences within the spread of the times do not count.",
        trade.size.0, trade.size.1, trade.oracle_samples, trade.oracle, trade.repeats,
    ));
    page.paragraph(&format!("{HINT}:"));
    page.list(advice(trade).lines().chain(trade.idle.iter().map(String::as_str)));
    for output in &trade.outputs {
        page.heading(2, &output.name);
        plot(trade, output, &mut page);
        let oracle = output.oracle_error;
        page.paragraph(&format!(
            "Range {}. The oracle's own standard error: {oracle:.1e}.",
            short(output.range)
        ));
        let row = |(at, (row, error)): (usize, (&Row, &Error))| {
            let name = format!("{}, {}", row.variant, row.setting);
            let cells = std::iter::once(name).chain(cells(row, error, output.range)).collect();
            (output.front.contains(&at), cells)
        };
        let rows = trade.rows.iter().zip(&output.errors).enumerate().map(row);
        page.table(std::iter::once("setting").chain(TITLES), rows);
        pictures(trade, output, encode, &mut page);
    }
    page.ended()
}

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

fn plot(trade: &Trade, output: &Output, page: &mut Page) {
    let x = Axis::around(trade.rows.iter().map(|row| row.ns_per_pixel), [60.0, 660.0]);
    let y = Axis::around(output.errors.iter().map(|error| error.rms), [300.0, 20.0]);
    let title =
        format!("Error of {} against time, of each setting; the table below has the numbers", output.name);
    page.plot([WIDTH, 340.0], &title);
    x.marks().for_each(|at| page.mark_x(x.place(at), [20.0, 300.0], &at.to_string()));
    for at in y.marks() {
        let text = if at > 0.0 { format!("{at:e}") } else { "0".to_string() };
        page.mark_y(y.place(at), [60.0, 660.0], &text);
    }
    page.label([360.0, 334.0], "middle", "nanoseconds a pixel");
    page.label([62.0, 14.0], "start", "root mean square error");
    let place = |row: &Row, error: &Error| (x.place(row.ns_per_pixel), y.place(error.rms));
    let dot = |row: &usize| Some(place(trade.rows.get(*row)?, output.errors.get(*row)?));
    page.curve(output.front.iter().filter_map(dot), "#2f6fde");
    let dots = || trade.rows.iter().zip(&output.errors).enumerate();
    let mut labels = Labels::beside(dots().map(|(_, (row, error))| place(row, error)));
    // Names of settings on the front are placed first.
    let on_front = |(at, _): &(usize, _)| output.front.contains(at);
    for (at, (row, error)) in dots().filter(on_front).chain(dots().filter(|dot| !on_front(dot))) {
        let fill = if output.front.contains(&at) { "#2f6fde" } else { "#fff" };
        let name = format!("{}, {}", row.variant, row.setting);
        let ((px, py), title) = (place(row, error), escape(&name));
        let _ = write!(
            page.text,
            "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4\" fill=\"{fill}\" stroke=\"#2f6fde\"><title>{title}</title></circle>"
        );
        if let Some((x, y)) = labels.place(px, py, name.len()) {
            page.label([x, y], "start", &name);
        }
    }
    page.end_plot();
}

/// Errors as colors from black over red and yellow to white, by decades: white is 1 or more, black 0.0001 or
/// less.
fn pictures(trade: &Trade, output: &Output, encode: Encode<'_>, page: &mut Page) {
    let mut any = false;
    for (row, picture) in output.front.iter().zip(&output.pictures) {
        let height = picture.values.len() / picture.width.max(1);
        let heat = |shift: f32| {
            let one = |error: &f32| ((1.0 + f_log10f(error.max(1e-4)) / 4.0) * 3.0 - shift).clamp(0.0, 1.0);
            picture.values.iter().map(one).collect::<Vec<f32>>()
        };
        let url = encode(picture.width, height, &[heat(0.0), heat(1.0), heat(2.0)]);
        if let (Some(url), Some(row)) = (url, trade.rows.get(*row)) {
            let name = format!("{}, {}", row.variant, row.setting);
            page.picture(&url, &name, &format!("errors of {} with {name}", output.name));
            any = true;
        }
    }
    if any {
        page.paragraph("Errors of the front: black 10⁻⁴ or less, red, yellow, white 1 or more.");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
