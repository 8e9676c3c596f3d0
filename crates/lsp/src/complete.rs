//! What may stand at a cursor: keys, kinds, words, names and files.

use crate::answers::shader_of;
use crate::graphs::is_ron;
use crate::ron::{Bracket, StructKind, TokenShape, WordRole, role, thing, walk};
use crate::symbols::Symbol;
use crate::text::{ColumnUnit, LineStarts};
use crate::words::{self, Word, choices, section, word};
use crate::workspace::Workspace;
use lightgraph::internals::diag::Source;
use lightgraph::internals::shader::Library;
use lsp_types::{CompletionItem, CompletionItemKind, CompletionTextEdit, Documentation, TextEdit};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Proposals at most.
const MOST: usize = 2000;

/// What may stand at a byte of a document.
pub fn complete(
    workspace: &mut Workspace,
    path: &Path,
    source: &Arc<Source>,
    byte: usize,
    columns: ColumnUnit,
) -> Vec<CompletionItem> {
    let mut offer = Offer { items: vec![], seen: BTreeSet::new() };
    let before = &source.text[..byte];
    let line = before.rsplit('\n').next().unwrap_or("");
    let start = if is_ron(path) {
        if line.trim_start().starts_with("//") {
            return vec![];
        }
        GraphCompletion { workspace, path, offer: &mut offer }.complete(before, byte)
    } else {
        shader(workspace, path, line, &mut offer);
        byte - tail(before, |c| c.is_alphanumeric() || c == '_').len()
    };
    let range = LineStarts::new(source, columns).range(&(start..byte));
    for item in &mut offer.items {
        let new_text = item.insert_text.take().unwrap_or_else(|| item.label.clone());
        item.text_edit = Some(CompletionTextEdit::Edit(TextEdit { range, new_text }));
    }
    offer.items
}

/// The end of a text of such characters.
fn tail(text: &str, part: impl Fn(char) -> bool) -> &str {
    let start = text.rfind(|c| !part(c)).map_or(0, |at| at + text[at..].chars().next().map_or(0, char::len_utf8));
    &text[start..]
}

struct Offer {
    items: Vec<CompletionItem>,
    seen: BTreeSet<String>,
}

impl Offer {
    fn add(&mut self, label: &str, kind: CompletionItemKind, detail: &str, about: &str, insert: Option<String>) {
        if self.items.len() < MOST && !label.is_empty() && self.seen.insert(label.into()) {
            self.items.push(CompletionItem {
                label: label.into(),
                kind: Some(kind),
                detail: Some(detail.to_string()).filter(|d| !d.is_empty()),
                documentation: Some(Documentation::String(about.into())).filter(|_| !about.is_empty()),
                insert_text: insert,
                ..CompletionItem::default()
            });
        }
    }

    fn words(&mut self, words: &[Word], kind: CompletionItemKind, noun: &str, insert: &dyn Fn(&str) -> String) {
        for word in words {
            let detail = if word.ty.is_empty() { noun.to_string() } else { format!("{noun}: {}", word.ty) };
            self.add(word.name, kind, &detail, word.about, Some(insert(word.name)));
        }
    }
}

struct GraphCompletion<'w> {
    workspace: &'w mut Workspace,
    path: &'w Path,
    offer: &'w mut Offer,
}

