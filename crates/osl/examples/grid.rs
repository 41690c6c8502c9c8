//! Runs a shader over a square grid, without files or further threads, so that a profiler or an instruction
//! counter sees little else: `grid FILE OUTPUT ISA SIZE`. docs/performance.md has an example.

#![allow(clippy::disallowed_methods, reason = "a program for measurements may read its file")]

use osl::{Group, Isa, Points, Renderer, RunOptions, Shader};

/// Points are in patches of this width, one patch after the other, as `oslrun` runs them.
const PATCH: usize = 32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [file, output, isa, size] = args.as_slice() else {
        return Err("usage: grid FILE OUTPUT ISA SIZE".into());
    };
    let size = size.parse::<usize>()?.next_multiple_of(PATCH);
    let isa = Isa::from_name(isa).ok_or_else(|| format!("this machine has {:?}", Isa::all()))?;
    let shader = Shader::compile(file, &std::fs::read_to_string(file)?)?;
    let program = Group::new().layer("shader", &shader).compile(&[output])?;
    let (patches, area) = (size / PATCH, PATCH * PATCH);
    let at = |patch: usize, offset: usize| (patch * PATCH + offset) as f32 / size as f32 + 0.5 / size as f32;
    let (u, v): (Vec<f32>, Vec<f32>) = (0..size * size)
        .map(|point| (point / area, point % area))
        .map(|(patch, place)| (at(patch % patches, place % PATCH), at(patch / patches, place / PATCH)))
        .unzip();
    let p: Vec<[f32; 3]> = u.iter().zip(&v).map(|(u, v)| [*u, *v, 0.0]).collect();
    let points = Points::new(size * size).u(u).v(v).p(&p);
    let options = RunOptions::default().instruction_set(isa).threads(1);
    program.run_with(&points, &Renderer::default(), &options)?;
    Ok(())
}
