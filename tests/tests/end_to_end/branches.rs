//! Branches whose sides pass variables on, swap them or compute them: the same values whether a condition is
//! the same at all points or not. If it is, a result can take over the register of what it passes on.

use osl_exec::Native;
use osl_ir::passes::Pass;
use osl_tests::generate::{Bytes, noise_bytes};
use osl_tests::laws::{Way, hold, plain};
use std::fmt::Write;

const FLOATS: [&str; 3] = ["a", "b", "c"];
const COLORS: [&str; 2] = ["p", "q"];

/// A statement, with branches up to a depth.
fn statement(bytes: &mut Bytes<'_>, depth: usize, out: &mut String) {
    let pad = "    ".repeat(5 - depth);
    let (x, y) = (bytes.pick(&FLOATS), bytes.pick(&FLOATS));
    let (p, q) = (bytes.pick(&COLORS), bytes.pick(&COLORS));
    match bytes.below(if depth > 0 { 10 } else { 6 }) {
        0 => writeln!(out, "{pad}{x} = {y};"),
        1 => writeln!(out, "{pad}{p} = {q};"),
        2 => writeln!(out, "{pad}t = {x}; {x} = {y}; {y} = t;"),
        3 => writeln!(out, "{pad}{x} = {y} * 0.75 + {p}[1];"),
        4 => writeln!(out, "{pad}{p} = {q} * {x} - p;"),
        5 => writeln!(out, "{pad}{x} += {y} + {};", bytes.below(9)),
        _ => {
            let edge = bytes.below(9) as f32 / 4.0 - 0.5;
            let of = bytes.pick(&["time", "time", "u", "v", "10 * Dx(u)"]);
            let _ = writeln!(out, "{pad}if ({of} > {edge:?}) {{");
            (0..1 + bytes.below(3)).for_each(|_| statement(bytes, depth - 1, out));
            if bytes.chance(160) {
                let _ = writeln!(out, "{pad}}} else {{");
                (0..1 + bytes.below(3)).for_each(|_| statement(bytes, depth - 1, out));
            }
            writeln!(out, "{pad}}}")
        }
    }
    .expect("text");
}

fn shader(seed: u64) -> String {
    let data = noise_bytes(seed, 300);
    let mut bytes = Bytes::new(&data);
    let mut out = String::from(
        "shader s(output float a = u, output float b = v * 3, output float c = 0.5, output color p = color(u, v, 2), \
         output color q = 0) {\n    float t = 0; b += u; p += b;\n",
    );
    (0..2 + bytes.below(4)).for_each(|_| statement(&mut bytes, 4, &mut out));
    out + "}\n"
}

fn ways() -> Vec<Way> {
    let flatten = vec![Pass::Flatten];
    vec![
        Way { for_grid: true, ..plain() },
        Way { for_grid: true, without: flatten.clone(), ..plain() },
        Way { for_grid: true, without: flatten, batch: 32, native: Native::Always, ..plain() },
        Way { without: vec![Pass::Flatten, Pass::Rate], batch: 32, native: Native::Always, ..plain() },
    ]
}

fn check(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let text = shader(seed);
        hold(&text, &ways()).unwrap_or_else(|law| panic!("{seed}: {law}\n{text}"));
    }
}

#[test]
fn sides_that_pass_values_on() {
    check(0..1500);
}

/// `t` is read after the branch that changes `a`, but no side yields it.
#[test]
fn a_value_that_is_read_after_an_inner_branch() {
    let text = "shader s(output float a = u, output float c = 0) { a += v;
        if (time > -1) { float t = a; if (time > -2) a = a * 0.5 + v * v; c = t * 2; } }";
    hold(text, &ways()).unwrap();
}

/// `cargo test --release -p osl-tests --test end_to_end -- --ignored many_sides`
#[test]
#[ignore = "takes minutes"]
fn many_sides() {
    check(0..200_000);
}
