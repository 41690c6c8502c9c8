//! The symbols of a source and the types of its expressions, for editors.
//!
//! It holds what resolution learned, also about sources with errors: whatever could be bound is there, and
//! the rest is missing.

use crate::builtins::Signature;
use crate::hir::{VarId, VarKind};
use osl_ir::types::{Base, Struct, StructId, StructTable, Type};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The kind of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SymbolKind {
    /// The shader itself.
    Shader,
    /// A struct.
    Struct,
    /// A field of a struct.
    Field,
    /// A function of the file. A prototype is a symbol of its own.
    Function,
    /// A parameter of the shader.
    Parameter,
    /// A parameter of a function.
    Formal,
    /// A local variable.
    Local,
    /// A shader global, such as `P`.
    Global,
    /// A function of the language.
    Builtin,
}

/// A name with everything that is known about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Its name.
    pub name: Arc<str>,
    /// Its kind.
    pub kind: SymbolKind,
    /// The type of a variable, field or struct; of a function, the type that it returns. [`Type::VOID`] for
    /// the shader, [`Type::ERROR`] if the declaration has an error.
    pub ty: Type,
    /// The declaration on one line, without values: `float f(color, output int)`, `vector v`, `struct slot`.
    pub text: String,
    /// The name in the declaration; `None` for globals and built-in functions.
    pub declared: Option<Span>,
    /// The name where it is used, in order of position. A use within a macro has the location of the macro.
    pub uses: Vec<Span>,
}

/// The symbols of a source, and the types of its expressions.
///
/// Positions are global byte offsets, as in all spans; those of the main file are offsets into its text.
#[derive(Clone, Debug, Default)]
pub struct Symbols {
    list: Vec<Symbol>,
    /// The location and type of each expression.
    types: Vec<(Span, Type)>,
    /// The names of called built-in functions, with the chosen signatures, in order of position.
    forms: Vec<(Span, &'static str, &'static Signature)>,
    structs: StructTable,
}

impl Symbols {
    /// All symbols: declared ones in order of their declarations, then used globals and built-in functions.
    pub fn list(&self) -> &[Symbol] {
        &self.list
    }

    /// The symbol whose name is declared or used at a position.
    pub fn at(&self, position: u32) -> Option<&Symbol> {
        self.list
            .iter()
            .find(|symbol| symbol.declared.iter().chain(&symbol.uses).any(|s| holds(*s, position)))
    }

    /// The type of the innermost expression at a position, or of the variable or field that is declared
    /// there; `None` if there is none or its type is not known.
    pub fn type_at(&self, position: u32) -> Option<Type> {
        use SymbolKind::{Field, Formal, Global, Local, Parameter};
        let named =
            self.at(position).filter(|s| matches!(s.kind, Field | Formal | Global | Local | Parameter));
        let around = self.types.iter().filter(|(span, _)| holds(*span, position));
        let innermost = || around.min_by_key(|(span, _)| span.end - span.start).map(|(_, ty)| *ty);
        named.map(|symbol| symbol.ty).or_else(innermost).filter(|ty| !ty.is_error())
    }

    /// The signature that was chosen for the built-in function whose name is at a position, with the names of
    /// its parameters.
    pub fn signature_at(&self, position: u32) -> Option<String> {
        let before = self.forms.partition_point(|(span, ..)| span.start <= position);
        let form = before.checked_sub(1).and_then(|at| self.forms.get(at));
        form.filter(|(span, ..)| holds(*span, position)).map(|(_, name, signature)| signature.show(name))
    }

    /// A type as written in the language.
    pub fn show(&self, ty: Type) -> String {
        self.structs.show(ty)
    }
}

fn holds(span: Span, position: u32) -> bool {
    span.start <= position && position < span.end
}

/// What a symbol is known by while symbols are collected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Key {
    Var(VarId),
    Struct(StructId),
    Field(StructId, usize),
    /// A function, by the location of its name.
    Function(Span),
    Builtin(&'static str),
}

/// Collects symbols during resolution.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    list: Vec<Symbol>,
    by_key: FxHashMap<Key, usize>,
    types: Vec<(Span, Type)>,
    forms: Vec<(Span, &'static str, &'static Signature)>,
}

impl Recorder {
    fn add(&mut self, key: Option<Key>, name: &Arc<str>, kind: SymbolKind, ty: Type, declared: Span) {
        if let Some(key) = key {
            self.by_key.insert(key, self.list.len());
        }
        let declared = Some(declared).filter(|span| *span != Span::default());
        let symbol = Symbol { name: name.clone(), kind, ty, text: String::new(), declared, uses: Vec::new() };
        self.list.push(symbol);
    }

