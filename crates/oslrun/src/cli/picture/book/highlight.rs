//! Syntax colors: the lines of a source as HTML, with comments, words, numbers and texts marked.
//!
//! It reads letters, not the grammar, so that any text has colors.

use osl_measure::page::escape;
use std::fmt::Write;

/// Words of the language, by the class of their color.
const WORDS: [(&str, &[&str]); 3] = [
    (
        "k",
        &[
            "break",
            "continue",
            "do",
            "else",
            "for",
            "if",
            "output",
            "return",
            "struct",
            "while",
            "shader",
            "surface",
            "displacement",
            "volume",
        ],
    ),
    ("t", &["int", "float", "color", "point", "vector", "normal", "matrix", "string", "void", "closure"]),
    ("g", &["P", "I", "N", "Ng", "u", "v", "dPdu", "dPdv", "Ps", "time", "dtime", "dPdtime", "Ci"]),
];

/// The state at the end of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    in_comment: bool,
}

/// One line as HTML.
pub(super) fn line(text: &str, state: &mut State) -> String {
    let mut out = String::new();
    let mut rest = text;
    let mut put = |class: &str, text: &str| {
        let _ = match class {
            "" => write!(out, "{}", escape(text)),
            _ => write!(out, "<i class={class}>{}</i>", escape(text)),
        };
    };
    while let Some(first) = rest.chars().next() {
        let (class, length) = if state.in_comment {
            let end = rest.find("*/");
            state.in_comment = end.is_none();
            ("c", end.map_or(rest.len(), |end| end + 2))
        } else if rest.starts_with("//") {
            ("c", rest.len())
        } else if rest.starts_with("/*") {
            state.in_comment = true;
            ("c", 2)
        } else if first == '#' {
            ("p", rest.len())
        } else if first == '"' {
            ("s", end_of_text(rest))
        } else if first.is_ascii_digit() {
            ("n", span(rest, |c| c.is_ascii_alphanumeric() || c == '.'))
        } else if first.is_ascii_alphabetic() || first == '_' {
            let length = span(rest, |c| c.is_ascii_alphanumeric() || c == '_');
            let word = rest.get(..length).unwrap_or_default();
            let class = WORDS.iter().find(|(_, list)| list.contains(&word)).map_or("", |(class, _)| class);
            let is_call = rest.get(length..).unwrap_or_default().trim_start().starts_with('(');
            (if class.is_empty() && is_call { "f" } else { class }, length)
        } else {
            ("", first.len_utf8())
        };
        let (done, after) = rest.split_at_checked(length).unwrap_or((rest, ""));
        put(class, done);
        rest = after;
    }
    out
}

/// The length of the letters at the start that belong together.
fn span(text: &str, belongs: impl Fn(char) -> bool) -> usize {
    text.find(|c| !belongs(c)).unwrap_or(text.len())
}

/// The length of a text in quotes.
fn end_of_text(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_colors_and_keep_their_text() {
        let mut state = State::default();
        let shown = line("float d = noise(\"cell\", 2.5); // <b>", &mut state);
        assert_eq!(
            shown,
            "<i class=t>float</i> d = <i class=f>noise</i>(<i class=s>&quot;cell&quot;</i>, <i class=n>2.5</i>); \
             <i class=c>// &lt;b&gt;</i>"
        );
        assert_eq!(line("a /* b", &mut state), "a <i class=c>/*</i><i class=c> b</i>");
        assert_eq!(line("c */ if", &mut state), "<i class=c>c */</i> <i class=k>if</i>");
        assert_eq!(line("\"open \\\" é", &mut state), "<i class=s>&quot;open \\&quot; é</i>");
        assert_eq!(line("\u{202e}é", &mut state), "\\u{202e}é");
    }
}
