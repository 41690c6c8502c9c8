//! The style, case by case, and the text that stays unchanged.

#![allow(clippy::unwrap_used, reason = "a test says what must hold")]

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::read;
use osl_syntax::format::format;

/// Formats a valid text twice: the second time changes nothing.
fn tidy(text: &str) -> String {
    let once = format("test.osl", text).unwrap();
    assert_eq!(format("test.osl", &once).unwrap(), once, "not stable");
    once
}

/// Formats statements of a shader's body and takes them out again.
fn body(text: &str) -> String {
    let all = tidy(&format!("shader s() {{\n{text}\n}}\n"));
    let inner = all.strip_prefix("shader s() {\n").and_then(|t| t.strip_suffix("}\n")).unwrap();
    inner.lines().map(|l| l.strip_prefix("    ").unwrap_or(l)).collect::<Vec<_>>().join("\n")
}

/// The codes of the errors in a text that cannot be formatted.
fn refused(text: &str) -> Vec<&'static str> {
    format("test.osl", text).unwrap_err().iter().map(|d| d.code.id).collect()
}

#[test]
fn everything_at_once() {
    insta::assert_snapshot!(tidy(&read("crates/osl-syntax/tests/data/format/ugly.osl")));
}

#[test]
fn the_seeds_of_users() {
    for name in ["Cobbled", "chaosmosaic", "flakes", "strips"] {
        insta::assert_snapshot!(format!("format-{name}"), tidy(&read(&format!("osl/{name}.osl"))));
    }
}

#[test]
fn spaces_between_tokens() {
    for (text, want) in [
        ("a=b+c*d-e/f%g;", "a = b + c * d - e / f % g;"),
        ("a=-b- -c+ +d- - -e;", "a = -b - -c + +d - - -e;"),
        ("a = ! b&&~ c||not(d) and e;", "a = !b && ~c || not (d) and e;"),
        ("i ++ ; -- i; i+++j; i- --j;", "i++;\n--i;\ni++ + j;\ni - --j;"),
        ("a += b<<1>>2&3|4^5;", "a += b << 1 >> 2 & 3 | 4 ^ 5;"),
        ("a = b<c?-d:+e;", "a = b < c ? -d : +e;"),
        ("f ( a ,b )[ 0 ] . x = ( float )-y;", "f(a, b)[0].x = (float) -y;"),
        ("float a [ 2 ]={ 1,2 },b;", "float a[2] = {1, 2}, b;"),
        ("Pair p={{1 , 2},{ }};", "Pair p = {{1, 2}, {}};"),
        ("return(a);", "return (a);"),
        ("return{1,2};", "return {1, 2};"),
        ("for( int i=0,j;;++i , j++ )continue;", "for (int i = 0, j;; ++i, j++)\n    continue;"),
        ("a = 1 .x + 2. + .5 + 1e5+3;", "a = 1 .x + 2. + .5 + 1e5 + 3;"),
        ("closure color c=diffuse( N )*.5;", "closure color c = diffuse(N) * .5;"),
        ("s=\"a\"\"b\"  \"c\";", "s = \"a\" \"b\" \"c\";"),
        ("a = b /*x*/*/*y*/ c/**/;", "a = b /*x*/ * /*y*/ c /**/;"),
        ("f(/*none*/);", "f(/*none*/);"),
        ("a = \\\n  1;", "a = 1;"),
    ] {
        assert_eq!(body(text), want, "{text}");
    }
}

#[test]
fn one_statement_a_line() {
    for (text, want) in [
        ("a;b;{c;}", "a;\nb;\n{\n    c;\n}"),
        ("if(a)b;else if(c)d;else e;", "if (a)\n    b;\nelse if (c)\n    d;\nelse\n    e;"),
        ("if(a){b;}\nelse\n{c;}", "if (a) {\n    b;\n} else {\n    c;\n}"),
        ("if(a)if(b)c;else d;e;", "if (a)\n    if (b)\n        c;\n    else\n        d;\ne;"),
        ("if(a){if(b)c;}else d;", "if (a) {\n    if (b)\n        c;\n} else\n    d;"),
        ("do{a;}while(b);c;", "do {\n    a;\n} while (b);\nc;"),
        ("do do a;while(b);while(c);d;", "do\n    do\n        a;\n    while (b);\nwhile (c);\nd;"),
        ("while(a)for(;;)if(b)break;c;", "while (a)\n    for (;;)\n        if (b)\n            break;\nc;"),
        ("if(a){}else{}", "if (a) {} else {}"),
        ("for(;;);", "for (;;)\n    ;"),
        ("float f(float x){return x;}a;", "float f(float x) {\n    return x;\n}\na;"),
    ] {
        assert_eq!(body(text), want, "{text}");
    }
}

