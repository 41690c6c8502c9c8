//! Files in other forms, and files whose text messages must not show.

use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::hidden::hide;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::{About, SourceProvider, with_line_ends};
use osl_syntax::token::is_keyword;
use osl_syntax::{NoFiles, Options, Parsed, format, parse};
use std::sync::Arc;

/// A main file and one header, `secret.h`.
struct Pair {
    header: &'static str,
    main: About,
    included: About,
}

impl SourceProvider for Pair {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        if name == "secret.h" { Ok((name.into(), self.header.into())) } else { Err("no such file".into()) }
    }

    fn about(&self, name: &str) -> About {
        if name == "secret.h" { self.included } else { self.main }
    }
}

fn read(text: &str, files: &dyn SourceProvider) -> Parsed {
    parse("main.osl", text, files, &Options::default())
}

/// The line and column of each diagnostic, with its code.
fn places(parsed: &Parsed) -> Vec<(u32, u32, &'static str)> {
    let place = |d: &Diagnostic| {
        let place = parsed.sources.place(d.span).unwrap_or_else(|| unreachable!("{d:?}"));
        (place.line, place.column, d.code.id)
    };
    parsed.diagnostics.iter().map(place).collect()
}

#[test]
fn bytes_that_are_not_utf8_are_told_once_a_file() {
    let at = |first_foreign| About { hidden: false, first_foreign };
    let files = Pair { header: "// \u{fc}ber \u{e9}\n", main: at(Some(13)), included: at(Some(3)) };
    let parsed = read("// ascii\n// \u{e9} \u{e8}\n#include \"secret.h\"\nshader s() {}\n", &files);
    assert_eq!(places(&parsed), [(2, 4, "W0006"), (1, 4, "W0006")]);
    insta::assert_snapshot!(render(&parsed.diagnostics, &parsed.sources, RenderStyle::default()));
    // The position may be that of an earlier text.
    let files = Pair { header: "", main: at(Some(500)), included: at(None) };
    assert_eq!(places(&read("// \u{e9}\nshader s() {}\n", &files)), [(1, 4, "W0006")]);
    let silenced = "// \u{e9}\n#pragma osl nowarn\n// \u{e9}\nshader s() {}\n";
    let files = Pair { header: "", main: at(Some(26)), included: at(None) };
    assert_eq!(places(&read(silenced, &files)), []);
}

#[test]
fn a_carriage_return_alone_ends_a_line() {
    let lines = [
        "#define A 1 // one",
        "// a comment",
        "/* and",
        "another */ shader s(output float r = A)",
        "{",
        "    string t = \"a\\",
        "b\";",
        "    r = A @ 2;",
        "}",
        "",
    ];
    let expected = places(&read(&lines.join("\n"), &NoFiles));
    assert_eq!(expected, [(8, 11, "E0101")]);
    for end in ["\r", "\r\n"] {
        assert_eq!(places(&read(&lines.join(end), &NoFiles)), expected, "{end:?}");
    }
    assert_eq!(with_line_ends("a\rb\r\nc\r\r\n\r"), "a\nb\r\nc\n\r\n\n");
}

#[test]
fn the_formatter_keeps_line_ends() {
    let text = "shader s(output float r=1)\n{\nr = 2; // two\n}\n";
    let formatted = format::format("a.osl", text).unwrap_or_default();
    for end in ["\r", "\r\n"] {
        let other = format::format("a.osl", &text.replace('\n', end));
        assert_eq!(other.as_deref(), Ok(&*formatted.replace('\n', end)));
    }
}

/// What messages say of a main text with a header whose text is hidden.
fn said(header: &'static str, text: &str) -> String {
    let included = About { hidden: true, first_foreign: None };
    let files = Pair { header, main: About::default(), included };
    let mut parsed = read(text, &files);
    hide(&mut parsed.diagnostics, &parsed.sources, &is_keyword);
    assert!(!parsed.diagnostics.is_empty());
    let all = format!("{:?}", parsed.diagnostics);
    assert!(!all.contains("sesame"), "{all}");
    render(&parsed.diagnostics, &parsed.sources, RenderStyle::default())
}

#[test]
fn a_hidden_file_is_not_quoted() {
    for header in [
        "sesame: open, sesame\n",
        "int sesame(sesame;\n",
        "#error sesame\n",
        "#define sesame(\n",
        "#sesame\n",
        "#include \"sesame.h\"\n",
        "\"sesame\n",
        "float a = 1.0sesame;\n",
        "/* sesame\n",
        "#if sesame(\n",
        "#pragma warning \"sesame\"\n",
    ] {
        let said = said(header, "#include \"secret.h\"\nshader s() {}\n");
        assert!(said.contains("secret.h:") && said.contains("-I DIR"), "{said}");
    }
    // A macro of the file, used in the shader's own text.
    for header in ["#define X(a) sesame\n#define X(a) 1 sesame\n", "#define X sesame 1 2 sesame\n"] {
        said(header, "#include \"secret.h\"\nshader s() { float a = X; }\n");
    }
    // What is wrong in the shader itself is told as always, also with words that a comment there has.
    let plain = said("// sesame: radius\n", "#include \"secret.h\"\nshader s() { float a = radius 2; }\n");
    assert!(plain.contains("float a = radius 2"), "{plain}");
}
