//! From a slider of the live page to its picture: a shader with a texture of 4096 by 4096 pixels, a picture
//! of 512 by 512. The first picture reads both files; the following ones are timed. Then a cheap shader at
//! 1024 by 1024 pixels: what four samples for each pixel cost in comparison with one.
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
use osl_job::host::Memory;
use osl_job::picture::{self, Extras};
use osl_job::{Image, NoSink, Session};
use serde_json::json;
use std::time::Instant;
use studio_client::Studio;

const SHADER: &str = "shader s(float k = 1, string file = \"t.png\", output color f = 0)
{
    f = k * (color)texture(file, 3 * u, 3 * v) + 0.1 * (color)noise(\"perlin\", 20 * P);
}";
const CHEAP: &str = "shader c(output color f = 0) { f = color(u * v, u + v, 0.5 * u); }";
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
    drop(page);
    let [one, four] = [1, 4].map(sampled);
    println!("1024 x 1024: one sample {one:.1} ms, four {four:.1} ms, {:.1} times as much", four / one);
}

/// The median time of a picture of the cheap shader, in milliseconds.
fn sampled(samples: u32) -> f64 {
    let mut memory = Memory::default();
    memory.text("c.osl", CHEAP);
    let session = Session::new(memory);
    let mut image = Image::default().on(session.snapshot());
    image.shader.file = Some("c.osl".into());
    image.points.grid = (1024, 1024);
    image.sampling.samples = Some(samples);
    image.wanted.ranges = true;
    let mut times: Vec<f64> = (0..15)
        .map(|_| {
            let started = Instant::now();
            picture::run(&image, Extras::default(), &mut NoSink).map_err(|failure| failure.text).unwrap();
            started.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
