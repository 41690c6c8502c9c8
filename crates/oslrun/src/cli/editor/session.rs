//! The open texts, and the answers to the requests about them.

use super::desk::{Buffers, Desk, name_of};
use super::probe;
use super::settings::Settings;
use gen_lsp_types as lsp;
use gen_lsp_types::{Position, PublishDiagnosticsParams, Range, TextDocumentContentChangeEvent, Uri};
use osl_editor::{Page, Text};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Why a request has no answer.
#[derive(Debug)]
pub(super) enum Stop {
    /// There is no such request.
    Unknown,
    /// Its parameters are wrong.
    Params(String),
    /// It is refused; the text says why.
    Failed(String),
    /// The server has a mistake.
    Internal(String),
}

/// Diagnostics by the name of the file.
type Found = BTreeMap<String, Vec<lsp::Diagnostic>>;

/// An open text.
struct Open {
    version: i32,
    text: Text,
    /// The text with its analysis, unless it changed since.
    page: Option<Page>,
    /// Whether its diagnostics are to be reported.
    changed: bool,
    /// The files that it was made of.
    files: BTreeSet<String>,
    /// What its last analysis found.
    found: Found,
    /// The values of the probed pixel, unless the text changed since.
    values: Option<Vec<(u32, String)>>,
}

/// A session with an editor.
pub(super) struct Session {
    settings: Settings,
    /// The open texts, by the names of their files.
    open: BTreeMap<String, Open>,
    buffers: Buffers,
    /// Whether the editor asks again for hints when it is told to.
    pub(super) refreshes: bool,
    /// Whether hints changed although their text did not.
    pub(super) stale_hints: bool,
}

/// What the server can do.
pub(super) fn capabilities() -> Value {
    json!({
        "positionEncoding": "utf-16",
        "textDocumentSync": { "openClose": true, "change": 2, "save": true },
        "hoverProvider": true,
        "completionProvider": { "triggerCharacters": [".", "\"", "#", "<"] },
        "signatureHelpProvider": { "triggerCharacters": ["(", ","] },
        "definitionProvider": true,
        "referencesProvider": true,
        "documentHighlightProvider": true,
        "documentSymbolProvider": true,
        "codeActionProvider": { "codeActionKinds": ["quickfix", "source.fixAll.oslrun"] },
        "documentFormattingProvider": true,
        "documentRangeFormattingProvider": true,
        "renameProvider": { "prepareProvider": true },
        "documentLinkProvider": {},
        "colorProvider": true,
        "foldingRangeProvider": true,
        "selectionRangeProvider": true,
        "semanticTokensProvider": { "legend": osl_editor::legend(), "range": true, "full": true },
        "inlayHintProvider": true,
    })
}

/// The parameters of requests about a text: those that each has, and those that some have.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asked {
    text_document: lsp::TextDocumentIdentifier,
    position: Option<Position>,
    range: Option<Range>,
}

impl Asked {
    fn position(&self) -> Result<Position, Stop> {
        self.position.ok_or_else(|| Stop::Params("there is no position".to_string()))
    }

    fn range(&self) -> Result<Range, Stop> {
        self.range.ok_or_else(|| Stop::Params("there is no range".to_string()))
    }
}

impl Session {
    pub(super) fn new(settings: Settings) -> Session {
        let (open, buffers) = (BTreeMap::new(), Buffers::new());
        Session { settings, open, buffers, refreshes: false, stale_hints: false }
    }

    /// Takes settings.
    pub(super) fn configure(&mut self, sent: &Value) -> Result<(), String> {
        let result = self.settings.read(sent);
        self.stale_hints = true;
        self.touch(|_| true);
        result
    }

    /// Has texts checked again.
    fn touch(&mut self, which: impl Fn(&Open) -> bool) {
        for open in self.open.values_mut().filter(|open| which(open)) {
            (open.page, open.values, open.changed) = (None, None, true);
        }
    }

    /// Checks a changed text and returns what is to be reported; `None` if no text changed.
    pub(super) fn check_one(&mut self) -> Option<Vec<PublishDiagnosticsParams>> {
        let name = self.open.iter().find(|(_, open)| open.changed).map(|(name, _)| name.clone())?;
        let desk = Desk { buffers: &self.buffers, settings: &self.settings };
        let open = self.open.get_mut(&name)?;
        // Set first: a text that cannot be checked is not tried again and again.
        open.changed = false;
        let page = fresh(open, &name, &desk);
        let found = page.diagnostics(&desk);
        open.files = page.analysis.files().map(|(file, _)| file.to_string()).collect();
        let before = std::mem::replace(&mut open.found, found);
        let included = open.files.iter().filter(|file| self.buffers.contains_key(*file));
        let files = before.into_keys().chain(open.found.keys().cloned()).chain(included.cloned()).collect();
        Some(self.reports(files))
    }

