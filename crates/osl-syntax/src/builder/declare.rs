//! Declarations and statements.

use super::Builder;
use crate::ast::{
    ArrayLen, Block, Declarator, ExprId, ExprKind, FieldDecl, Formal, FunctionDecl, Metadatum, Name,
    ShaderDecl, ShaderKind, StmtId, StmtKind, StructDecl, TypeName, TypeSpec,
};
use crate::errors;

/// A function except its body. Metadata may precede or follow the parameters.
pub(crate) struct FunctionHead {
    pub(crate) ret: TypeSpec,
    pub(crate) name: Name,
    pub(crate) formals: Vec<Formal>,
    pub(crate) metadata: (Option<Vec<Metadatum>>, Option<Vec<Metadatum>>),
}

/// A shader except its body.
pub(crate) struct ShaderHead {
    pub(crate) kind: ShaderKind,
    pub(crate) name: Name,
    pub(crate) formals: Vec<Formal>,
    pub(crate) metadata: (Option<Vec<Metadatum>>, Option<Vec<Metadatum>>),
}

/// The parts of a parameter.
pub(crate) struct FormalParts {
    pub(crate) output: bool,
    pub(crate) ty: TypeSpec,
    pub(crate) name: Name,
    pub(crate) array: Option<ArrayLen>,
    pub(crate) init: Option<ExprId>,
    pub(crate) metadata: Option<Vec<Metadatum>>,
}

/// The parentheses of a `for`.
pub(crate) struct ForHead {
    pub(crate) init: Option<StmtId>,
    pub(crate) cond: Option<ExprId>,
    pub(crate) iter: Option<ExprId>,
}

impl Builder<'_> {
    pub(crate) fn ty(&mut self, l: u32, r: u32, closure: bool, name: TypeName) -> TypeSpec {
        TypeSpec { span: self.span(l, r), closure, name }
    }

    pub(crate) fn array_len(&mut self, l: u32, r: u32, len: Option<ExprId>) -> ArrayLen {
        if let Some(len) = len {
            let e = self.get(len);
            if !matches!(e.kind, ExprKind::Int(1..) | ExprKind::Error) {
                self.report(errors::array_length(e.span, None));
            }
        }
        ArrayLen { span: self.span(l, r), len }
    }

    /// Rejects `[]` where a length is required: it is permitted only for parameters.
    fn check_sized(&mut self, array: Option<ArrayLen>, init: Option<ExprId>) {
        if let Some(ArrayLen { span, len: None }) = array {
            let listed = init.and_then(|init| match &self.get(init).kind {
                ExprKind::InitList(values) if !values.is_empty() => Some(values.len()),
                _ => None,
            });
            self.report(errors::array_length(span, listed));
        }
    }

    fn check_declared(&mut self, name: &Name) {
        if name.text.starts_with("___") {
            self.report(errors::triple_underscore(name.span, &name.text));
        }
    }

    fn check_initializer(&mut self, array: Option<ArrayLen>, init: Option<ExprId>) {
        if let (Some(_), Some(init)) = (array, init) {
            let e = self.get(init);
            if !matches!(e.kind, ExprKind::InitList(_) | ExprKind::Error) {
                let span = e.span;
                let values = matches!(e.kind, ExprKind::Paren(inner) if matches!(self.get(inner).kind, ExprKind::Comma(_)));
                self.report(errors::array_initializer(span, values));
            }
        }
    }

    pub(crate) fn struct_decl(
        &mut self,
        l: u32,
        r: u32,
        name: Name,
        fields: Vec<Vec<FieldDecl>>,
    ) -> StructDecl {
        self.check_declared(&name);
        StructDecl { span: self.span(l, r), name, fields: fields.into_iter().flatten().collect() }
    }

    pub(crate) fn fields(&mut self, ty: TypeSpec, names: Vec<(Name, Option<ArrayLen>)>) -> Vec<FieldDecl> {
        let mut fields = Vec::with_capacity(names.len());
        for (name, array) in names {
            self.check_sized(array, None);
            fields.push(FieldDecl { ty: ty.clone(), name, array });
        }
        fields
    }

    pub(crate) fn function(
        &mut self,
        l: u32,
        r: u32,
        head: FunctionHead,
        body: Option<Block>,
    ) -> FunctionDecl {
        self.check_declared(&head.name);
        let FunctionHead { ret, name, formals, metadata } = head;
        for init in formals.iter().filter_map(|f| f.init) {
            self.check_lists(&[init]);
        }
        FunctionDecl { span: self.span(l, r), ret, name, formals, metadata: join(metadata), body }
    }

    pub(crate) fn shader(&mut self, l: u32, r: u32, head: ShaderHead, body: Block) -> ShaderDecl {
        let ShaderHead { kind, name, formals, metadata } = head;
        ShaderDecl { span: self.span(l, r), kind, name, metadata: join(metadata), formals, body }
    }

    pub(crate) fn formal(&mut self, l: u32, r: u32, parts: FormalParts) -> Formal {
        let FormalParts { output, ty, name, array, init, metadata } = parts;
        self.check_declared(&name);
        self.check_initializer(array, init);
        Formal {
            span: self.span(l, r),
            output,
            ty,
            name,
            array,
            init,
            metadata: metadata.unwrap_or_default(),
        }
    }

    pub(crate) fn metadatum(
        &mut self,
        ty: TypeSpec,
        name: Name,
        array: Option<ArrayLen>,
        value: ExprId,
    ) -> Metadatum {
        self.check_initializer(array, Some(value));
        Metadatum { ty, name, array, value }
    }

    pub(crate) fn block(&mut self, l: u32, r: u32, stmts: Vec<StmtId>) -> Block {
        Block { span: self.span(l, r), stmts }
    }

    pub(crate) fn declarator(
        &mut self,
        name: Name,
        array: Option<ArrayLen>,
        init: Option<ExprId>,
    ) -> Declarator {
        self.check_declared(&name);
        self.check_sized(array, init);
        self.check_initializer(array, init);
        self.check_lists(&init);
        Declarator { name, array, init }
    }

    pub(crate) fn return_stmt(&mut self, l: u32, r: u32, value: Option<ExprId>) -> StmtId {
        self.check_lists(&value);
        self.stmt(l, r, StmtKind::Return(value))
    }

    pub(crate) fn if_stmt(
        &mut self,
        l: u32,
        r: u32,
        cond: ExprId,
        then: StmtId,
        otherwise: Option<StmtId>,
    ) -> StmtId {
        self.stmt(l, r, StmtKind::If { cond, then, otherwise })
    }

    pub(crate) fn for_stmt(&mut self, l: u32, r: u32, head: ForHead, body: StmtId) -> StmtId {
        let ForHead { init, cond, iter } = head;
        self.stmt(l, r, StmtKind::For { init, cond, iter, body })
    }

    /// The parentheses of a `for` whose contents recovery has removed.
    pub(crate) fn bad_for(&mut self, l: u32, r: u32) -> ForHead {
        ForHead { init: None, cond: Some(self.expr(l, r, ExprKind::Error)), iter: None }
    }
}

fn join((before, behind): (Option<Vec<Metadatum>>, Option<Vec<Metadatum>>)) -> Vec<Metadatum> {
    before.into_iter().chain(behind).flatten().collect()
}
