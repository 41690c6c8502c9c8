//! Declarations: structs, functions, shaders, parameters.

use super::errors;
use super::unknown::SHADERS;
use super::{Contents, Context, FunctionSymbol, Resolver, Symbol};
use crate::builtins::{self, ParamType, Signature, Tail};
use crate::hir::{self, Init, VarId, VarKind};
use osl_ir::types::{Base, Extent, Field, Struct, Type};
use osl_syntax::Reports;
use osl_syntax::ast;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// The longest permitted array. Longer ones are refused before memory is allocated.
use osl_ir::types::MAX_ARRAY_LENGTH;

impl Resolver<'_> {
    /// Resolves the file's declarations in order and returns its shader.
    pub(super) fn items(&mut self) -> Option<hir::Shader> {
        let mut shader: Option<(hir::Shader, Span)> = None;
        self.begin_file();
        for item in &self.ast.items {
            self.begin_item(item.span());
            match item {
                ast::Item::Struct(decl) => self.struct_decl(decl),
                ast::Item::Function(decl) => self.function(decl),
                ast::Item::Shader(decl) => {
                    if let Some((_, first)) = &shader {
                        let d = Diagnostic::error(
                            errors::TWO_SHADERS,
                            decl.name.span,
                            "a second shader in one file",
                        )
                        .label("a file holds exactly one shader")
                        .also(*first, "the first");
                        self.report(d);
                        continue;
                    }
                    shader = Some((self.shader(decl), decl.name.span));
                }
            }
        }
        if shader.is_none() {
            let d = Diagnostic::error(errors::NO_SHADER, Span::default(), "the file declares no shader");
            let main = self.ast.items.iter().find_map(|item| match item {
                ast::Item::Function(f) if &*f.name.text == "main" => Some(f),
                _ => None,
            });
            self.report(match main {
                Some(main) => d
                    .also(main.name.span, "a function like any other")
                    .help("a shader is declared by the word `shader`: `shader main(float x = 1, output color c = 0) { … }`"),
                None => d.help("a shader looks like `shader name(float x = 1, output color c = 0) { … }`"),
            });
        }
        shader.map(|(shader, _)| shader)
    }

    fn struct_decl(&mut self, decl: &ast::StructDecl) {
        let name = &decl.name.text;
        let taken = self.structs.find(name).map(|id| self.structs.get(id).span);
        if let Some(earlier) = taken {
            self.report(errors::redeclared(decl.name.span, name, Some(earlier)));
        } else if let Some(earlier) = self.taken_in_file(name) {
            self.report(errors::redeclared(decl.name.span, name, earlier));
        }
        let mut fields: Vec<Field> = Vec::new();
        let mut spans = Vec::new();
        let mut names = FxHashSet::default();
        for field in &decl.fields {
            if names.contains(&field.name.text) {
                let earlier = decl.fields.iter().find(|f| f.name.text == field.name.text);
                self.report(errors::redeclared(
                    field.name.span,
                    &field.name.text,
                    earlier.map(|f| f.name.span),
                ));
                continue;
            }
            if taken.is_none() && matches!(&field.ty.name, ast::TypeName::Struct(of) if of == name) {
                self.report(errors::holds_itself(field.name.span, name));
                continue;
            }
            let ty = self.declared_type(&field.ty, field.array.as_ref(), false);
            names.insert(field.name.text.clone());
            spans.push(field.name.span);
            fields.push(Field { name: field.name.text.clone(), ty });
        }
        if taken.is_some() {
            // The first one keeps its name and its values.
            return;
        }
        let mut contents = Contents::default();
        for field in &fields {
            let inner = self.contents(field.ty);
            contents.values = contents.values.saturating_add(inner.values);
            contents.array |= inner.array;
            contents.depth = contents.depth.max(inner.depth);
        }
        contents.depth += 1;
        if contents.values > MAX_ARRAY_LENGTH as u64 {
            let message = format!("a struct of more than {MAX_ARRAY_LENGTH} values");
            self.report(Diagnostic::error(errors::BAD_STRUCT, decl.name.span, message));
            fields.clear();
            contents = Contents::default();
        }
        let deepest = self.limits.compiling.struct_depth;
        if contents.depth > deepest {
            let message = format!("structs within structs, more than {deepest} deep");
            self.report(Diagnostic::error(errors::BAD_STRUCT, decl.name.span, message));
            fields.clear();
            contents = Contents::default();
        }
        self.contents.push(contents);
        let id = self.structs.add(Struct { name: name.clone(), fields, span: decl.name.span });
        if self.ast.gaps.meet(decl.span) {
            self.open_struct(id.0);
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.structure(id, self.structs.get(id), &spans);
        }
    }

    /// Whether a variable or function of the file's scope has the name, and where it was declared, unless it
    /// is a name of the language.
    fn taken_in_file(&self, name: &str) -> Option<Option<Span>> {
        match self.scopes.first().and_then(|scope| scope.symbols.get(name)) {
            Some(Symbol::Var(id)) => Some(Some(self.var(*id).span)),
            Some(Symbol::Functions(list)) => Some(list.last().map(|f| f.span)),
            None => builtins::find(name).map(|_| None),
        }
    }

    /// The contents of a value of this type.
    fn contents(&self, ty: Type) -> Contents {
        let one = match ty.base {
            Base::Struct(id) => self.contents.get(id.0 as usize).copied().unwrap_or_default(),
            _ => Contents { values: 1, array: false, depth: 0 },
        };
        match ty.extent {
            Extent::Array(n) => {
                Contents { values: one.values.saturating_mul(u64::from(n)), array: true, ..one }
            }
            _ => one,
        }
    }

    /// The type in a declaration; reports unknown structs and invalid lengths.
    pub(super) fn declared_type(
        &mut self,
        ty: &ast::TypeSpec,
        array: Option<&ast::ArrayLen>,
        open: bool,
    ) -> Type {
        let base = self.type_spec(ty).base;
        let Some(array) = array else { return Type::one(base) };
        if self.ast.strict && self.contents(Type::one(base)).array {
            self.report(errors::nested_arrays(array.span));
        }
        let Some(len) = array.len else {
            if open {
                return Type { base, extent: Extent::Unsized };
            }
            self.report(Diagnostic::error(
                errors::BAD_ARRAY_LENGTH,
                array.span,
                "an array needs a length here",
            ));
            return Type::ERROR;
        };
        match self.ast[len].kind {
            ast::ExprKind::Int(n @ 1..=MAX_ARRAY_LENGTH) => {
                let ty = Type { base, extent: Extent::Array(n as u32) };
                if self.contents(ty).values <= MAX_ARRAY_LENGTH as u64 {
                    return ty;
                }
                let message = format!("an array of more than {MAX_ARRAY_LENGTH} values");
                self.report(Diagnostic::error(errors::BAD_ARRAY_LENGTH, self.ast[len].span, message));
                Type::ERROR
            }
            ast::ExprKind::Int(n) if n > MAX_ARRAY_LENGTH => {
                let message = format!("an array of {n} elements is longer than {MAX_ARRAY_LENGTH}");
                self.report(Diagnostic::error(errors::BAD_ARRAY_LENGTH, self.ast[len].span, message));
                Type::ERROR
            }
            _ => {
                let d = Diagnostic::error(
                    errors::BAD_ARRAY_LENGTH,
                    self.ast[len].span,
                    "an array length is an int literal of at least 1",
                );
                self.report(d);
                Type::ERROR
            }
        }
    }

    /// The type of a type name, arrays aside.
    pub(super) fn type_spec(&mut self, ty: &ast::TypeSpec) -> Type {
        use ast::TypeName as N;
        if ty.closure {
            return Type::CLOSURE;
        }
        match &ty.name {
            N::Int => Type::INT,
            N::Float => Type::FLOAT,
            N::Color => Type::COLOR,
            N::Point => Type::POINT,
            N::Vector => Type::VECTOR,
            N::Normal => Type::NORMAL,
            N::Matrix => Type::MATRIX,
            N::String => Type::STRING,
            N::Void => Type::VOID,
            N::Struct(name) => match self.structs.find(name) {
                Some(id) => {
                    if let Some(recorder) = &mut self.recorder {
                        recorder.use_struct(id, ty.span);
                    }
                    Type::one(Base::Struct(id))
                }
                None => {
                    self.unknown_type(ty.span, name);
                    Type::ERROR
                }
            },
        }
    }

    /// Declares a local or formal in the innermost scope, reporting a clash.
    pub(super) fn declare(&mut self, name: &ast::Name, ty: Type, kind: VarKind) -> VarId {
        let top = self.scopes.len() == 1;
        let earlier = match self.scopes.last().and_then(|s| s.symbols.get(&name.text)) {
            Some(Symbol::Var(id)) if ty.is_error() && self.reports != Reports::AsReference => {
                // `retrun x;` is a use of `x` with a misspelt word before it.
                if self.var(*id).span != Span::default() {
                    return *id;
                }
                None
            }
            Some(Symbol::Var(id)) => Some(Some(self.var(*id).span)),
            Some(Symbol::Functions(f)) => Some(f.last().map(|f| f.span)),
            None => None,
        };
        let builtin = top && builtins::find(&name.text).is_some();
        if matches!(kind, VarKind::Param { .. })
            && (builtin || matches!(earlier, Some(Some(_)) if self.is_function(&name.text)))
        {
            let message = format!("parameter `{}` has the name of a function", name.text);
            self.report(
                Diagnostic::warning(errors::HIDES_FUNCTION, name.span, message).label("hides the function"),
            );
        } else if let Some(earlier) = earlier {
            self.report(errors::redeclared(name.span, &name.text, earlier));
        } else if builtin {
            self.report(errors::redeclared(name.span, &name.text, None));
        }
        self.add_var(name.text.clone(), ty, kind, name.span)
    }

    fn is_function(&self, name: &str) -> bool {
        matches!(self.lookup(name), Some((_, Symbol::Functions(_))))
    }

    /// Resolves a function and adds it to the innermost scope.
    pub(super) fn function(&mut self, decl: &ast::FunctionDecl) {
        let outer_told = std::mem::take(&mut self.told);
        self.keywords = SHADERS;
        let ret = self.type_spec(&decl.ret);
        self.keywords = &[];
        if ret.is_error() && self.scopes.len() == 1 {
            self.unknown_declaration();
        }
        let n_errors = self.n_errors;
        // The name alone marks it, whatever its value.
        let operation = self.metadata(&decl.metadata).iter().any(|(_, name, _)| &**name == "builtin");
        let depth = self.scopes.len();
        let outer = std::mem::replace(&mut self.context, Context { ret: Some(ret), loops: 0 });
        let outer_returns = std::mem::take(&mut self.returns);
        let (formals, vars, body) = self.within_scope(|r| {
            let (formals, vars) = r.formals(decl);
            let body = decl.body.as_ref().map(|b| r.stmts_expecting(&b.stmts, Some(ret)));
            (formals, vars, body)
        });
        debug_assert_eq!(depth, self.scopes.len());
        self.context = outer;
        self.told = outer_told;
        let returns = std::mem::replace(&mut self.returns, outer_returns);
        let as_reference = self.reports == Reports::AsReference;
        let sound = self.n_errors == n_errors && !ret.is_error() && !self.may_be_cut_off(decl.span);
        let never_returns = match as_reference {
            true => ret != Type::VOID && (!returns || ret.is_error()),
            false => ret != Type::VOID && !returns && sound,
        };
        let body_start = decl.body.as_ref().map_or(decl.span.end, |body| body.span.start);
        let head = Span::new(decl.span.start, body_start.max(decl.span.start));
        let open = !as_reference && self.ast.gaps.meet(head);
        let id = body.filter(|_| !operation).map(|body| {
            self.functions.push(hir::Function {
                name: decl.name.text.clone(),
                ret: if returns || ret == Type::VOID { ret } else { Type::ERROR },
                formals: vars,
                body,
                span: decl.name.span,
            });
            hir::FunctionId(self.functions.len() as u32 - 1)
        });
        self.add_function(FunctionSymbol {
            id,
            name: decl.name.text.clone(),
            ret,
            formals,
            names: decl.formals.iter().map(|formal| formal.name.text.clone()).collect(),
            operation,
            never_returns,
            open,
            span: decl.name.span,
        });
    }

    fn formals(&mut self, decl: &ast::FunctionDecl) -> (Vec<(Type, bool)>, Vec<VarId>) {
        let mut types = Vec::new();
        let mut vars = Vec::new();
        for formal in &decl.formals {
            let ty = self.declared_type(&formal.ty, formal.array.as_ref(), true);
            if let Some(init) = formal.init
                && (self.reports == Reports::AsReference || self.context.ret != Some(Type::ERROR))
            {
                let d = Diagnostic::error(
                    errors::FORMAL_DEFAULT,
                    self.ast[init].span,
                    "a function's parameter has no default value",
                )
                .help(
                    "only shader parameters have defaults; declare an overload with fewer parameters instead",
                );
                self.report(d);
            }
            types.push((ty, formal.output));
            vars.push(self.declare(&formal.name, ty, VarKind::Formal { output: formal.output }));
        }
        (types, vars)
    }

    fn add_function(&mut self, symbol: FunctionSymbol) {
        if let Some(recorder) = &mut self.recorder {
            recorder.function(&symbol.name, symbol.ret, &symbol.formals, symbol.span, &self.structs);
        }
        let symbol = Arc::new(symbol);
        let same = |f: &FunctionSymbol| {
            f.ret == symbol.ret
                && f.formals.len() == symbol.formals.len()
                && f.formals.iter().zip(&symbol.formals).all(|(a, b)| a.0 == b.0)
        };
        let name = symbol.name.clone();
        let mut redefined = None;
        let mut full = false;
        let most = self.limits.compiling.overloads;
        let clash = match self.scope().symbols.get_mut(&name) {
            Some(Symbol::Var(id)) => Some(*id),
            Some(Symbol::Functions(list)) => {
                let earlier = list.iter().find(|f| same(f) && (f.id.is_some() || f.operation)).cloned();
                let is_prototype = symbol.id.is_none() && !symbol.operation;
                // A prototype after the body adds nothing.
                if !is_prototype || earlier.is_none() {
                    let with_body = earlier.filter(|f| f.id.is_some() && symbol.id.is_some());
                    redefined = with_body.map(|f| f.span);
                    list.retain(|f| !same(f));
                    full = list.len() as u64 >= most;
                    if !full {
                        list.push(symbol.clone());
                    }
                }
                None
            }
            None => {
                self.scope().symbols.insert(name.clone(), Symbol::Functions(vec![symbol.clone()]));
                None
            }
        };
        if let Some(id) = clash {
            let span = self.var(id).span;
            self.report(errors::redeclared(symbol.span, &name, Some(span)));
        }
        if full {
            self.report(errors::too_many_overloads(symbol.span, &name, self.limits.compiling.overloads));
        }
        let takes_place = redefined.is_none() && symbol.id.is_some() && self.scopes.len() == 1;
        if takes_place && !symbol.operation && redefines_builtin(&symbol) {
            let message = format!("function `{name}` takes the place of a built-in one");
            let d = Diagnostic::warning(errors::REDEFINED, symbol.span, message)
                .label("this one is called from here on");
            self.report(d);
        }
        if let Some(earlier) = redefined {
            let d = Diagnostic::warning(
                errors::REDEFINED,
                symbol.span,
                format!("function `{name}` is defined again"),
            )
            .label("this one is called from here on")
            .also(earlier, "the earlier one");
            self.report(d);
        }
    }

    fn shader(&mut self, decl: &ast::ShaderDecl) -> hir::Shader {
        let mut params = Vec::new();
        for (index, formal) in decl.formals.iter().enumerate() {
            params.push(self.param(formal, index as u32));
        }
        let metadata = self.metadata(&decl.metadata);
        self.context = Context { ret: None, loops: 0 };
        let body = self.stmts(&decl.body.stmts);
        if let Some(recorder) = &mut self.recorder {
            recorder.shader(&decl.name.text, decl.name.span);
        }
        hir::Shader { name: decl.name.text.clone(), kind: decl.kind, metadata, params, body }
    }

    fn param(&mut self, formal: &ast::Formal, index: u32) -> hir::Param {
        let mut ty = self.declared_type(&formal.ty, formal.array.as_ref(), true);
        if ty == Type::VOID {
            let d = Diagnostic::error(errors::BAD_PARAMETER, formal.name.span, "a parameter cannot be void");
            self.report(d);
            ty = Type::ERROR;
        }
        if ty.is_array() && matches!(ty.base, Base::Struct(_)) {
            let d = Diagnostic::error(
                errors::BAD_PARAMETER,
                formal.name.span,
                "a shader parameter cannot be an array of structs",
            );
            self.report(d);
        }
        let open = ty.extent == Extent::Unsized;
        if open {
            if formal.output {
                let d = Diagnostic::error(
                    errors::BAD_PARAMETER,
                    formal.name.span,
                    "an output parameter needs an array length",
                );
                self.report(d);
            }
            let len = match formal.init.map(|e| &self.ast[e].kind) {
                Some(ast::ExprKind::InitList(items)) => items.len().max(1),
                _ => 1,
            };
            ty.extent = Extent::Array(len as u32);
        }
        // The initialiser sees the parameters before it, but not itself.
        let init = match formal.init {
            Some(init) => {
                self.in_default = true;
                let init = self.param_init(ty, init);
                self.in_default = false;
                init
            }
            None => {
                let message = format!("parameter `{}` has no default value", formal.name.text);
                self.report(
                    Diagnostic::error(errors::NO_DEFAULT, formal.name.span, message)
                        .help("write one, as in `float x = 0`: every shader parameter has a default"),
                );
                Init::List(Vec::new())
            }
        };
        let var = self.declare(&formal.name, ty, VarKind::Param { index, output: formal.output });
        let metadata = self.metadata(&formal.metadata);
        hir::Param { var, output: formal.output, open, init, metadata }
    }
}

/// Whether a built-in function has the same signature.
fn redefines_builtin(symbol: &FunctionSymbol) -> bool {
    let formals = |s: &Signature| {
        s.params.len() == symbol.formals.len()
            && s.params.iter().zip(&symbol.formals).all(|(p, (ty, _))| p.ty == ParamType::Of(*ty))
    };
    builtins::find(&symbol.name).is_some_and(|row| {
        let tail = |s: &Signature| matches!(s.tail, Tail::None | Tail::Keywords);
        row.signatures().iter().any(|s| s.ret == symbol.ret && tail(s) && formals(s))
    })
}
