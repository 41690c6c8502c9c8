//! Texts of shaders: the parser, the compiler and the formatter.

use super::{contents, files, outcome, tight};
use crate::laws;
use osl::stages;
use osl_ir::ir::validate;
use osl_ir::passes;
use osl_lower::params::ParamValues;
use osl_scene::Grid;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options, parse as parse_text, print, repair};
use std::sync::Arc;

/// Words of the language and of its preprocessor.
pub(super) const WORDS: &[&str] = &[
    "shader",
    "surface",
    "struct",
    "output",
    "int",
    "float",
    "color",
    "point",
    "vector",
    "closure color",
    "string",
    "matrix",
    "void",
    "return",
    "if",
    "else",
    "for",
    "while",
    "do",
    "break",
    "continue",
    "and",
    "not",
    "[[",
    "]]",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    "++",
    "<<=",
    "&&",
    "?",
    ":",
    ",",
    ";",
    "0x",
    "1e9",
    "2147483647",
    "\"\\\"\"",
    "\"%s\"",
    "/*",
    "*/",
    "//",
    "\\\n",
    "\n#define M(x) x x\n",
    "\n#define A B\n",
    "\n#undef A\n",
    "\n#include \"a\"\n",
    "\n#if 1\n",
    "\n#elif 0\n",
    "\n#else\n",
    "\n#endif\n",
    "\n#ifndef A\n",
    "\n#pragma once\n",
    "\n#pragma osl nowarn\n",
    "\n#line 7\n",
    "__VA_ARGS__",
    "__LINE__",
    "##",
    "...",
    "defined(A)",
    "noise",
    "texture",
    "format",
    "concat",
    "regex_search",
    "split",
    "Dx",
    "spline",
    "setmessage",
    "getmessage",
    "dict_find",
    "diffuse(N)",
    "P",
    "u",
    "v",
    "[2147483647]",
    "int i = 0; i < 9; i++",
    "#",
    "\u{feff}",
    "é",
];

/// Shaders of the repository.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = contents("osl", &["osl"]);
    seeds.retain(|text| text.len() < 4000);
    for folder in ["text", "reject", "accept_with_warning", "accept_silently"] {
        seeds.extend(contents(&format!("tests/data/{folder}"), &["osl"]));
    }
    let values = files("tests/data/values", &["osl"]);
    seeds.extend(values.iter().step_by(7).filter_map(|path| std::fs::read(path).ok()));
    seeds
}

/// Every included file is the text itself, so that inclusion is fuzzed too.
struct Itself<'a>(&'a str);

impl SourceProvider for Itself<'_> {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        if name.len() > 8 { Err("no such file".to_owned()) } else { Ok((name.to_owned(), self.0.into())) }
    }
}

/// Any text: the preprocessor, the lexer, the parser with its recovery, and the printers of their results. A
/// repaired text must parse, and a tree without errors must print the same text after its file is read again.
pub fn parse(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let strict = bytes.len().is_multiple_of(2);
    // Small limits are reached more often.
    let mut options = Options { strict, keep_tokens: true, ..Options::default() };
    let reading = &mut options.limits.reading;
    (reading.include_depth, reading.includes, reading.nesting) = (6, 20, 48);
    (reading.expansion, reading.tokens) = (2000, 20_000);
    (reading.diagnostics, reading.repair) = (12, 1 << 12);
    let provider = Itself(&text);
    let parsed = parse_text("fuzz.osl", &text, &provider, &options);
    assert!(parsed.diagnostics.len() <= 2 * options.limits.reading.diagnostics as usize + 1);
    let tree = print::ast(&parsed.ast);
    // Printing takes most of the time, so it runs only sometimes.
    if bytes.len() % 16 < 2 {
        print::tokens(&parsed.tokens, &parsed.sources);
        render(&parsed.diagnostics, &parsed.sources, RenderStyle { color: strict });
    }
    for d in &parsed.diagnostics {
        assert!(d.span.start <= d.span.end && parsed.sources.place(d.span).is_some(), "{d:?}");
    }
    if !parsed.has_errors() {
        assert_eq!(print::ast(&parse_text("fuzz.osl", &text, &provider, &options).ast), tree);
    } else if bytes.len() < 400
        && let Some(found) = repair::repair("fuzz.osl", &text, &provider, &options)
    {
        // The provider must also return the repaired text, or includes would restore the errors.
        if !text.contains("include") {
            assert!(!parse_text("fuzz.osl", &found.text, &provider, &options).has_errors());
        }
    }
    outcome(parsed.diagnostics.iter().map(|d| d.code.id))
}

