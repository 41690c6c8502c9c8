//! Random rounding: what cancels loses its digits, with the line to blame; what is stable keeps them; and
//! exact results have no spread.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl::stages;
use osl_exec::{PointSource, Services};
use osl_ir::passes;
use osl_measure::sanitize::{self, Points, Rounding, Subject};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

/// The digits of a shader with these statements on the lines from 3, with one output `r`.
fn digits(statements: &str) -> Rounding {
    let text = format!("shader s(output float r = 0)\n{{\n{statements}\n}}\n");
    let checked = stages::check("s.osl", &text, &NoFiles, &Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{text}: {:?}", checked.diagnostics));
    let grid = Grid::new(16, 16);
    let options = passes::Options {
        varying: grid.varying().to_vec(),
        derivs: grid.varying_derivs().to_vec(),
        ..passes::Options::default()
    };
    let subject = Subject::new(stages::lower(&program, &[]).unwrap(), &options);
    let points = Points { source: &grid, size: (16, 16), pixels: None };
    sanitize::rounding(&subject, &Services::default(), &points, &checked.sources)
}

/// The digits at 95 % of the points, the smallest, and the lines to blame.
fn found(statements: &str) -> (f64, f64, Vec<u32>) {
    let found = digits(statements);
    assert_eq!((found.points, found.cut, found.not_examined), (256, 0, 0), "{statements}");
    let output = &found.outputs[0];
    (output.usual, output.least, found.lines.iter().map(|apart| apart.quote.line).collect())
}

#[test]
fn a_cancellation_loses_digits_at_its_line() {
    // 4096 has a last place of 4.9e-4: three digits of a third are left, at best.
    let (usual, least, lines) = found("float far = 4096 + (u + 1) / 3;\nr = far - 4096;");
    assert!(usual < 3.6 && least > 2.0, "{usual} {least}");
    assert_eq!(lines, [4]);
    // Beyond what double precision holds.
    let (usual, _, lines) = found("float far = 1e20 + u;\nr = far - 1e20;");
    assert!(usual < 0.5, "{usual}");
    assert_eq!(lines, [4]);
}

#[test]
fn a_stable_shader_keeps_its_digits() {
    for stable in [
        "r = sqrt(u * u + v * v + 1) / 3;",
        "r = mix(0.2, 0.9, smoothstep(0.1, 0.8, u)) * (1 + v / 7);",
        "r = 0.3 * sin(3 * u) + cos(v);",
        "for (int i = 1; i < 10; i++) r += u / i;",
        "r = noise(4 * u, 3 * v);",
        "r = noise(\"cell\", 7.3 * u, v);",
    ] {
        let (usual, least, lines) = found(stable);
        assert!(usual > 6.0 && least > 5.0, "{stable}: {usual} {least}");
        assert!(lines.is_empty(), "{stable}: {lines:?}");
    }
}

#[test]
fn exact_results_have_no_spread() {
    for exact in [
        "r = u > 0.3 ? v : -u;",
        "r = max(u, 0.5) - min(v, 0.25) * 0;",
        "r = floor(8 * u) + 3 * round(v);",
        "int n = (int) (16 * u); r = n * 7 % 5;",
        "float list[3] = {0.1, 0.2, 0.3}; r = list[(int) (2 * u)];",
    ] {
        let (_, least, lines) = found(exact);
        assert!(least > 6.5 && lines.is_empty(), "{exact}: {least} {lines:?}");
    }
}

#[test]
fn what_double_precision_does_not_see_is_seen() {
    // A hash of a number that is rounded: another number for each way to round it.
    let (usual, _, lines) = found("float x = 1000 * sin(u + 0.1);\nr = noise(\"hash\", x);");
    assert!(usual < 1.0, "{usual}");
    assert_eq!(lines, [4]);
    // An int that depends on the last digit.
    let (usual, _, lines) = found("float x = (u + v) / 3 * 3e7;\nint n = (int) x;\nr = n % 2;");
    assert!(usual < 1.0, "{usual}");
    assert!(!lines.is_empty());
}

#[test]
fn runs_that_take_other_paths_part_at_the_condition() {
    let found =
        digits("float x = sin(40000 * (u + 0.1) / 3);\nif (mod(x * 30000, 0.01) > 0.005)\n    r = 1;");
    assert!(found.outputs[0].usual < 1.0);
    assert!(!found.lines.is_empty());
}

#[test]
fn two_examinations_find_the_same() {
    let text = "float far = 4096 + (u + 1) / 3;\nr = far - 4096;";
    let json = |found: &Rounding| serde_json::to_string(found).unwrap();
    assert_eq!(json(&digits(text)), json(&digits(text)));
}
