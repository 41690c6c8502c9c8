//! Generated programs: they compile, and all ways to compile and run them give the same bits.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_tests::agree::{self, Verdict};
use osl_tests::{generate, laws};
use std::panic::catch_unwind;

fn text(seed: u64) -> String {
    generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100))
}

fn walked_text(seed: u64) -> String {
    generate::walked_program(&generate::noise_bytes(seed, 150 + (seed % 7) as usize * 80))
}

fn nested_text(seed: u64) -> String {
    generate::nested_program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 80))
}

/// Seeds, and a text about the program of each.
type Told = Vec<(u64, String)>;

/// The seeds on whose programs the product and the walker differ; and those that were not compared, with the
/// reason. Every eighth program is also compared through `.oso` if it can be.
fn disagreeing(seeds: std::ops::Range<u64>, text: fn(u64) -> String, oso: bool) -> (Told, Told) {
    let (mut broken, mut open) = (Vec::new(), Vec::new());
    for seed in seeds {
        let text = text(seed);
        match catch_unwind(|| agree::hold(&text, oso && seed % 8 == 0)) {
            Ok(Ok(Verdict::Same)) => {}
            Ok(Ok(Verdict::Open(why))) => open.push((seed, why)),
            Ok(Err(law)) => broken.push((seed, law)),
            Err(_) => broken.push((seed, "panics".to_string())),
        }
    }
    (broken, open)
}

/// The seeds whose programs violate a property, with the property.
fn broken(seeds: std::ops::Range<u64>) -> Vec<(u64, String)> {
    let ways = laws::ways();
    let mut broken = Vec::new();
    for seed in seeds {
        let text = text(seed);
        let way = &ways[seed as usize % ways.len()..][..1];
        let outcome = catch_unwind(|| laws::hold(&text, if seed % 16 == 0 { &ways } else { way }));
        match outcome {
            Ok(Ok(())) => {}
            Ok(Err(law)) => broken.push((seed, law)),
            Err(_) => broken.push((seed, "panics".to_string())),
        }
    }
    broken
}

fn tell(broken: &[(u64, String)]) {
    for (seed, law) in broken.iter().take(40) {
        println!("--- {seed}: {}", law.chars().take(900).collect::<String>());
    }
}

#[test]
fn programs_compile() {
    let refused: Vec<(u64, String)> =
        (0..3000).filter_map(|seed| Some((seed, laws::lower(&text(seed)).err()?))).collect();
    tell(&refused);
    assert!(refused.len() <= 30, "{} of 3000 do not compile", refused.len());
}

#[test]
fn same_bits_in_any_way() {
    let broken = broken(0..1500);
    tell(&broken);
    assert!(broken.is_empty(), "{} programs", broken.len());
}

