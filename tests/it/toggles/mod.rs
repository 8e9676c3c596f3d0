//! Every field of every kind of pass and resource is edited live, there and back, and each frame equals one in full.
//! The kinds and their fields come from the grammar itself: a new one that is not in `toggles/graph.ron` fails the
//! test.

use crate::reference::kinds;
use crate::{device, support};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::shader::Library;
use lightgraph::{Checked, Gpu, Memory, Project, Scene, Session, Settings};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// Fields whose edit may leave every result as it was: names and headings, promises, what is kept for other frames,
/// other members than the one that is looked at.
const SILENT: [&str; 14] = [
    "name",
    "group",
    "min",
    "max",
    "history",
    "once",
    "only",
    "frusta",
    "tolerance",
    "mips",
    "members",
    "each",
    "load",
    "until",
];

/// A field that can be edited: its name, where it stands in the text, what stands there, and what instead.
#[derive(Debug, Clone)]
struct Toggle {
    field: String,
    texts: [String; 2],
}

/// The pieces between the toggles, one more than these.
fn toggles() -> (Vec<String>, Vec<Toggle>) {
    let (mut pieces, mut toggles) = (vec![], vec![]);
    let graph = std::fs::read_to_string(support::repository("tests/it/toggles/graph.ron")).unwrap();
    let mut rest = graph.as_str();
    while let Some((piece, more)) = rest.split_once('⟨') {
        let (toggle, after) = more.split_once('⟩').expect("a toggle ends");
        let parts: Vec<&str> = toggle.split('|').collect();
        let [field, before, instead] = parts[..] else { panic!("{toggle}") };
        pieces.push(piece.to_string());
        toggles.push(Toggle { field: field.into(), texts: [before.into(), instead.into()] });
        rest = after;
    }
    pieces.push(rest.to_string());
    (pieces, toggles)
}

/// The graph with one field edited, or none. A comma after nothing goes with it.
fn text(pieces: &[String], toggles: &[Toggle], edited: Option<usize>) -> String {
    let mut text = pieces[0].clone();
    for (i, (toggle, piece)) in toggles.iter().zip(&pieces[1..]).enumerate() {
        let word = &toggle.texts[usize::from(edited == Some(i))];
        text.push_str(word);
        text.push_str(if word.is_empty() { piece.strip_prefix(',').unwrap_or(piece) } else { piece });
    }
    text
}

fn project(text: String) -> Checked<Project> {
    let folder = support::repository("tests/it/toggles");
    let main = Source::new(folder.join("graph.ron").display().to_string(), text);
    let read = |path: &Path| if path.ends_with("graph.ron") { Ok(main.clone()) } else { Source::read(path) };
    let graph = graph::load(&folder.join("graph.ron"), &read)?;
    let texts = Library::load(&[folder.join("shaders"), support::repository("shaders")])?;
    Ok(Project { graph, texts })
}

/// A graph after another, in memory that both share.
struct Player<'a> {
    gpu: &'a Gpu,
    scene: Arc<Scene>,
    session: Option<Session>,
}

impl Player<'_> {
    /// The bytes of every output after a frame that equals one in full.
    fn frame(&mut self, text: String) -> Checked<BTreeMap<String, Vec<u32>>> {
        let project = project(text)?;
        let settings = Settings { size: [8, 8], skip: true, verify: true, ..Settings::default() };
        let mut session = Session::after(self.gpu, &project, self.scene.clone(), settings, self.session.as_ref())?;
        session.frame(self.gpu, 0, 0.0)?;
        let mut outputs = BTreeMap::new();
        for (name, id) in session.plan.outputs.clone() {
            let words = match session.memory(id)? {
                Memory::Buffer(_) => session.words(self.gpu, &name)?,
                Memory::Texture(_) => session.image(self.gpu, &name)?.data.iter().map(|x| x.to_bits()).collect(),
            };
            outputs.insert(name, words);
        }
        self.session = Some(session);
        Ok(outputs)
    }
}

#[test]
fn every_field_of_every_pass_and_resource_is_edited_live() {
    let (pieces, toggles) = toggles();
    let there: BTreeSet<String> = toggles.iter().map(|t| t.field.clone()).collect();
    let passes = kinds(&|kind| format!("Graph(passes: [{kind}], outputs: {{}})"));
    let resources = kinds(&|kind| format!("Graph(resources: {{\"a\": {kind}}}, passes: [], outputs: {{}})"));
    let all = passes.iter().chain(&resources);
    let all: BTreeSet<String> =
        all.flat_map(|(kind, fields)| fields.iter().map(move |f| format!("{kind}.{f}"))).collect();
    assert_eq!(all.difference(&there).collect::<Vec<_>>(), Vec::<&String>::new(), "not in toggles/graph.ron");
    assert_eq!(there.difference(&all).collect::<Vec<_>>(), Vec::<&String>::new(), "not of the language");

    let gpu = &*device::gpu();
    let scene = Scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}")).scene;
    let mut player = Player { gpu, scene: Arc::new(scene), session: None };
    let plain = player.frame(text(&pieces, &toggles, None)).unwrap_or_else(|f| panic!("{f}"));
    let mut wrong = vec![];
    let mut silent = vec![];
    for (i, toggle) in toggles.iter().enumerate() {
        match player.frame(text(&pieces, &toggles, Some(i))) {
            Ok(edited) if edited == plain => silent.push(toggle.field.as_str()),
            Ok(_) => {}
            Err(faults) => wrong.push(format!("{}: {faults}", toggle.field)),
        }
        match player.frame(text(&pieces, &toggles, None)) {
            Ok(back) if back == plain => {}
            Ok(_) => wrong.push(format!("{}, undone: another result than at first", toggle.field)),
            Err(faults) => wrong.push(format!("{}, undone: {faults}", toggle.field)),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    silent.retain(|field| !SILENT.iter().any(|s| field.ends_with(&format!(".{s}"))));
    assert!(silent.is_empty(), "no output is another after an edit of {silent:?}");
}
