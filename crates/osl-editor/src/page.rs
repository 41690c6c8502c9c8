//! A text with its analysis, and what a page must ask of the world.

use crate::scan::{Kind, Scan, Token};
use crate::text::Text;
use gen_lsp_types::{Location, Position, Range, Uri};
use osl::{Analysis, Levels, Symbol, SymbolKind, Symbols};
use std::cell::OnceCell;
use std::collections::BTreeMap;

/// What a page must ask.
pub trait World {
    /// Reads and checks a text. Headers come from open editors first.
    fn check(&self, name: &str, text: &str) -> Analysis;
    /// The text after preprocessing.
    fn expanded(&self, name: &str, text: &str) -> String;
    /// The text after all safe fixes.
    fn fixed(&self, name: &str, text: &str) -> String;
    /// The address of a file; `None` if it has none, as a header of the compiler.
    fn uri(&self, name: &str) -> Option<Uri>;
    /// The names of the headers that a file could include.
    fn headers(&self, name: &str) -> Vec<String>;
    /// The file that an include of a file leads to.
    fn included(&self, name: &str, include: &str, quoted: bool) -> Option<String>;
    /// Which warnings are shown.
    fn levels(&self) -> &Levels;
    /// The address of the folder or page with the lessons of diagnostics, to which the code and `.md` are
    /// added.
    fn lessons(&self) -> Option<&str>;
}

/// A text with its analysis.
pub struct Page {
    /// The name of its file.
    pub name: String,
    /// The text.
    pub text: Text,
    /// What the compiler says.
    pub analysis: Analysis,
    symbols: OnceCell<Symbols>,
    /// The indices of symbols, by the first byte of each place that names them.
    places: OnceCell<BTreeMap<usize, usize>>,
    scan: OnceCell<Scan>,
    found: OnceCell<Vec<osl::Diagnostic>>,
}

impl Page {
    /// Reads and checks a text.
    pub fn new(name: &str, text: Text, world: &dyn World) -> Page {
        let analysis = world.check(name, text.as_str());
        Page {
            name: name.to_string(),
            text,
            analysis,
            symbols: OnceCell::new(),
            places: OnceCell::new(),
            scan: OnceCell::new(),
            found: OnceCell::new(),
        }
    }

    /// The diagnostics that the levels show.
    pub fn found(&self, levels: &Levels) -> &[osl::Diagnostic] {
        self.found.get_or_init(|| self.analysis.diagnostics(levels))
    }

    /// The names of the text, and the types of its expressions.
    pub fn symbols(&self) -> &Symbols {
        self.symbols.get_or_init(|| self.analysis.symbols())
    }

    /// The tokens of the text.
    pub fn scan(&self) -> &Scan {
        self.scan.get_or_init(|| Scan::of(self.text.as_str()))
    }

    /// Whether it is a header: no shader of its own is expected.
    pub fn is_header(&self) -> bool {
        self.name.ends_with(".h")
    }

    /// Whether a range lies in this page's file.
    pub(crate) fn has(&self, range: &osl::Range) -> bool {
        range.file == self.name
    }

    /// The location of a range; `None` in a header of the compiler.
    pub(crate) fn location(&self, range: &osl::Range, world: &dyn World) -> Option<Location> {
        Some(Location::new(world.uri(&range.file)?, lsp_range(range)))
    }

    /// The text of a token.
    pub(crate) fn token(&self, token: &Token) -> &str {
        self.text.slice(token.start, token.end)
    }

    /// The text of the token with an index; empty if there is none.
    pub(crate) fn word(&self, index: Option<usize>) -> &str {
        index.and_then(|i| self.scan().get(i)).map_or("", |token| self.token(token))
    }

    /// The word at a byte, or before it.
    pub(crate) fn word_at(&self, offset: usize) -> Option<&Token> {
        let token = self.scan().get(self.scan().touching(offset)?)?;
        (token.kind == Kind::Word).then_some(token)
    }

    /// The symbol that is named at this byte. Of a macro that names several, the last one.
    pub(crate) fn symbol_of(&self, start: usize) -> Option<&Symbol> {
        let list = self.symbols().list();
        let places = self.places.get_or_init(|| {
            let own = |range: &osl::Range| self.has(range).then_some(range.start.offset);
            let all = list.iter().enumerate().flat_map(|(index, symbol)| {
                symbol.declared.iter().chain(&symbol.uses).filter_map(own).map(move |place| (place, index))
            });
            all.collect()
        });
        list.get(*places.get(&start)?)
    }

