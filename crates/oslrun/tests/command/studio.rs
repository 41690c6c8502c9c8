//! `studio`: the answers of the live page are those of the command line.

use crate::in_process::{oslrun, oslrun_at};
use crate::studio_client::{Page, Studio};
use osl_image::{BitDepth, PngOptions, Transfer, png_bytes, read_image};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, SystemTime};

fn osl(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl").join(name).display().to_string()
}

/// The samples of the PNG file that a command line makes.
fn samples_of(args: &[&str]) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.png").display().to_string();
    let (code, _, err) = oslrun(&[args, &["-o", &file]].concat());
    assert_eq!(code, 0, "{args:?}: {err}");
    let image = read_image(Path::new(&file)).unwrap();
    image.samples.iter().map(|x| (x * 255.0).round() as u8).collect()
}

/// The picture of a state.
fn picture(page: &mut Page, state: Value) -> (Value, Vec<u8>) {
    page.state(state);
    page.until("picture")
}

#[test]
fn pictures_have_the_bits_of_the_command_line() {
    let cobbled = osl("Cobbled.osl");
    let studio = Studio::start(Path::new("."), &[&cobbled, "-g", "48x32", "--uv-scale", "2,2"]);
    let mut page = studio.page();
    let usual = ["-g", "48x32", "--uv-scale", "2,2"];
    for (state, words) in [
        (json!({ "output": "resultRGB" }), vec!["--outputs", "resultRGB"]),
        (
            json!({ "output": "resultRGB", "params": [["radius", "0.3"], ["Small_Freq", "12"]] }),
            vec!["--outputs", "resultRGB", "-p", "radius=0.3", "-p", "Small_Freq=12"],
        ),
        (
            json!({ "output": "resultMask", "params": [["radius", "0.05"]] }),
            vec!["--outputs", "resultMask", "-p", "radius=0.05"],
        ),
        (
            json!({ "output": "resultRGB", "on": "sphere", "params": [["jitter", "0.9"]] }),
            vec!["--outputs", "resultRGB", "--on", "sphere", "-p", "jitter=0.9"],
        ),
        (
            json!({ "output": "resultRGB", "on": "torus", "lit": true, "params": [["radius", "0.3"]] }),
            vec!["--preview", "--base", "resultRGB", "--on", "torus", "-p", "radius=0.3"],
        ),
        (json!({ "output": "resultMask", "on": "patch", "lit": true }), vec!["--preview"]),
    ] {
        let (header, samples) = picture(&mut page, state.clone());
        assert_eq!((&header["width"], &header["height"]), (&json!(48), &json!(32)));
        let expected = samples_of(&[&[cobbled.as_str()], &usual[..], &words[..]].concat());
        assert!(samples == expected, "{state}");
        assert!(samples.iter().any(|byte| *byte != samples[0]), "{state}");
    }
}

#[test]
fn a_small_picture_comes_first() {
    let cobbled = osl("Cobbled.osl");
    let studio = Studio::start(Path::new("."), &[&cobbled, "-g", "48x32"]);
    for (state, words) in [
        (json!({ "output": "resultRGB" }), vec!["--outputs", "resultRGB"]),
        (json!({ "output": "34:dist" }), vec![]),
        (json!({ "output": "resultRGB", "on": "sphere" }), vec!["--outputs", "resultRGB", "--on", "sphere"]),
        (json!({ "on": "sphere", "lit": true }), vec!["--preview", "--on", "sphere"]),
    ] {
        let mut page = studio.page();
        page.state(state.clone());
        assert_eq!(page.next().0["type"], "shader");
        let (header, samples) = page.next();
        assert_eq!(
            (&header["coarse"], &header["width"], &header["height"]),
            (&true.into(), &12.into(), &8.into())
        );
        if !words.is_empty() {
            let usual = [cobbled.as_str(), "-g", "12x8"];
            assert!(samples == samples_of(&[&usual[..], &words[..]].concat()), "{state}");
        }
        let (header, _) = page.next();
        assert_eq!(
            (&header["coarse"], &header["width"], &header["height"]),
            (&false.into(), &48.into(), &32.into())
        );
        let phases = header["phases"].as_object().unwrap();
        assert_eq!(phases.is_empty(), state["lit"] == true, "{header}");
    }
}

/// The samples of the PNG file that a command line with a tap makes. There is a second file if some points do
/// not get to the line.
fn samples_of_a_tap(args: &[&str], output: &str) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("{output}.png").display().to_string();
    let (code, _, err) = oslrun(&[args, &["-o", &file]].concat());
    assert_eq!(code, 0, "{args:?}: {err}");
    let image = read_image(&dir.path().join(format!("{output}.png"))).unwrap();
    image.samples.iter().map(|x| (x * 255.0).round() as u8).collect()
}

