//! Macro expansion.

use super::Preprocessor;
use crate::errors;
use crate::lexer::{PpToken, Raw, Sym, scan};
use crate::span::Span;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// Bytes that `#` and `##` may make per token of the budget.
const BYTES_A_TOKEN: usize = 16;

/// A macro.
#[derive(Clone)]
pub(super) struct Macro {
    /// Parameters; `None` for an object-like macro.
    pub(super) params: Option<Rc<Params>>,
    /// Whether the last parameter takes all remaining arguments.
    pub(super) variadic: bool,
    pub(super) body: Rc<[PpToken]>,
    /// The location of its name in the definition.
    pub(super) span: Span,
    /// Number of its expansions in progress; while there is one, its name does not expand.
    pub(super) active: u32,
}

/// The parameters of a macro: their names with their indices, the first index for a repeated name. A macro
/// may have as many parameters as its line holds.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Params {
    places: FxHashMap<Sym, usize>,
    count: usize,
}

impl Params {
    pub(super) fn push(&mut self, name: Sym) {
        self.places.entry(name).or_insert(self.count);
        self.count += 1;
    }

    pub(super) fn place(&self, name: Sym) -> Option<usize> {
        self.places.get(&name).copied()
    }
}

/// Tokens that expansion has placed before the rest of the input.
pub(super) struct Context {
    pub(super) tokens: Rc<[PpToken]>,
    pub(super) at: usize,
    /// The macro from which they come.
    pub(super) name: Option<Sym>,
}

impl Context {
    pub(super) fn next(&mut self) -> Option<PpToken> {
        let token = self.tokens.get(self.at).copied();
        self.at += 1;
        token
    }
}

/// The result of examining a name.
pub(super) enum Outcome {
    /// It is not a macro call: the token itself.
    Plain(PpToken),
    /// Its expansion was placed before the rest of the input.
    Pushed,
}

/// The arguments of a call, as written.
struct Call {
    args: Vec<Vec<PpToken>>,
    span: Span,
}

