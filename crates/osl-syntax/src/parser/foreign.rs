//! Constructs of other languages, and brackets in places where another kind is meant: methods, lists in
//! square brackets, loops over ranges, pointers, a brace that closes too much.
//!
//! They come before the other [slips](super::slips), because each of them explains more than a missing token.

use super::Failure;
use super::Stream;
use super::slips::{self, Slip, Slips, insertion};
use crate::ast::{BinaryOp, TypeName};
use crate::brackets::Brackets;
use crate::diagnostic::{Diagnostic, Edit};
use crate::errors;
use crate::layout;
use crate::source::SourceMap;
use crate::span::Span;
use crate::spelling::closest;
use crate::token::Token;

/// Names that stand before the functions of a module or a library.
const MODULES: [&str; 8] = ["math", "Math", "np", "numpy", "glm", "std", "mx", "hou"];

/// Methods of other languages that are functions here, with the value as their first argument.
const METHODS: [&str; 14] = [
    "dot",
    "cross",
    "distance",
    "normalize",
    "reflect",
    "refract",
    "abs",
    "min",
    "max",
    "clamp",
    "pow",
    "mod",
    "floor",
    "concat",
];

/// Methods that ask for a length.
const LENGTHS: [&str; 4] = ["length", "size", "len", "count"];

/// Words that begin a function in other languages.
const FUNCTION_WORDS: [&str; 5] = ["def", "fn", "func", "function", "fun"];

const AS_VALUE: &str = "a value that depends on a condition is `condition ? a : b`";
const COUNTS: &str = "a loop counts: `for (int i = 0; i < 3; i++)`";
const COUNTS_ELEMENTS: &str = "a loop counts the elements: `for (int i = 0; i < arraylength(a); i++)`";
const BEGINS_FUNCTION: &str =
    "a function begins with a type, the type that it returns: `float twice(float x)`";
const NO_POINTERS: &str = "OSL has no pointers and no addresses: the variable itself is passed";
const REFERENCE: &str = "an argument that the function changes is an output: `output float x`";
const NO_ATTRIBUTES: &str = "OSL has no attributes before statements: leave them out";

