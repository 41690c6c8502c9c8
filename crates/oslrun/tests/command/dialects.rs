//! Dialects of renderers: each file of tests/data/dialects runs as its `// expect:` says, docs/dialects.md is
//! current, and every header compiles.

use crate::in_process::oslrun;
use osl_dialects::{Dialects, NONE};
use osl_image::read_image;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The values of an output, if all points have the same: from lines such as `c.G: 0.5 to 0.5, mean 0.5`.
fn values(out: &str, name: &str) -> Vec<f32> {
    let of = |line: &str| {
        let (head, rest) = line.split_once(": ")?;
        let is_it = head == name || head.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
        let (min, max) = rest.split_once(", mean")?.0.split_once(" to ")?;
        (is_it && min == max).then(|| min.parse().ok())?
    };
    out.lines().filter_map(of).collect()
}

/// What is wrong with a case, if anything.
fn wrong(path: &Path, text: &str, folder: &Path) -> Option<String> {
    let field = |name: &str| text.lines().find_map(|line| line.strip_prefix(name));
    let (run, expect) = (field("// run: oslrun ")?, field("// expect: ")?);
    let name = path.file_name()?.to_str()?;
    let word = |word: &str| match word {
        word if word == name => path.display().to_string(),
        "x.png" => folder.join("x.png").display().to_string(),
        "." => path.parent().unwrap_or(path).display().to_string(),
        word => word.to_string(),
    };
    // The text of a group is in quotes.
    let parts = run.split('"').enumerate();
    let words = parts.flat_map(|(at, part)| match at % 2 {
        0 => part.split_whitespace().collect::<Vec<_>>(),
        _ => vec![part],
    });
    let args: Vec<String> = words.map(word).collect();
    let (code, out, err) = oslrun(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let holds = |item: &str| match item.strip_prefix("prints ") {
        Some(text) => format!("{out}{err}").contains(text),
        None => item.split_once(" = ").is_some_and(|(name, wanted)| {
            let wanted: Vec<f32> = wanted.split(' ').filter_map(|x| x.parse().ok()).collect();
            let found = values(&out, name);
            wanted.len() == found.len()
                && wanted.iter().zip(&found).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs())
        }),
    };
    let failed: Vec<&str> = expect.split("; ").filter(|item| !holds(item)).collect();
    (code != 0 || !failed.is_empty()).then(|| format!("{name}: exit {code}, not {failed:?}\n{out}{err}"))
}