#[test]
fn taps_have_the_bits_of_the_command_line() {
    let cobbled = osl("Cobbled.osl");
    let usual = ["-g", "48x32", "--uv-scale", "2,2"];
    let studio = Studio::start(Path::new("."), &[&[cobbled.as_str()], &usual[..]].concat());
    let mut page = studio.page();
    let mut seen = Vec::new();
    for (tap, output, state, words) in [
        ("34:dist", "line34.dist", json!({ "range": "auto" }), vec!["--range", "auto"]),
        ("34:dist@2", "line34.dist.round2", json!({ "range": "1,2.5" }), vec!["--range", "1,2.5"]),
        ("22:pp", "line22.pp", json!({ "params": [["radius", "0.3"]] }), vec!["-p", "radius=0.3"]),
        ("47:intHSV3", "line47.intHSV3", json!({ "on": "sphere" }), vec!["--on", "sphere"]),
    ] {
        let mut state = state;
        state["output"] = json!(tap);
        let (header, samples) = picture(&mut page, state);
        assert_eq!(header["output"], output);
        let words = [&[cobbled.as_str()], &usual[..], &words[..], &["--tap", tap]].concat();
        assert!(samples == samples_of_a_tap(&words, output), "{tap}");
        assert!(samples.iter().any(|byte| *byte != samples[0]), "{tap}");
        seen.push(samples);
    }
    assert!(seen[0] != seen[1]);
    page.state(json!({ "range": "much" }));
    assert!(page.until("failed").0["messages"].to_string().contains("auto"));
    for (tap, why) in
        [("1:nothing", "no statement on line 1"), ("34:dst", "did you mean `dist`?"), ("34:", "a tap is")]
    {
        page.state(json!({ "output": tap }));
        let (failed, _) = page.until("failed");
        assert!(failed["messages"].to_string().contains(why), "{failed}");
    }
}

#[test]
fn a_layer_marks_values_that_the_picture_does_not_show() {
    let folder = tempfile::tempdir().unwrap();
    // Four columns: below, in the range, above, and NaN.
    let text = "shader s(output color c = 0, output float f = 0, output normal n = 0) {
        float x = floor(u * 3 + 0.5);
        f = x == 3 ? 1e38 * (x * 1e38) : x - 0.5;
        c = color(x < 2 ? 0.5 : 1.25, x == 2 ? -0.001 : 0.25, 1);
        n = vector(x - 1.5, 0, 0);
    }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "4x2"]);
    let mut page = studio.page();
    let mut show = |state: Value| {
        let (header, samples) = picture(&mut page, state);
        let said = header["messages"][0]["message"].as_str().unwrap_or_default().to_string();
        (said, header["channels"].as_u64().unwrap(), samples)
    };
    let [grey, blue, orange, pink, violet] =
        [[128_u8; 3], [33, 84, 191], [217, 97, 15], [255, 0, 204], [128, 60, 170]];
    let (said, channels, samples) = show(json!({ "output": "f", "layer": "outside" }));
    assert_eq!(
        said,
        "of 8 pixels: 2 NaN or infinite (pink), 2 below 0 (blue), 2 above 1 (orange); 2 from 0 to 1 (grey)"
    );
    assert_eq!((channels, samples), (3, [[blue, grey, orange, pink]; 2].concat().concat()));
    let (said, _, samples) = show(json!({ "output": "c", "layer": "outside" }));
    assert!(said.contains("2 above 1 (orange), 2 below 0 and above 1"), "{said}");
    assert_eq!(samples[6..12], [violet, orange].concat());
    // Black and white of a normal are -1 and 1, so nothing is outside there but the ends.
    let (said, ..) = show(json!({ "output": "n", "layer": "outside" }));
    assert_eq!(said, "of 8 pixels: 2 below -1 (blue), 2 above 1 (orange); 4 from -1 to 1 (grey)");
    // Pixels that show nothing do not count.
    let (said, channels, _) = show(json!({ "output": "n", "on": "sphere", "layer": "outside" }));
    assert!(!said.contains("of 8 pixels") && channels == 4, "{said}");
    let (said, ..) = show(json!({ "output": "f" }));
    assert!(said.contains("become black"), "without a layer: {said}");
    page.state(json!({ "layer": "gold" }));
    assert!(page.until("failed").0["messages"].to_string().contains("no layer gold"));
    page.state(json!({ "on": "sphere", "lit": true, "layer": "outside" }));
    assert!(page.until("failed").0["messages"].to_string().contains("has no layers"));
}

