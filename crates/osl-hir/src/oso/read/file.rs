//! The lines of a file: the shader line, the symbols, and the operations of each section.

use super::lex::{self, Kind, Token};
use crate::hir::MetaValue;
use crate::oso::errors::{self, Wrong};
use crate::oso::text;
use osl_ir::types::{Base, Extent, Type};
use osl_limits::{Limits, Reading};
use osl_syntax::ast::ShaderKind;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;
use std::sync::Arc;

/// A metadatum: type, name, value.
pub(super) type Metadatum = (String, Arc<str>, MetaValue);

/// A file as written.
#[derive(Debug, Default)]
pub(super) struct File<'a> {
    pub(super) shader: Option<Shader<'a>>,
    pub(super) symbols: Vec<Symbol<'a>>,
    pub(super) sections: Vec<Section<'a>>,
    pub(super) ops: Vec<Op<'a>>,
    /// Source lines quoted in comments: file, line and text.
    pub(super) quoted: Vec<(&'a str, u32, &'a str)>,
}

/// The shader's line.
#[derive(Debug)]
pub(super) struct Shader<'a> {
    pub(super) kind: ShaderKind,
    pub(super) name: &'a str,
    pub(super) metadata: Vec<Metadatum>,
}

/// The class of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Param,
    Output,
    Local,
    Global,
    Const,
}

/// The type of a symbol.
#[derive(Clone, Copy, Debug)]
pub(super) enum SymbolType<'a> {
    Plain(Type),
    Struct(&'a str),
}

/// The line of a symbol.
#[derive(Debug)]
pub(super) struct Symbol<'a> {
    pub(super) class: Class,
    pub(super) ty: SymbolType<'a>,
    pub(super) name: &'a str,
    pub(super) values: Vec<Token<'a>>,
    pub(super) metadata: Vec<Metadatum>,
    /// The struct that contains it as a field, and the field's index.
    pub(super) parent: Option<(&'a str, u32)>,
    /// Whether code computes its default, by its hint.
    pub(super) computed: bool,
    pub(super) span: Span,
}

/// Operations under one name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    pub(super) name: &'a str,
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) span: Span,
}

/// The line of an operation.
#[derive(Debug)]
pub(super) struct Op<'a> {
    pub(super) name: &'a str,
    pub(super) args: Vec<(&'a str, Span)>,
    pub(super) jumps: Vec<u32>,
    pub(super) span: Span,
    /// File and line of the source, where known.
    pub(super) place: Option<(&'a str, u32)>,
    /// The hints about which operands it reads and writes, and which it differentiates.
    pub(super) access: Option<&'a str>,
    pub(super) derivatives: Option<&'a str>,
}

/// Reads all lines. Errors are reported, and all valid lines are kept.
pub(super) fn parse<'a>(source: &'a str, limits: &Limits, errors: &mut Vec<Diagnostic>) -> File<'a> {
    let Reading { oso_lines: most, diagnostics: most_errors, .. } = limits.reading;
    let mut reader = Reader { most, file: File::default(), place: (None, None), header: false };
    let mut base = 0u32;
    let mut quoting: Option<(&str, u32)> = None;
    for line in source.split_inclusive('\n') {
        let words = line.trim_end_matches(['\n', '\r']);
        if let Some(comment) = words.trim_start().strip_prefix('#') {
            match quoting.take() {
                Some((file, number)) => {
                    let quoted = comment.strip_prefix(' ').unwrap_or(comment);
                    reader.file.quoted.push((file, number, quoted));
                }
                None => quoting = source_place(comment),
            }
        } else {
            quoting = None;
            if let Err(error) = lex::tokens(words, base, false).and_then(|tokens| reader.line(&tokens)) {
                let fatal = error.code == crate::hir::TOO_LARGE || error.message == NO_HEADER;
                errors.push(*error);
                if fatal || errors.len() as u64 >= most_errors {
                    break;
                }
            }
        }
        base += line.len() as u32;
    }
    let ends = reader.file.ops.len();
    if let Some(last) = reader.file.sections.last_mut() {
        last.end = ends;
    }
    if errors.is_empty() && !reader.header {
        errors.push(*errors::syntax(Span::default(), NO_HEADER));
    } else if errors.is_empty() && reader.file.shader.is_none() {
        errors.push(*errors::syntax(Span::default(), "no line names the shader"));
    }
    reader.file
}

const NO_HEADER: &str = "a compiled shader starts with `OpenShadingLanguage 1.00`";

/// `file:line` of a comment that announces a quoted line.
fn source_place(comment: &str) -> Option<(&str, u32)> {
    let (file, line) = comment.strip_prefix(' ')?.rsplit_once(':')?;
    Some((file, line.trim().parse().ok()?))
}

