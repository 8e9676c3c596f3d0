//! Transforms the triangles in tables to world space on the device, and fits the boxes round them, so that a frame in
//! which nodes move uploads their matrices alone.

use super::{
    buffers::{bind_buffers, filled, kernel},
    device::Gpu,
    recorder::Recorder,
    refit::{Boxes, layout},
    scene_data::{Mesh, TableMemory},
};
use crate::diag::Checked;
use crate::plan::TableUse;
use crate::plan::tables::{Derived, derived, has_derived, stride};
use crate::scene::{Corners, Table, VertexAttribute};
use std::ops::Range;
use std::sync::Arc;
use wgpu::BufferUsages as U;

/// Words of a job before its ranges.
const HEADER: usize = 10;
/// Ranges of a job. More are joined into one.
const MOST_RANGES: usize = 64;
/// The place of a member that the row does not have.
const ABSENT: u32 = u32::MAX;
/// Rows of a workgroup.
const LANES: usize = 64;
/// Bytes of a node's transforms.
const NODE: usize = size_of::<[[f32; 4]; 7]>();

/// The kernels that transform triangles and fit boxes, and what they read.
#[derive(Debug)]
pub(super) struct WorldSpace {
    pipeline: wgpu::ComputePipeline,
    nodes: wgpu::Buffer,
    /// The triangles whose transforms the device has.
    held: Arc<Corners>,
    /// `None` where no table has any.
    boxes: Option<Boxes>,
    /// By table.
    jobs: Vec<Job>,
}

/// What the device writes to a table.
#[derive(Debug)]
enum Job {
    Nothing,
    /// Corners of triangles; with the rows to transform.
    Corners(wgpu::Buffer, wgpu::BindGroup),
    /// Boxes round triangles.
    Boxes(wgpu::BindGroup),
}

