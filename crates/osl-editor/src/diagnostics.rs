//! Diagnostics as the protocol has them, by file.

use crate::page::{Page, World, lsp_range};
use gen_lsp_types as lsp;
use gen_lsp_types::{CodeDescription, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag};
use osl::{Diagnostic, Severity};
use std::collections::BTreeMap;

/// The code of a text without a shader, which is no mistake in a header.
const NO_SHADER: &str = "E0206";

impl Page {
    /// The diagnostics of the text and of its headers, by the name of the file. Those without a place, and
    /// those in headers of the compiler, are shown at the start of the text.
    pub fn diagnostics(&self, world: &dyn World) -> BTreeMap<String, Vec<lsp::Diagnostic>> {
        let mut files: BTreeMap<String, Vec<lsp::Diagnostic>> = BTreeMap::new();
        files.entry(self.name.clone()).or_default();
        for found in self.found(world.levels()) {
            if self.is_header() && found.code == NO_SHADER {
                continue;
            }
            let file = found.range.as_ref().map(|range| &range.file).filter(|file| world.uri(file).is_some());
            let list = files.entry(file.unwrap_or(&self.name).clone()).or_default();
            let shown = self.shown(found, world);
            if !list.contains(&shown) {
                list.push(shown);
            }
        }
        files
    }

    /// One diagnostic.
    pub(crate) fn shown(&self, found: &Diagnostic, world: &dyn World) -> lsp::Diagnostic {
        let place = found.range.as_ref().filter(|range| world.uri(&range.file).is_some());
        let related = |label: &osl::Label| {
            let location = self.location(label.range.as_ref()?, world)?;
            Some(DiagnosticRelatedInformation::new(location, label.text.clone()))
        };
        let related: Vec<DiagnosticRelatedInformation> = found.labels.iter().filter_map(related).collect();
        let lesson =
            world.lessons().map(|base| CodeDescription::new(format!("{base}{}.md", found.code).into()));
        lsp::Diagnostic {
            range: place.map(lsp_range).unwrap_or_default(),
            severity: Some(match found.severity {
                Severity::Error => DiagnosticSeverity::Error,
                Severity::Warning => DiagnosticSeverity::Warning,
            }),
            code: Some(found.code.to_string().into()),
            code_description: lesson,
            source: Some("oslrun".to_string()),
            message: message(found).into(),
            tags: tag(found.name).map(|tag| vec![tag]),
            related_information: (!related.is_empty()).then_some(related),
            data: None,
        }
    }
}

/// The message, what the label at its place adds, the notes and the next step.
fn message(found: &Diagnostic) -> String {
    let mut text = found.message.clone();
    if !found.label.is_empty() {
        text.push_str(&format!(": {}", found.label));
    }
    for note in &found.notes {
        text.push_str(&format!("\nnote: {note}"));
    }
    if let Some(help) = &found.help {
        text.push_str(&format!("\nhelp: {help}"));
    }
    text
}

/// Editors show redundant text faded.
fn tag(name: &str) -> Option<DiagnosticTag> {
    const REDUNDANT: [&str; 7] = [
        "unused-variable",
        "unused-parameter",
        "unused-function",
        "unreachable-code",
        "no-effect",
        "self-assignment",
        "stray-semicolon",
    ];
    REDUNDANT.contains(&name).then_some(DiagnosticTag::Unnecessary)
}
