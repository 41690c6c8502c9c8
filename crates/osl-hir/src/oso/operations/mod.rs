//! The table of operations: which operands each accepts, which of them it reads, writes and differentiates,
//! and how many jumps it has. Writing takes its hints from here, and checking compares files with it.
//!
//! # Notation
//! A form is a list of operands, the result first. Each is a letter: `i` int, `f` float, `v` triple of any
//! kind, `m` matrix, `s` string, `C` closure; `n` an int or a float, `w` a float or a triple, `a` an int, a
//! float or a triple, `t` an int or a string, `x` anything except closures and structs, `?` anything except
//! structs, `@` anything. Each `T` of a form is the same type. A number after a letter repeats the operand,
//! `…` repeats the last one any number of times, also zero, and `*` stands for pairs of a constant name and
//! a value. `[]` marks an array; `?`, `x` and `@` alone include arrays. Before the letter, `>` marks an
//! operand that is written, `'` one whose derivatives are read, and `$` one that must be constant.
//!
//! Source of the facts: the behaviour of the reference's run time, 1.13.

mod table;

use osl_ir::types::{Base, Type};
use rustc_hash::FxHashMap;
use std::sync::OnceLock;

/// A row of the table.
pub(super) struct Operation {
    /// Its names, separated by blanks.
    names: &'static str,
    /// The forms of its operands.
    forms: &'static [&'static str],
    options: Options,
    /// Number of jumps.
    jumps: usize,
    /// What to write instead where a run time accepts it only in part, or computes something else.
    advice: &'static str,
}

/// The pairs of a name and a value after the operands: names separated by blanks, and a letter for the type.
#[derive(Clone, Copy)]
enum Options {
    /// Any names and values, which are read.
    Any,
    /// Any names, with values that are written.
    Written,
    /// Only these names. `alpha` and `errormessage` are written.
    These(&'static [(&'static str, &'static str)]),
    /// These names, and others that have no effect.
    Among(&'static [(&'static str, &'static str)]),
}

impl Operation {
    const fn options(self, options: Options) -> Operation {
        Operation { options, ..self }
    }

    const fn jumps(self, jumps: usize) -> Operation {
        Operation { jumps, ..self }
    }

    const fn advice(self, advice: &'static str) -> Operation {
        Operation { advice, ..self }
    }
}

/// An operand as the rules see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operand<'a> {
    /// Its type; `None` for the placeholder of a struct.
    pub(super) ty: Option<Type>,
    pub(super) array: bool,
    pub(super) constant: bool,
    /// The value of a constant string.
    pub(super) text: Option<&'a str>,
}

/// How an operation uses its operands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Usage {
    /// `r` or `w` for each operand.
    pub(super) access: Vec<u8>,
    /// The indices of the operands whose derivatives it reads.
    pub(super) derivatives: Vec<usize>,
}

impl Usage {
    /// That of an operation with a result.
    pub(super) fn of_result(count: usize) -> Usage {
        let access = (0..count).map(|at| if at == 0 { b'w' } else { b'r' }).collect();
        Usage { access, derivatives: Vec::new() }
    }
}

/// Why an operation cannot be written in this way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Misuse {
    /// No run time has an operation of this name.
    Unknown,
    /// No form takes these operands; the advice may be empty.
    Operands { advice: &'static str },
    /// An option with this name is not known, or its value has another type.
    Option { name: String, known: bool },
}

/// An operand of a form.
#[derive(Clone, Copy)]
struct Slot {
    letter: u8,
    array: bool,
    written: bool,
    differentiated: bool,
    constant: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Tail {
    None,
    /// The last slot may occur any number of times.
    Repeated,
    Options,
}

struct Form {
    slots: Vec<Slot>,
    tail: Tail,
}

type Index = FxHashMap<&'static str, (&'static Operation, OnceLock<Vec<Form>>)>;

fn find(name: &str) -> Option<(&'static Operation, &'static [Form])> {
    static INDEX: OnceLock<Index> = OnceLock::new();
    let rows =
        || table::OPERATIONS.iter().flat_map(|row| row.names.split_whitespace().map(move |n| (n, row)));
    let index = INDEX.get_or_init(|| rows().map(|(name, row)| (name, (row, OnceLock::new()))).collect());
    let (row, forms) = index.get(name)?;
    Some((row, forms.get_or_init(|| row.forms.iter().map(|form| Form::parse(form)).collect())))
}

/// Number of jumps of an operation; `None` if no run time knows it.
pub(super) fn jumps(name: &str) -> Option<usize> {
    find(name).map(|(row, _)| row.jumps)
}

/// The advice about an operation that run times compute in an unexpected way; empty for most.
pub(super) fn advice(name: &str) -> &'static str {
    find(name).map_or("", |(row, _)| row.advice)
}

/// Whether the value of an option must be a float.
pub(super) fn is_float_option(name: &str, option: &str) -> bool {
    let Some((Operation { options: Options::These(list), .. }, _)) = find(name) else { return false };
    list.iter().any(|(names, letter)| *letter == "f" && names.split_whitespace().any(|n| n == option))
}

