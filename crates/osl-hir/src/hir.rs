//! The resolved tree: every name is bound, every overload is chosen, and every conversion is explicit.
//!
//! Resolution makes it from the syntax tree, and lowering turns it into IR. Functions are not inlined yet,
//! and variables are still variables.

use crate::builtins::Builtin;
pub use osl_ir::global::{GLOBALS, Global};
use osl_ir::types::{Base, StructId, StructTable, Type};
use osl_syntax::ast::{BinaryOp, ShaderKind, UnaryOp};
use osl_syntax::diagnostic::Code;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::sync::{Arc, OnceLock};

/// The program grows beyond its budget: the text of a compiled shader, or functions when they are inlined.
pub const TOO_LARGE: Code = Code { id: "E0601", name: "program-too-large" };

/// The name of variables that hold a piece of a long chain of operators or of `else if`. Names of the
/// language do not begin with three underscores.
pub const CHAIN: &str = "___chain";

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
    /// Why calls take the functions that they take, where there was a choice: by the position of the call.
    pub choices: FxHashMap<u32, Choice>,
    /// The indices of the parameters, by name.
    pub(crate) places: ParamPlaces,
}

/// Why a call takes one of several functions with its name.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// If the expected type of the result decided: how many functions take the arguments equally well, and
    /// that type.
    pub by_result: Option<(usize, Type)>,
    /// The functions that were not taken, with the reason; only if some of them are of the source.
    pub others: Vec<(String, String)>,
}

/// What was resolved of a source with errors: it has error nodes, and may lack the shader.
///
/// It is a type of its own so that nothing lowers or runs it. Tools that show a source read it.
#[derive(Clone, Debug, Default)]
pub struct Broken {
    /// All structs.
    pub structs: StructTable,
    /// All variables: globals, parameters, formals, locals.
    pub vars: Vec<Var>,
    /// All functions with bodies.
    pub functions: Vec<Function>,
    /// The shader, unless the source has none.
    pub shader: Option<Shader>,
}

impl From<Program> for Broken {
    fn from(program: Program) -> Broken {
        let Program { structs, vars, functions, shader, .. } = program;
        Broken { structs, vars, functions, shader: Some(shader) }
    }
}

/// The index of each parameter in the list, by name. It is computed on first use, because a shader may have
/// very many parameters, and a group as many values for them.
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

    /// A variable, or else a function, with a value in two arrays: a field of an element of an array is an
    /// array, or has one.
    pub fn nested_arrays(&self) -> Option<Span> {
        // By the index of each struct: whether it holds an array, and one within another.
        let mut known: Vec<[bool; 2]> = Vec::new();
        let of = |known: &[[bool; 2]], ty: Type| {
            let [holds, nests] = match ty.base {
                Base::Struct(id) => known.get(id.0 as usize).copied().unwrap_or_default(),
                _ => [false; 2],
            };
            [holds || ty.is_array(), nests || (holds && ty.is_array())]
        };
        for id in 0..self.structs.names().count() {
            let fields = self.structs.get(StructId(id as u32)).fields.iter();
            let each = fields.map(|field| of(&known, field.ty));
            let all = each.fold([false; 2], |[a, b], [holds, nests]| [a || holds, b || nests]);
            known.push(all);
        }
        let vars = self.vars.iter().map(|var| (var.ty, var.span));
        let mut all = vars.chain(self.functions.iter().map(|f| (f.ret, f.span)));
        all.find(|(ty, _)| of(&known, *ty)[1]).map(|(_, span)| span)
    }
}

/// The kind of a variable.
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
    /// Its kind.
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
    /// Whether it is an array whose length is that of its value; the type has the length of the default.
    pub open: bool,
    /// The default.
    pub init: Init,
    /// Metadata as written: type, name, value.
    pub metadata: Vec<(String, Arc<str>, MetaValue)>,
}

