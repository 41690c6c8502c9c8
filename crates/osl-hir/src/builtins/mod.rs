//! The one table of built-in functions.
//!
//! A row is all there is to know of a function: name, meaning, signatures, names of parameters, derivatives,
//! what happens at the edges, an example, and how a call becomes IR. Type checking, "did you mean", lowering
//! and the reference page read it; the arithmetic itself is that of the [lane operations](osl_ir::ir::LaneOp)
//! that the row names. Rows stand in the file of their family; within a row the order of signatures is the
//! priority for ties. Source of the signatures: OSL language specification, chapter on the standard library.

mod closure;
mod color;
mod derivative;
mod facts;
mod geometry;
mod math;
mod matrix;
mod message;
mod noise;
mod number;
mod optics;
mod print;
mod scene;
mod signature;
mod spline;
mod string;
mod texture;

pub use closure::component;
pub use facts::{Asks, Compiled, Facts, LeftOut, Spaces};
pub use message::carry as carry_messages;
pub use signature::{Param, ParamType, Signature, Tail};
pub(crate) use texture::OPTIONS;

use osl_ir::ir::{Builder, LaneOp, Names, SlotId, ValueId};
use osl_ir::types::Type;
use rustc_hash::FxHashMap;
use std::sync::{Arc, OnceLock};

/// A built-in function.
pub struct Builtin {
    /// Its name; constructors with a space name have one that no program can write.
    pub name: &'static str,
    /// Its meaning, with units and ranges, in one or two sentences.
    pub about: &'static str,
    /// Its derivatives, `cos(x) dx` or in words; `dx` is the change of the argument x.
    pub derivatives: &'static str,
    /// What it gives at the edges of its domain and beyond: zeros, denormals, infinities, nan, huge
    /// arguments.
    pub extremes: &'static str,
    /// One or two statements that use it, which compile in a surface without a warning.
    pub example: &'static str,
    /// Its signatures in the notation of [`Signature`].
    sigs: &'static [&'static str],
    /// The names of the parameters, in the notation of [`Signature`].
    params: &'static str,
    /// How a call becomes IR.
    pub emit: Emit,
    /// What else is to be known of it.
    pub facts: Facts,
}

/// Writes the IR of a call.
#[derive(Clone, Copy)]
pub enum Emit {
    /// One lane operation on the arguments in order.
    Lane(LaneOp),
    /// Written by a function, which returns the result and the outputs.
    Compose(fn(&mut Builder, &Site<'_>) -> Emitted),
    /// Ends the shader.
    Exit,
}

/// A call that is being written.
pub struct Site<'a> {
    /// Values of the arguments, converted to the signature's types; arbitrary for an array.
    pub args: &'a [ValueId],
    /// Types of the arguments.
    pub types: &'a [Type],
    /// The arguments that are arrays.
    pub arrays: &'a [Option<Array>],
    /// The text of each argument that is a string literal.
    pub literals: &'a [Option<Arc<str>>],
    /// The chosen signature.
    pub signature: &'a Signature,
    /// The names of the shader.
    pub names: &'a Names,
    /// How the first argument is connected, if it is a parameter: 1 upstream, 2 downstream.
    pub connected: i32,
}

/// An argument that is an array.
#[derive(Clone, Copy, Debug)]
pub struct Array {
    /// Its slot.
    pub slot: SlotId,
    /// How many elements it has.
    pub len: u32,
    /// Type of an element.
    pub ty: Type,
}

impl Site<'_> {
    /// An argument. Resolution has checked their number; a missing one reads as the first value of the body.
    pub fn arg(&self, index: usize) -> ValueId {
        self.args.get(index).copied().unwrap_or(ValueId(0))
    }

    /// An argument that is an array.
    pub fn array(&self, index: usize) -> Option<Array> {
        self.arrays.get(index).copied().flatten()
    }

    /// The text of an argument that is a string literal.
    pub fn literal(&self, index: usize) -> Option<&Arc<str>> {
        self.literals.get(index).and_then(Option::as_ref)
    }
}

/// The results of a call.
#[derive(Debug, Default)]
pub struct Emitted {
    /// Its value.
    pub result: Option<ValueId>,
    /// Values for output arguments, with their positions.
    pub outputs: Vec<(usize, ValueId)>,
}

impl From<ValueId> for Emitted {
    fn from(value: ValueId) -> Emitted {
        Emitted { result: Some(value), outputs: Vec::new() }
    }
}

