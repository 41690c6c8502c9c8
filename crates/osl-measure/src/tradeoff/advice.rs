//! The sentences of a trade-off: what to take for an error, and what another arithmetic or `--prefilter`
//! changes. Each of them holds in the table.

use super::front::Measured;
use super::{Output, Row, Setting, Trade};
use crate::words::listed;

/// The errors for which a sentence names the setting. **Units:** percent of the output's range.
pub(super) const WANTED: [f32; 3] = [5.0, 2.0, 1.0];

/// What the sentences are about.
pub(super) const HINT: &str =
    "What to take for an error at 999 of 1000 pixels (`--within TIME` chooses by the time instead)";

/// The variants that use another arithmetic than the strict one.
const ARITHMETICS: [&str; 2] = ["fast", "f64"];
/// Median times that differ more than this differ for the reader, even if the spread leaves it open.
const NOTABLE: f64 = 1.25;
/// And those that differ less do not, even beyond the spread.
const SMALL: f64 = 1.05;

/// A sentence about an output: the words before and after its name. Without words after it, the name is only
/// needed if the sentence does not hold for all outputs.
type Sentence = (String, Option<String>);

/// The sentences of a kind about an output.
type Sentences<'a> = &'a dyn Fn(&Output) -> Vec<Sentence>;

/// One sentence for each error, and what other arithmetic and `--prefilter` change. Outputs for which a
/// sentence is the same share it.
pub(super) fn advice(trade: &Trade) -> String {
    let takes = |output: &Output| takes(trade, output);
    let changes = |output: &Output| changes(trade, output).into_iter().map(|text| (text, None)).collect();
    let kinds: [Sentences<'_>; 2] = [&takes, &changes];
    let mut text = String::new();
    for kind in kinds {
        let sentences = trade
            .outputs
            .iter()
            .flat_map(|output| kind(output).into_iter().map(|sentence| (sentence, output.name.as_str())));
        for ((before, after), names) in shared(sentences) {
            let is_for_all = names.len() == trade.outputs.len();
            text += &match after {
                Some(after) => format!("{before}{}{after}\n", listed(&names, "and")),
                None if is_for_all => format!("{before}\n"),
                None => format!("{before} ({})\n", listed(&names, "and")),
            };
        }
    }
    text
}

/// What several names share, each once, in the order of the first name.
pub(super) fn shared<'a, T: PartialEq>(list: impl Iterator<Item = (T, &'a str)>) -> Vec<(T, Vec<&'a str>)> {
    let mut out: Vec<(T, Vec<&str>)> = Vec::new();
    for (what, name) in list {
        match out.iter_mut().find(|(other, _)| *other == what) {
            Some((_, names)) => names.push(name),
            None => out.push((what, vec![name])),
        }
    }
    out
}

/// What to take for each error.
fn takes(trade: &Trade, output: &Output) -> Vec<Sentence> {
    let bounds = WANTED.map(|percent| f64::from(percent) / 100.0 * output.range);
    let rows = choices(trade, output, &bounds);
    let sentence = |((percent, bound), row): ((&f32, f64), Option<&Row>)| {
        let what = match row {
            _ if output.oracle_error >= bound => {
                "unknown, since the oracle's own error is larger; a larger --budget helps".to_string()
            }
            Some(row) => format!("take `{}`, {} a pixel", row.options, time(row.ns_per_pixel)),
            None => nothing(trade, output),
        };
        (format!("For {percent} % of the range of "), Some(format!(" ({}): {what}", short(bound))))
    };
    WANTED.iter().zip(bounds).zip(rows).map(sentence).collect()
}

fn measured<'a>(trade: &'a Trade, output: &'a Output) -> Measured<'a> {
    Measured { rows: &trade.rows, errors: &output.errors, oracle: output.oracle_error }
}

/// The row to take for each error, the largest error first. The row for a smaller error is also the one for a
/// larger error, unless another row is faster.
fn choices<'a>(trade: &'a Trade, output: &Output, bounds: &[f64]) -> Vec<Option<&'a Row>> {
    let mut list: Vec<Option<usize>> = Vec::new();
    for bound in bounds.iter().rev() {
        list.push(choice(trade, output, *bound, list.last().copied().flatten()));
    }
    list.reverse();
    list.into_iter().map(|row| trade.rows.get(row?)).collect()
}

