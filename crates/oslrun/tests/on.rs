//! `--on`: shaders on surfaces, as pictures with alpha.

#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs, reason = "a test says what must hold")]

use osl_image::{Image, read_image};
use std::path::Path;

/// Runs the command in this process: exit code, and what it said.
fn oslrun(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("oslrun").chain(args.iter().copied()).map(Into::into);
    let code = oslrun::cli::main(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn file(dir: &Path, name: &str, text: &str) -> String {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// The channels of a picture of 32 × 32 pixels.
fn shade(shader: &str, more: &[&str], out: &Path) -> Image {
    let path = out.display().to_string();
    let args = [&[shader, "-g", "32x32", "-o", &path], more].concat();
    let (code, _, err) = oslrun(&args);
    assert_eq!(code, 0, "{args:?}: {err}");
    read_image(out).unwrap()
}

const SHADER: &str =
    "shader s(float bump = 0, output color uv = 0, output float far = 0, output normal n = 0,
    output vector by = 0, output point to = 0, output float out = 0) {
    uv = color(u, v, 0); far = length(P - point(\"object\", 0, 0, 0)); n = N;
    out = bump; by = bump * N; to = P + bump * N;
}";
