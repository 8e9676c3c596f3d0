//! What names mean across files: a resource in a graph, its variants and the shaders that bind it by name is one
//! symbol.

use crate::mentions::{self, GraphFile, GraphName};
use crate::wgsl::{self, ShaderFile};
use crate::words::provided;
use crate::workspace::Workspace;
use lightgraph::internals::shader::Library;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A thing with a name. Of a graph's names the last base tells which graph.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    Value(PathBuf, String),
    Definition(PathBuf, String),
    Pass(PathBuf, String),
    Output(PathBuf, String),
    /// A file.
    File(PathBuf),
    /// A declaration of a shader file.
    Item(PathBuf, String),
    Member(PathBuf, String, String),
    /// A definition as a shader file asks for it.
    Asked(PathBuf, String),
    Provided(String),
}

impl Symbol {
    pub fn name(&self) -> &str {
        match self {
            Symbol::Value(_, n) | Symbol::Definition(_, n) | Symbol::Pass(_, n) | Symbol::Output(_, n) => n,
            Symbol::Item(_, n) | Symbol::Member(_, _, n) | Symbol::Asked(_, n) | Symbol::Provided(n) => n,
            Symbol::File(path) => path.to_str().unwrap_or(""),
        }
    }
}

/// A place where a symbol is named.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymbolPlace {
    pub path: PathBuf,
    pub range: Range<usize>,
    pub declares: bool,
}

impl Ord for SymbolPlace {
    fn cmp(&self, other: &SymbolPlace) -> Ordering {
        let key = |p: &SymbolPlace| (p.range.start, p.range.end, p.declares);
        self.path.cmp(&other.path).then_with(|| key(self).cmp(&key(other)))
    }
}

impl PartialOrd for SymbolPlace {
    fn partial_cmp(&self, other: &SymbolPlace) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The passes of a name in all graphs of a family.
#[derive(Debug, Default)]
struct Passes {
    shaders: BTreeSet<String>,
    graphs: BTreeSet<PathBuf>,
    said: BTreeSet<String>,
}

impl Workspace {
    /// What a name in a graph file means.
    pub fn of_graph(&mut self, path: &Path, file: &GraphFile, named: &GraphName) -> Option<Symbol> {
        let root = self.root(path);
        match named {
            GraphName::Value(name) if self.used(&root, name).is_some() => Some(Symbol::Pass(root, name.clone())),
            GraphName::Value(name) if provided(name).is_some() => Some(Symbol::Provided(name.clone())),
            GraphName::Value(name) => Some(Symbol::Value(root, name.clone())),
            GraphName::Definition(name) => Some(Symbol::Definition(root, name.clone())),
            GraphName::Pass(name) => Some(Symbol::Pass(root, name.clone())),
            GraphName::Output(name) => Some(Symbol::Output(root, name.clone())),
            GraphName::Of(by, name) => self.of_used(&root, by, name, true),
            GraphName::Given(by, name) => self.of_used(&root, by, name, false),
            GraphName::Variable(pass, name) => {
                let sources = self.sources(path);
                let shader = self.shader_of(&root, file.passes.get(*pass)?)?;
                self.bound(&sources, &shader, name).into_iter().next()
            }
            GraphName::Entry(pass, name) => {
                let sources = self.sources(path);
                let shader = self.shader_of(&root, file.passes.get(*pass)?)?;
                let source = sources.files.get(&shader)?;
                Some(Symbol::Item(PathBuf::from(&source.path), name.clone()))
            }
            GraphName::Shader(shader) => {
                let sources = self.sources(path);
                Some(Symbol::File(PathBuf::from(&sources.files.get(shader)?.path)))
            }
            GraphName::Graph(path) => Some(Symbol::File(path.clone())),
        }
    }

    /// The graph that a pass of this name uses.
    fn used(&mut self, root: &Path, pass: &str) -> Option<PathBuf> {
        let family = self.family(root);
        family.iter().flat_map(|(_, f)| &f.passes).find(|p| p.name == pass && p.graph.is_some())?.graph.clone()
    }

    fn of_used(&mut self, root: &Path, by: &str, name: &str, output: bool) -> Option<Symbol> {
        let graph = self.used(root, by)?;
        let root = self.root(&graph);
        if let Some((by, inner)) = name.split_once('.') {
            return self.of_used(&root, by, inner, output);
        }
        let declared = |section: &str, family: &[(PathBuf, Arc<GraphFile>)]| {
            family
                .iter()
                .flat_map(|f| &f.1.declared)
                .any(|d| d.name == name && (d.section == "outputs") == (section == "outputs"))
        };
        let family = self.family(&root);
        let as_output = declared("outputs", &family) && (output || !declared("", &family));
        Some(if as_output { Symbol::Output(root, name.into()) } else { Symbol::Value(root, name.into()) })
    }

