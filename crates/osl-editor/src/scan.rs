//! The words, texts, comments and brackets of a text, without any grammar.
//!
//! It never fails, and takes linear time. A quote without a partner ends at the end of its line, an open
//! comment at the end of the text, and a bracket without a partner encloses the rest of the text.

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A name, a keyword or a type.
    Word,
    /// A number.
    Number,
    /// A text in quotes, with its quotes.
    Str,
    /// A comment.
    Comment,
    /// `#` at the start of a line.
    Hash,
    /// An opening bracket.
    Open,
    /// A closing bracket.
    Close,
    /// Any other character.
    Mark,
}

/// A token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    /// Its kind.
    pub kind: Kind,
    /// Its first byte.
    pub start: usize,
    /// The byte after its last one.
    pub end: usize,
    /// Whether it belongs to a directive of the preprocessor.
    pub directive: bool,
    /// The index of the innermost bracket around it. A bracket is not around itself or its partner.
    pub parent: Option<usize>,
    /// Of a bracket: the index of its partner.
    pub partner: Option<usize>,
}

/// The tokens of a text.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// The tokens, in order.
    pub tokens: Vec<Token>,
}

impl Scan {
    /// Scans a text.
    pub fn of(text: &str) -> Scan {
        let mut tokens = Vec::new();
        // The end of the line of a directive.
        let mut directive = 0;
        let mut at = if text.starts_with('\u{feff}') { 3 } else { 0 };
        let mut line_start = true;
        while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
            let (kind, length) = next(rest);
            if let Some(mut kind) = kind {
                if rest.starts_with('#') && line_start {
                    kind = Kind::Hash;
                    directive = at + logical_line(rest);
                }
                let token = Token {
                    kind,
                    start: at,
                    end: at + length,
                    directive: at < directive,
                    parent: None,
                    partner: None,
                };
                line_start &= kind == Kind::Comment;
                tokens.push(token);
            } else if rest.starts_with(['\n', '\r']) && at >= directive {
                line_start = true;
            }
            at += length;
        }
        let mut scan = Scan { tokens };
        scan.pair(text);
        scan
    }

    /// Finds the partners of brackets. A closing bracket belongs to the last open one of its kind; brackets
    /// that were opened after that one have no partner.
    fn pair(&mut self, text: &str) {
        let kind = |token: &Token| text.get(token.start..token.end).unwrap_or_default();
        let mut open: Vec<usize> = Vec::new();
        for at in 0..self.tokens.len() {
            let Some(token) = self.tokens.get(at).copied() else { break };
            let in_code = !token.directive;
            if token.kind == Kind::Close && in_code {
                let wanted = match kind(&token) {
                    ")" => "(",
                    "]" => "[",
                    _ => "{",
                };
                let found = open.iter().rposition(|i| self.tokens.get(*i).is_some_and(|t| kind(t) == wanted));
                if let Some(found) = found {
                    let partner = open.get(found).copied();
                    open.truncate(found);
                    if let Some(other) = partner.and_then(|i| self.tokens.get_mut(i)) {
                        other.partner = Some(at);
                    }
                    if let Some(token) = self.tokens.get_mut(at) {
                        token.partner = partner;
                    }
                }
            }
            if let Some(token) = self.tokens.get_mut(at) {
                token.parent = open.last().copied();
            }
            if token.kind == Kind::Open && in_code {
                open.push(at);
            }
        }
    }

    /// The token with an index.
    pub fn get(&self, index: usize) -> Option<&Token> {
        self.tokens.get(index)
    }

    /// The index of the token at a byte: the one that begins before it and does not end before it. Of two
    /// tokens that touch there, a word, number or text.
    pub fn touching(&self, offset: usize) -> Option<usize> {
        let after = self.tokens.partition_point(|token| token.end < offset);
        let touches = |i: &usize| self.get(*i).is_some_and(|t| t.start <= offset && offset <= t.end);
        let all = || (after..after + 2).filter(touches);
        let is_word =
            |i: &usize| self.get(*i).is_some_and(|t| matches!(t.kind, Kind::Word | Kind::Number | Kind::Str));
        all().find(is_word).or_else(|| all().next_back())
    }

    /// The number of tokens that end at or before a byte.
    pub fn before(&self, offset: usize) -> usize {
        self.tokens.partition_point(|token| token.end <= offset)
    }

    /// The indices of the brackets around a byte, from the innermost one.
    pub fn around(&self, offset: usize) -> impl Iterator<Item = usize> {
        let before = self.tokens.partition_point(|token| token.start < offset);
        let last = before.checked_sub(1).and_then(|i| Some((i, self.get(i)?)));
        let inner = last.and_then(|(i, token)| match token.kind {
            Kind::Open if !token.directive && token.end <= offset => Some(i),
            _ => token.parent,
        });
        std::iter::successors(inner, |i| self.get(*i)?.parent)
    }

    /// The byte after what a bracket encloses, its partner included; the end of the text if it has none.
    pub fn end_of(&self, bracket: usize) -> usize {
        let partner = self.get(bracket).and_then(|token| self.get(token.partner?));
        partner.map_or(usize::MAX, |token| token.end)
    }
}