#[test]
fn published_forms_run_as_expected() {
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(root().join("tests/data/dialects")).unwrap().flatten().map(|e| e.path()).collect();
    files.sort();
    let case = |path: &PathBuf| wrong(path, &std::fs::read_to_string(path).unwrap(), folder.path());
    let failed: Vec<String> = files.iter().filter_map(case).collect();
    assert!(files.len() >= 38 && failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn the_page_is_current() {
    let path = root().join("docs/dialects.md");
    let (code, page, _) = oslrun(&["dialects", "--markdown"]);
    assert_eq!(code, 0);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let held = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(held == page, "docs/dialects.md is not current: run this test with UPDATE_DOCS=1");
}

#[test]
fn every_header_compiles_without_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    for dialect in Dialects::built_in().list().iter().filter(|dialect| dialect.name != NONE) {
        for header in dialect.headers() {
            let path = folder.path().join("a.osl");
            let text = format!("#include \"{header}\"\nshader a(output float o = 0) {{ o = u; }}\n");
            std::fs::write(&path, text).unwrap();
            let path = path.to_str().unwrap();
            let (code, out, err) = oslrun(&["check", path, "--dialect", &dialect.name]);
            assert!(code == 0 && !err.contains("warning"), "{} {header}: {out}{err}", dialect.name);
        }
    }
}

#[test]
fn a_note_names_the_dialect_unless_the_user_does() {
    let path = root().join("tests/data/dialects/CYCLES_uv.osl");
    let run = |more: &[&str]| oslrun(&[&[path.to_str().unwrap(), "-g", "3x3"], more].concat());
    let note = "note: the file is in the dialect of Blender Cycles (cycles): line 6 asks for the attribute \"geom:uv\"; \
                --dialect overrides it";
    assert_eq!(run(&[]).2.lines().next(), Some(note));
    assert_eq!(run(&["--dialect", "cycles"]).2, "");
    let (_, out, err) = run(&["--dialect", "none"]);
    assert!(values(&out, "found") == [0.0] && err.contains("\"geom:uv\" is not answered"), "{out}{err}");
    let (code, _, err) = run(&["--dialect", "cyles"]);
    assert!(code == 2 && err.contains("did you mean `cycles`?"), "{err}");
    // Values of the user come first.
    let (_, out, _) = run(&["--userdata", "geom:uv=1,2,3"]);
    assert_eq!(values(&out, "found"), [1.0]);
    assert!(values(&out, "err").is_empty(), "it differs from point to point: {out}");
    let (_, out, _) = oslrun(&["info", path.to_str().unwrap()]);
    assert!(out.contains("dialect cycles: line 6"), "{out}");
}

#[test]
fn attributes_are_those_of_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.osl");
    let text = "shader a(output float off = 0, output float asks = 0) {
            point uv = 0, g = 0, p = 0; normal n = 0; vector t = 0; float x;
            asks = getattribute(\"geom:uv\", uv) + getattribute(\"geom:generated\", g) + getattribute(\"geom:N\", n)
                 + getattribute(\"geom:P\", p) + getattribute(\"geom:tangent\", t) + getattribute(\"geom:nothing\", x);
            off = max(distance(uv, point(u, v, 0)), distance(g, 0.5 * P + 0.5));
            off = max(off, max(distance(p, P), max(length(n - N), length(t - normalize(dPdu)))));
            off = off < 1e-5 ? 0 : off;
        }";
    std::fs::write(&path, text).unwrap();
    for more in [&["--on", "sphere"][..], &["--on", "sphere", "--samples", "4"]] {
        let image = folder.path().join("x.exr");
        let args = ["-g", "16x16", "--outputs", "off,asks", "-o"];
        let (code, out, err) =
            oslrun(&[&[path.to_str().unwrap()], &args[..], &[image.to_str().unwrap()], more].concat());
        assert!(code == 0 && err.contains("\"geom:nothing\" is not answered"), "{out}{err}");
        let seen = read_image(&image).unwrap();
        let largest = |name: &str| {
            let at = seen.channels.iter().position(|channel| channel.starts_with(name)).unwrap();
            seen.samples.chunks(seen.channels.len()).map(|pixel| pixel[at]).fold(0.0, f32::max)
        };
        assert_eq!((largest("off"), largest("asks")), (0.0, 5.0), "{more:?}: {:?}", seen.channels);
    }
}

#[test]
fn an_output_for_transparency_lets_light_through() {
    let folder = tempfile::tempdir().unwrap();
    let light = |transparency: &str, dialect: &str| -> Vec<f32> {
        let (path, image) = (folder.path().join("a.osl"), folder.path().join("x.exr"));
        let text = format!(
            "surface a(output color transparency = 0) {{ Ci = diffuse(N); transparency = color({transparency}); }}"
        );
        std::fs::write(&path, text).unwrap();
        let args = [
            path.to_str().unwrap(),
            "--preview",
            "-g",
            "32x32",
            "--samples",
            "64",
            "--dialect",
            dialect,
            "-o",
        ];
        let (code, out, err) = oslrun(&[&args[..], &[image.to_str().unwrap()]].concat());
        assert_eq!(code, 0, "{out}{err}");
        let seen = read_image(&image).unwrap();
        seen.samples.chunks(seen.channels.len()).skip(16 * 32 + 8).take(16).map(|pixel| pixel[0]).collect()
    };
    let mean = |list: Vec<f32>| list.iter().sum::<f32>() / list.len() as f32;
    let (clear, part, solid) =
        (mean(light("1", "vray")), mean(light("0.75", "vray")), mean(light("0.75", "none")));
    let expected = 0.75 * clear + 0.25 * solid;
    assert!((part - expected).abs() < 0.05 * expected.max(0.1), "{clear} {part} {solid}");
    assert!((clear - solid).abs() > 0.05, "{clear} {solid}");
}

#[test]
fn the_differences_of_renderers_have_lines() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.osl");
    let text = "#include \"node_color.h\"\nsurface a(float list[3] = {0, 0, 0}) {\n    float f;\n    \
                getattribute(\"geom:pointiness\", f);\n    float g = noise(\"gabor\", P) + Dx(u);\n    \
                Ci = diffuse_toon(N, f, g) + diffuse(N);\n}\n";
    std::fs::write(&path, text).unwrap();
    let (code, out, err) = oslrun(&["portability", path.to_str().unwrap()]);
    assert_eq!((code, err.as_str()), (0, ""));
    for line in [
        "Octane:\n",
        "    line 5: Dx(): no derivatives\n",
        "    line 5: noise \"gabor\": no Gabor noise\n",
        "    line 6: diffuse_toon: not known there; it is of Blender Cycles\n",
        "    line 6: diffuse(): textures only, without closures\n",
        "    line 1: node_color.h: this header is not there\n",
        "    line 2: parameter `list`: only base types\n",
        "    line 4: getattribute \"geom:pointiness\": this attribute is not known there\n",
        "    a surface shader: only the kind shader\n",
    ] {
        assert!(out.contains(line), "{line}{out}");
    }
    assert!(!out.contains("Blender Cycles:\n    line 6"), "{out}");
}

