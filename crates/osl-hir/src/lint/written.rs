//! Lints on the text as written: bodies that are a lone `;`, chained comparisons, `!` before a comparison,
//! branches that are alike.
//!
//! They read the syntax tree, since meaning does not tell `a < b < c` from `(a < b) < c`. Text of macros is
//! recognised by its form and left alone.

use super::{Findings, codes_of_slips as codes};
use osl_syntax::ast::{self, Ast, BinaryOp, ExprId, ExprKind, StmtId, StmtKind, UnaryOp};
use osl_syntax::span::Span;

/// Maximum number of bytes of an operand that a suggestion repeats.
const MAX_OPERAND: u32 = 40;
/// Maximum number of bytes of a branch that is compared.
const MAX_BRANCH: u32 = 2000;

/// Reports the findings described above.
pub(super) fn run(ast: &Ast, found: &mut Findings<'_>) {
    let mut written = Written { ast, found };
    for stmt in &ast.stmts {
        written.stmt(stmt);
    }
    written.loops();
    for expr in &ast.exprs {
        match &expr.kind {
            ExprKind::Binary(op, a, b) if is_relation(*op) || is_equality(*op) => {
                written.chained(expr.span, *op, *a, *b);
                written.negated(expr.span, *a, *b);
            }
            ExprKind::Ternary(cond, a, b) => {
                let (cond, a, b) = (ast[*cond].span, ast[*a].span, ast[*b].span);
                written.branches(cond, a, b);
            }
            _ => {}
        }
    }
}

fn is_relation(op: BinaryOp) -> bool {
    matches!(op, BinaryOp::Lt | BinaryOp::Le | BinaryOp::Gt | BinaryOp::Ge)
}

fn is_equality(op: BinaryOp) -> bool {
    matches!(op, BinaryOp::Eq | BinaryOp::Ne)
}

struct Written<'a, 'f, 's> {
    ast: &'a Ast,
    found: &'f mut Findings<'s>,
}

impl Written<'_, '_, '_> {
    fn stmt(&mut self, stmt: &ast::Stmt) {
        if let StmtKind::If { cond, then, otherwise } = &stmt.kind {
            if otherwise.is_none() {
                self.empty_body("if", *cond, *then);
            }
            if let Some(otherwise) = otherwise {
                let (then, otherwise) = (self.ast[*then].span, self.ast[*otherwise].span);
                self.branches(self.ast[*cond].span, then, otherwise);
            }
        }
    }

    /// A loop may have all of its work in its head; only with a block after it, the `;` is a slip.
    fn loops(&mut self) {
        let ast = self.ast;
        let mut lists: Vec<&[StmtId]> = Vec::new();
        for item in &ast.items {
            match item {
                ast::Item::Shader(shader) => lists.push(&shader.body.stmts),
                ast::Item::Function(f) => lists.extend(f.body.as_ref().map(|body| &body.stmts[..])),
                ast::Item::Struct(_) => {}
            }
        }
        for stmt in &ast.stmts {
            match &stmt.kind {
                StmtKind::Block(list) => lists.push(list),
                StmtKind::Function(f) => lists.extend(f.body.as_ref().map(|body| &body.stmts[..])),
                _ => {}
            }
        }
        for pair in lists.into_iter().flat_map(|list| list.windows(2)) {
            let [first, second] = pair else { continue };
            if !matches!(ast[*second].kind, StmtKind::Block(_)) {
                continue;
            }
            match &ast[*first].kind {
                StmtKind::While { cond, body } => self.empty_body("while", *cond, *body),
                StmtKind::For { cond, iter, body, .. } => {
                    if let Some(last) = iter.or(*cond) {
                        self.empty_body("for", last, *body);
                    }
                }
                _ => {}
            }
        }
    }

    fn empty_body(&mut self, word: &str, head: ExprId, body: StmtId) {
        let (head, body) = (self.ast[head].span, &self.ast[body]);
        if !matches!(body.kind, StmtKind::Empty) || self.found.text(body.span) != ";" {
            return;
        }
        // A macro that expands to nothing may stand between them.
        let between = Span::new(head.end, body.span.start.max(head.end));
        let bare = self.found.text(between).chars().all(|c| c == ')' || c.is_whitespace());
        if bare && self.found.text(between).contains(')') {
            self.found.report(codes::empty_body(body.span, word, head));
        }
    }

    fn chained(&mut self, span: Span, op: BinaryOp, a: ExprId, b: ExprId) {
        let ExprKind::Binary(first, _, middle) = &self.ast[a].kind else { return };
        let chains = (is_relation(op) && is_relation(*first))
            || (is_equality(op) && *first == op && !self.is_truth(b));
        if !chains || !self.is_whole(span) {
            return;
        }
        let (inner, middle) = (self.ast[a].span, self.ast[*middle].span);
        let short = middle.end.saturating_sub(middle.start) <= MAX_OPERAND && middle.end == inner.end;
        let symbol = match first {
            BinaryOp::Lt => "<",
            BinaryOp::Le => "<=",
            BinaryOp::Gt => ">",
            BinaryOp::Ge => ">=",
            BinaryOp::Eq => "==",
            _ => "!=",
        };
        let text = self.found.text(middle).to_owned();
        let middle = short.then_some((text.as_str(), symbol)).filter(|(text, _)| !text.is_empty());
        self.found.report(codes::chained(span, inner, middle));
    }

    /// Whether an expression is 0 or 1 by its form.
    fn is_truth(&self, id: ExprId) -> bool {
        match &self.ast[id].kind {
            ExprKind::Int(n) => matches!(n, 0 | 1),
            ExprKind::Unary(UnaryOp::Not, _) => true,
            ExprKind::Binary(op, ..) => {
                is_relation(*op) || is_equality(*op) || matches!(op, BinaryOp::And | BinaryOp::Or)
            }
            ExprKind::Paren(inner) => self.is_truth(*inner),
            _ => false,
        }
    }

    fn negated(&mut self, span: Span, a: ExprId, b: ExprId) {
        let ExprKind::Unary(UnaryOp::Not, inner) = &self.ast[a].kind else { return };
        if self.is_truth(b) || self.is_truth(*inner) || !self.is_whole(span) {
            return;
        }
        let not = self.ast[a].span;
        let plain = self.found.text(not).starts_with('!');
        self.found.report(codes::negated_operand(not, span, plain));
    }

    fn branches(&mut self, cond: Span, first: Span, second: Span) {
        let long = |span: Span| span.end.saturating_sub(span.start) > MAX_BRANCH;
        if long(first) || long(second) || first == second {
            return;
        }
        let words = |span: Span| -> String {
            let text = self.found.text(span).trim();
            let text = text.strip_prefix('{').and_then(|t| t.strip_suffix('}')).unwrap_or(text);
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let (one, other) = (words(first), words(second));
        if one == other && one.len() > usize::from(one == ";") {
            self.found.report(codes::same_branches(cond, first, second));
        }
    }

    /// Whether an expression was written as it is: text of a macro has the place of the macro's name.
    fn is_whole(&self, span: Span) -> bool {
        let text = self.found.text(span);
        self.found.in_main_file(span) && text.contains(['<', '>', '=', '!'])
    }
}
