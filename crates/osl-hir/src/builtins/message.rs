//! Messages between the layers of a point, by name.
//!
//! All layers of a run are one body, so a message is a variable of that body with a state: unset, queried in
//! vain, or set with a type. This requires literal names. If a body computes a name, all messages are kernels
//! instead, which store them by point and name.

use super::scene::{store_found, wanted};
use super::{Array, Builtin, Emitted, Site};
use osl_ir::ir::{
    Builder, First, Kernel, Kind, LaneOp, Message, MessageForm, MessageMade, SlotId, ValueId, other_type,
    set_late, set_twice,
};
use osl_ir::types::Type;
use osl_syntax::span::Span;
use std::sync::Arc;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "setmessage",
        &["x(s,?)", "x(s,?[])"],
        "name, value",
        set,
        "Stores `value` under `name` for layers that run later at this point. The first value with a \
         name wins.",
    )
    .derivatives("zero for the layer that reads the message")
    .extremes(
        "A second value with the same name at a point is a run-time error and is ignored. So is a \
         value whose name was queried before it was set. A batch of points keeps at most 65536 \
         messages and 4 MiB of values under computed names; more of them end the run.",
    )
    .example("setmessage(\"height\", 2 * u);"),
    Builtin::compose(
        "getmessage",
        &["i(s,o?)", "i(s,o?[])", "i(s,s,o?)", "i(s,s,o?[])"],
        "source, name, destination | name, destination",
        get,
        "Stores the value of the message `name` at this point in `destination`. Returns 1 if a \
         message of this name and type was set, else 0.",
    )
    .query()
    .scene()
    .derivatives("zero")
    .extremes(
        "Without a message the result is 0, and `destination` is unchanged. It is a run-time error, \
         and gives 0, if the message was set or first queried with another type.",
    )
    .example("float h = 0; int there = getmessage(\"height\", h);"),
];

/// Makes the messages of another builder, with the locations where they were first set and queried, but
/// without values.
pub fn carry(b: &mut Builder, from: &[Message]) {
    for Message { name, set, asked, .. } in from {
        let at = message(b, name);
        (b.messages[at].set, b.messages[at].asked) = (set.clone(), asked.clone());
    }
}

/// The message with a name, created if necessary.
fn message(b: &mut Builder, name: &Arc<str>) -> usize {
    if let Some(at) = b.message_places.get(name) {
        return *at;
    }
    let state = b.slot(Kind::Int, None, format!("message {name}").into());
    let (set, asked) = (First::default(), First::default());
    b.message_places.insert(name.clone(), b.messages.len());
    b.messages.push(Message { name: name.clone(), state, values: Vec::new(), set, asked });
    b.messages.len() - 1
}

/// The variable of a message for a type, and its number.
fn variable(b: &mut Builder, at: usize, kind: Kind, array: Option<Array>, ty: Type) -> (i32, SlotId) {
    let len = array.map(|a| a.len);
    let name: Arc<str> = b.messages[at].name.clone();
    if let Some(found) = b.messages[at].values.iter().position(|(t, l, _)| *t == ty && *l == len) {
        return (found as i32 + 1, b.messages[at].values[found].2);
    }
    let slot = b.slot(kind, len, name);
    b.messages[at].values.push((ty, len, slot));
    (b.messages[at].values.len() as i32, slot)
}

/// A type that represents the kind of a value, which messages compare.
fn type_of(b: &Builder, s: &Site<'_>, index: usize) -> (Kind, Type) {
    let kind = s.array(index).map_or_else(|| b.body.kind(s.arg(index)), |a| b.body.slot(a.slot).kind);
    let ty = s.types.get(index).copied().unwrap_or(Type::INT).element();
    (kind, ty)
}

fn report(b: &mut Builder, text: String, places: Vec<Span>) {
    b.kernel_of(Kernel::Report { text: text.into(), places }, &[], &[]);
}

/// The name, unless messages are found by name at run time.
fn written_name(b: &mut Builder, s: &Site<'_>) -> Option<Arc<str>> {
    let name = s.literal(0).cloned();
    b.messages_by_name |= name.is_none();
    if b.messages_by_name { None } else { name }
}

fn set(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let (kind, ty) = type_of(b, s, 1);
    let array = s.array(1);
    let shown = show(ty, array);
    let Some(name) = written_name(b, s) else {
        let args = [s.arg(0), s.arg(1)];
        let args = if array.is_some() { &args[..1] } else { &args };
        b.kernel_of(Kernel::SetMessage(form(b, array, shown)), args, &[]);
        return Emitted::default();
    };
    let at = message(b, &name);
    let (number, slot) = variable(b, at, kind, array, ty);
    let here = b.span;
    b.messages[at].set.note(here, &shown);
    let state = b.messages[at].state;
    let now = b.load(state);
    let zero = b.int(0);
    let free = b.lane(LaneOp::IEq, &[now, zero]);
    b.if_else(
        free,
        |b| {
            copy(b, slot, array, s.arg(1));
            let number = b.int(number);
            b.store(state, number);
        },
        |b| {
            let is_set = b.lane(LaneOp::IGt, &[now, zero]);
            let places = |first: &First| vec![first.at, here];
            b.if_else(
                is_set,
                |b| report(b, set_twice(&name), places(&b.messages[at].set)),
                |b| report(b, set_late(&name), places(&b.messages[at].asked)),
            );
        },
    );
    Emitted::default()
}

