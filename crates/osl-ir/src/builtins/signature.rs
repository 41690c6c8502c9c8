//! Signatures in a short notation, as the table writes them.
//!
//! `v(v,f)`: a return type and parameter types by letter: `i` int, `f` float, `c` color, `p` point, `v`
//! vector, `n` normal, `m` matrix, `s` string, `K` closure, `x` void, `?` anything. `o` before a letter makes
//! an output, `[]` behind it an array of any length. `…` at the end takes any further arguments, `*` pairs of
//! an option's name and value; behind the parameters of a closure, whatever follows a name.

use crate::types::{Base, Extent, StructTable, Type};

/// A signature of a built-in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Return type.
    pub ret: Type,
    /// Parameters.
    pub params: Vec<Param>,
    /// What may follow them.
    pub tail: Tail,
}

/// A parameter of a built-in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Param {
    /// Its type.
    pub ty: ParamType,
    /// Whether it is an output.
    pub output: bool,
}

/// The type that a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParamType {
    /// This type, or what converts to it.
    Of(Type),
    /// Any type.
    Any {
        /// Whether it has to be an array.
        array: bool,
    },
}

/// What may follow the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Nothing.
    None,
    /// Any arguments.
    Any,
    /// Pairs of a name and a value.
    KeyValue,
    /// What closures take: a name, and at least one further argument of any kind.
    Keywords,
}

impl Tail {
    /// Whether it takes arguments of these types.
    pub fn takes(self, given: &[Type]) -> bool {
        match self {
            Tail::None => given.is_empty(),
            Tail::Any => true,
            Tail::KeyValue => {
                given.len().is_multiple_of(2) && given.iter().step_by(2).all(|ty| *ty == Type::STRING)
            }
            Tail::Keywords => match given {
                [] => true,
                [first, rest @ ..] => {
                    let value = |ty: &Type| !matches!(ty.base, Base::Void | Base::Struct(_));
                    *first == Type::STRING && !rest.is_empty() && rest.iter().all(value)
                }
            },
        }
    }
}

impl Signature {
    /// Parses the notation; `None` where it is malformed.
    pub(super) fn parse(text: &str) -> Option<Signature> {
        let (ret, rest) = text.split_once('(')?;
        let inner = rest.strip_suffix(')')?;
        let mut signature = Signature { ret: letter(ret)?, params: Vec::new(), tail: Tail::None };
        for part in inner.split(',').filter(|p| !p.is_empty()) {
            match part {
                "…" => signature.tail = Tail::Any,
                "*" if signature.ret == Type::CLOSURE => signature.tail = Tail::Keywords,
                "*" => signature.tail = Tail::KeyValue,
                _ => signature.params.push(param(part)?),
            }
        }
        Some(signature)
    }

    /// The signature as the language would declare it.
    pub fn show(&self, name: &str) -> String {
        let structs = StructTable::default();
        let params = self.params.iter().map(|p| {
            let ty = match p.ty {
                ParamType::Of(ty) => structs.show(ty),
                ParamType::Any { array: false } => "any".to_string(),
                ParamType::Any { array: true } => "any[]".to_string(),
            };
            if p.output { format!("output {ty}") } else { ty }
        });
        let tail = match self.tail {
            Tail::None => None,
            Tail::Any => Some("...".to_string()),
            Tail::KeyValue | Tail::Keywords => Some("\"option\", value, ...".to_string()),
        };
        let all: Vec<String> = params.chain(tail).collect();
        format!("{} {name}({})", structs.show(self.ret), all.join(", "))
    }
}

fn param(part: &str) -> Option<Param> {
    let (part, output) = match part.strip_prefix('o') {
        Some(rest) => (rest, true),
        None => (part, false),
    };
    let (part, array) = match part.strip_suffix("[]") {
        Some(rest) => (rest, true),
        None => (part, false),
    };
    if part == "?" {
        return Some(Param { ty: ParamType::Any { array }, output });
    }
    let mut ty = letter(part)?;
    if array {
        ty.extent = Extent::Unsized;
    }
    Some(Param { ty: ParamType::Of(ty), output })
}

fn letter(text: &str) -> Option<Type> {
    Some(Type::one(match text {
        "i" => Base::Int,
        "f" => Base::Float,
        "c" => Base::Color,
        "p" => Base::Point,
        "v" => Base::Vector,
        "n" => Base::Normal,
        "m" => Base::Matrix,
        "s" => Base::String,
        "K" => Base::Closure,
        "x" => Base::Void,
        _ => return None,
    }))
}
