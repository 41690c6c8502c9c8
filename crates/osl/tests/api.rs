//! The interface, used as by an embedder.

#![allow(clippy::unwrap_used, missing_docs, reason = "a test says what must hold")]

use osl::{
    Analysis, Arithmetic, Cancel, CompileOptions, Error, ErrorKind, Group, Isa, Length, Levels, Limits,
    MemoryFiles, NoFiles, Points, ReadOptions, Renderer, RendererServices, RunOptions, Severity, Shader,
    Value,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn shader(text: &str) -> Shader {
    Shader::compile("s.osl", text).unwrap()
}

#[test]
fn points_are_the_callers_own() {
    let all = shader(
        "shader s(output point p = P, output normal n = N, output normal g = Ng, output vector t = dPdu, output float w = u + 10 * v,
            output vector i = I, output float when = time, output vector d = Dx(P), output float e = Dy(u)) {}",
    );
    let program = Group::new().layer("s", &all).compile(&[]).unwrap();
    // More than a batch, so that the last batch is not full.
    let count = 5000;
    let triples = |k: f32| -> Vec<[f32; 3]> { (0..count).map(|i| [k, i as f32, k * i as f32]).collect() };
    let floats = |k: f32| -> Vec<f32> { (0..count).map(|i| k * i as f32).collect() };
    let (p, n, i, dx) = (triples(1.0), triples(2.0), triples(3.0), triples(4.0));
    let derivs: Vec<[f32; 4]> = (0..count).map(|i| [0.0, i as f32, 0.0, 0.0]).collect();
    let points = Points::new(count).p(&p).n(&n).i(&i).u(floats(1.0)).v(floats(2.0)).time(floats(0.5));
    let points = points.p_derivs(&dx, vec![[0.0; 3]; count]).uv_derivs(&derivs);
    let out = program.run(&points).unwrap();
    assert_eq!(out.names(), ["p", "n", "g", "t", "w", "i", "when", "d", "e"]);
    assert_eq!(out.triples("p"), Some(p));
    assert_eq!(out.triples("n"), Some(n.clone()));
    assert_eq!(out.triples("g"), Some(n), "the geometric normal is the shading one if it is not given");
    assert_eq!(out.triples("t"), Some(vec![[1.0, 0.0, 0.0]; count]));
    assert_eq!(out.triples("i"), Some(i));
    assert_eq!(out.triples("d"), Some(dx));
    assert_eq!(out.floats("w"), Some(floats(21.0)));
    assert_eq!(out.floats("when"), Some(floats(0.5)));
    assert_eq!(out.floats("e"), Some(floats(1.0)));
    assert_eq!((out.floats("p"), out.triples("w"), out.floats("none")), (None, None, None));

    let error = program.run(&Points::new(3).u(&[1.0])).unwrap_err();
    assert_eq!(error.to_string(), "there are 3 points, but 1 values of u");
    assert_eq!(program.run(&Points::new(0)).unwrap().floats("w"), Some(vec![]));
}

#[test]
fn normals_of_positions_are_on_the_side_of_the_normal() {
    let text = "shader s(output normal n = 0) { n = calculatenormal(P); }";
    let program = Group::new().layer("s", &shader(text)).compile(&[]).unwrap();
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let of = |points: Points| program.run(&points).unwrap().triples("n").unwrap();
    // The second point is left-handed; the third has no area.
    let derivs = Points::new(3).p_derivs(vec![x, y, x], vec![y, x, x]);
    assert_eq!(of(derivs.clone()), [z, z, [0.0; 3]]);
    let below = [0.0, 0.0, -1.0];
    assert_eq!(of(derivs.n(&[below; 3])), [below, below, [0.0; 3]]);
    assert_eq!(of(Points::new(1)), [[0.0; 3]]);
}

