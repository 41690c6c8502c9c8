//! What each line of a source does: the variables that it sets, its conditions and its loops, as the taps
//! that show them.
//!
//! A variable is listed only if a tap of its name at its line finds it: one that an inner variable hides is
//! not.

use super::{Site, Tap, TapPart, TapPath, Tapped, find};
use osl_hir::hir::{
    Arg, Expr, ExprKind, FunctionId, Init, Lvalue, Program, Step, Stmt, StmtKind, VarId, VarKind,
};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// A variable, or a part of one, that a line sets.
#[derive(Clone, Debug)]
pub struct Set {
    /// The line, the variable and its part, as a user writes them: the last value.
    pub wanted: TapPath,
    /// The tap.
    pub tap: Tap,
    /// If the line is inside of a loop, the taps of its first visits.
    pub rounds: Vec<Tap>,
}

/// A condition of an `if`.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The line of the `if`.
    pub line: u32,
    /// The number of times that it was true.
    pub is_true: Tap,
    /// The number of times that it was false.
    pub is_false: Tap,
}

/// A loop.
#[derive(Clone, Debug)]
pub struct Rounds {
    /// The line of its head.
    pub line: u32,
    /// The number of its rounds, of all times that a point got to it.
    pub tap: Tap,
}

/// What the lines of a file do.
#[derive(Clone, Debug, Default)]
pub struct Doings {
    /// The variables, in the order of the lines.
    pub sets: Vec<Set>,
    /// The conditions, in the order of the lines.
    pub branches: Vec<Branch>,
    /// The loops, in the order of the lines.
    pub loops: Vec<Rounds>,
    /// How many of these are left out.
    pub more: usize,
}

/// How much is listed.
#[derive(Clone, Copy, Debug)]
pub struct Most {
    /// Variables, conditions and loops.
    pub taps: usize,
    /// Visits of a line inside of a loop.
    pub rounds: u32,
    /// Only what this line does.
    pub line: Option<u32>,
}

/// Maximum number of elements of an array that are listed.
const ELEMENTS: u32 = 4;
/// Maximum depth of structs that are listed.
const DEPTH: usize = 8;

/// What the lines of the main file of a program do; its files are in `sources` from `base` on. What exceeds
/// `most` is left out, from the last line up; of a single line, the last of its doings.
pub fn doings(program: &Program, (sources, base): (&SourceMap, u32), layer: usize, most: Most) -> Doings {
    let Walk { mut places, mut done, .. } = walk(program, (sources, base), layer);
    if let Some(line) = most.line {
        places.retain(|place| place.wanted.line == line);
        done.branches.retain(|branch| branch.line == line);
        done.loops.retain(|rounds| rounds.line == line);
    }
    places.sort_by_key(|place| place.wanted.line);
    done.branches.sort_by_key(|branch| branch.line);
    done.loops.sort_by_key(|rounds| rounds.line);
    let lines = lines_of(&places, &done);
    if most.line.is_some() {
        done.more = lines.len().saturating_sub(most.taps);
        done.loops.truncate(most.taps);
        done.branches.truncate(most.taps - done.loops.len());
        places.truncate(most.taps - done.loops.len() - done.branches.len());
    } else if let Some(line) = lines.get(most.taps).copied() {
        done.more = lines.iter().filter(|at| **at >= line).count();
        places.retain(|place| place.wanted.line < line);
        done.branches.retain(|branch| branch.line < line);
        done.loops.retain(|rounds| rounds.line < line);
    }
    let found = |wanted: &TapPath| find(wanted, program, (sources, base), layer).ok();
    for SetVariable { var, wanted, in_loop } in places {
        if let Some(tap) = found(&wanted).filter(|tap| tap.var == Tapped::Var(var)) {
            let rounds = (1..=if in_loop { most.rounds } else { 0 })
                .filter_map(|round| found(&TapPath { round: Some(round), ..wanted.clone() }))
                .filter(|tap| tap.var == Tapped::Var(var))
                .collect();
            done.sets.push(Set { wanted, tap, rounds });
        }
    }
    done
}

/// The lines of the main file of a program that set a variable, or have a condition or a loop, in order.
pub fn doing_lines(program: &Program, files: (&SourceMap, u32)) -> Vec<u32> {
    let Walk { places, done, .. } = walk(program, files, 0);
    let mut lines = lines_of(&places, &done);
    lines.dedup();
    lines
}

