//! An explanation as text.

use super::{Explanation, Fact, Line, Shown, State};
use std::fmt::Write;

/// Values shown of a sequence: this many from its start, and the last.
const SHOWN: usize = 4;

/// The text. With `exact`, it shows both values of everything and the number of digits they have in common.
pub fn text(explanation: &Explanation, place: &str, exact: bool) -> String {
    let mut out = String::new();
    let style = Style { exact };
    let _ = writeln!(out, "{} at {place}", explanation.shader);
    for (name, value) in &explanation.globals {
        let _ = writeln!(out, "  {name} = {}", style.value(value));
    }
    let width = explanation.lines.iter().map(|l| l.number).max().unwrap_or(1).to_string().len();
    let mut file = "";
    for line in &explanation.lines {
        if line.file != file {
            file = &line.file;
            let _ = writeln!(out, "\n{file}");
        }
        style.line(line, width, &mut out);
    }
    out.push('\n');
    if explanation.cut {
        out.push_str("The way was too long to be followed to its end; what is above is its beginning.\n");
    }
    for (name, value) in &explanation.outputs {
        let _ = writeln!(out, "{name} = {}", style.value(value));
    }
    out
}

struct Style {
    exact: bool,
}

impl Style {
    fn value(&self, value: &Shown) -> String {
        match value.digits.filter(|_| self.exact) {
            None => value.value.clone(),
            Some(digits) => {
                format!("{} (exactly {}: {digits:.1} digits in common)", value.value, value.exact)
            }
        }
    }

    fn line(&self, line: &Line, width: usize, out: &mut String) {
        let _ = writeln!(out, "{:>width$} | {}", line.number, line.text);
        let mut say = |text: &str| {
            let _ = writeln!(out, "{:>width$} :   {text}", "");
        };
        match line.state {
            State::NotNeeded => return say("not needed for what was asked for"),
            State::Skipped => return say("does not run at this point"),
            State::Runs => {}
        }
        for fact in &line.facts {
            match fact {
                Fact::Set { name, values } => say(&self.set(name, values)),
                Fact::Branch { taken, flips } => say(&branch(taken, *flips)),
                Fact::Rounds { count: 1 } => say("one round"),
                Fact::Rounds { count } => say(&format!("{count} rounds")),
                Fact::Call { form, why, calls } => {
                    say(&format!("calls {form} ({why})"));
                    let shown = calls.len().min(if calls.len() > SHOWN + 1 { SHOWN - 1 } else { SHOWN + 1 });
                    for call in &calls[..shown] {
                        say(&format!("  {}", self.call(form, call)));
                    }
                    if let (true, Some(last)) = (calls.len() > shown, calls.last()) {
                        say(&format!("  … {} calls in all, the last:", calls.len()));
                        say(&format!("  {}", self.call(form, last)));
                    }
                }
            }
        }
    }

    fn set(&self, name: &str, values: &[Shown]) -> String {
        let all: Vec<String> = values.iter().map(|v| self.value(v)).collect();
        match &all[..] {
            [one] => format!("{name} = {one}"),
            several if several.iter().all(|v| *v == several[0]) => {
                format!("{name} = {}, {} times", several[0], several.len())
            }
            few if few.len() <= SHOWN + 2 => format!("{name} = {}", few.join(", ")),
            many => {
                let last = many.last().map_or("", String::as_str);
                format!("{name} = {}, … {last} ({} values)", many[..SHOWN].join(", "), many.len())
            }
        }
    }

    fn call(&self, form: &str, (args, result): &(Vec<Shown>, Option<Shown>)) -> String {
        let name = form.split('(').next().and_then(|head| head.split(' ').next_back()).unwrap_or("");
        let args: Vec<&str> = args.iter().map(|a| a.value.as_str()).collect();
        let result = result.as_ref().map_or(String::new(), |r| format!(" = {}", self.value(r)));
        format!("{name}({}){result}", args.join(", "))
    }
}

fn branch(taken: &[bool], flips: usize) -> String {
    let yes = taken.iter().filter(|t| **t).count();
    let no = taken.len() - yes;
    let times = |n: usize| match n {
        1 => "once".to_string(),
        2 => "twice".to_string(),
        n => format!("{n} times"),
    };
    let mut text = match (yes, no) {
        (1, 0) => "true".to_string(),
        (0, 1) => "false".to_string(),
        (yes, 0) => format!("true {}", times(yes)),
        (0, no) => format!("false {}", times(no)),
        (yes, no) => format!("true {}, false {}", times(yes), times(no)),
    };
    if flips > 0 {
        let _ = write!(text, "; double precision says otherwise {}", times(flips));
    }
    text
}
