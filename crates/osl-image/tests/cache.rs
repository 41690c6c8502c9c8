//! The cache: one read and one report per file, from any thread.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::thread;

use osl_image::{
    BitDepth, Footprint, LookupOptions, PngOptions, SubImage, TextureCache, Transfer, lookup_values,
    write_png,
};
use osl_limits::Limits;

fn write(path: &Path, value: f32) {
    write_png(
        path,
        1,
        1,
        &[&[value]],
        PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None },
    )
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
    assert_eq!(textures[0].average().unwrap()[0], 1.0);
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
        failure
            .message()
            .ends_with("a.png: not an EXR, PNG, JPEG, TIFF, HDR, TGA, BMP, GIF, WebP, PNM or DDS file"),
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
    assert_eq!(cache.get("a.png").unwrap().average().unwrap()[0], 1.0);
    assert_eq!(cache.get("b.png").unwrap().average().unwrap()[0], 0.0);
    // An absolute name is used unchanged if it is below one of the permitted folders.
    let absolute = second.path().join("a.png");
    assert_eq!(cache.get(absolute.to_str().unwrap()).unwrap().average().unwrap()[0], 0.0);
}

/// Bytes of a 16 x 16 texture with one channel of bytes: 256 + 64 + 16 + 4 + 1 texels, and the overhead of a
/// texture.
const BYTES: u64 = 341 + 1024;

fn write_squares(dir: &Path, n: usize) {
    for i in 0..n {
        let plane: Vec<f32> = (0..256).map(|p| ((p * 7 + i * 13) % 256) as f32 / 255.0).collect();
        let options = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
        write_png(&dir.join(format!("{i}.png")), 16, 16, &[&plane], options).unwrap();
    }
}

fn cache_of(dir: &Path, bytes: u64) -> TextureCache {
    let mut limits = Limits::default();
    limits.images.texture_memory = bytes;
    TextureCache::within(vec![dir.to_owned()], &limits)
}

#[test]
fn what_was_used_longest_ago_is_dropped() {
    let dir = tempfile::tempdir().unwrap();
    write_squares(dir.path(), 4);
    let cache = cache_of(dir.path(), 3 * BYTES);
    let held = |name: &str| Arc::downgrade(&cache.get(name).unwrap());
    let (zero, one, two) = (held("0.png"), held("1.png"), held("2.png"));
    assert_eq!(cache.held_bytes(), 3 * BYTES);
    held("0.png");
    held("3.png");
    assert_eq!(cache.held_bytes(), 3 * BYTES);
    assert!(one.upgrade().is_none());
    assert!(zero.upgrade().is_some() && two.upgrade().is_some());
}

#[test]
fn textures_in_use_stay() {
    let dir = tempfile::tempdir().unwrap();
    write_squares(dir.path(), 4);
    let cache = cache_of(dir.path(), 2 * BYTES);
    let first = cache.get("0.png").unwrap();
    for name in ["1.png", "2.png", "3.png"] {
        cache.get(name).unwrap();
    }
    assert!(Arc::ptr_eq(&first, &cache.get("0.png").unwrap()), "not read twice");
    assert_eq!(cache.held_bytes(), 2 * BYTES);
}

/// A texture that can never fit is refused, and the message names the limit.
#[test]
fn a_texture_larger_than_the_budget_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    write_squares(dir.path(), 1);
    let failure = cache_of(dir.path(), 300).get("0.png").unwrap_err();
    let expected = "16 x 16 pixels of 1 channels, with coarser levels, takes 341 bytes, and the limit is 300 bytes \
                    (--limit images.texture_memory=BYTES)";
    assert!(failure.message().ends_with(expected), "{}", failure.message());
    // One that just fits is dropped for the next.
    write_squares(dir.path(), 2);
    let cache = cache_of(dir.path(), 341);
    let first = Arc::downgrade(&cache.get("0.png").unwrap());
    cache.get("1.png").unwrap();
    assert!(first.upgrade().is_none());
}

