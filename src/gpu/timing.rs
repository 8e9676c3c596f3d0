//! Measures steps by device timestamps: a pair per run of a step, in as many query sets as a frame needs. Adjacent
//! runs share a stamp, because on some drivers a stamp costs as much as a small dispatch.

use super::{buffers::empty, device::Gpu, recorder::Recorder};
use crate::diag::Checked;
use crate::plan::StepId;

/// Queries in one set; the most that WebGPU allows.
const CHUNK: u32 = wgpu::QUERY_SET_MAX_QUERIES;
/// Runs beyond this many sets go untimed, so that an endless loop doesn't eat the memory.
const MOST_CHUNKS: usize = 64;

/// What is timed in a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Timing {
    /// Each step: the device may have to end one before it begins the next.
    #[default]
    Steps,
    /// Each step by itself, by the host's clock: it is submitted and waited for. For software drivers, whose stamps say
    /// when a command was read and not when its work was done. A recorded frame waits for nothing and has the device's
    /// stamps.
    Waited,
    /// The frame as a whole.
    Frame,
}

impl Timing {
    /// How steps are timed on this device by a caller who waits for its frames.
    pub fn of_steps(gpu: &Gpu) -> Timing {
        if gpu.is_software() { Timing::Waited } else { Timing::Steps }
    }
}

/// Hands out pairs of queries and reads them at the end of a frame. Its query sets stay for the next frame.
#[derive(Debug)]
pub(super) struct Timer {
    /// Copies and clears, which have no pass of their own, can be timed.
    encoders: bool,
    passes: bool,
    sets: Vec<wgpu::QuerySet>,
    /// Of each set: the queries in use.
    used: Vec<u32>,
    resolved: Option<wgpu::Buffer>,
    taken: Stamps,
}

/// The stamps of a frame.
#[derive(Debug, Default)]
pub(super) struct Stamps {
    /// Each run's step, set, and queries in it, in the order of use.
    runs: Vec<(StepId, usize, [u32; 2])>,
    /// Moments of the frame that are no step's: set, and query in it.
    marks: Vec<(usize, u32)>,
}

/// Where a run of a step writes its begin and its end.
#[derive(Debug, Clone)]
pub(super) struct TimestampPair {
    pub set: wgpu::QuerySet,
    /// Is written already where the run before has ended with it.
    pub begin: u32,
    pub begun: bool,
    pub end: u32,
}

/// What a frame took on the device.
pub(super) struct Timed {
    /// By index of the step.
    pub steps: Vec<TimedStep>,
    /// From the first begin to the last end, milliseconds.
    pub whole: Option<f64>,
}

/// What the runs of a step took, in milliseconds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TimedStep {
    pub ms: f64,
    /// The runs that were timed.
    pub runs: u32,
    /// From the first begin of all to that of its first run.
    pub began_ms: Option<f64>,
}