fn form(b: &Builder, array: Option<Array>, shown: String) -> MessageForm {
    MessageForm { ty: shown.into(), array: array.map(|a| a.slot), place: b.span }
}

fn copy(b: &mut Builder, to: SlotId, array: Option<Array>, value: ValueId) {
    let Some(array) = array else { return b.store(to, value) };
    for element in 0..array.len {
        if b.excess().is_some() {
            return;
        }
        let at = b.int(element as i32);
        let value = b.load_element(array.slot, at);
        b.store_element(to, at, value);
    }
}

fn get(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.signature.params.len() == 3 {
        return of_source(b, s);
    }
    let (kind, ty) = type_of(b, s, 1);
    let array = s.array(1);
    let shown = show(ty, array);
    let Some(name) = written_name(b, s) else { return get_by_name(b, s, kind, array, shown) };
    let at = message(b, &name);
    let (number, slot) = variable(b, at, kind, array, ty);
    let here = b.span;
    b.messages[at].asked.note(here, &shown);
    let state = b.messages[at].state;
    let now = b.load(state);
    let number = b.int(number);
    let found = b.lane(LaneOp::IEq, &[now, number]);
    let old = if array.is_none() { Some(b.load(slot)) } else { None };
    let old = old.map(|value| still(b, value));
    b.if_else(
        found,
        |b| {
            if let Some(target) = array {
                copy_array(b, slot, target);
            }
        },
        |b| {
            let zero = b.int(0);
            let vain = b.lane(LaneOp::INeg, &[number]);
            let other = |b: &mut Builder, made: MessageMade| {
                let Message { set, asked, .. } = &b.messages[at];
                let first = if made == MessageMade::Set { set } else { asked };
                let (text, places) = (other_type(&name, made, &first.ty, &shown), vec![first.at, here]);
                report(b, text, places);
            };
            let is_set = b.lane(LaneOp::IGt, &[now, zero]);
            let ask = |b: &mut Builder| {
                let unknown = b.lane(LaneOp::IEq, &[now, zero]);
                b.if_else(
                    unknown,
                    |b| b.store(state, vain),
                    |b| {
                        let differs = b.lane(LaneOp::INe, &[now, vain]);
                        b.if_else(differs, |b| other(b, MessageMade::AskedFor), |_| ());
                    },
                );
            };
            b.if_else(is_set, |b| other(b, MessageMade::Set), ask);
        },
    );
    let outputs = match old {
        Some(value) => {
            let value = b.choose(found, value, s.arg(1));
            vec![(1, value)]
        }
        None => Vec::new(),
    };
    Emitted { result: Some(found), outputs }
}

/// Queries a source of messages, such as the last ray.
fn of_source(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let (kind, count, mut kinds) = wanted(b, s, 2);
    kinds.push(Kind::Int);
    let base = s.types.get(2).map_or(Type::INT.base, |ty| ty.base);
    let mut values = b.kernel_of(Kernel::SourceMessage { base, kind, count }, &[s.arg(0), s.arg(1)], &kinds);
    let (Some(found), Some(given)) = (values.pop(), values.pop()) else { return Emitted::default() };
    Emitted { result: Some(found), ..store_found(b, s, 2, given, &values) }
}

fn get_by_name(b: &mut Builder, s: &Site<'_>, kind: Kind, array: Option<Array>, shown: String) -> Emitted {
    let kernel = Kernel::GetMessage(form(b, array, shown));
    if array.is_some() {
        return b.kernel(kernel, &[s.arg(0)], Kind::Int).into();
    }
    let results = b.kernel_of(kernel, &[s.arg(0)], &[Kind::Int, kind]);
    let [found, value] = results[..] else { return Emitted::default() };
    let value = b.choose(found, value, s.arg(1));
    Emitted { result: Some(found), outputs: vec![(1, value)] }
}

fn copy_array(b: &mut Builder, from: SlotId, to: Array) {
    for element in 0..to.len {
        if b.excess().is_some() {
            return;
        }
        let at = b.int(element as i32);
        let value = b.load_element(from, at);
        let value = still(b, value);
        b.store_element(to.slot, at, value);
    }
}

/// The value as passed on by a message: without derivatives.
fn still(b: &mut Builder, value: ValueId) -> ValueId {
    match b.body.kind(value) {
        Kind::Float | Kind::Triple => b.lane(LaneOp::Still, &[value]),
        _ => value,
    }
}

fn show(ty: Type, array: Option<Array>) -> String {
    let ty = osl_ir::types::StructTable::default().show(ty);
    array.map_or(ty.clone(), |a| format!("{ty}[{}]", a.len))
}