    /// What is to be reported about files. A header that a shader includes has the diagnostics of the shader,
    /// and none as a text of its own. It is left to an includer that is to be checked.
    fn reports(&self, files: BTreeSet<String>) -> Vec<PublishDiagnosticsParams> {
        let desk = Desk { buffers: &self.buffers, settings: &self.settings };
        let report = |file: String| {
            let uri = osl_editor::World::uri(&desk, &file)?;
            let includes = |(name, open): &(&String, &Open)| **name != file && open.files.contains(&file);
            let is_included = self.open.iter().any(|entry| includes(&entry));
            // What an includer found before its last change is about another text: it reports again.
            if self.open.iter().any(|entry| includes(&entry) && entry.1.changed) {
                return None;
            }
            let mut diagnostics: Vec<lsp::Diagnostic> = Vec::new();
            for (_, open) in self.open.iter().filter(|(name, _)| !(is_included && **name == file)) {
                for found in open.found.get(&file).into_iter().flatten() {
                    if !diagnostics.contains(found) {
                        diagnostics.push(found.clone());
                    }
                }
            }
            let version = self.open.get(&file).map(|open| open.version);
            Some(PublishDiagnosticsParams { uri, version, diagnostics })
        };
        files.into_iter().filter_map(report).collect()
    }

    /// Takes a notification, and returns what is to be reported at once.
    pub(super) fn note(
        &mut self,
        method: &str,
        params: Value,
    ) -> Result<Vec<PublishDiagnosticsParams>, Stop> {
        match method {
            "textDocument/didOpen" => {
                let lsp::DidOpenTextDocumentParams { text_document: document } = read(params)?;
                let text = Text::new(document.text);
                self.put(&document.uri, document.version, text);
            }
            "textDocument/didChange" => {
                let change: lsp::DidChangeTextDocumentParams = read(params)?;
                let uri = change.text_document.text_document_identifier.uri;
                let (name, version) = (name_of(&uri), change.text_document.version);
                let open = self.open.get_mut(&name).ok_or_else(not_open)?;
                // A change of an older text would be applied to the wrong one.
                if version < open.version {
                    return Err(Stop::Params(format!("version {version} comes after {}", open.version)));
                }
                let mut text = open.text.clone();
                for change in change.content_changes {
                    match change {
                        TextDocumentContentChangeEvent::TextDocumentContentChangePartial(part) => {
                            text.edit(Some(part.range), &part.text);
                        }
                        TextDocumentContentChangeEvent::TextDocumentContentChangeWholeDocument(whole) => {
                            text.edit(None, &whole.text);
                        }
                    }
                }
                self.put(&uri, version, text);
            }
            "textDocument/didClose" => {
                let lsp::DidCloseTextDocumentParams { text_document: document } = read(params)?;
                let name = name_of(&document.uri);
                let closed = self.open.remove(&name).ok_or_else(not_open)?;
                let mut files: BTreeSet<String> = closed.found.into_keys().collect();
                files.extend(closed.files.into_iter().filter(|file| self.buffers.contains_key(file)));
                files.insert(name.clone());
                let reports = self.reports(files);
                self.buffers.remove(&name);
                self.touch(|open| open.files.contains(&name));
                return Ok(reports);
            }
            // Headers may have changed.
            "textDocument/didSave" | "workspace/didChangeWatchedFiles" => self.touch(|_| true),
            "workspace/didChangeConfiguration" => {
                let settings = params.get("settings").unwrap_or(&Value::Null);
                self.configure(settings).map_err(Stop::Params)?;
            }
            _ => return Err(Stop::Unknown),
        }
        Ok(Vec::new())
    }

    /// Opens or changes a text; texts that include it are checked again.
    fn put(&mut self, uri: &Uri, version: i32, text: Text) {
        let name = name_of(uri);
        self.buffers.insert(name.clone(), (uri.clone(), text.as_str().into()));
        let old = self.open.remove(&name);
        let (files, found) = old.map_or_else(Default::default, |old| (old.files, old.found));
        let new = Open { version, text, page: None, changed: true, files, found, values: None };
        self.touch(|open| open.files.contains(&name));
        self.open.insert(name, new);
    }

