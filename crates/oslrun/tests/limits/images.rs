//! The limits of `images`.

use crate::{Folder, Said, Tripped};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[
    ("images.file_bytes", |row| too_much(row, "t.png", 10)),
    ("images.header_bytes", |row| too_much(row, "t.exr", 100)),
    ("images.samples", |row| too_much(row, "t.png", 10)),
    ("images.texture_memory", |row| too_much(row, "t.png", 100)),
    ("images.working_memory", working_memory),
    ("images.partial_samples", partial_samples),
    ("images.pages", pages),
    ("images.attributes", |row| attribute(row, 0)),
    ("images.attribute_length", |row| attribute(row, 3)),
    ("images.names", |row| forgotten(row, "no%d.png")),
    ("images.patterns", |row| forgotten(row, "no%d.<UDIM>.png")),
];

const LOOK: &str = "shader a(string f = \"\", int part = 0, output color o = 0) {\n\
                    o = (color)texture(f, u, v, \"subimage\", part);\n}\n";

/// A folder with pictures of 8 x 8 pixels and a shader that shows them.
fn pictures() -> Folder {
    let folder = Folder::with(&[("a.osl", LOOK.as_bytes()), ("t.tif", &two_pages()), ("p.exr", &part())]);
    std::fs::write(folder.path().join("b.osl"), "shader b(output color o = 0) { o = color(u, v, 0); }")
        .unwrap();
    for name in ["t.png", "t.exr"] {
        folder.run(&["b.osl", "-g", "8x8", "-o", name]).succeeds();
    }
    folder
}

fn look(folder: &Folder, name: &str, more: &[&str]) -> Said {
    let file = format!("f={name}");
    folder.run(&[&["a.osl", "-g", "2x2", "-p", &file], more].concat())
}

fn set(row: &Row, n: u64) -> String {
    format!("{}={n}", row.name)
}

/// Checks that a picture beyond a limit is an error that names the limit.
fn too_much(row: &Row, name: &str, n: u64) {
    let folder = pictures();
    let said = look(&folder, name, &[]);
    assert!(!said.err.contains("error"), "{}", said.err);
    let said = look(&folder, name, &["--limit", &set(row, n)]);
    assert!(said.err.contains(row.error), "{}", said.err);
}

fn working_memory(row: &Row) {
    let said = look(&pictures(), "t.png", &["--limit", "images.texture_memory=10k", "--limit", &set(row, 1)]);
    assert!(said.err.contains(row.error), "{}", said.err);
}

/// The mipmap levels of an image of 8 x 8 pixels, in a file that stores one level.
fn partial_samples(row: &Row) {
    let folder = pictures();
    let count = "shader c(output float o = 0) { int n; gettextureinfo(\"p.exr\", \"miplevels\", n); printf(\"%d\\n\", n); }";
    std::fs::write(folder.path().join("c.osl"), count).unwrap();
    let said = folder.run(&["c.osl", "-g", "1x1"]);
    assert!(said.out.contains('4'), "{}\n{}", said.out, said.err);
    let said = folder.run(&["c.osl", "-g", "1x1", "--limit", &set(row, 10)]);
    assert!(said.out.contains('1') && !said.out.contains('4'), "{}\n{}", said.out, said.err);
}

fn pages(row: &Row) {
    let folder = pictures();
    let said = look(&folder, "t.tif", &["-p", "part=1"]);
    assert!(!said.err.contains("error"), "{}", said.err);
    let said = look(&folder, "t.tif", &["-p", "part=1", "--limit", &set(row, 1)]);
    assert!(said.err.contains(row.error), "{}", said.err);
}

fn attribute(row: &Row, n: u64) {
    let folder = pictures();
    let ask = "shader c(output float o = 0) { string s = \"none\"; gettextureinfo(\"t.exr\", \"compression\", s); printf(\"%s\\n\", s); }";
    std::fs::write(folder.path().join("c.osl"), ask).unwrap();
    assert!(folder.run(&["c.osl", "-g", "1x1"]).out.contains("zip"));
    assert!(folder.run(&["c.osl", "-g", "1x1", "--limit", &set(row, n)]).out.contains("none"));
}

/// Names that were dropped are looked up again: nothing else changes.
fn forgotten(row: &Row, names: &str) {
    let folder = pictures();
    let ask = format!(
        "shader c(output float o = 0) {{ int e = 9; for (int i = 0; i < 3; i++) {{ \
         gettextureinfo(format(\"{names}\", i), \"exists\", e); printf(\"%d\\n\", e); }} \
         o = texture(\"t.png\", u, v) + texture(\"t.exr\", u, v); printf(\"%g\\n\", o); }}"
    );
    std::fs::write(folder.path().join("c.osl"), ask).unwrap();
    let usual = folder.run(&["c.osl", "-g", "2x2"]);
    usual.succeeds();
    let limited = folder.run(&["c.osl", "-g", "2x2", "--limit", &set(row, 1)]);
    assert_eq!((limited.code, limited.out), (usual.code, usual.out));
}

/// A TIFF of two pages of one pixel each.
fn two_pages() -> Vec<u8> {
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    for page in 0..2_u32 {
        let start = file.len() as u32;
        let tags: [(u16, u32); 9] = [
            (256, 1),
            (257, 1),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, start + 114),
            (277, 1),
            (278, 1),
            (279, 1),
        ];
        file.extend(9_u16.to_le_bytes());
        for (tag, value) in tags {
            file.extend([tag.to_le_bytes(), 4_u16.to_le_bytes()].concat());
            file.extend([1, value].map(u32::to_le_bytes).concat());
        }
        let next = if page == 0 { start + 116 } else { 0 };
        file.extend(next.to_le_bytes());
        file.extend([7, 0]);
    }
    file
}

/// An EXR that stores one pixel of an image of 8 x 8.
fn part() -> Vec<u8> {
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &(value.len() as u32).to_le_bytes(), value].concat()
    };
    let window = |last: i32| [0, 0, last, last].map(i32::to_le_bytes).concat();
    let channel = [b"Y\0".as_slice(), &[1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0]].concat();
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    file.extend(attribute("channels", "chlist", &channel));
    file.extend(attribute("compression", "compression", &[0]));
    file.extend(attribute("dataWindow", "box2i", &window(0)));
    file.extend(attribute("displayWindow", "box2i", &window(7)));
    file.extend(attribute("lineOrder", "lineOrder", &[0]));
    file.extend(attribute("pixelAspectRatio", "float", &1.0_f32.to_le_bytes()));
    file.extend(attribute("screenWindowCenter", "v2f", &[0; 8]));
    file.extend(attribute("screenWindowWidth", "float", &1.0_f32.to_le_bytes()));
    file.push(0);
    let block_at = file.len() as u64 + 8;
    file.extend(block_at.to_le_bytes());
    file.extend([[0; 4], 2_i32.to_le_bytes()].concat());
    file.extend([0, 0x3c]);
    file
}
