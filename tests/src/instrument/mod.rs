//! Instrumented sources: a shader rewritten so that it prints what it does, statement by statement.
//!
//! It works on the source and its syntax tree, and the result is an ordinary shader. This module must not
//! know how the product follows a point or writes taps: tests compare them.

mod calls;
mod case;
mod compare;
mod differences;
mod print;
mod reasons;
mod reports;
mod slopes;
mod tapped;
mod texts;
mod types;

pub use case::{Outcome, hold};
pub use differences::Differences;
pub use tapped::taps_hold;

use osl_syntax::ast::{self, Ast, Expr, ExprId, ExprKind, Item, StmtId, StmtKind, TypeName};
use osl_syntax::span::Span;
use print::base_name;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use types::{Scopes, Ty};

/// A rewritten shader.
#[derive(Debug, Default)]
pub struct Instrumented {
    /// Its text; every statement is on its old line.
    pub text: String,
    /// The conditions: line and text of each, by number.
    pub conditions: Vec<(u32, String)>,
    /// The lines of the loops, by number.
    pub loops: Vec<u32>,
    /// Where each loop and its body begin and end in the original text.
    pub spans: Vec<[(usize, usize); 2]>,
    /// The loops around the statements of each line; none if they differ.
    pub inside: BTreeMap<u32, Option<Vec<usize>>>,
    /// Variables that are set in ways that are not printed: the line, and the variable.
    pub open: BTreeSet<(u32, String)>,
    /// The functions whose calls are printed.
    pub functions: BTreeSet<String>,
    /// The assignments after which a statement can be inserted.
    pub sets: Vec<Set>,
}

/// An assignment to a whole variable or element.
#[derive(Clone, Debug)]
pub struct Set {
    /// Its line.
    pub line: u32,
    /// The variable, without index.
    pub name: String,
    /// A statement that changes the variable.
    pub change: String,
    /// The end of the statement in the original text.
    pub end: usize,
    /// The loops around it.
    pub loops: Vec<usize>,
}

/// Rewrites a shader without macros or includes of its own. With `slopes`, it prints the derivatives of each
/// assigned value instead of the value.
pub fn instrument(text: &str, ast: &Ast, slopes: bool) -> Instrumented {
    let scopes = Scopes::new(ast);
    let (edits, done) = (Vec::new(), Instrumented::default());
    let mut w = Writer { ast, text, edits, done, scopes, slopes, shader: true, loops: Vec::new() };
    let inside = |span: Span| (span.end as usize) <= text.len() && span.start < span.end;
    let first = ast.items.iter().map(Item::span).find(|span| inside(*span));
    if let Some(first) = first {
        w.insert(first.start, "int t_(int id, int c) { printf(\"@T %d %d\", id, c); return c; } ");
    }
    for item in &ast.items {
        if !inside(item.span()) {
            continue;
        }
        match item {
            Item::Struct(_) => {}
            Item::Function(f) => w.function(f),
            Item::Shader(s) => {
                w.scopes.push();
                w.formals(&s.formals);
                w.list(&s.body.stmts, None);
                w.scopes.pop();
            }
        }
    }
    let mut edits = std::mem::take(&mut w.edits);
    edits.sort_by_key(|(at, ..)| *at);
    let mut out = String::new();
    let mut from = 0;
    for (at, end, new) in edits {
        out.push_str(&text[from.min(at)..at]);
        out.push_str(&new);
        from = end.max(from);
    }
    out.push_str(&text[from..]);
    Instrumented { text: out, ..w.done }
}

struct Writer<'a> {
    ast: &'a Ast,
    text: &'a str,
    /// Start, end, and what replaces the text between them.
    edits: Vec<(usize, usize, String)>,
    done: Instrumented,
    scopes: Scopes,
    slopes: bool,
    /// Whether the text is that of the shader itself rather than of a function.
    shader: bool,
    /// The loops around the statement.
    loops: Vec<usize>,
}

/// The function around a statement.
struct Around {
    /// The type of its result, and the word for it.
    ret: Ty,
    word: String,
    /// Its outputs: their names and types.
    outs: Vec<(String, Ty)>,
    /// The number of scopes with its formals.
    depth: usize,
}

