//! The sentences in which a trade-off ends: what to take for an error, and whether another arithmetic pays.

use super::front::Measured;
use super::{Output, Row, Setting, Trade};
use std::fmt::Write;

/// The errors for which a sentence names the setting. **Units:** percent of the output's range.
pub(super) const WANTED: [f32; 3] = [5.0, 2.0, 1.0];

/// What the sentences are about.
pub(super) const HINT: &str =
    "What to take for an error at 999 of 1000 pixels (`--within TIME` chooses by the time instead)";

/// The variants that use another arithmetic than the strict one.
const ARITHMETICS: [&str; 2] = ["fast", "f64"];
/// Median times that differ more than this differ for the reader, even if the spread leaves it open.
const NOTABLE: f64 = 1.25;

/// One sentence for each error, and one for the other kinds of arithmetic.
pub(super) fn advice(trade: &Trade, output: &Output) -> String {
    let mut text = String::new();
    let bounds = WANTED.map(|percent| f64::from(percent) / 100.0 * output.range);
    for ((percent, bound), row) in WANTED.iter().zip(bounds).zip(choices(trade, output, &bounds)) {
        let _ = write!(text, "For {percent} % of the range of {} ({}): ", output.name, short(bound));
        text += &match row {
            _ if output.oracle_error >= bound => {
                "unknown, since the oracle's own error is larger; a larger --budget helps".to_string()
            }
            Some(row) => format!("take `{}`, {} a pixel", row.options, time(row.ns_per_pixel)),
            None => nothing(trade, output),
        };
        text.push('\n');
    }
    text + &arithmetics(trade, output)
}

fn measured<'a>(trade: &'a Trade, output: &'a Output) -> Measured<'a> {
    Measured { rows: &trade.rows, errors: &output.errors, oracle: output.oracle_error }
}

/// The row to take for each error, the largest error first. The row for a smaller error is also the one for a
/// larger error, unless another row is faster.
fn choices<'a>(trade: &'a Trade, output: &Output, bounds: &[f64]) -> Vec<Option<&'a Row>> {
    let mut list: Vec<Option<&Row>> = Vec::new();
    for bound in bounds.iter().rev() {
        let closer = list.last().copied().flatten();
        let own = choice(trade, output, *bound);
        list.push(
            closer.filter(|closer| own.is_none_or(|own| closer.ns_per_pixel <= own.ns_per_pixel)).or(own),
        );
    }
    list.reverse();
    list
}

/// The fastest row with at most this error at 999 of 1000 pixels. The strict arithmetic is preferred if no
/// other row is faster beyond the spread of the times.
fn choice<'a>(trade: &'a Trade, output: &Output, bound: f64) -> Option<&'a Row> {
    let keeps = |at: &usize| output.errors.get(*at).is_some_and(|error| error.nearly_all <= bound);
    let rows = || (0..trade.rows.len()).filter(keeps);
    let fastest = |rows: &mut dyn Iterator<Item = usize>| {
        let all = rows.filter_map(|at| Some((at, trade.rows.get(at)?.ns_per_pixel)));
        all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    };
    let any = fastest(&mut rows())?;
    let is_strict = |at: &usize| trade.rows.get(*at).is_some_and(|row| row.variant == "strict");
    let strict = fastest(&mut rows().filter(is_strict));
    let strict = strict.filter(|strict| !measured(trade, output).is_faster(any, *strict));
    trade.rows.get(strict.unwrap_or(any))
}

/// The words for an error that no row keeps.
fn nothing(trade: &Trade, output: &Output) -> String {
    let pairs = trade.rows.iter().zip(&output.errors);
    let best = pairs.min_by(|a, b| a.1.nearly_all.total_cmp(&b.1.nearly_all));
    match best {
        Some((row, error)) => format!(
            "no tried setting keeps it; `{}` comes closest with {}, and a larger --budget tries more",
            row.options,
            short(error.nearly_all)
        ),
        None => "no setting was tried; a larger --budget helps".to_string(),
    }
}

