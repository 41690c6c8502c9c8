//! Ways to write files: `fprintf`, names derived from a shader's name, sets of files, the standard output.

use super::{Place, Said, names, oslrun};
use std::fs::{self, File};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const GOOD: &str = "shader a(output float o = 0) { o = u; }\n";

#[test]
fn fprintf_stays_in_the_folder() {
    let place = Place::new("txt", b"sesame", b"old\n");
    place.write(
        "a.osl",
        "shader a(string f = \"\", output float o = 0) { fprintf(f, \"%s\", \"new\\n\"); o = u; }",
    );
    let print = |name: &str| place.run(&["a.osl", "-g", "1x1", "-p", &format!("f={name}")]);
    // Files with unusual names are still files in the folder.
    let odd = ["GOOD.txt", "good.txt.", "good.txt/"];
    for name in place.tricks().into_iter().filter(|name| !odd.contains(&name.as_str())) {
        let said = print(&name);
        assert_eq!(said.status.code(), Some(1), "{name}: {}", said.text);
        assert!(said.text.contains("cannot append to"), "{name}: {}", said.text);
    }
    fs::create_dir_all(place.project().join(".git/hooks")).unwrap();
    for name in [".bashrc", ".git/hooks/post-commit", "sub/.x"] {
        assert!(print(name).text.contains("begin with a dot"), "{name}");
    }
    // A command without an option that admits the file names none.
    let said = place.run(&["testshade", "-g", "1", "1", "--param", "f", "../x.txt", "a.osl"]);
    assert!(said.text.contains("cannot append to") && !said.text.contains("--allow-files"), "{}", said.text);
    assert!(print("../x.txt").text.contains("--allow-files"));
    place.outside_is_untouched("fprintf");
    assert_eq!(fs::read(place.outside().join("secret.txt")).unwrap(), b"sesame");
    assert_eq!(names(&place.project().join("sub")), Vec::<String>::new());
    for name in ["good.txt", "sub/new.txt"] {
        assert_eq!(print(name).status.code(), Some(0), "{name}");
    }
    assert_eq!(fs::read_to_string(place.project().join("good.txt")).unwrap(), "old\nnew\n");
    assert_eq!(fs::read_to_string(place.project().join("sub/new.txt")).unwrap(), "new\n");
}

#[test]
fn names_of_outputs_cannot_climb() {
    let place = Place::new("png", b"", b"");
    for name in ["../x", "/../../outside/x", "x/../../../outside/x", "a/b", "a\\b"] {
        let shader = format!(
            "OpenShadingLanguage 1.00\nshader a\noparam\tfloat\t{name}\t0\t\t%read{{0,0}} %write{{0,0}}\n\
             oparam\tfloat\tz\t0\t\t%read{{0,0}} %write{{0,0}}\ncode ___main___\n\tend\n"
        );
        place.write("a.oso", shader);
        let said = place.run(&["a.oso", "-g", "2x2", "-o", "o.png"]);
        assert_eq!(said.status.code(), Some(1), "{name}: {}", said.text);
    }
    place.outside_is_untouched("names of outputs");
    assert_eq!(names(&place.project()).iter().filter(|name| name.starts_with("o.")).count(), 0);
    // A link with the name of a derived file.
    place.write("a.osl", "shader a(output float x = 0, output float y = 0) { x = u; y = v; }");
    symlink("../outside/x", place.project().join("a.oso2")).unwrap();
    symlink("../outside/secret.png", place.project().join("o.y.png")).unwrap();
    let said = place.run(&["a.osl", "-g", "2x2", "-o", "o.png"]);
    assert_eq!(said.status.code(), Some(1), "{}", said.text);
    assert!(!place.project().join("o.x.png").exists(), "the set is all or none");
    assert_eq!(fs::read(place.outside().join("secret.png")).unwrap(), b"");
}

#[test]
fn a_set_of_images_is_all_or_none() {
    let place = Place::new("png", b"", b"");
    let long = "y".repeat(300);
    place.write("a.osl", format!("shader a(output float x = 0, output float {long} = 0) {{ x = u; }}"));
    place.write("a.x.png", "old");
    let said = place.run(&["a.osl", "-g", "4x4", "-o", "a.png"]);
    assert_eq!(said.status.code(), Some(1), "{}", said.text);
    assert_eq!(fs::read(place.project().join("a.x.png")).unwrap(), b"old");
    place.write("a.osl", "shader a(output float x = 0, output float y = 0) { x = u; y = v; }");
    fs::create_dir(place.project().join("a.y.png")).unwrap();
    let tool = place.run(&["testshade", "-g", "2", "2", "-o", "x", "a.x.png", "-o", "y", "a.y.png", "a"]);
    assert_eq!(tool.status.code(), Some(1), "{}", tool.text);
    assert_eq!(place.run(&["a.osl", "-g", "4x4", "-o", "a.png"]).status.code(), Some(1));
    assert_eq!(fs::read(place.project().join("a.x.png")).unwrap(), b"old");
    fs::remove_dir(place.project().join("a.y.png")).unwrap();
    assert_eq!(place.run(&["a.osl", "-g", "4x4", "-o", "a.png"]).status.code(), Some(0));
    assert_ne!(fs::read(place.project().join("a.x.png")).unwrap(), b"old");
    assert!(names(&place.project()).iter().all(|name| !name.starts_with(".oslrun")));
}

