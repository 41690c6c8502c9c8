//! The pass that widens steps: the code that it writes, and the code that it leaves alone. The tests of
//! crates/osl-measure check the means.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::resolve::resolve;
use osl_ir::ir::Body;
use osl_ir::ir::{Op, print, validate::validate};
use osl_ir::passes::{self, Options, Prefilter};
use osl_lower::lower;
use osl_lower::params::ParamValues;
use osl_syntax::{NoFiles, parse};

fn lowered(text: &str) -> Body {
    let parsed = parse("test.osl", text, &NoFiles, &osl_syntax::Options::default());
    let program = resolve(&parsed.ast).program.unwrap();
    lower(&program, &ParamValues::default()).unwrap()
}

fn passed(text: &str, prefilter: Option<f32>) -> Body {
    let mut body = lowered(text);
    let prefilter = prefilter.map(|scale| Prefilter { scale });
    passes::run(&mut body, &Options { prefilter, ..Options::default() });
    validate(&body).unwrap();
    body
}

fn shader(text: &str) -> String {
    format!("shader s(float f = 1, output float r = 0, output color c = 0) {{ {text} }}")
}

#[test]
fn steps_get_a_footprint_of_their_own() {
    for text in [
        "r = step(0.5, u);",
        "r = smoothstep(0.4, 0.5, u);",
        "r = linearstep(0.4, 0.5, u);",
        "r = u > 0.5;",
        "r = u > 0.5 ? v : 0.3;",
        "if (u > 0.5 && v < 0.2) c = color(u, v, 1);",
        "for (int i = 0; i < 3; ++i) { if (u * i > 0.5) r += v; }",
        "r = noise(P);",
        "c = noise(\"simplex\", u, v);",
    ] {
        let body = passed(&shader(text), Some(1.0));
        let all = body.blocks.iter().flat_map(|block| &block.insts);
        assert!(all.clone().any(|inst| matches!(inst.op, Op::GlobalDeriv(..))), "{text}\n{}", print(&body));
        assert!(!all.clone().any(|inst| matches!(inst.op, Op::Derivative(..))), "{text}");
    }
}

#[test]
fn what_is_not_shown_as_it_is_stays() {
    for text in [
        "r = floor(step(0.5, u) * 3);",
        "r = noise(\"cell\", step(0.5, u));",
        "int k = u > 0.5; r = k == 1 ? 2 : 3 ; r = floor(r);",
        "float a[2] = { 0, 0 }; if (u > 0.5) a[0] = v; r = a[0];",
        "if (u > 0.5) printf(\"%g\\n\", u);",
        "r = noise(\"hash\", P) + noise(\"cell\", P);",
        "r = f > 0.5 ? u : v;",
        "r = mod(step(u, 0.5), 0.3);",
    ] {
        let text = shader(text);
        assert_eq!(print(&passed(&text, Some(1.0))), print(&passed(&text, None)), "{text}");
    }
}

#[test]
fn what_is_the_same_everywhere_costs_nothing() {
    let text = shader("r = step(0.5, f) * u;");
    let body = passed(&text, Some(1.0));
    assert!(!body.blocks.iter().flat_map(|b| &b.insts).any(|inst| matches!(inst.op, Op::GlobalDeriv(..))));
}

#[test]
fn widened_operations_are_counted() {
    let text = "r = step(0.5, u) + (v > 0.2 ? u : v); if (u < 0.3) r += noise(P);";
    for (text, n) in [(text, 4), ("r = noise(\"cell\", P);", 0), ("r = step(0.5, u); r = 1;", 0)] {
        assert_eq!(passes::n_filtered(lowered(&shader(text)), &Options::default()), n, "{text}");
    }
}
