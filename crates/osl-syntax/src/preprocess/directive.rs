//! Directives: the lines that begin with `#`.

use super::expand::{Macro, Params};
use super::{Conditional, Preprocessor, headers};
use crate::errors;
use crate::lexer::{PpToken, Raw, Sym};
use crate::span::Span;
use crate::spelling::closest;
use std::rc::Rc;

impl Preprocessor<'_> {
    /// Executes the directive whose `#` has been read.
    pub(super) fn directive(&mut self, hash: PpToken) {
        let line = self.rest_of_line();
        let Some((head, rest)) = line.split_first() else { return };
        let name = self.names.text(head.sym);
        let span = hash.span.to(head.span);
        match &*name {
            "include" => self.include(*head, rest),
            "define" => self.define(*head, rest),
            "undef" => match rest {
                [n] if n.kind == Raw::Ident => {
                    self.macros.remove(&n.sym);
                }
                _ => self.malformed(span, "undef", "NAME"),
            },
            "if" => {
                let taken = self.condition(head.span, rest);
                self.open_conditional(span, taken);
            }
            "ifdef" | "ifndef" => match rest {
                [n] if n.kind == Raw::Ident => {
                    let taken = self.is_defined(n.sym) == (&*name == "ifdef");
                    self.open_conditional(span, taken);
                }
                _ => {
                    self.malformed(span, &name, "NAME");
                    self.open_conditional(span, false);
                }
            },
            // The current branch ends here, and later branches are never read.
            "elif" | "else" => {
                if self.check_open(&name, span) {
                    self.skip();
                }
            }
            "endif" => {
                if self.check_endif(span)
                    && let Some(file) = self.files.last_mut()
                {
                    file.conditionals.pop();
                }
            }
            "error" => {
                let text = self.spell(rest);
                self.diagnostics.push(errors::error_directive(span, &text));
            }
            "warning" => {
                let text = self.spell(rest);
                self.diagnostics.push(errors::warning_directive(self.options.strict, span, &text));
            }
            "line" => self.line_directive(span, rest),
            "pragma" => self.pragma(span, rest),
            _ => {
                let comment = head.space && rest.first().is_some_and(|word| word.kind == Raw::Ident);
                self.diagnostics.push(errors::unknown_directive(span, &name, comment.then_some(hash.span)));
            }
        }
    }

    fn malformed(&mut self, span: Span, directive: &str, form: &str) {
        self.diagnostics.push(errors::bad_directive(span, directive, form));
    }

    /// The spelling of a line, for messages.
    fn spell(&self, tokens: &[PpToken]) -> String {
        let mut text = String::new();
        for (n, token) in tokens.iter().enumerate() {
            if n > 0 && token.space {
                text.push(' ');
            }
            text.push_str(self.names.str(token.sym));
        }
        text
    }

    pub(super) fn is_defined(&self, name: Sym) -> bool {
        self.macros.contains_key(&name) || name == self.special.line || name == self.special.file
    }

    fn include(&mut self, head: PpToken, rest: &[PpToken]) {
        let expanded;
        let mut tokens = rest;
        if tokens.first().is_some_and(|t| t.kind == Raw::Ident) {
            expanded = self.expand_alone(rest);
            tokens = &expanded;
        }
        let (name, quoted) = match tokens {
            [t] if t.kind == Raw::Str => {
                let text = self.names.str(t.sym);
                (text.trim_matches('"').to_owned(), true)
            }
            [open, inner @ .., close] if open.kind == Raw::Lt && close.kind == Raw::Gt => {
                (self.spell(inner), false)
            }
            _ => return self.malformed(head.span, "include", "\"file\"` or `#include <file>"),
        };
        let first = tokens.first().map_or(head.span, |t| t.span);
        let span = tokens.iter().fold(first, |s, t| s.to(t.span));
        self.include_file(&name, quoted, span);
    }

    fn include_file(&mut self, name: &str, quoted: bool, span: Span) {
        if self.files.len() as u64 >= self.options.limits.reading.include_depth {
            // Reported once: files that include themselves twice would repeat it endlessly.
            if !std::mem::replace(&mut self.too_deep, true) {
                self.diagnostics.push(errors::include_depth(
                    span,
                    name,
                    self.options.limits.reading.include_depth,
                ));
            }
            return;
        }
        self.n_includes += 1;
        if self.n_includes > self.options.limits.reading.includes {
            self.diagnostics.push(errors::include_count(span, self.options.limits.reading.includes));
            self.stopped = true;
            return;
        }
        let from = self.files.last().map_or(String::new(), |f| f.name.clone());
        match self.provider.include(name, quoted, &from) {
            Ok((name, _)) if self.once.contains(&name) => {}
            Ok((name, text)) => self.enter_text(&name, text, span),
            Err(_) if self.enter_built_in(name, span) => {}
            Err(reason) => {
                let beside = self.provider.names(&from);
                let mut names: Vec<&str> = headers::names().collect();
                names.extend(beside.iter().map(String::as_str));
                let close = closest(name, names);
                self.diagnostics.push(errors::include_not_found(span, name, &reason, (quoted, close)));
            }
        }
    }

    fn define(&mut self, head: PpToken, rest: &[PpToken]) {
        let Some((name, rest)) = rest.split_first().filter(|(n, _)| n.kind == Raw::Ident) else {
            return self.diagnostics.push(errors::bad_define(head.span, "a name must follow"));
        };
        if name.sym == self.special.defined || name.sym == self.special.va_args {
            let text = format!("`{}` cannot be a macro", self.names.str(name.sym));
            return self.diagnostics.push(errors::bad_define(name.span, &text));
        }
        let mut made = Macro { params: None, variadic: false, body: rest.into(), span: name.span, active: 0 };
        if let Some(open) = rest.first()
            && open.kind == Raw::LParen
            && !open.space
        {
            let Some((params, variadic, n)) = self.parameters(rest) else {
                return self
                    .diagnostics
                    .push(errors::bad_define(open.span, "its parameters are not a list of names"));
            };
            made = Macro {
                params: Some(params),
                variadic,
                body: rest.get(n..).unwrap_or_default().into(),
                ..made
            };
        }
        if let Some(why) = self.body_fault(&made) {
            return self.diagnostics.push(errors::bad_define(name.span, why));
        }
        if let Some(old) = self.macros.get(&name.sym) {
            if !same(old, &made) {
                let first = old.span;
                let text = self.names.text(name.sym);
                self.diagnostics.push(errors::macro_redefined(self.options.strict, name.span, &text, first));
            }
            // Current expansions of the old body continue to guard the name.
            made.active = old.active;
        }
        self.macros.insert(name.sym, made);
    }

    /// The parameters of `(a, b, ...)`, whether the last one takes all remaining arguments, and the number of
    /// tokens in the list.
    fn parameters(&self, tokens: &[PpToken]) -> Option<(Rc<Params>, bool, usize)> {
        let mut params = Params::default();
        let mut at = 1;
        if tokens.get(at)?.kind == Raw::RParen {
            return Some((Rc::new(params), false, 2));
        }
        loop {
            let token = tokens.get(at)?;
            let next = tokens.get(at + 1)?;
            match (token.kind, next.kind) {
                (Raw::Ellipsis, Raw::RParen) => {
                    params.push(self.special.va_args);
                    return Some((Rc::new(params), true, at + 2));
                }
                (Raw::Ident, Raw::RParen | Raw::Comma) if params.place(token.sym).is_none() => {
                    params.push(token.sym)
                }
                (Raw::Ident, Raw::Ellipsis) if tokens.get(at + 2)?.kind == Raw::RParen => {
                    params.push(token.sym);
                    return Some((Rc::new(params), true, at + 3));
                }
                _ => return None,
            }
            if next.kind == Raw::RParen {
                return Some((Rc::new(params), false, at + 2));
            }
            at += 2;
        }
    }

    fn body_fault(&self, made: &Macro) -> Option<&'static str> {
        let ends = [made.body.first(), made.body.last()];
        if ends.iter().flatten().any(|t| t.kind == Raw::HashHash) {
            return Some("`##` needs a token on either side");
        }
        let params = made.params.as_ref()?;
        let hash = |w: &[PpToken]| w.first().is_some_and(|t| t.kind == Raw::Hash);
        let lone =
            made.body.windows(2).any(|w| hash(w) && w.get(1).is_none_or(|t| params.place(t.sym).is_none()));
        (lone || made.body.last().is_some_and(|t| t.kind == Raw::Hash))
            .then_some("`#` needs a parameter behind it")
    }

    fn open_conditional(&mut self, opened: Span, taken: bool) {
        let Some(file) = self.files.last_mut() else { return };
        file.conditionals.push(Conditional { opened, taken, other: None });
        if !taken {
            self.skip();
        }
    }

    /// Checks that `#else` or `#elif` continues a conditional, and records an `#else`.
    fn check_open(&mut self, name: &str, span: Span) -> bool {
        let open = self.files.last_mut().and_then(|f| f.conditionals.last_mut());
        let other = match open {
            Some(Conditional { other: None, .. }) => {
                if let (Some(open), "else") = (open, name) {
                    open.other = Some(span);
                }
                return true;
            }
            Some(open) => open.other,
            None => None,
        };
        self.diagnostics.push(errors::unbalanced_conditional(span, name, other));
        // After a second `#else` nothing is read; without any `#if` everything is.
        other.is_some()
    }

    fn check_endif(&mut self, span: Span) -> bool {
        if self.files.last().is_some_and(|f| !f.conditionals.is_empty()) {
            return true;
        }
        self.diagnostics.push(errors::unbalanced_conditional(span, "endif", None));
        false
    }

    /// Skips text up to the next branch to read, or past the `#endif`.
    fn skip(&mut self) {
        let mut inner = 0usize;
        while let Some(hash) = self.skip_to_directive() {
            let Some((word, text)) = self.peek_word() else { continue };
            let span = hash.span.to(word);
            match text.as_str() {
                "if" | "ifdef" | "ifndef" => inner += 1,
                "endif" if inner > 0 => inner -= 1,
                "endif" => {
                    self.rest_of_line();
                    if let Some(file) = self.files.last_mut() {
                        file.conditionals.pop();
                    }
                    return;
                }
                "else" | "elif" if inner == 0 => {
                    if !self.check_open(&text, span) {
                        continue;
                    }
                    let taken = self.files.last().and_then(|f| f.conditionals.last()).is_none_or(|c| c.taken);
                    if taken {
                        continue;
                    }
                    let line = self.rest_of_line();
                    let yes = text == "else"
                        || line.split_first().is_some_and(|(h, rest)| self.condition(h.span, rest));
                    if yes {
                        if let Some(open) = self.files.last_mut().and_then(|f| f.conditionals.last_mut()) {
                            open.taken = true;
                        }
                        return;
                    }
                }
                _ => {}
            }
        }
    }

    /// The word after the last `#`, without consuming it.
    fn peek_word(&self) -> Option<(Span, String)> {
        let file = self.files.last()?;
        let mut at = file.at;
        while let Some((kind, to)) = crate::lexer::scan(&file.text, at) {
            match kind {
                Raw::Space | Raw::BlockComment => at = to,
                Raw::Ident => return Some((file.span(at, to), file.text.get(at..to)?.to_owned())),
                _ => return None,
            }
        }
        None
    }

    fn line_directive(&mut self, span: Span, rest: &[PpToken]) {
        let tokens = self.expand_alone(rest);
        let line = tokens.first().and_then(|t| self.names.str(t.sym).parse::<u32>().ok());
        let name = match tokens.get(1..).unwrap_or_default() {
            [] => None,
            [t] if t.kind == Raw::Str => Some(crate::token::unescape(self.names.str(t.sym)).into()),
            _ => return self.malformed(span, "line", "NUMBER \"file\""),
        };
        let Some(line) = line else { return self.malformed(span, "line", "NUMBER \"file\"") };
        let here = self.line_of(span.start);
        let Some(file) = self.files.last_mut() else { return };
        file.line_shift = i64::from(line) - i64::from(here) - 1;
        file.line_file = name.or(file.line_file.take());
    }

    fn pragma(&mut self, span: Span, rest: &[PpToken]) {
        let words: Vec<_> = rest.iter().take(2).map(|t| self.names.text(t.sym)).collect();
        let words: Vec<&str> = words.iter().map(|w| &**w).collect();
        let text =
            |s: &Self| rest.get(1).map_or(String::new(), |t| crate::token::unescape(s.names.str(t.sym)));
        match words.as_slice() {
            ["once", ..] => {
                if let Some(file) = self.files.last() {
                    self.once.insert(file.name.clone());
                }
            }
            ["osl", "nowarn", ..] => {
                let Some(file) = self.files.last() else { return };
                let len = file
                    .text
                    .get(file.at..)
                    .and_then(|t| t.find('\n'))
                    .map_or(file.text.len() - file.at, |n| n + 1);
                self.nowarn.push(file.span(file.at, file.at + len));
            }
            ["osl", other @ ..] => {
                let d = errors::unknown_osl_pragma(span, other.first().unwrap_or(&""));
                self.diagnostics.push(d);
            }
            ["error", ..] => {
                let d = errors::pragma_error(span, &text(self));
                self.diagnostics.push(d);
            }
            ["warning", ..] => {
                let d = errors::pragma_warning(span, &text(self));
                self.diagnostics.push(d);
            }
            _ => {}
        }
    }
}

/// Whether two definitions are equal: parameters, spellings and the positions of white space.
fn same(a: &Macro, b: &Macro) -> bool {
    let body = |m: &Macro| {
        m.body.iter().enumerate().map(|(n, t)| (t.kind, t.sym, n > 0 && t.space)).collect::<Vec<_>>()
    };
    a.params == b.params && a.variadic == b.variadic && body(a) == body(b)
}
