//! The names in a shader file, each with its place and what it names.

use lightgraph::internals::diag::Source;
use lightgraph::internals::shader::{Survey, Token, TokenKind, survey};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

/// What a name in a shader names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ShaderName {
    /// A declaration at module scope of this file.
    Own(String),
    /// Of another module.
    Foreign(String, String),
    Module(String),
    /// A member of a struct, which is own or foreign.
    Member(Box<ShaderName>, String),
    Definition(String),
}

#[derive(Debug, Clone)]
pub struct ShaderMention {
    pub range: Range<usize>,
    pub named: ShaderName,
    pub declares: bool,
}

#[derive(Debug)]
pub struct ShaderFile {
    pub source: Arc<Source>,
    pub survey: Survey,
    pub mentions: Vec<ShaderMention>,
    /// Variables that graphs bind, with the struct of uniforms that have one.
    pub variables: BTreeMap<String, Option<ShaderName>>,
    /// Members by struct.
    pub members: BTreeMap<String, BTreeSet<String>>,
    /// Functions that are entry points.
    pub entries: BTreeSet<String>,
}

impl ShaderFile {
    pub fn new(source: &Arc<Source>) -> ShaderFile {
        let survey = survey(source);
        let mut reader = ShaderReader {
            survey: &survey,
            mentions: vec![],
            scopes: vec![],
            coming: vec![],
            params: BTreeMap::new(),
            declaring: 0,
        };
        let imported = reader.imports();
        reader.directives(source);
        let variables = variables(&survey, &imported);
        let (members, entries) = (members(&survey), entries(&survey));
        reader.words(&imported, &variables);
        let mentions = reader.mentions;
        ShaderFile { source: source.clone(), mentions, variables, members, entries, survey }
    }

    /// The mention that holds a byte, its ends included.
    pub fn at(&self, byte: usize) -> Option<&ShaderMention> {
        self.mentions.iter().find(|m| m.range.start <= byte && byte <= m.range.end)
    }

    /// The comment lines before a declaration, and its first line.
    pub fn about(&self, name: &str) -> Option<(String, String)> {
        let declared = self.survey.outline.declared.get(name)?;
        let text = &self.source.text;
        let start = text[..declared.range.start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[start..].lines().next().unwrap_or("").trim_end_matches(['{', ' ']).to_string();
        let above = text[..start].lines().rev().skip_while(|l| l.trim_start().starts_with('@'));
        let mut comment: Vec<&str> = above.take_while(|l| l.starts_with("//")).collect();
        comment.reverse();
        let comment: Vec<&str> = comment.iter().map(|l| l.trim_start_matches('/').trim()).collect();
        Some((line, comment.join("\n")))
    }
}

/// By local name: what an import means.
type Imported = BTreeMap<String, ShaderName>;

fn word(survey: &Survey, at: usize) -> &str {
    survey.words.get(at).map_or("", |w| w.text(&survey.code))
}

fn mark(survey: &Survey, at: usize, c: char) -> bool {
    survey.words.get(at).is_some_and(|w| w.is(c))
}

/// What a name of a type means: a struct of this file or another's.
fn typed(survey: &Survey, imported: &Imported, name: &str) -> Option<ShaderName> {
    match survey.outline.declared.get(name) {
        Some(declared) if declared.keyword == "struct" => Some(ShaderName::Own(name.into())),
        Some(_) => None,
        None => imported.get(name).cloned().or_else(|| path(imported, name)),
    }
}

/// What `a::b` means.
fn path(imported: &Imported, name: &str) -> Option<ShaderName> {
    let (module, item) = name.rsplit_once("::")?;
    let module = match imported.get(module) {
        Some(ShaderName::Module(whole)) => whole.clone(),
        Some(ShaderName::Foreign(outer, inner)) => format!("{outer}::{inner}"),
        _ => module.into(),
    };
    Some(ShaderName::Foreign(module, item.into()))
}

fn variables(survey: &Survey, imported: &Imported) -> BTreeMap<String, Option<ShaderName>> {
    let mut found = BTreeMap::new();
    for at in &survey.outline.resources {
        let template = if mark(survey, at + 1, '<') {
            (at + 1..).find(|i| mark(survey, *i, '>') || word(survey, *i).is_empty())
        } else {
            None
        };
        let name = template.map_or(at + 1, |end| end + 1);
        let uniform = word(survey, at + 2) == "uniform";
        let ty = if mark(survey, name + 1, ':') { word(survey, name + 2) } else { "" };
        found.insert(word(survey, name).to_string(), typed(survey, imported, ty).filter(|_| uniform));
    }
    found
}

fn members(survey: &Survey) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut of = "";
    for at in 0..survey.words.len() {
        if at > 0 && word(survey, at - 1) == "struct" {
            of = word(survey, at);
            found.entry(of.into()).or_default();
        }
        if survey.outline.members.contains(&at) {
            found.entry(of.into()).or_default().insert(word(survey, at).into());
        }
    }
    found
}

