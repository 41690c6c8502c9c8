//! The syntax tree of one translation unit, as written: no names are resolved, and there are no types.
//!
//! Expressions and statements are in arenas of the [`Ast`], addressed by typed `u32` ids; each has the
//! [`Span`] of its source text. The tree is a value: later stages put their results into tables keyed by id,
//! never into the tree.

use crate::gaps::Gaps;
use crate::span::Span;
pub use crate::words::{BinaryOp, ShaderKind, TypeName, UnaryOp};
use std::collections::HashSet;
use std::sync::Arc;

/// An identifier and its location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The identifier's text.
    pub text: Arc<str>,
    /// Its location.
    pub span: Span,
}

/// Index of an expression in [`Ast::exprs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(pub u32);

/// Index of a statement in [`Ast::stmts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StmtId(pub u32);

/// One parsed translation unit: the main file with everything that it includes.
#[derive(Clone, Debug, Default)]
pub struct Ast {
    /// Declarations at file level, in order.
    pub items: Vec<Item>,
    /// The expression arena.
    pub exprs: Vec<Expr>,
    /// The statement arena.
    pub stmts: Vec<Stmt>,
    /// The parts of the file that are missing from the tree.
    pub gaps: Gaps,
    /// Where long chains are cut.
    pub cuts: Cuts,
    /// Whether later stages, too, refuse whatever the reference refuses.
    pub strict: bool,
}

/// The places where chains `a + b + c …` and `if … else if …` of hundreds of links are cut into pieces. A
/// chain is no deeper than its longest piece for visitors that treat the pieces one after another; the tree
/// itself has a level for each link, so visitors follow its links in a loop.
#[derive(Clone, Debug, Default)]
pub struct Cuts {
    /// Binary operators whose left operand is the end of a piece.
    pub operators: HashSet<ExprId>,
    /// `if` statements whose `else` begins a piece.
    pub branches: HashSet<StmtId>,
}

impl Ast {
    /// Adds an expression.
    pub fn expr(&mut self, span: Span, kind: ExprKind) -> ExprId {
        self.exprs.push(Expr { span, kind });
        ExprId(self.exprs.len() as u32 - 1)
    }

    /// Adds a statement.
    pub fn stmt(&mut self, span: Span, kind: StmtKind) -> StmtId {
        self.stmts.push(Stmt { span, kind });
        StmtId(self.stmts.len() as u32 - 1)
    }
}

impl std::ops::Index<ExprId> for Ast {
    type Output = Expr;
    fn index(&self, id: ExprId) -> &Expr {
        &self.exprs[id.0 as usize]
    }
}

impl std::ops::Index<StmtId> for Ast {
    type Output = Stmt;
    fn index(&self, id: StmtId) -> &Stmt {
        &self.stmts[id.0 as usize]
    }
}

/// A declaration at file level.
#[derive(Clone, Debug)]
pub enum Item {
    /// `struct S { … };`
    Struct(StructDecl),
    /// A function, defined or only declared.
    Function(Arc<FunctionDecl>),
    /// A shader.
    Shader(Arc<ShaderDecl>),
}

impl Item {
    /// The whole declaration.
    pub fn span(&self) -> Span {
        match self {
            Item::Struct(decl) => decl.span,
            Item::Function(decl) => decl.span,
            Item::Shader(decl) => decl.span,
        }
    }
}

/// `struct name { fields };`
#[derive(Clone, Debug)]
pub struct StructDecl {
    /// The whole declaration.
    pub span: Span,
    /// The struct's name.
    pub name: Name,
    /// Its fields in order; `float a, b;` makes two.
    pub fields: Vec<FieldDecl>,
}

/// One field of a struct.
#[derive(Clone, Debug)]
pub struct FieldDecl {
    /// Type of the field (of its elements, for an array).
    pub ty: TypeSpec,
    /// The field's name.
    pub name: Name,
    /// `[n]` after the name.
    pub array: Option<ArrayLen>,
}

/// A function, at file level or nested in a block.
#[derive(Clone, Debug)]
pub struct FunctionDecl {
    /// The whole declaration.
    pub span: Span,
    /// Return type.
    pub ret: TypeSpec,
    /// The name, which may also be `__operator__add__` and the like.
    pub name: Name,
    /// Formal parameters.
    pub formals: Vec<Formal>,
    /// Metadata blocks, joined.
    pub metadata: Vec<Metadatum>,
    /// The body; `None` for a prototype.
    pub body: Option<Block>,
}

/// A shader declaration.
#[derive(Clone, Debug)]
pub struct ShaderDecl {
    /// The whole declaration.
    pub span: Span,
    /// `shader`, `surface`, `displacement` or `volume`.
    pub kind: ShaderKind,
    /// The shader's name.
    pub name: Name,
    /// Metadata blocks, joined.
    pub metadata: Vec<Metadatum>,
    /// Parameters.
    pub formals: Vec<Formal>,
    /// The body.
    pub body: Block,
}

/// A parameter of a shader or function.
#[derive(Clone, Debug)]
pub struct Formal {
    /// From the type (or `output`) to the end of its metadata.
    pub span: Span,
    /// Whether `output` precedes the type.
    pub output: bool,
    /// Type (of the elements, for an array).
    pub ty: TypeSpec,
    /// The parameter's name.
    pub name: Name,
    /// `[n]` or `[]` after the name.
    pub array: Option<ArrayLen>,
    /// Default value.
    pub init: Option<ExprId>,
    /// Metadata.
    pub metadata: Vec<Metadatum>,
}