#[test]
fn values_of_all_types_reach_their_parameters() {
    let all = shader(
        "struct pair { float a; int b; };
         shader s(int i = 0, float f = 0, float g = 0, color c = 0, matrix m = 0, string s = \"\", int is[2] = {0, 0},
            float fs[] = {0}, color cs[2] = {0, 0}, string ss[2] = {\"\", \"\"}, pair p = {0, 0}, vector d = 0) {
            printf(\"%d %g %g | %g | %g | %s | %d %d | %d %g | %g %g | %s %s | %g %d | %g\",
                i, f, g, c, m[3][0], s, is[0], is[1], arraylength(fs), fs[2], cs[0], cs[1], ss[0], ss[1], p.a, p.b, d);
         }",
    );
    let mut matrix = [0.0; 16];
    matrix[12] = 7.5;
    let program = Group::new()
        .layer("s", &all)
        .param("i", 4)
        .param("f", 0.1)
        .param("g", 3)
        .param("c", [1.0, 2.0, 3.0])
        .param("m", matrix)
        .param("s", "a, b \"c\"")
        .param("is", Value::Ints(vec![5, 6]))
        .param("fs", Value::Floats(vec![1.0, 2.0, 3.5]))
        .param("cs", Value::Triples(vec![[1.0; 3], [2.0; 3]]))
        .param("ss", Value::Strings(vec!["x,y".into(), "z".into()]))
        .param("p.b", 8)
        .param("d", 9.0)
        .compile(&[])
        .unwrap();
    let said = program.run(&Points::new(1)).unwrap().printed();
    let expected = "4 0.1 3 | 1 2 3 | 7.5 | a, b \"c\" | 5 6 | 3 3.5 | 1 1 1 2 2 2 | x,y z | 0 8 | 9 9 9";
    assert_eq!(said, expected);
}

#[test]
fn only_what_is_asked_for_is_computed() {
    let speaker = shader("shader a(output float x = 1, output float y = 2) { printf(\"spoke\"); x = u; }");
    let sink = shader("shader b(float x = 0, output float o = 0, output color c = 0) { o = 2 * x; }");
    let group = |outputs: &[&str]| -> Result<osl::Program, Error> {
        Group::new().layer("a", &speaker).layer("b", &sink).connect("a.x", "b.x").compile(outputs)
    };
    let points = Points::new(2).u(&[0.5, 1.0]);
    let out = group(&["o", "a.y"]).unwrap().run(&points).unwrap();
    assert_eq!(out.names(), ["a.y", "o"], "layer by layer");
    assert_eq!((out.floats("o"), out.floats("a.y")), (Some(vec![1.0, 2.0]), Some(vec![2.0, 2.0])));
    let wrong = |outputs: &[&str]| group(outputs).unwrap_err().to_string();
    assert_eq!(wrong(&["x"]), "layer `b` has no output `x`");
    assert_eq!(wrong(&["a.o"]), "layer `a` has no output `o`");
}

#[test]
fn what_is_wrong_is_told() {
    let error = Shader::compile("s.osl", "shader s() {\n  float x = 1 + ;\n}").unwrap_err();
    let first = &error.diagnostics()[0];
    assert_eq!((first.line_column().0, first.is_error()), (2, true));
    assert_eq!(first.range.as_ref().unwrap().file, "s.osl");
    assert_eq!(error.kind(), ErrorKind::Source);
    assert!(error.to_string().contains("float x = 1 + ;"), "{error}");

    let good = shader("shader s(float x = 0, output float o = 0) {}");
    let said = |builder: osl::Group| builder.compile(&[]).unwrap_err().to_string();
    assert_eq!(said(Group::new()), "the group has no layers");
    assert!(said(Group::new().param("x", 1.0)).contains("add one first"));
    let one = || Group::new().layer("a", &good);
    assert!(said(one().layer("a", &good)).contains("the name is taken"));
    assert!(said(one().param("y", 1.0)).contains("no parameter `y`"));
    assert!(said(one().param("x", "text")).contains("parameter `x` is of type float"));
    assert!(said(one().connect("a", "b.x")).contains("LAYER.PARAMETER"));
    assert!(said(one().connect("a.o", "b.x")).contains("no layer `b`"));
    assert!(said(one().layer("b", &good).connect("b.o", "a.x")).contains("does not come before"));
    let endless = shader("shader s(output float o = 0) { while (u < 1) o += 1; }");
    let program = Group::new().layer("s", &endless).compile(&[]).unwrap();
    let error = program.run(&Points::new(1)).unwrap_err();
    assert!(error.to_string().contains("takes more than"));
    assert_eq!((error.kind(), error.range().unwrap().start.column), (ErrorKind::Run, 32), "the loop");
}

#[test]
fn includes_and_descriptions() {
    let text =
        "#include \"half.h\"\nshader s(float x = HALF, color c[2] = {0, 0}, output float o = 0) { o = x; }";
    assert!(Shader::compile("s.osl", text).is_err());
    let files = MemoryFiles::new().with("half.h", "#define HALF 0.5\n");
    let found = Shader::read("s.osl", text, &files, &ReadOptions::default()).unwrap();
    let params: Vec<_> = found.params().into_iter().map(|p| (p.name, p.ty.to_string(), p.output)).collect();
    let expected = [("x", "float", false), ("c", "color[2]", false), ("o", "float", true)];
    assert_eq!(params, expected.map(|(n, t, o)| (n.to_string(), t.to_string(), o)));
    assert_eq!((found.name(), found.warnings().len()), ("s", 0));
    assert_eq!(shader("float f() { return 1; }\n}\nshader q() {}").warnings()[0].line_column().0, 2);
}

struct Scene;

impl RendererServices for Scene {
    fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
        match (object, name) {
            ("", "index") => Some(Value::Int(point as i32)),
            ("lamp", "watts") => Some(Value::Floats(vec![40.0, 60.0])),
            _ => None,
        }
    }

    fn user_data(&self, name: &str, point: usize) -> Option<Value> {
        (name == "amp").then_some(Value::Float(point as f32 + 0.5))
    }

    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let scale = |s: f32| [s, 0., 0., 0., 0., s, 0., 0., 0., 0., s, 0., 0., 0., 0., 1.];
        match space {
            "double" => Some(scale(2.0)),
            "object" => Some(scale(4.0)),
            _ => None,
        }
    }

    fn texture_folders(&self) -> Vec<PathBuf> {
        vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/textures")]
    }

    fn ray_type(&self) -> String {
        "shadow".to_string()
    }
}

