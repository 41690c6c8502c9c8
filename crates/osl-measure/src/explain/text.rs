//! An explanation as text.

use super::value::number;
use super::{
    Called, Compiled, Derivatives, Explanation, Fact, Line, Reported, Shown, State, Test, Triple,
    ValueOrigin, What,
};
use osl_syntax::escape::shown;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Values shown of a sequence: this many from its start, and the last.
const SHOWN: usize = 4;

/// What the text shows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// Both values of everything, and the number of digits that they have in common.
    pub exact: bool,
    /// All values of long loops and arrays.
    pub all: bool,
}

/// The text. The point is named by `place`.
pub fn text(explanation: &Explanation, place: &str, style: Style) -> String {
    let mut out = String::new();
    let writer = Writer { style, calls: &explanation.calls };
    let _ = writeln!(out, "{} at {place}", explanation.shader);
    for (name, value) in &explanation.globals {
        let _ = writeln!(out, "  {name} = {}", writer.value(value));
    }
    let width = explanation.lines.iter().map(|l| l.number).max().unwrap_or(1).to_string().len();
    let mut file = "";
    for line in &explanation.lines {
        if line.file != file {
            file = &line.file;
            let _ = writeln!(out, "\n{file}");
        }
        writer.line(line, width, &mut out);
    }
    out.push('\n');
    if explanation.cut {
        out.push_str("The way was too long to be followed to its end; what is above is its beginning.\n");
    }
    for text in explanation.reports.iter().flat_map(reported) {
        let _ = writeln!(out, "{text}");
    }
    for (name, value) in &explanation.outputs {
        let _ = writeln!(out, "{name} = {}", writer.value(value));
    }
    out
}

/// How the facts of a line are told.
#[derive(Clone, Copy)]
struct Say {
    /// The function of the line is called several times.
    several: bool,
    /// The line has several conditions, so that each is named.
    named: bool,
    /// The line says already that its values are not needed.
    quiet: bool,
}

struct Writer<'a> {
    style: Style,
    calls: &'a [Called],
}

