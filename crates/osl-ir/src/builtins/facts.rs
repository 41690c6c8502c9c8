//! Facts of a row beside its texts: what lints, resolution and compiled shaders ask of a function.
//!
//! This module must not know who asks.

use super::Builtin;
use crate::types::Type;

/// What the strings among the arguments of a function name, if they are names of spaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spaces {
    /// A space of coordinates: `common`, `object`, those of the scene.
    Coordinates,
    /// A color space that a constructor takes.
    OfColor,
    /// A color space that a conversion takes: it knows some more.
    OfConversion,
}

/// What a function asks about a variable, of which it does not take the value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asks {
    /// How many elements it has.
    Length,
    /// How it is connected.
    Connection,
    /// Whether it is constant.
    Constancy,
}

/// The arguments whose derivatives a function reads by itself. What it is composed of is not counted where
/// compiled shaders write that out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Differentiates {
    /// These, counted from 0.
    Arguments(&'static [usize]),
    /// The coordinates behind the name of a noise, if the noise of this name filters itself, or the name is
    /// not known.
    Noise(&'static str),
}

/// What a compiled shader writes for a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compiled {
    /// An operation of the function's own name.
    Own,
    /// An operation of another name.
    As(&'static str),
    /// An operation whose name depends on the type of the result; for other types it is the function's own.
    ByResult(&'static [(Type, &'static str)]),
    /// An operation of this name on the space and on each part of the value: a constructor.
    Parts(&'static str),
    /// Several operations, where the arguments are of the usual form; otherwise one of the function's own
    /// name.
    Composed(Composed),
}

/// The functions that compiled shaders write as several operations, since renderers have none for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each variant is the function of its name")]
pub enum Composed {
    Mod,
    Mix,
    Log,
    Hypot,
    Reflect,
    Refract,
    FaceForward,
    AaStep,
    Substr,
    Concat,
    /// Whether the ray is of a kind.
    RayKind(&'static str),
}

/// An argument that a short form leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// The number 0.
    Zero,
    /// The zero vector.
    ZeroVector,
    /// The same as another argument of the short form, counted from 0.
    Same(usize),
}

/// The facts of a row. Most functions have the usual ones.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// Which argument is a format string. What follows is printed, so that it is only read; what follows the
    /// parameters of other functions may be written.
    pub format: Option<usize>,
    /// What it asks about its first argument.
    pub asks: Option<Asks>,
    /// Whether it asks the renderer or other shaders for something, and leaves its output as it is where they
    /// do not have it.
    pub query: bool,
    /// Whether the options of texture lookups may follow its parameters.
    pub lookup: bool,
    /// What the strings among its arguments name.
    pub spaces: Option<Spaces>,
    /// The arguments whose derivatives it reads.
    pub differentiates: Differentiates,
    /// What a compiled shader writes for it.
    pub compiled: Compiled,
    /// The form of so many parameters, and what it leaves out of the one form that compiled shaders know, by
    /// its place there.
    pub left_out: (usize, &'static [(usize, LeftOut)]),
}

impl Facts {
    /// The facts of a function of which nothing else is said.
    pub(super) const USUAL: Facts = Facts {
        format: None,
        asks: None,
        query: false,
        lookup: false,
        spaces: None,
        differentiates: Differentiates::Arguments(&[]),
        compiled: Compiled::Own,
        left_out: (0, &[]),
    };
}

impl Builtin {
    /// The row with the format string at an argument.
    pub(super) const fn format(self, at: usize) -> Builtin {
        Builtin { facts: Facts { format: Some(at), ..self.facts }, ..self }
    }

    /// The row of a function that asks about a variable.
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

    /// The row with what its strings name.
    pub(super) const fn spaces(self, spaces: Spaces) -> Builtin {
        Builtin { facts: Facts { spaces: Some(spaces), ..self.facts }, ..self }
    }

    /// The row with the arguments whose derivatives it reads.
    pub(super) const fn differentiates(self, differentiates: Differentiates) -> Builtin {
        Builtin { facts: Facts { differentiates, ..self.facts }, ..self }
    }

    /// The row with what its form of so many parameters leaves out.
    pub(super) const fn left_out(self, params: usize, left_out: &'static [(usize, LeftOut)]) -> Builtin {
        Builtin { facts: Facts { left_out: (params, left_out), ..self.facts }, ..self }
    }

    /// The row of a function that compiled shaders write as several operations.
    pub(super) const fn composed(self, composed: Composed) -> Builtin {
        self.compiled(Compiled::Composed(composed))
    }

    /// The row with what compiled shaders write for it.
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

    /// An argument that a fact speaks of is there in every signature, and of the kind that it speaks of.
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
                if let Differentiates::Arguments(list) = facts.differentiates {
                    let smooth = |at: &usize| is(params.get(*at), |ty| ty == Type::FLOAT || ty.is_triple());
                    assert!(list.iter().all(smooth), "{}: differentiates", row.name);
                }
            }
        }
    }

    /// Where strings name spaces, the names of the parameters say so, and the reverse.
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