#[test]
fn services_answer() {
    let asks = shader(
        "shader s(float amp = 1 [[ int lockgeom = 0 ]], float other = 1, output float a = amp, output float b = other,
            output int index = -1, output float watts = 0, output point d = 0, output point o = 0, output point c = 0,
            output int shadow = 0, output color t = 0) {
            getattribute(\"index\", index);
            getattribute(\"lamp\", \"watts\", 1, watts);
            d = transform(\"double\", P);
            o = transform(\"object\", \"double\", P);
            c = transform(\"shader\", P);
            shadow = raytype(\"shadow\");
            t = texture(\"tex64.png\", u, v);
         }",
    );
    let program = Group::new().layer("s", &asks).interpolate("other").compile(&[]).unwrap();
    let points = Points::new(3).p(&[[8.0, 0.0, 0.0]; 3]).u(&[0.5; 3]).v(&[0.5; 3]);
    let renderer = Renderer::new(Scene);
    for _ in 0..2 {
        let out = program.run_with(&points, &renderer, &RunOptions::default()).unwrap();
        assert!(out.messages().is_empty(), "{:?}", out.messages());
        assert_eq!(out.floats("a"), Some(vec![0.5, 1.5, 2.5]));
        assert_eq!(out.floats("b"), Some(vec![1.0; 3]));
        assert_eq!(out.ints("index"), Some(vec![0, 1, 2]));
        assert_eq!(out.floats("watts"), Some(vec![60.0; 3]));
        assert_eq!(out.triples("d"), Some(vec![[4.0, 0.0, 0.0]; 3]));
        assert_eq!(out.triples("o"), Some(vec![[16.0, 0.0, 0.0]; 3]));
        assert_eq!(out.triples("c"), Some(vec![[8.0, 0.0, 0.0]; 3]));
        assert_eq!(out.ints("shadow"), Some(vec![1; 3]));
        assert!(out.triples("t").unwrap()[0].iter().any(|x| *x > 0.0));
    }
    let alone = program.run(&points).unwrap();
    assert_eq!(alone.ints("index"), Some(vec![-1; 3]));
    assert!(alone.messages().iter().any(|m| m.error && m.text.contains("double")), "{:?}", alone.messages());
}

/// Closures with any name are returned as data.
#[test]
fn closures_are_data() {
    let text = "closure color fuzz(normal n, float a) [[ int builtin = 1 ]];
        surface s(output closure color other = 0, output float r = 0)
        {
            float list[2] = { 1, u };
            Ci = color(u, 1, 0) * fuzz(N, 2, \"list\", list, \"base\", diffuse(N)) + emission();
            r = u;
        }";
    let shader = Shader::compile("s.osl", text).unwrap();
    let program = Group::new().layer("s", &shader).compile(&["Ci", "r"]).unwrap();
    let outputs = program.run(&Points::new(2).u(&[0.0, 0.5])).unwrap();
    let closures = outputs.closures("Ci").unwrap();
    let point: Vec<_> = closures.at(1).collect();
    assert_eq!((closures.len(), point.len()), (2, 2));
    let (fuzz, emission) = (&point[0], &point[1]);
    assert_eq!((fuzz.name(), fuzz.weight()), ("fuzz", [0.5, 1.0, 0.0]));
    let kinds = closures.kinds();
    assert_eq!((emission.name(), kinds[emission.kind()].params.len()), ("emission", 0));
    let params = &kinds[fuzz.kind()].params;
    let keys: Vec<Option<&str>> = params.iter().map(|p| p.key.as_deref()).collect();
    assert_eq!(keys, [None, None, Some("list"), Some("base")]);
    let types: Vec<String> = params.iter().map(|p| p.ty.to_string()).collect();
    assert_eq!(types, ["vector", "float", "float[2]", "closure color"]);
    assert_eq!((fuzz.triple(0), fuzz.float(1)), (Some([0.0, 0.0, 1.0]), Some(2.0)));
    assert_eq!((fuzz.float(0), fuzz.triple(1), fuzz.value(9)), (None, None, None));
    assert_eq!(fuzz.value(2), Some(Value::Floats(vec![1.0, 0.5])));
    assert_eq!(fuzz.closure(3).map(|inner| inner.name()).collect::<Vec<_>>(), ["diffuse"]);
    assert!(fuzz.closure(1).next().is_none() && closures.at(2).next().is_none());
    assert!(outputs.closures("other").is_none());
    // No output is named, so closures are not computed.
    let all = Group::new().layer("s", &shader).compile(&[]).unwrap();
    let outputs = all.run(&Points::new(2).u(&[0.0, 0.5])).unwrap();
    assert!(outputs.names() == ["r"] && outputs.closures("Ci").is_none());
}

#[test]
fn limits_are_handed_on() {
    let text =
        "shader s(string f = \"\", output float o = 0) { for (int i = 0; i < 100; i++) o += sin(u * i); }";
    let limited = |set: fn(&mut Limits)| {
        let mut limits = Limits::default();
        set(&mut limits);
        limits
    };
    let few = limited(|limits| limits.reading.tokens = 5);
    let wrong = Shader::read("s.osl", text, &NoFiles, &ReadOptions::default().limits(&few)).unwrap_err();
    assert_eq!(wrong.diagnostics()[0].code, "E0016");
    let compile = |limits: &Limits| {
        Group::new().limits(limits).layer("a", &shader(text)).layer("b", &shader(text)).compile(&["o"])
    };
    assert!(compile(&Limits::default()).is_ok());
    assert!(compile(&limited(|limits| limits.reading.layers = 1)).is_err());
    assert!(compile(&limited(|limits| limits.compiling.values = 5)).is_err());
    let program = compile(&limited(|limits| limits.running.point_steps = 100)).unwrap();
    let stopped = program.run(&Points::new(2).u(&[0.5, 1.0])).unwrap_err();
    assert!(stopped.to_string().contains("takes more than"), "{stopped}");
    // The order to stop reaches a program through any copy.
    let limits = Limits::default();
    let program = compile(&limits).unwrap();
    limits.halt(osl::Halt::Time);
    assert!(program.run(&Points::new(2).u(&[0.5, 1.0])).is_err());
}

#[test]
fn textures_have_limits() {
    struct Files;
    impl RendererServices for Files {
        fn texture_folders(&self) -> Vec<PathBuf> {
            vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/textures")]
        }
    }
    let look = shader("shader s(output color c = 0) { c = (color)texture(\"tex64.png\", 0.25, 0.25); }");
    let program = Group::new().layer("s", &look).compile(&["c"]).unwrap();
    let messages = |limits: &Limits| {
        let out = program
            .run_with(&Points::new(1), &Renderer::within(Files, limits), &RunOptions::default())
            .unwrap();
        out.messages().to_vec()
    };
    assert!(messages(&Limits::default()).is_empty());
    let mut limits = Limits::default();
    limits.images.samples = 1;
    let said = messages(&limits);
    assert!(said.iter().any(|m| m.text.contains("images.samples")), "{said:?}");
}
#[test]
fn parameters_have_types_defaults_and_metadata() {
    let text = "struct pair { float a; int b[2]; };
        surface s [[ string help = \"Text\" ]] (
            int i = 2, float f = 3, color c = 0.5, point p = point(1, 2, 3), matrix m = 1, string s = \"x\",
            float fs[3] = {1, 2}, string ss[] = {\"a\", \"b\"}, pair q = {1.5, {4, 5}},
            closure color ks[2] = {0, 0}, closure color k = 0, float computed = f * 2,
            float g = 1 [[ float min = 0, int steps[2] = {1, 2}, string names[2] = {\"a\", \"b\"}, color c = 1 ]]
        ) {}";
    let shader = shader(text);
    assert_eq!((shader.kind(), shader.metadata()[0].value.clone()), ("surface", Some("Text".into())));
    let params = shader.params();
    let find = |name: &str| params.iter().find(|p| p.name == name).unwrap();
    let default = |name: &str| find(name).default.clone();
    let one = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let pair = |a: f32, b: [i32; 2]| {
        Value::Struct(vec![("a".into(), a.into()), ("b".into(), Value::Ints(b.to_vec()))])
    };
    for (name, expected) in [
        ("i", Some(2.into())),
        ("f", Some(3.0.into())),
        ("c", Some([0.5; 3].into())),
        ("p", Some([1.0, 2.0, 3.0].into())),
        ("m", Some(one.into())),
        ("s", Some("x".into())),
        ("fs", Some(vec![1.0, 2.0, 0.0].into())),
        ("ss", Some(vec!["a".to_string(), "b".to_string()].into())),
        ("q", Some(pair(1.5, [4, 5]))),
        ("ks", Some(Value::List(vec![Value::NullClosure, Value::NullClosure]))),
        ("k", Some(Value::NullClosure)),
        ("computed", None),
    ] {
        assert_eq!(default(name), expected, "{name}");
    }
    assert_eq!((find("ss").ty.length, find("fs").ty.length), (Length::Open, Length::Array(3)));
    let osl::Base::Struct(of) = &find("q").ty.base else { panic!("a struct") };
    assert_eq!((of.name.as_str(), of.fields[1].1.to_string()), ("pair", "int[2]".to_string()));
    assert_eq!(find("g").metadatum("min"), Some(&0.0.into()));
    assert_eq!(find("g").metadatum("steps"), Some(&Value::Ints(vec![1, 2])));
    assert_eq!(find("g").metadatum("c"), Some(&[1.0; 3].into()));
    // A default can be given back.
    let program = Group::new().layer("s", &shader).param("q", default("q").unwrap()).compile(&[]);
    assert!(program.is_ok(), "{program:?}");
}

#[test]
fn options_of_a_run_do_not_change_its_results() {
    let text = "shader s(output float o = 0) { o = sin(u) / noise(u * 100); }";
    let program = Group::new().layer("s", &shader(text)).compile(&["o"]).unwrap();
    let points = Points::new(10_000).u((0..10_000).map(|i| i as f32 / 100.0).collect::<Vec<f32>>());
    let run = |options: &RunOptions| program.run_with(&points, &Renderer::default(), options);
    let expected = run(&RunOptions::default()).unwrap().floats("o");
    assert_eq!(run(&RunOptions::default().threads(1)).unwrap().floats("o"), expected);
    for isa in Isa::all() {
        let options = RunOptions::default().instruction_set(isa).threads(2);
        assert_eq!(run(&options).unwrap().floats("o"), expected, "{isa:?}");
    }
    let most = Arc::new(AtomicUsize::new(0));
    let seen = most.clone();
    let options = RunOptions::default().progress(move |done| {
        seen.fetch_max(done, Ordering::Relaxed);
    });
    run(&options).unwrap();
    assert_eq!(most.load(Ordering::Relaxed), 10_000);
    let cancel = Cancel::new();
    let options = RunOptions::default().cancel(&cancel);
    assert!(run(&options).is_ok());
    cancel.cancel();
    assert_eq!(run(&options).unwrap_err().kind(), ErrorKind::Cancelled);
    assert!(run(&RunOptions::default()).is_ok(), "only that run was cancelled");
}

#[test]
fn programs_compute_in_the_requested_arithmetic() {
    let group = Group::new().layer("s", &shader("shader s(output float o = 0) { o = u / 3; }"));
    let options = CompileOptions::outputs(&["o"]).arithmetic(Arithmetic::Double);
    let program = group.compile_with(&options).unwrap();
    assert_eq!(program.arithmetic(), Arithmetic::Double);
    let out = program.run(&Points::new(1).u(&[1.0])).unwrap();
    assert_eq!(out.doubles("o"), Some(vec![1.0 / 3.0]));
    assert_eq!(out.floats("o"), Some(vec![1.0 / 3.0]));
}

#[test]
fn an_analysis_has_positions_fixes_and_levels() {
    let text = "// \u{1f600}\nshader s(output float o = 0) {\n  /* \u{1f600} */ float unused = 1;\n  o = 1 / 2;\n}\n";
    let analysis = Analysis::of("s.osl", text, &NoFiles, &ReadOptions::default());
    let found = analysis.diagnostics(&Levels::default());
    let unused = found.iter().find(|d| d.name == "unused-variable").unwrap();
    let start = unused.range.as_ref().unwrap().start;
    assert_eq!((start.line, start.column, start.utf16), (3, 17, 17));
    assert_eq!(&text[start.offset..start.offset + 6], "unused");
    let fixed = unused.fixes[0].apply("s.osl", text).unwrap();
    assert!(!fixed.contains("unused"), "{fixed}");
    let levels = Levels::default().deny("integer-division").allow("all");
    let found = analysis.diagnostics(&levels);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].code, found[0].severity), ("W0312", Severity::Error));
    assert_eq!(osl::check_warning("unknown-name"), Err(osl::NoWarning::IsError));
    assert_eq!(analysis.files().next(), Some(("s.osl", text)));
    assert!(!analysis.has_errors());
}

/// Textures and documents in memory.
struct InMemory(Arc<MemoryFiles>);

impl RendererServices for InMemory {
    fn files(&self) -> Option<Arc<dyn osl::Files>> {
        Some(self.0.clone())
    }
}

#[test]
fn textures_and_documents_come_from_memory() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/textures");
    let picture = std::fs::read(folder.join("tex64.png")).unwrap();
    let files = MemoryFiles::new().with("given.png", &picture).with("tile.1001.png", &picture);
    let files = files.with("given.xml", "<a n=\"7\"/>");
    let text = "shader s(string name = \"\", output color c = 0, output float tile = 0, output int n = 0, output int none = 1) {
        c = (color)texture(name, u, v);
        tile = texture(\"tile.<UDIM>.png\", u, v);
        int found = dict_find(\"given.xml\", \"a\");
        dict_value(found, \"n\", n);
        gettextureinfo(\"tex64.png\", \"exists\", none);
    }";
    let shader = shader(text);
    let program = |name: &str| Group::new().layer("s", &shader).param("name", name).compile(&[]).unwrap();
    let points = Points::new(2).u(&[0.25, 0.75]).v(&[0.25, 0.5]);
    let memory = Renderer::new(InMemory(Arc::new(files)));
    let given = program("given.png").run_with(&points, &memory, &RunOptions::default()).unwrap();
    assert!(given.messages().is_empty(), "{:?}", given.messages());
    let disk = program("tex64.png").run_with(&points, &Renderer::new(Scene), &RunOptions::default()).unwrap();
    assert_eq!(given.triples("c"), disk.triples("c"));
    assert!(given.floats("tile").unwrap()[0] > 0.0);
    assert_eq!((given.ints("n"), given.ints("none")), (Some(vec![7; 2]), Some(vec![0; 2])));
}

#[test]
fn an_editor_gets_symbols_of_texts_with_errors() {
    let text = "/* \u{1f600} */ shader s(float size = 1, output float o = 0) {\n  o = size * nothing + v;\n";
    let analysis = Analysis::of("s.osl", text, &NoFiles, &ReadOptions::default());
    assert!(analysis.has_errors());
    let symbols = analysis.symbols();
    // Positions as an editor counts them: the smiley has two units.
    let at = analysis.offset(1, 6).unwrap();
    let size = symbols.at(at).unwrap();
    assert_eq!((size.name.as_str(), size.kind), ("size", osl::SymbolKind::Parameter));
    let declared = size.declared.as_ref().unwrap().start;
    assert_eq!((declared.line, declared.utf16), (1, 24));
    assert_eq!(analysis.offset(0, 24), Some(declared.offset));
    assert_eq!(analysis.offset(1, 1000), Some(text.trim_end().len()));
    assert_eq!(analysis.offset(5, 0), None);
    assert_eq!(symbols.type_at(text.find("v;").unwrap()).as_deref(), Some("float"));
    assert_eq!(symbols.list().last().unwrap().name, "v");
}

#[test]
fn components_are_read_without_copies() {
    let text = "shader s(output color c = color(u, 2, 3), output int n = 1) {}";
    let program = Group::new().layer("s", &shader(text)).compile(&[]).unwrap();
    let out = program.run(&Points::new(2).u(&[0.5, 1.0])).unwrap();
    assert_eq!(out.component("c", 0), Some(&[0.5, 1.0][..]));
    assert_eq!(out.component("c", 2), Some(&[3.0; 2][..]));
    assert_eq!((out.component("c", 3), out.component("n", 0)), (None, None));
}

#[test]
fn serialized_groups_are_read_from_memory() {
    let files = MemoryFiles::new().with("a.osl", "shader a(float x = 1, output float o = 0) { o = x * u; }");
    let read = |text: &str| Group::read("g.group", text, &files, &ReadOptions::default());
    let group = read("param float x 2; shader a first; shader a second; connect first.o second.x;").unwrap();
    let out = group.compile(&["o"]).unwrap().run(&Points::new(1).u(&[3.0])).unwrap();
    assert_eq!(out.floats("o"), Some(vec![18.0]));
    let error = read("shader b first;").unwrap_err();
    assert_eq!((error.kind(), error.diagnostics()[0].line_column()), (ErrorKind::Source, (1, 8)));
}