impl Writer<'_> {
    fn value(&self, value: &Shown) -> String {
        match value.digits.filter(|_| self.style.exact) {
            None => value.value(),
            Some(digits) => {
                format!("{} (exactly {}: {digits:.1} digits in common)", value.value(), value.exactly())
            }
        }
    }

    fn line(&self, line: &Line, width: usize, out: &mut String) {
        let _ = writeln!(out, "{:>width$} | {}", line.number, line.text);
        let mut say = |text: &str| {
            let _ = writeln!(out, "{:>width$} :   {text}", "");
        };
        let why = line.why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        if line.state == State::Skipped {
            let never = if why.contains("is always") { "never runs" } else { "does not run" };
            return say(&if why.is_empty() {
                format!("{never} at this point")
            } else {
                format!("{never}{why}")
            });
        }
        let told = self.line_facts(line);
        told.iter().for_each(|text| say(text));
        if line.state == State::NotNeeded || line.why.is_some() {
            say(&format!("not needed{why}"));
        }
        line.reports.iter().flat_map(reported).for_each(|text| say(&text));
    }

    /// The sentences about a line that runs.
    fn line_facts(&self, line: &Line) -> Vec<String> {
        let mut out = Vec::new();
        let mut done = vec![false; line.facts.len()];
        let is_if = |what: &What| matches!(what, What::Branch { test: Test::If, .. });
        let conditions: BTreeSet<(u8, &str)> =
            line.facts.iter().filter(|f| is_if(&f.what)).map(|f| about(&f.what)).collect();
        let named = conditions.len() > 1;
        let several = line.calls.len() > 1;
        for (at, fact) in line.facts.iter().enumerate() {
            if done[at] {
                continue;
            }
            if let Some(end) = self.elements(&line.facts[at..], &mut out) {
                done[at..at + end].fill(true);
                continue;
            }
            // The same thing in all calls of the function.
            let mut same: Vec<&Fact> = Vec::new();
            for (other, done) in line.facts[at..].iter().zip(&mut done[at..]) {
                if !*done && about(&other.what) == about(&fact.what) {
                    *done = true;
                    same.push(other);
                }
            }
            self.thing(&same, Say { several, named, quiet: line.state == State::NotNeeded }, &mut out);
        }
        out
    }

    /// Elements of an array that are set one after the other, as one sentence; returns how many facts it
    /// tells.
    fn elements(&self, facts: &[Fact], out: &mut Vec<String>) -> Option<usize> {
        if self.style.all {
            return None;
        }
        let part = |fact: &'_ Fact| match &fact.what {
            What::Set { name, values, derivatives, .. } if values.len() == 1 && derivatives.is_empty() => {
                let (base, index) = name.split_once('[')?;
                let index: usize = index.strip_suffix(']')?.parse().ok()?;
                Some((fact.call, base.to_string(), index, self.value(values.first()?)))
            }
            _ => None,
        };
        let (call, base, start, _) = part(facts.first()?)?;
        let run: Vec<String> = facts
            .iter()
            .enumerate()
            .map_while(|(n, fact)| {
                part(fact).filter(|(c, b, at, _)| *c == call && *b == base && *at == start + n)
            })
            .map(|(.., text)| text)
            .collect();
        if run.len() <= SHOWN {
            return None;
        }
        let last = run.last()?;
        let list = if run.iter().all(|text| text == last) {
            format!("{last} each")
        } else {
            format!("{}, … {last}", run[..SHOWN - 1].join(", "))
        };
        out.push(format!("{base}[{start}] to {base}[{}] = {list}", start + run.len() - 1));
        Some(run.len())
    }

    /// The sentences about one thing, in one call or in several.
    fn thing(&self, facts: &[&Fact], say: Say, out: &mut Vec<String>) {
        let Some(first) = facts.first() else { return };
        match &first.what {
            What::Call { form, why, how, .. } => {
                self.form(form, why, out);
                let shown = if self.style.all { how.len() } else { how.len().min(SHOWN) };
                out.extend(how[..shown].iter().map(|applied| {
                    let how = match applied.to {
                        Triple::Point => "a point: with the translation of the matrix",
                        Triple::Vector => "a vector: without the translation of the matrix",
                        Triple::Normal => {
                            "a normal: by the transposed inverse of the matrix, without translation"
                        }
                    };
                    format!("  {how} {}", self.value(&applied.matrix))
                }));
                let calls: Vec<String> = facts
                    .iter()
                    .filter_map(
                        |fact| if let What::Call { calls, .. } = &fact.what { Some(calls) } else { None },
                    )
                    .flatten()
                    .map(|call| self.call(form, call))
                    .collect();
                self.list(&calls, out);
            }
            What::Enter { form, why, .. } => {
                self.form(form, why, out);
                let calls: Vec<String> = facts
                    .iter()
                    .filter_map(
                        |fact| if let What::Enter { calls, .. } = &fact.what { Some(calls) } else { None },
                    )
                    .flatten()
                    .filter_map(|number| self.entered(*number))
                    .collect();
                self.list(&calls, out);
            }
            what => {
                let status = |fact: &Fact| match &fact.what {
                    What::Set { compiled, each, .. } if !say.quiet => match &each[..] {
                        [] => compiled_text(*compiled),
                        each => each_text(each),
                    },
                    _ => String::new(),
                };
                // The calls of a function may differ in what the compiler makes of them.
                let of_all = facts.iter().all(|fact| status(fact) == status(first));
                let in_call = |fact: &&Fact| {
                    let status = if of_all { String::new() } else { status(fact) };
                    (fact.call, self.sentence(&fact.what, say) + &status)
                };
                let texts: Vec<(usize, String)> = facts.iter().map(in_call).collect();
                let name = match what {
                    What::Set { name, .. } if name == "return" => "returns ".to_string(),
                    What::Set { name, .. } => format!("{name} = "),
                    _ => String::new(),
                };
                let compiled = if of_all { status(first) } else { String::new() };
                out.push(format!("{name}{}{compiled}", self.by_call(&texts, say.several)));
                for fact in facts {
                    self.derivatives(fact, say.several, out);
                }
            }
        }
    }

    /// How the values of a variable change.
    fn derivatives(&self, fact: &Fact, several: bool, out: &mut Vec<String>) {
        let What::Set { derivatives, .. } = &fact.what else { return };
        let shown = match derivatives.len() {
            n if self.style.all || n <= 1 => derivatives,
            n => &derivatives[n - 1..],
        };
        for derivs in shown {
            let last = if shown.len() < derivatives.len() { "the last: " } else { "" };
            let call = if several { format!(" (call {})", fact.call) } else { String::new() };
            if derivs.dx.iter().chain(&derivs.dy).all(|x| *x == 0.0) {
                out.push(format!("  {last}derivative 0{}{call}", nothing(derivs)));
                continue;
            }
            let mut text = format!("  {last}");
            if !derivs.du.is_empty() {
                text += &format!("d/du = {}, d/dv = {}; ", list(&derivs.du), list(&derivs.dv));
            }
            text += &format!("to the next pixel {} in x, {} in y", list(&derivs.dx), list(&derivs.dy));
            if !derivs.why.is_empty() {
                text += &format!(", as the language defines it: {}", derivs.why.join("; "));
            }
            out.push(text + &through(&derivs.through) + &call);
        }
    }

    /// A called function, and why it is called rather than another one.
    fn form(&self, form: &str, why: &str, out: &mut Vec<String>) {
        let mut lines = why.lines();
        out.push(format!("calls {form}{}", in_brackets(lines.next().unwrap_or_default())));
        out.extend(lines.map(|line| format!("  {line}")));
    }

    /// Calls, one below the other.
    fn list(&self, calls: &[String], out: &mut Vec<String>) {
        let shown = if self.style.all || calls.len() <= SHOWN + 1 { calls.len() } else { SHOWN - 1 };
        out.extend(calls[..shown].iter().map(|call| format!("  {call}")));
        if let (true, Some(last)) = (calls.len() > shown, calls.last()) {
            out.push(format!("  … {} calls in all, the last:", calls.len()));
            out.push(format!("  {last}"));
        }
    }

    /// The texts about one thing in several calls of a function.
    fn by_call(&self, texts: &[(usize, String)], several: bool) -> String {
        if !several {
            return texts.first().map_or_else(String::new, |(_, text)| text.clone());
        }
        let in_call = |(call, text): &(usize, String)| format!("{text} (call {call})");
        match texts {
            [one] => in_call(one),
            [(_, first), ..] if texts.iter().all(|(_, text)| text == first) => {
                format!("{first} (in {} calls)", texts.len())
            }
            few if self.style.all || few.len() <= SHOWN + 1 => {
                few.iter().map(in_call).collect::<Vec<_>>().join("; ")
            }
            many => {
                let start: Vec<String> = many[..SHOWN - 1].iter().map(in_call).collect();
                let last = many.last().map_or_else(String::new, in_call);
                format!("{}; … {last} ({} calls)", start.join("; "), many.len())
            }
        }
    }

    fn sentence(&self, what: &What, say: Say) -> String {
        match what {
            What::Set { values, .. } => self.values(values),
            What::Branch { test, condition, taken, flips, known } => {
                let outcome = outcome(taken, *flips, *known);
                match test {
                    Test::If if !say.named => outcome,
                    Test::If | Test::Operand => format!("`{condition}` is {outcome}"),
                    Test::Choice => format!("`{condition} ?` is {outcome}"),
                }
            }
            What::Unevaluated { condition } => format!("`{condition}` is not evaluated"),
            What::Rounds { counts } => self.rounds(counts),
            What::Call { .. } | What::Enter { .. } => String::new(),
        }
    }

    fn values(&self, values: &[Shown]) -> String {
        let all: Vec<String> = values.iter().map(|v| self.value(v)).collect();
        match &all[..] {
            [one] => one.clone(),
            several if several.iter().all(|v| *v == several[0]) => {
                format!("{}, {} times", several[0], several.len())
            }
            few if self.style.all || few.len() <= SHOWN + 2 => few.join(", "),
            many => {
                let last = many.last().map_or("", String::as_str);
                let numbers: Option<Vec<f64>> = values.iter().map(Shown::number).collect();
                let range = numbers.map_or_else(String::new, |numbers| extremes(&numbers));
                format!("{}, … {last} ({} values{range})", many[..SHOWN].join(", "), many.len())
            }
        }
    }

    fn rounds(&self, counts: &[usize]) -> String {
        let rounds = |n: usize| match n {
            0 => "no rounds".to_string(),
            1 => "one round".to_string(),
            n => format!("{n} rounds"),
        };
        match counts {
            [] => String::new(),
            [one] => rounds(*one),
            [first, ..] if counts.iter().all(|count| count == first) => {
                format!("{}, {}", rounds(*first), times(counts.len()))
            }
            [few @ .., last] if self.style.all || counts.len() <= SHOWN + 1 => {
                let few: Vec<String> = few.iter().map(usize::to_string).collect();
                format!("{} and {last} rounds", few.join(", "))
            }
            many => {
                let few: Vec<String> = many[..SHOWN].iter().map(usize::to_string).collect();
                let least = many.iter().min().copied().unwrap_or(0);
                let most = many.iter().max().copied().unwrap_or(0);
                format!("{}, … rounds ({} times, from {least} to {most})", few.join(", "), many.len())
            }
        }
    }

    fn call(&self, form: &str, (args, result): &(Vec<Shown>, Option<Shown>)) -> String {
        let args: Vec<String> = args.iter().map(Shown::value).collect();
        let result = result.as_ref().map_or(String::new(), |r| format!(" = {}", self.value(r)));
        format!("{}({}){result}", name_of(form), args.join(", "))
    }

    /// A call of a function of the source, with its number.
    fn entered(&self, number: usize) -> Option<String> {
        let called = self.calls.get(number.checked_sub(1)?)?;
        let given: Vec<String> =
            called.given.iter().map(|(name, value)| format!("{name} = {}", value.value())).collect();
        let mut text = format!("call {number}: {}({})", name_of(&called.form), given.join(", "));
        for (name, value) in &called.results {
            let value = self.value(value);
            text += &if name.is_empty() { format!(" = {value}") } else { format!(", {name} = {value}") };
        }
        Some(text)
    }
}