#[test]
fn a_picture_with_an_error_has_the_bits_of_the_command_line_and_says_its_cost() {
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(float k = 9, output color c = 0, output float f = 0)
        { f = step(0.4, u) * 0.5 + 0.5 * sin(k * v); c = color(f, u, v); }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let file = folder.path().join("s.osl").display().to_string();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "64x48"]);
    let mut page = studio.page();
    let said = |header: &Value| {
        let list = header["messages"].as_array().unwrap().iter();
        list.map(|message| message["message"].as_str().unwrap().to_string()).collect::<Vec<_>>().join("\n")
    };
    let (header, _) = picture(&mut page, json!({ "output": "c" }));
    assert!(!said(&header).contains("evaluations"), "{header}");
    for (error, params) in [("10%", json!([])), ("0.5%", json!([["k", "30"]]))] {
        let state = json!({ "output": "c", "max_error": error, "params": params });
        let mut words = vec![file.as_str(), "-g", "64x48", "--outputs", "c", "--max-error", error];
        if !params.as_array().unwrap().is_empty() {
            words.extend(["-p", "k=30"]);
        }
        let (header, samples) = picture(&mut page, state.clone());
        assert!(samples == samples_of(&words), "{error}");
        let said_now = said(&header);
        for part in [
            "% of the range of c (",
            " evaluations a pixel: ",
            "the error bound is kept, as estimated",
            "it ran for ",
            "the last picture with one sample for each pixel ran for ",
        ] {
            assert!(said_now.contains(part), "{part}: {said_now}");
        }
        assert_eq!(header["text"], "", "the cost is not a text of the shader");
        // The layer: as many pixels are black as are interpolated.
        let mut layer = state.clone();
        layer["layer"] = json!("samples");
        let (header, samples) = picture(&mut page, layer);
        assert_eq!((&header["channels"], samples.len()), (&json!(3), 64 * 48 * 3));
        let black = samples.chunks(3).filter(|pixel| pixel == &[0; 3]).count();
        let words = said(&header);
        let share = format!("black 0 ({:.1} % are interpolated)", 100.0 * black as f64 / (64.0 * 48.0));
        assert!(words.contains(&share) && words.contains(" evaluations a pixel: "), "{share}: {words}");
        assert_eq!(black > 0, error == "10%", "{words}");
        assert!(samples.chunks(3).any(|pixel| pixel == [255; 3]), "{words}");
    }
    let state = json!({ "output": "c", "on": "sphere", "max_error": "10%" });
    let (_, samples) = picture(&mut page, state);
    let words = ["-g", "64x48", "--outputs", "c", "--on", "sphere", "--max-error", "10%"];
    assert!(samples == samples_of(&[&[file.as_str()], &words[..]].concat()), "on a surface");
    // What makes no sense is said.
    for (state, why) in [
        (json!({ "max_error": "much" }), "much"),
        (json!({ "max_error": "0%" }), "above 0 %"),
        (json!({ "max_error": "2%", "on": "sphere", "lit": true }), "for a picture without light"),
        (json!({ "layer": "samples" }), "the same number of samples"),
    ] {
        page.state(state);
        let (failed, _) = page.until("failed");
        assert!(failed["messages"].to_string().contains(why), "{why}: {failed}");
    }
    // A small picture comes first, with one sample for each pixel.
    let mut page = studio.page();
    page.state(json!({ "output": "c", "max_error": "0.5%" }));
    let mut next = page.next();
    while next.0["type"] != "picture" {
        next = page.next();
    }
    assert_eq!(next.0["coarse"], true);
    assert!(next.1 == samples_of(&[&file, "-g", "16x12", "--outputs", "c"]));
    // An error of the command line counts until the page has another one.
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "64x48", "--max-error", "5%"]);
    let mut page = studio.page();
    for (state, error) in
        [(json!({ "output": "f" }), "5%"), (json!({ "output": "f", "max_error": "1%" }), "1%")]
    {
        let (_, samples) = picture(&mut page, state);
        assert!(
            samples == samples_of(&[&file, "-g", "64x48", "--outputs", "f", "--max-error", error]),
            "{error}"
        );
    }
}

/// Replaces the content of a file by another of the same length, and lets it look as old as before.
fn replaced_in_secret(path: &Path, text: &[u8]) {
    let before = std::fs::metadata(path).unwrap();
    assert_eq!(before.len(), text.len() as u64);
    std::fs::write(path, text).unwrap();
    made_old(path, before.modified().unwrap());
}

fn made_old(path: &Path, time: SystemTime) {
    std::fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
}

#[test]
fn the_shader_and_its_texture_are_read_once_until_they_change() {
    let folder = tempfile::tempdir().unwrap();
    let [shader, texture] = ["s.osl", "t.png"].map(|name| folder.path().join(name));
    let text = |more: &str| {
        format!(
            "shader s(float k = 1, string file = \"t.png\", output color f = 0) \
             {{ f = k * color(texture(file, u, v)) + {more}; }}"
        )
    };
    let png = |value: f32| {
        let options = PngOptions { transfer: Transfer::Linear, depth: BitDepth::Eight, software: None };
        png_bytes(Path::new("t.png"), 1, 1, &[&[value]], options).unwrap()
    };
    std::fs::write(&shader, text("0.0")).unwrap();
    std::fs::write(&texture, png(0.25)).unwrap();
    let old = SystemTime::now() - Duration::from_secs(100);
    made_old(&shader, old);
    made_old(&texture, old);

    let studio = Studio::start(folder.path(), &["s.osl", "-g", "4x4", "--range", "0,1"]);
    let mut page = studio.page();
    let mut shown = |k: f32| picture(&mut page, json!({ "params": [["k", k.to_string()]] })).1;
    let first = shown(1.0);
    // Whoever reads one of the files again gets another picture.
    replaced_in_secret(&shader, text("0.5").as_bytes());
    replaced_in_secret(&texture, &png(0.75));
    let double = shown(2.0);
    for event in 0..200 {
        assert_eq!(shown(1.0 + event as f32 / 200.0).len(), first.len());
    }
    assert_eq!((shown(1.0), shown(2.0)), (first.clone(), double));
    made_old(&texture, old - Duration::from_secs(1));
    let brighter = shown(1.0);
    let red = brighter.iter().zip(&first).step_by(3);
    assert!(red.into_iter().all(|(now, before)| now > before), "the texture has changed");
    made_old(&shader, old - Duration::from_secs(1));
    assert_ne!(shown(1.0), brighter, "the shader has changed");
}

