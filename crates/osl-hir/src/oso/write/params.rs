//! Parameters: symbols with constant defaults, and code for the other defaults.

use super::constant::{constant, zero};
use super::place::Spot;
use super::table::{Class, Sym, Value};
use super::{Leaf, Storage, Writer};
use crate::hir::{Init, MetaValue, Param};
use osl_ir::types::{Base, Extent, Type};
use std::sync::Arc;

/// A symbol before it is added.
struct Named {
    name: String,
    parent: Option<(String, usize)>,
    metadata: Vec<(String, Arc<str>, MetaValue)>,
}

impl Writer<'_> {
    /// Writes the symbols of all parameters, and the code of their defaults.
    pub(super) fn params(&mut self) {
        let program = self.program;
        let mut storages = Vec::new();
        for param in &program.shader.params {
            let Some(var) = program.vars.get(param.var.0 as usize) else { continue };
            let class = Class::Param { output: param.output };
            let named = Named { name: var.name.to_string(), parent: None, metadata: param.metadata.clone() };
            storages.push((param, var, self.declare(class, var.ty, named, param)));
        }
        for (param, var, storage) in storages {
            self.span = var.span;
            self.default(&storage, var.ty, &param.init);
            self.bind(param.var, storage);
        }
    }

    /// The symbols of a parameter; those of a struct's fields follow its own.
    fn declare(&mut self, class: Class, ty: Type, named: Named, param: &Param) -> Storage {
        let Named { name, parent, metadata } = named;
        let sym = self.table.add(class, ty, name.clone());
        if let Some(symbol) = self.table.get_mut(sym) {
            symbol.parent = parent;
            symbol.metadata = metadata;
            symbol.open = param.open;
        }
        let Some(id) = ty.as_struct() else { return Storage::Leaf(Leaf::Symbol(sym)) };
        let fields = self.program.structs.get(id).fields.clone();
        let field = |(at, field): (usize, &osl_ir::types::Field)| {
            let named = Named {
                name: format!("{name}.{}", field.name),
                parent: Some((name.clone(), at)),
                metadata: Vec::new(),
            };
            self.declare(class, field.ty, named, &Param { open: false, ..param.clone() })
        };
        Storage::Struct(fields.iter().enumerate().map(field).collect())
    }

    /// The default: values of the symbols, or a section of code named after the first symbol that it sets.
    fn default(&mut self, storage: &Storage, ty: Type, init: &Init) {
        match (storage, init) {
            (Storage::Struct(parts), Init::List(items)) => {
                let Base::Struct(id) = ty.base else { return };
                let fields = self.program.structs.get(id).fields.clone();
                for (at, (part, field)) in parts.iter().zip(&fields).enumerate() {
                    match items.get(at) {
                        Some(item) => self.default(part, field.ty, item),
                        None => self.empty(part, field.ty),
                    }
                }
            }
            (Storage::Leaf(Leaf::Symbol(sym)), init) if self.constants(*sym, ty, init) => {}
            _ => {
                self.empty(storage, ty);
                let Some(Leaf::Symbol(first)) = storage.first() else { return };
                if let Some(symbol) = self.table.get_mut(first) {
                    symbol.computed = true;
                    let name = symbol.name.clone();
                    self.sections.push((name, self.ops.len()));
                }
                match init {
                    Init::Value(_) => self.store_init(storage, ty, init),
                    Init::List(items) => {
                        let items = items.clone();
                        let spot = Spot::whole(storage.clone());
                        self.store_init(&spot.storage, ty, &Init::List(items));
                    }
                }
            }
        }
    }

    /// Zero, as the table writes it.
    fn empty(&mut self, storage: &Storage, ty: Type) {
        match (storage, ty.base) {
            (Storage::Struct(parts), Base::Struct(id)) => {
                let fields = self.program.structs.get(id).fields.clone();
                for (part, field) in parts.iter().zip(&fields) {
                    self.empty(part, field.ty);
                }
            }
            (Storage::Leaf(Leaf::Symbol(sym)), _) => {
                self.constants(*sym, ty, &Init::List(Vec::new()));
            }
            _ => {}
        }
    }

    /// Gives a symbol its constant value, with missing elements zero; `false` if it is not a constant.
    fn constants(&mut self, sym: Sym, ty: Type, init: &Init) -> bool {
        let values: Option<Vec<Value>> = match (init, ty.extent) {
            (Init::Value(e), Extent::One) if ty == Type::CLOSURE => {
                matches!(e.kind, crate::hir::ExprKind::NullClosure).then(Vec::new)
            }
            (Init::Value(e), Extent::One) => constant(e),
            (Init::List(items), Extent::Array(n)) => elements(items, ty.base, n as usize),
            (Init::List(_), _) => Some(zero(ty.base)),
            _ => None,
        };
        match (values, self.table.get_mut(sym)) {
            (Some(values), Some(symbol)) => {
                symbol.values = values;
                true
            }
            _ => false,
        }
    }
}

fn elements(items: &[Init], base: Base, length: usize) -> Option<Vec<Value>> {
    let mut all = Vec::new();
    for item in items.iter().take(length) {
        match item {
            Init::Value(e) if base == Base::Closure => {
                matches!(e.kind, crate::hir::ExprKind::NullClosure).then_some(())?;
            }
            Init::Value(e) => all.extend(constant(e)?),
            Init::List(_) => return None,
        }
    }
    for _ in items.len()..length {
        all.extend(zero(base));
    }
    Some(all)
}
