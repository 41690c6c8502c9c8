//! The tree and the tokens as readable text, for snapshots and for people.
//!
//! The text contains everything in the tree except locations, so two trees mean the same exactly if they
//! print the same. One construct per line, two spaces per level; expressions in prefix form in parentheses.

mod expr;

pub(crate) use expr::binary_op;

use crate::ast::{
    ArrayLen, Ast, Block, FieldDecl, Formal, FunctionDecl, Item, Metadatum, ShaderDecl, ShaderKind, StmtId,
    StmtKind, StructDecl, TypeName, TypeSpec,
};
use crate::source::SourceMap;
use crate::span::Span;
use crate::token::Token;
use std::fmt::Write as _;

/// The tree as indented text.
pub fn ast(ast: &Ast) -> String {
    let mut p = Printer { ast, out: String::new(), level: 0 };
    for item in &ast.items {
        match item {
            Item::Struct(s) => p.structure(s),
            Item::Function(f) => p.function(f),
            Item::Shader(s) => p.shader(s),
        }
    }
    p.out
}

/// The tokens with line and column, one per line.
pub fn tokens(tokens: &[(Token, Span)], sources: &SourceMap) -> String {
    let mut out = String::new();
    for (token, span) in tokens {
        // Writing to a string cannot fail.
        let _ = match sources.place(*span) {
            Some(place) => writeln!(out, "{:>3}:{:<3} {token:?}", place.line, place.column),
            None => writeln!(out, "        {token:?}"),
        };
    }
    out
}

/// The keyword of a shader.
pub fn shader_kind(kind: ShaderKind) -> &'static str {
    match kind {
        ShaderKind::Generic => "shader",
        ShaderKind::Surface => "surface",
        ShaderKind::Displacement => "displacement",
        ShaderKind::Volume => "volume",
    }
}

/// The spelling of a type's name.
pub fn type_name(name: &TypeName) -> &str {
    match name {
        TypeName::Int => "int",
        TypeName::Float => "float",
        TypeName::Color => "color",
        TypeName::Point => "point",
        TypeName::Vector => "vector",
        TypeName::Normal => "normal",
        TypeName::Matrix => "matrix",
        TypeName::String => "string",
        TypeName::Void => "void",
        TypeName::Struct(name) => name,
    }
}

/// Levels by which a chain of `else if` is indented.
const MAX_LEVELS: usize = 256;

struct Printer<'a> {
    ast: &'a Ast,
    out: String,
    level: usize,
}

