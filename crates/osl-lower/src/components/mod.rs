//! The closures of a particular renderer: their parameters, and how calls that do not match are treated.
//!
//! This is not part of the language, in which every closure is data. A stand-in for a renderer uses this
//! module to find the [problems](Problem) among the components that a body needs, to drop with [`stop`] the
//! code that the renderer would not compile, and to give the other components their registered form with
//! [`fit`].

mod stop;

pub use stop::{Stops, stop};

use osl_ir::ir::{Body, Const, Inst, Kernel, Kind, Op, Shape, ValueId};
use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// A closure known to a renderer.
#[derive(Clone, Copy, Debug)]
pub struct RendererClosure {
    /// Its name.
    pub name: &'static str,
    /// Its parameters: the kind and the number of values of each.
    pub params: &'static [(Kind, u32)],
    /// Its keywords in order, each with the kind and the number of its values.
    pub keywords: &'static [(&'static str, Kind, u32)],
}

/// A call that a renderer rejects.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Problem {
    /// The closure is unknown.
    Closure {
        /// Its name.
        name: Arc<str>,
        /// The call.
        span: Span,
    },
    /// The keyword is unknown, or does not take a value of this kind.
    Keyword {
        /// The keyword.
        key: Arc<str>,
        /// Name of the closure.
        name: Arc<str>,
        /// The call.
        span: Span,
    },
}

/// An argument of a component: a value of several parts, or a keyword that is not kept as a value.
#[derive(Clone, Debug)]
enum Item {
    Key(Arc<str>),
    Values(Kind, Vec<ValueId>),
}

/// A call of a closure: its name, its arguments, and its location.
type Component<'b> = (&'b Arc<str>, &'b [Shape], &'b [ValueId], Span);

/// The reachable components of a body.
fn components(body: &Body) -> Vec<Component<'_>> {
    let mut found = Vec::new();
    for inst in body.insts_from(body.entry) {
        if let Op::Kernel(Kernel::Component { name, shapes }, args) = &inst.op {
            found.push((name, &shapes[..], &args[..], inst.span));
        }
    }
    found
}

/// The constant strings of a body.
fn texts(body: &Body) -> FxHashMap<ValueId, Arc<str>> {
    let text = |inst: &Inst| match (&inst.op, inst.results.first()) {
        (Op::Const(Const::Str(text)), Some(result)) => Some((*result, text.clone())),
        _ => None,
    };
    body.insts().filter_map(text).collect()
}

/// The arguments of a call, one by one.
fn items(shapes: &[Shape], args: &[ValueId]) -> Vec<Item> {
    let mut args = args.iter().copied();
    let mut items = Vec::new();
    for shape in shapes {
        items.extend(shape.key.clone().map(Item::Key));
        items.push(Item::Values(shape.kind, args.by_ref().take(shape.count as usize).collect()));
    }
    items
}

/// The pairs of keyword and value after the parameters. A keyword that is not a constant is ignored.
fn pairs<'i>(rest: &'i [Item], texts: &FxHashMap<ValueId, Arc<str>>) -> Vec<(Arc<str>, Kind, &'i [ValueId])> {
    let pair = |pair: &'i [Item]| {
        let [key, Item::Values(kind, values)] = pair else { return None };
        let key = match key {
            Item::Key(key) => key.clone(),
            Item::Values(_, values) => texts.get(values.first()?)?.clone(),
        };
        Some((key, *kind, &values[..]))
    };
    rest.chunks_exact(2).filter_map(pair).collect()
}

fn suits(keyword: &(&str, Kind, u32), (key, kind, values): &(Arc<str>, Kind, &[ValueId])) -> bool {
    (keyword.0, keyword.1, keyword.2 as usize) == (&**key, *kind, values.len())
}

