//! The rules for files: what is opened, what is refused, and what is left on the disk.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test fails by panicking")]

use osl_files::{FileError, Kind, Roots, Unsaved, open_named, replace, save_all};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// A readable folder `in` with `a` and `sub/b`, and a file `secret` next to it.
fn place() -> (tempfile::TempDir, PathBuf, Roots) {
    let dir = tempfile::tempdir().unwrap();
    let inside = dir.path().join("in");
    fs::create_dir_all(inside.join("sub")).unwrap();
    fs::write(inside.join("a"), "a").unwrap();
    fs::write(inside.join("sub/b"), "b").unwrap();
    fs::write(dir.path().join("secret"), "secret").unwrap();
    let roots = Roots::new([&inside]);
    (dir, inside, roots)
}

fn fifo(path: &Path) {
    let made = std::process::Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

fn answer(roots: &Roots, path: &Path) -> String {
    match roots.open(path) {
        Ok(file) => file.text(100).unwrap(),
        Err(error) => format!("{error}"),
    }
}

const OUTSIDE: &str = "it lies outside of the folders that may be used";
const MISSING: &str = "no such file";

#[test]
fn what_lies_below_a_root_is_opened_and_nothing_else() {
    let (dir, inside, roots) = place();
    symlink(inside.join("a"), inside.join("good")).unwrap();
    symlink("sub", inside.join("folder")).unwrap();
    symlink(dir.path().join("secret"), inside.join("bad")).unwrap();
    symlink("..", inside.join("up")).unwrap();
    symlink(dir.path().join("nothing"), inside.join("dangling")).unwrap();
    symlink("loop", inside.join("loop")).unwrap();
    fifo(&inside.join("pipe"));
    let long = "x".repeat(5000);
    let there = dir.path().join("secret").display().to_string();
    for (name, expected) in [
        ("a", "a"),
        ("sub/b", "b"),
        ("sub/../a", "a"),
        ("./good", "a"),
        ("folder/b", "b"),
        ("bad", OUTSIDE),
        ("up/secret", OUTSIDE),
        ("../secret", OUTSIDE),
        ("../nothing", OUTSIDE),
        ("up/nothing", OUTSIDE),
        ("dangling", OUTSIDE),
        ("loop", OUTSIDE),
        (&there, OUTSIDE),
        ("/etc/passwd", OUTSIDE),
        ("/proc/self/fd/0", OUTSIDE),
        ("/dev/zero", OUTSIDE),
        ("nothing", MISSING),
        ("a.", MISSING),
        ("A", MISSING),
        ("a/b", MISSING),
        ("nul\0byte", MISSING),
        (&long, MISSING),
        ("pipe", "it is a pipe, not a file"),
        ("sub", "it is a folder, not a file"),
        ("", "it is a folder, not a file"),
    ] {
        let got = answer(&roots, &inside.join(name));
        let same = got == expected || expected == MISSING && got.contains("cannot");
        assert!(same, "{name:?}: {got}");
    }
    let open = roots.or_anywhere(true);
    assert_eq!(answer(&open, &dir.path().join("secret")), "secret");
    assert_eq!(answer(&open, &inside.join("pipe")), "it is a pipe, not a file");
    assert_eq!(answer(&open, Path::new("/dev/zero")), "it is a device, not a file");
}

#[test]
fn a_target_counts_where_the_path_alone_leads_outside() {
    let (dir, inside, roots) = place();
    symlink(inside.join("sub"), dir.path().join("link")).unwrap();
    symlink(dir.path(), inside.join("up")).unwrap();
    let read = |name: &str| {
        let file = roots.open_target(&dir.path().join(name)).map_err(|error| error.to_string())?;
        assert_eq!(file.path(), dir.path().join(name));
        file.text(100).map_err(|error| error.to_string())
    };
    assert_eq!(answer(&roots, &dir.path().join("link/b")), OUTSIDE);
    assert_eq!(read("link/b").as_deref(), Ok("b"));
    assert_eq!(read("link/../a").as_deref(), Ok("a"));
    for name in
        ["secret", "nothing", "link/../../secret", "in/up/secret", "link/../../nothing", "in/up/nothing"]
    {
        assert_eq!(read(name), Err(OUTSIDE.to_string()), "{name}");
    }
    assert_eq!(read("in/nothing"), Err(MISSING.to_string()));
}

#[test]
fn a_folder_that_becomes_a_link_while_files_are_opened_leads_nowhere() {
    let (dir, inside, roots) = place();
    fs::create_dir(dir.path().join("other")).unwrap();
    fs::write(dir.path().join("other/b"), "secret").unwrap();
    symlink(dir.path().join("other"), inside.join("link")).unwrap();
    fs::rename(inside.join("sub"), inside.join("sub2")).unwrap();
    std::thread::scope(|scope| {
        let turn = scope.spawn(|| {
            for _ in 0..3000 {
                fs::rename(inside.join("sub2"), inside.join("sub")).unwrap();
                fs::rename(inside.join("sub"), inside.join("sub2")).unwrap();
                fs::rename(inside.join("link"), inside.join("sub")).unwrap();
                fs::rename(inside.join("sub"), inside.join("link")).unwrap();
            }
        });
        while !turn.is_finished() {
            assert_ne!(answer(&roots, &inside.join("sub/b")), "secret");
        }
    });
}

#[test]
fn reads_are_bounded_and_text_is_text() {
    let (_dir, inside, roots) = place();
    let write = |bytes: &[u8]| fs::write(inside.join("t"), bytes).unwrap();
    let read = |limit| roots.open(&inside.join("t")).unwrap().text(limit);
    write(b"12345");
    assert_eq!(read(5).unwrap(), "12345");
    assert!(matches!(read(4), Err(FileError::TooLong(4))));
    write(b"a\xff");
    assert!(matches!(read(9), Err(FileError::NotUtf8(1))));
    write(b"ab\0");
    assert!(matches!(read(9), Err(FileError::Zero(2))));
    assert!(matches!(osl_files::read_stream(std::io::repeat(65), 1000), Err(FileError::TooLong(1000))));
    for (path, kind) in [("/dev/zero", Kind::Device), ("/tmp", Kind::Folder)] {
        let refused = open_named(Path::new(path)).map(|_| ());
        assert!(matches!(refused, Err(FileError::NotAFile(found)) if found == kind), "{path}: {refused:?}");
    }
    fifo(&inside.join("pipe"));
    assert!(matches!(open_named(&inside.join("pipe")), Err(FileError::NotAFile(Kind::Pipe))));
}

#[test]
fn appending_stays_below_the_root_and_never_waits() {
    let (dir, inside, roots) = place();
    symlink(dir.path().join("new"), inside.join("dangling")).unwrap();
    symlink("fresh", inside.join("near")).unwrap();
    symlink("a", inside.join("good")).unwrap();
    symlink(dir.path(), inside.join("up")).unwrap();
    fifo(&inside.join("pipe"));
    let append = |name: &str| roots.append(&inside.join(name), b"+").map_err(|e| e.to_string());
    for name in ["a", "good", "sub/new", "sub/../a"] {
        append(name).unwrap();
    }
    for name in [
        "dangling", "near", "up/new", "../new", "/tmp/new", "pipe", "sub", "none/new", ".hidden", ".git/x",
        "", "n\0",
    ] {
        append(name).unwrap_err();
    }
    assert_eq!(fs::read_to_string(inside.join("a")).unwrap(), "a+++");
    assert_eq!(fs::read_to_string(inside.join("sub/new")).unwrap(), "+");
    assert_eq!(names(dir.path()), ["in", "secret"]);
    assert_eq!(names(&inside), ["a", "dangling", "good", "near", "pipe", "sub", "up"]);
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_set_of_files_is_all_or_none() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("1"), "old").unwrap();
    let set = || {
        let one = |name| Unsaved::new(&at(name)).unwrap().with(b"new").unwrap();
        vec![one("1"), one("2"), one("3")]
    };
    let waiting = set();
    fs::create_dir(at("3")).unwrap();
    assert_eq!(save_all(waiting).unwrap_err().path, at("3"));
    assert_eq!(names(dir.path()), ["1", "3"]);
    assert_eq!(fs::read(at("1")).unwrap(), b"old");
    fs::remove_dir(at("3")).unwrap();
    save_all(set()).unwrap();
    assert_eq!(names(dir.path()), ["1", "2", "3"]);
    assert_eq!(fs::read(at("1")).unwrap(), b"new");
}

