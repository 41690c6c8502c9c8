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
    ("scenes.samples", samples),
    ("scenes.bounces", bounces),
    ("scenes.printed", printed),
];

/// A scene of a square that is subdivided and a sphere that is displaced, with a material of two nodes, in
/// two files.
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

/// Checks that the scene is rendered with coarser surfaces.
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

fn testrender(row: &Row, text: &str, n: u64) {
    let folder = Folder::with(&[("a.xml", text.as_bytes())]);
    let limit = format!("{}={n}", row.name);
    folder.run(&["testrender", "-r", "2", "2", "a.xml", "a.exr", "--limit", &limit]).fails_with(row);
}

fn shapes(row: &Row) {
    let sphere = "<Sphere center=\"0,0,0\" radius=\"1\"/>";
    testrender(row, &format!("<World>{sphere}{sphere}</World>"), 1);
}

fn xml_depth(row: &Row) {
    testrender(row, "<a><a><a></a></a></a>", 2);
}

/// A scene of testrender: a ball inside a larger one, both bright mirrors, with shaders that print their
/// hits.
fn mirrors(more: &[&str]) -> (Said, Vec<u8>) {
    let text = "<World><Camera eye=\"0,0,4\" dir=\"0,0,-1\"/><ShaderGroup>shader s x;</ShaderGroup>\
                <Sphere center=\"0,0,0\" radius=\"1\"/><Sphere center=\"0,0,0\" radius=\"9\"/></World>";
    let shader = "surface s() { printf(\"met\\n\"); Ci = 0.3 * emission() + 0.5 * reflection(N); }";
    let folder = Folder::with(&[("a.xml", text.as_bytes()), ("s.osl", shader.as_bytes())]);
    let said = folder.run(&[&["testrender", "-r", "4", "4", "-aa", "2", "a.xml", "a.exr"], more].concat());
    said.succeeds();
    (said, std::fs::read(folder.path().join("a.exr")).unwrap())
}

fn met(said: &Said) -> usize {
    said.out.matches("met").count()
}

fn samples(row: &Row) {
    let limit = format!("{}=1", row.name);
    assert!(met(&mirrors(&[]).0) > 2 * met(&mirrors(&["--limit", &limit]).0));
    let folder = scene();
    let paths = |more: &[&str]| {
        let said =
            folder.run(&[&["render", "a.ass", "-o", "a.exr", "--samples", "9", "--stats"], more].concat());
        said.succeeds();
        said.err
    };
    assert!(paths(&[]).contains("144 paths"));
    assert!(paths(&["--limit", &limit]).contains("16 paths"));
}

fn bounces(row: &Row) {
    let (many, few) = (mirrors(&[]), mirrors(&["--limit", &format!("{}=1", row.name)]));
    assert!(met(&many.0) > met(&few.0) && many.1 != few.1);
}

fn printed(row: &Row) {
    let (all, some) = (mirrors(&[]), mirrors(&["--limit", &format!("{}=5", row.name)]));
    assert!(met(&all.0) > 5 && met(&some.0) == 5 && all.1 == some.1);
}

fn background(row: &Row) {
    let text = "<World><Background resolution=\"100000\"/></World>";
    let mut limits = Limits::default();
    let side = |limits: &Limits| {
        osl_scene::testrender::scene::read(text, limits).unwrap().background.unwrap().resolution as u64
    };
    assert_eq!(side(&limits), row.default);
    limits.scenes.background = 8;
    assert_eq!(side(&limits), 8);
}
