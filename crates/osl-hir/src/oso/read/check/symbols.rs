//! Declarations: their order, names and values, and the sections that initialise parameters.

use super::super::file::{Class, Symbol, SymbolType};
use super::super::lex::{Kind, Token};
use super::{Checker, Rule};
use crate::oso::text::{self, MAIN};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;

impl Checker<'_, '_> {
    /// Parameters come first, each name is declared once, globals exist, and values suit their types.
    pub(super) fn symbols(&mut self) {
        let file = self.file;
        let (mut others, mut names) = (false, FxHashSet::default());
        for symbol in &file.symbols {
            let is_param = matches!(symbol.class, Class::Param | Class::Output);
            if is_param && others {
                let message = "a parameter follows a symbol of another kind";
                self.report(Rule::Symbol, symbol.span, symbol.name, message);
            }
            others |= !is_param;
            if !names.insert(symbol.name) {
                self.report(Rule::Symbol, symbol.span, symbol.name, "the name is declared twice");
            }
            if symbol.class == Class::Global && text::global(symbol.name).is_none() {
                self.report(Rule::Symbol, symbol.span, symbol.name, "there is no such global");
            }
            self.values(symbol);
        }
    }

    fn values(&mut self, symbol: &Symbol<'_>) {
        let SymbolType::Plain(ty) = symbol.ty else {
            if !symbol.values.is_empty() {
                self.report(Rule::Literal, symbol.span, symbol.name, "a struct has no values of its own");
            }
            return;
        };
        let most = match ty.extent {
            Extent::Array(n) => n as usize,
            Extent::One => 1,
            Extent::Unsized => usize::MAX,
        };
        if symbol.values.len() > most.saturating_mul(words(ty.base)) {
            self.report(Rule::Literal, symbol.span, symbol.name, "there are more values than the type has");
        }
        for value in &symbol.values {
            if !is_value(ty, value) {
                let message = "this is no literal of the symbol's type; infinity is written 1e39";
                self.report(Rule::Literal, value.span, symbol.name, message);
            }
        }
    }

    /// Each section names a parameter, the body is the last one, and `end` is its last operation.
    pub(super) fn sections(&mut self) {
        let file = self.file;
        let mut names = FxHashSet::default();
        for section in &file.sections {
            let param = self.symbol(section.name);
            let is_param = param.is_some_and(|s| matches!(s.class, Class::Param | Class::Output));
            if section.name != MAIN && !is_param {
                self.report(Rule::Section, section.span, section.name, "there is no such parameter");
            }
            if section.start == section.end {
                self.report(Rule::Section, section.span, section.name, "the section is empty");
            }
            if !names.insert(section.name) {
                self.report(Rule::Section, section.span, section.name, "there are two sections of this name");
            }
        }
        for symbol in file.symbols.iter().filter(|s| s.computed && !names.contains(s.name)) {
            self.report(Rule::Section, symbol.span, symbol.name, "no section computes the default");
        }
        let last = file.sections.last();
        if last.is_none_or(|section| section.name != MAIN) {
            let span = last.map_or(Span::default(), |section| section.span);
            self.report(Rule::Section, span, MAIN, "the last section is not the shader's body");
        }
        if file.ops.last().is_none_or(|op| op.name != "end") {
            let span = file.ops.last().or(None).map_or(Span::default(), |op| op.span);
            self.report(Rule::File, span, "end", "`end` is not the last operation");
        }
        for op in file.ops.iter().rev().skip(1).filter(|op| op.name == "end") {
            self.report(Rule::File, op.span, "end", "operations follow `end`");
        }
    }
}

/// Number of values of one element.
fn words(base: Base) -> usize {
    match base {
        Base::Matrix => 16,
        Base::Closure => 0,
        base if base.is_triple() => 3,
        _ => 1,
    }
}

/// Whether a value is a literal of the format for this type. Ints stand for floats too.
fn is_value(ty: Type, value: &Token<'_>) -> bool {
    let word = match value.kind {
        Kind::Text(_) => return ty.base == Base::String,
        Kind::Word(word) => word,
        Kind::Hint(..) | Kind::Comma => return false,
    };
    let digits = word.strip_prefix(['-', '+']).unwrap_or(word);
    let is_int = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    match ty.base {
        Base::Int => is_int,
        Base::String | Base::Closure => false,
        _ => {
            let plain =
                word.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'E' | b'+' | b'-'));
            is_int || (plain && word.parse::<f32>().is_ok())
        }
    }
}
