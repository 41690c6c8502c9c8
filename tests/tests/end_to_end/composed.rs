//! Values of functions that are composed of several operations, measured on the reference: of literals, which
//! are folded, and of values that vary.

use osl_exec::RunOptions;
use osl_scene::Grid;
use osl_tests::run;

/// Statements that set `out`, and the value to which that comes; X is 2.3, Y is 0.3.
const CASES: &[(&str, [f32; 3])] = &[
    ("out = hypot(X, Y);", [2.319_482_8; 3]),
    ("out = degrees(X);", [131.780_29; 3]),
    ("out = radians(X);", [0.040_142_573; 3]),
    ("int a = (int)X + 1; out = mod(a, a - a);", [3.0; 3]),
    ("int a = (int)X + 5; out = mod(-a, 3);", [-1.0; 3]),
    ("out = distance(point(X, Y, 0), point(0), point(1, 2, 3));", [3.526_585; 3]),
    (
        "out = (color)rotate(point(X, Y, 1), 0.5, point(1), point(1, 2, 3));",
        [2.441_025, 0.926_008_34, 0.686_995_86],
    ),
    (
        "float kr, kt; fresnel(normalize(vector(X, Y, -1)), normal(0, 0, 1), 0.75, kr, kt); out = color(kr, kt, 0);",
        [0.100_120_96, 0.506_182, 0.0],
    ),
];

#[test]
fn composed_functions_have_the_values_of_the_reference() {
    for (code, expected) in CASES {
        for zero in ["0.0", "(u - u)"] {
            let text = format!(
                "shader s(output color out = 0) {{ float X = 2.3 + {zero}; float Y = 0.3 + {zero}; {code} }}"
            );
            let frame = run::run("s.osl", &text, &[], &Grid::new(3, 2), &RunOptions::default()).unwrap();
            assert_eq!(frame.planes.len(), 3);
            for (plane, expected) in frame.planes.iter().zip(expected) {
                for got in plane.floats() {
                    let off = (got - expected).abs();
                    assert!(
                        off <= 3e-7 * expected.abs().max(1.0),
                        "{code} with {zero}: {got} for {expected}"
                    );
                }
            }
        }
    }
}
