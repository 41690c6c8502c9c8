//! `studio` in a real browser: Chromium, if it is installed.
//!
//! `OSLRUN_SCREENSHOTS=FOLDER` saves pictures of the window. The figures of docs/studio.md come from
//! `cargo test --release -p oslrun --test studio_browser -- --ignored --nocapture figures`, its pictures from
//! `pictures`.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod in_process;
mod studio_client;

use in_process::oslrun;
use osl_image::read_image;
use serde_json::Value;
use std::path::Path;
use studio_client::Studio;
use studio_client::shown::{IDLE, LINES, browser, params, pixels, pixels_of, screenshot};

const TOKEN: &str = "a-token-that-both-servers-have";
/// The arrow to the right, as WebDriver names it.
const RIGHT: char = '\u{E014}';
/// The arrow down.
const DOWN: char = '\u{E015}';

fn cobbled() -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/Cobbled.osl");
    std::fs::read_to_string(file).unwrap()
}

/// The picture of a command line.
fn picture_of(words: &[String]) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.png").display().to_string();
    let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
    words.extend(["-o", &file]);
    let (code, _, err) = oslrun(&words);
    assert_eq!(code, 0, "{words:?}: {err}");
    read_image(Path::new(&file)).unwrap().samples.iter().map(|x| (x * 255.0).round() as u8).collect()
}

/// What is typed is compiled and pictured without being saved: an error is marked at its column, its fix is a
/// button, and undo goes back.
#[test]
fn a_text_is_shown_while_it_is_typed() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    let text = "shader s(output color c = 0) {\n    c = color(u, v, 0);\n}\n";
    std::fs::write(folder.path().join("s.osl"), text).unwrap();
    let studio = Studio::start(folder.path(), &["s.osl", "-g", "32x32"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let first = pixels(&browser);
    browser.run("document.getElementById('edit').click();");
    let insert = |at: &str, word: &str| {
        browser.run(&format!(
            "const text = document.getElementById('editor');
             text.focus();
             const at = text.value.indexOf('{at}');
             text.setSelectionRange(at, at);
             document.execCommand('insertText', false, '{word}');"
        ));
    };
    insert("u, v", "smothstep(0, 1, v) * ");
    browser.wait("document.querySelectorAll('.mark.error').length === 1");
    let mark = browser.run(
        "const place = document.querySelector('.mark').style;
         return [place.getPropertyValue('--line'), place.getPropertyValue('--from'), place.getPropertyValue('--columns')]",
    );
    assert_eq!(mark, serde_json::json!(["1", "14", "9"]), "line 2, columns 15 to 23");
    assert_eq!(pixels(&browser), first, "the last picture stays");
    browser.run("document.querySelector('#messages .fix').click();");
    browser.wait("document.querySelectorAll('.mark').length === 0");
    browser.wait(IDLE);
    let second = pixels(&browser);
    assert_ne!(second, first);
    assert_eq!(std::fs::read_to_string(folder.path().join("s.osl")).unwrap(), text, "nothing is saved");
    browser.run("document.execCommand('undo'); document.execCommand('undo');");
    browser.wait("!document.getElementById('editor').value.includes('smo')");
    // The picture follows: with the step, the first row is black.
    let red = "document.getElementById('picture').getContext('2d').getImageData(1, 0, 1, 1).data[0]";
    browser.wait(&format!("{red} > 0"));
    browser.wait(IDLE);
    assert_eq!(pixels(&browser), first);
    // A text that is not saved goes with the editor.
    insert("u, v", "1 - ");
    browser.wait(&format!("{red} > 200"));
    browser.run("document.getElementById('discard').click();");
    browser.wait(&format!("{red} < 100"));
    browser.wait(IDLE);
    assert_eq!(pixels(&browser), first);
}

/// A file with errors shows nothing of the file before it, and no control changes what it does not have.
#[test]
fn another_file_with_errors_has_no_picture_and_no_controls() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    std::fs::write(folder.path().join("wrong.osl"), "shader s(float k = 1) { float d = ; }").unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "32x32"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let choose = |name: &str| {
        browser.run(&format!(
            "const file = document.getElementById('file');
             file.value = '{name}';
             file.dispatchEvent(new Event('change'))"
        ));
    };
    browser.run("document.getElementById('picture').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' }))");
    browser.wait("document.querySelector('#explanation table')");
    choose("wrong.osl");
    browser.wait("document.getElementById('status').textContent === 'errors'");
    let is_empty = browser.run(
        "const canvas = document.getElementById('picture');
         const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
         return data.every((byte) => byte === 0) && !document.querySelector('#explanation table, #source .value, .parameter')
             && ['random', 'reset', 'output'].every((name) => document.getElementById(name).disabled)",
    );
    assert_eq!(is_empty, true);
    browser.run("document.getElementById('random').click()");
    choose("lines.osl");
    browser.wait(IDLE);
    let is_back =
        "return document.querySelector('.parameter') && !document.getElementById('random').disabled";
    assert_eq!(browser.run(is_back), true);
    assert_eq!(params(&browser), Vec::<String>::new());
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// The value as a browser has it: all numbers are of one type.
fn plain(value: &Value) -> Value {
    match value {
        Value::Number(number) => Value::from(number.as_f64()),
        Value::Array(list) => list.iter().map(plain).collect(),
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.clone(), plain(value))).collect(),
        value => value.clone(),
    }
}