impl Printer<'_> {
    fn line(&mut self, text: &str) {
        for _ in 0..self.level {
            self.out.push_str("  ");
        }
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn deeper(&mut self, inside: impl FnOnce(&mut Self)) {
        self.level += 1;
        inside(self);
        self.level -= 1;
    }

    fn ty(&self, ty: &TypeSpec) -> String {
        let closure = if ty.closure { "closure " } else { "" };
        format!("{closure}{}", type_name(&ty.name))
    }

    fn array(&self, array: Option<ArrayLen>) -> String {
        match array {
            None => String::new(),
            Some(a) => format!("[{}]", a.len.map_or(String::new(), |e| self.expr(e))),
        }
    }

    fn structure(&mut self, s: &StructDecl) {
        self.line(&format!("struct {}", s.name.text));
        self.deeper(|p| {
            for FieldDecl { ty, name, array } in &s.fields {
                p.line(&format!("field {} {}{}", p.ty(ty), name.text, p.array(*array)));
            }
        });
    }

    fn function(&mut self, f: &FunctionDecl) {
        let what = if f.body.is_some() { "function" } else { "prototype" };
        self.line(&format!("{what} {} {}", self.ty(&f.ret), f.name.text));
        self.deeper(|p| {
            p.metadata(&f.metadata);
            p.formals(&f.formals);
            if let Some(body) = &f.body {
                p.body(body);
            }
        });
    }

    fn shader(&mut self, s: &ShaderDecl) {
        self.line(&format!("{} {}", shader_kind(s.kind), s.name.text));
        self.deeper(|p| {
            p.metadata(&s.metadata);
            p.formals(&s.formals);
            p.body(&s.body);
        });
    }

    fn metadata(&mut self, metadata: &[Metadatum]) {
        for m in metadata {
            let text = format!(
                "meta {} {}{} = {}",
                self.ty(&m.ty),
                m.name.text,
                self.array(m.array),
                self.expr(m.value)
            );
            self.line(&text);
        }
    }

    fn formals(&mut self, formals: &[Formal]) {
        for f in formals {
            let output = if f.output { "output " } else { "" };
            let init = f.init.map_or(String::new(), |e| format!(" = {}", self.expr(e)));
            let text =
                format!("param {output}{} {}{}{init}", self.ty(&f.ty), f.name.text, self.array(f.array));
            self.line(&text);
            self.deeper(|p| p.metadata(&f.metadata));
        }
    }

    fn body(&mut self, body: &Block) {
        self.line("body");
        self.stmts(&body.stmts);
    }

    fn stmts(&mut self, stmts: &[StmtId]) {
        self.deeper(|p| stmts.iter().for_each(|s| p.stmt(*s)));
    }

    fn stmt(&mut self, mut id: StmtId) {
        let ast = self.ast;
        let level = self.level;
        // A chain of `else if` may be long: its last levels are not indented.
        while let Some(StmtKind::If { cond, then, otherwise: Some(next) }) =
            ast.stmts.get(id.0 as usize).map(|s| &s.kind)
        {
            self.line(&format!("if {}", self.expr(*cond)));
            self.stmts(&[*then]);
            self.line("else");
            self.level = (self.level + 1).min(level + MAX_LEVELS);
            id = *next;
        }
        self.one(id);
        self.level = level;
    }

    /// A statement that is no `if` with `else`.
    fn one(&mut self, id: StmtId) {
        let ast = self.ast;
        let Some(stmt) = ast.stmts.get(id.0 as usize) else { return };
        match &stmt.kind {
            StmtKind::Empty => self.line("empty"),
            StmtKind::Expr(e) => self.line(&self.expr(*e)),
            StmtKind::Declare { ty, vars } => {
                for v in vars {
                    let init = v.init.map_or(String::new(), |e| format!(" = {}", self.expr(e)));
                    let text = format!("var {} {}{}{init}", self.ty(ty), v.name.text, self.array(v.array));
                    self.line(&text);
                }
            }
            StmtKind::Block(stmts) => {
                self.line("block");
                self.stmts(stmts);
            }
            StmtKind::If { cond, then, .. } => {
                self.line(&format!("if {}", self.expr(*cond)));
                self.stmts(&[*then]);
            }
            StmtKind::While { cond, body } => {
                self.line(&format!("while {}", self.expr(*cond)));
                self.stmts(&[*body]);
            }
            StmtKind::DoWhile { body, cond } => {
                self.line(&format!("do-while {}", self.expr(*cond)));
                self.stmts(&[*body]);
            }
            StmtKind::For { init, cond, iter, body } => {
                let part = |e: &Option<_>| e.map_or("always".to_owned(), |e| self.expr(e));
                let head = format!(
                    "for {} step {}",
                    part(cond),
                    iter.map_or("nothing".to_owned(), |e| self.expr(e))
                );
                self.line(&head);
                self.deeper(|p| {
                    p.line("init");
                    p.stmts(init.as_slice());
                    p.line("do");
                    p.stmts(&[*body]);
                });
            }
            StmtKind::Break => self.line("break"),
            StmtKind::Continue => self.line("continue"),
            StmtKind::Return(None) => self.line("return"),
            StmtKind::Return(Some(e)) => self.line(&format!("return {}", self.expr(*e))),
            StmtKind::Function(f) => self.function(f),
            StmtKind::Error => self.line("<error>"),
        }
    }
}
