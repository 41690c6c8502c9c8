//! Text from a shader, a file name or the command line is only shown, never executed, by pages and terminals.
//! The text that a shader prints into a pipe is not changed.

use std::process::{Command, Output};

/// A name that contains an HTML element, closing quotes, and control sequences for a terminal.
const NAME: &str = "x<svg onload=alert(1)>\"'&]]>\u{1b}[2J\u{202e}.osl";

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(text: &str) -> Folder {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(NAME), text).unwrap();
        Folder(folder)
    }

    fn run(&self, args: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(self.0.path()).args(args).output().unwrap()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).unwrap()
    }
}

/// Checks that the only control characters are line breaks and tabs.
#[track_caller]
fn plain(text: &[u8]) {
    let text = String::from_utf8_lossy(text);
    let found = text.chars().find(|c| osl_syntax::escape::is_control(*c) && !matches!(c, '\n' | '\t'));
    assert_eq!(found, None, "{text:?}");
}

/// Checks that no part of the name is markup.
#[track_caller]
fn harmless(page: &str) {
    plain(page.as_bytes());
    assert!(!page.contains("<svg onload"), "{page}");
}

const BODY: &str = "shader s(float p = 1, output float o = 0) {\n\
    o = fmod(u * 1e7 * p, 1.0); // <script>alert(1)</script> \"'&]]>\n\
    if (u > 0.5) o += noise(P * 1e5);\n}\n";

#[test]
fn pages_hold_text() {
    let folder = Folder::with(BODY);
    let said = folder.run(&["stability", NAME, "--points", "4x4", "--html", "s.html"]);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let page = folder.read("s.html");
    harmless(&page);
    assert!(!page.contains("<script>"), "{page}");
    let said = folder.run(&["tradeoff", NAME, "-g", "8x8", "--html", "t.html"]);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    harmless(&folder.read("t.html"));
}

#[test]
fn flame_graphs_hold_text() {
    let folder = Folder::with(BODY);
    let said = folder.run(&[NAME, "-g", "8x8", "--profile=f.svg"]);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    plain(&said.stderr);
    let page = folder.read("f.svg");
    assert!(page.contains("s.osl") || page.contains(".osl"), "{page}");
    let own = page.replace('\r', "");
    harmless(&own);
    folder.run(&[NAME, "-g", "8x8", "--profile=f.folded"]);
    plain(folder.read("f.folded").as_bytes());
}

#[test]
fn messages_hold_text() {
    let broken = "shader s(output float o = 0) {\n  o = nobody; // \u{1b}[8m \u{9b}2J \u{202e} \u{7}\n  \
                  printf(\"%d\", \"\u{1b}]0;title\u{7}\");\n}\n";
    let folder = Folder::with(broken);
    for args in [
        vec!["check", NAME],
        vec![NAME, "-g", "2x2"],
        vec!["check", NAME, "--message-format", "json"],
        vec!["info", NAME],
        vec!["compile", NAME],
        vec!["explain", NAME],
        vec!["check", "there is none \u{1b}[2J\u{202e}"],
        vec!["--no-such-\u{1b}[2J\u{202e}"],
        vec!["doc", "\u{1b}[2J"],
        vec!["explain-error", "\u{1b}[2J"],
        vec!["check", NAME, "--limit", "\u{1b}[2J=1"],
    ] {
        let said = folder.run(&args);
        let err = String::from_utf8_lossy(&said.stderr).into_owned();
        assert!(!said.status.success() && !err.is_empty(), "{args:?}");
        if args.contains(&"json") {
            // JSON escapes control characters itself; other special characters are part of its text.
            assert!(!err.contains('\u{1b}') && !err.contains('\u{7}'), "{err:?}");
        } else {
            plain(&said.stderr);
        }
    }
}

#[test]
fn what_a_shader_says_is_shown_and_what_it_prints_is_kept() {
    let folder = Folder::with(
        "shader s(string t = \"\\033[2J\", output float o = 0) { printf(\"%s\\n\", t); error(\"%s\", t); warning(\"\\007\"); o = u; }\n",
    );
    let said = folder.run(&[NAME, "-g", "1x1"]);
    assert!(String::from_utf8_lossy(&said.stdout).contains("\u{1b}[2J\n"), "{said:?}");
    plain(&said.stderr);
    assert!(String::from_utf8_lossy(&said.stderr).contains("\\x1b[2J"), "{said:?}");
}
