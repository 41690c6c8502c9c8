//! The resolved tree: every name bound, every overload chosen, every conversion written out.
//!
//! Resolution makes it from the syntax tree; lowering turns it into IR. Functions are not inlined yet and
//! variables are still variables. It must not know lanes, rates or SSA.

use crate::builtins::Builtin;
use crate::types::{StructTable, Type};
use osl_syntax::ast::{BinaryOp, ShaderKind, UnaryOp};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::sync::{Arc, OnceLock};

/// Index of a variable in [`Program::vars`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VarId(pub u32);

/// Index of a function in [`Program::functions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// A resolved translation unit with its one shader.
#[derive(Clone, Debug)]
pub struct Program {
    /// All structs.
    pub structs: StructTable,
    /// All variables: globals, parameters, formals, locals.
    pub vars: Vec<Var>,
    /// All functions with bodies.
    pub functions: Vec<Function>,
    /// The shader.
    pub shader: Shader,
    /// The places of the parameters, by name.
    pub(crate) places: ParamPlaces,
}

/// Where each parameter stands in the list, by name. Found at the first question, since a shader may have very many
/// parameters, and a group as many values for them.
#[derive(Clone, Debug, Default)]
pub(crate) struct ParamPlaces(OnceLock<FxHashMap<Arc<str>, usize>>);

impl Program {
    /// The index of a parameter of the shader.
    pub fn param(&self, name: &str) -> Option<usize> {
        let places = self.places.0.get_or_init(|| {
            let mut places = FxHashMap::default();
            for (at, param) in self.shader.params.iter().enumerate() {
                if let Some(var) = self.vars.get(param.var.0 as usize) {
                    places.entry(var.name.clone()).or_insert(at);
                }
            }
            places
        });
        places.get(name).copied()
    }
}

/// Shader globals, in the order of [`GLOBALS`], and what calls ask of the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "each variant is the global of its name")]
pub enum Global {
    P,
    I,
    N,
    Ng,
    U,
    V,
    DPdu,
    DPdv,
    Ps,
    Time,
    Dtime,
    DPdtime,
    Ci,
    /// What `surfacearea()` yields; a program cannot name it.
    SurfaceArea,
    /// What `backfacing()` yields, 0 or 1; a program cannot name it.
    Backfacing,
}

impl Global {
    /// All of them.
    pub const ALL: [Global; 15] = [
        Global::P,
        Global::I,
        Global::N,
        Global::Ng,
        Global::U,
        Global::V,
        Global::DPdu,
        Global::DPdv,
        Global::Ps,
        Global::Time,
        Global::Dtime,
        Global::DPdtime,
        Global::Ci,
        Global::SurfaceArea,
        Global::Backfacing,
    ];

    /// Its name, or the call that yields it.
    pub fn name(self) -> &'static str {
        match self {
            Global::P => "P",
            Global::I => "I",
            Global::N => "N",
            Global::Ng => "Ng",
            Global::U => "u",
            Global::V => "v",
            Global::DPdu => "dPdu",
            Global::DPdv => "dPdv",
            Global::Ps => "Ps",
            Global::Time => "time",
            Global::Dtime => "dtime",
            Global::DPdtime => "dPdtime",
            Global::Ci => "Ci",
            Global::SurfaceArea => "surfacearea()",
            Global::Backfacing => "backfacing()",
        }
    }
}

/// Each global with its name, type, and whether a shader may assign it without a warning.
pub const GLOBALS: [(Global, &str, Type, bool); 13] = [
    (Global::P, "P", Type::POINT, true),
    (Global::I, "I", Type::VECTOR, true),
    (Global::N, "N", Type::NORMAL, true),
    (Global::Ng, "Ng", Type::NORMAL, false),
    (Global::U, "u", Type::FLOAT, false),
    (Global::V, "v", Type::FLOAT, false),
    (Global::DPdu, "dPdu", Type::VECTOR, false),
    (Global::DPdv, "dPdv", Type::VECTOR, false),
    (Global::Ps, "Ps", Type::POINT, false),
    (Global::Time, "time", Type::FLOAT, false),
    (Global::Dtime, "dtime", Type::FLOAT, false),
    (Global::DPdtime, "dPdtime", Type::VECTOR, false),
    (Global::Ci, "Ci", Type::CLOSURE, true),
];

