//! Messages between the layers of a point, by name.
//!
//! All layers of a run are one body, so a message is a variable of that body with a note of how far it got: nothing
//! yet, asked for in vain, or set with a type. Names have to be known when compiling.

use super::{Array, Builtin, Emitted, Site};
use crate::ir::{Builder, Kernel, Kind, LaneOp, SlotId, ValueId};
use crate::types::Type;
use osl_syntax::span::Span;
use std::sync::Arc;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "setmessage",
        &["x(s,?)", "x(s,?[])"],
        set,
        "Leaves a value for later readers at this point; the first of a name wins.",
    )
    .derivatives("zero for the reader")
    .extremes(
        "A second value of the same name at a point is an error of the run and ignored; so is one of \
               a name that was asked for in vain. The name has to be written out.",
    )
    .example("setmessage(\"height\", 2 * u);"),
    Builtin::compose(
        "getmessage",
        &["i(s,o?)", "i(s,o?[])", "i(s,s,o?)", "i(s,s,o?[])"],
        get,
        "Whether a message of this name and type was set at this point, and its value.",
    )
    .derivatives("zero")
    .extremes(
        "0 without a message, and the variable stays; another type is an error of the run and gives \
               0. The name has to be written out.",
    )
    .example("float h = 0; int there = getmessage(\"height\", h);"),
];

/// A message that the body may hold.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    name: Arc<str>,
    /// 0 nothing, −1 asked for in vain, n set with the type of `values[n - 1]`.
    state: SlotId,
    values: Vec<(Type, Option<u32>, SlotId)>,
    /// Where it is set first, and with what type.
    set_at: Span,
    set_as: String,
}

/// The message of a name, made where it is new.
fn message(b: &mut Builder, name: &Arc<str>) -> usize {
    if let Some(at) = b.messages.iter().position(|m| m.name == *name) {
        return at;
    }
    let state = b.slot(Kind::Int, None, format!("message {name}").into());
    let (values, set_at, set_as) = (Vec::new(), Span::default(), String::new());
    b.messages.push(Message { name: name.clone(), state, values, set_at, set_as });
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

/// A type that stands for the kind of a value: what messages compare.
fn type_of(b: &Builder, s: &Site<'_>, index: usize) -> (Kind, Type) {
    let kind = s.array(index).map_or_else(|| b.body.kind(s.arg(index)), |a| b.body.slot(a.slot).kind);
    let ty = s.types.get(index).copied().unwrap_or(Type::INT).element();
    (kind, ty)
}

fn report(b: &mut Builder, text: String, places: Vec<Span>) {
    b.kernel_of(Kernel::Report { text: text.into(), places }, &[], &[]);
}

fn set(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let Some(name) = s.literal(0).cloned() else {
        b.refuse("a message whose name is not written out");
        return Emitted::default();
    };
    let at = message(b, &name);
    let (kind, ty) = type_of(b, s, 1);
    let array = s.array(1);
    let (number, slot) = variable(b, at, kind, array, ty);
    if b.messages[at].set_as.is_empty() {
        b.messages[at].set_at = b.span;
        b.messages[at].set_as = show(ty, array);
    }
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
            let text = format!(
                "message \"{name}\" already exists (created here: {{0}}) cannot set again from {{1}}"
            );
            let places = vec![b.messages[at].set_at, b.span];
            report(b, text, places);
        },
    );
    Emitted::default()
}

fn copy(b: &mut Builder, to: SlotId, array: Option<Array>, value: ValueId) {
    let Some(array) = array else { return b.store(to, value) };
    for element in 0..array.len {
        let at = b.int(element as i32);
        let value = b.load_element(array.slot, at);
        b.store_element(to, at, value);
    }
}

fn get(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.signature.params.len() == 3 {
        // Messages of a source, such as the last ray traced: there is none.
        return b.int(0).into();
    }
    let Some(name) = s.literal(0).cloned() else {
        b.refuse("a message whose name is not written out");
        return Emitted::default();
    };
    let at = message(b, &name);
    let (kind, ty) = type_of(b, s, 1);
    let array = s.array(1);
    let (number, slot) = variable(b, at, kind, array, ty);
    let state = b.messages[at].state;
    let now = b.load(state);
    let number = b.int(number);
    let found = b.lane(LaneOp::IEq, &[now, number]);
    let old = if array.is_none() { Some(b.load(slot)) } else { None };
    b.if_else(
        found,
        |b| {
            if let Some(target) = array {
                copy_array(b, slot, target);
            }
        },
        |b| {
            let zero = b.int(0);
            let other = b.lane(LaneOp::IGt, &[now, zero]);
            b.if_else(
                other,
                |b| {
                    let (first, wanted) = (b.messages[at].set_as.clone(), show(ty, array));
                    let text = format!(
                        "type mismatch for message \"{name}\" (created as {first} here: {{0}}) cannot fetch \
                         as {wanted} from {{1}}"
                    );
                    let places = vec![b.messages[at].set_at, b.span];
                    report(b, text, places);
                },
                |b| {
                    let vain = b.int(-1);
                    b.store(state, vain);
                },
            );
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

fn copy_array(b: &mut Builder, from: SlotId, to: Array) {
    for element in 0..to.len {
        let at = b.int(element as i32);
        let value = b.load_element(from, at);
        b.store_element(to.slot, at, value);
    }
}

fn show(ty: Type, array: Option<Array>) -> String {
    let ty = crate::types::StructTable::default().show(ty);
    array.map_or(ty.clone(), |a| format!("{ty}[{}]", a.len))
}
