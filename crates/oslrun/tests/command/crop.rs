//! `--crop`: a part of a picture has the values of the whole one.

use crate::in_process::oslrun_at;
use osl_image::{ImageData, read_image};
use tempfile::TempDir;

/// Noise, derivatives, cells, a matrix space, texture coordinates as data, and a loop that differs by point.
const SHADER: &str = "shader s(output color c = 0, output float f = 0, output int n = 0) {
    float s = 0; getattribute(\"s\", s);
    c = color(noise(9 * P), Dx(u * u * v), cellnoise(floor(P * 7)));
    for (int i = 0; i < 40 * u; i++) f += sin(i * v + s);
    point p = transform(\"raster\", P);
    n = (int)p[0];
    if (u > 0.5 && v > 0.5) warning(\"here\");
}";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), SHADER).unwrap();
    std::fs::write(folder.path().join("m.osl"), "surface m() { Ci = u * diffuse(N); }").unwrap();
    folder
}

fn image(folder: &TempDir, args: &str, name: &str) -> ImageData {
    let (code, _, err) = oslrun_at(folder.path(), &format!("{args} -o @/{name}"));
    assert_eq!(code, 0, "{args}: {err}");
    read_image(&folder.path().join(name)).unwrap()
}

/// Checks that each pixel of a part has the bits of the whole picture.
#[track_caller]
fn same(part: &ImageData, whole: &ImageData, (x0, y0): (usize, usize)) {
    assert_eq!(part.channels, whole.channels);
    let n = part.channels.len();
    for y in 0..part.height {
        for x in 0..part.width {
            let (here, there) = ((y * part.width + x) * n, ((y + y0) * whole.width + x + x0) * n);
            for (c, name) in part.channels.iter().enumerate() {
                let (a, b) = (part.samples[here + c], whole.samples[there + c]);
                assert_eq!(a.to_bits(), b.to_bits(), "{name} at ({x}, {y})");
            }
        }
    }
}

#[test]
fn values_are_those_of_the_whole_picture() {
    let folder = folder();
    for way in [
        "",
        "--center --uv-scale 3.7,-0.3 --uv-offset 0.1,2",
        "--samples 5",
        "--samples 4 --filter mitchell",
        "--prefilter",
        "--samples 4 --filter gaussian,3 --prefilter",
        "--arithmetic f64",
        "--batch 7",
        "--half --compression piz",
        "--compression none",
    ] {
        let whole = image(&folder, &format!("@/s.osl -g 90x70 {way}"), "whole.exr");
        for (crop, corner, size) in [
            ("11,60,20,63", (11, 20), (49, 43)),
            ("89,90,0,70", (89, 0), (1, 70)),
            ("0,90,69,70", (0, 69), (90, 1)),
        ] {
            let part = image(&folder, &format!("@/s.osl -g 90x70 --crop {crop} {way}"), "part.exr");
            assert_eq!((part.width, part.height), size, "{way}");
            same(&part, &whole, corner);
            // The file says which part it is.
            assert_eq!(part.header.data_origin, (corner.0 as i32, corner.1 as i32));
            assert_eq!(part.header.display_window, Some([0, 0, 89, 69]));
        }
    }
}

#[test]
fn the_whole_picture_is_no_part() {
    let folder = folder();
    image(&folder, "@/s.osl -g 30x20 --no-command", "whole.exr");
    image(&folder, "@/s.osl -g 30x20 --crop 0,30,0,20 --no-command", "part.exr");
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("whole.exr") == bytes("part.exr"));
}

#[test]
fn other_formats_hold_the_part_alone() {
    let folder = folder();
    for ending in ["png", "tif"] {
        let whole = image(&folder, "@/s.osl -g 90x70 --outputs c", &format!("whole.{ending}"));
        let part =
            image(&folder, "@/s.osl -g 90x70 --outputs c --crop 11,60,20,63", &format!("part.{ending}"));
        assert_eq!((part.width, part.height), (49, 43));
        same(&part, &whole, (11, 20));
    }
    let (code, out, err) = oslrun_at(folder.path(), "@/m.osl -g 90x70 --crop 88,90,69,70 --closures");
    assert!(code == 0 && out.contains("Ci at (89, 69)"), "{out}{err}");
}

#[test]
fn messages_name_the_pixels_of_the_whole_picture() {
    let folder = folder();
    for way in ["", "--samples 2"] {
        let (_, _, err) = oslrun_at(folder.path(), &format!("@/s.osl -g 90x70 --crop 40,60,30,63 {way}"));
        assert!(
            err.contains("first at pixel (45, 35)") || err.contains("first at pixel (44, 3"),
            "{way}: {err}"
        );
    }
}

#[test]
fn parts_are_compared_with_parts() {
    let folder = folder();
    image(&folder, "@/s.osl -g 90x70 --crop 11,60,20,63", "part.exr");
    let run = |args: &str| oslrun_at(folder.path(), args);
    let (code, out, err) = run("compare @/part.exr @/s.osl -g 90x70 --crop 11,60,20,63");
    assert_eq!(code, 0, "{out}{err}");
    let (code, _, err) = run("compare @/part.exr @/s.osl -g 90x70 --crop 12,61,20,63");
    assert!(code == 1 && err.contains("different parts"), "{err}");
}

#[test]
fn what_cannot_be_cut_is_refused_with_a_reason() {
    let folder = folder();
    for (args, word) in [
        ("--crop 5,5,0,9", "at least one column"),
        ("--crop 5,9", "four numbers"),
        ("--crop -1,5,0,9", "four numbers"),
        ("--crop 0,91,0,9", "X1 is at most 90"),
        ("--crop 0,9,0,71", "Y1 at most 70"),
        ("--crop 0,9,0,9 --max-error 0.1", "other values than the whole picture"),
        ("--crop 0,9,0,9 --adaptive 0.1", "other values than the whole picture"),
        ("--crop 0,9,0,9 --shading-rate 2x2", "other values than the whole picture"),
        ("--crop 0,9,0,9 --on sphere", "not for --on"),
        ("--crop 0,91,0,9 --preview -o @/a.png", "X1 is at most 90"),
    ] {
        let (code, _, err) = oslrun_at(folder.path(), &format!("@/s.osl -g 90x70 {args}"));
        assert!(code == 2 && err.contains(word), "{args}: {code} {err}");
    }
    let (code, _, err) = oslrun_at(folder.path(), "explain @/s.osl --crop 0,9,0,9");
    assert!(code == 2 && err.contains("--crop has no effect in `explain`"), "{err}");
}

const SCENE: &str = "options\n{\n xres 90\n yres 70\n AA_samples 1\n}
persp_camera\n{\n name c\n position 0 0 5\n look_at 0 0 0\n}
lambert\n{\n name mat\n}
sphere\n{\n name s\n radius 1\n shader mat\n}
sky\n{\n name sky\n color 1 1 1\n}
";

#[test]
fn parts_of_pictures_with_light_have_the_values_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), "shader s(output color c = 0) { c = color(u, v, 0.5); }")
        .unwrap();
    std::fs::write(folder.path().join("a.ass"), SCENE).unwrap();
    for line in ["@/s.osl -g 90x70 --preview", "@/s.osl -g 90x70 --preview --raw", "render @/a.ass --denoise"]
    {
        let whole = image(&folder, line, "whole.exr");
        let part = image(&folder, &format!("{line} --crop 37,70,25,60"), "part.exr");
        assert_eq!((part.width, part.height), (33, 35), "{line}");
        assert_eq!((whole.width, whole.height), (90, 70));
        same(&part, &whole, (37, 25));
    }
}