/// A line for each variable, condition and loop, in order.
fn lines_of(places: &[SetVariable], done: &Doings) -> Vec<u32> {
    let sets = places.iter().map(|place| place.wanted.line);
    let branches = done.branches.iter().map(|branch| branch.line);
    let mut lines: Vec<u32> = sets.chain(branches).chain(done.loops.iter().map(|l| l.line)).collect();
    lines.sort_unstable();
    lines
}

/// All that the main file of a program does.
fn walk<'p>(program: &'p Program, (sources, base): (&'p SourceMap, u32), layer: usize) -> Walk<'p> {
    let file = sources.file_at(base).map(|file| file.name.clone()).unwrap_or_default();
    let mut walk = Walk {
        program,
        sources,
        base,
        layer,
        file,
        loops: 0,
        line: 0,
        places: Vec::new(),
        known: FxHashMap::default(),
        done: Doings::default(),
    };
    program.functions.iter().for_each(|function| walk.list(&function.body));
    walk.list(&program.shader.body);
    walk
}

/// A variable, or a part of one, that a line sets.
struct SetVariable {
    var: VarId,
    wanted: TapPath,
    in_loop: bool,
}

struct Walk<'p> {
    program: &'p Program,
    sources: &'p SourceMap,
    base: u32,
    layer: usize,
    file: String,
    loops: usize,
    /// The line of the statement; 0 if it is in another file.
    line: u32,
    places: Vec<SetVariable>,
    /// The index of each place, by its variable and the name of its output.
    known: FxHashMap<(u32, String), usize>,
    done: Doings,
}

