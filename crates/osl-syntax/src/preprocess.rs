//! The C preprocessor on tokens: turns files into one stream of preprocessing tokens, each with its location
//! in the source text.
//!
//! Macro expansion follows ISO C, section 6.10.3: arguments are expanded first, the result is scanned again,
//! and a name found during its own expansion is painted, so that it never expands.

mod condition;
mod directive;
mod expand;
mod file;
mod headers;

use crate::Options;
use crate::diagnostic::Sink;
use crate::errors;
use crate::lexer::{Interner, PpToken, Raw, Sym};
use crate::source::{self, SourceMap, SourceProvider};
use crate::span::Span;
use expand::{Context, Macro};
use file::FileCursor;
pub(crate) use file::broken_string;
pub(crate) use headers::names as header_names;
use rustc_hash::{FxHashMap, FxHashSet};
use std::borrow::Cow;
use std::rc::Rc;
use std::sync::Arc;

/// The result of preprocessing.
pub(crate) struct Preprocessed {
    pub(crate) tokens: Vec<PpToken>,
    pub(crate) names: Interner,
    pub(crate) sources: SourceMap,
    pub(crate) diagnostics: Sink,
    /// Lines on which `#pragma osl nowarn` suppresses warnings.
    pub(crate) nowarn: Vec<Span>,
    /// Whether a budget ended the stream early.
    pub(crate) stopped: bool,
}

/// Preprocesses the file `name` with the given text.
pub(crate) fn preprocess(
    name: &str,
    text: &str,
    provider: &dyn SourceProvider,
    options: &Options,
) -> Preprocessed {
    let mut pp = Preprocessor::new(provider, options);
    pp.run(name, text);
    Preprocessed {
        tokens: pp.output,
        names: pp.names,
        sources: pp.sources,
        diagnostics: pp.diagnostics,
        nowarn: pp.nowarn,
        stopped: pp.stopped,
    }
}

/// A file that was read: the location of its text, and whether `#pragma once` guards it.
#[derive(Clone)]
struct CachedFile {
    text: Arc<str>,
    base: u32,
}

/// An `#if` without its `#endif` so far.
struct Conditional {
    opened: Span,
    /// Whether one of its branches was taken.
    taken: bool,
    /// The `#else`, once seen.
    other: Option<Span>,
}

struct Preprocessor<'a> {
    provider: &'a dyn SourceProvider,
    options: &'a Options,
    sources: SourceMap,
    names: Interner,
    diagnostics: Sink,
    nowarn: Vec<Span>,
    output: Vec<PpToken>,
    macros: FxHashMap<Sym, Macro>,
    files: Vec<FileCursor>,
    known: FxHashMap<String, CachedFile>,
    once: FxHashSet<String>,
    n_includes: u64,
    /// Total bytes of all entered files; a file counts each time it is entered.
    n_included: u64,
    /// Bytes of the tokens in the output.
    n_bytes: u64,
    /// Whether the nesting of includes has reached the limit.
    too_deep: bool,
    contexts: Vec<Context>,
    /// Contexts below this index belong to an outer expansion and must not be read.
    floor: usize,
    /// Whether tokens come only from the contexts, not from the files.
    isolated: bool,
    /// Number of tokens that expansion has made so far.
    n_expanded: u64,
    /// Nesting depth of macro calls within arguments of macro calls.
    depth: u64,
    /// Set when a budget is used up; the stream then ends.
    stopped: bool,
    special: Special,
}

/// Names with a special meaning.
struct Special {
    defined: Sym,
    line: Sym,
    file: Sym,
    va_args: Sym,
}

impl<'a> Preprocessor<'a> {
    fn new(provider: &'a dyn SourceProvider, options: &'a Options) -> Self {
        let mut names = Interner::default();
        let special = Special {
            defined: names.intern("defined"),
            line: names.intern("__LINE__"),
            file: names.intern("__FILE__"),
            va_args: names.intern("__VA_ARGS__"),
        };
        Self {
            provider,
            options,
            sources: SourceMap::default(),
            names,
            diagnostics: Sink::new(options.limits.reading.diagnostics),
            nowarn: Vec::new(),
            output: Vec::new(),
            macros: FxHashMap::default(),
            files: Vec::new(),
            known: FxHashMap::default(),
            once: FxHashSet::default(),
            n_includes: 0,
            n_included: 0,
            n_bytes: 0,
            too_deep: false,
            contexts: Vec::new(),
            floor: 0,
            isolated: false,
            n_expanded: 0,
            depth: 0,
            stopped: false,
            special,
        }
    }

    fn run(&mut self, name: &str, text: &str) {
        if text.len() as u64 > self.options.limits.reading.source_bytes {
            self.diagnostics.push(errors::file_too_large(
                Span::default(),
                name,
                self.options.limits.reading.source_bytes,
            ));
            self.stopped = true;
            return;
        }
        let text: Arc<str> = source::with_line_ends(text).into();
        let Some(_) = self.sources.add_about(name, text.clone(), self.provider.about(name)) else {
            self.diagnostics.push(errors::too_large(Span::default(), name));
            return;
        };
        self.known.insert(name.to_owned(), CachedFile { text: text.clone(), base: 0 });
        self.predefine();
        self.files.push(FileCursor::new(name, text, 0));
        self.enter_standard();
        while let Some(token) = self.next_expanded() {
            if self.output.len() as u64 >= self.options.limits.reading.tokens {
                self.diagnostics.push(errors::token_budget(token.span, self.options.limits.reading.tokens));
                self.stopped = true;
                break;
            }
            self.n_bytes += self.names.str(token.sym).len() as u64;
            if self.n_bytes > self.options.limits.reading.token_bytes {
                let limit = self.options.limits.reading.token_bytes;
                self.diagnostics.push(errors::token_bytes(token.span, limit));
                self.stopped = true;
                break;
            }
            self.output.push(token);
        }
    }

