//! Text of the reference of the built-in functions: a list, an entry, the page in `docs`.
//!
//! [`osl::reference`] has the data.

use osl::reference::{Function, NOISE_FIELDS, RULES, Topic, functions, topics};
use std::fmt::Write;

/// The functions whose first argument names a field.
const NAMES_FIELDS: [&str; 2] = ["noise", "pnoise"];

/// Width of text for terminals in columns.
const WIDTH: usize = 96;

/// The functions of each family.
fn families(all: &[Function]) -> impl Iterator<Item = &[Function]> {
    all.chunk_by(|a, b| a.family == b.family)
}

/// All functions, family by family, one per line.
pub fn list() -> String {
    let mut text = String::new();
    let all = functions();
    let width = all.iter().map(|f| f.name.len()).max().unwrap_or(0);
    for family in families(&all) {
        let _ = writeln!(text, "{}", family[0].family);
        for f in family {
            let _ = writeln!(text, "  {:width$}  {}", f.name, first_sentence(f.about));
        }
        text.push('\n');
    }
    let words = topics();
    for kind in words.chunk_by(|a, b| a.kind == b.kind) {
        let _ = writeln!(text, "{}s", capital(kind[0].kind));
        for word in kind {
            let _ = writeln!(text, "  {:width$}  {}", word.name, first_sentence(word.about));
        }
        text.push('\n');
    }
    let nodes: Vec<&str> = crate::nodes::names().collect();
    let _ =
        writeln!(text, "Built-in nodes\n  {}\n", wrapped(&nodes.join(", ")).trim_end().replace('\n', "\n  "));
    text.push_str("`oslrun doc NAME` prints the entry of a name.\n");
    text
}

fn capital(word: &str) -> String {
    let mut chars = word.chars();
    chars.next().map(|first| first.to_uppercase().chain(chars).collect()).unwrap_or_default()
}

/// The entry of a word that is not a function, for terminals.
pub fn topic(topic: &Topic) -> String {
    let mut text = format!("{} ({})\n\n    {}\n\n", topic.name, topic.kind, topic.form);
    text.push_str(&wrapped(topic.about));
    text.push_str("\nExample:\n\n");
    for line in statements(topic.example) {
        let _ = writeln!(text, "    {line}");
    }
    text
}

/// The entry of a function, for terminals.
pub fn entry(row: &Function) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{} ({})\n", row.name, row.family);
    for signature in &row.signatures {
        let _ = writeln!(text, "    {}", signature.text);
    }
    if !row.signatures.is_empty() {
        text.push('\n');
    }
    let parts = [
        ("", row.about),
        ("Derivatives: ", row.derivatives),
        ("Extremes: ", row.extremes),
        ("From: ", row.source),
    ];
    for (label, part) in parts {
        text.push_str(&wrapped(&format!("{label}{}", sentence(part))));
        text.push('\n');
    }
    if NAMES_FIELDS.contains(&row.name) {
        text.push_str("The fields:\n\n");
        for (field, range, look) in NOISE_FIELDS {
            let _ = writeln!(text, "    {:10} {range:14} {look}", format!("\"{field}\""));
        }
        text.push('\n');
    }
    text.push_str("Example:\n\n");
    for line in example(row) {
        let _ = writeln!(text, "    {line}");
    }
    text
}

/// The whole reference, as the page `docs/builtins.md`.
pub fn markdown() -> String {
    let mut text = String::from(
        "# Built-in functions\n\n\
         Written from the table of built-ins by `oslrun doc --markdown`; `oslrun doc NAME` prints one entry. Every \
         example is compiled and run by a test, and so are the extremes (`tests/data/extremes.txt`): folded and \
         when running, on every instruction set.\n\n\
         ## What holds everywhere\n\n",
    );
    for (what, rule) in RULES {
        let _ = writeln!(text, "* **{}**: {rule}", escaped(what));
    }
    text.push_str("\n## Contents\n\n");
    let all = functions();
    for family in families(&all) {
        let links: Vec<String> =
            family.iter().map(|f| format!("[{}](#{})", escaped(f.name), anchor(f.name))).collect();
        let _ = writeln!(text, "* {}: {}", family[0].family, links.join(", "));
    }
    for family in families(&all) {
        let _ = write!(text, "\n## {}\n\n{}\n", family[0].family, escaped(family[0].source));
        family.iter().for_each(|row| section(&mut text, row));
    }
    text
}

fn section(text: &mut String, row: &Function) {
    let _ = write!(text, "\n### {}\n\n", row.name);
    if !row.signatures.is_empty() {
        let signatures: Vec<&str> = row.signatures.iter().map(|s| s.text.as_str()).collect();
        let _ = write!(text, "```c\n{}\n```\n\n", signatures.join("\n"));
    }
    let _ = write!(text, "{}\n\n", escaped(row.about));
    let _ = write!(text, "*Derivatives*: {}\n\n", escaped(&sentence(row.derivatives)));
    let _ = write!(text, "*Extremes*: {}\n\n", escaped(row.extremes));
    let _ = write!(text, "```c\n{}\n```\n", example(row).join("\n"));
}

/// The statements of the example, one per line.
fn example(row: &Function) -> Vec<String> {
    statements(row.example)
}

fn statements(text: &str) -> Vec<String> {
    // The parts of a `for` and the body of a block stay together.
    if text.contains(['{', '(']) && (text.contains("for (") || text.contains("{ ")) {
        return vec![text.to_string()];
    }
    let statements = text.split_inclusive("; ");
    statements.map(|s| s.trim_end().to_string()).collect()
}

fn sentence(text: &str) -> String {
    if text.ends_with('.') { text.to_string() } else { format!("{text}.") }
}

fn first_sentence(text: &str) -> &str {
    text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.')
}

/// The text in lines of a terminal's width; if there are several, all but the first are indented.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(line) = lines.last_mut() else { break };
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(word.to_string());
            continue;
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.join("\n") + "\n"
}

/// Markdown that displays the text unchanged. Names between backticks are code there too.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut code = false;
    for c in text.chars() {
        code ^= c == '`';
        if !code && matches!(c, '*' | '_' | '<' | '>' | '[' | ']' | '#') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// The anchor that a heading gets.
fn anchor(heading: &str) -> String {
    heading.to_lowercase().replace(' ', "-")
}
