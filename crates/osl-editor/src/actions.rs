//! Code actions: fixes of diagnostics, all safe fixes, and silencing a warning.

use crate::page::{Page, World, lsp_range};
use gen_lsp_types::{CodeAction, CodeActionKind, Range, TextEdit, Uri, WorkspaceEdit};
use osl::{Diagnostic, Fix};
use std::collections::HashMap;

/// The kind of the action that applies all safe fixes.
const FIX_ALL: &str = "source.fixAll.oslrun";

/// The directive that silences the warnings of the next line.
const SILENCE: &str = "#pragma osl nowarn";

impl Page {
    /// The actions for a range. `only` lists the wanted kinds; without it, all are.
    pub fn actions(
        &self,
        range: Range,
        only: Option<&[CodeActionKind]>,
        world: &dyn World,
    ) -> Vec<CodeAction> {
        let wants = |kind: &str| {
            only.is_none_or(|list| {
                list.iter().any(|wanted| {
                    let wanted = String::from(wanted.clone());
                    wanted.is_empty() || kind == wanted || kind.starts_with(&format!("{wanted}."))
                })
            })
        };
        let mut actions = Vec::new();
        let (start, end) = (self.text.offset(range.start), self.text.offset(range.end));
        let touches =
            |place: &osl::Range| self.has(place) && place.start.offset <= end && start <= place.end.offset;
        let found = self.found(world.levels()).iter();
        let here = || found.clone().filter(|found| found.range.as_ref().is_some_and(touches));
        if wants("quickfix") {
            for found in here() {
                let fixes = found.fixes.iter().filter_map(|fix| self.fix(found, fix, world));
                actions.extend(fixes);
            }
            actions.extend(here().filter_map(|found| self.silence(found, world)));
        }
        if wants(FIX_ALL)
            && self.found(world.levels()).iter().any(|d| d.fixes.first().is_some_and(|f| f.safe))
        {
            let fixed = world.fixed(&self.name, self.text.as_str());
            let edit = self.text.edit_to(&fixed).and_then(|edit| self.changes(vec![edit], world));
            actions.extend(edit.map(|edit| CodeAction {
                title: "apply all safe fixes".to_string(),
                kind: Some(CodeActionKind::from(FIX_ALL)),
                edit: Some(edit),
                ..CodeAction::default()
            }));
        }
        actions
    }

    /// The change that repairs a diagnostic; `None` if it would edit a file without an address.
    fn fix(&self, found: &Diagnostic, fix: &Fix, world: &dyn World) -> Option<CodeAction> {
        let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
        for edit in &fix.edits {
            let edits = changes.entry(world.uri(&edit.range.file)?).or_default();
            edits.push(TextEdit::new(lsp_range(&edit.range), edit.text.clone()));
        }
        Some(CodeAction {
            title: fix.title.clone(),
            kind: Some(CodeActionKind::QuickFix),
            diagnostics: Some(vec![self.shown(found, world)]),
            is_preferred: fix.safe.then_some(true),
            edit: Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }),
            ..CodeAction::default()
        })
    }

    /// The change that silences a warning at its line; `None` for an error.
    fn silence(&self, found: &Diagnostic, world: &dyn World) -> Option<CodeAction> {
        let place = found.range.as_ref().filter(|_| found.code.starts_with('W'))?;
        let at = self.text.line_start(self.text.line(place.start.offset));
        // A line within a comment, a text or a directive cannot have a directive before it.
        let is_inside = |t: &&crate::scan::Token| t.start < at && at < t.end;
        if self.scan().tokens.iter().any(|t| is_inside(&t)) {
            return None;
        }
        let spaces = self.text.slice(at, place.start.offset);
        let spaces = spaces.get(..spaces.len() - spaces.trim_start().len()).unwrap_or_default();
        let end = if self.text.as_str().contains("\r\n") { "\r\n" } else { "\n" };
        let edit = TextEdit::new(self.text.range(at, at), format!("{spaces}{SILENCE}{end}"));
        Some(CodeAction {
            title: format!("silence warnings on this line ({})", found.name),
            kind: Some(CodeActionKind::QuickFix),
            diagnostics: Some(vec![self.shown(found, world)]),
            edit: self.changes(vec![edit], world),
            ..CodeAction::default()
        })
    }

    /// Edits of this page's text.
    pub(crate) fn changes(&self, edits: Vec<TextEdit>, world: &dyn World) -> Option<WorkspaceEdit> {
        let changes = HashMap::from([(world.uri(&self.name)?, edits)]);
        Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() })
    }
}
