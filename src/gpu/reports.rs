//! Holds the reports of shaders: a buffer for each step whose shader checks something, cleared before the step runs.

use super::{buffers::empty, device::Gpu, recorder::Recorder};
use crate::diag::Checked;
use crate::plan::{Binding, Plan, StepId};
use crate::shader::report::{BYTES, Failed, read};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// By step. What a step reported stays until it runs again.
#[derive(Debug, Default)]
pub(super) struct Reports {
    buffers: BTreeMap<StepId, wgpu::Buffer>,
    arrived: Arc<Mutex<Vec<(StepId, Failed)>>>,
}

/// The reports of one frame, once its bytes have arrived.
#[derive(Debug)]
pub(super) struct FrameReports {
    steps: Vec<StepId>,
    /// Shared by the frames of a session, which arrive in their order.
    arrived: Arc<Mutex<Vec<(StepId, Failed)>>>,
}

impl FrameReports {
    /// The checks that do not hold, by step. A frame in which nothing ran reads no bytes: those of the frame before.
    pub(super) fn failed(&self, bytes: &[u8]) -> Vec<(StepId, Failed)> {
        // The list is replaced as a whole.
        let mut arrived = self.arrived.lock().unwrap_or_else(PoisonError::into_inner);
        if !bytes.is_empty() {
            let each = self.steps.iter().zip(bytes.chunks_exact(BYTES as usize));
            *arrived = each.flat_map(|(step, bytes)| read(bytes).into_iter().map(|f| (*step, f))).collect();
        }
        arrived.clone()
    }
}

impl Reports {
    /// # Errors
    /// No memory is left.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Reports> {
        let wanted = |id: &usize| plan.steps[*id].bindings.iter().any(|b| matches!(b, Binding::Report));
        let steps: Vec<StepId> = (0..plan.steps.len()).filter(wanted).map(StepId).collect();
        use wgpu::BufferUsages as U;
        let report = || empty(gpu, "what shaders report to", BYTES, U::STORAGE | U::COPY_SRC | U::COPY_DST);
        let buffers = steps.iter().map(|id| Ok((*id, report()?))).collect::<Checked<_>>()?;
        Ok(Reports { buffers, arrived: Arc::default() })
    }

    pub(super) fn buffer(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.buffers.get(&StepId(step))
    }

    /// Forgets what a step reported, before its first run of a frame.
    pub(super) fn clear(&self, record: &mut Recorder<'_>, step: StepId) {
        if let Some(buffer) = self.buffers.get(&step) {
            record.encoder().clear_buffer(buffer, 0, None);
        }
    }

    /// What all steps report to, and how many bytes each.
    pub(super) fn all(&self) -> impl Iterator<Item = (&wgpu::Buffer, u64)> {
        self.buffers.values().map(|buffer| (buffer, BYTES))
    }

    pub(super) fn of_frame(&self) -> FrameReports {
        FrameReports { steps: self.buffers.keys().copied().collect(), arrived: self.arrived.clone() }
    }
}
