//! The table of symbols: variables, structs composed of their fields, constants, defaults of parameters.

use super::file::{Class, Section, Symbol, SymbolType};
use super::lex::{Kind, Token};
use super::{Builder, Result};
use crate::hir::{Expr, ExprKind, GLOBALS, Init, Lvalue, Param, Step, Stmt, StmtKind, Var, VarId, VarKind};
use crate::oso::{errors, text};
use osl_ir::types::{Base, Extent, Field, Struct, Type};
use osl_limits::Reading;
use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// The meaning of a name.
#[derive(Clone, Debug)]
pub(super) enum Meaning {
    /// A variable, or a field of one.
    Lvalue { var: VarId, path: Vec<u32>, ty: Type },
    /// A constant.
    Literal(Type, ExprKind),
    /// A local struct: only its fields are variables.
    Struct,
    /// A constant array, or a constant with parts that operations name: a variable that is set before it is
    /// used.
    Table { var: VarId, init: Init },
}

/// All names.
#[derive(Debug, Default)]
pub(super) struct Symbols<'a> {
    meanings: FxHashMap<&'a str, Meaning>,
    /// Constant arrays used by the current section.
    tables: Vec<(VarId, Init)>,
    used: FxHashSet<VarId>,
    /// Elements of constant arrays in all sections so far.
    elements: u64,
    /// The lengths of arrays of structs.
    lengths: FxHashMap<&'a str, i32>,
    /// Constants whose parts are read or written.
    divided: FxHashSet<&'a str>,
    /// A parameter whose default is being computed, and the variable that stands for it meanwhile.
    stands_for: Option<(VarId, VarId)>,
}

impl Symbols<'_> {
    /// The answer to a question about a struct: the length of an array of structs, or whether a local one is
    /// connected.
    pub(super) fn about_struct(&self, question: &str, name: &str) -> Option<i32> {
        match question {
            "arraylength" => self.lengths.get(name).copied(),
            "isconnected" => matches!(self.meanings.get(name), Some(Meaning::Struct)).then_some(0),
            _ => None,
        }
    }

    /// Counts elements of arrays that are written one by one.
    pub(super) fn charge(&mut self, elements: u64, limits: &Reading, at: Span) -> Result<()> {
        self.elements = self.elements.saturating_add(elements);
        if self.elements > limits.oso_elements {
            return Err(errors::too_large(at, "the constant and copied arrays of all parts are too large"));
        }
        Ok(())
    }
}

/// A parameter before its default is known.
#[derive(Debug)]
pub(super) struct Declared {
    /// Index of its symbol.
    symbol: usize,
    param: Param,
}

/// The variables of the shader globals, which come first in every program.
pub(super) fn globals() -> Vec<Var> {
    let var = |(global, name, ty, _): &(_, &str, Type, bool)| Var {
        name: (*name).into(),
        ty: *ty,
        kind: VarKind::Global(*global),
        span: Span::default(),
    };
    GLOBALS.iter().map(var).collect()
}

