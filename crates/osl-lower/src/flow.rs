//! Which statements may leave their path. This determines where lowering needs guards.

use osl_hir::hir::{Stmt, StmtKind};

/// How control may leave a statement other than at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Flow {
    /// Some path returns.
    pub(super) returns: bool,
    /// Some path breaks the loop around it.
    pub(super) breaks: bool,
    /// Some path continues the loop around it.
    pub(super) continues: bool,
    /// No path reaches the end.
    pub(super) always: bool,
}

/// The flow of code that may leave the function or the shader.
pub(super) const RETURNED: Flow = Flow { returns: true, breaks: false, continues: false, always: false };

impl Flow {
    /// Whether some path leaves.
    pub(super) fn may_leave(self) -> bool {
        self.returns || self.breaks || self.continues
    }

    fn then(self, next: Flow) -> Flow {
        if self.always {
            return self;
        }
        Flow { always: next.always, ..self.or(next) }
    }

    pub(super) fn or(self, other: Flow) -> Flow {
        Flow {
            returns: self.returns || other.returns,
            breaks: self.breaks || other.breaks,
            continues: self.continues || other.continues,
            always: self.always && other.always,
        }
    }
}

/// The flow of statements in order.
pub(super) fn of_list(list: &[Stmt]) -> Flow {
    list.iter().fold(Flow::default(), |flow, stmt| flow.then(of(stmt)))
}

/// The flow of one statement.
pub(super) fn of(stmt: &Stmt) -> Flow {
    match &stmt.kind {
        StmtKind::Expr(_) | StmtKind::Declare(..) => Flow::default(),
        StmtKind::Block(list) => of_list(list),
        StmtKind::If(_, then, otherwise) => of_list(then).or(of_list(otherwise)),
        // Breaks and continues end at the loop, which may run zero times.
        StmtKind::Loop { body, .. } => Flow { returns: of_list(body).returns, ..Flow::default() },
        StmtKind::Break => Flow { breaks: true, always: true, ..Flow::default() },
        StmtKind::Continue => Flow { continues: true, always: true, ..Flow::default() },
        StmtKind::Return(_) => Flow { returns: true, always: true, ..Flow::default() },
    }
}
