//! The interface, used as by an embedder.

#![allow(clippy::unwrap_used, missing_docs, reason = "a test says what must hold")]

use osl::{Error, Group, Limits, Points, Renderer, RendererServices, Shader, Value};
use std::path::{Path, PathBuf};

fn shader(text: &str) -> Shader {
    Shader::compile("s.osl", text).unwrap()
}

#[test]
fn points_are_the_callers_own() {
    let all = shader(
        "shader s(output point p = P, output normal n = N, output normal g = Ng, output vector t = dPdu, output float w = u + 10 * v,
            output vector i = I, output float when = time, output vector d = Dx(P), output float e = Dy(u)) {}",
    );
    let program = Group::builder().layer("s", &all).compile(&[]).unwrap();
    // More than a batch, so that the last batch is not full.
    let count = 5000;
    let triples = |k: f32| -> Vec<[f32; 3]> { (0..count).map(|i| [k, i as f32, k * i as f32]).collect() };
    let floats = |k: f32| -> Vec<f32> { (0..count).map(|i| k * i as f32).collect() };
    let (p, n, i, dx) = (triples(1.0), triples(2.0), triples(3.0), triples(4.0));
    let slopes: Vec<[f32; 4]> = (0..count).map(|i| [0.0, i as f32, 0.0, 0.0]).collect();
    let points = Points::new(count).p(&p).n(&n).i(&i).u(floats(1.0)).v(floats(2.0)).time(floats(0.5));
    let points = points.p_slopes(&dx, &vec![[0.0; 3]; count]).uv_slopes(&slopes);
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

    let error = program.run(&Points::new(3).u([1.0])).unwrap_err();
    assert_eq!(error.to_string(), "there are 3 points, but 1 values of U");
    assert_eq!(program.run(&Points::new(0)).unwrap().floats("w"), Some(vec![]));
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
    let program = Group::builder()
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
        Group::builder().layer("a", &speaker).layer("b", &sink).connect("a.x", "b.x").compile(outputs)
    };
    let points = Points::new(2).u([0.5, 1.0]);
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
    assert_eq!((first.file.as_str(), first.line, first.error), ("s.osl", 2, true));
    assert!(error.to_string().contains("float x = 1 + ;"), "{error}");

    let good = shader("shader s(float x = 0, output float o = 0) {}");
    let said = |builder: osl::GroupBuilder| builder.compile(&[]).unwrap_err().to_string();
    assert_eq!(said(Group::builder()), "the group has no layers");
    assert!(said(Group::builder().param("x", 1.0)).contains("add one first"));
    let one = || Group::builder().layer("a", &good);
    assert!(said(one().layer("a", &good)).contains("the name is taken"));
    assert!(said(one().param("y", 1.0)).contains("no parameter `y`"));
    assert!(said(one().param("x", "text")).contains("parameter `x` is of type float"));
    assert!(said(one().connect("a", "b.x")).contains("LAYER.PARAMETER"));
    assert!(said(one().connect("a.o", "b.x")).contains("no layer `b`"));
    assert!(said(one().layer("b", &good).connect("b.o", "a.x")).contains("does not come before"));
    let endless = shader("shader s(output float o = 0) { while (u < 1) o += 1; }");
    let program = Group::builder().layer("s", &endless).compile(&[]).unwrap();
    assert!(program.run(&Points::new(1)).unwrap_err().to_string().contains("takes more than"));
}

