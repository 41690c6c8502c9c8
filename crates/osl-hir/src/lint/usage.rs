//! Finds unused declarations: variables, parameters, functions.

use super::walk::{Event, Purpose, Walk, bodies, each_stmt, is_output};
use super::{Findings, codes, removal};
use crate::hir::{ExprKind, FunctionId, MetaValue, StmtKind, Var, VarId, VarKind};
use osl_ir::types::Type;
use osl_syntax::ast::{self, Ast, ExprId, StmtId};
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};

/// Reports unused declarations. A name that begins with an underscore means that this is intended.
pub(super) fn run(ast: &Ast, walk: &Walk<'_>, found: &mut Findings<'_>) {
    let used = Used::of(walk);
    let needed = needed_for_outputs(walk);
    let mut params = Vec::new();
    let statements = Statements::of(ast);
    for (index, var) in walk.program.vars.iter().enumerate() {
        let id = VarId(index as u32);
        let unused = !used.vars.contains(&id) && !var.name.starts_with('_');
        if !unused || !found.is_written(var.span, &var.name) {
            continue;
        }
        match var.kind {
            VarKind::Local if needed.contains(&id) => {}
            VarKind::Local => {
                let assigned = walk.is_written(id);
                let mut d = codes::unused_variable(var.span, &var.name, assigned);
                if let (false, Some(stmt)) = (assigned, statements.alone(ast, var.span)) {
                    d = d.fix("remove the declaration", vec![removal(found.sources, stmt)]);
                }
                found.report(d);
            }
            VarKind::Param { output: false, index } => {
                if !found.is_silenced(var.span) && !is_documentation(walk, index, var) {
                    params.push((var.span, &*var.name));
                }
            }
            // The formals of a prototype need no use; those of functions follow below.
            VarKind::Param { .. } | VarKind::Formal { .. } | VarKind::Global(_) => {}
        }
    }
    // One message for all of them: most are an interface that cannot change.
    params.sort_unstable();
    let names: Vec<&str> = params.iter().map(|(_, name)| *name).collect();
    if let Some((first, _)) = params.first() {
        found.report(codes::unused_shader_parameters(*first, &names));
    }
    formals(walk, &used, found);
    functions(walk, &used, found);
}

/// The variables that are declared with a call that has outputs: the call is there for these, and its value
/// has to go somewhere.
fn needed_for_outputs(walk: &Walk<'_>) -> FxHashSet<VarId> {
    let mut found = FxHashSet::default();
    for body in bodies(walk.program) {
        each_stmt(body, &mut |stmt| {
            if let StmtKind::Declare(var, Some(_)) = &stmt.kind {
                walk.own(stmt, &mut |event| {
                    if let Event::Output { .. } = event {
                        found.insert(*var);
                    }
                });
            }
        });
    }
    found
}

/// Whether a parameter is documentation: a string that cannot be connected, or one with such a name.
fn is_documentation(walk: &Walk<'_>, index: u32, var: &Var) -> bool {
    let Some(param) = walk.program.shader.params.get(index as usize) else { return false };
    let no = MetaValue::Numbers(vec![0.0]);
    let apart = param.metadata.iter().any(|(_, name, value)| &**name == "connectable" && *value == no);
    let noted = ["notes", "note", "documentation", "doc", "help", "comment", "comments"];
    var.ty == Type::STRING && (apart || noted.contains(&&*var.name.to_lowercase()))
}

fn formals(walk: &Walk<'_>, used: &Used, found: &mut Findings<'_>) {
    // The parameters of an overload may be there to select it.
    let mut seen: FxHashSet<&str> = FxHashSet::default();
    let twice: FxHashSet<&str> =
        walk.program.functions.iter().map(|f| &*f.name).filter(|name| !seen.insert(name)).collect();
    let alone = walk.program.functions.iter().filter(|f| !twice.contains(&*f.name));
    for formal in alone.flat_map(|f| &f.formals) {
        let Some(var) = walk.var(*formal) else { continue };
        // A formal that is written carries its value to the caller, and has a separate warning.
        let used = is_output(var) || used.vars.contains(formal) || walk.is_written(*formal);
        if used || var.name.starts_with('_') || !found.is_written(var.span, &var.name) {
            continue;
        }
        let text = format!("_{}", var.name);
        let d = codes::unused_formal(var.span, &var.name);
        found.report(d.suggest(format!("name it `{text}`"), vec![Edit { span: var.span, text }]));
    }
}

