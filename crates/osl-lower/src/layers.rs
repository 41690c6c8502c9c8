//! Layers: makes one body of a shader, or of a whole group.
//!
//! Each layer is lowered separately, and then inserted into the layers that read it, before the first read:
//! inside the branch that reads it if there is only one, so that it runs once and only where it is needed.
//! Connections are small blocks that copy into the reader's parameter, placed in the same way. Layers that
//! are not read are left out.

use super::checks::Checking;
use super::first_use::{self, Spot};
use super::flow::RETURNED;
use super::joins;
use super::notes::Telling;
use super::wiring::{Asked, Joint, Joints, Wiring};
use super::{Frame, Lowerer, Requests, Storage, View, kind_of};
use crate::group::{Connection, Rules};
use crate::taps::Tapping;
use osl_hir::builtins::{Asks, carry_messages};
use osl_hir::hir::{self, Global, Param, VarId};
use osl_hir::oso::errors::OPERATION;
use osl_ir::ir::validate;
use osl_ir::ir::{
    BlockId, Body, Builder, Const, Kernel, Kind, LaneOp, Output, SlotId, Source, USER_DATA, ValueId, Values,
};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::ShaderKind;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// The index of `Ci` among the globals.
const CI: usize = hir::GLOBALS.len() - 1;