impl Timer {
    pub(super) fn new(gpu: &Gpu) -> Timer {
        let passes = gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY);
        let encoders = passes && gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        Timer { encoders, passes, sets: vec![], used: vec![], resolved: None, taken: Stamps::default() }
    }

    pub(super) fn start(&mut self) {
        self.taken = Stamps::default();
        self.used.clear();
    }

    /// A pair for one run of a step; `None` when the device can't time it. With `follows` nothing has come since the
    /// last run ended.
    pub(super) fn pair(&mut self, gpu: &Gpu, step: StepId, in_pass: bool, follows: bool) -> Option<TimestampPair> {
        if !(if in_pass { self.passes } else { self.encoders }) {
            return None;
        }
        let (chunk, set) = self.room(gpu)?;
        let used = self.used.last_mut()?;
        let begun = follows && *used > 0;
        let begin = *used - u32::from(begun);
        let end = begin + 1;
        *used = end + 1;
        self.taken.runs.push((step, chunk, [begin, end]));
        Some(TimestampPair { set, begin, begun, end })
    }

    /// Notes when the device comes to this moment of the frame.
    pub(super) fn mark(&mut self, gpu: &Gpu, record: &mut Recorder<'_>) {
        if !self.encoders {
            return;
        }
        if let Some((chunk, set)) = self.room(gpu)
            && let Some(used) = self.used.last_mut()
        {
            record.encoder().write_timestamp(&set, *used);
            self.taken.marks.push((chunk, *used));
            *used += 1;
        }
    }

    /// A set with room for two queries, and its number.
    fn room(&mut self, gpu: &Gpu) -> Option<(usize, wgpu::QuerySet)> {
        let full = |used: &u32| used + 2 > CHUNK;
        if self.used.last().is_none_or(full) {
            if self.used.len() >= MOST_CHUNKS {
                return None;
            }
            self.used.push(0);
        }
        let chunk = self.used.len() - 1;
        if chunk >= self.sets.len() {
            self.sets.push(gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: CHUNK,
            }));
        }
        Some((chunk, self.sets.get(chunk)?.clone()))
    }

    /// Hands over the stamps of a frame: what they are of, and a buffer of the first so many bytes.
    ///
    /// # Errors
    /// No memory is left for them.
    pub(super) fn resolve(
        &mut self,
        gpu: &Gpu,
        record: &mut Recorder<'_>,
    ) -> Checked<(Stamps, Option<(wgpu::Buffer, u64)>)> {
        let taken = std::mem::take(&mut self.taken);
        let bytes = 8 * self.queries();
        if bytes == 0 {
            return Ok((taken, None));
        }
        let resolve = self.buffer(gpu, bytes)?;
        let encoder = record.encoder();
        for (chunk, (set, used)) in self.sets.iter().zip(&self.used).enumerate() {
            encoder.resolve_query_set(set, 0..*used, &resolve, 8 * chunk as u64 * u64::from(CHUNK));
        }
        Ok((taken, Some((resolve, bytes))))
    }

    /// How many queries there are to read, with those left over at the ends of full sets.
    fn queries(&self) -> u64 {
        let full = self.used.len().saturating_sub(1) as u64;
        full * u64::from(CHUNK) + u64::from(self.used.last().copied().unwrap_or(0))
    }

    fn buffer(&mut self, gpu: &Gpu, size: u64) -> Checked<wgpu::Buffer> {
        if let Some(resolve) = self.resolved.as_ref().filter(|buffer| buffer.size() >= size) {
            return Ok(resolve.clone());
        }
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let made = empty(gpu, "room for timestamps", size.next_power_of_two(), usage)?;
        Ok(self.resolved.insert(made).clone())
    }
}

impl Stamps {
    /// What `steps` steps took, by the bytes of their stamps.
    pub(super) fn read(&self, bytes: &[u8], period: f32, steps: usize) -> Timed {
        let mut out = vec![TimedStep::default(); steps];
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        let ms = |begin: u64, end: u64| end.saturating_sub(begin) as f64 * f64::from(period) * 1e-6;
        let at = |chunk: usize, query: u32| ticks.get(chunk * CHUNK as usize + query as usize);
        let marks = self.marks.iter().filter_map(|(chunk, query)| at(*chunk, *query).copied());
        let mut whole = marks.clone().min().zip(marks.max()).map(|(first, last)| [first, last]);
        for (step, chunk, pair) in &self.runs {
            let [begin, end] = pair.map(|query| at(*chunk, query));
            if let (Some(timed), Some(&begin), Some(&end)) = (out.get_mut(step.0), begin, end) {
                timed.ms += ms(begin, end);
                timed.runs += 1;
                let [first, last] = whole.unwrap_or([begin, end]);
                whole = Some([first.min(begin), last.max(end)]);
            }
        }
        for (step, chunk, [begin, _]) in &self.runs {
            if let (Some(timed), Some(&begin), Some([first, _])) = (out.get_mut(step.0), at(*chunk, *begin), whole) {
                timed.began_ms.get_or_insert(ms(first, begin));
            }
        }
        Timed { steps: out, whole: whole.map(|[begin, end]| ms(begin, end)) }
    }
}