/// One entry of a metadata block: `type name = value`.
#[derive(Clone, Debug)]
pub struct Metadatum {
    /// Type.
    pub ty: TypeSpec,
    /// Name.
    pub name: Name,
    /// `[n]` after the name.
    pub array: Option<ArrayLen>,
    /// Value.
    pub value: ExprId,
}

/// The brackets after a declared name.
#[derive(Clone, Copy, Debug)]
pub struct ArrayLen {
    /// The brackets.
    pub span: Span,
    /// The length as written; `None` for `[]`.
    pub len: Option<ExprId>,
}

/// A type as written.
#[derive(Clone, Debug)]
pub struct TypeSpec {
    /// Its location.
    pub span: Span,
    /// Whether `closure` precedes the name. Every such type is `closure color`.
    pub closure: bool,
    /// The type's name.
    pub name: TypeName,
}

/// `{ statements }` as the body of a function or shader.
#[derive(Clone, Debug)]
pub struct Block {
    /// Braces included.
    pub span: Span,
    /// The statements.
    pub stmts: Vec<StmtId>,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Stmt {
    /// Its location.
    pub span: Span,
    /// Its kind.
    pub kind: StmtKind,
}

/// Kinds of statements.
#[derive(Clone, Debug)]
pub enum StmtKind {
    /// `;`
    Empty,
    /// An expression for its effect.
    Expr(ExprId),
    /// `type a = e, b, c[3];`
    Declare {
        /// Type of each (of the elements, for arrays).
        ty: TypeSpec,
        /// The names with their lengths and initialisers.
        vars: Vec<Declarator>,
    },
    /// `{ … }`
    Block(Vec<StmtId>),
    /// `if (cond) then else otherwise`
    If {
        /// Condition.
        cond: ExprId,
        /// Taken when true.
        then: StmtId,
        /// Taken when false.
        otherwise: Option<StmtId>,
    },
    /// `while (cond) body`
    While {
        /// Condition.
        cond: ExprId,
        /// Body.
        body: StmtId,
    },
    /// `do body while (cond);`
    DoWhile {
        /// Body.
        body: StmtId,
        /// Condition.
        cond: ExprId,
    },
    /// `for (init; cond; iter) body`
    For {
        /// A declaration or an expression statement.
        init: Option<StmtId>,
        /// Condition; absent means true.
        cond: Option<ExprId>,
        /// Evaluated after the body.
        iter: Option<ExprId>,
        /// Body.
        body: StmtId,
    },
    /// `break;`
    Break,
    /// `continue;`
    Continue,
    /// `return;` or `return value;`
    Return(Option<ExprId>),
    /// A function declared inside a block.
    Function(Arc<FunctionDecl>),
    /// A place where the parser recovered from an error. A diagnostic covers the same span.
    Error,
}

/// One name of a declaration statement.
#[derive(Clone, Debug)]
pub struct Declarator {
    /// The name.
    pub name: Name,
    /// `[n]` after the name.
    pub array: Option<ArrayLen>,
    /// Initialiser; an [`ExprKind::InitList`] for `{…}`.
    pub init: Option<ExprId>,
}

/// One expression as written.
#[derive(Clone, Debug)]
pub struct Expr {
    /// Its location.
    pub span: Span,
    /// Its kind.
    pub kind: ExprKind,
}

/// Kinds of expressions.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// An int literal, wrapped to 32 bits.
    Int(i32),
    /// A float literal.
    Float(f32),
    /// A string literal: escapes are replaced, and adjacent literals are joined. Bytes above 0x7f are UTF-8,
    /// as in the source.
    Str(Arc<str>),
    /// A variable by name.
    Name(Arc<str>),
    /// A prefix operator. Unary plus is dropped by the parser.
    Unary(UnaryOp, ExprId),
    /// `++` and `--` before or after an lvalue.
    Step {
        /// Whether it precedes its operand.
        prefix: bool,
        /// `++` rather than `--`.
        increment: bool,
        /// The lvalue.
        target: ExprId,
    },
    /// A binary operator.
    Binary(BinaryOp, ExprId, ExprId),
    /// `target = value`, or `target op= value`.
    Assign {
        /// The operator of a compound assignment.
        op: Option<BinaryOp>,
        /// The lvalue.
        target: ExprId,
        /// The right-hand side.
        value: ExprId,
    },
    /// `cond ? a : b`
    Ternary(ExprId, ExprId, ExprId),
    /// `(type) value`
    Cast(TypeSpec, ExprId),
    /// A constructor of a built-in type: `color("hsv", a, b, c)`, `float(x)`.
    Construct(TypeSpec, Vec<ExprId>),
    /// `callee(args)`; resolution decides whether it builds a struct or calls a function.
    Call(Name, Vec<ExprId>),
    /// `base[index]`
    Index(ExprId, ExprId),
    /// `base.field`
    Field(ExprId, Name),
    /// `a, b, c` where a comma list is permitted; its value is the last one.
    Comma(Vec<ExprId>),
    /// `( inner )`
    Paren(ExprId),
    /// `{ a, b, c }`
    InitList(Vec<ExprId>),
    /// A place where the parser recovered from an error. A diagnostic covers the same span.
    Error,
}