#[test]
fn includes_and_descriptions() {
    let text =
        "#include \"half.h\"\nshader s(float x = HALF, color c[2] = {0, 0}, output float o = 0) { o = x; }";
    assert!(Shader::compile("s.osl", text).is_err());
    let include = |name: &str| (name == "half.h").then(|| "#define HALF 0.5\n".to_string());
    let found = Shader::compile_with("s.osl", text, include).unwrap();
    let params: Vec<_> = found.params().into_iter().map(|p| (p.name, p.ty, p.output)).collect();
    let expected = [("x", "float", false), ("c", "color[2]", false), ("o", "float", true)];
    assert_eq!(params, expected.map(|(n, t, o)| (n.to_string(), t.to_string(), o)));
    assert_eq!((found.name(), found.warnings().len()), ("s", 0));
    assert_eq!(shader("float f() { return 1; }\n}\nshader q() {}").warnings()[0].line, 2);
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
    let program = Group::builder().layer("s", &asks).interpolate("other").compile(&[]).unwrap();
    let points = Points::new(3).p(&[[8.0, 0.0, 0.0]; 3]).u([0.5; 3]).v([0.5; 3]);
    let renderer = Renderer::new(Scene);
    for _ in 0..2 {
        let out = program.run_with(&points, &renderer).unwrap();
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
    let program = Group::builder().layer("s", &shader).compile(&["Ci", "r"]).unwrap();
    let outputs = program.run(&Points::new(2).u([0.0, 0.5])).unwrap();
    let points = outputs.closures("Ci").unwrap();
    assert_eq!((points.len(), points[1].len()), (2, 2));
    let (fuzz, emission) = (&points[1][0], &points[1][1]);
    assert_eq!((fuzz.name.as_str(), fuzz.weight), ("fuzz", [0.5, 1.0, 0.0]));
    assert_eq!((emission.name.as_str(), emission.arguments.len()), ("emission", 0));
    let keys: Vec<Option<&str>> = fuzz.arguments.iter().map(|a| a.key.as_deref()).collect();
    assert_eq!(keys, [None, None, Some("list"), Some("base")]);
    assert_eq!(fuzz.arguments[1].value, Some(Value::Float(2.0)));
    assert_eq!(fuzz.arguments[2].value, Some(Value::Floats(vec![1.0, 0.5])));
    assert_eq!(fuzz.arguments[3].closure[0].name, "diffuse");
    assert!(outputs.closures("other").is_none());
    // No output is named, so closures are not computed.
    let all = Group::builder().layer("s", &shader).compile(&[]).unwrap();
    let outputs = all.run(&Points::new(2).u([0.0, 0.5])).unwrap();
    assert_eq!((outputs.names(), outputs.closures("Ci")), (vec!["r"], None));
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
    let wrong = Shader::compile_within("s.osl", text, |_| None, &few).unwrap_err();
    assert_eq!(wrong.diagnostics()[0].code, "E0016");
    let compile = |limits: &Limits| {
        Group::builder().limits(limits).layer("a", &shader(text)).layer("b", &shader(text)).compile(&["o"])
    };
    assert!(compile(&Limits::default()).is_ok());
    assert!(compile(&limited(|limits| limits.reading.layers = 1)).is_err());
    assert!(compile(&limited(|limits| limits.compiling.values = 5)).is_err());
    let program = compile(&limited(|limits| limits.running.point_steps = 100)).unwrap();
    let stopped = program.run(&Points::new(2).u([0.5, 1.0])).unwrap_err();
    assert!(stopped.to_string().contains("takes more than"), "{stopped}");
    // The order to stop reaches a program through any copy.
    let limits = Limits::default();
    let program = compile(&limits).unwrap();
    limits.halt(osl::Halt::Time);
    assert!(program.run(&Points::new(2).u([0.5, 1.0])).is_err());
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
    let program = Group::builder().layer("s", &look).compile(&["c"]).unwrap();
    let messages = |limits: &Limits| {
        let out = program.run_with(&Points::new(1), &Renderer::within(Files, limits)).unwrap();
        out.messages().to_vec()
    };
    assert!(messages(&Limits::default()).is_empty());
    let mut limits = Limits::default();
    limits.images.samples = 1;
    let said = messages(&limits);
    assert!(said.iter().any(|m| m.text.contains("images.samples")), "{said:?}");
}
