//! Escapes foreign text for HTML and SVG.

use osl_syntax::escape::shown;

/// Escapes a text for HTML, also inside quotes of either kind. Control characters are written out as in
/// messages, since XML permits most of them nowhere.
pub fn escape(text: &str) -> String {
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
