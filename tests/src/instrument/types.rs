//! Types of variables, as far as printing needs them.

use osl_syntax::ast::{Ast, Item, TypeName, TypeSpec};
use std::collections::HashMap;

/// A type whose values can be printed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Ty {
    Int,
    Float,
    Triple,
    Matrix,
    Text,
    Struct(usize),
    Array(Box<Ty>, u32),
    /// A closure, nothing, or an array of unknown length.
    Other,
}

impl Ty {
    pub(super) fn is_triple(&self) -> bool {
        *self == Ty::Triple
    }

    pub(super) fn is_scalar(&self) -> bool {
        !matches!(self, Ty::Struct(_) | Ty::Array(..) | Ty::Other)
    }

    pub(super) fn is_plain_array(&self) -> bool {
        matches!(self, Ty::Array(element, _) if element.is_scalar())
    }
}

/// The variables that are visible.
pub(super) struct Scopes {
    structs: Vec<(String, Vec<(String, Ty)>)>,
    scopes: Vec<HashMap<String, Ty>>,
}

impl Scopes {
    pub(super) fn new(ast: &Ast) -> Scopes {
        let mut globals = HashMap::new();
        for name in ["P", "I", "N", "Ng", "dPdu", "dPdv", "Ps", "dPdtime"] {
            globals.insert(name.to_string(), Ty::Triple);
        }
        for name in ["u", "v", "time", "dtime"] {
            globals.insert(name.to_string(), Ty::Float);
        }
        let mut scopes = Scopes { structs: Vec::new(), scopes: vec![globals] };
        for item in &ast.items {
            let Item::Struct(decl) = item else { continue };
            let mut fields = Vec::new();
            for field in &decl.fields {
                let len = field.array.as_ref().and_then(|array| match ast[array.len?].kind {
                    osl_syntax::ast::ExprKind::Int(n) => u32::try_from(n).ok(),
                    _ => None,
                });
                fields.push((field.name.text.to_string(), scopes.ty(&field.ty, len, field.array.is_some())));
            }
            scopes.structs.push((decl.name.text.to_string(), fields));
        }
        scopes
    }

    pub(super) fn push(&mut self) {
        self.scopes.push(HashMap::new());
    }

    pub(super) fn pop(&mut self) {
        self.scopes.pop();
    }

    pub(super) fn declare(&mut self, name: &str, ty: Ty) {
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name.to_string(), ty);
        }
    }

    pub(super) fn find(&self, name: &str) -> Option<Ty> {
        self.scopes.iter().rev().find_map(|scope| scope.get(name)).cloned()
    }

    /// The number of scopes.
    pub(super) fn depth(&self) -> usize {
        self.scopes.len()
    }

    /// Whether a name of the first scopes is hidden by one of a later scope.
    pub(super) fn is_hidden(&self, name: &str, depth: usize) -> bool {
        self.scopes.iter().skip(depth).any(|scope| scope.contains_key(name))
    }

    pub(super) fn field(&self, ty: &Ty, name: &str) -> Option<Ty> {
        let Ty::Struct(id) = ty else { return None };
        self.fields(*id).iter().find(|(field, _)| field == name).map(|(_, ty)| ty.clone())
    }

    pub(super) fn fields(&self, id: usize) -> &[(String, Ty)] {
        &self.structs[id].1
    }

    /// A declared type; an array whose length is not known is not printed.
    pub(super) fn ty(&self, spec: &TypeSpec, len: Option<u32>, is_array: bool) -> Ty {
        let own = match &spec.name {
            _ if spec.closure || !super::printable(&spec.name) => Ty::Other,
            TypeName::Int => Ty::Int,
            TypeName::Float => Ty::Float,
            TypeName::Color | TypeName::Point | TypeName::Vector | TypeName::Normal => Ty::Triple,
            TypeName::Matrix => Ty::Matrix,
            TypeName::String => Ty::Text,
            TypeName::Struct(name) => match self.structs.iter().rposition(|(own, _)| *own == **name) {
                Some(id) => Ty::Struct(id),
                None => Ty::Other,
            },
            TypeName::Void => Ty::Other,
        };
        match len {
            Some(len) if is_array => Ty::Array(Box::new(own), len),
            None if is_array => Ty::Other,
            _ => own,
        }
    }
}
