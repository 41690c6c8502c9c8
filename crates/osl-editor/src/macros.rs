//! Macros: where they are defined, and what their calls expand to.

use crate::page::{Page, World};
use crate::scan::{Kind, Scan};

/// The definition of a macro.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Definition {
    /// The name of the macro.
    pub(crate) name: String,
    /// The file.
    pub(crate) file: String,
    /// The bytes of the name in it.
    pub(crate) at: (usize, usize),
    /// The directive, with the lines that continue it.
    pub(crate) text: String,
}

/// Separates the text before a macro call from what the call expands to.
const MARK: &str = "__osl_editor_expansion__";

/// Maximum length of a shown expansion, in characters.
const MOST_SHOWN: usize = 2000;

impl Page {
    /// The definitions of macros in the text and its headers, in the order of the files.
    pub(crate) fn macros(&self) -> Vec<Definition> {
        let mut list = Vec::new();
        for (file, text) in self.analysis.files() {
            // Most headers of the compiler are long, and few define macros.
            if !text.contains("define") {
                continue;
            }
            let scan = Scan::of(text);
            let word = |i: usize| scan.get(i).and_then(|t| text.get(t.start..t.end)).unwrap_or_default();
            for (i, hash) in scan.tokens.iter().enumerate().filter(|(_, token)| token.kind == Kind::Hash) {
                if word(i + 1) != "define" {
                    continue;
                }
                let Some(name) = scan.get(i + 2).filter(|token| token.kind == Kind::Word) else { continue };
                let is_end =
                    |(j, t): &(usize, &crate::scan::Token)| *j > i && (!t.directive || t.kind == Kind::Hash);
                let end =
                    scan.tokens.iter().enumerate().skip(i).find(is_end).map_or(scan.tokens.len(), |(j, _)| j);
                let end = scan.get(end - 1).map_or(name.end, |token| token.end);
                list.push(Definition {
                    name: word(i + 2).to_string(),
                    file: file.to_string(),
                    at: (name.start, name.end),
                    text: text.get(hash.start..end).unwrap_or_default().to_string(),
                });
            }
        }
        list
    }

    /// The definition of a macro that counts at a byte: the last one before it in the text, else one of a
    /// header, else the first one.
    pub(crate) fn macro_at(&self, name: &str, offset: usize) -> Option<Definition> {
        let all: Vec<Definition> = self.macros().into_iter().filter(|m| m.name == name).collect();
        let before = all.iter().rfind(|m| m.file == self.name && m.at.0 <= offset);
        let of_header = || all.iter().rfind(|m| m.file != self.name);
        before.or_else(of_header).or_else(|| all.first()).cloned()
    }

    /// What a macro expands to where the token with an index names it: the preprocessor reads the text before
    /// it, a mark, and the call.
    pub(crate) fn expansion(&self, index: usize, world: &dyn World) -> Option<String> {
        let scan = self.scan();
        let token = scan.get(index).filter(|token| !token.directive)?;
        let open = scan.get(index + 1).filter(|t| t.kind == Kind::Open && self.token(t) == "(");
        let end = open.and_then(|open| Some(scan.get(open.partner?)?.end)).unwrap_or(token.end);
        let (before, call) = (self.text.slice(0, token.start), self.text.slice(token.start, end));
        let text = world.expanded(&self.name, &format!("{before}\n{MARK}\n{call}\n"));
        let (_, expanded) = text.split_once(MARK)?;
        let expanded = expanded.split_whitespace().collect::<Vec<_>>().join(" ");
        Some(expanded.chars().take(MOST_SHOWN).collect()).filter(|text: &String| text != call)
    }
}
