//! Valid shaders with one slip, and with two: the number of errors stays small, and none hides another.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages::{self, Diagnostic, Options, SourceProvider};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most errors of one slip, and the mean of those that have errors. Measured: 6 and 1.08. The worst is a
/// deleted `{` of a list of constructors, whose `}` then ends the shader.
const WORST: usize = 6;
const MEAN: f64 = 1.1;

/// The headers under `osl`.
struct Headers;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

impl SourceProvider for Headers {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        let path = root().join("osl").join(name);
        let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
        Ok((name.to_string(), text.into()))
    }
}

fn errors(text: &str) -> Vec<Diagnostic> {
    let checked = stages::check("slip.osl", text, &Headers, &Options::default());
    assert_eq!(checked.program.is_none(), checked.broken.is_some());
    checked.diagnostics.into_iter().filter(Diagnostic::is_error).collect()
}

/// The sources under a folder, in order of their names.
fn sources(folder: &Path, out: &mut Vec<(PathBuf, String)>) {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "osl")
            && let Ok(text) = std::fs::read_to_string(&path)
            && errors(&text).is_empty()
        {
            out.push((path, text));
        }
    }
}

fn valid() -> Vec<(PathBuf, String)> {
    let mut list = Vec::new();
    for folder in ["osl", "tests/data"] {
        sources(&root().join(folder), &mut list);
    }
    // What is newer than the limits comes last, so that the slips in the other files stay what they were.
    let newer = [
        "faults",
        "oso_forms",
        "published",
        "text/format_at_run_time.osl",
        "text/nan_components.osl",
        "dialects",
    ]
    .map(|name| root().join("tests/data").join(name));
    list.sort_by_key(|(path, _)| newer.iter().position(|newer| path.starts_with(newer)).map_or(0, |n| n + 1));
    list
}

/// A generator of choices that is the same everywhere.
struct Choices(u64);

impl Choices {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize).checked_rem(n).unwrap_or(0)
    }
}

/// The tokens of a source: byte ranges without comments, directives and spaces.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let mut list = Vec::new();
    let mut at = 0;
    let until = |from: usize, end: &str| text[from..].find(end).map_or(text.len(), |n| from + n + end.len());
    while at < bytes.len() {
        let start = at;
        let rest = &text[at..];
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if rest.starts_with("//") || rest.starts_with('#') {
            at = until(at, "\n");
        } else if rest.starts_with("/*") {
            at = until(at, "*/");
        } else if bytes[at].is_ascii_whitespace() || !bytes[at].is_ascii() {
            at += rest.chars().next().unwrap().len_utf8();
        } else if bytes[at] == b'"' {
            at += 1;
            while at < bytes.len() && bytes[at] != b'"' {
                at += if bytes[at] == b'\\' { 2 } else { 1 };
            }
            at = (at + 1).min(bytes.len());
            list.push((start, at));
        } else if rest.starts_with(is_word) {
            let number = bytes[at].is_ascii_digit();
            at += rest.find(|c| !(is_word(c) || number && c == '.')).unwrap_or(rest.len());
            list.push((start, at));
        } else {
            let two = ["++", "--", "==", "!=", "<=", ">=", "&&", "||", "+=", "-=", "*=", "/=", "[[", "]]"];
            at += if two.iter().any(|t| rest.starts_with(t)) { 2 } else { 1 };
            list.push((start, at));
        }
    }
    list
}

/// One change of the text: what replaces a range.
#[derive(Clone, Debug)]
struct Slip {
    at: (usize, usize),
    text: String,
}

fn slip(text: &str, tokens: &[(usize, usize)], choices: &mut Choices) -> Slip {
    loop {
        let at = tokens[choices.below(tokens.len())];
        let word = &text[at.0..at.1];
        let other = tokens[choices.below(tokens.len())];
        let name = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && word.len() > 1;
        let text = match choices.below(4) {
            0 => String::new(),
            1 => format!("{word} {word}"),
            2 => text[other.0..other.1].to_string(),
            _ if name => {
                let n = choices.below(word.len() - 1) + 1;
                format!("{}{}", &word[..n], &word[(n + 1).min(word.len())..])
            }
            _ => continue,
        };
        if text != word {
            return Slip { at, text };
        }
    }
}

fn with(text: &str, slips: &[&Slip]) -> String {
    let mut sorted = slips.to_vec();
    sorted.sort_by_key(|s| s.at);
    let mut out = String::new();
    let mut from = 0;
    for slip in sorted {
        out += &text[from..slip.at.0];
        out += &slip.text;
        from = slip.at.1;
    }
    out + &text[from..]
}