#[test]
fn blank_lines() {
    assert_eq!(tidy("\n\n\nint f();\n\n\n\nint g();\n\n"), "int f();\n\nint g();\n");
    assert_eq!(body("\n\na;\n\n\n// c\n\n\nb;\n\n"), "a;\n\n// c\n\nb;");
    assert_eq!(tidy("int f();"), "int f();\n");
    assert_eq!(tidy(" \n\t\n"), "");
}

#[test]
fn comments_stay_where_they_are() {
    for (text, want) in [
        ("a; // x  \nb;//y", "a; // x\nb; //y"),
        ("// x\na;\n/* y */\nb;", "// x\na;\n/* y */\nb;"),
        ("a; /* x */ b;", "a;\n/* x */ b;"),
        ("if (a) // x\n{ b; }", "if (a) // x\n{\n    b;\n}"),
        ("if (a) { // x\n b; }", "if (a) { // x\n    b;\n}"),
        ("if (a)\n// x\nb;\n// y\nelse c;", "if (a)\n    // x\n    b;\n// y\nelse\n    c;"),
        ("if (a) b;\n// x\nc;", "if (a)\n    b;\n// x\nc;"),
        ("if (a) {\n b;\n // x\n}\n// y\n", "if (a) {\n    b;\n    // x\n}\n// y"),
        ("f(a, // x\nb);", "f(a, // x\n        b);"),
        ("a = b\n// x\n+ c;", "a = b\n        // x\n        + c;"),
    ] {
        assert_eq!(body(text), want, "{text}");
    }
    assert_eq!(tidy("/* a\n      b */\nint f();"), "/* a\n      b */\nint f();\n");
    assert_eq!(tidy("int f() {\na; } // x\nint g();"), "int f() {\n    a;\n} // x\nint g();\n");
}

#[test]
fn long_lines_are_broken_outside_first() {
    let long = "a".repeat(40);
    insta::assert_snapshot!(body(&format!(
        "x = {long} * {long} + {long};\nfunction({long}, {long}, {long});\nx = f(a, b, {long}) + g({long});\n\
         if ({long} && {long} || {long}) x;\nx = {long}{long}{long};\nstring s = \"{long}\" \"{long}\" \"{long}\";\n\
         float t[3] = {{{long}, {long}, {long}}};\nx = y; // {long} {long} {long}\n"
    )));
}

#[test]
fn rows_of_an_initialiser_are_kept() {
    insta::assert_snapshot!(tidy(
        "matrix m[1] = {\n 1,0,0,\n 0,1,0, // second\n\n\n 0,0,1};\nint a[3] = {1,\n2,\n3};\n\
         float t[2] = { // rows\n{1,2}, {\n3,4}\n};\n"
    ));
}

#[test]
fn parameters() {
    insta::assert_snapshot!(tidy(
        "shader short(float a=1,output color c=0){}\nfloat kept(\nfloat a,float b){}\n\
         float meta(float a[[int lockgeom=0]],float b){}\nfloat comment(float a, // first\nfloat b // second\n){}\n\
         shader wide[[string help=\"h\"]](float first_of_them=0.5,float second_of_them=0.25,output color third=0){}\n\
         void trailing(float a,\n\n\n/* why */ float b,){}\nfloat proto(\nfloat a);\n"
    ));
}

#[test]
fn directives_stay_byte_for_byte() {
    let text =
        "  #define  A( x )   x + \\\n      x  \n#  pragma  once  // why \n#define  B /* two\nlines */ 3\n";
    assert_eq!(tidy(text), text);
    insta::assert_snapshot!(tidy(
        "shader s(float a=1,\n#ifdef B\nfloat b=1,\n  #else\nfloat c=1,\n#endif\noutput color d=0){\n#if A\nif(a){\n\
         #else\nif(c){\n#endif\na=1;}\nfloat x\n#ifdef A\n=1;\n#else\n=2\n;\n#endif\nx=\n#pragma p\n2;}\n"
    ));
}

