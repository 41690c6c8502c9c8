//! Regular expressions for `regex_search` and `regex_match`.
//!
//! The reference uses the ECMAScript grammar of C++; here the `fancy-regex` crate searches, for patterns that
//! are translated to its grammar. It bounds the cost of a match: one that would backtrack endlessly counts as
//! no match. The cost of a search is known before it runs, see [`Pattern::cost`].
//!
//! As in the reference, a pattern and the string that it searches are bytes: `.` matches one byte, and `\w`,
//! `\d` and `\s` know ASCII only. A character beyond ASCII is the two to four bytes of its UTF-8 form.

use super::ecmascript::translated;
use fancy_regex::{BytesMode, Regex, RegexBuilder};
use osl_limits::Running;
use std::cell::RefCell;

/// Sizes of compiled patterns, as shares of the largest: a pattern is of the first that it fits.
const SHARES: [usize; 3] = [64, 8, 1];
/// Bytes of a compiled pattern that count as one position in it.
const PLACE: u64 = 256;
/// Bytes of a string that a position processes in one counted step.
const BYTES_A_STEP: u64 = 16;
/// Steps for compiling a class of characters.
const CLASS: u64 = 5000;
/// Steps of any search, whatever it searches.
const SEARCH: u64 = 10;

/// Start and end of each group of the first match, the whole match first; `None` for a group that did not
/// take part.
pub type Groups = Vec<Option<(usize, usize)>>;

/// Patterns that a thread keeps compiled. A shader uses the same few at every point.
const KEPT: usize = 8;

thread_local! {
    /// The last patterns of this thread, the latest one first.
    static LAST: RefCell<Vec<Compiled>> = const { RefCell::new(Vec::new()) };
}

/// A pattern, and the result of compiling it.
struct Compiled {
    text: String,
    /// Whether it is to match a whole string.
    whole: bool,
    /// The limits with which it was compiled.
    limits: (u64, u64),
    /// `None` if the pattern is malformed or too large. That takes as long to find out as to compile one.
    pattern: Option<Pattern>,
}

/// A compiled pattern.
#[derive(Debug)]
pub struct Pattern {
    regex: Regex,
    /// Its maximum size in bytes.
    size: usize,
    /// Times that a search may go back and try again.
    retries: u64,
}

impl Pattern {
    /// Does something with a pattern, compiled; `whole`: with one that is to match a whole string.
    ///
    /// # Errors
    /// The pattern is malformed, or larger than the limits permit.
    #[expect(clippy::result_unit_err, reason = "there is one way to fail, and callers word it")]
    pub fn with<T>(
        pattern: &str,
        whole: bool,
        limits: &Running,
        f: impl FnOnce(&Pattern) -> T,
    ) -> Result<T, ()> {
        let limits = (limits.regex_bytes, limits.regex_retries);
        LAST.with_borrow_mut(|last| {
            match last.iter().position(|c| c.text == pattern && c.whole == whole && c.limits == limits) {
                Some(at) => last.get_mut(..=at).unwrap_or_default().rotate_right(1),
                None => {
                    last.truncate(KEPT - 1);
                    last.insert(0, Compiled::new(pattern, whole, limits));
                }
            }
            last.first().and_then(|c| c.pattern.as_ref()).map(f).ok_or(())
        })
    }

    /// The approximate cost of compiling a pattern, in counted steps.
    pub fn making(pattern: &str) -> u64 {
        // A repeated part is compiled as often as it is repeated.
        let repeats = if pattern.contains('{') { 20 } else { 1 };
        let classes = pattern.bytes().filter(|b| matches!(b, b'\\' | b'[' | b'.')).count() as u64;
        (500 + 40 * pattern.len() as u64 + CLASS * classes) * repeats
    }

    /// The maximum cost of a search in a number of bytes, in counted steps: every position of the pattern
    /// meets every byte.
    pub fn cost(&self, bytes: usize) -> u64 {
        let (places, bytes) = (self.size as u64 / PLACE, bytes as u64);
        let once = SEARCH.saturating_add(places.saturating_mul(bytes).div_ceil(BYTES_A_STEP));
        once.saturating_add(self.retries.saturating_mul(1 + bytes / 64))
    }

    /// Its first match.
    pub fn find(&self, s: &str) -> Option<Groups> {
        let found = self.regex.captures(s.as_bytes()).ok()??;
        Some(found.iter().map(|group| group.map(|g| (g.start(), g.end()))).collect())
    }

    /// Its match with the whole of a string.
    pub fn whole(&self, s: &str) -> Option<Groups> {
        self.find(s).filter(|g| g.first() == Some(&Some((0, s.len()))))
    }
}

impl Compiled {
    fn new(text: &str, whole: bool, limits: (u64, u64)) -> Self {
        let wrapped = if whole { format!("^(?:{text})$") } else { text.to_string() };
        let [bytes, most] = [limits.0, limits.1].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let pattern = SHARES.into_iter().find_map(|share| {
            let size = bytes / share;
            let mut builder = RegexBuilder::new(&translated(&wrapped));
            builder.bytes_mode(BytesMode::Ascii).backtrack_limit(most).delegate_size_limit(size);
            let regex = builder.build().ok()?;
            Some(Pattern { regex, size, retries: if retries(text) { limits.1 } else { 0 } })
        });
        Compiled { text: text.to_string(), whole, limits, pattern }
    }
}

