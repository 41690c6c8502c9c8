//! Serialized groups: the text that pipelines exchange.
//!
//! ```text
//! param float scale 4 ;  param color tint 1 0.5 0 [[ int lockgeom = 0 ]] ;
//! shader noisy n1 ;
//! shader mixer m ;
//! connect n1.out m.a ;
//! ```
//!
//! Values precede the shader to which they belong. Statements end with `;` or `,`, and blank ones mean
//! nothing. Grammar: OSL language specification, "Describing shader groups". [`parse`] returns statements,
//! and [`build`] makes a group of them; errors become diagnostics with locations in the text.

use super::{ConnectError, Group, Layer};
use crate::params::{self, ParamError, ParamValues};
use osl_hir::hir::Program;
use osl_ir::types::Type;
use osl_limits::{Limits, Reading};
use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;
use std::sync::Arc;

/// The text is not a statement of a group.
pub const GROUP_SYNTAX: Code = Code { id: "E0801", name: "group-syntax" };
/// A shader of a group is missing or does not compile.
pub const NO_SHADER: Code = Code { id: "E0802", name: "missing-shader" };
/// A layer's name is taken, or there are too many layers.
pub const BAD_LAYER: Code = Code { id: "E0803", name: "bad-layer" };
/// A connection cannot be made.
pub const BAD_CONNECTION: Code = Code { id: "E0804", name: "bad-connection" };
/// A value for which there is no parameter.
pub const UNUSED_VALUE: Code = Code { id: "W0805", name: "unused-value" };

/// The codes of this module.
pub const CODES: [Code; 5] = [GROUP_SYNTAX, NO_SHADER, BAD_LAYER, BAD_CONNECTION, UNUSED_VALUE];

/// A word of the text, with its location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// The word; for a quoted word, the text inside the quotes.
    pub text: Arc<str>,
    /// Its location.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Statement {
    /// A value for the next shader.
    Param {
        /// Its type.
        ty: Type,
        /// The parameter.
        name: Word,
        /// Numbers or strings, one by one.
        values: Vec<Word>,
        /// Whether the point's user data take precedence.
        interpolated: bool,
        /// The whole statement.
        span: Span,
    },
    /// A layer.
    Shader {
        /// The shader.
        shader: Word,
        /// The layer's name.
        layer: Option<Word>,
    },
    /// A connection from one layer's parameter to another's.
    Connect {
        /// Layer and parameter.
        from: (Word, Word),
        /// Layer and parameter.
        to: (Word, Word),
        /// The whole statement.
        span: Span,
    },
}

/// Reads a text whose first byte has the offset `base`.
pub fn parse(text: &str, base: u32, limits: &Limits) -> (Vec<Statement>, Vec<Diagnostic>) {
    let Reading { group_words: words, diagnostics: most, .. } = limits.reading;
    let mut reader = Reader { text, base: base as usize, at: 0, words };
    let (mut statements, mut diagnostics) = (Vec::new(), Vec::new());
    while !reader.is_done() && (diagnostics.len() as u64) < most {
        match reader.statement() {
            Ok(statement) => statements.push(statement),
            Err(diagnostic) => {
                diagnostics.push(*diagnostic);
                reader.skip_statement();
            }
        }
    }
    (statements, diagnostics)
}

type Result<T> = std::result::Result<T, Box<Diagnostic>>;

fn error<T>(span: Span, message: impl Into<String>, help: &str) -> Result<T> {
    Err(Box::new(Diagnostic::error(GROUP_SYNTAX, span, message).help(help)))
}

