//! What a name means, and the type of an expression.

use crate::page::{Page, World};
use crate::scan::{Kind, Token};
use gen_lsp_types::{Contents, Hover, MarkupContent, MarkupKind, Position};
use osl::reference::{self, Function};
use osl::{Symbol, SymbolKind, lessons};

impl Page {
    /// The description of what is at a position, with the lessons of the diagnostics there.
    pub fn hover(&self, position: Position, world: &dyn World) -> Option<Hover> {
        let offset = self.text.offset(position);
        let index = self.scan().touching(offset)?;
        let token = self.scan().get(index)?;
        let mut parts: Vec<String> = self.described(index, token, world).into_iter().collect();
        let holds = |range: &osl::Range| {
            self.has(range)
                && range.start.offset <= offset
                && offset < range.end.offset.max(range.start.offset + 1)
        };
        let here = self.found(world.levels()).iter().filter(|d| d.range.as_ref().is_some_and(holds));
        for found in here {
            let lesson = lessons::find(found.code).into_iter().find(|lesson| lesson.code == found.code);
            let text =
                lesson.map(|lesson| format!("**{}: {}**\n\n{}", lesson.code, lesson.title, lesson.rule));
            parts.extend(text.filter(|text| !parts.contains(text)));
        }
        if parts.is_empty() {
            return None;
        }
        let contents = MarkupContent::new(MarkupKind::Markdown, parts.join("\n\n---\n\n"));
        Some(Hover {
            contents: Contents::from(contents),
            range: Some(self.text.range(token.start, token.end)),
        })
    }

    /// The description of a token.
    fn described(&self, index: usize, token: &Token, world: &dyn World) -> Option<String> {
        let typed = || self.symbols().type_at(token.start).map(|ty| code(&ty));
        let word = self.token(token);
        match token.kind {
            Kind::Comment | Kind::Hash => None,
            Kind::Str => {
                let inner = word.trim_matches('"');
                let field = || reference::NOISE_FIELDS.iter().find(|(name, ..)| *name == inner);
                let is_noise = self.callee(token.start).is_some_and(|(name, at)| {
                    at == 0 && ["noise", "pnoise"].contains(&self.word(Some(name)))
                });
                field()
                    .filter(|_| is_noise)
                    .map(|(name, range, look)| format!("noise `{name}`: {range}; {look}"))
                    .or_else(typed)
            }
            Kind::Word => {
                if let Some(symbol) = self.symbol_of(token.start).filter(|symbol| symbol.name == word) {
                    return Some(self.of_symbol(symbol, token));
                }
                if let Some(found) = self.macro_at(word, token.start) {
                    let expansion =
                        self.expansion(index, world).map(|text| format!("\n\nexpands to\n{}", code(&text)));
                    return Some(format!("{}{}", code(&found.text), expansion.unwrap_or_default()));
                }
                if token.directive {
                    return None;
                }
                // A word of the language, but not the name of a member.
                if index.checked_sub(1).is_some_and(|before| self.word(Some(before)) == ".") {
                    return typed();
                }
                let topic =
                    reference::topic(word).map(|topic| format!("{}\n{}", code(&topic.form), topic.about));
                let function = || reference::find(word).first().map(|function| of_function(function, None));
                topic.or_else(function).or_else(typed)
            }
            Kind::Number | Kind::Open | Kind::Close | Kind::Mark => typed(),
        }
    }

    fn of_symbol(&self, symbol: &Symbol, token: &Token) -> String {
        match symbol.kind {
            SymbolKind::Builtin => {
                let chosen = self.symbols().signature_at(token.start);
                let found = reference::find(&symbol.name);
                match found.iter().find(|function| function.name == symbol.name) {
                    Some(function) => of_function(function, chosen.as_deref()),
                    None => code(&symbol.text),
                }
            }
            SymbolKind::Global => match reference::topic(&symbol.name) {
                Some(topic) => format!("{}\n{}", code(&topic.form), topic.about),
                None => code(&symbol.text),
            },
            SymbolKind::Function | SymbolKind::Shader => {
                let header = self.header(symbol).map_or_else(|| symbol.text.clone(), |(text, _)| text);
                self.with_comment(&header, symbol)
            }
            _ => {
                let what = match symbol.kind {
                    SymbolKind::Parameter => " // parameter of the shader",
                    SymbolKind::Formal => " // parameter",
                    SymbolKind::Field => " // field",
                    _ => "",
                };
                self.with_comment(&format!("{}{what}", symbol.text), symbol)
            }
        }
    }

    fn with_comment(&self, declaration: &str, symbol: &Symbol) -> String {
        let comment = self.comment(symbol).unwrap_or_default();
        format!("{}\n{comment}", code(declaration)).trim_end().to_string()
    }
}

/// A built-in function: the chosen signature, or all of them, the meaning and the derivative.
pub(crate) fn of_function(function: &Function, chosen: Option<&str>) -> String {
    let all: Vec<&str> = function.signatures.iter().map(|s| s.text.as_str()).collect();
    let (shown, more) = match chosen {
        Some(chosen) => (chosen.to_string(), all.len().saturating_sub(1)),
        None => (all.join("\n"), 0),
    };
    let mut text = if shown.is_empty() { String::new() } else { format!("{}\n", code(&shown)) };
    if more > 0 {
        text.push_str(&format!("(and {more} other form{})\n\n", if more == 1 { "" } else { "s" }));
    }
    text.push_str(function.about);
    for (what, fact) in [("Derivative", function.derivatives), ("At the edges", function.extremes)] {
        if !fact.is_empty() {
            text.push_str(&format!("\n\n{what}: {fact}"));
        }
    }
    text
}

/// A block of source text.
pub(crate) fn code(text: &str) -> String {
    format!("```osl\n{text}\n```")
}
