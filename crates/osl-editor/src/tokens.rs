//! Semantic tokens: the color class of each word, also where an editor has no grammar of the language.

use crate::page::Page;
use crate::scan::Kind;
use crate::words::{KEYWORDS, TYPES};
use gen_lsp_types::{Range, SemanticToken, SemanticTokens, SemanticTokensLegend};
use osl::SymbolKind;
use std::collections::{BTreeMap, BTreeSet};

const CLASSES: [&str; 12] = [
    "comment",
    "string",
    "number",
    "keyword",
    "type",
    "struct",
    "function",
    "parameter",
    "variable",
    "property",
    "macro",
    "namespace",
];
const DECLARATION: u32 = 1;
const LIBRARY: u32 = 2;

/// The classes and modifiers of tokens, in the order of their numbers.
pub fn legend() -> SemanticTokensLegend {
    SemanticTokensLegend {
        token_types: CLASSES.map(str::to_string).to_vec(),
        token_modifiers: ["declaration", "defaultLibrary"].map(str::to_string).to_vec(),
    }
}

impl Page {
    /// The classes of the tokens, or of those in a range.
    pub fn semantic_tokens(&self, range: Option<Range>) -> SemanticTokens {
        let mut symbols: BTreeMap<usize, (&'static str, u32)> = BTreeMap::new();
        for symbol in self.symbols().list() {
            let (class, library) = match symbol.kind {
                SymbolKind::Shader => ("namespace", 0),
                SymbolKind::Struct => ("struct", 0),
                SymbolKind::Field => ("property", 0),
                SymbolKind::Function => ("function", 0),
                SymbolKind::Builtin => ("function", LIBRARY),
                SymbolKind::Parameter | SymbolKind::Formal => ("parameter", 0),
                SymbolKind::Local => ("variable", 0),
                SymbolKind::Global => ("variable", LIBRARY),
            };
            let own = |range: &&osl::Range| self.has(range);
            let uses = symbol.uses.iter().filter(own).map(|range| (range.start.offset, (class, library)));
            symbols.extend(uses);
            let declared = symbol.declared.iter().filter(own);
            symbols.extend(declared.map(|range| (range.start.offset, (class, library | DECLARATION))));
        }
        let macros: BTreeSet<String> = self.macros().into_iter().map(|found| found.name).collect();
        let mut pieces = Vec::new();
        for (index, token) in self.scan().tokens.iter().enumerate() {
            let word = self.token(token);
            let after_hash = index.checked_sub(1).is_some_and(|i| self.word(Some(i)) == "#");
            let (class, modifiers) = match token.kind {
                Kind::Comment => ("comment", 0),
                Kind::Str => ("string", 0),
                Kind::Number => ("number", 0),
                Kind::Hash => ("macro", 0),
                Kind::Word if macros.contains(word) => ("macro", 0),
                Kind::Word if token.directive => {
                    if after_hash {
                        ("macro", 0)
                    } else {
                        continue;
                    }
                }
                Kind::Word => match symbols.get(&token.start) {
                    Some(found) => *found,
                    None if KEYWORDS.contains(&word) => ("keyword", 0),
                    None if TYPES.contains(&word) => ("type", LIBRARY),
                    None => continue,
                },
                Kind::Open | Kind::Close | Kind::Mark => continue,
            };
            let class = CLASSES.iter().position(|name| *name == class).unwrap_or(0) as u32;
            pieces.push((token.start, token.end, class, modifiers));
        }
        SemanticTokens { result_id: None, data: self.encoded(&pieces, range) }
    }

    /// The tokens relative to each other, line by line.
    fn encoded(&self, pieces: &[(usize, usize, u32, u32)], range: Option<Range>) -> Vec<SemanticToken> {
        let mut data = Vec::new();
        let mut last = gen_lsp_types::Position::new(0, 0);
        for (start, end, token_type, token_modifiers_bitset) in pieces {
            for line in self.text.line(*start)..=self.text.line(*end) {
                let from = self.text.line_start(line).max(*start);
                let to = self.text.line_end(line).min(*end);
                let at = self.text.range(from, to.max(from));
                let is_wanted = range.is_none_or(|range| range.start <= at.end && at.start <= range.end);
                if from >= to || !is_wanted {
                    continue;
                }
                let same_line = at.start.line == last.line;
                data.push(SemanticToken {
                    delta_line: at.start.line - last.line,
                    delta_start: at.start.character - if same_line { last.character } else { 0 },
                    length: at.end.character - at.start.character,
                    token_type: *token_type,
                    token_modifiers_bitset: *token_modifiers_bitset,
                });
                last = at.start;
            }
        }
        data
    }
}