#[test]
fn a_shader_is_shown_changed_broken_and_mended() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("Cobbled.osl");
    std::fs::write(&file, cobbled()).unwrap();
    let path = file.display().to_string();
    let size = std::env::var("OSLRUN_STUDIO_SIZE").unwrap_or_else(|_| "96x96".to_string());
    let studio = Studio::start(folder.path(), &["Cobbled.osl", "-g", &size, "--token", TOKEN]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let words = |params: &[String]| {
        let usual = [&path, "-g", &size, "--outputs", "resultRGB"].map(str::to_string);
        let params = params.iter().flat_map(|text| ["-p".to_string(), text.clone()]);
        usual.into_iter().chain(params).collect::<Vec<_>>()
    };
    let usual = picture_of(&words(&[]));
    assert!(pixels(&browser) == usual, "the picture at the defaults");
    browser.run("document.getElementById('pin').click()");
    browser.wait("document.getElementById('pin').textContent === 'Unpin'");

    // The slider of a parameter.
    browser.mouse("[data-name=radius] input[type=range]", (-30, 0), Some((25, 0)));
    browser.wait("location.hash.includes('radius')");
    browser.wait(IDLE);
    let set = params(&browser);
    assert!(set.len() == 1 && set[0].starts_with("radius="), "{set:?}");
    let shown = pixels(&browser);
    assert!(shown == picture_of(&words(&set)), "the picture at {set:?}");
    assert!(shown != usual, "{set:?}");
    assert!(pixels_of(&browser, "pinned") == usual, "the pinned picture");
    browser.run(
        "const slider = document.getElementById('wipe');
         slider.value = 30;
         slider.dispatchEvent(new Event('input'))",
    );
    assert_eq!(
        browser.run("return document.getElementById('pinned').style.clipPath"),
        "inset(0px 70% 0px 0px)"
    );
    browser.wait("document.getElementById('pin').textContent === 'Unpin'");
    screenshot(&browser, "studio.wipe.png");
    browser.run("document.getElementById('pin').click()");
    browser.wait("document.getElementById('pinned').hidden && document.getElementById('wipe').hidden");

    // The command line that the page copies.
    browser.run(
        "navigator.clipboard.writeText = async (text) => { window.copied = text; };
         document.getElementById('copy').click()",
    );
    browser.wait("window.copied");
    let line = browser.run("return window.copied");
    let mut copied = line.as_str().unwrap().split(' ').map(str::to_string);
    assert_eq!(copied.next().as_deref(), Some("oslrun"));
    studio.run_beside(folder.path(), &copied.collect::<Vec<_>>());
    let image = read_image(&folder.path().join("Cobbled.png")).unwrap();
    assert!(shown == image.samples.iter().map(|x| (x * 255.0).round() as u8).collect::<Vec<_>>(), "{line}");

    // A pixel under the mouse, and the next one by a key.
    browser.run(
        "document.addEventListener('studio-explanation', (event) => { window.explained = event.detail; });",
    );
    browser.mouse("#picture", (-20, 15), None);
    browser.wait("window.explained");
    browser.wait("document.querySelectorAll('#source .value').length > 3");
    screenshot(&browser, "studio.light.png");
    let told = |found: &Value| {
        let at = format!("{},{}", found["at"][0], found["at"][1]);
        let mut words: Vec<&str> = vec!["explain", "Cobbled.osl", "-g", &size, "--at", &at, "--json"];
        set.iter().for_each(|text| words.extend(["-p", text]));
        studio.beside(folder.path(), &words)
    };
    let found = browser.run("return window.explained");
    assert!(plain(&found["explanation"]) == plain(&told(&found)), "{}", found["at"]);
    browser.run("window.explained = null; document.getElementById('picture').focus()");
    browser.key(RIGHT);
    browser.wait("window.explained");
    let next = browser.run("return window.explained");
    assert_eq!(next["at"][0].as_u64(), found["at"][0].as_u64().map(|x| x + 1));
    assert!(plain(&next["explanation"]) == plain(&told(&next)), "{}", next["at"]);

    // A mistake on the disk, and its repair.
    assert_eq!(browser.complaints(), Vec::<String>::new());
    let broken =
        cobbled().replacen("float d = createCells(P, spacename, cellfreq, jitter);", "float d = ;", 1);
    let line = broken.lines().position(|line| line.contains("float d = ;")).unwrap() + 1;
    std::fs::write(&file, &broken).unwrap();
    browser.wait("document.querySelector('#source .note.error')");
    let number = browser.run(
        "return document.querySelector('#source .note.error').parentElement.querySelector('.number').textContent",
    );
    assert_eq!(number, line.to_string());
    assert!(pixels(&browser) == shown, "the last picture stays");
    screenshot(&browser, "studio.error.png");
    std::fs::write(&file, cobbled() + "\n").unwrap();
    browser.wait("!document.querySelector('#source .note.error')");
    browser.wait(IDLE);
    assert!(pixels(&browser) == shown);

    // The end of the server, and its return.
    let (_, port) = studio.url.trim_start_matches("http://").split_once(':').unwrap();
    let port = port.split('/').next().unwrap().to_string();
    drop(studio);
    browser.wait("!document.getElementById('gone').hidden");
    assert!(pixels(&browser) == shown);
    let again = ["Cobbled.osl", "-g", &size, "--token", TOKEN, "--port", &port];
    let Some(studio) = Studio::start_at(folder.path(), &again) else {
        println!("left out: the return of the server, because somebody else took its port");
        return;
    };
    browser.wait("document.getElementById('gone').hidden");
    browser.wait(IDLE);
    assert_eq!(params(&browser), set);
    assert!(pixels(&browser) == shown);
    drop(studio);
}

