//! The view of the picture, the history of the parameters and the editor on the page of `studio`, in a real
//! browser: Chromium, if it is installed.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod studio_client;

use osl_image::read_image;
use studio_client::Studio;
use studio_client::browser::Browser;
use studio_client::shown::{IDLE, LINES, browser, params, pixels, pixels_of, screenshot};

/// Where the canvas and the frame are on the page: left, top, width and height of each.
fn places(browser: &Browser) -> [[f64; 4]; 2] {
    ["picture", "frame"].map(|id| {
        let found = browser.run(&format!(
            "const box = document.getElementById('{id}').getBoundingClientRect();
             return [box.left, box.top, box.width, box.height]"
        ));
        [0, 1, 2, 3].map(|at: usize| found[at].as_f64().unwrap())
    })
}

/// Checks that the window shows each pixel of a picture that is seen, in its color and at its place. Returns
/// how many there are.
fn pixels_are_in_place(browser: &Browser, (width, height): (usize, usize), samples: &[u8]) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("window.png");
    // The frame around the chosen pixel covers others.
    browser.run("document.getElementById('cross').style.visibility = 'hidden'");
    browser.screenshot(&file);
    browser.run("document.getElementById('cross').style.visibility = ''");
    let window = read_image(&file).unwrap();
    let color = |x: f64, y: f64| {
        let at = (y as usize * window.width + x as usize) * window.channels.len();
        [0, 1, 2].map(|c: usize| (window.samples[at + c] * 255.0).round() as u8)
    };
    let [[left, top, wide, high], [frame_left, frame_top, frame_wide, frame_high]] = places(browser);
    let mut seen = 0;
    for y in 0..height {
        for x in 0..width {
            let (page_x, page_y) = (
                left + (x as f64 + 0.5) / width as f64 * wide,
                top + (y as f64 + 0.5) / height as f64 * high,
            );
            let is_inside = (frame_left + 1.0..frame_left + frame_wide - 1.0).contains(&page_x)
                && (frame_top + 1.0..frame_top + frame_high - 1.0).contains(&page_y)
                && page_y < window.height as f64;
            if is_inside {
                let at = (y * width + x) * 3;
                assert_eq!(color(page_x, page_y), samples[at..at + 3], "pixel ({x}, {y})");
                seen += 1;
            }
        }
    }
    seen
}