    /// The shader of a pass; of an edit that of the pass it edits.
    pub fn shader_of(&mut self, root: &Path, pass: &mentions::PassMention) -> Option<String> {
        if pass.shader.is_some() {
            return pass.shader.clone();
        }
        let family = self.family(root);
        family.iter().flat_map(|f| &f.1.passes).find(|p| p.name == pass.name && p.shader.is_some())?.shader.clone()
    }

    /// What a name in a shader file means.
    pub fn of_shader(&mut self, sources: &Library, file: &ShaderFile, named: &wgsl::ShaderName) -> Option<Symbol> {
        let own = PathBuf::from(&file.source.path);
        match named {
            wgsl::ShaderName::Own(name) => Some(Symbol::Item(own, name.clone())),
            wgsl::ShaderName::Foreign(module, item) => module_file(sources, &format!("{module}::{item}"))
                .map(Symbol::File)
                .or_else(|| Some(Symbol::Item(module_file(sources, module)?, item.clone()))),
            wgsl::ShaderName::Module(name) => Some(Symbol::File(module_file(sources, name)?)),
            wgsl::ShaderName::Member(of, name) => match self.of_shader(sources, file, of)? {
                Symbol::Item(path, of) => Some(Symbol::Member(path, of, name.clone())),
                _ => None,
            },
            wgsl::ShaderName::Definition(name) => Some(Symbol::Asked(own, name.clone())),
        }
    }

    /// The variables and members of uniforms that a name is bound to in a shader and what it imports.
    pub fn bound(&mut self, sources: &Library, shader: &str, name: &str) -> Vec<Symbol> {
        let mut found = vec![];
        for file in self.reachable(sources, std::iter::once(shader)) {
            for (variable, of) in &file.variables {
                let of = of.as_ref().and_then(|of| self.of_shader(sources, &file, of));
                match of {
                    Some(Symbol::Item(path, of)) => {
                        let holds = self
                            .file(sources, &path)
                            .is_some_and(|f| f.members.get(&of).is_some_and(|m| m.contains(name)));
                        found.extend(holds.then(|| Symbol::Member(path, of, name.into())));
                    }
                    _ if variable == name => found.push(Symbol::Item(PathBuf::from(&file.source.path), name.into())),
                    _ => {}
                }
            }
        }
        found
    }

    /// A file among the sources by its path on the disk.
    pub fn file(&mut self, sources: &Library, path: &Path) -> Option<Arc<ShaderFile>> {
        let key = sources.files.iter().find(|(_, s)| Path::new(&s.path) == path)?.0.clone();
        self.shader(sources, &key)
    }

    fn passes(&mut self, root: &Path) -> Vec<Passes> {
        let mut passes: BTreeMap<String, Passes> = BTreeMap::new();
        for pass in self.family(root).iter().flat_map(|f| &f.1.passes) {
            let known = passes.entry(pass.name.clone()).or_default();
            known.shaders.extend(pass.shader.clone());
            known.graphs.extend(pass.graph.clone());
            known.said.extend(pass.said.iter().cloned());
        }
        passes.into_values().collect()
    }

    fn roots(&mut self) -> BTreeSet<PathBuf> {
        let all = self.all();
        all.iter().map(|g| self.root(g)).collect()
    }

    /// Whether the graphs of a family take an input of this name.
    fn takes(&mut self, root: &Path, name: &str) -> bool {
        self.family(root).iter().flat_map(|f| &f.1.declared).any(|d| d.section == "inputs" && d.name == name)
    }

