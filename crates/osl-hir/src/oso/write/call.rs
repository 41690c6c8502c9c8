//! Calls: functions are inlined, built-ins are operations with their name.

use super::place::Spot;
use super::stmt::ends;
use super::table::Sym;
use super::{Storage, Val, Writer};
use crate::builtins::{Compiled, LeftOut};
use crate::hir::{Arg, BuiltinCall, Expr, ExprKind, FunctionId, Init, Lvalue, OperationCall};
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
        self.returns.push(ret.clone().map(|ret| (ret, function.ret)));
        let name = self.table.text(function.name.clone());
        let op = self.emit("functioncall", &[name], "r");
        self.body(&function.body);
        self.part_ends(op);
        self.returns.pop();
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
        let mut access = String::new();
        for (index, (e, place)) in call.args.iter().zip(&call.outputs).enumerate() {
            let output = self.reads_output(call, index);
            args.push(match place {
                Some(place) => self.output(place, &mut spots),
                None => self.passed(e),
            });
            access.push(match (place.is_some(), output) {
                (true, _) | (false, Some(true)) => 'w',
                _ => 'r',
            });
        }
        self.span = span;
        let result = self.operation(call, ty, to, &args, &access);
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
            self.emit(call.name.to_string(), &args, &"r".repeat(args.len()));
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
        let access = format!("w{}", "r".repeat(all.len() - 1));
        self.emit(if closure { "closure".to_string() } else { call.name.to_string() }, &all, &access);
        Val::One(to)
    }

    /// Whether the table marks an argument as an output.
    fn reads_output(&self, call: &BuiltinCall, index: usize) -> Option<bool> {
        let signature = call.row.signatures().get(call.overload)?;
        signature.params.get(index).map(|p| p.output)
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

    /// The operation itself, or the few operations for a function that the format does not have.
    fn operation(
        &mut self,
        call: &BuiltinCall,
        ty: Type,
        to: Option<Sym>,
        args: &[Sym],
        access: &str,
    ) -> Option<Sym> {
        let (name, compiled) = (call.row.name, call.row.facts.compiled);
        if ty == Type::VOID {
            self.emit(name, args, access);
            return None;
        }
        // If there are several operations, the earlier ones must not write a variable that the later ones
        // read.
        let to = match to {
            Some(to) if !args.contains(&to) => to,
            _ => self.table.temp(ty),
        };
        if let Compiled::Composed(composed) = compiled
            && self.composed(composed, ty, to, args)
        {
            return Some(to);
        }
        let mut all = vec![to];
        let name = match compiled {
            _ if ty == Type::CLOSURE => {
                all.push(self.table.text(name.into()));
                "closure"
            }
            Compiled::Own | Compiled::Parts(_) | Compiled::Composed(_) => name,
            Compiled::As(other) => other,
            Compiled::ByResult(names) => {
                names.iter().find(|(of, _)| *of == ty).map_or(name, |(_, name)| name)
            }
        };
        let before = "r".repeat(all.len() - 1);
        let (mut args, mut access) = (args.to_vec(), access.to_string());
        for (at, sym) in self.left_out(call, &args) {
            args.insert(at.min(args.len()), sym);
            access.push('r');
        }
        all.extend_from_slice(&args);
        self.emit(name, &all, &format!("w{before}{access}"));
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
            ExprKind::Convert(inner) => vec![self.value(inner)],
            _ => return None,
        };
        let to = to.unwrap_or_else(|| self.table.temp(ty));
        self.emit_to(name, to, &[&[space][..], &parts].concat());
        Some(to)
    }
}