/// What a variable is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VarKind {
    /// A shader global.
    Global(Global),
    /// A shader parameter, by index; whether it is an output.
    Param {
        /// Index into [`Shader::params`].
        index: u32,
        /// `output`.
        output: bool,
    },
    /// A function's formal; whether it is an output.
    Formal {
        /// `output`.
        output: bool,
    },
    /// A local variable.
    Local,
}

/// A variable.
#[derive(Clone, Debug)]
pub struct Var {
    /// Its name.
    pub name: Arc<str>,
    /// Its type.
    pub ty: Type,
    /// What it is.
    pub kind: VarKind,
    /// Where it was declared.
    pub span: Span,
}

/// The shader.
#[derive(Clone, Debug)]
pub struct Shader {
    /// Its name.
    pub name: Arc<str>,
    /// Its kind.
    pub kind: ShaderKind,
    /// Its metadata: type, name, value.
    pub metadata: Vec<(String, Arc<str>, MetaValue)>,
    /// Its parameters in order.
    pub params: Vec<Param>,
    /// Its body.
    pub body: Vec<Stmt>,
}

/// A shader parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// The variable.
    pub var: VarId,
    /// Whether it is an output.
    pub output: bool,
    /// Whether it is an array that takes the length of its value; the type has that of the default.
    pub open: bool,
    /// The default.
    pub init: Init,
    /// Metadata as written: type, name, value.
    pub metadata: Vec<(String, Arc<str>, MetaValue)>,
}

/// The value of a metadatum, as far as it is a constant.
#[derive(Clone, Debug, PartialEq)]
pub enum MetaValue {
    /// A string.
    Text(Arc<str>),
    /// Numbers: one, three, sixteen, or an array of them.
    Numbers(Vec<f64>),
    /// Strings of an array.
    Texts(Vec<Arc<str>>),
    /// Not a constant.
    Unknown,
}

/// A function with a body.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its name.
    pub name: Arc<str>,
    /// Return type.
    pub ret: Type,
    /// Formals in order.
    pub formals: Vec<VarId>,
    /// The body.
    pub body: Vec<Stmt>,
    /// Where its name stands.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Stmt {
    /// What it is.
    pub kind: StmtKind,
    /// Where it stands.
    pub span: Span,
}

/// Kinds of statements.
#[derive(Clone, Debug)]
pub enum StmtKind {
    /// Evaluated for its effect.
    Expr(Expr),
    /// A local comes to life: zero, then its initialiser.
    Declare(VarId, Option<Init>),
    /// A block.
    Block(Vec<Stmt>),
    /// `if`.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
    /// Any loop: `for`, `while`, `do`.
    Loop {
        /// Condition; `None` is true.
        cond: Option<Expr>,
        /// Whether the condition stands before the body.
        test_first: bool,
        /// Evaluated after the body and after `continue`.
        iter: Option<Expr>,
        /// The body.
        body: Vec<Stmt>,
    },
    /// `break`.
    Break,
    /// `continue`.
    Continue,
    /// `return`.
    Return(Option<Init>),
}

/// What a variable, argument or return value is made from.
#[derive(Clone, Debug)]
pub enum Init {
    /// A value of exactly the destination's type (triples interchange).
    Value(Expr),
    /// Element by element, or field by field; missing ones stay zero.
    List(Vec<Init>),
}

impl Init {
    /// Whether it is literals, and triples and matrices of them: what a compiled file holds as values.
    pub fn is_constant(&self) -> bool {
        match self {
            Init::Value(e) => e.is_constant(),
            Init::List(items) => items.iter().all(Init::is_constant),
        }
    }
}

