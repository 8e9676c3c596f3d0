//! Messages in and out.

use crate::answers::{self, Under};
use crate::capabilities::capabilities;
use crate::checker::{FileChanges, WorkspaceChecker};
use crate::complete::complete;
use crate::computed::Computed;
use crate::fixes::fixes;
use crate::graphs::{CheckSettings, is_ron};
use crate::text::{ColumnUnit, LineStarts, changed};
use crate::texts::Texts;
use crate::uri;
use crate::workspace::Workspace;
use crate::{hover, outline, semantic, status};
use lightgraph::Scene;
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph::format::format;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument, DidOpenTextDocument, DidSaveTextDocument,
    Notification as _,
};
use lsp_types::request::{
    CodeActionRequest, CodeLensRefresh, CodeLensRequest, Completion, DocumentSymbolRequest, FoldingRangeRequest,
    Formatting, GotoDefinition, HoverRequest, InlayHintRequest, PrepareRenameRequest, References, RegisterCapability,
    Rename, Request as _, SemanticTokensFullRequest,
};
use lsp_types::{
    DidChangeWatchedFilesRegistrationOptions, FileSystemWatcher, GlobPattern, Hover, HoverContents, InitializeParams,
    InitializeResult, MarkupContent, MarkupKind, PositionEncodingKind, Registration, RegistrationParams, ServerInfo,
    TextDocumentPositionParams, TextEdit, Uri, WorkspaceEdit,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::cell::RefCell;
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread;

/// Serves an editor over the standard streams until it says goodbye.
///
/// # Errors
/// The editor breaks the protocol or goes away without a word.
pub fn serve() -> Result<(), Box<dyn Error>> {
    let (connection, threads) = Connection::stdio();
    run(connection)?;
    threads.join()?;
    Ok(())
}

/// What a user sets in the editor (`initializationOptions`).
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct EditorOptions {
    /// The scene that graphs are checked for, as of `check --scene`.
    scene: Option<PathBuf>,
    /// Folders of shaders besides the usual ones, as of `--shaders`.
    shaders: Vec<PathBuf>,
}

fn run(connection: Connection) -> Result<(), Box<dyn Error>> {
    let (id, params) = connection.initialize_start()?;
    let params: InitializeParams = serde_json::from_value(params)?;
    let encodings = params.capabilities.general.as_ref().and_then(|g| g.position_encodings.clone()).unwrap_or_default();
    let columns = if encodings.contains(&PositionEncodingKind::UTF8) { ColumnUnit::Bytes } else { ColumnUnit::Utf16 };
    let result = InitializeResult {
        capabilities: capabilities(columns),
        server_info: Some(ServerInfo { name: "lightgraph".into(), version: Some(env!("CARGO_PKG_VERSION").into()) }),
    };
    connection.initialize_finish(id, serde_json::to_value(result)?)?;
    let (settings, complaint) = settings(params.initialization_options.as_ref());
    let texts = Arc::new(Texts::default());
    let (changes, heard) = channel();
    let sender = connection.sender.clone();
    // An editor that has gone away hears nothing.
    let send = Box::new(move |message| drop(sender.send(message)));
    let roots = roots(&params);
    let checker = WorkspaceChecker::new(texts.clone(), settings.clone(), roots.clone(), columns, send);
    thread::Builder::new().name("checker".into()).spawn(move || checker.run(&heard))?;
    let workspace = RefCell::new(Workspace::new(texts.clone(), settings.shaders.clone(), roots));
    // Its other end is dropped with the server.
    let (alive, ended) = channel();
    let server = Server {
        _alive: alive,
        connection,
        texts,
        changes,
        columns,
        settings,
        workspace,
        computed: RefCell::default(),
    };
    if let Some(text) = complaint {
        server.say(&text);
    }
    let lenses = params.capabilities.workspace.as_ref().and_then(|w| w.code_lens.as_ref());
    if lenses.and_then(|l| l.refresh_support) == Some(true) {
        let sender = server.connection.sender.clone();
        let refresh = move |turn: u32| {
            let id = RequestId::from(format!("lenses {turn}"));
            sender.send(Request::new(id, CodeLensRefresh::METHOD.into(), ()).into()).is_ok()
        };
        thread::Builder::new().name("runs".into()).spawn(move || status::follow(&ended, refresh))?;
    }
    let watches = params.capabilities.workspace.and_then(|w| w.did_change_watched_files);
    if watches.and_then(|w| w.dynamic_registration) == Some(true) {
        server.watch()?;
    }
    server.listen()
}

/// The folders that the editor has open.
fn roots(params: &InitializeParams) -> Vec<PathBuf> {
    let folders = params.workspace_folders.iter().flatten().filter_map(|f| uri::path(&f.uri)).collect::<Vec<_>>();
    #[expect(deprecated, reason = "editors that know one folder only say it so")]
    let root = params.root_uri.as_ref().and_then(uri::path);
    if folders.is_empty() { root.into_iter().collect() } else { folders }
}

/// The settings, and what is wrong with them.
fn settings(options: Option<&Value>) -> (CheckSettings, Option<String>) {
    let Some(options) = options.filter(|o| !o.is_null()) else { return (CheckSettings::default(), None) };
    let options = match EditorOptions::deserialize(options) {
        Ok(options) => options,
        Err(e) => return (CheckSettings::default(), Some(format!("the settings of lightgraph can't be read: {e}"))),
    };
    let scene = options.scene.as_deref().map(Scene::load);
    let (facts, complaint) = match scene {
        None => (None, None),
        Some(Ok(loaded)) => (Some(loaded.scene.facts()), None),
        Some(Err(faults)) => (None, Some(format!("the scene can't be read: {}", faults.one_line()))),
    };
    (CheckSettings { shaders: options.shaders, facts }, complaint)
}

struct Server {
    _alive: Sender<()>,
    connection: Connection,
    texts: Arc<Texts>,
    changes: Sender<FileChanges>,
    columns: ColumnUnit,
    settings: CheckSettings,
    workspace: RefCell<Workspace>,
    /// What the graph that was asked about last came to.
    computed: RefCell<Option<(PathBuf, Rc<Computed>)>>,
}

/// What an answer can be: the value of a request, or nothing.
type RequestResult = Result<Value, (ErrorCode, String)>;

impl Server {
    fn listen(&self) -> Result<(), Box<dyn Error>> {
        for message in &self.connection.receiver {
            match message {
                Message::Request(request) => {
                    if self.connection.handle_shutdown(&request)? {
                        return Ok(());
                    }
                    let id = request.id.clone();
                    // A panic is a fault of one answer, and no reason to leave the editor alone.
                    let answer = catch_unwind(AssertUnwindSafe(|| self.answer(request)));
                    let failed = |_| Err((ErrorCode::InternalError, "lightgraph has a fault of its own".to_string()));
                    self.reply(id, answer.unwrap_or_else(failed))?;
                }
                Message::Notification(notification) => {
                    let _ = catch_unwind(AssertUnwindSafe(|| self.hear(notification)));
                }
                Message::Response(_) => {}
            }
        }
        Ok(())
    }

    fn reply(&self, id: RequestId, answer: RequestResult) -> Result<(), Box<dyn Error>> {
        let response = match answer {
            Ok(value) => Response::new_ok(id, value),
            Err((code, message)) => Response::new_err(id, code as i32, message),
        };
        Ok(self.connection.sender.send(response.into())?)
    }

    /// Asks the editor to tell of files that others write.
    fn watch(&self) -> Result<(), Box<dyn Error>> {
        let globs = ["**/*.ron", "**/*.wgsl"];
        let watcher = |glob: &str| FileSystemWatcher { glob_pattern: GlobPattern::String(glob.into()), kind: None };
        let options = DidChangeWatchedFilesRegistrationOptions { watchers: globs.map(watcher).into() };
        let registration = Registration {
            id: "files".into(),
            method: DidChangeWatchedFiles::METHOD.into(),
            register_options: Some(serde_json::to_value(options)?),
        };
        let params = RegistrationParams { registrations: vec![registration] };
        let request = Request::new(RequestId::from("watch".to_string()), RegisterCapability::METHOD.into(), params);
        Ok(self.connection.sender.send(request.into())?)
    }

    /// Shows the user a line.
    fn say(&self, text: &str) {
        let params = serde_json::json!({ "type": 2, "message": text });
        // An editor that has gone away shows nothing.
        let _ = self.connection.sender.send(Notification::new("window/showMessage".into(), params).into());
    }

    fn hear(&self, notification: Notification) {
        let mut change = FileChanges::default();
        match notification.method.as_str() {
            DidOpenTextDocument::METHOD => {
                let Some(p) = read::<lsp_types::DidOpenTextDocumentParams>(notification.params) else { return };
                let Some(path) = uri::path(&p.text_document.uri) else { return };
                self.texts.set(&path, p.text_document.text, p.text_document.version);
                change.documents.insert(path);
            }
            DidChangeTextDocument::METHOD => {
                let Some(p) = read::<lsp_types::DidChangeTextDocumentParams>(notification.params) else { return };
                let Some(path) = uri::path(&p.text_document.uri) else { return };
                for edit in p.content_changes {
                    let Some(document) = self.texts.document(&path) else { return };
                    let text = changed(&document.source, edit, self.columns);
                    self.texts.set(&path, text, p.text_document.version);
                }
                change.documents.insert(path);
            }
            DidCloseTextDocument::METHOD => {
                let Some(p) = read::<lsp_types::DidCloseTextDocumentParams>(notification.params) else { return };
                let Some(path) = uri::path(&p.text_document.uri) else { return };
                self.texts.close(&path);
                change.documents.insert(path);
            }
            DidSaveTextDocument::METHOD => {
                let Some(p) = read::<lsp_types::DidSaveTextDocumentParams>(notification.params) else { return };
                if let Some(path) = uri::path(&p.text_document.uri) {
                    self.texts.forget(&path);
                }
                return;
            }
            DidChangeWatchedFiles::METHOD => {
                let Some(p) = read::<lsp_types::DidChangeWatchedFilesParams>(notification.params) else { return };
                let files: Vec<PathBuf> = p.changes.iter().filter_map(|c| uri::path(&c.uri)).collect();
                files.iter().for_each(|f| self.texts.forget(f));
                // A document that is open counts, whatever is written under it.
                self.workspace.borrow_mut().forget();
                change.disk = files.iter().any(|f| self.texts.document(f).is_none());
            }
            _ => return,
        }
        self.computed.replace(None);
        self.workspace.borrow_mut().changed();
        // The checker works as long as the server.
        let _ = self.changes.send(change);
    }

    fn answer(&self, request: Request) -> RequestResult {
        let params = request.params;
        match request.method.as_str() {
            Formatting::METHOD => {
                let p: lsp_types::DocumentFormattingParams = wanted(params)?;
                result(self.document(&p.text_document.uri).and_then(|(path, source)| self.format(&path, &source)))
            }
            Completion::METHOD => {
                let p: lsp_types::CompletionParams = wanted(params)?;
                let at = p.text_document_position;
                let found = self.document(&at.text_document.uri).map(|(path, source)| {
                    let byte = LineStarts::new(&source, self.columns).byte(at.position);
                    complete(&mut self.workspace.borrow_mut(), &path, &source, byte, self.columns)
                });
                result(found)
            }
            HoverRequest::METHOD => {
                let p: lsp_types::HoverParams = wanted(params)?;
                result(self.hover(&p.text_document_position_params))
            }
            DocumentSymbolRequest::METHOD => {
                let p: lsp_types::DocumentSymbolParams = wanted(params)?;
                result(self.lines(&p.text_document.uri).map(|(path, lines)| outline::symbols(&path, &lines)))
            }
            FoldingRangeRequest::METHOD => {
                let p: lsp_types::FoldingRangeParams = wanted(params)?;
                result(self.lines(&p.text_document.uri).map(|(path, lines)| outline::folds(&path, &lines)))
            }
            InlayHintRequest::METHOD => {
                let p: lsp_types::InlayHintParams = wanted(params)?;
                let hints = self.lines(&p.text_document.uri).filter(|(path, _)| is_ron(path)).map(|(path, lines)| {
                    let within = lines.byte(p.range.start)..lines.byte(p.range.end) + 1;
                    outline::hints(&lines, &self.computed(&path), &within)
                });
                result(hints)
            }
            CodeLensRequest::METHOD => {
                let p: lsp_types::CodeLensParams = wanted(params)?;
                let lines = self.lines(&p.text_document.uri).filter(|(path, _)| is_ron(path));
                result(lines.map(|(path, lines)| outline::lenses(&path, &lines)))
            }
            SemanticTokensFullRequest::METHOD => {
                let p: lsp_types::SemanticTokensParams = wanted(params)?;
                let lines = self.lines(&p.text_document.uri).filter(|(path, _)| is_ron(path));
                result(lines.map(|(_, lines)| semantic::tokens(&lines)))
            }
            CodeActionRequest::METHOD => {
                let p: lsp_types::CodeActionParams = wanted(params)?;
                let uri = &p.text_document.uri;
                result(self.lines(uri).map(|(_, lines)| fixes(uri, &lines, p.context.diagnostics)))
            }
            GotoDefinition::METHOD => {
                let p: lsp_types::GotoDefinitionParams = wanted(params)?;
                let found = self.under(&p.text_document_position_params).map(|(path, under)| {
                    let mut workspace = self.workspace.borrow_mut();
                    let places = answers::definition(&mut workspace, &path, &under);
                    answers::locations(&mut workspace, &places, self.columns)
                });
                result(found)
            }
            References::METHOD => {
                let p: lsp_types::ReferenceParams = wanted(params)?;
                let found = self.under(&p.text_document_position).map(|(_, under)| {
                    let mut workspace = self.workspace.borrow_mut();
                    let symbols = workspace.closure(&under.symbol);
                    let places = workspace.places(&symbols).into_iter();
                    let places: Vec<_> =
                        places.filter(|place| p.context.include_declaration || !place.declares).collect();
                    answers::locations(&mut workspace, &places, self.columns)
                });
                result(found)
            }
            PrepareRenameRequest::METHOD => {
                let p: TextDocumentPositionParams = wanted(params)?;
                let found = self.under(&p).and_then(|(path, under)| {
                    answers::renamable(&mut self.workspace.borrow_mut(), &under, &path, self.columns)
                });
                result(found)
            }
            Rename::METHOD => {
                let p: lsp_types::RenameParams = wanted(params)?;
                let failed = |why: String| (ErrorCode::RequestFailed, why);
                let (_, under) =
                    self.under(&p.text_document_position).ok_or_else(|| failed("no name stands here".into()))?;
                let mut workspace = self.workspace.borrow_mut();
                let edits = answers::rename(&mut workspace, &under, &p.new_name, &self.settings, self.columns)
                    .map_err(failed)?;
                result(WorkspaceEdit { changes: Some(edits.into_iter().collect()), ..WorkspaceEdit::default() })
            }
            other => Err((ErrorCode::MethodNotFound, format!("unknown request `{other}`"))),
        }
    }

    fn document(&self, uri: &Uri) -> Option<(PathBuf, Arc<Source>)> {
        let path = uri::path(uri)?;
        let source = self.texts.read(&path).ok()?;
        Some((path, source))
    }

    fn lines(&self, uri: &Uri) -> Option<(PathBuf, LineStarts)> {
        let (path, source) = self.document(uri)?;
        Some((path, LineStarts::new(&source, self.columns)))
    }

    /// What a graph comes to, computed once until something changes.
    fn computed(&self, graph: &Path) -> Rc<Computed> {
        if let Some((path, computed)) = &*self.computed.borrow()
            && path == graph
        {
            return computed.clone();
        }
        let sources = self.workspace.borrow_mut().sources(graph);
        let computed = Rc::new(Computed::new(graph, &self.settings, &self.texts, &sources));
        self.computed.replace(Some((graph.into(), computed.clone())));
        computed
    }

    fn hover(&self, at: &TextDocumentPositionParams) -> Option<Hover> {
        let (path, lines) = self.lines(&at.text_document.uri)?;
        let byte = lines.byte(at.position);
        let language = if is_ron(&path) { hover::of_language(&lines.source, byte) } else { None };
        let (text, range) = match language {
            Some(text) => (text, None),
            None => {
                let (path, under) = self.under(at)?;
                let graph = if is_ron(&path) { Some(path.clone()) } else { self.workspace.borrow_mut().user(&path) };
                let computed = graph.map(|graph| self.computed(&graph));
                let mut workspace = self.workspace.borrow_mut();
                let text = hover::of_symbol(&mut workspace, &path, &under.symbol, computed.as_deref())?;
                (text, Some(lines.range(&under.range)))
            }
        };
        let contents = HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value: text });
        Some(Hover { contents, range })
    }

    /// What stands under a cursor, and the file.
    fn under(&self, at: &TextDocumentPositionParams) -> Option<(PathBuf, Under)> {
        let (path, source) = self.document(&at.text_document.uri)?;
        let byte = LineStarts::new(&source, self.columns).byte(at.position);
        let under = answers::under(&mut self.workspace.borrow_mut(), &path, byte)?;
        Some((path, under))
    }

    /// The edit that brings a RON file into the one layout; `None` where it can't be read.
    fn format(&self, path: &Path, source: &Arc<Source>) -> Option<Vec<TextEdit>> {
        let text = format(source).ok().filter(|_| is_ron(path))?;
        Some(edit(source, text, self.columns).into_iter().collect())
    }
}

