//! Reads the text of [`print`](super::print()) back, so that a pass can be tested over text.
//!
//! Values and slots keep their numbers; numbers that the text leaves out stay unused. What the text does not
//! hold gets a default: source locations, layers, assumptions, and the types of outputs, which follow from
//! their kinds. The reader checks the form only: [`validate`](super::validate) checks the body. Products must
//! not depend on this module: it serves tests, in this crate and in others.

mod kernel;

use super::{
    Assumptions, Axis, Block, BlockId, Body, Const, Input, Inst, Kind, LaneOp, Op, Output, Rate, Slot,
    SlotId, Source, Value, ValueId, Values,
};
use crate::global::Global;
use crate::types::Type;
use osl_syntax::span::Span;

/// Reads a body.
///
/// # Errors
/// The first line that is not understood, with its number, as text.
pub fn read(text: &str) -> Result<Body, String> {
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let mut reader = Reader {
        lines: lines.map(|(n, line)| (n + 1, line)).collect(),
        at: 0,
        body: Body {
            name: "".into(),
            values: Vec::new(),
            blocks: Vec::new(),
            slots: Vec::new(),
            entry: BlockId(0),
            outputs: Vec::new(),
            inputs: Vec::new(),
            layers: Vec::new(),
            assumptions: Assumptions::default(),
        },
    };
    let result = reader.body();
    let line = reader.lines.get(reader.at.saturating_sub(1)).map_or(0, |(n, _)| *n);
    result.map_err(|e| format!("line {line}: {e}"))?;
    Ok(reader.body)
}

/// The largest number of a value or slot, so that a wrong one does not fill the memory.
const MAX_NUMBER: u32 = 1 << 24;

struct Reader<'t> {
    /// The lines that are not empty, with their numbers.
    lines: Vec<(usize, &'t str)>,
    at: usize,
    body: Body,
}