/// The problems that a renderer finds with the components of a body, in the order of the calls; each once.
pub fn problems(body: &Body, known: &[RendererClosure]) -> Vec<Problem> {
    let texts = texts(body);
    let mut found = Vec::new();
    let mut seen = FxHashSet::default();
    for (name, shapes, args, span) in components(body) {
        let Some(closure) = known.iter().find(|k| *k.name == **name) else {
            found.push(Problem::Closure { name: name.clone(), span });
            continue;
        };
        let items = items(shapes, args);
        for pair in pairs(items.get(closure.params.len()..).unwrap_or(&[]), &texts) {
            if !closure.keywords.iter().any(|keyword| suits(keyword, &pair)) {
                found.push(Problem::Keyword { key: pair.0, name: name.clone(), span });
            }
        }
    }
    found.retain(|problem| seen.insert(problem.clone()));
    found
}

/// Gives the components known to a renderer their registered form: the parameters, then the keywords in
/// order, each with its last value of a suitable kind, or zero. Runs before the passes.
pub fn fit(body: &mut Body, known: &[RendererClosure]) {
    let texts = texts(body);
    for at in 0..body.blocks.len() {
        let Some(block) = body.blocks.get_mut(at) else { continue };
        let mut kept = Vec::with_capacity(block.insts.len());
        for mut inst in std::mem::take(&mut block.insts) {
            if let Op::Kernel(Kernel::Component { name, shapes }, args) = &mut inst.op
                && let Some(closure) = known.iter().find(|k| *k.name == **name)
            {
                let mut fitted =
                    Fitted { body, before: &mut kept, span: inst.span, shapes: Vec::new(), args: Vec::new() };
                fitted.closure(closure, &items(shapes, args), &texts);
                let (made, values) = (fitted.shapes, fitted.args);
                (*shapes, *args) = (made, values.into_iter().collect());
            }
            kept.push(inst);
        }
        if let Some(block) = body.blocks.get_mut(at) {
            block.insts = kept;
        }
    }
}

/// A component in its registered form.
struct Fitted<'b> {
    body: &'b mut Body,
    /// The instructions before it.
    before: &'b mut Vec<Inst>,
    span: Span,
    shapes: Vec<Shape>,
    args: Vec<ValueId>,
}

impl Fitted<'_> {
    fn closure(&mut self, closure: &RendererClosure, items: &[Item], texts: &FxHashMap<ValueId, Arc<str>>) {
        for (at, (kind, count)) in closure.params.iter().enumerate() {
            match items.get(at) {
                Some(Item::Key(key)) if (*kind, *count) == (Kind::Str, 1) => {
                    let text = self.constant(Const::Str(key.clone()));
                    self.push(*kind, None, vec![text]);
                }
                Some(Item::Values(own, values)) if (own, values.len()) == (kind, *count as usize) => {
                    self.push(*kind, None, values.clone());
                }
                _ => self.zeros(*kind, *count, None),
            }
        }
        let pairs = pairs(items.get(closure.params.len()..).unwrap_or(&[]), texts);
        for keyword in closure.keywords {
            let (name, kind, count) = *keyword;
            match pairs.iter().rev().find(|pair| suits(keyword, pair)) {
                Some((key, _, values)) => self.push(kind, Some(key.clone()), values.to_vec()),
                None => self.zeros(kind, count, Some(name.into())),
            }
        }
    }

    fn push(&mut self, kind: Kind, key: Option<Arc<str>>, values: Vec<ValueId>) {
        self.shapes.push(Shape { kind, count: values.len() as u32, key });
        self.args.extend(values);
    }

    fn zeros(&mut self, kind: Kind, count: u32, key: Option<Arc<str>>) {
        let zero = self.constant(Const::zero(kind));
        self.push(kind, key, vec![zero; count as usize]);
    }

    fn constant(&mut self, value: Const) -> ValueId {
        let kind = value.kind();
        let id = self.body.fresh(kind, self.span);
        self.before.push(Inst { op: Op::Const(value), results: [id].into_iter().collect(), span: self.span });
        id
    }
}