/// The value of a metadatum, if it is a constant.
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
    /// The location of its name.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Stmt {
    /// Its kind.
    pub kind: StmtKind,
    /// Its location.
    pub span: Span,
}

/// Kinds of statements.
#[derive(Clone, Debug)]
pub enum StmtKind {
    /// Evaluated for its effect.
    Expr(Expr),
    /// Declares a local: it is set to zero, then to its initialiser.
    Declare(VarId, Option<Init>),
    /// A block.
    Block(Vec<Stmt>),
    /// `if`.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
    /// Any loop: `for`, `while`, `do`.
    Loop {
        /// Condition; `None` is true.
        cond: Option<Expr>,
        /// Whether the condition is tested before the body.
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

/// The value for a variable, argument or return value.
#[derive(Clone, Debug)]
pub enum Init {
    /// A value of exactly the destination's type (any kind of triple for a triple).
    Value(Expr),
    /// Element by element, or field by field; missing ones are zero.
    List(Vec<Init>),
}

impl Init {
    /// The expressions of its elements.
    pub fn exprs(&self) -> Vec<&Expr> {
        match self {
            Init::Value(e) => vec![e],
            Init::List(items) => items.iter().flat_map(Init::exprs).collect(),
        }
    }

    /// Whether it consists of literals, and triples and matrices of them: such values are stored in a
    /// compiled file.
    pub fn is_constant(&self) -> bool {
        match self {
            Init::Value(e) => e.is_constant(),
            Init::List(items) => items.iter().all(Init::is_constant),
        }
    }
}

impl Stmt {
    /// Its expressions, without those of the statements in it.
    pub fn exprs(&self) -> Vec<&Expr> {
        match &self.kind {
            StmtKind::Expr(e) | StmtKind::If(e, ..) => vec![e],
            StmtKind::Declare(_, Some(value)) | StmtKind::Return(Some(value)) => value.exprs(),
            StmtKind::Loop { cond, iter, .. } => cond.iter().chain(iter).collect(),
            _ => Vec::new(),
        }
    }
}

impl Expr {
    /// The expressions directly within it, in the order of the text.
    pub fn parts(&self) -> Vec<&Expr> {
        match &self.kind {
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::NullClosure
            | ExprKind::Error => Vec::new(),
            ExprKind::Read(place) | ExprKind::Step { place, .. } => place.indices().collect(),
            ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => vec![inner],
            ExprKind::Binary(_, a, b) => vec![a, b],
            ExprKind::Ternary(cond, a, b) => vec![cond, a, b],
            ExprKind::Assign(place, value) => place.indices().chain(value.exprs()).collect(),
            ExprKind::Triple(parts) => parts.iter().collect(),
            ExprKind::Matrix(parts) | ExprKind::Comma(parts) => parts.iter().collect(),
            ExprKind::Struct(parts) => parts.iter().flat_map(Init::exprs).collect(),
            ExprKind::Call(_, args) => args
                .iter()
                .flat_map(|arg| match arg {
                    Arg::Alias(place) => place.indices().collect(),
                    Arg::Copy { value, .. } => value.exprs(),
                })
                .collect(),
            ExprKind::Builtin(call) => call.args.iter().collect(),
            ExprKind::Operation(call) => call.args.iter().collect(),
        }
    }

    /// Visits it and everything in it.
    pub fn each<'e>(&'e self, visit: &mut dyn FnMut(&'e Expr)) {
        visit(self);
        self.parts().into_iter().for_each(|part| part.each(visit));
    }

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

/// An expression with its type.
#[derive(Clone, Debug)]
pub struct Expr {
    /// Its type; [`Type::VOID`] for a call without value.
    pub ty: Type,
    /// Its kind.
    pub kind: ExprKind,
    /// Its location.
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
    Read(Lvalue),
    /// A conversion to the type of this expression: number to number, triple or matrix; triple to triple.
    Convert(Box<Expr>),
    /// A built-in prefix operator.
    Unary(UnaryOp, Box<Expr>),
    /// A built-in binary operator. Operands keep their own types: a float next to a triple stays a float.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `cond ? a : b`; both sides have the type of this expression.
    Ternary(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `place = value`, or `place op= value` with the operation made explicit in `value`.
    Assign(Lvalue, Box<Init>),
    /// `++` and `--`.
    Step {
        /// Whether the result is the new value.
        prefix: bool,
        /// `++` rather than `--`.
        increment: bool,
        /// The place.
        place: Lvalue,
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
    /// A call of an operation that only the renderer knows, mostly a component of a closure.
    Operation(OperationCall),
    /// Values in order; the value of the expression is the last one.
    Comma(Vec<Expr>),
    /// An error was reported here.
    Error,
}

/// An argument of a user function.
#[derive(Clone, Debug)]
pub enum Arg {
    /// A variable, or a member of one at any depth, for which the formal is an alias: the path has no index.
    Alias(Lvalue),
    /// Copied in; copied back after the call if `back` is given.
    Copy {
        /// The value, converted to the formal's type.
        value: Init,
        /// The element or component passed to an output formal, unless it is [only copied
        /// in](Lvalue::is_only_copied_in).
        back: Option<Lvalue>,
    },
}

/// A call of a built-in function.
#[derive(Clone, Debug)]
pub struct BuiltinCall {
    /// The table's row.
    pub row: &'static Builtin,
    /// The chosen signature.
    pub overload: usize,
    /// Input arguments, converted; for an output argument, its value before the call.
    pub args: Vec<Expr>,
    /// For each argument, the place where an output is stored.
    pub outputs: Vec<Option<Lvalue>>,
    /// The arguments that had another type than the parameter, by their indices.
    pub converted: Vec<usize>,
}

/// A call of an operation that is not in the table of built-ins. If it returns a closure, it makes a
/// component with that name; other operations cannot run here.
#[derive(Clone, Debug)]
pub struct OperationCall {
    /// Its name.
    pub name: Arc<str>,
    /// Number of arguments for its parameters; keywords follow.
    pub formals: usize,
    /// Its arguments; those of parameters are converted.
    pub args: Vec<Expr>,
}

/// A variable, or a part of one.
#[derive(Clone, Debug)]
pub struct Lvalue {
    /// The variable.
    pub var: VarId,
    /// The path from the variable to the part.
    pub path: Vec<Step>,
    /// Type of the part.
    pub ty: Type,
    /// Its location.
    pub span: Span,
}

impl Lvalue {
    /// The indices of its path.
    pub fn indices(&self) -> impl Iterator<Item = &Expr> {
        self.path.iter().flat_map(Step::indices)
    }

    /// Whether it is a variable, or a field of one, without any index.
    pub fn is_plain(&self) -> bool {
        self.path.iter().all(|step| matches!(step, Step::Field(_)))
    }

    /// Whether it keeps its value as an output of a function of the file, as in published compilers: it is a
    /// struct in an element of an array.
    pub fn is_only_copied_in(&self) -> bool {
        !self.is_plain() && self.ty.as_struct().is_some()
    }

    /// Whether both are the same variable, or the same field of one, without any index.
    pub fn is_same_variable(&self, other: &Lvalue) -> bool {
        let field = |step: &Step| if let Step::Field(n) = step { Some(*n) } else { None };
        self.var == other.var
            && self.path.len() == other.path.len()
            && self.path.iter().zip(&other.path).all(|(a, b)| field(a).is_some() && field(a) == field(b))
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

impl Step {
    /// Its indices: none, one, or the row and the column.
    pub fn indices(&self) -> impl Iterator<Item = &Expr> {
        let indices = match self {
            Step::Field(_) => [None, None],
            Step::Element(at) | Step::Component(at) => [Some(&**at), None],
            Step::Cell(row, column) => [Some(&**row), Some(&**column)],
        };
        indices.into_iter().flatten()
    }
}
