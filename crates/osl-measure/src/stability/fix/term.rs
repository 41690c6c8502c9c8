//! Expressions as terms: sums and products are lists, so that `a + b - a` has one form however it is written.
//!
//! Terms come from the resolved tree of a shader ([`Reader`]) and from the text of a rule ([`parse`]). A term
//! of a shader remembers its source text, so that a rewrite keeps the author's spelling.

use osl_hir::hir::{Expr, ExprKind, Step, VarId};
use osl_ir::types::{Base, Type};
use osl_syntax::ast::{self, Ast, BinaryOp, UnaryOp};
use osl_syntax::span::Span;
use osl_syntax::{NoFiles, Options};
use std::sync::Arc;

/// The kind of a term.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Head {
    Number(f64),
    /// For each part whether it is subtracted.
    Sum(Vec<bool>),
    /// For each part whether it is a divisor.
    Product(Vec<bool>),
    Call(Arc<str>),
    /// Only in rows.
    Compare(BinaryOp),
    /// `a ? b : c`; only in rows.
    Choose,
    /// A sum in parentheses, which is added up first; only in what rows write.
    Group,
    /// A letter of a row, which stands for any term.
    Any(char),
    /// Anything else, by its text.
    Leaf(Arc<str>),
}

/// How tightly a text binds: a part that binds less than its place requires gets parentheses.
pub(crate) mod binds {
    pub(crate) const LOOSE: u8 = 0;
    pub(crate) const COMPARE: u8 = 1;
    pub(crate) const SUM: u8 = 2;
    pub(crate) const PRODUCT: u8 = 3;
    pub(crate) const NEGATIVE: u8 = 4;
    pub(crate) const WHOLE: u8 = 5;
}

/// An expression.
#[derive(Clone, Debug)]
pub(super) struct Term {
    pub(super) head: Head,
    pub(super) parts: Vec<Term>,
    /// The text of a term that is in the source, without parentheses around it.
    pub(super) text: Option<Arc<str>>,
    /// How tightly that text binds.
    pub(super) binds: u8,
    /// The places of the source that it comes from.
    pub(super) covers: Vec<Span>,
    /// Its type in the source.
    pub(super) ty: Option<Type>,
    /// Whether it can be evaluated any number of times.
    pub(super) is_pure: bool,
    /// The variable that it reads, and where.
    pub(super) var: Option<(Place, Span)>,
    /// Where it calls a function of the source.
    pub(super) call: Option<Span>,
}

impl Term {
    /// A term that is not in the source.
    pub(super) fn new(head: Head, parts: Vec<Term>) -> Term {
        let is_pure = parts.iter().all(|part| part.is_pure);
        let ty = parts.iter().find_map(|part| part.ty);
        Term {
            head,
            parts,
            text: None,
            binds: binds::WHOLE,
            covers: Vec::new(),
            ty,
            is_pure,
            var: None,
            call: None,
        }
    }

    pub(super) fn number(x: f64) -> Term {
        Term::new(Head::Number(x), Vec::new())
    }

    /// The parts of a sum or product with their flags; the term itself as the only part of anything else.
    pub(super) fn items(&self, sum: bool) -> Vec<(bool, Term)> {
        match (&self.head, sum) {
            (Head::Sum(flags), true) | (Head::Product(flags), false) => {
                flags.iter().copied().zip(self.parts.iter().cloned()).collect()
            }
            _ => vec![(false, self.clone())],
        }
    }

    /// Whether two terms are the same expression.
    pub(super) fn same(&self, other: &Term) -> bool {
        if let (Some(a), Some(b)) = (&self.text, &other.text)
            && a == b
            && self.is_pure
        {
            return true;
        }
        match (&self.head, &other.head) {
            (Head::Number(a), Head::Number(b)) => a == b,
            (Head::Leaf(a), Head::Leaf(b)) => a == b && self.is_pure,
            (Head::Call(a), Head::Call(b)) => {
                a == b
                    && self.parts.len() == other.parts.len()
                    && self.parts.iter().zip(&other.parts).all(|(a, b)| a.same(b))
            }
            (Head::Sum(a), Head::Sum(b)) | (Head::Product(a), Head::Product(b)) => {
                let mut left: Vec<(bool, &Term)> = b.iter().copied().zip(&other.parts).collect();
                a.len() == b.len()
                    && a.iter().zip(&self.parts).all(|(flag, part)| {
                        let at = left.iter().position(|(other, term)| other == flag && part.same(term));
                        at.map(|at| left.swap_remove(at)).is_some()
                    })
            }
            _ => false,
        }
    }

    /// The places of the source that the term and its parts come from.
    pub(super) fn all_covers(&self) -> Vec<Span> {
        let mut covers = Vec::new();
        self.each(&mut |part| covers.extend(part.covers.iter().copied()));
        covers
    }

