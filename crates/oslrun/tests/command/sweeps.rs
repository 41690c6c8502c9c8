//! `-p radius=0.1:0.5:5`: sheets of pictures.

use crate::in_process::oslrun_at;
use osl_image::{ImageData, read_image};
use tempfile::TempDir;

const SHADER: &str = "shader s(float k = 1, int n = 1, color tint = 1, string word = \"\",
    output color c = 0, output float f = 0)
    { c = tint * k; f = k * n; if (u == 0 && v == 0) printf(\"%s\\n\", word); if (n > 2) warning(\"large\"); }";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), SHADER).unwrap();
    folder
}

fn image(folder: &TempDir, name: &str) -> ImageData {
    read_image(&folder.path().join(name)).unwrap()
}

/// The 8-bit values of a pixel.
fn pixel(image: &ImageData, (x, y): (usize, usize)) -> Vec<u8> {
    let n = image.channels.len();
    let at = (y * image.width + x) * n;
    image.samples[at..at + n].iter().map(|x| (x * 255.0).round() as u8).collect()
}

#[test]
fn one_parameter_makes_a_row() {
    let folder = folder();
    let (code, out, err) = oslrun_at(folder.path(), "@/s.osl -g 60x20 --outputs f -p k=0:1:3 -o @/row.png");
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.ends_with("wrote @/row.png: 3 pictures\n"), "{out}");
    let image = image(&folder, "row.png");
    // Gaps of 4 pixels, and a line of letters that are 8 pixels high.
    assert_eq!((image.width, image.height), (4 + 3 * 64, 16 + 24));
    let colors = |row: usize| [0, 1, 2].map(|at| pixel(&image, (4 + at * 64 + 30, row))[0]);
    assert_eq!(colors(16), [0, 128, 255]);
    assert_eq!(colors(35), [0, 128, 255]);
    assert_eq!(colors(36), [255; 3], "the paper");
    let ink = |columns: std::ops::Range<usize>| {
        columns.flat_map(|x| (0..16).map(move |y| (x, y))).filter(|at| pixel(&image, *at)[0] == 0).count()
    };
    assert!([4..64, 68..128, 132..192].map(ink).iter().all(|dots| *dots > 20), "labels");
}

#[test]
fn two_parameters_make_a_table() {
    let folder = folder();
    let (code, out, err) =
        oslrun_at(folder.path(), "@/s.osl -g 40x30 --outputs f -p k=0:0.25:2 -p n=1:4:4 -o @/table.png");
    assert_eq!(code, 0, "{err}");
    assert!(out.ends_with("wrote @/table.png: 8 pictures\n"), "{out}");
    assert_eq!(err.matches("large").count(), 1, "the same messages are printed once: {err}");
    let image = image(&folder, "table.png");
    // `n=1` is three letters wide.
    let (left, top) = (4 + 18 + 4, 16);
    assert_eq!((image.width, image.height), (left + 2 * 44, top + 4 * 34));
    for row in 0..4 {
        let at = |column: usize| pixel(&image, (left + column * 44 + 20, top + row * 34 + 15))[0];
        assert_eq!((at(0), at(1)), (0, ((row + 1) as f64 * 63.75).round() as u8), "row {row}");
    }
}

#[test]
fn triples_sweep_and_all_pictures_have_the_same_colors() {
    let folder = folder();
    let (code, _, err) =
        oslrun_at(folder.path(), "@/s.osl -g 16x16 --outputs f -p k=2:6:3 --range auto -o @/a.png");
    assert_eq!((code, err.as_str()), (0, ""));
    let auto = image(&folder, "a.png");
    let step = "k=2".len() * 6 + 4;
    assert_eq!([0, 1, 2].map(|at| pixel(&auto, (4 + at * step + 8, 20))[0]), [0, 128, 255]);
    let (code, out, _) = oslrun_at(folder.path(), "@/s.osl -g 100x16 -p tint=0:1,0.5,0:2 -o @/b.png");
    assert!(code == 0 && out.contains("wrote @/b.c.png: 2 pictures\nwrote @/b.f.png: 2 pictures\n"), "{out}");
    let tint = image(&folder, "b.c.png");
    let step = 100 + 4;
    assert_eq!(pixel(&tint, (4 + step + 8, 20)), [255, 188, 0], "through the curve of a color");
}

#[test]
fn texts_keep_their_colons() {
    let folder = folder();
    let (code, out, err) = oslrun_at(folder.path(), "@/s.osl -g 4x4 -p word=0:1:3");
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.starts_with("0:1:3\n"), "{out}");
    let (code, out, _) =
        oslrun_at(folder.path(), "@/s.osl -g 4x4 --outputs f -p word=a:b -p k=0:1:2 -o @/a.png");
    assert!(code == 0 && out.starts_with("a:b\na:b\n"), "{out}");
}

#[test]
fn layers_and_surfaces_sweep() {
    let folder = folder();
    let group = "--shader-path @ --layer a=s -g 8x8 --outputs f -p a.k=0:1:2 -o @/g.png";
    let (code, out, err) = oslrun_at(folder.path(), group);
    assert!(code == 0 && out.ends_with("2 pictures\n"), "{out}{err}");
    let (code, _, err) =
        oslrun_at(folder.path(), "@/s.osl --on sphere -g 32x32 --outputs f -p k=0:1:2 -o @/on.png");
    assert_eq!(code, 0, "{err}");
    let image = image(&folder, "on.png");
    assert_eq!(pixel(&image, (4, 16))[0], 255, "beside the sphere is paper");
    assert_eq!([20, 56].map(|x| pixel(&image, (x, 32))[0]), [0, 255]);
}

#[test]
fn bad_forms_are_told_the_right_one() {
    let folder = folder();
    for (args, word) in [
        ("-p k=0:1 -o @/a.png", "FROM:TO:COUNT, such as 0.1:0.5:5"),
        ("-p k=0:1:x -o @/a.png", "FROM:TO:COUNT"),
        ("-p k=0:1:1 -o @/a.png", "from 2 to 100"),
        ("-p n=0:1.5:3 -o @/a.png", "whole numbers"),
        ("-p tint=0,1:1:3 -o @/a.png", "such as 0,0,0:1,0.5,0:5"),
        ("-p k=0:1:2 -p n=0:1:2 -p tint=0:1:2 -o @/a.png", "two directions, and 3 parameters"),
        ("-p k=0:1:2", "name it with -o"),
        ("-p k=0:1:2 -o @/a.exr", "a .png or .jpg"),
        ("-p k=0:1:2 -o @/a.png --stats", "--stats"),
        ("-p k=0:1:2 -o @/a.png --json", "--json"),
    ] {
        let (code, _, err) = oslrun_at(folder.path(), &format!("@/s.osl -g 8x8 {args}"));
        assert!(code == 2 && err.contains(word), "{args}: {code} {err}");
    }
    let many = "@/s.osl -g 100x100 -p k=0:1:100 -p n=0:99:100 -o @/a.png --limit running.points=1M";
    let (code, _, err) = oslrun_at(folder.path(), many);
    assert!(code == 1 && err.contains("10000 pictures of 100x100"), "{err}");
    assert!(!folder.path().join("a.png").exists());
}