struct Reader<'a> {
    /// Symbols, and operations, at most.
    most: u64,
    file: File<'a>,
    /// File and line of the source for the next operation.
    place: (Option<&'a str>, Option<u32>),
    header: bool,
}

impl<'a> Reader<'a> {
    fn line(&mut self, tokens: &[Token<'a>]) -> Result<(), Wrong> {
        let Some((first, rest)) = tokens.split_first() else { return Ok(()) };
        let span = tokens.last().map_or(first.span, |last| first.span.to(last.span));
        if !self.header {
            return self.header(tokens, span);
        }
        let Some(word) = first.word() else {
            return Err(errors::syntax(first.span, "a line starts with a word"));
        };
        if self.file.shader.is_none() {
            self.file.shader = Some(shader(word, rest, span)?);
            return Ok(());
        }
        if word == "code" {
            return self.section(rest, span);
        }
        if !self.file.sections.is_empty() {
            // A label before an operation has no meaning.
            let is_label = word.strip_suffix(':').is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()));
            return match rest.split_first() {
                Some((name, rest)) if is_label => self.op(name.word().unwrap_or_default(), rest, span),
                _ => self.op(word, rest, span),
            };
        }
        let class = match word {
            "param" => Class::Param,
            "oparam" => Class::Output,
            "local" | "temp" => Class::Local,
            "global" => Class::Global,
            "const" => Class::Const,
            _ => {
                let message =
                    format!("`{word}` is no kind of symbol, and operations come after a `code` line");
                return Err(errors::syntax(first.span, message));
            }
        };
        if self.file.symbols.len() as u64 >= self.most {
            return Err(errors::too_large(span, format!("more than {} symbols", self.most)));
        }
        self.file.symbols.push(symbol(class, rest, span)?);
        Ok(())
    }

    fn header(&mut self, tokens: &[Token<'a>], span: Span) -> Result<(), Wrong> {
        let words: Vec<&str> = tokens.iter().filter_map(Token::word).collect();
        match words[..] {
            [text::HEADER, version] if version.split('.').next() == Some("1") => {
                self.header = true;
                Ok(())
            }
            [text::HEADER, version] => {
                // The rest of the file would be read by the wrong rules.
                let error = errors::syntax(span, NO_HEADER);
                Err(Box::new(error.label(format!("this is version {version}"))))
            }
            _ => Err(errors::syntax(span, NO_HEADER)),
        }
    }

    fn section(&mut self, rest: &[Token<'a>], span: Span) -> Result<(), Wrong> {
        let at = self.file.ops.len();
        if let Some(last) = self.file.sections.last_mut() {
            last.end = at;
        }
        match rest.first().and_then(Token::word) {
            Some(name) => {
                self.file.sections.push(Section { name, start: at, end: at, span });
                Ok(())
            }
            None => Err(errors::syntax(span, "`code` without the name of what it computes")),
        }
    }

    fn op(&mut self, name: &'a str, rest: &[Token<'a>], span: Span) -> Result<(), Wrong> {
        if self.file.ops.len() as u64 >= self.most {
            return Err(errors::too_large(span, format!("more than {} operations", self.most)));
        }
        let mut op = Op {
            name,
            args: Vec::new(),
            jumps: Vec::new(),
            span,
            place: None,
            access: None,
            derivatives: None,
        };
        for token in rest {
            match token.kind {
                Kind::Word(word) if word.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
                    let target = word.parse();
                    op.jumps.push(target.map_err(|_| {
                        errors::syntax(
                            token.span,
                            format!("`{word}` is neither a symbol nor an operation's number"),
                        )
                    })?);
                }
                Kind::Word(word) => op.args.push((word, token.span)),
                Kind::Hint("filename", Some(name)) => {
                    self.place.0 = Some(name.trim_matches('"'));
                }
                Kind::Hint("line", Some(line)) => self.place.1 = line.trim().parse().ok(),
                Kind::Hint("argrw", Some(access)) => op.access = Some(access.trim_matches('"')),
                Kind::Hint("argderivs", Some(list)) => op.derivatives = Some(list),
                Kind::Hint(..) => {}
                Kind::Text(_) | Kind::Comma => {
                    return Err(errors::syntax(token.span, "operations take symbols, not values"));
                }
            }
        }
        if let (Some(file), Some(line)) = self.place {
            op.place = Some((file, line));
        }
        self.file.ops.push(op);
        Ok(())
    }
}

