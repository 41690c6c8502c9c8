//! Compiled shaders as text: what the reader refuses and with which message, and how it treats hostile files.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_hir::oso::{self, errors};
use osl_lower::lower;
use osl_lower::params::ParamValues;
use osl_syntax::render::{RenderStyle, render};
use std::collections::BTreeSet;
use std::fmt::Write;

const HEAD: &str = "OpenShadingLanguage 1.00\nshader s\n";
const SYMBOLS: &str = "oparam\tfloat\tr\t0\noparam\tcolor\tc\t0 0 0\nlocal\tfloat[2]\ta\nlocal\tint\ti\n\
    local\tstring\tt\nconst\tint\t$one\t1\nglobal\tfloat\tu\n";

/// Name, symbols, code.
const CASES: &[(&str, &str, &str)] = &[
    ("no-quote", "param\tstring\tx\t\"abc\n", ""),
    ("no-brace", "param\tfloat\tx\t0 %meta{string,help\n", ""),
    ("no-class", "parameter\tfloat\tx\t0\n", ""),
    ("no-name", "param\tfloat\n", ""),
    ("bad-metadata", "param\tfloat\tx\t0 %meta{float,min,low}\n", ""),
    ("literal-argument", "", "\tassign\tr \"a\"\n"),
    ("unknown-type", "param\tfloaty\tx\t0\n", ""),
    ("unsized-local", "local\tfloat[]\tx\n", ""),
    ("bad-number", "param\tint\tx\t0.5\n", ""),
    ("too-many-values", "param\tcolor\tx\t1 2 3 4\n", ""),
    ("twice", "param\tfloat\tx\t1\nlocal\tint\tx\n", ""),
    ("unknown-global", "global\tfloat\tw\n", ""),
    ("not-declared", "", "\tadd\tr u w\n"),
    ("no-such-parameter", "", "\tend\ncode\tw\n"),
    ("unknown-operation", "", "\tsideways\tr u\n"),
    ("operands", "", "\tadd\tr u t\n"),
    ("spaces", "local\tmatrix\tm\n", "\tmatrix\tm t t t t\n"),
    ("stored", "", "\tassign\tt u\n"),
    ("constant-written", "", "\tassign\t$one i\n"),
    ("function", "", "\tsin\tr t\n"),
    ("closure", "", "\tclosure\tr u\n"),
    ("index", "", "\taref\tr a u\n"),
    ("no-result", "", "\tsin\n"),
    ("backwards", "", "\tif\ti 1 0\n"),
    ("beyond", "", "\twhile\ti 1 2 3 900\n"),
    ("too-few", "", "\tfor\ti 1 2\n"),
    ("no-loop", "", "\tfunctioncall\tt 2\n\tbreak\n"),
];

#[test]
fn what_is_refused() {
    let mut all = String::new();
    let mut seen = BTreeSet::new();
    for (name, symbols, code) in CASES {
        let text = format!("{HEAD}{SYMBOLS}{symbols}code ___main___\n{code}\tend\n");
        let read = oso::read("case.oso", &text, &Default::default());
        assert!(read.program.is_none(), "{name}");
        seen.extend(read.diagnostics.iter().map(|d| d.code.id));
        let _ =
            writeln!(all, "== {name}\n{}", render(&read.diagnostics, &read.sources, RenderStyle::default()));
    }
    assert_eq!(seen, errors::ALL.iter().map(|c| c.id).collect());
    insta::assert_snapshot!(all);
}

#[test]
fn a_struct_is_no_operand() {
    let code = "code ___main___\n\tassign\tr x\n\tend\n";
    let read = oso::read("s.oso", &format!("{HEAD}{SYMBOLS}local\tstruct S\tx\n{code}"), &Default::default());
    let said: Vec<&str> = read.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(said, ["`x` is a struct, and operations take its fields"]);
}

