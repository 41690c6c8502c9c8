//! Branches and loops as machine code: the same values, messages and verdicts as in the interpreter.

use osl_exec::{Frame, Isa, Native, RunError, RunOptions};
use osl_ir::passes::{self, Pass};
use osl_limits::Limits;
use osl_scene::Grid;
use osl_tests::run;

/// Shaders whose loops do what a compiled loop may contain.
const SHADERS: [(&str, &str); 7] = [
    (
        "leaves at different times",
        r#"shader s(int rounds = 50, output float x = 0, output int count = 0, output color c = 0)
        {
            float y = 0;
            int i = 0;
            for (i = 0; i < rounds; i++) {
                float next = x * x - y * y + u;
                y = 2 * x * y + v;
                x = next;
                if (x * x + y * y > 4)
                    break;
                if (i % 3 == 1)
                    continue;
                c += color(x, y, i / 3.0) * 0.25;
                count += i / 2 - i % 5;
            }
            count = count * 100 + i;
        }"#,
    ),
    (
        "loops in loops",
        r#"shader s(int most = 6, output float sum = 0, output int steps = 0)
        {
            int a = (int)(abs(u) * 9) % most;
            for (int i = 0; i < a; i++) {
                float part = 0;
                for (int j = i; j < most; j++) {
                    part = part * 0.5 + sin(i * 3.0 + j + v);
                    if (part > 0.9) {
                        steps += j;
                        break;
                    }
                    int k = 0;
                    do {
                        part -= 0.01 * k;
                        k++;
                    } while (k < j && part > -0.5);
                    steps += k;
                }
                sum += part;
                if (sum < -3)
                    return;
            }
        }"#,
    ),
    (
        "branches with large sides",
        r#"shader s(output vector where = 0, output int path = 0)
        {
            point p = point(u, v, u * v) * 3;
            for (int i = 0; i < 12; i++) {
                if (p[0] > 1) {
                    p = rotate(p, 0.3 * i, point(0), point(1, 2, 3)) - vector(0.7, 0.1, 0.2);
                    p = p * (1 + 0.1 * sin(p[1])) + normalize(vector(p[2], p[0], 1));
                    path = path * 3 + 1;
                } else if (p[1] < -0.5) {
                    p = vector(p[1], -p[0], p[2] * 0.9) + cross(p, vector(1, 1, 0.5));
                    path = path * 3 + 2;
                } else if (length(p) < 0.4) {
                    p += vector(exp(p[0]), log(abs(p[1]) + 1), sqrt(abs(p[2]))) * 0.5;
                    if (i > 8)
                        break;
                } else
                    p *= 1.07;
            }
            where = p;
        }"#,
    ),
    (
        "arrays",
        r#"shader s(int length = 20, float table[7] = { 3, 1, 4, 1, 5, 9, 2 },
            output float levels[24] = { 0 }, output color picked[5] = { 0 }, output float sum = 0)
        {
            for (int i = 0; i < length; i++) {
                levels[i] = u * i + (i > 2 ? levels[i - 2] : v) * 0.5;
                if (levels[i] > 9)
                    break;
            }
            int at = (int)(abs(v) * 20) % 24;
            for (int i = 0; i < length; i++) {
                at = (at * 5 + 3) % 24;
                sum += levels[at] * table[at % 7];
                picked[at % 5] += color(i, at, sum);
                if (picked[at % 5][0] > 40 && u > 0)
                    picked[2] = levels[i];
            }
        }"#,
    ),
    (
        "indices out of range",
        r#"shader s(output float sum = 0, output float kept[4] = { 0 })
        {
            float own[6] = { 1, 2, 3, 4, 5, 6 };
            for (int i = 0; i < 9; i++) {
                int at = (int)(u * i);
                if (i > 3)
                    own[at] += v;
                sum += own[at + 1];
                kept[i % 4] += own[5 - i % 6];
            }
        }"#,
    ),
    (
        "uniform values",
        r#"shader s(float start = 0.5, int most = 9, output float same = 0, output float x = 0)
        {
            float f = start;
            int i = 0;
            while (f < 40 && i < most) {
                f = f * 1.5 + 0.25;
                x += f * u;
                i++;
            }
            same = f + i;
            float g = f;
            for (int k = 0; k < most; k++) {
                g = g * 0.75;
                if (x > g * 10)
                    break;
                x = x * 1.25 + g + v;
            }
            x += g;
        }"#,
    ),
    (
        "ints",
        r#"shader s(int modulus = 9973, output int sum = 0, output float share = 0)
        {
            int state = (int)(u * 8191) * 31 + (int)(v * 8191) * 17 + 1;
            int i;
            for (i = 0; i < 200; i++) {
                state = (state * 69069 + 5) % modulus;
                sum += (state & 5) ? state / 7 << 2 : -(state % 5) ^ i;
                sum = max(sum, state - 4000) - (~state >> 3);
                if (state % 211 == 7)
                    break;
            }
            share = (float)i / 200;
        }"#,
    ),
];