#[test]
fn places_that_cannot_be_written() {
    let place = Place::new("exr", b"", b"");
    place.write("a.osl", GOOD);
    let pipe = place.project().join("pipe.exr").display().to_string();
    for target in ["dir.exr", "none/a.exr", "/dev/full", &pipe, "loop.exr/x.exr"] {
        let target = if target == "/dev/full" { "full.exr" } else { target };
        if target == "full.exr" {
            symlink("/dev/full", place.project().join(target)).unwrap();
        }
        let said = place.run(&["a.osl", "-g", "2x2", "-o", target]);
        assert_eq!(said.status.code(), Some(1), "{target}: {}", said.text);
    }
    let locked = place.project().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    // The superuser may write everywhere.
    if File::create(locked.join("probe")).is_err() {
        assert_eq!(place.run(&["a.osl", "-g", "2x2", "-o", "locked/a.exr"]).status.code(), Some(1));
    }
}

#[test]
fn a_full_disk_is_an_error_and_a_closed_pipe_is_none() {
    let place = Place::new("osl", b"", GOOD.as_bytes());
    place.write("p.osl", "shader p(output float o = 0) { o = u; printf(\"%g\\n\", u); }");
    for args in [
        "compile good.osl -o -",
        "info good.osl",
        "info --json good.osl",
        "doc",
        "doc sin",
        "explain good.osl --at 0,0 -g 2x2",
        "explain-error E0201",
        "ir good.osl",
        "p.osl -g 4x4",
        "p.osl -g 4x4 -o a.exr",
        "oslinfo good.osl",
        "--help",
        "--version",
    ] {
        let command = || {
            let mut command = oslrun();
            command.args(args.split(' ')).current_dir(place.project()).stdin(Stdio::null());
            command
        };
        let full = command().stdout(File::create("/dev/full").unwrap()).output().unwrap();
        assert_eq!(full.status.code(), Some(1), "{args}");
        let said = String::from_utf8_lossy(&full.stderr).into_owned();
        assert!(said.contains("cannot write to the standard output"), "{args}: {said}");
        assert!(!place.project().join("a.exr").exists(), "{args}");

        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let closed = command().stdout(writer).output().unwrap();
        assert_eq!(closed.status.code(), Some(0), "{args}");
        assert_eq!(String::from_utf8_lossy(&closed.stderr), "", "{args}");
        let _ = fs::remove_file(place.project().join("a.exr"));
    }
    let mut format = oslrun();
    format.args(["fmt", "-"]).stdin(File::open(place.project().join("good.osl")).unwrap());
    let full = format.stdout(File::create("/dev/full").unwrap()).output().unwrap();
    assert_eq!(full.status.code(), Some(1));
}

#[test]
fn nothing_of_the_user_is_needed() {
    let place = Place::new("osl", b"", GOOD.as_bytes());
    let said = Said::of(
        oslrun().args(["good.osl", "-g", "4x4", "-o", "a.exr"]).env_clear().current_dir(place.project()),
    );
    assert!(said.status.success(), "{}", said.text);
}

#[test]
fn two_processes_may_write_the_same_file() {
    let place = Place::new("osl", b"", GOOD.as_bytes());
    let start = || {
        let mut command = oslrun();
        let args = ["good.osl", "-g", "64x64", "-o", "a.exr"];
        command.args(args).current_dir(place.project()).stdout(Stdio::null()).spawn().unwrap()
    };
    let mut children: Vec<_> = (0..4).map(|_| start()).collect();
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    assert!(osl_image::read_image(&place.project().join("a.exr")).is_ok());
    assert!(names(&place.project()).iter().all(|name| !name.starts_with(".oslrun")));
}

#[test]
fn a_signal_removes_what_is_not_complete() {
    // Where the caller ignores the signal, as scripts do for background commands, the child would too. A
    // handler of this process becomes the default action in the child.
    let always = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    signal_hook::flag::register_conditional_shutdown(signal_hook::consts::SIGINT, 130, always).unwrap();
    for signal in ["HUP", "INT", "QUIT", "TERM"] {
        let place = Place::new(
            "osl",
            b"",
            b"shader a(output float o = 0) { for (int i = 0; i < 2000; i++) o += sin(u * i); }",
        );
        place.write("a.exr", "old");
        let args = ["good.osl", "-g", "2048x2048", "-o", "a.exr"];
        let mut child =
            oslrun().args(args).current_dir(place.project()).stdout(Stdio::null()).spawn().unwrap();
        let start = Instant::now();
        let is_part = |name: &String| name.starts_with(".oslrun-");
        while !names(&place.project()).iter().any(is_part) {
            assert!(start.elapsed() < super::PATIENCE && child.try_wait().unwrap().is_none());
            std::thread::sleep(Duration::from_millis(2));
        }
        let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let status = child.wait().unwrap();
        assert_eq!(status.code(), None, "it ends by the signal");
        assert!(!names(&place.project()).iter().any(is_part), "{signal}");
        assert_eq!(fs::read(place.project().join("a.exr")).unwrap(), b"old");
    }
}

/// Small limits of the system end a command with a message, or have no effect.
#[cfg(target_os = "linux")]
#[test]
fn limits_of_the_system() {
    let place = Place::new("osl", b"", GOOD.as_bytes());
    let program = env!("CARGO_BIN_EXE_oslrun");
    let run = |limits: &str, threads: &str| {
        let script = format!("{limits}; exec '{program}' good.osl -g 64x64 -o a.exr");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(place.project()).env("RAYON_NUM_THREADS", threads);
        Said::of(&mut shell)
    };
    let small_stack = run("ulimit -s 128", "2");
    assert!(small_stack.status.success(), "{}", small_stack.text);
    for (limits, threads) in [("ulimit -v 65536", "2"), ("ulimit -v 200000", "64")] {
        let said = run(limits, threads);
        assert_eq!(said.status.code(), Some(1), "{}", said.text);
        assert!(said.text.starts_with("error: ") && said.text.lines().count() == 1, "{}", said.text);
    }
}
