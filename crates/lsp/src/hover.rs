//! What is known of the name under a cursor.

use crate::answers::{bases, shader_of};
use crate::computed::Computed;
use crate::graphs::is_ron;
use crate::mentions::{GraphFile, SectionEntry};
use crate::ron::{StructKind, TokenShape, WordRole, role, walk};
use crate::symbols::Symbol;
use crate::words::{Word, provided, word};
use crate::workspace::Workspace;
use lightgraph::internals::diag::Source;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Characters of a declaration that are shown at most.
const MOST_SHOWN: usize = 600;

/// What is said of a word of the language at a byte of a graph file.
pub fn of_language(source: &Arc<Source>, byte: usize) -> Option<String> {
    let mut found = None;
    walk(&source.text, &mut |token, frames| {
        if found.is_some() || token.shape == TokenShape::Close || byte < token.range.start || token.range.end < byte {
            return;
        }
        let said = match role(frames, token.shape, token.key) {
            WordRole::Kind(
                what @ (StructKind::Parameter | StructKind::Resource | StructKind::Input | StructKind::Pass),
            ) => what.headings().iter().find_map(|heading| word(heading, token.text)).map(kind),
            WordRole::Field(StructKind::Root) => {
                word("Sections", token.text).map(|w| format!("`{}`: {}", w.name, w.about))
            }
            WordRole::Choice => word("Formats", token.text).map(|w| format!("`{}`: {}", w.name, w.about)),
            WordRole::Expression => {
                let names = crate::ron::names(token.text);
                let inside = byte - token.range.start;
                let on_name = names.iter().any(|n| n.1.start <= inside && inside <= n.1.end);
                let function = if on_name { None } else { function_at(token.text, inside) };
                function.map(|w| format!("`{}`{}", w.name, w.about))
            }
            _ => None,
        };
        found = said;
    });
    found
}

fn kind(word: &Word) -> String {
    let fields: Vec<String> = word.parts.iter().map(|p| format!("`{p}`")).collect();
    format!("**{}**: {}\n\n{}", word.name, word.about, fields.join(" "))
}

fn function_at(text: &str, at: usize) -> Option<&'static Word> {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    let start = text[..at].rfind(|c| !part(c)).map_or(0, |i| i + 1);
    let end = text[at..].find(|c| !part(c)).map_or(text.len(), |i| at + i);
    word("Functions", text.get(start..end)?)
}

/// What is known of a symbol that is named in a file.
pub fn of_symbol(
    workspace: &mut Workspace,
    path: &Path,
    symbol: &Symbol,
    computed: Option<&Computed>,
) -> Option<String> {
    let text = match symbol {
        Symbol::Provided(name) => {
            let (noun, word) = provided(name)?;
            let value = computed.and_then(|c| c.values.get(name)).map_or(String::new(), |v| format!(" = {v}"));
            let ty = if word.ty.is_empty() { String::new() } else { format!(": {}", word.ty) };
            let columns: Vec<String> = word.parts.iter().map(|p| format!("`{p}`")).collect();
            format!("`{name}{ty}`{value}\n\n{noun}. {} {}", word.about, columns.join(" "))
        }
        Symbol::Value(root, name) | Symbol::Definition(root, name) | Symbol::Output(root, name) => {
            let sections: &[&str] = match symbol {
                Symbol::Definition(..) => &["defines"],
                Symbol::Output(..) => &["outputs"],
                _ => &["resources", "inputs", "params", "lets"],
            };
            let own = is_ron(path) && workspace.root(path) == *root;
            let from = if own { path.to_path_buf() } else { root.clone() };
            value(workspace, &from, sections, name, computed)?
        }
        Symbol::Pass(root, name) => {
            let own = is_ron(path) && workspace.root(path) == *root;
            let from = if own { path.to_path_buf() } else { root.clone() };
            pass(workspace, &from, name, computed)?
        }
        Symbol::Item(file, name) => item(workspace, path, file, name, symbol, computed)?,
        Symbol::Member(_, of, name) => {
            let linked = linked(workspace, symbol, computed);
            format!("```wgsl\n{of}.{name}\n```\n{linked}")
        }
        Symbol::Asked(_, name) => format!("definition `{name}`\n{}", linked(workspace, symbol, computed)),
        Symbol::File(file) => about(workspace, file)?,
    };
    Some(text)
}

/// The nearest declaration in a graph and its bases.
fn declared(
    workspace: &mut Workspace,
    from: &Path,
    sections: &[&str],
    name: &str,
) -> Option<(PathBuf, Arc<GraphFile>, SectionEntry)> {
    bases(workspace, from).into_iter().find_map(|path| {
        let file = workspace.graph(&path)?;
        let found = file.declared.iter().find(|d| d.name == name && sections.contains(&d.section))?.clone();
        Some((path, file, found))
    })
}

