//! What shaders report of themselves: memory for each step whose shader checks something, cleared before the step runs.

use super::{device::Gpu, readback::map, readback::staging, record::Record, scope::scoped};
use crate::diag::Checked;
use crate::plan::{Binding, Plan, StepId};
use crate::shader::report::{BYTES, Failed, read};
use std::collections::BTreeMap;

/// By step. What a step reported stays until it runs again.
#[derive(Debug, Default)]
pub(super) struct Reports {
    buffers: BTreeMap<StepId, wgpu::Buffer>,
    /// Where all of them are read; `None` without any.
    staging: Option<wgpu::Buffer>,
}

impl Reports {
    /// # Errors
    /// No memory is left.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Reports> {
        let wanted = |id: &usize| plan.steps[*id].bindings.iter().any(|b| matches!(b, Binding::Report));
        let steps: Vec<StepId> = (0..plan.steps.len()).filter(wanted).map(StepId).collect();
        if steps.is_empty() {
            return Ok(Reports::default());
        }
        let desc = wgpu::BufferDescriptor {
            label: Some("report"),
            size: BYTES,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        let buffers = scoped(gpu, "allocate what shaders report to", || {
            steps.iter().map(|id| (*id, gpu.device.create_buffer(&desc))).collect()
        })?;
        let staging = staging(gpu, "what shaders report", BYTES * steps.len() as u64)?;
        Ok(Reports { buffers, staging: Some(staging) })
    }

    pub(super) fn buffer(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.buffers.get(&StepId(step))
    }

    /// Forgets what a step reported, before its first run of a frame.
    pub(super) fn clear(&self, record: &mut Record<'_>, step: StepId) {
        if let Some(buffer) = self.buffers.get(&step) {
            record.encoder().clear_buffer(buffer, 0, None);
        }
    }

    /// Hands over what all steps reported, to be read when the frame is done.
    pub(super) fn collect(&self, record: &mut Record<'_>) {
        let Some(staging) = &self.staging else { return };
        for (i, buffer) in self.buffers.values().enumerate() {
            record.encoder().copy_buffer_to_buffer(buffer, 0, staging, BYTES * i as u64, BYTES);
        }
    }

    /// Waits for what was collected: the checks that do not hold, by step.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn read(&self, gpu: &Gpu) -> Checked<Vec<(StepId, Failed)>> {
        let Some(staging) = &self.staging else { return Ok(vec![]) };
        let bytes = map(gpu, staging, BYTES * self.buffers.len() as u64)?;
        let each = self.buffers.keys().zip(bytes.chunks_exact(BYTES as usize));
        Ok(each.flat_map(|(step, bytes)| read(bytes).into_iter().map(|f| (*step, f))).collect())
    }
}