    /// Visits the term and its parts.
    pub(super) fn each(&self, visit: &mut dyn FnMut(&Term)) {
        visit(self);
        self.parts.iter().for_each(|part| part.each(visit));
    }
}

/// The sum of terms, some of them subtracted. Sums among them become part of it.
pub(super) fn sum(items: Vec<(bool, Term)>) -> Term {
    let (mut flags, mut parts, mut covers) = (Vec::new(), Vec::new(), Vec::new());
    for (minus, term) in items {
        match &term.head {
            Head::Sum(inner) => {
                covers.extend(term.covers.iter().copied());
                flags.extend(inner.iter().map(|flag| *flag != minus));
                parts.extend(term.parts);
            }
            _ => {
                flags.push(minus);
                parts.push(term);
            }
        }
    }
    if flags == [false]
        && let Some(only) = parts.pop()
    {
        return only;
    }
    Term { covers, ..Term::new(Head::Sum(flags), parts) }
}

/// The product of terms, some of them divisors. Products among them become part of it, and minus signs go in
/// front of it.
pub(super) fn product(items: Vec<(bool, Term)>) -> Term {
    let (mut flags, mut parts, mut covers) = (Vec::new(), Vec::new(), Vec::new());
    let mut minus = false;
    let mut todo: Vec<(bool, Term)> = items.into_iter().rev().collect();
    while let Some((divides, mut term)) = todo.pop() {
        match &term.head {
            Head::Product(inner) => {
                covers.extend(term.covers.iter().copied());
                let inner: Vec<bool> = inner.iter().map(|flag| *flag != divides).collect();
                todo.extend(inner.into_iter().zip(term.parts).rev());
            }
            Head::Sum(signs) if signs == &[true] && term.parts.len() == 1 => {
                covers.extend(term.covers.iter().copied());
                minus = !minus;
                todo.extend(term.parts.pop().map(|part| (divides, part)));
            }
            _ => {
                flags.push(divides);
                parts.push(term);
            }
        }
    }
    let only = if flags == [false] { parts.pop() } else { None };
    let term = only.unwrap_or_else(|| Term { covers, ..Term::new(Head::Product(flags), parts) });
    if minus { Term::new(Head::Sum(vec![true]), vec![term]) } else { term }
}

/// The negated term.
pub(super) fn negative(term: Term) -> Term {
    match term.head {
        Head::Number(x) => Term::number(-x),
        _ => sum(vec![(true, term)]),
    }
}

/// Reads terms from the tree of a shader.
pub(crate) struct Reader<'a> {
    /// The text of the main file, whose positions are its offsets.
    pub(crate) text: &'a str,
}