#[test]
fn skipped_text_stays_byte_for_byte() {
    let text = "#if 0 // never\n  don't \" read { (\n # if 1\n#else\n#endif\n#elif 1\nint f();\n#else\nint g();\n#endif\n";
    assert_eq!(tidy(text), text);
}

#[test]
fn macro_uses_stay_byte_for_byte() {
    assert_eq!(
        tidy("#define STR(x) #x\nint  n=strlen( STR( a+b,( \")\"\n'  ) ) );\n"),
        "#define STR(x) #x\nint n = strlen(STR( a+b,( \")\"\n'  ) ));\n"
    );
    // Macros of an included file are recognised by their capitals, if a file is included.
    let call = "int  n=ASSERT_EQ( a+b ,c );\n";
    assert_eq!(
        tidy(&format!("#include \"m.h\"\n{call}")),
        "#include \"m.h\"\nint n = ASSERT_EQ( a+b ,c );\n"
    );
    assert_eq!(
        tidy(&format!("#include <stdosl.h>\n{call}")),
        "#include <stdosl.h>\nint n = ASSERT_EQ(a + b, c);\n"
    );
    // A macro alone on its line is a separate statement.
    assert_eq!(
        tidy("#define M(x) x\nM(1)\nM(2)\nint a;M(3) int b;\n"),
        "#define M(x) x\nM(1)\nM(2)\nint a;\nM(3) int b;\n"
    );
}

#[test]
fn broken_strings_stay_byte_for_byte() {
    // Text after the string on its last line decides how it is read: no quote may get there.
    assert_eq!(
        body("f(\"a\n   b\",\n\"http://c\");\ns = \"a\nb\"; // \"\n"),
        "f(\"a\n   b\",\n        \"http://c\");\ns = \"a\nb\";\n// \""
    );
}

#[test]
fn parameters_after_a_broken_string_are_divided_at_once() {
    let once = tidy("\"a\nb\" f(\"c\" float x = 0) {\n}\n");
    assert_eq!(once, "\"a\nb\" f(\n    \"c\" float x = 0\n) {}\n");
    assert_eq!(tidy(&once), once);
    let list = tidy("string s = \"a\nb\", t[2] = {\"c\", \"d\"};\n");
    assert_eq!(tidy(&list), list);
}

#[test]
fn line_ends_and_byte_order_mark() {
    assert_eq!(tidy("int f( );\r\n\r\n\r\nint g( );"), "int f();\r\n\r\nint g();\r\n");
    // Line breaks within comments and directives stay unchanged and do not affect the others.
    assert_eq!(tidy("\r\n/* a\n*/ int f();\n"), "/* a\n*/ int f();\r\n");
    assert_eq!(tidy("#define X\r\nint f();"), "#define X\r\nint f();\r\n");
    assert_eq!(tidy("\u{feff}int f( );\n"), "\u{feff}int f();\n");
    assert_eq!(tidy("int f();\n// x \\"), "int f();\n// x \\\n");
    assert_eq!(tidy("#define X \\"), "#define X \\\n");
    assert_eq!(tidy("#define X \\\n"), "#define X \\\n");
}

#[test]
fn a_stray_brace_before_the_shader_is_kept() {
    assert_eq!(tidy("int f(){}\n}\nshader s(){}"), "int f() {}\n}\nshader s() {}\n");
    assert_eq!(refused("int f(){}\n}\nint g(){}"), ["E0112"]);
}

#[test]
fn what_cannot_be_formatted() {
    for (text, code) in [
        ("shader s() {", "E0111"),
        ("shader s( {}", "E0111"),
        ("shader s() { a[1); }", "E0111"),
        ("shader s() { a); }", "E0112"),
        ("int a[[ 1;", "E0111"),
        ("s = \"never closed;\n", "E0102"),
        ("/* never closed", "E0103"),
        ("a = @;", "E0101"),
        ("a = 'c';", "E0108"),
        ("#if A\n", "E0012"),
        ("#endif\n", "E0011"),
        ("#if A\n#else\n#else\n#endif\n", "E0011"),
        ("#define M(x) x\nM(1;\n", "E0008"),
    ] {
        assert_eq!(refused(text), [code], "{text}");
    }
    assert_eq!(refused(&read("osl/sprinkles.osl")), ["E0111"]);
}