/// The slip behind a failure, if there is one.
pub(crate) fn find(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Slip> {
    foreign(stream, failure, sources).or_else(|| slips::find(stream, failure, sources))
}

/// The slip behind a failure that no missing token explains, if there is one.
pub(crate) fn beyond_insertion(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Slip> {
    foreign(stream, failure, sources).or_else(|| slips::misspelt(stream, failure, sources))
}

fn foreign(stream: &Stream, failure: &Failure, sources: &SourceMap) -> Option<Slip> {
    let slips = Slips::new(stream, failure, sources);
    let brackets = Brackets::of(&stream.tokens);
    slips
        .extra_brace(&brackets)
        .or_else(|| slips.macro_with_semicolon())
        .or_else(|| slips.method(&brackets))
        .or_else(|| slips.square_list(&brackets))
        .or_else(|| slips.single_brackets(&brackets))
        .or_else(|| slips.untyped_metadata(&brackets))
        .or_else(|| slips.qualifier(&brackets))
        .or_else(|| slips.advice(&brackets))
}

impl Slips<'_> {
    /// A `}` that closes a declaration of the file although more statements follow it, and a later one that
    /// closes nothing. The indentation may say which one is too many.
    fn extra_brace(&self, brackets: &Brackets) -> Option<Slip> {
        let tokens = &self.stream.tokens;
        if brackets.parent(self.at).is_some() {
            return None;
        }
        let before = tokens.get(..self.at)?;
        let close = before.iter().rposition(|token| *token == Token::RBrace)?;
        let rest = tokens.get(self.at + 1..)?;
        let stray = rest
            .iter()
            .zip(self.at + 1..)
            .find(|(token, n)| **token == Token::RBrace && brackets.parent(*n).is_none());
        let (stray, open) = (stray?.1, brackets.parent(close)?);
        if self.at - close > 3 || brackets.parent(open).is_some() {
            return None;
        }
        let name = (0..open).rev().find_map(|n| match self.token(n) {
            Some(Token::Ident(name)) if brackets.parent(n).is_none() => Some(name.clone()),
            _ => None,
        })?;
        let closes_other = |n: &usize| {
            let own = brackets.parent(*n).filter(|_| self.token(*n) == Some(&Token::RBrace))?;
            Some(self.begins_line(*n)? && self.indent(*n)? != self.indent(own)?)
        };
        let extra = (open..close + 1).find(|n| closes_other(n) == Some(true));
        let at = extra.unwrap_or(close);
        let d = errors::extra_brace(self.span(at), &name, self.here(), self.span(stray), extra.is_some());
        Some(Slip { diagnostic: d, remedy: vec![(at..at + 1, Vec::new())], guess: Some(self.span(at)) })
    }

    /// `#define GAIN 2;`, where the name is used within an expression.
    fn macro_with_semicolon(&self) -> Option<Slip> {
        let semicolon = self.at.checked_sub(1).filter(|n| self.token(*n) == Some(&Token::Semi))?;
        let name = self.sources.text(self.span(semicolon));
        let is_name = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let help = "the text of a macro needs no `;`, since it replaces the name within a statement";
        is_name.then(|| {
            let message = format!("the macro `{name}` ends with a `;`");
            self.said(self.span(semicolon), message, "ends the statement here", help)
        })
    }

    /// `N.dot(I)`, `math.sin(u)`.
    fn method(&self, brackets: &Brackets) -> Option<Slip> {
        let (Some(Token::Ident(name)), Some(Token::Dot)) = (self.before(1), self.before(2)) else {
            return None;
        };
        let close = brackets.partner(self.at).filter(|_| self.token(self.at) == Some(&Token::LParen))?;
        let last = self.at.checked_sub(3)?;
        let first = self.path_start(brackets, last);
        self.between(first, self.at)?;
        let (object, empty) = (self.span(first).to(self.span(last)), close == self.at + 1);
        let of_module = first == last
            && matches!(self.token(first), Some(Token::Ident(word)) if MODULES.contains(&&**word));
        let whole = object.to(self.here());
        if LENGTHS.contains(&&**name) && empty && !of_module {
            let help = "`length(v)` is the length of a vector, `arraylength(a)` of an array, `strlen(s)` of a string";
            let slip = self.said(whole, "OSL has no methods".into(), "a method", help);
            return Some(Slip { remedy: vec![(first..close + 1, vec![(Token::BadExpr, whole)])], ..slip });
        }
        let call = (Token::Ident(name.clone()), self.span(self.at - 1));
        let mut tokens = vec![call, (Token::LParen, self.here())];
        let mut text = format!("{name}(");
        if !of_module {
            let object_tokens = self.stream.tokens.get(first..last + 1)?.iter().cloned();
            tokens.extend(object_tokens.zip(self.stream.spans.get(first..last + 1)?.iter().copied()));
            text += self.sources.text(object);
            if !empty {
                tokens.push((Token::Comma, self.here()));
                text += ", ";
            }
        }
        let known = of_module || METHODS.contains(&&**name);
        let d = errors::method(whole, name, of_module, known.then_some(text));
        Some(Slip { diagnostic: d, remedy: vec![(first..self.at + 1, tokens)], guess: None })
    }

    /// The first token of the variable, element or call that ends at a token.
    fn path_start(&self, brackets: &Brackets, last: usize) -> usize {
        let mut at = last;
        loop {
            if matches!(self.token(at), Some(Token::RBracket | Token::RParen)) {
                let Some(opener) = brackets.parent(at) else { return at };
                let called = opener.checked_sub(1).filter(|n| {
                    matches!(self.token(*n), Some(Token::Ident(_) | Token::RBracket | Token::Type(_)))
                });
                match called {
                    Some(before) => at = before,
                    None => return opener,
                }
                continue;
            }
            match at.checked_sub(2).filter(|_| self.token(at - 1) == Some(&Token::Dot)) {
                Some(before) => at = before,
                None => return at,
            }
        }
    }

    /// `float a[3] = [1, 2, 3];`
    fn square_list(&self, brackets: &Brackets) -> Option<Slip> {
        if self.token(self.at) != Some(&Token::LBracket)
            || !matches!(self.before(1), Some(Token::Assign | Token::Return | Token::Comma | Token::LParen))
        {
            return None;
        }
        let close = brackets.partner(self.at)?;
        self.between(self.at, close)?;
        let (open, end) = (self.here(), self.span(close));
        let edit = |span: Span, text: &str| Edit { span, text: text.to_owned() };
        let d = errors::list_in_brackets(open, vec![edit(open, "{"), edit(end, "}")]);
        let remedy = vec![
            (self.at..self.at + 1, vec![(Token::LBrace, open)]),
            (close..close + 1, vec![(Token::RBrace, end)]),
        ];
        Some(Slip { diagnostic: d, remedy, guess: None })
    }

    /// `float k = 2 [ float min = 0 ]`
    fn single_brackets(&self, brackets: &Brackets) -> Option<Slip> {
        let open = self.at.checked_sub(2).filter(|n| self.token(*n) == Some(&Token::LBracket))?;
        let declares = matches!(
            (self.before(1), self.token(self.at), self.token(self.at + 1)),
            (Some(Token::Type(_)), Some(Token::Ident(_)), Some(Token::Assign))
        );
        let close = brackets.partner(open).filter(|_| declares)?;
        let (start, end) = (self.span(open), self.span(close));
        let edits = vec![
            insertion(Span::new(start.end, start.end), "["),
            insertion(Span::new(end.end, end.end), "]"),
        ];
        let d = errors::single_brackets(start, end, edits);
        let remedy = vec![
            (open..open + 1, vec![(Token::LMeta, start)]),
            (close..close + 1, vec![(Token::RBracket, end), (Token::RBracket, end)]),
        ];
        Some(Slip { diagnostic: d, remedy, guess: None })
    }

    /// `[[ min = 0 ]]`
    fn untyped_metadata(&self, brackets: &Brackets) -> Option<Slip> {
        let name = self.at.checked_sub(1)?;
        let Some(Token::Ident(word)) = self.token(name) else { return None };
        if self.token(self.at) != Some(&Token::Assign)
            || !matches!(self.before(2), Some(Token::LMeta | Token::Comma))
        {
            return None;
        }
        let meta = brackets.around(self.at).find(|n| self.token(*n) == Some(&Token::LMeta))?;
        // The type of the parameter, whose bounds have the same.
        let outside = brackets.parent(meta);
        let own = (0..meta).rev().take_while(|n| {
            brackets.parent(*n) != outside || !matches!(self.token(*n), Some(Token::Comma | Token::Semi))
        });
        let mut types = own.filter(|n| brackets.parent(*n) == outside).filter_map(|n| match self.token(n) {
            Some(Token::Type(ty)) => Some(ty.clone()),
            _ => None,
        });
        let ty = match self.token(self.at + 1)? {
            Token::Str(_) => TypeName::String,
            Token::Int(_) if types.any(|ty| ty == TypeName::Int) => TypeName::Int,
            Token::Int(_) | Token::Float(_) | Token::Minus => TypeName::Float,
            _ => return None,
        };
        let at = self.span(name);
        let before = Span::new(at.start, at.start);
        let d = errors::untyped_metadata(at, word, before, crate::print::type_name(&ty));
        Some(Slip { diagnostic: d, remedy: vec![(name..name, vec![(Token::Type(ty), before)])], guess: None })
    }

    /// `out float r`, `ouput float r`, `in float x`.
    fn qualifier(&self, brackets: &Brackets) -> Option<Slip> {
        let at = self.at.checked_sub(1)?;
        let Some(Token::Ident(word)) = self.token(at) else { return None };
        let begins = matches!(self.token(self.at), Some(Token::Type(_)))
            && matches!(self.token(self.at + 1), Some(Token::Ident(_)))
            && matches!(self.before(2), Some(Token::LParen | Token::Comma));
        let opener = brackets.parent(self.at).filter(|_| begins)?;
        if super::recover::stand_in(&self.stream.tokens, opener) != Token::Bad {
            return None;
        }
        let span = self.span(at);
        let (written, tokens) = match &**word {
            "in" => ("", Vec::new()),
            "out" | "inout" => ("output", vec![(Token::Output, span)]),
            word if closest(word, ["output"]).is_some() => ("output", vec![(Token::Output, span)]),
            _ => return None,
        };
        // The space behind the word goes with it.
        let until = if written.is_empty() { self.here().start } else { span.end };
        let edit = Edit { span: Span::new(span.start, until), text: written.to_owned() };
        let d = errors::qualifier(span, word, edit);
        Some(Slip { diagnostic: d, remedy: vec![(at..self.at, tokens)], guess: None })
    }

    /// Constructs without an edit.
    fn advice(&self, brackets: &Brackets) -> Option<Slip> {
        let word = |at: Option<usize>| match at.and_then(|n| self.token(n)) {
            Some(Token::Ident(name)) => &**name,
            _ => "",
        };
        let parent = brackets.parent(self.at);
        let before = |n: Option<usize>, by: usize| n.and_then(|n| n.checked_sub(by));
        let here = self.here();
        let behind_for = self.before(1) == Some(&Token::For);
        let in_for = parent.filter(|n| before(Some(*n), 1).and_then(|n| self.token(n)) == Some(&Token::For));
        let head = if behind_for { Some(self.at) } else { in_for.map(|n| n + 1) };
        let ranges = head.is_some_and(|n| (n..n + 3).any(|n| word(Some(n)) == "in"));
        if ranges {
            return Some(self.said(here, "OSL has no loops over ranges".into(), "not expected here", COUNTS));
        }
        if word(before(parent, 1)) == "foreach" {
            let message = "OSL has no loops over arrays".into();
            return Some(self.said(here, message, "not expected here", COUNTS_ELEMENTS));
        }
        if self.token(self.at) == Some(&Token::If) && self.is_value(brackets) {
            return Some(self.said(here, "an `if` has no value".into(), "stands within a value", AS_VALUE));
        }
        let defines = parent.is_some() && FUNCTION_WORDS.contains(&word(before(parent, 2)));
        let in_formals =
            parent.is_some_and(|n| super::recover::stand_in(&self.stream.tokens, n) == Token::Bad);
        let top = parent.is_none();
        let help = match (self.before(1), self.token(self.at)?) {
            _ if defines => BEGINS_FUNCTION,
            (Some(Token::Type(_)), Token::Amp) if in_formals => REFERENCE,
            (Some(Token::Type(_)), Token::MulOp(BinaryOp::Mul) | Token::Amp) | (_, Token::Amp) => NO_POINTERS,
            (Some(Token::Semi | Token::LBrace | Token::RBrace), Token::LBracket) => NO_ATTRIBUTES,
            (Some(Token::Ident(_)), Token::LParen)
                if top && matches!(self.before(2), None | Some(Token::Semi | Token::RBrace)) =>
            {
                BEGINS_FUNCTION
            }
            _ => return None,
        };
        let d = errors::syntax(here, &self.found(), &super::words::words(&self.failure.expected)).help(help);
        Some(Slip { diagnostic: d, remedy: Vec::new(), guess: None })
    }

    /// Whether an `if` stands where a value is expected, or follows one in its line with an `else`.
    fn is_value(&self, brackets: &Brackets) -> bool {
        match self.before(1) {
            Some(Token::Assign | Token::OpAssign(_) | Token::Return | Token::LParen | Token::Comma) => true,
            Some(Token::Ident(_) | Token::Int(_) | Token::Float(_) | Token::Str(_) | Token::RParen) => {
                let parent = brackets.parent(self.at);
                let own = |n: &usize| brackets.parent(*n) == parent;
                let rest = (self.at + 1..self.stream.tokens.len()).filter(own);
                let mut rest = rest.map_while(|n| self.token(n)).take_while(|token| **token != Token::Semi);
                let tight = self.at.checked_sub(1).and_then(|last| self.between(last, self.at));
                // A block between them belongs to a statement.
                tight.is_some_and(|gap| !gap.contains('\n'))
                    && rest.find(|token| matches!(token, Token::Else | Token::LBrace)) == Some(&Token::Else)
            }
            _ => false,
        }
    }

    fn said(&self, span: Span, message: String, label: &str, help: &str) -> Slip {
        let diagnostic = Diagnostic::error(errors::SYNTAX, span, message).label(label).help(help);
        Slip { diagnostic, remedy: Vec::new(), guess: None }
    }

    /// The indentation of the line of a token.
    fn indent(&self, at: usize) -> Option<&str> {
        let span = self.span(at);
        let file = self.sources.file_at(span.start)?;
        Some(layout::indent(&file.text, (span.start - file.base) as usize))
    }

    fn begins_line(&self, at: usize) -> Option<bool> {
        let span = self.span(at);
        let file = self.sources.file_at(span.start)?;
        Some(layout::begins_line(&file.text, (span.start - file.base) as usize))
    }
}
