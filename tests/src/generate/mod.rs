//! Valid programs from any bytes: what the properties of the compiler are tested on.
//!
//! A byte is a choice. Where the bytes end, every choice is the simplest, so that a program of any bytes ends. Every
//! expression is made for a type, calls follow the table of built-ins, loops have counters that their bodies cannot
//! write. This module must not know passes or machines.

mod bytes;
mod call;
mod expr;
mod stmt;

pub use bytes::{Bytes, noise_bytes};

use std::fmt::Write;

/// A type: the letter of its element as the table of built-ins writes it, or a struct by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ty {
    One(char),
    Array(char, u32),
    Struct(usize),
}

#[derive(Clone, Debug)]
struct Var {
    name: String,
    ty: Ty,
    /// Whether it may be assigned to: loop counters and parameters without `output` may not.
    write: bool,
}

#[derive(Clone, Debug)]
struct Function {
    name: String,
    ret: char,
    params: Vec<(Ty, bool)>,
}

/// Letters of the values that planes show.
const VALUES: &[char] = &['f', 'c', 'i', 'p', 'v', 'n', 'm', 's'];

/// A program in the making.
struct Gen<'a> {
    bytes: Bytes<'a>,
    text: String,
    vars: Vec<Var>,
    functions: Vec<Function>,
    /// Types of the fields of each struct.
    structs: Vec<Vec<Ty>>,
    names: usize,
    indent: usize,
    loops: usize,
    /// Indices around what is being made.
    indices: usize,
    /// Statements that may still be made.
    left: usize,
    /// What a `return` returns; `None` in the shader itself.
    returns: Option<char>,
}

/// A valid program, all of whose choices are these bytes.
pub fn program(bytes: &[u8]) -> String {
    let bytes = Bytes::new(bytes);
    let mut g = Gen {
        bytes,
        text: String::new(),
        vars: Vec::new(),
        functions: Vec::new(),
        structs: Vec::new(),
        names: 0,
        indent: 0,
        loops: 0,
        indices: 0,
        left: 40,
        returns: None,
    };
    for _ in 0..g.bytes.below(3) {
        g.declare_struct();
    }
    for _ in 0..g.bytes.below(4) {
        g.function();
    }
    g.shader();
    g.text
}

/// The word of a letter.
fn word(letter: char) -> &'static str {
    match letter {
        'i' => "int",
        'f' => "float",
        'c' => "color",
        'p' => "point",
        'v' => "vector",
        'n' => "normal",
        'm' => "matrix",
        's' => "string",
        'K' => "closure color",
        _ => "void",
    }
}

impl Gen<'_> {
    fn name(&mut self, prefix: &str) -> String {
        self.names += 1;
        format!("{prefix}{}", self.names)
    }

    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{:1$}{text}", "", 4 * self.indent);
    }

    fn value_letter(&mut self) -> char {
        self.bytes.pick(VALUES)
    }

    /// `type name`, with its length behind the name where it is an array.
    fn declarator(ty: Ty, name: &str) -> String {
        match ty {
            Ty::One(letter) => format!("{} {name}", word(letter)),
            Ty::Array(letter, len) => format!("{} {name}[{len}]", word(letter)),
            Ty::Struct(id) => format!("S{id} {name}"),
        }
    }

    fn any_type(&mut self) -> Ty {
        match self.bytes.below(8) {
            6 => Ty::Array(self.value_letter(), 1 + self.bytes.below(4) as u32),
            7 if !self.structs.is_empty() => Ty::Struct(self.bytes.below(self.structs.len())),
            _ => Ty::One(self.value_letter()),
        }
    }

    fn declare_struct(&mut self) {
        let id = self.structs.len();
        let mut fields = Vec::new();
        for _ in 0..1 + self.bytes.below(3) {
            // A struct within a struct has a smaller number, and is no element of an array.
            let ty = self.any_type();
            fields.push(ty);
        }
        let list: Vec<String> = fields
            .iter()
            .enumerate()
            .map(|(n, ty)| format!("{};", Self::declarator(*ty, &format!("m{n}"))))
            .collect();
        self.line(&format!("struct S{id} {{ {} }};", list.join(" ")));
        self.structs.push(fields);
    }

    fn function(&mut self) {
        let ret = if self.bytes.chance(40) { 'x' } else { self.value_letter() };
        let name = self.name("f");
        let mut params = Vec::new();
        let mut list = Vec::new();
        for _ in 0..self.bytes.below(4) {
            let (ty, write) = (self.any_type(), self.bytes.chance(80));
            let name = self.name("a");
            let out = if write { "output " } else { "" };
            list.push(format!("{out}{}", Self::declarator(ty, &name)));
            self.vars.push(Var { name, ty, write });
            params.push((ty, write));
        }
        self.line(&format!("{} {name}({})", word(ret), list.join(", ")));
        self.returns = Some(ret);
        self.left = 8;
        self.block(2);
        self.returns = None;
        if ret != 'x' {
            // Every way to the end returns a value.
            let at = self.text.trim_end().len() - 1;
            self.text.truncate(at);
            let value = self.expr(ret, 2);
            self.line(&format!("    return {value};"));
            self.line("}");
        }
        self.vars.clear();
        self.functions.push(Function { name, ret, params });
    }

    fn shader(&mut self) {
        let kind = self.bytes.pick(&["shader", "surface", "displacement", "volume"]);
        self.line(&format!("{kind} generated("));
        for _ in 0..self.bytes.below(5) {
            let ty = self.any_type();
            self.param("a", ty, false);
        }
        let outputs = 1 + self.bytes.below(4);
        for _ in 0..outputs {
            let ty = self.any_type();
            self.param("r", ty, true);
        }
        if self.bytes.chance(60) {
            self.param("k", Ty::One('K'), true);
        }
        self.param("last", Ty::One('f'), true);
        let at = self.text.trim_end().len() - 1;
        self.text.truncate(at);
        self.line(")");
        self.left = 8 + self.bytes.below(32);
        self.block(3);
    }

    /// A parameter of the shader.
    fn param(&mut self, prefix: &str, ty: Ty, write: bool) {
        let name = self.name(prefix);
        let out = if write { "output " } else { "" };
        let value = match ty {
            Ty::One('K') => "0".to_string(),
            Ty::One(letter) if self.bytes.chance(60) => self.expr(letter, 1),
            _ => self.literal_of(ty),
        };
        self.line(&format!("    {out}{} = {value},", Self::declarator(ty, &name)));
        self.vars.push(Var { name, ty, write });
    }
}
