//! Ways to read files: includes, shaders of groups, included scenes, textures, dictionaries, and files that
//! the user names.

use super::{Place, SECRET, Said, oslrun};
use osl_image::{BitDepth, PngOptions, Transfer, write_png};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

const HEADER: &str = "int sesame(sesame;\n";

#[test]
fn includes() {
    let place = Place::new("h", HEADER.as_bytes(), b"#define GOOD 1\n");
    for name in place.tricks() {
        place.write("a.osl", format!("#include \"{name}\"\nshader a() {{}}\n"));
        let said = place.run(&["check", "a.osl"]);
        assert_eq!(said.status.code(), Some(1), "{name}: {}", said.text);
        assert!(said.text.contains("error[E"), "{name}: {}", said.text);
    }
    // If the file is refused because of its folder, the message says how to allow it.
    place.write("a.osl", "#include \"link.h\"\nshader a() {}\n");
    assert!(place.run(&["check", "a.osl"]).text.contains("-I DIR"));
    for name in ["good.h", "./good.h", "sub/../good.h", "../project/good.h"] {
        place.write("a.osl", format!("#include \"{name}\"\nshader a(output int o = GOOD) {{}}\n"));
        let said = place.run(&["check", "a.osl"]);
        assert_eq!(said.status.code(), Some(0), "{name}: {}", said.text);
    }
    // A folder of -I allows the files below it, also through `..` and links.
    std::fs::write(place.outside().join("secret.h"), "#define GOOD 1\n").unwrap();
    for name in ["../outside/secret.h", "secret.h", "link.h"] {
        place.write("a.osl", format!("#include \"{name}\"\nshader a(output int o = GOOD) {{}}\n"));
        let said = place.run(&["check", "a.osl", "-I", "../outside"]);
        assert_eq!(said.status.code(), Some(0), "{name}: {}", said.text);
    }
}

#[test]
fn includes_of_every_command_and_tool() {
    let place = Place::new("h", HEADER.as_bytes(), b"");
    place.write("a.osl", "#include \"link.h\"\nshader a(output color Cout = 0) { Cout = u; }\n");
    place.write("a.group", "shader a A ;\n");
    place.write(
        "a.ass",
        "options\n{\n xres 2\n yres 2\n}\na\n{\n name m\n}\nsphere\n{\n name s\n shader m\n}\n",
    );
    for args in [
        "a.osl -g 1x1",
        "a.group -g 1x1",
        "compile a.osl",
        "info a.osl",
        "ir a.osl",
        "explain a.osl -g 2x2 --at 0,0",
        "render a.ass -o a.exr",
        "oslc a.osl",
        "oslc -E a.osl",
        "oslinfo a.osl",
        "testshade -g 1 1 a",
    ] {
        place.run(&args.split(' ').collect::<Vec<_>>());
    }
    let said = Said::of(oslrun().args(["a.osl", "-g", "1x1", "--allow-files"]).current_dir(place.project()));
    assert!(said.text.contains(SECRET), "the user may lift this: {}", said.text);
}

#[test]
fn shaders_of_groups() {
    let place = Place::new(
        "osl",
        b"shader secret() { printf(\"sesame\"); sesame }",
        b"shader good(output float o = 0) {}",
    );
    for name in place.tricks().into_iter().filter(|name| !name.ends_with("good.osl.")) {
        for name in [name.as_str(), name.strip_suffix(".osl").unwrap_or("link")] {
            place.write("a.group", format!("shader \"{name}\" A ;\n"));
            let said = place.run(&["a.group", "-g", "1x1"]);
            assert_eq!(said.status.code(), Some(1), "{name}: {}", said.text);
        }
    }
    place.write("a.group", "shader good A ;\n");
    assert_eq!(place.run(&["a.group", "-g", "1x1"]).status.code(), Some(0));
}

#[test]
fn scenes_and_their_includes() {
    let place = Place::new("ass", b"sesame\n{\n", b"options\n{\n xres 1\n yres 1\n}\n");
    for name in place.tricks() {
        place.write("a.ass", format!("include \"{name}\"\n"));
        let said = place.run(&["render", "a.ass", "-o", "a.exr"]);
        assert_eq!(said.status.code(), Some(1), "{name}: {}", said.text);
    }
}

