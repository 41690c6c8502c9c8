//! The limits of `scenes`.

use crate::{Folder, Said, Tripped};
use osl_limits::{Limits, Row};

pub(crate) const TRIPPED: Tripped = &[
    ("scenes.files", |row| refused(row, 1)),
    ("scenes.file_depth", |row| refused(row, 0)),
    ("scenes.bytes", |row| refused(row, 10)),
    ("scenes.elements", |row| refused(row, 5)),
    ("scenes.nodes", |row| refused(row, 1)),
    ("scenes.node_depth", |row| refused(row, 1)),
    ("scenes.messages", messages),
    ("scenes.corners", |row| refused(row, 2)),
    ("scenes.subdivisions", |row| subdivided(row, 1)),
    ("scenes.triangles", |row| refused(row, 5)),
    ("scenes.pixel_triangles", |row| subdivided(row, 1)),
    ("scenes.pixels", |row| refused(row, 10)),
    ("scenes.shapes", shapes),
    ("scenes.xml_depth", xml_depth),
    ("scenes.background", background),
];

/// A scene of a square that is subdivided and a sphere that is displaced, with a material of two nodes, in two files.
fn scene() -> Folder {
    Folder::with(&[
        (
            "a.ass",
            b"options\n{\n xres 4\n yres 4\n AA_samples 1\n}\npersp_camera\n{\n name c\n position 0 0 5\n look_at 0 0 0\n}\n\
              include \"b.ass\"\n\
              polymesh\n{\n name p\n nsides 1 1 UINT 4\n vidxs 4 1 UINT 0 1 2 3\n\
              vlist 4 1 POINT -1 -1 0 1 -1 0 1 1 0 -1 1 0\n subdiv_type catclark\n subdiv_iterations 2\n shader m\n}\n",
        ),
        (
            "b.ass",
            b"sphere\n{\n name s\n radius 0.5\n shader m\n disp_map d\n unknown 1\n}\n\
              look\n{\n name m\n c n\n unknown 2\n}\nlook\n{\n name n\n}\nlift\n{\n name d\n}\n",
        ),
        ("look.osl", b"shader look(color c = 0.5, output color o = 0) { o = c * 0.5; }"),
        ("lift.osl", b"shader lift(output float o = 0) { o = 0.01 * u; }"),
    ])
}

fn render(folder: &Folder, row: &Row, n: u64) -> Said {
    folder.run(&["render", "a.ass", "-o", "a.exr", "--limit", &format!("{}={n}", row.name)])
}

fn refused(row: &Row, n: u64) {
    let folder = scene();
    render(&folder, row, row.default).succeeds();
    render(&folder, row, n).fails_with(row);
}

/// The scene is rendered, with coarser surfaces.
fn subdivided(row: &Row, n: u64) {
    let folder = scene();
    let said = render(&folder, row, n);
    said.succeeds();
    assert!(row.name.ends_with("pixel_triangles") || said.err.contains(row.error), "{}", said.err);
}

fn messages(row: &Row) {
    let folder = scene();
    let count = |said: Said| said.err.matches("warning").count();
    assert!(count(render(&folder, row, row.default)) > count(render(&folder, row, 1)));
}

/// The reference's tool has its own options; a scene reaches its limits as they are.
fn testrender(text: &str) -> Said {
    let folder = Folder::with(&[("a.xml", text.as_bytes())]);
    folder.run(&["testrender", "-r", "2", "2", "a.xml", "a.exr"])
}

fn shapes(row: &Row) {
    let sphere = "<Sphere center=\"0,0,0\" radius=\"1\"/>".repeat(row.default as usize + 1);
    let said = testrender(&format!("<World>{sphere}</World>"));
    assert!(said.err.contains(row.error) || said.out.contains(row.error), "{}\n{}", said.out, said.err);
}

fn xml_depth(row: &Row) {
    let said = testrender(&"<a>".repeat(row.default as usize + 1));
    assert!(said.err.contains(row.error) || said.out.contains(row.error), "{}\n{}", said.out, said.err);
}

fn background(row: &Row) {
    let text = "<World><Background resolution=\"100000\"/></World>";
    let scene = osl_scene::testrender::scene::read(text, &Limits::default()).unwrap();
    assert_eq!(scene.background.unwrap().resolution as u64, row.default);
}
