//! Alternatives of what is shown, timed in turn with its frames; then the fastest is shown.

use super::{Engine, ShownPair};
use crate::tell;
use lightgraph::Checked;
use lightgraph::internals::fastest::{Measuring, Policy};
use lightgraph::internals::plan::fastest::{Alternatives, Choices};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

/// Where times of alternatives are held, in memory: the page keeps them for the next visit.
pub(super) const TIMES: &str = "caches/fastest.json";

/// What has been shown for so long is timed: whoever drags a slider waits for none of it.
const SETTLED: Duration = Duration::from_secs(1);

impl ShownPair {
    /// Whether it has alternatives of which nobody knows the fastest, and has been shown long enough.
    fn is_due(&self) -> bool {
        let session = &self.first.session;
        let open = |group: &Alternatives| !session.settings.choices.contains_key(&group.name);
        self.wish.fastest == Policy::Measure
            && !self.measured
            && session.plan.alternatives.iter().any(open)
            && self.since.elapsed() > SETTLED
    }
}

impl Engine {
    /// Begins a run of an alternative or ends one, between two frames. Whether the next frame has to wait.
    pub(super) fn measure(&mut self, told: &mut Value) -> Checked<bool> {
        let quiet = self.frames.iter().all(VecDeque::is_empty) && self.next.is_none() && !self.failed;
        let (Some(shown), gpu) = (&mut self.shown, &self.gpu) else { return Ok(false) };
        let measuring = match &mut self.measuring {
            Some(measuring) => measuring,
            None if quiet && self.index[0] > 0 && shown.is_due() => {
                shown.measured = true;
                let (first, scene) = (&shown.first, &shown.first.session.scene);
                let file = Some(Path::new(TIMES));
                self.measuring.insert(Measuring::new(gpu, &first.project, scene, &first.session.settings, file)?)
            }
            None => return Ok(false),
        };
        if !measuring.is_under_way() {
            if !quiet || !gpu.answered()? {
                return Ok(true);
            }
            // A frame has its turn between two runs.
            if !self.drawn && !self.rest[0] {
                return Ok(false);
            }
            self.drawn = false;
        }
        let found = measuring.advance(gpu);
        if matches!(found, Ok(None)) {
            return Ok(true);
        }
        let refused = self.measuring.take().map_or(vec![], |measuring| measuring.refused);
        told["noticed"] = tell::diagnostics(&refused);
        match found.and_then(|choices| self.decide(choices.unwrap_or_default(), told)) {
            // What is shown goes on.
            Err(faults) if self.gpu.check().is_ok() => told["noticed"] = tell::diagnostics(&faults.0),
            decided => decided?,
        }
        Ok(false)
    }

    /// Makes what is shown of these choices.
    fn decide(&mut self, choices: Choices, told: &mut Value) -> Checked<()> {
        let Some(shown) = &mut self.shown else { return Ok(()) };
        shown.first.session.settings.choices = choices;
        let wish = shown.wish.clone();
        told["times"] = json!(TIMES);
        told["made"] = self.make(&wish)?;
        Ok(())
    }
}
