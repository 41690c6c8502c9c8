//! The symbols and operations of a compiled shader that is being written.

use crate::hir::{GLOBALS, MetaValue};
use crate::oso::operations::{Operand, Usage};
use crate::oso::text;
use osl_ir::types::{Base, Type};
use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};
use std::borrow::Cow;
use std::sync::Arc;

/// Index of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Sym(pub(super) u32);

/// The class of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Param { output: bool },
    Global,
    Local,
    Temp,
    Const,
}

/// A value as the table writes it.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Int(i32),
    Float(f32),
    Text(Arc<str>),
}

/// A symbol.
#[derive(Debug)]
pub(super) struct Symbol {
    pub(super) class: Class,
    pub(super) ty: Type,
    pub(super) name: String,
    pub(super) values: Vec<Value>,
    pub(super) metadata: Vec<(String, Arc<str>, MetaValue)>,
    /// An array with the length of its value.
    pub(super) open: bool,
    /// Whether code computes its default.
    pub(super) computed: bool,
    /// The struct that contains it as a field, and the field's index.
    pub(super) parent: Option<(String, usize)>,
    pub(super) derivs: bool,
}

/// An operation.
#[derive(Debug)]
pub(super) struct Op {
    pub(super) name: Cow<'static, str>,
    pub(super) args: Vec<Sym>,
    /// How it uses its arguments.
    pub(super) usage: Usage,
    /// The operations at which its parts end.
    pub(super) jumps: Vec<usize>,
    pub(super) span: Span,
}

/// A constant by its bits.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Int(i32),
    Floats(Base, Vec<u32>),
    Text(Arc<str>),
}

/// All symbols, in the order in which they were added.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub(super) symbols: Vec<Symbol>,
    constants: FxHashMap<Key, Sym>,
    globals: FxHashMap<usize, Sym>,
    names: FxHashSet<String>,
    /// Bytes of the names of all symbols.
    pub(super) name_bytes: u64,
    n_constants: usize,
    n_temps: usize,
    n_scopes: usize,
}

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("constant")
    }
}

impl Table {
    pub(super) fn new() -> Table {
        let names = GLOBALS.iter().map(|(_, name, ..)| (*name).to_string()).collect();
        Table { names, ..Table::default() }
    }

    pub(super) fn get(&self, sym: Sym) -> Option<&Symbol> {
        self.symbols.get(sym.0 as usize)
    }

    pub(super) fn get_mut(&mut self, sym: Sym) -> Option<&mut Symbol> {
        self.symbols.get_mut(sym.0 as usize)
    }

    pub(super) fn ty(&self, sym: Sym) -> Type {
        self.get(sym).map_or(Type::ERROR, |s| s.ty)
    }

    /// A symbol as the table of operations sees it.
    pub(super) fn operand(&self, sym: Sym) -> Operand<'_> {
        let constant = self.get(sym).filter(|symbol| symbol.class == Class::Const);
        let text = constant.and_then(|symbol| match symbol.values.first() {
            Some(Value::Text(text)) => Some(&**text),
            _ => None,
        });
        let ty = self.ty(sym);
        Operand { ty: Some(ty), array: ty.is_array(), constant: constant.is_some(), text }
    }

    /// Whether later operations may change it: not for a constant or the result of one expression.
    pub(super) fn is_variable(&self, sym: Sym) -> bool {
        self.get(sym).is_some_and(|s| !matches!(s.class, Class::Const | Class::Temp))
    }

    /// Adds a symbol with an unused name.
    pub(super) fn add(&mut self, class: Class, ty: Type, name: String) -> Sym {
        self.names.insert(name.clone());
        self.name_bytes += name.len() as u64;
        self.symbols.push(Symbol {
            class,
            ty,
            name,
            values: Vec::new(),
            metadata: Vec::new(),
            open: false,
            computed: false,
            parent: None,
            derivs: false,
        });
        Sym(self.symbols.len() as u32 - 1)
    }

    /// An unused name for a variable of the source: its own, or with the number of a scope in front.
    pub(super) fn local_name(&mut self, name: &str) -> String {
        let taken = |t: &Table, name: &str| {
            t.names.contains(name) || t.names.contains(name.split('.').next().unwrap_or(name))
        };
        if text::plain_name(name) == name && !name.starts_with('$') && !taken(self, name) {
            self.names.insert(name.to_string());
            return name.to_string();
        }
        loop {
            self.n_scopes += 1;
            let scoped = format!("___{}_{name}", self.n_scopes);
            if !taken(self, &scoped) {
                self.names.insert(scoped.clone());
                return scoped;
            }
        }
    }

    pub(super) fn temp_name(&mut self) -> String {
        self.n_temps = self.unused("$tmp", self.n_temps);
        format!("$tmp{}", self.n_temps)
    }

    /// The next number with which a prefix makes an unused name: a compiled shader may have parameters with
    /// such names.
    fn unused(&self, prefix: &str, last: usize) -> usize {
        let mut number = last + 1;
        while self.names.contains(&format!("{prefix}{number}")) {
            number += 1;
        }
        number
    }

    pub(super) fn temp(&mut self, ty: Type) -> Sym {
        let name = self.temp_name();
        self.add(Class::Temp, ty, name)
    }

    /// The symbol of a global, by index.
    pub(super) fn global(&mut self, index: usize) -> Sym {
        if let Some(sym) = self.globals.get(&index) {
            return *sym;
        }
        let (name, ty) = GLOBALS.get(index).map_or(("", Type::ERROR), |(_, name, ty, _)| (*name, *ty));
        let sym = self.add(Class::Global, ty, name.to_string());
        self.globals.insert(index, sym);
        sym
    }

    /// The symbol of a constant.
    pub(super) fn constant(&mut self, ty: Type, values: Vec<Value>) -> Sym {
        let key = match values.first() {
            Some(Value::Int(n)) => Key::Int(*n),
            Some(Value::Text(text)) => Key::Text(text.clone()),
            _ => {
                let bits = |v: &Value| if let Value::Float(x) = v { x.to_bits() } else { 0 };
                Key::Floats(ty.base, values.iter().map(bits).collect())
            }
        };
        if let Some(sym) = self.constants.get(&key) {
            return *sym;
        }
        self.n_constants = self.unused("$const", self.n_constants);
        let sym = self.add(Class::Const, ty, format!("$const{}", self.n_constants));
        if let Some(symbol) = self.get_mut(sym) {
            symbol.values = values;
        }
        self.constants.insert(key, sym);
        sym
    }

    pub(super) fn int(&mut self, n: i32) -> Sym {
        self.constant(Type::INT, vec![Value::Int(n)])
    }

    /// The value of an int constant.
    pub(super) fn int_value(&self, sym: Sym) -> Option<i32> {
        let symbol = self.get(sym).filter(|symbol| symbol.class == Class::Const)?;
        match symbol.values.first() {
            Some(Value::Int(n)) => Some(*n),
            _ => None,
        }
    }

    pub(super) fn float(&mut self, x: f32) -> Sym {
        self.constant(Type::FLOAT, vec![Value::Float(x)])
    }

    pub(super) fn text(&mut self, text: Arc<str>) -> Sym {
        self.constant(Type::STRING, vec![Value::Text(text)])
    }
}
