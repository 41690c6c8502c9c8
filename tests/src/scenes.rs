//! Random scenes and meshes: coordinates at the limits of floats, corners without vertices, files that
//! include themselves.
//!
//! Most of the text from [`scene`] is well-formed, so that it passes the reader and is built and rendered.
//! This module must not know what reads its text.

use crate::dice::Dice;
use std::fmt::Write;

/// The text of a scene file called `a.ass`. The same bytes make the same scene.
pub fn scene(bytes: &[u8]) -> String {
    let mut dice = Dice::new(bytes);
    let mut text = String::new();
    let _ = write!(text, "options\n{{\n xres {}\n yres {}\n AA_samples 1\n}}\n", dice.side(), dice.side());
    let _ = write!(
        text,
        "persp_camera\n{{\n name c\n position {}\n look_at 0 0 {}\n fov {}\n}}\n",
        triple(&mut dice),
        dice.float(),
        dice.float()
    );
    for n in 0..1 + dice.below(4) {
        surface(&mut dice, &mut text, n);
    }
    if dice.one_in(4) {
        let _ =
            write!(text, "point_light\n{{\n position {}\n radius {}\n}}\n", triple(&mut dice), dice.float());
    }
    if dice.one_in(4) {
        let _ = write!(text, "sky\n{{\n name s\n color {}\n}}\n", triple(&mut dice));
    }
    if dice.one_in(6) {
        let name = dice.pick(&["a.ass", "../a.ass", "/dev/zero", ""]);
        let _ = writeln!(text, "include \"{name}\"");
    }
    // Truncated, sometimes within a word.
    if dice.one_in(8) {
        let length = dice.below(text.len() as u64) as usize;
        text.truncate(length);
    }
    text
}

/// The text of an OBJ file. The same bytes make the same mesh.
pub fn mesh(bytes: &[u8]) -> String {
    let mut dice = Dice::new(bytes);
    let mut text = String::new();
    for _ in 0..dice.below(24) {
        let _ = writeln!(text, "v {}", triple(&mut dice));
    }
    for _ in 0..dice.below(12) {
        text += "f";
        for _ in 0..dice.below(7) {
            let _ = match dice.below(4) {
                0 => write!(text, " {}", i64::from(dice.side()) - 8),
                1 => write!(text, " {}/{}/", dice.below(24), dice.side()),
                _ => write!(text, " {}", dice.below(24)),
            };
        }
        text += "\n";
    }
    text
}

fn triple(dice: &mut Dice<'_>) -> String {
    format!("{} {} {}", dice.float(), dice.float(), dice.float())
}

fn surface(dice: &mut Dice<'_>, text: &mut String, n: u64) {
    let _ = match dice.below(5) {
        0 => write!(text, "sphere\n{{\n center {}\n radius {}\n", triple(dice), dice.float()),
        1 => write!(text, "cylinder\n{{\n bottom {}\n top {}\n", triple(dice), triple(dice)),
        2 => write!(text, "plane\n{{\n point {}\n normal {}\n", triple(dice), triple(dice)),
        _ => {
            let polygons = polymesh(dice);
            write!(text, "polymesh\n{{\n{polygons}")
        }
    };
    if dice.one_in(6) {
        let numbers: Vec<String> = (0..16).map(|_| dice.float().to_string()).collect();
        let _ = writeln!(text, " matrix {}", numbers.join(" "));
    }
    let _ = write!(text, " name p{n}\n shader m\n}}\n");
}

fn polymesh(dice: &mut Dice<'_>) -> String {
    let list = |numbers: &[u64]| numbers.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
    let points = dice.below(12);
    let sides: Vec<u64> = (0..dice.below(8)).map(|_| dice.below(6)).collect();
    let n_corners = if dice.one_in(8) { dice.side().into() } else { sides.iter().sum::<u64>() };
    let corner = |dice: &mut Dice<'_>| if dice.one_in(60) { dice.side().into() } else { dice.below(points) };
    let corners: Vec<u64> = (0..n_corners.min(64)).map(|_| corner(dice)).collect();
    let vertices: Vec<String> = (0..points).map(|_| triple(dice)).collect();
    let mut text = format!(
        " nsides {} 1 UINT {}\n vidxs {n_corners} 1 UINT {}\n vlist {points} 1 POINT {}\n",
        sides.len(),
        list(&sides),
        list(&corners),
        vertices.join(" ")
    );
    if dice.one_in(2) {
        let times = dice.pick(&[1_u32, 2, 0, 9, 64]);
        let kind = dice.pick(&["catclark", "linear", "none", "x"]);
        let _ = write!(text, " subdiv_type {kind}\n subdiv_iterations {times}\n");
    }
    if dice.one_in(4) {
        text += " smoothing on\n";
    }
    text
}
