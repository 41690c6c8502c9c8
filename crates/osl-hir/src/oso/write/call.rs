//! Calls: functions are inlined; built-ins are operations with their name, or functions of the library.

use super::place::Spot;
use super::stmt::ends;
use super::table::Sym;
use super::{Storage, Val, Writer};
use crate::builtins::{Compiled, LeftOut, ParamType};
use crate::hir::{Arg, BuiltinCall, Expr, ExprKind, Function, FunctionId, Init, Lvalue, OperationCall};
use crate::oso::operations::{Usage, is_float_option};
use osl_ir::types::{Extent, Type};

impl Writer<'_> {
    /// Inlines a function at its call.
    pub(super) fn call(&mut self, id: FunctionId, args: &[Arg]) -> Val {
        let program = self.program;
        let Some(function) = program.functions.get(id.0 as usize) else { return Val::Void };
        let span = self.span;
        if self.returns.len() as u64 > self.limits.call_depth {
            self.full.get_or_insert(span);
        }
        if self.is_full() {
            return Val::Void;
        }
        let mut bound = Vec::new();
        let mut back: Vec<(Spot, Storage)> = Vec::new();
        for (arg, formal) in args.iter().zip(&function.formals) {
            let Some(var) = program.vars.get(formal.0 as usize) else { continue };
            let storage = match arg {
                Arg::Alias(place) => self.spot(place, false).map(|spot| spot.storage),
                Arg::Copy { value, back: None } => Some(self.argument(var.ty, &var.name, value)),
                Arg::Copy { back: Some(place), .. } => {
                    let spot = self.spot(place, true);
                    let storage = self.allocate(var.ty, &var.name);
                    if let Some(spot) = spot {
                        let value = self.read(&spot);
                        self.write(&Spot::whole(storage.clone()), value);
                        back.push((spot, storage.clone()));
                    }
                    Some(storage)
                }
            };
            bound.push((*formal, storage));
        }
        for (formal, storage) in bound {
            if let Some(storage) = storage {
                self.bind(formal, storage);
            }
        }
        let ret = (function.ret != Type::VOID).then(|| self.allocate_temp(function.ret));
        if let Some(ret) = ret.as_ref().filter(|_| !ends(&function.body)) {
            self.store_zero(ret);
        }
        self.inline(function, &function.name, ret.clone());
        self.span = span;
        for (spot, storage) in back {
            let value = self.read(&Spot::whole(storage));
            self.write(&spot, value);
        }
        match ret {
            Some(ret) => self.read(&Spot::whole(ret)),
            None => Val::Void,
        }
    }

    /// Writes the body of a function whose formals are bound.
    pub(super) fn inline(&mut self, function: &Function, name: &str, ret: Option<Storage>) {
        self.returns.push(ret.map(|ret| (ret, function.ret)));
        let name = self.table.text(name.into());
        let op = self.emit("functioncall", &[name]);
        self.body(&function.body);
        self.part_ends(op);
        self.returns.pop();
    }

    /// Storage for an argument that is copied in. An expression that is an array is stored in a variable; the
    /// formal is an alias for that, whatever its length.
    fn argument(&mut self, ty: Type, name: &str, value: &Init) -> Storage {
        if let Init::Value(e) = value
            && ty.is_array()
            && let Val::Stored(storage, None) = self.eval(e)
        {
            return storage;
        }
        let ty = match value {
            Init::List(items) if ty.extent == Extent::Unsized => {
                Type { extent: Extent::Array(items.len().max(1) as u32), ..ty }
            }
            _ => ty,
        };
        let storage = self.allocate(ty, name);
        self.store_init(&storage, ty, value);
        storage
    }

    /// A built-in function; its result goes to a given symbol or a new one.
    pub(super) fn builtin(&mut self, call: &BuiltinCall, ty: Type, to: Option<Sym>) -> Val {
        let span = self.span;
        if let Some(made) = self.in_space(call, ty, to) {
            return Val::One(made);
        }
        let mut spots: Vec<(Spot, Sym)> = Vec::new();
        let mut args = Vec::new();
        let params = call.row.signatures().get(call.overload).map_or(&[][..], |s| &s.params);
        for (index, (e, place)) in call.args.iter().zip(&call.outputs).enumerate() {
            let param = params.get(index);
            let option = index.checked_sub(1).and_then(|name| call.args.get(name));
            args.push(match place {
                Some(place) => self.output(place, &mut spots),
                // A result that nothing receives.
                None if param.is_some_and(|param| param.output) => self.written(e),
                None => match (param.map(|param| param.ty), option.map(|name| &name.kind)) {
                    (Some(ParamType::Of(ty)), _) if ty.is_array() && !e.ty.is_array() => self.array_of(e),
                    (None, Some(ExprKind::Str(name))) if call.row.output_option(name).is_some() => {
                        self.written(e)
                    }
                    (None, Some(ExprKind::Str(name))) if is_float_option(call.row.name, name) => {
                        let value = self.passed(e);
                        self.float(value)
                    }
                    _ => self.passed(e),
                },
            });
        }
        self.span = span;
        let result = self.operation(call, ty, to, &args);
        for (spot, temp) in spots {
            self.write(&spot, Val::One(temp));
        }
        result.map_or(Val::Void, Val::One)
    }

    /// An operation of the renderer, by its name; its result goes to a given symbol or a new one.
    pub(super) fn renderers(&mut self, call: &OperationCall, ty: Type, to: Option<Sym>) -> Val {
        let span = self.span;
        let args: Vec<Sym> = call.args.iter().map(|e| self.passed(e)).collect();
        self.span = span;
        if ty == Type::VOID {
            let access = vec![b'r'; args.len()];
            self.push(call.name.to_string(), &args, Usage { access, derivatives: Vec::new() });
            return Val::Void;
        }
        let to = match to {
            Some(to) if !args.contains(&to) => to,
            _ => self.table.temp(ty),
        };
        let closure = ty == Type::CLOSURE;
        let mut all = vec![to];
        if closure {
            all.push(self.table.text(call.name.clone()));
        }
        all.extend_from_slice(&args);
        let usage = Usage::of_result(all.len());
        self.push(if closure { "closure".to_string() } else { call.name.to_string() }, &all, usage);
        Val::One(to)
    }

    /// An operand that the operation writes, although no place of the program receives it.
    fn written(&mut self, e: &Expr) -> Sym {
        let value = self.passed(e);
        let ty = self.table.ty(value);
        if ty.is_array() { value } else { self.emit_value("assign", ty, &[value]) }
    }

    /// A single value where the operation takes an array.
    fn array_of(&mut self, e: &Expr) -> Sym {
        let value = self.passed(e);
        let ty = Type { extent: Extent::Array(1), ..self.table.ty(value) };
        let storage = self.allocate_temp(ty);
        let Some(array) = self.leaf(&storage) else { return value };
        let first = self.table.int(0);
        self.emit_to("aassign", array, &[first, value]);
        array
    }

    /// A number as a float, which run times take for an int in few operations.
    fn float(&mut self, value: Sym) -> Sym {
        match (self.table.ty(value), self.table.int_value(value)) {
            (Type::INT, Some(n)) => self.table.float(n as f32),
            (Type::INT, None) => self.emit_value("assign", Type::FLOAT, &[value]),
            _ => value,
        }
    }

    /// An argument that is only read. Arrays are passed directly. A struct, or an array of structs, is
    /// represented by its first part, because functions that take any type only use the number of elements
    /// and the connection.
    fn passed(&mut self, e: &Expr) -> Sym {
        if !e.ty.is_array() && e.ty.as_struct().is_none() {
            return self.operand(e);
        }
        match self.eval(e) {
            Val::Stored(storage, None) => self.first(&storage),
            val => self.one(val),
        }
    }

    fn first(&mut self, storage: &Storage) -> Sym {
        match storage {
            Storage::Struct(parts) => match parts.first() {
                Some(part) => self.first(part),
                None => self.table.int(0),
            },
            _ => self.leaf(storage).unwrap_or_else(|| self.table.int(0)),
        }
    }

    /// An output argument: the variable, or a temporary that is stored to a part of one after the call.
    fn output(&mut self, place: &Lvalue, spots: &mut Vec<(Spot, Sym)>) -> Sym {
        let Some(spot) = self.spot(place, true) else { return self.table.int(0) };
        let value = self.read(&spot);
        let value = self.one(value);
        if !spot.is_plain() {
            spots.push((spot, value));
        }
        value
    }

    /// The operation itself, or the body of a function of the library.
    fn operation(&mut self, call: &BuiltinCall, ty: Type, to: Option<Sym>, args: &[Sym]) -> Option<Sym> {
        let (name, compiled) = (call.row.name, call.row.facts.compiled);
        if ty == Type::VOID {
            let again = self.quiet && call.row.facts.format.is_some();
            if !again && !self.library(call, None, args) {
                self.emit(name, args);
            }
            return None;
        }
        // If there are several operations, the earlier ones must not write a variable that the later ones
        // read.
        let to = match to {
            Some(to) if !args.contains(&to) => to,
            _ => self.table.temp(ty),
        };
        if self.library(call, Some(to), args) {
            return Some(to);
        }
        let mut all = vec![to];
        let name = match compiled {
            _ if ty == Type::CLOSURE => {
                all.push(self.table.text(name.into()));
                "closure"
            }
            Compiled::Own | Compiled::Parts(_) => name,
            Compiled::As(other) => other,
            Compiled::ByResult(names) => {
                names.iter().find(|(of, _)| *of == ty).map_or(name, |(_, name)| name)
            }
        };
        let mut args = args.to_vec();
        for (at, sym) in self.left_out(call, &args) {
            args.insert(at.min(args.len()), sym);
        }
        all.extend_from_slice(&args);
        self.emit(name, &all);
        Some(to)
    }

    /// What a short form of a closure leaves out, and where it stands: the operation has only the long form.
    fn left_out(&mut self, call: &BuiltinCall, args: &[Sym]) -> Vec<(usize, Sym)> {
        let formals = call.row.signatures().get(call.overload).map_or(0, |s| s.params.len());
        let (short, left_out) = call.row.facts.left_out;
        if formals != short {
            return Vec::new();
        }
        let value = |(at, what): &(usize, LeftOut)| {
            let zero = || super::table::Value::Float(0.0);
            let sym = match what {
                LeftOut::Zero => Some(self.table.float(0.0)),
                LeftOut::ZeroVector => Some(self.table.constant(Type::VECTOR, vec![zero(), zero(), zero()])),
                LeftOut::Same(other) => args.get(*other).copied(),
            };
            sym.map(|sym| (*at, sym))
        };
        left_out.iter().filter_map(value).collect()
    }

    /// A constructor with a space: the parts of the value are its arguments.
    fn in_space(&mut self, call: &BuiltinCall, ty: Type, to: Option<Sym>) -> Option<Sym> {
        let (Compiled::Parts(name), [space, value]) = (call.row.facts.compiled, call.args.as_slice()) else {
            return None;
        };
        let space = self.operand(space);
        let parts = match &value.kind {
            ExprKind::Triple(parts) => parts.iter().map(|p| self.operand(p)).collect(),
            ExprKind::Matrix(cells) => self.cells(cells),
            ExprKind::Convert(inner) => {
                let value = self.value(inner);
                let value = self.float(value);
                match (self.table.ty(value).is_triple(), ty) {
                    (true, _) => [0, 1, 2].map(|at| self.component(value, at)).into(),
                    (false, Type::MATRIX) => vec![value],
                    (false, _) => vec![value; 3],
                }
            }
            _ => return None,
        };
        let to = to.unwrap_or_else(|| self.table.temp(ty));
        self.emit_to(name, to, &[&[space][..], &parts].concat());
        Some(to)
    }

    fn component(&mut self, of: Sym, at: i32) -> Sym {
        let at = self.table.int(at);
        self.emit_value("compref", Type::FLOAT, &[of, at])
    }
}
