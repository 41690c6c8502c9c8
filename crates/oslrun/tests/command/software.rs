//! The name of the program in the pictures that it writes, and the command in EXR files.

use crate::in_process::oslrun_at;
use osl_image::read_image;
use std::path::Path;

const SHADER: &str = "shader s(float k = 1, output color c = 0) { c = color(u, v, k); }";

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// The file that a command line writes.
fn written(folder: &Path, line: &str, name: &str) -> Vec<u8> {
    let (code, _, err) = oslrun_at(folder, line);
    assert_eq!(code, 0, "{line}: {err}");
    std::fs::read(folder.join(name)).unwrap()
}

#[test]
fn pictures_name_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("s.osl"), SHADER).unwrap();
    let program = concat!("oslrun ", env!("CARGO_PKG_VERSION"));
    let png = format!("\0\0\0{}tEXtSoftware\0{program}", char::from(9 + program.len() as u8));
    let exr = format!("software\0string\0{}\0\0\0{program}", char::from(program.len() as u8));
    for (line, name) in [
        ("@/s.osl -g 8x4 -o @/a.png", "a.png"),
        ("@/s.osl -g 8x4 -o @/a.exr", "a.exr"),
        ("@/s.osl -g 8x8 --on sphere -o @/on.exr", "on.exr"),
        ("@/s.osl -g 16x16 --preview -o @/lit.png", "lit.png"),
        ("@/s.osl -g 16x16 --preview -o @/lit.exr", "lit.exr"),
        ("@/s.osl -g 8x4 -p k=0:1:2 -o @/sheet.png", "sheet.png"),
        ("compare @/a.exr @/a.exr -o @/minus.exr", "minus.exr"),
        ("compare @/a.exr @/a.exr -o @/heat.png", "heat.png"),
    ] {
        let bytes = written(folder, line, name);
        let expected = if name.ends_with("png") { &png } else { &exr };
        assert!(contains(&bytes, expected.as_bytes()), "{line}");
        let has_command = name.ends_with("exr") && !line.starts_with("compare");
        assert_eq!(contains(&bytes, b"s.osl"), has_command, "{line}");
        assert!(!contains(&bytes, folder.to_string_lossy().as_bytes()), "{line}: no folder");
        assert!(!read_image(&folder.join(name)).unwrap().samples.is_empty(), "{line}");
    }
    // Other commands with the same picture write the same file.
    let first = written(folder, "@/s.osl -g 8x4 -o @/a.png", "a.png");
    assert_eq!(written(folder, "@/s.osl -g 8x4 -p k=1 --threads 1 -o @/b.png", "b.png"), first);
}

/// The text of an attribute of an EXR file.
fn attribute<'a>(bytes: &'a [u8], name: &str) -> Option<&'a str> {
    let start = format!("{name}\0string\0");
    let at = bytes.windows(start.len()).position(|window| window == start.as_bytes())? + start.len();
    let length = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    std::str::from_utf8(&bytes[at + 4..at + 4 + length]).ok()
}

#[test]
fn exr_files_have_the_command_without_folders() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("s.osl"), SHADER).unwrap();
    let scene = "options\n{\n xres 8\n yres 4\n AA_samples 1\n}\npersp_camera\n{\n name c\n position 0 0 5\n}\n\
                 lambert\n{\n name mat\n}\nsphere\n{\n name s\n radius 1\n shader mat\n}\n";
    std::fs::write(folder.join("a.ass"), scene).unwrap();
    let command = |line: &str, name: &str| {
        attribute(&written(folder, line, name), "oslrun:command").map(str::to_string)
    };
    let said = command("@/s.osl -g 8x4 --threads 2 -p k=0.5 --texture-path @ --stats -o @/a.exr", "a.exr");
    assert_eq!(said.as_deref(), Some("oslrun s.osl -g 8x4 -p k=0.5"));
    let said = command("@/s.osl -g 16x16 --preview --samples 1 -o @/a.exr", "a.exr");
    assert_eq!(said.as_deref(), Some("oslrun s.osl -g 16x16 --preview --samples 1"));
    let said = command("render @/a.ass -p mat.Kd=0.5 -o @/a.exr", "a.exr");
    assert_eq!(said.as_deref(), Some("oslrun render a.ass -p mat.Kd=0.5"));
    assert_eq!(command("@/s.osl -g 8x4 --no-command -o @/a.exr", "a.exr"), None);
    // How the program is run changes no byte.
    let first = written(folder, "@/s.osl -g 8x4 -o @/a.exr", "a.exr");
    assert_eq!(written(folder, "@/s.osl -g 8x4 --threads 1 --batch 16 -o @/b.exr", "b.exr"), first);
    assert!(contains(&first, b"chromaticities\0chromaticities\0"), "a color");
}
