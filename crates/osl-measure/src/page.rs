//! The frame of a page: what all pages have in common, and prose.

use crate::markup::escape;

/// The rules of reports. `.wide` scrolls by itself what is wider than the screen.
pub const REPORT: &str = "\
body{font:14px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff;\
overflow-wrap:anywhere}\n\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}h3{font-size:1rem}\n\
pre,code{font:12px/1.4 ui-monospace,monospace;background:#f6f8fb}pre{padding:.6rem;overflow-x:auto;overflow-wrap:normal}\n\
.wide{overflow-x:auto}.wide>svg{max-width:100%;min-width:32rem;height:auto}\n\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin-top:.6rem}\
td,th{padding:.15rem .7rem;text-align:right;white-space:nowrap}\
td:first-child,th:first-child{text-align:left}tr.front{background:#eef4ff;font-weight:600}\n\
figure{display:inline-block;margin:.4rem 1rem .4rem 0;vertical-align:top}figcaption{font-size:12px}\
img{image-rendering:pixelated;max-width:100%}\n\
svg text{font:11px system-ui,sans-serif;fill:#1c2430}\n";

/// The start of a page up to its body: the language, the title, and the rules. The page loads nothing, and
/// has no scripts.
pub fn start(title: &str, rules: &[&str]) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" content=\"default-src \
         'none'; img-src data:; style-src 'unsafe-inline'\"><title>{}</title><style>\n{}</style></head>\n<body>",
        escape(title),
        rules.concat()
    )
}

/// The end of a page.
pub const END: &str = "</body></html>\n";

/// A text for HTML, in which parts between backticks are code.
pub fn prose(text: &str) -> String {
    let escaped = escape(text);
    let mut parts = escaped.split('`');
    let mut out = parts.next().unwrap_or_default().to_string();
    while let Some(code) = parts.next() {
        match parts.next() {
            Some(after) => out.extend(["<code>", code, "</code>", after]),
            // Alone, a backtick is a backtick.
            None => out.extend(["`", code]),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_between_backticks_are_code() {
        assert_eq!(
            prose("take `--samples 4`, or `a<b`."),
            "take <code>--samples 4</code>, or <code>a&lt;b</code>."
        );
        assert_eq!(prose("none"), "none");
        assert_eq!(prose("`a` and ` alone"), "<code>a</code> and ` alone");
        assert_eq!(prose("`"), "`");
    }

    #[test]
    fn a_title_is_text() {
        assert!(start("<b>", &["a{}", "b{}"]).contains("<title>&lt;b&gt;</title><style>\na{}b{}</style>"));
    }
}
