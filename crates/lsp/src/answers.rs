//! Definitions, references and renames: places of symbols as editors ask for them.

use crate::graphs::{self, CheckSettings, is_ron};
use crate::symbols::{Symbol, SymbolPlace};
use crate::text::ColumnUnit;
use crate::texts::Texts;
use crate::told::ProtocolFaults;
use crate::uri;
use crate::workspace::Workspace;
use lightgraph::internals::builtin;
use lightgraph::internals::diag::{Severity, Source};
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Values;
use lsp_types::{Location, Range, TextEdit, Uri};
use std::collections::{BTreeMap, BTreeSet};
use std::ops;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What stands under a cursor.
pub struct Under {
    pub symbol: Symbol,
    pub range: ops::Range<usize>,
}

/// The symbol at a byte of a file, its text, and the graph that is meant.
pub fn under(workspace: &mut Workspace, path: &Path, byte: usize) -> Option<Under> {
    if is_ron(path) {
        let file = workspace.graph(path)?;
        let mention = file.at(byte)?;
        let symbol = workspace.of_graph(path, &file, &mention.named)?;
        return Some(Under { symbol, range: mention.range.clone() });
    }
    let (sources, key) = shader_of(workspace, path)?;
    let file = workspace.shader(&sources, &key)?;
    let mention = file.at(byte)?;
    let symbol = workspace.of_shader(&sources, &file, &mention.named)?;
    Some(Under { symbol, range: mention.range.clone() })
}

/// The sources among which a shader file is, and its name there.
pub fn shader_of(workspace: &mut Workspace, path: &Path) -> Option<(Library, String)> {
    let shown = path.to_str()?;
    let of = |sources: &Library| sources.files.iter().find(|(_, s)| s.path == shown).map(|(key, _)| key.clone());
    // One of a graph that uses it, else of any graph that could.
    let graph = workspace.user(path);
    let graphs: Vec<PathBuf> = graph.into_iter().chain(workspace.all()).collect();
    graphs.iter().find_map(|graph| {
        let sources = workspace.sources(graph);
        let key = of(&sources)?;
        Some((sources, key))
    })
}

/// Where a symbol is declared. From a declaration, where what it stands for is: an edit of a variant leads to the base,
/// a variable of a shader to the resource.
pub fn definition(workspace: &mut Workspace, path: &Path, under: &Under) -> Vec<SymbolPlace> {
    if let Symbol::File(file) = &under.symbol {
        return vec![SymbolPlace { path: file.clone(), range: 0..0, declares: true }];
    }
    let only = BTreeSet::from([under.symbol.clone()]);
    let here = |p: &&SymbolPlace| p.path == path && p.range == under.range;
    let declared: Vec<SymbolPlace> = workspace.places(&only).into_iter().filter(|p| p.declares).collect();
    let chain = bases(workspace, path);
    // Of a base and its variants the nearest above counts.
    let rank = |p: &SymbolPlace| chain.iter().position(|c| *c == p.path).unwrap_or(usize::MAX);
    let mut others: Vec<SymbolPlace> = declared.iter().filter(|p| !here(p)).cloned().collect();
    others.sort_by_key(rank);
    let best = others.first().map(rank);
    others.retain(|p| Some(rank(p)) == best && (best != Some(usize::MAX) || chain.len() < 2 || !is_ron(&p.path)));
    if !others.is_empty() {
        return others;
    }
    let mut linked = workspace.closure(&under.symbol);
    linked.remove(&under.symbol);
    let places: Vec<SymbolPlace> = workspace.places(&linked).into_iter().filter(|p| p.declares).collect();
    // Nothing else: the declaration itself.
    if places.is_empty() { declared } else { places }
}

/// A graph and its bases, the nearest first.
pub fn bases(workspace: &mut Workspace, path: &Path) -> Vec<PathBuf> {
    let mut chain = vec![path.to_path_buf()];
    while let Some(base) =
        workspace.graph(&chain[chain.len() - 1]).filter(|_| is_ron(path)).and_then(|g| g.base.clone())
    {
        if chain.contains(&base) {
            break;
        }
        chain.push(base);
    }
    chain
}

/// Places in the protocol's words; those in files that the program carries are left out.
pub fn locations(workspace: &mut Workspace, places: &[SymbolPlace], columns: ColumnUnit) -> Vec<Location> {
    let mut told = ProtocolFaults::new(columns);
    let mut location = |p: &SymbolPlace| {
        let source = text_of(workspace, &p.path)?;
        Some(Location { uri: uri::of(&p.path)?, range: told.lines(&source).range(&p.range) })
    };
    places.iter().filter_map(&mut location).collect()
}