/// The fastest row with at most this error at 999 of 1000 pixels. The strict arithmetic is preferred, and
/// then the row for a smaller error if that takes no longer, as long as no row is faster beyond the spread.
fn choice(trade: &Trade, output: &Output, bound: f64, closer: Option<usize>) -> Option<usize> {
    let cost = |row: usize| trade.rows.get(row).map_or(f64::INFINITY, |row| row.ns_per_pixel);
    let keeps = |row: &usize| output.errors.get(*row).is_some_and(|error| error.nearly_all <= bound);
    let rows: Vec<usize> = (0..trade.rows.len()).filter(keeps).collect();
    let fastest = |is: &dyn Fn(&usize) -> bool| {
        rows.iter().copied().filter(is).min_by(|a, b| cost(*a).total_cmp(&cost(*b)))
    };
    let any = fastest(&|_| true)?;
    let is_open = |row: &usize| !measured(trade, output).is_faster(any, *row);
    let is_strict = |row: &usize| trade.rows.get(*row).is_some_and(|row| row.variant == "strict");
    let own = fastest(&is_strict).filter(is_open).unwrap_or(any);
    Some(closer.filter(|closer| cost(*closer) <= cost(own) && is_open(closer)).unwrap_or(own))
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

/// What the other kinds of arithmetic and `--prefilter` change, at the settings that were tried in both. A
/// difference is named if all these settings show it.
fn changes(trade: &Trade, output: &Output) -> Vec<String> {
    let measured = measured(trade, output);
    let pairs = |name: &'static str| {
        let strict = |row: &Row| {
            let is_same = |strict: &Row| strict.variant == "strict" && strict.setting == row.setting;
            trade.rows.iter().position(is_same)
        };
        let own = trade.rows.iter().enumerate().filter(move |(_, row)| row.variant == name);
        own.filter_map(move |(at, row)| Some((strict(row)?, at))).collect::<Vec<_>>()
    };
    let taken = choices(trade, output, &WANTED.map(|percent| f64::from(percent) / 100.0 * output.range));
    let mut lines = Vec::new();
    for name in ARITHMETICS {
        let is_taken = taken.iter().flatten().any(|row| row.variant == name);
        lines.extend(
            arithmetic(trade, measured, &pairs(name), is_taken)
                .map(|what| format!("`--arithmetic {name}` {what}")),
        );
    }
    for (strict, own) in pairs("prefilter") {
        let word = match (measured.is_closer(own, strict), measured.is_closer(strict, own)) {
            (true, _) => "cuts",
            (_, true) => "raises",
            _ => continue,
        };
        let share =
            |at: usize| output.errors.get(at).map_or(f64::NAN, |error| 100.0 * error.rms / output.range);
        let setting = trade.rows.get(own).map_or("", |row| &row.setting);
        lines.push(format!(
            "`--prefilter` with {setting} {word} the root mean square error from {} to {} % of the range",
            digits(share(strict), 3),
            digits(share(own), 3)
        ));
    }
    lines
}

/// What an arithmetic changes, from pairs of strict rows and its own ones.
fn arithmetic(
    trade: &Trade,
    measured: Measured<'_>,
    pairs: &[(usize, usize)],
    is_taken: bool,
) -> Option<String> {
    let all = |is: &dyn Fn(usize, usize) -> bool| pairs.iter().all(|(strict, own)| is(*strict, *own));
    let ratio = |strict: usize, own: usize| {
        let cost = |at: usize| trade.rows.get(at).map_or(f64::NAN, |row| row.ns_per_pixel);
        cost(own) / cost(strict)
    };
    let is_within = |x: f64, most: f64| (1.0 / most..=most).contains(&x);
    let mut times: Vec<f64> = pairs.iter().map(|(strict, own)| ratio(*strict, *own)).collect();
    times.sort_by(f64::total_cmp);
    let middle = times.get(times.len() / 2).copied()?;
    let error = if all(&|strict, own| measured.is_closer(own, strict)) {
        Some("a smaller error")
    } else if all(&|strict, own| measured.is_closer(strict, own)) {
        Some("a larger error")
    } else {
        let differs = |strict, own| measured.is_closer(strict, own) || measured.is_closer(own, strict);
        all(&|strict, own| !differs(strict, own)).then_some("the same error")
    };
    let with = error.map_or(String::new(), |error| format!(", with {error}"));
    if all(&|strict, own| measured.is_faster(own, strict) && !is_within(ratio(strict, own), SMALL)) {
        return Some(format!("is {:.1} times as fast here{with}", 1.0 / middle));
    }
    if all(&|strict, own| measured.is_faster(strict, own) && !is_within(ratio(strict, own), SMALL)) {
        return Some(format!("takes {middle:.1} times as long here{with}"));
    }
    let is_alike = |strict, own| {
        let is_open = !measured.is_faster(strict, own) && !measured.is_faster(own, strict);
        is_within(ratio(strict, own), if is_open { NOTABLE } else { SMALL })
    };
    if error == Some("the same error") && all(&is_alike) && !is_taken {
        return Some("changes nothing here".to_string());
    }
    error.map(|error| format!("has {error} here, and the times leave open whether it is faster"))
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
    digits(number, 2)
}

