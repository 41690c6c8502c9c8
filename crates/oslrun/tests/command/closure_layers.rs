//! Materials whose outputs are closures alone: the weights become layers, whatever the size of the picture,
//! and null closures are black.

use crate::in_process::{oslrun, oslrun_at};
use osl_image::read_image;
use std::path::Path;
use std::process::Command;

/// What `Ci` is in forty materials, after some variables: one to eight lobes, those of MaterialX, layers,
/// null closures, and branches.
const MATERIALS: [&str; 40] = [
    "diffuse(N)",
    "emission()",
    "diffuse(N) + emission()",
    "u * diffuse(n)",
    "tint * reflection(n, 1.5)",
    "0.5 * phong(n, 20 * v) + transparent()",
    "oren_nayar(n, rough) + translucent(-n)",
    "ward(n, T, rough, 2 * rough)",
    "microfacet(\"ggx\", n, T, rough, rough, 1.5, 0)",
    "microfacet(\"beckmann\", n, rough, 1.3, 1) + refraction(n, 1.3)",
    "subsurface(1.4, 0.2, tint, color(0.8)) + diffuse(n)",
    "background() * tint",
    "holdout()",
    "debug(\"mark\") + v * debug(\"other\")",
    "oren_nayar_diffuse_bsdf(n, tint, rough)",
    "burley_diffuse_bsdf(n, tint, rough) + uniform_edf(tint)",
    "dielectric_bsdf(n, T, tint, tint, rough, rough, 1.5, \"ggx\")",
    "conductor_bsdf(n, T, rough, rough, tint, 1 - tint, \"ggx\")",
    "generalized_schlick_bsdf(n, T, tint, tint, rough, rough, color(0.04), color(1), 5, \"ggx\")",
    "translucent_bsdf(n, tint) + transparent_bsdf()",
    "subsurface_bssrdf(n, tint, 0.1, tint, 0.3)",
    "sheen_bsdf(n, tint, rough) + diffuse(n)",
    "anisotropic_vdf(tint, tint, 0.4)",
    "medium_vdf(tint, 0.5, tint, 0.1, 1.3, 0)",
    "layer(dielectric_bsdf(n, T, tint, tint, rough, rough, 1.5, \"ggx\"), burley_diffuse_bsdf(n, tint, rough))",
    "layer(sheen_bsdf(n, tint, v), layer(reflection(n), v * diffuse(n) + u * emission()))",
    "mix(diffuse(n), reflection(n, 1.5), u)",
    "mix(layer(reflection(n), diffuse(n)), emission(), tint)",
    "0",
    "0 * diffuse(N)",
    "(color(1) - opacity) * transparent()",
    "(u > 2) * diffuse(n)",
    "opacity * given + (color(1) - opacity) * transparent()",
    "fold",
    "branch",
    "loop",
    "diffuse(n) + emission() + tint * reflection(n, 1.4) + phong(n, 30)",
    "diffuse(n) + emission() + tint * reflection(n, 1.4) + phong(n, 30) + translucent(n) + transparent()",
    "u * diffuse(n) + v * emission() + tint * reflection(n, 1.4) + 0.1 * phong(n, 30) + translucent(n) + transparent() \
     + microfacet(\"ggx\", n, T, rough, rough, 1.5, 0) + ward(n, T, rough, rough)",
    "dielectric_bsdf(n, T, tint, tint, rough, rough, 1.5, \"ggx\") + conductor_bsdf(n, T, rough, rough, tint, tint, \"ggx\") \
     + generalized_schlick_bsdf(n, T, tint, tint, rough, rough, tint, tint, 5, \"ggx\") + sheen_bsdf(n, tint, rough) \
     + subsurface_bssrdf(n, tint, 0.1, tint, 0.3) + uniform_edf(tint) + translucent_bsdf(n, tint) + transparent_bsdf()",
];

/// The shader of a material.
fn material(ci: &str) -> String {
    format!(
        "surface m(color opacity = 1, closure color given = 0, float rough = 0.2) {{\n\
         normal n = normalize(N + 0.3 * vector(noise(\"perlin\", P * 10)));\n\
         vector T = vector(1, 0, 0); color tint = color(u, v, 0.5);\n\
         closure color fold = 0; closure color branch = 0; closure color loop = 0;\n\
         if (u > 0.5) branch = diffuse(n); else if (v > 0.5) branch = tint * emission();\n\
         for (int i = 0; i < int(4 * v); i++) loop = 0.5 * loop + diffuse(n) + u * reflection(n, 1 + i);\n\
         Ci = {ci};\n}}\n"
    )
}

/// Runs a material in a process of its own. Returns the bytes of its peak memory, and of the picture's
/// samples.
fn memory(folder: &Path, ci: &str, grid: &[&str]) -> (f64, f64) {
    let source = folder.join("m.osl");
    std::fs::write(&source, material(ci)).unwrap();
    let args = ["m.osl", "-o", "m.exr", "--stats"].iter().chain(grid);
    let run = Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(folder).args(args).output().unwrap();
    let err = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{ci}: {err}");
    let peak = err.lines().find_map(|line| line.strip_prefix("peak memory ")?.strip_suffix(" MB"));
    let image = read_image(&folder.join("m.exr")).unwrap();
    assert!(
        image.channels.iter().all(|name| name.starts_with("Ci.") || name.len() == 1),
        "{:?}",
        image.channels
    );
    let samples = image.width * image.height * image.channels.len() * 4;
    (peak.map_or(0.0, |peak| peak.parse::<f64>().unwrap() * 1e6), samples as f64)
}

