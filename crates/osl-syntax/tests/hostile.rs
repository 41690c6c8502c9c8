//! Hostile text: nothing panics, nothing hangs, and the message names the limit that was reached.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{codes, lenient, parse_with};
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options, print, repair};
use proptest::prelude::*;

const DEEP: usize = 10_000;

#[test]
fn deep_nesting_of_every_construct() {
    let body = |text: String| format!("shader s() {{ {text} }}");
    let twice = |open: &str, inner: &str, close: &str| {
        body(format!("{}{inner}{}", open.repeat(DEEP), close.repeat(DEEP)))
    };
    for text in [
        twice("(", "a", ");").replacen(";", "", DEEP - 1),
        format!("shader s() {{ {}a{}; }}", "(".repeat(DEEP), ")".repeat(DEEP)),
        twice("{", "", "}"),
        format!("shader s() {{ f{}; }}", "(f".repeat(DEEP) + &")".repeat(DEEP)),
        format!("shader s() {{ a{}; }}", "[a".repeat(DEEP) + &"]".repeat(DEEP)),
        format!("shader s() {{ float a[1] = {}1{}; }}", "{".repeat(DEEP), "}".repeat(DEEP)),
        body(format!("{}a;", " -".repeat(DEEP))),
        body(format!("{}a;", "!".repeat(DEEP))),
        body(format!("{}a;", "(float)".repeat(DEEP))),
        body(format!("{}a;", "a ? b : ".repeat(DEEP))),
        body(format!("{}a;", "a = ".repeat(DEEP))),
        body(format!("a{};", ".b".repeat(DEEP))),
        body("if (a) ".repeat(DEEP) + ";"),
        body("if (a) ; else { ".repeat(DEEP) + ";" + &"}".repeat(DEEP)),
        body(format!("{}a;", "a + (a + ".repeat(DEEP)).replace("a;", &format!("a{};", ")".repeat(DEEP)))),
        body("while (a) ".repeat(DEEP) + ";"),
        body("for (;;) ".repeat(DEEP) + ";"),
        body("do ".repeat(DEEP) + ";" + &"while (a);".repeat(DEEP)),
        body("void f() {".repeat(DEEP) + &"}".repeat(DEEP)),
    ] {
        let parsed = lenient(&text);
        assert!(codes(&parsed).contains(&"E0113"), "{:.60} {:?}", text, codes(&parsed));
        assert_eq!(codes(&parsed).len(), 1, "{:.60} {:?}", text, codes(&parsed));
        print::ast(&parsed.ast);
    }
}

#[test]
fn chains_have_any_number_of_links() {
    let body = |text: String| format!("shader s() {{ {text} }}");
    for text in [
        body(format!("{}a;", "a + ".repeat(DEEP))),
        body(format!("{}a;", "a * b + c(d) < e && ".repeat(DEEP))),
        body(format!("{}a;", "(a + b) | ".repeat(DEEP))),
        body(format!("{}a = 1;", "a + ".repeat(DEEP))),
        body("if (a) ; else ".repeat(DEEP) + ";"),
        body("if (a) { b; } else ".repeat(DEEP) + "if (c) ;"),
        // Long chains within each other, as far as the nesting permits.
        body("((((a".to_string() + &format!("{})", " - b".repeat(DEEP)).repeat(4) + ";"),
        body("{ if (c) {".repeat(20) + &"if (a) ; else ".repeat(DEEP) + ";" + &"} }".repeat(20)),
    ] {
        let parsed = lenient(&text);
        assert_eq!(codes(&parsed), [""; 0], "{:.60}", text);
        print::ast(&parsed.ast);
    }
}

#[test]
fn chains_that_are_nested_in_each_other_have_a_limit() {
    let links = " - b".repeat(300);
    let text = format!("shader s() {{ {}a{}; }}", "(".repeat(100), format!("{links})").repeat(100));
    assert_eq!(codes(&lenient(&text)), ["E0113"]);
}

#[test]
fn a_part_of_a_long_line_is_shown() {
    let text = format!("shader s() {{ float a; {}b = ; }}\n", "a = 1; ".repeat(1000));
    let parsed = lenient(&text);
    let shown = render(&parsed.diagnostics, &parsed.sources, RenderStyle::default());
    assert!(shown.contains("a = 1; b = ; }"), "{shown}");
    assert!(shown.lines().all(|line| line.len() < 200), "{shown}");
}

#[test]
fn unclosed_and_stray_brackets_by_the_thousand() {
    for bracket in ["(", "[", "[[", "{", ")", "]", "}", "{(", "shader s(", "#if 1\n", "f(", "/* ", "\"", "'"]
    {
        let parsed = lenient(&bracket.repeat(DEEP));
        assert!(parsed.has_errors(), "{bracket}");
        let parsed = lenient(&format!("shader s() {{ {} }}", bracket.repeat(DEEP)));
        assert!(parsed.has_errors(), "{bracket}");
    }
}

#[test]
fn nesting_within_the_limit_is_fine() {
    let text = format!("shader s() {{ float a = {}1{}; }}", "(".repeat(250), ")".repeat(250));
    assert_eq!(codes(&lenient(&text)), [""; 0]);
}

