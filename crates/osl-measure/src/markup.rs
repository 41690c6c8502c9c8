//! Text of others inside HTML and SVG. It must not know what reports say.

use osl_syntax::escape::shown;

/// The text, with what HTML would take for its own written out, in quotes of either kind too, and with controls written out
/// as in messages: XML permits most of them nowhere.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in shown(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}
