//! The parts of a file that are missing from its tree: dropped by recovery, completed by a guess, or lost
//! before parsing.
//!
//! Later stages must not report what only follows from a gap: a name that it may have declared, an argument
//! that it may have held.

use crate::span::Span;
use crate::token::Token;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// A gap.
#[derive(Clone, Debug)]
pub struct Gap {
    /// The part of the file. It is empty where a token was guessed and nothing was dropped.
    pub span: Span,
    /// The identifiers in it: within the declaration around the gap, it may have declared them.
    pub names: FxHashSet<Arc<str>>,
    /// The functions, structs and global variables that it may have declared for the rest of the file.
    pub declarations: FxHashSet<Arc<str>>,
    /// Number of declarations in it that lack their name.
    pub nameless: usize,
    /// Number of structs in it that lack their name.
    pub nameless_structs: usize,
}

impl Gap {
    /// Whether the gap lies in a part of the file. An empty gap lies in the parts that it touches.
    pub fn meets(&self, span: Span) -> bool {
        match self.span.start == self.span.end || span.start == span.end {
            true => self.span.start <= span.end && span.start <= self.span.end,
            false => self.overlaps(span),
        }
    }

    /// Whether the gap and a part of the file share text.
    pub fn overlaps(&self, span: Span) -> bool {
        self.span.start < span.end && span.start < self.span.end
    }
}

/// The gaps of a tree.
#[derive(Clone, Debug, Default)]
pub struct Gaps {
    /// In the order in which they were found.
    pub list: Vec<Gap>,
    /// Whether text was lost before parsing, such as an include, so that any name may be declared there.
    pub any_name: bool,
}

impl Gaps {
    /// Whether the tree is whole.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty() && !self.any_name
    }

    /// Whether a gap lies in a part of the file.
    pub fn meet(&self, span: Span) -> bool {
        self.list.iter().any(|gap| gap.meets(span))
    }

    /// Adds a gap that lost no tokens.
    pub(crate) fn add(&mut self, span: Span) {
        self.add_lost(span, &[]);
    }

    /// Adds a gap that lost tokens.
    pub(crate) fn add_lost(&mut self, span: Span, lost: &[Token]) {
        let name = |token: &Token| if let Token::Ident(name) = token { Some(name.clone()) } else { None };
        let names = lost.iter().filter_map(name).collect();
        let is_nameless = |pair: &&[Token]| matches!(pair, [Token::Type(_), next] if !matches!(next, Token::Ident(_) | Token::LParen));
        let nameless = lost.windows(2).filter(is_nameless).count();
        let declared = |three: &[Token]| match three {
            [
                Token::Type(_) | Token::Ident(_) | Token::Struct | Token::Stray,
                Token::Ident(name),
                Token::LParen | Token::LMeta,
            ] => Some(name.clone()),
            // A struct with something else in place of its first word.
            [_, Token::Ident(name), Token::LBrace] => Some(name.clone()),
            _ => None,
        };
        let declarations = lost.windows(3).filter_map(declared).collect();
        let is_struct = |pair: &&[Token]| matches!(pair, [Token::Struct, Token::LBrace]);
        let nameless_structs = lost.windows(2).filter(is_struct).count();
        self.list.push(Gap { span, names, declarations, nameless, nameless_structs });
    }
}