    /// The symbols that are this one under other rules: a resource and the variables that bind it by name.
    fn linked(&mut self, symbol: &Symbol) -> Vec<Symbol> {
        let mut found = vec![];
        match symbol {
            Symbol::Value(root, name) => {
                let sources = self.sources(root);
                for pass in self.passes(root).into_iter().filter(|p| !p.said.contains(name)) {
                    for shader in &pass.shaders {
                        found.extend(self.bound(&sources, shader, name));
                    }
                    for graph in &pass.graphs {
                        let sub = self.root(graph);
                        if self.takes(&sub, name) {
                            found.push(Symbol::Value(sub, name.clone()));
                        }
                    }
                }
                if self.takes(root, name) {
                    for outer in self.roots() {
                        let uses = |p: &Passes, w: &mut Workspace| p.graphs.iter().any(|g| w.root(g) == *root);
                        let passes = self.passes(&outer);
                        if passes.iter().any(|p| !p.said.contains(name) && uses(p, self)) {
                            found.push(Symbol::Value(outer, name.clone()));
                        }
                    }
                }
            }
            Symbol::Item(..) | Symbol::Member(..) => {
                let name = symbol.name().to_string();
                for root in self.roots() {
                    let sources = self.sources(&root);
                    let shaders: BTreeSet<String> = self
                        .passes(&root)
                        .into_iter()
                        .filter(|p| !p.said.contains(&name))
                        .flat_map(|p| p.shaders)
                        .collect();
                    if shaders.iter().any(|shader| self.bound(&sources, shader, &name).contains(symbol)) {
                        found.push(Symbol::Value(root, name.clone()));
                    }
                }
            }
            Symbol::Definition(root, name) => {
                for file in self.reach_of(root) {
                    let asks = file.survey.mentioned.contains(name);
                    found.extend(asks.then(|| Symbol::Asked(PathBuf::from(&file.source.path), name.clone())));
                }
            }
            Symbol::Asked(path, name) => {
                for root in self.roots() {
                    let reaches = self.reach_of(&root).iter().any(|f| Path::new(&f.source.path) == path);
                    found.extend(reaches.then(|| Symbol::Definition(root, name.clone())));
                }
            }
            Symbol::Pass(..) | Symbol::Output(..) | Symbol::File(_) | Symbol::Provided(_) => {}
        }
        found
    }

    fn reach_of(&mut self, root: &Path) -> Vec<Arc<ShaderFile>> {
        let sources = self.sources(root);
        let shaders: BTreeSet<String> = self.passes(root).into_iter().flat_map(|p| p.shaders).collect();
        self.reachable(&sources, shaders.iter().map(String::as_str))
    }

    /// A symbol and all that are linked with it.
    pub fn closure(&mut self, symbol: &Symbol) -> BTreeSet<Symbol> {
        let mut all = BTreeSet::new();
        let mut open = vec![symbol.clone()];
        while let Some(symbol) = open.pop() {
            if all.insert(symbol.clone()) {
                open.extend(self.linked(&symbol));
            }
        }
        all
    }

    /// Every place where one of these symbols is named.
    pub fn places(&mut self, symbols: &BTreeSet<Symbol>) -> BTreeSet<SymbolPlace> {
        let names: BTreeSet<String> = symbols.iter().map(|s| s.name().to_string()).collect();
        let mut found = BTreeSet::new();
        let (mut graphs, mut libraries) = (self.all(), BTreeMap::new());
        for root in self.roots() {
            graphs.insert(root);
        }
        for path in graphs {
            let Some(file) = self.graph(&path) else { continue };
            for mention in &file.mentions {
                let text = file.source.text.get(mention.range.clone()).unwrap_or("");
                let of_file = matches!(mention.named, GraphName::Shader(_) | GraphName::Graph(_));
                if (of_file || names.contains(text))
                    && self.of_graph(&path, &file, &mention.named).is_some_and(|s| symbols.contains(&s))
                {
                    found.insert(SymbolPlace {
                        path: path.clone(),
                        range: mention.range.clone(),
                        declares: mention.declares,
                    });
                }
            }
            let sources = self.sources(&path);
            let folders = sources.files.values().map(|s| s.path.clone()).collect::<Vec<_>>();
            libraries.entry(folders).or_insert(sources);
        }
        for sources in libraries.into_values() {
            let paths: Vec<String> = sources.files.keys().cloned().collect();
            for path in paths {
                let Some(file) = self.shader(&sources, &path) else { continue };
                for mention in &file.mentions {
                    let text = file.source.text.get(mention.range.clone()).unwrap_or("");
                    let of_file = matches!(mention.named, wgsl::ShaderName::Foreign(..) | wgsl::ShaderName::Module(_));
                    if (of_file || names.contains(text))
                        && self.of_shader(&sources, &file, &mention.named).is_some_and(|s| symbols.contains(&s))
                    {
                        let path = PathBuf::from(&file.source.path);
                        found.insert(SymbolPlace { path, range: mention.range.clone(), declares: mention.declares });
                    }
                }
            }
        }
        found
    }
}

fn module_file(sources: &Library, module: &str) -> Option<PathBuf> {
    let index = sources.index();
    let path = index.module(module).first()?;
    Some(PathBuf::from(&sources.files.get(path)?.path))
}
