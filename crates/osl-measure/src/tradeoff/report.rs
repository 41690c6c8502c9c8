//! A trade-off as text, and as comma-separated values.

use super::{Output, Setting, Trade};
use std::fmt::Write;

/// The errors for which a sentence names the samples.
const WANTED: [f32; 3] = [0.1, 0.03, 0.01];

/// The numbers of samples among the settings.
const COUNTS: [u32; 5] = [1, 4, 16, 64, 256];

/// One sentence for each error that a user may want: how many samples keep it, and what `--max-error` costs.
fn advice(trade: &Trade, output: &Output) -> String {
    let errors = |setting: Setting| {
        let name = setting.to_string();
        let mut rows = trade.rows.iter().zip(&output.errors);
        rows.find(|(row, _)| row.variant == "strict" && row.setting == name)
    };
    let mut text = String::new();
    for wanted in WANTED {
        let bound = f64::from(wanted);
        let _ = write!(text, "For an error below {wanted} at 999 of 1000 pixels: ");
        if output.oracle_error >= bound {
            text.push_str("unknown, since the oracle's own error is larger; a larger --budget helps\n");
            continue;
        }
        let tried = COUNTS.into_iter().filter(|n| errors(Setting::Samples(*n)).is_some());
        let keeps = |n: &u32| errors(Setting::Samples(*n)).is_some_and(|(_, e)| e.nearly_all <= bound);
        match (tried.clone().find(keeps), tried.max()) {
            (Some(1), _) => text.push_str("1 sample"),
            (Some(n), _) => _ = write!(text, "{n} samples"),
            (None, Some(most)) => _ = write!(text, "more than {most} samples"),
            (None, None) => text.push_str("no number of samples was tried; a larger --budget helps"),
        }
        if let Some((row, error)) = errors(Setting::MaxError(wanted))
            && error.nearly_all <= bound
        {
            let _ = write!(text, ", or `--max-error {wanted}`: {:.1} evaluations a pixel", row.evaluations);
        }
        text.push('\n');
    }
    text
}

/// For each output, what to take for an error, then the table: the rows of each output, with a star where no other row is both faster and more accurate.
pub fn text(trade: &Trade) -> String {
    let mut out = format!(
        "{}, {}x{} pixels; oracle: {}, {} samples a pixel; times: median of {} rounds\n",
        trade.name, trade.size.0, trade.size.1, trade.oracle, trade.oracle_samples, trade.repeats
    );
    let names: Vec<String> =
        trade.rows.iter().map(|row| format!("{}, {}", row.variant, row.setting)).collect();
    let width = names.iter().map(String::len).max().unwrap_or(0).max(8);
    for output in &trade.outputs {
        let _ = writeln!(
            out,
            "\n{} (the oracle's own standard error: {:.1e}, subtracted)",
            output.name, output.oracle_error
        );
        out.push_str(&advice(trade, output));
        let _ = writeln!(
            out,
            "  {:<width$} {:>10} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}",
            "setting", "ns/pixel", "spread", "speed-up", "samples", "rms", "99.9 %", "largest"
        );
        for (at, (row, name)) in trade.rows.iter().zip(&names).enumerate() {
            let star = if output.front.contains(&at) { '*' } else { ' ' };
            let Some(error) = output.errors.get(at) else { continue };
            let _ = writeln!(
                out,
                "{star} {name:<width$} {:>10.1} {:>6.0}% {:>8.2}x {:>9.3} {:>9.1e} {:>9.1e} {:>9.1e}",
                row.ns_per_pixel,
                100.0 * row.spread,
                row.speed_up,
                row.evaluations,
                error.rms,
                error.nearly_all,
                error.largest
            );
        }
    }
    out
}

/// A line for each output and row.
pub fn csv(trade: &Trade) -> String {
    let mut out = String::from(
        "output,variant,setting,ns_per_pixel,spread,speed_up,evaluations,rms,nearly_all,largest,front,oracle_error\n",
    );
    for output in &trade.outputs {
        for (at, (row, error)) in trade.rows.iter().zip(&output.errors).enumerate() {
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{}",
                output.name,
                row.variant,
                row.setting,
                row.ns_per_pixel,
                row.spread,
                row.speed_up,
                row.evaluations,
                error.rms,
                error.nearly_all,
                error.largest,
                u8::from(output.front.contains(&at)),
                output.oracle_error
            );
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::{Error, Row};

    #[test]
    fn a_sentence_names_the_samples() {
        let row = |setting: Setting, evaluations| Row {
            variant: "strict".into(),
            setting: setting.to_string(),
            ns_per_pixel: 1.0,
            spread: 0.0,
            speed_up: 1.0,
            evaluations,
        };
        let error = |nearly_all| Error { rms: 0.0, nearly_all, largest: 1.0 };
        let trade = Trade {
            name: "s".into(),
            size: (2, 2),
            oracle: "f64".into(),
            oracle_samples: 64,
            repeats: 3,
            rows: vec![
                row(Setting::Samples(1), 1.0),
                row(Setting::Samples(4), 4.0),
                row(Setting::MaxError(0.03), 9.0),
                row(Setting::MaxError(0.01), 9.0),
            ],
            outputs: Vec::new(),
        };
        let output = Output {
            name: "f".into(),
            oracle_error: 0.0,
            errors: [0.5, 0.06, 0.02, 0.02].map(error).to_vec(),
            front: Vec::new(),
            pictures: Vec::new(),
        };
        assert_eq!(
            advice(&trade, &output),
            "For an error below 0.1 at 999 of 1000 pixels: 4 samples\n\
             For an error below 0.03 at 999 of 1000 pixels: more than 4 samples, or `--max-error 0.03`: 9.0 evaluations a pixel\n\
             For an error below 0.01 at 999 of 1000 pixels: more than 4 samples\n"
        );
        let unsure = Output { oracle_error: 0.05, ..output };
        assert!(advice(&trade, &unsure).contains("0.03 at 999 of 1000 pixels: unknown"));
    }
}