#[test]
fn the_layer_of_rounding_errors_is_the_error_map_of_stability() {
    let folder = tempfile::tempdir().unwrap();
    // Subtracting the large number again loses most digits.
    let text = "shader s(float large = 10000, output float f = 0, output color c = 0, output float half = 0)
        { f = (u + large) - large; c = color(f, v, u * v); half = 0.5; }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let file = folder.path().join("s.osl").display().to_string();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "32x24"]);
    let mut page = studio.page();
    for (output, params) in [("f", vec![]), ("c", vec!["large=300"])] {
        let list: Vec<Vec<&str>> = params.iter().map(|text: &&str| text.split('=').collect()).collect();
        let state = json!({ "output": output, "layer": "rounding", "params": list });
        let (header, samples) = picture(&mut page, state);
        let map = folder.path().join("map.png");
        let path = map.display().to_string();
        let mut words = vec!["stability", &file, "--points", "32x24", "--outputs", output];
        words.extend(["--no-params", "--error-map", &path]);
        params.iter().for_each(|text| words.extend(["-p", text]));
        let (code, _, err) = oslrun(&words);
        assert_eq!(code, 0, "{err}");
        let image = read_image(&map).unwrap();
        let expected: Vec<u8> = image.samples.iter().map(|x| (x * 255.0).round() as u8).collect();
        assert_eq!(image.channels.len(), 1);
        assert!(samples == expected && samples.iter().any(|byte| *byte > 60), "{output}");
        let said = header["messages"].to_string();
        assert!(said.contains("decimal digits lost to rounding: at most "), "{said}");
    }
    let (header, samples) = picture(&mut page, json!({ "output": "half", "layer": "rounding" }));
    assert!(header["messages"].to_string().contains("no digit is lost"), "{header}");
    assert!(samples.iter().all(|byte| *byte == 0));
    for state in [
        json!({ "layer": "rounding", "on": "sphere" }),
        json!({ "layer": "rounding", "on": "sphere", "lit": true }),
        json!({ "layer": "rounding", "output": "2:f" }),
    ] {
        page.state(state.clone());
        let (failed, _) = page.until("failed");
        let said = failed["messages"].to_string();
        assert!(said.contains("is for an output on the patch") || said.contains("has no layers"), "{said}");
    }
    // Like any other picture it is given up for the next one.
    let slow = "shader s(int n = 1, output float f = 0) { for (int i = 0; i < n; i++) f += noise(P * i); }";
    std::fs::write(folder.path().join("slow.osl"), slow).unwrap();
    page.state(json!({ "file": "slow.osl", "layer": "rounding", "params": [["n", "100000000"]] }));
    page.state(json!({ "file": "slow.osl", "params": [["n", "2"]] }));
    page.until("picture");
}

/// The picture of a difference, and what the command says about it.
fn compared(args: &[&str]) -> (Vec<u8>, Value) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.png").display().to_string();
    let (_, out, err) = oslrun(&[&["compare", "-o", &file, "--json"], args].concat());
    let image = read_image(Path::new(&file)).unwrap_or_else(|why| panic!("{why}: {err}"));
    let samples = image.samples.iter().map(|x| (x * 255.0).round() as u8).collect();
    (samples, serde_json::from_str(&out).unwrap())
}

#[test]
fn the_difference_to_a_pinned_picture_is_that_of_compare() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("Cobbled.osl").display().to_string();
    std::fs::copy(osl("Cobbled.osl"), &file).unwrap();
    let studio = Studio::start(folder.path(), &[&file, "-g", "48x32"]);
    let mut page = studio.page();
    let shown = |params: Value| json!({ "output": "resultRGB", "layer": "difference", "params": params });
    page.state(shown(json!([])));
    assert!(page.until("failed").0["messages"].to_string().contains("no values are pinned"));
    let said = |header: &Value| header["messages"][0]["message"].as_str().unwrap().to_string();
    for on in ["patch", "sphere"] {
        let state = |params: Value, layer: &str| json!({ "output": "resultRGB", "on": on, "params": params, "layer": layer });
        page.state(json!({ "output": "resultRGB", "on": on }));
        page.until("picture");
        page.pin();
        assert_eq!(page.until("pinned").0["pinned"], true);
        let (header, samples) = picture(&mut page, state(json!([]), "difference"));
        assert_eq!(said(&header), "every value is equal to that of the pinned picture, in 1536 pixels");
        assert!(samples.iter().all(|byte| *byte == 0));
        let (header, samples) = picture(&mut page, state(json!([["radius", "0.3"]]), "difference"));
        let mut words = vec![file.as_str(), "-g", "48x32", "--outputs", "resultRGB"];
        if on != "patch" {
            words.extend(["--on", on]);
        }
        words.extend(["--", "-p", "radius=0.3"]);
        let (expected, numbers) = compared(&words);
        assert!(samples == expected, "{on}");
        let said = said(&header);
        let different = numbers["different_pixels"].as_u64().unwrap();
        assert!(said.starts_with(&format!("{different} of 1536 pixels differ")), "{said}: {numbers}");
        let largest = |channel: &&Value| channel["largest"].as_f64().unwrap();
        let worst =
            numbers["channels"].as_array().unwrap().iter().max_by(|a, b| largest(a).total_cmp(&largest(b)));
        let at = &worst.unwrap()["at"]["pixel"];
        assert!(
            said.contains(&format!("at pixel ({}, {}), the rms of the components ", at[0], at[1])),
            "{said}: {at}"
        );
    }
    // The pinned values are those of the file at that time.
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replacen("float radius = 0.15", "float radius = 0.25", 1)).unwrap();
    page.until("shader");
    let (header, _) =
        picture(&mut page, json!({ "output": "resultRGB", "on": "sphere", "layer": "difference" }));
    assert!(said(&header).contains("pixels differ from the pinned picture"), "{header}");
    page.state(json!({ "output": "resultMask", "on": "sphere", "layer": "difference" }));
    let (failed, _) = page.until("failed");
    assert!(
        failed["messages"].to_string().contains("has 3 components, and `resultMask` has 1 component"),
        "{failed}"
    );
}