/// Clones of a cache are one cache.
#[test]
fn copies_share_their_textures() {
    let dir = tempfile::tempdir().unwrap();
    write_squares(dir.path(), 1);
    let cache = cache_of(dir.path(), u64::MAX);
    assert!(Arc::ptr_eq(&cache.get("0.png").unwrap(), &cache.clone().get("0.png").unwrap()));
}

/// An endless stream of new names does not take endless memory, and each name is answered like the first.
#[test]
fn few_names_are_remembered() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.1001.png"), 1.0);
    let mut limits = Limits::default();
    (limits.images.names, limits.images.patterns) = (2, 2);
    let cache = TextureCache::within(vec![dir.path().to_owned()], &limits);
    for i in 0..9 {
        assert!(cache.get(&format!("{i}.png")).is_err());
        assert!(cache.get("a.1001.png").is_ok());
        assert!(!cache.exists(&format!("{i}.<UDIM>.png")));
        assert!(cache.exists("a.<UDIM>.png") && cache.exists("./a.<UDIM>.png"));
        assert!(!cache.exists(&format!("no{i}/a.<UDIM>.png")));
    }
}

/// Many threads over more textures than fit get the results of one thread that keeps all of them.
#[test]
fn results_do_not_depend_on_what_is_dropped() {
    const N_TEXTURES: usize = 12;
    const N_THREADS: u64 = 8;
    let dir = tempfile::tempdir().unwrap();
    write_squares(dir.path(), N_TEXTURES);
    let footprint = Footprint { ds_dx: 0.1, dt_dy: 0.2, ..Footprint::default() };
    let look = |cache: &TextureCache, i: usize| {
        let texture = cache.get(&format!("{i}.png")).unwrap();
        lookup_values(&texture, 0.3, 0.6, &footprint, 1, &LookupOptions::default())[0].to_bits()
    };
    let all = cache_of(dir.path(), u64::MAX);
    let expected: Vec<u32> = (0..N_TEXTURES).map(|i| look(&all, i)).collect();
    let few = cache_of(dir.path(), 4 * BYTES);
    thread::scope(|scope| {
        for seed in 0..N_THREADS {
            let (few, expected, look) = (&few, &expected, &look);
            scope.spawn(move || {
                let mut state = seed;
                for _ in 0..400 {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    let i = (state >> 33) as usize % N_TEXTURES;
                    assert_eq!(look(few, i), expected[i]);
                    // The textures that fit, and one in use by each thread.
                    assert!(few.held_bytes() <= (4 + N_THREADS) * BYTES);
                }
            });
        }
    });
    look(&few, 0);
    (0..N_TEXTURES).for_each(|i| assert_eq!(look(&few, i), expected[i]));
    assert!(few.held_bytes() <= 4 * BYTES);
}

#[test]
fn tiles_by_unit_square() {
    let dir = tempfile::tempdir().unwrap();
    for (name, value) in [("a.1001.png", 0.0), ("a.1012.png", 1.0), ("b_u1_v1.png", 0.2)] {
        write(&dir.path().join(name), value);
    }
    let cache = cache_of(dir.path(), u64::MAX);
    // A byte is read as itself times the rounded 1/255.
    let fifth = 51.0 * (1.0 / 255.0);
    let at = |name: &str, s, t| {
        let (texture, s, t) = cache.tile(name, SubImage::default(), s, t);
        (texture.map(|texture| texture.average().unwrap()[0]).map_err(|f| f.message().to_owned()), s, t)
    };
    assert_eq!(at("a.<UDIM>.png", 0.25, 0.5), (Ok(0.0), 0.25, 0.5));
    assert_eq!(at("a.<UDIM>.png", 1.25, 1.5), (Ok(1.0), 0.25, 0.5));
    assert_eq!(at("a.%(UDIM)d.png", 1.25, 1.5).0, Ok(1.0));
    assert_eq!(at("b_<u>_<v>.png", 1.25, 1.5).0, Ok(fifth));
    assert_eq!(at("b_<U>_<V>.png", 0.25, 0.5).0, Ok(fifth));
    assert_eq!(at("a.<UDIM>.png", 2.0, 0.0).0, Err("Could not open file \"a.1003.png\"".to_owned()));
    assert_eq!(at("a.<UDIM>.png", 77.0, 0.0).0, Err("Could not open file \"a.<UDIM>.png\"".to_owned()));
    assert_eq!(at("a.1001.png", 5.5, -1.0), (Ok(0.0), 5.5, -1.0));
    assert!(cache.exists("a.<UDIM>.png") && !cache.exists("c.<UDIM>.png"));
    assert!(TextureCache::is_tiled("a.<UDIM>.png") && !TextureCache::is_tiled("a.1001.png"));
}

