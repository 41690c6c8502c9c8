//! Instrumented sources: a shader rewritten so that it prints what it does, statement by statement.
//!
//! It works on the source and its syntax tree, and the result is an ordinary shader. This module must not
//! know how the product follows a point: tests compare the two.

mod compare;
mod types;

pub use compare::{Outcome, hold};

use osl_syntax::ast::{self, Ast, Expr, ExprId, ExprKind, Item, StmtId, StmtKind, TypeName};
use osl_syntax::span::Span;
use std::collections::BTreeSet;
use std::fmt::Write;
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
    /// Variables that are set in ways that are not printed: the line, and the variable.
    pub open: BTreeSet<(u32, String)>,
    /// The functions whose calls are printed.
    pub functions: BTreeSet<String>,
}

/// Rewrites a shader without macros or includes of its own.
pub fn instrument(text: &str, ast: &Ast) -> Instrumented {
    let mut w =
        Writer { ast, text, edits: Vec::new(), done: Instrumented::default(), scopes: Scopes::new(ast) };
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
        self.insert(body.span.start + 1, " printf(\"@E\");");
        let ret = self.scopes.ty(&f.ret, None, false);
        self.list(&body.stmts, Some((ret, self.slice(f.ret.span).to_string())).as_ref());
        self.insert(body.span.end - 1, " printf(\"@X\"); ");
        self.scopes.pop();
    }

    fn list(&mut self, stmts: &[StmtId], ret: Option<&(Ty, String)>) {
        for stmt in stmts {
            self.stmt(*stmt, ret, true);
        }
    }

    /// A statement; `listed` tells whether it stands in a list, where others may stand beside it.
    fn stmt(&mut self, id: StmtId, ret: Option<&(Ty, String)>, listed: bool) {
        let ast = self.ast;
        let stmt = &ast[id];
        let (span, line) = (stmt.span, self.line(stmt.span));
        match &stmt.kind {
            StmtKind::Expr(e) => {
                self.expr(*e);
                self.open_parts(*e, line, true);
                if let Some(prints) = self.prints_of(*e, line) {
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
                        self.print(&own, &var.name.text, &var.name.text, line, &mut prints);
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
                (Some(value), Some((ty, word))) => {
                    self.expr(*value);
                    self.open_parts(*value, line, false);
                    let start = span.start as usize;
                    self.edits.push((start, start + "return".len(), format!("{{ {word} r_ = ")));
                    let mut prints = String::new();
                    self.print(ty, "return", "r_", line, &mut prints);
                    self.insert(span.end, &format!("{prints} printf(\"@X\"); return r_; }}"));
                }
                (None, Some(_)) => {
                    self.insert(span.start, "{ printf(\"@X\"); ");
                    self.insert(span.end, " }");
                }
                _ => {}
            },
            StmtKind::Function(f) => self.function(f),
            StmtKind::Empty | StmtKind::Break | StmtKind::Continue | StmtKind::Error => {}
        }
    }

    fn a_loop(&mut self, body: StmtId, span: Span, line: u32, ret: Option<&(Ty, String)>) {
        let number = self.done.loops.len();
        self.done.loops.push(line);
        self.insert(span.start, &format!("{{ printf(\"@P {number}\"); "));
        let inner = self.ast[body].span;
        self.insert(inner.start, &format!("{{ printf(\"@O {number}\"); "));
        self.stmt(body, ret, true);
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
        let target = match &ast[id].kind {
            ExprKind::Assign { target, .. } | ExprKind::Step { target, .. } => *target,
            ExprKind::Paren(inner) => return self.prints_of(*inner, line),
            _ => return None,
        };
        let mut out = String::new();
        if self.print_target(target, line, &mut out).is_none() {
            self.open_base(target, line);
            return None;
        }
        Some(out)
    }

    fn print_target(&self, target: ExprId, line: u32, out: &mut String) -> Option<()> {
        let (ty, told, path) = self.place(target)?;
        self.print(&ty, &told, &path, line, out);
        Some(())
    }

    /// The type of a place, the name that it has in an explanation, and its path in the source; a component
    /// stands for its variable. In the name, `%d` is an index, which follows after a `|`.
    fn place(&self, id: ExprId) -> Option<(Ty, String, String)> {
        match &self.ast[id].kind {
            ExprKind::Name(name) => Some((self.scopes.find(name)?, name.to_string(), name.to_string())),
            ExprKind::Paren(inner) => self.place(*inner),
            ExprKind::Field(base, field) => {
                let (ty, told, path) = self.place(*base)?;
                match self.scopes.field(&ty, &field.text) {
                    Some(own) => Some((own, join(&told, &field.text), format!("{path}.{}", field.text))),
                    None => ty.is_triple().then_some((ty, told, path)),
                }
            }
            ExprKind::Index(base, index) => {
                let (ty, told, path) = self.place(*base)?;
                let Ty::Array(element, len) = &ty else { return Some((ty, told, path)) };
                let simple = self.is_simple(*index, &base_name(&path));
                let index = self.slice(self.ast[*index].span);
                let told = format!("{told}[%d]|clamp({index}, 0, {})", len.saturating_sub(1));
                simple.then(|| ((**element).clone(), told, format!("{path}[{index}]")))
            }
            _ => None,
        }
    }

    /// Whether an index has the same value after the statement.
    fn is_simple(&self, id: ExprId, set: &str) -> bool {
        let expr = &self.ast[id];
        let own = match &expr.kind {
            ExprKind::Name(name) => &**name != set,
            ExprKind::Call(name, _) => &*name.text == "abs",
            ExprKind::Int(_) | ExprKind::Unary(..) | ExprKind::Paren(_) => true,
            ExprKind::Binary(op, ..) => !matches!(op, ast::BinaryOp::And | ast::BinaryOp::Or),
            _ => false,
        };
        own && children(expr).into_iter().all(|inner| self.is_simple(inner, set))
    }

    /// Statements that print a value, part by part.
    fn print(&self, ty: &Ty, told: &str, path: &str, line: u32, out: &mut String) {
        let (name, index) = match told.split_once('|') {
            Some((name, index)) => (name.to_string(), format!(", {index}")),
            None => (told.to_string(), String::new()),
        };
        let parts = |out: &mut String, form: &str, values: &[String]| {
            let _ = write!(out, " printf(\"@S {line} {name} {form}\"{index}, {});", values.join(", "));
        };
        match ty {
            Ty::Int => parts(out, "i %d", &[path.to_string()]),
            Ty::Float => parts(out, "f %.9g", &[path.to_string()]),
            Ty::Triple => {
                parts(out, "f %.9g %.9g %.9g", &[0, 1, 2].map(|n| format!("{path}[{n}]")));
            }
            Ty::Matrix => {
                let cells: Vec<String> = (0..16).map(|n| format!("{path}[{}][{}]", n / 4, n % 4)).collect();
                parts(out, &format!("f{}", " %.9g".repeat(16)), &cells);
            }
            Ty::Text => parts(out, "s %s", &[path.to_string()]),
            Ty::Struct(id) => {
                for (field, own) in self.scopes.fields(*id) {
                    self.print(own, &join(told, field), &format!("{path}.{field}"), line, out);
                }
            }
            Ty::Array(element, len) => {
                for n in 0..*len {
                    self.print(element, &format!("{told}[{n}]"), &format!("{path}[{n}]"), line, out);
                }
            }
            Ty::Other => {}
        }
    }
}

/// The name of a field: in an explanation, the index of an array of structs stands at the end.
fn join(told: &str, field: &str) -> String {
    match told.find('[') {
        Some(at) => format!("{}.{field}{}", &told[..at], &told[at..]),
        None => format!("{told}.{field}"),
    }
}

fn base_name(path: &str) -> String {
    path.split(['.', '[']).next().unwrap_or_default().to_string()
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