fn text_of(workspace: &Workspace, path: &Path) -> Option<Arc<Source>> {
    workspace.texts.read(path).ok()
}

/// The edits of a rename, by file.
///
/// # Errors
/// Why it can't be done.
pub fn rename(
    workspace: &mut Workspace,
    under: &Under,
    new: &str,
    settings: &CheckSettings,
    columns: ColumnUnit,
) -> Result<Vec<(Uri, Vec<TextEdit>)>, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !new.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') || !new.chars().all(plain) || new.contains("__")
    {
        return Err(format!("`{new}` is no name: letters, digits and single underscores are"));
    }
    let symbols = workspace.closure(&under.symbol);
    for symbol in &symbols {
        match symbol {
            Symbol::Provided(name) => return Err(format!("`{name}` is provided by the scene or the frame")),
            Symbol::File(_) => return Err("files are renamed on the disk".into()),
            _ => {}
        }
    }
    let places = workspace.places(&symbols);
    if let Some(carried) = places.iter().find(|p| is_carried(&p.path)) {
        return Err(format!(
            "`{}` is named in {}, which comes with lightgraph",
            under.symbol.name(),
            carried.path.display()
        ));
    }
    let mut by_file: BTreeMap<PathBuf, Vec<ops::Range<usize>>> = BTreeMap::new();
    for place in places {
        by_file.entry(place.path).or_default().push(place.range);
    }
    let (mut edits, mut texts) = (vec![], BTreeMap::new());
    let mut told = ProtocolFaults::new(columns);
    for (path, ranges) in &by_file {
        let source = text_of(workspace, path).ok_or_else(|| format!("{} can't be read", path.display()))?;
        let uri = uri::of(path).ok_or("a file has no address")?;
        let lines = told.lines(&source);
        let edit = |range: &ops::Range<usize>| TextEdit { range: lines.range(range), new_text: new.into() };
        edits.push((uri, ranges.iter().map(edit).collect()));
        let mut text = source.text.clone();
        ranges.iter().rev().for_each(|range| text.replace_range(range.clone(), new));
        texts.insert(path.clone(), text);
    }
    verified(workspace, &texts, settings)?;
    Ok(edits)
}

fn is_carried(path: &Path) -> bool {
    path.to_str().is_some_and(|p| p.starts_with(builtin::PREFIX))
}

/// Graphs that a rename is tried on, at most.
const MOST_TRIED: usize = 24;

/// Checks the graphs that a rename touches: none has more faults after it than before.
fn verified(
    workspace: &mut Workspace,
    edited: &BTreeMap<PathBuf, String>,
    settings: &CheckSettings,
) -> Result<(), String> {
    let after = Texts::default();
    for path in workspace.texts.open() {
        if let Some(document) = workspace.texts.document(&path) {
            after.set(&path, document.source.text.clone(), 0);
        }
    }
    edited.iter().for_each(|(path, text)| after.set(path, text.clone(), 0));
    let facts = settings.all_facts();
    let mut tried = 0;
    for graph in workspace.all() {
        let sources = workspace.sources(&graph);
        let before = graphs::open(&graph, settings, &workspace.texts, &sources);
        if tried == MOST_TRIED || !before.files.iter().any(|f| edited.contains_key(f)) {
            continue;
        }
        tried += 1;
        let faults = |opened: graphs::Opened| match opened.project {
            Ok(project) => project.faults(&Values::new(), &facts),
            Err(faults) => faults,
        };
        let (before, after) = (faults(before), faults(graphs::open(&graph, settings, &after, &sources)));
        if after.len() > before.len() {
            let new = after.iter().find(|d| !before.iter().any(|b| b.message == d.message));
            let why = new.or(after.iter().find(|d| d.severity == Severity::Error)).map_or("", |d| d.message.as_str());
            return Err(format!("{} would have a fault: {why}", graph.display()));
        }
    }
    Ok(())
}

/// The range of the name under a cursor, for an editor that is about to ask for another.
pub fn renamable(workspace: &mut Workspace, under: &Under, path: &Path, columns: ColumnUnit) -> Option<Range> {
    if matches!(under.symbol, Symbol::Provided(_) | Symbol::File(_)) {
        return None;
    }
    let source = text_of(workspace, path)?;
    Some(ProtocolFaults::new(columns).lines(&source).range(&under.range))
}