    /// Enters the header that is included before the first line of every file: the provider's, else the
    /// compiler's.
    fn enter_standard(&mut self) {
        match self.provider.standard() {
            Some(Ok((name, text))) => self.enter_text(&name, text, Span::default()),
            Some(Err(why)) => {
                let d = errors::include_not_found(Span::default(), headers::STANDARD, &why, (true, None));
                self.diagnostics.push(d);
                return;
            }
            None => {
                self.enter_built_in(headers::STANDARD, Span::default());
            }
        }
        // It repeats what the compiler knows, so its warnings are suppressed.
        self.nowarn.extend(self.files.last().map(|file| file.span(0, file.text.len())));
    }

    /// Enters a header that comes with the compiler, unless `#pragma once` prevents it. Returns whether the
    /// header exists.
    fn enter_built_in(&mut self, name: &str, at: Span) -> bool {
        let Some(text) = headers::text(name) else { return false };
        if !self.once.contains(name) {
            self.enter_text(name, text.into(), at);
        }
        true
    }

    /// Defines the version macros and the macros from the options, in a separate file before the main one.
    fn predefine(&mut self) {
        let version = self.options.version;
        let [major, minor, patch] = version.numbers();
        let mut text = format!(
            "#define OSL_VERSION_MAJOR {major}\n#define OSL_VERSION_MINOR {minor}\n#define OSL_VERSION_PATCH {patch}\n\
             #define OSL_VERSION {}\n",
            version.number()
        );
        for (name, value) in &self.options.defines {
            // A line break would start another directive.
            let value = value.replace(['\n', '\r'], " ");
            text.push_str(&format!("#define {} {value}\n", name.replace(['\n', '\r'], " ")));
        }
        self.enter_text("<command line>", text.into(), Span::default());
        while self.next_expanded().is_some() {}
    }

    /// Continues with the text of a file; `at` is the location of the include.
    fn enter_text(&mut self, name: &str, text: Arc<str>, at: Span) {
        self.n_included += text.len() as u64;
        if self.n_included > self.options.limits.reading.included_bytes {
            self.diagnostics.push(errors::included_bytes(at, self.options.limits.reading.included_bytes));
            self.stopped = true;
            return;
        }
        let known = match self.known.get(name) {
            Some(known) => known.clone(),
            None => {
                if text.len() as u64 > self.options.limits.reading.source_bytes {
                    self.diagnostics.push(errors::file_too_large(
                        at,
                        name,
                        self.options.limits.reading.source_bytes,
                    ));
                    return;
                }
                let text = match source::with_line_ends(&text) {
                    Cow::Borrowed(_) => text,
                    Cow::Owned(text) => text.into(),
                };
                if self.sources.add_about(name, text.clone(), self.provider.about(name)).is_none() {
                    self.diagnostics.push(errors::too_large(at, name));
                    return;
                }
                let base = self.sources.files().last().map_or(0, |f| f.base);
                let known = CachedFile { text, base };
                self.known.insert(name.to_owned(), known.clone());
                known
            }
        };
        self.files.push(FileCursor::new(name, known.text, known.base));
    }

    /// The next token with macros expanded; `None` at the end of the input.
    fn next_expanded(&mut self) -> Option<PpToken> {
        while !self.stopped {
            let token = self.next_token()?;
            if token.kind == Raw::Ident && !token.painted {
                match self.try_expand(token) {
                    expand::Outcome::Plain(token) => return Some(token),
                    expand::Outcome::Pushed => continue,
                }
            }
            return Some(token);
        }
        None
    }

    /// The next token without expansion: from the innermost expansion, else from the files, where directives
    /// are executed on the way.
    fn next_token(&mut self) -> Option<PpToken> {
        loop {
            if self.stopped {
                return None;
            }
            if self.contexts.len() > self.floor {
                if let Some(token) = self.contexts.last_mut().and_then(Context::next) {
                    return Some(token);
                }
                self.pop_context();
                continue;
            }
            if self.isolated {
                return None;
            }
            let Some(token) = self.next_of_file() else {
                if self.files.len() > 1 {
                    self.leave_file();
                    continue;
                }
                self.leave_file();
                return None;
            };
            if token.kind == Raw::Hash && token.line_start {
                self.directive(token);
                continue;
            }
            return Some(token);
        }
    }

    /// The line, from 1, of an offset in the current file; the first line for an earlier offset.
    fn line_of(&self, offset: u32) -> u32 {
        let base = self.files.last().map_or(0, |file| file.base);
        let file = self.sources.file_at(base);
        file.map_or(1, |file| file.line_at((offset.saturating_sub(base) as usize).min(file.text.len())))
    }

    fn leave_file(&mut self) {
        let Some(file) = self.files.pop() else { return };
        let end = file.here();
        for open in file.conditionals {
            self.diagnostics.push(errors::unterminated_conditional(open.opened, end));
        }
    }

    fn pop_context(&mut self) {
        let Some(context) = self.contexts.pop() else { return };
        if let Some(name) = context.name
            && let Some(m) = self.macros.get_mut(&name)
        {
            m.active = m.active.saturating_sub(1);
        }
    }

    fn push_context(&mut self, tokens: Rc<[PpToken]>, name: Option<Sym>) {
        if let Some(name) = name
            && let Some(m) = self.macros.get_mut(&name)
        {
            m.active += 1;
        }
        self.contexts.push(Context { tokens, at: 0, name });
    }
}
