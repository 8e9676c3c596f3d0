//! Timestamps of the device: a pair for each run of a step, in as many query sets as a frame needs.

use super::{device::Gpu, readback::map, record::Record, scope::scoped};
use crate::diag::Checked;
use crate::plan::StepId;

/// Queries in one set; the most that WebGPU allows.
const CHUNK: u32 = wgpu::QUERY_SET_MAX_QUERIES;
/// Runs beyond this many sets go untimed, so that an endless loop doesn't eat the memory.
const MOST_CHUNKS: u32 = 64;

/// Hands out pairs of queries and reads them at the end of a frame. Its query sets stay for the next frame.
#[derive(Debug)]
pub(super) struct Timer {
    /// Copies and clears, which have no pass of their own, can be timed.
    encoders: bool,
    passes: bool,
    sets: Vec<wgpu::QuerySet>,
    resolved: Option<(wgpu::Buffer, wgpu::Buffer)>,
    /// The step of each pair, in the order of use.
    runs: Vec<StepId>,
}

/// Where a run of a step writes its begin and its end.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    pub set: wgpu::QuerySet,
    pub begin: u32,
    pub end: u32,
}

impl Timer {
    pub(super) fn new(gpu: &Gpu) -> Timer {
        let passes = gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY);
        let encoders = passes && gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        Timer { encoders, passes, sets: vec![], resolved: None, runs: vec![] }
    }

    pub(super) fn start(&mut self) {
        self.runs.clear();
    }

    /// A pair for one run of a step; `None` when the device can't time it.
    pub(super) fn pair(&mut self, gpu: &Gpu, step: StepId, in_pass: bool) -> Option<Pair> {
        let index = u32::try_from(self.runs.len()).ok()?.checked_mul(2)?;
        let chunk = index / CHUNK;
        if !(if in_pass { self.passes } else { self.encoders }) || chunk >= MOST_CHUNKS {
            return None;
        }
        if chunk as usize >= self.sets.len() {
            self.sets.push(gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: CHUNK,
            }));
        }
        self.runs.push(step);
        let set = self.sets.get(chunk as usize)?.clone();
        Some(Pair { set, begin: index % CHUNK, end: index % CHUNK + 1 })
    }

    /// Hands over the times of all runs, to be read when the frame is done.
    ///
    /// # Errors
    /// No memory is left for them.
    pub(super) fn resolve(&mut self, gpu: &Gpu, record: &mut Record<'_>) -> Checked<()> {
        let queries = 2 * self.runs.len() as u64;
        if queries == 0 {
            return Ok(());
        }
        let (resolve, read) = self.buffers(gpu, 8 * queries)?;
        let encoder = record.encoder();
        for (chunk, set) in self.sets.iter().enumerate() {
            let first = chunk as u64 * u64::from(CHUNK);
            let count = queries.saturating_sub(first).min(CHUNK.into()) as u32;
            if count > 0 {
                encoder.resolve_query_set(set, 0..count, &resolve, 8 * first);
            }
        }
        encoder.copy_buffer_to_buffer(&resolve, 0, &read, 0, 8 * queries);
        Ok(())
    }

    /// Waits for the frame; milliseconds and timed runs of each step, by its index.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn read(&self, gpu: &Gpu, steps: usize) -> Checked<Vec<(f64, u32)>> {
        let mut out = vec![(0.0, 0); steps];
        let queries = 2 * self.runs.len() as u64;
        let Some((_, read)) = self.resolved.as_ref().filter(|_| queries > 0) else {
            gpu.wait()?;
            return Ok(out);
        };
        let bytes = map(gpu, read, 8 * queries)?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        for (step, pair) in self.runs.iter().zip(ticks.chunks_exact(2)) {
            let [begin, end] = *pair else { continue };
            if let Some((ms, runs)) = out.get_mut(step.0) {
                *ms += end.saturating_sub(begin) as f64 * f64::from(gpu.timestamp_period) * 1e-6;
                *runs += 1;
            }
        }
        Ok(out)
    }

    fn buffers(&mut self, gpu: &Gpu, size: u64) -> Checked<(wgpu::Buffer, wgpu::Buffer)> {
        if let Some((resolve, read)) = &self.resolved
            && resolve.size() >= size
        {
            return Ok((resolve.clone(), read.clone()));
        }
        let made = scoped(gpu, "allocate room for timestamps", || {
            let make = |usage| {
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size: size.next_power_of_two(),
                    usage,
                    mapped_at_creation: false,
                })
            };
            (
                make(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
                make(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            )
        })?;
        self.resolved = Some(made.clone());
        Ok(made)
    }
}
