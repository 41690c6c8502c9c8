//! The syntactic role of a piece, and whether a space separates two pieces.

use super::pieces::{Kind, Piece};
use crate::lexer::scan;
use crate::token::Token;

/// The syntactic role of a piece.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Role {
    /// A comment, or whole lines.
    #[default]
    None,
    /// A name or a literal.
    Operand,
    /// The name of a type.
    Type,
    /// Any other word.
    Keyword,
    /// An operator between two operands, with its binding strength.
    Binary(u8),
    /// `=` and the like.
    Assign,
    Prefix,
    Postfix,
    Comma,
    Semi,
    Dot,
    /// A bracket that belongs to the name before it.
    Call,
    /// Any other parenthesis.
    Group,
    /// `)` or `]`.
    Close,
    /// The `)` of a cast.
    CastClose,
    /// `[[`
    MetaOpen,
    /// The first `]` of the `]]`.
    MetaMid,
    /// The second one.
    MetaClose,
    /// The braces of an initialiser.
    ListOpen,
    ListClose,
    /// The braces of a block.
    BlockOpen,
    BlockClose,
}

impl Role {
    /// Whether an operand may end here, so that a following `-` is a binary operator.
    fn ends_operand(self) -> bool {
        matches!(self, Role::Operand | Role::Postfix | Role::Close | Role::MetaClose | Role::ListClose)
    }

    /// Whether a following `(` contains arguments.
    pub(super) fn is_callee(self) -> bool {
        matches!(self, Role::Operand | Role::Type)
    }

    /// Whether a following `{` begins an initialiser rather than a block.
    pub(super) fn wants_list(self) -> bool {
        matches!(self, Role::Assign | Role::Comma | Role::Binary(_) | Role::Prefix | Role::Keyword)
    }

    /// Whether it opens a bracket within a statement.
    pub(super) fn opens(self) -> bool {
        matches!(self, Role::Call | Role::Group | Role::MetaOpen | Role::ListOpen)
    }

    fn closes(self) -> bool {
        matches!(self, Role::Close | Role::CastClose | Role::MetaClose | Role::ListClose)
    }
}

/// The role of a piece that is not a bracket; `before` is the role of the code before it.
pub(super) fn of(piece: &Piece<'_>, before: Role) -> Role {
    let token = match &piece.kind {
        Kind::Fixed(token) => token,
        Kind::LineComment | Kind::BlockComment | Kind::Lines(_) => return Role::None,
        Kind::Name | Kind::Number | Kind::Str | Kind::Macro => return Role::Operand,
    };
    match token {
        Token::Type(_) => Role::Type,
        Token::Comma => Role::Comma,
        Token::Semi => Role::Semi,
        Token::Dot => Role::Dot,
        Token::Assign | Token::OpAssign(_) => Role::Assign,
        Token::Step(_) if before.ends_operand() => Role::Postfix,
        Token::Plus | Token::Minus if before.ends_operand() => Role::Binary(7),
        Token::Step(_) | Token::Plus | Token::Minus => Role::Prefix,
        // The word needs a space, the sign does not.
        Token::Prefix(_) if piece.text != "not" => Role::Prefix,
        Token::Question | Token::Colon => Role::Binary(0),
        Token::OrOr => Role::Binary(1),
        Token::AndAnd => Role::Binary(2),
        Token::Pipe | Token::Caret | Token::Amp => Role::Binary(3),
        Token::EqOp(_) => Role::Binary(4),
        Token::RelOp(_) => Role::Binary(5),
        Token::ShiftOp(_) => Role::Binary(6),
        Token::MulOp(_) => Role::Binary(8),
        _ => Role::Keyword,
    }
}

/// Whether a statement or declaration may begin with a piece, and none can continue with it.
pub(super) fn begins_statement(piece: &Piece<'_>) -> bool {
    match &piece.kind {
        Kind::Name | Kind::Macro | Kind::Lines(_) => true,
        Kind::Fixed(token) => matches!(
            token,
            Token::Type(_)
                | Token::If
                | Token::For
                | Token::While
                | Token::Do
                | Token::Return
                | Token::Break
                | Token::Continue
                | Token::Struct
                | Token::Closure
                | Token::RBrace
        ),
        _ => false,
    }
}

/// Whether a space separates two pieces on a line, by their roles.
fn spaced(a: Role, b: Role) -> bool {
    let tight_before = match b {
        Role::Comma | Role::Semi | Role::Dot | Role::Postfix | Role::Call => true,
        b => b.closes(),
    };
    let tight_behind = matches!(a, Role::Call | Role::Group | Role::ListOpen | Role::Dot | Role::Prefix);
    let empty_block = (a, b) == (Role::BlockOpen, Role::BlockClose);
    !(tight_before || tight_behind || empty_block)
}

/// Whether a space separates two adjacent pieces on a line.
pub(super) fn space(a: &Piece<'_>, a_role: Role, b: &Piece<'_>, b_role: Role) -> bool {
    spaced(a_role, b_role) || b.kind == Kind::LineComment || glue(a.text, b.text)
}

/// Whether two tokens without a space between them would be read as something else.
fn glue(a: &str, b: &str) -> bool {
    let inert = |c: char| matches!(c, '(' | ')' | ']' | '{' | '}' | ',' | ';');
    if a.ends_with(inert) || b.starts_with(inert) {
        return false;
    }
    scan(&format!("{a}{b}"), 0).is_some_and(|(_, end)| end != a.len())
}
