//! Generates valid programs from any bytes: the inputs for tests of the compiler's properties.
//!
//! A byte is a choice. After the end of the bytes, every choice is the simplest, so every program ends. Every
//! expression is made for a type, calls follow the table of built-ins, and loops have counters that their
//! bodies cannot write. This module must not know passes or machines.

mod bytes;
mod call;
mod expr;
mod place;
mod stmt;
mod whole;

pub use bytes::{Bytes, noise_bytes};

use std::fmt::Write;

/// A type: the letter of its element in the table of built-ins, or the number of a struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ty {
    One(char),
    Array(char, u32),
    /// A formal that takes arrays of any length.
    Open(char),
    Struct(usize),
    /// An array of structs; they hold no arrays, unless `Gen::nested` permits it.
    Structs(usize, u32),
    /// A formal that takes arrays of such structs of any length.
    OpenStructs(usize),
}

/// How a function takes an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pass {
    /// It only reads it.
    In,
    /// Not an output, but written to, which changes the caller's variable.
    Written,
    /// An output.
    Out,
}

/// What programs may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// Everything.
    All,
    /// Only what the walker knows: no closures, spaces, textures, messages or derivatives.
    Walked,
}

#[derive(Clone, Debug)]
struct Var {
    name: String,
    ty: Ty,
    /// Whether it may be assigned to; loop counters and parameters without `output` may not.
    write: bool,
}

#[derive(Clone, Debug)]
struct Function {
    name: String,
    ret: Ty,
    params: Vec<(Ty, Pass)>,
}

/// The result type of a function without result.
const NOTHING: Ty = Ty::One('x');

/// Letters of the types that planes show.
const VALUES: &[char] = &['f', 'c', 'i', 'p', 'v', 'n', 'm', 's'];

/// The state of the generator.
struct Gen<'a> {
    scope: Scope,
    /// Whether the elements of arrays may hold arrays, for which compiled shaders have no form.
    nested: bool,
    bytes: Bytes<'a>,
    text: String,
    vars: Vec<Var>,
    functions: Vec<Function>,
    /// Types of the fields of each struct.
    structs: Vec<Vec<Ty>>,
    names: usize,
    indent: usize,
    loops: usize,
    /// Number of array indices around the current expression.
    indices: usize,
    /// Number of statements that may still be generated.
    left: usize,
    /// The type that `return` returns; `None` in the shader itself.
    returns: Option<Ty>,
}

/// The valid program that these bytes choose.
pub fn program(bytes: &[u8]) -> String {
    make(bytes, Scope::All, false)
}

/// A valid program with only what the [walker](osl_walker) knows.
pub fn walked_program(bytes: &[u8]) -> String {
    make(bytes, Scope::Walked, false)
}

/// The same, with arrays of structs that hold arrays.
pub fn nested_program(bytes: &[u8]) -> String {
    make(bytes, Scope::Walked, true)
}

