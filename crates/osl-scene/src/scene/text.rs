//! The syntax of scenes: nodes with their parameters, as words and arrays.
//!
//! A node is `kind { name value … }`, with one parameter per line. Values continue on lines that begin with a
//! number or a quoted text. Arrays state their number of elements: `vlist 8 1 POINT …`, or `b64POINT` with
//! the bytes of little-endian floats in base64. `#` begins a comment.

use super::message::{Messages, SceneLocation};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::sync::Arc;

/// A node as written.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its type: `polymesh`, or the name of a shader.
    pub kind: String,
    /// Where it begins.
    pub place: SceneLocation,
    /// Its parameters, in order.
    pub params: Vec<Param>,
}

/// A parameter of a node.
#[derive(Clone, Debug)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// Its location.
    pub place: SceneLocation,
    /// Its value.
    pub value: Value,
}

/// A value as written.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// One or more words.
    Words(Vec<Word>),
    /// Numbers of an array with a given length: the components in sequence.
    Numbers(Vec<f64>),
    /// Texts of an array with a given length.
    Texts(Vec<String>),
}

/// A word of a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    /// Its text, without quotes.
    pub text: String,
    /// Whether it was in quotes.
    pub quoted: bool,
}

/// A top-level item of a file.
#[derive(Clone, Debug)]
pub(super) enum Item {
    /// A node.
    Node(Node),
    /// The name of an included file, whose items belong here.
    Include(String, SceneLocation),
}

/// Reads a text. Invalid parts are skipped with an error.
pub(super) fn read(file: &Arc<str>, text: &str, messages: &mut Messages) -> Vec<Item> {
    let mut reader = Reader { tokens: Tokens::new(text), file: file.clone(), messages, ahead: None };
    let mut items = Vec::new();
    while let Some(token) = reader.next() {
        let place = reader.place(&token);
        match (token.text.as_str(), token.quoted) {
            ("include", false) => match reader.next() {
                Some(name) if name.quoted => items.push(Item::Include(name.text, place)),
                _ => reader.messages.error(&place, "an include is `include \"file.ass\"`"),
            },
            ("{" | "}", false) | (_, true) => {
                reader
                    .messages
                    .error(&place, format!("a node begins with its kind, not with `{}`", token.text));
                if token.text == "{" {
                    reader.skip();
                }
            }
            _ => items.extend(reader.node(token, place).map(Item::Node)),
        }
    }
    items
}

/// A word of the text with its location.
#[derive(Clone, Debug)]
struct Token {
    text: String,
    quoted: bool,
    line: u32,
    /// Whether it is the first of its line.
    first: bool,
    /// Whether it is the last of its line.
    last: bool,
}

impl Token {
    fn is(&self, text: &str) -> bool {
        !self.quoted && self.text == text
    }

    fn is_number(&self) -> bool {
        !self.quoted
            && self.text.parse::<f64>().is_ok()
            && !self.text.starts_with(|c: char| c.is_alphabetic())
    }
}

/// The words of a text.
struct Tokens<'a> {
    rest: &'a str,
    line: u32,
    first: bool,
}

impl<'a> Tokens<'a> {
    fn new(text: &'a str) -> Tokens<'a> {
        Tokens { rest: text, line: 1, first: true }
    }

    fn blanks(&mut self) {
        loop {
            let blank = |c: char| c != '\n' && (c.is_whitespace() || c == '\u{feff}');
            let trimmed = self.rest.trim_start_matches(blank);
            if let Some(after) = trimmed.strip_prefix('\n') {
                self.rest = after;
                self.line += 1;
                self.first = true;
            } else if trimmed.starts_with('#') {
                self.rest = trimmed.find('\n').map_or("", |at| &trimmed[at..]);
            } else {
                self.rest = trimmed;
                return;
            }
        }
    }

    /// The text of the next word, and whether it is in quotes.
    fn word(&mut self) -> Option<(String, bool)> {
        let first = self.rest.chars().next()?;
        if let Some(open) = self.rest.strip_prefix('"') {
            let end = open.find(['"', '\n']).unwrap_or(open.len());
            let closed = open[end..].starts_with('"');
            self.rest = &open[end + usize::from(closed)..];
            return Some((open[..end].to_string(), true));
        }
        let brace = matches!(first, '{' | '}');
        let stops = |c: char| c.is_whitespace() || matches!(c, '{' | '}' | '"' | '#');
        let end = if brace { 1 } else { self.rest.find(stops).unwrap_or(self.rest.len()) };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some((word.to_string(), false))
    }
}

impl Iterator for Tokens<'_> {
    type Item = Token;

