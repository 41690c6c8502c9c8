//! Files that a shader, group, scene or texture names are opened only below the folders that the user gave,
//! and an output file is either old or new, never incomplete. All tests use one table of tricks.
//!
//! `reads` and `writes` contain the ways to open files; `killed` ends runs at random moments.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod killed;
mod reads;
mod writes;

use std::ffi::OsStr;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Text that no output may contain: every file outside contains it.
const SECRET: &str = "sesame";

/// Maximum time of a command, even on a busy machine without optimisation.
const PATIENCE: Duration = Duration::from_secs(60);

/// A working folder with files of one extension, and a neighbouring folder that must not be accessed.
struct Place {
    dir: tempfile::TempDir,
    ending: &'static str,
}

impl Place {
    /// `secret` is the content of the file outside, `good` that of a file that may be opened.
    fn new(ending: &'static str, secret: &[u8], good: &[u8]) -> Place {
        let place = Place { dir: tempfile::tempdir().unwrap(), ending };
        std::fs::create_dir_all(place.project().join("sub")).unwrap();
        std::fs::create_dir(place.outside()).unwrap();
        std::fs::write(place.outside().join(format!("secret.{ending}")), secret).unwrap();
        let work = |name: &str| place.project().join(format!("{name}.{ending}"));
        std::fs::write(work("good"), good).unwrap();
        symlink(place.outside().join(format!("secret.{ending}")), work("link")).unwrap();
        symlink(place.outside().join(format!("none.{ending}")), work("dangling")).unwrap();
        symlink(place.outside(), place.project().join("folder")).unwrap();
        symlink(format!("loop.{ending}"), work("loop")).unwrap();
        std::fs::create_dir(work("dir")).unwrap();
        assert!(Command::new("mkfifo").arg(work("pipe")).status().unwrap().success());
        place
    }

    fn project(&self) -> PathBuf {
        self.dir.path().join("project")
    }

    fn outside(&self) -> PathBuf {
        self.dir.path().join("outside")
    }

    /// Names that lead outside, to something that is not a file, or to nothing.
    fn tricks(&self) -> Vec<String> {
        let end = self.ending;
        let mut names: Vec<String> = [
            "../outside/secret.E",
            "../outside/none.E",
            "sub/../../outside/secret.E",
            "./.././outside/secret.E",
            "link.E",
            "folder/secret.E",
            "folder/none.E",
            "folder/../outside/secret.E",
            "dangling.E",
            "loop.E",
            "dir.E",
            "pipe.E",
            "GOOD.E",
            "good.E.",
            "good.E/",
            "good.E/x.E",
            "",
            ".",
            "..",
            "/",
            "/dev/zero",
            "/dev/stdin",
            "/proc/self/fd/0",
            "/proc/self/environ",
            "/etc/passwd",
        ]
        .map(|name| name.replace(".E", &format!(".{end}")))
        .into();
        names.push(self.outside().join(format!("secret.{end}")).display().to_string());
        names.push("x".repeat(300) + "." + end);
        names.push("x/".repeat(3000) + "a." + end);
        names
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.project().join(name), text).unwrap();
    }

    /// Runs a command, which must end by itself and must not print the secret.
    fn run<S: AsRef<OsStr>>(&self, args: &[S]) -> Said {
        let said = Said::of(oslrun().args(args).current_dir(self.project()));
        assert!(!said.text.contains(SECRET), "{}", said.text);
        assert!(matches!(said.status.code(), Some(0 | 1)), "{:?} {}", said.status, said.text);
        said
    }

    /// Checks that the files outside are unchanged.
    fn outside_is_untouched(&self, why: &str) {
        let names = names(&self.outside());
        assert_eq!(names, [format!("secret.{}", self.ending)], "{why}");
    }
}

fn oslrun() -> Command {
    Command::new(env!("CARGO_BIN_EXE_oslrun"))
}

/// The output of a command, on both streams.
struct Said {
    status: ExitStatus,
    text: String,
}

impl Said {
    /// Runs a command, which must end.
    fn of(command: &mut Command) -> Said {
        let streams = tempfile::tempdir().unwrap();
        let file = |name: &str| std::fs::File::create(streams.path().join(name)).unwrap();
        let mut child = command.stdin(Stdio::null()).stdout(file("out")).stderr(file("err")).spawn().unwrap();
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if start.elapsed() > PATIENCE {
                child.kill().unwrap();
                panic!("it does not end: {command:?}");
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let text = |name: &str| {
            String::from_utf8_lossy(&std::fs::read(streams.path().join(name)).unwrap()).into_owned()
        };
        Said { status, text: text("out") + &text("err") }
    }
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
