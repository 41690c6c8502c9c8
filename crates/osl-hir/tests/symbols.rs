//! Symbols and types at positions, of sources with and without errors.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::resolve::symbols;
use osl_hir::symbols::{SymbolKind, Symbols};
use osl_limits::Limits;
use osl_syntax::{NoFiles, Options, parse};
use std::fmt::Write;

fn read(text: &str) -> Symbols {
    symbols(&parse("s.osl", text, &NoFiles, &Options::default()).ast, &Limits::default())
}

/// The symbols with the texts that declare and use them.
fn show(text: &str) -> String {
    let symbols = read(text);
    let mut out = String::new();
    for symbol in symbols.list() {
        let at = |span: osl_syntax::span::Span| {
            let said = text.get(span.start as usize..span.end as usize).unwrap_or("?");
            assert_eq!(said, &*symbol.name, "{span:?}");
            format!("{}", span.start)
        };
        let declared = symbol.declared.map_or("-".to_string(), at);
        let uses: Vec<String> = symbol.uses.iter().map(|span| at(*span)).collect();
        let _ = writeln!(out, "{:?} {:?} at {declared} used {}", symbol.kind, symbol.text, uses.join(" "));
    }
    out
}

/// The type at the first place of a text within the source.
fn type_at(source: &str, of: &str) -> Option<String> {
    let symbols = read(source);
    symbols.type_at(source.find(of).unwrap() as u32).map(|ty| symbols.show(ty))
}

const WHOLE: &str = "struct key { float at; color c; };
color pick(key k, float x) { return k.c * x; }
float pick(float x) { float half = x / 2; return half; }
shader s(float a = 1, output color r = 0) {
    key k = { a, P };
    for (int i = 0; i < 3; i++) { float a = i; k.at += a; }
    r = pick(k, pick(u)) + mix(color(1), noise(P), a);
}
";

#[test]
fn symbols_of_a_whole_source() {
    insta::assert_snapshot!("symbols", format!("{WHOLE}----\n{}", show(WHOLE)));
}

#[test]
fn symbols_of_a_broken_source() {
    let broken = "struct key { float at; flaot c; };
float pick(key k, float x) { return k.at * xx; }
float lost(float x) { return x + ; }
shader s(float a = 1, output float r = 0) {
    key k;
    vec3 v = 1;
    r = pick(k, lost(a)) + smothstep(a, k.c) + v + mix(u);
";
    insta::assert_snapshot!("symbols-broken", format!("{broken}----\n{}", show(broken)));
}

#[test]
fn a_position_has_a_symbol() {
    let symbols = read(WHOLE);
    let at = |text: &str, skip: u32| symbols.at(WHOLE.find(text).unwrap() as u32 + skip);
    assert_eq!(at("k.c * x", 0).unwrap().kind, SymbolKind::Formal);
    assert_eq!(at("k.c * x", 2).unwrap().text, "color c");
    assert_eq!(at("pick(u)", 1).unwrap().text, "float pick(float)");
    assert_eq!(at("key k =", 0).unwrap().kind, SymbolKind::Struct);
    assert_eq!(at("+= a", 3).unwrap().kind, SymbolKind::Local);
    assert_eq!(at("noise", 0).unwrap().kind, SymbolKind::Builtin);
    assert_eq!(at("P }", 0).unwrap().declared, None);
    assert!(at("return", 0).is_none());
}

#[test]
fn a_position_has_a_type() {
    for (text, ty) in [
        ("k.c * x", Some("key")),
        ("* x; }", Some("color")),
        ("x / 2", Some("float")),
        ("2; return", Some("int")),
        ("pick(k, pick(u))", Some("color")),
        ("i < 3", Some("int")),
        ("k.at +=", Some("key")),
        ("noise(P)", Some("color")),
        ("half = x", Some("float")),
        ("return", None),
    ] {
        assert_eq!(type_at(WHOLE, text).as_deref(), ty, "{text}");
    }
    let broken = "shader s(output float r = 0) { vec3 v = 1; r = sin(v) + u * 2; r = radiuss + P; ";
    assert_eq!(type_at(broken, "u * 2").as_deref(), Some("float"));
    assert_eq!(type_at(broken, "P; ").as_deref(), Some("point"));
    assert_eq!(type_at(broken, "v = 1"), None);
    assert_eq!(type_at(broken, "radiuss"), None);
}
