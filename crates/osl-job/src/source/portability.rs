//! Which renderers run a file, as far as their dialects tell: what each lacks of what the file uses, by line.

use super::input::Input;
use osl::stages;
use osl_dialects::{Dialect, Dialects, NONE};
use osl_hir::builtins::{self, FAMILIES};
use osl_hir::hir;
use osl_syntax::ast::ShaderKind;
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use osl_syntax::token::Token;
use std::collections::BTreeSet;
use std::path::Path;

/// What differs in one renderer.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Difference {
    /// The line, from 1; 0 for the whole file.
    pub line: u32,
    /// What it is.
    pub what: String,
    /// Why it differs there.
    pub why: String,
}

/// A renderer, and what differs there.
#[derive(Clone, Debug)]
pub struct Portability {
    /// The name of its dialect.
    pub name: String,
    /// The renderer.
    pub title: String,
    /// In the order of lines; empty if nothing is known to differ.
    pub differences: Vec<Difference>,
}

/// What a file uses, each with its line.
#[derive(Default)]
struct Uses {
    /// Called functions and closures.
    calls: Vec<(u32, String)>,
    /// Other words.
    words: Vec<(u32, String)>,
    /// Functions, closures and macros of the file's own dialect.
    own: Vec<(u32, String)>,
    /// Kinds of noise.
    noises: Vec<(u32, String)>,
    /// Objects and names of attributes, if they are literals.
    attributes: Vec<(u32, String, String)>,
    /// Included headers that are no files of the user.
    headers: Vec<(u32, String)>,
    /// The first `#include`.
    include: Option<u32>,
    /// Kinds of parameters.
    parameters: Vec<(u32, &'static str, String)>,
    kind: &'static str,
}

/// Compares what a file uses with each renderer.
pub fn compare(input: &Input, program: &hir::Program, dialects: &Dialects) -> Vec<Portability> {
    let options = osl_syntax::Options { keep_tokens: true, ..input.options.clone() };
    let parsed = osl_syntax::parse(&input.name, &input.text, &input.files, &options);
    let mut uses = Uses::of(&parsed.tokens, &parsed.sources, &input.text, program);
    let own = input.files.spoken().map(|spoken| spoken.dialect);
    uses.own = of_dialect(&input.text, own.as_deref());
    let others = dialects.list().iter().filter(|dialect| dialect.name != NONE);
    others
        .map(|dialect| Portability {
            name: dialect.name.clone(),
            title: dialect.names.title.clone(),
            differences: uses.differences(dialect, own.as_deref()),
        })
        .collect()
}

/// The words of a text that its dialect declares, and neither the language nor the text itself.
fn of_dialect(text: &str, own: Option<&Dialect>) -> Vec<(u32, String)> {
    let Some(own) = own else { return Vec::new() };
    let (theirs, mine) = (own.declared(), osl_dialects::declared(text));
    let is_theirs =
        |word: &str| theirs.contains(word) && !mine.contains(word) && builtins::find(word).is_none();
    let words = osl_dialects::words_of(text).filter(|(_, word)| is_theirs(word));
    words.map(|(line, word)| (line, word.to_string())).collect()
}

/// Whether a name is that of a standard closure.
fn is_closure(name: &str) -> bool {
    let closures = FAMILIES.iter().filter(|family| family.title == "Closures");
    closures.flat_map(|family| family.rows).any(|row| row.name == name)
}

impl Uses {
    fn of(tokens: &[(Token, Span)], sources: &SourceMap, text: &str, program: &hir::Program) -> Uses {
        let mut uses = Uses { kind: kind(program), ..Uses::default() };
        // Headers of dialects and the standard header are no files on the disk.
        let line = |span: Span| {
            let (file, line) = sources.line(span)?;
            let is_main = sources.files().first().is_some_and(|main| main.name == file.name);
            (is_main || Path::new(&file.name).is_file()).then_some(line)
        };
        let token = |at: usize| tokens.get(at).map(|(token, _)| token);
        for (at, (this, span)) in tokens.iter().enumerate() {
            let (Token::Ident(name), Some(line)) = (this, line(*span)) else { continue };
            if token(at + 1) != Some(&Token::LParen) {
                uses.words.push((line, name.to_string()));
                continue;
            }
            let first = token(at + 2).and_then(text_of);
            match (&**name, first, token(at + 4).and_then(text_of)) {
                ("noise" | "pnoise", Some(kind), _) => uses.noises.push((line, kind.to_string())),
                ("getattribute", Some(object), Some(name)) => {
                    uses.attributes.push((line, object.to_string(), name.to_string()));
                }
                ("getattribute", Some(name), _) => {
                    uses.attributes.push((line, String::new(), name.to_string()))
                }
                _ => {}
            }
            uses.calls.push((line, name.to_string()));
        }
        for (at, written) in text.lines().enumerate() {
            let Some(rest) = written.trim_start().strip_prefix('#') else { continue };
            let Some(rest) = rest.trim_start().strip_prefix("include") else { continue };
            uses.include.get_or_insert(at as u32 + 1);
            let name =
                rest.trim().trim_start_matches(['"', '<']).split(['"', '>']).next().unwrap_or_default();
            let is_known = |file: &osl_syntax::source::SourceFile| {
                file.name == name || (Path::new(&file.name).is_file() && file.name.ends_with(name))
            };
            if !sources.files().iter().any(is_known) {
                uses.headers.push((at as u32 + 1, name.to_string()));
            }
        }
        uses.params(program, sources);
        uses
    }