impl<'t> Reader<'t> {
    /// The next line without its indentation, if it is indented by `depth` levels.
    fn peek(&self, depth: usize) -> Option<&'t str> {
        let (_, line) = self.lines.get(self.at)?;
        let text = line.trim_start_matches(' ');
        (line.len() - text.len() == 2 * depth).then_some(text.trim_end())
    }

    fn body(&mut self) -> Result<(), String> {
        let name = self.peek(0).and_then(|line| line.strip_prefix("shader ")).ok_or("expected `shader`")?;
        self.body.name = name.into();
        self.at += 1;
        while let Some(line) = self.peek(1).filter(|line| line.starts_with("slot ")) {
            self.at += 1;
            self.slot(&mut Cursor { rest: line })?;
        }
        while let Some(line) = self.peek(1).filter(|line| line.starts_with("input ")) {
            self.at += 1;
            self.input(&mut Cursor { rest: line })?;
        }
        self.body.entry = self.block(1)?;
        while let Some(line) = self.peek(1).and_then(|line| line.strip_prefix("output ")) {
            self.at += 1;
            let (name, source) = line.rsplit_once(" = ").ok_or("expected ` = `")?;
            let mut cursor = Cursor { rest: source };
            let (source, kind) = match source.starts_with('s') {
                true => {
                    let slot = cursor.slot()?;
                    let decl = self.body.slots.get(slot.index()).ok_or("an unknown slot")?;
                    (Source::Slot(slot), decl.kind)
                }
                false => {
                    let value = cursor.value()?;
                    let decl = self.body.values.get(value.index()).ok_or("an unknown value")?;
                    (Source::Value(value), decl.kind)
                }
            };
            self.body.outputs.push(Output { name: name.into(), ty: type_of(kind), source });
        }
        match self.lines.get(self.at) {
            None => Ok(()),
            Some(_) => {
                self.at += 1;
                Err("not expected here".to_string())
            }
        }
    }

    /// `slot s1: float[3] uniform "name"`
    fn slot(&mut self, line: &mut Cursor<'_>) -> Result<(), String> {
        line.word("slot")?;
        let id = line.slot()?;
        line.word(":")?;
        let kind = line.kind()?;
        let len = if line.eat("[") { Some(line.number_until("]")?) } else { None };
        let rate = line.rate()?;
        let name = line.string()?.into();
        line.end()?;
        while self.body.slots.len() <= id.index() {
            self.body.slots.push(Slot { kind: Kind::Int, len: None, name: "".into(), rate: Rate::Varying });
        }
        self.body.slots[id.index()] = Slot { kind, len, name, rate };
        Ok(())
    }

    /// `input 0: float "layer.name"[2] = 1.0`
    fn input(&mut self, line: &mut Cursor<'_>) -> Result<(), String> {
        line.word("input")?;
        let index = line.number_until(":")?;
        if index as usize != self.body.inputs.len() {
            return Err(format!("input {index} is out of order"));
        }
        let kind = line.kind()?;
        let name = line.string()?.into();
        let element = if line.eat("[") { Some(line.number_until("]")?) } else { None };
        line.word("=")?;
        let value = line.constant(kind).ok_or("expected a constant")?;
        line.end()?;
        self.body.inputs.push(Input { name, element, value });
        Ok(())
    }

    /// The instructions at a depth, as a new block.
    fn block(&mut self, depth: usize) -> Result<BlockId, String> {
        let id = BlockId(self.body.blocks.len() as u32);
        self.body.blocks.push(Block::default());
        let mut insts = Vec::new();
        while let Some(line) = self.peek(depth) {
            let ends = ["yield ", "while ", "output "].iter().any(|word| line.starts_with(word));
            if ends || line == "else" {
                break;
            }
            self.at += 1;
            insts.push(self.inst(&mut Cursor { rest: line }, depth)?);
        }
        self.body.blocks[id.index()].insts = insts;
        Ok(id)
    }

    fn define(&mut self, id: ValueId, kind: Kind, rate: Rate) {
        while self.body.values.len() <= id.index() {
            self.body.values.push(Value { kind: Kind::Int, rate: Rate::Varying, span: Span::default() });
        }
        self.body.values[id.index()] = Value { kind, rate, span: Span::default() };
    }

    /// `v1: float uniform`
    fn definition(&mut self, line: &mut Cursor<'_>) -> Result<ValueId, String> {
        let id = line.value()?;
        line.word(":")?;
        let kind = line.kind()?;
        let rate = line.rate()?;
        self.define(id, kind, rate);
        Ok(id)
    }

    fn inst(&mut self, line: &mut Cursor<'_>, depth: usize) -> Result<Inst, String> {
        let mut results = Values::new();
        if line.at_value() {
            results.push(self.definition(line)?);
            while line.eat(",") {
                results.push(self.definition(line)?);
            }
            line.word("=")?;
        }
        let op = self.op(line, &results, depth)?;
        Ok(Inst { op, results, span: Span::default() })
    }

    fn op(&mut self, line: &mut Cursor<'_>, results: &Values, depth: usize) -> Result<Op, String> {
        let kind = results.first().and_then(|v| self.body.values.get(v.index())).map(|value| value.kind);
        if let Some(constant) = kind.and_then(|kind| line.constant(kind)) {
            line.end()?;
            return Ok(Op::Const(constant));
        }
        let word = line.name();
        let op = match word {
            "if" => return self.branch(line, depth),
            "loop" => return self.repeat(line, depth),
            "global" => Op::Global(line.global()?),
            "input" => Op::Input(line.number_until("")?),
            "deriv" => Op::GlobalDeriv(line.global()?, line.axis()?),
            "derivative" => Op::Derivative(line.value()?, line.axis()?),
            "load" => {
                let slot = line.slot()?;
                match line.index()? {
                    Some(index) => Op::LoadElement(slot, index),
                    None => Op::Load(slot),
                }
            }
            "store" => {
                let slot = line.slot()?;
                let index = line.index()?;
                line.word(",")?;
                let value = line.value()?;
                match index {
                    Some(index) => Op::StoreElement(slot, index, value),
                    None => Op::Store(slot, value),
                }
            }
            _ => match (LaneOp::ALL.iter().find(|op| op.text() == word), word.strip_prefix("share")) {
                (Some(op), _) => Op::Lane(*op, line.values()?),
                (None, Some(group)) => {
                    let group = group.parse().map_err(|_| format!("no group `{group}`"))?;
                    Op::Share(group, line.values()?)
                }
                (None, None) => {
                    let kernel = kernel::kernel(word, line)?;
                    Op::Kernel(kernel, line.values()?)
                }
            },
        };
        line.end()?;
        Ok(op)
    }

    /// The values after a word at a depth; none without the line.
    fn yields(&mut self, word: &str, depth: usize) -> Result<Values, String> {
        let Some(rest) = self.peek(depth).and_then(|line| line.strip_prefix(word)) else {
            return Ok(Values::new());
        };
        self.at += 1;
        let mut line = Cursor { rest };
        let values = line.values()?;
        line.end()?;
        Ok(values)
    }

    fn branch(&mut self, line: &mut Cursor<'_>, depth: usize) -> Result<Op, String> {
        let cond = line.value()?;
        line.end()?;
        let then = self.block(depth + 1)?;
        let then_yields = self.yields("yield ", depth + 1)?;
        let has_else = self.peek(depth) == Some("else");
        self.at += usize::from(has_else);
        let otherwise = self.block(if has_else { depth + 1 } else { usize::MAX / 4 })?;
        let else_yields = if has_else { self.yields("yield ", depth + 1)? } else { Values::new() };
        Ok(Op::If { cond, then, otherwise, then_yields, else_yields })
    }

    fn repeat(&mut self, line: &mut Cursor<'_>, depth: usize) -> Result<Op, String> {
        let (mut params, mut init) = (Values::new(), Values::new());
        line.word("(")?;
        while !line.eat(")") {
            if !params.is_empty() {
                line.word(",")?;
            }
            params.push(self.definition(line)?);
            line.word("=")?;
            init.push(line.value()?);
        }
        line.end()?;
        let body = self.block(depth + 1)?;
        let rest =
            self.peek(depth + 1).and_then(|line| line.strip_prefix("while ")).ok_or("expected `while`")?;
        self.at += 1;
        let mut line = Cursor { rest };
        let cond = line.value()?;
        line.word("next")?;
        let next = line.values()?;
        line.end()?;
        Ok(Op::Loop { init, params, body, cond, next })
    }
}