impl std::fmt::Debug for Builtin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Builtin {
    /// A row whose call is one lane operation.
    const fn lane(
        name: &'static str,
        sigs: &'static [&'static str],
        params: &'static str,
        op: LaneOp,
        about: &'static str,
    ) -> Builtin {
        Builtin::new(name, (sigs, params), Emit::Lane(op), about)
    }

    /// A row whose call is composed.
    const fn compose(
        name: &'static str,
        sigs: &'static [&'static str],
        params: &'static str,
        emit: fn(&mut Builder, &Site<'_>) -> Emitted,
        about: &'static str,
    ) -> Builtin {
        Builtin::new(name, (sigs, params), Emit::Compose(emit), about)
    }

    /// The row that ends the shader.
    const fn exit(
        name: &'static str,
        sigs: &'static [&'static str],
        params: &'static str,
        about: &'static str,
    ) -> Builtin {
        Builtin::new(name, (sigs, params), Emit::Exit, about)
    }

    const fn new(
        name: &'static str,
        (sigs, params): (&'static [&'static str], &'static str),
        emit: Emit,
        about: &'static str,
    ) -> Builtin {
        Builtin {
            name,
            about,
            derivatives: "",
            extremes: "",
            example: "",
            sigs,
            params,
            emit,
            facts: Facts::USUAL,
        }
    }

    /// The row with what its derivatives are.
    const fn derivatives(self, derivatives: &'static str) -> Builtin {
        Builtin { derivatives, ..self }
    }

    /// The row with its results at the edges.
    const fn extremes(self, extremes: &'static str) -> Builtin {
        Builtin { extremes, ..self }
    }

    /// The row with its example.
    const fn example(self, example: &'static str) -> Builtin {
        Builtin { example, ..self }
    }

    /// The type of the value of an option that is an output.
    pub fn output_option(&self, option: &str) -> Option<Type> {
        self.facts.lookup.then(|| texture::output_option(option)).flatten()
    }

    /// The signatures, in order of priority.
    pub fn signatures(&'static self) -> &'static [Signature] {
        let parsed = || self.sigs.iter().filter_map(|s| Signature::parse(s, self.params)).collect();
        index().get(self.name).map_or(&[], |(_, signatures)| signatures.get_or_init(parsed))
    }

    /// Number of signatures as written; equal to the number parsed.
    #[cfg(test)]
    fn written(&self) -> usize {
        self.sigs.len()
    }
}

/// Rows that belong together.
pub struct Family {
    /// Their subject, as a heading.
    pub title: &'static str,
    /// Where they are defined.
    pub source: &'static str,
    /// The rows.
    pub rows: &'static [Builtin],
}

/// The standard library's page of the public specification, by section.
macro_rules! specified {
    ($section:literal) => {
        concat!("OSL language specification, standard library: ", $section, ".")
    };
}

/// All families.
pub static FAMILIES: [Family; 15] = [
    Family {
        title: "Angles, exponentials, roots",
        source: concat!(
            specified!("mathematical functions"),
            " The values are those of OpenImageIO's approximations (fmath.h), product by product and sum by \
             sum."
        ),
        rows: math::ROWS,
    },
    Family {
        title: "Rounding, comparing, blending",
        source: specified!("mathematical functions, pattern generation"),
        rows: number::ROWS,
    },
    Family { title: "Geometry", source: specified!("geometric functions"), rows: geometry::ROWS },
    Family { title: "Light at a boundary", source: specified!("geometric functions"), rows: optics::ROWS },
    Family {
        title: "Derivatives and antialiasing",
        source: specified!("derivatives and area operators"),
        rows: derivative::ROWS,
    },
    Family { title: "Matrices and spaces", source: specified!("matrix functions"), rows: matrix::ROWS },
    Family {
        title: "Color",
        source: concat!(specified!("color functions"), " Observer: CIE 1931."),
        rows: color::ROWS,
    },
    Family { title: "Splines", source: specified!("pattern generation, splines"), rows: spline::ROWS },
    Family {
        title: "Noise",
        source: concat!(
            specified!("pattern generation, noise"),
            " Fields: Perlin, Improving Noise, 2002; Gustavson, Simplex noise demystified, 2005; Lagae et al., \
             Procedural noise using sparse Gabor convolution, 2009; hash: Jenkins, lookup3."
        ),
        rows: noise::ROWS,
    },
    Family { title: "Textures", source: specified!("texture"), rows: texture::ROWS },
    Family { title: "Strings and hashing", source: specified!("string functions"), rows: string::ROWS },
    Family { title: "Printing", source: specified!("string functions, output"), rows: print::ROWS },
    Family {
        title: "Messages",
        source: specified!("renderer state and message passing"),
        rows: message::ROWS,
    },
    Family {
        title: "Surroundings",
        source: specified!("renderer state, dictionaries, point clouds, tracing"),
        rows: scene::ROWS,
    },
    Family {
        title: "Closures",
        source: concat!(
            specified!("material closures"),
            " MaterialX for those that end in bsdf, edf or vdf."
        ),
        rows: closure::ROWS,
    },
];

