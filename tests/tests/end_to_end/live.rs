//! Generated programs give the same results with live parameters as with values that are compiled in.

use osl::stages::{self, NoFiles, Options, ParamValues};
use osl::{CompileOptions, Group, Outputs, Points, Shader, Value};
use osl_lower::params;
use osl_tests::{generate, laws};

/// Another value of the same type.
fn changed(value: &Value) -> Option<Value> {
    let change = |x: f32| x * 0.75 - 0.25;
    Some(match value {
        Value::Int(n) => Value::Int(n.wrapping_add(3)),
        Value::Float(x) => Value::Float(change(*x)),
        Value::Triple(x) => Value::Triple(x.map(change)),
        Value::Matrix(x) => Value::Matrix(x.map(change)),
        Value::Ints(list) => Value::Ints(list.iter().map(|n| n.wrapping_sub(1)).collect()),
        Value::Floats(list) => Value::Floats(list.iter().map(|x| change(*x)).collect()),
        Value::Triples(list) => Value::Triples(list.iter().map(|x| x.map(change)).collect()),
        Value::Struct(fields) => Value::Struct(
            fields
                .iter()
                .map(|(name, value)| Some((name.clone(), changed(value)?)))
                .collect::<Option<_>>()?,
        ),
        _ => return None,
    })
}

/// All values and printed texts. NaNs have no sign.
fn shown(out: &Outputs) -> String {
    let mut text = out.printed().replace("-nan", "nan");
    for name in out.names() {
        let floats = out.floats(name).or_else(|| out.triples(name).map(|t| t.into_flattened()));
        let floats = floats.or_else(|| out.matrices(name).map(|m| m.into_flattened())).unwrap();
        let bits: Vec<u32> =
            floats.into_iter().map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }).collect();
        text += &format!("{name}: {bits:08x?}\n");
    }
    text
}

#[test]
fn generated_programs_give_the_same_results() {
    let points = Points::new(40).u((0..40).map(|i| i as f32 / 40.0).collect::<Vec<f32>>());
    let points = points.uv_derivs(&[[0.025, 0.0, 0.0, 0.1]; 40]);
    let mut params = 0;
    for seed in 0..250 {
        let text = generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100));
        // The language distinguishes a quotient by a constant from other quotients, see `isconstant` as well.
        let text = text.replace(" / ", " * ").replace(" /= ", " *= ");
        if text.contains("isconstant") {
            continue;
        }
        let Ok(shader) = Shader::compile("generated.osl", &text) else { continue };
        let given: Vec<(String, Value)> = shader
            .params()
            .into_iter()
            .filter(|p| !p.output)
            .filter_map(|p| Some((p.name, changed(&p.default?)?)))
            .collect();
        let names: Vec<&str> = given.iter().map(|(name, _)| name.as_str()).collect();
        let group = Group::new().layer("s", &shader);
        let Ok(mut live) = group.clone().compile_with(&CompileOptions::default().live(&names)) else {
            continue;
        };
        let mut fixed = group;
        for (name, value) in &given {
            live.set(name, value.clone()).unwrap();
            fixed = fixed.param(name, value.clone());
        }
        let run = |program: &osl::Program| program.run(&points).map(|out| shown(&out));
        let (live, fixed) = (run(&live), run(&fixed.compile(&[]).unwrap()));
        // Folding changes the number of steps, so a limit may be reached by one of them only.
        if let (Ok(live), Ok(fixed)) = (live, fixed) {
            assert!(live == fixed, "seed {seed}, {given:?}\n{text}\n live {live}\nfixed {fixed}");
            params += names.len();
        }
    }
    assert!(params > 50, "{params} parameters");
}

/// The numbers of a value as text.
fn words(value: &Value) -> Option<String> {
    fn joined<T: ToString>(list: &[T]) -> Option<String> {
        Some(list.iter().map(ToString::to_string).collect::<Vec<String>>().join(","))
    }
    match value {
        Value::Int(n) => joined(&[*n]),
        Value::Float(x) => joined(&[*x]),
        Value::Triple(x) => joined(x),
        Value::Matrix(x) => joined(x),
        Value::Ints(list) => joined(list),
        Value::Floats(list) => joined(list),
        Value::Triples(list) => joined(list.as_flattened()),
        _ => None,
    }
}

#[test]
fn all_ways_to_run_agree_on_live_parameters() {
    let ways = laws::ways();
    let mut inputs = 0;
    for seed in 0..80 {
        let text = generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100));
        let checked = stages::check("generated.osl", &text, &NoFiles, &Options::default());
        let Some(program) = checked.program else { continue };
        let mut values = ParamValues::default();
        for param in stages::params(&program) {
            let given = param.default.as_ref().and_then(changed).and_then(|value| words(&value));
            if let Some(given) = given.filter(|_| !param.output) {
                params::set(&program, &mut values, &param.name, &given).unwrap();
                values.make_live(&param.name);
            }
        }
        let Ok(body) = osl_lower::lower(&program, &values) else { continue };
        inputs += body.inputs.len();
        let law = laws::hold_body(&body, &ways[seed as usize % ways.len()..][..1]);
        assert!(law.is_ok(), "seed {seed}: {}\n{text}", law.unwrap_err());
    }
    assert!(inputs > 50, "{inputs} inputs");
}