#[test]
fn names_made_of_a_shader_cannot_climb() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("in");
    fs::create_dir(&folder).unwrap();
    fs::write(dir.path().join("old"), "old").unwrap();
    symlink("../old", folder.join("link")).unwrap();
    for name in
        ["../x", "a/../../x", "/tmp/x", "..", ".", "", "a\0", "a\nb", "a\\b", "link", &"y".repeat(300)]
    {
        assert!(Unsaved::derived(&folder, name).is_err(), "{name:?}");
    }
    Unsaved::derived(&folder, "..x").unwrap().with(b"1").unwrap().save().unwrap();
    assert_eq!(names(&folder), ["..x", "link"]);
    assert_eq!(names(dir.path()), ["in", "old"]);
}

#[test]
fn part_files_of_the_dead_go_and_those_of_the_living_stay() {
    let dir = tempfile::tempdir().unwrap();
    let (dead, alive) = (dir.path().join(".oslrun-dead.part"), dir.path().join(".oslrun-alive.part"));
    fs::write(&dead, "").unwrap();
    let writer = fs::File::create(&alive).unwrap();
    writer.lock().unwrap();
    symlink("/etc/passwd", dir.path().join(".oslrun-link.part")).unwrap();
    replace(&dir.path().join("a"), b"1").unwrap();
    assert_eq!(names(dir.path()), [".oslrun-alive.part", ".oslrun-link.part", "a"]);
}