    /// The symbol of the word at a position, or before it.
    pub(crate) fn symbol_at(&self, position: Position) -> Option<(&Symbol, &Token)> {
        let token = self.word_at(self.text.offset(position))?;
        let symbol = self.symbol_of(token.start)?;
        (symbol.name == self.token(token)).then_some((symbol, token))
    }

    /// The bytes in which a symbol of this page can be named, as brackets tell; all for one of a header.
    pub(crate) fn scope(&self, symbol: &Symbol) -> (usize, usize) {
        let Some(declared) = symbol.declared.as_ref().filter(|range| self.has(range)) else {
            return (0, usize::MAX);
        };
        let start = declared.start.offset;
        let scan = self.scan();
        let Some(bracket) = scan.around(start).next() else { return (start, usize::MAX) };
        let end = scan.end_of(bracket);
        let after = scan.get(bracket).and_then(|open| open.partner).map_or(usize::MAX, |close| close + 1);
        match self.word(Some(bracket)) {
            "{" => (start, end),
            // A parameter, or the variable of a loop: it also has the block, or the statement, that follows.
            _ => (start, self.after_header(after)),
        }
    }

    /// The end of the block or the statement that begins at a token.
    fn after_header(&self, first: usize) -> usize {
        let scan = self.scan();
        for (index, token) in scan.tokens.iter().enumerate().skip(first) {
            match self.token(token) {
                "{" => return scan.end_of(index),
                ";" if scan.get(first).is_some_and(|t| t.parent == token.parent) => return token.end,
                _ => {}
            }
        }
        usize::MAX
    }

    /// Whether a symbol can be named at a byte.
    pub(crate) fn is_visible(&self, symbol: &Symbol, offset: usize) -> bool {
        let (start, end) = self.scope(symbol);
        symbol.kind != SymbolKind::Field && start <= offset && offset < end
    }

    /// The declaration of a function, shader or struct as written up to its body, on one line, and its end.
    pub(crate) fn header(&self, symbol: &Symbol) -> Option<(String, usize)> {
        let declared = symbol.declared.as_ref()?;
        let other;
        let (text, scan) = if self.has(declared) {
            (self.text.as_str(), self.scan())
        } else {
            let text = self.analysis.files().find(|(name, _)| *name == declared.file)?.1;
            other = Scan::of(text);
            (text, &other)
        };
        let name = scan.before(declared.start.offset);
        let word = |i: usize| scan.get(i).and_then(|t| text.get(t.start..t.end)).unwrap_or_default();
        let ends = |i: &usize| {
            let token = scan.get(*i);
            [";", "{", "}"].contains(&word(*i))
                || token.is_none_or(|t| t.directive || t.kind == Kind::Comment)
        };
        let first = (0..name).rev().find(ends).map_or(0, |i| i + 1);
        let open = Some(name + 1).filter(|i| word(*i) == "(");
        let end = open.and_then(|i| scan.get(i)?.partner).unwrap_or(name);
        let (start, end) = (scan.get(first)?.start, scan.get(end)?.end);
        Some((text.get(start..end)?.split_whitespace().collect::<Vec<_>>().join(" "), end))
    }

    /// The comment before a declaration, without its marks.
    pub(crate) fn comment(&self, symbol: &Symbol) -> Option<String> {
        let declared = symbol.declared.as_ref().filter(|range| self.has(range))?;
        let mut line = self.text.line(declared.start.offset);
        let mut lines = Vec::new();
        let own = self.text.slice(declared.end.offset, self.text.line_end(line));
        lines.extend(own.split_once("//").map(|(_, words)| words.trim().to_string()));
        // A comment above a line belongs to what the line begins with.
        let before = self.text.slice(self.text.line_start(line), declared.start.offset);
        let is_first = !before.contains(['{', '(', ';', ',']);
        while let Some(above) = line.checked_sub(1).filter(|_| is_first) {
            let text = self.text.slice(self.text.line_start(above), self.text.line_end(above)).trim();
            let Some(words) = text.strip_prefix("//") else { break };
            lines.insert(0, words.trim_start_matches('/').trim().to_string());
            line = above;
        }
        Some(lines.join("\n")).filter(|text| !text.is_empty())
    }
}

/// A range in the units of the protocol.
pub(crate) fn lsp_range(range: &osl::Range) -> Range {
    let position = |p: &osl::Position| Position::new(p.line.saturating_sub(1), p.utf16);
    Range::new(position(&range.start), position(&range.end))
}