/// Programs that once violated a property, with a description of the bug.
const ONCE_BROKEN: &[(&str, &str)] = &[
    (
        "a NaN had another sign in the last lanes of a batch, which a message showed",
        "shader generated(output matrix r = transpose(matrix(1e-3, 1e30, 1.5e-45, 0.1, 0, 1e-3, 16777216, 1e38, 0, 1e-3, 1e-40, -7.5,
            1e38, -7.5, 3.25, 1e-3))) { for (int i = 0; i < 3; i++) { r /= r[0][i] / v * transpose(r) * u;
            error(\"= %e %g\\n\", u * r, v); } }",
    ),
    (
        "which messages were kept where there are too many depended on how many points run together",
        "shader generated(output float r = 0) { for (int i = 0; i < 100; i++) { warning(\"= %d %g %g\\n\", i, u, v); } r = u; }",
    ),
    (
        "the hash of a NaN depended on the instruction set",
        "surface s(color a1 = color(100.0, 100.0, 1.5e-45), output normal r6 = normal((-7.5), (-7.5), (-7.5)), output float last7 = (-7.5)) {
            for (int i8 = 0; i8 < 2; i8++) for (int i9 = 0; i9 < 2; i9++) for (int i10 = 0; i10 < 2; i10++) {
            r6 *= normal(\"camera\", (((v - v) - (v - v)) - ((v - v) - (v - 1e38))), ((last7 + (u - r6[2])) * (float)psnoise((i8 ? u : r6[abs((i8 ? i10 : i8)) % 3]), atan(r6[abs(((-2147483647 - 1) ? i9 : i10)) % 3]), a1[abs(i10) % 3], (time * r6[1]))), exp2(step((-r6[2]), last7)));
            color x11 = a1; float x12 = x11[hash(last7, r6[1])];
            sincos((float)cellnoise(v, r6[abs(i8) % 3]), x11[abs((i10 ? i9 : i10)) % 3], last7); } }",
    ),
    (
        "whether a division has a guard depended on folding, where a loop has one round",
        "shader s(output normal a = normal(1.5e-45, 1.5e-45, 2.0), output normal b = normal(1.5e-45)) {
            for (int i = 0; i < 2; i++) {
                a = 0 ? -b : ((normal(1.5e-45) / normal(1.5e-45)) / (normal(0.5, 1.0, 100.0) / a) / b);
                if (1) return; } }",
    ),
    (
        "hash noise of a NaN depended on the instruction set",
        "shader s(output float a = 0, output color c = 0) {
            float big = u * 1e38 * 1e38;
            float some = big - big;
            float others = -some;
            a = hashnoise(some + others) + hashnoise(others + some, u) + pnoise(\"hash\", others * some, some);
            c = hashnoise(point(some * others, u, others + some)); }",
    ),
    (
        "the register of a global was taken by values before and, in loops, behind its use",
        "shader s(output color r = 11, output float last = u) { if (backfacing()) r += 11; }",
    ),
    (
        "a global in the second round of a loop",
        "shader s(output float r = 0) { for (int i = 0; i < 3; i++) r += surfacearea() + u * v; }",
    ),
    (
        "division by a constant has no guard, whether it is folded or not",
        "shader s(output float r = P[0] / 1e-40, output float q = 1e38 / (u * 0 + 1e-3)) { r += fmod(u, 0.3); }",
    ),
    (
        "without folding, constants for derivatives had the results of double precision where single precision overflows",
        "shader s(output point r = transform(matrix(1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 2, 3, 1e38, 1e38, 1e38, 1e38),
            transform(matrix(1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38, 1e38),
            point(1e38))), output float d = Dx(u)) {}",
    ),
    (
        "lanes behind the last point took branches and reported",
        "shader s(output normal r = 1) { string t[1] = { \"-3\" };
            if (stoi(t[int(u * 0)])) {} else { r /= normal(\"nowhere\", 1, 1, 1); } }",
    ),
    (
        "the sign of a noise that is no number depended on the instruction set",
        "shader s(output float r = 1) { for (int w = 0; w < 2; w++)
            r = (float)pnoise((point)((w ? (float)psnoise(point(1e30, 1.0, 0.0), 1) : 1) - 1), 11); }",
    ),
    (
        "isconstant finds the same without folding",
        "shader s(output int r = isconstant(2), output int q = isconstant(u)) { r += isconstant(1 + 1); }",
    ),
    (
        "what wants derivatives, which rounds noises and powers in another way, was asked of the unfolded body",
        "shader s(output float r = 0, output float q = 0) { float a = snoise(P * 7); float b = pow(u, v);
            r = a; q = b; if (1 - 1) r += Dx(a * b); r += Dx(u); }",
    ),
    (
        "what rounds of a loop divide by, and whether it is constant, was not found out without folding",
        "shader s(output vector r = 0, output int q = 0, output float p = 1) {
            for (int i = 1 - 1; i < 3; i++) { normal n = 1; r = u / vector(r[1 % 3], n[0], 2);
            q += isconstant(p) * (i + 1); if (i == 1) continue; p /= 1 - 1; } }",
    ),
    (
        "derivatives of a texture that is missing were whatever the register held",
        "surface s(output float r = 0) { r -= Dx((float)texture(\"none.png\", 1, u)); if (u) 1; }",
    ),
    (
        "only a loop that is not written out seems to need a space",
        "shader s(output int r = 1) { matrix m = matrix(\"nowhere\", \"camera\"); int w = 0; do {
            m[1][1] = (r ? m[1][1] == u : 1) ? 1 : m[abs(r) % 4][1]; --r; } while (++w < 1 && r); }",
    ),
    (
        "a round of a loop picks what it divides by from a table",
        "shader s(output color r = 1) { matrix m = matrix(1, 2, 3, 4, 1e-45, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16);
            for (int i = 0; i++ < 4;) r = clamp(-(color)pnoise(v / m[1][abs(-i) % 4], 0.0), 1, 1); }",
    ),
    (
        "a round of a loop wants derivatives that the others do not",
        "shader s(output float r = 0) { float n = u; for (int i = 0; i < 3; i++) {
            n = noise(P * (i + 3)) + n; if (i == 1) r += Dx(n); r += n; } }",
    ),
    (
        "a lookup that nobody needs is the same as one in a branch that no point takes",
        "shader s(output normal r = 1, output float last = 3) { for (int i = 0; i < 2; i++) {
            r = (0 <= (0 ? 1 : (float)psnoise(P, P))) ? 1 : (1 ? normal(\"nowhere\", 1, 11, last) : 1);
            normal x = normal(\"nowhere\", 1, 1, 1); } }",
    ),
    (
        "a message that a later point says in an earlier round came before others",
        "shader s(output float r = 1) { for (int i = 0; i < 4; i++) { warning(\"= %g\", floor(v * 4) - i * r);
            if (noise(u * 9 + i) < 0.4) r = -r; } }",
    ),
    (
        "a point reads a component of what its cell shares before the cell computes anything",
        "shader s(output point r = floor(P), output float x = 0) {
            r *= point(((1 ? (u - r[1]) : 1) + v), (0 ? 1 : (1 / (float)hashnoise(r, 1))), 1); }",
    ),
    (
        "what nothing needs asked for derivatives, but only where it was not removed",
        "shader s(output color r = 0) { r = pow(2.5, (color)snoise(point(-1, -1, -1), u));
            float x = (float)pnoise(\"usimplex\", P, 1e-40, point(0, 0.5, 100), time, \"direction\", (vector)r); }",
    ),
    (
        "a closure of few nodes that are shared was written out in full",
        "volume s(output closure color k = 0) { for (int i = 0; i < 9; i++)
            k += layer(dielectric_bsdf(N, P, color(v), color(1), u, v, 3.25, \"ggx\") * u, k + k + k * v); }",
    ),
    (
        "strings that only a program without passes makes used up their room",
        "shader s(output string t = \"hello\", output float r = 0) { for (int i = 0; i < 2; i++)
            for (int j = 0; j < 3; j++) for (int k = 0; k < 3; k++) {
            t = concat(concat(t, t, t), concat(t, t, (k ? \"\" : \"x\"), concat(t, \"a b\", t)), t); r = u; } }",
    ),
    (
        "strings of 21 points used up the room of a batch, where those of 16 did not",
        "shader s(output string t = format(\"= %x %.3f %g\\n\", 2147483647, P, u), output float r = u) {
            for (int i = 0; i < 7; i++) t = concat(concat(concat(t, t, t, t, t), t, t, \"tex64.png\", \"tex64.png\"), t, t, t, \"\"); }",
    ),
];

#[test]
fn once_broken() {
    for (what, text) in ONCE_BROKEN {
        laws::hold(text, &laws::ways()).unwrap_or_else(|law| panic!("{what}: {law}"));
    }
}

/// A program by its seed, reduced if it breaks a law:
/// `SEED=7 cargo test -p osl-tests --test generated -- --ignored --nocapture one`, or the text of a `FILE`.
#[test]
#[ignore = "shows a program"]
fn one() {
    let seed = std::env::var("SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    let text = std::env::var("FILE").ok().map_or_else(|| text(seed), |f| std::fs::read_to_string(f).unwrap());
    let ways = laws::ways();
    let small = if laws::hold(&text, &ways).is_ok() { text } else { laws::reduce(&text, &ways) };
    println!("{small}");
    laws::hold(&small, &ways).unwrap_or_else(|law| println!("breaks {law}"));
}

/// `SEEDS=100000 cargo test --release -p osl-tests --test generated -- --ignored --nocapture many`.
#[test]
#[ignore = "takes as long as it is told to"]
fn many() {
    let from: u64 = std::env::var("FROM").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    let count: u64 = std::env::var("SEEDS").ok().and_then(|s| s.parse().ok()).unwrap_or(100_000);
    let broken = broken(from..from + count);
    tell(&broken);
    assert!(broken.is_empty(), "{} programs", broken.len());
}

#[test]
fn the_walker_agrees() {
    let (broken, open) = disagreeing(0..2000, walked_text, true);
    tell(&broken);
    assert!(broken.is_empty(), "{} programs", broken.len());
    // Undefined behaviour is not compared; such programs must stay rare.
    tell(&open);
    assert!(open.len() < 300, "{} of 2000 are not compared", open.len());
}

/// Arrays of structs that hold arrays, at any depth.
#[test]
fn the_walker_agrees_on_arrays_within_arrays() {
    let (broken, open) = disagreeing(0..1000, nested_text, false);
    tell(&broken);
    assert!(broken.is_empty(), "{} programs", broken.len());
    assert!(open.len() < 150, "{} of 1000 are not compared", open.len());
    let is_nested = |seed: &u64| {
        let text = nested_text(*seed);
        let checked =
            osl::stages::check("s.osl", &text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
        checked.program.is_some_and(|program| program.nested_arrays().is_some())
    };
    let nested = (0..1000).filter(is_nested).count();
    assert!(nested > 150, "{nested} of 1000 have any");
    let ways = laws::ways();
    for seed in 0..100 {
        let way = &ways[seed as usize % ways.len()..][..1];
        let held = laws::hold(&nested_text(seed), way);
        assert!(held.is_ok(), "{seed}: {held:?}");
    }
}

/// Programs on which the product once differed from the walker, with a description of the bug.
const ONCE_DIFFERENT: &[(&str, &str)] = &[
    (
        "what follows exit() in the same statement still ran: another call, an index out of range, an assignment",
        "int f() { if (1) exit(); return 1; }
        int g(output int n) { n += 10; return n; }
        struct T { float x[2]; };
        T h() { if (1) exit(); return T({ 5, 6 }); }
        shader s(output int n = 1, output float q[2] = { 1, 2 }, output T t = { { 1, 2 } }, output int last = 3) {
            if (u > 0.6) { n += f() + g(n); }
            if (u > 0.4) { q[f() * 7] = 3; }
            if (u > 0.2) t = h();
            if (u > 0.1) printf(\"%d\\n\", f());
            if (u > 0.0) { if (f() > v) last = 0; else last = 1; }
            int i = 0;
            while (f() < i) { last = 7; break; }
            last = 9; }",
    ),
    (
        "exit() in a condition of a loop, and in its step",
        "int f(float x) { if (x > 0.3) exit(); return x < 2; }
        shader s(output int n = 0, output int m = 0) {
            for (int i = 0; f(u + i * 0.1); i++) { n++; if (i > 9) break; }
            for (int i = 0; i < 5; i += f(v + i * 0.1)) m++;
            n = 77; }",
    ),
    (
        "a NaN below the root of refract counts as below zero, as comparisons of the language hold with NaN",
        "shader s(output vector r = refract(u, vector(1e38, 1.5e-45, 3.25), time), output vector q = 1) {
            q = refract(vector(u, v, 1e38), vector(1e38, 1, 1), u * 0); }",
    ),
    (
        "an element of an array of structs was read after the indices of the left side had changed it",
        "struct T { int m; float x; }; shader s(output int r = 0, output int q = 0) {
            T a[2] = { { 1, 2 }, { 0, 3 } };
            a[a[0].m * (++a[0].m) - 2] = a[0];
            r = a[0].m; q = a[1].m; }",
    ),
    (
        "the remainder by a constant 0 was a NaN",
        "shader s(output float r = fmod(u, 0.0), output color c = fmod(color(P), 0.0), output float q = 1) {
            float zero = 0; q = fmod(v, zero); }",
    ),
    (
        "a quotient of constants that overflows was 0, and only where both were known",
        "shader s(output float r = 1 / 1e-40, output float q = 1e38 / 1e-3, output float p = 1) {
            p = (u * 0 + 1) / 1e-40 + 1 / 1e-40; }",
    ),
    (
        "mod of ints became the operator in .oso, which yields 0 where the divisor is 0",
        "shader s(output int r[4] = { 0, 0, 0, 0 }) { for (int i = 0; i < 4; i++) r[i] = mod(-7 - i, i) + (-7 - i) % i; }",
    ),
    (
        "the length of an array of structs was 0, and what was written to .oso did not load",
        "struct A { float x; int n; }; int count(A a[]) { return arraylength(a); }
        shader s(output int r = 0) { A a[3]; A b[1] = { { u, 2 } }; r = arraylength(a) * 100 + count(a) * 10 + count(b); }",
    ),
];

#[test]
fn once_different() {
    for (what, text) in ONCE_DIFFERENT {
        assert_eq!(agree::hold(text, true), Ok(Verdict::Same), "{what}");
        laws::hold(text, &laws::ways()).unwrap_or_else(|law| panic!("{what}: {law}"));
    }
}

/// A program by its seed, or the text of a `FILE`, reduced if the product and the walker differ on it:
/// `SEED=7 cargo test -p osl-tests --test generated -- --ignored --nocapture agree_one`.
#[test]
#[ignore = "shows a program"]
fn agree_one() {
    let seed = std::env::var("SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    let text =
        std::env::var("FILE").ok().map_or_else(|| walked_text(seed), |f| std::fs::read_to_string(f).unwrap());
    let differs = |text: &str, oso| !matches!(catch_unwind(|| agree::hold(text, oso)), Ok(Ok(_)));
    // Differences in the source itself do not concern the compiled text.
    let oso = !differs(&text, false);
    let differs = |text: &str| differs(text, oso);
    let small = if differs(&text) { laws::reduce_by(&text, &differs) } else { text };
    println!("{small}\n{:?}", agree::hold(&small, oso));
}

/// `SEEDS=500000 cargo test --release -p osl-tests --test generated -- --ignored --nocapture agree_many`.
#[test]
#[ignore = "takes as long as it is told to"]
fn agree_many() {
    let from: u64 = std::env::var("FROM").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    let count: u64 = std::env::var("SEEDS").ok().and_then(|s| s.parse().ok()).unwrap_or(100_000);
    let (broken, open) = disagreeing(from..from + count, walked_text, true);
    tell(&broken);
    println!("{} of {count} are not compared", open.len());
    assert!(broken.is_empty(), "{} programs", broken.len());
}