impl WorldSpace {
    /// Takes all tables of a plan, with the content and memory of each. Returns `None` where the device derives no
    /// member of any.
    ///
    /// # Errors
    /// Fails where the device has no memory left or binds less than a buffer takes.
    pub(super) fn prepare<'a, I>(gpu: &Gpu, mesh: &Mesh, uses: impl Fn() -> I) -> Checked<Option<WorldSpace>>
    where
        I: Iterator<Item = ((&'a TableUse, &'a Table), &'a TableMemory)>,
    {
        let triangles = |wanted, table: &'a Table| table.corners().filter(|_| has_derived(wanted, table));
        let Some(held) = uses().find_map(|((wanted, table), _)| triangles(wanted, table)) else {
            return Ok(None);
        };
        let hierarchy = uses().find_map(|((wanted, table), _)| layout(wanted, table).and(table.hierarchy()));
        let boxes = hierarchy.map(|of| Boxes::prepare(gpu, of)).transpose()?;
        let pipeline = kernel(gpu, include_str!("world_space.wgsl"), "to_world")?;
        let vertices: Vec<[u32; 3]> = (0..held.rows()).map(|row| held.vertices(row)).collect();
        let corners = filled(gpu, "corners of triangles", &[bytemuck::cast_slice(&vertices)], U::STORAGE)?;
        let transforms: Vec<_> = held.transforms(0..held.nodes().len()).collect();
        let nodes = filled(gpu, "transforms of nodes", &[bytemuck::cast_slice(&transforms)], U::STORAGE)?;
        let mut jobs = vec![];
        for ((wanted, table), memory) in uses() {
            if let (Some(boxes), Some(layout)) = (&boxes, layout(wanted, table)) {
                let group = boxes.bind(gpu, layout, [&mesh.vertices, &corners, &nodes], &memory.buffer)?;
                jobs.push(Job::Boxes(group));
                continue;
            }
            let Some(header) = header(wanted, table) else {
                jobs.push(Job::Nothing);
                continue;
            };
            let ranges = vec![0; 2 * MOST_RANGES];
            let pieces = [bytemuck::cast_slice(&header), bytemuck::cast_slice(&ranges)];
            let job = filled(gpu, "rows to transform", &pieces, U::STORAGE)?;
            let buffers = [&job, &mesh.vertices, &mesh.tangents, &corners, &nodes, &memory.buffer];
            let group = bind_buffers(gpu, &format!("the transform of `{}`", wanted.table), &pipeline, &buffers)?;
            jobs.push(Job::Corners(job, group));
        }
        Ok(Some(WorldSpace { pipeline, nodes, held: held.clone(), boxes, jobs }))
    }

    /// Uploads what changed of transforms, and of which boxes are to be fitted.
    pub(super) fn follow(&mut self, gpu: &Gpu, changed: &[Table]) {
        if let (Some(boxes), Some(now)) = (&mut self.boxes, changed.iter().find_map(Table::hierarchy)) {
            boxes.follow(gpu, now);
        }
        let Some(now) = changed.iter().find_map(Table::corners) else { return };
        let differs = |i: &usize| bytemuck::bytes_of(&now.nodes()[*i]) != bytemuck::bytes_of(&self.held.nodes()[*i]);
        let mut other = (0..now.nodes().len()).filter(differs);
        if let Some(first) = other.next() {
            let last = other.next_back().unwrap_or(first);
            let transforms: Vec<_> = now.transforms(first..last + 1).collect();
            gpu.queue.write_buffer(&self.nodes, (NODE * first) as u64, bytemuck::cast_slice(&transforms));
        }
        self.held = now.clone();
    }

    /// Transforms the changed rows, and fits boxes.
    pub(super) fn encode(&self, gpu: &Gpu, record: &mut Recorder<'_>, tables: &[TableMemory]) {
        for (job, memory) in self.jobs.iter().zip(tables) {
            let (job, group) = match (job, &self.boxes) {
                (Job::Corners(job, group), _) => (job, group),
                (Job::Boxes(group), Some(boxes)) => {
                    boxes.encode(record, group);
                    continue;
                }
                _ => continue,
            };
            let mut ranges: Vec<Range<usize>> = memory.dirty.iter().filter(|r| !r.is_empty()).cloned().collect();
            if ranges.len() > MOST_RANGES {
                let end = ranges.iter().map(|r| r.end).max().unwrap_or(0);
                ranges = std::iter::once(ranges[0].start..end).collect();
            }
            let Some(longest) = ranges.iter().map(|r| r.len()).max() else { continue };
            let words: Vec<u32> = ranges.iter().flat_map(|r| [r.start as u32, r.len() as u32]).collect();
            gpu.queue.write_buffer(job, 4 * HEADER as u64, bytemuck::cast_slice(&words));
            let pass = record.compute();
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            let across = (longest.div_ceil(LANES) as u32).min(gpu.limits.max_compute_workgroups_per_dimension);
            pass.dispatch_workgroups(across, ranges.len() as u32, 1);
        }
    }
}

impl WorldSpace {
    /// Notes that the device got what was encoded.
    pub(super) fn encoded(&mut self) {
        self.boxes.iter_mut().for_each(Boxes::encoded);
    }
}

/// The start of a job: the number of words in a row, then the places in it of three positions, three normals and three
/// tangents. `None` where a row has no member in world space.
fn header(wanted: &TableUse, table: &Table) -> Option<[u32; HEADER]> {
    let mut words = [ABSENT; HEADER];
    words[0] = stride(wanted) as u32 / 4;
    for member in &wanted.row.members {
        let Some(Derived::Corner(held, corner)) = derived(wanted, table, member) else { continue };
        let first = match held {
            VertexAttribute::Position => 1,
            VertexAttribute::Normal => 4,
            _ => 7,
        };
        words[first + corner] = member.offset / 4;
    }
    words[1..].iter().any(|place| *place != ABSENT).then_some(words)
}
