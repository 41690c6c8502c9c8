//! Chains of thousands of links, and what else the language says about the order of evaluation.

#![allow(clippy::unwrap_used, missing_docs, reason = "a test says what must hold")]

use osl::{Group, Points, Shader};

fn run(text: &str, u: &[f32], output: &str) -> Vec<f32> {
    let shader = Shader::compile("s.osl", text).unwrap();
    let program = Group::new().layer("s", &shader).compile(&[]).unwrap();
    program.run(&Points::new(u.len()).u(u.to_vec())).unwrap().floats(output).unwrap()
}

/// `link` for each number, joined.
fn chain(n: usize, between: &str, link: impl Fn(usize) -> String) -> String {
    (0..n).map(link).collect::<Vec<_>>().join(between)
}

const LINKS: usize = 5000;

#[test]
fn chains_of_operators_have_their_values() {
    let sum = chain(LINKS, " + ", |_| "u".into());
    let mixed = chain(LINKS, " ", |n| format!("{} {n} * u", if n % 2 == 0 { "-" } else { "+" }));
    let text = format!(
        "shader s(float k = {sum}, output float a = 0, output float b = 0) {{ a = k; b = {mixed}; }}"
    );
    assert_eq!(run(&text, &[0.0, 1.0], "a"), [0.0, LINKS as f32]);
    assert_eq!(run(&text, &[0.0, 1.0], "b"), [0.0, LINKS as f32 / 2.0]);
    // The right side of `&&` runs only where the left side is true, and operands are referred to.
    let and = chain(LINKS, " && ", |n| format!("i++ < {}", if n == 3000 { 10 } else { LINKS }));
    let text = format!("shader s(output float n = 0) {{ int i = 0; if ({and}) n = -1; else n = i; }}");
    assert_eq!(run(&text, &[0.0], "n"), [3001.0]);
}

#[test]
fn chains_of_branches_take_one() {
    let links = chain(LINKS, " else ", |n| format!("if (i == {n}) r = {};", 2 * n));
    let text = format!("shader s(output float r = 0) {{ int i = (int)u; {links} else r = -1; }}");
    assert_eq!(run(&text, &[0.0, 200.0, 4999.0, 5000.0], "r"), [0.0, 400.0, 9998.0, -1.0]);
    let returns = chain(1000, " else ", |n| format!("if (i == {n}) return {};", 3 * n));
    let text = format!(
        "float f(int i) {{ {returns} return -2; }}
         shader s(output float r = 0) {{ r = f((int)u); }}"
    );
    assert_eq!(run(&text, &[7.0, 999.0, 1000.0], "r"), [21.0, 2997.0, -2.0]);
    let jumps = chain(500, " else ", |n| {
        format!("if (i == {n}) {{ {} }}", if n == 400 { "break;" } else { "n += 1; continue;" })
    });
    let text = format!(
        "shader s(output float n = 0) {{ for (int i = 0; i < 1000; i++) {{ {jumps} else n += 100; n += 1000; }} }}"
    );
    assert_eq!(run(&text, &[0.0], "n"), [400.0]);
}

#[test]
fn a_step_that_is_assigned_to_its_own_variable_counts() {
    let text = "struct pair { int a; int b; };
        shader s(output float r = 0) {
            int i = 2; i = i++; r = i;
            i = u > 0 ? i-- : 9; r = r * 10 + i;
            int k = i++; r = r * 10 + k;
            pair p = { 4, 5 }; p.a = p.a++; r = r * 10 + p.a;
            p.a = p.b++; r = r * 10 + p.a;
        }";
    assert_eq!(run(text, &[1.0], "r"), [32_255.0]);
}

#[test]
fn all_layers_that_are_connected_to_one_parameter_run() {
    let a = Shader::compile(
        "a.osl",
        "shader a(float k = 1, output float f = 0) { printf(\"%g \", k); f = u + k; }",
    );
    let b = Shader::compile("b.osl", "shader b(float x = 3, output float o = 0) { o = x; }");
    let (a, b) = (a.unwrap(), b.unwrap());
    let group = Group::new().layer("a", &a).param("k", 10.0).layer("c", &a).layer("b", &b);
    let program = group.connect("a.f", "b.x").connect("c.f", "b.x").compile(&[]).unwrap();
    let out = program.run(&Points::new(1).u(&[0.5])).unwrap();
    assert_eq!((out.floats("o"), out.printed()), (Some(vec![1.5]), "10 1 ".to_string()));
}
