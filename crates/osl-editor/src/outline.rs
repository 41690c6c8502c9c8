//! The structure of a text: its symbols as a tree, what can be folded, and what a selection grows to.

use crate::page::{Page, lsp_range};
use crate::scan::Kind;
use gen_lsp_types as lsp;
use gen_lsp_types::{DocumentSymbol, FoldingRange, FoldingRangeKind, Position, Range, SelectionRange};
use osl::SymbolKind;

impl Page {
    /// The symbols of the text: functions, shaders and structs, with the variables and fields in them.
    pub fn outline(&self) -> Vec<DocumentSymbol> {
        let mut tree: Vec<(usize, DocumentSymbol)> = Vec::new();
        for symbol in self.symbols().list() {
            let Some(declared) = symbol.declared.as_ref().filter(|range| self.has(range)) else { continue };
            let kind = match symbol.kind {
                SymbolKind::Shader => lsp::SymbolKind::Module,
                SymbolKind::Struct => lsp::SymbolKind::Struct,
                SymbolKind::Function => lsp::SymbolKind::Function,
                SymbolKind::Field => lsp::SymbolKind::Field,
                SymbolKind::Parameter => lsp::SymbolKind::Property,
                SymbolKind::Formal | SymbolKind::Local | SymbolKind::Global | SymbolKind::Builtin => {
                    lsp::SymbolKind::Variable
                }
            };
            let is_outer =
                matches!(symbol.kind, SymbolKind::Shader | SymbolKind::Struct | SymbolKind::Function);
            let end = if is_outer { self.end_of_body(declared.start.offset) } else { declared.end.offset };
            let entry = DocumentSymbol {
                name: symbol.name.clone(),
                detail: Some(symbol.text.clone()),
                kind,
                range: Range::new(lsp_range(declared).start, self.text.position(end)),
                selection_range: lsp_range(declared),
                children: None,
                tags: None,
                #[expect(deprecated, reason = "the struct has no other constructor with all of these")]
                deprecated: None,
            };
            match tree.last_mut() {
                Some((outer, last)) if declared.start.offset < *outer => {
                    last.children.get_or_insert_default().push(entry);
                }
                _ => tree.push((if is_outer { end } else { 0 }, entry)),
            }
        }
        tree.into_iter().map(|(_, entry)| entry).collect()
    }

    /// The end of the block or the `;` that follows the name at a byte.
    fn end_of_body(&self, name: usize) -> usize {
        let scan = self.scan();
        let first = scan.before(name);
        for (index, token) in scan.tokens.iter().enumerate().skip(first) {
            let is_level = scan.get(first).is_some_and(|t| t.parent == token.parent);
            match self.token(token) {
                "{" if is_level => return scan.end_of(index).min(self.text.as_str().len()),
                ";" if is_level => return token.end,
                _ => {}
            }
        }
        self.text.as_str().len()
    }

