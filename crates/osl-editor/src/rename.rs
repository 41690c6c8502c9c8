//! Renaming, which refuses what would change the meaning of the text.

use crate::page::{Page, World, lsp_range};
use crate::words::{KEYWORDS, TYPES};
use gen_lsp_types::{Position, Range, TextEdit, WorkspaceEdit};
use osl::{Analysis, Symbol, SymbolKind, reference};

impl Page {
    /// The name at a position that can be changed.
    ///
    /// # Errors
    /// It cannot be changed; the message says why.
    pub fn renamable(&self, position: Position) -> Result<(Range, String), String> {
        let (symbol, token) = self.symbol_at(position).ok_or("there is no name of this text here")?;
        self.places(symbol)?;
        Ok((self.text.range(token.start, token.end), symbol.name.clone()))
    }

    /// The places that a change of a symbol's name edits.
    fn places<'s>(&'s self, symbol: &'s Symbol) -> Result<Vec<&'s osl::Range>, String> {
        let name = &symbol.name;
        let mut places = Vec::new();
        for symbol in self.same(symbol) {
            let declared =
                symbol.declared.as_ref().ok_or_else(|| format!("`{name}` belongs to the language"))?;
            places.push(declared);
            places.extend(&symbol.uses);
        }
        if self.is_header() || places.iter().any(|range| !self.has(range)) {
            return Err(format!("`{name}` belongs to a header, which other shaders may include"));
        }
        let is_elsewhere =
            |range: &&&osl::Range| self.text.slice(range.start.offset, range.end.offset) != name.as_str();
        if let Some(range) = places.iter().find(is_elsewhere) {
            return Err(format!("the macro on line {} uses `{name}`", range.start.line));
        }
        places.sort_by_key(|range| range.start.offset);
        places.dedup();
        Ok(places)
    }

    /// The change of a name. The changed text is checked: it must have the same errors, and every name must
    /// stand for the same as before.
    ///
    /// # Errors
    /// The name cannot be changed in this way; the message says why.
    pub fn rename(&self, position: Position, new: &str, world: &dyn World) -> Result<WorkspaceEdit, String> {
        let (symbol, _) = self.symbol_at(position).ok_or("there is no name of this text here")?;
        let places = self.places(symbol)?;
        check_name(new)?;
        if self.macro_at(new, usize::MAX).is_some() {
            return Err(format!("`{new}` is a macro"));
        }
        if symbol.name == new {
            return Ok(WorkspaceEdit::default());
        }
        let mut text = String::new();
        let mut at = 0;
        for range in &places {
            text.push_str(self.text.slice(at, range.start.offset));
            text.push_str(new);
            at = range.end.offset;
        }
        text.push_str(self.text.slice(at, self.text.as_str().len()));
        let after = world.check(&self.name, &text);
        if bindings(&self.analysis, &self.name) != bindings(&after, &self.name) {
            return Err(format!(
                "another `{new}` would take the place of `{}`, or the other way round",
                symbol.name
            ));
        }
        let edit = |range: &&osl::Range| TextEdit::new(lsp_range(range), new.to_string());
        self.changes(places.iter().map(edit).collect(), world)
            .ok_or_else(|| "the text has no address".to_string())
    }
}

/// Checks that a word can be a name.
fn check_name(new: &str) -> Result<(), String> {
    let is_word = new.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && new.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !is_word {
        return Err(format!("`{new}` is not a name: names have letters, digits and underscores"));
    }
    let is_reserved = TYPES.contains(&new) || KEYWORDS.contains(&new) || reference::topic(new).is_some();
    if is_reserved || reference::elsewhere(new).is_some() || !reference::find(new).is_empty() {
        return Err(format!("`{new}` is a word of the language"));
    }
    Ok(())
}

/// What the names of a text stand for, each with its number in the text; and the codes of the errors. The
/// body of a macro may have several names at one place.
fn bindings(analysis: &Analysis, file: &str) -> (Vec<(usize, Binding)>, Vec<&'static str>) {
    let symbols = analysis.symbols();
    let own = |range: &osl::Range| (range.file == file).then_some(range.start.offset);
    let places = |symbol: &Symbol| -> Vec<usize> {
        symbol.declared.iter().chain(&symbol.uses).filter_map(own).collect()
    };
    let mut order: Vec<usize> = symbols.list().iter().flat_map(places).collect();
    order.sort_unstable();
    order.dedup();
    let number = |place: usize| order.partition_point(|other| *other < place);
    let mut bound = Vec::new();
    for symbol in symbols.list() {
        let binding = match symbol.declared.as_ref() {
            Some(range) if range.file == file => Binding::Own(symbol.kind, number(range.start.offset)),
            Some(range) => Binding::Header(range.file.clone(), range.start.offset),
            None => Binding::Language(symbol.name.clone()),
        };
        bound.extend(places(symbol).into_iter().map(|place| (number(place), binding.clone())));
    }
    bound.sort_unstable();
    let mut codes: Vec<&'static str> = analysis
        .diagnostics(&osl::Levels::default())
        .iter()
        .filter(|d| d.is_error())
        .map(|d| d.code)
        .collect();
    codes.sort_unstable();
    (bound, codes)
}

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    /// The declaration at the name with this number.
    Own(SymbolKind, usize),
    /// The declaration in a header.
    Header(String, usize),
    /// A word of the language.
    Language(String),
}
