//! The user's limits reach every command, and every way in which a shader is run.

use crate::{Folder, Said, shader};

/// Shaders with loops, deep nesting and long text: each exceeds the limits that the tests set.
const LOOP: &str = "shader a(output float o = 0) { for (int i = 0; i < 100; i++) o += sin(u * i); }";
const SURFACE: &str =
    "surface s() { float k = 0; for (int i = 0; i < 100; i++) k += sin(u * i); Ci = k * diffuse(N); }";

const STEPS: [&str; 2] = ["--limit", "running.point_steps=300"];
const VALUES: [&str; 2] = ["--limit", "compiling.values=5"];
const TOKENS: [&str; 2] = ["--limit", "reading.tokens=5"];

/// The command succeeds; with a lower limit it fails with this text.
#[track_caller]
fn limited(folder: &Folder, args: &[&str], limit: [&str; 2], error: &str) {
    folder.run(args).succeeds();
    let said = folder.run(&[args, &limit].concat());
    refused(&said, error);
}

#[track_caller]
fn refused(said: &Said, error: &str) {
    let all = format!("{}\n{}", said.out, said.err);
    assert!(said.code == 1 && all.contains(error), "not `{error}` but {}:\n{all}", said.code);
}

#[test]
fn commands_of_one_shader() {
    let folder = shader(LOOP);
    for args in [&["check", "a.osl"][..], &["fmt", "a.osl"], &["info", "a.osl"], &["oslc", "a.osl"]] {
        limited(&folder, args, TOKENS, "tokens");
    }
    limited(&folder, &["oslinfo", "a.osl"], TOKENS, "tokens");
    limited(&folder, &["ir", "a.osl"], VALUES, "E0601");
    limited(
        &folder,
        &["compile", "a.osl", "-o", "b.oso"],
        ["--limit", "compiling.written_operations=2"],
        "E0601",
    );
    limited(&folder, &["explain", "a.osl"], VALUES, "E0601");
    limited(&folder, &["stability", "a.osl", "--points", "4x4", "--no-params"], VALUES, "E0601");
    limited(&folder, &["tradeoff", "a.osl", "-g", "4x4", "--budget", "0.01"], STEPS, "takes more than");
    limited(&folder, &["picture-book", "a.osl", "-g", "4x4", "-o", "b.html"], STEPS, "takes more than");
    limited(&folder, &["compare", "a.osl", "a.osl", "-g", "4x4"], STEPS, "takes more than");
    folder.run(&["a.osl", "-g", "4x4", "-o", "b.exr"]).succeeds();
    limited(&folder, &["compare", "b.exr", "b.exr"], ["--limit", "images.samples=9"], "images.samples");
    limited(&folder, &["a.osl", "-g", "4x4", "--frames", "1-2", "-o", "#.png"], STEPS, "takes more than");
    limited(&folder, &["picture-book", "a.osl", "-g", "4x4", "-o", "b.html"], VALUES, "E0601");
}

#[test]
fn groups() {
    let folder = shader(LOOP);
    let group = ["--group", "shader a x; shader a y;", "-g", "2x2"];
    limited(&folder, &group, STEPS, "takes more than");
    limited(&folder, &group, VALUES, "E0601");
    limited(&folder, &group, ["--limit", "reading.layers=1"], "E0803");
    limited(&folder, &group, TOKENS, "tokens");
}

#[test]
fn surfaces() {
    let mesh = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let folder = Folder::with(&[("a.osl", LOOP.as_bytes()), ("m.obj", mesh), ("d.json", b"{\"x\": 1.0}")]);
    let on = |surface| ["a.osl", "--on", surface, "-g", "8x8"];
    limited(&folder, &on("sphere"), STEPS, "takes more than");
    limited(&folder, &on("m.obj"), ["--limit", "scenes.corners=3"], "scenes.corners");
    limited(&folder, &on("m.obj"), ["--limit", "reading.file_bytes=9"], "it has more than");
    let fine = [&on("m.obj")[..], &["--level", "2"]].concat();
    limited(&folder, &fine, ["--limit", "scenes.triangles=9"], "scenes.triangles");
    let moved = ["a.osl", "--on", "sphere", "-g", "8x8", "--displace", "o", "--level", "2"];
    limited(&folder, &moved, ["--limit", "scenes.triangles=9"], "scenes.triangles");
    limited(&folder, &moved, STEPS, "takes more than");
    let known = ["a.osl", "-g", "2x2", "--attributes", "d.json"];
    limited(&folder, &known, ["--limit", "reading.file_bytes=9"], "it has more than");
}

const SCENE: &str = "options\n{\n xres 4\n yres 4\n AA_samples 1\n}\n\
                     persp_camera\n{\n position 0 0 5\n look_at 0 0 0\n}\n\
                     sphere\n{\n name b\n radius 1\n shader m\n}\n";

