//! A parameter that changes again and again: one program, with the bits of many.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl_job::host::Memory;
use osl_job::picture::{self, Extras};
use osl_job::{Image, NoSink, Session};

/// Values of the slider; the first two programs are compiled with the first and for the second.
const VALUES: [&str; 8] = ["0.3", "0.7", "0", "-0.0", "1e30", "-2.5", "1", "0.3"];

/// The number of programs that were compiled for the values of a parameter of a shader. Every picture has
/// the bits of a program with the value as a constant.
fn programs(text: &str, param: &str, values: &[&str], change: impl Fn(usize, &mut Image)) -> u64 {
    let mut memory = Memory::default();
    memory.text("s.osl", text);
    let ramp: Vec<f32> = (0..64).map(|at| at as f32 / 50.0).collect();
    memory.image("t.tif", (8, 8), &[&ramp, &ramp, &ramp]).unwrap();
    let session = Session::new(memory.clone());
    for (at, value) in values.iter().enumerate() {
        let mut image = Image::default();
        image.shader.file = Some("s.osl".into());
        image.shader.params =
            vec![("other".to_string(), "2".to_string()), (param.to_string(), (*value).to_string())];
        image.points.grid = (24, 16);
        image.wanted.values = true;
        change(at, &mut image);
        let bits = |image: Image| -> Vec<Vec<u32>> {
            let done = picture::run(&image, Extras::default(), &mut NoSink);
            let done = done.map_err(|failure| failure.text).unwrap();
            done.frame.planes.iter().map(|plane| plane.words.to_vec()).collect()
        };
        let own = bits(image.clone().on(session.snapshot()));
        let alone = Session::new(memory.clone()).snapshot();
        assert_eq!(own, bits(image.on(alone)), "{param} = {value} of {text}");
    }
    session.snapshot().compiled()
}

fn shader(body: &str) -> String {
    format!("shader s(float k = 1, color c = 1, int n = 1, float other = 1, output color f = 0) {{ {body} }}")
}

#[test]
fn a_slider_runs_one_program() {
    let same = |_: usize, _: &mut Image| {};
    for body in [
        "f = k * color(u, v, 0.5) + other;",
        "f = k * (color)texture(\"t.tif\", k * u, v * other) + noise(\"perlin\", k * P);",
        "float x = pow(u, k) + sqrt(k) + smoothstep(0, 1, k * u); f = color(x, Dx(x), k * Dy(v));",
    ] {
        assert_eq!(programs(&shader(body), "k", &VALUES, same), 2, "{body}");
    }
    let colors = ["0.5", "1,0,0", "0,0.25,1", "#336699"];
    assert_eq!(programs(&shader("f = c * u;"), "c", &colors, same), 2);
    // What only the display of values needs is no reason to compile.
    let ranges = |at: usize, image: &mut Image| image.output.display.signed = at.is_multiple_of(2);
    assert_eq!(programs(&shader("f = k * u;"), "k", &["1"; 6], ranges), 1);
    assert_eq!(programs(&shader("f = k * u;"), "k", &VALUES, |_, image| image.sampling.samples = Some(4)), 2);
}

#[test]
fn a_parameter_that_decides_more_stays_a_constant() {
    let same = |_: usize, _: &mut Image| {};
    let values = &VALUES[..4];
    for body in [
        "if (k > 0.5) f = u; else f = v;",
        "f = 1e38 * (1 + u) / k;",
        "f = mod(u, k) + fmod(v, k);",
        "f = isconstant(k);",
        "f = k > 0.5 ? u : v;",
        "float x = k; x *= 2; f = u / x;",
    ] {
        assert_eq!(programs(&shader(body), "k", values, same), 4, "{body}");
    }
    assert_eq!(
        programs(&shader("for (int i = 0; i < n; i++) f += u / (i + 1);"), "n", &["1", "2", "3"], same),
        3
    );
    assert_eq!(programs(&shader("f = u; if (u > k) f = v / other;"), "k", values, same), 4);
}