fn grid() -> Grid {
    Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(37, 23) }
}

fn words(frame: &Frame) -> Vec<(String, usize, Vec<u32>)> {
    frame.planes.iter().map(|p| (p.output.to_string(), p.component, p.words.to_vec())).collect()
}

fn said(frame: &Frame) -> Vec<(bool, String)> {
    frame.said(|span| format!("{span:?}"))
}

#[test]
fn regions_have_the_bits_of_the_interpreter() {
    // Loops stay loops, and branches stay branches.
    for without in [vec![], vec![Pass::Unroll], vec![Pass::Unroll, Pass::Flatten]] {
        let passes = passes::Options { without, ..passes::Options::default() };
        for (name, text) in SHADERS {
            let compiled = run::compile(name, text, &[], &passes).unwrap();
            let run = |isa, native, batch| {
                let options =
                    RunOptions { isa, native, batch: Some(batch), tile: 400, ..RunOptions::default() };
                osl_exec::run(&compiled.program, &run::services(), &grid(), &options, &|_| ()).unwrap()
            };
            let expected = run(Isa::baseline(), Native::Never, 64);
            for isa in Isa::all() {
                for batch in [16, 64, 256] {
                    let got = run(isa, Native::Always, batch);
                    let way = format!("{name} {isa:?} {batch} without {:?}", passes.without);
                    assert_eq!(words(&got), words(&expected), "{way}");
                    assert_eq!(said(&got), said(&expected), "{way}");
                }
            }
        }
    }
}

/// Which points exceed the limit of steps does not depend on how they run.
#[test]
fn the_limit_of_steps_is_the_same() {
    let (name, text) = SHADERS[0];
    let compiled = run::compile(name, text, &[], &passes::Options::default()).unwrap();
    let verdict = |native, steps| -> Result<Vec<_>, RunError> {
        let mut limits = Limits::default();
        limits.running.point_steps = steps;
        let options = RunOptions { native, limits, batch: Some(64), ..RunOptions::default() };
        osl_exec::run(&compiled.program, &run::services(), &grid(), &options, &|_| ())
            .map(|frame| words(&frame))
    };
    let mut both = [false; 2];
    for steps in (100..6000).step_by(149) {
        let (interpreted, native) = (verdict(Native::Never, steps), verdict(Native::Always, steps));
        both[usize::from(interpreted.is_ok())] = true;
        match (&interpreted, &native) {
            (Ok(a), Ok(b)) => assert_eq!(a, b, "{steps}"),
            (Err(a), Err(b)) => assert_eq!(a.to_string(), b.to_string(), "{steps}"),
            _ => panic!("{steps}: {:?}, {:?}", interpreted.is_ok(), native.is_ok()),
        }
    }
    assert_eq!(both, [true; 2], "some limits are too low and some are not");
}
