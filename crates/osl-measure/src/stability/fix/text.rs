//! A repair as text. This module must not know how it was found.

use super::{Errors, Repair, Step};
use crate::explain::short;
use std::fmt::Write;

/// The text of a repair: its rewrites with their figures, then the diff. Where nothing helps, it says so.
pub fn text(repair: &Repair, shader: &str) -> String {
    let mut out = String::new();
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
                "\nRepair ({}): {}, at {} times the cost:",
                repair.setting,
                change(&before, &last.errors),
                short(last.cost, 3)
            );
            let mut earlier = before;
            for step in &repair.steps {
                rewrite(shader, step, &mut out);
                if repair.steps.len() > 1 {
                    let cost = short(step.cost, 3);
                    let _ = writeln!(out, "  = {}, at {cost} times the cost", change(&earlier, &step.errors));
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
            "\nNo repair ({}): {}, and none cuts the error tenfold, keeps what is right and costs less than \
             1.2 times.",
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
    } else if let Some((step, (name, value))) = &repair.harmful {
        let _ = writeln!(
            out,
            "\nThis one helps with the given values, but with `{name} = {value}` its results differ from those of the original in double precision, where the original is right:"
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
        "the largest error falls from {} to {} of the output's range, their root mean square from {} to {}",
        short(before.largest, 2),
        short(after.largest, 2),
        short(before.rms, 2),
        short(after.rms, 2)
    )
}
