//! A repair as text: each rewrite with its errors and its cost, then the diff.

use super::{Errors, Repair, Step};
use crate::words::short;
use std::fmt::Write;

/// The text of a repair: its rewrites with their figures, then the diff. Where nothing helps, it says so.
pub fn text(repair: &Repair, shader: &str) -> String {
    let mut out = String::new();
    if let Some(why) = &repair.refused {
        let _ = writeln!(out, "\nNo repair ({}): {why}.", repair.setting);
        return out;
    }
    let Some(before) = repair.before else {
        let said = if repair.cut_short {
            "No repair was looked for: the time was over."
        } else {
            "Nothing to repair."
        };
        let _ = writeln!(out, "\n{said}");
        return out;
    };
    match repair.steps.last() {
        Some(last) => {
            let _ = writeln!(
                out,
                "\nRepair ({}): {}, {}:",
                repair.setting,
                change(&before, &last.errors),
                at_cost(last.cost)
            );
            let mut earlier = before;
            for step in &repair.steps {
                rewrite(shader, step, &mut out);
                if repair.steps.len() > 1 {
                    let change = change(&earlier, &step.errors);
                    let _ = writeln!(out, "  = {change}, {}", at_cost(step.cost));
                }
                earlier = step.errors;
            }
            if repair.doubt > last.errors.largest / 10.0 && repair.doubt > 1e-6 {
                let _ = writeln!(
                    out,
                    "\nDouble precision loses digits here too: it gives results of the two sources that differ by {} of \
                     the range.",
                    short(repair.doubt, 2)
                );
            }
            let _ = write!(out, "\n{}", repair.diff);
        }
        None => none(repair, shader, &mut out),
    }
    if repair.not_tried > 0 {
        let _ = writeln!(
            out,
            "\n{} more rewrites match these lines; they were not tried, to bound the work.",
            repair.not_tried
        );
    }
    if repair.cut_short {
        let _ = writeln!(out, "\nThe time was over (--budget) before everything was examined and tried.");
    }
    out
}

/// What is said if nothing helps enough.
fn none(repair: &Repair, shader: &str, out: &mut String) {
    let _ = match repair.tried {
        0 => writeln!(out, "\nNo repair ({}): no known rewrite matches the lines to blame.", repair.setting),
        n => writeln!(
            out,
            "\nNo repair ({}): {}, and none cuts the error tenfold, keeps what is right and costs \
             little enough.",
            repair.setting,
            if n == 1 {
                "one known rewrite matches the lines to blame".to_string()
            } else {
                format!("{n} known rewrites match the lines to blame")
            }
        ),
    };
    if let Some(step) = &repair.dear {
        let _ = writeln!(out, "\nThis one helps, but costs {} times as much:", short(step.cost, 3));
        rewrite(shader, step, out);
        if let Some(before) = &repair.before {
            let _ = writeln!(out, "  = {}", change(before, &step.errors));
        }
    } else if let Some((step, at)) = &repair.harmful {
        let _ = writeln!(
            out,
            "\nThis one helps with the given values, but with `{at}` it makes points worse: to more than twice \
             the error that the original has there, or to what is no finite number:"
        );
        rewrite(shader, step, out);
        if let Some(before) = &repair.before {
            let _ = writeln!(out, "  = {}", change(before, &step.errors));
        }
    } else if let Some((step, gain)) = &repair.nearly
        && *gain >= 1.1
    {
        let _ = writeln!(out, "\nThe best one makes the error {} times smaller:", short(*gain, 2));
        rewrite(shader, step, out);
    }
}

fn rewrite(shader: &str, step: &Step, out: &mut String) {
    let line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let _ = writeln!(out, "\n{shader}:{}: {}: {}", step.line, step.name, step.why);
    let _ = writeln!(out, "  - {}", line(&step.old));
    let _ = writeln!(out, "  + {}", line(&step.new));
}

fn change(before: &Errors, after: &Errors) -> String {
    format!(
        "the largest error {} of the output's range, their root mean square {}",
        from_to(before.largest, after.largest),
        from_to(before.rms, after.rms)
    )
}

/// How a figure changes, as the shown digits have it.
fn from_to(before: f64, after: f64) -> String {
    let [from, to] = [before, after].map(|error| short(error, 2));
    match to {
        to if to == from => format!("stays at {to}"),
        to if after > before => format!("rises from {from} to {to}"),
        to => format!("falls from {from} to {to}"),
    }
}

/// A relative cost as the end of a sentence.
fn at_cost(cost: f64) -> String {
    match short(cost, 3).as_str() {
        "1" => "at the same cost".to_string(),
        cost => format!("at {cost} times the cost"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_falls_stays_or_rises() {
        let errors = |largest, rms| Errors { largest, rms };
        let said = "the largest error falls from 0.016 to 0.014 of the output's range, their root mean square \
                    rises from 0.0026 to 0.0039";
        assert_eq!(change(&errors(0.016, 0.0026), &errors(0.014, 0.0039)), said);
        let said = "the largest error stays at 0.00016 of the output's range, their root mean square falls from \
                    0.0001 to 0.00001";
        assert_eq!(change(&errors(0.000162, 1e-4), &errors(0.000158, 1e-5)), said);
        assert_eq!(
            (at_cost(0.9999), at_cost(1.05)),
            ("at the same cost".into(), "at 1.05 times the cost".into())
        );
    }
}