impl<'a> Builder<'_, 'a> {
    /// Makes variables of all symbols. Returns the parameters in order, without their defaults.
    pub(super) fn declare(&mut self) -> Result<Vec<Declared>> {
        let file = self.file;
        let mut fields: FxHashMap<&'a str, Vec<usize>> = FxHashMap::default();
        for (index, symbol) in file.symbols.iter().enumerate() {
            if let Some((parent, _)) = symbol.parent {
                fields.entry(parent).or_default().push(index);
            }
        }
        #[expect(clippy::iter_over_hash_type, reason = "each list is sorted by itself")]
        for list in fields.values_mut() {
            list.sort_by_key(|index| file.symbols.get(*index).and_then(|s| s.parent).map_or(0, |(_, at)| at));
        }
        self.symbols.divided = file.ops.iter().filter_map(super::ops::divided).collect();
        let mut params = Vec::new();
        let mut seen = FxHashSet::default();
        for (index, symbol) in file.symbols.iter().enumerate() {
            if !seen.insert(symbol.name) {
                return Err(errors::symbol(symbol.span, format!("`{}` is declared twice", symbol.name)));
            }
            if let SymbolType::Struct(name) = symbol.ty
                && let Some((_, length)) = name.split_once('[')
                && let Ok(length) = length.trim_end_matches(']').parse()
            {
                self.symbols.lengths.insert(symbol.name, length);
            }
            match (symbol.class, symbol.ty) {
                (Class::Global, SymbolType::Plain(_)) => self.global(symbol)?,
                (Class::Const, SymbolType::Plain(ty)) => self.constant(symbol, ty)?,
                (Class::Local, SymbolType::Plain(ty)) => self.local(symbol, ty)?,
                (Class::Local, SymbolType::Struct(_)) => {
                    self.symbols.meanings.insert(symbol.name, Meaning::Struct);
                }
                (Class::Param | Class::Output, ty) => {
                    let of_struct = symbol.parent.is_some_and(|(parent, _)| {
                        symbol.name.strip_prefix(parent).is_some_and(|rest| rest.starts_with('.'))
                    });
                    if !of_struct {
                        params.push(self.param(index, symbol, ty, &fields, params.len())?);
                    }
                }
                (_, SymbolType::Struct(_)) => {
                    return Err(errors::symbol(symbol.span, "a struct is a parameter or a local variable"));
                }
            }
        }
        Ok(params)
    }

    fn var(&mut self, name: &str, ty: Type, kind: VarKind, span: Span) -> VarId {
        let id = VarId(self.vars.len() as u32);
        self.vars.push(Var { name: name.into(), ty, kind, span });
        id
    }

    fn global(&mut self, symbol: &Symbol<'a>) -> Result<()> {
        let Some(index) = text::global(symbol.name) else {
            return Err(errors::symbol(symbol.span, format!("there is no global `{}`", symbol.name)));
        };
        let ty = GLOBALS.get(index).map_or(Type::ERROR, |(_, _, ty, _)| *ty);
        let place = Meaning::Lvalue { var: VarId(index as u32), path: Vec::new(), ty };
        self.symbols.meanings.insert(symbol.name, place);
        Ok(())
    }

    fn local(&mut self, symbol: &Symbol<'a>, ty: Type) -> Result<()> {
        if ty.extent == Extent::Unsized {
            return Err(errors::symbol(symbol.span, "only parameters are arrays without a length"));
        }
        let var = self.var(text::plain_name(symbol.name), ty, VarKind::Local, symbol.span);
        self.symbols.meanings.insert(symbol.name, Meaning::Lvalue { var, path: Vec::new(), ty });
        Ok(())
    }

    fn constant(&mut self, symbol: &Symbol<'a>, ty: Type) -> Result<()> {
        let ty = sized(ty, &symbol.values);
        let init = literal(ty, &symbol.values, symbol.span)?;
        let meaning = match init {
            Init::Value(value) if !self.symbols.divided.contains(symbol.name) => {
                Meaning::Literal(ty, value.kind)
            }
            init => {
                let var = self.var(symbol.name, ty, VarKind::Local, symbol.span);
                Meaning::Table { var, init }
            }
        };
        self.symbols.meanings.insert(symbol.name, meaning);
        Ok(())
    }

    fn param(
        &mut self,
        index: usize,
        symbol: &Symbol<'a>,
        ty: SymbolType<'a>,
        fields: &FxHashMap<&'a str, Vec<usize>>,
        count: usize,
    ) -> Result<Declared> {
        let open = matches!(ty, SymbolType::Plain(Type { extent: Extent::Unsized, .. }));
        let (ty, init) = match ty {
            SymbolType::Plain(ty) => {
                let ty = sized(ty, &symbol.values);
                (ty, literal(ty, &symbol.values, symbol.span)?)
            }
            SymbolType::Struct(name) => self.structure(name, symbol, fields, 0)?,
        };
        let output = symbol.class == Class::Output;
        let var = self.var(symbol.name, ty, VarKind::Param { index: count as u32, output }, symbol.span);
        self.bind(symbol.name, var, Vec::new(), ty, fields);
        let param = Param { var, output, open, init, metadata: symbol.metadata.clone() };
        Ok(Declared { symbol: index, param })
    }

    /// Declares the struct made by a symbol's fields. Returns its type and default.
    fn structure(
        &mut self,
        name: &str,
        symbol: &Symbol<'a>,
        fields: &FxHashMap<&'a str, Vec<usize>>,
        depth: u64,
    ) -> Result<(Type, Init)> {
        let deepest = self.limits.oso_structs;
        if depth >= deepest {
            let message = format!("structs within structs, more than {deepest} deep");
            return Err(errors::too_large(symbol.span, message));
        }
        let file = self.file;
        let (mut list, mut inits) = (Vec::new(), Vec::new());
        for field in fields.get(symbol.name).into_iter().flatten().filter_map(|i| file.symbols.get(*i)) {
            let rest = field.name.strip_prefix(symbol.name).and_then(|rest| rest.strip_prefix('.'));
            let (Some(short), true) = (rest, field.class == symbol.class) else {
                let message = format!("`{}` is no field of `{}`", field.name, symbol.name);
                return Err(errors::symbol(field.span, message));
            };
            let (ty, init) = match field.ty {
                SymbolType::Plain(ty) => {
                    let ty = sized(ty, &field.values);
                    (ty, literal(ty, &field.values, field.span)?)
                }
                SymbolType::Struct(inner) => self.structure(inner, field, fields, depth + 1)?,
            };
            list.push(Field { name: short.into(), ty });
            inits.push(init);
        }
        if let Some(known) = self.structs.find(name) {
            let same = |a: &Field, b: &Field| a.name == b.name && a.ty == b.ty;
            let old = &self.structs.get(known).fields;
            if old.len() == list.len() && old.iter().zip(&list).all(|(a, b)| same(a, b)) {
                return Ok((Type::one(Base::Struct(known)), Init::List(inits)));
            }
        }
        let id = self.structs.add(Struct { name: name.into(), fields: list, span: symbol.span });
        Ok((Type::one(Base::Struct(id)), Init::List(inits)))
    }

    /// Binds a name, and the names of its fields, to a variable and its parts.
    fn bind(
        &mut self,
        name: &'a str,
        var: VarId,
        path: Vec<u32>,
        ty: Type,
        fields: &FxHashMap<&'a str, Vec<usize>>,
    ) {
        let file = self.file;
        if let Some(id) = ty.as_struct() {
            let types: Vec<Type> = self.structs.get(id).fields.iter().map(|f| f.ty).collect();
            let parts = fields.get(name).into_iter().flatten().filter_map(|i| file.symbols.get(*i));
            for (at, (field, ty)) in parts.zip(types).enumerate() {
                let mut path = path.clone();
                path.push(at as u32);
                self.bind(field.name, var, path, ty, fields);
            }
        }
        self.symbols.meanings.insert(name, Meaning::Lvalue { var, path, ty });
    }

    /// Gives the parameters their defaults: from the table, or computed by code.
    pub(super) fn defaults(&mut self, declared: Vec<Declared>) -> Result<Vec<Param>> {
        let file = self.file;
        let mut sections: FxHashMap<&'a str, Vec<&Section<'a>>> = FxHashMap::default();
        for section in file.sections.iter().filter(|s| s.name != text::MAIN) {
            let whole = section.name.split('.').next().unwrap_or(section.name);
            if !matches!(self.symbols.meanings.get(section.name), Some(Meaning::Lvalue { .. })) {
                let message = format!("there is no parameter `{}`", section.name);
                return Err(errors::symbol(section.span, message));
            }
            sections.entry(whole).or_default().push(section);
        }
        let mut params = Vec::new();
        for Declared { symbol, mut param } in declared {
            let symbol = file.symbols.get(symbol);
            if let Some(list) = symbol.and_then(|s| sections.get(s.name)) {
                param.init = self.computed(&param, list)?;
            }
            params.push(param);
        }
        Ok(params)
    }

    /// A default computed by code, as the call of a function that returns it.
    fn computed(&mut self, param: &Param, sections: &[&Section<'a>]) -> Result<Init> {
        let Some(var) = self.vars.get(param.var.0 as usize).cloned() else {
            return Ok(Init::List(Vec::new()));
        };
        let own = self.var(&var.name, var.ty, VarKind::Local, var.span);
        let start = Stmt { kind: StmtKind::Declare(own, Some(param.init.clone())), span: var.span };
        let mut body = vec![start];
        self.symbols.stands_for = Some((param.var, own));
        for section in sections {
            body.extend(self.section(section)?);
        }
        self.symbols.stands_for = None;
        let place = Lvalue { var: own, path: Vec::new(), ty: var.ty, span: var.span };
        let value = Expr { ty: var.ty, kind: ExprKind::Read(place), span: var.span };
        body.push(Stmt { kind: StmtKind::Return(Some(Init::Value(value))), span: var.span });
        Ok(Init::Value(self.call_of(var.name, body, var.ty, var.span)))
    }

    /// The statements of a section, preceded by the assignments of constant arrays.
    pub(super) fn section(&mut self, section: &Section<'a>) -> Result<Vec<Stmt>> {
        // A new set each time, because clearing one takes time proportional to its largest size, and there
        // may be many sections.
        self.symbols.tables = Vec::new();
        self.symbols.used = FxHashSet::default();
        let body = self.block(section.start..section.end, super::flow::Around::default())?;
        let set = |(var, init)| Stmt { kind: StmtKind::Declare(var, Some(init)), span: section.span };
        let mut all: Vec<Stmt> = self.symbols.tables.drain(..).map(set).collect();
        all.extend(body);
        Ok(all)
    }

    /// The place of a name, with a span.
    pub(super) fn place(&mut self, (name, at): (&str, Span), span: Span) -> Result<Lvalue> {
        match self.operand((name, at), span)?.kind {
            ExprKind::Read(place) => Ok(place),
            _ => Err(errors::operation(at, format!("`{name}` is a constant and cannot be written"))),
        }
    }

    /// The value of a name, with a span.
    pub(super) fn operand(&mut self, (name, at): (&str, Span), span: Span) -> Result<Expr> {
        let Some(meaning) = self.symbols.meanings.get(name) else {
            return Err(errors::symbol(at, format!("`{name}` is not declared")));
        };
        let (var, path, ty) = match meaning {
            Meaning::Struct => {
                let message = format!("`{name}` is a struct, and operations take its fields");
                return Err(errors::operation(at, message));
            }
            Meaning::Literal(ty, kind) => return Ok(Expr { ty: *ty, kind: kind.clone(), span }),
            Meaning::Lvalue { var, path, ty } => (*var, path.clone(), *ty),
            Meaning::Table { var, init } => {
                let var = *var;
                if self.symbols.used.insert(var) {
                    let elements = if let Init::List(list) = init { list.len() as u64 } else { 1 };
                    self.symbols.tables.push((var, init.clone()));
                    self.symbols.charge(elements, &self.limits, at)?;
                }
                (var, Vec::new(), self.vars.get(var.0 as usize).map_or(Type::ERROR, |v| v.ty))
            }
        };
        let var = match self.symbols.stands_for {
            Some((param, own)) if param == var => own,
            _ => var,
        };
        let path = path.into_iter().map(Step::Field).collect();
        Ok(Expr { ty, kind: ExprKind::Read(Lvalue { var, path, ty, span }), span })
    }
}