impl Walk<'_> {
    fn line_of(&self, span: Span) -> Option<u32> {
        let place = self.sources.line(span.moved(self.base));
        place.filter(|(file, _)| file.name == self.file).map(|(_, line)| line)
    }

    fn list(&mut self, list: &[Stmt]) {
        list.iter().for_each(|stmt| self.stmt(stmt));
    }

    fn stmt(&mut self, stmt: &Stmt) {
        self.line = self.line_of(stmt.span).unwrap_or(0);
        let line = self.line;
        match &stmt.kind {
            StmtKind::Expr(e) => self.expr(e),
            StmtKind::Declare(id, init) => {
                init.iter().for_each(|init| self.init(init));
                if let Some(var) = self.program.vars.get(id.0 as usize) {
                    self.set(*id, Vec::new(), var.ty, 0);
                }
            }
            StmtKind::Block(list) => self.list(list),
            StmtKind::If(cond, then, otherwise) => {
                self.expr(cond);
                if line > 0 {
                    let tap = |site: fn(u32, u32) -> Site, word: &str| {
                        self.visits(site(cond.span.start, cond.span.end), line, word)
                    };
                    let (is_true, is_false) = (tap(Site::True, "true"), tap(Site::False, "false"));
                    self.done.branches.push(Branch { line, is_true, is_false });
                }
                self.list(then);
                self.list(otherwise);
            }
            StmtKind::Loop { cond, iter, body, .. } => {
                if line > 0 {
                    let tap = self.visits(Site::Start(stmt.span.start, stmt.span.end), line, "rounds");
                    self.done.loops.push(Rounds { line, tap });
                }
                self.loops += 1;
                cond.iter().chain(iter).for_each(|e| self.expr(e));
                self.list(body);
                self.loops -= 1;
            }
            StmtKind::Return(init) => init.iter().for_each(|init| self.init(init)),
            StmtKind::Break | StmtKind::Continue => {}
        }
    }

    /// A tap that counts how often a point gets to a site. No variable has its name.
    fn visits(&self, site: Site, line: u32, word: &str) -> Tap {
        let (Site::After(start, end)
        | Site::Round(start, end)
        | Site::Start(start, end)
        | Site::True(start, end)
        | Site::False(start, end)) = site;
        let name = format!("line{line}:{word}:{start}:{end}");
        Tap {
            mask: format!("{name}:reached").into(),
            name: name.into(),
            layer: self.layer,
            ty: Type::INT,
            conditional: false,
            site,
            var: Tapped::Visits,
            fields: Vec::new(),
            elements: Vec::new(),
            component: None,
            round: None,
            calls: Vec::new(),
        }
    }

    /// Adds the parts of a variable that have a picture.
    fn set(&mut self, var: VarId, path: Vec<TapPart>, ty: Type, depth: usize) {
        if self.line == 0 || depth > DEPTH {
            return;
        }
        let with = |part: TapPart| {
            let mut path = path.clone();
            path.push(part);
            path
        };
        match (ty.extent, ty.base) {
            (Extent::Array(len), _) => {
                for index in 0..len.min(ELEMENTS) {
                    self.set(var, with(TapPart::Element(index)), ty.element(), depth + 1);
                }
            }
            (Extent::Unsized, _) => {}
            (Extent::One, Base::Struct(id)) => {
                for field in &self.program.structs.get(id).fields {
                    self.set(var, with(TapPart::Field(field.name.to_string())), field.ty, depth + 1);
                }
            }
            (Extent::One, Base::Int | Base::Float) => self.add(var, path),
            (Extent::One, _) if ty.is_triple() => self.add(var, path),
            _ => {}
        }
    }

    fn add(&mut self, var: VarId, path: Vec<TapPart>) {
        let Some(known) = self.program.vars.get(var.0 as usize) else { return };
        let (line, variable) = (self.line, known.name.to_string());
        let wanted = TapPath { file: None, calls: Vec::new(), line, variable, path, round: None };
        let in_loop = self.loops > 0;
        let at = *self.known.entry((var.0, wanted.output())).or_insert(self.places.len());
        match self.places.get_mut(at) {
            Some(place) => place.in_loop |= in_loop,
            None => self.places.push(SetVariable { var, wanted, in_loop }),
        }
    }

    fn place(&mut self, place: &Lvalue) {
        self.indices(place);
        let Some(var) = self.program.vars.get(place.var.0 as usize) else { return };
        let (mut ty, mut path) = (var.ty, Vec::new());
        for step in &place.path {
            match step {
                Step::Field(index) if !ty.is_array() => {
                    let field = ty
                        .as_struct()
                        .and_then(|id| self.program.structs.get(id).fields.get(*index as usize));
                    let Some(field) = field else { return };
                    path.push(TapPart::Field(field.name.to_string()));
                    ty = field.ty;
                }
                Step::Element(index) if ty.is_array() => {
                    // Which element it is may differ from point to point.
                    let ExprKind::Int(at) = index.kind else { break };
                    let Ok(at) = u32::try_from(at) else { return };
                    path.push(TapPart::Element(at));
                    ty = ty.element();
                }
                // A component belongs to its triple.
                _ => break,
            }
        }
        self.set(place.var, path, ty, 0);
    }

    fn indices(&mut self, place: &Lvalue) {
        place.indices().for_each(|e| self.expr(e));
    }

    fn init(&mut self, init: &Init) {
        init.exprs().into_iter().for_each(|e| self.expr(e));
    }

    fn call(&mut self, id: FunctionId, args: &[Arg]) {
        let formals = self.program.functions.get(id.0 as usize).map_or(&[][..], |f| &f.formals);
        for (at, arg) in args.iter().enumerate() {
            let var = formals.get(at).and_then(|formal| self.program.vars.get(formal.0 as usize));
            let output = var.is_some_and(|var| var.kind == (VarKind::Formal { output: true }));
            match arg {
                Arg::Alias(place) if output => self.place(place),
                Arg::Alias(place) => self.indices(place),
                Arg::Copy { value, back } => {
                    self.init(value);
                    back.iter().for_each(|place| self.place(place));
                }
            }
        }
    }

    fn expr(&mut self, e: &Expr) {
        match &e.kind {
            ExprKind::Assign(place, value) => {
                self.init(value);
                self.place(place);
            }
            ExprKind::Step { place, .. } => self.place(place),
            ExprKind::Call(id, args) => self.call(*id, args),
            ExprKind::Builtin(call) => {
                call.args.iter().for_each(|arg| self.expr(arg));
                call.outputs.iter().flatten().for_each(|place| self.place(place));
            }
            _ => e.parts().into_iter().for_each(|e| self.expr(e)),
        }
    }
}
