//! The statements that print a value, part by part.

use super::types::Ty;
use super::{Writer, children};
use osl_syntax::ast::{self, ExprId, ExprKind};
use std::fmt::Write;

impl Writer<'_> {
    /// Prints what is set; `value` is what an assignment sets it to.
    pub(super) fn print_target(
        &self,
        (target, value): (ExprId, Option<ExprId>),
        line: u32,
        out: &mut String,
    ) -> Option<()> {
        let (ty, told, path) = self.place(target)?;
        self.print(&self.set_by(ty, value), &told, &path, line, out);
        Some(())
    }

    /// What an assignment or an initialiser sets of a variable: of an array only as many elements as the
    /// value has.
    pub(super) fn set_by(&self, ty: Ty, value: Option<ExprId>) -> Ty {
        let of_value = value.and_then(|value| self.array_length(value));
        match (ty, of_value) {
            (Ty::Array(element, len), Some(own)) => Ty::Array(element, len.min(own)),
            (ty, _) => ty,
        }
    }

    fn array_length(&self, id: ExprId) -> Option<u32> {
        match &self.ast[id].kind {
            ExprKind::Assign { target: inner, .. } | ExprKind::Paren(inner) => self.array_length(*inner),
            ExprKind::InitList(list) => u32::try_from(list.len()).ok(),
            _ => match self.place(id)?.0 {
                Ty::Array(_, len) => Some(len),
                _ => None,
            },
        }
    }

    /// The type of a place, the name that it has in an explanation, and its path in the source; a component
    /// stands for its variable. In the name, `%d` is an index, which follows after a `|`.
    pub(super) fn place(&self, id: ExprId) -> Option<(Ty, String, String)> {
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
                let index_now = format!("clamp({index}, 0, {})", len.saturating_sub(1));
                let told = match told.split_once('|') {
                    Some((name, outer)) => format!("{name}[%d]|{outer}, {index_now}"),
                    None => format!("{told}[%d]|{index_now}"),
                };
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
    pub(super) fn print(&self, ty: &Ty, told: &str, path: &str, line: u32, out: &mut String) {
        self.print_as("@S", (ty, told, path), line, out);
    }

    pub(super) fn print_as(
        &self,
        word: &str,
        (ty, told, path): (&Ty, &str, &str),
        line: u32,
        out: &mut String,
    ) {
        let (name, index) = match told.split_once('|') {
            Some((name, index)) => (name.to_string(), format!(", {index}")),
            None => (told.to_string(), String::new()),
        };
        let parts = |out: &mut String, form: &str, values: &[String]| {
            let _ = write!(out, " printf(\"{word} {line} {name} {form}\"{index}, {});", values.join(", "));
        };
        if self.slopes && word == "@S" {
            let values = match ty {
                Ty::Float => vec![format!("Dx({path})"), format!("Dy({path})")],
                Ty::Triple => ["Dx", "Dy"]
                    .iter()
                    .flat_map(|f| (0..3).map(move |n| format!("{f}({path}[{n}])")))
                    .collect(),
                _ => return,
            };
            return parts(out, &format!("f{}", " %.9g".repeat(values.len())), &values);
        }
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
                    self.print_as(word, (own, &join(told, field), &format!("{path}.{field}")), line, out);
                }
            }
            Ty::Array(element, len) => {
                for n in 0..*len {
                    self.print_as(
                        word,
                        (element, &format!("{told}[{n}]"), &format!("{path}[{n}]")),
                        line,
                        out,
                    );
                }
            }
            Ty::Other => {}
        }
    }
}

/// The name of a field; indices that follow a `|` stay at the end.
fn join(told: &str, field: &str) -> String {
    match told.split_once('|') {
        Some((name, index)) => format!("{name}.{field}|{index}"),
        None => format!("{told}.{field}"),
    }
}

pub(super) fn base_name(path: &str) -> String {
    path.split(['.', '[']).next().unwrap_or_default().to_string()
}
