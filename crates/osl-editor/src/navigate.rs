//! From a name to its declaration and its uses.

use crate::page::{Page, World, lsp_range};
use crate::scan::Kind;
use gen_lsp_types::{DocumentHighlight, DocumentHighlightKind, DocumentLink, Location, Position, Range};
use osl::{Symbol, SymbolKind};

/// What a name stands for, in a form that is the same on all pages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The kind of the symbol, its declaration as text, and where that is; `None` for a word of the language.
    of: (SymbolKind, String, Option<(String, usize)>),
}

impl Page {
    /// Where the name at a position is declared, or the file of an include.
    pub fn definition(&self, position: Position, world: &dyn World) -> Vec<Location> {
        let found = self.symbol_at(position).map(|(symbol, _)| symbol);
        if let Some(symbol) = found {
            // A prototype leads to the function.
            let places = self.same(symbol).filter_map(|s| s.declared.as_ref());
            return places.filter_map(|range| self.location(range, world)).collect();
        }
        let offset = self.text.offset(position);
        let holds = |(start, end, _): &(usize, usize, String)| *start <= offset && offset <= *end;
        if let Some((_, _, file)) = self.includes(world).into_iter().find(holds) {
            return world.uri(&file).map(|uri| Location::new(uri, Range::default())).into_iter().collect();
        }
        let Some(word) = self.word_at(offset) else { return Vec::new() };
        let Some(found) = self.macro_at(self.token(word), word.start) else { return Vec::new() };
        let Some(uri) = world.uri(&found.file) else { return Vec::new() };
        let text = self.analysis.files().find(|(name, _)| *name == found.file).map_or("", |(_, text)| text);
        let text = crate::Text::new(text.to_string());
        vec![Location::new(uri, text.range(found.at.0, found.at.1))]
    }

    /// What the name at a position stands for.
    pub fn target(&self, position: Position) -> Option<Target> {
        self.symbol_at(position).map(|(symbol, _)| target(symbol))
    }

    /// The places of this page's text and headers that name a target.
    pub fn references(&self, target: &Target, declared: bool, world: &dyn World) -> Vec<Location> {
        let Some(symbol) = self.symbols().list().iter().find(|symbol| self::target(symbol) == *target) else {
            return Vec::new();
        };
        let mut places: Vec<&osl::Range> = Vec::new();
        for symbol in self.same(symbol) {
            places.extend(symbol.declared.iter().filter(|_| declared));
            places.extend(&symbol.uses);
        }
        places.iter().filter_map(|range| self.location(range, world)).collect()
    }

    /// A symbol, and for a function its other declarations.
    pub(crate) fn same<'s>(&'s self, symbol: &'s Symbol) -> impl Iterator<Item = &'s Symbol> {
        let is_same = move |other: &&Symbol| {
            let function = symbol.kind == SymbolKind::Function && other.kind == SymbolKind::Function;
            **other == *symbol || (function && other.text == symbol.text)
        };
        self.symbols().list().iter().filter(is_same)
    }

    /// The places of the text that name the same as the one at a position.
    pub fn highlights(&self, position: Position) -> Vec<DocumentHighlight> {
        let Some((symbol, _)) = self.symbol_at(position) else { return Vec::new() };
        let mut list = Vec::new();
        for symbol in self.same(symbol) {
            let uses = symbol.uses.iter().map(|range| (range, self.is_written(range)));
            for (range, written) in symbol.declared.iter().map(|range| (range, true)).chain(uses) {
                if self.has(range) {
                    let kind =
                        if written { DocumentHighlightKind::Write } else { DocumentHighlightKind::Read };
                    list.push(DocumentHighlight { range: lsp_range(range), kind: Some(kind) });
                }
            }
        }
        list
    }

    /// Whether an assignment follows a name, or a step is beside it.
    fn is_written(&self, range: &osl::Range) -> bool {
        let after = self.text.slice(range.end.offset, self.text.as_str().len()).trim_start();
        let before = self.text.slice(0, range.start.offset).trim_end();
        let op = after.trim_start_matches(['+', '-', '*', '/', '&', '|', '^', '<', '>']);
        let is_op = after.len() - op.len() <= 2 && op.starts_with('=') && !op.starts_with("==");
        let is_comparison = ["<=", ">="].iter().any(|word| after.starts_with(word));
        let is_step = |text: &str| text == "++" || text == "--";
        (is_op && !is_comparison)
            || is_step(after.get(..2).unwrap_or_default())
            || is_step(before.get(before.len().saturating_sub(2)..).unwrap_or_default())
    }

    /// The bytes of each name of an included file, and the file.
    fn includes(&self, world: &dyn World) -> Vec<(usize, usize, String)> {
        let scan = self.scan();
        let mut list = Vec::new();
        for (i, _) in scan.tokens.iter().enumerate().filter(|(_, token)| token.kind == Kind::Hash) {
            if self.word(Some(i + 1)) != "include" {
                continue;
            }
            let Some(first) = scan.get(i + 2).filter(|token| token.directive) else { continue };
            let line_end = self.text.line_end(self.text.line(first.start));
            let rest = self.text.slice(first.start, line_end);
            let quoted = rest.starts_with('"');
            let Some(name) = rest.get(1..).and_then(|rest| rest.split(['"', '>']).next()) else { continue };
            if let Some(file) = world.included(&self.name, name, quoted) {
                list.push((first.start + 1, first.start + 1 + name.len(), file));
            }
        }
        list
    }

    /// The included files that have an address.
    pub fn links(&self, world: &dyn World) -> Vec<DocumentLink> {
        let link = |(start, end, file): (usize, usize, String)| DocumentLink {
            range: self.text.range(start, end),
            target: world.uri(&file),
            tooltip: None,
            data: None,
        };
        self.includes(world).into_iter().map(link).filter(|link| link.target.is_some()).collect()
    }
}

fn target(symbol: &Symbol) -> Target {
    let declared = symbol.declared.as_ref().map(|range| (range.file.clone(), range.start.offset));
    Target { of: (symbol.kind, symbol.text.clone(), declared) }
}