    fn next(&mut self) -> Option<Token> {
        self.blanks();
        let (line, first) = (self.line, self.first);
        let (text, quoted) = self.word()?;
        self.first = false;
        self.blanks();
        Some(Token { text, quoted, line, first, last: self.first || self.rest.is_empty() })
    }
}

struct Reader<'a> {
    tokens: Tokens<'a>,
    file: Arc<str>,
    messages: &'a mut Messages,
    ahead: Option<Token>,
}

impl Reader<'_> {
    fn place(&self, token: &Token) -> SceneLocation {
        SceneLocation { file: self.file.clone(), line: token.line }
    }

    fn next(&mut self) -> Option<Token> {
        self.ahead.take().or_else(|| self.tokens.next())
    }

    fn peek(&mut self) -> Option<&Token> {
        if self.ahead.is_none() {
            self.ahead = self.tokens.next();
        }
        self.ahead.as_ref()
    }

    /// The next word, if `wanted` accepts it.
    fn next_if(&mut self, wanted: impl Fn(&Token) -> bool) -> Option<Token> {
        if self.peek().is_some_and(wanted) { self.next() } else { None }
    }

    /// Maximum number of array elements.
    fn most(&self) -> u64 {
        self.messages.limits().scenes.elements
    }

    /// Skips to the end of the node.
    fn skip(&mut self) {
        while self.next().is_some_and(|t| !t.is("}")) {}
    }

    fn node(&mut self, kind: Token, place: SceneLocation) -> Option<Node> {
        if self.next_if(|t| t.is("{")).is_none() {
            self.messages.error(&place, format!("`{}` is followed by no `{{`", kind.text));
            return None;
        }
        let mut node = Node { kind: kind.text, place, params: Vec::new() };
        loop {
            let Some(token) = self.next() else {
                let text = format!("node `{}` has no closing `}}`", node.kind);
                self.messages.error(&node.place, text);
                return None;
            };
            if token.is("}") {
                return Some(node);
            }
            let place = self.place(&token);
            let named = !token.quoted && token.text.starts_with(|c: char| c.is_alphabetic() || c == '_');
            if !named {
                let text = format!("a parameter begins with its name, not with `{}`", token.text);
                self.messages.error(&place, text);
                self.skip();
                return None;
            }
            match self.value() {
                Ok(value) => node.params.push(Param { name: token.text, place, value }),
                Err(why) => {
                    self.messages.error(&place, format!("parameter `{}`: {why}", token.text));
                    self.skip();
                    return None;
                }
            }
        }
    }

    /// The value of a parameter whose name has been read.
    fn value(&mut self) -> Result<Value, String> {
        let mut words: Vec<Word> = Vec::new();
        let goes_on = |t: &Token| !t.is("}") && !t.is("{") && (!t.first || t.quoted || t.is_number());
        while let Some(token) = self.next_if(goes_on) {
            let array = !token.quoted && words.len() == 2 && element(&token.text).is_some();
            if let (true, [count, keys]) = (array, &words[..]) {
                return self.array(&count.text, &keys.text, &token.text);
            }
            if words.len() as u64 >= self.most() {
                return Err(format!("it has more than {} words ({HINT})", self.most()));
            }
            words.push(Word { text: token.text, quoted: token.quoted });
        }
        if words.is_empty() { Err("it has no value".to_string()) } else { Ok(Value::Words(words)) }
    }

    fn array(&mut self, count: &str, keys: &str, ty: &str) -> Result<Value, String> {
        let number =
            |text: &str| text.parse::<usize>().map_err(|_| format!("`{text}` is no number of elements"));
        let (count, keys) = (number(count)?, number(keys)?);
        let Element { components, packed, texts } = element(ty).unwrap_or(Element::NUMBER);
        let total = count.checked_mul(keys.max(1)).and_then(|n| n.checked_mul(components));
        let most = self.most();
        let total = total.filter(|n| *n as u64 <= most).ok_or_else(|| {
            format!("an array has at most {most} numbers, and {count} of type {ty} are more ({HINT})")
        })?;
        if texts {
            let items = std::iter::from_fn(|| self.next_if(|t| t.quoted)).take(total).map(|t| t.text);
            let items: Vec<String> = items.collect();
            return if items.len() == total {
                Ok(Value::Texts(items))
            } else {
                Err(short(items.len(), total))
            };
        }
        let mut numbers = if packed { self.packed(total)? } else { self.plain(total)? };
        // If a moving object has values for several times, the first one counts.
        numbers.truncate(count * components);
        Ok(Value::Numbers(numbers))
    }

    fn plain(&mut self, total: usize) -> Result<Vec<f64>, String> {
        let mut numbers = Vec::new();
        while numbers.len() < total {
            let Some(token) = self.next_if(|t| t.is_number() || t.is("on") || t.is("off")) else {
                return Err(short(numbers.len(), total));
            };
            numbers.push(match token.text.as_str() {
                "on" => 1.0,
                "off" => 0.0,
                text => text.parse().unwrap_or_default(),
            });
        }
        Ok(numbers)
    }

    /// Floats in base64, over any number of lines that contain nothing else.
    fn packed(&mut self, total: usize) -> Result<Vec<f64>, String> {
        let bytes = total * 4;
        let letters = (bytes * 4).div_ceil(3);
        let mut text = String::new();
        while text.len() < letters {
            let Some(token) = self.next_if(|t| !t.quoted && !t.is("}") && !t.is("{") && (t.last || !t.first))
            else {
                break;
            };
            text += &token.text;
        }
        let padding = DecodePaddingMode::Indifferent;
        let engine =
            GeneralPurpose::new(&STANDARD, GeneralPurposeConfig::new().with_decode_padding_mode(padding));
        let found = engine.decode(text.as_bytes()).map_err(|e| format!("it is not base64: {e}"))?;
        if found.len() != bytes {
            return Err(format!("its base64 holds {} bytes, not {bytes}", found.len()));
        }
        let (floats, _) = found.as_chunks::<4>();
        Ok(floats.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect())
    }
}

