//! The short notation for signatures in the table.
//!
//! `v(v,f)`: a return type and parameter types by letter: `i` int, `f` float, `c` color, `p` point, `v`
//! vector, `n` normal, `m` matrix, `s` string, `K` closure, `x` void, `?` anything. `o` before a letter marks
//! an output, `[]` after it an array of any length. `…` at the end accepts any further arguments, `*` pairs
//! of an option's name and value; after the parameters of a closure, `*` accepts anything after a name.
//!
//! Names of parameters are in a separate list, `edge0, edge1, x`, for all signatures of a row: the first
//! parameter has the first name. If signatures of different lengths have different names, there are several
//! lists, separated by `|`: a signature uses the list of its length, or else the first longer one. A name
//! after a type, `f(p p,f t)`, takes precedence over the list.

use osl_ir::types::{Base, Extent, StructTable, Type};

/// A signature of a built-in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Return type.
    pub ret: Type,
    /// Parameters.
    pub params: Vec<Param>,
    /// The arguments that may follow them.
    pub tail: Tail,
}

/// A parameter of a built-in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Param {
    /// Its name; empty if it is not known.
    pub name: &'static str,
    /// Its type.
    pub ty: ParamType,
    /// Whether it is an output.
    pub output: bool,
}

impl Param {
    /// Whether an argument of this type becomes another one. Arrays stay as they are.
    fn converts(&self, given: Type) -> bool {
        matches!(self.ty, ParamType::Of(ty) if ty != given && !self.output && !ty.is_array() && !given.is_error())
    }
}

/// The type that a parameter accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParamType {
    /// This type, or types that convert to it.
    Of(Type),
    /// Any type.
    Any {
        /// Whether it must be an array.
        array: bool,
    },
}

/// The arguments that may follow the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Nothing.
    None,
    /// Any arguments.
    Any,
    /// Pairs of a name and a value.
    KeyValue,
    /// Keyword arguments of closures: a name, and at least one further argument of any kind.
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
    /// The numbers of the arguments of these types that are converted, from 0.
    pub(crate) fn converted(&self, given: impl Iterator<Item = Type>) -> Vec<usize> {
        let converts = |(index, ty): (usize, Type)| {
            self.params.get(index).is_some_and(|param| param.converts(ty)).then_some(index)
        };
        given.enumerate().filter_map(converts).collect()
    }

    /// Parses the notation and the names of the parameters; `None` if one of them is malformed.
    pub(super) fn parse(text: &'static str, names: &'static str) -> Option<Signature> {
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
        let count = signature.params.len();
        let lists =
            || names.split('|').map(|list| list.split(',').map(str::trim).filter(|name| !name.is_empty()));
        let list = lists().find(|list| list.clone().count() == count);
        let list = list.or_else(|| lists().find(|list| list.clone().count() > count));
        let mut list = list.into_iter().flatten();
        for param in &mut signature.params {
            let listed = list.next();
            if param.name.is_empty() {
                param.name = listed?;
            }
        }
        Some(signature)
    }

    /// The signature as a declaration in the language.
    pub fn show(&self, name: &str) -> String {
        let structs = StructTable::default();
        let params = self.params.iter().map(|p| {
            let ty = match p.ty {
                ParamType::Of(ty) => structs.show(ty),
                ParamType::Any { array: false } => "any".to_string(),
                ParamType::Any { array: true } => "any[]".to_string(),
            };
            let output = if p.output { "output " } else { "" };
            match (p.name, ty.strip_suffix("[]")) {
                ("", _) => format!("{output}{ty}"),
                (name, None) => format!("{output}{ty} {name}"),
                (name, Some(element)) => format!("{output}{element} {name}[]"),
            }
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

fn param(part: &'static str) -> Option<Param> {
    let (part, name) = part.split_once(' ').unwrap_or((part, ""));
    let (part, output) = match part.strip_prefix('o') {
        Some(rest) => (rest, true),
        None => (part, false),
    };
    let (part, array) = match part.strip_suffix("[]") {
        Some(rest) => (rest, true),
        None => (part, false),
    };
    if part == "?" {
        return Some(Param { name, ty: ParamType::Any { array }, output });
    }
    let mut ty = letter(part)?;
    if array {
        ty.extent = Extent::Unsized;
    }
    Some(Param { name, ty: ParamType::Of(ty), output })
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
