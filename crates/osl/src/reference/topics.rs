//! Words of the language other than functions: globals, types, statements, and the kinds of shaders.

use osl_ir::global::GLOBALS;
use osl_ir::types::StructTable;

/// A word of the language that is not a function.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Topic {
    /// The word.
    pub name: &'static str,
    /// What it is: `global`, `type`, `statement`, `kind of shader`, `word`.
    pub kind: &'static str,
    /// Its form: the declaration of a global, or how a statement is written.
    pub form: String,
    /// Its meaning.
    pub about: &'static str,
    /// Statements that use it.
    pub example: &'static str,
}

const GLOBAL: &str = "global";
const TYPE: &str = "type";
const STATEMENT: &str = "statement";
const KIND: &str = "kind of shader";
const WORD: &str = "word";

/// Name, meaning and example of each global.
const ABOUT_GLOBALS: [(&str, &str, &str); 13] = [
    (
        "P",
        "The position of the shaded point, in common space. A displacement shader assigns it to move the \
         surface. On the unit patch of `oslrun FILE` it is (u, v, 1).",
        "float near = 1 / (1 + length(P)); result = near;",
    ),
    (
        "I",
        "The direction from which the point is seen: from the eye to P. It is not normalized. The unit \
         patch of `oslrun FILE` is seen from above: there it is (0, 0, -1) at all points.",
        "vector r = reflect(normalize(I), N); result = r[2];",
    ),
    (
        "N",
        "The shading normal at P, of length 1. It may be bent by bump mapping, and surface and displacement \
         shaders may assign it. Ng is the normal of the geometry itself. On the unit patch it is (0, 0, 1).",
        "float facing = abs(dot(normalize(I), N)); result = facing;",
    ),
    (
        "Ng",
        "The normal of the geometry at P, without bump mapping or smooth shading.",
        "result = dot(N, Ng);",
    ),
    (
        "u",
        "The first coordinate on the surface. On the unit patch it runs from 0 at the left to 1 at the \
         right.",
        "result = u;",
    ),
    (
        "v",
        "The second coordinate on the surface. On the unit patch it runs from 0 in the first row of the \
         picture to 1 in the last.",
        "result = v;",
    ),
    (
        "dPdu",
        "How P changes with u: a vector along the surface. Anisotropic closures use it as their tangent.",
        "vector along = normalize(dPdu); result = along[0];",
    ),
    (
        "dPdv",
        "How P changes with v: a vector along the surface.",
        "vector along = normalize(dPdv); result = along[1];",
    ),
    (
        "Ps",
        "The point that a light shader illuminates. Surface shaders do not need it.",
        "result = distance(P, Ps);",
    ),
    ("time", "The time of this sample, which a renderer sets; 0 otherwise.", "result = sin(time);"),
    (
        "dtime",
        "The amount of time that this sample covers, which a renderer sets; 0 otherwise.",
        "result = time + dtime;",
    ),
    (
        "dPdtime",
        "How P moves per unit of time, which a renderer sets; 0 otherwise.",
        "result = length(dPdtime);",
    ),
    (
        "Ci",
        "How the surface scatters and emits light: a closure, which is a sum of components such as \
         `diffuse(N)` with weights. A renderer evaluates it. It has no value that could be compared or \
         written as a color.",
        "Ci = color(0.8, 0.2, 0.1) * diffuse(N) + 0.1 * reflection(N);",
    ),
];