/// What a run reports, line by line.
fn reported(reported: &Reported) -> Vec<String> {
    let Reported { severity, message, help } = reported;
    let help = help.as_ref().map_or_else(String::new, |help| format!("; {help}"));
    let text = format!("{severity}: {message}{help}");
    let line = |(at, line): (usize, &str)| {
        let indent = if at == 0 { "" } else { "    " };
        shown(&format!("{indent}{line}")).into_owned()
    };
    text.lines().enumerate().map(line).collect()
}

/// The variables from which a value is made.
fn through(names: &[(String, Option<u32>)]) -> String {
    let names = names.iter().map(|(name, line)| match line {
        Some(line) => format!("{name} (line {line})"),
        None => name.clone(),
    });
    let names: Vec<String> = names.collect();
    if names.is_empty() { String::new() } else { format!("; through {}", names.join(", ")) }
}

/// Why a derivative is 0.
fn nothing(derivs: &Derivatives) -> String {
    match derivs.made {
        ValueOrigin::Constant => ": a constant here".to_string(),
        _ if !derivs.why.is_empty() => format!(" in the language: {}", derivs.why.join("; ")),
        _ if !derivs.through.is_empty() => through(&derivs.through),
        _ if !derivs.still.is_empty() => {
            through(&derivs.still)
                + if derivs.still.len() == 1 { ", which has none" } else { ", which have none" }
        }
        _ => ": it stays the same around this point".to_string(),
    }
}

