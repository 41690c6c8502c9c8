//! The preprocessor, after ISO C section 6.10 and the OSL language specification.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{codes, lenient, parse_with};
use osl_syntax::token::Token;
use osl_syntax::{Options, Parsed};

/// The tokens of a text as one line.
fn line(text: &str) -> String {
    spell(&lenient(text))
}

fn spell(parsed: &Parsed) -> String {
    let spell = |t: &Token| match t {
        Token::Ident(n) => n.to_string(),
        Token::Int(v) => v.to_string(),
        Token::Float(v) => format!("{v:?}"),
        Token::Str(v) => format!("{v:?}"),
        Token::LParen => "(".into(),
        Token::RParen => ")".into(),
        Token::Comma => ",".into(),
        Token::Plus => "+".into(),
        Token::Minus => "-".into(),
        Token::Semi => ";".into(),
        Token::MulOp(_) => "*".into(),
        other => format!("{other:?}"),
    };
    parsed.tokens.iter().map(|(t, _)| spell(t)).collect::<Vec<_>>().join(" ")
}

#[test]
fn macros() {
    for (text, want) in [
        ("#define A 1 + B\n#define B A\nA", "1 + A"),
        ("#define f(a) a + f(a)\nf(f(x))", "x + f ( x ) + f ( x + f ( x ) )"),
        ("#define f(a) [a]\nf\n(x) f", "LBracket x RBracket f"),
        ("#define f() 1\nf() f ( ) f", "1 1 f"),
        ("#define f(a, b) b a\nf((1, 2), 3) f(, 4) f(5,)", "3 ( 1 , 2 ) 4 5"),
        ("#define A f(\n#define f(x) x x\nA 1)", "1 1"),
        ("#define S(x) #x\nS( a  +  \"b\\n\" )", r#""a + \"b\\n\"""#),
        ("#define S(x) #x\n#define T(x) S(x)\n#define N 3\nS(N) T(N)", "\"N3\""),
        ("#define G(a, b) a ## b\nG(x, 1) G(, y) G(z, ) G(1, e3)", "x1 y z 1000.0"),
        ("#define N x\n#define G(a, b) a ## b a\nG(N, 1)", "N1 x"),
        ("#define V(f, ...) f(__VA_ARGS__)\nV(p, 1, 2) V(q)", "p ( 1 , 2 ) q ( )"),
        ("#define V(args...) g(args)\nV(1, 2)", "g ( 1 , 2 )"),
        ("#define A 1\n#undef A\nA", "A"),
        ("#define LONG a \\\n  b\nLONG", "a b"),
        ("#define A /* none */ 1 // one\nA;", "1 ;"),
        // A backslash before the line end does not end a token.
        ("str\\\nange x\\\r\n\\\ny 1\\\n2.\\\n5", "strange xy 12.5"),
        ("#define LO\\\nNG(a) a\nL\\\nONG(2) a\\\n b", "2 a b"),
        ("i\\\nf +\\\n+ <\\\n<\\\n=", "If Step(true) OpAssign(Shl)"),
        ("#define f (1)\nf", "( 1 )"),
        ("#define foo() bar\n#define foo2 foo\nfoo2 ()", "bar"),
        // Some of the examples of ISO C, 6.10.3.5.
        (
            "#define x 3\n#define f(a) f(x * (a))\n#undef x\n#define x 2\n#define g f\n#define z z[0]\n\
             #define h g(~\n#define m(a) a(w)\n#define w 0,1\n#define t(a) a\nf(y+1) + f(f(z)) * t(t(g)(0) + t)(1);",
            "f ( 2 * ( y + 1 ) ) + f ( 2 * ( f ( 2 * ( z LBracket 0 RBracket ) ) ) ) * f ( 2 * ( 0 ) ) + t ( 1 ) ;",
        ),
        ("#define hash_hash # ## #\nhash_hash", "Stray"),
    ] {
        assert_eq!(line(text), want, "{text}");
    }
}

#[test]
fn conditions() {
    for (condition, holds) in [
        ("1", true),
        ("0", false),
        ("UNKNOWN", false),
        ("defined M_PI && defined(OSL_VERSION)", true),
        ("!defined(M_PI)", false),
        ("OSL_VERSION >= 11300 && OSL_VERSION_MAJOR == 1 && OSL_VERSION_MINOR == 13", true),
        ("OSL_VERSION == 11312 && OSL_VERSION_PATCH == 12", true),
        ("(1 + 2) * 3 == 9 && 7 % 4 == 3 && -7 / 2 == -3", true),
        ("1 ? 0 : 1", false),
        ("0 && 1 / 0", false),
        ("1 || 1 / 0", true),
        ("0x10 == 16 && 010 == 8 && 1uL == 1", true),
        ("'a' == 97 && ~0 == -1 && (1 << 4 | 1) == 17", true),
        ("not 0 and 1 or 0", true),
        ("__LINE__ == 1", true),
        ("defined STDOSL_H", true),
    ] {
        let text = format!("#if {condition}\nyes\n#else\nno\n#endif");
        let parsed = lenient(&text);
        assert_eq!(spell(&parsed), if holds { "yes" } else { "no" }, "{condition}");
    }
}

#[test]
fn branches() {
    for (text, want) in [
        ("#if 0\na\n#elif 1\nb\n#elif 1\nc\n#else\nd\n#endif\ne", "b e"),
        ("#if 0\n#if 1\na\n#else\nb\n#endif\n#elif 0\n#else\nc\n#endif", "c"),
        ("#if 0\n it's \" unbalanced\n #error no\n#endif\na", "a"),
        ("#if 0\n#foo\n#elif 1\na\n#endif", "a"),
        ("#ifdef M_PI\na\n#endif\n#ifndef M_PI\nb\n#endif", "a"),
        ("# /* x */ if 0\na\n#  endif\nb", "b"),
        ("#\na", "a"),
        ("#if 1\n#elif 1 / 0\n#endif\na", "a"),
    ] {
        let parsed = lenient(text);
        assert_eq!(spell(&parsed), want, "{text}");
        assert!(codes(&parsed).iter().all(|c| *c == "E0110"), "{text} {:?}", codes(&parsed));
    }
}

#[test]
fn files() {
    let files = [
        ("once.h", "#pragma once\nonce\n"),
        ("guard.h", "#ifndef G\n#define G\nguarded\n#endif\n"),
        ("line.h", "__LINE__ __FILE__"),
    ];
    for (text, want) in [
        ("#include \"once.h\"\n#include <once.h>\n", "once"),
        ("#include \"guard.h\"\n#include \"guard.h\"\n", "guarded"),
        ("#define H \"guard.h\"\n#include H\n", "guarded"),
        ("#include \"stdosl.h\"\n#include <stdosl.h>\na", "a"),
        ("\n#include \"line.h\"\n__LINE__ __FILE__", "1 \"line.h\" 3 \"test.osl\""),
        ("#line 100 \"x.osl\"\n__LINE__ __FILE__", "100 \"x.osl\""),
    ] {
        let parsed = parse_with(text, &files, &Options::default());
        assert_eq!(spell(&parsed), want, "{text}");
    }
}

#[test]
fn headers_of_the_compiler_are_found_last() {
    let struct_of = |text: &str, files: &[(&'static str, &str)]| {
        let parsed = parse_with(text, files, &Options::default());
        let spelled = spell(&parsed);
        let missing = codes(&parsed).into_iter().filter(|c| *c == "E0001").collect::<Vec<_>>();
        (spelled.to_lowercase().split(' ').take(2).collect::<Vec<_>>().join(" "), missing)
    };
    for header in ["color2", "color4", "matrix33", "vector2", "vector4"] {
        let name: &'static str = Box::leak(format!("{header}.h").into_boxed_str());
        let own = [("user.h", "mine"), (name, "#pragma once\nother thing")];
        for (open, close) in [('"', '"'), ('<', '>')] {
            let text = format!("#include {open}{header}.h{close}\n#include \"{header}.h\"\n");
            assert_eq!(struct_of(&text, &own[..1]), (format!("struct {header}"), vec![]));
            assert_eq!(struct_of(&text, &own), ("other thing".into(), vec![]));
        }
    }
    assert_eq!(struct_of("#include <oslutil.h>", &[]).0, "type(float) wireframe");
    assert_eq!(struct_of("#include <color3.h>", &[]).1, ["E0001"]);
}

#[test]
fn defines_of_the_command_line() {
    let options = Options {
        defines: vec![("A".into(), "1 + 2".into()), ("B".into(), String::new()), ("M_PI".into(), "3".into())],
        ..Options::default()
    };
    assert_eq!(spell(&parse_with("A B M_PI M_E", &[], &options)), "1 + 2 3 M_E");
}

#[test]
fn the_standard_header() {
    assert_eq!(line("M_PI"), "3.1415927");
    assert_eq!(line("M_2PI M_SQRT1_2 M_LOG10E"), "6.2831855 0.70710677 0.4342945");
}

#[test]
fn tokens_of_an_expansion_stand_at_the_call_and_arguments_at_themselves() {
    let text = "#define SUM(a, b) (b + a)\nshader s() { x = SUM(k, 10); }";
    let parsed = lenient(text);
    assert_eq!(codes(&parsed), [""; 0]);
    let places: Vec<_> = parsed.tokens.iter().map(|(t, s)| (t.clone(), parsed.sources.text(*s))).collect();
    let at = places.iter().position(|(t, _)| *t == Token::Assign).unwrap();
    let texts: Vec<_> = places[at + 1..at + 6].iter().map(|(_, s)| *s).collect();
    assert_eq!(texts, ["SUM(k, 10)", "10", "SUM(k, 10)", "k", "SUM(k, 10)"]);
}

#[test]
fn nowarn_silences_the_next_line() {
    assert_eq!(codes(&lenient("#pragma osl nowarn\nshader s() { color c = (1, 2); }")), [""; 0]);
    assert_eq!(codes(&lenient("#pragma osl nowarn\n\nshader s() { color c = (1, 2); }")), ["W0105"]);
}