/// A type of the language that is stored as a kind.
fn type_of(kind: Kind) -> Type {
    match kind {
        Kind::Int => Type::INT,
        Kind::Float => Type::FLOAT,
        Kind::Triple => Type::COLOR,
        Kind::Matrix => Type::MATRIX,
        Kind::Str => Type::STRING,
        Kind::Closure => Type::CLOSURE,
    }
}

/// A place in a line.
struct Cursor<'t> {
    rest: &'t str,
}

impl<'t> Cursor<'t> {
    /// Skips spaces and the word, if it comes next.
    fn eat(&mut self, word: &str) -> bool {
        let found = self.rest.trim_start().strip_prefix(word);
        self.rest = found.unwrap_or(self.rest);
        found.is_some()
    }

    fn word(&mut self, word: &str) -> Result<(), String> {
        if self.eat(word) { Ok(()) } else { Err(format!("expected `{word}`, found `{}`", self.rest)) }
    }

    fn end(&self) -> Result<(), String> {
        if self.rest.trim().is_empty() { Ok(()) } else { Err(format!("`{}` is left over", self.rest)) }
    }

    /// The text up to a space, a comma or a bracket.
    fn name(&mut self) -> &'t str {
        let text = self.rest.trim_start();
        let end = text.find([' ', ',', '[', '(', ')', ']', ':']).unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        self.rest = rest;
        name
    }

    /// The next name, if `known` knows it; else the cursor stays.
    fn known<T>(&mut self, known: impl FnOnce(&str) -> Option<T>) -> Option<T> {
        let before = self.rest;
        let found = known(self.name());
        if found.is_none() {
            self.rest = before;
        }
        found
    }

    fn number_until(&mut self, end: &str) -> Result<u32, String> {
        let name = self.name();
        let number = name.parse().map_err(|_| format!("`{name}` is no number"))?;
        self.word(end)?;
        Ok(number)
    }

    fn id(&mut self, letter: char) -> Option<u32> {
        let number = |name: &str| name.strip_prefix(letter)?.parse().ok().filter(|n| *n < MAX_NUMBER);
        self.known(number)
    }

    fn value(&mut self) -> Result<ValueId, String> {
        self.id('v').map(ValueId).ok_or_else(|| format!("expected a value, found `{}`", self.rest))
    }

    fn slot(&mut self) -> Result<SlotId, String> {
        self.id('s').map(SlotId).ok_or_else(|| format!("expected a slot, found `{}`", self.rest))
    }

    fn at_value(&self) -> bool {
        Cursor { rest: self.rest }.id('v').is_some()
    }

    /// The values up to the end, separated by commas.
    fn values(&mut self) -> Result<Values, String> {
        let mut values = Values::new();
        if self.at_value() {
            values.push(self.value()?);
            while self.eat(",") {
                values.push(self.value()?);
            }
        }
        Ok(values)
    }

    /// `[v1]`, if it comes next.
    fn index(&mut self) -> Result<Option<ValueId>, String> {
        if !self.eat("[") {
            return Ok(None);
        }
        let index = self.value()?;
        self.word("]")?;
        Ok(Some(index))
    }

    fn kind(&mut self) -> Result<Kind, String> {
        let kinds = [Kind::Int, Kind::Float, Kind::Triple, Kind::Matrix, Kind::Str, Kind::Closure];
        let kind = |name: &str| kinds.into_iter().find(|kind| super::print::kind(*kind) == name);
        self.known(kind).ok_or_else(|| format!("expected a kind, found `{}`", self.rest))
    }

    /// `uniform`, `shared1`, or nothing for varying.
    fn rate(&mut self) -> Result<Rate, String> {
        let rate = |name: &str| match name.strip_prefix("shared") {
            Some(group) => group.parse().ok().map(Rate::PerCell),
            None => (name == "uniform").then_some(Rate::Uniform),
        };
        Ok(self.known(rate).unwrap_or(Rate::Varying))
    }

    fn global(&mut self) -> Result<Global, String> {
        let global =
            |name: &str| Global::ALL.into_iter().find(|g| format!("{g:?}").eq_ignore_ascii_case(name));
        self.known(global).ok_or_else(|| format!("expected a global, found `{}`", self.rest))
    }

    fn axis(&mut self) -> Result<Axis, String> {
        let axis = |name: &str| match name {
            "x" => Some(Axis::X),
            "y" => Some(Axis::Y),
            _ => None,
        };
        self.known(axis).ok_or_else(|| format!("expected an axis, found `{}`", self.rest))
    }

    /// A string as Rust writes it.
    fn string(&mut self) -> Result<String, String> {
        self.word("\"")?;
        let mut out = String::new();
        let mut chars = self.rest.chars();
        loop {
            match chars.next() {
                Some('"') => break,
                Some('\\') => out.push(escape(&mut chars).ok_or("a wrong escape")?),
                Some(c) => out.push(c),
                None => return Err("the string does not end".to_string()),
            }
        }
        self.rest = chars.as_str();
        Ok(out)
    }

    /// A constant of a kind, if one comes next.
    fn constant(&mut self, kind: Kind) -> Option<Const> {
        let before = self.rest;
        let constant = match kind {
            Kind::Int => self.name().parse().ok().map(Const::Int),
            Kind::Float => self.name().parse().ok().map(Const::Float),
            Kind::Triple => self.numbers("(", ")").and_then(|n| n.try_into().ok()).map(Const::Triple),
            Kind::Matrix => {
                let numbers: Option<[f32; 16]> = self.numbers("[", "]").and_then(|n| n.try_into().ok());
                numbers.map(|n| Const::Matrix(Box::new(n)))
            }
            Kind::Str => self.string().ok().map(|s| Const::Str(s.into())),
            Kind::Closure => self.eat("null").then_some(Const::Null),
        };
        if constant.is_none() {
            self.rest = before;
        }
        constant
    }

    fn numbers(&mut self, open: &str, close: &str) -> Option<Vec<f32>> {
        let mut numbers = Vec::new();
        if !self.eat(open) {
            return None;
        }
        while !self.eat(close) {
            numbers.push(self.name().parse().ok()?);
        }
        Some(numbers)
    }
}

/// The character of an escape, after its backslash.
fn escape(chars: &mut std::str::Chars<'_>) -> Option<char> {
    Some(match chars.next()? {
        'n' => '\n',
        't' => '\t',
        'r' => '\r',
        '0' => '\0',
        'u' => {
            let digits: String = chars.by_ref().skip(1).take_while(|c| *c != '}').collect();
            char::from_u32(u32::from_str_radix(&digits, 16).ok()?)?
        }
        c => c,
    })
}