/// Maximum number of values of a body that is run; larger bodies are only compiled.
const MAX_VALUES: usize = 20_000;

/// Texts similar to real shaders: if they parse, they are checked, linted, lowered, compiled in two ways, and
/// run with tight limits.
pub fn mutate(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let mut options = Options::default();
    let reading = &mut options.limits.reading;
    (reading.expansion, reading.tokens) = (2000, 20_000);
    (reading.diagnostics, reading.repair) = (12, 1 << 10);
    let checked = stages::check("fuzz.osl", &text, &NoFiles, &options);
    let lints = stages::lint(&checked, &osl_hir::lint::Options::default());
    let codes = || checked.diagnostics.iter().chain(&lints).map(|d| d.code.id);
    assert_eq!(checked.program.is_none(), checked.broken.is_some());
    let symbols = stages::symbols(&checked, &options.limits);
    for symbol in symbols.list() {
        for span in symbol.declared.iter().chain(&symbol.uses) {
            assert!(span.start <= span.end && checked.sources.place(*span).is_some(), "{symbol:?}");
        }
        symbols.show(symbol.ty);
    }
    let Some(program) = &checked.program else { return outcome(codes()) };
    let Ok(body) = osl_lower::lower(program, &ParamValues::default()) else { return outcome(codes()) };
    if let Err(wrong) = validate::validate(&body) {
        super::broken(&text, &wrong);
    }
    let elements: u64 = body.slots.iter().filter_map(|slot| slot.len).map(u64::from).sum();
    if body.values.len() > MAX_VALUES || elements > 1 << 14 {
        return outcome(codes());
    }
    let without = if bytes.len().is_multiple_of(2) { Vec::new() } else { laws::SWITCHABLE.to_vec() };
    let compiled = stages::finish(body, &passes::Options { without, ..passes::Options::default() });
    let run = osl_exec::run(&compiled.program, laws::services(), &Grid::new(3, 2), &tight(), &|_| ());
    outcome(codes().chain([if run.is_ok() { "ran" } else { "stopped" }]))
}

/// The formatter: formatting twice gives the same text as once; tokens, tree and compiled program stay the
/// same.
pub fn fmt(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let once = match osl_syntax::format::format("fuzz.osl", &text) {
        Ok(once) => once,
        Err(errors) => return outcome(errors.iter().map(|d| d.code.id)),
    };
    match osl_syntax::format::format("fuzz.osl", &once) {
        Ok(twice) => assert_eq!(twice, once, "formatting again changes\n{text}"),
        Err(errors) => super::broken(&text, &format!("formatted it cannot be formatted: {errors:?}")),
    }
    // Formatting moves lines, and these depend on line numbers.
    if text.contains("__LINE__") || text.contains("#line") || text.contains("# ") {
        return 1;
    }
    let options = Options { keep_tokens: true, ..Options::default() };
    let [before, after] = [&*text, &once].map(|text| parse_text("fuzz.osl", text, &NoFiles, &options));
    let tokens = |parsed: &osl_syntax::Parsed| -> Vec<String> {
        parsed.tokens.iter().map(|(token, _)| format!("{token:?}")).collect()
    };
    assert_eq!(tokens(&before), tokens(&after), "other tokens\n{text}\n{once}");
    let codes = |parsed: &osl_syntax::Parsed| outcome(parsed.diagnostics.iter().map(|d| d.code.id));
    if before.has_errors() {
        return codes(&before);
    }
    assert_eq!(print::ast(&before.ast), print::ast(&after.ast), "another tree\n{text}\n{once}");
    // The tree determines the meaning; that nothing else in the text matters is checked only sometimes.
    if bytes.len().is_multiple_of(8) {
        let [before, after] = [&*text, &once].map(|text| Some(osl_ir::ir::print(&laws::lower(text).ok()?)));
        assert_eq!(before, after, "another program\n{text}\n{once}");
    }
    codes(&before)
}
