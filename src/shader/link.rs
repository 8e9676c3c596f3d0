//! From a shader to the files it is made of: follows imports, checks every imported name, orders the files.

use super::{
    compose::Defs,
    imports::Import,
    lex::{self, Token, TokenKind},
    library::Library,
    limits::{MAX_FILES, MAX_IMPORTS},
    memo::Modules,
    outline::{Outline, outline},
    report::HERE,
    scan::{Scan, scan, unknown_definition},
};
use crate::diag::{Checked, Diagnostic, Faults, Source, Span, nearest};
use std::{collections::BTreeMap, sync::Arc};

/// A file that goes into a shader.
#[derive(Debug, Clone)]
pub(super) struct LinkUnit {
    /// Its path in the library.
    pub path: String,
    pub source: Arc<Source>,
    pub scan: Scan,
    pub words: Vec<Token>,
    pub outline: Outline,
    /// What its imports mean, by local name; units by their index.
    pub imports: BTreeMap<String, LinkTarget>,
    /// What each path (`a::b`) among its words means, by the word's index.
    pub paths: BTreeMap<usize, LinkTarget>,
}

/// What an imported name stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum LinkTarget {
    Module(usize),
    Item(usize, String),
}

/// The files of a shader: what is imported stands before what imports it, the shader's own file is last.
///
/// # Errors
/// Every fault in directives and imports of all these files.
pub(super) fn gather(library: &Library, path: &str, defs: &Defs) -> Checked<Vec<LinkUnit>> {
    let modules = library.memo.index(library).modules.clone();
    let mut gather = Gather {
        texts: library,
        modules,
        defs,
        units: vec![],
        known: BTreeMap::new(),
        stack: vec![],
        faults: vec![],
        overfull: false,
    };
    let Some(source) = library.files.get(path) else {
        let known = library.files.keys().map(String::as_str);
        return Err(Diagnostic::error(format!("unknown shader `{path}`")).nearest(path, known).into());
    };
    gather.visit(path, source);
    Faults::check(gather.faults, gather.units)
}

/// The module that `path` names, or the one before its last `::`.
pub(super) fn find_module<'a>(modules: &'a Modules, path: &str) -> Option<(&'a String, &'a Vec<String>)> {
    modules.get_key_value(path).or_else(|| modules.get_key_value(path.rsplit_once("::")?.0))
}

struct Gather<'a> {
    texts: &'a Library,
    modules: Arc<Modules>,
    defs: &'a Defs,
    units: Vec<LinkUnit>,
    /// Units by library path; `None` for a file that is still being read.
    known: BTreeMap<String, Option<usize>>,
    stack: Vec<String>,
    faults: Vec<Diagnostic>,
    /// That there are too many files was said.
    overfull: bool,
}

