//! Changes a parameter between runs without compiling again, as a slider in an editor does.
//!
//! `cargo run -p osl-examples --bin live` prints one line for each value of the parameter.

#![allow(clippy::print_stdout, reason = "its purpose is to print")]

use osl::{CompileOptions, Error, Group, Points, Shader};

const SHADER: &str = "
    shader rings(float frequency = 4 [[ float min = 1, float max = 16 ]], output float mask = 0) {
        mask = sin(frequency * M_2PI * u) > 0;
    }";

/// Points on a line.
const WIDTH: usize = 64;

fn main() -> Result<(), Error> {
    let rings = Shader::compile("rings.osl", SHADER)?;
    let options = CompileOptions::outputs(&["mask"]).live(&["frequency"]);
    let mut program = Group::new().layer("rings", &rings).compile_with(&options)?;
    let points =
        Points::new(WIDTH).u((0..WIDTH).map(|x| (x as f32 + 0.5) / WIDTH as f32).collect::<Vec<f32>>());
    for frequency in [1.0, 2.0, 4.0, 8.0, 16.0] {
        program.set("frequency", frequency)?;
        let outputs = program.run(&points)?;
        let mask = outputs.component("mask", 0).unwrap_or_default();
        let line: String = mask.iter().map(|x| if *x > 0.0 { '#' } else { '.' }).collect();
        println!("{frequency:4} {line}");
    }
    Ok(())
}
