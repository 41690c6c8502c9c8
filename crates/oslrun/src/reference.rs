//! The reference of the built-in functions, generated from their table: a list, an entry, the page in `docs`.
//!
//! This module must not know how functions are compiled, nor where its text is written.

use osl_ir::builtins::{self, Builtin, FAMILIES, Family};
use std::fmt::Write;

/// Width of text for terminals in columns.
const WIDTH: usize = 96;

/// The rules for all operators and functions: a heading and a text.
pub const RULES: [(&str, &str); 8] = [
    (
        "Floats",
        "Single precision, rounded operation by operation; denormals and the sign of zero are kept. Only the \
         sign of a zero derivative may depend on which values are known at compile time.",
    ),
    (
        "a / b",
        "0 if the quotient is not finite: x/0, 0/0, inf/2 and 1e38/1e-10 are 0. There is one exception: if a \
         varies from point to point, and b is a number other than 0 that is known at compile time, the result \
         may be inf or nan. For ints, b = 0 gives 0, and -2147483648/-1 is -2147483648.",
    ),
    ("a % b", "Ints only. The result has the sign of a, and is 0 for b = 0."),
    ("Int arithmetic", "Wraps at 32 bits. Shifts use the low five bits of their distance."),
    (
        "(int) x",
        "Removes the fraction. The result is -2147483648 for nan, inf, -inf, and all numbers out of range.",
    ),
    (
        "Comparisons",
        "All six are true if an operand is nan, including == and !=. A condition that is nan is true too.",
    ),
    (
        "Indices",
        "Indices of arrays, components and matrices are clamped to the valid range, and the run reports an error.",
    ),
    (
        "nan",
        "The sign and payload of a nan are the only results that may differ between processors; see isnan.",
    ),
];

/// The rows of a name: the function, or the constructors with a space that start with it.
pub fn find(name: &str) -> Vec<&'static Builtin> {
    let begins = |row: &&Builtin| row.name.split_once(' ').is_some_and(|(first, _)| first == name);
    builtins::all().filter(|row| row.name == name || begins(row)).collect()
}

/// The existing name that is closest to an unknown one.
pub fn closest(name: &str) -> Option<&'static str> {
    osl_syntax::spelling::closest(name, builtins::names())
}

/// All functions, family by family, one per line.
pub fn list() -> String {
    let mut text = String::new();
    let width = builtins::all().map(|row| row.name.len()).max().unwrap_or(0);
    for family in &FAMILIES {
        let _ = writeln!(text, "{}", family.title);
        for row in family.rows {
            let _ = writeln!(text, "  {:width$}  {}", row.name, first_sentence(row.about));
        }
        text.push('\n');
    }
    text.push_str("`oslrun doc NAME` prints the entry of a function.\n");
    text
}

/// The entry of a function, for terminals.
pub fn entry(row: &'static Builtin) -> String {
    let mut text = String::new();
    let family = family(row);
    let _ = writeln!(text, "{} ({})\n", row.name, family.map_or("", |f| f.title));
    for line in signatures(row) {
        let _ = writeln!(text, "    {line}");
    }
    if !signatures(row).is_empty() {
        text.push('\n');
    }
    let source = family.map_or("", |f| f.source);
    let parts = [
        ("", row.about),
        ("Derivatives: ", row.derivatives),
        ("Extremes: ", row.extremes),
        ("From: ", source),
    ];
    for (label, part) in parts {
        text.push_str(&wrapped(&format!("{label}{}", sentence(part))));
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
    for family in &FAMILIES {
        let links: Vec<String> =
            family.rows.iter().map(|row| format!("[{}](#{})", escaped(row.name), anchor(row.name))).collect();
        let _ = writeln!(text, "* {}: {}", family.title, links.join(", "));
    }
    for family in &FAMILIES {
        let _ = write!(text, "\n## {}\n\n{}\n", family.title, escaped(family.source));
        family.rows.iter().for_each(|row| section(&mut text, row));
    }
    text
}

fn section(text: &mut String, row: &'static Builtin) {
    let _ = write!(text, "\n### {}\n\n", row.name);
    let signatures = signatures(row);
    if !signatures.is_empty() {
        let _ = write!(text, "```c\n{}\n```\n\n", signatures.join("\n"));
    }
    let _ = write!(text, "{}\n\n", escaped(row.about));
    let _ = write!(text, "*Derivatives*: {}\n\n", escaped(&sentence(row.derivatives)));
    let _ = write!(text, "*Extremes*: {}\n\n", escaped(row.extremes));
    let _ = write!(text, "```c\n{}\n```\n", example(row).join("\n"));
}

fn family(row: &Builtin) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.rows.iter().any(|r| r.name == row.name))
}

/// The signatures as declarations; empty for constructors, whose description shows their form.
fn signatures(row: &'static Builtin) -> Vec<String> {
    if row.name.contains(' ') {
        return Vec::new();
    }
    row.signatures().iter().map(|s| s.show(row.name)).collect()
}

/// The statements of the example, one per line.
fn example(row: &Builtin) -> Vec<String> {
    let statements = row.example.split_inclusive("; ");
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

/// Markdown that displays the text unchanged.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '*' | '_' | '<' | '>' | '[' | ']' | '`' | '#') {
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
