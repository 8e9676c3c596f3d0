//! Stops a frame around one step, to inspect what the step reads and what it writes.

use super::probe::find;
use super::{Session, change};
use crate::diag::Checked;
use crate::gpu::{self, FrameInputs, FrameReport, Gpu};
use crate::plan::{Binding, StepId, steps_of};
use crate::value::Value;

impl Session {
    /// The step of this name, or the only one of the pass of this name.
    ///
    /// # Errors
    /// There is none, there are several, or it does not run.
    pub fn step(&self, name: &str) -> Checked<StepId> {
        find(&self.plan, name).map(StepId)
    }

    /// As [`Session::frame`], in full; calls `look` before the step runs and after it did. A step in a loop is looked
    /// at before the whole loop and after it. What resources hold at those moments can be read where the session was
    /// made with [`super::Settings::inspect`].
    ///
    /// # Errors
    /// As [`Session::frame`], or as `look`.
    pub fn frame_around(
        &mut self,
        gpu: &Gpu,
        (index, time): (u32, f32),
        step: StepId,
        look: &mut dyn FnMut(&Session, bool) -> Checked<()>,
    ) -> Checked<FrameReport> {
        let (values, tables, _) = self.choose(index, time)?;
        let selection = change::full(&self.plan, &self.keys, &self.held, &self.inputs, &values);
        let mut parts = [(); 3].map(|()| vec![false; self.plan.steps.len()]);
        let mut part = 0;
        for node in &self.plan.order {
            let steps = steps_of(std::slice::from_ref(node));
            let here = steps.contains(&step);
            part = if here {
                1
            } else if part == 1 {
                2
            } else {
                part
            };
            steps.iter().for_each(|s| parts[part][s.0] = true);
        }
        self.start(&selection);
        let mut whole: Checked<FrameReport> = Ok(FrameReport::default());
        for (i, run) in parts.iter().enumerate() {
            if run.contains(&true) {
                let mut chosen = selection.clone();
                chosen.run.clone_from(run);
                let tables = tables.as_deref().filter(|_| i == 0);
                let timing = self.settings.timing;
                let frame =
                    FrameInputs { values: values.clone(), tables, chosen: Some(&chosen), timing, careful: true };
                let ran = gpu::execute(gpu, &self.plan, &mut self.prepared, &frame);
                whole = whole.and_then(|whole| Ok(joined(whole, ran?)));
            }
            if i < 2 && whole.is_ok() {
                self.last.values.clone_from(&values);
                if let Err(faults) = look(self, i == 1) {
                    whole = Err(faults);
                }
            }
            if whole.is_err() {
                break;
            }
        }
        self.finish(&selection, (index, time), &values, whole)
    }

    /// The uniforms of a step in the last frame, by name; those that a loop counts are left out.
    pub fn uniforms(&self, step: StepId) -> Vec<(String, Value)> {
        let bindings = self.plan.steps.get(step.0).map_or(&[][..], |s| &s.bindings);
        let mut found = vec![];
        for binding in bindings {
            let Binding::Uniform { layout, extra } = binding else { continue };
            for member in layout.members.iter().filter(|m| m.read) {
                let name = &member.name;
                let value = extra.get(name).or(self.last.values.get(name)).or(self.plan.values.get(name));
                found.extend(value.map(|value| (name.clone(), *value)));
            }
        }
        found
    }
}

/// One report of two parts of a frame.
fn joined(mut whole: FrameReport, part: FrameReport) -> FrameReport {
    let FrameReport { steps, loops, warnings, numerics, failed, device_ms, wall_ms, record_ms, submit_ms } = part;
    whole.steps.extend(steps);
    whole.loops.extend(loops);
    whole.warnings.extend(warnings);
    whole.numerics = match (whole.numerics, numerics) {
        (Some(before), Some(now)) => Some(before.then(now)),
        (before, now) => before.or(now),
    };
    whole.failed.extend(failed);
    whole.device_ms = match (whole.device_ms, device_ms) {
        (Some(a), Some(b)) => Some(a + b),
        (a, b) => a.or(b),
    };
    whole.wall_ms += wall_ms;
    whole.record_ms += record_ms;
    whole.submit_ms += submit_ms;
    whole
}