type Row = (&'static str, &'static str, &'static str, &'static str, &'static str);

/// Name, kind, form, meaning and example of each other word.
const OTHERS: [Row; 31] = [
    (
        "int",
        TYPE,
        "int count = 3;",
        "A whole number of 32 bits. Arithmetic wraps, and `/` between ints drops the fraction: 1 / 2 is 0. \
         A truth value is an int too: 0 is false, and every other number is true.",
        "int count = 7 / 2; result = count;",
    ),
    (
        "float",
        TYPE,
        "float x = 0.5;",
        "A number in single precision: about seven digits. An int becomes a float without a cast.",
        "float x = 1.0 / 3; result = x;",
    ),
    (
        "string",
        TYPE,
        "string name = \"object\";",
        "A text, such as the name of a texture, a space or a message. `concat` joins strings, and `format` \
         makes one from values.",
        "string name = concat(\"a\", \"b\"); result = strlen(name);",
    ),
    (
        "color",
        TYPE,
        "color c = color(1, 0.5, 0);    color(\"hsv\", h, s, v)",
        "Red, green and blue, linear, usually 0 to 1. `c[0]` or `c.r` is red. A single number makes a grey. \
         `luminance(c)` is the brightness of `c`.",
        "color c = color(\"hsv\", 0.1, 1, 1); result = luminance(c);",
    ),
    (
        "point",
        TYPE,
        "point p = point(x, y, z);    point(\"object\", x, y, z)",
        "A position. `transform` moves it with the whole matrix, translation included. A point minus a point \
         is a vector; a point plus a vector is a point.",
        "point p = point(1, 2, 3); vector d = p - P; result = length(d);",
    ),
    (
        "vector",
        TYPE,
        "vector d = vector(x, y, z);",
        "A direction with a length. `transform` turns and scales it, and ignores the translation.",
        "vector up = vector(0, 1, 0); result = dot(up, N);",
    ),
    (
        "normal",
        TYPE,
        "normal n = normal(x, y, z);",
        "A direction perpendicular to a surface. `transform` multiplies it by the inverse transpose of the \
         matrix, so that it stays perpendicular when the surface is stretched.",
        "normal n = normalize(N); result = n[2];",
    ),
    (
        "matrix",
        TYPE,
        "matrix m = matrix(1);    matrix(\"object\", \"common\")",
        "Four rows of four numbers, for row vectors: the last row is the translation. `m[row][column]` is an \
         element; a single number makes a multiple of the identity. `transform(m, p)` applies it.",
        "matrix m = matrix(2); point p = transform(m, P); result = p[0];",
    ),
    (
        "void",
        TYPE,
        "void f(float x, output float y)",
        "The type of a function without a result.",
        "result = 0;",
    ),
    (
        "closure",
        TYPE,
        "closure color c = diffuse(N);",
        "Tells a renderer how a surface scatters or emits light. Closures can be added, and multiplied by a \
         color or a float.",
        "closure color c = 0.5 * diffuse(N) + emission(); Ci = c;",
    ),
    (
        "struct",
        TYPE,
        "struct Layer { color tint; float weight; };",
        "A type with several named fields. It is declared outside of functions and shaders. `a.tint` is a \
         field of the struct `a`, and a list such as `{ tint, weight }` initialises a struct.",
        "struct Layer { color tint; float weight; }; Layer a = { color(1, 0, 0), 0.5 }; result = a.weight;",
    ),
    (
        "if",
        STATEMENT,
        "if (condition) statement else statement",
        "Runs the first statement where the condition is not 0, else the second. Points of one picture may \
         take different branches.",
        "if (u > 0.5) result = 1; else result = 0;",
    ),
    (
        "else",
        STATEMENT,
        "if (condition) statement else statement",
        "Starts the other branch of an `if`.",
        "if (u > 0.5) result = 1; else result = 0;",
    ),
    (
        "for",
        STATEMENT,
        "for (start; condition; step) statement",
        "Runs `start` once, then the statement and `step` as long as the condition is not 0. `start` may \
         declare the counter. `break` leaves the loop, and `continue` goes to its next turn.",
        "float sum = 0; for (int i = 0; i < 3; i++) sum += i * u; result = sum;",
    ),
    (
        "while",
        STATEMENT,
        "while (condition) statement",
        "Runs the statement as long as the condition, tested before each turn, is not 0.",
        "float x = u + 1; while (x < 4) x *= 2; result = x;",
    ),
    (
        "do",
        STATEMENT,
        "do statement while (condition);",
        "Runs the statement once, then again as long as the condition is not 0.",
        "float x = u + 1; do x *= 2; while (x < 4); result = x;",
    ),
    (
        "break",
        STATEMENT,
        "break;",
        "Leaves the innermost loop.",
        "for (int i = 0; i < 9; i++) { if (i > 3 * u) break; result = i; }",
    ),
    (
        "continue",
        STATEMENT,
        "continue;",
        "Goes to the next turn of the innermost loop.",
        "for (int i = 0; i < 9; i++) { if (i % 2 == 0) continue; result += i * u; }",
    ),
    (
        "return",
        STATEMENT,
        "return value;",
        "Leaves the function with a result. `return;` leaves a void function or the shader.",
        "float twice(float x) { return 2 * x; } result = twice(u);",
    ),
    (
        "output",
        WORD,
        "output float mask = 0",
        "Stands before a parameter. A shader computes its outputs, and `oslrun` writes them to the picture. A \
         function stores its outputs in the caller's variables.",
        "void twice(float x, output float y) { y = 2 * x; } twice(u, result);",
    ),
    (
        "shader",
        KIND,
        "shader name(parameters) { statements }",
        "A shader of no particular kind: a pattern, or a node of a group.",
        "result = u;",
    ),
    (
        "surface",
        KIND,
        "surface name(parameters) { statements }",
        "A shader that says how a surface scatters light: it assigns Ci.",
        "Ci = diffuse(N);",
    ),
    (
        "displacement",
        KIND,
        "displacement name(parameters) { statements }",
        "A shader that moves the surface: it assigns P and N.",
        "P += 0.1 * noise(4 * P) * N;",
    ),
    (
        "volume",
        KIND,
        "volume name(parameters) { statements }",
        "A shader that says how a volume scatters light: it assigns Ci.",
        "Ci = emission();",
    ),
    ("and", WORD, "a and b", "The same as `&&`: 1 if both sides are not 0.", "result = u > 0.2 and u < 0.8;"),
    (
        "or",
        WORD,
        "a or b",
        "The same as `||`: 1 if at least one side is not 0.",
        "result = u < 0.2 or u > 0.8;",
    ),
    ("not", WORD, "not a", "The same as `!`: 1 if the value is 0, else 0.", "result = not (u > 0.5);"),
    (
        "M_PI",
        WORD,
        "M_PI = 3.14159265…",
        "Half a turn in radians. Other constants are M_PI_2, M_PI_4, M_2PI, M_4PI, M_2_PI, M_1_PI, M_E, \
         M_SQRT2 and more.",
        "result = sin(2 * M_PI * u);",
    ),
    (
        "include",
        WORD,
        "#include \"file.h\"",
        "Inserts the text of a file. The compiler looks for it beside the including file and in the folders \
         of `-I`.",
        "result = 0;",
    ),
    (
        "metadata",
        WORD,
        "float radius = 0.5 [[ float min = 0, float max = 1, string help = \"…\" ]]",
        "Facts about a parameter or a shader, for programs that show it: limits of a slider, a label, a help \
         text. They do not change what the shader computes. `oslrun info` prints them.",
        "result = 0;",
    ),
    (
        "array",
        TYPE,
        "float a[3] = { 1, 2, 3 };",
        "Several values of one type, numbered from 0. `arraylength(a)` is their number. An index out of \
         range is a run-time error and selects the nearest element.",
        "float a[3] = { 1, 2, 3 }; result = a[1] + arraylength(a);",
    ),
];

/// All words.
pub fn topics() -> Vec<Topic> {
    let structs = StructTable::default();
    let globals = ABOUT_GLOBALS.iter().map(|(name, about, example)| {
        let ty = GLOBALS.iter().find(|(_, global, ..)| global == name).map(|(_, _, ty, _)| structs.show(*ty));
        let form = format!("{} {name}", ty.unwrap_or_default());
        Topic { name, kind: GLOBAL, form, about, example }
    });
    let others = OTHERS.iter().map(|(name, kind, form, about, example)| Topic {
        name,
        kind,
        form: (*form).to_string(),
        about,
        example,
    });
    globals.chain(others).collect()
}

/// The word with this name.
pub fn topic(name: &str) -> Option<Topic> {
    topics().into_iter().find(|topic| topic.name == name)
}
