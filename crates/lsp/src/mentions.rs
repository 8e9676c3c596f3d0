//! The names in a graph file, each with its place and what it names.

use crate::ron::{TokenShape, WordRole, names, role, thing, walk};
use lightgraph::internals::builtin;
use lightgraph::internals::diag::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a name in a graph file names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GraphName {
    /// A parameter, let, resource, input, or what a loop or group of alternatives counts.
    Value(String),
    Definition(String),
    Pass(String),
    Output(String),
    /// By the pass that uses another graph: an output of that one, or a value.
    Of(String, String),
    /// The same, a value whatever its outputs are called.
    Given(String, String),
    /// By the pass: a variable of its shader.
    Variable(usize, String),
    /// An entry point of the pass's shader.
    Entry(usize, String),
    Shader(String),
    Graph(PathBuf),
}

#[derive(Debug, Clone)]
pub struct GraphMention {
    pub range: Range<usize>,
    pub named: GraphName,
    pub declares: bool,
}

/// A pass as the file says it; of a variant perhaps an edit of one of the base's.
#[derive(Debug, Clone, Default)]
pub struct PassMention {
    pub range: Range<usize>,
    /// Empty for edits that keep the base's kind.
    pub kind: String,
    pub name: String,
    /// Of its name.
    pub place: Range<usize>,
    pub shader: Option<String>,
    /// The graph that it uses.
    pub graph: Option<PathBuf>,
    /// Variables of its shader, or inputs of its graph, that it says something else of.
    pub said: BTreeSet<String>,
}

/// A declaration in a section.
#[derive(Debug, Clone)]
pub struct SectionEntry {
    pub section: &'static str,
    pub name: String,
    pub place: Range<usize>,
    /// The kind of what is declared, where one is said.
    pub kind: String,
    pub range: Range<usize>,
}

/// All that a graph file names.
#[derive(Debug)]
pub struct GraphFile {
    pub source: Arc<Source>,
    pub mentions: Vec<GraphMention>,
    pub passes: Vec<PassMention>,
    pub declared: Vec<SectionEntry>,
    pub base: Option<PathBuf>,
}

const SECTIONS: [&str; 6] = ["inputs", "params", "lets", "defines", "resources", "outputs"];

/// Kinds of passes whose names are values.
const COUNTED: [&str; 3] = ["Loop", "For", "Fastest"];

impl GraphFile {
    pub fn new(source: &Arc<Source>) -> GraphFile {
        let mut reader = MentionReader { folder: folder(source), ..MentionReader::default() };
        walk(&source.text, &mut |token, frames| reader.token(token, frames));
        let MentionReader { mut mentions, passes, declared, base, .. } = reader;
        // Names of passes become known after what is in them.
        let counted: BTreeSet<&str> =
            passes.iter().filter(|p| COUNTED.contains(&p.kind.as_str())).map(|p| p.name.as_str()).collect();
        for mention in &mut mentions {
            if let GraphName::Pass(name) = &mention.named
                && counted.contains(name.as_str())
            {
                mention.named = GraphName::Value(name.clone());
            }
        }
        GraphFile { source: source.clone(), mentions, passes, declared, base }
    }

    /// The mention that holds a byte, its ends included.
    pub fn at(&self, byte: usize) -> Option<&GraphMention> {
        let holds = |m: &&GraphMention| m.range.start <= byte && byte <= m.range.end;
        self.mentions.iter().filter(holds).min_by_key(|m| m.range.len())
    }
}

fn folder(source: &Source) -> PathBuf {
    Path::new(&source.path).parent().unwrap_or(Path::new("")).to_path_buf()
}

#[derive(Default)]
struct MentionReader {
    folder: PathBuf,
    mentions: Vec<GraphMention>,
    passes: Vec<PassMention>,
    /// By the start of a pass: its index.
    open: BTreeMap<usize, usize>,
    declared: Vec<SectionEntry>,
    base: Option<PathBuf>,
}

impl MentionReader {
    fn token(&mut self, token: &crate::ron::RonToken, frames: &[crate::ron::Bracket]) {
        if token.shape == TokenShape::Close {
            if let Some(pass) = self.open.get(&token.range.start) {
                self.passes[*pass].range = token.range.clone();
            }
            if let Some(declared) = self.declaring(frames) {
                declared.range.end = token.range.end;
            }
            return;
        }
        let role = role(frames, token.shape, token.key);
        let pass = self.pass(frames);
        let text = token.text.to_string();
        let field = thing(frames).and_then(|(at, _)| frames[at].key.as_ref().map(|k| k.0)).unwrap_or("");
        match role {
            WordRole::Declares if token.key => self.declares(field, token, GraphName::Value(text)),
            WordRole::Declares => self.mention(token.range.clone(), GraphName::Value(text), true),
            WordRole::Output => self.declares(field, token, GraphName::Output(text)),
            WordRole::Definition if pass.is_none() => self.declares(field, token, GraphName::Definition(text)),
            WordRole::Definition => self.mention(token.range.clone(), GraphName::Definition(text), false),
            WordRole::Names | WordRole::Expression => self.names(token),
            WordRole::OfPass => self.mention(token.range.clone(), GraphName::Pass(text), false),
            WordRole::Graph => {
                let path = builtin::join(&self.folder, token.text);
                match pass {
                    Some(pass) => self.passes[pass].graph = Some(path.clone()),
                    None => self.base = Some(path.clone()),
                }
                self.mention(token.range.clone(), GraphName::Graph(path), false);
            }
            WordRole::Kind(_) => {
                if let Some(declared) = self.declaring(frames).filter(|_| token.kind) {
                    declared.kind = text;
                }
            }
            _ => {
                if let Some(pass) = pass {
                    self.of_pass(pass, role, token);
                }
            }
        }
    }

