//! `render --camera` and the preview of a camera shader.

use crate::in_process::{oslrun, oslrun_at};
use osl_image::{ImageData, read_image};
use std::path::{Path, PathBuf};

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/cameras")
}

fn channel(image: &ImageData, name: &str) -> Vec<f32> {
    image.plane(image.channels.iter().position(|c| c == name).unwrap())
}

/// The street in 96 by 54 pixels, and what was said.
fn street(dir: &Path, more: &[&str]) -> (ImageData, String) {
    let (scene, out) = (examples().join("street.ass"), dir.join("out.exr"));
    let args =
        ["render", scene.to_str().unwrap(), "-g", "96x54", "--samples", "8", "-o", out.to_str().unwrap()];
    let (code, _, err) = oslrun(&[&args, more].concat());
    assert_eq!(code, 0, "{more:?}: {err}");
    (read_image(&out).unwrap(), err)
}

/// Rays of the shader are in single precision, so that a few of them hit another lamp or ball than those of
/// the camera of scenes.
#[test]
fn a_pinhole_shows_the_picture_of_the_scenes_camera() {
    let dir = tempfile::tempdir().unwrap();
    let pinhole = examples().join("pinhole.osl");
    let usual = street(dir.path(), &[]).0;
    let own = street(dir.path(), &["--camera", pinhole.to_str().unwrap()]).0;
    let mut differ = 0;
    for name in ["R", "G", "B", "depth"] {
        let pairs = channel(&usual, name).into_iter().zip(channel(&own, name));
        differ += pairs.filter(|(a, b)| (a - b).abs() > 1e-3 * a.abs().max(1e-2)).count();
    }
    assert!(differ <= 4 * 96 * 54 / 1000, "{differ} of {} values differ", 4 * 96 * 54);
    let wide = street(dir.path(), &["--camera", pinhole.to_str().unwrap(), "--camera-param", "fov=100"]).0;
    assert_ne!(channel(&wide, "depth"), channel(&own, "depth"));
}

#[test]
fn without_throughput_a_sample_is_black() {
    let dir = tempfile::tempdir().unwrap();
    let fisheye = examples().join("fisheye.osl");
    let (image, said) = street(dir.path(), &["--camera", fisheye.to_str().unwrap()]);
    assert!(!said.contains("error"), "{said}");
    let (green, mut lit) = (channel(&image, "G"), 0);
    for y in 0..54 {
        for x in 0..96 {
            let far = f64::hypot(f64::from(x) - 47.5, f64::from(y) - 26.5);
            let light = green[(y * 96 + x) as usize];
            assert!(far < 28.0 || light == 0.0, "{x} {y}: {light}");
            lit += u32::from(light > 0.0);
        }
    }
    assert!(lit > 2000, "{lit} pixels of a circle with 2290");
}

#[test]
fn a_lens_takes_attributes() {
    let dir = tempfile::tempdir().unwrap();
    let lens = examples().join("thin_lens.osl");
    let own = |more: &[&str]| street(dir.path(), &[&["--camera", lens.to_str().unwrap()], more].concat()).0;
    let usual = own(&["--camera-param", "focus=2.2"]);
    let file = dir.path().join("a.json");
    for text in ["{\"cam:focal_distance\": 2.2}", "{\"cam:focal_distance\": 2}"] {
        std::fs::write(&file, text).unwrap();
        let image = own(&["--attributes", file.to_str().unwrap()]);
        assert_eq!(channel(&image, "G") == channel(&usual, "G"), text.contains("2.2"), "{text}");
    }
}

