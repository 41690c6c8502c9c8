//! Text inside HTML. It must not know what reports say.

/// The text, with what HTML would take for its own written out.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
