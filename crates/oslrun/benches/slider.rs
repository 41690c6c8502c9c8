//! From a slider of the live page to its picture: a shader with a texture of 4096 by 4096 pixels, a picture
//! of 512 by 512. The first picture reads both files; the following ones are timed.
//!
//! cargo bench -p oslrun --bench slider

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench may fail, and prints"
)]

#[path = "../tests/studio_client/mod.rs"]
mod studio_client;

use osl_image::{BitDepth, PngOptions, Transfer, write_png};
use serde_json::json;
use std::time::Instant;
use studio_client::Studio;

const SHADER: &str = "shader s(float k = 1, string file = \"t.png\", output color f = 0)
{
    f = k * (color)texture(file, 3 * u, 3 * v) + 0.1 * (color)noise(\"perlin\", 20 * P);
}";
const SIDE: usize = 4096;
const EVENTS: usize = 200;

fn main() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), SHADER).unwrap();
    let pixels: Vec<f32> = (0..SIDE * SIDE).map(|at| (at % 251) as f32 / 250.0).collect();
    let options = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
    write_png(&folder.path().join("t.png"), SIDE, SIDE, &[&pixels, &pixels, &pixels], options).unwrap();
    // A file that was written just now may change again without a new time, so it would be read again.
    std::thread::sleep(std::time::Duration::from_secs(3));
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "512x512"]);
    let mut page = studio.page();
    let mut event = |k: f64| {
        let started = Instant::now();
        page.state(json!({ "params": [["k", k.to_string()]] }));
        page.until("picture");
        started.elapsed().as_secs_f64() * 1e3
    };
    let first = event(1.0);
    let mut times: Vec<f64> = (0..EVENTS).map(|at| event(1.0 + at as f64 / EVENTS as f64)).collect();
    times.sort_by(f64::total_cmp);
    println!(
        "first picture {first:.1} ms; {EVENTS} slider events: median {:.1} ms, 90 % within {:.1} ms",
        times[EVENTS / 2],
        times[EVENTS * 9 / 10]
    );
}
