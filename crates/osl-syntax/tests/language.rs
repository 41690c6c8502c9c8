//! What the grammar accepts and rejects, after the tables of the language specification.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{codes, expr, strict, tree};

#[test]
fn precedence_and_associativity() {
    for (text, want) in [
        ("a + b * c - d", "(- (+ a (* b c)) d)"),
        (
            "a << b + c < d == e & f ^ g | h && i || j",
            "(|| (&& (| (^ (& (== (< (<< a (+ b c)) d) e) f) g) h) i) j)",
        ),
        ("a ? b : c ? d : e", "(? a b (? c d e))"),
        ("a = b = c", "(= a (= b c))"),
        ("a += b *= c", "(+= a (*= b c))"),
        ("a + b = c + d", "(+ a (= b (+ c d)))"),
        ("x = a ? b : c = d", "(= x (? a b (= c d)))"),
        ("-a * b", "(* (- a) b)"),
        ("-a++", "(- (post++ a))"),
        ("!a and not b or c", "(|| (&& (! a) (! b)) c)"),
        ("(float)a + b", "(+ (cast float a) b)"),
        ("(float)-a", "(cast float (- a))"),
        ("(a) + b", "(+ (paren a) b)"),
        ("+a", "a"),
        ("a, b, c", "(, a b c)"),
        ("a.b[1].c[2][3]", "(index (index (field (index (field a b) 1) c) 2) 3)"),
        ("f(a, {1, {2, 3}})", "(call f a {1 {2 3}})"),
        ("color(\"hsv\", 1, 2, 3)", "(new color \"hsv\" 1 2 3)"),
        ("a % b / c", "(/ (% a b) c)"),
        ("~a | ++b", "(| (~ a) (pre++ b))"),
    ] {
        assert_eq!(expr(text), want, "{text}");
    }
}