/// The option that permits more elements.
const HINT: &str = "--limit scenes.elements=N";

fn short(found: usize, total: usize) -> String {
    format!("the array ends after {found} of {total} elements")
}

/// The element type of an array.
struct Element {
    components: usize,
    packed: bool,
    texts: bool,
}

impl Element {
    const NUMBER: Element = Element { components: 1, packed: false, texts: false };
}

/// The element type for the type name of an array.
fn element(name: &str) -> Option<Element> {
    let (packed, plain) = match name.strip_prefix("b64") {
        Some(rest) => (true, rest),
        None => (false, name),
    };
    let (components, texts) = match plain {
        "FLOAT" => (1, false),
        "BYTE" | "INT" | "UINT" | "BOOL" if !packed => (1, false),
        "STRING" | "NODE" if !packed => (1, true),
        "POINT2" | "VECTOR2" => (2, false),
        "POINT" | "VECTOR" | "RGB" => (3, false),
        "RGBA" => (4, false),
        "MATRIX" => (16, false),
        _ => return None,
    };
    Some(Element { components, packed, texts })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(text: &str) -> (Vec<Item>, Vec<String>) {
        let mut messages = Messages::default();
        let items = read(&"a.ass".into(), text, &mut messages);
        (items, messages.list().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn values_end_where_they_should() {
        let (items, said) = items(
            "# a mesh\npolymesh\n{\n name a\n nsides 2 1 UINT 4\n 4\n vlist 1 1 b64POINT\n  AAB6wwAAAAAAAHrD\n \
             matrix\n  1 0 0 0\n  0 1 0 0\n smoothing on # yes\n tint \"a b\" 3\n}\ninclude \"b.ass\"",
        );
        assert!(said.is_empty(), "{said:?}");
        let [Item::Node(node), Item::Include(file, place)] = &items[..] else { panic!("{items:?}") };
        assert_eq!((file.as_str(), place.line), ("b.ass", 15));
        let names: Vec<&str> = node.params.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["name", "nsides", "vlist", "matrix", "smoothing", "tint"]);
        assert_eq!(node.params[1].value, Value::Numbers(vec![4.0, 4.0]));
        assert_eq!(node.params[2].value, Value::Numbers(vec![-250.0, 0.0, -250.0]));
        assert!(matches!(&node.params[3].value, Value::Words(words) if words.len() == 8));
        assert_eq!(node.params[3].place.line, 9);
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        for (text, expected) in [
            (
                "a {\n vlist 8 1 b64POINT\n AAB6ww\n smoothing on\n}",
                "a.ass:2: error: parameter `vlist`: its base64 holds",
            ),
            ("a {\n vlist 1 1 b64POINT\n AAB*ww==\n}", "a.ass:2: error: parameter `vlist`: it is not base64"),
            ("a {\n n 3 1 INT 1 2\n}", "a.ass:2: error: parameter `n`: the array ends after 2 of 3 elements"),
            ("a {\n n 99999999999 1 RGB 1\n}", "an array has at most"),
            ("a {\n n\n}", "a.ass:2: error: parameter `n`: it has no value"),
            ("\na {\n n 1\n", "a.ass:2: error: node `a` has no closing `}`"),
            ("a\nb { }", "a.ass:1: error: `a` is followed by no `{`"),
            ("}", "a.ass:1: error: a node begins with its kind, not with `}`"),
        ] {
            let (_, said) = items(text);
            assert!(said.first().is_some_and(|s| s.contains(expected)), "{text}: {said:?}");
        }
    }
}