#[test]
fn lines_have_the_pictures_of_a_picture_book() {
    let cobbled = osl("Cobbled.osl");
    let usual = ["-g", "48x32", "-p", "radius=0.3"];
    let studio = Studio::start(Path::new("."), &[&[cobbled.as_str()], &usual[..]].concat());
    let mut page = studio.page();
    page.state(json!({}));
    let (shader, _) = page.until("shader");
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("book.html").display().to_string();
    let (code, _, err) = oslrun(&[&["picture-book", &cobbled], &usual[..], &["-o", &file]].concat());
    assert_eq!(code, 0, "{err}");
    let book = std::fs::read_to_string(file).unwrap();
    let lines = shader["lines"].as_array().unwrap();
    assert!(lines.len() > 20 && lines.contains(&json!(34)) && !lines.contains(&json!(1)), "{lines:?}");
    let (mut pictures, mut taps, mut rounds) = (0, 0, 0);
    for line in lines {
        page.line(u32::try_from(line.as_u64().unwrap()).unwrap());
        let (found, _) = page.until("line");
        assert_eq!((&found["line"], &found["more"]), (line, &json!(0)));
        let (_, row) = book.split_once(&format!(" id=L{line}>")).unwrap();
        let (row, _) = row.split_once("</tr>").unwrap();
        for shown in found["pictures"].as_array().unwrap() {
            let [name, words] = ["name", "words"].map(|part| shown[part].as_str().unwrap());
            let caption = format!("<b>{name}</b> <span class=dim>{words}</span>");
            assert!(row.contains(&caption), "{shown} in {row}");
            if let Some(url) = shown["picture"].as_str() {
                pictures += 1;
                assert!(row.contains(url), "line {line}: {name}");
            }
            if let Some(tap) = shown["tap"].as_str() {
                taps += 1;
                assert_eq!(tap, format!("{line}:{name}"));
                assert!(row.contains(&format!("--tap {tap}")) || shown["picture"].is_null());
            }
            for url in shown["rounds"].as_array().unwrap() {
                rounds += 1;
                assert!(row.contains(url.as_str().unwrap()), "line {line}: {name}");
            }
        }
    }
    assert!(pictures > 20 && taps > 20 && rounds > 5, "{pictures} {taps} {rounds}");
    // Large pictures have small ones, and lines that do nothing have none.
    page.line(1);
    assert_eq!(page.until("line").0["pictures"], json!([]));
    page.state(json!({ "on": "torus" }));
    page.until("picture");
    page.line(34);
    let words = page.until("line").0.to_string();
    assert!(words.contains(" of the points"), "the background is left out: {words}");
}

#[test]
fn lines_of_other_files_have_no_pictures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("g.group"), "shader fractal noise;").unwrap();
    let studio = Studio::start(folder.path(), &["g.group", "-g", "4x4"]);
    let mut page = studio.page();
    page.state(json!({}));
    assert_eq!(page.until("shader").0["lines"], json!([]));
    page.line(1);
    let (found, _) = page.until("line");
    assert!(found["messages"].to_string().contains("only the lines of a source"), "{found}");
}

#[test]
fn groups_have_the_parameters_of_all_layers() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("g.group"),
        "param float scale 2; shader fractal noise; shader ramp ramp; connect noise.result ramp.position;",
    )
    .unwrap();
    let studio = Studio::start(folder.path(), &["g.group", "-g", "16x16"]);
    let mut page = studio.page();
    page.state(json!({}));
    let (shader, _) = page.until("shader");
    let layers: Vec<&str> =
        shader["layers"].as_array().unwrap().iter().map(|layer| layer["name"].as_str().unwrap()).collect();
    assert_eq!(layers, ["noise", ""], "{shader}");
    let output = shader["outputs"][0]["name"].as_str().unwrap().to_string();
    let state = json!({ "output": output, "params": [["noise.frequency", "3"]] });
    let (_, samples) = picture(&mut page, state);
    let group = folder.path().join("g.group").display().to_string();
    let words = [group.as_str(), "-g", "16x16", "-p", "noise.frequency=3", "--outputs", &output];
    assert!(samples == samples_of(&words));
}

