//! Resolution: from the syntax tree to the [resolved tree](crate::hir).
//!
//! It binds names, checks types, chooses overloads and makes every conversion explicit. It reports through
//! diagnostics and never fails: where there is an error, the tree has an error node, whose type fits
//! everywhere, so that one mistake makes one message. It also resolves trees with [gaps], and then keeps
//! quiet about everything that a gap may explain (`follow`). Rules: OSL language specification, chapters on
//! types, declarations and expressions; where that is silent, the behaviour of published compilers.
//!
//! [gaps]: osl_syntax::gaps::Gaps

mod chain;
mod decl;
pub mod errors;
mod expr;
mod follow;
mod formats;
mod init;
mod instead;
mod invoke;
mod metadata;
pub(crate) mod operators;
mod options;
mod overload;
mod passed;
mod place;
mod score;
mod stmt;
mod unknown;
mod vocabulary;

pub use vocabulary::{Elsewhere, elsewhere};

pub(crate) use expr::unify_numbers;
pub(crate) use formats::count_conversions;
pub(crate) use init::convert_to;

use crate::builtins::{Param, ParamType, Signature, Tail};
use crate::hir::{self, Broken, Function, GLOBALS, Program, Var, VarId, VarKind};
use crate::symbols::{Recorder, Symbols};
use follow::Follow;
use osl_ir::types::{StructTable, Type};
use osl_limits::Limits;
use osl_syntax::ast::Ast;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::errors::too_many_errors;
use osl_syntax::span::Span;
use osl_syntax::{Parsed, Reports};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// The result of resolution.
#[derive(Debug)]
pub struct Resolved {
    /// The program if there is no error, else what was resolved.
    pub program: Result<Program, Broken>,
    /// Errors and warnings, in source order.
    pub diagnostics: Vec<Diagnostic>,
}

/// Resolves a translation unit, and reports every mistake once.
pub fn resolve(ast: &Ast) -> Resolved {
    resolve_with(ast, Reports::Once, &Limits::default())
}

/// Resolves a translation unit.
pub fn resolve_with(ast: &Ast, reports: Reports, limits: &Limits) -> Resolved {
    resolve_recording(ast, reports, limits, None).0
}

/// Resolves the tree of a file, with or without errors, and leaves out what the file's diagnostics say
/// already: messages at the place of an earlier error, and silenced warnings. The program is whole only if
/// the file has no errors either.
pub fn resolve_parsed(parsed: &Parsed, reports: Reports, limits: &Limits) -> Resolved {
    let Resolved { program, mut diagnostics } = resolve_with(&parsed.ast, reports, limits);
    let errors: Vec<Span> =
        parsed.diagnostics.iter().filter(|e| e.is_error()).map(|error| error.span).collect();
    diagnostics.retain(|d| {
        let said = errors.iter().any(|e| e.start < d.span.end && d.span.start < e.end);
        !said && !parsed.silenced.hides(d)
    });
    let program = match program {
        Ok(program) if !errors.is_empty() => Err(program.into()),
        program => program,
    };
    Resolved { program, diagnostics }
}

/// The symbols of a source, which may have errors: names that could not be bound are missing.
pub fn symbols(ast: &Ast, limits: &Limits) -> Symbols {
    let (resolved, recorder) = resolve_recording(ast, Reports::Once, limits, Some(Recorder::default()));
    let structs = match resolved.program {
        Ok(program) => program.structs,
        Err(broken) => broken.structs,
    };
    recorder.unwrap_or_default().finish(structs)
}

/// Resolves a translation unit, and records its symbols if there is a recorder.
fn resolve_recording(
    ast: &Ast,
    reports: Reports,
    limits: &Limits,
    recorder: Option<Recorder>,
) -> (Resolved, Option<Recorder>) {
    let mut resolver = Resolver::new(ast, reports, limits);
    resolver.recorder = recorder;
    if let Some(recorder) = &mut resolver.recorder {
        for (index, var) in resolver.vars.iter().enumerate() {
            recorder.variable(VarId(index as u32), &var.name, var.ty, var.kind, var.span);
        }
    }
    let shader = resolver.items();
    let Resolver { structs, vars, functions, mut diagnostics, checked, dropped, recorder, choices, .. } =
        resolver;
    if ast.gaps.is_empty() && !diagnostics.iter().any(Diagnostic::is_error) {
        diagnostics.extend(checked);
    }
    diagnostics.extend(dropped.map(|span| too_many_errors(span, limits.reading.diagnostics)));
    let whole = ast.gaps.is_empty() && !diagnostics.iter().any(Diagnostic::is_error);
    let program = match shader {
        Some(shader) if whole => {
            let program = Program { structs, vars, functions, shader, choices, places: Default::default() };
            let changed = passed::check(&program);
            if changed.is_empty() {
                Ok(program)
            } else {
                diagnostics.extend(changed);
                Err(program.into())
            }
        }
        shader => Err(Broken { structs, vars, functions, shader }),
    };
    diagnostics.sort_by_key(|d| (d.span.start, d.span.end));
    (Resolved { program, diagnostics }, recorder)
}

