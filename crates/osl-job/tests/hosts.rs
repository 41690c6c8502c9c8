//! Pictures from the three hosts: the same bits, read once, and cancelled by a change.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl_files::{FileError, Roots, Stamp};
use osl_image::{ExrOptions, Layer, LayerKind, TextureCache, write_exr};
use osl_job::host::{Host, Memory, Watching, Within};
use osl_job::picture::{self, Extras};
use osl_job::{Image, NoSink, Session};
use osl_limits::{Cancel, Halt, Limits};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::SystemTime;

const TEXTURED: &str = "#include \"gain.h\"
shader s(string file = \"wood.exr\", output color f = 0) { f = GAIN * (color)texture(file, u, v, \"wrap\", \"periodic\"); }";
const GAIN: &str = "#define GAIN 0.5\n";

/// Three channels of four pixels.
const WOOD: [[f32; 4]; 3] = [[0.1, 0.2, 0.3, 0.4], [1e-20, 2.5, -1.0, 1e9], [0.0, 0.7, 0.5, 0.25]];

/// A picture of a shader.
fn image(file: impl Into<PathBuf>) -> Image {
    let mut image = Image::default();
    image.shader.file = Some(file.into());
    image.points.grid = (16, 16);
    image.wanted.values = true;
    image
}

/// The bits of all planes, or the text of the failure.
fn bits(image: &Image) -> Result<Vec<Vec<u32>>, String> {
    let done = picture::run(image, Extras::default(), &mut NoSink).map_err(|failure| failure.text)?;
    Ok(done.frame.planes.into_iter().map(|plane| plane.words.to_vec()).collect())
}

/// The textured shader in memory.
fn textured() -> Memory {
    let mut memory = Memory::default();
    memory.text("shaders/s.osl", TEXTURED);
    memory.text("shaders/gain.h", GAIN);
    memory.image("shaders/wood.exr", (2, 2), &[&WOOD[0], &WOOD[1], &WOOD[2]]).unwrap();
    memory
}

/// The same on the disk.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), TEXTURED).unwrap();
    std::fs::write(folder.path().join("gain.h"), GAIN).unwrap();
    let planes = WOOD.iter().map(|plane| &plane[..]).collect();
    let layer = Layer { name: "", kind: LayerKind::Color, planes };
    write_exr(&folder.path().join("wood.exr"), 2, 2, &[layer], ExrOptions::default()).unwrap();
    folder
}

#[test]
fn a_seed_in_memory_has_the_bits_of_the_file() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/Cobbled.osl");
    let mut memory = Memory::default();
    memory.text("web/Cobbled.osl", &std::fs::read_to_string(&file).unwrap());
    let session = Session::new(memory);
    let found = bits(&image("web/./Cobbled.osl").on(session.snapshot())).unwrap();
    assert_eq!(found, bits(&image(file)).unwrap());
}

#[test]
fn a_texture_in_memory_has_the_bits_of_the_file() {
    let folder = folder();
    let session = Session::new(textured());
    let found = bits(&image("shaders/s.osl").on(session.snapshot())).unwrap();
    assert!(found.iter().flatten().any(|word| f32::from_bits(*word) > 0.1));
    assert_eq!(found, bits(&image(folder.path().join("s.osl"))).unwrap());
    let other = "shaders/t.osl";
    assert!(bits(&image(other).on(session.snapshot())).unwrap_err().contains("no such file"));
}