#[test]
fn macro_bombs() {
    let mut doubling = String::from("#define M0 1\n");
    for n in 1..200 {
        doubling += &format!("#define M{n} M{} + M{}\n", n - 1, n - 1);
    }
    let mut tripling = String::from("#define F0(x) x x x\n");
    for n in 1..200 {
        tripling += &format!("#define F{n}(x) F{}(x x) F{}(x)\n", n - 1, n - 1);
    }
    for text in
        [format!("{doubling}shader s() {{ float a = M199; }}"), format!("{tripling}shader s() {{ F199(a) }}")]
    {
        assert!(codes(&lenient(&text)).contains(&"E0014"), "{:?}", codes(&lenient(&text)));
    }
    let nested =
        format!("#define ID(x) x\nshader s() {{ int a = {}1{}; }}", "ID(".repeat(DEEP), ")".repeat(DEEP));
    assert!(codes(&lenient(&nested)).contains(&"E0015"));
    let empty: String = (0..200).map(|n| format!("#define E{} E{n} E{n}\n", n + 1)).collect();
    assert!(codes(&lenient(&format!("#define E0\n{empty}E200"))).contains(&"E0014"));
    let unterminated = format!("#define F(x) x\n{}", "F(".repeat(DEEP));
    assert!(codes(&lenient(&unterminated)).contains(&"E0008"));
}

#[test]
fn include_loops() {
    let one =
        parse_with("#include \"a.h\"\nshader s() {}", &[("a.h", "#include \"a.h\"\n")], &Options::default());
    assert!(codes(&one).contains(&"E0002"));
    let two = "#include \"a.h\"\n#include \"a.h\"\n";
    let doubled = parse_with(two, &[("a.h", two)], &Options::default());
    assert!(codes(&doubled).contains(&"E0003"));
    let own = parse_with(
        "#include \"test.osl\"\n",
        &[("test.osl", "#include \"test.osl\"\n")],
        &Options::default(),
    );
    assert!(codes(&own).contains(&"E0002"));
}

#[test]
fn a_file_of_too_many_tokens() {
    let mut options = Options::default();
    options.limits.reading.tokens = 1000;
    assert!(codes(&parse_with(&"a ".repeat(2000), &[], &options)).contains(&"E0016"));
}

#[test]
fn diagnostics_are_bounded() {
    let limit = Options::default().limits.reading.diagnostics as usize;
    for line in ["a = * ;\n", "@\n", "f(a,);\n", "\"\n", "a[0] = (1;\n", "/* /* */\n", "#foo\n", "(a) = 1;\n"]
    {
        let parsed = lenient(&format!("shader s() {{ {} }}", line.repeat(DEEP)));
        let (errors, warnings): (Vec<_>, Vec<_>) = parsed.diagnostics.iter().partition(|d| d.is_error());
        assert!(errors.len() <= limit + 1 && warnings.len() <= limit, "{line}");
        assert_eq!(errors.len() >= limit, codes(&parsed).contains(&"E0120"), "{line}");
    }
}

#[test]
fn warnings_neither_fail_a_file_nor_hide_its_errors() {
    let warnings = "f(a,); /* /* */\n".repeat(DEEP);
    assert!(!lenient(&format!("shader s() {{ {warnings} }}")).has_errors());
    assert!(lenient(&format!("shader s() {{ {warnings} a = ; }}")).has_errors());
    assert!(lenient(&format!("shader s() {{ {warnings} (a) = 1; }}")).has_errors());
}

#[test]
fn text_that_macros_paste_or_quote_is_bounded() {
    let paste = format!("#define X(a) {}a\nX(b)", "a ## ".repeat(100_000));
    let quote = format!("#define S(x) #x\n#define T(x) {}\nT({})", "S(x) ".repeat(DEEP), "a ".repeat(DEEP));
    for text in [paste, quote] {
        assert!(codes(&lenient(&text)).contains(&"E0014"), "{:.60}", text);
    }
}

/// Fragments that combine to text that resembles OSL.
const PIECES: [&str; 52] = [
    "shader",
    "s",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    "[[",
    ";",
    ",",
    "float",
    "color",
    "a",
    "b",
    "1",
    "2.5",
    "\"x\"",
    "\"",
    "=",
    "+=",
    "+",
    "-",
    "*",
    "<",
    "?",
    ":",
    ".",
    "++",
    "!",
    "if",
    "else",
    "for",
    "while",
    "do",
    "return",
    "struct",
    "output",
    "closure",
    "\n",
    "\n#define M(x) x x\n",
    "M(",
    "\n#if 1\n",
    "\n#else\n",
    "\n#endif\n",
    "//",
    "/*",
    "*/",
    "##",
    "\n#define a b\n",
    "\\\n",
    "é",
];

fn check(text: &str) {
    for strict in [false, true] {
        let options = Options { strict, keep_tokens: true, ..Options::default() };
        let parsed = osl_syntax::parse("fuzz.osl", text, &NoFiles, &options);
        print::ast(&parsed.ast);
        print::tokens(&parsed.tokens, &parsed.sources);
        render(&parsed.diagnostics, &parsed.sources, RenderStyle { color: strict });
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_text_never_panics(text in ".{0,200}") {
        check(&text);
    }

    #[test]
    fn nearly_osl_never_panics(pieces in prop::collection::vec(prop::sample::select(&PIECES[..]), 0..60)) {
        let text = pieces.join(" ");
        check(&text);
        if let Some(r) = repair::repair("fuzz.osl", &text, &NoFiles, &Options::default()) {
            prop_assert!(!lenient(&r.text).has_errors());
        }
    }

    #[test]
    fn a_seed_with_a_piece_lost_never_panics(from in 0usize..3000, len in 1usize..40) {
        let text = common::read("osl/Cobbled.osl");
        let whole = |mut n: usize| { while !text.is_char_boundary(n) { n -= 1 } n };
        let (from, to) = (whole(from.min(text.len())), whole((from + len).min(text.len())));
        check(&format!("{}{}", &text[..from], &text[to..]));
    }
}
