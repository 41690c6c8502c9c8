//! Compiled shaders and groups.

use super::{contents, files, outcome, tight};
use crate::laws;
use osl::stages::{self, ShaderFiles};
use osl_ir::passes;
use osl_lower::params::ParamValues;
use osl_scene::Grid;
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};

/// Words of compiled shaders.
pub(super) const OSO_WORDS: &[&str] = &[
    "OpenShadingLanguage 1.00",
    "surface",
    "shader",
    "param",
    "oparam",
    "local",
    "temp",
    "const",
    "global",
    "symbol",
    "code",
    "___main___",
    "end",
    "assign",
    "add",
    "mul",
    "div",
    "mod",
    "if",
    "for",
    "while",
    "dowhile",
    "functioncall",
    "return",
    "exit",
    "break",
    "continue",
    "useparam",
    "aref",
    "aassign",
    "compref",
    "compassign",
    "mxcompref",
    "arraycopy",
    "arraylength",
    "format",
    "printf",
    "texture",
    "noise",
    "closure",
    "matrix",
    "color",
    "float",
    "int",
    "string",
    "point",
    "struct:",
    "[]",
    "[3]",
    "[1000000]",
    "%meta{string,help,\"x\"}",
    "%read{0,9}",
    "%write{0,9}",
    "%derivs",
    "%argrw{\"wrr\"}",
    "%filename{\"a\"}",
    "%line{1}",
    "%struct{\"S\"}",
    "%structfields{a,b}",
    "%mystruct{s}",
    "%mystructfield{1}",
    "%initexpr",
    "$tmp1",
    "$const1",
    "\t",
    "\n",
    "nop",
    "lt",
    "eq",
    "spline",
    "regex_search",
    "split",
    "concat",
    "dict_find",
    "setmessage",
];

/// Compiled shaders of the repository.
pub(super) fn compiled_seeds() -> Vec<Vec<u8>> {
    contents("tests/data/oso", &["oso"])
}

/// A compiled shader: if it can be read, it is compiled and run with tight limits. The text written from it
/// can be read again.
pub fn oso(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let checked = stages::check("fuzz.oso", &text, &NoFiles, &Options::default());
    let codes = || checked.diagnostics.iter().map(|d| d.code.id);
    for d in &checked.diagnostics {
        assert!(d.span.start <= d.span.end && checked.sources.place(d.span).is_some(), "{d:?}");
    }
    let Some(program) = &checked.program else { return outcome(codes()) };
    let Ok(body) = osl_lower::lower(program, &ParamValues::default()) else {
        return outcome(codes().chain(["not lowered"]));
    };
    if let Err(wrong) = osl_ir::ir::validate::validate(&body) {
        super::broken(&text, &wrong);
    }
    let elements: u64 = body.slots.iter().filter_map(|slot| slot.len).map(u64::from).sum();
    if body.values.len() > 20_000 || elements > 1 << 14 {
        return outcome(codes().chain(["large"]));
    }
    if bytes.len().is_multiple_of(4)
        && let Ok(written) = osl_hir::oso::write(program, &checked.sources, &Default::default())
    {
        let again = stages::check("fuzz.oso", &written, &NoFiles, &Options::default());
        if again.program.is_none() {
            super::broken(
                &text,
                &format!("{written}\nwhat is written cannot be read: {:?}", again.diagnostics),
            );
        }
    }
    let compiled = stages::finish(body, &passes::Options::default());
    let run = osl_exec::run(&compiled.program, laws::services(), &Grid::new(3, 2), &tight(), &|_| ());
    outcome(codes().chain([if run.is_ok() { "ran" } else { "stopped" }]))
}

/// Words of groups.
pub(super) const GROUP_WORDS: &[&str] = &[
    "param",
    "shader",
    "connect",
    "float",
    "int",
    "color",
    "string",
    "matrix",
    "vector",
    "[3]",
    "[]",
    "[2147483647]",
    ";",
    ".",
    ",",
    "\"a b\"",
    "1 2 3",
    "[[int lockgeom=0]]",
    "[[int interactive=1]]",
    "a",
    "b",
    "mixer",
    "shapes",
    "lists",
    "nosuch",
    "out",
    "x",
    "c",
    "s",
    "s.f",
    "arr",
    "arr[1]",
    "c[0]",
    "k",
    "m",
    "closures",
    "Ci",
    "#",
    "\n",
];

