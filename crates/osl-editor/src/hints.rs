//! Inlay hints: what the compiler adds to the text, the names of parameters, and values of a run.

use crate::page::{Page, lsp_range};
use crate::scan::Kind;
use crate::signature::Form;
use gen_lsp_types::{InlayHint, InlayHintKind, Position, Range};
use osl::Implied;
use std::collections::BTreeMap;

/// Which hints are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hints {
    /// Conversions that nobody wrote.
    pub conversions: bool,
    /// The types of results that decided which function a call takes.
    pub results: bool,
    /// Names of parameters, beside arguments that do not tell.
    pub parameters: bool,
}

impl Default for Hints {
    fn default() -> Hints {
        Hints { conversions: true, results: true, parameters: true }
    }
}

impl Page {
    /// The hints in a range. `values` are texts to show after lines, numbered from 1.
    pub fn hints(&self, range: Range, shown: Hints, values: &[(u32, String)]) -> Vec<InlayHint> {
        let mut list = Vec::new();
        if shown.conversions || shown.results {
            for implied in self.analysis.implied() {
                match implied {
                    Implied::Conversion { range, to } if shown.conversions && self.has(&range) => {
                        list.push(hint(
                            lsp_range(&range).start,
                            format!("({to})"),
                            Some(InlayHintKind::Type),
                        ));
                    }
                    Implied::Result { range, ty } if shown.results && self.has(&range) => {
                        list.push(hint(lsp_range(&range).start, format!("{ty}:"), Some(InlayHintKind::Type)));
                    }
                    _ => {}
                }
            }
        }
        if shown.parameters {
            self.parameter_names(range, &mut list);
        }
        for (line, text) in values {
            let line = line.saturating_sub(1) as usize;
            let mut value = hint(self.text.position(self.text.line_end(line)), text.clone(), None);
            value.padding_left = Some(true);
            list.push(value);
        }
        list.retain(|hint| range.start <= hint.position && hint.position <= range.end);
        list.sort_by_key(|hint| hint.position);
        list
    }

    /// The names of parameters beside arguments that begin with a number or a bracket.
    fn parameter_names(&self, range: Range, list: &mut Vec<InlayHint>) {
        let scan = self.scan();
        let mut forms: BTreeMap<&str, Vec<Form>> = BTreeMap::new();
        let (first, last) = (scan.before(self.text.offset(range.start)), self.text.offset(range.end));
        for (open, token) in scan.tokens.iter().enumerate().skip(first).take_while(|(_, t)| t.start < last) {
            let Some(close) = token.partner.filter(|_| self.token(token) == "(" && !token.directive) else {
                continue;
            };
            let Some(name) =
                open.checked_sub(1).filter(|i| scan.get(*i).is_some_and(|t| t.kind == Kind::Word))
            else {
                continue;
            };
            let at = scan.get(name).map_or(0, |token| token.start);
            let is_call = self.symbol_of(at).is_some_and(|symbol| {
                use osl::SymbolKind::{Builtin, Function};
                let declared = symbol.declared.as_ref().is_some_and(|d| self.has(d) && d.start.offset == at);
                matches!(symbol.kind, Builtin | Function) && !declared
            });
            if !is_call {
                continue;
            }
            let firsts = (open + 1..close).filter(|i| {
                scan.get(*i).is_some_and(|t| t.parent == Some(open))
                    && (*i == open + 1 || self.word(i.checked_sub(1)) == ",")
            });
            let firsts: Vec<usize> = firsts.collect();
            let word = self.word(Some(name));
            let forms = forms.entry(word).or_insert_with(|| self.forms(word));
            let Some(form) = forms.get(self.form_of(name, forms, firsts.len())) else { continue };
            // One parameter, or one letter, tells nothing.
            let named = firsts.iter().zip(&form.names).filter(|(_, name)| firsts.len() > 1 && name.len() > 1);
            for (first, name) in named {
                let Some(argument) = scan.get(*first) else { continue };
                let is_plain = argument.kind == Kind::Number || ["-", "("].contains(&self.token(argument));
                if is_plain {
                    let mut entry = hint(
                        self.text.position(argument.start),
                        format!("{name}:"),
                        Some(InlayHintKind::Parameter),
                    );
                    entry.padding_right = Some(true);
                    list.push(entry);
                }
            }
        }
    }
}

fn hint(position: Position, label: String, kind: Option<InlayHintKind>) -> InlayHint {
    InlayHint {
        position,
        label: label.into(),
        kind,
        text_edits: None,
        tooltip: None,
        padding_left: None,
        padding_right: None,
        data: None,
    }
}