fn shader<'a>(kind: &str, rest: &[Token<'a>], span: Span) -> Result<Shader<'a>, Wrong> {
    // Other kinds are allowed, too: `light`, or any word.
    let kind = text::shader_kind(kind).unwrap_or(ShaderKind::Generic);
    let Some(name) = rest.first().and_then(Token::text).filter(|name| !name.is_empty()) else {
        return Err(errors::syntax(span, "a shader without a name"));
    };
    // In quotes it could hold anything, but it is written without them.
    if name.contains(|c: char| c.is_whitespace() || c.is_control() || "\"\\%#,{}".contains(c)) {
        return Err(errors::syntax(span, "the name of a shader is one word"));
    }
    Ok(Shader { kind, name, metadata: metadata(rest)? })
}

/// The line of a symbol after its class: type, name, values, hints.
fn symbol<'a>(class: Class, rest: &[Token<'a>], span: Span) -> Result<Symbol<'a>, Wrong> {
    let missing = || errors::syntax(span, "a symbol has a type and a name");
    let (first, mut rest) = rest.split_first().ok_or_else(missing)?;
    let word = first.word().ok_or_else(missing)?;
    let ty = match word {
        "struct" | "closure" => {
            let (second, after) = rest.split_first().ok_or_else(missing)?;
            rest = after;
            let of = second.word().ok_or_else(missing)?;
            if word == "struct" {
                SymbolType::Struct(of)
            } else {
                SymbolType::Plain(closure(of).ok_or_else(|| unknown_type(second.span, of))?)
            }
        }
        // The language permits this declaration of a variable, without further meaning.
        "void" if class == Class::Local => SymbolType::Plain(Type::VOID),
        _ => SymbolType::Plain(Type::parse(word).ok_or_else(|| unknown_type(first.span, word))?),
    };
    let (name, rest) = rest.split_first().ok_or_else(missing)?;
    let name = name.word().ok_or_else(missing)?;
    let mut parent = (None, None);
    let mut values = Vec::new();
    let mut computed = false;
    for token in rest {
        match token.kind {
            Kind::Hint("initexpr", _) => computed = true,
            Kind::Hint("mystruct", Some(of)) => parent.0 = Some(of.trim()),
            Kind::Hint("mystructfield", Some(index)) => parent.1 = index.trim().parse().ok(),
            Kind::Hint(..) => {}
            _ => values.push(*token),
        }
    }
    let parent = match parent {
        (Some(of), Some(index)) => Some((of, index)),
        _ => None,
    };
    Ok(Symbol { class, ty, name, values, metadata: metadata(rest)?, parent, computed, span })
}

/// `color` or `color[3]` after `closure`.
fn closure(word: &str) -> Option<Type> {
    let ty = Type::parse(word).filter(|ty| ty.base == Base::Color)?;
    Some(Type { base: Base::Closure, ..ty })
}

fn unknown_type(span: Span, word: &str) -> Wrong {
    errors::symbol(span, format!("there is no type `{word}`"))
}

/// The metadata among the hints.
fn metadata(tokens: &[Token<'_>]) -> Result<Vec<Metadatum>, Wrong> {
    let mut list = Vec::new();
    for token in tokens {
        let Kind::Hint("meta", Some(inside)) = token.kind else { continue };
        // `%meta{`
        let parts = lex::tokens(inside, token.span.start + 6, true)?;
        let parts: Vec<&Token<'_>> = parts.iter().filter(|t| t.kind != Kind::Comma).collect();
        let datum = || {
            let (ty, rest) = parts.split_first()?;
            let (name, values) = rest.split_first()?;
            Some((ty.word()?.to_string(), name.text()?.into(), meta_value(ty.word()?, values)?))
        };
        list.push(datum().ok_or_else(|| {
            errors::syntax(token.span, "metadata has a type, a name and values, separated by commas")
        })?);
    }
    Ok(list)
}

fn meta_value(ty: &str, values: &[&Token<'_>]) -> Option<MetaValue> {
    let ty = Type::parse(ty)?;
    if ty.base == Base::String {
        let mut texts = values.iter().map(|t| t.text().map(text::unescape));
        return match ty.extent {
            Extent::One => Some(MetaValue::Text(texts.next()??)),
            _ => Some(MetaValue::Texts(texts.collect::<Option<_>>()?)),
        };
    }
    // The reference accepts and writes `int connectable = 0.5`: an int need not be whole here.
    let number = |word: &str| {
        let whole = if ty.base == Base::Int { word.parse::<i32>().ok().map(f64::from) } else { None };
        whole.or_else(|| word.parse::<f32>().ok().map(f64::from))
    };
    let all: Option<Vec<f64>> = values.iter().map(|t| number(t.word()?)).collect();
    Some(MetaValue::Numbers(all?))
}