impl Writer<'_> {
    fn insert(&mut self, at: u32, new: &str) {
        self.edits.push((at as usize, at as usize, new.to_string()));
    }

    fn line(&self, span: Span) -> u32 {
        self.text[..span.start as usize].matches('\n').count() as u32 + 1
    }

    fn slice(&self, span: Span) -> &str {
        &self.text[span.start as usize..span.end as usize]
    }

    fn formals(&mut self, formals: &[ast::Formal]) {
        for formal in formals {
            let ty = self.scopes.ty(&formal.ty, self.length(formal.array.as_ref()), formal.array.is_some());
            self.scopes.declare(&formal.name.text, ty);
            // Defaults and arguments are not printed.
            self.done.open.insert((self.line(formal.name.span), formal.name.text.to_string()));
            if let Some(init) = formal.init {
                self.expr(init);
            }
        }
    }

    fn length(&self, array: Option<&ast::ArrayLen>) -> Option<u32> {
        match self.ast[array?.len?].kind {
            ExprKind::Int(n) => u32::try_from(n).ok(),
            _ => None,
        }
    }

    fn function(&mut self, f: &Arc<ast::FunctionDecl>) {
        let Some(body) = &f.body else { return };
        self.done.functions.insert(f.name.text.to_string());
        self.scopes.push();
        self.formals(&f.formals);
        let mut begin = format!(" printf(\"@E {}\");", f.name.text);
        let mut outs = Vec::new();
        for formal in &f.formals {
            let Some(ty) = self.scopes.find(&formal.name.text) else { continue };
            let name = formal.name.text.to_string();
            self.print_as("@G", (&ty, &name, &name), 0, &mut begin);
            if formal.output {
                outs.push((name, ty));
            }
        }
        self.insert(body.span.start + 1, &begin);
        let (ret, word) = (self.scopes.ty(&f.ret, None, false), self.slice(f.ret.span).to_string());
        let around = Around { ret, word, outs, depth: self.scopes.depth() };
        let outside = std::mem::replace(&mut self.shader, false);
        let around_loops = std::mem::take(&mut self.loops);
        self.scopes.push();
        self.list(&body.stmts, Some(&around));
        let leave = self.leave(&around);
        self.insert(body.span.end - 1, &leave);
        self.scopes.pop();
        self.shader = outside;
        self.loops = around_loops;
        self.scopes.pop();
    }

    /// Statements that print the outputs of a function, and that it is left.
    fn leave(&self, around: &Around) -> String {
        let mut out = String::new();
        for (name, ty) in around.outs.iter().filter(|(name, _)| !self.scopes.is_hidden(name, around.depth)) {
            self.print_as("@R", (ty, name, name), 0, &mut out);
        }
        out + " printf(\"@X\"); "
    }

    fn list(&mut self, stmts: &[StmtId], ret: Option<&Around>) {
        for stmt in stmts {
            self.stmt(*stmt, ret, true);
        }
    }

    /// A statement; `listed` tells whether it stands in a list, where others may stand beside it.
    fn stmt(&mut self, id: StmtId, ret: Option<&Around>, listed: bool) {
        let ast = self.ast;
        let stmt = &ast[id];
        let (span, line) = (stmt.span, self.line(stmt.span));
        let loops = Some(self.loops.clone());
        let inside = self.done.inside.entry(line).or_insert_with(|| loops.clone());
        if *inside != loops {
            *inside = None;
        }
        match &stmt.kind {
            StmtKind::Expr(e) => {
                self.expr(*e);
                self.open_parts(*e, line, true);
                if let Some(prints) = self.prints_of(*e, line) {
                    if listed {
                        self.changeable(*e, span);
                    }
                    if !listed {
                        self.insert(span.start, "{ ");
                    }
                    self.insert(span.end, &prints);
                    if !listed {
                        self.insert(span.end, " }");
                    }
                }
            }
            StmtKind::Declare { ty, vars } => {
                let mut prints = String::new();
                for var in vars {
                    if let Some(init) = var.init {
                        self.expr(init);
                        self.open_parts(init, line, true);
                    }
                    let own = self.scopes.ty(ty, self.length(var.array.as_ref()), var.array.is_some());
                    self.scopes.declare(&var.name.text, own.clone());
                    let line = self.line(var.name.span);
                    let written = match var.init.map(|init| &ast[init].kind) {
                        Some(ExprKind::InitList(_)) => own.is_plain_array() || own.is_scalar(),
                        Some(_) => true,
                        None => false,
                    };
                    if written && listed && vars.len() == 1 {
                        let set = self.set_by(own.clone(), var.init);
                        self.print(&set, &var.name.text, &var.name.text, line, &mut prints);
                        self.change(&own, (&var.name.text, &var.name.text), line, span);
                    } else {
                        self.done.open.insert((line, var.name.text.to_string()));
                    }
                }
                self.insert(span.end, &prints);
            }
            StmtKind::Block(list) => {
                self.scopes.push();
                self.list(list, ret);
                self.scopes.pop();
            }
            StmtKind::If { cond, then, otherwise } => {
                self.expr(*cond);
                self.open_parts(*cond, line, false);
                self.condition(*cond);
                self.stmt(*then, ret, false);
                if let Some(otherwise) = otherwise {
                    self.stmt(*otherwise, ret, false);
                }
            }
            StmtKind::While { cond, body } | StmtKind::DoWhile { cond, body } => {
                self.expr(*cond);
                self.open_parts(*cond, line, false);
                self.a_loop(*body, span, line, ret);
            }
            StmtKind::For { init, cond, iter, body } => {
                self.scopes.push();
                if let Some(init) = init {
                    match &ast[*init].kind {
                        StmtKind::Declare { ty, vars } => {
                            for var in vars {
                                let own = self.scopes.ty(ty, None, false);
                                self.scopes.declare(&var.name.text, own);
                                self.done.open.insert((line, var.name.text.to_string()));
                                if let Some(init) = var.init {
                                    self.expr(init);
                                    self.open_parts(init, line, false);
                                }
                            }
                        }
                        StmtKind::Expr(e) => {
                            self.expr(*e);
                            self.open_parts(*e, line, false);
                        }
                        _ => {}
                    }
                }
                for e in cond.iter().chain(iter) {
                    self.expr(*e);
                    self.open_parts(*e, line, false);
                }
                self.a_loop(*body, span, line, ret);
                self.scopes.pop();
            }
            StmtKind::Return(value) => match (value, ret) {
                (Some(value), Some(around)) => {
                    self.expr(*value);
                    self.open_parts(*value, line, false);
                    let start = span.start as usize;
                    self.edits.push((start, start + "return".len(), format!("{{ {} r_ = ", around.word)));
                    let mut prints = String::new();
                    self.print(&around.ret, "return", "r_", line, &mut prints);
                    self.insert(span.end, &format!("{prints}{}return r_; }}", self.leave(around)));
                }
                (None, Some(around)) => {
                    self.insert(span.start, &format!("{{{}", self.leave(around)));
                    self.insert(span.end, " }");
                }
                _ => {}
            },
            StmtKind::Function(f) => self.function(f),
            StmtKind::Empty | StmtKind::Break | StmtKind::Continue | StmtKind::Error => {}
        }
    }

    fn a_loop(&mut self, body: StmtId, span: Span, line: u32, ret: Option<&Around>) {
        let number = self.done.loops.len();
        self.done.loops.push(line);
        self.insert(span.start, &format!("{{ printf(\"@P {number}\"); "));
        let inner = self.ast[body].span;
        let range = |span: Span| (span.start as usize, span.end as usize);
        self.done.spans.push([range(span), range(inner)]);
        self.loops.push(number);
        self.insert(inner.start, &format!("{{ printf(\"@O {number}\"); "));
        self.stmt(body, ret, true);
        self.loops.pop();
        self.insert(inner.end, " }");
        self.insert(span.end, " }");
    }

    /// Wraps a condition, so that its truth is printed.
    fn condition(&mut self, id: ExprId) {
        let span = self.ast[id].span;
        let number = self.done.conditions.len();
        let text = self.slice(span).to_string();
        self.done.conditions.push((self.line(span), text));
        // Edits at the same place stand in the order in which they were made, and those inside this
        // expression were made before.
        let at = self.edits.iter().position(|(at, ..)| *at >= span.start as usize && *at < span.end as usize);
        let open = (span.start as usize, span.start as usize, format!("t_({number}, ("));
        self.edits.insert(at.unwrap_or(self.edits.len()), open);
        self.insert(span.end, ") ? 1 : 0)");
    }

    /// Wraps the conditions within an expression.
    fn expr(&mut self, id: ExprId) {
        let ast = self.ast;
        for inner in children(&ast[id]) {
            self.expr(inner);
        }
        match &ast[id].kind {
            ExprKind::Ternary(cond, ..) => self.condition(*cond),
            ExprKind::Binary(ast::BinaryOp::And | ast::BinaryOp::Or, a, b) => {
                self.condition(*a);
                self.condition(*b);
            }
            _ => {}
        }
    }

    /// Notes which variables an expression sets besides the one that a statement prints.
    fn open_parts(&mut self, id: ExprId, line: u32, top: bool) {
        let ast = self.ast;
        match &ast[id].kind {
            ExprKind::Assign { target, .. } | ExprKind::Step { target, .. } if !top => {
                self.open_base(*target, line);
            }
            ExprKind::Call(_, args) | ExprKind::Construct(_, args) => {
                args.iter().for_each(|arg| self.open_base(*arg, line));
            }
            _ => {}
        }
        for inner in children(&ast[id]) {
            let is_top = top && matches!(ast[id].kind, ExprKind::Paren(_));
            self.open_parts(inner, line, is_top);
        }
    }

    fn open_base(&mut self, id: ExprId, line: u32) {
        match &self.ast[id].kind {
            ExprKind::Name(name) => drop(self.done.open.insert((line, name.to_string()))),
            ExprKind::Index(base, _) | ExprKind::Field(base, _) | ExprKind::Paren(base) => {
                self.open_base(*base, line);
            }
            _ => {}
        }
    }

    /// The statements that print what an expression statement sets; `None` if nothing is printed.
    fn prints_of(&mut self, id: ExprId, line: u32) -> Option<String> {
        let ast = self.ast;
        let (target, value) = match &ast[id].kind {
            ExprKind::Assign { target, value, .. } => (*target, Some(*value)),
            // A step of a string sets nothing.
            ExprKind::Step { target, .. } if matches!(self.place(*target), Some((Ty::Text, ..))) => {
                return None;
            }
            ExprKind::Step { target, .. } => (*target, None),
            ExprKind::Paren(inner) => return self.prints_of(*inner, line),
            _ => return None,
        };
        let mut out = String::new();
        if self.print_target((target, value), line, &mut out).is_none() {
            self.open_base(target, line);
            return None;
        }
        Some(out)
    }

    /// Notes an assignment of the shader itself that can be followed by a change.
    fn changeable(&mut self, id: ExprId, span: Span) {
        let ast = self.ast;
        match &ast[id].kind {
            ExprKind::Assign { target, .. } | ExprKind::Step { target, .. } => {
                if let Some((ty, told, path)) = self.place(*target) {
                    let line = self.line(span);
                    self.change(&ty, (base_name(&told).as_str(), path.as_str()), line, span);
                }
            }
            ExprKind::Paren(inner) => self.changeable(*inner, span),
            _ => {}
        }
    }

    fn change(&mut self, ty: &Ty, (name, path): (&str, &str), line: u32, span: Span) {
        let change = match ty {
            Ty::Int => format!(" {path} = {path} + 3;"),
            Ty::Float | Ty::Triple => format!(" {path} = {path} * -3 + 17.25;"),
            Ty::Matrix => format!(" {path} = 7;"),
            Ty::Text => format!(" {path} = \"changed\";"),
            _ => return,
        };
        if self.shader {
            let (loops, end) = (self.loops.clone(), span.end as usize);
            self.done.sets.push(Set { line, name: name.to_string(), change, end, loops });
        }
    }
}

fn children(expr: &Expr) -> Vec<ExprId> {
    match &expr.kind {
        ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) | ExprKind::Name(_) | ExprKind::Error => {
            Vec::new()
        }
        ExprKind::Unary(_, a) | ExprKind::Cast(_, a) | ExprKind::Field(a, _) | ExprKind::Paren(a) => vec![*a],
        ExprKind::Step { target, .. } => vec![*target],
        ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => vec![*a, *b],
        ExprKind::Assign { target, value, .. } => vec![*target, *value],
        ExprKind::Ternary(a, b, c) => vec![*a, *b, *c],
        ExprKind::Construct(_, list)
        | ExprKind::Call(_, list)
        | ExprKind::Comma(list)
        | ExprKind::InitList(list) => list.clone(),
    }
}

/// Whether a type has only the parts that are printed.
fn printable(name: &TypeName) -> bool {
    !matches!(name, TypeName::Void)
}