#[test]
fn a_preview_shows_the_stage_through_a_camera() {
    let dir = tempfile::tempdir().unwrap();
    let run = |line: &str| {
        let line = line.replace('%', examples().to_str().unwrap());
        oslrun_at(dir.path(), &line)
    };
    let (code, out, err) =
        run("%/thin_lens.osl --preview -g 40x30 -p radius=0.3 --rays @/rays.svg -o @/a.exr");
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("the preview shows what the camera sees"), "{err}");
    assert!(out.contains("wrote @/a.exr") && out.contains("wrote @/rays.svg"), "{out}");
    let drawing = std::fs::read_to_string(dir.path().join("rays.svg")).unwrap();
    assert!(drawing.contains("Rays of thin_lens") && drawing.contains("From above"));
    // 2 views of 7 places with 7 rays each, and the legend.
    assert_eq!(drawing.matches("stroke=\"rgb(20,60,170)\"").count(), 2 * 49 + 1, "{drawing}");
    let image = read_image(&dir.path().join("a.exr")).unwrap();
    assert!(channel(&image, "G").iter().all(|light| *light > 0.0));

    std::fs::write(
        dir.path().join("bad.osl"),
        "shader bad(output point position = 0, output vector direction = 0, output color throughput = 1) {}",
    )
    .unwrap();
    let (code, out, err) = run("@/bad.osl --preview -g 10x8 --raw -o @/b.exr");
    assert_eq!(code, 0, "{err}");
    let said =
        "error: the camera gives no ray, so the sample is black, at 320 of 320 rays, first at pixel (0, 0)";
    assert!(err.contains(said), "{err}");
    assert!(out.contains("1 error while shading"), "{out}");
    assert!(channel(&read_image(&dir.path().join("b.exr")).unwrap(), "G").iter().all(|light| *light == 0.0));
    let (code, _, err) = run("@/bad.osl --preview -g 10x8 --deny errors -o @/c.exr");
    assert!(code == 1 && err.contains("--deny errors") && !dir.path().join("c.exr").exists(), "{err}");

    std::fs::write(dir.path().join("none.osl"), "shader none(output color c = 0) {}").unwrap();
    std::fs::write(dir.path().join("a.json"), "{}").unwrap();
    let (code, _, err) = run("@/none.osl --preview -g 4x4 --attributes @/a.json -o @/d.png");
    assert!(code == 0 && err.contains("warning: --attributes are for a camera"), "{err}");
    for (line, text) in [
        ("@/none.osl --preview --rays @/n.svg -o @/n.png", "`none` is no camera"),
        ("render %/street.ass --camera @/none.osl -o @/n.png", "`none` is no camera"),
        ("render %/street.ass --camera-param a=1 -o @/n.png", "--camera <FILE.osl>"),
        (
            "render %/street.ass --camera %/pinhole.osl --camera-param fv=1 -o @/n.png",
            "no parameter `fv`; it has fov",
        ),
    ] {
        let (code, _, err) = run(line);
        assert!(code != 0 && err.contains(text), "{line}: {err}");
        assert!(!dir.path().join("n.png").exists() && !dir.path().join("n.svg").exists());
    }
}

/// The answers on the patch are those of the reference's tool; on a surface, those of its view.
#[test]
fn the_camera_of_a_run_answers_its_attributes() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output float o = 0) {
        int size[2]; string projection; float clip[2], shutter[2], window[4];
        float fov, aspect, near, far, open, close;
        int n = getattribute(\"camera:resolution\", size) + getattribute(\"camera:projection\", projection)
            + getattribute(\"camera:fov\", fov) + getattribute(\"camera:pixelaspect\", aspect)
            + getattribute(\"camera:clip\", clip) + getattribute(\"camera:clip_near\", near)
            + getattribute(\"camera:clip_far\", far) + getattribute(\"camera:shutter\", shutter)
            + getattribute(\"camera:shutter_open\", open) + getattribute(\"camera:shutter_close\", close)
            + getattribute(\"camera:screen_window\", window);
        o = n;
        printf(\"%d: %d %d %s %g %g %g %g %g %g %g %g\\n\", n, size[0], size[1], projection, fov, aspect,
            near, clip[1] - far, far, shutter[1], close - open, window[2]);
    }";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    let first = |line: &str| {
        let (code, out, err) = oslrun_at(dir.path(), line);
        assert!(code == 0 && !err.contains("not answered"), "{line}: {err}");
        out.lines().next().unwrap().to_string()
    };
    let patch = "11: 8 4 perspective 90 1 0.1 0 1000 1 1 2";
    assert_eq!(first("@/s.osl -g 8x4"), patch);
    assert_eq!(first("testshade -g 8 4 @/s.osl"), patch);
    assert_eq!(first("@/s.osl --on sphere -g 8x4 -o @/a.exr"), "11: 8 4 perspective 30 1 0.01 0 100 1 1 2");
}
