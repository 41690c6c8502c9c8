//! Any text gives a result or an error, never a panic, in time that grows with the length of the text.

#![allow(clippy::unwrap_used, reason = "a test says what must hold")]

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{lenient, squeezed};
use osl_syntax::format::{format, format_within};
use proptest::prelude::*;

const MANY: usize = 10_000;

/// Formats a text; the result has the same tokens, and formatting it again changes nothing.
fn check(text: &str) {
    let Ok(once) = format("fuzz.osl", text) else { return };
    assert_eq!(format("fuzz.osl", &once).as_ref(), Ok(&once), "not stable:\n{text:?}\n{once}");
    assert_eq!(squeezed(&once), squeezed(text), "{text:?}\n{once}");
    let tokens = |t: &str| lenient(t).tokens.into_iter().map(|(t, _)| t).collect::<Vec<_>>();
    assert_eq!(tokens(&once), tokens(text), "{text:?}\n{once}");
}

#[test]
fn deep_nesting() {
    let n = MANY;
    for text in [
        "(".repeat(n) + &")".repeat(n),
        "{".repeat(n) + &"}".repeat(n),
        "[[".repeat(n) + &"]]".repeat(n),
        "a = {\n".repeat(n) + &"}".repeat(n),
        "f(a, ".repeat(n) + &")".repeat(n),
        "if (a) ".repeat(n) + ";",
        "do ".repeat(n) + ";" + &"while (a);".repeat(n),
        "#if 1\n{\n".repeat(n) + &"#else\n{\n#endif\n".repeat(n) + &"}".repeat(n),
    ] {
        let found = format("deep.osl", &text).unwrap_err();
        assert_eq!(found.iter().map(|d| d.code.id).collect::<Vec<_>>(), ["E0113"], "{text:.40}");
    }
}

#[test]
fn an_operator_without_an_operand_starts_no_row() {
    let long = "1".repeat(90);
    check(&format!("s(output float b = 0) output {{& {long}\n#pragma p\n}}\n"));
    check(&format!("s() {{ float a[2] = {{& {long} {{{long}}}}}; }}\n"));
}

#[test]
fn metadata_among_values_leaves_rows_as_they_are() {
    let loops = "for (;;) if (a) {} * float , -  float while (a) a =  if (a) {} while (a) if (a) {} --";
    check(&format!("int a[] = {{\nif (a)  // \"\n + else {{}} [[ int x = 1 ]] ! \n\n {loops}\n}};"));
    check(&format!("int a[] = {{\n(else {{}} [[ int x = 1 ]] !) {loops}\n}};"));
}

#[test]
fn deep_but_flat_for_the_formatter() {
    let n = MANY;
    let deep = 500;
    for text in [
        "(".repeat(deep) + &")".repeat(deep),
        "{".repeat(deep) + &"}".repeat(deep),
        "if (a) ; else ".repeat(n) + ";",
        "if (a) ; else ".repeat(n) + "if (a) ;",
        "#if 0\n".repeat(n) + &"#endif\n".repeat(n),
        "#define F(x) x\n".to_owned() + &"F(".repeat(n) + &")".repeat(n),
        // Each path through a conditional leaves all headers again.
        "if (a) ".repeat(deep) + "x;\n" + &"#if 1\n".repeat(n) + &"y;\n#else\nz;\n#endif\n".repeat(n),
        "if (a) ".repeat(deep) + "x;\n" + &"// c\n".repeat(n) + "else x;",
    ] {
        let once = format("deep.osl", &text).unwrap();
        assert!(once.len() < 200 * text.len(), "{text:.40}");
        assert_eq!(format("deep.osl", &once).unwrap(), once, "{text:.40}");
    }
}

#[test]
fn much_of_everything() {
    for (piece, fits) in [
        ("(", false),
        (")", false),
        ("{", false),
        ("}", false),
        ("[[", false),
        // Pairs of quotes, which are empty strings.
        ("\"", true),
        ("\"\n", true),
        ("'", false),
        ("/*", false),
        ("/* */", true),
        ("//\n", true),
        ("// \\\n", true),
        ("\\\n", true),
        ("\r", true),
        ("#", false),
        ("#\n", true),
        ("#if 1\n", false),
        ("#if 0\n", false),
        ("#else\n", false),
        ("#define F(x)\nF(", false),
        ("#define F(x)\nF()", false),
        ("else ", false),
        ("a + ", true),
        ("a, ", true),
        ("\"a\n", true),
        ("; ", true),
        ("- ", true),
        ("a /* \n */, ", true),
        ("\u{e9}", false),
    ] {
        let text = piece.repeat(MANY);
        assert_eq!(format("much.osl", &text).is_ok(), fits, "{piece:?}");
    }
}

