//! What to write instead of a value that does not fit.
//!
//! The advice names the functions of the language that make the value fit, with the variable that the source
//! names.

use super::Resolver;
use crate::hir::{Expr, ExprKind};
use osl_ir::types::Type;

impl Resolver<'_> {
    /// How to make a value of type `to` from a value that cannot be converted to it.
    pub(super) fn instead_of(&self, to: Type, value: &Expr) -> Option<String> {
        let from = value.ty;
        let name = |usual: &str| match &value.kind {
            ExprKind::Read(place) if place.path.is_empty() => self.var(place.var).name.to_string(),
            _ => usual.to_string(),
        };
        if from.is_array() && !to.is_array() && self.structs.assignable(to, from.element()) {
            return Some(format!("`{0}[0]` is its first element", name("a")));
        }
        if from.is_array() || to.is_array() {
            return None;
        }
        if to.as_struct().is_some() && matches!(value.kind, ExprKind::Comma(_)) {
            return Some("write braces instead of the parentheses: `{1, 2, 3}`".to_string());
        }
        let cast = if to == Type::INT { "(int)" } else { "" };
        Some(match (to, from) {
            (Type::FLOAT | Type::INT, Type::COLOR) => {
                let c = name("c");
                format!("`{cast}luminance({c})` is its brightness, `{cast}{c}.r` its red part")
            }
            (Type::FLOAT | Type::INT, Type::POINT) => {
                format!("`{cast}{0}.x` is its first coordinate", name("p"))
            }
            (Type::FLOAT | Type::INT, _) if from.is_triple() => {
                let v = name("v");
                format!("`{cast}length({v})` is its length, `{cast}{v}.x` its first component")
            }
            (Type::FLOAT | Type::INT, Type::MATRIX) => {
                format!("`{cast}{0}[0][0]` is an element of it", name("m"))
            }
            (Type::FLOAT, Type::STRING) => format!("`stof({})` reads a number", name("s")),
            (Type::INT, Type::STRING) => format!("`stoi({})` reads a number", name("s")),
            (Type::STRING, Type::INT) => format!("`format(\"%d\", {})` makes a string", name("n")),
            (Type::STRING, _) if from.is_number() || from.is_triple() => {
                format!("`format(\"%g\", {})` makes a string", name("x"))
            }
            (Type::CLOSURE, _) if from.is_number() || from.is_triple() => {
                let c = name("c");
                format!(
                    "a function makes a closure, and a color scales it: `{c} * diffuse(N)`, `{c} * emission()`"
                )
            }
            (_, Type::CLOSURE) => {
                "a closure has no color before a renderer evaluates it: assign it to `Ci`, \
                                   or to a `closure color`"
                    .to_string()
            }
            (_, Type::MATRIX) if to.is_triple() => "a matrix is applied by `transform(m, p)`".to_string(),
            _ => return None,
        })
    }
}
