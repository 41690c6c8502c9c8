//! The headers that come with the compiler: every function of each, compared with the same arithmetic on the
//! components.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl::{Group, MemoryFiles, Points, ReadOptions, Renderer, RendererServices, RunOptions, Shader, Value};
use std::fmt::Write;

/// A struct of a header: its name, its fields, and the type of each.
type Fields = &'static [(&'static str, &'static str)];

const VECTOR2: Fields = &[("x", "float"), ("y", "float")];
const VECTOR4: Fields = &[("x", "float"), ("y", "float"), ("z", "float"), ("w", "float")];
const COLOR2: Fields = &[("r", "float"), ("a", "float")];
const COLOR4: Fields = &[("rgb", "color"), ("a", "float")];

const STRUCTS: [(&str, Fields); 4] =
    [("vector2", VECTOR2), ("vector4", VECTOR4), ("color2", COLOR2), ("color4", COLOR4)];

/// Calls of all headers, with the expected expression for one component: `$` stands for its name.
const EACH: &[(&str, &str)] = &[
    ("-a", "-a.$"),
    ("a + b", "a.$ + b.$"),
    ("a - b", "a.$ - b.$"),
    ("a * b", "a.$ * b.$"),
    ("a / b", "a.$ / b.$"),
    ("a + 3", "a.$ + 3.0"),
    ("3 + a", "3.0 + a.$"),
    ("a - 3", "a.$ - 3.0"),
    ("3 - a", "3.0 - a.$"),
    ("a * 3", "a.$ * 3.0"),
    ("3 * a", "3.0 * a.$"),
    ("a / 3", "a.$ * (1.0 / 3.0)"),
    ("3 / a", "3.0 / a.$"),
    ("a + v", "a.$ + v"),
    ("v + a", "v + a.$"),
    ("a - v", "a.$ - v"),
    ("v - a", "v - a.$"),
    ("a * v", "a.$ * v"),
    ("v * a", "v * a.$"),
    ("a / v", "a.$ * (1.0 / v)"),
    ("v / a", "v / a.$"),
    ("abs(b - a)", "abs(b.$ - a.$)"),
    ("ceil(3 * a)", "ceil(3.0 * a.$)"),
    ("floor(3 * a)", "floor(3.0 * a.$)"),
    ("sqrt(a)", "sqrt(a.$)"),
    ("exp(a)", "exp(a.$)"),
    ("log(a)", "log(a.$)"),
    ("log2(a)", "log2(a.$)"),
    ("sign(a - b)", "sign(a.$ - b.$)"),
    ("sin(a)", "sin(a.$)"),
    ("cos(a)", "cos(a.$)"),
    ("tan(a)", "tan(a.$)"),
    ("asin(a)", "asin(a.$)"),
    ("acos(a)", "acos(a.$)"),
    ("mix(a, b, v)", "mix(a.$, b.$, v)"),
    ("smoothstep(b, c, a)", "smoothstep(b.$, c.$, a.$)"),
    ("smoothstep(0.25, 0.75, a)", "smoothstep(a.$ * 0 + 0.25, a.$ * 0 + 0.75, a.$)"),
    ("clamp(a, b, c)", "clamp(a.$, b.$, c.$)"),
    ("clamp(a, 0.25, 0.75)", "clamp(a.$, a.$ * 0 + 0.25, a.$ * 0 + 0.75)"),
    ("max(a, b)", "max(a.$, b.$)"),
    ("max(a, v)", "max(a.$, a.$ * 0 + v)"),
    ("min(a, b)", "min(a.$, b.$)"),
    ("min(a, v)", "min(a.$, a.$ * 0 + v)"),
    ("fmod(3 * a, b)", "fmod(3.0 * a.$, b.$)"),
    ("fmod(3 * a, v)", "fmod(3.0 * a.$, v)"),
    ("fmod(-3 * a, 2)", "fmod(-3.0 * a.$, 2.0)"),
    ("pow(a, b)", "pow(a.$, b.$)"),
    ("pow(a, v)", "pow(a.$, v)"),
    ("atan2(a, b)", "atan2(a.$, b.$)"),
    ("atan2(a, v)", "atan2(a.$, a.$ * 0 + v)"),
];

