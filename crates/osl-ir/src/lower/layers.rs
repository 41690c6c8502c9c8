//! Layers: one body of a shader, or of a whole group.
//!
//! Each layer is lowered by itself, and then written into the layers that read it before the first read: in the branch
//! that reads it if there is one only, so that it runs where it is needed, and once. Connections are small blocks that
//! copy into the reader's parameter, placed in the same way. What nobody reads is left out.

use super::checks::Checking;
use super::first_use::{self, Spot};
use super::flow::Flow;
use super::{Frame, Lowerer, Storage, View, kind_of};
use crate::builtins::carry_messages;
use crate::group::{Connection, End, Rules};
use crate::hir::{self, Global, Param, VarId};
use crate::ir::{BlockId, Body, Builder, Const, Kernel, Kind, LaneOp, Output, SlotId, Source, ValueId};
use crate::types::{Base, Extent, Type};
use osl_syntax::ast::ShaderKind;
use osl_syntax::diagnostic::Diagnostic;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Where `Ci` stands among the globals.
const CI: usize = hir::GLOBALS.len() - 1;

/// Lowers layers to one body: see [`super::lower_group`].
pub(super) fn lower(
    views: &[View<'_>],
    connections: &[Connection],
    rules: &Rules,
    outputs: &[Arc<str>],
    notes: bool,
) -> Result<Body, Vec<Diagnostic>> {
    let wiring = Wiring::new(views, connections, rules, outputs);
    let mut first = Builder::new(wiring.name.clone());
    first.notes = notes;
    let (mut b, mut diagnostics) = write(views, &wiring, first);
    if !b.messages.is_empty() && (b.messages_by_name || views.len() > 1) {
        // Found by name where one is computed, those before the first would be variables of the body; and a layer may
        // speak of the place in a later one where a message was set first. So it is written again with what is known now.
        let mut again = Builder::new(wiring.name.clone());
        again.messages_by_name = b.messages_by_name;
        again.notes = notes;
        if !b.messages_by_name {
            carry_messages(&mut again, &b.messages);
        }
        (b, diagnostics) = write(views, &wiring, again);
    }
    if diagnostics.is_empty() { Ok(b.body) } else { Err(diagnostics) }
}

/// Which layers are needed, and how their parameters are connected.
pub(super) struct Wiring<'a> {
    /// Name of the last layer's shader.
    name: Arc<str>,
    pub(super) rules: &'a Rules,
    connections: &'a [Connection],
    /// The layers that run in any case, in order.
    pub(super) entries: Vec<usize>,
    needed: Vec<bool>,
    /// For each layer and parameter, the connections to it, those of components first.
    to: Vec<FxHashMap<usize, Vec<&'a Connection>>>,
    /// For each layer and parameter: 1 from upstream, 2 downstream, 3 both.
    ends: Vec<Vec<i32>>,
    /// Outputs of layers before the last that are asked for.
    asked: Vec<Asked>,
}

/// An output of a layer before the last: the layer runs at every point.
struct Asked {
    layer: usize,
    param: usize,
    /// Whether it is an output of the body.
    deliver: bool,
}

impl<'a> Wiring<'a> {
    fn new(
        views: &[View<'_>],
        connections: &'a [Connection],
        rules: &'a Rules,
        outputs: &[Arc<str>],
    ) -> Wiring<'a> {
        let name = views.last().map_or_else(|| "".into(), |v| v.program.shader.name.clone());
        let mut wiring = Wiring {
            name,
            rules,
            connections,
            entries: rules
                .entries
                .clone()
                .unwrap_or_else(|| views.len().checked_sub(1).into_iter().collect()),
            needed: vec![rules.is_eager(); views.len()],
            to: vec![FxHashMap::default(); views.len()],
            ends: views.iter().map(|v| vec![0; v.program.shader.params.len()]).collect(),
            asked: Vec::new(),
        };
        for connection in connections {
            for (End { layer, param, .. }, bit) in [(&connection.to, 1), (&connection.from, 2)] {
                wiring.ends[*layer][*param] |= bit;
            }
            let list = wiring.to[connection.to.layer].entry(connection.to.param).or_default();
            list.push(connection);
            list.sort_by_key(|c| c.to.component.is_none());
        }
        let before = views.split_last().map_or(&[][..], |(_, before)| before);
        for name in outputs {
            let (of, output) =
                name.split_once('.').map_or((None, &**name), |(of, output)| (Some(of), output));
            for (layer, View { program, names, .. }) in before.iter().enumerate() {
                if of.is_none_or(|of| of == &*names.layer) {
                    let named = |p: &Param| &*program.vars[p.var.0 as usize].name == output;
                    let found = program.shader.params.iter().position(|p| p.output && named(p));
                    wiring.asked.extend(found.map(|param| Asked { layer, param, deliver: of.is_some() }));
                }
            }
        }
        // Measured: a shader by itself has no connections, not even those of what is asked of it.
        if let ([_, .., last], [_, .., ends]) = (views, &mut wiring.ends[..]) {
            for (param, ends) in last.program.shader.params.iter().zip(ends) {
                *ends |= if param.output { 2 } else { 0 };
            }
        }
        for Asked { layer, param, .. } in &wiring.asked {
            wiring.ends[*layer][*param] |= 2;
            // Among entries it runs only if it is one or is needed by one.
            wiring.needed[*layer] |= rules.entries.is_none();
        }
        for entry in &wiring.entries {
            wiring.needed.get_mut(*entry).into_iter().for_each(|needed| *needed = true);
        }
        for (view, ends) in views.iter().zip(&mut wiring.ends).filter(|_| rules.userdata_connected) {
            for (param, ends) in view.program.shader.params.iter().zip(ends) {
                let name = &view.program.vars[param.var.0 as usize].name;
                *ends |= i32::from(rules.interpolates(param) || view.values.is_interpolated(name));
            }
        }
        for layer in (0..views.len()).rev().filter(|l| wiring.needed[*l]).collect::<Vec<_>>() {
            wiring.need(layer);
        }
        wiring
    }

