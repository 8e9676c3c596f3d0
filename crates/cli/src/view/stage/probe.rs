//! Asks an invocation what it computes: one frame of a session like the one that is seen, with the step's shader
//! instrumented. Both share memory, so that only the step runs and what reads its result; history goes on.

use super::super::feed::ProbeAnswer;
use super::kept::Key;
use super::{FrameRequest, ResourcePart, ViewStage, ms};
use crate::probe_report::ProbeReport;
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::plan::ResourceId;
use lightgraph::internals::session::Probing;
use lightgraph::{Checked, Diagnostic, Session, Settings};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// An invocation, and a number by which the same one can be asked again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ask {
    pub serial: u32,
    /// Whose pass it is: one of the graphs that are seen.
    pub graph: PathBuf,
    pub of: ProbedPlace,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProbedPlace {
    /// That which wrote a texel of the output that is shown.
    Pixel([u32; 2]),
    /// That which wrote a texel of a resource.
    Texel {
        part: ResourcePart,
        at: [u32; 2],
    },
    Invocation {
        step: String,
        at: [u32; 3],
    },
}

/// At most so often while what was asked changes.
const SELDOM: Duration = Duration::from_millis(400);

/// The last answer, what it was made with, and when.
pub(super) struct LastAnswer {
    key: Option<Key>,
    at: Instant,
    pub probed: Arc<ProbeAnswer>,
}

impl ViewStage {
    /// Answers what the wish asks: once, and again when the graph, a shader, a parameter, the size or the scene
    /// changes. Whether a frame was rendered for it.
    pub(super) fn probe(&mut self, wish: &FrameRequest, rest: bool) -> bool {
        let Some(ask) = &wish.ask else {
            self.answer = None;
            return false;
        };
        let key = self.find(&ask.graph).map(|k| k.key.clone());
        let due = self
            .answer
            .as_ref()
            .is_none_or(|last| last.probed.ask != *ask || (last.key != key && (rest || last.at.elapsed() > SELDOM)));
        if due {
            let start = Instant::now();
            let answer = self.ask(ask, wish.time);
            let probed = Arc::new(ProbeAnswer { ask: ask.clone(), answer, ms: ms(start) });
            self.answer = Some(LastAnswer { key, at: Instant::now(), probed });
        }
        due
    }

    fn ask(&mut self, ask: &Ask, time: f32) -> Checked<ProbeReport> {
        let gpu = self.gpu.clone();
        let Some(kept) = self.kept.iter_mut().find(|k| k.key.graph == ask.graph) else {
            let d = Diagnostic::error(format!("{} is not shown", ask.graph.display()));
            return Err(d.help("show the graph, then ask").into());
        };
        let shown = &kept.session;
        let texel = |id, part, at| -> Checked<(String, [u32; 3])> {
            let (step, place) = shown.writer(id, part, at)?;
            Ok((shown.plan.steps[step.0].name.clone(), place))
        };
        let (pass, place) = match &ask.of {
            ProbedPlace::Pixel(at) => texel(shown.output(&kept.output)?, (0, 0), *at),
            ProbedPlace::Texel { part, at } => {
                let found = shown.plan.resources.iter().position(|r| r.name == part.resource);
                let none = || Diagnostic::error(format!("the graph has no resource `{}`", part.resource));
                texel(ResourceId(found.ok_or_else(none)?), (part.mip, part.layer), *at)
            }
            ProbedPlace::Invocation { step, at } => Ok((step.clone(), *at)),
        }?;
        let probe = Some(Probing { pass, values: vec![] });
        let settings = Settings { probe, timing: Timing::Frame, ..shown.settings.clone() };
        let mut session = Session::after(&gpu, &kept.project, kept.subject.scene.clone(), settings, Some(shown))?;
        (session.shift, session.pointer) = (shown.shift.clone(), shown.pointer);
        session.probe(&gpu, place)?;
        // From here on memory holds what the copy made: a frame without it follows.
        kept.rest = false;
        session.frame(&gpu, kept.frames, time)?;
        kept.frames += 1;
        ProbeReport::read(&session, &gpu, place)
    }
}
