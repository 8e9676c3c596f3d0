//! A session that stays as long as it may be wanted, and the last image that it made.

use super::super::choice::ViewChoice;
use super::super::feed::{ShownFrame, Subject};
use super::super::shown::copy;
use lightgraph::internals::gpu::Numerics;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Memory, Project, Session};
use std::path::PathBuf;
use std::sync::Arc;

/// A session and what it was made for.
pub(super) struct KeptSession {
    pub key: Key,
    pub project: Project,
    pub session: Session,
    pub subject: Arc<Subject>,
    pub output: String,
    /// A copy of the output, in linear light.
    pub image: Option<wgpu::Texture>,
    /// Counts the contents of `image`.
    pub images: u64,
    /// Frames since what is seen changed.
    pub frames: u32,
    /// What the last frame was made with.
    pub last: Option<(ViewChoice, f32)>,
    /// The last frame ran no step, or can't be rendered.
    pub rest: bool,
    /// Why it can't.
    pub fault: Option<Faults>,
    /// The checks in shaders that do not hold in what is shown, and what is wrong with the numbers that steps left.
    pub checks: Arc<Vec<Diagnostic>>,
    /// Of what is in memory, where numbers are checked.
    pub numerics: Option<Numerics>,
}

/// What a session depends on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Key {
    pub graph: PathBuf,
    pub params: Values,
    pub size: [u32; 2],
    pub scene: u64,
    pub revision: u64,
}

impl KeptSession {
    pub fn render(&mut self, gpu: &Gpu, time: f32) -> Checked<ShownFrame> {
        let mut report = self.session.frame(gpu, self.frames, time)?;
        self.frames += 1;
        if let Some(now) = report.numerics.take() {
            report.numerics = Some(self.numerics.take().unwrap_or_default().then(now));
            self.numerics.clone_from(&report.numerics);
        }
        self.checks = Arc::new(self.session.failed_checks(&report));
        let shown = match self.session.memory(self.session.output(&self.output)?)? {
            Memory::Texture(texture) => copy(gpu, texture, self.image.take()),
            Memory::Buffer(_) => None,
        };
        let Some(image) = shown else {
            let d = Diagnostic::error(format!("the output `{}` is no image of colours", self.output));
            return Err(d.help("look at it as a resource, or choose another output").into());
        };
        self.image = Some(image);
        self.images += 1;
        Ok(ShownFrame { report, why: self.session.why().to_vec() })
    }
}

/// The output to show.
pub(super) fn output(session: &Session, wanted: Option<&str>) -> Checked<String> {
    let has = |name: &str| session.plan.outputs.iter().any(|o| o.0 == name);
    let first = session.plan.outputs.first().map(|o| o.0.as_str());
    let found = wanted.filter(|w| has(w)).or(if has("color") { Some("color") } else { first });
    found.map(str::to_string).ok_or_else(|| Diagnostic::error("the graph has no output to show").into())
}