struct Reader<'a> {
    text: &'a str,
    base: usize,
    at: usize,
    /// Number of words that may still follow.
    words: u64,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn blank(&mut self) {
        self.at += self.rest().len() - self.rest().trim_start().len();
    }

    /// Whether nothing follows but blank statements, which are skipped.
    fn is_done(&mut self) -> bool {
        while self.takes(";") || self.takes(",") {}
        self.rest().is_empty()
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new((self.base + start) as u32, (self.base + end) as u32)
    }

    /// The location of the next character.
    fn here(&self) -> Span {
        self.span(self.at, self.at + self.rest().chars().next().map_or(0, char::len_utf8))
    }

    /// Consumes a mark if it comes next.
    fn takes(&mut self, mark: &str) -> bool {
        self.blank();
        let there = self.rest().starts_with(mark);
        self.at += if there { mark.len() } else { 0 };
        there
    }

    fn ends(&mut self) -> bool {
        self.blank();
        self.rest().is_empty() || self.rest().starts_with([';', ','])
    }

    /// Checks that the statement ends here.
    fn end(&mut self) -> Result<()> {
        if self.ends() {
            return Ok(());
        }
        error(self.here(), "a statement ends with `;`", "put a `;` before this")
    }

    fn skip_statement(&mut self) {
        let rest = self.rest();
        self.at += rest.find(';').map_or(rest.len(), |at| at + 1);
    }

    /// The next word, or string in quotes.
    fn word(&mut self, what: &str) -> Result<Word> {
        self.blank();
        let start = self.at;
        let Some(left) = self.words.checked_sub(1) else {
            let here = self.here();
            // The rest of the text is not read.
            self.at = self.text.len();
            return error(
                here,
                "the text of the group has too many words",
                "put shaders for its long arrays",
            );
        };
        self.words = left;
        if self.rest().starts_with('"') {
            return self.quoted();
        }
        let rest = self.rest();
        let stops = |(at, c): (usize, char)| {
            c.is_whitespace() || matches!(c, ';' | ',' | '"') || rest[at..].starts_with("[[")
        };
        let len = rest.char_indices().find(|c| stops(*c)).map_or(rest.len(), |(at, _)| at);
        if len == 0 {
            return error(
                self.here(),
                format!("here should be {what}"),
                "see the form of a group: explain-error E0801",
            );
        }
        self.at += len;
        Ok(Word { text: rest[..len].into(), span: self.span(start, self.at) })
    }

    fn quoted(&mut self) -> Result<Word> {
        let start = self.at;
        let mut text = String::new();
        let mut chars = self.rest().char_indices().skip(1);
        while let Some((at, c)) = chars.next() {
            match c {
                '"' => {
                    self.at += at + 1;
                    return Ok(Word { text: text.into(), span: self.span(start, self.at) });
                }
                '\\' => match chars.next() {
                    Some((_, 'n')) => text.push('\n'),
                    Some((_, 't')) => text.push('\t'),
                    Some((_, 'r')) => text.push('\r'),
                    Some((_, other)) => text.push(other),
                    None => {}
                },
                c => text.push(c),
            }
        }
        let opening = self.span(start, start + 1);
        self.at = self.text.len();
        error(opening, "a string without its closing quote", "put a `\"` behind it")
    }

    fn statement(&mut self) -> Result<Statement> {
        self.blank();
        let start = self.at;
        let first = self.word("a statement: `param`, `shader` or `connect`")?;
        match &*first.text {
            "shader" => {
                let shader = self.word("the name of a shader")?;
                let layer = if self.ends() { None } else { Some(self.word("the name of the layer")?) };
                self.end()?;
                Ok(Statement::Shader { shader, layer })
            }
            "connect" => {
                let (from, to) = (self.place()?, self.place()?);
                let span = self.span(start, self.at);
                self.end()?;
                Ok(Statement::Connect { from, to, span })
            }
            "param" => {
                let ty = self.word("a type")?;
                self.param(&ty, start)
            }
            _ if Type::parse(&first.text).is_some() => self.param(&first, start),
            _ => error(
                first.span,
                format!("`{}` is no statement of a group", first.text),
                "statements begin with `param`, `shader` or `connect`",
            ),
        }
    }

    /// `layer.parameter`, or the two as words.
    fn place(&mut self) -> Result<(Word, Word)> {
        let word = self.word("a layer and its parameter, as `layer.parameter`")?;
        let Some((layer, param)) = word.text.split_once('.') else {
            let param = self.word("a parameter of the layer")?;
            return Ok((word, param));
        };
        let dot = word.span.start + layer.len() as u32;
        let part = |text: &str, start, end| Word { text: text.into(), span: Span::new(start, end) };
        Ok((part(layer, word.span.start, dot), part(param, dot + 1, word.span.end)))
    }

    fn param(&mut self, ty: &Word, start: usize) -> Result<Statement> {
        let Some(known) = Type::parse(&ty.text) else {
            return error(
                ty.span,
                format!("`{}` is no type of a value", ty.text),
                "types are int, float, color, point, vector, normal, matrix and string, with `[n]` behind for arrays",
            );
        };
        let name = self.word("the name of a parameter")?;
        let (mut values, mut interpolated) = (Vec::new(), false);
        while !self.ends() && !self.rest().starts_with("[[") {
            values.push(self.word("a value")?);
        }
        if self.takes("[[") {
            interpolated = self.hints()?;
        }
        let span = self.span(start, self.at);
        if values.is_empty() {
            return error(span, format!("`{}` has no value", name.text), "write the value behind the name");
        }
        self.end()?;
        Ok(Statement::Param { ty: known, name, values, interpolated, span })
    }

    /// Reads hints up to their closing brackets. Returns whether one gives precedence to the point's user
    /// data.
    fn hints(&mut self) -> Result<bool> {
        let mut interpolated = false;
        loop {
            let start = self.at;
            let rest = self.rest();
            let len = rest.find(',').unwrap_or(rest.len()).min(rest.find("]]").unwrap_or(rest.len()));
            let hint = &rest[..len];
            self.at += len;
            let words: Vec<&str> =
                hint.split(['=', ' ', '\t', '\n', '\r']).filter(|w| !w.is_empty()).collect();
            match words[..] {
                ["int", "lockgeom", value] => interpolated |= value == "0",
                ["int", "interpolated", value] => interpolated |= value != "0",
                ["int", "interactive", _] => {}
                _ => {
                    return error(
                        self.span(start, self.at),
                        format!("`{}` is no hint", hint.trim()),
                        "hints are `int lockgeom = 0`, `int interpolated = 1` and `int interactive = 1`",
                    );
                }
            }
            if self.takes("]]") {
                return Ok(interpolated);
            }
            if !self.takes(",") {
                return error(self.here(), "the hints do not end", "put `]]` behind them");
            }
        }
    }
}