    /// The declaration whose value stands in these brackets.
    fn declaring(&mut self, frames: &[crate::ron::Bracket]) -> Option<&mut SectionEntry> {
        let [root, map] = frames else { return None };
        let (section, name) = (root.key.as_ref()?, map.key.as_ref()?);
        self.declared.last_mut().filter(|d| d.section == section.0 && d.place == name.1)
    }

    fn of_pass(&mut self, pass: usize, role: WordRole, token: &crate::ron::RonToken) {
        let (text, range) = (token.text.to_string(), token.range.clone());
        match role {
            WordRole::Pass => {
                self.passes[pass].name.clone_from(&text);
                self.passes[pass].place = range.clone();
                self.mention(range, GraphName::Pass(text), true);
            }
            WordRole::Shader => {
                self.passes[pass].shader = Some(text.clone());
                self.mention(range, GraphName::Shader(text), false);
            }
            WordRole::Entry => self.mention(range, GraphName::Entry(pass, text), false),
            WordRole::Variable => {
                self.passes[pass].said.insert(text.clone());
                self.mention(range, GraphName::Variable(pass, text), false);
            }
            WordRole::Taken => self.mention(range, GraphName::Of(self.passes[pass].name.clone(), text), false),
            WordRole::Input | WordRole::Parameter => {
                self.passes[pass].said.insert(text.clone());
                self.mention(range, GraphName::Given(self.passes[pass].name.clone(), text), false);
            }
            _ => {}
        }
    }

    fn mention(&mut self, range: Range<usize>, named: GraphName, declares: bool) {
        self.mentions.push(GraphMention { range, named, declares });
    }

    fn declares(&mut self, field: &str, token: &crate::ron::RonToken, named: GraphName) {
        let range = token.range.clone();
        // What a variant says of a graph that its base uses.
        if let (GraphName::Value(text), Some(dot)) = (&named, token.text.find('.')) {
            let named = GraphName::Given(text[..dot].into(), text[dot + 1..].into());
            return self.mention(range.start + dot + 1..range.end, named, false);
        }
        if let Some(section) = SECTIONS.iter().find(|s| **s == field) {
            let (name, place) = (token.text.to_string(), range.clone());
            self.declared.push(SectionEntry { section, name, place, kind: String::new(), range: range.clone() });
        }
        self.mention(range, named, true);
    }

    fn names(&mut self, token: &crate::ron::RonToken) {
        for (name, range) in names(token.text) {
            let start = token.range.start + range.start;
            let head = name.split('.').next().unwrap_or(name);
            self.mention(start..start + head.len(), GraphName::Value(head.into()), false);
            if let Some((_, rest)) = name.split_once('.') {
                let inner = start + head.len() + 1;
                self.mention(inner..inner + rest.len(), GraphName::Of(head.into(), rest.into()), false);
            }
        }
    }

    /// The innermost pass around, which it may be the first to tell of.
    fn pass(&mut self, frames: &[crate::ron::Bracket]) -> Option<usize> {
        use crate::ron::StructKind;
        let (mut at, mut what) = thing(frames)?;
        if what == StructKind::Dirty {
            let outer = thing(&frames[..at])?;
            (at, what) = outer;
        }
        if what != StructKind::Pass {
            return None;
        }
        let frame = &frames[at];
        if let Some(pass) = self.open.get(&frame.start) {
            return Some(*pass);
        }
        // An edit has its name before it.
        let before = frames[at - 1].key.clone().filter(|_| frames[at - 1].open == b'{' && at == 2);
        let before = before.filter(|_| frames[0].key.as_ref().is_some_and(|k| k.0 == "passes"));
        let (name, place) = before.map_or((String::new(), 0..0), |(name, place)| (name.to_string(), place));
        let end = frame.start..usize::MAX;
        self.passes.push(PassMention { range: end, kind: frame.word.into(), name, place, ..PassMention::default() });
        self.open.insert(frame.start, self.passes.len() - 1);
        Some(self.passes.len() - 1)
    }
}
