//! Any text: the preprocessor, the lexer, the parser with its recovery, and what prints their results.
//!
//! A panic, a hang or a budget that does not hold is a bug. What repair returns must parse, and a tree without errors
//! must print the same when its file is read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceProvider;
use osl_syntax::{Options, parse, print, repair};
use std::sync::Arc;

/// Every file that is asked for is the text itself, so that inclusion is fuzzed too.
struct Itself<'a>(&'a str);

impl SourceProvider for Itself<'_> {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        if name.len() > 8 { Err("no such file".to_owned()) } else { Ok((name.to_owned(), self.0.into())) }
    }
}

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let strict = data.len() % 2 == 0;
    // Small budgets are met more often.
    let options = Options {
        strict,
        keep_tokens: true,
        max_include_depth: 6,
        max_includes: 20,
        max_expansion: 2000,
        max_tokens: 20_000,
        max_nesting: 48,
        max_diagnostics: 12,
        max_repair_work: 1 << 12,
        ..Options::default()
    };
    let provider = Itself(&text);
    let parsed = parse("fuzz.osl", &text, &provider, &options);
    assert!(parsed.diagnostics.len() <= 2 * options.max_diagnostics + 1);
    let tree = print::ast(&parsed.ast);
    // Drawing takes longer than all the rest, so it has its turn now and then.
    if data.len() % 16 < 2 {
        print::tokens(&parsed.tokens, &parsed.sources);
        render(&parsed.diagnostics, &parsed.sources, RenderStyle { color: strict });
    }
    for d in &parsed.diagnostics {
        assert!(d.span.start <= d.span.end && parsed.sources.place(d.span).is_some(), "{d:?}");
    }
    if !parsed.has_errors() {
        assert_eq!(print::ast(&parse("fuzz.osl", &text, &provider, &options).ast), tree);
    } else if data.len() < 400
        && let Some(found) = repair::repair("fuzz.osl", &text, &provider, &options)
    {
        // The provider must see the repaired text as well, or includes would bring back what was lost.
        if !text.contains("include") {
            assert!(!parse("fuzz.osl", &found.text, &provider, &options).has_errors());
        }
    }
});