#[test]
fn a_state_is_a_group_of_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(osl("Cobbled.osl"), folder.path().join("Cobbled.osl")).unwrap();
    // The shader has another name than its file.
    let kinds = "struct pair { float a; color b; };
        shader other(string kind = \"a\", int n = 1, color tint = 1, float list[3] = {1, 2, 3},
            matrix m = 1, pair p = {1, color(0.5)}, output color c = 0)
        { c = tint * list[n] * 0.1 * p.b + (kind == \"x \\\"y\\\"\" ? u : v) * m[0][0] * p.a; }";
    std::fs::write(folder.path().join("my kinds.osl"), kinds).unwrap();
    std::fs::write(
        folder.path().join("g.group"),
        "param float scale 2; shader fractal noise; shader ramp last; connect noise.result last.position;",
    )
    .unwrap();
    let studio = Studio::start(folder.path(), &["Cobbled.osl", "-g", "24x16"]);
    let mut page = studio.page();
    for (state, output, part) in [
        (
            json!({ "file": "Cobbled.osl", "params": [["radius", "0.3"], ["jitter", "0.1234567"]] }),
            "resultRGB",
            "param float radius 0.3 ;",
        ),
        (
            json!({ "file": "my kinds.osl", "params": [
                ["kind", "x \"y\""], ["n", "2"], ["tint", "0.2"], ["list", "3,1,0.7"], ["m", "0.5"],
                ["p.b", "1,0.25,0.125"]
            ] }),
            "c",
            "shader \"my kinds\" other ;",
        ),
        (
            json!({ "file": "g.group", "params": [["noise.frequency", "3"]] }),
            "",
            "connect noise.result last.position ;",
        ),
    ] {
        let mut state = state;
        page.state(state.clone());
        let (shader, _) = page.until("shader");
        let output = if output.is_empty() { shader["outputs"][0]["name"].as_str().unwrap() } else { output };
        state["output"] = json!(output);
        let (_, samples) = picture(&mut page, state.clone());
        page.group();
        let (answer, _) = page.until("group");
        let text = answer["text"].as_str().unwrap_or_else(|| panic!("{answer}"));
        assert!(text.contains(part), "{text}");
        let copy = folder.path().join("copy.group");
        std::fs::write(&copy, text).unwrap();
        let words = [&copy.display().to_string(), "-g", "24x16", "--outputs", output];
        assert!(samples == samples_of(&words), "{text}");
        let plain = json!({ "file": state["file"], "output": output });
        let (_, usual) = picture(&mut page, plain);
        assert!(samples != usual, "the values make a difference: {text}");
    }
    page.state(json!({ "file": "Cobbled.osl", "params": [["radius", "much"]] }));
    page.group();
    assert!(page.until("group").0["messages"].to_string().contains("much"));
}

#[test]
fn explanations_are_those_of_explain() {
    let flakes = osl("flakes.osl");
    let studio = Studio::start(Path::new("."), &[&flakes, "-g", "16x12"]);
    let mut page = studio.page();
    page.state(json!({}));
    let (info, _) = page.until("shader");
    let described = oslrun(&["info", &flakes, "--json"]).1;
    let described: Value = serde_json::from_str(&described).unwrap();
    assert_eq!(info["layers"][0]["description"], described);
    let name = described["parameters"][0]["name"].as_str().unwrap();
    let value = described["parameters"][0]["default"].to_string();
    let params = json!([[name, value.trim_matches(|c| c == '[' || c == ']' || c == '"')]]);
    picture(&mut page, json!({ "params": params }));
    for (x, y) in [(0, 0), (5, 11), (15, 3)] {
        page.point(x, y);
        let (found, _) = page.until("explanation");
        let at = format!("{x},{y}");
        let given = format!("{}={}", params[0][0].as_str().unwrap(), params[0][1].as_str().unwrap());
        let (code, out, _) =
            oslrun(&["explain", &flakes, "-g", "16x12", "--at", &at, "--json", "-p", &given]);
        assert_eq!(code, 0);
        assert!(found["explanation"] == serde_json::from_str::<Value>(&out).unwrap(), "{at}");
    }
    page.point(16, 0);
    let (outside, _) = page.until("explanation");
    assert!(outside["messages"].to_string().contains("the last is 15,11"), "{outside}");
}

#[test]
fn points_of_nested_loops_are_explained_as_far_as_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let loops: String = (0..40).map(|i| format!("for (int i{i} = 0; i{i} < 2; i{i}++)\n")).collect();
    let file = folder.path().join("nest.osl");
    std::fs::write(&file, format!("shader nest(output float r = 0)\n{{\n{loops}    r += 1;\n}}\n")).unwrap();
    let file = file.display().to_string();
    let studio = Studio::start(Path::new("."), &[&file, "-g", "2x2", "--limit", "running.trace=20000"]);
    let mut page = studio.page();
    page.state(json!({}));
    page.until("shader");
    page.point(0, 0);
    let (found, _) = page.until("explanation");
    assert_eq!(found["explanation"]["cut"], true, "{found}");
}

#[test]
fn the_layer_of_the_cost_shows_the_steps() {
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(output float f = 0) { for (int i = 0; i < 4 * u; i++) f += i; }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "5x2"]);
    let mut page = studio.page();
    let (header, samples) = picture(&mut page, json!({ "layer": "cost" }));
    let said = header["messages"][0]["message"].as_str().unwrap().to_string();
    let (code, _, err) = oslrun_at(folder.path(), "@/s.osl -g 5x2 --steps -o @/a.exr");
    assert_eq!(code, 0, "{err}");
    let image = read_image(&folder.path().join("a.exr")).unwrap();
    let steps = image.plane(image.channels.iter().position(|name| name == "steps").unwrap());
    let (least, most) = (steps[0], steps[4]);
    assert!(said.contains(&format!("white ({most} steps): at least {least}, on average ")), "{said}");
    assert_eq!(header["channels"], 3);
    assert_eq!(samples[12..15], [255; 3], "the last pixel of the first row");
    assert!(samples[..3] != [255; 3] && samples[..15] == samples[15..]);
    page.state(json!({ "layer": "cost", "on": "sphere" }));
    assert!(page.until("failed").0["messages"].to_string().contains("for the patch"));
}

const GOOD: &str = "shader s(float k = 1, output float f = 0) { f = k * u; }";