#[test]
fn other_images_of_a_file_have_their_own_failures() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.png"), 1.0);
    let cache = cache_of(dir.path(), u64::MAX);
    for first in [SubImage::Index(0), SubImage::Name("")] {
        assert_eq!(cache.get_part("a.png", first).unwrap().n_parts(), 1);
    }
    let failure = cache.get_part("a.png", SubImage::Index(3)).unwrap_err();
    assert!(failure.message().ends_with("a.png: there is no subimage 3, only 1"), "{}", failure.message());
    assert!(Arc::ptr_eq(&failure, &cache.get_part("a.png", SubImage::Index(3)).unwrap_err()));
    assert!(cache.get_part("a.png", SubImage::Name("x")).is_err());
    assert!(cache.get("a.png").is_ok());
}

/// A readable folder with a picture, next to a picture that may not be read.
fn walled() -> (tempfile::TempDir, TextureCache) {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("inside/deep")).unwrap();
    write(&dir.path().join("inside/a.png"), 1.0);
    write(&dir.path().join("secret.png"), 1.0);
    let cache = cache_of(&dir.path().join("inside"), u64::MAX);
    (dir, cache)
}

#[test]
fn files_elsewhere_are_refused() {
    let (dir, cache) = walled();
    let secret = dir.path().join("secret.png");
    let (secret, absent) = (secret.to_str().unwrap(), dir.path().join("absent.png"));
    let names = [secret, absent.to_str().unwrap(), "../secret.png", "deep/../../secret.png", "/etc/passwd"];
    for name in names {
        let message = cache.get(name).unwrap_err().message().to_owned();
        assert!(
            message.ends_with("neither below the working directory nor below a search path"),
            "{message}"
        );
        assert!(!cache.exists(name));
    }
    assert!(cache.get("deep/../a.png").is_ok());
    let (_dir, open) = walled();
    assert!(open.allow_files(true).get(secret).is_ok());
}

#[cfg(unix)]
#[test]
fn links_are_followed_before_they_are_judged() {
    use std::os::unix::fs::symlink;
    let (dir, cache) = walled();
    symlink(dir.path(), dir.path().join("inside/out")).unwrap();
    symlink("a.png", dir.path().join("inside/b.png")).unwrap();
    assert!(cache.get("b.png").is_ok());
    assert!(cache.get("out/secret.png").unwrap_err().message().contains("neither below"));
    assert!(cache.get("out/inside/a.png").is_ok());
    // A pipe must not make the reader wait for a writer.
    let made = std::process::Command::new("mkfifo").arg(dir.path().join("inside/pipe")).status();
    if made.is_ok_and(|status| status.success()) {
        assert_eq!(cache.get("pipe").unwrap_err().message(), "Could not open file \"pipe\"");
    }
}

/// The reasons in the words of the reference's library, by file extension.
#[test]
fn failures_have_the_words_of_the_reference() {
    let cache = TextureCache::default();
    let text = |name: &str| cache.get(name).unwrap_err().reference_message();
    assert_eq!(text("no.tx"), "Could not open file: no.tx: No such file or directory");
    assert_eq!(text("no.EXR"), "Could not open file \"no.EXR\"");
    assert_eq!(text(""), "ImageInput::create() called with no filename");
    for name in ["no", "no.", "no.such", "no. "] {
        let expected = format!(
            "Image \"{name}\" does not exist. Also, it is not the name of an image format that OpenImageIO recognizes."
        );
        assert_eq!(text(name), expected);
    }
}