fn functions(walk: &Walk<'_>, used: &Used, found: &mut Findings<'_>) {
    let mut unused = Vec::new();
    // A set of overloads is there as a whole.
    let is_called = |index: usize| used.functions.contains(&FunctionId(index as u32));
    let all = &walk.program.functions;
    let called = all.iter().enumerate().filter(|(index, _)| is_called(*index));
    let called_names: FxHashSet<&str> = called.map(|(_, function)| &*function.name).collect();
    for function in all {
        let called = called_names.contains(&*function.name);
        let (name, span) = (&function.name, function.span);
        if !called && !name.starts_with('_') && found.is_written(span, name) && !found.is_silenced(span) {
            unused.push((span, &**name));
        }
    }
    unused.sort_unstable();
    let mut names: Vec<&str> = unused.iter().map(|(_, name)| *name).collect();
    names.dedup();
    if let Some((first, _)) = unused.first() {
        found.report(codes::unused_functions(*first, &names));
    }
}

/// The variables whose values are used, and the functions that are called.
#[derive(Default)]
struct Used {
    vars: FxHashSet<VarId>,
    functions: FxHashSet<FunctionId>,
}

impl Used {
    fn of(walk: &Walk<'_>) -> Used {
        let mut used = Used::default();
        let mut note = |event: Event<'_>| match event {
            Event::Read { var, purpose: Purpose::Value, .. } | Event::Output { var } => {
                used.vars.insert(var);
            }
            Event::Expr(e) => {
                if let ExprKind::Call(id, _) = &e.kind {
                    used.functions.insert(*id);
                }
            }
            Event::Read { purpose: Purpose::Update, .. } | Event::Write { .. } | Event::Conditional(_) => {}
        };
        walk.everything(&mut note);
        used
    }
}

/// The declarations in blocks, by the location of their first name.
struct Statements {
    by_name: FxHashMap<Span, StmtId>,
}

impl Statements {
    fn of(ast: &Ast) -> Statements {
        let mut by_name = FxHashMap::default();
        let mut add = |list: &[StmtId]| {
            for id in list {
                if let ast::StmtKind::Declare { vars, .. } = &ast[*id].kind
                    && let [var] = &vars[..]
                {
                    by_name.insert(var.name.span, *id);
                }
            }
        };
        for item in &ast.items {
            match item {
                ast::Item::Shader(shader) => add(&shader.body.stmts),
                ast::Item::Function(f) => f.body.iter().for_each(|b| add(&b.stmts)),
                ast::Item::Struct(_) => {}
            }
        }
        for stmt in &ast.stmts {
            match &stmt.kind {
                ast::StmtKind::Block(list) => add(list),
                ast::StmtKind::Function(f) => f.body.iter().for_each(|b| add(&b.stmts)),
                _ => {}
            }
        }
        Statements { by_name }
    }

    /// The statement that declares only this name and can be removed without other changes.
    fn alone(&self, ast: &Ast, name: Span) -> Option<Span> {
        let stmt = &ast[*self.by_name.get(&name)?];
        let ast::StmtKind::Declare { vars, .. } = &stmt.kind else { return None };
        let pure = vars.iter().all(|v| v.init.is_none_or(|e| is_pure(ast, e)));
        pure.then_some(stmt.span)
    }
}

/// Whether the expression certainly has no effect. Calls are not examined.
fn is_pure(ast: &Ast, mut id: ExprId) -> bool {
    use ast::ExprKind as E;
    // A chain of operators may be long.
    while let E::Binary(_, a, b) = ast[id].kind {
        if !is_pure(ast, b) {
            return false;
        }
        id = a;
    }
    let all = |list: &[ExprId]| list.iter().all(|e| is_pure(ast, *e));
    match &ast[id].kind {
        E::Int(_) | E::Float(_) | E::Str(_) | E::Name(_) => true,
        E::Unary(_, a) | E::Cast(_, a) | E::Field(a, _) | E::Paren(a) => is_pure(ast, *a),
        E::Index(a, b) => all(&[*a, *b]),
        E::Ternary(a, b, c) => all(&[*a, *b, *c]),
        E::Construct(_, list) | E::Comma(list) | E::InitList(list) => all(list),
        E::Binary(..) | E::Step { .. } | E::Assign { .. } | E::Call(..) | E::Error => false,
    }
}
