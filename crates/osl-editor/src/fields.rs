//! The members of the variable before a dot.

use crate::page::Page;
use osl::{Symbol, SymbolKind, reference};

/// The components of triples that can be named.
const COMPONENTS: [(&str, &[&str]); 4] = [
    ("color", &["r", "g", "b"]),
    ("point", &["x", "y", "z"]),
    ("vector", &["x", "y", "z"]),
    ("normal", &["x", "y", "z"]),
];

impl Page {
    /// Names and declarations of the members that can follow the dot with an index. The names before it are
    /// looked up one after another, since the text around a dot is often no sentence yet.
    pub(crate) fn members(&self, dot: usize) -> Vec<(String, String)> {
        let Some(ty) = self.type_before(dot, 0) else { return Vec::new() };
        if let Some((_, names)) = COMPONENTS.iter().find(|(name, _)| *name == ty) {
            return names.iter().map(|name| ((*name).to_string(), format!("float {name}"))).collect();
        }
        self.fields(&ty).map(|field| (field.name.clone(), field.text.clone())).collect()
    }

    /// The fields of a struct, which follow it in the list of symbols.
    fn fields(&self, name: &str) -> impl Iterator<Item = &Symbol> {
        let list = self.symbols().list();
        let found = list.iter().position(|s| s.kind == SymbolKind::Struct && s.name == name);
        let after = found.map_or(&[][..], |at| list.get(at + 1..).unwrap_or_default());
        after.iter().take_while(|symbol| symbol.kind == SymbolKind::Field)
    }

    /// The type of what ends before a dot, without its array. `depth` bounds the recursion.
    fn type_before(&self, dot: usize, depth: usize) -> Option<String> {
        const DEEPEST: usize = 32;
        let scan = self.scan();
        let mut at = dot.checked_sub(1).filter(|_| depth < DEEPEST)?;
        while self.word(Some(at)) == "]" {
            at = scan.get(at)?.partner?.checked_sub(1)?;
        }
        let name = self.word(Some(at));
        let declared = if at.checked_sub(1).is_some_and(|before| self.word(Some(before)) == ".") {
            let outer = self.type_before(at - 1, depth + 1)?;
            self.fields(&outer).find(|field| field.name == name)?.text.clone()
        } else {
            let start = scan.get(at)?.start;
            let visible = |s: &&Symbol| s.name == name && is_variable(s.kind) && self.is_visible(s, start);
            let found = self.symbols().list().iter().rfind(visible).map(|symbol| symbol.text.clone());
            // A global that the text does not use otherwise is no symbol of it.
            found.or_else(|| reference::topic(name).filter(|t| t.kind == "global").map(|t| t.form))?
        };
        // `slot[4] name` or `struct slot name`.
        let (ty, _) = declared.rsplit_once(' ')?;
        let ty = ty.split('[').next().unwrap_or(ty);
        Some(ty.rsplit(' ').next().unwrap_or(ty).to_string())
    }
}

/// Whether it has a value.
pub(crate) fn is_variable(kind: SymbolKind) -> bool {
    use SymbolKind::{Formal, Global, Local, Parameter};
    matches!(kind, Formal | Global | Local | Parameter)
}