/// Slips of a source: more for longer ones.
fn slips(text: &str, seed: usize) -> Vec<Slip> {
    let tokens = tokens(text);
    let mut choices = Choices(seed as u64 * 977 + 5);
    let n = (tokens.len() / 20).clamp(4, 40);
    if tokens.is_empty() { Vec::new() } else { (0..n).map(|_| slip(text, &tokens, &mut choices)).collect() }
}

/// Sources with one slip: most have one error, and none has many.
#[test]
fn one_slip_makes_few_errors() {
    let mut counts: Vec<usize> = Vec::new();
    for (seed, (path, text)) in valid().iter().enumerate() {
        for slip in slips(text, seed) {
            let broken = with(text, &[&slip]);
            let errors = errors(&broken).len();
            assert!(errors <= WORST, "{errors} errors in {}:\n{broken}", path.display());
            counts.extend((errors > 0).then_some(errors));
        }
    }
    let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
    assert!(counts.len() > 2_000 && mean < MEAN, "{} slips with errors, {mean} errors each", counts.len());
}

/// The range of the function, struct or shader around a position: its lines up to the next `}` at the margin.
fn declarations(text: &str) -> Vec<(usize, usize)> {
    let mut list = Vec::new();
    let mut from = None;
    let mut depth = 0;
    for (start, end) in tokens(text) {
        from.get_or_insert(start);
        match &text[start..end] {
            "{" | "(" | "[[" => depth += 1,
            "}" | ")" | "]]" => depth -= 1,
            _ => {}
        }
        if depth == 0 && matches!(&text[start..end], "}" | ";") {
            list.extend(from.take().map(|from| (from, end)));
        }
    }
    list
}

/// Two slips in two declarations, each with errors only in its own declaration, are both reported together.
#[test]
fn two_slips_are_both_reported() {
    let mut pairs = 0;
    for (seed, (path, text)) in valid().iter().enumerate() {
        let declarations = declarations(text);
        let place = |at: usize| declarations.iter().position(|(from, to)| *from <= at && at < *to);
        // The errors of a slip by declaration, if they are all in its own.
        let local = |slip: &Slip| {
            // A bracket moves the ends of other declarations too.
            let brackets = ['{', '}', '(', ')', '[', ']'];
            if slip.text.contains(brackets) || text[slip.at.0..slip.at.1].contains(brackets) {
                return None;
            }
            let own = place(slip.at.0)?;
            let shift = slip.text.len() as isize - (slip.at.1 - slip.at.0) as isize;
            let list = errors(&with(text, &[slip]));
            let at = |d: &Diagnostic| match d.span.start as usize {
                at if at > slip.at.0 => (at as isize - shift) as usize,
                at => at,
            };
            (!list.is_empty() && list.iter().all(|d| place(at(d)) == Some(own))).then_some(own)
        };
        // Types of a struct that is broken are unknown, and so are the parameters of a function, so that
        // errors about them are left out.
        let is_made_of = |made_at: usize, user: usize| {
            let of = |at: usize| &text[declarations[at].0..declarations[at].1];
            let name = match of(made_at).strip_prefix("struct ") {
                Some(rest) => rest.split_whitespace().next(),
                None => of(made_at).split('(').next().and_then(|head| head.split_whitespace().nth(1)),
            };
            name.is_some_and(|name| of(user).contains(name))
        };
        let slips: Vec<(usize, Slip)> =
            slips(text, seed + 1).into_iter().filter_map(|slip| Some((local(&slip)?, slip))).collect();
        for (n, (first, a)) in slips.iter().enumerate() {
            let Some((second, b)) = slips.iter().skip(n + 1).find(|(second, _)| {
                second != first && !is_made_of(*first, *second) && !is_made_of(*second, *first)
            }) else {
                continue;
            };
            pairs += 1;
            let broken = with(text, &[a, b]);
            let list = errors(&broken);
            // Declarations keep their order, and slips of this kind neither add nor remove one.
            let shift = |at: usize| {
                let moved = [a, b].map(|slip| match slip.at.0 < at {
                    true => slip.text.len() as isize - (slip.at.1 - slip.at.0) as isize,
                    false => 0,
                });
                (at as isize + moved.iter().sum::<isize>()) as u32
            };
            for own in [*first, *second] {
                let (from, to) = declarations[own];
                let (from, to) = (shift(from), shift(to));
                assert!(
                    list.iter().any(|d| from <= d.span.start && d.span.start <= to),
                    "{}: {a:?} and {b:?}, no error in {from}..{to}:\n{broken}\n{list:#?}",
                    path.display()
                );
            }
        }
    }
    assert!(pairs > 100, "{pairs}");
}