fn make(bytes: &[u8], scope: Scope, nested: bool) -> String {
    let bytes = Bytes::new(bytes);
    let mut g = Gen {
        scope,
        nested,
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
    for _ in 0..g.bytes.below(4) {
        g.declare_struct();
    }
    for _ in 0..g.bytes.below(4) {
        g.function();
    }
    g.shader();
    g.text
}

/// The keyword for a letter.
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

    /// `type name`, with its length after the name if it is an array.
    fn declarator(ty: Ty, name: &str) -> String {
        match ty {
            Ty::One(letter) => format!("{} {name}", word(letter)),
            Ty::Array(letter, len) => format!("{} {name}[{len}]", word(letter)),
            Ty::Open(letter) => format!("{} {name}[]", word(letter)),
            Ty::Struct(id) => format!("S{id} {name}"),
            Ty::Structs(id, len) => format!("S{id} {name}[{len}]"),
            Ty::OpenStructs(id) => format!("S{id} {name}[]"),
        }
    }

    fn any_type(&mut self) -> Ty {
        match self.bytes.below(12) {
            6 | 7 => Ty::Array(self.value_letter(), 1 + self.bytes.below(4) as u32),
            8 | 9 if !self.structs.is_empty() => Ty::Struct(self.bytes.below(self.structs.len())),
            10 => match self.element_struct() {
                Some(id) => Ty::Structs(id, 1 + self.bytes.below(3) as u32),
                None => Ty::One(self.value_letter()),
            },
            _ => Ty::One(self.value_letter()),
        }
    }

    /// A struct that may be the element of an array.
    fn element_struct(&mut self) -> Option<usize> {
        let ids: Vec<usize> = (0..self.structs.len()).filter(|id| self.nested || self.is_flat(*id)).collect();
        ids.get(self.bytes.below(ids.len())).copied()
    }

    fn is_flat(&self, id: usize) -> bool {
        self.structs[id].iter().all(|field| match field {
            Ty::One(_) => true,
            Ty::Struct(id) => self.is_flat(*id),
            _ => false,
        })
    }

    /// Whether the type contains arrays of structs, which a parameter of a shader must not have.
    fn holds_structs(&self, ty: Ty) -> bool {
        match ty {
            Ty::Struct(id) => self.structs[id].iter().any(|field| self.holds_structs(*field)),
            Ty::Structs(..) | Ty::OpenStructs(_) => true,
            _ => false,
        }
    }

    fn formal_type(&mut self) -> Ty {
        if self.bytes.chance(60) && !self.structs.is_empty() {
            return Ty::Struct(self.bytes.below(self.structs.len()));
        }
        if !self.bytes.chance(50) {
            return self.any_type();
        }
        if self.bytes.chance(90)
            && let Some(id) = self.element_struct()
        {
            return Ty::OpenStructs(id);
        }
        Ty::Open(self.value_letter())
    }

    fn declare_struct(&mut self) {
        let id = self.structs.len();
        let mut fields = Vec::new();
        for _ in 0..1 + self.bytes.below(3) {
            // A struct within a struct has a smaller number.
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

    /// A function; one inside the shader sees the variables declared before it.
    fn function(&mut self) {
        let ret = match self.bytes.below(8) {
            0 => NOTHING,
            1 | 2 if !self.structs.is_empty() => Ty::Struct(self.bytes.below(self.structs.len())),
            _ => Ty::One(self.value_letter()),
        };
        let name = self.name("f");
        let mark = self.vars.len();
        let mut params = Vec::new();
        let mut list = Vec::new();
        for _ in 0..self.bytes.below(4) {
            let ty = self.formal_type();
            let pass = match self.bytes.below(8) {
                5 => Pass::Written,
                6 | 7 => Pass::Out,
                _ => Pass::In,
            };
            let name = self.name("a");
            let out = if pass == Pass::Out { "output " } else { "" };
            list.push(format!("{out}{}", Self::declarator(ty, &name)));
            self.vars.push(Var { name, ty, write: pass != Pass::In });
            params.push((ty, pass));
        }
        let word = match ret {
            Ty::Struct(id) => format!("S{id}"),
            Ty::One(letter) => word(letter).to_string(),
            _ => "void".to_string(),
        };
        self.line(&format!("{word} {name}({})", list.join(", ")));
        let outer = (self.returns.replace(ret), std::mem::replace(&mut self.left, 8));
        self.block(2);
        if ret != NOTHING {
            // Every path to the end returns a value.
            let at = self.text.trim_end().len() - 1;
            self.text.truncate(at);
            let value = self.returned(ret);
            self.line(&format!("    return {value};"));
            self.line("}");
        }
        (self.returns, self.left) = outer;
        self.vars.truncate(mark);
        self.functions.push(Function { name, ret, params });
    }

    fn shader(&mut self) {
        let kind = self.bytes.pick(&["shader", "surface", "displacement", "volume"]);
        self.line(&format!("{kind} generated("));
        for _ in 0..self.bytes.below(5) {
            let ty = self.param_type();
            self.param("a", ty, false);
        }
        let outputs = 1 + self.bytes.below(4);
        for _ in 0..outputs {
            let ty = self.param_type();
            self.param("r", ty, true);
        }
        if self.bytes.chance(60) && self.scope == Scope::All {
            self.param("k", Ty::One('K'), true);
        }
        self.param("last", Ty::One('f'), true);
        let at = self.text.trim_end().len() - 1;
        self.text.truncate(at);
        self.line(")");
        self.left = 8 + self.bytes.below(32);
        self.line("{");
        self.indent += 1;
        if self.bytes.chance(60) {
            self.declaration();
            self.function();
        }
        self.block(3);
        if self.scope == Scope::Walked {
            self.print_texts();
        }
        self.indent -= 1;
        self.line("}");
    }

    fn param_type(&mut self) -> Ty {
        let ty = self.any_type();
        if self.holds_structs(ty) { Ty::One('f') } else { ty }
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

    /// Prints the strings of the outputs, which have no planes.
    fn print_texts(&mut self) {
        let mut texts = Vec::new();
        let outputs: Vec<(String, Ty)> =
            self.vars.iter().filter(|var| var.write).map(|var| (var.name.clone(), var.ty)).collect();
        for (name, ty) in outputs {
            self.texts_of(ty, name, &mut texts);
        }
        if !texts.is_empty() {
            let format = " %s".repeat(texts.len());
            self.line(&format!("printf(\"={format}\\n\", {});", texts.join(", ")));
        }
    }

    fn texts_of(&self, ty: Ty, path: String, texts: &mut Vec<String>) {
        match ty {
            Ty::One('s') | Ty::Array('s', _) => texts.push(path),
            Ty::Struct(id) => {
                for (n, field) in self.structs[id].iter().enumerate() {
                    self.texts_of(*field, format!("{path}.m{n}"), texts);
                }
            }
            _ => {}
        }
    }
}
