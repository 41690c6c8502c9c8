//! A lesson for each diagnostic: the rule, a wrong example and a right one.
//!
//! The texts are the files of `docs/errors`, one per code, so that they can be read on the web; a program
//! that uses this module contains them. Their form: a heading `# CODE: title`, paragraphs, `Wrong:` with a
//! block of code, `Right:` with another. Tests check that each wrong example produces the code and that each
//! right one does not.
//!
//! ```
//! let lesson = osl::lessons::find("integer-division")[0];
//! assert_eq!(lesson.code, "W0312");
//! assert!(lesson.wrong.contains("shader"));
//! ```

mod files;

use osl_hir::{hir, lint, oso, resolve};
use osl_lower::group;
#[doc(inline)]
pub use osl_syntax::diagnostic::Code;
use std::sync::OnceLock;

/// A lesson.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lesson {
    /// The code that it explains, as in the file name.
    pub code: &'static str,
    /// A few words.
    pub title: &'static str,
    /// The rule, in one or more paragraphs.
    pub rule: &'static str,
    /// A source text that produces the code.
    pub wrong: &'static str,
    /// The corrected source text.
    pub right: &'static str,
    /// The whole lesson, as written.
    pub text: &'static str,
}

/// All lessons, by code.
pub fn all() -> &'static [Lesson] {
    static LESSONS: OnceLock<Vec<Lesson>> = OnceLock::new();
    LESSONS.get_or_init(|| files::FILES.iter().filter_map(|text| parse(text)).collect())
}

/// Every code that any stage of the compiler reports, in order of the number, errors first.
pub fn codes() -> Vec<Code> {
    let mut all: Vec<Code> = osl_syntax::errors::CODES.to_vec();
    all.extend(resolve::errors::ALL);
    all.extend([hir::TOO_LARGE, osl_lower::NO_OPERATION]);
    all.extend(oso::errors::ALL);
    all.extend(group::text::CODES);
    all.extend(lint::LINTS.iter().map(|l| l.code));
    all.sort_by_key(|code| code.id);
    all
}

/// The lessons of a code or a name, in any case. Some names belong to two codes, of different stages.
pub fn find(code_or_name: &str) -> Vec<&'static Lesson> {
    let fits = |code: &Code| {
        code_or_name.eq_ignore_ascii_case(code.id) || code_or_name.eq_ignore_ascii_case(code.name)
    };
    let wanted: Vec<Code> = codes().into_iter().filter(fits).collect();
    all().iter().filter(|lesson| wanted.iter().any(|code| code.id == lesson.code)).collect()
}

/// Up to three codes with a similar number or name, the closest first.
pub fn closest(code_or_name: &str) -> Vec<Code> {
    let text = code_or_name.to_lowercase();
    let distance = |code: &Code| {
        // A number may differ in one character, a name in a third of its length.
        let limits = [(code.id.to_lowercase(), 1), (code.name.to_owned(), code.name.len() / 3)];
        let distances = limits.map(|(known, limit)| (strsim::damerau_levenshtein(&text, &known), limit));
        distances
            .into_iter()
            .filter(|(distance, limit)| distance <= limit)
            .map(|(distance, _)| distance)
            .min()
    };
    let mut close: Vec<(usize, Code)> =
        codes().into_iter().filter_map(|code| distance(&code).map(|d| (d, code))).collect();
    close.sort_by_key(|(d, code)| (*d, code.id));
    close.into_iter().take(3).map(|(_, code)| code).collect()
}

/// Parses a lesson; `None` if the text has another form.
fn parse(text: &'static str) -> Option<Lesson> {
    let (heading, rest) = text.strip_prefix("# ")?.split_once('\n')?;
    let (code, title) = heading.split_once(": ")?;
    let (rule, rest) = rest.split_once("\nWrong:\n")?;
    let (wrong, right) = rest.split_once("\nRight:\n")?;
    Some(Lesson { code, title, rule: rule.trim(), wrong: block(wrong)?, right: block(right)?, text })
}

/// The code between the fences.
fn block(text: &'static str) -> Option<&'static str> {
    // A shader, a compiled shader, or the text of a group.
    let fence = |name: &str| text.split_once(&format!("```{name}\n"));
    let (_, inside) = ["osl", "oso", "text"].into_iter().find_map(fence)?;
    inside.split_once("```").map(|(code, _)| code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form() {
        let lesson =
            parse("# E1: two words\n\nA rule.\n\nWrong:\n\n```osl\na\n```\n\nRight:\n\n```osl\nb\n```\n");
        let lesson = lesson.map(|l| (l.code, l.title, l.rule, l.wrong, l.right));
        assert_eq!(lesson, Some(("E1", "two words", "A rule.", "a\n", "b\n")));
        assert_eq!(parse("# E1\n\nWrong:\n"), None);
    }

    #[test]
    fn what_is_close() {
        let ids = |text| closest(text).into_iter().map(|c| c.id).collect::<Vec<_>>();
        assert!(ids("W031").contains(&"W0310"));
        assert_eq!(ids("integer-divison").first(), Some(&"W0312"));
        assert!(ids("nothing of the kind").is_empty());
        assert_eq!(find("w0312"), find("Integer-Division"));
    }
}
