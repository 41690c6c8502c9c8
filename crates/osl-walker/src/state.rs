//! The state of a run: which location each variable has, and which value each location holds.
//!
//! The *environment* maps the variables of the program to locations; the *store* maps locations to values.
//! Two variables with the same location are aliases: a function that is called by reference binds its formal
//! to the location of the argument (`functions`). A declaration makes a new location each time it is
//! executed. What the shader prints and reports is part of the state too.
//!
//! A [`Location`] may be a part of a variable: an element, a field, a component. An index outside the range
//! is an error of the shader that does not stop it: the index is clamped to the range and reported.
//!
//! ```
//! use osl_walker::printed;
//! // The second line is what the shader reports.
//! let text = printed(r#"int a[2] = { 5, 6 }; a[7] = 9; printf("%d %d\n", a[0], a[1]);"#);
//! assert_eq!(text, "5 9\nIndex [7] out of range [0..1]");
//! ```

use crate::value::Value;
use osl_hir::hir::{Lvalue, Program, Step, VarId};
use osl_ir::types::Type;
use osl_syntax::span::Span;
use std::collections::BTreeSet;

/// A variable or a part of one, with all indices evaluated. Both the target of an assignment and an argument
/// by reference are locations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Location {
    /// The index of the variable's value in the store.
    cell: usize,
    /// The elements and fields that lead to the part.
    path: Vec<usize>,
    /// The number of a component in a triple or a matrix.
    component: Option<usize>,
}

/// Why a run ended before the last statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// The shader called `exit`.
    Exit,
    /// There is no outcome.
    Error(Reason),
}

/// Why a walk has no outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The language does not define the value, for this reason.
    Undefined(&'static str),
    /// The walker does not know this.
    Unsupported(&'static str),
}

/// A walk without an outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// Why.
    pub reason: Reason,
    /// The statement or expression that was executed.
    pub span: Span,
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.reason {
            Reason::Undefined(what) => write!(f, "the language does not define {what}"),
            Reason::Unsupported(what) => write!(f, "the walker does not know {what}"),
        }
    }
}

impl std::error::Error for Error {}

pub(crate) fn undefined(what: &'static str) -> Stop {
    Stop::Error(Reason::Undefined(what))
}

pub(crate) fn unsupported(what: &'static str) -> Stop {
    Stop::Error(Reason::Unsupported(what))
}

/// Maximum number of statements and expressions of a walk. A walk is for short programs: the memory of its
/// variables has no other limit.
const MAX_STEPS: u32 = 300_000;

/// The state of a run.
pub(crate) struct Walker<'a> {
    pub(crate) program: &'a Program,
    /// The location of each variable of the program; none before its first declaration.
    environment: Vec<Option<Location>>,
    /// The value of each location, old ones included.
    store: Vec<Value>,
    /// The printed text.
    pub(crate) printed: String,
    /// Errors and warnings, each once.
    pub(crate) messages: BTreeSet<String>,
    /// The statement or expression that is executed.
    pub(crate) span: Span,
    steps: u32,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(program: &'a Program) -> Walker<'a> {
        Walker {
            program,
            environment: vec![None; program.vars.len()],
            store: Vec::new(),
            printed: String::new(),
            messages: BTreeSet::new(),
            span: Span::default(),
            steps: 0,
        }
    }

    /// Counts a statement or an expression.
    pub(crate) fn step(&mut self, span: Span) -> Result<(), Stop> {
        self.span = span;
        self.steps += 1;
        if self.steps > MAX_STEPS { Err(unsupported("programs with so many steps")) } else { Ok(()) }
    }

    pub(crate) fn zero(&self, ty: Type) -> Value {
        Value::zero(ty, &self.program.structs)
    }

    pub(crate) fn type_of(&self, var: VarId) -> Type {
        self.program.vars[var.0 as usize].ty
    }

    /// A new location that holds a value.
    pub(crate) fn allocate(&mut self, value: Value) -> Location {
        self.store.push(value);
        Location { cell: self.store.len() - 1, path: Vec::new(), component: None }
    }

    /// Gives a variable a location, in place of the one that it may have.
    pub(crate) fn bind(&mut self, var: VarId, location: Location) {
        self.environment[var.0 as usize] = Some(location);
    }

    /// Whether a variable was declared before.
    pub(crate) fn is_bound(&self, var: VarId) -> bool {
        self.environment[var.0 as usize].is_some()
    }

    /// The location of a variable. One whose declaration was not executed is zero.
    pub(crate) fn location_of(&mut self, var: VarId) -> Location {
        if let Some(location) = &self.environment[var.0 as usize] {
            return location.clone();
        }
        let location = self.allocate(self.zero(self.type_of(var)));
        self.bind(var, location.clone());
        location
    }

    /// The location of a part of a variable. Its indices are evaluated once each, from left to right.
    pub(crate) fn locate(&mut self, place: &Lvalue) -> Result<Location, Stop> {
        let mut location = self.location_of(place.var);
        for step in &place.path {
            match step {
                Step::Field(index) => location.path.push(*index as usize),
                Step::Element(index) => {
                    let index = self.eval(index)?.int();
                    let length = match self.part(&location) {
                        Some(Value::Aggregate(elements)) => elements.len(),
                        _ => 1,
                    };
                    location.path.push(self.clamped(index, length));
                }
                Step::Component(index) => {
                    let index = self.eval(index)?.int();
                    location.component = Some(self.clamped(index, 3));
                }
                Step::Cell(row, column) => {
                    let (row, column) = (self.eval(row)?.int(), self.eval(column)?.int());
                    location.component = Some(4 * self.clamped(row, 4) + self.clamped(column, 4));
                }
            }
        }
        Ok(location)
    }

    /// An index below a length. One outside the range is reported, and the nearest one inside is taken.
    fn clamped(&mut self, index: i32, length: usize) -> usize {
        let last = (length as i32 - 1).max(0);
        if !(0..=last).contains(&index) {
            self.messages.insert(format!("Index [{index}] out of range [0..{last}]"));
        }
        index.clamp(0, last) as usize
    }

    /// The value at a location.
    pub(crate) fn read(&self, location: &Location) -> Value {
        match (location.component, self.part(location)) {
            (Some(n), Some(Value::Triple(t))) => Value::Float(t[n]),
            (Some(n), Some(Value::Matrix(m))) => Value::Float(m[n]),
            (_, value) => value.cloned().unwrap_or(Value::Void),
        }
    }

    fn part(&self, location: &Location) -> Option<&Value> {
        location.path.iter().try_fold(self.store.get(location.cell)?, |value, step| match value {
            Value::Aggregate(parts) => parts.get(*step),
            _ => None,
        })
    }

    /// Stores a value at a location.
    pub(crate) fn write(&mut self, location: &Location, from: Value) {
        let mut value = &mut self.store[location.cell];
        for step in &location.path {
            let Value::Aggregate(parts) = value else { return };
            let Some(part) = parts.get_mut(*step) else { return };
            value = part;
        }
        match (location.component, value) {
            (Some(n), Value::Triple(t)) => t[n] = from.float(),
            (Some(n), Value::Matrix(m)) => m[n] = from.float(),
            (_, value) => value.assign(from),
        }
    }
}