/// A shader whose output counts the failed checks, and which prints them.
fn wrong_of(header: &str, fields: Fields, more: &str) -> String {
    let mut text = format!("#include \"{header}.h\"\n");
    let make = |seed: u32| {
        let parts = fields.iter().enumerate().map(|(i, (_, ty))| {
            let k = format!("{}.{}", 0, 11 * (seed + i as u32));
            match *ty {
                "color" => format!("color(u * {k}, {k}, u)"),
                _ => format!("u * {k} + 0.05"),
            }
        });
        format!("{header}({})", parts.collect::<Vec<_>>().join(", "))
    };
    let _ = write!(
        text,
        "shader wrong(output int wrong = 0) {{\n{header} a = {}, b = {}, c = b + 0.5, r;\n",
        make(3),
        make(1)
    );
    for (call, each) in EACH {
        let _ = writeln!(text, "r = {call};");
        for (name, _) in fields {
            let each = each.replace('$', name);
            let _ = writeln!(text, "if (r.{name} != {each}) {{ ++wrong; printf(\"{call} {name}\\n\"); }}");
        }
    }
    text + "wrong += !(a == a) + (a == b) + (a != a) + !(a != b);\n" + more + "\n}\n"
}

/// Runs a shader at three points and expects its output `wrong` to be 0.
#[track_caller]
fn nothing_wrong(text: &str) {
    let shader = Shader::compile("s.osl", text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let program = Group::new().layer("s", &shader).compile(&[]).unwrap();
    let out = program.run(&Points::new(3).u(&[0.25, 0.5, 0.9]).v(&[0.3, 0.5, 0.8])).unwrap();
    assert_eq!(out.ints("wrong"), Some(vec![0; 3]), "{}", out.printed());
}

#[test]
fn each_component_by_itself() {
    for (header, fields) in STRUCTS {
        nothing_wrong(&wrong_of(header, fields, ""));
    }
}

#[test]
fn geometry_of_vectors() {
    let two = "if (dot(a, b) != a.x * b.x + a.y * b.y) wrong += 1;
        if (length(a) != hypot(a.x, a.y)) wrong += 10;
        r = normalize(a); c = a / length(a); if (r != c) wrong += 100;
        r = mod(vector2(5.5, -5.5), vector2(2, 2)); if (r.x != 1.5 || r.y != 0.5) wrong += 1000;
        r = fmod(vector2(5.5, -5.5), vector2(2, 2)); if (r.x != 1.5 || r.y != -1.5) wrong += 10000;";
    nothing_wrong(&wrong_of("vector2", VECTOR2, two));
    let four = "if (abs(dot(a, b) - (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w)) > 1e-6) wrong += 1;
        if (abs(length(a) * length(a) - dot(a, a)) > 1e-6) wrong += 10;
        r = normalize(a); if (abs(length(r) - 1) > 1e-6) wrong += 100;
        vector p = vec4ToVec3(vector4(2, 4, 6, 2)); if (p != vector(1, 2, 3)) wrong += 1000;
        matrix m = matrix(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16);
        r = transform(m, vector4(1, 10, 100, 1000));
        if (r.x != 13951 || r.y != 15062 || r.z != 16173 || r.w != 17284) wrong += 10000;
        r = transform(\"common\", \"common\", a); if (r != a) wrong += 100000;";
    nothing_wrong(&wrong_of("vector4", VECTOR4, four));
}

#[test]
fn colors_with_alpha() {
    let more = "r = transformc(\"rgb\", \"hsv\", color4(color(0.1, 0.2, 0.3), 0.5));
        if (r.rgb != transformc(\"rgb\", \"hsv\", color(0.1, 0.2, 0.3)) || r.a != 0.5) wrong += 1;";
    nothing_wrong(&wrong_of("color4", COLOR4, more));
    nothing_wrong(&wrong_of("color2", COLOR2, ""));
}

#[test]
fn matrices_of_three() {
    nothing_wrong(
        "#include <matrix33.h>
        shader s(output int wrong = 0) {
            matrix any = matrix(1, u, 3, 9, 0, 1, v, 9, 5, 6, 0, 9, 9, 9, 9, 9);
            matrix33 a = matrix44To33(any);
            matrix m = matrix33To44(a);
            wrong += isValidAs33(any) + !isValidAs33(m);
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k)
                    wrong += m[i][k] != any[i][k];
            for (int i = 0; i < 4; ++i) {
                matrix off = m;
                off[i][3] = 2;
                wrong += isValidAs33(off);
                off = m;
                off[3][i] = 2;
                wrong += isValidAs33(off);
            }
            matrix33 b = transpose(a), c = -a;
            wrong += b.m != transpose(m);
            wrong += c.m != -m;
            c = a * b; wrong += c.m != m * b.m;
            c = a * 2; wrong += c.m != m * 2;
            c = 2 * a; wrong += c.m != 2 * m;
            c = a * v; wrong += c.m != m * v;
            c = v * a; wrong += c.m != v * m;
            c = a / b; wrong += c.m != m / b.m;
            c = a / 2; wrong += c.m != m / 2;
            c = 2 / a; wrong += c.m != 2 / m;
            c = a / v; wrong += c.m != m / v;
            c = v / a; wrong += c.m != v / m;
            wrong += !(a == a) + (a == b);
            wrong += determinant(a) != determinant(m);
            wrong += transform(a, point(1, 2, 3)) != transform(m, point(1, 2, 3));
            wrong += transform(a, vector(1, 2, 3)) != transform(m, vector(1, 2, 3));
            wrong += transform(a, normal(1, 2, 3)) != transform(m, normal(1, 2, 3));
        }",
    );
    let unequal = "#include \"matrix33.h\"\nshader s() { matrix33 a = matrix44To33(1); if (a != a) N = 0; }";
    assert!(Shader::compile("s.osl", unequal).is_err(), "as in the distribution, no operator is `!=`");
}

/// A square of side 2 around the origin, and the triangle of three of its corners.
struct Square;

impl RendererServices for Square {
    fn attribute(&self, _: &str, name: &str, _: usize) -> Option<Value> {
        let corners =
            |list: &[[f32; 3]]| Value::Triples(list.iter().copied().chain([[0.0; 3]; 64]).take(64).collect());
        let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        match name {
            "geom:numpolyvertices" => Some(Value::Int(4)),
            "geom:polyvertices" => Some(corners(&square)),
            "geom:trianglevertices" => Some(corners(&square[..3])),
            _ => None,
        }
    }
}

#[test]
fn lines_along_edges() {
    let text = "#include \"oslutil.h\"
        shader s(output float pixels = 0, output float wide = 0, output float diagonal = 0, output float patch = 0,
            output float by_default = 0, output float none = 0) {
            pixels = wireframe(\"polygons\");
            wide = wireframe(\"polygons\", 0.5, 0);
            diagonal = wireframe(\"triangles\", 2.0);
            patch = wireframe(\"patches\", 2.0, 1);
            by_default = wireframe();
            none = wireframe(\"circles\");
        }";
    let shader = Shader::compile("s.osl", text).unwrap();
    let outputs = ["pixels", "wide", "diagonal", "patch", "by_default", "none"];
    let program = Group::new().layer("s", &shader).compile(&outputs).unwrap();
    // The center, points a tenth and a fifth from the right edge, and one near the left edge, which the
    // triangle lacks.
    let p = [[0.0, 0.0, 0.0], [0.9, 0.0, 0.0], [0.79, 0.0, 0.0], [-0.9, 0.0, 0.0]];
    let points = Points::new(4).p(&p).i(&[[0.0, 0.0, -1.0]; 4]);
    let points = points.p_derivs(&[[0.3, 0.0, 0.0]; 4], &[[0.0, 0.1, 0.0]; 4]);
    let run = |renderer: &Renderer| {
        let out = program.run_with(&points, renderer, &RunOptions::default()).unwrap();
        outputs.map(|name| out.floats(name).unwrap().iter().map(|x| x.to_string()).collect::<String>())
    };
    // A pixel is 0.2 wide on average, so a line of one pixel reaches 0.1: not quite as far as the second
    // point.
    let found = run(&Renderer::new(Square));
    assert_eq!(found[1], "0111", "half of 0.5");
    assert_eq!(found[2], "1100", "the triangle's third edge runs through the center");
    assert_eq!(found[3], "0101", "two pixels reach 0.2, which is less than the distance of the third point");
    assert_eq!(found[0], found[4]);
    assert_eq!(found[5], "0000");
    assert_eq!(run(&Renderer::default()), ["0000"; 6].map(String::from), "no geometry, no lines");
}

/// All letters as drawn: 16 per row, one line of text per row of pixels.
#[test]
fn letters() {
    let text = "#include \"oslutil.h\"
        shader s(string text = \"\", output float set = 0) { set = draw_string(text, P[0], P[1], 0, 0, 0); }";
    let shader = Shader::compile("s.osl", text).unwrap();
    let mut sheet = String::new();
    for first in (33u8..127).step_by(16) {
        let letters: String = (first..127.min(first + 16)).map(char::from).collect();
        let program = Group::new().layer("s", &shader).param("text", letters.as_str()).compile(&[]).unwrap();
        let width = 8 * letters.len() + 2;
        let p: Vec<[f32; 3]> =
            (-1..15).flat_map(|y| (0..width).map(move |x| [x as f32 - 0.5, y as f32 + 0.25, 0.0])).collect();
        let set = program.run(&Points::new(p.len()).p(&p)).unwrap().floats("set").unwrap();
        for (y, row) in set.chunks(width).enumerate() {
            let row: String = row.iter().map(|x| if *x == 1.0 { '#' } else { '.' }).collect();
            if y == 0 || y == 15 {
                assert!(!row.contains('#'), "a row of pixels beside the text");
                continue;
            }
            // The first pixel is before the text, the last after it.
            let cells: Vec<&str> = (0..letters.len()).map(|n| &row[8 * n + 2..8 * n + 9]).collect();
            let between: String = (0..=letters.len()).map(|n| &row[8 * n + 1..8 * n + 2]).collect();
            assert!(!between.contains('#'), "the first column of a cell is empty");
            let _ = writeln!(sheet, "{}", cells.join(" "));
        }
        sheet.push('\n');
    }
    assert_eq!(sheet.trim_end(), include_str!("data/letters.txt").trim_end());
}

#[test]
fn text_that_repeats() {
    nothing_wrong(
        "#include \"oslutil.h\"
        shader s(output int wrong = 0) {
            for (int x = -20; x < 36; ++x)
                for (int y = 0; y < 14; ++y) {
                    float once = draw_string(\"Ag\", x, y, 0, 0, 0);
                    wrong += once != 0 && (x < 0 || x > 15);
                    float again = draw_string(\"Ag\", x, y, 1, 0, 0);
                    wrong += x >= 0 && x < 16 && again != once;
                    wrong += again != draw_string(\"Ag\", x + 30, y, 1, 0, 0);
                    wrong += draw_string(\"Ag\", x, y, 1, 0, 5) != draw_string(\"Ag\", x + 5, y, 1, 0, 0);
                    wrong += draw_string(\"Ag\", x, y, 0, 0, 5) != once;
                    wrong += once != draw_string(\"Ag\", x, y - 28, 0, 1, 0);
                    wrong += draw_string(\"Ag\", x, y, 0, 1, 3 << 16) != draw_string(\"Ag\", x, y + 3, 0, 1, 0);
                }
            wrong += draw_string(\"Ag\", 1e20, 1e20, 0, 0, 0) != 0 || draw_string(\"\", 3, 3, 1, 1, 0) != 0;
            wrong += draw_string(\" \\t~\", 4, 6, 0, 0, 0) != 0;
        }",
    );
}

#[test]
fn own_headers_go_first() {
    let read = |text: &str, own: &MemoryFiles| Shader::read("s.osl", text, own, &ReadOptions::default());
    let own = MemoryFiles::new().with("vector2.h", "#define OWN 5\n");
    let text = "#include \"vector2.h\"\n#include <vector4.h>\nshader s(output int five = OWN, vector4 four = {1, 2, 3, 4}) {}";
    assert_eq!(read(text, &own).unwrap().params().len(), 2);
    let own = MemoryFiles::new().with("stdosl.h", "#define TAU 6.5\n");
    let text = "shader s(output float tau = TAU) {}";
    assert!(read(text, &own).is_ok());
    assert!(Shader::compile("s.osl", text).is_err());
    let text = "shader s(output float pi = M_PI) {}";
    assert!(read(text, &own).is_err(), "read in place of the compiler's own");
    assert!(read(text, &MemoryFiles::new()).is_ok());
}
