//! The resolved tree as a stream of events in the order of evaluation: which variable is read or written
//! where.

use crate::hir::{
    Arg, BuiltinCall, Expr, ExprKind, FunctionId, Init, Lvalue, Program, Stmt, StmtKind, Var, VarId, VarKind,
};
use osl_syntax::span::Span;
use std::cell::Cell;

/// What a read is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Its value is used.
    Value,
    /// Only to write the same variable again: `x += 1;`, `x++;`.
    Update,
}

/// An event in the evaluation of an expression.
#[derive(Debug)]
pub enum Event<'p> {
    /// An expression begins; its parts follow.
    Expr(&'p Expr),
    /// A variable, or a part of it, is read.
    Read { var: VarId, span: Span, purpose: Purpose },
    /// A variable, or a part of it, is assigned.
    Write { var: VarId, span: Span },
    /// A variable is passed where it may be written: it counts as read and as written.
    Output { var: VarId },
    /// From here on (`true`) to the matching `false`, evaluation depends on a condition.
    Conditional(bool),
}

/// The receiver of the events.
pub(crate) type Sink<'s, 'p> = &'s mut dyn FnMut(Event<'p>);

/// Whether the variable carries its value to a caller.
pub(super) fn is_output(var: &Var) -> bool {
    matches!(var.kind, VarKind::Param { output: true, .. } | VarKind::Formal { output: true })
}

/// A program with the facts that its walkers need.
pub struct Walk<'p> {
    pub(super) program: &'p Program,
    written: Vec<Cell<bool>>,
}

impl<'p> Walk<'p> {
    /// Finds the variables that are written. A function precedes its callers, so that one pass is enough.
    pub fn new(program: &'p Program) -> Self {
        let walk = Walk { program, written: vec![Cell::new(false); program.vars.len()] };
        for body in bodies(program) {
            walk.all(body, &mut |event| {
                if let Event::Write { var, .. } | Event::Output { var } = event
                    && let Some(flag) = walk.written.get(var.0 as usize)
                {
                    flag.set(true);
                }
            });
        }
        walk
    }

    /// Whether anything writes the variable after its declaration.
    pub(crate) fn is_written(&self, id: VarId) -> bool {
        self.written.get(id.0 as usize).is_some_and(Cell::get)
    }

    /// The variable of an id.
    pub(crate) fn var(&self, id: VarId) -> Option<&'p Var> {
        self.program.vars.get(id.0 as usize)
    }

    /// Every event of the program: parameters' defaults, functions, the shader.
    pub(super) fn everything(&self, sink: Sink<'_, 'p>) {
        self.params(sink);
        for body in bodies(self.program) {
            self.all(body, sink);
        }
    }

    /// Every event of the parameters' defaults.
    pub(crate) fn params(&self, sink: Sink<'_, 'p>) {
        for param in &self.program.shader.params {
            self.init(&param.init, sink);
        }
    }

    /// Every event of the statements, nested ones included, in the order of the text.
    pub fn all(&self, body: &'p [Stmt], sink: Sink<'_, 'p>) {
        each_stmt(body, &mut |stmt| self.own(stmt, sink));
    }

    /// The events of a statement's own expressions.
    pub(super) fn own(&self, stmt: &'p Stmt, sink: Sink<'_, 'p>) {
        match &stmt.kind {
            StmtKind::Expr(e) => self.expr(e, false, sink),
            StmtKind::Declare(_, Some(init)) | StmtKind::Return(Some(init)) => self.init(init, sink),
            StmtKind::If(cond, ..) => self.expr(cond, true, sink),
            StmtKind::Loop { cond, iter, .. } => {
                if let Some(cond) = cond {
                    self.expr(cond, true, sink);
                }
                if let Some(iter) = iter {
                    self.expr(iter, false, sink);
                }
            }
            StmtKind::Declare(_, None)
            | StmtKind::Return(None)
            | StmtKind::Block(_)
            | StmtKind::Break
            | StmtKind::Continue => {}
        }
    }

    pub(super) fn init(&self, init: &'p Init, sink: Sink<'_, 'p>) {
        init.exprs().into_iter().for_each(|e| self.expr(e, true, sink));
    }

    /// The events of an expression; `used` tells whether its value is used.
    pub(super) fn expr(&self, e: &'p Expr, used: bool, sink: Sink<'_, 'p>) {
        sink(Event::Expr(e));
        match &e.kind {
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::NullClosure
            | ExprKind::Error => {}
            ExprKind::Read(place) => self.read(place, Purpose::Value, sink),
            ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => self.expr(inner, true, sink),
            ExprKind::Binary(op, a, b) => {
                self.expr(a, true, sink);
                let short = matches!(op, osl_syntax::ast::BinaryOp::And | osl_syntax::ast::BinaryOp::Or);
                self.conditional(short, sink, |sink| self.expr(b, true, sink));
            }
            ExprKind::Ternary(cond, a, b) => {
                self.expr(cond, true, sink);
                self.conditional(true, sink, |sink| self.expr(a, used, sink));
                self.conditional(true, sink, |sink| self.expr(b, used, sink));
            }
            ExprKind::Assign(place, value) => self.assign(place, value, used, sink),
            ExprKind::Step { place, .. } => {
                self.read(place, if used { Purpose::Value } else { Purpose::Update }, sink);
                sink(Event::Write { var: place.var, span: place.span });
            }
            ExprKind::Triple(parts) => parts.iter().for_each(|p| self.expr(p, true, sink)),
            ExprKind::Matrix(parts) => parts.iter().for_each(|p| self.expr(p, true, sink)),
            ExprKind::Struct(parts) => parts.iter().for_each(|p| self.init(p, sink)),
            ExprKind::Call(id, args) => self.call(*id, args, e.span, sink),
            ExprKind::Builtin(call) => self.builtin(call, sink),
            ExprKind::Operation(call) => call.args.iter().for_each(|arg| self.expr(arg, true, sink)),
            ExprKind::Comma(parts) => {
                let last = parts.len().saturating_sub(1);
                parts.iter().enumerate().for_each(|(i, p)| self.expr(p, used && i == last, sink));
            }
        }
    }

    fn conditional(&self, is: bool, sink: Sink<'_, 'p>, work: impl FnOnce(Sink<'_, 'p>)) {
        if is {
            sink(Event::Conditional(true));
        }
        work(sink);
        if is {
            sink(Event::Conditional(false));
        }
    }

    fn assign(&self, place: &'p Lvalue, value: &'p Init, used: bool, sink: Sink<'_, 'p>) {
        match compound(place, value) {
            Some((target, right)) => {
                self.read(target, if used { Purpose::Value } else { Purpose::Update }, sink);
                self.expr(right, true, sink);
            }
            None => {
                self.init(value, sink);
                self.indices(place, sink);
            }
        }
        sink(Event::Write { var: place.var, span: place.span });
    }

    fn read(&self, place: &'p Lvalue, purpose: Purpose, sink: Sink<'_, 'p>) {
        self.indices(place, sink);
        sink(Event::Read { var: place.var, span: place.span, purpose });
    }

    fn indices(&self, place: &'p Lvalue, sink: Sink<'_, 'p>) {
        place.indices().for_each(|index| self.expr(index, true, sink));
    }

    fn call(&self, id: FunctionId, args: &'p [Arg], span: Span, sink: Sink<'_, 'p>) {
        let formals = self.program.functions.get(id.0 as usize).map_or(&[][..], |f| &f.formals);
        for (index, arg) in args.iter().enumerate() {
            let writes = formals.get(index).is_some_and(|formal| {
                let output = self.var(*formal).is_some_and(is_output);
                output || self.is_written(*formal)
            });
            match arg {
                Arg::Alias(place) if writes => sink(Event::Output { var: place.var }),
                Arg::Alias(place) => sink(Event::Read { var: place.var, span, purpose: Purpose::Value }),
                Arg::Copy { back: Some(place), .. } => {
                    self.indices(place, sink);
                    sink(Event::Output { var: place.var });
                }
                Arg::Copy { value, back: None } => self.init(value, sink),
            }
        }
    }

    fn builtin(&self, call: &'p BuiltinCall, sink: Sink<'_, 'p>) {
        let signature = call.row.signatures().get(call.overload);
        for (index, arg) in call.args.iter().enumerate() {
            let output = match signature.and_then(|s| s.params.get(index)) {
                Some(param) => param.output,
                // Further arguments are read. Options such as `alpha` of a texture are written.
                None => call.outputs.get(index).is_some_and(Option::is_some),
            };
            match &arg.kind {
                ExprKind::Read(place) if output => {
                    self.indices(place, sink);
                    sink(Event::Output { var: place.var });
                }
                _ => self.expr(arg, true, sink),
            }
        }
    }
}

