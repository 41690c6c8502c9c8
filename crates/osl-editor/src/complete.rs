//! Completion: what can be written at a position.

use crate::hover::of_function;
use crate::page::{Page, World};
use crate::scan::{Kind, Token};
use crate::words::{COLORS, DIRECTIVES, METADATA, SPACES, TAKE_COLORS, TAKE_SPACES, TYPES, WIDGETS};
use gen_lsp_types::{
    CompletionItem, CompletionItemKind, Documentation, MarkupContent, MarkupKind, Position, TextEdit,
};
use osl::SymbolKind;
use osl::reference::{self, NOISE_FIELDS};
use std::collections::BTreeSet;

impl Page {
    /// The words that can be written at a position.
    pub fn completion(&self, position: Position, world: &dyn World) -> Vec<CompletionItem> {
        let offset = self.text.offset(position);
        let scan = self.scan();
        // The token in which the cursor is, or that ends there.
        let touched = scan.touching(offset).filter(|i| scan.get(*i).is_some_and(|t| t.start < offset));
        let token = touched.and_then(|i| scan.get(i));
        let written = token.is_some_and(|t| t.kind == Kind::Word);
        let before = if written { touched } else { Some(scan.before(offset)) };
        let before = before.and_then(|i| i.checked_sub(1));
        match token {
            Some(token) if is_inside(token, offset, self.token(token)) => match token.kind {
                Kind::Str => self.texts(token, touched, position, world),
                _ => Vec::new(),
            },
            Some(token) if token.kind == Kind::Number => Vec::new(),
            _ if self.word(before) == "." => {
                let members = before.map(|dot| self.members(dot)).unwrap_or_default();
                members
                    .into_iter()
                    .map(|(name, text)| item(&name, CompletionItemKind::Field, &text, ""))
                    .collect()
            }
            _ if before.and_then(|i| scan.get(i)).is_some_and(|t| t.kind == Kind::Hash) => {
                DIRECTIVES.iter().map(|word| item(word, CompletionItemKind::Keyword, "", "")).collect()
            }
            _ if self.in_metadata(offset) => self.metadata(before),
            _ => self.names(offset),
        }
    }

    /// Whether a byte is between `[[` and `]]`, outside of further brackets.
    fn in_metadata(&self, offset: usize) -> bool {
        let scan = self.scan();
        let mut around = scan.around(offset);
        let (Some(inner), Some(outer)) = (around.next(), around.next()) else { return false };
        self.word(Some(inner)) == "[" && self.word(Some(outer)) == "[" && inner == outer + 1
    }

    /// Types and names of metadata; after a type, the names that have it.
    fn metadata(&self, before: Option<usize>) -> Vec<CompletionItem> {
        let ty = self.word(before);
        if ty == "=" {
            return Vec::new();
        }
        let is_typed = TYPES.contains(&ty);
        let fits = |kind: &str| !is_typed || kind == ty || (kind == "float" && ty == "int");
        let entries = METADATA.iter().filter(|(_, kind, _)| fits(kind)).map(|(name, kind, about)| {
            let mut entry = item(name, CompletionItemKind::Property, &format!("{kind} {name}"), about);
            if !is_typed {
                entry.insert_text = Some(format!("{kind} {name} = "));
            }
            entry
        });
        entries.collect()
    }

    /// What can be written in the text in quotes that is the token with this index.
    fn texts(
        &self,
        token: &Token,
        index: Option<usize>,
        position: Position,
        world: &dyn World,
    ) -> Vec<CompletionItem> {
        let before = |n: usize| self.word(index.and_then(|i| i.checked_sub(n)));
        let constant = |name: &str, about: &str| item(name, CompletionItemKind::EnumMember, about, "");
        let mut list: Vec<CompletionItem> = Vec::new();
        if token.directive && before(1) == "include" {
            list.extend(
                world.headers(&self.name).iter().map(|name| item(name, CompletionItemKind::File, "", "")),
            );
        } else if before(1) == "=" && before(2) == "widget" {
            list.extend(WIDGETS.iter().map(|(name, about)| constant(name, about)));
        } else if let Some((name, argument)) = self.callee(token.start) {
            let name = self.word(Some(name));
            if argument == 0 && ["noise", "pnoise"].contains(&name) {
                list.extend(
                    NOISE_FIELDS
                        .iter()
                        .map(|(field, range, look)| constant(field, &format!("{range}; {look}"))),
                );
            } else if TAKE_SPACES.contains(&name) {
                let known = world.levels().known_spaces.iter().map(String::as_str);
                list.extend(SPACES.into_iter().chain(known).map(|space| constant(space, "space")));
            } else if TAKE_COLORS.contains(&name) {
                list.extend(COLORS.iter().map(|space| constant(space, "color space")));
            }
        }
        // Names with a dash or a dot are several words for an editor, so the replaced part is stated.
        let range = gen_lsp_types::Range::new(self.text.position(token.start + 1), position);
        for entry in &mut list {
            entry.text_edit = Some(TextEdit::new(range, entry.label.clone()).into());
        }
        list
    }

    /// The names in scope, the macros, and the words of the language.
    fn names(&self, offset: usize) -> Vec<CompletionItem> {
        let mut seen: BTreeSet<String> = BTreeSet::new();
        let mut list = Vec::new();
        let mut put = |entry: CompletionItem, list: &mut Vec<CompletionItem>| {
            if seen.insert(entry.label.clone()) {
                list.push(entry);
            }
        };
        // Of two variables with a name, the inner one is declared later.
        for symbol in self.symbols().list().iter().rev() {
            let kind = match symbol.kind {
                SymbolKind::Function => CompletionItemKind::Function,
                SymbolKind::Struct => CompletionItemKind::Struct,
                SymbolKind::Parameter | SymbolKind::Formal | SymbolKind::Local => {
                    CompletionItemKind::Variable
                }
                SymbolKind::Field | SymbolKind::Shader | SymbolKind::Global | SymbolKind::Builtin => continue,
            };
            if self.is_visible(symbol, offset) {
                put(item(&symbol.name, kind, &symbol.text, ""), &mut list);
            }
        }
        for found in self.macros() {
            put(item(&found.name, CompletionItemKind::Constant, &found.text, ""), &mut list);
        }
        for topic in reference::topics() {
            let kind = match topic.kind {
                "global" => CompletionItemKind::Variable,
                "type" => CompletionItemKind::Class,
                _ => CompletionItemKind::Keyword,
            };
            put(item(topic.name, kind, &topic.form, topic.about), &mut list);
        }
        for function in reference::functions().iter().filter(|function| !function.name.contains(' ')) {
            let form = function.signatures.first().map_or("", |signature| signature.text.as_str());
            put(
                item(function.name, CompletionItemKind::Function, form, &of_function(function, Some(""))),
                &mut list,
            );
        }
        list
    }
}

/// Whether a byte is within a comment or a text in quotes, rather than after it.
fn is_inside(token: &Token, offset: usize, text: &str) -> bool {
    match token.kind {
        Kind::Comment => offset < token.end || text.starts_with("//") || !text.ends_with("*/"),
        Kind::Str => offset < token.end || text.len() < 2 || !text.ends_with('"'),
        _ => false,
    }
}

fn item(label: &str, kind: CompletionItemKind, detail: &str, about: &str) -> CompletionItem {
    let about = MarkupContent::new(MarkupKind::Markdown, about.to_string());
    CompletionItem {
        label: label.to_string(),
        kind: Some(kind),
        detail: (!detail.is_empty()).then(|| detail.to_string()),
        documentation: (!about.value.is_empty()).then(|| Documentation::from(about)),
        ..CompletionItem::default()
    }
}