#[test]
fn literals() {
    for (text, want) in [
        ("010", "10"),
        ("2147483648", "-2147483648"),
        ("0xffffffff", "-1"),
        ("0XfF", "255"),
        ("0xe+1", "(+ 14 1)"),
        ("1.", "1.0"),
        (".5", "0.5"),
        ("1e3", "1000.0"),
        ("1.e-2", "0.01"),
        ("1E+2", "100.0"),
        ("3.4e99", "inf"),
        (r#""a" "b" "c""#, "\"abc\""),
        (r#""\x41""#, r#""\\x41""#),
        (r#""\'""#, r#""\\'""#),
        (r#""a\tb\n\101\\\"""#, r#""a\tb\nA\\\"""#),
        (r#""ab\0cd""#, "\"ab\""),
        ("\"a\\\nb\"", "\"ab\""),
        ("\"é\"", "\"é\""),
        (r#""// no comment /*""#, r#""// no comment /*""#),
    ] {
        assert_eq!(expr(text), want, "{text}");
    }
}

#[test]
fn declarations_that_are_sound() {
    for text in [
        "struct S { float a, b; float c[3]; color d; }; shader s() { S x = {1, 2}; S y[2]; x.c[1] = y[0].a; }",
        "surface s(float a = 1,) {}",
        "displacement s(float a = 1,, float b = 2) {}",
        "volume s [[ string help = \"x\" \"y\" ]] (float a[] = {1, 2} [[ int b = 1, , float c[2] = {1, 2} ]]) [[ int d = -1 ]] {}",
        "shader s(output closure color c = 0, float e[] = {}, string t = \"a\" \"b\") { return; }",
        "float f(float a, output int b); float f(float a, output int b) { return a; } shader s() {}",
        "float f [[ int builtin = 1 ]] (float a); void g() [[ int x = 1 ]] { } shader s() {}",
        "color __operator__add__(color a, color b) { return a; } shader s() {}",
        "struct shader { float a; }; shader f(shader x) { return x; } surface s() {}",
        "float shader(float surface) { float volume = surface; return volume; } shader displacement() {}",
        "shader ___s() {}",
        "shader s() { float f(float x) { return x; } ; { float g() { return 1; } } if (u) float a = 1; }",
        "shader s() { if (a) if (b) ; else ; while (a, b) {} do ; while (a); for (;;) break; }",
        "shader s() { for (int i = 0, j = 1; i < j; ++i, --j) continue; for (i = 0; ; ) {} ;;; {} }",
        "shader s() { int goto = 1, operator = 2, try = 3, throw = 4, catch = 5, emit = 6, new = 7, delete = 8; }",
        "light f() { return x; } shader s() {}",
        "shader s() { m[1][2] = a[b[0]]; a[i][j][k] += 1; s.x++; c.g--; }",
        "shader s() { \n#pragma whatever\n }",
        "\u{feff}shader s() {}",
    ] {
        let parsed = strict(text);
        assert_eq!(codes(&parsed), [""; 0], "{text}");
    }
}

#[test]
fn else_belongs_to_the_nearest_if() {
    let text = tree("shader s() { if (a) while (b) if (c) ; else break; }");
    assert_eq!(
        text.lines().skip(2).map(str::trim).collect::<Vec<_>>(),
        ["if a", "while b", "if c", "empty", "else", "break"]
    );
}

#[test]
fn what_is_refused() {
    for (text, code) in [
        ("shader s() { (a) = 1; }", "E0114"),
        ("shader s() { f(x) = 1; }", "E0114"),
        ("shader s() { (a)++; }", "E0114"),
        ("shader s() { x++ ++; }", "E0114"),
        ("shader s() { f(x).a; }", "E0115"),
        ("shader s() { f(x)[0]; }", "E0115"),
        ("shader s() { color(1)[0]; }", "E0115"),
        ("shader s() { a[1][2][3][4]; }", "E0115"),
        ("shader s() { a [[1]]; }", "E0110"),
        ("shader s() { a = {1, 2}; }", "E0110"),
        ("shader s() { for (i = 0, j = 1; ; ) ; }", "E0110"),
        ("shader s() { do ; while (a) }", "E0110"),
        ("shader s() { float a[2] = b; }", "E0117"),
        ("shader s() { float a[n]; }", "E0116"),
        ("shader s() { float a[]; }", "E0116"),
        ("shader s() { float a[0]; }", "E0116"),
        ("shader s() { color c = {}; }", "E0118"),
        ("shader s() { float a[2][2]; }", "E0110"),
        ("shader s() { struct S { float a; }; }", "E0110"),
        ("shader s() { float ___a; }", "E0107"),
        ("shader s() { int a = 2147483649; }", "E0104"),
        ("shader s() { int a = 0x1ffffffff; }", "E0104"),
        ("shader s() { illuminate(); }", "E0110"),
        ("shader s() { a -> b; }", "E0110"),
        ("shader s() { a ::b; }", "E0110"),
        ("shader s() { a %= 2; }", "E0110"),
        ("shader s(, float a = 1) {}", "E0110"),
        ("shader s(float a = 1; float b = 2) {}", "E0110"),
        ("shader s(float a = 1, b = 2) {}", "E0110"),
        ("shader s(float a = 1 [[ ]]) {}", "E0110"),
        ("shader s(float a = 1 [ [ int b = 1 ] ]) {}", "E0115"),
        ("shader s(color output a = 1) {}", "E0110"),
        ("shader s {}", "E0110"),
        ("float a = 1; shader s() {}", "E0110"),
        ("float f(void) { return 1; } shader s() {}", "E0110"),
        ("float[2] f() { } shader s() {}", "E0110"),
        ("struct S { }; shader s() {}", "E0110"),
        ("struct S { float a = 1; }; shader s() {}", "E0110"),
        ("struct S { float a; } shader s() {}", "E0110"),
    ] {
        let parsed = strict(text);
        assert_eq!(codes(&parsed).first().copied(), Some(code), "{text}\n{:#?}", parsed.diagnostics);
    }
}

#[test]
fn several_errors_a_file() {
    let text = "float f(float a, float) { return a; }\nshader s(float a = 1 float b = 2, float c = 3) {\n  a = * 2;\n  \
                if (a b) { c = 1; a[ = 2; }\n  for (i = 0; i <; ++i) { c = ); d = 1; }\n  f(1 2, 3);\n}\nfoo bar;\n";
    let parsed = strict(text);
    let places: Vec<_> =
        parsed.diagnostics.iter().map(|d| parsed.sources.place(d.span).unwrap().line).collect();
    assert!(places.len() >= 6, "{:#?}", parsed.diagnostics);
    assert!([1, 2, 3, 4, 6].iter().all(|l| places.contains(l)), "{places:?}");
    let tree = osl_syntax::print::ast(&parsed.ast);
    assert!(tree.contains("shader s"), "{tree}");
}
