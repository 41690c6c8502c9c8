//! The files of the page, which are part of the program.

/// A file of the page.
pub(crate) struct File {
    pub(crate) kind: &'static str,
    pub(crate) text: &'static str,
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SVG: &str = "image/svg+xml";
const JS: &str = "text/javascript; charset=utf-8";

/// The file of a name; the page itself has the empty name.
pub(crate) fn file(name: &str) -> Option<File> {
    let (kind, text) = match name {
        "" => (HTML, include_str!("page/index.html")),
        "history.js" => (JS, include_str!("page/history.js")),
        "icon.svg" => (SVG, include_str!("page/icon.svg")),
        "studio.css" => (CSS, include_str!("page/studio.css")),
        "main.js" => (JS, include_str!("page/main.js")),
        "state.js" => (JS, include_str!("page/state.js")),
        "socket.js" => (JS, include_str!("page/socket.js")),
        "source.js" => (JS, include_str!("page/source.js")),
        "picture.js" => (JS, include_str!("page/picture.js")),
        "parameters.js" => (JS, include_str!("page/parameters.js")),
        "marks.js" => (JS, include_str!("page/marks.js")),
        "editor.js" => (JS, include_str!("page/editor.js")),
        "explanation.js" => (JS, include_str!("page/explanation.js")),
        "taps.js" => (JS, include_str!("page/taps.js")),
        "wipe.js" => (JS, include_str!("page/wipe.js")),
        "zoom.js" => (JS, include_str!("page/zoom.js")),
        "element.js" => (JS, include_str!("page/element.js")),
        _ => return None,
    };
    Some(File { kind, text })
}