/// The available shaders.
const SHADERS: &[(&str, &str)] = &[
    ("a", "shader a(float freq = 2, output float out = 0, output color c = 1) { out = noise(P * freq); c = color(u, v, out); }"),
    ("b", "shader b(float x = 1, int i = 3, string text = \"t\", output float out = 0) { out = x * i + strlen(text); }"),
    ("mixer", "shader mixer(color a = 0, color b = 1, float m = 0.5, output color c = 0) { c = mix(a, b, m); }"),
    (
        "shapes",
        "struct S { float f; color c; }; shader shapes(S s = {1, 2}, matrix m = 1, point p = P, output S out = {0, 0}) {
        out.f = s.f + m[0][0] + p[0]; out.c = s.c; }",
    ),
    (
        "lists",
        "shader lists(float arr[3] = {1, 2, 3}, float any[] = {1}, string names[2] = {\"a\", \"b\"}, output float out[3] = {0, 0, 0})
        { for (int k = 0; k < 3; k++) out[k] = arr[k] + any[0] + strlen(names[0]); }",
    ),
    (
        "closures",
        "surface closures(closure color k = 0, float x = 1 [[ int lockgeom = 0 ]], output closure color out = 0) {
        setmessage(\"m\", x); out = k + x * diffuse(N); Ci = out; }",
    ),
];

struct AtHand;

impl ShaderFiles for AtHand {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let found = SHADERS.iter().find(|(name, _)| *name == shader);
        found
            .map(|(name, text)| (format!("{name}.osl"), (*text).to_string()))
            .ok_or_else(|| "there is none".to_string())
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// Groups of the repository with the names of these shaders, and some groups of these shaders.
pub(super) fn group_seeds() -> Vec<Vec<u8>> {
    let mut seeds: Vec<Vec<u8>> = [
        "shader a one; param float x 3; shader b two; connect one.out two.x",
        "param float freq 3 [[int lockgeom=0]]; shader a one; shader a two; shader mixer m; connect one.c m.a; connect two.c m.b; connect one.out m.m;",
        "shader shapes s; shader shapes t; connect s.out t.s; connect s.out.f t.p[1]",
        "param float[3] arr 1 2 3; param string[2] names \"x y\" \"z\"; shader lists l; shader lists k; connect l.out k.any;",
        "shader closures c; shader closures d; connect c.out d.k;",
        "param matrix m 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1; param color s.c 1 2 3; shader shapes s;",
    ]
    .map(|text| text.as_bytes().to_vec())
    .into();
    for path in files("tests/data/groups", &["group", "oslgroup", "txt"]) {
        let Ok(text) = std::fs::read_to_string(path) else { continue };
        seeds.push(text.into_bytes());
    }
    seeds
}

/// A group: if it can be read, it is compiled to one program and run with tight limits.
pub fn group(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let checked = stages::check_group("fuzz.group", &text, "g", &AtHand, &Options::default());
    let codes = || checked.diagnostics.iter().map(|d| d.code.id);
    for d in &checked.diagnostics {
        assert!(d.span.start <= d.span.end && checked.sources.place(d.span).is_some(), "{d:?}");
    }
    let Some(group) = &checked.group else { return outcome(codes()) };
    let Ok(body) = osl_lower::lower_group(group, &[]) else {
        return outcome(codes().chain(["not lowered"]));
    };
    if let Err(wrong) = osl_ir::ir::validate::validate(&body) {
        super::broken(&text, &wrong);
    }
    if body.values.len() > 20_000 {
        return outcome(codes().chain(["large"]));
    }
    let compiled = stages::finish(body, &passes::Options::default());
    let run = osl_exec::run(&compiled.program, laws::services(), &Grid::new(3, 2), &tight(), &|_| ());
    outcome(codes().chain([if run.is_ok() { "ran" } else { "stopped" }]))
}