impl Gather<'_> {
    fn visit(&mut self, path: &str, source: &Arc<Source>) -> usize {
        self.known.insert(path.to_owned(), None);
        self.stack.push(path.to_owned());
        let scan = scan(source, Some(self.defs), &mut self.faults);
        let words = lex::tokens(&scan.text, 0..scan.text.len());
        let outline = outline(source, &scan.text, &words, &mut self.faults);
        for word in words.iter().filter(|w| w.kind == TokenKind::Definition) {
            let name = word.definition(&scan.text);
            if name != HERE && !self.defs.contains_key(name) {
                let place = Span::new(source, word.range.clone());
                self.faults.push(unknown_definition(name, &place, self.defs));
            }
        }
        let mut imports = BTreeMap::new();
        for import in &scan.imports {
            let Some(target) = self.resolve(import, source) else { continue };
            let place = Span::new(source, import.range.clone());
            match imports.get(&import.local) {
                Some(other) if *other != target => {
                    let message = format!("`{}` is imported twice with two meanings", import.local);
                    self.faults.push(Diagnostic::error(message).at(&place, "").help("rename one with `as`"));
                }
                _ => {}
            }
            if let Some(own) = outline.declared.get(&import.local) {
                let message = format!("`{}` is both imported and declared", import.local);
                let own = Span::new(source, own.range.clone());
                let fault = Diagnostic::error(message).at(&place, "imported here").at(&own, "declared here");
                self.faults.push(fault.help("rename the import with `as`"));
            }
            imports.insert(import.local.clone(), target);
        }
        let paths = self.paths(source, &scan.text, &words, &imports);
        self.stack.pop();
        let index = self.units.len();
        self.known.insert(path.to_owned(), Some(index));
        self.units.push(LinkUnit {
            path: path.to_owned(),
            source: source.clone(),
            scan,
            words,
            outline,
            imports,
            paths,
        });
        index
    }

    /// The unit of the module called `name`, read now if it wasn't yet.
    fn unit(&mut self, name: &str, place: &Span) -> Option<usize> {
        let paths = self.modules.get(name).cloned().unwrap_or_default();
        let Some(path) = paths.first() else {
            self.faults.push(self.unknown_module(name, place));
            return None;
        };
        if paths.len() > 1 {
            let message = format!("two files are both called `{name}`: {}", paths.join(", "));
            self.faults.push(Diagnostic::error(message).at(place, "").help("give each its own `#define_import_path`"));
        }
        match self.known.get(path) {
            Some(Some(index)) => Some(*index),
            Some(None) => {
                let from = self.stack.iter().position(|p| p == path).unwrap_or(0);
                let ring = self.stack.get(from..).unwrap_or_default().join(" → ");
                let message = format!("imports go round in a circle: {ring} → {path}");
                self.faults.push(Diagnostic::error(message).at(place, "").help("move what both need to a third file"));
                None
            }
            None if self.stack.len() > MAX_IMPORTS || self.known.len() >= MAX_FILES => {
                let message = match self.known.len() < MAX_FILES {
                    true => format!("more than {MAX_IMPORTS} files, each of which imports the next"),
                    false => format!("more than {MAX_FILES} files in one shader"),
                };
                if !self.overfull {
                    self.faults.push(Diagnostic::error(message).at(place, "").help("join some of them"));
                }
                self.overfull = true;
                None
            }
            None => {
                let source = self.texts.files.get(path)?.clone();
                Some(self.visit(path, &source))
            }
        }
    }

    fn unknown_module(&self, name: &str, place: &Span) -> Diagnostic {
        let fault = Diagnostic::error(format!("unknown module `{name}`")).at(place, "");
        let quoted = format!("\"{}\"", name.trim_matches('"'));
        if self.modules.contains_key(&quoted) {
            return fault.help(format!("a path stands in quotes: `{quoted}`"));
        }
        let by_path = self.modules.iter().find(|(_, paths)| paths.iter().any(|p| p == name.trim_matches('"')));
        match by_path {
            Some((name, _)) => fault.help(format!("that file is called `{name}`")),
            None => fault.nearest(name, self.modules.keys().map(String::as_str)),
        }
    }

    fn resolve(&mut self, import: &Import, source: &Arc<Source>) -> Option<LinkTarget> {
        let place = Span::new(source, import.range.clone());
        if self.modules.contains_key(&import.path) {
            return self.unit(&import.path, &place).map(LinkTarget::Module);
        }
        match import.path.rsplit_once("::") {
            Some((module, item)) => self.item(module, item, &place),
            None => {
                self.faults.push(self.unknown_module(&import.path, &place));
                None
            }
        }
    }

    fn item(&mut self, module: &str, item: &str, place: &Span) -> Option<LinkTarget> {
        let unit = self.unit(module, place)?;
        self.item_of(unit, module, item, place)
    }

    fn item_of(&mut self, unit: usize, module: &str, item: &str, place: &Span) -> Option<LinkTarget> {
        let declared = &self.units.get(unit)?.outline.declared;
        match declared.get(item) {
            Some(found) if found.keyword == "alias" => {
                let message = format!("`{item}` is an alias, and aliases can't be imported");
                self.faults.push(Diagnostic::error(message).at(place, "").help("import the type that it stands for"));
                None
            }
            Some(_) => Some(LinkTarget::Item(unit, item.to_owned())),
            None => {
                let mut fault = Diagnostic::error(format!("`{module}` has no `{item}`")).at(place, "");
                let names: Vec<&str> = declared.keys().map(String::as_str).collect();
                fault = match nearest(item, names.iter().copied()) {
                    Some(near) => fault.help(format!("did you mean `{near}`?")),
                    None if names.is_empty() => fault.help("the module declares nothing"),
                    None => fault.help(format!("it declares: {}", names.join(", "))),
                };
                self.faults.push(fault);
                None
            }
        }
    }

    /// What the words with `::` mean.
    fn paths(
        &mut self,
        source: &Arc<Source>,
        text: &str,
        words: &[Token],
        imports: &BTreeMap<String, LinkTarget>,
    ) -> BTreeMap<usize, LinkTarget> {
        let mut out = BTreeMap::new();
        for (at, word) in words.iter().enumerate().filter(|(_, w)| w.kind == TokenKind::Name) {
            let Some((module, item)) = word.text(text).rsplit_once("::") else {
                if word.text(text).starts_with('"') {
                    let place = Span::new(source, word.range.clone());
                    self.faults.push(Diagnostic::error("WGSL has no strings").at(&place, "").help("remove it"));
                }
                continue;
            };
            let place = Span::new(source, word.range.clone());
            let target = match imports.get(module) {
                Some(LinkTarget::Module(unit)) => self.item_of(*unit, module, item, &place),
                _ => self.item(module, item, &place),
            };
            if let Some(target) = target {
                out.insert(at, target);
            }
        }
        out
    }
}
