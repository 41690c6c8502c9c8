//! A shader inside another program: text in, values out, without files or a command line.
//!
//! `cargo run -p osl-examples --bin embed` prints the stripes of the shader below over a small grid.

#![allow(clippy::print_stdout, reason = "its purpose is to print")]

use anyhow::{Context, Result, ensure};
use osl_exec::{PointSource, Program, RunOptions, Services, Spaces};
use osl_image::TextureCache;
use osl_ir::{lower, params, passes, resolve};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

const SHADER: &str = "
    shader stripes(float width = 0.1, output float mask = 0) {
        float warp = 0.2 * noise(8 * P);
        mask = mod(u + warp, 2 * width) < width;
    }";

fn main() -> Result<()> {
    let parsed = osl_syntax::parse("stripes.osl", SHADER, &NoFiles, &Options::default());
    ensure!(!parsed.has_errors(), "{:?}", parsed.diagnostics);
    let resolved = resolve::resolve(&parsed.ast);
    let shader = resolved.program.with_context(|| format!("{:?}", resolved.diagnostics))?;

    let mut values = params::ParamValues::default();
    params::set(&shader, &mut values, "width", "0.25")?;
    let mut body = lower::lower(&shader, &values).map_err(|errors| anyhow::anyhow!("{errors:?}"))?;

    let grid = Grid::new(64, 16);
    let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
    passes::run(&mut body, &options);
    let program = Program::new(&body);

    let services = Services {
        spaces: Spaces::default(),
        textures: TextureCache::new(Vec::new()),
        ..Services::default()
    };
    let frame = osl_exec::run(&program, &services, &grid, &RunOptions::default(), &|_| ())
        .map_err(|stop| anyhow::anyhow!("{stop:?}"))?;
    for row in frame.planes[0].floats().chunks(grid.width) {
        println!("{}", row.iter().map(|m| if *m > 0.0 { '#' } else { '.' }).collect::<String>());
    }
    Ok(())
}
