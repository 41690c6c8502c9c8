//! Parameters: symbols with constant defaults, and code for the other defaults.

use super::constant::{constant, zero};
use super::place::is_pure;
use super::table::{Class, Sym, Value};
use super::{Leaf, Storage, Writer};
use crate::hir::{Expr, ExprKind, Init, Lvalue, MetaValue, Param, Step};
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

    /// The default: values of the symbols, or for each of them a section of code with its name. In run times,
    /// a section sets no other parameter.
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
            (Storage::Struct(_), Init::Value(e)) => match self.fields(e) {
                Some(list) => self.default(storage, ty, &list),
                None => self.repeated(storage, ty, init),
            },
            (Storage::Leaf(Leaf::Symbol(sym)), init) if self.constants(*sym, ty, init) => {}
            _ => {
                self.empty(storage, ty);
                self.section(storage);
                self.store_init(storage, ty, init);
            }
        }
    }

    /// Starts the section of a symbol.
    fn section(&mut self, storage: &Storage) {
        let Some(Leaf::Symbol(sym)) = storage.first() else { return };
        if let Some(symbol) = self.table.get_mut(sym) {
            symbol.computed = true;
            self.sections.push((symbol.name.clone(), self.ops.len()));
        }
    }

    /// The values of a struct's fields, if they can be computed one by one.
    fn fields(&self, e: &Expr) -> Option<Init> {
        match &e.kind {
            ExprKind::Struct(list) => Some(Init::List(list.clone())),
            ExprKind::Read(place) if is_pure(e) => {
                let fields = &self.program.structs.get(e.ty.as_struct()?).fields;
                let field = |(at, field): (usize, &osl_ir::types::Field)| {
                    let mut place = Lvalue { ty: field.ty, ..place.clone() };
                    place.path.push(Step::Field(at as u32));
                    Init::Value(Expr { ty: field.ty, kind: ExprKind::Read(place), span: e.span })
                };
                Some(Init::List(fields.iter().enumerate().map(field).collect()))
            }
            _ => None,
        }
    }

    /// The sections of a struct's fields, each with the whole computation. Only the first one prints.
    fn repeated(&mut self, storage: &Storage, ty: Type, init: &Init) {
        self.empty(storage, ty);
        for (at, part) in storage.leaves().into_iter().map(Storage::Leaf).enumerate() {
            if self.is_full() {
                return;
            }
            self.section(&part);
            self.quiet = at > 0;
            let whole = self.allocate_temp(ty);
            self.store_init(&whole, ty, init);
            if let Some(value) = whole.leaves().into_iter().map(Storage::Leaf).nth(at) {
                self.copy(&part, None, &value, None);
            }
        }
        self.quiet = false;
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
