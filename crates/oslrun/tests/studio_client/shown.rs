//! What the page shows in a browser, and the shader of most tests.

#![allow(clippy::print_stdout, reason = "a test that is left out says why")]

use super::browser::Browser;
use base64::Engine;
use std::path::Path;

/// A browser, or a word why there is none.
pub(crate) fn browser(size: (u32, u32), dark: bool) -> Option<Browser> {
    match Browser::start(size, dark) {
        Ok(browser) => Some(browser),
        Err(why) => {
            println!("left out: a test in a browser, because {why}");
            None
        }
    }
}

/// The page is idle when it has the picture of its newest state.
pub(crate) const IDLE: &str = "document.getElementById('picture').getAttribute('aria-busy') === 'false' \
    && / ms$/.test(document.getElementById('status').textContent)";

/// The red, green and blue of the picture on the page.
pub(crate) fn pixels(browser: &Browser) -> Vec<u8> {
    pixels_of(browser, "picture")
}

/// The red, green and blue of a canvas.
pub(crate) fn pixels_of(browser: &Browser, canvas: &str) -> Vec<u8> {
    let text = browser.run(&format!(
        "const canvas = document.getElementById('{canvas}');
         const {{ data }} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
         return btoa(Array.from(data, (byte) => String.fromCharCode(byte)).join(''))"
    ));
    let bytes = base64::engine::general_purpose::STANDARD.decode(text.as_str().unwrap()).unwrap();
    assert!(bytes.chunks_exact(4).all(|pixel| pixel[3] == 255));
    bytes.chunks_exact(4).flat_map(|pixel| pixel[..3].to_vec()).collect()
}

pub(crate) fn screenshot(browser: &Browser, name: &str) {
    if let Some(folder) = std::env::var_os("OSLRUN_SCREENSHOTS") {
        browser.screenshot(&Path::new(&folder).join(name));
    }
}

/// What the fragment of the address says about the parameters.
pub(crate) fn params(browser: &Browser) -> Vec<String> {
    let list = browser.run("return new URLSearchParams(location.hash.slice(1)).getAll('p')");
    list.as_array().unwrap().iter().map(|text| text.as_str().unwrap().to_string()).collect()
}

/// A shader whose lines are known.
pub(crate) const LINES: &str = "shader lines(float k = 3, output color result = 0)
{
    float wave = 0.5 + 0.5 * sin(k * 10 * u);
    float swing = snoise(P * 8);
    // Nothing is set here.
    result = color(wave, v, swing);
    for (int i = 0; i < 3; i++) {
        result *= 0.9 + 0.1 * i * wave;
    }
}
";