    /// The answer to a request.
    pub(super) fn answer(&mut self, method: &str, params: Value) -> Result<Value, Stop> {
        if method == "textDocument/colorPresentation" {
            let asked: lsp::ColorPresentationParams = read(params)?;
            return sent(osl_editor::presentations(&asked.color, asked.range));
        }
        if !method.starts_with("textDocument/") {
            return Err(Stop::Unknown);
        }
        let asked: Asked = read(params.clone())?;
        let name = name_of(&asked.text_document.uri);
        let desk = Desk { buffers: &self.buffers, settings: &self.settings };
        let open = self.open.get_mut(&name).ok_or_else(not_open)?;
        if method == "textDocument/references" {
            let with = params.pointer("/context/includeDeclaration") != Some(&Value::Bool(false));
            return self.references(&name, asked.position()?, with);
        }
        if method == "textDocument/inlayHint" && open.values.is_none() {
            let values = |probe| probe::values(&desk, &name, open.text.as_str(), probe);
            open.values = Some(self.settings.asked.probe.map(values).unwrap_or_default());
        }
        let values = open.values.clone().unwrap_or_default();
        let page = fresh(open, &name, &desk);
        let limits = &self.settings.reading.limits;
        match method.trim_start_matches("textDocument/") {
            "hover" => sent(page.hover(asked.position()?, &desk)),
            "completion" => sent(page.completion(asked.position()?, &desk)),
            "signatureHelp" => sent(page.signature_help(asked.position()?)),
            "definition" => sent(page.definition(asked.position()?, &desk)),
            "documentHighlight" => sent(page.highlights(asked.position()?)),
            "documentSymbol" => sent(page.outline()),
            "codeAction" => {
                let asked: lsp::CodeActionParams = read(params)?;
                sent(page.actions(asked.range, asked.context.only.as_deref(), &desk))
            }
            "formatting" => sent(page.formatted(None, limits).map_err(Stop::Failed)?),
            "rangeFormatting" => sent(page.formatted(Some(asked.range()?), limits).map_err(Stop::Failed)?),
            "prepareRename" => {
                let (range, placeholder) = page.renamable(asked.position()?).map_err(Stop::Failed)?;
                sent(lsp::PrepareRenamePlaceholder { range, placeholder })
            }
            "rename" => {
                let new: String = read(params.get("newName").cloned().unwrap_or_default())?;
                sent(page.rename(asked.position()?, &new, &desk).map_err(Stop::Failed)?)
            }
            "documentLink" => sent(page.links(&desk)),
            "documentColor" => sent(page.colors()),
            "foldingRange" => sent(page.folds()),
            "selectionRange" => {
                let asked: lsp::SelectionRangeParams = read(params)?;
                sent(page.selections(&asked.positions))
            }
            "semanticTokens/full" => sent(page.semantic_tokens(None)),
            "semanticTokens/range" => sent(page.semantic_tokens(Some(asked.range()?))),
            "inlayHint" => sent(page.hints(asked.range()?, self.settings.hints(), &values)),
            _ => Err(Stop::Unknown),
        }
    }

    /// The places in all open texts that name the same as a position of one of them.
    fn references(&mut self, name: &str, position: Position, declared: bool) -> Result<Value, Stop> {
        let desk = Desk { buffers: &self.buffers, settings: &self.settings };
        let open = self.open.get_mut(name).ok_or_else(not_open)?;
        let Some(target) = fresh(open, name, &desk).target(position) else { return Ok(json!([])) };
        let mut places: Vec<lsp::Location> = Vec::new();
        for (name, open) in &mut self.open {
            for place in fresh(open, name, &desk).references(&target, declared, &desk) {
                if !places.contains(&place) {
                    places.push(place);
                }
            }
        }
        sent(places)
    }
}

/// The page of a text, checked again if it changed.
fn fresh<'o>(open: &'o mut Open, name: &str, desk: &Desk<'_>) -> &'o Page {
    let text = &open.text;
    open.page.get_or_insert_with(|| Page::new(name, text.clone(), desk))
}

fn not_open() -> Stop {
    Stop::Params("the text is not open".to_string())
}

fn read<T: DeserializeOwned>(params: Value) -> Result<T, Stop> {
    serde_json::from_value(params).map_err(|why| Stop::Params(why.to_string()))
}

fn sent(answer: impl Serialize) -> Result<Value, Stop> {
    serde_json::to_value(answer).map_err(|why| Stop::Internal(why.to_string()))
}