/// A number, or the components of a triple.
fn list(numbers: &[f64]) -> String {
    match numbers {
        [one] => number(*one),
        several => {
            let all: Vec<String> = several.iter().map(|x| number(*x)).collect();
            format!("({})", all.join(" "))
        }
    }
}

/// What identifies a fact besides the call: its kind and its subject.
fn about(what: &What) -> (u8, &str) {
    match what {
        What::Set { name, .. } => (0, name),
        What::Branch { condition, .. } | What::Unevaluated { condition } => (1, condition),
        What::Rounds { .. } => (2, ""),
        What::Call { form, .. } => (3, form),
        What::Enter { form, .. } => (4, form),
    }
}

fn in_brackets(why: &str) -> String {
    if why.is_empty() { String::new() } else { format!(" ({why})") }
}

/// The name of a function, from its declaration.
fn name_of(form: &str) -> &str {
    form.split('(').next().and_then(|head| head.split(' ').next_back()).unwrap_or("")
}

fn compiled_words(compiled: Compiled) -> Option<String> {
    match compiled {
        Compiled::Kept => None,
        Compiled::NotNeeded => Some("not needed".to_string()),
        Compiled::Constant => Some("known when the shader is compiled".to_string()),
        Compiled::SameAsLine(line) => Some(format!("line {line} computes the same")),
    }
}