#[test]
fn a_file_of_another_kind() {
    for text in [
        "",
        "\n\n",
        "shader s() {}",
        "OpenShadingLanguage 2.00\nshader s\n",
        "OpenShadingLanguage 1.00\n",
        "\u{1f600}",
    ] {
        let read = oso::read("other.oso", text, &Default::default());
        assert!(read.program.is_none() && read.diagnostics.len() == 1, "{text}: {:?}", read.diagnostics);
    }
}

/// Too many nested blocks, nested structs, and lines of sources: bounded, and no panic.
#[test]
fn hostile_files() {
    let depth = 5000;
    let mut nested = format!("{HEAD}{SYMBOLS}code ___main___\n");
    for at in 0..depth {
        let _ = writeln!(nested, "\tif\ti {depth} {depth}\n# {at}");
    }
    let mut structs = format!("{HEAD}param\tstruct S\tp\n");
    let mut name = "p".to_string();
    for _ in 0..200 {
        let _ = writeln!(structs, "param\tstruct S\t{name}.p %mystruct{{{name}}} %mystructfield{{0}}");
        name += ".p";
    }
    for text in [nested, structs] {
        let read = oso::read("deep.oso", &text, &Default::default());
        assert_eq!(read.diagnostics.len(), 1, "{:?}", read.diagnostics);
        assert_eq!(read.diagnostics[0].code.id, "E0601");
    }
    // The deepest permitted nesting compiles.
    let mut deep = format!("{HEAD}{SYMBOLS}code ___main___\n");
    for at in 0..500 {
        let op = if at % 2 == 0 { "if\ti 501 501" } else { "functioncall\tt 501" };
        let _ = writeln!(deep, "\t{op}");
    }
    let read = oso::read("deep.oso", &format!("{deep}\tassign\tr u\n\tend\n"), &Default::default());
    let program = read.program.unwrap_or_else(|| panic!("{:?}", read.diagnostics));
    let _ = lower(&program, &ParamValues::default());
    let _ = oso::write(&program, &read.sources, &Default::default());

    let far =
        "\tassign\tr u %filename{\"a.osl\"} %line{4294967295}\n\tassign\tr u %filename{\"b.osl\"} %line{9}\n";
    let read =
        oso::read("far.oso", &format!("{HEAD}{SYMBOLS}code ___main___\n{far}\tend\n"), &Default::default());
    assert!(read.program.is_some());
    assert!(read.sources.files().iter().all(|f| f.text.len() < 4096));
}

#[test]
fn operations_know_the_lines_of_their_source() {
    let code = "# far.osl:7\n#     r = u / 0;\n\tdiv\tr u i %filename{\"far.osl\"} %line{7}\n\tend\n";
    let read = oso::read("near.oso", &format!("{HEAD}{SYMBOLS}code ___main___\n{code}"), &Default::default());
    let program = read.program.unwrap();
    let place = read.sources.place(program.shader.body[0].span).unwrap();
    assert_eq!((place.file.as_str(), place.line, place.column), ("far.osl", 7, 5));
    assert_eq!(read.sources.text(program.shader.body[0].span), "r = u / 0;");
}

/// The reference accepts fractional numbers as metadata of ints, and so do sources here: written files can be
/// read.
#[test]
fn numbers_of_metadata_need_not_suit_their_type() {
    let meta = |hint: &str| {
        let text = format!("{HEAD}param\tint\tp\t0\t\t{hint}\ncode ___main___\n\tend\n");
        let read = oso::read("meta.oso", &text, &Default::default());
        let program = read.program.unwrap_or_else(|| panic!("{hint}: {:?}", read.diagnostics));
        let written = oso::write(&program, &read.sources, &Default::default()).unwrap();
        assert!(written.contains(hint), "{written}");
    };
    for hint in [
        "%meta{int,connectable,0.5}",
        "%meta{int,big,-16777217}",
        "%meta{int[2],pair,1,2.25}",
        "%meta{int,x,inf}",
    ] {
        meta(hint);
    }
}