    fn params(&mut self, program: &hir::Program, sources: &SourceMap) {
        for (param, about) in program.shader.params.iter().zip(stages::params(program)) {
            let span = program.vars.get(param.var.0 as usize).map_or(Span::default(), |var| var.span);
            let line = sources.line(span).map_or(0, |(_, line)| line);
            let ty = about.ty.to_string();
            let kinds = [
                ("array", ty.contains('[')),
                ("closure", ty.starts_with("closure") && !about.output),
                ("matrix", ty.starts_with("matrix") && !about.output),
                ("struct", !ty.contains('[') && builtin_type(&ty).is_none()),
            ];
            for (kind, _) in kinds.into_iter().filter(|(_, is)| *is) {
                self.parameters.push((line, kind, about.name.clone()));
            }
        }
    }

    /// What differs in a renderer, for a file that is in another dialect.
    fn differences(&self, dialect: &Dialect, own: Option<&Dialect>) -> Vec<Difference> {
        let lacks = &dialect.names.lacks;
        let title = own.map_or("", |own| own.names.title.as_str());
        let mut found = BTreeSet::new();
        let mut add = |line: u32, what: String, why: &str| {
            found.insert(Difference { line, what, why: why.to_string() });
        };
        if let Some(why) = lacks.kinds.get(self.kind) {
            add(0, format!("a {} shader", self.kind), why);
        }
        for (line, name) in &self.calls {
            let closure = lacks.all_closures.as_ref().filter(|_| is_closure(name));
            if let Some(why) = lacks.functions.get(name).or(lacks.closures.get(name)).or(closure) {
                add(*line, format!("{name}()"), why);
            } else if is_closure(name)
                && !lacks.only_closures.is_empty()
                && !lacks.only_closures.contains(name)
            {
                let why = format!("only {} have an effect", lacks.only_closures.join(", "));
                add(*line, format!("{name}()"), &why);
            }
        }
        let known = dialect.declared();
        for (line, name) in self.own.iter().filter(|(_, name)| !known.contains(name.as_str())) {
            add(*line, name.clone(), &format!("not known there; it is of {title}"));
        }
        for (line, name) in &self.words {
            if let Some(why) = lacks.globals.get(name) {
                add(*line, name.clone(), why);
            }
        }
        for (line, kind) in &self.noises {
            let of_own =
                own.is_some_and(|own| own.name != dialect.name && own.names.unknown.contains_key(kind));
            let why = lacks.noises.get(kind).cloned();
            if let Some(why) = why.or(of_own.then(|| format!("not known there; it is of {title}"))) {
                add(*line, format!("noise \"{kind}\""), &why);
            }
        }
        for (line, object, name) in &self.attributes {
            let answers = |dialect: &Dialect| dialect.attribute(object, name).is_some();
            if own.is_some_and(answers) && !answers(dialect) {
                let of = if object.is_empty() { String::new() } else { format!("\"{object}\", ") };
                add(*line, format!("getattribute {of}\"{name}\""), "this attribute is not known there");
            }
        }
        match (&lacks.includes, self.include) {
            (Some(why), Some(line)) => add(line, "#include".to_string(), why),
            _ => {
                let headers = self.headers.iter().filter(|(_, name)| dialect.header(name).is_none());
                headers.for_each(|(line, name)| add(*line, name.clone(), "this header is not there"));
            }
        }
        for (line, kind, name) in &self.parameters {
            if let Some(why) = lacks.parameters.get(*kind) {
                add(*line, format!("parameter `{name}`"), why);
            }
        }
        found.into_iter().collect()
    }
}

/// The type that is no struct, by its name.
fn builtin_type(ty: &str) -> Option<&str> {
    let types = ["int", "float", "string", "color", "point", "vector", "normal", "matrix", "closure color"];
    types.into_iter().find(|name| *name == ty)
}

fn text_of(token: &Token) -> Option<&str> {
    if let Token::Str(text) = token { Some(&**text) } else { None }
}

fn kind(program: &hir::Program) -> &'static str {
    match program.shader.kind {
        ShaderKind::Generic => "shader",
        ShaderKind::Surface => "surface",
        ShaderKind::Displacement => "displacement",
        ShaderKind::Volume => "volume",
    }
}