fn compiled_text(compiled: Compiled) -> String {
    compiled_words(compiled).map_or_else(String::new, |words| format!(" ({words})"))
}

/// Says which values of a list are known when the shader is compiled, or not needed: `(values 1 to 3, 5 not
/// needed)`.
fn each_text(each: &[Compiled]) -> String {
    let mut kinds: Vec<(String, Vec<(usize, usize)>)> = Vec::new();
    for (number, compiled) in (1..).zip(each) {
        let Some(words) = compiled_words(*compiled) else { continue };
        let at = kinds.iter().position(|(known, _)| *known == words).unwrap_or(kinds.len());
        if at == kinds.len() {
            kinds.push((words, Vec::new()));
        }
        match kinds[at].1.last_mut() {
            Some((_, end)) if *end + 1 == number => *end = number,
            _ => kinds[at].1.push((number, number)),
        }
    }
    let parts = kinds.into_iter().map(|(words, runs)| {
        let few: Vec<String> = runs
            .iter()
            .take(SHOWN)
            .map(|run| match run {
                (start, end) if start == end => start.to_string(),
                (start, end) => format!("{start} to {end}"),
            })
            .collect();
        let more = if runs.len() > SHOWN { ", …" } else { "" };
        let value = if matches!(runs[..], [(start, end)] if start == end) { "value" } else { "values" };
        format!("{value} {}{more} {words}", few.join(", "))
    });
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() { String::new() } else { format!(" ({})", parts.join("; ")) }
}

fn extremes(numbers: &[f64]) -> String {
    let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
    let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!(" from {} to {}", number(least), number(most))
}

fn times(n: usize) -> String {
    match n {
        1 => "once".to_string(),
        2 => "twice".to_string(),
        n => format!("{n} times"),
    }
}

/// How often a condition was true and false.
fn outcome(taken: &[bool], flips: usize, known: bool) -> String {
    let yes = taken.iter().filter(|t| **t).count();
    let no = taken.len() - yes;
    let mut text = match (yes, no) {
        (1, 0) => "true".to_string(),
        (0, 1) => "false".to_string(),
        (yes, 0) => format!("true {}", times(yes)),
        (0, no) => format!("false {}", times(no)),
        (yes, no) => format!("true {}, false {}", times(yes), times(no)),
    };
    if known {
        text += "; known when the shader is compiled";
    }
    if flips > 0 {
        let _ = write!(text, "; double precision says otherwise {}", times(flips));
    }
    text
}