/// Provides the shaders of a group.
pub trait Shaders {
    /// Loads a shader for one layer, by name: the program, and the offset to add to its spans to make them
    /// spans of the group's source map.
    ///
    /// # Errors
    /// Why the shader is not available, as text.
    fn load(&mut self, name: &str) -> std::result::Result<(Arc<Program>, u32), String>;
}

/// Builds a group from statements. If there is an error among the diagnostics, the group lacks the part with
/// the error.
pub fn build(
    name: &str,
    statements: &[Statement],
    shaders: &mut dyn Shaders,
    limits: &Limits,
) -> (Group, Vec<Diagnostic>) {
    let mut group = Group::new(name).with_limits(limits);
    let mut diagnostics = Vec::new();
    let mut pending: Vec<&Statement> = Vec::new();
    for statement in statements {
        match statement {
            Statement::Param { .. } => pending.push(statement),
            Statement::Shader { shader, layer } => {
                let params = std::mem::take(&mut pending);
                match layer_of(&group, shader, layer.as_ref(), &params, shaders, &mut diagnostics) {
                    Ok(layer) => {
                        if let Err(layer) = group.add(layer) {
                            let text = format!("the group has too many layers for `{}`", layer.name);
                            diagnostics.push(Diagnostic::error(BAD_LAYER, shader.span, text));
                        }
                    }
                    Err(d) => diagnostics.push(*d),
                }
            }
            Statement::Connect { from, to, span } => {
                let ends = [from, to].map(|(layer, param)| (&*layer.text, &*param.text));
                if let Err(why) = group.connect(ends[0], ends[1]) {
                    diagnostics.push(unconnected(&why, from, to, *span));
                }
            }
        }
        if diagnostics.len() as u64 >= limits.reading.diagnostics {
            break;
        }
    }
    for statement in pending {
        if let Statement::Param { name, span, .. } = statement {
            let text = format!("the value of `{}` is for no shader: none follows", name.text);
            diagnostics
                .push(Diagnostic::warning(UNUSED_VALUE, *span, text).help("write it before its shader"));
        }
    }
    (group, diagnostics)
}

fn layer_of(
    group: &Group,
    shader: &Word,
    name: Option<&Word>,
    params: &[&Statement],
    shaders: &mut dyn Shaders,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<Layer> {
    let (program, base) = shaders.load(&shader.text).map_err(|why| {
        Box::new(Diagnostic::error(NO_SHADER, shader.span, format!("no shader `{}`: {why}", shader.text)))
    })?;
    let (layer, span) = match name {
        Some(word) => (word.text.clone(), word.span),
        None => (format!("{}_{}", program.shader.name, group.layers.len()).into(), shader.span),
    };
    if group.find(&layer).is_some() {
        let text = format!("there is a layer `{layer}` already");
        return Err(Box::new(
            Diagnostic::error(BAD_LAYER, span, text).help("give each layer a name of its own"),
        ));
    }
    let mut values = ParamValues::default();
    for statement in params {
        let Statement::Param { ty, name, values: words, interpolated, span } = statement else { continue };
        let words: Vec<Arc<str>> = words.iter().map(|w| w.text.clone()).collect();
        match params::set_words(&program, &mut values, *ty, &name.text, &words) {
            Ok(()) if *interpolated => values.interpolate(&name.text),
            Ok(()) => {}
            Err(why) => {
                let span = if matches!(why, ParamError::Unknown { .. }) { name.span } else { *span };
                let warning = Diagnostic::warning(UNUSED_VALUE, span, why.to_string());
                diagnostics.push(warning.note("the value is ignored"));
            }
        }
    }
    Ok(Layer { name: layer, program, values, base })
}

fn unconnected(why: &ConnectError, from: &(Word, Word), to: &(Word, Word), all: Span) -> Diagnostic {
    let word = |text: &str, of: fn(&(Word, Word)) -> &Word| {
        if *of(from).text == *text { of(from).span } else { of(to).span }
    };
    let span = match why {
        ConnectError::NoLayer(layer, _) => word(layer, |w| &w.0),
        ConnectError::NoParameter { layer, .. } if *layer == *from.0.text => from.1.span,
        ConnectError::NoParameter { .. } | ConnectError::Forbidden(_) => to.1.span,
        ConnectError::NoPart(path) if path.starts_with(&*from.0.text) => from.1.span,
        ConnectError::NoPart(_) => to.1.span,
        ConnectError::Order { .. } | ConnectError::Types { .. } => all,
    };
    Diagnostic::error(BAD_CONNECTION, span, why.to_string())
}