/// What the other kinds of arithmetic change, at the numbers of samples that were tried in both.
fn arithmetics(trade: &Trade, output: &Output) -> String {
    let measured = measured(trade, output);
    let mut text = String::new();
    for name in ARITHMETICS {
        let pair = |(at, row): (usize, &Row)| {
            let same = |strict: &Row| strict.variant == "strict" && strict.setting == row.setting;
            (row.variant == name).then(|| Some((trade.rows.iter().position(same)?, at)))?
        };
        let pairs: Vec<(usize, usize)> = trade.rows.iter().enumerate().filter_map(pair).collect();
        if pairs.is_empty() {
            continue;
        }
        let most = |is: &dyn Fn(&(usize, usize)) -> bool| {
            2 * pairs.iter().filter(|pair| is(pair)).count() > pairs.len()
        };
        let faster = most(&|(strict, own)| measured.is_faster(*own, *strict));
        let slower = most(&|(strict, own)| measured.is_faster(*strict, *own));
        let closer = most(&|(strict, own)| measured.is_closer(*own, *strict));
        let worse = most(&|(strict, own)| measured.is_closer(*strict, *own));
        let cost = |at: usize| trade.rows.get(at).map_or(f64::NAN, |row| row.ns_per_pixel);
        let mut times: Vec<f64> = pairs.iter().map(|(strict, own)| cost(*own) / cost(*strict)).collect();
        times.sort_by(f64::total_cmp);
        let times = times.get(times.len() / 2).copied().unwrap_or(1.0);
        let is_alike = (1.0 / NOTABLE..=NOTABLE).contains(&times);
        let is_open = !(faster || slower || is_alike);
        let speed = match (faster, slower) {
            (true, _) => format!("is {:.1} times as fast here", 1.0 / times),
            (_, true) => format!("takes {times:.1} times as long here"),
            _ if is_open && times < 1.0 => {
                format!("was {:.1} times as fast here, which is within the spread of the times", 1.0 / times)
            }
            _ if is_open => {
                format!("took {times:.1} times as long here, which is within the spread of the times")
            }
            _ => "is no faster here".to_string(),
        };
        let _ = match (faster || slower || is_open, closer, worse) {
            (false, false, false) => writeln!(text, "`--arithmetic {name}` changes nothing here"),
            (_, true, _) => writeln!(text, "`--arithmetic {name}` {speed}, with a smaller error"),
            (_, _, true) => writeln!(text, "`--arithmetic {name}` {speed}, with a larger error"),
            _ => writeln!(text, "`--arithmetic {name}` {speed}, with the same error"),
        };
    }
    text
}

/// A time of a pixel.
fn time(nanoseconds: f64) -> String {
    if nanoseconds < 1e6 {
        format!("{} µs", short(1e-3 * nanoseconds))
    } else {
        format!("{} ms", short(1e-6 * nanoseconds))
    }
}

/// A number with two digits.
pub(super) fn short(number: f64) -> String {
    let text = format!("{number:.1e}");
    text.parse::<f64>().map_or(text, |rounded| rounded.to_string())
}

