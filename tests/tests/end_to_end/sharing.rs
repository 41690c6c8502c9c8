//! Tests in the text of the IR which computations neighbouring cells share, and which distances are compared
//! by their squares.

use osl_ir::ir;
use osl_ir::passes::Options;
use osl_scene::Grid;
use osl_tests::run;

/// The instructions of a shader's body after the passes.
fn after(body: &str) -> String {
    let text = format!("shader s(output float f = 0, output color c = 0, output int i = 0) {{ {body} }}");
    let options =
        Options { varying: osl_exec::PointSource::varying(&Grid::new(2, 2)).to_vec(), ..Options::default() };
    let compiled = run::compile("s.osl", &text, &[], &options).unwrap();
    let printed = ir::print(&compiled.body);
    printed.lines().filter(|line| !line.starts_with("  slot")).collect::<Vec<_>>().join("\n")
}

#[test]
fn groups() {
    for (name, body) in [
        ("lattice", "point p = floor(P * 4); c = cellnoise(p + 0.5) * 2 - 1; f = distance(P, p + c);"),
        ("branch_inside", "float x = floor(u * 9); if (fmod(x, 2) == 0) x += noise(x, 42.5); f = x - u;"),
        ("chosen_by_points", "int n = u < 0.5 ? (int)(v * 3) : 7; f = cellnoise(n + 0.5, 1.5);"),
        (
            "one_after_another",
            "float x = floor(u * 9); x -= u * 9 < x + cellnoise(x) ? 1 : 0; f = cellnoise(x * 3);",
        ),
        ("of_two_sizes", "f = cellnoise(floor(u * 3)) * cellnoise(floor(u * 50));"),
        ("in_a_loop", "for (int k = 0; k < 100 * v; k++) f += cellnoise(floor(P * k));"),
        ("nothing_worth_it", "f = floor(u * 9) + floor(v * 9); i = (int)f % 3;"),
        ("of_single_points", "f = cellnoise(u * 9) + noise(P);"),
    ] {
        insta::assert_snapshot!(format!("share_{name}"), after(body));
    }
}

#[test]
fn squares() {
    for (name, body) in [
        (
            "nearest",
            "f = 1000; for (int k = 0; k < 3; k++) { float d = distance(P, point(k, 0, 1)); if (d < f) f = d; }",
        ),
        ("compared", "float d = distance(P, point(0.5)); i = (d < 0.3) + (0.4 <= d);"),
        ("used_too", "float d = distance(P, point(0.5)); i = d < 0.3; f = d;"),
        (
            "farthest_stays",
            "f = 0; for (int k = 0; k < 2; k++) { float d = distance(P, point(k, 0, 1)); if (d > f) f = d; }",
        ),
    ] {
        insta::assert_snapshot!(format!("algebra_{name}"), after(body));
    }
}