#[test]
fn errors_on_disk_are_shown_at_their_lines_and_go_away() {
    let folder = tempfile::tempdir().unwrap();
    let write = |text: &str| std::fs::write(folder.path().join("s.osl"), text).unwrap();
    write(GOOD);
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "4x4"]);
    let mut page = studio.page();
    page.state(json!({}));
    assert_eq!(page.until("shader").0["diagnostics"], json!([]));
    let (_, before) = page.until("picture");
    write("// a comment\nshader s(float k = 1, output float f = 0) { f = k * ; }");
    let (shader, _) = page.until("shader");
    let error = &shader["diagnostics"][0];
    assert_eq!(
        (&error["severity"], &error["file"], &error["line"]),
        (&json!("error"), &json!("s.osl"), &json!(2))
    );
    assert_eq!(shader["layers"], json!([]), "there is nothing to run");
    let (code, lesson, _) = oslrun(&["explain-error", error["code"].as_str().unwrap()]);
    assert_eq!((code, &shader["lessons"][error["code"].as_str().unwrap()]), (0, &json!(lesson.trim_end())));
    assert!(shader["text"].as_str().unwrap().contains("a comment"));
    // The page keeps its picture: it gets no other.
    page.until("failed");
    write(&GOOD.replace("k * u", "k * u + 0"));
    assert_eq!(page.until("shader").0["diagnostics"], json!([]));
    assert_eq!(page.until("picture").1, before);
    // A header counts too, also one that comes later.
    write("#include \"k.h\"\nshader s(output float f = 0) { f = K * u; }");
    assert_eq!(page.until("shader").0["diagnostics"][0]["line"], 1);
    page.until("failed");
}

#[test]
fn a_page_reads_only_below_the_folder_of_its_file_and_writes_nothing() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("inside");
    std::fs::create_dir(&folder).unwrap();
    std::fs::create_dir(folder.join("more")).unwrap();
    let printing = "shader s(string file = \"\", output color f = 0) \
        { f = texture(file, u, v); fprintf(\"log.txt\", \"x\"); printf(\"y\"); }";
    std::fs::write(folder.join("s.osl"), printing).unwrap();
    std::fs::write(folder.join("more/t.osl"), GOOD).unwrap();
    std::fs::write(outside.path().join("secret.osl"), GOOD).unwrap();
    let path = |name: &str| outside.path().join(name).display().to_string();
    let (code, _, err) = oslrun_at(outside.path(), "@/secret.osl -g 2x2 -o @/secret.png");
    assert_eq!(code, 0, "{err}");
    #[cfg(unix)]
    std::os::unix::fs::symlink(outside.path().join("secret.osl"), folder.join("link.osl")).unwrap();

    let studio = Studio::start(&folder, &["s.osl", "-g", "2x2"]);
    let mut page = studio.page();
    for file in ["../secret.osl", "more/../../secret.osl", &path("secret.osl"), "link.osl", "s.png", ".", ""]
    {
        page.state(json!({ "file": file }));
        let (failed, _) = page.until("failed");
        assert!(!failed["messages"].as_array().unwrap().is_empty(), "{file}");
        assert!(!failed.to_string().contains("k * u"), "{file}");
    }
    page.state(json!({ "file": "more/t.osl" }));
    assert_eq!(page.until("shader").0["text"], GOOD);
    page.until("picture");
    // A value of the page is not a name that the user typed.
    let (header, black) =
        picture(&mut page, json!({ "file": "s.osl", "params": [["file", path("secret.png")]] }));
    assert!(header["messages"].to_string().contains("is refused"), "{header}");
    assert!(black.iter().all(|byte| *byte == 0));
    assert_eq!(header["text"], "yyyy");
    assert!(!folder.join("log.txt").exists());
}

#[test]
fn a_page_saves_the_source_that_it_shows() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.osl");
    std::fs::write(&file, GOOD).unwrap();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "4x4"]);
    let mut page = studio.page();
    page.state(json!({}));
    let (shader, _) = page.until("shader");
    assert_eq!((&shader["locked"], &shader["max_message"]), (&Value::Null, &json!(256 << 10)));
    let (_, before) = page.until("picture");
    let next = GOOD.replace("k * u", "k * v");
    page.save("s.osl", &shader["version"], &next);
    let (saved, _) = page.until("saved");
    assert_eq!(saved["saved"], true, "{saved}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), next);
    // The page follows, as after a change by somebody else.
    page.state(json!({}));
    let (_, after) = page.until("picture");
    assert!(before != after && after == samples_of(&[&file.display().to_string(), "-g", "4x4"]));
    // An error is at its line.
    page.save("s.osl", &saved["version"], &GOOD.replace("k * u", "k *"));
    let (saved, _) = page.until("saved");
    assert_eq!(saved["saved"], true, "{saved}");
    let shader = shader_with(&mut page, "version", &saved["version"]);
    assert_eq!(shader["diagnostics"][0]["line"], 1);
    // Somebody else's text is not overwritten, unless the page names it.
    std::fs::write(&file, "// theirs\n").unwrap();
    page.save("s.osl", &saved["version"], GOOD);
    let (refused, _) = page.until("saved");
    assert!(refused["messages"].to_string().contains("has changed on the disk since"), "{refused}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "// theirs\n");
    page.save("s.osl", &refused["version"], GOOD);
    assert_eq!(page.until("saved").0["saved"], true);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), GOOD);
}

/// The next description of a shader with this property.
fn shader_with(page: &mut Page, name: &str, value: &Value) -> Value {
    loop {
        let (shader, _) = page.next();
        if shader["type"] == "shader" && shader[name] == *value {
            return shader;
        }
    }
}