/// The options of a command line that run the shader so.
pub(super) fn options(variant: &str, setting: Setting) -> String {
    let own = match setting {
        Setting::Rate(rate) => format!("--shading-rate {rate}"),
        Setting::Samples(n) => format!("--samples {n}"),
        Setting::Adaptive(threshold) => format!("--adaptive {threshold}"),
        Setting::MaxError(percent) => format!("--max-error {percent}%"),
    };
    match variant {
        "strict" => own,
        "prefilter" => format!("{own} --prefilter"),
        other => format!("{own} --arithmetic {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Rate;
    use crate::tradeoff::Error;

    /// Rows with their time and their error at 999 of 1000 pixels.
    fn trade(list: &[(&str, Setting, f64, f64)], range: f64) -> (Trade, Output) {
        let row = |(variant, setting, ns, _): &(&str, Setting, f64, f64)| Row {
            variant: (*variant).into(),
            setting: setting.to_string(),
            options: options(variant, *setting),
            ns_per_pixel: *ns,
            ns_least: 0.8 * ns,
            spread: 0.2,
            speed_up: 1.0,
            evaluations: 1.0,
        };
        let error = |(.., error): &(&str, Setting, f64, f64)| Error {
            rms: 0.2 * error,
            nearly_all: *error,
            largest: 1.0,
        };
        let trade = Trade {
            name: "s".into(),
            size: (2, 2),
            oracle: "f64".into(),
            oracle_samples: 64,
            repeats: 3,
            rows: list.iter().map(row).collect(),
            outputs: Vec::new(),
            idle: Vec::new(),
        };
        let output = Output {
            name: "r".into(),
            range,
            oracle_error: 0.0,
            errors: list.iter().map(error).collect(),
            front: Vec::new(),
            pictures: Vec::new(),
        };
        (trade, output)
    }

    #[test]
    fn the_fastest_setting_that_keeps_the_error_is_named() {
        let (trade, output) = trade(
            &[
                ("strict", Setting::Rate(Rate([2, 2])), 20.0, 0.5),
                ("strict", Setting::Samples(4), 100.0, 0.08),
                ("strict", Setting::Samples(16), 400.0, 0.03),
                ("strict", Setting::MaxError(2.0), 390.0, 0.03),
                ("fast", Setting::Samples(4), 98.0, 0.08),
                ("fast", Setting::Samples(16), 380.0, 0.03),
                ("prefilter", Setting::Samples(1), 150.0, 0.035),
            ],
            2.0,
        );
        assert_eq!(
            advice(&trade, &output),
            "For 5 % of the range of r (0.1): take `--samples 4`, 0.1 µs a pixel\n\
             For 2 % of the range of r (0.04): take `--samples 1 --prefilter`, 0.15 µs a pixel\n\
             For 1 % of the range of r (0.02): no tried setting keeps it; `--samples 16` comes closest with 0.03, and \
             a larger --budget tries more\n\
             `--arithmetic fast` changes nothing here\n"
        );
        let unsure = Output { oracle_error: 0.05, ..output };
        assert!(advice(&trade, &unsure).contains("(0.04): unknown, since the oracle's own error"));
    }

    #[test]
    fn an_arithmetic_that_pays_is_named() {
        let (trade, output) = trade(
            &[
                ("strict", Setting::Samples(1), 100.0, 0.01),
                ("fast", Setting::Samples(1), 40.0, 0.01),
                ("f64", Setting::Samples(1), 600.0, 0.005),
            ],
            1.0,
        );
        let text = advice(&trade, &output);
        assert!(
            text.contains("For 5 % of the range of r (0.05): take `--samples 1 --arithmetic fast`, 0.04 µs"),
            "{text}"
        );
        assert!(
            text.contains("`--arithmetic fast` is 2.5 times as fast here, with the same error\n"),
            "{text}"
        );
        assert!(
            text.contains("`--arithmetic f64` takes 6.0 times as long here, with a smaller error\n"),
            "{text}"
        );
    }

    #[test]
    fn a_smaller_error_does_not_take_less_time() {
        let list = [
            ("strict", Setting::Samples(4), 58.0, 0.04),
            ("prefilter", Setting::Samples(1), 12.0, 0.01),
            ("f64", Setting::Samples(1), 290.0, 0.2),
            ("strict", Setting::Samples(1), 58.0, 0.2),
        ];
        let (mut trade, output) = trade(&list, 1.0);
        // The times vary too much to say which row is faster.
        trade.rows.iter_mut().for_each(|row| row.ns_least = 1.0);
        let text = advice(&trade, &output);
        assert_eq!(text.matches("take `--samples 1 --prefilter`, 0.012 µs").count(), 3, "{text}");
        assert!(
            text.contains(
                "`--arithmetic f64` took 5.0 times as long here, which is within the spread of the times, with the \
                 same error\n"
            ),
            "{text}"
        );
        // What suffices for a small error is taken for a larger one, also instead of a strict row.
        let list = [
            ("strict", Setting::Samples(4), 300.0, 0.04),
            ("fast", Setting::Samples(4), 290.0, 0.04),
            ("fast", Setting::Samples(16), 292.0, 0.01),
            ("strict", Setting::Samples(16), 900.0, 0.01),
        ];
        let (trade, output) = self::trade(&list, 1.0);
        let text = advice(&trade, &output);
        assert_eq!(text.matches("take `--samples 16 --arithmetic fast`").count(), 3, "{text}");
    }
}
