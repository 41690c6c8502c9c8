//! Live parameters: a program that is changed gives the results of one compiled with the value.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl::{CompileOptions, Group, Outputs, Points, Program, Shader, Value};
use std::path::Path;

const TEXT: &str = "
    struct pair { float a; color b; };
    shader s(
        int n = 2, float f = 0.5, color c = color(1, 2, 3), matrix m = 2, float list[3] = {1, 2, 3},
        float open[] = {1, 2}, pair p = {4, 5}, string name = \"x\", float computed = f * 2, float other = 1,
        output float o = 0, output color d = 0, output int k = 0)
    {
        for (int i = 0; i < n; i++) o += list[i] * noise(u * f);
        o += open[1] * m[1][1] + computed + other;
        d = c * p.b * p.a;
        k = arraylength(open);
        if (f > 1) o = -o;
    }";

fn shader(text: &str) -> Shader {
    Shader::compile("s.osl", text).unwrap()
}

fn points() -> Points<'static> {
    let count = 300;
    let ramp = |k: f32| -> Vec<f32> { (0..count).map(|i| i as f32 * k).collect() };
    let p: Vec<[f32; 3]> =
        (0..count).map(|i| [i as f32 * 0.1, (i % 7) as f32, (i % 11) as f32 * 0.5]).collect();
    Points::new(count).u(ramp(0.01)).v(ramp(0.003)).p(p).uv_derivs(vec![[0.01, 0.0, 0.0, 0.01]; count])
}

/// All outputs bit by bit; NaNs have no sign.
fn bits(out: &Outputs) -> Vec<(String, Vec<u32>)> {
    let words = |list: Vec<f32>| -> Vec<u32> {
        list.into_iter().map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }).collect()
    };
    let values = |name: &str| {
        let floats = out.floats(name).or_else(|| out.triples(name).map(|t| t.into_flattened()));
        floats.or_else(|| out.matrices(name).map(|m| m.into_flattened())).map(words)
    };
    out.names().into_iter().map(|name| (name.to_string(), values(name).unwrap())).collect()
}

fn run(program: &Program) -> Vec<(String, Vec<u32>)> {
    bits(&program.run(&points()).unwrap())
}