#[test]
fn places_that_are_no_files() {
    let dir = tempfile::tempdir().unwrap();
    fifo(&dir.path().join("pipe"));
    let reason = |path: &Path| replace(path, b"1").unwrap_err().to_string();
    assert!(reason(&dir.path().join("pipe")).contains("cannot write to it"));
    assert!(reason(dir.path()).ends_with("it is a folder, not a file"));
    assert!(reason(Path::new("/dev/full")).contains("cannot write to it"));
    assert!(reason(&dir.path().join("none/a")).contains("there is no folder"));
    replace(Path::new("/dev/null"), b"1").unwrap();
}

#[test]
fn what_is_write_protected_stays() {
    let dir = tempfile::tempdir().unwrap();
    let guarded = dir.path().join("guarded");
    fs::write(&guarded, "old").unwrap();
    symlink("guarded", dir.path().join("link")).unwrap();
    let mut permissions = fs::metadata(&guarded).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&guarded, permissions).unwrap();
    for name in ["guarded", "link"] {
        let error = replace(&dir.path().join(name), b"new").unwrap_err();
        assert!(matches!(error.error, FileError::Protected), "{error}");
        assert!(Unsaved::derived(dir.path(), name).is_err());
    }
    assert_eq!(fs::read_to_string(&guarded).unwrap(), "old");
}

#[test]
fn links_to_nothing_are_followed() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("sub")).unwrap();
    symlink("second", dir.path().join("first")).unwrap();
    symlink("sub/new", dir.path().join("second")).unwrap();
    symlink("none/new", dir.path().join("lost")).unwrap();
    replace(&dir.path().join("first"), b"1").unwrap();
    assert_eq!(fs::read_to_string(dir.path().join("sub/new")).unwrap(), "1");
    assert!(fs::symlink_metadata(dir.path().join("second")).unwrap().is_symlink());
    assert!(replace(&dir.path().join("lost"), b"1").is_err());
}

#[test]
fn only_existing_files_below_a_root_are_replaced_as_a_whole() {
    let (dir, inside, roots) = place();
    symlink("sub/b", inside.join("good")).unwrap();
    symlink(dir.path().join("secret"), inside.join("bad")).unwrap();
    symlink("..", inside.join("up")).unwrap();
    fs::write(inside.join(".hidden"), "hidden").unwrap();
    fs::write(inside.join("guarded"), "guarded").unwrap();
    let mut permissions = fs::metadata(inside.join("guarded")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(inside.join("guarded"), permissions).unwrap();
    let put = |name: &str| {
        let path = inside.join(name);
        assert_eq!(roots.may_replace(&path).is_ok(), Unsaved::existing(&roots, &path).is_ok(), "{name}");
        Unsaved::existing(&roots, &path).and_then(|file| file.with(b"new")).and_then(Unsaved::save)
    };
    for (name, why) in [
        ("../secret", OUTSIDE),
        ("bad", OUTSIDE),
        ("up/secret", OUTSIDE),
        ("missing", MISSING),
        ("sub", "it is a folder, not a file"),
        (".hidden", "names that begin with a dot are not written"),
        ("guarded", "it is write-protected"),
    ] {
        assert_eq!(put(name).unwrap_err().error.to_string(), why, "{name}");
    }
    put("a").unwrap();
    put("good").unwrap();
    let text = |path: PathBuf| fs::read_to_string(path).unwrap();
    assert_eq!([text(inside.join("a")), text(inside.join("sub/b"))], ["new", "new"]);
    assert!(fs::symlink_metadata(inside.join("good")).unwrap().is_symlink(), "the link stays");
    assert_eq!(text(dir.path().join("secret")), "secret");
    assert_eq!(text(inside.join("guarded")), "guarded");
    assert!(!inside.join("missing").exists());
    // A file that is dropped before it is saved changes nothing.
    drop(Unsaved::existing(&roots, &inside.join("a")).unwrap().with(b"newer").unwrap());
    assert_eq!(text(inside.join("a")), "new");
    assert!(names(&inside).iter().all(|name| !name.ends_with(".part")));
}