    /// Whether an output is asked for of a layer that runs at every point for that reason.
    pub(super) fn asks(&self, layer: usize) -> bool {
        self.rules.entries.is_none() && self.asked.iter().any(|asked| asked.layer == layer)
    }

    /// Whether a connection leaves a layer.
    pub(super) fn leaves(&self, layer: usize) -> bool {
        self.connections.iter().any(|c| c.from.layer == layer)
    }

    /// Marks what a layer reads, however far up.
    fn need(&mut self, layer: usize) {
        let mut open = vec![layer];
        while let Some(layer) = open.pop() {
            let sources: Vec<usize> = self.to[layer].values().flatten().map(|c| c.from.layer).collect();
            for source in sources {
                if !std::mem::replace(&mut self.needed[source], true) {
                    open.push(source);
                }
            }
        }
    }
}

/// A layer that has been lowered, not yet in its place.
pub(super) struct Lowered {
    /// Its parameters, and its body too unless it is an entry.
    pub(super) block: BlockId,
    /// The body of an entry; else empty.
    pub(super) body: BlockId,
    /// Where each parameter lives.
    pub(super) params: Vec<Storage>,
}

fn write(views: &[View<'_>], wiring: &Wiring<'_>, b: Builder) -> (Builder, Vec<Diagnostic>) {
    let Some(last) = views.last() else { return (b, Vec::new()) };
    let entry = b.current;
    let mut l = Lowerer {
        layer: last,
        rules: wiring.rules,
        program: last.program,
        connected: Vec::new(),
        b,
        vars: Vec::new(),
        frames: Vec::new(),
        diagnostics: Vec::new(),
        array_words: 0,
        full: false,
        exits: 0,
        depth: 0,
        unsure: false,
        checking: Checking::default(),
    };
    let globals = l.globals();
    let start = Spot { block: entry, index: l.b.body.block(entry).insts.len() };
    let mut done: Vec<Option<Lowered>> = Vec::new();
    for (index, view) in views.iter().enumerate() {
        if !wiring.needed[index] {
            done.push(None);
            continue;
        }
        l.enter(view, wiring.ends[index].clone(), &globals);
        // The first entry is written where the body starts; the others wait for their place.
        let first = wiring.entries.first() == Some(&index);
        let from = if first { start } else { Spot { block: l.b.block(), index: 0 } };
        let outer = std::mem::replace(&mut l.b.current, from.block);
        let lowered = l.layer(&wiring.to[index], from, &done);
        l.b.current = outer;
        if !wiring.entries.contains(&index) {
            l.append(lowered.body, lowered.block);
        }
        done.push(Some(lowered));
    }
    l.b.current = entry;
    l.place_layers(wiring, &done, &globals);
    for Asked { layer, param, .. } in wiring.asked.iter().filter(|asked| asked.deliver) {
        l.enter(&views[*layer], Vec::new(), &globals);
        if let Some(storage) = done[*layer].as_ref().and_then(|d| d.params.get(*param)) {
            l.deliver(storage, *param, &format!("{}.", views[*layer].names.layer));
        }
    }
    if let Some(Some(lowered)) = done.last() {
        l.enter(last, Vec::new(), &globals);
        for (index, _) in last.program.shader.params.iter().enumerate().filter(|(_, p)| p.output) {
            if let Some(storage) = lowered.params.get(index) {
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
    // So are the point and the normal, where a displacement moves them.
    if last.program.shader.kind == ShaderKind::Displacement {
        for ((global, name, ty, _), slot) in hir::GLOBALS.iter().zip(&globals) {
            let moved = matches!(global, Global::P | Global::N);
            if moved && first_use::is_stored(&l.b.body, entry, start.index, *slot) {
                l.b.body.outputs.push(Output { name: (*name).into(), ty: *ty, source: Source::Slot(*slot) });
            }
        }
    }
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

    /// Turns to another layer.
    fn enter(&mut self, view: &'a View<'a>, connected: Vec<i32>, globals: &[SlotId]) {
        self.layer = view;
        self.program = view.program;
        self.connected = connected;
        self.vars = vec![None; view.program.vars.len()];
        self.frames.clear();
        (self.exits, self.unsure) = (0, false);
        self.begin_checks();
        for (index, slot) in globals.iter().enumerate() {
            self.bind(VarId(index as u32), Storage::Leaf(*slot));
        }
    }

    /// Lowers the layer that was entered: its parameters into the current block, behind `start`, its body into another.
    fn layer(
        &mut self,
        to: &FxHashMap<usize, Vec<&Connection>>,
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
            let sources = to.get(&index).map_or(&[][..], Vec::as_slice);
            let ty = self.param_type(param, sources, done);
            let storage = self.allocate(ty, &var.name);
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
                l.guarded(Flow { returns: true, ..Flow::default() }, |l| l.stmts(&program.shader.body));
            }
        });
        // From the last on, since a default may read parameters before its own.
        for (index, block) in links.into_iter().rev() {
            let handed_on = self.connected.get(index).is_some_and(|ends| ends & 2 != 0);
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

    /// The value of a parameter that nothing is connected to.
    fn own_value(&mut self, storage: &Storage, ty: Type, param: &Param) {
        let name = &self.program.vars[param.var.0 as usize].name;
        self.param(storage, ty, name, &param.init, self.layer.values);
        if self.rules.interpolates(param) || self.layer.values.is_interpolated(name) {
            self.interpolate(storage, ty, name);
        }
    }

    /// Copies what is connected to a parameter.
    fn link(
        &mut self,
        storage: &Storage,
        ty: Type,
        param: &Param,
        sources: &[&Connection],
        done: &[Option<Lowered>],
    ) {
        let whole = |c: &&&Connection| c.to.fields.is_empty() && c.to.component.is_none();
        // The last connection of the whole makes all others futile.
        let sources = match sources.iter().rposition(|c| whole(&c)) {
            Some(at) => &sources[at..=at],
            None => {
                self.own_value(storage, ty, param);
                sources
            }
        };
        for connection in sources {
            let from = done.get(connection.from.layer).and_then(Option::as_ref);
            let from =
                from.and_then(|lowered| part(lowered.params.get(connection.from.param)?, &connection.from));
            if let (Some(from), Some(to)) = (from, part(storage, &connection.to)) {
                self.connect(&to, connection.to.component, &from, connection.from.component);
            }
        }
    }

    fn connect(&mut self, to: &Storage, component: Option<u8>, from: &Storage, from_component: Option<u8>) {
        let (to, from) = match (to, from) {
            (Storage::Struct(to), Storage::Struct(from)) => {
                to.iter().zip(from).for_each(|(to, from)| self.connect(to, None, from, None));
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
        } else {
            let value = self.widened(value, kind);
            self.b.store(to, value);
        }
    }

    /// A value as the kind that it goes to.
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
            self.b.body.slot(part(lowered.params.get(c.from.param)?, &c.from)?.first()?).len
        });
        let given = || self.layer.values.get(&var.name).map(|values| values.len() as u32);
        match connected.or_else(given) {
            Some(len) => Type { extent: Extent::Array(len.max(1)), ..var.ty },
            None => var.ty,
        }
    }

    /// Takes the value that the point has for a parameter's name and type, where it has one.
    fn interpolate(&mut self, storage: &Storage, ty: Type, name: &str) {
        let Storage::Leaf(slot) = storage else { return };
        let kind = kind_of(ty.base);
        if ty.is_array() || kind == Kind::Closure {
            return;
        }
        let (object, whole) = (self.b.constant(Const::Str("".into())), self.b.int(-1));
        let name = self.b.constant(Const::Str(name.into()));
        let kernel = Kernel::Attribute { kind, count: 0, tangents: false };
        let found = self.b.kernel_of(kernel, &[object, name, whole], &[kind, Kind::Int]);
        if let [value, found] = found[..] {
            let own = self.b.load(*slot);
            let value = self.b.choose(found, value, own);
            self.b.store(*slot, value);
        }
    }

    /// How the first argument of a call is connected, if it is a parameter.
    pub(super) fn connected(&self, call: &hir::BuiltinCall) -> i32 {
        let var = match call.args.first().map(|e| &e.kind) {
            Some(hir::ExprKind::Read(place)) => self.program.vars.get(place.var.0 as usize),
            _ => None,
        };
        match var.map(|v| v.kind) {
            Some(hir::VarKind::Param { index, .. }) => {
                self.connected.get(index as usize).copied().unwrap_or(0)
            }
            _ => 0,
        }
    }

    /// Makes outputs of the parts of a parameter.
    fn deliver(&mut self, storage: &Storage, param: usize, before: &str) {
        let var = self.program.shader.params.get(param).map(|p| &self.program.vars[p.var.0 as usize]);
        if let Some(var) = var {
            self.output(storage, var.ty, format!("{before}{}", var.name));
        }
    }

    fn output(&mut self, storage: &Storage, ty: Type, name: String) {
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

/// The part of a parameter that an end names.
fn part(storage: &Storage, end: &End) -> Option<Storage> {
    let mut storage = storage;
    for field in &end.fields {
        let Storage::Struct(parts) = storage else { return None };
        storage = parts.get(*field)?;
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
