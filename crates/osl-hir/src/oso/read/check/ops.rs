//! Single operations: their operands by the table, their hints, and what they write.

use super::super::file::{Class, Op, Section, SymbolType};
use super::super::lex::Kind;
use super::{Checker, Rule};
use crate::builtins::{self, Param, ParamType, Signature};
use crate::oso::operations::{self, Misuse, Operand, Usage};
use crate::oso::text::{MAIN, unescape};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::span::Span;

impl<'a> Checker<'_, 'a> {
    /// Checks each operation without its surroundings, and records how it uses its operands.
    pub(super) fn operations(&mut self) {
        let file = self.file;
        let mut valid = Vec::new();
        for op in &file.ops {
            let usage = match self.operands(op) {
                Ok(operands) => {
                    operations::usage(op.name, &operands).map_err(|misuse| self.misused(op, misuse))
                }
                Err((name, span)) => {
                    self.report(Rule::Operand, span, op.name, format!("`{name}` is not declared"));
                    Err(())
                }
            };
            if let Ok(usage) = &usage {
                self.hints(op, usage);
            }
            valid.push(usage.ok());
        }
        self.usages = valid;
        for at in 0..file.ops.len() {
            let written: Vec<&str> = self.written(at).collect();
            written.into_iter().for_each(|name| self.writers.entry(name).or_default().push(at));
        }
        for section in &file.sections {
            for (at, op) in self.ops(section) {
                if op.name == "clamp" {
                    self.report(Rule::Operand, op.span, op.name, operations::advice(op.name));
                }
                if let Ok(operands) = self.operands(op) {
                    self.texts(op, &operands);
                }
                self.writes(at, section);
            }
        }
    }

    /// The operands.
    ///
    /// # Errors
    /// The name of one that is not declared.
    fn operands(&self, op: &Op<'a>) -> Result<Vec<Operand<'a>>, (&'a str, Span)> {
        let mut operands = Vec::new();
        for (name, span) in &op.args {
            let symbol = self.symbol(name).ok_or((*name, *span))?;
            let (ty, array) = match symbol.ty {
                SymbolType::Plain(ty) => (Some(ty), ty.is_array()),
                SymbolType::Struct(name) => (None, name.ends_with(']')),
            };
            let constant = symbol.class == Class::Const;
            let text = symbol.values.first().filter(|_| constant).and_then(|value| match value.kind {
                Kind::Text(text) => Some(text),
                _ => None,
            });
            operands.push(Operand { ty, array, constant, text });
        }
        Ok(operands)
    }

    fn misused(&mut self, op: &Op<'a>, misuse: Misuse) {
        let message = match misuse {
            Misuse::Unknown => "no run time has this operation".to_string(),
            Misuse::Option { name, known: false } => format!("there is no option \"{name}\""),
            Misuse::Option { name, known: true } => format!("the option \"{name}\" has another type"),
            Misuse::Operands { advice } => {
                let shown: Vec<String> = op.args.iter().map(|(name, _)| self.shown(name)).collect();
                let advice = if advice.is_empty() { String::new() } else { format!(": {advice}") };
                format!("it does not take ({}){advice}", shown.join(", "))
            }
        };
        self.report(Rule::Operand, op.span, op.name, message);
    }

    /// The type of a symbol as the format writes it.
    fn shown(&self, name: &str) -> String {
        match self.symbol(name).map(|symbol| symbol.ty) {
            Some(SymbolType::Struct(name)) => format!("struct {name}"),
            Some(SymbolType::Plain(ty)) => osl_ir::types::StructTable::default().show(ty),
            None => "?".to_string(),
        }
    }

    /// Hints say what the table says; without one, the first operand is written and the others are read.
    fn hints(&mut self, op: &Op<'a>, usage: &Usage) {
        let wanted: String = usage.access.iter().map(|a| char::from(*a)).collect();
        let usual = |at: usize| if at == 0 { 'w' } else { 'r' };
        let given = match op.access {
            Some(access) => access.to_string(),
            None => (0..op.args.len()).map(usual).collect(),
        };
        let given = given.replace('W', "w");
        if given != wanted {
            let message = format!("%argrw is \"{given}\" in place of \"{wanted}\"");
            self.report(Rule::Hint, op.span, op.name, message);
        }
        let list = op.derivatives.unwrap_or_default();
        let given: Vec<usize> = list.split(',').filter_map(|at| at.trim().parse().ok()).collect();
        if let Some(missing) = usage.derivatives.iter().find(|at| !given.contains(at)) {
            let message = format!("%argderivs lacks {missing}, whose derivatives it reads");
            self.report(Rule::Hint, op.span, op.name, message);
        }
    }

    /// Constant texts: formats have a value for each conversion, and closures the parameters of their name.
    fn texts(&mut self, op: &Op<'a>, operands: &[Operand<'a>]) {
        let format = match op.name {
            "printf" | "warning" | "error" => 0,
            "format" | "fprintf" => 1,
            "closure" => return self.closure(op, operands),
            _ => return,
        };
        let Some((name, _)) = op.args.get(format) else { return };
        let values = op.args.len() - format - 1;
        match operands.get(format).and_then(|operand| operand.text) {
            Some(text) => {
                let wanted = crate::resolve::count_conversions(&unescape(text));
                if wanted > values {
                    let message = format!("the format has {wanted} conversions for {values} values");
                    self.report(Rule::Constant, op.span, op.name, message);
                }
            }
            None if !self.is_settled(name) => {
                self.report(Rule::Constant, op.span, op.name, format!("the format `{name}` is not constant"));
            }
            None => {}
        }
    }

    /// Whether run times find that a symbol is constant: a parameter, or a variable that one assignment sets.
    fn is_settled(&self, name: &str) -> bool {
        let class = self.symbol(name).map(|symbol| symbol.class);
        if matches!(class, Some(Class::Param | Class::Output | Class::Const)) {
            return true;
        }
        let Some([writer]) = self.writers.get(name).map(Vec::as_slice) else { return false };
        let op = self.file.ops.get(*writer);
        op.is_some_and(|op| matches!(op.name, "assign" | "format" | "concat" | "substr"))
    }

    /// The parameters of a closure that the language knows have exactly their types.
    fn closure(&mut self, op: &Op<'a>, operands: &[Operand<'a>]) {
        let Some(row) = operands.get(1).and_then(|name| name.text).and_then(builtins::find) else { return };
        let short = row.facts.left_out.0;
        let is_form = |form: &&Signature| form.ret == Type::CLOSURE && form.params.len() != short;
        let mut forms = row.signatures().iter().filter(is_form).peekable();
        let given = operands.get(2..).unwrap_or_default();
        if forms.peek().is_none() {
            return;
        }
        let fits = |(param, operand): (&Param, &Operand<'_>)| match (param.ty, operand.ty) {
            (ParamType::Of(wanted), Some(ty)) => alike(wanted, ty),
            (ParamType::Any { .. }, _) => true,
            (ParamType::Of(_), None) => false,
        };
        let takes =
            |form: &Signature| given.len() >= form.params.len() && form.params.iter().zip(given).all(fits);
        if !forms.any(takes) {
            let shown: Vec<String> = op.args.iter().skip(2).map(|(name, _)| self.shown(name)).collect();
            let message = format!("the closure `{}` does not take ({})", row.name, shown.join(", "));
            self.report(Rule::Operand, op.span, op.name, message);
        }
    }

    /// Constants and input parameters are not written. The initialiser of a parameter sets no other one,
    /// except outputs before it, which have their values by then.
    fn writes(&mut self, at: usize, section: &Section<'a>) {
        let Some(op) = self.file.ops.get(at) else { return };
        let names: Vec<&str> = self.written(at).collect();
        for name in names {
            let class = self.symbol(name).map(|symbol| symbol.class);
            let before = self.symbols.get(name) < self.symbols.get(section.name);
            let message = match class {
                _ if name == section.name => continue,
                Some(Class::Output) if section.name != MAIN && before => continue,
                Some(Class::Const) => "is a constant",
                Some(Class::Param) if section.name == MAIN => "is a parameter that is no output",
                Some(Class::Param | Class::Output) if section.name != MAIN => {
                    "does not belong to the section"
                }
                _ => continue,
            };
            self.report(Rule::Write, op.span, op.name, format!("it writes `{name}`, which {message}"));
        }
    }
}

/// Whether two types are the same to a run time: all triples are.
fn alike(wanted: Type, given: Type) -> bool {
    let same = wanted.base == given.base || (wanted.base.is_triple() && given.base.is_triple());
    let array = |ty: Type| !matches!(ty.extent, Extent::One);
    same && array(wanted) == array(given) && wanted.base != Base::Void
}
