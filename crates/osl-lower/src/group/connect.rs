//! Connections: which parameters, or parts of them, may be connected.
//!
//! A connection may widen a value (int to float, number to triple) and convert between kinds of triples, but
//! never narrow it. Components of triples and fields of structs may be connected, elements of arrays may not.

use super::{Connection, End, Group};
use osl_hir::hir::{MetaValue, Program};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::spelling::closest;
use std::sync::Arc;

/// Why two parameters cannot be connected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConnectError {
    /// There is no layer with this name; also the closest name.
    #[error("there is no layer `{0}`{hint}", hint = did_you_mean(.1, &[]))]
    NoLayer(String, Option<String>),
    /// The layer's shader has no such parameter.
    #[error("layer `{layer}` has no parameter `{name}`{hint}", hint = did_you_mean(.close, .known))]
    NoParameter {
        /// The layer.
        layer: String,
        /// The requested name.
        name: String,
        /// The closest name.
        close: Option<String>,
        /// The parameters that could be meant: outputs, if a value is to come from it.
        known: Vec<String>,
    },
    /// The part does not exist, or parts of this kind cannot be connected.
    #[error("`{0}` is no parameter, field or component that can be connected")]
    NoPart(String),
    /// The value comes from the same layer or a later one.
    #[error("layer `{from}` does not come before `{to}`: values go from a layer to a later one")]
    Order {
        /// The source.
        from: String,
        /// The destination.
        to: String,
    },
    /// The types do not match.
    #[error("a value of type {from} cannot go to one of type {to}")]
    Types {
        /// Type of the source.
        from: String,
        /// Type of the destination.
        to: String,
    },
    /// The metadata of the destination forbid it.
    #[error("parameter `{0}` is not to be connected (`allowconnect` is 0)")]
    Forbidden(String),
}

fn did_you_mean(close: &Option<String>, known: &[String]) -> String {
    match close {
        Some(close) => format!("; there is one named `{close}`"),
        None if known.is_empty() => String::new(),
        None => format!("; it has {}", known.join(", ")),
    }
}

/// Maximum number of parameters in a message.
const MOST_NAMES: usize = 20;

/// One end of a connection, resolved.
struct ConnectionEnd {
    end: End,
    ty: Type,
}

impl Group {
    /// Connects `from` to `to`, each given as a layer and a parameter or its part: `c`, `c[1]`, `c.g`,
    /// `s.field`.
    ///
    /// # Errors
    /// Why they cannot be connected; the group is then unchanged.
    pub fn connect(&mut self, from: (&str, &str), to: (&str, &str)) -> Result<(), ConnectError> {
        let (source, target) = (self.end(from, true)?, self.end(to, false)?);
        if source.end.layer >= target.end.layer {
            return Err(ConnectError::Order { from: from.0.to_string(), to: to.0.to_string() });
        }
        let (a, b) = (self.program(&source.end), self.program(&target.end));
        let param = b.shader.params.get(target.end.param);
        let forbids = |data: &(String, Arc<str>, MetaValue)| {
            &*data.1 == "allowconnect" && data.2 == MetaValue::Numbers(vec![0.0])
        };
        if param.is_some_and(|p| p.metadata.iter().any(forbids)) {
            return Err(ConnectError::Forbidden(to.1.to_string()));
        }
        if !suits((a, source.ty), (b, target.ty)) {
            let (from, to) = (a.structs.show(source.ty), b.structs.show(target.ty));
            return Err(ConnectError::Types { from, to });
        }
        self.connections.push(Connection { from: source.end, to: target.end });
        Ok(())
    }

    fn program(&self, end: &End) -> &Program {
        &self.layers[end.layer].program
    }

    fn end(&self, (layer, path): (&str, &str), output: bool) -> Result<ConnectionEnd, ConnectError> {
        let index = self.find(layer).ok_or_else(|| {
            let names = self.layers.iter().map(|l| &*l.name);
            ConnectError::NoLayer(layer.to_string(), closest(layer, names).map(str::to_string))
        })?;
        let program = &self.layers[index].program;
        let whole = format!("{layer}.{path}");
        let no_part = || ConnectError::NoPart(whole.clone());
        let (path, mut component) = match path.strip_suffix(']').and_then(|p| p.rsplit_once('[')) {
            Some((path, number)) => (path, Some(number)),
            None => (path, None),
        };
        let mut parts = path.split('.');
        let name = parts.next().unwrap_or("");
        let param = program.param(name).ok_or_else(|| {
            let names = program.shader.params.iter().map(|p| &*program.vars[p.var.0 as usize].name);
            let close = closest(name, names).map(str::to_string);
            let known = program.shader.params.iter().filter(|param| param.output == output);
            let known = known.filter_map(|param| program.vars.get(param.var.0 as usize));
            let known = known.map(|var| var.name.to_string()).take(MOST_NAMES).collect();
            ConnectError::NoParameter { layer: layer.to_string(), name: name.to_string(), close, known }
        })?;
        let mut ty = program.vars[program.shader.params[param].var.0 as usize].ty;
        if program.shader.params[param].open {
            ty.extent = Extent::Unsized;
        }
        let mut fields = Vec::new();
        for part in parts {
            // A component by its name is the last part.
            if let (true, None, Some(number)) = (ty.is_triple(), component, named_component(ty.base, part)) {
                component = Some(number);
                continue;
            }
            let of = ty.as_struct().ok_or_else(no_part)?;
            let (at, field) = program.structs.field(of, part).ok_or_else(no_part)?;
            ty = field.ty;
            fields.push(at);
        }
        let component = match component {
            None => None,
            Some(number) if ty.is_triple() => {
                ty = Type::FLOAT;
                Some(number.trim().parse().ok().filter(|n| *n < 3).ok_or_else(no_part)?)
            }
            Some(_) => return Err(no_part()),
        };
        Ok(ConnectionEnd { end: End { layer: index, param, fields, component }, ty })
    }
}

/// The number of a component of a triple.
fn named_component(base: Base, name: &str) -> Option<&'static str> {
    let names = if base == Base::Color { ["r", "g", "b"] } else { ["x", "y", "z"] };
    let at = names.iter().position(|n| *n == name)?;
    ["0", "1", "2"].get(at).copied()
}

/// Whether a value of one type may go to another: it may widen, but not narrow.
fn suits((a, from): (&Program, Type), (b, to): (&Program, Type)) -> bool {
    let lengths = match (from.extent, to.extent) {
        (Extent::One, Extent::One) | (Extent::Array(_), Extent::Unsized) => true,
        (Extent::Array(n), Extent::Array(m)) => n == m,
        // An open array without a given length keeps that of its default.
        (Extent::Unsized, Extent::Array(_) | Extent::Unsized) => true,
        _ => false,
    };
    let bases = match (from.base, to.base) {
        (Base::Struct(x), Base::Struct(y)) => {
            let (x, y) = (&a.structs.get(x).fields, &b.structs.get(y).fields);
            x.len() == y.len()
                && x.iter().zip(y).all(|(x, y)| suits((a, x.ty), (b, y.ty)) && suits((b, y.ty), (a, x.ty)))
        }
        (Base::Int, Base::Float) => true,
        (Base::Int | Base::Float, to) if to.is_triple() => !from.is_array(),
        (x, y) => x == y || (x.is_triple() && y.is_triple()),
    };
    lengths && bases
}