/// A function as callers see it.
#[derive(Clone, Debug)]
struct FunctionSymbol {
    /// `None` while only a prototype was seen.
    id: Option<hir::FunctionId>,
    name: Arc<str>,
    ret: Type,
    formals: Vec<(Type, bool)>,
    /// The names of its formals.
    names: Vec<Arc<str>>,
    /// Whether it is marked as an operation of the renderer: it needs no body, and an existing body is
    /// ignored.
    operation: bool,
    /// Whether a body without errors has no `return` of a value, although the function has a type.
    never_returns: bool,
    /// Whether its parameters are not known, because a gap is among them.
    open: bool,
    span: Span,
}

impl FunctionSymbol {
    /// The arguments that calls may add after its formals.
    fn tail(&self) -> Tail {
        if self.operation && self.ret == Type::CLOSURE { Tail::Keywords } else { Tail::None }
    }

    /// Its signature in the notation of the table of built-ins.
    fn signature(&self) -> Signature {
        let params = self.formals.iter().map(|(ty, output)| Param {
            name: "",
            ty: ParamType::Of(*ty),
            output: *output,
        });
        Signature { ret: self.ret, params: params.collect(), tail: self.tail() }
    }
}

#[derive(Clone, Debug)]
enum Symbol {
    Var(VarId),
    /// Overloads, oldest first.
    Functions(Vec<Arc<FunctionSymbol>>),
}

#[derive(Debug, Default)]
struct Scope {
    symbols: FxHashMap<Arc<str>, Symbol>,
}

/// The context of a statement.
#[derive(Clone, Copy, Debug)]
struct Context {
    /// Return type of the function; `None` in a shader body.
    ret: Option<Type>,
    /// Number of loops around the statement, within the function.
    loops: u32,
}

/// The contents of a struct, including nested fields.
#[derive(Clone, Copy, Debug, Default)]
struct Contents {
    values: u64,
    array: bool,
    /// Nesting depth of structs in it, including itself.
    depth: u64,
}

struct Resolver<'a> {
    ast: &'a Ast,
    reports: Reports,
    limits: &'a Limits,
    structs: StructTable,
    vars: Vec<Var>,
    functions: Vec<Function>,
    scopes: Vec<Scope>,
    diagnostics: Vec<Diagnostic>,
    /// For scripts that count errors: those that the reference finds when it checks the types of the shader,
    /// which it does only if there are no others.
    checked: Vec<Diagnostic>,
    n_errors: usize,
    /// The location of the first dropped error.
    dropped: Option<Span>,
    /// Number of values in each struct, and whether there is an array among its fields.
    contents: Vec<Contents>,
    /// Nesting depth of indices around the current expression.
    index_depth: u64,
    context: Context,
    /// Whether any statement of the current function returns a value.
    returns: bool,
    /// Unknown names that were reported in the current function.
    told: FxHashSet<String>,
    /// The variable whose declaration is being resolved.
    declaring: Option<Arc<str>>,
    /// Whether the default of a parameter of the shader is being resolved.
    in_default: bool,
    /// The keywords that may stand instead of the type that is resolved.
    keywords: &'static [&'static str],
    /// What errors and gaps so far explain.
    follow: Follow,
    /// Where symbols are recorded.
    recorder: Option<Recorder>,
    /// Why calls take their functions.
    choices: FxHashMap<u32, hir::Choice>,
    /// The calls of which only a float fits, by the position of their names.
    unambiguous: FxHashSet<u32>,
}

impl<'a> Resolver<'a> {
    fn new(ast: &'a Ast, reports: Reports, limits: &'a Limits) -> Self {
        let mut resolver = Resolver {
            ast,
            reports,
            limits,
            structs: StructTable::default(),
            vars: Vec::new(),
            functions: Vec::new(),
            scopes: vec![Scope::default()],
            diagnostics: Vec::new(),
            checked: Vec::new(),
            n_errors: 0,
            dropped: None,
            contents: Vec::new(),
            index_depth: 0,
            context: Context { ret: None, loops: 0 },
            returns: false,
            told: FxHashSet::default(),
            declaring: None,
            in_default: false,
            keywords: &[],
            follow: Follow::default(),
            recorder: None,
            choices: FxHashMap::default(),
            unambiguous: FxHashSet::default(),
        };
        for (global, name, ty, _) in GLOBALS {
            resolver.add_var(name.into(), ty, VarKind::Global(global), Span::default());
        }
        resolver
    }

