//! Facts of a row in addition to its texts: what lints, resolution and compiled shaders need to know about a
//! function.

use super::Builtin;
use osl_ir::types::Type;

/// What the string arguments of a function name, if they are names of spaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spaces {
    /// A coordinate space: `common`, `object`, or one of the scene.
    Coordinates,
    /// A color space that a constructor accepts.
    OfColor,
    /// A color space that a conversion accepts: there are some more of these.
    OfConversion,
}

/// A property of a variable that a function reads instead of its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asks {
    /// The number of its elements.
    Length,
    /// Its connections.
    Connection,
    /// Whether it is constant.
    Constancy,
}

/// The operation of a compiled shader for a call, if run times have one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compiled {
    /// An operation with the function's own name.
    Own,
    /// An operation with another name.
    As(&'static str),
    /// An operation whose name depends on the type of the result; for other types it has the function's own
    /// name.
    ByResult(&'static [(Type, &'static str)]),
    /// An operation with this name, on the space and on each part of the value: a constructor.
    Parts(&'static str),
}

/// An argument that a short form omits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// The number 0.
    Zero,
    /// The zero vector.
    ZeroVector,
    /// The same as another argument of the short form, counted from 0.
    Same(usize),
}

/// The facts of a row. Most functions have the usual facts.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// Which argument is a format string. The arguments after it are printed, so they are only read; further
    /// arguments of other functions may be written.
    pub format: Option<usize>,
    /// The property of its first argument that it reads.
    pub asks: Option<Asks>,
    /// Whether it is a query to the renderer or to other shaders, which leaves its output unchanged if it
    /// fails.
    pub query: bool,
    /// Whether the options of texture lookups may follow its parameters.
    pub lookup: bool,
    /// Whether its result depends on the object, the ray or the scene, beyond what the globals of a point
    /// say.
    pub scene: bool,
    /// What its string arguments name.
    pub spaces: Option<Spaces>,
    /// Its form in a compiled shader.
    pub compiled: Compiled,
    /// The number of parameters of a short form, and the arguments that it omits, by their positions in the
    /// one form that compiled shaders have.
    pub left_out: (usize, &'static [(usize, LeftOut)]),
}

impl Facts {
    /// The facts of a function without special ones.
    pub(super) const USUAL: Facts = Facts {
        format: None,
        asks: None,
        query: false,
        lookup: false,
        scene: false,
        spaces: None,
        compiled: Compiled::Own,
        left_out: (0, &[]),
    };
}

impl Builtin {
    /// The row, with the format string at this argument.
    pub(super) const fn format(self, at: usize) -> Builtin {
        Builtin { facts: Facts { format: Some(at), ..self.facts }, ..self }
    }

    /// The row of a function that reads a property of a variable.
    pub(super) const fn asks(self, asks: Asks) -> Builtin {
        Builtin { facts: Facts { asks: Some(asks), ..self.facts }, ..self }
    }

    /// The row of a query.
    pub(super) const fn query(self) -> Builtin {
        Builtin { facts: Facts { query: true, ..self.facts }, ..self }
    }

    /// The row of a texture lookup.
    pub(super) const fn lookup(self) -> Builtin {
        Builtin { facts: Facts { lookup: true, ..self.facts }, ..self }
    }

    /// The row of a function whose result depends on the object, the ray or the scene.
    pub(super) const fn scene(self) -> Builtin {
        Builtin { facts: Facts { scene: true, ..self.facts }, ..self }
    }

    /// The row, with what its strings name.
    pub(super) const fn spaces(self, spaces: Spaces) -> Builtin {
        Builtin { facts: Facts { spaces: Some(spaces), ..self.facts }, ..self }
    }

    /// The row, with the arguments that its form with this number of parameters omits.
    pub(super) const fn left_out(self, params: usize, left_out: &'static [(usize, LeftOut)]) -> Builtin {
        Builtin { facts: Facts { left_out: (params, left_out), ..self.facts }, ..self }
    }

    /// The row, with its form in a compiled shader.
    pub(super) const fn compiled(self, compiled: Compiled) -> Builtin {
        Builtin { facts: Facts { compiled, ..self.facts }, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ParamType, Tail, all};
    use super::*;

    fn is(param: Option<&super::super::Param>, suits: impl Fn(Type) -> bool) -> bool {
        matches!(param.map(|p| p.ty), Some(ParamType::Of(ty)) if suits(ty))
    }

    /// An argument that a fact refers to exists in every signature, and has the right type.
    #[test]
    fn facts_suit_the_signatures() {
        for row in all() {
            for signature in row.signatures() {
                let (facts, params) = (&row.facts, &signature.params);
                if let Some(at) = facts.format {
                    assert!(is(params.get(at), |ty| ty == Type::STRING), "{}: format", row.name);
                    assert_eq!((signature.tail, params.len()), (Tail::Any, at + 1), "{}: values", row.name);
                }
                if facts.asks.is_some() {
                    let any = matches!(params[..], [super::super::Param { ty: ParamType::Any { .. }, .. }]);
                    assert!(any, "{}: asks", row.name);
                }
                if facts.query {
                    let output = params.last().is_some_and(|p| p.output);
                    assert!(output && signature.ret == Type::INT, "{}: query", row.name);
                }
                if facts.lookup {
                    assert_eq!(signature.tail, Tail::KeyValue, "{}: lookup", row.name);
                }
            }
        }
    }

    /// If strings name spaces, their parameters are named accordingly, and vice versa.
    #[test]
    fn names_of_spaces_are_named_so() {
        for row in all() {
            for param in row.signatures().iter().flat_map(|s| &s.params) {
                let string = is(Some(param), |ty| ty == Type::STRING);
                let space = param.name.ends_with("space");
                assert_eq!(string && row.facts.spaces.is_some(), space, "{}: {}", row.name, param.name);
            }
        }
    }

    /// Each operation of a compiled shader is found again, except those that constructors write.
    #[test]
    fn operations_are_found_by_their_names() {
        let found = |name: &str| super::super::of_operation(name).map(|row| row.name);
        for row in all().filter(|row| !row.name.contains(' ')) {
            assert_eq!(found(row.name), Some(row.name));
            if let Compiled::ByResult(names) = row.facts.compiled {
                names.iter().for_each(|(_, name)| assert_eq!(found(name), Some(row.name), "{name}"));
            }
        }
        assert_eq!(found("transformn"), Some("transform"));
        assert_eq!(found("point in space"), None);
    }
}
