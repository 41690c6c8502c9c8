//! The IR as text: one instruction per line, blocks by indentation. Used by snapshots, tests of passes and
//! `oslrun ir`; [`read`](super::read::read) reads it back.
//!
//! The text leaves out slots that nothing uses, source locations, layers and assumptions.

use super::{
    BlockId, Body, Const, Input, Inst, Kernel, Kind, MessageForm, Note, Op, Rate, Shape, SlotId, Source,
    TextureOption, ValueId,
};
use std::fmt::Write;

/// The body as text.
pub fn print(body: &Body) -> String {
    let mut out = format!("shader {}\n", body.name);
    let used = used_slots(body);
    for (index, slot) in body.slots.iter().enumerate().filter(|(index, _)| used.get(*index) == Some(&true)) {
        let kind = kind(slot.kind);
        let _ = match slot.len {
            Some(len) => writeln!(out, "  slot s{index}: {kind}[{len}]{} {:?}", rate(slot.rate), slot.name),
            None => writeln!(out, "  slot s{index}: {kind} {:?}", slot.name),
        };
    }
    for (index, Input { name, element, value }) in body.inputs.iter().enumerate() {
        let (kind, value) = (kind(value.kind()), constant(value));
        let element = element.map_or(String::new(), |element| format!("[{element}]"));
        let _ = writeln!(out, "  input {index}: {kind} {name:?}{element} = {value}");
    }
    block(body, body.entry, 1, &mut out);
    for output in &body.outputs {
        let _ = match output.source {
            Source::Value(v) => writeln!(out, "  output {} = {v:?}", output.name),
            Source::Slot(s) => writeln!(out, "  output {} = {s:?}", output.name),
        };
    }
    out
}

/// For each slot, whether an instruction or an output uses it.
fn used_slots(body: &Body) -> Vec<bool> {
    let mut used = vec![false; body.slots.len()];
    let mut blocks = vec![body.entry];
    let mut touch = |slot: &SlotId| {
        if let Some(used) = used.get_mut(slot.index()) {
            *used = true;
        }
    };
    while let Some(id) = blocks.pop() {
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::Load(s) | Op::Store(s, _) | Op::LoadElement(s, _) | Op::StoreElement(s, ..) => touch(s),
                Op::Kernel(kernel, _) => kernel.reads().iter().chain(&kernel.writes()).for_each(&mut touch),
                Op::If { then, otherwise, .. } => blocks.extend([*then, *otherwise]),
                Op::Loop { body, .. } => blocks.push(*body),
                _ => {}
            }
        }
    }
    for output in &body.outputs {
        if let Source::Slot(s) = &output.source {
            touch(s);
        }
    }
    used
}

pub(super) fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Int => "int",
        Kind::Float => "float",
        Kind::Triple => "triple",
        Kind::Matrix => "matrix",
        Kind::Str => "string",
        Kind::Closure => "closure",
    }
}

fn rate(rate: Rate) -> String {
    match rate {
        Rate::Uniform => " uniform".to_string(),
        Rate::PerCell(group) => format!(" shared{group}"),
        Rate::Varying => String::new(),
    }
}

fn block(body: &Body, id: BlockId, depth: usize, out: &mut String) {
    for inst in &body.block(id).insts {
        instruction(body, inst, depth, out);
    }
}

fn instruction(body: &Body, inst: &Inst, depth: usize, out: &mut String) {
    let pad = "  ".repeat(depth);
    out.push_str(&pad);
    for (index, result) in inst.results.iter().enumerate() {
        let value = body.value(*result);
        let comma = if index == 0 { "" } else { ", " };
        let _ = write!(out, "{comma}{result:?}: {}{}", kind(value.kind), rate(value.rate));
    }
    if !inst.results.is_empty() {
        out.push_str(" = ");
    }
    match &inst.op {
        Op::If { cond, then, otherwise, then_yields, else_yields } => {
            let _ = writeln!(out, "if {cond:?}");
            block(body, *then, depth + 1, out);
            yields("yield", then_yields, depth + 1, out);
            if !body.block(*otherwise).insts.is_empty() || !else_yields.is_empty() {
                let _ = writeln!(out, "{pad}else");
                block(body, *otherwise, depth + 1, out);
                yields("yield", else_yields, depth + 1, out);
            }
        }
        Op::Loop { init, params, body: inner, cond, next } => {
            let pairs: Vec<String> = params
                .iter()
                .zip(init)
                .map(|(p, i)| format!("{p:?}: {}{} = {i:?}", kind(body.kind(*p)), rate(body.value(*p).rate)))
                .collect();
            let _ = writeln!(out, "loop ({})", pairs.join(", "));
            block(body, *inner, depth + 1, out);
            yields(&format!("while {cond:?} next"), next, depth + 1, out);
        }
        op => {
            let _ = writeln!(out, "{}", simple(op).trim_end());
        }
    }
}

