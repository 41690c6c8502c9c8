//! The cache: one read and one report a file, from any thread.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::thread;

use osl_image::{BitDepth, PngOptions, TextureCache, Transfer, write_png};

fn write(path: &Path, value: f32) {
    write_png(path, 1, 1, &[&[value]], PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight })
        .unwrap();
}

#[test]
fn all_threads_share_one_texture() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.png"), 1.0);
    let cache = TextureCache::new(vec![dir.path().to_owned()]);
    let textures: Vec<_> = thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(|| cache.get("a.png").unwrap())).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(textures.iter().all(|texture| Arc::ptr_eq(texture, &textures[0])));
    assert_eq!(textures[0].average(0), 1.0);
}

#[test]
fn a_missing_file_is_reported_once() {
    let cache = TextureCache::default();
    let n_reports: usize = thread::scope(|scope| {
        let report = || usize::from(cache.get("nosuch.exr").unwrap_err().take_report().is_some());
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(report)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).sum()
    });
    assert_eq!(n_reports, 1);
    let failure = cache.get("nosuch.exr").unwrap_err();
    assert_eq!(failure.message(), "Could not open file \"nosuch.exr\"");
    assert_eq!(failure.take_report(), None);
    assert!(!cache.exists("nosuch.exr"));
    assert!(!cache.exists(""));
}

#[test]
fn a_damaged_file_is_an_error_with_its_reason() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.png"), "not a picture").unwrap();
    let cache = TextureCache::new(vec![dir.path().to_owned()]);
    assert!(cache.exists("a.png"));
    let failure = cache.get("a.png").unwrap_err();
    assert!(
        failure.message().ends_with("a.png: not an EXR, PNG, JPEG, TIFF or HDR file"),
        "{}",
        failure.message()
    );
}

#[test]
fn directories_are_searched_in_order() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write(&second.path().join("a.png"), 0.0);
    write(&second.path().join("b.png"), 0.0);
    write(&first.path().join("a.png"), 1.0);
    let cache = TextureCache::new(vec![first.path().to_owned(), second.path().to_owned()]);
    assert_eq!(cache.get("a.png").unwrap().average(0), 1.0);
    assert_eq!(cache.get("b.png").unwrap().average(0), 0.0);
    // An absolute name is taken as it is.
    let absolute = second.path().join("a.png");
    assert_eq!(cache.get(absolute.to_str().unwrap()).unwrap().average(0), 0.0);
}
