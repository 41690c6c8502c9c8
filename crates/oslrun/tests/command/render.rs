//! `render`: options of a scene on the command line.

use crate::in_process::oslrun_at;
use osl_image::read_image;

const SCENE: &str = "options
{
 xres 8
 yres 8
 AA_samples 1
}
persp_camera
{
 name c
 position 0 0 3
 look_at 0 0 0
}
sky
{
 name sky
 color 1 1 1
}
ramp_color
{
 name paint
}
lambert
{
 name mat.left
 Kd 1
 Kd_color paint
}
sphere
{
 name s
 radius 1
 shader mat.left
}
";

#[test]
fn parameters_of_nodes_are_given_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("a.ass"), SCENE).unwrap();
    std::fs::write(
        folder.join("ramp_color.osl"),
        "shader ramp_color(float level = 0.5, output color c = 0) { c = level; }",
    )
    .unwrap();
    let middle = |more: &str| {
        let (code, _, err) = oslrun_at(folder, &format!("render @/a.ass -o @/a.exr {more}"));
        assert_eq!(code, 0, "{more}: {err}");
        let image = read_image(&folder.join("a.exr")).unwrap();
        let plane = image.plane(image.channels.iter().position(|c| c == "G").unwrap());
        plane[4 * image.width + 4]
    };
    let usual = middle("");
    let given = middle("-p paint.level=0.25");
    assert!((given / usual - 0.5).abs() < 1e-3, "{usual} {given}");
    // The name of a node may have dots, and a value replaces a link.
    let white = middle("-p mat.left.Kd_color=1,1,1 -p mat.left.Kd=0.5");
    assert!((white / usual - 1.0).abs() < 1e-3, "{usual} {white}");
    let wrong = |more: &str| {
        let (code, _, err) = oslrun_at(folder, &format!("render @/a.ass -o @/b.exr {more}"));
        assert!(code != 0 && !folder.join("b.exr").exists(), "{more}");
        err
    };
    assert!(wrong("-p none.level=1").contains("no such shader node; it has mat.left, paint"));
    assert!(wrong("-p level=1").contains("NODE.PARAMETER=VALUE"));
    assert!(wrong("-p paint.lvl=1").contains("lvl"));
    assert!(wrong("-p paint.level=red").contains("-p paint.level=red"));
    assert!(wrong("--crop 0,9,0,8").contains("X1 is at most 8"));
    assert_eq!(read_size(folder, "-g 5x3"), (5, 3));
    assert_eq!(read_size(folder, "--size 5x3"), (5, 3));
}

fn read_size(folder: &std::path::Path, more: &str) -> (usize, usize) {
    let (code, _, err) = oslrun_at(folder, &format!("render @/a.ass -o @/c.exr {more}"));
    assert_eq!(code, 0, "{err}");
    let image = read_image(&folder.join("c.exr")).unwrap();
    (image.width, image.height)
}