/// All rows, family by family.
pub fn all() -> impl Iterator<Item = &'static Builtin> {
    FAMILIES.iter().flat_map(|family| family.rows)
}

type Index = FxHashMap<&'static str, (&'static Builtin, OnceLock<Vec<Signature>>)>;

/// The rows by name, with their signatures, which are parsed when they are asked for: a shader calls few
/// functions.
fn index() -> &'static Index {
    static INDEX: OnceLock<Index> = OnceLock::new();
    INDEX.get_or_init(|| all().map(|row| (row.name, (row, OnceLock::new()))).collect())
}

/// The row of a name.
pub fn find(name: &str) -> Option<&'static Builtin> {
    index().get(name).map(|(row, _)| *row)
}

/// The row of an operation of a compiled shader.
pub(crate) fn of_operation(name: &str) -> Option<&'static Builtin> {
    let by_result = |row: &&Builtin| match row.facts.compiled {
        Compiled::ByResult(names) => names.iter().any(|(_, operation)| *operation == name),
        _ => false,
    };
    find(name).filter(|row| !row.name.contains(' ')).or_else(|| all().find(by_result))
}

/// Names that a program can call.
pub fn names() -> impl Iterator<Item = &'static str> {
    all().map(|row| row.name).filter(|name| !name.contains(' '))
}

/// One form for each of normal, vector, point, color, float.
const T1: &[&str] = &["n(n)", "v(v)", "p(p)", "c(c)", "f(f)"];
/// The same with two arguments of the type.
const T2: &[&str] = &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "f(f,f)"];
/// Two arguments, the second of the type or a float.
const T2F: &[&str] =
    &["n(n,n)", "v(v,v)", "p(p,p)", "c(c,c)", "n(n,f)", "v(v,f)", "p(p,f)", "c(c,f)", "f(f,f)"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signature_parses() {
        for row in all() {
            assert_eq!(row.signatures().len(), row.written(), "{}", row.name);
        }
    }

    #[test]
    fn every_parameter_has_a_name() {
        for row in all() {
            for signature in row.signatures() {
                let mut names: Vec<_> = signature.params.iter().map(|p| p.name).collect();
                let plain = |name: &str| {
                    name.starts_with(|c: char| c.is_ascii_alphabetic())
                        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
                };
                assert!(names.iter().all(|name| plain(name)), "{}: {names:?}", row.name);
                names.sort_unstable();
                names.dedup();
                assert_eq!(names.len(), signature.params.len(), "{}: a name twice", row.name);
            }
        }
    }

    /// No list of names is there for nothing.
    #[test]
    fn every_list_of_names_is_used() {
        for row in all() {
            for list in
                row.params.split('|').map(|list| list.split(',').filter(|n| !n.trim().is_empty()).count())
            {
                let uses = |s: &Signature| s.params.len() == list;
                assert!(list == 0 || row.signatures().iter().any(uses), "{}: {}", row.name, row.params);
            }
        }
    }

    #[test]
    fn every_row_is_documented() {
        for row in all() {
            for (text, what) in [
                (row.about, "about"),
                (row.derivatives, "derivatives"),
                (row.extremes, "extremes"),
                (row.example, "example"),
            ] {
                assert!(!text.is_empty(), "{}: {what}", row.name);
            }
            let called = row.name.split(' ').next().unwrap_or_default();
            assert!(row.example.contains(called), "{}: the example does not use it", row.name);
            assert!(row.about.ends_with('.') && row.extremes.ends_with('.'), "{}", row.name);
            assert!(!row.derivatives.ends_with('.'), "{}", row.name);
        }
    }

    #[test]
    fn names_are_declared_once() {
        let mut names: Vec<_> = all().map(|r| r.name).collect();
        names.sort_unstable();
        let before = names.len();
        names.dedup();
        assert_eq!(names.len(), before);
    }
}