/// The edit of the lines that differ, so that cursors elsewhere stay.
fn edit(source: &Arc<Source>, new: String, columns: ColumnUnit) -> Option<TextEdit> {
    let old = &source.text;
    if *old == new {
        return None;
    }
    let same = |a: &mut dyn Iterator<Item = &'_ str>, b: &mut dyn Iterator<Item = &'_ str>| -> usize {
        a.zip(b).take_while(|(x, y)| x == y).map(|(x, _)| x.len()).sum()
    };
    let start = same(&mut old.split_inclusive('\n'), &mut new.split_inclusive('\n'));
    let (left, right) = (&old[start..], &new[start..]);
    let behind = same(&mut left.split_inclusive('\n').rev(), &mut right.split_inclusive('\n').rev());
    let range = LineStarts::new(source, columns).range(&(start..old.len() - behind));
    Some(TextEdit { range, new_text: right[..right.len() - behind].into() })
}

fn read<P: DeserializeOwned>(params: Value) -> Option<P> {
    serde_json::from_value(params).ok()
}

fn wanted<P: DeserializeOwned>(params: Value) -> Result<P, (ErrorCode, String)> {
    serde_json::from_value(params).map_err(|e| (ErrorCode::InvalidParams, e.to_string()))
}

fn result<R: serde::Serialize>(result: R) -> RequestResult {
    serde_json::to_value(result).map_err(|e| (ErrorCode::InternalError, e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edit_holds_the_lines_that_differ() {
        for (old, new) in
            [("a\nb\nc\n", "a\nB\nc\n"), ("a\na\n", "a\n"), ("a", "a\n"), ("", "x\n"), ("x\ny", "x\nü\ny\n")]
        {
            let source = Source::new("a.ron", old);
            let edit = edit(&source, new.into(), ColumnUnit::Utf16).unwrap();
            let change = lsp_types::TextDocumentContentChangeEvent {
                range: Some(edit.range),
                range_length: None,
                text: edit.new_text,
            };
            assert_eq!(changed(&source, change, ColumnUnit::Utf16), new);
        }
        assert_eq!(edit(&Source::new("a.ron", "a"), "a".into(), ColumnUnit::Bytes), None);
    }
}