impl Reader<'_> {
    /// The term of an expression; `None` if its text is not in the main file as it is, but in another file
    /// or in a macro.
    pub(super) fn term(&self, e: &Expr) -> Option<Term> {
        let (text, own) = self.source(e)?;
        let found = self.structure(e);
        let mut term = found.unwrap_or_else(|| Term::new(Head::Leaf(text.as_str().into()), Vec::new()));
        term.is_pure = is_pure(e);
        if let ExprKind::Read(place) = &e.kind
            && let (place, true) = Place::around(place.var, &place.path)
        {
            term.var = Some((place, e.span));
        }
        if matches!(e.kind, ExprKind::Call(..)) {
            term.call = Some(e.span);
        }
        term.text = Some(text.into());
        term.binds = own;
        term.covers.push(e.span);
        term.ty = Some(e.ty);
        Some(term)
    }

    /// The text of an expression without parentheses around it, and how tightly it binds.
    pub(crate) fn source(&self, e: &Expr) -> Option<(String, u8)> {
        let written = self.text.get(e.span.start as usize..e.span.end as usize)?;
        if written.is_empty() || written.contains("//") || written.contains("/*") || written.contains('#') {
            return None;
        }
        let text = stripped(&written.split_whitespace().collect::<Vec<_>>().join(" ")).to_string();
        let own = match &e.kind {
            ExprKind::Convert(inner) => {
                let literal = matches!(inner.kind, ExprKind::Int(_) | ExprKind::Float(_));
                if inner.ty == Type::INT && !literal && e.ty == Type::FLOAT && !text.starts_with("float") {
                    return Some((format!("float({text})"), binds::WHOLE));
                }
                return self.source(inner).or(Some((text, binds::LOOSE)));
            }
            ExprKind::Int(_) | ExprKind::Float(_) if text.starts_with('-') => binds::NEGATIVE,
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Read(_)
            | ExprKind::Call(..)
            | ExprKind::Builtin(_)
            | ExprKind::Triple(_) => binds::WHOLE,
            ExprKind::Unary(..) => binds::NEGATIVE,
            ExprKind::Binary(BinaryOp::Add | BinaryOp::Sub, ..) => binds::SUM,
            ExprKind::Binary(BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod, ..) => binds::PRODUCT,
            _ => binds::LOOSE,
        };
        // An operator of the language may also be written as a call.
        Some((text, own))
    }

    /// The term of a variable that is read at this place.
    pub(super) fn variable(&self, var: Place, ty: Option<Type>, at: Span, name: &str) -> Term {
        Term {
            text: Some(name.into()),
            covers: vec![at],
            ty,
            var: Some((var, at)),
            ..Term::new(Head::Leaf(name.into()), Vec::new())
        }
    }

    fn structure(&self, e: &Expr) -> Option<Term> {
        let is_real = e.ty == Type::FLOAT || e.ty.is_triple();
        let within = |parts: &[&Expr]| {
            let mut at = e.span.start;
            parts.iter().all(|part| {
                let fits = part.span.start >= at && part.span.end <= e.span.end && part.span != e.span;
                at = part.span.end;
                fits
            })
        };
        match &e.kind {
            ExprKind::Int(n) => Some(Term::number(f64::from(*n))),
            ExprKind::Float(x) => Some(Term::number(f64::from(*x))),
            ExprKind::Convert(inner) => match inner.kind {
                ExprKind::Int(_) | ExprKind::Float(_) => self.structure(inner),
                _ => None,
            },
            ExprKind::Read(place) => {
                let [path @ .., Step::Component(index)] = &place.path[..] else { return None };
                let ExprKind::Int(index @ 0..=2) = index.kind else { return None };
                let (whole, true) = Place::around(place.var, path) else { return None };
                let written = self.text.get(e.span.start as usize..e.span.end as usize)?;
                let (name, _) = written.rsplit_once('[')?;
                let whole = self.variable(whole, None, e.span, name.trim());
                Some(Term::new(Head::Call(COMPONENTS[index as usize].into()), vec![whole]))
            }
            ExprKind::Triple(parts) if e.ty.is_triple() && within(&parts.each_ref()) => {
                let parts = parts.iter().map(|part| self.term(part)).collect::<Option<Vec<Term>>>()?;
                Some(Term::new(Head::Call(word(e.ty)?.into()), parts))
            }
            ExprKind::Unary(UnaryOp::Neg, a) if is_real && within(&[a]) => Some(negative(self.term(a)?)),
            ExprKind::Binary(op, a, b) if is_real && within(&[a, b]) => {
                let (left, right) = (self.term(a)?, self.term(b)?);
                match op {
                    BinaryOp::Add => Some(sum(vec![(false, left), (false, right)])),
                    BinaryOp::Sub => Some(sum(vec![(false, left), (true, right)])),
                    BinaryOp::Mul => Some(product(vec![(false, left), (false, right)])),
                    BinaryOp::Div => Some(product(vec![(false, left), (true, right)])),
                    _ => None,
                }
            }
            ExprKind::Builtin(call) if is_real => {
                let args: Vec<&Expr> = call.args.iter().collect();
                if !within(&args) || call.outputs.iter().any(Option::is_some) {
                    return None;
                }
                let parts = args.iter().map(|arg| self.term(arg)).collect::<Option<Vec<Term>>>()?;
                Some(call_of(call.row.name, parts))
            }
            _ => None,
        }
    }
}

/// A call; the square as a power becomes a product.
fn call_of(name: &str, mut parts: Vec<Term>) -> Term {
    if name == "pow"
        && let [base, Term { head: Head::Number(2.0), .. }] = &parts[..]
        && base.is_pure
    {
        let base = base.clone();
        return product(vec![(false, base.clone()), (false, base)]);
    }
    // The order of two equal arguments does not matter.
    if COMMUTE.contains(&name) && parts.len() == 2 {
        parts.sort_by(|a, b| a.text.cmp(&b.text));
    }
    Term::new(Head::Call(name.into()), parts)
}

/// The names under which rows have the components of a triple.
pub(super) const COMPONENTS: [&str; 3] = ["comp0", "comp1", "comp2"];

/// Functions of two arguments that can be exchanged.
pub(super) const COMMUTE: [&str; 5] = ["dot", "distance", "hypot", "max", "min"];

/// A text without the parentheses that enclose the whole of it.
fn stripped(mut text: &str) -> &str {
    while let Some(inner) = text.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
        let mut depth = 0_i32;
        let closes = inner.chars().any(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth < 0
        });
        if closes {
            break;
        }
        text = inner.trim();
    }
    text
}

/// Whether an expression writes nothing, prints nothing and calls no function of the source.
pub(super) fn is_pure(e: &Expr) -> bool {
    computes(e) && e.parts().into_iter().all(is_pure)
}

