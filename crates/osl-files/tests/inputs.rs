//! An output does not replace a file that was read. The rule is one of the process, so that these tests have
//! a process of their own.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, reason = "a test fails by panicking")]

use osl_files::{Roots, Unsaved, forget_inputs, is_same, open_named, protect_inputs, replace, rewrite};
use std::fs;

#[test]
fn an_input_is_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    for name in ["early", "shader", "texture", "late", "other"] {
        fs::write(path(name), name).unwrap();
    }
    std::os::unix::fs::symlink("shader", path("link")).unwrap();
    fs::hard_link(path("shader"), path("second")).unwrap();
    assert!(is_same(&path("shader"), &path("link")) && is_same(&path("shader"), &path("second")));
    assert!(!is_same(&path("shader"), &path("other")) && !is_same(&path("none"), &path("none")));

    open_named(&path("early")).unwrap();
    replace(&path("early"), b"new").unwrap();
    protect_inputs();
    open_named(&path("shader")).unwrap();
    Roots::new([dir.path()]).open(&path("texture")).unwrap();
    for name in ["shader", "link", "second", "texture"] {
        let why = replace(&path(name), b"new").unwrap_err().error.to_string();
        assert_eq!(why, "this would replace a file that is read: name another one", "{name}");
    }
    // The file is read after the output was begun.
    let begun = Unsaved::new(&path("late")).unwrap().with(b"new").unwrap();
    open_named(&path("late")).unwrap();
    begun.save().unwrap_err();
    for name in ["shader", "texture", "late"] {
        assert_eq!(fs::read_to_string(path(name)).unwrap(), name);
    }

    replace(&path("other"), b"new").unwrap();
    rewrite(&path("shader"), b"new").unwrap();
    forget_inputs();
    replace(&path("texture"), b"new").unwrap();
    for name in ["other", "shader", "texture"] {
        assert_eq!(fs::read_to_string(path(name)).unwrap(), "new");
    }
    assert!(
        fs::read_dir(dir.path()).unwrap().all(|entry| !entry
            .unwrap()
            .path()
            .to_string_lossy()
            .ends_with(".part"))
    );
}
