//! The scene that is shown: of a file, or come over the link.

use super::super::feed::Remade;
use super::super::link::{self, Linked};
use super::kept::Key;
use super::{FrameRequest, ViewStage, ms};
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

pub(super) struct LoadedScene {
    pub path: PathBuf,
    pub scene: Arc<Scene>,
    pub files: Vec<PathBuf>,
    pub notices: Vec<Diagnostic>,
    pub stale: bool,
    /// Differs from that of any other scene.
    pub version: u64,
}

impl ViewStage {
    /// Makes the scene what the wish asks for.
    pub(super) fn set_scene(&mut self, wish: &FrameRequest, remade: &mut Remade) -> Checked<()> {
        match &wish.linked {
            Some(linked) => self.follow(linked),
            None if wish.choice.scene == Path::new(link::NAME) => {
                let d = Diagnostic::error("no scene has come over the live link yet");
                Err(d
                    .help("give the link that `lightgraph view --link` prints to the program that has the scene")
                    .into())
            }
            None => self.load_scene(&wish.choice.scene, remade),
        }
    }

    fn follow(&mut self, linked: &Linked) -> Checked<()> {
        let new = |scene: &&Arc<Scene>| !self.scene.as_ref().is_some_and(|s| Arc::ptr_eq(&s.scene, scene));
        if let Some(scene) = linked.scene.as_ref().filter(new) {
            self.scene = Some(LoadedScene {
                path: link::NAME.into(),
                scene: scene.clone(),
                files: vec![],
                notices: linked.notices.to_vec(),
                stale: false,
                version: self.scene.as_ref().map_or(1, |s| s.version + 1),
            });
        }
        Faults::check(linked.faults.clone(), ())
    }

    fn load_scene(&mut self, path: &Path, remade: &mut Remade) -> Checked<()> {
        let fresh = self.scene.as_ref().is_some_and(|s| s.path == path && !s.stale);
        if fresh {
            return Ok(());
        }
        let key = Key { graph: path.into(), params: Values::new(), size: [0; 2], scene: 0, revision: self.revision };
        self.vain(&key)?;
        let start = Instant::now();
        let loaded = Scene::load_with(path, &self.additions).map_err(|f| self.note(key, f))?;
        remade.scene_ms = ms(start);
        match &mut self.scene {
            Some(old) if *old.scene == loaded.scene => {
                old.path = path.into();
                old.stale = false;
                old.files = loaded.files;
                old.notices = loaded.notices;
            }
            slot => {
                let version = slot.as_ref().map_or(1, |s| s.version + 1);
                *slot = Some(LoadedScene {
                    path: path.into(),
                    scene: Arc::new(loaded.scene),
                    files: loaded.files,
                    notices: loaded.notices,
                    stale: false,
                    version,
                });
            }
        }
        Ok(())
    }
}