#[test]
fn a_page_saves_no_other_file() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("inside");
    std::fs::create_dir(&folder).unwrap();
    let group = "shader s layer;";
    for (name, text) in [("s.osl", GOOD), ("t.osl", GOOD), ("s.h", GOOD), ("s.oso", GOOD), ("g.group", group)]
    {
        std::fs::write(folder.join(name), text).unwrap();
    }
    std::fs::write(folder.join("bytes.osl"), b"// \xff\n").unwrap();
    std::fs::write(outside.path().join("secret.osl"), GOOD).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(outside.path().join("secret.osl"), folder.join("link.osl")).unwrap();
    let studio = Studio::start(&folder, &["s.osl", "-g", "2x2"]);
    let mut page = studio.page();
    page.state(json!({}));
    let version = page.until("shader").0["version"].clone();
    page.until("picture");
    let mut refused = |state: Value, file: &str, text: &str| {
        page.state(state);
        page.save(file, &version, text);
        let (answer, _) = page.until("saved");
        assert_eq!(answer["saved"], false, "{file}");
        answer["messages"][0]["message"].as_str().unwrap_or_default().to_string()
    };
    let secret = outside.path().join("secret.osl").display().to_string();
    // The page shows s.osl.
    for file in ["t.osl", "../secret.osl", &secret, "link.osl", "s.h", "new.osl", "", ".", "./s.osl"] {
        let why = refused(json!({}), file, "x");
        assert!(why.contains("the page does not show"), "{file}: {why}");
    }
    // What the page cannot show it cannot save.
    for file in ["../secret.osl", &secret, "link.osl", "s.h", "new.osl"] {
        let why = refused(json!({ "file": file }), file, "x");
        assert!(!why.is_empty() && !why.contains("has changed"), "{file}: {why}");
    }
    let why = refused(json!({ "file": "g.group" }), "g.group", "x");
    assert!(why.contains("a page saves only sources (.osl)"), "{why}");
    let why = refused(json!({ "file": "bytes.osl" }), "bytes.osl", "x");
    assert!(why.contains("it is not text (byte 3 is not UTF-8)"), "{why}");
    let why = refused(json!({}), "s.osl", "a\0b");
    assert!(why.contains("it is not text (byte 1 is zero)"), "{why}");
    // The reason is there before the attempt.
    for (file, reason) in [
        ("g.group", "a page saves only sources (.osl)"),
        ("bytes.osl", "it is not text (byte 3 is not UTF-8)"),
    ] {
        page.state(json!({ "file": file }));
        assert_eq!(shader_with(&mut page, "file", &json!(file))["locked"], reason);
    }
    let names: std::collections::BTreeSet<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert!(!names.contains("new.osl") && names.iter().all(|name| !name.contains(".part")), "{names:?}");
    for path in [folder.join("s.osl"), folder.join("t.osl"), folder.join("s.h"), secret.into()] {
        assert_eq!(std::fs::read_to_string(&path).unwrap(), GOOD, "{}", path.display());
    }
    assert_eq!(std::fs::read(folder.join("bytes.osl")).unwrap(), b"// \xff\n");
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_is_shown_when_named_and_never_saved() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("inside");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(outside.path().join("real.osl"), GOOD).unwrap();
    std::os::unix::fs::symlink("../real.osl", folder.join("s.osl")).unwrap();
    let studio = Studio::start(&folder, &["s.osl", "-g", "2x2"]);
    let mut page = studio.page();
    page.state(json!({}));
    let (shader, _) = page.until("shader");
    let why = "it lies outside of the folders that may be used";
    assert_eq!(shader["locked"], why);
    page.until("picture");
    page.save("s.osl", &shader["version"], "x");
    let (refused, _) = page.until("saved");
    assert!(refused["messages"].to_string().contains(why), "{refused}");
    assert_eq!(std::fs::read_to_string(outside.path().join("real.osl")).unwrap(), GOOD);
}

#[test]
fn limits_hold_for_every_picture() {
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(int n = 1, output float f = 0) { for (int i = 0; i < n; i++) f += noise(P * i); }";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "8x8", "--max-steps", "1000"]);
    let mut page = studio.page();
    page.state(json!({ "params": [["n", "1000000000"]] }));
    assert!(page.until("failed").0["messages"].to_string().contains("takes more than"));
    page.line(1);
    assert!(page.until("line").0["messages"].to_string().contains("takes more than"));
    picture(&mut page, json!({ "params": [["n", "2"]] }));
    page.state(json!({ "params": [["n", "many"]] }));
    assert!(!page.until("failed").0["messages"].as_array().unwrap().is_empty());
    page.state(json!({ "on": "/etc/passwd" }));
    assert!(page.until("failed").0["messages"].to_string().contains("a page has no surface"));
}

#[cfg(target_os = "linux")]
#[test]
fn huge_messages_do_not_take_memory() {
    let cobbled = osl("Cobbled.osl");
    let studio = Studio::start(Path::new("."), &[&cobbled, "-g", "8x8"]);
    picture(&mut studio.page(), json!({ "output": "resultRGB" }));
    let before = studio.memory();
    let mut pages: Vec<Page> = (0..20).map(|_| studio.page()).collect();
    for page in &mut pages {
        page.huge();
    }
    let mut page = studio.page();
    picture(&mut page, json!({ "output": "resultRGB" }));
    assert!(studio.memory() < before + (64 << 20), "{before} bytes, then {}", studio.memory());
}

#[test]
fn wrong_command_lines_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.osl"), GOOD).unwrap();
    let mut said = String::new();
    for line in ["", "missing.osl", "@/s.osl -o @/a.png", "@/s.osl --token short", "@/s.osl --port 0"] {
        let (code, out, err) = oslrun_at(folder.path(), &format!("studio {line}"));
        assert_eq!(out, "", "{line}");
        said += &format!("$ oslrun studio {line}\n{err}[exit {code}]\n\n");
    }
    insta::assert_snapshot!("refused", said);
}