fn value(
    workspace: &mut Workspace,
    from: &Path,
    sections: &[&str],
    name: &str,
    computed: Option<&Computed>,
) -> Option<String> {
    let (path, file, d) = declared(workspace, from, sections, name)?;
    // Up to the end of its line, or of what is in its brackets.
    let end = d.range.end.max(d.place.end + file.source.text[d.place.end..].find('\n').unwrap_or(0));
    let text: String = file.source.text.get(d.place.start - 1..end)?.chars().take(MOST_SHOWN).collect();
    let noun = match d.section {
        "resources" => "resource",
        "inputs" => "input",
        "params" => "parameter",
        "lets" => "let",
        "defines" => "definition",
        _ => "output",
    };
    let mut out =
        format!("```ron\n{}\n```\n{noun} of {}", text.trim_end_matches(','), path.file_name()?.to_string_lossy());
    if let Some(computed) = computed {
        if let Some(size) = computed.sizes.get(name) {
            out += &format!("\n\n{size}");
        }
        if let Some(value) = computed.values.get(name) {
            out += &format!("\n\n= {value}");
        }
        for (verb, of) in [("written by", &computed.writes), ("read by", &computed.reads)] {
            if let Some(passes) = of.get(name) {
                let passes: Vec<String> = passes.iter().map(|p| format!("`{p}`")).collect();
                out += &format!("\n\n{verb} {}", passes.join(", "));
            }
        }
    }
    Some(out)
}

fn pass(workspace: &mut Workspace, from: &Path, name: &str, computed: Option<&Computed>) -> Option<String> {
    let files: Vec<Arc<GraphFile>> = bases(workspace, from).iter().filter_map(|p| workspace.graph(p)).collect();
    let pass = files.iter().flat_map(|f| &f.passes).find(|p| p.name == name && !p.kind.is_empty())?;
    let mut out = format!("**{}** `{name}`", pass.kind);
    if let Some(shader) = &pass.shader {
        out += &format!(", shader `{shader}`");
    }
    if let Some(computed) = computed {
        for (verb, of) in [("writes", &computed.writes), ("reads", &computed.reads)] {
            let touched: Vec<String> =
                of.iter().filter(|(_, p)| p.contains(name)).map(|(r, _)| format!("`{r}`")).collect();
            if !touched.is_empty() {
                out += &format!("\n\n{verb} {}", touched.join(", "));
            }
        }
        if let Some(why) = computed.skipped.get(name) {
            out += &format!("\n\ndoes not run: {why}");
        }
    }
    Some(out)
}

fn item(
    workspace: &mut Workspace,
    path: &Path,
    file: &Path,
    name: &str,
    symbol: &Symbol,
    computed: Option<&Computed>,
) -> Option<String> {
    // A source of the program's own has no path to find others by: the file that names it has.
    let (sources, _) = shader_of(workspace, file).or_else(|| {
        let graph = if is_ron(path) { Some(path.to_path_buf()) } else { workspace.user(path) };
        graph.map(|g| (workspace.sources(&g), String::new()))
    })?;
    let shader = workspace.file(&sources, file)?;
    let (line, comment) = shader.about(name)?;
    let linked = if shader.variables.contains_key(name) { linked(workspace, symbol, computed) } else { String::new() };
    Some(format!("```wgsl\n{}\n```\n{comment}\n{linked}", line.trim()))
}

/// What the graphs that bind a variable say of it.
fn linked(workspace: &mut Workspace, symbol: &Symbol, computed: Option<&Computed>) -> String {
    let all: BTreeSet<Symbol> = workspace.closure(symbol);
    let of_graph = all.iter().filter(|s| matches!(s, Symbol::Value(..) | Symbol::Definition(..)));
    let graphs: Vec<Symbol> = of_graph.cloned().collect();
    let said: Option<String> = graphs.iter().find_map(|s| match s {
        Symbol::Value(root, _) | Symbol::Definition(root, _) => of_symbol(workspace, &root.clone(), s, computed),
        _ => None,
    });
    said.or_else(|| {
        let (noun, word) = provided(symbol.name())?;
        Some(format!("{noun}. {}", word.about))
    })
    .unwrap_or_default()
}

/// What a file says of itself.
fn about(workspace: &mut Workspace, file: &Path) -> Option<String> {
    let shown = file.to_string_lossy().into_owned();
    let Some(graph) = workspace.graph(file).filter(|_| is_ron(file)) else { return Some(format!("`{shown}`")) };
    let text = &graph.source.text;
    let said = text.split_once("about: \"").and_then(|(_, rest)| rest.split_once('"')).map_or("", |s| s.0);
    Some(format!("`{shown}`\n\n{}", said.split_whitespace().collect::<Vec<_>>().join(" ")))
}