fn digits(number: f64, count: usize) -> String {
    let text = format!("{number:.*e}", count - 1);
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
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use crate::sample::Rate;
    use crate::tradeoff::Error;

    /// Rows with their time and their error at 999 of 1000 pixels.
    fn trade(list: &[(&str, Setting, f64, f64)], range: f64) -> Trade {
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
        let mut trade = Trade {
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
        trade.outputs.push(output);
        trade
    }

    #[test]
    fn the_fastest_setting_that_keeps_the_error_is_named() {
        let mut trade = trade(
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
            advice(&trade),
            "For 5 % of the range of r (0.1): take `--samples 4`, 0.1 µs a pixel\n\
             For 2 % of the range of r (0.04): take `--samples 1 --prefilter`, 0.15 µs a pixel\n\
             For 1 % of the range of r (0.02): no tried setting keeps it; `--samples 16` comes closest with 0.03, and \
             a larger --budget tries more\n\
             `--arithmetic fast` changes nothing here\n"
        );
        trade.outputs[0].oracle_error = 0.05;
        assert!(advice(&trade).contains("(0.04): unknown, since the oracle's own error"));
    }

    #[test]
    fn an_arithmetic_that_pays_is_named() {
        let trade = trade(
            &[
                ("strict", Setting::Samples(1), 100.0, 0.01),
                ("fast", Setting::Samples(1), 40.0, 0.01),
                ("f64", Setting::Samples(1), 600.0, 0.005),
            ],
            1.0,
        );
        let text = advice(&trade);
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
        let mut trade = trade(&list, 1.0);
        // The times vary too much to say which row is faster.
        trade.rows.iter_mut().for_each(|row| row.ns_least = 1.0);
        let text = advice(&trade);
        assert_eq!(text.matches("take `--samples 1 --prefilter`, 0.012 µs").count(), 3, "{text}");
        assert!(
            text.contains(
                "`--arithmetic f64` has the same error here, and the times leave open whether it is faster\n"
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
        let trade = self::trade(&list, 1.0);
        let text = advice(&trade);
        assert_eq!(text.matches("take `--samples 16 --arithmetic fast`").count(), 3, "{text}");
    }

    #[test]
    fn outputs_share_sentences() {
        let list =
            [("strict", Setting::Samples(1), 100.0, 0.04), ("prefilter", Setting::Samples(1), 90.0, 0.01)];
        let mut trade = trade(&list, 1.0);
        trade.outputs.push(Output { name: "s".into(), ..trade.outputs[0].clone() });
        let all = advice(&trade);
        assert!(
            all.contains("For 5 % of the range of r and s (0.05): take `--samples 1 --prefilter`"),
            "{all}"
        );
        assert_eq!(all.lines().count(), 4, "{all}");
        let filtered =
            "`--prefilter` with 1 sample cuts the root mean square error from 0.8 to 0.2 % of the range\n";
        assert!(all.contains(filtered), "{all}");
        trade.outputs[1].errors.reverse();
        let all = advice(&trade);
        assert!(all.contains("from 0.8 to 0.2 % of the range (r)\n"), "{all}");
        assert!(
            all.contains("raises the root mean square error from 0.2 to 0.8 % of the range (s)\n"),
            "{all}"
        );
    }

    /// Whether a sentence about an output holds in its table.
    fn holds(trade: &Trade, line: &str) -> bool {
        let output = &trade.outputs[0];
        let rows = || trade.rows.iter().zip(&output.errors);
        let strict =
            |own: &Row| rows().find(|(row, _)| row.variant == "strict" && row.setting == own.setting);
        let pairs = |variant: &str| -> Vec<[(&Row, &Error); 2]> {
            let own = rows().filter(|(row, _)| row.variant == variant);
            own.filter_map(|own| Some([strict(own.0)?, own])).collect()
        };
        let beats = |a: &Row, b: &Row| a.ns_per_pixel < b.ns_least;
        if let Some(rest) = line.strip_prefix("For ") {
            let bound = rest.split(' ').next().unwrap().parse::<f64>().unwrap() / 100.0 * output.range;
            let keep = |(_, error): &(&Row, &Error)| error.nearly_all <= bound;
            if line.contains("no tried setting keeps it") {
                let best = rows().map(|(_, error)| error.nearly_all).fold(f64::INFINITY, f64::min);
                let named = rows().any(|(row, error)| {
                    line.contains(&format!("`{}` comes closest with {}", row.options, short(best)))
                        && error.nearly_all == best
                });
                return named && rows().filter(keep).count() == 0;
            }
            let (row, _) = rows()
                .filter(keep)
                .find(|(row, _)| line.contains(&format!("take `{}`,", row.options)))
                .unwrap();
            return line.ends_with(&format!("{} a pixel", time(row.ns_per_pixel)))
                && !rows().filter(keep).any(|(other, _)| beats(other, row));
        }
        let variant = line.split(['`', ' ']).nth(2).unwrap();
        if line.starts_with("`--prefilter`") {
            let is = |[strict, own]: &[(&Row, &Error); 2]| {
                let is_cut = own.1.rms < strict.1.rms;
                line.contains(&format!("with {} ", own.0.setting)) && line.contains("cuts") == is_cut
            };
            return pairs("prefilter").iter().any(is);
        }
        let pairs = pairs(variant);
        let all = |is: &dyn Fn(&Row, &Row) -> bool| pairs.iter().all(|[strict, own]| is(strict.0, own.0));
        let errors =
            |is: &dyn Fn(f64, f64) -> bool| pairs.iter().all(|[strict, own]| is(strict.1.rms, own.1.rms));
        let is_idle = line.contains("changes nothing");
        let text = advice(trade);
        let is_taken = text
            .lines()
            .any(|other| other.contains("take") && other.contains(&format!("--arithmetic {variant}`,")));
        (!line.contains("as fast") || all(&|strict, own| beats(own, strict)))
            && (!line.contains("as long") || all(&|strict, own| beats(strict, own)))
            && (!line.contains("smaller error") || errors(&|strict, own| own < strict))
            && (!line.contains("larger error") || errors(&|strict, own| own > strict))
            && (!(line.contains("the same error") || is_idle) || errors(&|strict, own| own == strict))
            && (!is_idle
                || !is_taken
                    && all(&|strict, own| (0.8..=1.25).contains(&(own.ns_per_pixel / strict.ns_per_pixel))))
            && !line.contains("within the spread")
    }

    proptest::proptest! {
        #[test]
        fn each_sentence_holds_in_its_table(
            cells in proptest::collection::vec((0_usize..4, 0_usize..4, 1_usize..9, 0.0_f64..0.9, 1_usize..9), 1..12),
        ) {
            let mut list: Vec<(&str, Setting, f64, f64)> = Vec::new();
            let mut spreads = Vec::new();
            for (variant, samples, ns, spread, error) in cells {
                let variant = ["strict", "fast", "f64", "prefilter"][variant];
                let setting = Setting::Samples([1, 4, 16, 64][samples]);
                if !list.iter().any(|(other, own, ..)| (*other, *own) == (variant, setting)) {
                    list.push((variant, setting, 40.0 + 5.0 * (ns * ns) as f64, 0.1 / (error * error) as f64));
                    spreads.push(spread * spread);
                }
            }
            let mut trade = trade(&list, 1.0);
            trade.rows.iter_mut().zip(spreads).for_each(|(row, spread)| row.ns_least = (1.0 - spread) * row.ns_per_pixel);
            for line in advice(&trade).lines() {
                assert!(holds(&trade, line), "{line}\n{}", crate::tradeoff::text(&trade));
            }
        }
    }
}