#[test]
fn every_kind_of_parameter_has_a_control() {
    let Some(browser) = browser((1280, 720), true) else { return };
    let folder = tempfile::tempdir().unwrap();
    let text = "shader kinds(
        float amount = 0.5 [[ float min = 0, float max = 2, string label = \"The <b>amount</b>\", string help = \"H\" ]],
        int on = 1 [[ string widget = \"checkBox\" ]],
        int mode = 1 [[ string widget = \"popup\", string options = \"one|two|three\" ]],
        string kind = \"b\" [[ string options = \"a|b|c\", string page = \"More\" ]],
        string words = \"<img src=x onerror=alert(1)>\" [[ string page = \"More\" ]],
        color tint = color(1, 0.5, 0), vector way = vector(0, 0, 1), int secret = 0 [[ int hidden = 1 ]],
        output color result = 0)
    { result = tint * amount * (on ? u : v) + (kind == \"c\" ? 0.25 : 0) + mode * 0.01 + way[0]; }
    // <script>alert(1)</script>";
    std::fs::write(folder.path().join("kinds.osl"), text).unwrap();
    let studio = Studio::start(folder.path(), &["kinds.osl", "-g", "64x64", "-p", "amount=1.5"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let control = |name: &str, part: &str| format!("document.querySelector('[data-name={name}] {part}')");
    let value = |name: &str, part: &str| browser.run(&format!("return {}.value", control(name, part)));
    assert_eq!(value("amount", "input[type=range]"), "1.5");
    assert_eq!(browser.run(&format!("return {}.max", control("amount", "input[type=range]"))), "2");
    assert_eq!(browser.run(&format!("return {}.checked", control("on", "input[type=checkbox]"))), true);
    assert_eq!(value("mode", "select"), "1");
    assert_eq!(value("kind", "select"), "b");
    assert_eq!(value("tint", "input[type=color]"), "#ffbc00");
    assert_eq!(browser.run("return document.querySelectorAll('[data-name=way] input').length"), 3);
    assert_eq!(browser.run("return document.querySelector('[data-name=secret]')"), Value::Null);
    // Text of a shader is text.
    assert_eq!(
        browser.run(&format!("return {}.textContent", control("amount", "label"))),
        "The <b>amount</b>"
    );
    assert_eq!(browser.run("return document.querySelectorAll('img, b, #source script').length"), 0);

    let set = |name: &str, part: &str, value: &str, event: &str| {
        browser.run(&format!(
            "const part = {}; part.value = {}; part.dispatchEvent(new Event('{event}'))",
            control(name, part),
            serde_json::to_string(value).unwrap()
        ));
        browser.wait(IDLE);
    };
    set("kind", "select", "c", "change");
    set("tint", "input[type=color]", "#ff0000", "input");
    set("way", "input[aria-label=\"way x\"]", "0.125", "input");
    browser.run(&format!("{}.click()", control("on", "input[type=checkbox]")));
    browser.wait(IDLE);
    screenshot(&browser, "studio.dark.png");
    let params = params(&browser);
    assert_eq!(params, ["amount=1.5", "kind=c", "tint=1,0,0", "way=0.125,0,1", "on=0"]);
    let file = folder.path().join("kinds.osl").display().to_string();
    let usual = [file.as_str(), "-g", "64x64", "--outputs", "result"].map(str::to_string);
    let values: Vec<String> = params.into_iter().flat_map(|text| ["-p".to_string(), text]).collect();
    let words = usual.into_iter().chain(values.clone());
    assert!(pixels(&browser) == picture_of(&words.collect::<Vec<_>>()));

    // With light: the patch becomes a sphere.
    browser.run("document.getElementById('lit').click()");
    browser.wait(IDLE);
    let lit =
        [file.as_str(), "-g", "64x64", "--preview", "--base", "result", "--on", "sphere"].map(str::to_string);
    assert!(pixels(&browser) == picture_of(&lit.into_iter().chain(values).collect::<Vec<_>>()));
    assert_eq!(browser.run("return document.getElementById('on').value"), "sphere");
    screenshot(&browser, "studio.kinds.png");
    assert_eq!(browser.complaints(), Vec::<String>::new());

    browser.run(
        "document.getElementById('lit').click();
         const on = document.getElementById('on');
         on.value = 'patch';
         on.dispatchEvent(new Event('change'))",
    );
    browser.run("document.getElementById('reset').click()");
    browser.wait("!location.hash.includes('p=')");
    browser.wait(IDLE);
    assert!(pixels(&browser) == picture_of(&[file.as_str(), "-g", "64x64"].map(str::to_string)));
}

#[test]
fn a_line_shows_what_it_sets_and_a_click_makes_it_the_picture() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lines.osl");
    std::fs::write(&file, LINES).unwrap();
    let path = file.display().to_string();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    assert_eq!(browser.run("return document.getElementById('taps').hidden"), true);
    // The mouse rests on a line.
    browser.mouse(".line-box:nth-child(3) .code", (0, 0), None);
    browser.wait("document.querySelector('#taps [data-tap=\"3:wave\"] img')");
    let words = browser.run("return document.querySelector('[data-tap=\"3:wave\"]').innerText");
    assert!(words.as_str().unwrap().contains("black is 0, white is 1"), "{words}");
    // A line that does nothing changes nothing; the next one does.
    browser.mouse(".line-box:nth-child(5) .code", (0, 0), None);
    browser.mouse(".line-box:nth-child(8) .code", (0, 0), None);
    browser.wait("document.querySelector('[data-tap=\"8:result\"] .rounds img')");
    screenshot(&browser, "studio.taps.png");
    // The keys: the lines that do something, one after another.
    browser.run("document.querySelector('.line-box:nth-child(3) button.number').focus()");
    browser.key(DOWN);
    browser.wait("document.querySelector('[data-tap=\"4:swing\"] img')");
    let place = "return document.activeElement.textContent";
    assert_eq!(browser.run(place), "4");
    browser.key(DOWN);
    browser.wait("document.querySelector('[data-tap=\"6:result\"]')");
    assert_eq!(browser.run(place), "6");

    // A click shows the tap in the picture, and in the address.
    let whole = pixels(&browser);
    browser.run("document.querySelector('.line-box:nth-child(3) button.number').focus()");
    browser.wait("document.querySelector('[data-tap=\"3:wave\"]')");
    browser.run("document.querySelector('[data-tap=\"3:wave\"]').click()");
    browser.wait("new URLSearchParams(location.hash.slice(1)).get('output') === '3:wave'");
    browser.wait(IDLE);
    let grey = |samples: Vec<u8>| -> Vec<u8> { samples.iter().flat_map(|x| [*x; 3]).collect() };
    let tapped = |tap: &str| grey(picture_of(&[&path, "-g", "96x64", "--tap", tap].map(str::to_string)));
    assert!(pixels(&browser) == tapped("3:wave"));
    assert_eq!(browser.run("return document.getElementById('output').value"), "3:wave");
    browser.wait("document.querySelector('[data-tap=\"3:wave\"]').getAttribute('aria-pressed') === 'true'");
    screenshot(&browser, "studio.tap.png");
    browser.run(
        "navigator.clipboard.writeText = async (text) => { window.copied = text; };
         document.getElementById('copy').click()",
    );
    browser.wait("window.copied");
    let line = browser.run("return window.copied");
    assert!(line.as_str().unwrap().contains(" --tap 3:wave "), "{line}");
    studio.run_beside(
        folder.path(),
        &line.as_str().unwrap().split(' ').skip(1).map(str::to_string).collect::<Vec<_>>(),
    );
    let image = read_image(&folder.path().join("lines.png")).unwrap();
    let copied = image.samples.iter().flat_map(|x| [(x * 255.0).round() as u8; 3]).collect::<Vec<_>>();
    assert!(pixels(&browser) == copied, "{line}");

    // A variable with other values than 0 to 1 is shown with all of them.
    browser.run("document.querySelector('.line-box:nth-child(4) button.number').focus()");
    browser.wait("document.querySelector('[data-tap=\"4:swing\"]')");
    browser.run("document.querySelector('[data-tap=\"4:swing\"]').click()");
    browser.wait(IDLE);
    let signed = [&path, "-g", "96x64", "--tap", "4:swing"].map(str::to_string);
    assert!(pixels(&browser) == grey(picture_of(&signed)), "a range with both signs is as usual");
    browser.run(
        "const range = document.getElementById('range');
         range.value = 'auto';
         range.dispatchEvent(new Event('change'))",
    );
    browser.wait("location.hash.includes('range=auto')");
    browser.wait(IDLE);
    let auto = [&path, "-g", "96x64", "--tap", "4:swing", "--range", "auto"].map(str::to_string);
    assert!(pixels(&browser) == grey(picture_of(&auto)));
    // The layer with marks.
    browser.run(
        "const range = document.getElementById('range');
         range.value = '';
         range.dispatchEvent(new Event('change'));
         const layer = document.getElementById('layer');
         layer.value = 'outside';
         layer.dispatchEvent(new Event('change'))",
    );
    browser.wait("/of 6144 pixels: \\d+ below 0/.test(document.getElementById('run-messages').textContent)");
    browser.wait(IDLE);
    assert!(pixels(&browser).chunks(3).any(|pixel| pixel == [33, 84, 191]));
    screenshot(&browser, "studio.outside.png");
    browser.run(
        "const layer = document.getElementById('layer');
         layer.value = '';
         layer.dispatchEvent(new Event('change'));
         document.querySelector('.line-box:nth-child(3) button.number').focus()",
    );
    browser.wait("document.querySelector('[data-tap=\"3:wave\"]')");
    browser.run("document.querySelector('[data-tap=\"3:wave\"]').click()");
    browser.wait(IDLE);
    assert!(pixels(&browser) == tapped("3:wave"));

    // The same line after a change above it, and the same address after a reload.
    std::fs::write(&file, format!("// A new line.\n{}", LINES.replace("0.9 + 0.1", "0.8 + 0.2"))).unwrap();
    browser.wait("new URLSearchParams(location.hash.slice(1)).get('output') === '4:wave'");
    browser.wait(IDLE);
    assert!(pixels(&browser) == tapped("4:wave"));
    browser.reload();
    browser.wait(IDLE);
    browser.wait("document.getElementById('output').value === '4:wave'");
    assert!(pixels(&browser) == tapped("4:wave"));
    // A second click gives the output back.
    std::fs::write(&file, LINES).unwrap();
    browser.wait("new URLSearchParams(location.hash.slice(1)).get('output') === '3:wave'");
    // A page that was loaded again has no focus in this browser, but the mouse points.
    browser.mouse(".line-box:nth-child(3) .code", (0, 0), None);
    browser.wait("document.querySelector('[data-tap=\"3:wave\"]')");
    browser.run("document.querySelector('[data-tap=\"3:wave\"]').click()");
    browser.wait("new URLSearchParams(location.hash.slice(1)).get('output') === 'result'");
    browser.wait(IDLE);
    assert!(pixels(&browser) == whole);
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
#[ignore = "measures: the figures of docs/studio.md"]
fn figures() {
    let Some(browser) = browser((1280, 720), true) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("Cobbled.osl"), cobbled()).unwrap();
    let studio = Studio::start(folder.path(), &["Cobbled.osl", "-g", "512x512"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    // From the event of the slider until a changed picture was drawn on the canvas, the small one and the
    // whole one, one change after another; and the parts of the time.
    let times = browser.run_until(
        "const done = arguments[arguments.length - 1];
         const slider = document.querySelector('[data-name=radius] input[type=range]');
         const times = [];
         let row = null;
         const since = () => performance.now() - row.started;
         const { send } = WebSocket.prototype;
         WebSocket.prototype.send = function (text) {
           row.sent = since();
           // The page's own handler comes after this one.
           if (!this.isMeasured) {
             this.isMeasured = true;
             const { onmessage } = this;
             this.onmessage = (event) => { row.arrived = since(); onmessage.call(this, event); };
           }
           return send.call(this, text);
         };
         const step = () => {
           slider.value = 0.05 + 0.002 * times.length;
           row = { started: performance.now() };
           slider.dispatchEvent(new Event('input'));
         };
         document.addEventListener('studio-coarse', () => { row.first = since(); });
         document.addEventListener('studio-picture', ({ detail: { seconds, phases } }) => {
           const whole = since();
           const { compile, run, samples } = phases;
           const server = [seconds, compile, run, samples].map((time) => time * 1000);
           times.push([row.first ?? whole, whole, row.sent, ...server, whole - row.arrived]);
           times.length < 220 ? setTimeout(step, 30) : done(times);
         });
         step();",
    );
    let names = [
        "from the slider to the first changed picture",
        "from the slider to the whole picture",
        "of these: until the state is sent",
        "  in the server",
        "    compiling",
        "    running the shader",
        "    samples of the picture",
        "  drawing in the page",
    ];
    for (at, name) in names.iter().enumerate() {
        let list = times.as_array().unwrap().iter().skip(20);
        let mut list: Vec<f64> = list.map(|row| row[at].as_f64().unwrap()).collect();
        list.sort_by(f64::total_cmp);
        let share = |part: f64| list[(part * (list.len() - 1) as f64) as usize];
        println!(
            "{name}: median {:.1} ms, 95 % within {:.1} ms, of {} changes",
            share(0.5),
            share(0.95),
            list.len()
        );
    }
}

#[test]
#[ignore = "makes the pictures of docs/studio.md, with OSLRUN_SCREENSHOTS"]
fn pictures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("Cobbled.osl"), cobbled()).unwrap();
    let studio = Studio::start(folder.path(), &["Cobbled.osl", "-g", "512x512"]);
    let Some(browser) = browser((1280, 720), false) else { return };
    browser.open(&format!("{}#output=resultRGB&p=radius%3D0.35&file=Cobbled.osl", studio.url));
    browser.wait(IDLE);
    browser.mouse("#picture", (-22, 15), None);
    browser.wait("document.querySelectorAll('#source .value').length > 3");
    browser.wait(IDLE);
    // The time is that of a test.
    let without_time = "document.getElementById('status').style.visibility = 'hidden'";
    browser.run(without_time);
    screenshot(&browser, "studio.light.png");
    let choose = |menu: &str, value: &str| {
        browser.run(&format!(
            "const menu = document.getElementById('{menu}');
             menu.value = '{value}';
             menu.dispatchEvent(new Event('change'))"
        ));
        browser.wait(IDLE);
    };
    choose("max-error", "2%");
    choose("layer", "samples");
    screenshot(&browser, "studio.samples.png");
    let Some(dark) = studio_client::shown::browser((1280, 720), true) else { return };
    dark.open(&format!("{}#file=Cobbled.osl&output=resultRGB&on=torus&lit=1", studio.url));
    dark.wait(IDLE);
    dark.run(without_time);
    screenshot(&dark, "studio.lit.png");
}