/// How an operation uses its operands.
///
/// # Errors
/// The operation does not take them.
pub(super) fn usage(name: &str, operands: &[Operand<'_>]) -> Result<Usage, Misuse> {
    let (row, forms) = find(name).ok_or(Misuse::Unknown)?;
    let form = forms.iter().find(|form| form.takes(operands));
    let form = form.ok_or(Misuse::Operands { advice: row.advice })?;
    let mut usage = Usage { access: Vec::new(), derivatives: Vec::new() };
    // Only a noise that filters itself reads derivatives.
    let is_other_noise = operands.get(1).is_some_and(|name| name.text.is_some_and(|name| name != "gabor"));
    let by_name = row.names == "noise" || row.names == "pnoise";
    for index in 0..operands.len() {
        let slot = form.slot(index);
        let written = match slot {
            Some(slot) => slot.written,
            None => row.options.is_written(form.option(index, operands)),
        };
        usage.access.push(if written { b'w' } else { b'r' });
        if slot.is_some_and(|slot| slot.differentiated) && !(by_name && is_other_noise) {
            usage.derivatives.push(index);
        }
    }
    if form.tail == Tail::Options && !(by_name && is_other_noise) {
        for pair in operands.get(form.slots.len()..).unwrap_or_default().chunks(2) {
            row.options.takes(pair)?;
        }
    }
    Ok(usage)
}

impl Options {
    fn is_written(self, name: Option<&str>) -> bool {
        match (self, name) {
            (_, None) | (Options::Any | Options::Among(_), _) => false,
            (Options::Written, _) => true,
            (Options::These(_), Some(name)) => matches!(name, "alpha" | "errormessage"),
        }
    }

    fn takes(self, pair: &[Operand<'_>]) -> Result<(), Misuse> {
        let [name, value] = pair else { return Ok(()) };
        // A name that is not a constant is reported by the form, and one without letters is skipped.
        let Some(name) = name.text.filter(|name| !name.is_empty()) else { return Ok(()) };
        let (list, closed) = match self {
            Options::Any | Options::Written => return Ok(()),
            Options::These(list) => (list, true),
            Options::Among(list) => (list, false),
        };
        let found = list.iter().find(|(names, _)| names.split_whitespace().any(|n| n == name));
        let wrong = |known| Err(Misuse::Option { name: name.to_string(), known });
        match found {
            None if closed => wrong(false),
            Some((_, letter)) if !is_of(letter.bytes().next().unwrap_or(b'?'), value) || value.array => {
                wrong(true)
            }
            _ => Ok(()),
        }
    }
}

/// Whether an operand, or an element of it, is of the class of a letter.
fn is_of(letter: u8, operand: &Operand<'_>) -> bool {
    let Some(Type { base, .. }) = operand.ty else { return letter == b'@' };
    let (int, float, triple) = (base == Base::Int, base == Base::Float, base.is_triple());
    match letter {
        b'i' => int,
        b'f' => float,
        b'v' => triple,
        b'm' => base == Base::Matrix,
        b's' => base == Base::String,
        b'C' => base == Base::Closure,
        b'n' => int || float,
        b'w' => float || triple,
        b'a' => int || float || triple,
        b't' => int || base == Base::String,
        b'x' => !matches!(base, Base::Closure | Base::Void),
        _ => base != Base::Void,
    }
}

/// The class of a type, in which all triples are one.
fn class(ty: Option<Type>) -> Option<Base> {
    ty.map(|ty| if ty.base.is_triple() { Base::Vector } else { ty.base })
}

impl Slot {
    fn takes(self, operand: &Operand<'_>) -> bool {
        let shape = operand.array == self.array || (!self.array && matches!(self.letter, b'?' | b'x' | b'@'));
        shape && is_of(self.letter, operand) && (operand.constant || !self.constant)
    }
}

impl Form {
    fn parse(text: &str) -> Form {
        let mut form = Form { slots: Vec::new(), tail: Tail::None };
        for word in text.split_whitespace() {
            if word == "*" {
                form.tail = Tail::Options;
                continue;
            }
            let mut slot =
                Slot { letter: b'?', array: false, written: false, differentiated: false, constant: false };
            let mut count = 0usize;
            for c in word.chars() {
                match c {
                    '>' => slot.written = true,
                    '\'' => slot.differentiated = true,
                    '$' => slot.constant = true,
                    '[' | ']' => slot.array = true,
                    '…' => form.tail = Tail::Repeated,
                    c => match c.to_digit(10) {
                        Some(digit) => count = count * 10 + digit as usize,
                        None => slot.letter = c as u8,
                    },
                }
            }
            form.slots.extend(std::iter::repeat_n(slot, count.max(1)));
        }
        form
    }

    /// The slot of an operand; none for options.
    fn slot(&self, index: usize) -> Option<Slot> {
        let last = || self.slots.last().filter(|_| self.tail == Tail::Repeated);
        self.slots.get(index).or_else(last).copied()
    }

    /// The name of the option whose value is this operand.
    fn option<'a>(&self, index: usize, operands: &[Operand<'a>]) -> Option<&'a str> {
        let at = index.checked_sub(self.slots.len())?;
        if at % 2 == 1 { operands.get(index - 1).map(|name| name.text.unwrap_or_default()) } else { None }
    }

    fn takes(&self, operands: &[Operand<'_>]) -> bool {
        let rest = match self.tail {
            Tail::None => operands.len() == self.slots.len(),
            Tail::Repeated => operands.len() + 1 >= self.slots.len(),
            Tail::Options => operands.get(self.slots.len()..).is_some_and(|rest| {
                let named = |name: &Operand<'_>| is_of(b's', name) && !name.array && name.constant;
                rest.len().is_multiple_of(2) && rest.iter().step_by(2).all(named)
            }),
        };
        let mut same = None;
        rest && operands.iter().enumerate().all(|(index, operand)| match self.slot(index) {
            Some(slot) if slot.letter == b'T' => {
                let class = class(operand.ty);
                slot.takes(operand) && class.is_some() && *same.get_or_insert(class) == class
            }
            Some(slot) => slot.takes(operand),
            None => true,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn operands(text: &str) -> Vec<Operand<'_>> {
        text.split_whitespace()
            .map(|word| {
                let (ty, text) = match word.strip_prefix('=') {
                    Some(text) => ("string", Some(text)),
                    None => (word, None),
                };
                let constant = ty.starts_with('$') || text.is_some();
                let ty = match ty.trim_start_matches('$') {
                    "closure" => Some(Type::CLOSURE),
                    ty => Type::parse(ty),
                };
                Operand { ty, array: ty.is_some_and(Type::is_array), constant, text }
            })
            .collect()
    }

    fn used(name: &str, text: &str) -> Result<(String, Vec<usize>), Misuse> {
        let Usage { access, derivatives } = usage(name, &operands(text))?;
        Ok((access.iter().map(|a| char::from(*a)).collect(), derivatives))
    }

    fn refused(name: &str, text: &str) -> bool {
        matches!(used(name, text), Err(Misuse::Operands { .. }))
    }

    /// The reference's table has 159 names.
    #[test]
    fn every_name_is_once_in_the_table() {
        let names: Vec<&str> =
            table::OPERATIONS.iter().flat_map(|row| row.names.split_whitespace()).collect();
        let unique: std::collections::BTreeSet<&&str> = names.iter().collect();
        assert_eq!((names.len(), unique.len()), (159, 159));
    }

    #[test]
    fn operands_decide_what_is_written_and_differentiated() {
        let is = |access: &str, derivatives: &[usize]| Ok((access.to_string(), derivatives.to_vec()));
        assert_eq!(used("add", "color float vector"), is("wrr", &[]));
        assert_eq!(used("sincos", "float float float"), is("rww", &[]));
        assert_eq!(used("getmatrix", "int string string matrix"), is("wrrw", &[]));
        assert_eq!(used("regex_match", "int string int[4] string"), is("wrwr", &[]));
        assert_eq!(used("noise", "float =perlin point"), is("wrr", &[]));
        assert_eq!(used("noise", "float =gabor point =impulses float"), is("wrrrr", &[2]));
        assert_eq!(used("pnoise", "color string point float point float"), is("wrrrrr", &[2, 3, 4, 5]));
        assert_eq!(used("texture", "color string float float =alpha float"), is("wrrrrw", &[2, 3]));
        assert_eq!(used("texture", "color string float float float float float float"), is("wrrrrrrr", &[]));
        assert_eq!(used("trace", "int point vector =maxdist float"), is("wrrrr", &[1, 2]));
        let search = used("pointcloud_search", "int string point float int =index int[4]");
        assert_eq!(search, is("wrrrrrw", &[]));
        assert_eq!(used("printf", "string int closure float[3]"), is("rrrr", &[]));
        assert_eq!(
            used("matrix", &format!("matrix string {}", "float ".repeat(16))).map(|u| u.0.len()),
            Ok(18)
        );
    }

    #[test]
    fn other_operands_are_refused() {
        for (name, operands) in [
            ("transform", "point string point"),
            ("transformc", "color string color"),
            ("getmatrix", "int string matrix"),
            ("radians", "float float"),
            ("mul", "color color int"),
            ("mul", "closure closure int"),
            ("neg", "closure closure"),
            ("matrix", "matrix string int"),
            ("smoothstep", "color color color color"),
            ("distance", "float point point point"),
            ("aref", "float int[3] int"),
            ("aassign", "color[2] int int"),
            ("noise", "float string int"),
            ("printf", "int"),
        ] {
            assert!(refused(name, operands), "{name} {operands}");
        }
        assert_eq!(used("rotate", "point point float vector"), Err(Misuse::Unknown));
        assert_eq!(used("radians", "float $float"), Ok(("wr".to_string(), Vec::new())));
        let option = |name: &str, known| Err(Misuse::Option { name: name.to_string(), known });
        assert_eq!(
            used("texture", "color string float float =missingalpha int"),
            option("missingalpha", true)
        );
        assert_eq!(
            used("texture", "color string float float =colorspace string"),
            option("colorspace", false)
        );
    }
}