#[test]
fn the_picture_is_enlarged_moved_and_picked() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "480x300"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let samples = pixels(&browser);
    let size = (480, 300);
    assert!(pixels_are_in_place(&browser, size, &samples) > 140_000);
    browser.run(
        "window.explained = null;
         document.addEventListener('studio-explanation', (event) => { window.explained = event.detail.at; });
         document.addEventListener('pointermove', (event) => { window.mouse = [event.clientX, event.clientY]; });",
    );
    // The pixel under the mouse, by the explanation.
    let picked = |at: (i64, i64)| {
        browser.run("window.explained = null");
        // There is an answer for each new pixel.
        browser.mouse("#frame", (at.0 + 30, at.1 + 30), None);
        browser.mouse("#frame", at, None);
        browser.wait(
            "window.explained && document.getElementById('explanation').textContent.includes('result')",
        );
        browser.wait(
            "(() => {
               const box = document.getElementById('picture').getBoundingClientRect();
               const [x, y] = window.mouse;
               const at = [(x - box.left) / box.width * 480, (y - box.top) / box.height * 300].map(Math.floor);
               return String(window.explained) === String(at);
             })()",
        );
        let at = browser.run("return window.explained");
        [at[0].as_i64().unwrap(), at[1].as_i64().unwrap()]
    };
    let before = picked((10, 5));
    // The wheel enlarges about the mouse. At eight times, lines separate the pixels.
    let mouse = browser.run("return window.mouse");
    let mouse = (mouse[0].as_i64().unwrap(), mouse[1].as_i64().unwrap());
    for _ in 0..6 {
        browser.wheel(mouse, -120);
    }
    browser.wait("document.getElementById('zoom-fit').textContent === '8×'");
    assert_eq!(browser.run("return document.getElementById('grid').hidden"), false);
    let [[left, top, wide, _], [_, _, frame_wide, frame_high]] = places(&browser);
    assert_eq!(wide, 8.0 * 480.0);
    assert!(frame_wide > 400.0 && frame_high > 400.0, "{frame_wide} {frame_high}");
    // The place that was under the mouse is there still.
    let under =
        [((mouse.0 as f64 - left) / 8.0).floor() as i64, ((mouse.1 as f64 - top) / 8.0).floor() as i64];
    assert_eq!(under, before);
    assert!(pixels_are_in_place(&browser, size, &samples) > 3000);
    screenshot(&browser, "studio.zoom.png");
    browser.wait("location.hash.includes('view=8')");
    // Dragging moves the picture with the mouse.
    let held = picked((40, 20));
    browser.mouse("#frame", (40, 20), Some((-80, -16)));
    let [[moved_left, moved_top, ..], _] = places(&browser);
    assert_eq!(picked((-40, 4)), held, "{left}, {top} and {moved_left}, {moved_top}");
    assert_eq!(picked((0, 4))[0], held[0] + 5);
    assert!(pixels_are_in_place(&browser, size, &samples) > 3000);
    // The border of a pinned picture stays in its place.
    browser.run(
        "document.getElementById('pin').click();
         const slider = document.getElementById('wipe');
         slider.value = 30;
         slider.dispatchEvent(new Event('input'))",
    );
    let clip = browser.run("return document.getElementById('pinned').style.clipPath");
    let right: f64 = clip.as_str().unwrap().split(' ').nth(1).unwrap().trim_end_matches('%').parse().unwrap();
    let [[left, _, wide, _], [frame_left, _, frame_wide, _]] = places(&browser);
    let border = left + wide * (1.0 - right / 100.0);
    assert!((border - frame_left - 0.3 * frame_wide).abs() < 0.1, "{clip}: {border}");
    assert!(pixels_are_in_place(&browser, size, &samples) > 3000);
    browser.run("document.getElementById('pin').click()");
    // The same part after a reload.
    let view = browser.run("return document.getElementById('picture').style.transform");
    let is_written = "new URLSearchParams(location.hash.slice(1)).get('view') === document.getElementById('frame').dataset.view";
    browser.wait(is_written);
    browser.reload();
    browser.wait(IDLE);
    assert_eq!(browser.run("return document.getElementById('picture').style.transform"), view);
    assert!(pixels_are_in_place(&browser, size, &samples) > 3000);
    // The keys; an arrow brings a pixel into view.
    browser.run("document.getElementById('picture').focus()");
    browser.key('+');
    browser.wait("document.getElementById('zoom-fit').textContent === '16×'");
    browser.key('-');
    browser.key('-');
    browser.wait("document.getElementById('zoom-fit').textContent === '4×'");
    assert_eq!(browser.run("return document.getElementById('grid').hidden"), true);
    browser.key('0');
    browser.wait("document.getElementById('zoom-fit').textContent === 'fit'");
    browser.wait("!location.hash.includes('view')");
    assert!(pixels_are_in_place(&browser, size, &samples) > 140_000);
    // Two fingers, and a double click.
    browser.pinch("#picture", 10, 40);
    browser.wait("document.getElementById('zoom-fit').textContent === '4×'");
    assert!(pixels_are_in_place(&browser, size, &samples) > 3000);
    browser.run("document.getElementById('picture').dispatchEvent(new MouseEvent('dblclick'))");
    browser.wait("document.getElementById('zoom-fit').textContent === 'fit'");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn changes_of_parameters_are_undone_and_redone() {
    let Some(browser) = browser((1280, 720), true) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let usual = pixels(&browser);
    let are_disabled = || {
        ["undo", "redo"].map(|id| browser.run(&format!("return document.getElementById('{id}').disabled")))
    };
    assert_eq!(are_disabled(), [true, true]);
    // Random values are one change.
    browser.run("document.getElementById('random').click()");
    browser.wait(IDLE);
    assert!(!params(&browser).is_empty());
    assert_eq!(are_disabled(), [false, true]);
    browser.run("document.getElementById('undo').click()");
    browser.wait(IDLE);
    assert_eq!(params(&browser), Vec::<String>::new());
    // One pull of a slider is one change.
    browser.mouse("[data-name=k] input[type=range]", (-20, 0), Some((30, 0)));
    browser.wait("location.hash.includes('k%3D')");
    browser.wait(IDLE);
    let (changed, shown) = (params(&browser), pixels(&browser));
    assert!(shown != usual);
    let press = |key: &str, shift: bool| {
        browser.run(&format!(
            "document.activeElement.dispatchEvent(new KeyboardEvent('keydown',
               {{ key: '{key}', ctrlKey: true, shiftKey: {shift}, bubbles: true, cancelable: true }}))"
        ));
        browser.wait(IDLE);
    };
    press("z", false);
    assert_eq!(params(&browser), Vec::<String>::new());
    assert_eq!(are_disabled(), [true, false]);
    assert!(pixels(&browser) == usual);
    press("Z", true);
    assert_eq!(params(&browser), changed);
    assert!(pixels(&browser) == shown);
    let click = |id: &str| {
        browser.run(&format!("document.getElementById('{id}').click()"));
        browser.wait(IDLE);
    };
    click("undo");
    assert!(pixels(&browser) == usual);
    click("redo");
    assert!(pixels(&browser) == shown);
    click("reset");
    assert!(pixels(&browser) == usual);
    assert_eq!(are_disabled(), [false, true]);
    press("z", false);
    assert_eq!(params(&browser), changed);
    assert!(pixels(&browser) == shown);
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_difference_to_a_pinned_picture_is_a_layer() {
    let Some(browser) = browser((1280, 720), true) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let usual = pixels(&browser);
    assert_eq!(browser.run("return document.querySelector('[value=difference]').disabled"), true);
    browser.run("document.getElementById('pin').click()");
    browser.wait("document.getElementById('pin').textContent === 'Unpin'");
    assert_eq!(pixels_of(&browser, "pinned"), usual);
    let choose = |layer: &str| {
        browser.run(&format!(
            "const layer = document.getElementById('layer');
             layer.value = '{layer}';
             layer.dispatchEvent(new Event('change'))"
        ));
        browser.wait(IDLE);
    };
    choose("difference");
    let says =
        |words: &str| format!("document.getElementById('run-messages').textContent.includes('{words}')");
    browser.wait(&says("every value is equal"));
    assert!(pixels(&browser).iter().all(|byte| *byte == 0));
    browser.mouse("[data-name=k] input[type=range]", (-20, 0), Some((30, 0)));
    browser.wait("location.hash.includes('k%3D')");
    browser.wait(IDLE);
    browser.wait(&says("differ from the pinned picture: the largest difference is"));
    // The pinned picture does not cover its difference to the present one.
    let covers = "return [getComputedStyle(document.getElementById('pinned')).visibility,
        document.getElementById('wipe').hidden]";
    assert_eq!(browser.run(covers), serde_json::json!(["hidden", true]));
    let different = pixels(&browser);
    assert!(different.chunks(3).any(|pixel| pixel == [255; 3]));
    screenshot(&browser, "studio.difference.png");
    assert!(!browser.run("return location.hash").as_str().unwrap().contains("difference"));
    choose("");
    assert_eq!(browser.run(covers), serde_json::json!(["visible", false]));
    let shown = pixels(&browser);
    assert!(shown != usual);
    // Without a pinned picture there is no difference to it.
    choose("difference");
    browser.run("document.getElementById('pin').click()");
    browser.wait(IDLE);
    assert_eq!(browser.run("return document.getElementById('layer').value"), "");
    assert!(pixels(&browser) == shown);
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_small_picture_is_as_large_as_fits() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let [[_, _, wide, high], [_, _, frame_wide, _]] = places(&browser);
    assert_eq!((wide, high, frame_wide), (5.0 * 96.0, 5.0 * 64.0, 5.0 * 96.0));
    assert_eq!(pixels_are_in_place(&browser, (96, 64), &pixels(&browser)), 96 * 64);
    browser.run(
        "document.addEventListener('studio-explanation', (event) => { window.explained = event.detail.at; })",
    );
    browser.mouse("#picture", (-238, -158), None);
    browser.wait("String(window.explained) === '0,0'");
    browser.mouse("#picture", (12, 8), None);
    browser.wait("String(window.explained) === '50,33'");
    // From there it is enlarged, and it does not become smaller.
    browser.run("document.getElementById('picture').focus()");
    browser.key('-');
    assert_eq!(browser.run("return document.getElementById('zoom-fit').textContent"), "fit");
    browser.key('+');
    browser.wait("document.getElementById('zoom-fit').textContent === '10×'");
    assert!(pixels_are_in_place(&browser, (96, 64), &pixels(&browser)) > 1000);
    browser.key('0');
    browser.wait("document.getElementById('zoom-fit').textContent === 'fit'");
    assert_eq!(places(&browser)[0][2], 5.0 * 96.0);
    // The header has one line, also after the command line was copied; so have the buttons of the parameters.
    let height = "return document.querySelector('header').getBoundingClientRect().height";
    let before = browser.run(height);
    assert!(before.as_f64().unwrap() < 45.0, "{before}");
    browser.run(
        "navigator.clipboard.writeText = async (text) => { window.copied = text; };
         document.getElementById('copy').click()",
    );
    browser.wait("document.getElementById('status').textContent === 'copied'");
    assert_eq!(browser.run(height), before);
    let tops = browser.run(
        "return [...document.querySelectorAll('#parameter-pane .bar button')]
           .map((button) => button.getBoundingClientRect().top)",
    );
    assert!(tops.as_array().unwrap().iter().all(|top| *top == tops[0]), "{tops}");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_source_is_edited_and_saved() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lines.osl");
    // The line ends of the file are kept.
    let windows = LINES.replace('\n', "\r\n");
    std::fs::write(&file, &windows).unwrap();
    std::fs::write(folder.path().join("g.group"), "shader lines layer;").unwrap();
    let on_disk = || std::fs::read_to_string(&file).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let usual = pixels(&browser);
    let shows = |id: &str| browser.run(&format!("return !document.getElementById('{id}').hidden")) == true;
    let word = |text: &str| format!("document.getElementById('edit-word').textContent.includes('{text}')");
    let click = |id: &str| browser.run(&format!("document.getElementById('{id}').click()"));
    let press = |key: &str, command: bool| {
        browser.run(&format!(
            "document.activeElement.dispatchEvent(new KeyboardEvent('keydown',
               {{ key: '{key}', ctrlKey: {command}, bubbles: true, cancelable: true }}))"
        ))
    };
    let change = |from: &str, to: &str| {
        browser.run(&format!(
            "const area = document.getElementById('editor');
             area.value = area.value.replace('{from}', '{to}');
             area.dispatchEvent(new Event('input'))"
        ))
    };
    press("e", false);
    assert!(shows("editor") && !shows("source") && !shows("edit"));
    assert_eq!(browser.run("return document.getElementById('editor').value"), LINES);
    assert_eq!(browser.run("return document.getElementById('save').disabled"), true);
    // Keys are text there.
    press("e", false);
    press("0", false);
    change("v, swing", "1 - v, swing");
    assert_eq!(browser.run("return document.getElementById('save').disabled"), false);
    press("s", true);
    browser.wait(&word("saved"));
    let changed = windows.replace("v, swing", "1 - v, swing");
    assert!(on_disk() == changed);
    browser.wait("document.getElementById('source').textContent.includes('1 - v, swing')");
    // The picture follows.
    let expected = ["lines.osl", "-g", "96x64", "-o", "a.png"].map(str::to_string);
    studio.run_beside(folder.path(), &expected);
    let image = read_image(&folder.path().join("a.png")).unwrap();
    let expected: Vec<u8> = image.samples.iter().map(|x| (x * 255.0).round() as u8).collect();
    assert!(expected != usual);
    let started = std::time::Instant::now();
    while pixels(&browser) != expected {
        assert!(started.elapsed().as_secs() < 300, "the picture does not follow");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    // A mistake is listed, and a click on it goes to its line.
    change("1 - v, swing", "1 - , swing");
    click("save");
    browser.wait("document.querySelector('#messages .error button')");
    browser.run("document.querySelector('#messages .error button').click()");
    let selected = "const area = document.getElementById('editor');
        return area.value.slice(area.selectionStart, area.selectionEnd)";
    assert_eq!(browser.run(selected), "    result = color(wave, 1 - , swing);");
    screenshot(&browser, "studio.edit.png");
    change("1 - , swing", "v, swing");
    click("save");
    browser.wait("!document.querySelector('#messages .error')");
    browser.wait(&word("saved"));
    assert!(on_disk() == windows);

    // Another program changes the file: a text without changes follows, and others are not lost.
    std::fs::write(&file, format!("// first\r\n{windows}")).unwrap();
    browser.wait("document.getElementById('editor').value.startsWith('// first')");
    change("// first", "// mine");
    std::fs::write(&file, format!("// theirs\r\n{windows}")).unwrap();
    browser.wait(&word("has changed on the disk; your text is not saved"));
    assert!(shows("overwrite"));
    press("s", true);
    browser.wait(&word("so it is not overwritten"));
    assert!(on_disk().starts_with("// theirs"));
    assert!(shows("overwrite") && !shows("save"));
    screenshot(&browser, "studio.conflict.png");
    click("overwrite");
    browser.wait(&word("saved"));
    assert!(on_disk() == format!("// mine\r\n{windows}"));
    // Escape goes back; a change is discarded only by the second one.
    change("// mine", "// other");
    press("Escape", false);
    browser.wait(&word("Escape once more"));
    assert!(shows("editor"));
    press("Escape", false);
    assert!(shows("source") && shows("edit") && !shows("editor") && !shows("discard"));
    browser.wait("document.getElementById('source').textContent.includes('// mine')");
    assert!(on_disk() == format!("// mine\r\n{windows}"));
    click("edit");
    assert!(shows("editor"));
    click("discard");
    assert!(shows("source"));

    // Files that are not edited, with the reason.
    let reason = |text: &str| {
        browser.wait(&format!(
            "document.getElementById('edit').disabled && document.getElementById('edit').title.includes('{text}')"
        ));
    };
    std::fs::write(&file, format!("// mixed\n{windows}")).unwrap();
    reason("its lines end in ways");
    std::fs::write(&file, format!("{windows}// {}\r\n", "long ".repeat(60_000))).unwrap();
    reason("at most 256 KiB");
    std::fs::write(&file, b"// \xff\n").unwrap();
    reason("byte 3 is not UTF-8");
    browser.wait("document.querySelector('#messages .error').textContent.includes('byte 3 is not UTF-8')");
    std::fs::write(&file, &windows).unwrap();
    browser.wait("!document.getElementById('edit').disabled");
    browser.wait(IDLE);
    browser.run(
        "const file = document.getElementById('file');
         file.value = 'g.group';
         file.dispatchEvent(new Event('change'))",
    );
    reason("only sources");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn an_error_is_traded_for_samples_and_a_layer_shows_where_they_are() {
    let Some(browser) = browser((1280, 720), false) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "96x64", "--shading-rate", "2x2"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    let choose = |menu: &str, value: &str| {
        browser.run(&format!(
            "const menu = document.getElementById('{menu}');
             menu.value = '{value}';
             menu.dispatchEvent(new Event('change'))"
        ));
        browser.wait(IDLE);
    };
    let is_disabled =
        |selector: &str| browser.run(&format!("return document.querySelector('{selector}').disabled"));
    assert_eq!(is_disabled("[value=samples]"), true);
    let given = pixels(&browser);
    choose("max-error", "2%");
    browser.wait("location.hash.includes('max_error=2%25')");
    let says = "document.getElementById('run-messages').textContent.includes('evaluations a pixel')";
    browser.wait(says);
    let shown = pixels(&browser);
    assert!(shown != given);
    browser.run(
        "navigator.clipboard.writeText = async (text) => { window.copied = text; };
         document.getElementById('copy').click()",
    );
    browser.wait("window.copied");
    let line = browser.run("return window.copied");
    let line = line.as_str().unwrap();
    assert!(line.contains(" --max-error 2% ") && !line.contains("--shading-rate"), "{line}");
    studio.run_beside(folder.path(), &line.split(' ').skip(1).map(str::to_string).collect::<Vec<_>>());
    let image = read_image(&folder.path().join("lines.png")).unwrap();
    assert!(shown == image.samples.iter().map(|x| (x * 255.0).round() as u8).collect::<Vec<_>>(), "{line}");
    choose("layer", "samples");
    browser.wait("document.getElementById('run-messages').textContent.includes('samples of each pixel')");
    assert!(pixels(&browser).chunks(3).any(|pixel| pixel == [255; 3]));
    screenshot(&browser, "studio.samples.png");
    browser.reload();
    browser.wait(IDLE);
    browser.wait("document.getElementById('max-error').value === '2%'");
    assert_eq!(browser.run("return document.getElementById('layer').value"), "samples");
    // Rounding errors.
    choose("layer", "rounding");
    browser.wait("document.getElementById('run-messages').textContent.includes('lost to rounding')");
    assert!(pixels(&browser).chunks(3).all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]));
    screenshot(&browser, "studio.rounding.png");
    choose("layer", "samples");
    browser.wait("document.getElementById('run-messages').textContent.includes('samples of each pixel')");
    // Without an error there is no layer of samples; without samples there is one of the cost.
    choose("max-error", "");
    assert_eq!(is_disabled("[value=samples]"), true);
    assert_eq!(browser.run("return document.getElementById('layer').value"), "");
    assert!(pixels(&browser) == given);
    browser.wait("!location.hash.includes('max_error')");
    // The shading rate of the command line is for the patch too, so the sphere has no picture here.
    browser.run(
        "const on = document.getElementById('on');
         on.value = 'sphere';
         on.dispatchEvent(new Event('change'))",
    );
    assert_eq!(is_disabled("[value=rounding]"), true);
    assert_eq!(is_disabled("[value=cost]"), true);
    assert_eq!(is_disabled("#max-error"), false);
    choose("max-error", "5%");
    choose("layer", "samples");
    browser.wait("document.getElementById('run-messages').textContent.includes('samples of each pixel')");
    assert!(pixels(&browser).chunks(3).any(|pixel| pixel == [255; 3]));
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_state_is_copied_as_a_group_and_as_a_contact_sheet() {
    let Some(browser) = browser((1280, 720), true) else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lines.osl"), LINES).unwrap();
    let studio = Studio::start(folder.path(), &["lines.osl", "-g", "48x32"]);
    browser.open(&studio.url);
    browser.wait(IDLE);
    browser.run("navigator.clipboard.writeText = async (text) => { window.copied = text; }");
    let copied = |id: &str| {
        browser.run(&format!("window.copied = null; document.getElementById('{id}').click()"));
        browser.wait("window.copied");
        browser.run("return window.copied").as_str().unwrap().to_string()
    };
    let picture_of = |words: &[String]| {
        studio.run_beside(folder.path(), words);
        let file = words.last().unwrap();
        let image = read_image(&folder.path().join(file)).unwrap();
        (image.width, image.samples.iter().map(|x| (x * 255.0).round() as u8).collect::<Vec<_>>())
    };
    assert_eq!(browser.run("return document.getElementById('copy-sheet').disabled"), true);
    browser.mouse("[data-name=k] input[type=range]", (-20, 0), Some((30, 0)));
    browser.wait("location.hash.includes('k%3D')");
    browser.wait(IDLE);
    let text = copied("copy-group");
    assert!(text.starts_with("param float k ") && text.ends_with("shader lines lines ;\n"), "{text}");
    std::fs::write(folder.path().join("copy.group"), &text).unwrap();
    let words = ["copy.group", "-g", "48x32", "-o", "copy.png"].map(str::to_string);
    assert!(picture_of(&words).1 == pixels(&browser), "{text}");
    let label = browser.run("return document.getElementById('copy-sheet').textContent");
    assert_eq!(label, "Copy contact sheet of k");
    let line = copied("copy-sheet");
    assert!(line.ends_with("-p k=0:6:5 -o lines.sheet.png"), "{line}");
    let words: Vec<String> = line.split(' ').skip(1).map(str::to_string).collect();
    assert!(picture_of(&words).0 >= 5 * 48, "{line}");
    screenshot(&browser, "studio.export.png");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
