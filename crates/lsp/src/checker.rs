//! The faults of every graph that an open document is part of, on a thread of its own.
//!
//! A change marks the graphs with the changed file; they are checked one after the other, those nearest to the change
//! first, and what is known is told after each. A change that comes meanwhile starts it over with what is left.

use crate::graphs::{self, CheckSettings, Opened, is_ron, may_be_graph};
use crate::text::ColumnUnit;
use crate::texts::Texts;
use crate::told::ProtocolFaults;
use crate::uri;
use lightgraph::internals::graph::tree;
use lightgraph::internals::shader::{Library, survey};
use lightgraph::internals::value::Values;
use lightgraph::{Diagnostic, Faults};
use lsp_server::{Message, Notification};
use lsp_types::PublishDiagnosticsParams;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};

/// What has happened to files.
#[derive(Debug, Default)]
pub struct FileChanges {
    /// Open documents that were opened, edited or closed.
    pub documents: BTreeSet<PathBuf>,
    /// Files came, went or were written by others: everything is looked at anew.
    pub disk: bool,
}

/// What sends messages to the editor. One that has gone away hears nothing.
pub type Send = Box<dyn Fn(Message) + std::marker::Send>;

pub struct WorkspaceChecker {
    texts: Arc<Texts>,
    settings: CheckSettings,
    roots: Vec<PathBuf>,
    columns: ColumnUnit,
    send: Send,
    /// The texts of the last graph, with all that was made of them.
    sources: Library,
    graphs: BTreeMap<PathBuf, CheckedGraph>,
    /// Graphs of the workspace, once they were searched.
    found: Option<BTreeSet<PathBuf>>,
    /// Documents that changed since all was checked.
    edited: BTreeSet<PathBuf>,
    /// Versions of the open documents as they were when they were last marked.
    versions: BTreeMap<PathBuf, i32>,
    /// The names by which open shaders are imported.
    modules: BTreeMap<PathBuf, Option<String>>,
    published: BTreeMap<PathBuf, Vec<lsp_types::Diagnostic>>,
}

/// A graph; what is `None` is to be made.
#[derive(Debug, Default)]
struct CheckedGraph {
    opened: Option<Opened>,
    faults: Option<Vec<Diagnostic>>,
}

/// Diagnostics of one file told at most.
const MOST_TOLD: usize = 1000;

impl WorkspaceChecker {
    pub fn new(
        texts: Arc<Texts>,
        settings: CheckSettings,
        roots: Vec<PathBuf>,
        columns: ColumnUnit,
        send: Send,
    ) -> WorkspaceChecker {
        WorkspaceChecker {
            texts,
            settings,
            roots,
            columns,
            send,
            sources: Library::default(),
            graphs: BTreeMap::new(),
            found: None,
            edited: BTreeSet::new(),
            versions: BTreeMap::new(),
            modules: BTreeMap::new(),
            published: BTreeMap::new(),
        }
    }

    /// Works until nobody can tell of changes any more.
    pub fn run(mut self, changes: &Receiver<FileChanges>) {
        while let Ok(change) = changes.recv() {
            self.mark(change);
            loop {
                match changes.try_recv() {
                    Ok(change) => self.mark(change),
                    Err(TryRecvError::Disconnected) => return,
                    Err(TryRecvError::Empty) => match self.work(changes) {
                        Some(change) => self.mark(change),
                        None => break,
                    },
                }
            }
        }
    }

    /// Forgets what a change makes untrue.
    fn mark(&mut self, change: FileChanges) {
        if change.disk {
            self.found = None;
        }
        // Another name of a module may be the one that any graph looks for.
        let renamed: Vec<bool> = change.documents.iter().map(|p| self.renames(p)).collect();
        if change.disk || renamed.contains(&true) {
            self.graphs.clear();
        }
        for (path, known) in &mut self.graphs {
            let made_of = |file: &PathBuf| known.opened.as_ref().is_some_and(|o| o.files.contains(file));
            if change.documents.contains(path) || change.documents.iter().any(made_of) {
                *known = CheckedGraph::default();
            }
        }
        for path in change.documents {
            match self.texts.document(&path) {
                Some(document) => drop(self.versions.insert(path.clone(), document.version)),
                None => drop(self.versions.remove(&path)),
            }
            self.edited.insert(path);
        }
    }

    /// Whether a shader has another name to import it by than before.
    fn renames(&mut self, path: &Path) -> bool {
        if is_ron(path) {
            return false;
        }
        let name = self.texts.read(path).ok().and_then(|source| survey(&source).module).map(|m| m.0);
        self.modules.insert(path.into(), name.clone()).is_some_and(|before| before != name)
    }

