//! Calls: user functions are inlined, built-ins are written by their row of the table.

use super::expr::Operand;
use super::flow::RETURNED;
use super::place::Spot;
use super::{Frame, Lowerer, NO_OPERATION, Storage, Val};
use osl_hir::builtins::{self, Array, Emit, Emitted, Param, ParamType, Signature, Site, Tail};
use osl_hir::hir::{Arg, BuiltinCall, Expr, ExprKind, FunctionId, Init, Lvalue, OperationCall, VarKind};
use osl_ir::ir::{Note, ValueId};
use osl_ir::types::{Extent, Type};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use std::sync::Arc;

impl Lowerer<'_> {
    /// Inlines a call.
    pub(super) fn call(&mut self, id: FunctionId, args: &[Arg], span: Span) -> Val {
        let program = self.program;
        let Some(function) = program.functions.get(id.0 as usize) else { return Val::Void };
        // Functions cannot recurse, so this only limits the length of a chain of calls.
        let deepest = self.b.limits.call_depth;
        if self.frames.len() as u64 > deepest {
            self.at(span);
            self.too_large(&format!("a chain of more than {deepest} calls"));
        }
        if !self.has_room() {
            return Val::Void;
        }
        self.aim(None);
        let mut bound = Vec::new();
        let mut back: Vec<(Spot, Storage)> = Vec::new();
        for (arg, formal) in args.iter().zip(&function.formals) {
            let var = &program.vars[formal.0 as usize];
            let storage = match arg {
                Arg::Alias(place) => self.spot(place).map(|spot| spot.storage().clone()),
                Arg::Copy { value, back: None } => Some(self.argument(var.ty, &var.name, value)),
                Arg::Copy { back: Some(place), .. } => {
                    let spot = self.spot(place);
                    // An array within an element of another is copied whatever its length.
                    let ty = if var.ty.is_array() { place.ty } else { var.ty };
                    let storage = self.allocate(ty, &var.name);
                    self.silence(&storage);
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
        let mut formals = Vec::new();
        for (formal, storage) in bound {
            if let Some(storage) = storage {
                formals.push((formal, storage.clone()));
                self.bind(formal, storage);
            }
        }
        let ret = (function.ret != Type::VOID).then(|| self.allocate(function.ret, &function.name));
        if let Some(ret) = &ret {
            self.store_zero(ret);
        }
        let returned = self.flag("returned");
        let exits = self.exits;
        let result = ret.as_ref().map(|ret| (ret, function.ret));
        let outer = self.begin_names(&formals, result);
        let here = self.telling.here;
        self.tapping.calls.push(span.start);
        self.where_live(|l| {
            l.at(span);
            l.note_enter(id, &formals, span);
            l.frames.push(Frame {
                ret: ret.clone().map(|ret| (ret, function.ret)),
                returned,
                loops: Vec::new(),
            });
            l.stmts(&function.body);
            l.frames.pop();
            l.at(span);
            if l.exits > exits {
                // An `exit` leaves without a result.
                l.guarded(RETURNED, |l| l.note_result(&formals, result));
            } else {
                l.note_result(&formals, result);
            }
            l.b.note(&[], |_| Note::Leave);
        });
        self.tapping.calls.pop();
        self.telling.here = here;
        self.end_names(outer);
        self.unsure |= self.exits > exits;
        self.at(span);
        for (arg, formal) in args.iter().zip(&function.formals) {
            let output = program.vars[formal.0 as usize].kind == (VarKind::Formal { output: true });
            if let (Arg::Alias(place), true, true) = (arg, output, self.b.notes)
                && let Some(spot) = self.spot(place)
            {
                self.note_written(spot.storage());
            }
        }
        for (spot, storage) in back {
            let value = self.read(&Spot::whole(storage.clone()));
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
        match value {
            Init::Value(e) if ty.is_array() => match self.eval(e) {
                Val::Stored(storage, None) => storage,
                _ => self.allocate(ty, name),
            },
            Init::List(items) if ty.extent == Extent::Unsized => {
                let ty = Type { extent: Extent::Array(items.len().max(1) as u32), ..ty };
                let storage = self.allocate(ty, name);
                self.silence(&storage);
                self.store_init(&storage, ty, value);
                storage
            }
            _ => {
                let storage = self.allocate(ty, name);
                self.silence(&storage);
                self.store_init(&storage, ty, value);
                storage
            }
        }
    }

    /// Stores the value of a `return`.
    pub(super) fn store_return(&mut self, init: &Init) {
        let Some((ret, ty)) = self.frames.last().and_then(|f| f.ret.clone()) else {
            if let Init::Value(e) = init {
                self.eval(e);
            }
            return;
        };
        self.store_init(&ret, ty, init);
    }

    /// A built-in, by its row of the table.
    pub(super) fn builtin(&mut self, call: &BuiltinCall, span: Span) -> Val {
        let target = self.take_target();
        let signatures = call.row.signatures();
        let Some(signature) = signatures.get(call.overload) else { return Val::Void };
        let mut spots = Vec::new();
        let mut operands = Vec::new();
        let mut arrays = Vec::new();
        for (e, place) in call.args.iter().zip(&call.outputs) {
            let spot = place.as_ref().and_then(|p| self.spot(p));
            let (operand, array) = match (&spot, place) {
                (Some(spot), Some(place)) => self.held(spot, place),
                _ if e.ty.is_array() => {
                    let val = self.eval(e);
                    let array = self.array(&val, e.ty);
                    (Operand::Now(self.one(val)), array)
                }
                _ => (self.operand(e), None),
            };
            spots.push(spot);
            operands.push(operand);
            arrays.push(array);
        }
        let first = usize::from(signature.ret != Type::VOID);
        let mut args: Vec<ValueId> = Vec::with_capacity(operands.len());
        for (at, operand) in operands.into_iter().enumerate() {
            self.reads_for(call.row.name, first + at);
            args.push(self.settle(operand));
        }
        let types: Vec<Type> = call.args.iter().map(|e| e.ty).collect();
        let literals = literals(&call.args);
        self.at(span);
        // Each printed element becomes a value, so they are counted before any is made.
        let elements: u64 = arrays.iter().flatten().map(|array| u64::from(array.len)).sum();
        if signature.tail == Tail::Any && elements > self.b.values_left() {
            self.too_large("the arrays that are printed have more elements than a program may have values");
            return Val::Void;
        }
        let site = Site {
            args: &args,
            types: &types,
            arrays: &arrays,
            literals: &literals,
            signature,
            names: &self.layer.names,
            connected: self.connected(call),
        };
        let Emitted { result, outputs } = match call.row.emit {
            Emit::Lane(op) => self.b.lane(op, &args).into(),
            Emit::Compose(write) => self.emitted_where_live(|l| write(&mut l.b, &site)),
            Emit::Exit => {
                self.where_live(Self::exit);
                Emitted::default()
            }
        };
        match result {
            Some(value) => self.made(target, value, call.row.name),
            None => self.count_op(),
        }
        // A variable is written by the function itself; elements and components are copies, which are written
        // back after the call. The order shows where two outputs overlap.
        for parts in [false, true] {
            for (index, value) in &outputs {
                if let Some(Some(spot)) = spots.get(*index)
                    && spot.is_part() == parts
                {
                    self.write(spot, Val::One(*value));
                }
            }
        }
        self.at(span);
        for (spot, array) in spots.iter().zip(&arrays) {
            if let (Some(spot), Some(array)) = (spot, array) {
                self.array_written(spot, array);
            }
        }
        if self.b.notes {
            let told = self.told_arguments((&args, &arrays), signature.params.len());
            let all: Vec<ValueId> = told.iter().copied().chain(result).collect();
            // A constructor, such as `color in space`, has no other forms.
            let (name, is_function) = match call.row.name.split_once(' ') {
                Some((name, _)) => (name, false),
                None => (call.row.name, true),
            };
            let chosen = self.chosen(span);
            let why = if is_function { why(call, signatures.len(), &chosen) } else { String::new() };
            self.b.note(&all, |_| Note::Call {
                form: signature.show(name).into(),
                why: why.into(),
                args: told.len() as u8,
            });
        }
        result.map_or(Val::Void, Val::One)
    }

    /// Follows a call that wrote an array: one within an element of another was a copy.
    fn array_written(&mut self, spot: &Spot, array: &Array) {
        let storage = Storage::Leaf(array.slot);
        match spot.is_inner_array() {
            true => self.write(spot, Val::Stored(storage, None)),
            false => self.note_written(&storage),
        }
    }

    /// A component of a closure. No other operation of the renderer can run.
    pub(super) fn operation(&mut self, call: &OperationCall, ty: Type, span: Span) -> Val {
        if ty != Type::CLOSURE {
            let message = format!("there is no operation `{}` to run", call.name);
            let d = Diagnostic::error(NO_OPERATION, span.moved(self.layer.base), message)
                .label("marked as an operation of the renderer")
                .help("give the function a body, and leave its metadata `builtin` out");
            self.diagnostics.push(d);
            return if ty == Type::VOID {
                Val::Void
            } else {
                Val::Stored(self.allocate(ty, &call.name), None)
            };
        }
        let mut operands = Vec::new();
        let mut arrays = Vec::new();
        for e in &call.args {
            let (operand, array) = if e.ty.is_array() {
                let val = self.eval(e);
                let array = self.array(&val, e.ty);
                (Operand::Now(self.one(val)), array)
            } else {
                (self.operand(e), None)
            };
            operands.push(operand);
            arrays.push(array);
        }
        let args: Vec<ValueId> = operands.into_iter().map(|o| self.settle(o)).collect();
        let types: Vec<Type> = call.args.iter().map(|e| e.ty).collect();
        let literals = literals(&call.args);
        let of = |ty: &Type| Param { name: "", ty: ParamType::Of(*ty), output: false };
        let params = types.iter().take(call.formals).map(of).collect();
        self.at(span);
        let site = Site {
            args: &args,
            types: &types,
            arrays: &arrays,
            literals: &literals,
            signature: &Signature { ret: ty, params, tail: Tail::Keywords },
            names: &self.layer.names,
            connected: 0,
        };
        let made = builtins::component(&mut self.b, &site, &call.name).result;
        made.map_or(Val::Void, Val::One)
    }

    /// The value of an output argument before the call; its indices are those of its spot, evaluated once.
    fn held(&mut self, spot: &Spot, place: &Lvalue) -> (Operand, Option<Array>) {
        if place.ty.is_array() {
            let val = self.read(spot);
            let array = self.array(&val, place.ty);
            (Operand::Now(self.one(val)), array)
        } else if place.is_plain() {
            (Operand::Later(spot.clone()), None)
        } else {
            let val = self.read(spot);
            (Operand::Now(self.one(val)), None)
        }
    }

    /// The storage of an array argument; for an array of structs the first part, which has the same number of
    /// elements.
    fn array(&self, val: &Val, ty: Type) -> Option<Array> {
        let Val::Stored(storage, None) = val else { return None };
        let slot = storage.first()?;
        Some(Array { slot, len: self.len_at(slot, None), ty: ty.element() })
    }

    /// Ends the shader at the points that get here.
    fn exit(&mut self) {
        let flags: Vec<_> = self.frames.iter().map(|f| f.returned).collect();
        for flag in flags {
            self.set_flag(flag, 1);
        }
        self.exits += 1;
        self.unsure = true;
    }

    /// The only value of a call that returns one; otherwise a constant.
    pub(super) fn one(&mut self, val: Val) -> ValueId {
        match val {
            Val::One(value) => value,
            Val::Stored(Storage::Leaf(slot), Some(element)) => self.b.load_element(slot, element.index),
            _ => self.b.int(0),
        }
    }
}

/// The text of each argument that is a string literal.
fn literals(args: &[Expr]) -> Vec<Option<Arc<str>>> {
    let text = |e: &Expr| if let ExprKind::Str(s) = &e.kind { Some(s.clone()) } else { None };
    args.iter().map(text).collect()
}

/// Why an overload of a built-in was chosen, as text: the types of its arguments, and the conversions of
/// those that differ from its parameters.
fn why(call: &BuiltinCall, forms: usize, chosen: &str) -> String {
    let changed: Vec<String> = call.converted.iter().map(|index| (index + 1).to_string()).collect();
    let fit = match &changed[..] {
        [] => "the arguments have exactly these types".to_string(),
        [one] => format!("argument {one} is converted"),
        several => format!("arguments {} are converted", several.join(", ")),
    };
    let fit = if forms == 1 { fit } else { format!("one of {forms} forms; {fit}") };
    match chosen {
        "" => fit,
        _ if chosen.starts_with('\n') => fit + chosen,
        _ => format!("{fit}; {chosen}"),
    }
}