/// Fragments that combine to text that resembles OSL.
const PIECES: [&str; 78] = [
    "shader",
    "s",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    "[[",
    "]]",
    ";",
    ",",
    "float",
    "color",
    "a",
    "b",
    "1",
    "2.5",
    "1e",
    "\"x\"",
    "\"y",
    "\"",
    "=",
    "+=",
    "+",
    "-",
    "*",
    "/",
    "<",
    "?",
    ":",
    ".",
    "++",
    "--",
    "!",
    "~",
    "&",
    "|",
    "and",
    "not",
    "if",
    "if (a)",
    "else",
    "for",
    "for (;;)",
    "while",
    "while (a)",
    "do",
    "return",
    "struct",
    "output",
    "closure",
    "\n",
    "\n\n",
    "\t",
    "\r\n",
    "\r",
    "\n#define M(x) x #x\n",
    "M(",
    "M(a+b )",
    "M",
    "\n#if 1\n",
    "\n#if 0\n",
    "\n#else\n",
    "\n#elif 1\n",
    "\n#endif\n",
    "\n#include \"x\"\n",
    "// c",
    "//c\n",
    "\n//d \\\n",
    "/*",
    "*/",
    " /* e */ ",
    "\n/* f\n*/\n",
    "##",
    "\\",
    "\\\n",
    "é",
];

/// Balanced fragments, so that most combinations can be formatted.
const WHOLE: [&str; 48] = [
    "a",
    "b;",
    "f(a, b)",
    "(a)",
    "(int)",
    "[1]",
    "{1, 2}",
    "{\n1,\n2}",
    "{}",
    "{ a; }",
    "[[ int x = 1 ]]",
    ";",
    ",",
    "float",
    "a = ",
    "+",
    "- ",
    "-",
    "--",
    "++",
    "*",
    "?",
    ":",
    ".",
    "!",
    "not",
    "if (a)",
    "if (a) {}",
    "else",
    "for (;;)",
    "while (a)",
    "do",
    "return",
    "\"x\"",
    "\"y\nz\"",
    "\n",
    "\n\n",
    " // c\n",
    " // \"\n",
    "\n/* d */\n",
    " /* e */ ",
    "/* f\ng */",
    "\n#pragma p\n",
    "\n#if 1\na\n#else\nb;\n#endif\n",
    "\n#ifdef A\n",
    "\n#else\n",
    "\n#endif\n",
    "\n#if 0\n ' {\n#endif\n",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_text(text in ".{0,200}") {
        check(&text);
    }

    #[test]
    fn nearly_osl(pieces in prop::collection::vec(prop::sample::select(&PIECES[..]), 0..40), space in any::<bool>()) {
        check(&pieces.join(if space { " " } else { "" }));
    }

    #[test]
    fn balanced_pieces(pieces in prop::collection::vec(prop::sample::select(&WHOLE[..]), 0..40)) {
        check(&pieces.join(" "));
        check(&format!("shader s(float a = 1) {{ {} }}", pieces.join(" ")));
        check(&format!("shader s({}) {{ }}", pieces.join(" ")));
        check(&format!("int a[] = {{\n{}\n}};", pieces.join(" ")));
    }
}

#[test]
fn nesting_and_errors_have_limits() {
    let mut limits = osl_limits::Limits::default();
    (limits.reading.nesting, limits.reading.diagnostics) = (4, 2);
    let deep = |n: usize| format!("float f() {{ return {}1{}; }}", "(".repeat(n), ")".repeat(n));
    assert!(format_within("a.osl", &deep(4), &limits).is_ok());
    let refused = format_within("a.osl", &deep(20), &limits).unwrap_err();
    assert_eq!(refused[0].code.id, "E0113");
    let many = format_within("a.osl", "\"a\n\"b\n\"c\n\"d\n\\ \\ \\ \\ \\", &limits).unwrap_err();
    assert!(many.len() <= 3, "{many:?}");
}
