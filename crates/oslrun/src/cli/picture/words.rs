//! The words of a command line: without some of its options, and as the text that an EXR file keeps.
//!
//! The text has what decides the values of a picture, so equal commands write equal files on every machine
//! and with any number of threads. It has no folders of the machine.

use std::ffi::OsString;
use std::path::Path;

/// Options to leave out, by name.
pub(super) struct Left {
    /// Those with a value, as the next word or after `=`.
    pub(super) valued: &'static [&'static str],
    /// Those without a value, or with one after `=` only.
    pub(super) alone: &'static [&'static str],
}

/// The options that do not change the values of a picture.
const SAME_VALUES: Left = Left {
    valued: &[
        "-o",
        "--output",
        "--format",
        "-I",
        "--texture-path",
        "--shader-path",
        "--search-path",
        "--threads",
        "--batch",
        "--isa",
        "--texture-memory",
        "--max-steps",
        "--limit",
        "--max-time",
        "--max-memory",
        "--message-format",
        "--write",
        "-W",
        "--warn",
        "-A",
        "--allow",
        "--deny",
        "--compression",
    ],
    alone: &["--stats", "--histogram", "--profile", "--json", "--watch", "--allow-files"],
};

impl Left {
    /// The words without these options and their values.
    pub(super) fn removed(&self, words: impl IntoIterator<Item = String>) -> Vec<String> {
        let mut words = words.into_iter();
        let mut kept = Vec::new();
        while let Some(word) = words.next() {
            if self.valued.contains(&word.as_str()) {
                let _ = words.next();
            } else if !self.alone.contains(&word.as_str()) && !self.is_joined(&word) {
                kept.push(word);
            }
        }
        kept
    }

    /// Whether a word is one of the options together with its value: `--port=80`, `-pa=1`.
    fn is_joined(&self, word: &str) -> bool {
        if word.starts_with("--") {
            let name = word.split_once('=').map(|(name, _)| name);
            return name.is_some_and(|name| self.valued.contains(&name) || self.alone.contains(&name));
        }
        self.valued.iter().any(|option| !option.starts_with("--") && word.starts_with(option))
    }
}

/// Whether a command line says that files are not to have it.
const NONE: &str = "--no-command";

/// The text of a command line for an EXR file; none if the command line says so. `main` is the shader or the
/// scene, which is written without its folder.
pub(super) fn text(words: &[OsString], main: Option<&Path>) -> Option<String> {
    let words = words.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    let words = SAME_VALUES.removed(words);
    if words.iter().any(|word| word == NONE) {
        return None;
    }
    let mut main = main.and_then(|path| Some((path.to_str()?, path.file_name()?.to_str()?)));
    let shown = words.iter().map(|word| match main {
        Some((path, name)) if path == word => {
            main = None;
            quoted(name)
        }
        _ => quoted(&without_folders(word)),
    });
    Some(std::iter::once("oslrun".to_string()).chain(shown).collect::<Vec<_>>().join(" "))
}

/// A command line as it was typed.
pub(super) fn typed(words: &[OsString]) -> String {
    line(words.iter().skip(1).map(|word| word.to_string_lossy().into_owned()))
}

/// A command line of these words.
pub(super) fn line(words: impl IntoIterator<Item = String>) -> String {
    let quoted = words.into_iter().map(|word| quoted(&word));
    std::iter::once("oslrun".to_string()).chain(quoted).collect::<Vec<_>>().join(" ")
}

/// A text with the file names alone of its absolute paths.
fn without_folders(text: &str) -> String {
    let ends = |c: char| c.is_whitespace() || "=,;()\"'".contains(c);
    let part = |part: &str| {
        let (path, end) = match part.char_indices().next_back() {
            Some((at, last)) if ends(last) => part.split_at(at),
            _ => (part, ""),
        };
        let is_drive =
            matches!(path.as_bytes(), [letter, b':', b'/' | b'\\', ..] if letter.is_ascii_alphabetic());
        let name = path.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next().unwrap_or_default();
        match is_drive || path.starts_with(['/', '~', '\\']) {
            true => format!("{name}{end}"),
            false => part.to_string(),
        }
    };
    text.split_inclusive(ends).map(part).collect()
}

/// A word as a shell takes it.
pub(super) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_@%+=:,./-".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(line: &str) -> Option<String> {
        let words: Vec<OsString> = line.split(' ').map(Into::into).collect();
        text(&words, Some(Path::new("/home/me/a.osl")))
    }

    #[test]
    fn the_text_has_what_decides_the_values() {
        let line =
            "x/oslrun /home/me/a.osl -g 8x8 -o /home/me/b.exr --threads 2 -p a=1 --isa=sse2 -Iinc --stats";
        assert_eq!(told(line).as_deref(), Some("oslrun a.osl -g 8x8 -p a=1"));
        assert_eq!(told("oslrun /home/me/a.osl --no-command"), None);
        assert_eq!(
            told("oslrun render b/c.ass --samples 4").as_deref(),
            Some("oslrun render b/c.ass --samples 4")
        );
    }

    #[test]
    fn absolute_paths_lose_their_folders() {
        let line = "oslrun -p Image=/home/me/t.png -p other=t/u.png --on C:\\me\\m.obj -D X=~/y";
        assert_eq!(told(line).as_deref(), Some("oslrun -p Image=t.png -p other=t/u.png --on m.obj -D X=y"));
        let group = "param string f \"/home/me/t.png\" ; shader /x/y z";
        assert_eq!(without_folders(group), "param string f \"t.png\" ; shader y z");
        assert_eq!(without_folders("a/b -1/2 1,2"), "a/b -1/2 1,2");
        assert_eq!(quoted("it's"), "'it'\\''s'");
    }
}
