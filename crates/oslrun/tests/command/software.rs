//! The name of the program in the pictures that it writes.

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
fn pictures_name_the_program_and_nothing_else() {
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
        assert!(!contains(&bytes, b"s.osl"), "{line}");
        assert!(!read_image(&folder.join(name)).unwrap().samples.is_empty(), "{line}");
    }
    // Other commands with the same picture write the same file.
    let first = written(folder, "@/s.osl -g 8x4 -o @/a.png", "a.png");
    assert_eq!(written(folder, "@/s.osl -g 8x4 -p k=1 --threads 1 -o @/b.png", "b.png"), first);
}
