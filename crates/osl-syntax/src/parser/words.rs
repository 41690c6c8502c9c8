//! Tokens in words: those that were found, and those that would fit.

use crate::ast::{BinaryOp, UnaryOp};
use crate::print;
use crate::token::Token;

/// The terminals that would fit, in words: a class where possible, else the tokens themselves.
pub(super) fn words(expected: &[String]) -> String {
    let has = |t: &str| expected.iter().any(|e| e.trim_matches('"') == t);
    let mut words: Vec<String> = Vec::new();
    let statement = has("while");
    let expression = has("int") && has("ident");
    let declaration = has("struct");
    if statement {
        words.push("a statement".into());
    } else if declaration {
        words.push("a declaration".into());
    } else if expression {
        words.push("an expression".into());
    } else if has("type") && has("ident") {
        words.push("a type".into());
    } else if has("ident") {
        words.push("a name".into());
    } else if has("type") {
        words.push("a type".into());
    }
    for closer in [";", ",", ")", "]", "}", "{", ":", "=", "(", "[", "[[", "else", "while"] {
        let covered = match closer {
            "(" | "[" => expression || statement || has("*"),
            "{" => statement,
            ";" => statement || declaration,
            "while" | "else" => statement,
            "}" => declaration,
            "=" => has("op="),
            _ => false,
        };
        if has(closer) && !covered {
            words.push(format!("`{closer}`"));
        }
    }
    if has("*") {
        words.push("an operator".into());
    }
    match words.as_slice() {
        [] => "something else".into(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// A token in words.
pub(super) fn describe(token: &Token) -> String {
    match token {
        Token::Ident(name) => format!("`{name}`"),
        Token::Int(v) => format!("`{v}`"),
        Token::Float(v) => format!("`{v:?}`"),
        Token::Str(_) => "a string".into(),
        Token::Type(name) => format!("`{}`", print::type_name(name)),
        Token::ShaderKind(kind) => format!("`{}`", print::shader_kind(*kind)),
        Token::OpAssign(op) => format!("`{}=`", print::binary_op(*op)),
        Token::MulOp(op) | Token::ShiftOp(op) | Token::RelOp(op) | Token::EqOp(op) => {
            format!("`{}`", print::binary_op(*op))
        }
        Token::Prefix(UnaryOp::Compl) => "`~`".into(),
        Token::Prefix(_) => "`!`".into(),
        Token::Step(up) => if *up { "`++`" } else { "`--`" }.into(),
        Token::Amp => op(BinaryOp::BitAnd),
        Token::Caret => op(BinaryOp::BitXor),
        Token::Pipe => op(BinaryOp::BitOr),
        Token::AndAnd => op(BinaryOp::And),
        Token::OrOr => op(BinaryOp::Or),
        Token::Plus => op(BinaryOp::Add),
        Token::Minus => op(BinaryOp::Sub),
        Token::Unused => "a reserved word".into(),
        Token::Stray | Token::Bad | Token::BadExpr => "something broken".into(),
        word => format!("`{}`", fixed(word)),
    }
}

fn op(op: BinaryOp) -> String {
    format!("`{}`", print::binary_op(op))
}

/// The spelling of tokens that have only one.
fn fixed(token: &Token) -> &'static str {
    match token {
        Token::Break => "break",
        Token::Closure => "closure",
        Token::Continue => "continue",
        Token::Do => "do",
        Token::Else => "else",
        Token::For => "for",
        Token::If => "if",
        Token::Output => "output",
        Token::Return => "return",
        Token::Struct => "struct",
        Token::While => "while",
        Token::LParen => "(",
        Token::RParen => ")",
        Token::LBracket => "[",
        Token::RBracket => "]",
        Token::LMeta => "[[",
        Token::LBrace => "{",
        Token::RBrace => "}",
        Token::Comma => ",",
        Token::Semi => ";",
        Token::Dot => ".",
        Token::Question => "?",
        Token::Colon => ":",
        Token::Assign => "=",
        _ => "",
    }
}
