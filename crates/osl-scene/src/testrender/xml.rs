//! The XML of `testrender` scenes: elements, attributes and text.
//!
//! The reader is as lenient as the one for which those scenes were written (pugixml): it accepts several root
//! elements, repeated attributes and unknown entities. Errors have the same texts and byte offsets, since
//! scripts compare them.

/// An element.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// Names and values of its attributes, in order.
    pub attributes: Vec<(String, String)>,
    /// The elements inside it.
    pub children: Vec<Element>,
    /// The first nonblank text inside it.
    pub text: Option<String>,
}

impl Element {
    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// Why a text is not valid XML.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} at offset {offset}")]
pub struct XmlError {
    /// What is wrong.
    pub what: &'static str,
    /// The byte offset.
    pub offset: usize,
}

const TAG: &str = "Could not determine tag type";
const DECLARATION: &str = "Error parsing document declaration/processing instruction";
const COMMENT: &str = "Error parsing comment";
const CDATA: &str = "Error parsing CDATA section";
const DOCTYPE: &str = "Error parsing document type declaration";
const START: &str = "Error parsing start element tag";
const ATTRIBUTE: &str = "Error parsing element attribute";
const END: &str = "Error parsing end element tag";
const MISMATCH: &str = "Start-end tags mismatch";
const NOTHING: &str = "No document element found";
const DEPTH: &str = "Elements are nested too deeply";

/// Reads a text with at most `depth` nested elements. The result is a nameless element that contains the
/// top-level elements.
///
/// # Errors
/// The first problem found.
pub fn read(text: &str, depth: u64) -> Result<Element, XmlError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = Reader { text, at: 0, open: vec![Element::default()], depth };
    while reader.at < text.len() {
        reader.next()?;
    }
    let mut open = reader.open;
    match (open.pop(), open.is_empty()) {
        (Some(root), true) if root.children.is_empty() => Err(XmlError { what: NOTHING, offset: text.len() }),
        (Some(root), true) => Ok(root),
        _ => Err(XmlError { what: MISMATCH, offset: text.len().saturating_sub(1) }),
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    /// The open elements, starting with the document.
    open: Vec<Element>,
    /// Maximum nesting depth.
    depth: u64,
}

fn begins_name(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_' || c == ':' || !c.is_ascii()
}

fn in_name(c: char) -> bool {
    begins_name(c) || c.is_ascii_digit() || c == '-' || c == '.'
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    /// An error at the current position. The end of the text counts as its last byte.
    fn error<T>(&self, what: &'static str) -> Result<T, XmlError> {
        Err(XmlError { what, offset: self.at.min(self.text.len().saturating_sub(1)) })
    }

    fn blank(&mut self) {
        self.at += self.rest().len() - self.rest().trim_start_matches([' ', '\t', '\r', '\n']).len();
    }

    fn takes(&mut self, mark: &str) -> bool {
        let there = self.rest().starts_with(mark);
        self.at += if there { mark.len() } else { 0 };
        there
    }

    /// The text up to a mark; the mark is consumed too.
    fn until(&mut self, mark: &str, what: &'static str) -> Result<&'a str, XmlError> {
        let rest = self.rest();
        match rest.find(mark) {
            Some(len) => {
                self.at += len + mark.len();
                Ok(&rest[..len])
            }
            None => {
                self.at = self.text.len();
                self.error(what)
            }
        }
    }

    fn name(&mut self) -> &'a str {
        let rest = self.rest();
        let len =
            if rest.starts_with(begins_name) { rest.find(|c| !in_name(c)).unwrap_or(rest.len()) } else { 0 };
        self.at += len;
        &rest[..len]
    }

    /// Reads the next item: text or a tag.
    fn next(&mut self) -> Result<(), XmlError> {
        let rest = self.rest();
        let len = rest.find('<').unwrap_or(rest.len());
        if len > 0 {
            self.at += len;
            self.add_text(rest[..len].trim_start_matches([' ', '\t', '\r', '\n']), true);
            return Ok(());
        }
        self.at += 1;
        if self.takes("?") {
            return self.until("?>", DECLARATION).map(|_| ());
        }
        if self.takes("!--") {
            return self.until("-->", COMMENT).map(|_| ());
        }
        if self.takes("![CDATA[") {
            let text = self.until("]]>", CDATA)?;
            self.add_text(text, false);
            return Ok(());
        }
        if self.takes("!DOCTYPE") {
            return self.until(">", DOCTYPE).map(|_| ());
        }
        if self.takes("/") {
            return self.end();
        }
        if self.rest().starts_with(begins_name) { self.start() } else { self.error(TAG) }
    }

    fn add_text(&mut self, text: &str, entities: bool) {
        let is_document = self.open.len() < 2;
        let Some(element) = self.open.last_mut().filter(|_| !is_document && !text.is_empty()) else { return };
        let text = || if entities { resolve(text) } else { text.to_string() };
        element.text.get_or_insert_with(text);
    }

    fn start(&mut self) -> Result<(), XmlError> {
        let mut element = Element { name: self.name().to_string(), ..Element::default() };
        loop {
            let before = self.at;
            self.blank();
            if self.takes("/") {
                if !self.takes(">") {
                    return self.error(START);
                }
                return self.close(element);
            }
            if self.takes(">") {
                if self.open.len() as u64 > self.depth {
                    return self.error(DEPTH);
                }
                self.open.push(element);
                return Ok(());
            }
            if self.at == before || !self.rest().starts_with(begins_name) {
                return self.error(START);
            }
            element.attributes.push(self.attribute()?);
        }
    }

    fn attribute(&mut self) -> Result<(String, String), XmlError> {
        let name = self.name().to_string();
        self.blank();
        if !self.takes("=") {
            return self.error(ATTRIBUTE);
        }
        self.blank();
        let quote = match self.rest().as_bytes().first() {
            Some(b'"') => "\"",
            Some(b'\'') => "'",
            _ => return self.error(ATTRIBUTE),
        };
        let start = self.at + 1;
        self.at = start;
        let Ok(value) = self.until(quote, ATTRIBUTE) else {
            self.at = start;
            return self.error(ATTRIBUTE);
        };
        if self.rest().starts_with(begins_name) {
            return self.error(ATTRIBUTE);
        }
        // Line ends and tabs in values become blanks.
        Ok((name, resolve(&value.replace("\r\n", " ").replace(['\t', '\n', '\r'], " "))))
    }

    fn end(&mut self) -> Result<(), XmlError> {
        let start = self.at;
        let name = self.name();
        let Some(element) = self.open.pop().filter(|e| !self.open.is_empty() && e.name == name) else {
            self.at = start;
            return self.error(MISMATCH);
        };
        self.blank();
        if !self.takes(">") {
            return self.error(END);
        }
        self.close(element)
    }

    fn close(&mut self, element: Element) -> Result<(), XmlError> {
        if let Some(parent) = self.open.last_mut() {
            parent.children.push(element);
        }
        Ok(())
    }
}

/// Replaces character references; unknown ones stay as they are.
fn resolve(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('&') {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        let end = rest.find(';').unwrap_or(0);
        let name = rest.get(1..end).unwrap_or("");
        let number = |digits: &str, radix| u32::from_str_radix(digits, radix).ok().and_then(char::from_u32);
        let found = match name {
            "lt" => Some('<'),
            "gt" => Some('>'),
            "amp" => Some('&'),
            "quot" => Some('"'),
            "apos" => Some('\''),
            _ => match (name.strip_prefix("#x"), name.strip_prefix('#')) {
                (Some(digits), _) => number(digits, 16),
                (None, Some(digits)) => number(digits, 10),
                _ => None,
            },
        };
        out.push(found.unwrap_or('&'));
        rest = rest.get(if found.is_some() { end + 1 } else { 1 }..).unwrap_or("");
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_attributes_and_text() {
        let text = "<?xml version='1.0'?><!-- a > b --><a x=\"1 &lt; 2&#65;\" y='\"'>\n  one &amp; &what; two\n \
                    <b/><c>text</c><![CDATA[more]]></a>";
        let root = read(text, 256).expect("a document");
        let a = &root.children[0];
        assert_eq!(a.attribute("x"), Some("1 < 2A"));
        assert_eq!(a.attribute("y"), Some("\""));
        assert_eq!(a.attribute("z"), None);
        assert_eq!(a.text.as_deref().map(str::trim_end), Some("one & &what; two"));
        assert_eq!(a.children.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["b", "c"]);
        assert_eq!(a.children[1].text.as_deref(), Some("text"));
    }

    #[test]
    fn what_is_wrong_and_where() {
        let error = |text: &str| read(text, 256).map_or_else(|e| e.to_string(), |_| "fine".to_string());
        assert_eq!(error("<World><Camera\n"), "Error parsing start element tag at offset 14");
        assert_eq!(error("nosuch.xml"), "No document element found at offset 10");
        assert_eq!(error("<a><b></a>"), "Start-end tags mismatch at offset 8");
        assert_eq!(error("<a><!-- b"), "Error parsing comment at offset 8");
        assert_eq!(error("<a x>"), "Error parsing element attribute at offset 4");
        assert_eq!(error("<a>"), "Start-end tags mismatch at offset 2");
        assert_eq!(error("<3>"), "Could not determine tag type at offset 1");
        assert_eq!(error(""), "No document element found at offset 0");
    }

    #[test]
    fn deep_nesting_is_an_error() {
        assert!(read(&"<a>".repeat(100_000), 256).is_err_and(|e| e.what == DEPTH));
    }
}
