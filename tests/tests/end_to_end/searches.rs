//! Loops over the neighbours of a cell, whose bounds differ from point to point: the same values as without
//! the pass that writes them out, also where a coordinate is NaN or too large for an int.

use osl_exec::Native;
use osl_ir::passes::Pass;
use osl_tests::laws::{Way, hold, plain};
use osl_tests::run;

/// Coordinates: usual ones; and NaN, infinity, and numbers beyond the range of ints at some points.
const COORDINATES: [&str; 4] = [
    "x = 3 * u; y = 4 * v;",
    "x = u > 0.5 ? 1e30 : 3 * u; y = v < 0 ? -2147483648.0 : 4 * v;",
    "x = acos(3 * u); y = log(v - 0.2) * 1e9;",
    "x = 2147483520.0 * (u - 1); y = v > 0 ? -2147483520.0 : 2147483520.0;",
];

/// Searches: the bounds, and whether the loops are written out.
const SEARCHES: [(&str, bool); 8] = [
    ("int i = a - 1; i <= a + 1; i++", true),
    ("int i = a; i < a + 3; i++", true),
    ("int i = a + 2; i > a - 1; i -= 1", true),
    ("int i = a - 2; i != a + 2; i += 2", true),
    ("int i = a - 60; i <= a + 60; i += 30", true),
    ("int i = a - 1; i <= b + 1 && i < a + 4; i++", false),
    ("int i = a - 1; i <= a + 1 && i < 5; i++", false),
    ("int i = a - 1; i <= a + (int)(2 * u); i++", false),
];

fn search(coordinates: &str, bounds: &str) -> String {
    format!(
        "shader s(output float near = 9, output int sum = 0, output vector last = 0)
        {{
            float x, y;
            {coordinates}
            int a = (int)floor(x), b = (int)floor(y);
            for ({bounds}) {{
                for (int j = b - 1; j <= b + 1; j++) {{
                    float d = hypot(x - i, y - j) + (float)cellnoise(i, j);
                    if (d < near) {{
                        near = d;
                        last = vector(i, j, i - a);
                    }}
                    if (i == a)
                        sum += j % 7;
                }}
                sum = sum % 1000 + i % 5;
            }}
        }}"
    )
}

#[test]
fn have_the_same_values_written_out() {
    let ways = [
        Way { without: vec![Pass::Unroll], ..plain() },
        Way { native: Native::Always, batch: 32, for_grid: true, ..plain() },
    ];
    for coordinates in COORDINATES {
        for (bounds, _) in SEARCHES {
            let text = search(coordinates, bounds);
            hold(&text, &ways).unwrap_or_else(|law| panic!("{law}\n{text}"));
        }
    }
}

#[test]
fn are_written_out_if_the_rounds_are_known() {
    for (bounds, written) in SEARCHES {
        let text = search(COORDINATES[0], bounds);
        let body = run::compile("s.osl", &text, &[], &Default::default()).expect("a shader").body;
        assert_eq!(!osl_ir::ir::print(&body).contains(" loop "), written, "{bounds}");
    }
}