impl Preprocessor<'_> {
    pub(super) fn try_expand(&mut self, token: PpToken) -> Outcome {
        if let Some(text) = self.dynamic_macro(token) {
            return Outcome::Plain(text);
        }
        let Some(found) = self.macros.get(&token.sym) else { return Outcome::Plain(token) };
        if found.active > 0 {
            return Outcome::Plain(PpToken { painted: true, ..token });
        }
        let found = found.clone();
        let tokens = match &found.params {
            None => self.substitute(&found, &[], token.span),
            Some(params) => {
                let Some(open) = self.next_token() else { return Outcome::Plain(token) };
                if open.kind != Raw::LParen {
                    self.push_context(Rc::new([open]), None);
                    return Outcome::Plain(token);
                }
                let Some(call) = self.arguments(token, open, params.count, found.variadic) else {
                    return Outcome::Plain(token);
                };
                let Some(args) = self.check_arguments(token, call.args, &found, call.span) else {
                    return Outcome::Pushed;
                };
                self.substitute(&found, &args, call.span)
            }
        };
        if self.charge(tokens.len(), token.span) {
            let mut tokens = tokens;
            if let Some(first) = tokens.first_mut() {
                first.space |= token.space;
            }
            self.push_context(tokens.into(), Some(token.sym));
        }
        Outcome::Pushed
    }

    /// Counts tokens that expansion makes; false when there are too many.
    fn charge(&mut self, n: usize, span: Span) -> bool {
        self.n_expanded += n as u64 + 1;
        if self.n_expanded > self.options.limits.reading.expansion {
            if !self.stopped {
                self.diagnostics.push(errors::expansion_budget(span, self.options.limits.reading.expansion));
            }
            self.stopped = true;
            return false;
        }
        true
    }

    /// `__LINE__` and `__FILE__`.
    fn dynamic_macro(&mut self, token: PpToken) -> Option<PpToken> {
        let (kind, text) = if token.sym == self.special.line {
            let line = i64::from(self.line_of(token.span.start)) + self.files.last()?.line_shift;
            (Raw::Number, line.to_string())
        } else if token.sym == self.special.file {
            let file = self.files.last()?;
            (Raw::Str, quote(file.line_file.as_deref().unwrap_or(&file.name)))
        } else {
            return None;
        };
        // A name from `#line` may be long and used often.
        self.charge(text.len() / BYTES_A_TOKEN, token.span);
        let sym = self.names.intern(&text);
        Some(PpToken { kind, sym, ..token })
    }

    /// Reads the arguments after `(`; `None`, with a message, if they never end.
    fn arguments(&mut self, name: PpToken, open: PpToken, n_params: usize, variadic: bool) -> Option<Call> {
        let mut args = vec![Vec::new()];
        let mut depth = 0usize;
        loop {
            let Some(token) = self.next_token() else {
                if !self.stopped {
                    let span = name.span.to(open.span);
                    self.diagnostics.push(errors::unterminated_invocation(span, self.names.str(name.sym)));
                }
                return None;
            };
            match token.kind {
                Raw::RParen if depth == 0 => return Some(Call { args, span: name.span.to(token.span) }),
                Raw::Comma if depth == 0 && !(variadic && args.len() >= n_params) => {
                    args.push(Vec::new());
                    continue;
                }
                Raw::LParen => depth += 1,
                Raw::RParen => depth -= 1,
                _ => {}
            }
            if let Some(last) = args.last_mut() {
                last.push(token);
            }
        }
    }

    /// Matches the number of arguments to the parameters; `None`, with a message, if that is impossible.
    fn check_arguments(
        &mut self,
        name: PpToken,
        mut args: Vec<Vec<PpToken>>,
        found: &Macro,
        span: Span,
    ) -> Option<Vec<Vec<PpToken>>> {
        let wanted = found.params.as_ref().map_or(0, |p| p.count);
        if wanted == 0 && args.iter().all(Vec::is_empty) && args.len() == 1 {
            args.clear();
        }
        if found.variadic && args.len() + 1 == wanted {
            args.push(Vec::new());
        }
        if args.len() == wanted {
            return Some(args);
        }
        let least = wanted - usize::from(found.variadic);
        let plural = if least == 1 { "" } else { "s" };
        let text = match found.variadic {
            true => format!("at least {least} argument{plural}"),
            false => format!("{least} argument{plural}"),
        };
        let d = errors::macro_arguments(span, self.names.str(name.sym), &text, args.len(), found.span);
        self.diagnostics.push(d);
        None
    }

    /// The body of a macro with its arguments substituted. Tokens of the body get the location of the call.
    fn substitute(&mut self, found: &Macro, args: &[Vec<PpToken>], call: Span) -> Vec<PpToken> {
        let param = |t: &PpToken| {
            found.params.as_ref().filter(|_| t.kind == Raw::Ident).and_then(|params| params.place(t.sym))
        };
        let mut expanded: Vec<Option<Rc<[PpToken]>>> = vec![None; args.len()];
        let mut out: Vec<PpToken> = Vec::with_capacity(found.body.len());
        let mut paste = false;
        let mut at = 0;
        while let Some(token) = found.body.get(at).copied() {
            if self.stopped {
                return Vec::new();
            }
            at += 1;
            let here = PpToken { span: call, line_start: false, ..token };
            if token.kind == Raw::Hash
                && found.params.is_some()
                && let Some(n) = found.body.get(at).and_then(param)
            {
                at += 1;
                let text = self.stringify(args.get(n).map_or(&[], |a| a));
                self.append(&mut out, &mut paste, &[PpToken { kind: Raw::Str, sym: text, ..here }]);
                continue;
            }
            if token.kind == Raw::HashHash {
                paste = true;
                continue;
            }
            let Some(n) = param(&token) else {
                self.append(&mut out, &mut paste, &[here]);
                continue;
            };
            let arg = args.get(n).map_or(&[][..], |a| a);
            let pasted = paste || found.body.get(at).is_some_and(|t| t.kind == Raw::HashHash);
            let tokens: Rc<[PpToken]> = if pasted {
                match arg {
                    [] => Rc::new([PpToken { kind: Raw::Placemarker, sym: Sym::EMPTY, ..here }]),
                    arg => arg.into(),
                }
            } else if let Some(Some(done)) = expanded.get(n) {
                done.clone()
            } else {
                let done: Rc<[PpToken]> = self.expand_alone(arg).into();
                if let Some(slot) = expanded.get_mut(n) {
                    *slot = Some(done.clone());
                }
                done
            };
            if !self.charge(tokens.len(), call) {
                return Vec::new();
            }
            let from = out.len();
            self.append(&mut out, &mut paste, &tokens);
            if let Some(first) = out.get_mut(from) {
                first.space = token.space;
            }
        }
        out.retain(|t| t.kind != Raw::Placemarker);
        out
    }

    /// Appends tokens; the first is glued to the previous token if there is a `##` between them.
    fn append(&mut self, out: &mut Vec<PpToken>, paste: &mut bool, tokens: &[PpToken]) {
        let mut tokens = tokens;
        if std::mem::take(paste)
            && let (Some(left), Some((right, rest))) = (out.pop(), tokens.split_first())
        {
            let glued = self.glue(left, *right);
            out.extend(glued);
            tokens = rest;
        }
        out.extend_from_slice(tokens);
    }

    fn glue(&mut self, left: PpToken, right: PpToken) -> Vec<PpToken> {
        if right.kind == Raw::Placemarker {
            return vec![left];
        }
        if left.kind == Raw::Placemarker {
            return vec![right];
        }
        let text = format!("{}{}", self.names.str(left.sym), self.names.str(right.sym));
        if !self.charge(text.len() / BYTES_A_TOKEN, left.span) {
            return Vec::new();
        }
        match scan(&text, 0) {
            Some((kind, end))
                if end == text.len()
                    && !matches!(kind, Raw::LineComment | Raw::BlockComment | Raw::OpenStr | Raw::Space) =>
            {
                let sym = self.names.intern(&text);
                vec![PpToken { kind, sym, span: left.span.to(right.span), ..left }]
            }
            _ => {
                let d = errors::bad_paste(
                    left.span.to(right.span),
                    self.names.str(left.sym),
                    self.names.str(right.sym),
                );
                self.diagnostics.push(d);
                vec![left, right]
            }
        }
    }

    /// `#` applied to an argument: its spelling as a string literal, with each run of white space as one
    /// space.
    fn stringify(&mut self, arg: &[PpToken]) -> Sym {
        let mut text = String::from("\"");
        for (n, token) in arg.iter().enumerate() {
            if n > 0 && token.space {
                text.push(' ');
            }
            let spelling = self.names.str(token.sym);
            if matches!(token.kind, Raw::Str | Raw::Char) {
                text.push_str(&spelling.replace('\\', "\\\\").replace('"', "\\\""));
            } else {
                text.push_str(spelling);
            }
        }
        text.push('"');
        let span = arg.first().map_or(Span::default(), |t| t.span);
        if !self.charge(text.len() / BYTES_A_TOKEN, span) {
            return Sym::EMPTY;
        }
        self.names.intern(&text)
    }

    /// Expands tokens as if they were the whole input.
    pub(super) fn expand_alone(&mut self, tokens: &[PpToken]) -> Vec<PpToken> {
        if tokens.iter().all(|t| t.kind != Raw::Ident) {
            return tokens.to_vec();
        }
        if self.depth >= self.options.limits.reading.nesting {
            if let Some(t) = tokens.first()
                && !self.stopped
            {
                self.diagnostics.push(errors::expansion_depth(t.span, self.options.limits.reading.nesting));
            }
            self.stopped = true;
            return Vec::new();
        }
        let floor = std::mem::replace(&mut self.floor, self.contexts.len());
        let isolated = std::mem::replace(&mut self.isolated, true);
        self.depth += 1;
        self.push_context(tokens.into(), None);
        let mut out = Vec::new();
        while let Some(token) = self.next_expanded() {
            out.push(token);
        }
        while self.contexts.len() > self.floor {
            self.pop_context();
        }
        self.depth -= 1;
        self.floor = floor;
        self.isolated = isolated;
        out
    }
}

/// A string literal of the text.
fn quote(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
