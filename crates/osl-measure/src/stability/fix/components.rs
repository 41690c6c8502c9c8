//! Components of triples that are known part by part.
//!
//! This module must not know the text of a shader.

use super::term::{COMPONENTS, Head, Term, product, sum};
use osl_ir::types::Type;

/// A component of a triple, if the triple is a constructor, a variable, or a sum or product of such.
pub(super) fn component(index: usize, whole: &Term) -> Option<Term> {
    let inner = match &whole.head {
        Head::Call(name) if ["color", "point", "vector", "normal"].contains(&&**name) => {
            whole.parts.get(index).cloned()
        }
        Head::Sum(flags) => {
            let parts = whole.parts.iter().map(|part| component(index, part)).collect::<Option<Vec<Term>>>();
            parts.map(|parts| sum(flags.iter().copied().zip(parts).collect()))
        }
        Head::Product(flags) => {
            let of_part = |part: &Term| match part.ty {
                Some(ty) if ty.is_triple() => component(index, part),
                _ => Some(part.clone()),
            };
            let parts = whole.parts.iter().map(of_part).collect::<Option<Vec<Term>>>();
            parts.map(|parts| product(flags.iter().copied().zip(parts).collect()))
        }
        _ => None,
    };
    inner.or_else(|| named(index, whole))
}

/// A component of a variable, by the variable's name.
pub(super) fn named(index: usize, whole: &Term) -> Option<Term> {
    let name = whole.text.as_ref().filter(|text| text.chars().all(|c| c.is_alphanumeric() || c == '_'))?;
    let text = format!("{name}[{index}]");
    let head = Head::Call((*COMPONENTS.get(index)?).into());
    Some(Term {
        text: Some(text.as_str().into()),
        ty: Some(Type::FLOAT),
        covers: whole.covers.clone(),
        ..Term::new(head, vec![whole.clone()])
    })
}