#[test]
fn scenes() {
    // The material, the displacement and the sky run at different times.
    let scene = |more: &str| {
        let text = format!("{SCENE}{more}");
        let slow = "shader slow(output color o = 0) { for (int i = 0; i < 100; i++) o += sin(P * i); }";
        Folder::with(&[
            ("a.ass", text.as_bytes()),
            ("s.osl", SURFACE.as_bytes()),
            ("plain.osl", b"shader plain(color c = 0.5, output color o = 0) { o = c; }"),
            ("slow.osl", slow.as_bytes()),
        ])
    };
    let render = ["render", "a.ass", "-o", "a.exr", "--threads", "2"];
    let material = scene("s\n{\n name m\n}\n");
    limited(&material, &render, STEPS, "takes more than");
    limited(&material, &render, VALUES, "cannot be compiled");
    limited(&material, &render, TOKENS, "tokens");
    let displaced = scene(
        "plain\n{\n name m\n}\nslow\n{\n name d\n}\n\
         sphere\n{\n name c\n radius 0.1\n shader m\n disp_map d\n}\n",
    );
    limited(&displaced, &render, STEPS, "takes more than");
    let sky = scene("plain\n{\n name m\n}\nslow\n{\n name d\n}\nsky\n{\n name k\n color d\n}\n");
    // The sky has many points: without a limit this takes a long time.
    refused(&sky.run(&[&render[..], &STEPS].concat()), "takes more than");
    let network = scene("plain\n{\n name m\n c d\n}\nslow\n{\n name d\n}\n");
    limited(&network, &render, ["--limit", "reading.layers=1"], "too many nodes");
}

#[test]
fn tools_of_the_reference() {
    let scene = "<World><Camera eye=\"0,0,5\" dir=\"0,0,-1\"/><ShaderGroup>shader s x;</ShaderGroup>\
                 <Sphere center=\"0,0,0\" radius=\"1\"/></World>";
    let folder = Folder::with(&[
        ("a.osl", LOOP.as_bytes()),
        ("s.osl", SURFACE.as_bytes()),
        ("a.xml", scene.as_bytes()),
    ]);
    let shade = ["testshade", "-g", "2", "2", "-o", "o", "null", "a"];
    for args in [&shade[..], &["testrender", "-r", "4", "4", "a.xml", "a.exr"]] {
        limited(&folder, args, STEPS, "takes more than");
        limited(&folder, args, VALUES, "large");
    }
    // Scripts expect that this tool continues without a shader that it cannot read.
    let said = folder.run(&[&shade[..], &["--limit", "reading.file_bytes=9"]].concat());
    assert!(said.err.contains("Could not find shader"), "{}", said.err);
    // The option may come before the others, and in one word.
    let said =
        folder.run(&["testshade", "--limit=running.point_steps=300", "-g", "2", "2", "-o", "o", "null", "a"]);
    refused(&said, "takes more than");
    let said = folder.run(&["testshade", "--limit", "nothing=1", "a"]);
    refused(&said, "there is no such limit");
}

#[test]
fn the_time_of_every_command_is_bounded() {
    let endless = "for (int i = 0; i < 2000000000; i++) x += sin(u * i);";
    let folder = Folder::with(&[
        ("a.osl", format!("shader a(output float x = 0) {{ {endless} }}").as_bytes()),
        ("s.osl", format!("surface s() {{ float x = 0; {endless} Ci = x * diffuse(N); }}").as_bytes()),
        ("a.ass", format!("{SCENE}s\n{{\n name m\n}}\n").as_bytes()),
        (
            "a.xml",
            b"<World><Camera eye=\"0,0,5\" dir=\"0,0,-1\"/><ShaderGroup>shader s x;</ShaderGroup>\
              <Sphere center=\"0,0,0\" radius=\"1\"/></World>",
        ),
    ]);
    for args in [
        &["a.osl", "-g", "8x8"][..],
        &["a.osl", "-g", "8x8", "--on", "sphere"],
        &["render", "a.ass", "-o", "a.exr"],
        &["tradeoff", "a.osl", "-g", "8x8"],
        &["compare", "a.osl", "a.osl", "-g", "8x8"],
        &["a.osl", "-g", "8x8", "--frames", "1-9", "-o", "f#.png"],
        &["picture-book", "a.osl", "-g", "8x8", "-o", "b.html"],
        &["testshade", "-g", "8", "8", "-o", "x", "null", "a"],
        &["testrender", "-r", "8", "8", "a.xml", "b.exr"],
    ] {
        let bound = ["--max-time", "0.2", "--limit", "running.point_steps=1000000000000"];
        refused(&folder.run(&[args, &bound].concat()), "--max-time");
    }
    for file in ["a.exr", "b.exr", "b.html"] {
        assert!(!folder.path().join(file).exists(), "{file}");
    }
}
