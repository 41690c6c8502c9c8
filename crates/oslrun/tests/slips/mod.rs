//! Slips of beginners (`tests/data/slips.txt`): what the compiler says about each, and whether it is right.
//!
//! A slip is right if the suggested edits make the text that was meant and this text compiles, or, where only
//! the author knows the text, if the message has the right words and no edit is offered. An edit that makes
//! another text is misleading.

use osl::{Analysis, Diagnostic, Levels, NoFiles, ReadOptions};

/// A slip and what was meant.
pub(crate) struct Slip {
    pub(crate) title: String,
    pub(crate) text: String,
    meant: Meant,
}

enum Meant {
    Edit(String),
    Advice(String),
}

/// The judgement on a slip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    Right,
    /// The message does not help.
    Silent,
    /// An edit makes another text than the one that was meant.
    Misleading,
}

/// What the compiler says about a slip, and the judgement.
pub(crate) struct Judged {
    pub(crate) verdict: Verdict,
    pub(crate) said: String,
    says: Vec<String>,
    helps: Vec<String>,
}

/// The slips of the file.
pub(crate) fn slips() -> Vec<Slip> {
    let data = include_str!("../../../../tests/data/slips.txt");
    data.split("\n--- ")
        .skip(1)
        .map(|block| {
            let (title, rest) = block.split_once('\n').unwrap();
            let (text, meant) = rest.split_once("\n=== ").unwrap();
            let meant = match meant.trim_end().split_once('\n') {
                Some(("edit", meant)) => Meant::Edit(whole(meant)),
                _ => Meant::Advice(meant.trim().strip_prefix("advice ").unwrap().to_owned()),
            };
            Slip { title: title.to_owned(), text: text.to_owned(), meant }
        })
        .collect()
}

/// The body of a shader as a file; other texts are files already.
fn whole(text: &str) -> String {
    match text.contains("s(") && text.contains("output")
        || text.contains("shader s(")
        || text.starts_with("void ")
    {
        true => format!("{text}\n"),
        false => format!("shader s(float f = 1, color c = 1, output float r = 0) {{\n{text}\n}}\n"),
    }
}

fn diagnostics(text: &str) -> Vec<Diagnostic> {
    Analysis::of("slip.osl", text, &NoFiles, &ReadOptions::default())
        .diagnostics(&Levels::default().allow("unused-parameter"))
}

/// The text after the first edits of each diagnostic, from the last to the first.
fn fixed(text: &str, list: &[Diagnostic]) -> String {
    let mut edits: Vec<_> = list.iter().filter_map(|d| d.fixes.first()).flat_map(|fix| &fix.edits).collect();
    edits.sort_by_key(|edit| edit.range.start.offset);
    let mut out = text.to_owned();
    for edit in edits.into_iter().rev() {
        out.replace_range(edit.range.start.offset..edit.range.end.offset, &edit.text);
    }
    out
}

impl Slip {
    /// Checks the slip and its edits.
    pub(crate) fn judge(&self) -> Judged {
        let text = whole(&self.text);
        let list = diagnostics(&text);
        let has_edit = list.iter().any(|d| !d.fixes.is_empty());
        let mut said = String::new();
        for d in &list {
            said += &format!("{} {}: {}\n", d.code, d.message, d.label);
            d.notes.iter().chain(&d.help).for_each(|line| said += &format!("    {line}\n"));
            d.fixes.iter().for_each(|fix| said += &format!("    edit: {}\n", fix.title));
        }
        let verdict = match &self.meant {
            Meant::Edit(meant) if !has_edit => {
                assert_ne!(*meant, text, "{}", self.title);
                Verdict::Silent
            }
            Meant::Edit(meant) => {
                let fixed = fixed(&text, &list);
                let compiles = !diagnostics(&fixed).iter().any(Diagnostic::is_error);
                if fixed == *meant && compiles { Verdict::Right } else { Verdict::Misleading }
            }
            Meant::Advice(_) if has_edit => Verdict::Misleading,
            Meant::Advice(words) if said.contains(words) => Verdict::Right,
            Meant::Advice(_) => Verdict::Silent,
        };
        let says = list.iter().map(|d| format!("{}: {}", d.code, d.message)).collect();
        let helps = list
            .iter()
            .filter_map(|d| match d.fixes.first() {
                Some(fix) => Some(format!("edit: {}", fix.title)),
                None => d.help.clone().or_else(|| d.notes.first().cloned()),
            })
            .collect();
        Judged { verdict, said, says, helps }
    }
}

/// The table of the docs.
pub(crate) fn table() -> String {
    let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
    let mut out = String::from("| slip | oslrun says | and suggests | |\n|---|---|---|---|\n");
    let (mut right, mut all) = (0, 0);
    for slip in slips() {
        let judged = slip.judge();
        let verdict = match judged.verdict {
            Verdict::Right => "right",
            Verdict::Silent => "no help",
            Verdict::Misleading => "misleading",
        };
        right += usize::from(judged.verdict == Verdict::Right);
        all += 1;
        let code = slip.text.replace('\n', " ");
        let code = code.split_whitespace().collect::<Vec<_>>().join(" ");
        out += &format!(
            "| {}: `` {} `` | {} | {} | {verdict} |\n",
            cell(&slip.title),
            cell(&code),
            cell(&judged.says.join("; ")),
            cell(&judged.helps.join("; "))
        );
    }
    out + &format!("\n{right} of {all} are right.\n")
}