fn yields(word: &str, values: &[ValueId], depth: usize, out: &mut String) {
    if !values.is_empty() || word != "yield" {
        let _ = writeln!(out, "{}", format!("{}{word} {}", "  ".repeat(depth), list(values)).trim_end());
    }
}

fn list(values: &[ValueId]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ")
}

fn simple(op: &Op) -> String {
    match op {
        Op::Const(value) => constant(value),
        Op::Global(global) => format!("global {global:?}"),
        Op::Input(index) => format!("input {index}"),
        Op::GlobalDeriv(global, axis) => format!("deriv {global:?} {axis:?}").to_lowercase(),
        Op::Derivative(of, axis) => format!("derivative {of:?} {axis:?}").to_lowercase(),
        Op::Lane(op, args) => format!("{} {}", op.text(), list(args)),
        Op::Kernel(kernel, args) => {
            let shapes = kernel.shapes().map_or(String::new(), |shapes| format!(" ({})", forms(shapes)));
            format!("{}{shapes} {}", kernel_name(kernel), list(args))
        }
        Op::Share(group, roots) => format!("share{group} {}", list(roots)),
        Op::Load(slot) => format!("load {slot:?}"),
        Op::Store(slot, value) => format!("store {slot:?}, {value:?}"),
        Op::LoadElement(slot, index) => format!("load {slot:?}[{index:?}]"),
        Op::StoreElement(slot, index, value) => format!("store {slot:?}[{index:?}], {value:?}"),
        Op::If { .. } | Op::Loop { .. } => String::new(),
    }
}

fn forms(shapes: &[Shape]) -> String {
    let form = |shape: &Shape| {
        let key = shape.key.as_ref().map_or(String::new(), |key| format!("{key:?}: "));
        let count = if shape.count == 1 { String::new() } else { format!("[{}]", shape.count) };
        format!("{key}{}{count}", kind(shape.kind))
    };
    shapes.iter().map(form).collect::<Vec<_>>().join(", ")
}

