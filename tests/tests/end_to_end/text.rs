//! Compares printed text and messages of shaders with the reference's: `tests/data/text/CASE.osl`, `.out`,
//! `.err`.

use osl_exec::{Frame, RunOptions};
use osl_syntax::source::SourceMap;
use osl_tests::golden::Golden;
use osl_tests::run;
use std::path::Path;

/// Cases that differ on purpose, with the reason.
const EXCEPTIONS: &[(&str, &str)] = &[
    (
        "array_index_error",
        "the reference names its own `$const1` where a table of constants is read; here `f`",
    ),
    ("inf_minus_inf", "the reference folds x - x and x * 0 to 0 even where x is infinite; here they are NaN"),
    ("printf_nan_inf", "the same"),
    ("noise_unknown", "the reference does not run the shader; here the noise is 0 and the error is reported"),
    ("printf_float_default", "the reference pools -0.0 with 0.0 and prints 0; here -0"),
    (
        "split_limits",
        "folded in the reference, which then empties unused elements; run, they are untouched, as here",
    ),
    ("split_out", "the same"),
];

/// Messages in the format of the recorder's renderer.
fn errors(frame: &Frame, sources: &SourceMap, case: &str) -> String {
    let place = |span| sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut text = String::new();
    for (error, mut line) in frame.said(place) {
        let kind = if error { "ERROR" } else { "WARNING" };
        if line.starts_with("Index [") {
            line += &format!(" (group unnamed_group_1, layer 0 {case}_0, shader {case})");
        }
        text += &format!("{kind}: {line}\n");
    }
    text
}

fn case(osl: &Path) -> Result<(), String> {
    let name = osl.file_stem().unwrap().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(osl).unwrap();
    let golden = Golden::conditions(&text);
    let file = format!("{name}.osl");
    let (frame, sources) = run::like(&file, &text, &golden, &RunOptions::default())?;
    let printed: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    let expected =
        |extension: &str| std::fs::read_to_string(osl.with_extension(extension)).unwrap_or_default();
    if printed != expected("out") {
        return Err(format!("printed\n{printed}for\n{}", expected("out")));
    }
    let errors = errors(&frame, &sources, &name);
    if errors != expected("err") {
        return Err(format!("reported\n{errors}for\n{}", expected("err")));
    }
    Ok(())
}

#[test]
fn text_and_messages_are_those_of_the_reference() {
    let mut cases: Vec<_> = std::fs::read_dir(run::root().join("tests/data/text"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "osl"))
        .collect();
    cases.sort();
    let mut bad = 0;
    for path in &cases {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let excepted = EXCEPTIONS.iter().any(|(n, _)| *n == name);
        match case(path) {
            Ok(()) if excepted => panic!("{name} is no exception any more"),
            Err(why) if !excepted => {
                bad += 1;
                println!("{name}: {why}");
            }
            _ => {}
        }
    }
    assert_eq!(bad, 0, "of {}", cases.len());
}