/// Checks all materials at a size.
fn all_within_memory(grid: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let mut most = (0.0, "");
    for ci in MATERIALS {
        let (peak, picture) = memory(dir.path(), ci, grid);
        most = if peak - picture > most.0 { (peak - picture, ci) } else { most };
        assert!(peak <= picture + 100e6, "{ci}: {peak} bytes for a picture of {picture}");
    }
    println!("most memory beside the picture: {:.0} MB, for {}", most.0 / 1e6, most.1);
}

#[test]
fn materials_are_pictures_in_little_memory() {
    all_within_memory(&["-g", "96x96"]);
}

/// `cargo test -p oslrun --test command -- --ignored --nocapture materials`
#[test]
#[ignore = "forty pictures of the default size take half a minute"]
fn materials_of_the_default_size_are_pictures_in_little_memory() {
    all_within_memory(&[]);
}

#[test]
fn layers_are_the_weights_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let source = "surface m() { closure color c = u * diffuse(N);\n\
                  for (int i = 0; i < 3; i++) c = c + color(0, v, 0.5) * emission() + 0.25 * diffuse(-N);\n\
                  Ci = c + layer(reflection(N), refraction(N, 1.5)) + (u > 2) * holdout(); }\n";
    std::fs::write(dir.path().join("m.osl"), source).unwrap();
    let names = ["diffuse", "emission", "layer", "holdout"];
    let expected = |name: &str, u: f32, v: f32| match name {
        "diffuse" => [u + 0.75; 3],
        "emission" => [0.0, 3.0 * v, 1.5],
        "layer" => [1.0; 3],
        _ => [0.0; 3],
    };
    // Without text, and with it, which is made from smaller pieces.
    for more in ["", "--closures", "--batch 16 --threads 2", "--arithmetic f64"] {
        let (code, out, err) = oslrun_at(dir.path(), &format!("@/m.osl -g 40x70 -o @/m.exr {more}"));
        assert_eq!(code, 0, "{err}");
        assert_eq!(out.contains("Ci: layer at 100.0 % of the points"), more == "--closures", "{out}");
        let image = read_image(&dir.path().join("m.exr")).unwrap();
        assert_eq!(image.channels.len(), 3 * names.len(), "{:?}", image.channels);
        for (at, channel) in image.channels.iter().enumerate() {
            let (layer, part) = channel.strip_prefix("Ci.").unwrap().split_once('.').unwrap();
            let component = ["R", "G", "B"].iter().position(|own| *own == part).unwrap();
            for (pixel, value) in image.samples.iter().skip(at).step_by(image.channels.len()).enumerate() {
                let (u, v) = ((pixel % 40) as f32 / 39.0, (pixel / 40) as f32 / 69.0);
                let wanted = expected(layer, u, v)[component];
                assert!((value - wanted).abs() < 1e-5, "{more} {channel} at {pixel}: {value} {wanted}");
            }
        }
    }
    let (code, _, err) = oslrun_at(dir.path(), "@/m.osl -g 8x8 --samples 4 -o @/m.exr");
    assert!(code == 0 && err.contains("note: the shader yields closures alone"), "{err}");
}

#[test]
fn null_closures_are_black_everywhere() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let texts = [
        "surface m(closure color bsdf = 0, color opacity = color(1)) {\n\
         Ci = opacity * bsdf + (color(1) - opacity) * transparent(); }\n",
        "surface m() { Ci = 0; }\n",
        "surface m() { Ci = (u > 2) * diffuse(N); }\n",
        "shader m(output closure color bsdf = 0) { if (u > 2) bsdf = emission(); }\n",
    ];
    let source = path("m.osl");
    for text in texts {
        std::fs::write(&source, text).unwrap();
        for (file, more) in [
            ("m.exr", &[][..]),
            ("m.exr", &["--closures"]),
            ("m.exr", &["--histogram"]),
            ("m.png", &[]),
            ("m.tif", &["--samples", "4"]),
            ("m.exr", &["--max-error", "0.01"]),
        ] {
            let output = path(file);
            let (code, out, err) = oslrun(&[&[&source, "-g", "12x12", "-o", &output][..], more].concat());
            assert_eq!(code, 0, "{text} {more:?}: {err}");
            let is_told = err.contains("null at every point") || out.contains("null at every point");
            assert!(is_told, "{text} {more:?}: {out} {err}");
            if file == "m.exr" {
                let image = read_image(Path::new(&output)).unwrap();
                assert!(image.channels.len() == 3 && image.samples.iter().all(|x| *x == 0.0), "{text}");
            }
            std::fs::remove_file(&output).unwrap();
        }
        let (code, out, err) = oslrun(&[&source, "-g", "12x12"]);
        assert!(code == 0 && out.contains("null at every point"), "{text}: {out} {err}");
        for command in ["explain", "stability", "sanitize", "tradeoff", "bounds", "--preview"] {
            let more: &[&str] = match command {
                "explain" => &["--at", "3,3"],
                "tradeoff" => &["--budget", "0.1"],
                "--preview" => &["-o", &path("m.png")],
                _ => &[],
            };
            let (code, _, err) = oslrun(&[&[command, &source, "-g", "12x12"][..], more].concat());
            assert_eq!(code, 0, "{text} {command}: {err}");
        }
        let (code, _, err) = oslrun(&["testshade", "-g", "2", "2", &source]);
        assert_eq!(code, 0, "{err}");
    }
}
