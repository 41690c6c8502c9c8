//! `kill -9` at random moments while a large file replaces an old one.

use super::{Place, names, oslrun};
use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Kills runs at moments spread over the time of a complete run. Afterwards the file must contain the old
/// bytes or the new ones, and the next run must leave no other files.
fn kill(times: u32, grid: &str) {
    // Cheap to compute, so that writing takes most of the time.
    let shader = b"shader a(float k = 0, output float o = 0) { o = u * v + k; }";
    let place = Place::new("osl", b"", shader);
    let before = names(&place.project());
    let command = |k: u32| -> Command {
        let mut command = oslrun();
        let args = ["good.osl", "-g", grid, "--compression", "none", "-o", "out.exr", "-p"];
        command.args(args).arg(format!("k={k}")).current_dir(place.project()).stdout(Stdio::null());
        command
    };
    let file = place.project().join("out.exr");
    let whole = |k: u32| {
        let start = Instant::now();
        assert!(command(k).status().unwrap().success());
        (fs::read(&file).unwrap(), start.elapsed())
    };
    let (images, time) = ([whole(0).0, whole(1).0], whole(1).1);
    assert_ne!(images[0], images[1]);
    // The two images alternate, so that each run would change the file.
    let (mut now, mut random, mut torn, mut parts, mut replaced) = (1, 1_u64, 0, 0, 0);
    for _ in 0..times {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let share = (random >> 33) as f64 / f64::from(1_u32 << 31);
        let mut child = command(1 - now).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(time.as_secs_f64() * 1.1 * share));
        let _ = child.kill();
        let _ = child.wait();
        let bytes = fs::read(&file).unwrap();
        parts += names(&place.project()).iter().filter(|name| name.starts_with(".oslrun-")).count();
        match images.iter().position(|image| *image == bytes) {
            Some(found) if found as u32 == 1 - now => {
                now = 1 - now;
                replaced += 1;
            }
            Some(_) => {}
            None => torn += 1,
        }
    }
    println!("{times} kills, {replaced} after the file was replaced; {parts} times a part file was seen");
    assert_eq!(torn, 0);
    whole(0);
    let mut expected = [before, vec!["out.exr".to_string()]].concat();
    expected.sort();
    assert_eq!(names(&place.project()), expected);
}

#[test]
fn a_few_times() {
    kill(12, "256x256");
}

/// `cargo test --release -p oslrun --test sandbox -- --ignored --nocapture killed`
#[test]
#[ignore = "two hundred runs take minutes"]
fn two_hundred_times() {
    kill(200, "2048x2048");
}
