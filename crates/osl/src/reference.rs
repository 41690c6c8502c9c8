//! The reference of the language's built-in functions, as data, for help, completion and signature hints.
//!
//! It comes from the table with which the compiler works.
//!
//! ```
//! let smoothstep = &osl::reference::find("smoothstep")[0];
//! let signature = &smoothstep.signatures[0];
//! assert_eq!(signature.params.iter().map(|p| p.name).collect::<Vec<_>>(), ["edge0", "edge1", "x"]);
//! assert_eq!(osl::reference::closest("smothstep"), Some("smoothstep"));
//! ```

mod topics;

pub use topics::{Topic, topic, topics};

pub use osl_hir::resolve::{Elsewhere, elsewhere};

use osl_hir::builtins::{self, Builtin, FAMILIES, ParamType, Tail};
use osl_ir::types::StructTable;

/// The rules for all operators and functions: a heading and a text.
pub const RULES: [(&str, &str); 8] = [
    (
        "Floats",
        "Floats have single precision, and every operation is rounded. Denormals and the sign of zero are \
         kept. Only the sign of a zero derivative may depend on which values are known at compile time.",
    ),
    (
        "a / b",
        "The result is 0 if the quotient is not finite: x/0, 0/0, inf/2 and 1e38/1e-10 are 0. There is one \
         exception: if a varies from point to point, and b is a number other than 0 that is known at compile \
         time, the result may be inf or nan. For ints, b = 0 gives 0, and -2147483648/-1 is -2147483648.",
    ),
    ("a % b", "Both operands must be ints. The result has the sign of a, and is 0 for b = 0."),
    ("Int arithmetic", "Ints wrap at 32 bits. Shifts use only the low five bits of their distance."),
    (
        "(int) x",
        "The cast removes the fraction. The result is -2147483648 for nan, inf, -inf, and all numbers out of \
         range.",
    ),
    (
        "Comparisons",
        "All six comparisons, including == and !=, are true if an operand is nan. A condition that is nan is \
         true too.",
    ),
    (
        "Indices",
        "Indices of arrays, components and matrices are clamped to the valid range, and the run reports an \
         error.",
    ),
    (
        "nan",
        "The sign and payload of a nan are the only results that may differ between processors; see isnan.",
    ),
];

/// A built-in function, or a constructor such as `color in space`, whose name contains a space.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// The subject of the functions to which it belongs.
    pub family: &'static str,
    /// Where it is defined.
    pub source: &'static str,
    /// Its signatures, in order of priority; empty for constructors, whose description shows their form.
    pub signatures: Vec<Signature>,
    /// Its meaning, with units and ranges.
    pub about: &'static str,
    /// Its derivatives, `cos(x) dx` or in words; `dx` is the change of the argument x.
    pub derivatives: &'static str,
    /// Its results at the edges of its domain and beyond.
    pub extremes: &'static str,
    /// One or two statements that use it.
    pub example: &'static str,
}

/// One way to call a function.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Signature {
    /// As a declaration: `float smoothstep(float edge0, float edge1, float x)`.
    pub text: String,
    /// The type of the result.
    pub returns: String,
    /// The parameters.
    pub params: Vec<Parameter>,
    /// Whether more arguments may follow, such as pairs of an option's name and its value.
    pub more: bool,
}

/// A parameter of a built-in function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its name; may be empty.
    pub name: &'static str,
    /// Its type; `any` or `any[]` if it takes every type.
    pub ty: String,
    /// Whether the function writes it.
    pub output: bool,
}

/// All functions, family by family.
pub fn functions() -> Vec<Function> {
    builtins::all().map(function).collect()
}

/// The functions with a name: one, or the constructors with a space that start with it.
pub fn find(name: &str) -> Vec<Function> {
    let begins = |row: &&Builtin| row.name.split_once(' ').is_some_and(|(first, _)| first == name);
    builtins::all().filter(|row| row.name == name || begins(row)).map(function).collect()
}

/// The names of the parameters of a function's form with so many parameters; empty if there is none.
pub fn parameter_names(function: &str, count: usize) -> Vec<&'static str> {
    let forms = builtins::find(function).map_or(&[][..], Builtin::signatures);
    let form = forms.iter().find(|form| form.params.len() == count);
    form.map_or_else(Vec::new, |form| form.params.iter().map(|param| param.name).collect())
}

/// The fields that the first argument of `noise` and `pnoise` names, each with its range and its look.
pub const NOISE_FIELDS: [(&str, &str, &str); 7] = [
    ("perlin", "-1 to 1", "soft bumps, 0 at whole coordinates; the same as `snoise`"),
    ("uperlin", "0 to 1", "the same around 0.5; `noise` without a name gives this"),
    ("simplex", "-1 to 1", "soft bumps without a visible grid"),
    ("usimplex", "0 to 1", "simplex noise around 0.5"),
    ("cell", "0 to 1", "one value for each unit cell, with hard edges between cells"),
    ("hash", "0 to 1", "a different value at every point: white noise"),
    ("gabor", "about -1 to 1", "stripes and waves of a chosen width and direction"),
];

/// The existing name that is closest to an unknown one: a name that it is the beginning of, else the one with
/// the most similar spelling, among functions and [`topics`].
pub fn closest(name: &str) -> Option<&'static str> {
    let names: Vec<&'static str> =
        builtins::names().chain(topics().into_iter().map(|topic| topic.name)).collect();
    let begun = names.iter().copied().filter(|known| name.len() >= MIN_BEGINNING && known.starts_with(name));
    begun.min_by_key(|known| (known.len(), *known)).or_else(|| osl_syntax::spelling::closest(name, names))
}

/// A shorter word is the beginning of too many names.
const MIN_BEGINNING: usize = 3;

fn function(row: &'static Builtin) -> Function {
    let family = FAMILIES.iter().find(|family| family.rows.iter().any(|r| r.name == row.name));
    let signatures = if row.name.contains(' ') { &[] } else { row.signatures() };
    Function {
        name: row.name,
        family: family.map_or("", |f| f.title),
        source: family.map_or("", |f| f.source),
        signatures: signatures.iter().map(|s| signature(row.name, s)).collect(),
        about: row.about,
        derivatives: row.derivatives,
        extremes: row.extremes,
        example: row.example,
    }
}

fn signature(name: &str, signature: &builtins::Signature) -> Signature {
    let structs = StructTable::default();
    let param = |p: &builtins::Param| Parameter {
        name: p.name,
        ty: match p.ty {
            ParamType::Of(ty) => structs.show(ty),
            ParamType::Any { array: false } => "any".to_string(),
            ParamType::Any { array: true } => "any[]".to_string(),
        },
        output: p.output,
    };
    Signature {
        text: signature.show(name),
        returns: structs.show(signature.ret),
        params: signature.params.iter().map(param).collect(),
        more: signature.tail != Tail::None,
    }
}