impl GraphCompletion<'_> {
    /// Offers what may stand behind a text; where that begins.
    fn complete(&mut self, before: &str, byte: usize) -> usize {
        let mut last: Option<(Range<usize>, TokenShape)> = None;
        let frames = walk(before, &mut |token, _| last = Some((token.range.clone(), token.shape)));
        let open = last.filter(|(range, shape)| range.end == before.len() && *shape != TokenShape::Close);
        let in_text = open.as_ref().is_some_and(|o| o.1 == TokenShape::Text);
        let typed = open.map_or(byte, |o| o.0.start);
        let around = frames.last().map(|f| (f.open, f.key.is_some()));
        let key = matches!(around, Some((b'{', false)));
        let plain = |name: &str| name.to_string();
        let quotes = |name: &str| format!("\"{name}\"");
        let quoted: &dyn Fn(&str) -> String = if in_text { &plain } else { &quotes };
        if let Some((at, what)) = thing(&frames)
            && matches!(around, Some((b'(', false)))
            && at == frames.len() - 1
            && !in_text
        {
            self.fields(what, &frames[at]);
            return typed;
        }
        if !in_text {
            self.bare(&frames);
        }
        match role(&frames, TokenShape::Text, key) {
            WordRole::Expression => {
                self.expression(&frames, quoted, in_text);
                // Of an expression the last name is completed, in an empty one all.
                return if in_text {
                    byte - tail(before, |c| c.is_alphanumeric() || c == '_' || c == '.').len()
                } else {
                    typed
                };
            }
            role => self.text(role, &frames, quoted),
        }
        typed
    }

    fn fields(&mut self, what: StructKind, frame: &Bracket) {
        let names: Vec<&str> = match what {
            StructKind::Root => {
                let fits = |w: &&Word| w.ty == "both" || frame.word == "Variant";
                section("Sections").iter().filter(fits).map(|w| w.name).collect()
            }
            StructKind::Dirty => vec!["bits", "of"],
            StructKind::Warning => vec!["when", "about"],
            _ => match what.headings().iter().find_map(|heading| word(heading, frame.word)) {
                Some(kind) => kind.parts.clone(),
                // An edit may change a field of whatever the base has.
                None => what.headings().iter().flat_map(|h| section(h)).flat_map(|w| w.parts.iter().copied()).collect(),
            },
        };
        for name in names.into_iter().filter(|n| !frame.keys.contains(n)) {
            let about = if what == StructKind::Root { word("Sections", name).map_or("", |w| w.about) } else { "" };
            self.offer.add(name, CompletionItemKind::FIELD, frame.word, about, Some(format!("{name}: ")));
        }
    }

    fn bare(&mut self, frames: &[Bracket]) {
        match role(frames, TokenShape::Word, false) {
            WordRole::Kind(StructKind::Root) => {
                self.offer.add("Graph", CompletionItemKind::CLASS, "a graph", "", Some("Graph(".into()));
                self.offer.add(
                    "Variant",
                    CompletionItemKind::CLASS,
                    "another graph with changes",
                    "",
                    Some("Variant(".into()),
                );
            }
            WordRole::Kind(StructKind::Warning) => {
                self.offer.add(
                    "Warning",
                    CompletionItemKind::CLASS,
                    "what the graph can't do",
                    "",
                    Some("Warning(".into()),
                );
            }
            WordRole::Kind(StructKind::Dirty) => {
                self.offer.add(
                    "Dirty",
                    CompletionItemKind::CLASS,
                    "instances whose bit is set",
                    "",
                    Some("Dirty(".into()),
                );
            }
            WordRole::Kind(what) => {
                for heading in what.headings() {
                    self.offer.words(section(heading), CompletionItemKind::CLASS, "", &|name| format!("{name}("));
                }
            }
            WordRole::Choice => {
                let field = thing(frames).and_then(|(at, _)| frames[at].key.as_ref().map(|k| k.0)).unwrap_or("");
                if field == "format" {
                    self.offer.words(section("Formats"), CompletionItemKind::ENUM_MEMBER, "", &str::to_string);
                }
                for choice in choices(field) {
                    self.offer.add(choice, CompletionItemKind::ENUM_MEMBER, "", "", None);
                }
            }
            _ => {}
        }
    }

    fn text(&mut self, role: WordRole, frames: &[Bracket], quoted: &dyn Fn(&str) -> String) {
        let bind = thing(frames).is_some_and(|(at, _)| frames[at].key.as_ref().is_some_and(|k| k.0 == "bind"));
        match role {
            WordRole::Names => {
                self.declared(&["resources", "inputs"], quoted);
                if bind {
                    self.declared(&["params", "lets"], quoted);
                    self.provided(&["Facts", "Frame values", "Tables"], quoted);
                } else {
                    self.provided(&["Tables"], quoted);
                }
            }
            // Of a variant: what its base declares.
            WordRole::Declares => {
                let section = frames.first().and_then(|f| f.key.as_ref()).map_or("", |k| k.0);
                self.declared(&[section], quoted);
            }
            WordRole::OfPass => {
                for path in self.chain().into_iter().skip(1) {
                    let Some(file) = self.workspace.graph(&path) else { continue };
                    for pass in &file.passes {
                        self.offer.add(
                            &pass.name,
                            CompletionItemKind::FUNCTION,
                            &pass.kind,
                            "",
                            Some(quoted(&pass.name)),
                        );
                    }
                }
            }
            WordRole::Shader => {
                let sources = self.workspace.sources(self.path);
                for path in sources.files.keys() {
                    self.offer.add(path, CompletionItemKind::FILE, "shader", "", Some(quoted(path)));
                }
            }
            WordRole::Graph => {
                let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
                for path in self.workspace.all() {
                    if let Some(path) = path.strip_prefix(&folder).ok().and_then(Path::to_str) {
                        self.offer.add(path, CompletionItemKind::FILE, "graph", "", Some(quoted(path)));
                    }
                }
                for (path, _) in lightgraph::internals::builtin::FILES
                    .iter()
                    .filter(|f| f.0.ends_with(".ron") && f.0.starts_with("graphs/"))
                {
                    let path = format!("{}{path}", lightgraph::internals::builtin::PREFIX);
                    self.offer.add(&path, CompletionItemKind::FILE, "comes with lightgraph", "", Some(quoted(&path)));
                }
            }
            WordRole::Variable | WordRole::Entry | WordRole::Definition => self.of_shader(role, frames, quoted),
            WordRole::Input => self.of_graph(frames, "inputs", quoted),
            WordRole::Taken => self.of_graph(frames, "outputs", quoted),
            WordRole::Parameter => self.of_graph(frames, "params", quoted),
            _ => {}
        }
    }

    fn expression(&mut self, frames: &[Bracket], quoted: &dyn Fn(&str) -> String, in_text: bool) {
        self.declared(&["params", "lets"], quoted);
        if thing(frames).is_some_and(|(at, _)| frames[at].key.as_ref().is_some_and(|k| ["size", "over"].contains(&k.0)))
        {
            self.declared(&["resources", "inputs"], quoted);
        }
        self.provided(&["Facts"], quoted);
        self.offer.add("screen", CompletionItemKind::CONSTANT, "vec2u", "the image's size", Some(quoted("screen")));
        if in_text {
            self.offer
                .words(section("Functions"), CompletionItemKind::FUNCTION, "function", &|name| format!("{name}("));
        }
        for path in self.chain() {
            let Some(file) = self.workspace.graph(&path) else { continue };
            for pass in file.passes.iter().filter(|p| ["Fastest", "For"].contains(&p.kind.as_str())) {
                self.offer.add(&pass.name, CompletionItemKind::VARIABLE, &pass.kind, "", Some(quoted(&pass.name)));
            }
        }
    }

    fn provided(&mut self, titles: &[&str], quoted: &dyn Fn(&str) -> String) {
        for title in titles {
            let noun = section(title).first().and_then(|w| words::provided(w.name)).map_or("", |p| p.0);
            self.offer.words(section(title), CompletionItemKind::CONSTANT, noun, quoted);
        }
    }

    /// The graph and its bases.
    fn chain(&mut self) -> Vec<PathBuf> {
        crate::answers::bases(self.workspace, self.path)
    }

    fn declared(&mut self, sections: &[&str], quoted: &dyn Fn(&str) -> String) {
        for path in self.chain() {
            let Some(file) = self.workspace.graph(&path) else { continue };
            for d in file.declared.iter().filter(|d| sections.contains(&d.section)) {
                let kind = if d.section == "resources" || d.section == "inputs" {
                    CompletionItemKind::VARIABLE
                } else {
                    CompletionItemKind::VALUE
                };
                self.offer.add(&d.name, kind, &d.kind, "", Some(quoted(&d.name)));
            }
        }
    }

    /// The pass around: what it is called and what it runs.
    fn pass(&mut self, frames: &[Bracket]) -> Option<crate::mentions::PassMention> {
        let start = frames[thing(frames)?.0].start;
        let file = self.workspace.graph(self.path)?;
        file.passes.iter().find(|p| p.range.start == start).cloned()
    }

    fn of_shader(&mut self, role: WordRole, frames: &[Bracket], quoted: &dyn Fn(&str) -> String) {
        let root = self.workspace.root(self.path);
        let sources = self.workspace.sources(self.path);
        let shader = self.pass(frames).and_then(|p| self.workspace.shader_of(&root, &p));
        let files = match &shader {
            Some(shader) => self.workspace.reachable(&sources, std::iter::once(shader.as_str())),
            None if role == WordRole::Definition => self.workspace.reach(self.path),
            None => return,
        };
        let set = thing(frames).is_some_and(|(at, _)| frames[at].key.as_ref().is_some_and(|k| k.0 == "set"));
        for file in files {
            match role {
                WordRole::Definition => {
                    for name in &file.survey.mentioned {
                        self.offer.add(name, CompletionItemKind::CONSTANT, "definition", "", Some(quoted(name)));
                    }
                }
                WordRole::Entry => {
                    let own =
                        shader.as_ref().and_then(|s| sources.files.get(s)).is_some_and(|s| s.path == file.source.path);
                    for name in file.entries.iter().filter(|_| own) {
                        self.offer.add(name, CompletionItemKind::FUNCTION, "entry point", "", Some(quoted(name)));
                    }
                }
                _ => {
                    for (name, of) in &file.variables {
                        let of = of.as_ref().and_then(|of| self.workspace.of_shader(&sources, &file, of));
                        match of {
                            Some(Symbol::Item(path, of)) => {
                                let members =
                                    self.workspace.file(&sources, &path).and_then(|f| f.members.get(&of).cloned());
                                for member in members.into_iter().flatten() {
                                    self.offer.add(&member, CompletionItemKind::FIELD, &of, "", Some(quoted(&member)));
                                }
                            }
                            _ if !set => {
                                let line = file.about(name).map_or(String::new(), |a| a.0);
                                self.offer.add(name, CompletionItemKind::VARIABLE, &line, "", Some(quoted(name)));
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
    }

    fn of_graph(&mut self, frames: &[Bracket], section: &str, quoted: &dyn Fn(&str) -> String) {
        let Some(graph) = self.pass(frames).and_then(|p| p.graph) else { return };
        for path in crate::answers::bases(self.workspace, &graph) {
            let Some(file) = self.workspace.graph(&path) else { continue };
            for d in file.declared.iter().filter(|d| d.section == section) {
                self.offer.add(&d.name, CompletionItemKind::VARIABLE, &d.kind, "", Some(quoted(&d.name)));
            }
        }
    }
}

fn shader(workspace: &mut Workspace, path: &Path, line: &str, offer: &mut Offer) {
    let Some((sources, key)) = shader_of(workspace, path) else { return };
    let import = line.trim_start().strip_prefix("#import");
    let typed = tail(line, |c| c.is_alphanumeric() || c == '_' || c == ':' || c == '"');
    if let Some((module, _)) = typed.rsplit_once("::").filter(|_| import.is_some() || typed.contains("::")) {
        return items(workspace, &sources, module, offer);
    }
    if let Some(rest) = import {
        if let Some((module, _)) = rest.trim().split_once("::{") {
            return items(workspace, &sources, module, offer);
        }
        let index = sources.index();
        for name in index.module_names() {
            offer.add(name, CompletionItemKind::MODULE, "module", "", None);
        }
        return;
    }
    let Some(file) = workspace.shader(&sources, &key) else { return };
    if let Some((base, _)) = typed_member(line) {
        let of = file.variables.get(base).cloned().flatten().and_then(|of| workspace.of_shader(&sources, &file, &of));
        if let Some(Symbol::Item(path, of)) = of {
            let members = workspace.file(&sources, &path).and_then(|f| f.members.get(&of).cloned());
            for member in members.into_iter().flatten() {
                offer.add(&member, CompletionItemKind::FIELD, &of, "", None);
            }
        }
        return;
    }
    let binds = line.trim_start().starts_with("var") && !line.contains(':');
    if binds && let Some(graph) = workspace.user(path) {
        for graph in crate::answers::bases(workspace, &graph) {
            let Some(graph) = workspace.graph(&graph) else { continue };
            for d in graph.declared.iter().filter(|d| ["resources", "inputs", "params", "lets"].contains(&d.section)) {
                offer.add(&d.name, CompletionItemKind::VARIABLE, &d.kind, "", None);
            }
        }
    }
    for (title, noun) in
        [("Facts", "fact of the scene"), ("Frame values", "value of the frame"), ("Tables", "table of the scene")]
    {
        // Members of uniforms are named after them as well.
        offer.words(section(title), CompletionItemKind::CONSTANT, noun, &str::to_string);
    }
    for (name, declared) in &file.survey.outline.declared {
        let about = file.about(name).unwrap_or_default();
        let kind = if declared.keyword == "fn" { CompletionItemKind::FUNCTION } else { CompletionItemKind::VARIABLE };
        offer.add(name, kind, &about.0, &about.1, None);
    }
    for import in &file.survey.imports {
        offer.add(&import.local, CompletionItemKind::MODULE, &import.path, "", None);
    }
}

/// `base.typed` at the end of a line.
fn typed_member(line: &str) -> Option<(&str, &str)> {
    let (base, typed) = tail(line, |c| c.is_alphanumeric() || c == '_' || c == '.').rsplit_once('.')?;
    Some((base, typed))
}

fn items(workspace: &mut Workspace, sources: &Library, module: &str, offer: &mut Offer) {
    let path = sources.index().module(module).first().cloned();
    let Some(file) = path.and_then(|path| workspace.shader(sources, &path)) else { return };
    for (name, declared) in file.survey.outline.declared.iter().filter(|d| d.1.keyword != "alias") {
        let about = file.about(name).unwrap_or_default();
        let kind = if declared.keyword == "fn" { CompletionItemKind::FUNCTION } else { CompletionItemKind::STRUCT };
        offer.add(name, kind, &about.0, &about.1, None);
    }
}