#[test]
fn a_folder_of_the_user_is_a_dialect() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("mine");
    std::fs::create_dir_all(own.join("headers")).unwrap();
    let names = "title = \"Mine\"\nabout = \"My renderer.\"\nprelude = \"mine.h\"\n[signs]\nwords = [\"MINE\"]\n\
                 [attributes]\nmine = { type = \"float\", default = 4.0, about = \"four\" }\n";
    std::fs::write(own.join("dialect.toml"), names).unwrap();
    std::fs::write(own.join("headers/mine.h"), "#include \"stdosl.h\"\n#define MINE 3\n").unwrap();
    let path = folder.path().join("a.osl");
    std::fs::write(
        &path,
        "shader a(output float o = MINE, output float b = 0) { getattribute(\"mine\", b); }",
    )
    .unwrap();
    let run = |path: &Path, dialects: &Path| {
        oslrun(&[path.to_str().unwrap(), "-g", "2x2", "--dialect-path", dialects.to_str().unwrap()])
    };
    for dialects in [folder.path(), &own] {
        let (code, out, err) = run(&path, dialects);
        assert_eq!(code, 0, "{err}");
        assert!(values(&out, "o") == [3.0] && values(&out, "b") == [4.0], "{out}");
        assert!(err.contains("Mine (mine): line 1 names MINE"), "{err}");
    }
    std::fs::write(own.join("dialect.toml"), "title = 1\n").unwrap();
    let (code, _, err) = run(&path, &own);
    assert!(code == 1 && err.contains("the dialect `mine`:"), "{err}");
    let (code, _, err) = run(&path, &folder.path().join("nowhere"));
    assert!(code == 1 && err.contains("--dialect-path"), "{err}");
}

#[test]
fn a_quotient_of_literals_by_zero_is_infinite_where_the_renderer_has_it_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.osl");
    let text = "shader a(output float a = 1.0/0.0, output float b = 1/0.0, output float c = -1.0/0.0, output float d = 0.0/0.0,
        output float e = 1) { e = a / (u - u); }";
    std::fs::write(&path, text).unwrap();
    let run = |dialect: &str| {
        let (_, out, _) = oslrun(&[path.to_str().unwrap(), "-g", "2x2", "--dialect", dialect]);
        ["a", "b", "c", "d", "e"].map(|name| values(&out, name)[0])
    };
    let inf = f32::INFINITY;
    assert_eq!(run("octane"), [inf, inf, -inf, 0.0, 0.0]);
    assert_eq!(run("none"), [0.0; 5]);
}