#[test]
fn textures() {
    let place = Place::new("png", b"", b"");
    let white = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
    for path in [place.project().join("good.png"), place.outside().join("secret.png")] {
        write_png(&path, 1, 1, &[&[1.0]], white).unwrap();
    }
    let shader = |text: &str| {
        format!(
            "shader a(string f = \"{text}\", output float o = 0) {{\n\
             color c = texture(f, u, v, \"wrap\", \"clamp\", \"missingcolor\", color(0.25));\n\
             int e = 0; gettextureinfo(f, \"exists\", e); o = c[0] + e; }}"
        )
    };
    let in_text = |name: &str| {
        place.write("a.osl", shader(name));
        place.run(&["a.osl", "-g", "1x1"]).text
    };
    let in_group = |name: &str| {
        place.write("a.osl", shader(""));
        place.write("a.group", format!("param string f \"{name}\" ; shader a A ;\n"));
        place.run(&["a.group", "-g", "1x1"]).text
    };
    let opened = |said: &str| said.contains("o: 1") || said.contains("o: 2");
    for name in place.tricks() {
        // A name without a file gives the missing color; a path that no system accepts may fail the run.
        for said in [in_text(&name), in_group(&name)] {
            assert!(!opened(&said), "{name}: {said}");
        }
    }
    for said in [in_text("good.png"), in_group("good.png")] {
        assert!(said.contains("o: 2"), "{said}");
    }
    place.write("a.osl", "shader a(output color c = 0) { c = texture(\"../outside/secret.png\", u, v); }");
    let refused = place.run(&["a.osl", "-g", "1x1"]).text;
    assert!(refused.contains("--texture-path DIR") && refused.contains("--allow-files"), "{refused}");

    // A name that the user types may be anywhere, but it is a file; other names stay inside.
    place.write("a.osl", shader(""));
    let typed = |name: &str| {
        let alone = place.run(&["a.osl", "-g", "1x1", "-p", &format!("f={name}")]).text;
        let group = format!("param string f \"{name}\" ; shader a A ;");
        let grouped = place.run(&["--group", &group, "-g", "1x1"]).text;
        assert_eq!(opened(&alone), opened(&grouped), "{name}: {alone}{grouped}");
        alone
    };
    let outside = place.outside().join("secret.png").display().to_string();
    let links = [
        "../outside/secret.png",
        "sub/../../outside/secret.png",
        "./.././outside/secret.png",
        "link.png",
        "folder/secret.png",
        "folder/../outside/secret.png",
        &outside,
    ];
    for name in place.tricks() {
        let said = typed(&name);
        // Other files exist for a user who types them, but are no pictures.
        assert_eq!(said.contains("o: 2 "), links.contains(&name.as_str()), "{name}: {said}");
    }
    place.write("a.osl", shader("").replace("texture(f", "texture(\"link.png\"").replace("c[0] + e", "c[0]"));
    assert!(!opened(&typed("good.png")), "the other name is the shader's");
}

#[test]
fn dictionaries() {
    let place = Place::new("xml", b"<a><b k='sesame'/></a>", b"<a><b k='good'/></a>");
    let shader = |text: &str| {
        let find = "int n = dict_find(f, \"/a/b\"); string s = \"\"; dict_value(n, \"k\", s);";
        place.write("a.osl", format!("shader a(string f = \"{text}\") {{ {find} printf(\"[%s]\\n\", s); }}"));
    };
    for name in place.tricks() {
        shader(&name);
        place.run(&["a.osl", "-g", "1x1"]);
    }
    shader("good.xml");
    assert!(place.run(&["a.osl", "-g", "1x1"]).text.contains("[good]"));
    // A name that the user types may be anywhere.
    let args = ["a.osl", "-g", "1x1", "-p", "f=link.xml"];
    assert!(Said::of(oslrun().args(args).current_dir(place.project())).text.contains(SECRET));
}

#[test]
fn what_the_user_names_may_lie_anywhere_but_is_a_file() {
    let place = Place::new("osl", b"shader a(output float o = 0) {}", b"shader a(output float o = 0) {}");
    for name in ["/dev/zero", "/dev/urandom", "pipe.osl", "dir.osl", "loop.osl", "none.osl"] {
        for args in [
            vec!["check", name],
            vec!["fmt", "--check", name],
            vec![name, "-g", "1x1"],
            vec!["good.osl", "-g", "1x1", "--attributes", name],
            vec!["render", name, "-o", "a.exr"],
            vec!["oslc", name],
        ] {
            let said = place.run(&args);
            assert_eq!(said.status.code(), Some(1), "{args:?}: {}", said.text);
        }
    }
    for name in ["../outside/secret.osl", "link.osl", "good.osl"] {
        assert_eq!(place.run(&["check", name]).status.code(), Some(0), "{name}");
    }
    // File names that are not valid text.
    let odd = OsStr::from_bytes(b"\xff.osl");
    std::fs::write(place.project().join(odd), "#include \"b.h\"\nshader a(output float o = B) {}").unwrap();
    place.write("b.h", "#define B 1\n");
    for args in [[OsStr::new("check"), odd], [OsStr::new("compile"), odd]] {
        let said = place.run(&args);
        assert_eq!(said.status.code(), Some(0), "{}", said.text);
    }
    assert!(place.project().join(OsStr::from_bytes(b"\xff.oso")).is_file());
}

#[test]
fn pipes_without_a_name_are_read() {
    let place = Place::new("osl", b"", b"shader a(output float o = 0) {}");
    let shell = |line: &str| {
        let mut command = std::process::Command::new("bash");
        Said::of(
            command.args(["-c", line]).env("O", env!("CARGO_BIN_EXE_oslrun")).current_dir(place.project()),
        )
    };
    for line in [
        "cat good.osl | \"$O\" check /dev/stdin",
        "\"$O\" check <(sleep 0.1; cat good.osl)",
        "\"$O\" check /dev/stdin < good.osl",
        "cat good.osl | \"$O\" fmt - | grep -q shader",
    ] {
        let said = shell(line);
        assert!(said.status.success(), "{line}: {}", said.text);
    }
    for line in [
        "\"$O\" check /dev/stdin < /dev/zero",
        "\"$O\" fmt - < /dev/zero",
        "cat /dev/zero | \"$O\" check /dev/stdin",
    ] {
        let said = shell(line);
        assert_eq!(said.status.code(), Some(1), "{line}: {}", said.text);
    }
}