#[test]
fn groups_meshes_and_attributes_come_from_memory() {
    let mut memory = textured();
    memory.text("two.group", "shader s base ; shader add last ; connect base.f last.x ;");
    memory.text(
        "add.osl",
        "shader add(color x = 0, output color f = 0)
        { float more = 0; getattribute(\"more\", more); f = x + more; }",
    );
    memory.text("more.json", "{ \"more\": 2.5 }");
    memory.text("one.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
    let mut image = image("two.group");
    image.shader.network.shader_path = vec!["shaders".into()];
    image.provided.texture_path = vec!["shaders".into()];
    image.provided.attributes = Some("more.json".into());
    let session = Session::new(memory);
    let plain = bits(&image.clone().on(session.snapshot())).unwrap();
    assert!(plain.iter().flatten().all(|word| f32::from_bits(*word) >= 2.0));
    image.points.surface.on = Some("one.obj".into());
    let on = bits(&image.on(session.snapshot())).unwrap();
    assert!(on.iter().flatten().any(|word| f32::from_bits(*word) >= 2.0));
}

#[test]
fn a_change_is_seen_by_the_next_snapshot_only() {
    let mut memory = textured();
    let session = Session::new(memory.clone());
    let before = session.snapshot();
    let first = bits(&image("shaders/s.osl").on(before.clone())).unwrap();
    memory.text("shaders/gain.h", "#define GAIN 1.0\n");
    let after = session.change(memory.clone());
    assert!(before.cancel().is_cancelled() && !after.cancel().is_cancelled());
    let double = bits(&image("shaders/s.osl").on(after)).unwrap();
    let twice = |(x, y): (&u32, &u32)| 2.0 * f32::from_bits(*x) == f32::from_bits(*y);
    assert!(first.iter().flatten().zip(double.iter().flatten()).all(twice));
    memory.image("shaders/wood.exr", (1, 1), &[&[3.0][..]; 3]).unwrap();
    let third = bits(&image("shaders/s.osl").on(session.change(memory))).unwrap();
    assert!(third.iter().flatten().all(|word| (f32::from_bits(*word) - 3.0).abs() < 1e-5));
}

#[test]
fn a_change_cancels_the_work_on_older_snapshots() {
    let mut memory = Memory::default();
    memory.text("s.osl", "shader s(output float f = 0) { for (int i = 0; i < 2000000000; i++) f += u; }");
    let session = Session::new(memory);
    let image = image("s.osl").on(session.snapshot());
    let started = std::time::Instant::now();
    let stopped = std::thread::scope(|scope| {
        let work = scope.spawn(|| bits(&image));
        std::thread::sleep(std::time::Duration::from_millis(300));
        session.outdate();
        work.join().unwrap()
    });
    assert!(stopped.unwrap_err().contains(&Halt::Cancelled.to_string()));
    assert!(started.elapsed().as_secs() < 60, "the loop takes hours");
}

#[test]
fn an_unsaved_text_replaces_the_file_where_that_may_be_read() {
    let folder = folder();
    let path = folder.path().join("s.osl");
    let saved = bits(&image(&path)).unwrap();
    let mut editor = Watching::default();
    let session = Session::new(editor.clone());
    assert_eq!(bits(&image(&path).on(session.snapshot())).unwrap(), saved);
    editor.edit(folder.path().join("x/../gain.h"), "#define GAIN 0.0\n");
    let dark = bits(&image(&path).on(session.change(editor.clone()))).unwrap();
    assert!(dark.iter().flatten().all(|word| f32::from_bits(*word) == 0.0));
    editor.close(folder.path().join("gain.h"));
    assert_eq!(bits(&image(&path).on(session.change(editor.clone()))).unwrap(), saved);

    // A header outside of the folders stays outside, also as an unsaved text.
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("secret.h");
    editor.edit(&secret, GAIN);
    editor.edit(&path, &TEXTURED.replace("gain.h", &secret.display().to_string()));
    let mut image = image(&path).on(session.change(editor));
    image.shader.read.reach = osl_job::request::Reach::Folders;
    bits(&image).unwrap_err();
    image.shader.allow_files = true;
    assert_eq!(bits(&image).unwrap(), saved);
}

/// Counts the files that are read.
#[derive(Debug)]
struct Counting(Memory, Arc<AtomicUsize>);

impl Host for Counting {
    fn read(&self, path: &Path, within: Within<'_>, most: u64) -> Result<Vec<u8>, FileError> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.read(path, within, most)
    }

    fn stamp(&self, path: &Path) -> Option<Stamp> {
        self.0.stamp(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        self.0.names(folder)
    }

    fn permit(&self, folder: &Path, project: bool, roots: &mut Roots) {
        self.0.permit(folder, project, roots);
    }

    fn textures(&self, folders: Vec<PathBuf>, limits: &Limits) -> TextureCache {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.textures(folders, limits)
    }

    fn now(&self) -> SystemTime {
        self.0.now()
    }
}

#[test]
fn what_was_read_is_kept_until_it_changes() {
    let mut memory = textured();
    memory.text("more.json", "{ \"more\": 2.5 }");
    let reads = Arc::new(AtomicUsize::new(0));
    let session = Session::new(Counting(memory.clone(), reads.clone()));
    let mut image = image("shaders/s.osl");
    image.provided.attributes = Some("more.json".into());
    for _ in 0..200 {
        bits(&image.clone().on(session.snapshot())).unwrap();
    }
    // The shader, its header, the attributes, and once the textures.
    assert_eq!(reads.load(Ordering::Relaxed), 4);
    memory.text("shaders/s.osl", &format!("{TEXTURED}\n"));
    bits(&image.on(session.change(Counting(memory, reads.clone())))).unwrap();
    assert_eq!(reads.load(Ordering::Relaxed), 6);
}

#[test]
fn limits_hold_in_memory_too() {
    let session = Session::new(textured());
    let mut image = image("shaders/s.osl").on(session.snapshot());
    image.shader.read.limits.reading.file_bytes = 10;
    assert!(bits(&image).unwrap_err().contains("more than 10 bytes"));
}

#[test]
fn a_part_of_the_work_ends_alone_or_with_the_whole() {
    let whole = Cancel::new();
    let [one, other] = [whole.part(), whole.part()];
    one.cancel();
    assert!(one.is_cancelled() && !other.is_cancelled() && !whole.is_cancelled());
    assert!(Limits::default().until(&other).halted().is_none());
    whole.cancel();
    assert_eq!(Limits::default().until(&other).halted(), Some(Halt::Cancelled));
}