    fn used(&mut self, key: Key, at: Span) {
        if let Some(symbol) = self.by_key.get(&key).and_then(|index| self.list.get_mut(*index)) {
            symbol.uses.push(at);
        }
    }

    /// A variable is declared.
    pub(crate) fn variable(&mut self, id: VarId, name: &Arc<str>, ty: Type, kind: VarKind, span: Span) {
        let kind = match kind {
            VarKind::Global(_) => SymbolKind::Global,
            VarKind::Param { .. } => SymbolKind::Parameter,
            VarKind::Formal { .. } => SymbolKind::Formal,
            VarKind::Local => SymbolKind::Local,
        };
        self.add(Some(Key::Var(id)), name, kind, ty, span);
    }

    /// A struct is declared, with the locations of its fields' names.
    pub(crate) fn structure(&mut self, id: StructId, decl: &Struct, fields: &[Span]) {
        self.add(
            Some(Key::Struct(id)),
            &decl.name,
            SymbolKind::Struct,
            Type::one(Base::Struct(id)),
            decl.span,
        );
        for (index, (field, span)) in decl.fields.iter().zip(fields).enumerate() {
            self.add(Some(Key::Field(id, index)), &field.name, SymbolKind::Field, field.ty, *span);
        }
    }

    /// A function is declared.
    pub(crate) fn function(
        &mut self,
        name: &Arc<str>,
        ret: Type,
        formals: &[(Type, bool)],
        span: Span,
        structs: &StructTable,
    ) {
        self.add(Some(Key::Function(span)), name, SymbolKind::Function, ret, span);
        if let Some(symbol) = self.list.last_mut() {
            let formal = |(ty, output): &(Type, bool)| {
                format!("{}{}", if *output { "output " } else { "" }, structs.show(*ty))
            };
            let formals: Vec<String> = formals.iter().map(formal).collect();
            symbol.text = format!("{} {name}({})", structs.show(ret), formals.join(", "));
        }
    }

    /// The shader is declared.
    pub(crate) fn shader(&mut self, name: &Arc<str>, span: Span) {
        self.add(None, name, SymbolKind::Shader, Type::VOID, span);
    }

    /// A variable is used.
    pub(crate) fn use_variable(&mut self, id: VarId, at: Span) {
        self.used(Key::Var(id), at);
    }

    /// A struct is used as a type or called as a constructor.
    pub(crate) fn use_struct(&mut self, id: StructId, at: Span) {
        self.used(Key::Struct(id), at);
    }

    /// A field is used.
    pub(crate) fn use_field(&mut self, id: StructId, index: usize, at: Span) {
        self.used(Key::Field(id, index), at);
    }

    /// A function of the file is called; `declared` is the location of its name.
    pub(crate) fn use_function(&mut self, declared: Span, at: Span) {
        self.used(Key::Function(declared), at);
    }

    /// A built-in function is called.
    pub(crate) fn use_builtin(&mut self, name: &'static str, signature: &'static Signature, at: Span) {
        self.forms.push((at, name, signature));
        if !self.by_key.contains_key(&Key::Builtin(name)) {
            self.add(
                Some(Key::Builtin(name)),
                &name.into(),
                SymbolKind::Builtin,
                signature.ret,
                Span::default(),
            );
            if let Some(symbol) = self.list.last_mut() {
                symbol.text = signature.show(name);
            }
        }
        self.used(Key::Builtin(name), at);
    }

    /// An expression has a type.
    pub(crate) fn expression(&mut self, span: Span, ty: Type) {
        self.types.push((span, ty));
    }

    /// The symbols that were collected.
    pub(crate) fn finish(self, structs: StructTable) -> Symbols {
        let Recorder { mut list, types, mut forms, .. } = self;
        forms.sort_by_key(|(span, ..)| span.start);
        list.retain(|symbol| symbol.declared.is_some() || !symbol.uses.is_empty());
        list.sort_by_key(|symbol| {
            (symbol.declared.is_none(), symbol.declared, symbol.kind, symbol.name.clone())
        });
        for symbol in &mut list {
            // A place is resolved twice where its value is also read.
            symbol.uses.sort_unstable();
            symbol.uses.dedup();
            if symbol.text.is_empty() {
                symbol.text = match symbol.kind {
                    SymbolKind::Shader => format!("shader {}", symbol.name),
                    SymbolKind::Struct => format!("struct {}", symbol.name),
                    _ => format!("{} {}", structs.show(symbol.ty), symbol.name),
                };
            }
        }
        Symbols { list, types, forms, structs }
    }
}
