//! Shaders of the planner's own steps. They are the same for all plans, and made once.

use super::wire::Wirer;
use crate::diag::{Checked, Source};
use crate::shader::{Def, Defs, Library, Shader, compose};
use std::sync::{Arc, Mutex, PoisonError};

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BuiltIn {
    /// Fills a buffer of draws with what members see.
    Cull,
    /// Bounds what a pass takes from a buffer of counts.
    Bound,
    /// A stage of prefix sums, of integers or of floats.
    Scan(ScanStage, bool),
}

/// The stages of prefix sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScanStage {
    /// The sum of each block.
    AddUp,
    /// What comes before each block.
    Before,
    /// The sums of each block's elements.
    Place,
    /// The same of a single block.
    Alone,
}

impl BuiltIn {
    /// Its file and entry point. The path can't be that of a file of a graph.
    fn file(self) -> (&'static str, &'static str, &'static str) {
        const SCAN: (&str, &str) = ("built-in: scan.wgsl", include_str!("scan.wgsl"));
        let ((path, text), entry) = match self {
            BuiltIn::Cull => (("built-in: cull.wgsl", include_str!("cull.wgsl")), "cull"),
            BuiltIn::Bound => (("built-in: bound.wgsl", include_str!("bound.wgsl")), "bound"),
            BuiltIn::Scan(ScanStage::AddUp, _) => (SCAN, "add_up"),
            BuiltIn::Scan(ScanStage::Before, _) => (SCAN, "come_before"),
            BuiltIn::Scan(ScanStage::Place, _) => (SCAN, "place"),
            BuiltIn::Scan(ScanStage::Alone, _) => (SCAN, "place_alone"),
        };
        (path, text, entry)
    }

    fn compose(self) -> Checked<Arc<Shader>> {
        let (path, text, entry) = self.file();
        let mut library = Library::default();
        library.files.insert(path.into(), Source::new(path, text));
        let floats = matches!(self, BuiltIn::Scan(_, true));
        let defs: Defs = floats.then(|| ("FLOATS".to_string(), Def::Bool(true))).into_iter().collect();
        compose(&library, path, &defs, &[entry.into()]).map(Arc::new)
    }

    fn shader(self) -> Checked<Arc<Shader>> {
        type Made = Vec<(BuiltIn, Checked<Arc<Shader>>)>;
        static MADE: Mutex<Made> = Mutex::new(vec![]);
        let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, shader)) = made.iter().find(|(known, _)| *known == self) {
            return shader.clone();
        }
        let shader = self.compose();
        made.push((self, shader.clone()));
        shader
    }
}

impl Wirer<'_, '_> {
    /// The shader and its index among the plan's.
    pub(super) fn built_in(&mut self, which: BuiltIn) -> Option<(usize, Arc<Shader>)> {
        let shader = which.shader().map_err(|f| self.faults.extend(f.0)).ok()?;
        let there = self.out.shaders.iter().position(|s| Arc::ptr_eq(s, &shader));
        let index = there.unwrap_or_else(|| {
            self.out.shaders.push(shader.clone());
            self.out.shaders.len() - 1
        });
        Some((index, shader))
    }
}