/// The length of a line, with the lines that continue it after a backslash, without its end.
fn logical_line(text: &str) -> usize {
    let mut from = 0;
    while let Some(end) = text.get(from..).and_then(|rest| rest.find('\n')) {
        let line = text.get(from..from + end).unwrap_or_default();
        if !line.trim_end_matches('\r').ends_with('\\') {
            return from + end;
        }
        from += end + 1;
    }
    text.len()
}

/// The kind and the length of what a text begins with; no kind for white space.
fn next(text: &str) -> (Option<Kind>, usize) {
    let first = text.chars().next().unwrap_or(' ');
    let span = |fits: fn(char) -> bool| text.find(|c| !fits(c)).unwrap_or(text.len());
    if text.starts_with("//") {
        return (Some(Kind::Comment), text.find(['\n', '\r']).unwrap_or(text.len()));
    }
    if text.starts_with("/*") {
        return (Some(Kind::Comment), text.find("*/").map_or(text.len(), |end| end + 2));
    }
    let second = text.chars().nth(1).unwrap_or(' ');
    match first {
        '"' => (Some(Kind::Str), quoted(text)),
        'A'..='Z' | 'a'..='z' | '_' => (Some(Kind::Word), span(|c| c.is_ascii_alphanumeric() || c == '_')),
        '0'..='9' => (Some(Kind::Number), number(text)),
        '.' if second.is_ascii_digit() => (Some(Kind::Number), number(text)),
        '(' | '[' | '{' => (Some(Kind::Open), 1),
        ')' | ']' | '}' => (Some(Kind::Close), 1),
        c if c.is_whitespace() || c == '\\' => (None, c.len_utf8()),
        c => (Some(Kind::Mark), c.len_utf8()),
    }
}

/// The length of a text in quotes, at most to the end of its line.
fn quoted(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '\n' | '\r' => return at,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// The length of a number, with its exponent.
fn number(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_hex = text.starts_with("0x") || text.starts_with("0X");
    let belongs = |at: usize, byte: u8| {
        let exponent = !is_hex && matches!(bytes.get(at.wrapping_sub(1)), Some(b'e' | b'E'));
        byte.is_ascii_alphanumeric() || byte == b'.' || (exponent && matches!(byte, b'+' | b'-'))
    };
    bytes.iter().enumerate().position(|(at, byte)| !belongs(at, *byte)).unwrap_or(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(Kind, &str)> {
        Scan::of(text).tokens.iter().map(|t| (t.kind, &text[t.start..t.end])).collect()
    }

    #[test]
    fn tokens() {
        use Kind::{Close, Comment, Hash, Mark, Number, Open, Str, Word};
        assert_eq!(
            words("a.x /* ( */ 1.5e-3+.5 \"é\\\"\" // b\n#if \\\n (1\n{ü}"),
            [
                (Word, "a"),
                (Mark, "."),
                (Word, "x"),
                (Comment, "/* ( */"),
                (Number, "1.5e-3"),
                (Mark, "+"),
                (Number, ".5"),
                (Str, "\"é\\\"\""),
                (Comment, "// b"),
                (Hash, "#"),
                (Word, "if"),
                (Open, "("),
                (Number, "1"),
                (Open, "{"),
                (Mark, "ü"),
                (Close, "}"),
            ]
        );
    }

    #[test]
    fn brackets() {
        let text = "f(a[1, {2);\n#x (\n}";
        let scan = Scan::of(text);
        let at = |part: &str| scan.tokens.iter().position(|t| t.start == text.find(part).unwrap_or(0));
        let partner =
            |part: &str| at(part).and_then(|i| scan.tokens[i].partner).map(|i| scan.tokens[i].start);
        assert_eq!((partner("("), partner("["), partner("{")), (text.find(");"), None, None));
        let around: Vec<usize> =
            scan.around(text.find('2').unwrap_or(0)).map(|i| scan.tokens[i].start).collect();
        assert_eq!(around, [7, 3, 1]);
        assert_eq!(scan.around(text.len()).count(), 0);
    }
}
