//! The IR as text: one instruction a line, blocks by indentation. Snapshots and `oslrun ir` show it.

use super::{BlockId, Body, Const, Inst, Kernel, Kind, Op, Rate, Source, ValueId};
use std::fmt::Write;

/// The body as text.
pub fn print(body: &Body) -> String {
    let mut out = format!("shader {}\n", body.name);
    for (index, slot) in body.slots.iter().enumerate() {
        let kind = kind(slot.kind);
        let _ = match slot.len {
            Some(len) => writeln!(out, "  slot s{index}: {kind}[{len}]{} \"{}\"", rate(slot.rate), slot.name),
            None => writeln!(out, "  slot s{index}: {kind} \"{}\"", slot.name),
        };
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

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Int => "int",
        Kind::Float => "float",
        Kind::Triple => "triple",
        Kind::Matrix => "matrix",
        Kind::Str => "string",
        Kind::Closure => "closure",
    }
}

fn rate(rate: Rate) -> &'static str {
    match rate {
        Rate::Uniform => " uniform",
        Rate::Varying => "",
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
            let _ = writeln!(out, "{}", simple(op));
        }
    }
}

fn yields(word: &str, values: &[ValueId], depth: usize, out: &mut String) {
    if !values.is_empty() || word != "yield" {
        let _ = writeln!(out, "{}{word} {}", "  ".repeat(depth), list(values));
    }
}

fn list(values: &[ValueId]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ")
}

fn simple(op: &Op) -> String {
    match op {
        Op::Const(value) => constant(value),
        Op::Global(global) => format!("global {global:?}"),
        Op::Slope(global, axis) => format!("slope {global:?} {axis:?}").to_lowercase(),
        Op::Lane(op, args) => format!("{} {}", op.text(), list(args)),
        Op::Kernel(kernel, args) => format!("{} {}", kernel_name(kernel), list(args)),
        Op::Load(slot) => format!("load {slot:?}"),
        Op::Store(slot, value) => format!("store {slot:?}, {value:?}"),
        Op::LoadElement(slot, index) => format!("load {slot:?}[{index:?}]"),
        Op::StoreElement(slot, index, value) => format!("store {slot:?}[{index:?}], {value:?}"),
        Op::If { .. } | Op::Loop { .. } => String::new(),
    }
}

fn kernel_name(kernel: &Kernel) -> String {
    let form = |dims: &u8, triple: &bool, periodic: &bool| {
        format!("{dims}d{}{}", if *triple { ".triple" } else { "" }, if *periodic { ".periodic" } else { "" })
    };
    match kernel {
        Kernel::Noise { field, dims, triple, periodic } => {
            format!("noise.{}.{}", format!("{field:?}").to_lowercase(), form(dims, triple, periodic))
        }
        Kernel::NamedNoise { dims, triple, periodic } => {
            format!("noise.named.{}", form(dims, triple, periodic))
        }
        Kernel::SpaceMatrix => "space_matrix".to_string(),
        Kernel::ColorFrom => "color_from".to_string(),
        Kernel::Texture { triple, options, footprint } => {
            let options: Vec<String> = options.iter().map(|o| format!(" {o:?}").to_lowercase()).collect();
            let footprint = if *footprint { " footprint" } else { "" };
            format!("texture{}{}{footprint}", if *triple { ".triple" } else { "" }, options.concat())
        }
    }
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