/// An array without a length has the length of its values.
fn sized(ty: Type, values: &[Token<'_>]) -> Type {
    match ty.extent {
        Extent::Unsized => {
            let length = (values.len() / words(ty.base)).max(1);
            Type { extent: Extent::Array(length as u32), ..ty }
        }
        _ => ty,
    }
}

/// Number of numbers or strings for one element.
fn words(base: Base) -> usize {
    match base {
        Base::Matrix => 16,
        base if base.is_triple() => 3,
        _ => 1,
    }
}

/// The value of a symbol in the table; missing parts are zero, empty or null.
fn literal(ty: Type, values: &[Token<'_>], span: Span) -> Result<Init> {
    let each = words(ty.base);
    let count = match ty.extent {
        Extent::Array(n) => n as usize,
        _ => 1,
    };
    if values.len() > each * count {
        let message = format!("{} values for the {} of the symbol", values.len(), each * count);
        return Err(errors::symbol(span, message));
    }
    if ty.is_array() {
        let elements = values.chunks(each).map(|chunk| element(ty.base, chunk, span).map(Init::Value));
        return Ok(Init::List(elements.collect::<Result<_>>()?));
    }
    Ok(Init::Value(element(ty.base, values, span)?))
}

fn element(base: Base, values: &[Token<'_>], span: Span) -> Result<Expr> {
    let of = |ty, kind| Expr { ty, kind, span };
    Ok(match base {
        Base::Int => {
            let value: i64 = values.first().map_or(Ok(0), parsed)?;
            of(Type::INT, ExprKind::Int(value.clamp(i32::MIN.into(), i32::MAX.into()) as i32))
        }
        Base::Float => float(values.first(), span)?,
        Base::String => {
            let text: Arc<str> = match values.first().map(|t| t.kind) {
                Some(Kind::Text(inside)) => text::unescape(inside),
                None => "".into(),
                Some(_) => return Err(errors::symbol(span, "a string stands in quotes")),
            };
            of(Type::STRING, ExprKind::Str(text))
        }
        Base::Matrix => {
            let cells = (0..16).map(|at| float(values.get(at), span)).collect::<Result<_>>()?;
            of(Type::MATRIX, ExprKind::Matrix(cells))
        }
        Base::Closure => of(Type::CLOSURE, ExprKind::NullClosure),
        base => {
            let [x, y, z] = [0, 1, 2].map(|at| float(values.get(at), span));
            of(Type::one(base), ExprKind::Triple(Box::new([x?, y?, z?])))
        }
    })
}

fn float(token: Option<&Token<'_>>, span: Span) -> Result<Expr> {
    let value: f32 = token.map_or(Ok(0.0), parsed)?;
    Ok(Expr { ty: Type::FLOAT, kind: ExprKind::Float(value), span })
}

fn parsed<T: std::str::FromStr>(token: &Token<'_>) -> Result<T> {
    let number = token.word().and_then(|word| word.parse().ok());
    number.ok_or_else(|| errors::symbol(token.span, "this is no number of the symbol's type"))
}