fn entries(survey: &Survey) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut stage = false;
    for at in 0..survey.words.len() {
        stage |= mark(survey, at, '@') && ["vertex", "fragment", "compute"].contains(&word(survey, at + 1));
        if stage && word(survey, at) == "fn" {
            found.insert(word(survey, at + 1).to_string());
            stage = false;
        }
    }
    found
}

/// By name: the struct that a local has, where it is known.
type Scope = BTreeMap<String, Option<ShaderName>>;

struct ShaderReader<'s> {
    survey: &'s Survey,
    mentions: Vec<ShaderMention>,
    scopes: Vec<Scope>,
    /// Locals whose statement has not ended.
    coming: Vec<(String, Option<ShaderName>)>,
    /// Of the function whose body is to come.
    params: Scope,
    /// The word that names a local where it is declared.
    declaring: usize,
}

impl ShaderReader<'_> {
    fn mention(&mut self, range: Range<usize>, named: ShaderName, declares: bool) {
        self.mentions.push(ShaderMention { range, named, declares });
    }

    /// What the imports mean; a path without an item is a module.
    fn imports(&mut self) -> Imported {
        let mut imported = Imported::new();
        for import in &self.survey.imports {
            let named = match import.path.rsplit_once("::") {
                // Whether `a::b` is a module or an item of one, the workspace knows.
                Some((module, item)) => ShaderName::Foreign(module.into(), item.into()),
                None => ShaderName::Module(import.path.clone()),
            };
            let last = import.path.rsplit("::").next().map_or(0, str::len);
            let start = import.range.end.saturating_sub(last).max(import.range.start);
            self.mentions.push(ShaderMention { range: start..import.range.end, named: named.clone(), declares: false });
            imported.insert(import.local.clone(), named);
        }
        if let Some((name, range)) = self.survey.module.clone() {
            self.mention(range, ShaderName::Module(name), true);
        }
        imported
    }

    /// Definitions in conditions, which the code leaves out.
    fn directives(&mut self, source: &Source) {
        let mut start = 0;
        for line in source.text.split_inclusive('\n') {
            let words = line.trim_start().strip_prefix('#').map(str::split_whitespace);
            for pair in words
                .into_iter()
                .flat_map(|w| w.collect::<Vec<_>>().windows(2).map(|p| [p[0], p[1]]).collect::<Vec<_>>())
            {
                if ["ifdef", "ifndef", "if"].contains(&pair[0]) && self.survey.mentioned.contains(pair[1]) {
                    let at = start + (pair[1].as_ptr() as usize - line.as_ptr() as usize);
                    self.mention(at..at + pair[1].len(), ShaderName::Definition(pair[1].into()), false);
                }
            }
            start += line.len();
        }
    }

    fn words(&mut self, imported: &Imported, variables: &BTreeMap<String, Option<ShaderName>>) {
        let survey = self.survey;
        let mut of = String::new();
        for (at, token) in survey.words.iter().enumerate() {
            match token.kind {
                TokenKind::Mark('{') => {
                    let scope = if self.scopes.is_empty() { std::mem::take(&mut self.params) } else { Scope::new() };
                    self.scopes.push(scope);
                }
                TokenKind::Mark('}') => drop(self.scopes.pop()),
                TokenKind::Mark(';') => {
                    if let Some(scope) = self.scopes.last_mut() {
                        scope.extend(self.coming.drain(..));
                    }
                }
                TokenKind::Definition => {
                    let name = token.definition(&survey.code);
                    let start = token.range.start + token.text(&survey.code).find(name).unwrap_or(0);
                    self.mention(start..start + name.len(), ShaderName::Definition(name.into()), false);
                }
                TokenKind::Name => {
                    match word(survey, at) {
                        "struct" => of = word(survey, at + 1).into(),
                        "fn" => self.params(at, imported),
                        "let" | "var" | "const" if !self.scopes.is_empty() => self.local(at, imported),
                        _ => {}
                    }
                    self.name(at, token, &of, imported, variables);
                }
                TokenKind::Mark(_) | TokenKind::Number => {}
            }
        }
    }

    fn name(
        &mut self,
        at: usize,
        token: &Token,
        of: &str,
        imported: &Imported,
        variables: &BTreeMap<String, Option<ShaderName>>,
    ) {
        let survey = self.survey;
        let (name, range) = (word(survey, at), token.range.clone());
        if at > 0 && (mark(survey, at - 1, '@') || at == self.declaring) {
            return;
        }
        if survey.outline.members.contains(&at) {
            return self.mention(range, ShaderName::Member(Box::new(ShaderName::Own(of.into())), name.into()), true);
        }
        if at > 1 && mark(survey, at - 1, '.') {
            let base = word(survey, at - 2);
            let behind = at > 2 && mark(survey, at - 3, '.');
            let local = self.scopes.iter().rev().find_map(|s| s.get(base));
            let of = local.or_else(|| variables.get(base)).filter(|_| !behind).cloned().flatten();
            if let Some(of) = of {
                self.mention(range, ShaderName::Member(Box::new(of), name.into()), false);
            }
            return;
        }
        if self.scopes.iter().any(|s| s.contains_key(name)) || self.params.contains_key(name) {
            return;
        }
        if let Some(foreign) = path(imported, name) {
            let item = name.rsplit("::").next().map_or(0, str::len);
            return self.mention(range.end - item..range.end, foreign, false);
        }
        if let Some(declared) = survey.outline.declared.get(name) {
            let declares = declared.range == range;
            self.mention(range, ShaderName::Own(name.into()), declares);
        } else if let Some(named) = imported.get(name) {
            self.mention(range, named.clone(), false);
        }
    }

    /// The parameters of the function at this word.
    fn params(&mut self, at: usize, imported: &Imported) {
        let survey = self.survey;
        self.params.clear();
        let mut depth = 0;
        for i in at + 2..survey.words.len() {
            if mark(survey, i, '(') {
                depth += 1;
            } else if mark(survey, i, ')') {
                depth -= 1;
            }
            if depth == 0 || mark(survey, i, '{') {
                break;
            }
            if depth == 1 && survey.words[i].kind == TokenKind::Name && mark(survey, i + 1, ':') {
                let ty = typed(survey, imported, word(survey, i + 2));
                self.params.insert(word(survey, i).into(), ty);
            }
        }
    }

    fn local(&mut self, at: usize, imported: &Imported) {
        let survey = self.survey;
        let mut name = at + 1;
        if mark(survey, name, '<') {
            name = (name..survey.words.len()).find(|i| mark(survey, *i, '>')).map_or(name, |end| end + 1);
        }
        let ty = if mark(survey, name + 1, ':') { typed(survey, imported, word(survey, name + 2)) } else { None };
        self.declaring = name;
        self.coming.push((word(survey, name).to_string(), ty));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_meanings() {
        let text = "#define_import_path m\n#import a::{b, c as d}\n#ifdef ON\n#endif\nstruct U { gain: f32, b2: f32 }\n\
            var<uniform> u: U;\nvar color: texture_2d<f32>;\n@fragment fn main(p: U) -> f32 {\n  \
            let color2 = u.gain + p.b2 * #{N};\n  \
            let x = color; { let color = 1; color; } return b(d) + a::e(color).gain; }\n";
        let file = ShaderFile::new(&Source::new("m.wgsl", text));
        let found: Vec<(&str, &ShaderName)> =
            file.mentions.iter().map(|m| (&text[m.range.clone()], &m.named)).collect();
        let own = |n: &str| ShaderName::Own(n.into());
        let foreign = |n: &str| ShaderName::Foreign("a".into(), n.into());
        let member = |n: &str| ShaderName::Member(Box::new(own("U")), n.into());
        for expected in [
            ("m", ShaderName::Module("m".into())),
            ("c", foreign("c")),
            ("ON", ShaderName::Definition("ON".into())),
            ("N", ShaderName::Definition("N".into())),
            ("gain", member("gain")),
            ("b2", member("b2")),
            ("b", foreign("b")),
            ("d", foreign("c")),
            ("e", foreign("e")),
        ] {
            assert!(found.contains(&(expected.0, &expected.1)), "{expected:?} in {found:?}");
        }
        let colors = found.iter().filter(|f| *f.1 == own("color")).count();
        assert_eq!(colors, 3, "its declaration and two uses: {found:?}");
        assert_eq!(file.variables.get("u"), Some(&Some(own("U"))));
        assert_eq!(file.entries, BTreeSet::from(["main".to_string()]));
        ShaderFile::new(&Source::new("m.wgsl", "var<uniform struct { fn ( let } ; #import ::"));
    }
}