/// Whether a search for a pattern may backtrack: it has look-around, back-references, bytes beyond ASCII, or
/// the like.
fn retries(pattern: &str) -> bool {
    let pairs = |pair: &[u8]| match pair {
        [b'\\', next] => next.is_ascii_digit(),
        [b'(', b'?'] => true,
        [b'*' | b'+' | b'?' | b'}', b'+'] => true,
        _ => false,
    };
    !pattern.is_ascii() || pattern.as_bytes().windows(2).any(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(s: &str, pattern: &str) -> Result<Option<Groups>, ()> {
        Pattern::with(pattern, false, &Running::default(), |p| p.find(s))
    }

    fn whole(s: &str, pattern: &str) -> Result<Option<Groups>, ()> {
        Pattern::with(pattern, true, &Running::default(), |p| p.whole(s))
    }

    #[test]
    fn search_and_match() {
        assert_eq!(find("foobar.baz", "bar"), Ok(Some(vec![Some((3, 6))])));
        assert_eq!(find("foobar", "([a-z])(z)?"), Ok(Some(vec![Some((0, 1)), Some((0, 1)), None])));
        assert_eq!(whole("foobar", "bar"), Ok(None));
        assert_eq!(whole("foobar", "f.*r|x"), Ok(Some(vec![Some((0, 6))])));
        assert_eq!(find("x", "("), Err(()));
    }

    /// A string, a pattern, and the first match, if any.
    type Case = (&'static str, &'static str, Option<(usize, usize)>);

    /// What `std::regex_search` of C++ finds (GCC 12, libstdc++).
    #[test]
    fn searches_as_cpp_does() {
        const CASES: &[Case] = &[
            ("aé", ".", Some((0, 1))),
            ("é", "^..", Some((0, 2))),
            ("é", "\\w", None),
            ("é", "\\W", Some((0, 1))),
            ("\u{663}", "\\d", None),
            ("cafés", "é", Some((3, 5))),
            ("é", "[é]", Some((0, 1))),
            ("è", "[é]", Some((0, 1))),
            ("aé)", "é+\\)", Some((1, 4))),
            ("é", "\\é", Some((0, 2))),
            ("\\é", "\\\\é", Some((0, 3))),
            ("é", "\\pL", None),
            ("\r", ".", None),
            ("a\nb", "a$", None),
            ("a\nb", "^b", None),
            ("]", "[]]", None),
            ("a]", "[]a]", None),
            ("a", "[^]", Some((0, 1))),
            ("x-y", "[x-]", Some((0, 1))),
            ("aa", "(?:a)(?=a)", Some((0, 1))),
            ("\u{b}", "\\s", Some((0, 1))),
            ("a b", "\\bb", Some((2, 3))),
            ("A", "[[:upper:]]", Some((0, 1))),
            ("a", "\\Aa", None),
            ("a1", "\\x31", Some((1, 2))),
            ("a", "\\u0061", Some((0, 1))),
            ("abab", "(ab)*\\1", Some((0, 4))),
            ("aaa", "a{2}?", Some((0, 2))),
            ("q", "\\q", Some((0, 1))),
            ("-", "\\-", Some((0, 1))),
            ("_", "\\_", Some((0, 1))),
            ("a/b", "\\/", Some((1, 2))),
            ("[", "[[]", Some((0, 1))),
            ("&", "[a&&b]", Some((0, 1))),
            ("~", "[~]", Some((0, 1))),
            ("A", "\\cA", Some((0, 1))),
            ("aaab", "a++b", Some((0, 4))),
            ("ababc", "(?:ab)+*c", Some((0, 5))),
            ("aaaaa", "a{2}+", Some((0, 4))),
            ("aab", "a+?+b", Some((0, 3))),
            ("aab", "\\x61++b", Some((0, 3))),
            ("aac", "a++*?c", Some((0, 3))),
        ];
        for &(s, pattern, expected) in CASES {
            let found = find(s, pattern).map(|groups| groups.and_then(|groups| groups[0]));
            assert_eq!(found, Ok(expected), "{pattern} in {s}");
        }
        assert_eq!(find("a", "[b-a]"), Err(()));
        // Repetitions are only repeated so often that groups do not become too deep.
        assert_eq!(find("a", &format!("a{}", "+".repeat(10_000))), Err(()));
    }

    #[test]
    fn endless_backtracking_ends() {
        assert_eq!(find(&"a".repeat(40), "^(a|aa|a*)*\\1b$"), Ok(None));
    }

    #[test]
    fn the_last_patterns_are_compiled_once() {
        let known =
            || LAST.with_borrow(|last| last.iter().map(|c| (c.text.clone(), c.whole)).collect::<Vec<_>>());
        let first = ["(a", "b{3000}{3000}", "c"];
        for pattern in first {
            assert_eq!(
                (find("c", pattern).is_ok(), whole("c", pattern).is_ok()),
                (pattern == "c", pattern == "c")
            );
        }
        let twice = |text: &str| [(text.to_string(), true), (text.to_string(), false)];
        assert_eq!(known(), ["c", "b{3000}{3000}", "(a"].map(twice).concat());
        // A known pattern, malformed or not, moves to the front; the oldest ones go.
        assert_eq!((find("x", "(a"), known()[0].0.as_str()), (Err(()), "(a"));
        for n in 0..KEPT - 1 {
            assert_eq!(find("x", &format!("x{{{}}}", n + 2)), Ok(None));
        }
        assert_eq!((known().len(), known()[KEPT - 1].0.as_str()), (KEPT, "(a"));
    }

    #[test]
    fn large_patterns_and_long_strings_cost_more() {
        let cost = |pattern: &str, bytes| {
            Pattern::with(pattern, false, &Running::default(), |p| p.cost(bytes)).unwrap_or(0)
        };
        assert!(cost("a+b", 10) < 100);
        assert!(cost("(?:[a-z]{1,20}x){1,20}", 1000) > 4 * cost("a+b", 1000));
        assert!(cost("(a)\\1", 10) > 4000);
        assert!(cost("a+b", 1 << 20) > 1 << 20);
    }
}