/// Lowers layers to one body: see [`super::lower_group`].
pub(super) fn lower(
    views: &[View<'_>],
    connections: &[Connection],
    rules: &Rules,
    requests: &Requests,
) -> Result<Body, Vec<Diagnostic>> {
    let wiring = Wiring::new(views, connections, rules, requests);
    let notes = requests.notes;
    let mut first = Builder::new(wiring.name.clone());
    (first.notes, first.limits) = (notes, requests.limits.compiling);
    let (mut b, mut diagnostics) = write(views, &wiring, first, requests);
    if !b.messages.is_empty() && (b.messages_by_name || views.len() > 1) {
        // If one is found by a computed name, the messages before it would be variables of the body; and a
        // layer may refer to the location in a later one where a message was first set. So the body is
        // written again with the complete information.
        let mut again = Builder::new(wiring.name.clone());
        again.messages_by_name = b.messages_by_name;
        (again.notes, again.limits) = (notes, requests.limits.compiling);
        if !b.messages_by_name {
            carry_messages(&mut again, &b.messages);
        }
        (b, diagnostics) = write(views, &wiring, again, requests);
    }
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    // A compiled shader may hold what no source could say, and later stages rely on the rules of bodies.
    validate::validate(&b.body).map(|()| b.body).map_err(|broken| {
        let message = "an operation does not take its arguments, so the program cannot run";
        vec![Diagnostic::error(OPERATION, Span::default(), message).note(broken)]
    })
}

/// A layer that was lowered but not placed yet.
pub(super) struct Lowered {
    /// Its parameters, and also its body unless it is an entry.
    pub(super) block: BlockId,
    /// The body of an entry; else empty.
    pub(super) body: BlockId,
    /// The storage of each parameter.
    pub(super) params: Vec<Storage>,
}

fn write(
    views: &[View<'_>],
    wiring: &Wiring<'_>,
    b: Builder,
    requests: &Requests,
) -> (Builder, Vec<Diagnostic>) {
    let Some(last) = views.last() else { return (b, Vec::new()) };
    let entry = b.current;
    let mut l = Lowerer {
        layer: last,
        rules: wiring.rules,
        program: last.program,
        connected: FxHashMap::default(),
        b,
        vars: Vec::new(),
        inner: FxHashMap::default(),
        frames: Vec::new(),
        diagnostics: Vec::new(),
        full: false,
        exits: 0,
        depth: 0,
        unsure: false,
        checking: Checking::default(),
        telling: Telling::new(requests.note_derivs),
        tapping: Tapping::new(&requests.taps),
        views,
    };
    let globals = l.globals();
    l.begin_taps();
    let start = Spot { block: entry, index: l.b.body.block(entry).insts.len() };
    let mut done: Vec<Option<Lowered>> = Vec::new();
    for (index, view) in views.iter().enumerate() {
        if !wiring.needed[index] {
            done.push(None);
            continue;
        }
        l.enter(view, &globals);
        l.tapping.layer = index;
        // The first entry is at the start of the body; the others are placed later.
        let first = wiring.entries.first() == Some(&index);
        let from = if first { start } else { Spot { block: l.b.block(), index: 0 } };
        let outer = std::mem::replace(&mut l.b.current, from.block);
        let lowered = l.layer(&wiring.to[index], &wiring.ends[index], from, &done);
        l.b.current = outer;
        if !wiring.entries.contains(&index) {
            l.append(lowered.body, lowered.block);
        }
        done.push(Some(lowered));
    }
    l.b.current = entry;
    l.place_layers(wiring, &done, &globals);
    for Asked { layer, param, .. } in wiring.asked.iter().filter(|asked| asked.deliver) {
        l.enter(&views[*layer], &globals);
        if let Some(storage) = done[*layer].as_ref().and_then(|d| d.params.get(*param)) {
            l.deliver(storage, *param, &format!("{}.", views[*layer].names.layer));
        }
    }
    if let Some(Some(lowered)) = done.last() {
        l.enter(last, &globals);
        for (index, storage) in lowered.params.iter().enumerate() {
            if wiring.delivered.get(index).is_some_and(|delivered| *delivered) {
                l.deliver(storage, index, "");
            }
        }
    }
    // The closure of the surface is an output of shaders that write it.
    if let Some(ci) = globals.get(CI)
        && first_use::is_stored(&l.b.body, entry, start.index, *ci)
    {
        l.b.body.outputs.push(Output { name: "Ci".into(), ty: Type::CLOSURE, source: Source::Slot(*ci) });
    }
    // The same holds for the point and the normal, if a displacement moves them.
    if last.program.shader.kind == ShaderKind::Displacement {
        for ((global, name, ty, _), slot) in hir::GLOBALS.iter().zip(&globals) {
            let moved = matches!(global, Global::P | Global::N);
            if moved && first_use::is_stored(&l.b.body, entry, start.index, *slot) {
                l.b.body.outputs.push(Output { name: (*name).into(), ty: *ty, source: Source::Slot(*slot) });
            }
        }
    }
    l.end_taps();
    // The code of the last statement counts too.
    if l.has_room() {
        let limit = l.b.limits.joins;
        if joins::count(&l.b.body, entry, limit) > limit {
            l.too_large(&format!("branches and loops hand on more than {limit} values of variables"));
        }
    }
    l.place_globals(Spot { block: entry, index: start.index }, &globals);
    l.b.body.layers = views.iter().map(|v| (v.base, v.names.clone())).collect();
    (l.b, l.diagnostics)
}

impl<'a> Lowerer<'a> {
    /// Variables for the globals, in order. All layers share them.
    fn globals(&mut self) -> Vec<SlotId> {
        let mut slots = Vec::new();
        for (global, name, ty, _) in &hir::GLOBALS {
            let kind = kind_of(ty.base);
            let slot = self.b.slot(kind, None, (*name).into());
            let value = if *global == Global::Ci {
                self.b.constant(Const::Null)
            } else {
                self.b.global(*global, kind)
            };
            self.b.store(slot, value);
            slots.push(slot);
        }
        slots
    }

    /// Switches to another layer.
    fn enter(&mut self, view: &'a View<'a>, globals: &[SlotId]) {
        self.layer = view;
        self.program = view.program;
        self.connected.clear();
        self.vars = vec![None; view.program.vars.len()];
        self.frames.clear();
        (self.exits, self.unsure) = (0, false);
        self.begin_checks();
        for (index, slot) in globals.iter().enumerate() {
            self.bind(VarId(index as u32), Storage::Leaf(*slot));
        }
    }

    /// Lowers the current layer: its parameters into the current block after `start`, its body into another
    /// block.
    fn layer(
        &mut self,
        to: &FxHashMap<usize, Vec<&Connection>>,
        ends: &Joints,
        start: Spot,
        done: &[Option<Lowered>],
    ) -> Lowered {
        let program = self.program;
        let returned = self.flag("returned");
        self.frames.push(Frame { ret: None, returned, loops: Vec::new() });
        let mut params = Vec::new();
        let mut links = Vec::new();
        for (index, param) in program.shader.params.iter().enumerate() {
            let var = &program.vars[param.var.0 as usize];
            self.at(var.span);
            self.telling.here = self.b.span;
            let sources = to.get(&index).map_or(&[][..], Vec::as_slice);
            let ty = self.param_type(param, sources, done);
            let storage = self.allocate(ty, &var.name);
            self.join(&storage, index, param, ends);
            if sources.is_empty() {
                self.own_value(&storage, ty, param);
            } else {
                let block = self.in_block(|l| l.link(&storage, ty, param, sources, done));
                links.push((index, block));
            }
            self.bind(param.var, storage.clone());
            params.push(storage);
        }
        self.unsure = false;
        let body = self.in_block(|l| {
            l.mark_undeclared();
            if l.exits == 0 {
                l.stmts(&program.shader.body);
            } else {
                l.guarded(RETURNED, |l| l.stmts(&program.shader.body));
            }
        });
        // In reverse order, since a default may read earlier parameters.
        for (index, block) in links.into_iter().rev() {
            let handed_on = ends.get(&index).is_some_and(|ends| ends.iter().any(|end| end.bit == 2));
            let spot = if handed_on || program.shader.params[index].output {
                Some(start)
            } else {
                first_use::across(&self.b.body, &[start.block, body], &leaves(&params[index]))
                    .map(|f| f.inner)
            };
            self.splice(block, spot);
        }
        Lowered { block: start.block, body, params }
    }

    /// The value of a parameter without a connection: the point's user data, the instance value, or the
    /// default.
    fn own_value(&mut self, storage: &Storage, ty: Type, param: &Param) {
        let values = self.layer.values;
        let name = &self.program.vars[param.var.0 as usize].name;
        let own = |l: &mut Self| {
            if says(param, "interactive", |x| x != 0.0)
                && !param.init.is_constant()
                && values.get(name).is_none()
            {
                // The code for the default never runs where the value may be edited between runs.
                l.store_zero(storage);
            } else {
                l.param(storage, ty, name, &param.init, values);
            }
        };
        let slot = match storage {
            Storage::Leaf(slot) if self.takes_user_data(param) => *slot,
            _ => return own(self),
        };
        let len = self.b.body.slot(slot).len;
        let kind = kind_of(ty.base);
        // The number of values of an array, or 0.
        let count = match len {
            None => Some(0),
            Some(len) => u8::try_from(len).ok().filter(|len| *len > 0),
        };
        let Some(count) = count.filter(|_| kind != Kind::Closure) else { return own(self) };
        let (found, data) = self.user_data(name, kind, count);
        let [value, ..] = data[..] else { return own(self) };
        if len.is_none() && (param.init.is_constant() || values.get(name).is_some()) {
            // The note tells the value that is chosen.
            let notes = std::mem::take(&mut self.b.notes);
            own(self);
            self.b.notes = notes;
            let own = self.b.load(slot);
            let value = self.b.choose(found, value, own);
            self.b.store(slot, value);
            self.note_set(slot, None, value);
        } else {
            // The default is computed only where the point has no value.
            self.store_zero(storage);
            let given = |l: &mut Self| {
                for (index, value) in data.iter().enumerate() {
                    let at = len.map(|_| l.b.int(index as i32));
                    match at {
                        Some(at) => l.b.store_element(slot, at, *value),
                        None => l.b.store(slot, *value),
                    }
                    l.note_set(slot, at, *value);
                }
            };
            self.if_else(found, given, own);
        }
    }

    /// Whether the point's value takes precedence over the parameter's.
    fn takes_user_data(&self, param: &Param) -> bool {
        let name = self.program.vars.get(param.var.0 as usize).map_or("", |var| &var.name);
        self.rules.interpolates(param) || self.layer.values.is_interpolated(name)
    }

    /// Whether the point has data with a name and kind, and their values: one, or as many as the array has.
    fn user_data(&mut self, name: &str, kind: Kind, count: u8) -> (ValueId, Values) {
        let (object, whole) = (self.b.constant(Const::Str("".into())), self.b.int(USER_DATA));
        let name = self.b.constant(Const::Str(name.into()));
        let kernel = Kernel::Attribute { kind, count, has_derivs: false };
        let mut kinds = vec![kind; usize::from(count).max(1)];
        kinds.push(Kind::Int);
        let mut values = self.b.kernel_of(kernel, &[object, name, whole], &kinds);
        (values.pop().unwrap_or(whole), values)
    }

    /// Copies the connected value to a parameter.
    fn link(
        &mut self,
        storage: &Storage,
        ty: Type,
        param: &Param,
        sources: &[&Connection],
        done: &[Option<Lowered>],
    ) {
        let whole = |c: &&&Connection| c.to.fields.is_empty() && c.to.component.is_none();
        // The last connection of the whole parameter overrides all others; yet their layers run.
        let winner = sources.iter().rposition(|c| whole(&c));
        match winner {
            Some(at) => {
                let notes = std::mem::take(&mut self.b.notes);
                let others = sources.iter().enumerate().filter(|(index, _)| *index != at);
                others.for_each(|(_, connection)| self.carry(storage, connection, done));
                self.b.notes = notes;
            }
            None => self.own_value(storage, ty, param),
        }
        let taken = winner.map_or(sources, |at| &sources[at..=at]);
        taken.iter().for_each(|connection| self.carry(storage, connection, done));
    }

    /// Copies the value of one connection.
    fn carry(&mut self, storage: &Storage, connection: &Connection, done: &[Option<Lowered>]) {
        if !self.has_room() {
            return;
        }
        let from = done.get(connection.from.layer).and_then(Option::as_ref);
        let end = &connection.from;
        let from = from.and_then(|lowered| part(lowered.params.get(end.param)?, &end.fields));
        if let (Some(from), Some(to)) = (from, part(storage, &connection.to.fields)) {
            self.connect(&to, connection.to.component, &from, connection.from.component);
        }
    }

    fn connect(&mut self, to: &Storage, component: Option<u8>, from: &Storage, from_component: Option<u8>) {
        let (to, from) = match (to, from) {
            (Storage::Struct(to), Storage::Struct(from)) => {
                for (to, from) in to.iter().zip(from.iter()) {
                    if self.has_room() {
                        self.connect(to, None, from, None);
                    }
                }
                return;
            }
            (Storage::Leaf(to), Storage::Leaf(from)) => (*to, *from),
            _ => return,
        };
        let kind = self.b.body.slot(to).kind;
        if let (Some(n), Some(m)) = (self.b.body.slot(to).len, self.b.body.slot(from).len) {
            for index in 0..n.min(m) {
                if !self.has_room() {
                    return;
                }
                let index = self.b.int(index as i32);
                let value = self.b.load_element(from, index);
                let value = self.widened(value, kind);
                self.b.store_element(to, index, value);
                self.note_set(to, Some(index), value);
            }
            return;
        }
        let mut value = self.b.load(from);
        if let Some(component) = from_component {
            let index = self.b.int(i32::from(component));
            value = self.b.lane(LaneOp::Get, &[value, index]);
        }
        if let Some(component) = component {
            let value = self.widened(value, Kind::Float);
            let (old, index) = (self.b.load(to), self.b.int(i32::from(component)));
            let value = self.b.lane(LaneOp::Set, &[old, index, value]);
            self.b.store(to, value);
            self.note_set(to, None, value);
        } else {
            let value = self.widened(value, kind);
            self.b.store(to, value);
            self.note_set(to, None, value);
        }
    }

    /// A value converted to the kind of its destination.
    fn widened(&mut self, value: ValueId, kind: Kind) -> ValueId {
        let own = self.b.body.kind(value);
        if own == kind {
            return value;
        }
        let value = if own == Kind::Int { self.b.lane(LaneOp::ToFloat, &[value]) } else { value };
        if kind == Kind::Triple { self.b.lane(LaneOp::Splat, &[value]) } else { value }
    }

    /// The type of a parameter; an open array has the length of its value.
    fn param_type(&self, param: &Param, sources: &[&Connection], done: &[Option<Lowered>]) -> Type {
        let var = &self.program.vars[param.var.0 as usize];
        if !param.open {
            return var.ty;
        }
        let connected = sources.last().and_then(|c| {
            let lowered = done.get(c.from.layer)?.as_ref()?;
            self.b.body.slot(part(lowered.params.get(c.from.param)?, &c.from.fields)?.first()?).len
        });
        let given = || self.layer.values.get(&var.name).map(|values| values.len() as u32);
        match connected.or_else(given) {
            Some(len) => Type { extent: Extent::Array(len.max(1)), ..var.ty },
            None => var.ty,
        }
    }

    /// Records how the parts of a parameter are connected.
    fn join(&mut self, storage: &Storage, index: usize, param: &Param, ends: &Joints) {
        if self.rules.userdata_connected && self.takes_user_data(param) {
            self.connected.extend(leaves(storage).into_iter().map(|slot| (slot, 1)));
        }
        for Joint { fields, bit } in ends.get(&index).into_iter().flatten() {
            for slot in part(storage, fields).iter().flat_map(leaves) {
                *self.connected.entry(slot).or_default() |= bit;
            }
        }
    }

    /// How the first argument of a call is connected: 1 upstream, 2 downstream or to the renderer, 3 both. It
    /// may be a formal that is an alias for a parameter. A struct is connected as its first part is.
    pub(super) fn connected(&mut self, call: &hir::BuiltinCall) -> i32 {
        let Some(hir::ExprKind::Read(place)) = call.args.first().map(|e| &e.kind) else { return 0 };
        if call.row.facts.asks != Some(Asks::Connection) || !place.is_plain() {
            return 0;
        }
        let slot = self.spot(place).and_then(|spot| spot.storage().first());
        slot.and_then(|slot| self.connected.get(&slot).copied()).unwrap_or(0)
    }

    /// Makes outputs of the parts of a parameter.
    fn deliver(&mut self, storage: &Storage, param: usize, before: &str) {
        let var = self.program.shader.params.get(param).map(|p| &self.program.vars[p.var.0 as usize]);
        if let Some(var) = var {
            self.output(storage, var.ty, format!("{before}{}", var.name));
        }
    }

    pub(super) fn output(&mut self, storage: &Storage, ty: Type, name: String) {
        match (storage, ty.base) {
            (Storage::Struct(parts), Base::Struct(id)) => {
                for (part, field) in parts.iter().zip(&self.program.structs.get(id).fields) {
                    self.output(part, field.ty, format!("{name}.{}", field.name));
                }
            }
            (Storage::Leaf(slot), _) => {
                self.b.body.outputs.push(Output { name: name.into(), ty, source: Source::Slot(*slot) });
            }
            _ => {}
        }
    }
}

/// Whether metadata with a name is one number that satisfies a condition.
fn says(param: &Param, name: &str, is: impl Fn(f64) -> bool) -> bool {
    param.metadata.iter().any(|(_, n, value)| match value {
        hir::MetaValue::Numbers(numbers) => &**n == name && matches!(numbers[..], [x] if is(x)),
        _ => false,
    })
}

/// The part of a parameter at a path of fields.
fn part(storage: &Storage, fields: &[usize]) -> Option<Storage> {
    let mut storage = storage;
    for field in fields {
        storage = storage.field(*field)?;
    }
    Some(storage.clone())
}

/// The slots of a parameter.
pub(super) fn leaves(storage: &Storage) -> Vec<SlotId> {
    match storage {
        Storage::Leaf(slot) => vec![*slot],
        Storage::Struct(parts) => parts.iter().flat_map(leaves).collect(),
    }
}
