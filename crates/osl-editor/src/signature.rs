//! Signature help: the forms of the called function, and the argument at the cursor.

use crate::page::Page;
use crate::scan::Kind;
use gen_lsp_types::{
    Documentation, MarkupContent, MarkupKind, ParameterInformation, Position, SignatureHelp,
    SignatureInformation,
};
use osl::{SymbolKind, reference};

/// A way to call a function.
pub(crate) struct Form {
    /// As a declaration, with the names of the parameters.
    pub(crate) text: String,
    /// The parts of the text for the parameters.
    pub(crate) params: Vec<String>,
    /// The names of the parameters.
    pub(crate) names: Vec<String>,
    /// Whether more arguments may follow.
    pub(crate) more: bool,
    /// What it does.
    about: String,
}

impl Page {
    /// The called name, as the index of its token, and the number of the argument at a byte.
    pub(crate) fn callee(&self, offset: usize) -> Option<(usize, usize)> {
        let scan = self.scan();
        let is_call = |i: &usize| {
            let before = i.checked_sub(1).and_then(|name| scan.get(name));
            self.word(Some(*i)) == "(" && before.is_some_and(|name| name.kind == Kind::Word)
        };
        let open = scan.around(offset).take_while(|i| self.word(Some(*i)) != "{").find(is_call)?;
        let inside = scan.tokens.iter().take(scan.before(offset)).skip(open + 1);
        let commas = inside.filter(|t| t.parent == Some(open) && self.token(t) == ",").count();
        Some((open - 1, commas))
    }

    /// The forms of a function: those of the text, then those of the language.
    pub(crate) fn forms(&self, name: &str) -> Vec<Form> {
        let own = self.symbols().list().iter().filter(|s| s.kind == SymbolKind::Function && s.name == name);
        let own = own.filter_map(|symbol| {
            let (text, _) = self.header(symbol)?;
            let inner = text.split_once('(')?.1.strip_suffix(')')?;
            let params: Vec<String> =
                inner.split(',').map(|p| p.trim().to_string()).filter(|p| !p.is_empty()).collect();
            let name_of = |p: &String| {
                let name = p.split('[').next().unwrap_or(p).split_whitespace().last();
                name.unwrap_or_default().to_string()
            };
            let names = params.iter().map(name_of).collect();
            let about = self.comment(symbol).unwrap_or_default();
            Some(Form { text, params, names, more: false, about })
        });
        let mut forms: Vec<Form> = own.collect();
        for function in reference::find(name).iter().filter(|function| function.name == name) {
            forms.extend(function.signatures.iter().map(|signature| {
                let params = signature.params.iter().map(|param| {
                    let output = if param.output { "output " } else { "" };
                    format!("{output}{} {}", param.ty, param.name).trim_end().to_string()
                });
                Form {
                    text: signature.text.clone(),
                    params: params.collect(),
                    names: signature.params.iter().map(|param| param.name.to_string()).collect(),
                    more: signature.more,
                    about: function.about.to_string(),
                }
            }));
        }
        forms
    }

    /// The index of the form that a call takes: the chosen one, else the first one with enough parameters.
    pub(crate) fn form_of(&self, name: usize, forms: &[Form], arguments: usize) -> usize {
        let at = self.scan().get(name).map_or(0, |token| token.start);
        let own = self.symbol_of(at).filter(|symbol| symbol.kind == SymbolKind::Function);
        let own = own.and_then(|symbol| self.header(symbol)).map(|(text, _)| text);
        let chosen = own.or_else(|| self.symbols().signature_at(at));
        let is_chosen = |form: &Form| chosen.as_ref() == Some(&form.text);
        let fits = |form: &Form| form.more || form.params.len() >= arguments;
        let chosen = forms.iter().position(|form| is_chosen(form) && fits(form));
        chosen.or_else(|| forms.iter().position(fits)).unwrap_or(0)
    }

    /// The forms of the function whose arguments are around a position.
    pub fn signature_help(&self, position: Position) -> Option<SignatureHelp> {
        let offset = self.text.offset(position);
        let (name, argument) = self.callee(offset)?;
        let forms = self.forms(self.word(Some(name)));
        let active = self.form_of(name, &forms, argument + 1);
        let signature = |form: &Form| SignatureInformation {
            label: form.text.clone(),
            documentation: Some(Documentation::from(MarkupContent::new(
                MarkupKind::Markdown,
                form.about.clone(),
            ))),
            parameters: Some(
                form.params.iter().map(|p| ParameterInformation::new(p.clone().into(), None)).collect(),
            ),
            active_parameter: None,
        };
        (!forms.is_empty()).then(|| SignatureHelp {
            signatures: forms.iter().map(signature).collect(),
            active_signature: Some(active as u32),
            active_parameter: Some((argument as u32).into()),
        })
    }
}
