//! Regular expressions of `regex_search` and `regex_match`.
//!
//! The reference takes the ECMAScript grammar; here it is that of the `fancy-regex` crate, which agrees on what
//! shaders use (classes, groups, repetition, anchors, look-around, back-references) and bounds how long a match may
//! take: one that would backtrack without end counts as none.

use fancy_regex::{Regex, RegexBuilder};
use std::cell::RefCell;

/// Steps that a match may take.
const MAX_STEPS: usize = 4_000;
/// Bytes of a compiled pattern.
const MAX_SIZE: usize = 1 << 20;

/// Begin and end of each group of the first match, the whole first; `None` for a group that took no part.
pub(super) type Groups = Vec<Option<(usize, usize)>>;

thread_local! {
    /// The pattern that this thread used last: a shader asks for the same one at every point.
    static LAST: RefCell<(String, Option<Regex>)> = const { RefCell::new((String::new(), None)) };
}

fn with<T>(pattern: &str, f: impl FnOnce(&Regex) -> Option<T>) -> Result<Option<T>, ()> {
    LAST.with_borrow_mut(|(text, compiled)| {
        if compiled.is_none() || text != pattern {
            *compiled = RegexBuilder::new(pattern)
                .backtrack_limit(MAX_STEPS)
                .delegate_size_limit(MAX_SIZE)
                .build()
                .ok();
            *text = pattern.to_string();
        }
        compiled.as_ref().map(f).ok_or(())
    })
}

/// Where a pattern is first found.
///
/// # Errors
/// The pattern is malformed.
#[expect(clippy::result_unit_err, reason = "there is one way to fail, and callers word it")]
pub fn find(s: &str, pattern: &str) -> Result<Option<Groups>, ()> {
    with(pattern, |regex| {
        let found = regex.captures(s).ok()??;
        Some(found.iter().map(|group| group.map(|g| (g.start(), g.end()))).collect())
    })
}

/// The match of a pattern with the whole of a string.
///
/// # Errors
/// The pattern is malformed.
#[expect(clippy::result_unit_err, reason = "there is one way to fail, and callers word it")]
pub fn whole(s: &str, pattern: &str) -> Result<Option<Groups>, ()> {
    find(s, &format!("^(?:{pattern})$")).map(|found| found.filter(|g| g.first() == Some(&Some((0, s.len())))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn search_and_match() {
        assert_eq!(find("foobar.baz", "bar"), Ok(Some(vec![Some((3, 6))])));
        assert_eq!(find("foobar", "([a-z])(z)?"), Ok(Some(vec![Some((0, 1)), Some((0, 1)), None])));
        assert_eq!(whole("foobar", "bar"), Ok(None));
        assert_eq!(whole("foobar", "f.*r|x"), Ok(Some(vec![Some((0, 6))])));
        assert_eq!(find("x", "("), Err(()));
    }

    #[test]
    fn endless_backtracking_ends() {
        assert_eq!(find(&"a".repeat(40), "^(a|aa|a*)*\\1b$"), Ok(None));
    }
}