/// The same of the expression itself, without its parts.
pub(super) fn computes(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Assign(..) | ExprKind::Step { .. } | ExprKind::Call(..) | ExprKind::Operation(_) => false,
        ExprKind::Builtin(call) => call.outputs.iter().all(Option::is_none),
        _ => true,
    }
}

/// The pattern of a row.
pub(super) fn parse(text: &str) -> Option<Term> {
    read(text, false)
}

/// What a row writes: sums in parentheses are kept, since the order of additions matters.
pub(super) fn parse_grouped(text: &str) -> Option<Term> {
    read(text, true)
}

fn read(text: &str, groups: bool) -> Option<Term> {
    let source = format!("shader row(output float o = 0) {{ o = {text}; }}");
    let parsed = osl_syntax::parse("row", &source, &NoFiles, &Options::default());
    if parsed.has_errors() {
        return None;
    }
    let value = parsed.ast.exprs.iter().find_map(|e| match e.kind {
        ast::ExprKind::Assign { op: None, value, .. } => Some(value),
        _ => None,
    })?;
    of_tree(&parsed.ast, value, groups)
}

fn of_tree(tree: &Ast, id: ast::ExprId, groups: bool) -> Option<Term> {
    let part = |id: &ast::ExprId| of_tree(tree, *id, groups);
    Some(match &tree[id].kind {
        ast::ExprKind::Int(n) => Term::number(f64::from(*n)),
        ast::ExprKind::Float(x) => Term::number(f64::from(*x)),
        ast::ExprKind::Paren(inner) => match part(inner)? {
            sum if groups && matches!(sum.head, Head::Sum(_)) => Term::new(Head::Group, vec![sum]),
            other => other,
        },
        ast::ExprKind::Name(name) => {
            let mut letters = name.chars();
            match (letters.next(), letters.next()) {
                (Some(letter), None) => Term::new(Head::Any(letter), Vec::new()),
                _ => return None,
            }
        }
        ast::ExprKind::Unary(UnaryOp::Neg, inner) => negative(part(inner)?),
        ast::ExprKind::Binary(op, a, b) => {
            let (left, right) = (part(a)?, part(b)?);
            match op {
                BinaryOp::Add => sum(vec![(false, left), (false, right)]),
                BinaryOp::Sub => sum(vec![(false, left), (true, right)]),
                BinaryOp::Mul => product(vec![(false, left), (false, right)]),
                BinaryOp::Div => product(vec![(false, left), (true, right)]),
                _ => Term::new(Head::Compare(*op), vec![left, right]),
            }
        }
        ast::ExprKind::Ternary(cond, a, b) => Term::new(Head::Choose, vec![part(cond)?, part(a)?, part(b)?]),
        ast::ExprKind::Call(name, args) => {
            let parts = args.iter().map(part).collect::<Option<Vec<Term>>>()?;
            Term::new(Head::Call(name.text.clone()), parts)
        }
        _ => return None,
    })
}

/// The word of a type for a declaration of a single number or triple.
pub(crate) fn word(ty: Type) -> Option<&'static str> {
    if ty.is_array() {
        return None;
    }
    match ty.base {
        Base::Float => Some("float"),
        Base::Color => Some("color"),
        Base::Point => Some("point"),
        Base::Vector => Some("vector"),
        Base::Normal => Some("normal"),
        _ => None,
    }
}

/// A variable, or the part of it at a constant path of fields, elements and components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) var: VarId,
    /// The indices of the path, the outermost first.
    path: [Option<u32>; 3],
}

impl From<VarId> for Place {
    fn from(var: VarId) -> Place {
        Place { var, path: [None; 3] }
    }
}

impl Place {
    /// The smallest place that is known to hold a path, and whether it is the path itself.
    pub(super) fn around(var: VarId, path: &[Step]) -> (Place, bool) {
        let mut place = Place::from(var);
        for step in path {
            let index = match step {
                Step::Field(index) => Some(*index),
                Step::Element(e) | Step::Component(e) => match e.kind {
                    ExprKind::Int(index) => u32::try_from(index).ok(),
                    _ => None,
                },
                Step::Cell(..) => None,
            };
            let Some(part) = index.and_then(|index| place.part(index)) else { return (place, false) };
            place = part;
        }
        (place, true)
    }

    /// The part of the place with this index; `None` if the path becomes too long.
    pub(super) fn part(mut self, index: u32) -> Option<Place> {
        *self.path.iter_mut().find(|step| step.is_none())? = Some(index);
        Some(self)
    }

    /// Whether two places have a part in common.
    pub(super) fn overlaps(self, other: Place) -> bool {
        let same = |(a, b): (Option<u32>, Option<u32>)| a.zip(b).is_none_or(|(a, b)| a == b);
        self.var == other.var && self.path.into_iter().zip(other.path).all(same)
    }
}