    /// Checks what is to be checked. Returns a change that came before its end.
    fn work(&mut self, changes: &Receiver<FileChanges>) -> Option<FileChanges> {
        let open = self.texts.open();
        let mut first: Vec<PathBuf> = open.iter().filter(|p| self.is_graph(p)).cloned().collect();
        // What is edited comes before what is only open.
        first.sort_by_key(|p| !self.edited.contains(p));
        for path in &first {
            if self.check(path) {
                self.publish(false);
                if let Ok(change) = changes.try_recv() {
                    return Some(change);
                }
            }
        }
        let found = self.found.get_or_insert_with(|| graphs::find(&self.roots, &self.texts)).clone();
        let mut wanted: BTreeSet<PathBuf> = first.into_iter().collect();
        for path in found.difference(&wanted.clone()) {
            let files = &self.open(path).files;
            if open.iter().any(|document| files.contains(document)) {
                wanted.insert(path.clone());
                if self.check(path) {
                    self.publish(false);
                }
            }
            if let Ok(change) = changes.try_recv() {
                return Some(change);
            }
        }
        self.graphs.retain(|path, _| wanted.contains(path) || found.contains(path));
        for known in self.graphs.iter_mut().filter(|(path, _)| !wanted.contains(*path)).map(|g| g.1) {
            known.faults = None;
        }
        self.publish(true);
        None
    }

    fn is_graph(&self, path: &Path) -> bool {
        is_ron(path) && self.texts.document(path).is_some_and(|d| may_be_graph(&d.source.text))
    }

    fn open(&mut self, path: &Path) -> &Opened {
        let known = self.graphs.entry(path.into()).or_default();
        known.opened.get_or_insert_with(|| {
            let opened = guarded(path, || graphs::open(path, &self.settings, &self.texts, &self.sources));
            let opened = opened.unwrap_or_else(|d| Opened { project: Err(vec![d]), files: [path.into()].into() });
            if let Ok(project) = &opened.project {
                self.sources = project.texts.clone();
            }
            opened
        })
    }

    /// Makes the faults of a graph. False when they were known.
    fn check(&mut self, path: &Path) -> bool {
        if self.graphs.get(path).is_some_and(|known| known.faults.is_some()) {
            return false;
        }
        let facts = self.settings.all_facts();
        let faults = match self.open(path).project.clone() {
            Err(faults) => faults,
            Ok(project) => guarded(path, || project.faults(&Values::new(), &facts)).unwrap_or_else(|d| vec![d]),
        };
        self.graphs.entry(path.into()).or_default().faults = Some(faults);
        true
    }

    /// Tells the editor what has changed of the faults of each file. `settled`: nothing is left to check.
    fn publish(&mut self, settled: bool) {
        let mut all = self.told();
        let gone: Vec<PathBuf> = self.published.keys().filter(|p| !all.contains_key(*p)).cloned().collect();
        all.extend(gone.into_iter().map(|path| (path, vec![])));
        // That an edit has no faults is told too.
        let checked = |p: &&PathBuf| settled || self.graphs.get(*p).is_some_and(|g| g.faults.is_some());
        let edited: BTreeSet<PathBuf> = self.edited.iter().filter(checked).cloned().collect();
        for path in edited.iter().filter(|p| self.texts.document(p).is_some()) {
            all.entry(path.clone()).or_default();
        }
        // What is edited comes last: when it is told, all else is.
        let (last, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|(path, _)| edited.contains(path));
        for (path, diagnostics) in others.into_iter().chain(last) {
            if self.published.get(&path) == Some(&diagnostics) && !edited.contains(&path) {
                continue;
            }
            let Some(uri) = uri::of(&path) else { continue };
            let version = self.versions.get(&path).copied();
            // A later version waits to be checked.
            if self.texts.document(&path).map(|d| d.version) != version {
                continue;
            }
            let params = PublishDiagnosticsParams { uri, diagnostics: diagnostics.clone(), version };
            (self.send)(Notification::new("textDocument/publishDiagnostics".into(), params).into());
            match diagnostics.is_empty() {
                true => drop(self.published.remove(&path)),
                false => drop(self.published.insert(path, diagnostics)),
            }
        }
        self.edited.retain(|path| !settled && !edited.contains(path));
    }

    /// The faults of all graphs, by the file in which each has its place.
    fn told(&self) -> BTreeMap<PathBuf, Vec<lsp_types::Diagnostic>> {
        let mut all: BTreeMap<PathBuf, Vec<lsp_types::Diagnostic>> = BTreeMap::new();
        let mut told = ProtocolFaults::new(self.columns);
        let mut tell = |graph: &Path, d: &Diagnostic| {
            let (path, diagnostic) = told.diagnostic(graph, d);
            let of_file = all.entry(path).or_default();
            if of_file.len() < MOST_TOLD && !of_file.contains(&diagnostic) {
                of_file.push(diagnostic);
            }
        };
        for (graph, known) in &self.graphs {
            let current = |d: &&Diagnostic| d.labels.iter().all(|l| self.texts.is_current(&l.0.source));
            known.faults.iter().flatten().filter(current).for_each(|d| tell(graph, d));
        }
        for path in self.texts.open().iter().filter(|p| is_ron(p) && !self.is_graph(p)) {
            let document = self.texts.document(path);
            if let Some(Err(Faults(faults))) = document.map(|d| tree::parse(&d.source)) {
                faults.iter().for_each(|d| tell(path, d));
            }
        }
        all
    }
}

/// A panic of the checker is a fault to report, and no reason to leave the editor alone.
fn guarded<T>(graph: &Path, work: impl FnOnce() -> T) -> Result<T, Diagnostic> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| {
        let d = Diagnostic::error(format!("{} can't be checked: lightgraph has a fault of its own", graph.display()));
        d.help("report it with this file")
    })
}