/// The target and the right-hand side of `place op= value`, which the resolved tree represents as
/// `place = place op value`: the two places then have the same span.
fn compound<'p>(place: &Lvalue, value: &'p Init) -> Option<(&'p Lvalue, &'p Expr)> {
    let Init::Value(value) = value else { return None };
    let ExprKind::Binary(_, left, right) = &unconverted(value).kind else { return None };
    match &unconverted(left).kind {
        ExprKind::Read(target) if target.var == place.var && target.span == place.span => {
            Some((target, right))
        }
        _ => None,
    }
}

/// The expression without its conversions.
fn unconverted(mut e: &Expr) -> &Expr {
    while let ExprKind::Convert(inner) = &e.kind {
        e = inner;
    }
    e
}

/// Counts how often variables are written, and how often as a whole by a literal.
pub fn count_writes(event: Event<'_>, writes: &mut rustc_hash::FxHashMap<VarId, (u32, u32)>) {
    match event {
        Event::Write { var, .. } => writes.entry(var).or_default().0 += 1,
        Event::Output { var } => writes.entry(var).or_default().0 += 2,
        Event::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) if place.path.is_empty() => {
            let literal =
                |e: &Expr| matches!(e.kind, ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_));
            if matches!(&**value, Init::Value(e) if literal(unconverted(e))) {
                writes.entry(place.var).or_default().1 += 1;
            }
        }
        _ => {}
    }
}

/// The bodies of a program: functions in the order of their definition, then the shader.
pub fn bodies(program: &Program) -> impl Iterator<Item = &[Stmt]> {
    program.functions.iter().map(|f| &f.body[..]).chain([&program.shader.body[..]])
}

/// Visits every expression of a program: defaults of parameters, functions, the shader.
pub fn walk_expressions<'p>(program: &'p Program, visit: &mut dyn FnMut(&'p Expr)) {
    Walk::new(program).everything(&mut |event| {
        if let Event::Expr(e) = event {
            visit(e);
        }
    });
}

/// Visits statements and what is nested in them, in the order of the text.
pub fn each_stmt<'p>(list: &'p [Stmt], visit: &mut dyn FnMut(&'p Stmt)) {
    for stmt in list {
        visit(stmt);
        match &stmt.kind {
            StmtKind::Block(inner) | StmtKind::Loop { body: inner, .. } => each_stmt(inner, visit),
            StmtKind::If(_, then, otherwise) => {
                each_stmt(then, visit);
                each_stmt(otherwise, visit);
            }
            StmtKind::Expr(_)
            | StmtKind::Declare(..)
            | StmtKind::Break
            | StmtKind::Continue
            | StmtKind::Return(_) => {}
        }
    }
}