    /// Blocks, lists and metadata, comments, conditionals and includes that span several lines.
    pub fn folds(&self) -> Vec<FoldingRange> {
        let scan = self.scan();
        let line = |offset: usize| self.text.line(offset) as u32;
        let mut list: Vec<(u32, u32, Option<FoldingRangeKind>)> = Vec::new();
        // Lines of comments and of includes that follow each other.
        let mut run: Option<(u32, u32, FoldingRangeKind)> = None;
        let mut conditionals: Vec<u32> = Vec::new();
        for (index, token) in scan.tokens.iter().enumerate() {
            let (start, end) = (line(token.start), line(token.end));
            let word = self.word(Some(index + 1));
            let lines_of = match token.kind {
                Kind::Comment => Some(FoldingRangeKind::Comment),
                Kind::Hash if word == "include" => Some(FoldingRangeKind::Imports),
                _ if token.directive => continue,
                _ => None,
            };
            match (&mut run, lines_of) {
                (Some((_, last, kind)), Some(of)) if *kind == of && start <= *last + 1 => *last = end,
                (_, of) => list.extend(std::mem::replace(&mut run, of.map(|of| (start, end, of))).map(some)),
            }
            if token.kind == Kind::Open
                && let Some(close) = token.partner.and_then(|partner| scan.get(partner))
            {
                list.push((start, line(close.start).saturating_sub(1), None));
            }
        }
        list.extend(run.map(some));
        for (index, token) in scan.tokens.iter().enumerate().filter(|(_, token)| token.kind == Kind::Hash) {
            let at = line(token.start);
            match self.word(Some(index + 1)) {
                "if" | "ifdef" | "ifndef" => conditionals.push(at),
                "else" | "elif" => {
                    list.extend(conditionals.pop().map(|from| (from, at.saturating_sub(1), None)));
                    conditionals.push(at);
                }
                "endif" => {
                    list.extend(conditionals.pop().map(|from| (from, at, Some(FoldingRangeKind::Region))))
                }
                _ => {}
            }
        }
        list.retain(|(start, end, _)| start < end);
        list.sort_by_key(|(start, end, _)| (*start, std::cmp::Reverse(*end)));
        list.dedup_by_key(|(start, ..)| *start);
        let fold = |(start_line, end_line, kind)| FoldingRange {
            start_line,
            end_line,
            kind,
            ..FoldingRange::default()
        };
        list.into_iter().map(fold).collect()
    }

    /// What a selection grows to, from each of some positions: the token, the argument or statement, the
    /// contents of the brackets, the brackets, and so on to the whole text.
    pub fn selections(&self, positions: &[Position]) -> Vec<SelectionRange> {
        positions.iter().map(|position| self.selection(self.text.offset(*position))).collect()
    }

    fn selection(&self, offset: usize) -> SelectionRange {
        let scan = self.scan();
        let mut spans: Vec<(usize, usize)> = Vec::new();
        let token = scan.touching(offset).and_then(|i| scan.get(i));
        spans.extend(token.map(|token| (token.start, token.end)));
        let length = self.text.as_str().len();
        let brackets: Vec<Option<usize>> = scan.around(offset).map(Some).chain([None]).collect();
        for bracket in brackets {
            let open = bracket.and_then(|i| scan.get(i));
            let start = open.map_or(0, |open| open.end);
            let close = open.map_or(length, |open| {
                open.partner.and_then(|i| scan.get(i)).map_or(length, |close| close.start)
            });
            let ends: &[&str] = if open.is_some_and(|t| self.token(t) != "{") { &[","] } else { &[";", "}"] };
            let inside =
                || scan.tokens.iter().filter(|t| t.parent == bracket && start <= t.start && t.end <= close);
            let separates = |t: &&crate::scan::Token| ends.contains(&self.token(t));
            let from =
                inside().filter(separates).take_while(|t| t.end <= offset).last().map_or(start, |t| t.end);
            let to = inside().filter(separates).find(|t| t.end > offset);
            let to = to.map_or(close, |t| if self.token(t) == "," { t.start } else { t.end });
            let trimmed = |from: usize, to: usize| {
                let text = self.text.slice(from, to);
                let start = from + text.len() - text.trim_start().len();
                (start, start + text.trim().len())
            };
            spans.extend([trimmed(from, to), trimmed(start, close)]);
            spans.extend(open.map(|open| (open.start, (close + 1).min(length))));
        }
        spans.push((0, length));
        // Each holds the one before.
        let mut chain: Vec<(usize, usize)> = Vec::new();
        for span in spans {
            match chain.last() {
                Some((start, end)) if span.0 > *start || span.1 < *end || span == (*start, *end) => {}
                _ => chain.push(span),
            }
        }
        let outer =
            chain.into_iter().rev().fold(None, |parent: Option<Box<SelectionRange>>, (start, end)| {
                Some(Box::new(SelectionRange { range: self.text.range(start, end), parent }))
            });
        outer.map_or_else(SelectionRange::default, |inner| *inner)
    }
}

fn some<K>((start, end, kind): (u32, u32, K)) -> (u32, u32, Option<K>) {
    (start, end, Some(kind))
}