#[test]
fn values_of_all_types_are_set() {
    let s = shader(TEXT);
    let matrix = [3., 0., 0., 0., 0., 7., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let values: [(&str, Value); 9] = [
        ("n", 3.into()),
        ("f", 1.25.into()),
        ("f", 3.into()),
        ("c", [0.5, -1.0, 2.0].into()),
        ("m", matrix.into()),
        ("list", vec![7.0, 8.0, 9.0].into()),
        ("open", vec![7.0, 8.0].into()),
        ("p.b", [1.0, 2.0, 4.0].into()),
        ("p", Value::Struct(vec![("a".into(), 2.5.into()), ("b".into(), 0.5.into())])),
    ];
    let all = ["n", "f", "c", "m", "list", "open", "p"];
    for (name, value) in values {
        let root = name.split('.').next().unwrap();
        for live in [&[name, root][..], &[&all[..], &[name]].concat()] {
            let group = || Group::new().layer("s", &s);
            let mut program = group().compile_with(&CompileOptions::default().live(live)).unwrap();
            assert_eq!(run(&program), run(&group().compile(&[]).unwrap()), "the default of {name}");
            program.set(name, value.clone()).unwrap();
            let expected = group().param(name, value.clone()).compile(&[]).unwrap();
            assert_eq!(run(&program), run(&expected), "{name} = {value:?}");
            let copy = program.clone();
            program
                .set(root, s.params().into_iter().find(|p| p.name == root).unwrap().default.unwrap())
                .unwrap();
            assert_eq!(run(&program), run(&group().compile(&[]).unwrap()), "back to the default of {name}");
            assert_eq!(run(&copy), run(&expected), "copies are independent");
        }
    }
}

#[test]
fn layers_have_live_parameters() {
    let first = shader("shader a(float x = 2, output float o = 0) { o = x * u; }");
    let last = shader("shader b(float i = 0, float x = 3, output float o = 0) { o = i + x; }");
    let group = || Group::new().layer("a", &first).layer("b", &last).connect("a.o", "b.i");
    let mut program =
        group().compile_with(&CompileOptions::outputs(&["o"]).live(&["a.x", "x", "b.i"])).unwrap();
    assert_eq!(program.live().collect::<Vec<_>>(), ["a.x", "x", "b.i"]);
    program.set("a.x", 5.0).unwrap();
    program.set("x", 7.0).unwrap();
    // The connection provides the value.
    program.set("b.i", 100.0).unwrap();
    assert_eq!(program.run(&Points::new(1).u(&[2.0])).unwrap().floats("o"), Some(vec![17.0]));
}

#[test]
fn wrong_live_parameters_are_refused() {
    let s = shader(TEXT);
    let compile = |live: &[&str]| {
        let options = CompileOptions::default().live(live);
        Group::new().layer("s", &s).param("other", 2.0).compile_with(&options)
    };
    let wrong = |live: &str| compile(&[live]).unwrap_err().to_string();
    assert_eq!(wrong("none"), "layer `s`: parameter `none` does not exist");
    assert_eq!(wrong("name"), "layer `s`: parameter `name` cannot be live: it is a string or a closure");
    assert!(wrong("computed").contains("neither a value nor a constant default"));
    let mut program = compile(&["f", "open", "list"]).unwrap();
    let mut set = |name: &str, value: Value| program.set(name, value).unwrap_err().to_string();
    assert_eq!(set("other", 1.0.into()), "the program has no live parameter `other`");
    assert!(set("f", "text".into()).contains("is of type float"));
    assert!(set("open", vec![1.0, 2.0, 3.0].into()).contains("was compiled for 2 elements"));
    assert!(set("list", vec![1.0; 4].into()).contains("is of type float[3]"));
}

/// Another value of the same type.
fn changed(value: &Value) -> Option<Value> {
    let change = |x: &f32| x * 1.25 + 0.125;
    Some(match value {
        Value::Int(n) => Value::Int(n + 1),
        Value::Float(x) => Value::Float(change(x)),
        Value::Triple(x) => Value::Triple(x.map(|x| change(&x))),
        Value::Floats(list) => Value::Floats(list.iter().map(change).collect()),
        _ => return None,
    })
}

#[test]
fn published_shaders_give_the_same_results() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl");
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap().chain(std::fs::read_dir(folder.join("nodes")).unwrap()) {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "osl") {
            continue;
        }
        let name = path.display().to_string();
        let Ok(shader) = Shader::compile(&name, &std::fs::read_to_string(&path).unwrap()) else { continue };
        let params = shader.params().into_iter().filter(|p| !p.output);
        let given: Vec<(String, Value)> =
            params.filter_map(|p| Some((p.name, changed(&p.default?)?))).collect();
        let names: Vec<&str> = given.iter().map(|(name, _)| name.as_str()).collect();
        let group = Group::new().layer("s", &shader);
        let mut live = group.clone().compile_with(&CompileOptions::default().live(&names)).unwrap();
        let mut fixed = group;
        for (name, value) in &given {
            live.set(name, value.clone()).unwrap();
            fixed = fixed.param(name, value.clone());
        }
        assert_eq!(run(&live), run(&fixed.compile(&[]).unwrap()), "{name}");
        count += names.len();
    }
    assert!(count > 80, "{count} parameters");
}

/// The language distinguishes constants from other values in two places.
#[test]
fn live_parameters_are_no_constants() {
    let text = "shader s(float x = 1e-10, output float o = 0, output int known = 0) { o = u / x; known = isconstant(x); }";
    let group = Group::new().layer("s", &shader(text));
    let results = |program: Program| {
        let out = program.run(&Points::new(1).u(&[1e38])).unwrap();
        (out.floats("o").unwrap()[0], out.ints("known").unwrap()[0])
    };
    assert_eq!(results(group.clone().compile(&[]).unwrap()), (f32::INFINITY, 1));
    assert_eq!(results(group.compile_with(&CompileOptions::default().live(&["x"])).unwrap()), (0.0, 0));
}

/// Runs long enough that operations become machine code, which must not keep the first value.
#[test]
fn long_runs_take_new_values() {
    let text =
        "shader s(float x = 2, color c = 3, output color o = 0) { o = sqrt(x * u + c) * (u - x) + x * c; }";
    let group = Group::new().layer("s", &shader(text));
    let mut live = group.clone().compile_with(&CompileOptions::default().live(&["x", "c"])).unwrap();
    let count = 50_000;
    let points = Points::new(count).u((0..count).map(|i| i as f32 * 0.25).collect::<Vec<f32>>());
    for (x, c) in [(2.0, 3.0), (0.5, 1.0), (7.0, 0.125)] {
        live.set("x", x).unwrap();
        live.set("c", c).unwrap();
        let fixed = group.clone().param("x", x).param("c", c).compile(&[]).unwrap();
        let (live, fixed) = (live.run(&points).unwrap(), fixed.run(&points).unwrap());
        assert!(bits(&live) == bits(&fixed), "x = {x}, c = {c}");
    }
}