fn kernel_name(kernel: &Kernel) -> String {
    let form = |dims: &u8, triple: &bool, periodic: &bool, has_derivs: &bool| {
        let flag = |on: &bool, word| if *on { word } else { "" };
        let (triple, periodic) = (flag(triple, ".triple"), flag(periodic, ".periodic"));
        format!("{dims}d{triple}{periodic}{}", flag(has_derivs, ".derivs"))
    };
    let lower = |text: String| text.to_lowercase();
    match kernel {
        Kernel::Noise { field, dims, triple, periodic, has_derivs } => {
            format!("noise.{}.{}", lower(format!("{field:?}")), form(dims, triple, periodic, has_derivs))
        }
        Kernel::NamedNoise { dims, triple, periodic, options, has_derivs } => {
            let options: Vec<String> = options.iter().map(|o| lower(format!(" {o:?}"))).collect();
            format!("noise.named.{}{}", form(dims, triple, periodic, has_derivs), options.concat())
        }
        Kernel::SpaceMatrix { both } => format!("space_matrix{}", if *both { ".both" } else { "" }),
        Kernel::FindSpace => "find_space".to_string(),
        Kernel::ColorBetween => "color_between".to_string(),
        Kernel::Texture { triple, options, footprint, quiet, has_derivs } => {
            let flags = [
                (*triple, ".triple"),
                (*quiet, ".quiet"),
                (*footprint, ".footprint"),
                (*has_derivs, ".derivs"),
            ];
            format!("texture{}", with_options(&flags, options))
        }
        Kernel::Environment { triple, options, footprint, quiet } => {
            let flags = [(*triple, ".triple"), (*quiet, ".quiet"), (*footprint, ".footprint")];
            format!("environment{}", with_options(&flags, options))
        }
        Kernel::Volume { triple, options, quiet } => {
            format!("volume{}", with_options(&[(*triple, ".triple"), (*quiet, ".quiet")], options))
        }
        Kernel::TextureInfo { kind: of, count } => format!("texture_info {}[{count}]", kind(*of)),
        Kernel::Text(function) => function.text().to_string(),
        Kernel::Format(_) => "format".to_string(),
        Kernel::Print { sink, .. } => lower(format!("print.{sink:?}")),
        Kernel::Split { pieces } => format!("split {pieces:?}"),
        Kernel::Regex { whole, places } => {
            let places = places.map_or(String::new(), |s| format!(" {s:?}"));
            format!("regex{}{places}", if *whole { ".whole" } else { "" })
        }
        Kernel::Hash => "hash.words".to_string(),
        Kernel::Attribute { kind: of, count, has_derivs } => {
            format!("attribute{} {}[{count}]", if *has_derivs { ".derivs" } else { "" }, kind(*of))
        }
        Kernel::DictFind => "dict_find".to_string(),
        Kernel::DictNext => "dict_next".to_string(),
        Kernel::DictValue { kind: of, count } => format!("dict_value {}[{count}]", kind(*of)),
        Kernel::IsConstant => "is_constant".to_string(),
        Kernel::RayType => "raytype".to_string(),
        Kernel::Trace => "trace".to_string(),
        Kernel::SourceMessage { base, count, .. } => {
            format!("source_message {}[{count}]", lower(format!("{base:?}")))
        }
        Kernel::SplineInverse { knots, has_derivs } => {
            format!("spline_inverse{} {knots:?}", if *has_derivs { ".derivs" } else { "" })
        }
        Kernel::Component { name, .. } => format!("closure.{name}"),
        Kernel::ClosureSum => "closure.sum".to_string(),
        Kernel::ClosureScale => "closure.scale".to_string(),
        Kernel::SetMessage(form) => format!("message.set{}", message(form)),
        Kernel::GetMessage(form) => format!("message.get{}", message(form)),
        Kernel::Report { text, .. } => format!("report {text:?}"),
        Kernel::CheckIndex { name } => format!("check_index {name:?}"),
        Kernel::CheckFinite { name, op } => format!("check_finite {name:?} {op:?}"),
        Kernel::CheckSet { what, reader } => format!("check_set {what:?} {reader:?}"),
        Kernel::Note { site, note } => match note {
            Note::Reach => format!("note.reach {site}"),
            Note::Set(name) => format!("note.set {site} {name:?}"),
            Note::Call { form, why, args } => format!("note.call {site} {args} {form:?} {why:?}"),
            Note::Branch(test) => format!("note.branch.{} {site}", test.text()),
            Note::Loop => format!("note.loop {site}"),
            Note::Round => format!("note.round {site}"),
            Note::Enter { form, why, names } => format!("note.enter {site} {form:?} {why:?} {names:?}"),
            Note::Result { names } => format!("note.result {site} {names:?}"),
            Note::Leave => format!("note.leave {site}"),
        },
    }
}

impl Op {
    /// The name of the operation, without its operands.
    pub fn name(&self) -> String {
        match self {
            Op::Const(_) => "const".to_string(),
            Op::Global(_) => "global".to_string(),
            Op::Input(_) => "input".to_string(),
            Op::GlobalDeriv(..) => "deriv".to_string(),
            Op::Derivative(..) => "derivative".to_string(),
            Op::Lane(op, _) => op.text().to_string(),
            Op::Kernel(kernel, _) => kernel_name(kernel),
            Op::Share(group, _) => format!("share{group}"),
            Op::Load(_) | Op::LoadElement(..) => "load".to_string(),
            Op::Store(..) | Op::StoreElement(..) => "store".to_string(),
            Op::If { .. } => "if".to_string(),
            Op::Loop { .. } => "loop".to_string(),
        }
    }
}

fn message(form: &MessageForm) -> String {
    let array = form.array.map_or(String::new(), |s| format!(" {s:?}"));
    format!(" {:?}{array}", form.ty)
}

fn with_options(flags: &[(bool, &str)], options: &[TextureOption]) -> String {
    let flags: String = flags.iter().filter(|(on, _)| *on).map(|(_, word)| *word).collect();
    options.iter().fold(flags, |text, o| format!("{text} {}", format!("{o:?}").to_lowercase()))
}

fn constant(value: &Const) -> String {
    let numbers = |n: &[f32]| n.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
    match value {
        Const::Int(n) => format!("{n}"),
        Const::Float(x) => format!("{x:?}"),
        Const::Triple(t) => format!("({})", numbers(t)),
        Const::Matrix(m) => format!("[{}]", numbers(&m[..])),
        Const::Str(s) => format!("{s:?}"),
        Const::Null => "null".to_string(),
    }
}