    /// Keeps a diagnostic, unless there are too many of its severity.
    fn report(&mut self, diagnostic: Diagnostic) {
        let parsing = follow::is_of_names(&diagnostic);
        self.report_when(diagnostic, parsing);
    }

    /// The same, with whether the reference finds the mistake before it checks types.
    fn report_when(&mut self, diagnostic: Diagnostic, parsing: bool) {
        if self.follows(&diagnostic) {
            return;
        }
        if diagnostic.is_error() {
            self.n_errors += 1;
            if self.n_errors > self.max_diagnostics() {
                self.dropped.get_or_insert(diagnostic.span);
                return;
            }
        } else if self.is_full() {
            return;
        }
        // The types of a function are checked where it is declared.
        let later = self.reports == Reports::AsReference && !parsing && self.context.ret.is_none();
        let list = if later { &mut self.checked } else { &mut self.diagnostics };
        list.push(diagnostic);
    }

    /// Reports an expression with an error once more where it is used, if the reference does so: its type
    /// does not suit.
    fn report_again(&mut self, value: Span, use_of_it: &str) {
        if self.reports != Reports::AsReference {
            return;
        }
        let within = |d: &&Diagnostic| d.is_error() && value.start <= d.span.start && d.span.end <= value.end;
        let Some(cause) = self.checked.iter().chain(&self.diagnostics).find(within) else { return };
        // A call without a value is an error only where it is used.
        if cause.code == errors::VOID_VALUE && cause.span == value {
            return;
        }
        let (code, message) = (cause.code, format!("an expression that has an error is {use_of_it}"));
        self.report_when(Diagnostic::error(code, value, message), false);
    }

    /// Whether a further warning would be dropped. Errors have a separate limit.
    fn is_full(&self) -> bool {
        self.diagnostics.len()
            >= self.max_diagnostics().saturating_add(self.n_errors.min(self.max_diagnostics()))
    }

    /// Maximum number of errors, and of warnings.
    fn max_diagnostics(&self) -> usize {
        usize::try_from(self.limits.reading.diagnostics).unwrap_or(usize::MAX)
    }

    fn scope(&mut self) -> &mut Scope {
        // The file's scope is never popped; if the stack were empty, only the symbol would be lost.
        if self.scopes.is_empty() {
            self.scopes.push(Scope::default());
        }
        let last = self.scopes.len() - 1;
        &mut self.scopes[last]
    }

    fn within_scope<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        self.scopes.push(Scope::default());
        let result = work(self);
        self.scopes.pop();
        result
    }

    /// Adds a variable to the innermost scope without checking for clashes.
    fn add_var(&mut self, name: Arc<str>, ty: Type, kind: VarKind, span: Span) -> VarId {
        let id = VarId(self.vars.len() as u32);
        if let Some(recorder) = &mut self.recorder {
            recorder.variable(id, &name, ty, kind, span);
        }
        self.vars.push(Var { name: name.clone(), ty, kind, span });
        self.scope().symbols.insert(name, Symbol::Var(id));
        id
    }

    fn var(&self, id: VarId) -> &Var {
        &self.vars[id.0 as usize]
    }

    /// The symbol of a name in the innermost scope that has it, with the depth of that scope.
    fn lookup(&self, name: &str) -> Option<(usize, &Symbol)> {
        self.scopes
            .iter()
            .enumerate()
            .rev()
            .find_map(|(depth, scope)| scope.symbols.get(name).map(|symbol| (depth, symbol)))
    }

    fn show(&self, ty: Type) -> String {
        self.structs.show(ty)
    }

    /// The type with its article: `a float`, `an int`, `a struct slot`.
    fn show_a(&self, ty: Type) -> String {
        let name = self.show(ty);
        match ty.base {
            osl_ir::types::Base::Struct(_) => format!("a struct {name}"),
            osl_ir::types::Base::Int => format!("an {name}"),
            _ => format!("a {name}"),
        }
    }

    /// The functions in scope, or the variables, for "did you mean".
    fn names_in_scope(&self, functions: bool) -> Vec<&str> {
        let symbols = self.scopes.iter().flat_map(|scope| &scope.symbols);
        let fits = symbols.filter(|(_, symbol)| matches!(symbol, Symbol::Functions(_)) == functions);
        let mut names: Vec<&str> = fits.map(|(name, _)| &**name).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}
