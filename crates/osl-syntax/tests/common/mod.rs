//! Helpers of the tests: files from a map, and parsing in one call.

use osl_syntax::source::SourceProvider;
use osl_syntax::{Options, Parsed, parse, print};
use std::sync::Arc;

/// Files by name.
pub(crate) struct Files(pub(crate) Vec<(&'static str, String)>);

impl SourceProvider for Files {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        let found = self.0.iter().find(|(n, _)| *n == name);
        found
            .map(|(n, text)| ((*n).to_owned(), text.as_str().into()))
            .ok_or_else(|| "no such file".to_owned())
    }
}

/// Parses with the given files and options.
pub(crate) fn parse_with(text: &str, files: &[(&'static str, &str)], options: &Options) -> Parsed {
    let files = Files(files.iter().map(|(n, t)| (*n, (*t).to_owned())).collect());
    parse("test.osl", text, &files, &Options { keep_tokens: true, ..options.clone() })
}

/// Parses by default.
pub(crate) fn lenient(text: &str) -> Parsed {
    parse_with(text, &[], &Options::default())
}

/// Parses under strict syntax.
pub(crate) fn strict(text: &str) -> Parsed {
    parse_with(text, &[], &Options { strict: true, ..Options::default() })
}

/// The codes of all diagnostics, in order.
pub(crate) fn codes(parsed: &Parsed) -> Vec<&'static str> {
    parsed.diagnostics.iter().map(|d| d.code.id).collect()
}

/// The printed tree of a text that must be valid under strict syntax.
pub(crate) fn tree(text: &str) -> String {
    let parsed = strict(text);
    assert!(parsed.diagnostics.is_empty(), "{text}\n{:#?}", parsed.diagnostics);
    print::ast(&parsed.ast)
}

/// The printed first expression statement of a shader body.
pub(crate) fn expr(text: &str) -> String {
    let tree = tree(&format!("shader s() {{ {text}; }}"));
    tree.lines().last().unwrap_or("").trim().to_owned()
}

/// A text without white space and without the backslashes that join lines: the code, comments and directives,
/// which a formatter must not change.
pub(crate) fn squeezed(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace() && *c != '\\').collect()
}

/// A file of the repository.
#[allow(clippy::panic, reason = "a test without its data has failed")]
pub(crate) fn read(path: &str) -> String {
    let path = format!("{}/../../{path}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
}