impl Expr {
    fn is_constant(&self) -> bool {
        match &self.kind {
            ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) | ExprKind::NullClosure => true,
            ExprKind::Triple(parts) => parts.iter().all(Expr::is_constant),
            ExprKind::Matrix(cells) => cells.iter().all(Expr::is_constant),
            ExprKind::Convert(inner) => inner.is_constant(),
            ExprKind::Struct(fields) => fields.iter().all(Init::is_constant),
            _ => false,
        }
    }
}

/// An expression of known type.
#[derive(Clone, Debug)]
pub struct Expr {
    /// Its type; [`Type::VOID`] for a call without value.
    pub ty: Type,
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// Kinds of expressions.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// An int constant.
    Int(i32),
    /// A float constant.
    Float(f32),
    /// A string constant.
    Str(Arc<str>),
    /// The null closure.
    NullClosure,
    /// The value at a place.
    Read(Place),
    /// A conversion to the type of this expression: number to number, triple or matrix; triple to triple.
    Convert(Box<Expr>),
    /// A built-in prefix operator.
    Unary(UnaryOp, Box<Expr>),
    /// A built-in binary operator. Operands keep their own types: a float beside a triple stays a float.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `cond ? a : b`; both sides have the type of this expression.
    Ternary(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `place = value`, or `place op= value` with the operation written out in `value`.
    Assign(Place, Box<Init>),
    /// `++` and `--`.
    Step {
        /// Whether the result is the new value.
        prefix: bool,
        /// `++` rather than `--`.
        increment: bool,
        /// The place.
        place: Place,
    },
    /// Three floats make a triple.
    Triple(Box<[Expr; 3]>),
    /// Sixteen floats make a matrix.
    Matrix(Vec<Expr>),
    /// A struct value, field by field.
    Struct(Vec<Init>),
    /// A call of a user function.
    Call(FunctionId, Vec<Arg>),
    /// A call of a built-in.
    Builtin(BuiltinCall),
    /// A call of an operation that the renderer knows by its name: a component of a closure, mostly.
    Operation(OperationCall),
    /// Values in order; the last counts.
    Comma(Vec<Expr>),
    /// An error was reported here.
    Error,
}

/// An argument of a user function.
#[derive(Clone, Debug)]
pub enum Arg {
    /// A variable, or a member of one at any depth, that the formal stands for: the path has no index.
    Alias(Place),
    /// Copied in; written back after the call if the place is given.
    Copy {
        /// The value, converted to the formal's type.
        value: Init,
        /// An element or component bound to an output formal. An element of an array of structs has none.
        back: Option<Place>,
    },
}

/// A call of a built-in function.
#[derive(Clone, Debug)]
pub struct BuiltinCall {
    /// The table's row.
    pub row: &'static Builtin,
    /// Which of its signatures was chosen.
    pub overload: usize,
    /// Input arguments, converted; for an output argument the value that it has before.
    pub args: Vec<Expr>,
    /// For each argument, the place that an output is stored to.
    pub outputs: Vec<Option<Place>>,
}

/// A call of an operation that is not in the table of built-ins. One that yields a closure makes a component of that name;
/// no other can run here.
#[derive(Clone, Debug)]
pub struct OperationCall {
    /// Its name.
    pub name: Arc<str>,
    /// How many of the arguments are its parameters; keywords follow.
    pub formals: usize,
    /// Its arguments, those of parameters converted.
    pub args: Vec<Expr>,
}

/// A variable, or a part of one.
#[derive(Clone, Debug)]
pub struct Place {
    /// The variable.
    pub var: VarId,
    /// The way from it to the part.
    pub path: Vec<Step>,
    /// Type of the part.
    pub ty: Type,
    /// Where it stands.
    pub span: Span,
}

impl Place {
    /// Whether it is a variable, or a field of one, without any index.
    pub fn is_plain(&self) -> bool {
        self.path.iter().all(|step| matches!(step, Step::Field(_)))
    }
}

/// One step from a variable to a part of it.
#[derive(Clone, Debug)]
pub enum Step {
    /// A struct's field.
    Field(u32),
    /// An array's element.
    Element(Box<Expr>),
    /// A triple's component.
    Component(Box<Expr>),
    /// A matrix element: row and column.
    Cell(Box<Expr>, Box<Expr>),
}
