//! The command `oslrun fmt`: the files that it writes, lists, or leaves unchanged.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const UGLY: &str = "shader s(output float a=1){a=2 ;} // end\n";
const TIDY: &str = "shader s(output float a = 1) {\n    a = 2;\n} // end\n";
const BROKEN: &str = "shader s( {a=2 ;}\n";
const SENSELESS: &str = "shader s( ) { a b c ; }\n";

/// A folder with files in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new(files: &[(&str, &str)]) -> Place {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(dir.path().join(name), text).unwrap();
        }
        Place(dir)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path().join(name)).unwrap()
    }

    /// Runs `oslrun fmt` in the folder; afterwards the folder must contain no other files.
    fn fmt(&self, args: &[&str], stdin: &str) -> Output {
        let count = || std::fs::read_dir(self.path()).unwrap().count();
        let before = count();
        let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
        command.arg("fmt").args(args).current_dir(self.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // A command that does not read its input may have closed it already.
        let _ = child.stdin.take().unwrap().write_all(stdin.as_bytes());
        let output = child.wait_with_output().unwrap();
        assert_eq!(count(), before);
        output
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn files_are_written_in_place() {
    let place = Place::new(&[("ugly.osl", UGLY), ("tidy.osl", TIDY)]);
    let time = |name: &str| std::fs::metadata(place.path().join(name)).unwrap().modified().unwrap();
    let old = time("tidy.osl");
    let output = place.fmt(&["ugly.osl", "tidy.osl"], "");
    assert_eq!(
        (output.status.code(), text(&output.stdout), text(&output.stderr)),
        (Some(0), "".into(), "".into())
    );
    assert_eq!(place.read("ugly.osl"), TIDY);
    assert_eq!(place.read("tidy.osl"), TIDY);
    assert_eq!(time("tidy.osl"), old, "what is tidy is not written");
}

#[test]
fn check_lists_what_would_change_and_writes_nothing() {
    let place = Place::new(&[("ugly.osl", UGLY), ("tidy.osl", TIDY)]);
    let output = place.fmt(&["--check", "ugly.osl", "tidy.osl"], "");
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(1), "ugly.osl\n".into()));
    assert_eq!(place.read("ugly.osl"), UGLY);
    let output = place.fmt(&["--check", "tidy.osl"], "");
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(0), "".into()));
    let output = place.fmt(&["--check", "--diff", "ugly.osl"], "");
    let shown = text(&output.stdout);
    assert!(shown.contains("-shader s(output float a=1){a=2 ;} // end\n"), "{shown}");
    assert!(shown.contains("+    a = 2;\n"), "{shown}");
}

#[test]
fn a_dash_stands_for_the_standard_streams() {
    let place = Place::new(&[]);
    let output = place.fmt(&["-"], UGLY);
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(0), TIDY.into()));
    let output = place.fmt(&["-"], TIDY);
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(0), TIDY.into()));
    let output = place.fmt(&["--check", "-"], UGLY);
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(1), "<standard input>\n".into()));
    for bad in [BROKEN, SENSELESS] {
        let output = place.fmt(&["-"], bad);
        assert_eq!((output.status.code(), text(&output.stdout)), (Some(1), "".into()));
        assert!(text(&output.stderr).contains("error[E01"), "{}", text(&output.stderr));
    }
}

#[test]
fn what_cannot_be_formatted_is_left_alone() {
    let place = Place::new(&[("broken.osl", BROKEN), ("senseless.osl", SENSELESS), ("ugly.osl", UGLY)]);
    std::fs::write(place.path().join("bytes.osl"), [0xff, 0xfe, 0]).unwrap();
    let output = place.fmt(&["broken.osl", "senseless.osl", "bytes.osl", "none.osl", "ugly.osl"], "");
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for words in
        ["--> broken.osl:1", "--> senseless.osl:1", "cannot read bytes.osl: it is not text", "none.osl"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_eq!(place.read("broken.osl"), BROKEN);
    assert_eq!(place.read("senseless.osl"), SENSELESS);
    assert_eq!(place.read("ugly.osl"), TIDY, "the others have their turn");
}

#[test]
fn includes_and_defines_say_whether_it_parses() {
    let main = "#include \"types.h\"\nshader s(TYPE a=1,output float b=a){b=MORE;}\n";
    let place = Place::new(&[("main.osl", main), ("types.h", "#define TYPE float\n")]);
    let output = place.fmt(&["-D", "MORE=a+1", "main.osl"], "");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let tidy = "#include \"types.h\"\nshader s(TYPE a = 1, output float b = a) {\n    b = MORE;\n}\n";
    assert_eq!(place.read("main.osl"), tidy);
    assert_eq!(place.fmt(&["types.h"], "").status.code(), Some(0));
    assert_eq!(place.fmt(&[], "").status.code(), Some(2));
    assert_eq!(place.fmt(&["--diff", "main.osl"], "").status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn links_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let place = Place::new(&[("ugly.osl", UGLY)]);
    let file = place.path().join("ugly.osl");
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o640)).unwrap();
    symlink("ugly.osl", place.path().join("link.osl")).unwrap();
    assert_eq!(place.fmt(&["link.osl"], "").status.code(), Some(0));
    assert!(place.path().join("link.osl").is_symlink());
    assert_eq!(place.read("ugly.osl"), TIDY);
    assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
}
