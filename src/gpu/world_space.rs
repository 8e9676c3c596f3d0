//! Writes on the device what follows from where nodes are: their matrices in tables, triangles in world space, and the
//! boxes round those. A frame in which nodes move uploads their transforms alone.

use super::{
    buffers::{bind_buffers, filled, kernel},
    device::Gpu,
    node_places::NodePlaces,
    recorder::Recorder,
    refit::{FittedBoxes, layout},
    scene_data::{Mesh, TableMemory},
};
use crate::diag::Checked;
use crate::plan::TableUse;
use crate::plan::tables::{Derived, derived, earlier_places, has_derived, stride};
use crate::scene::{NodeMatrix, Table, VertexAttribute};
use std::ops::Range;
use wgpu::BufferUsages as U;

/// Words of a job before its ranges.
const HEADER: usize = 10;
/// Ranges of a job. More are joined into one.
const MOST_RANGES: usize = 64;
/// The place of a member that the row does not have.
const ABSENT: u32 = u32::MAX;
/// Rows of a workgroup.
const LANES: usize = 64;

/// What the kernels read, and what they write.
#[derive(Debug)]
pub(super) struct WorldSpace {
    places: NodePlaces,
    /// `None` where no table has any.
    boxes: Option<FittedBoxes>,
    /// By table.
    jobs: Vec<DeviceJob>,
}

/// What the device writes to a table.
#[derive(Debug)]
enum DeviceJob {
    Nothing,
    /// A list of rows, and what writes them.
    Rows(wgpu::Buffer, wgpu::ComputePipeline, wgpu::BindGroup),
    /// Boxes round triangles.
    Boxes(wgpu::BindGroup),
}

impl WorldSpace {
    /// Takes all tables of a plan, with the content and memory of each. Returns `None` where the device derives no
    /// member of any.
    ///
    /// # Errors
    /// Fails where the device has no memory left or binds less than a buffer takes.
    pub(super) fn prepare<'a, I>(gpu: &Gpu, mesh: Option<&Mesh>, uses: impl Fn() -> I) -> Checked<Option<WorldSpace>>
    where
        I: Iterator<Item = ((&'a TableUse, &'a Table), &'a TableMemory)>,
    {
        let derives = |wanted, table: &'a Table| table.places().filter(|_| has_derived(wanted, table));
        let Some(now) = uses().find_map(|((wanted, table), _)| derives(wanted, table)) else {
            return Ok(None);
        };
        let before = uses().find_map(|((wanted, table), _)| earlier_places(wanted, table));
        let places = NodePlaces::prepare(gpu, now, before)?;
        let hierarchy = uses().find_map(|((wanted, table), _)| layout(wanted, table).and(table.hierarchy()));
        let boxes = hierarchy.map(|of| FittedBoxes::prepare(gpu, of)).transpose()?;
        let held = uses().find_map(|((wanted, table), _)| table.corners().filter(|_| has_derived(wanted, table)));
        let corners = held.map(|of| {
            let vertices: Vec<[u32; 3]> = (0..of.rows()).map(|row| of.vertices(row)).collect();
            filled(gpu, "corners of triangles", &[bytemuck::cast_slice(&vertices)], U::STORAGE)
        });
        let corners = corners.transpose()?;
        let triangles = mesh.zip(corners.as_ref());
        let mut jobs = vec![];
        for ((wanted, table), memory) in uses() {
            if let (Some(boxes), Some(layout), Some((mesh, corners))) = (&boxes, layout(wanted, table), triangles) {
                let group = boxes.bind(gpu, layout, [&mesh.vertices, corners, &places.buffer], &memory.buffer)?;
                jobs.push(DeviceJob::Boxes(group));
                continue;
            }
            let Some(header) = header(wanted, table) else {
                jobs.push(DeviceJob::Nothing);
                continue;
            };
            let ranges = vec![0; 2 * MOST_RANGES];
            let pieces = [bytemuck::cast_slice(&header), bytemuck::cast_slice(&ranges)];
            let job = filled(gpu, "rows to write", &pieces, U::STORAGE)?;
            let mut buffers = vec![&job, &places.buffer, &memory.buffer];
            let entry = match (table.corners(), triangles) {
                (None, _) => "write_matrices",
                (Some(_), Some((mesh, corners))) => {
                    buffers.extend([&mesh.vertices, &mesh.tangents, corners]);
                    "write_triangles"
                }
                (Some(_), None) => {
                    jobs.push(DeviceJob::Nothing);
                    continue;
                }
            };
            let pipeline = kernel(gpu, include_str!("world_space.wgsl"), entry)?;
            let group =
                bind_buffers(gpu, &format!("what follows from nodes in `{}`", wanted.table), &pipeline, &buffers)?;
            jobs.push(DeviceJob::Rows(job, pipeline, group));
        }
        Ok(Some(WorldSpace { places, boxes, jobs }))
    }

    /// Uploads what changed of transforms, and of which boxes are to be fitted.
    pub(super) fn follow(&mut self, gpu: &Gpu, changed: &[Table]) {
        if let (Some(boxes), Some(now)) = (&mut self.boxes, changed.iter().find_map(Table::hierarchy)) {
            boxes.follow(gpu, now);
        }
        if let Some(now) = changed.iter().find_map(Table::places) {
            self.places.follow(gpu, now, changed.iter().find_map(|t| t.matrices(NodeMatrix::PreviousTransform)));
        }
    }

    /// Writes the changed rows, and fits boxes.
    pub(super) fn encode(&self, gpu: &Gpu, record: &mut Recorder<'_>, tables: &[TableMemory]) {
        for (job, memory) in self.jobs.iter().zip(tables) {
            let (job, pipeline, group) = match (job, &self.boxes) {
                (DeviceJob::Rows(job, pipeline, group), _) => (job, pipeline, group),
                (DeviceJob::Boxes(group), Some(boxes)) => {
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
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            let across = (longest.div_ceil(LANES) as u32).min(gpu.limits.max_compute_workgroups_per_dimension);
            pass.dispatch_workgroups(across, ranges.len() as u32, 1);
        }
    }

    /// Notes that the device got what was encoded.
    pub(super) fn encoded(&mut self) {
        self.boxes.iter_mut().for_each(FittedBoxes::encoded);
    }
}

/// The start of a job: the number of words in a row, then the places in it of three matrices, or of three positions,
/// three normals and three tangents. `None` where a row has none of them.
fn header(wanted: &TableUse, table: &Table) -> Option<[u32; HEADER]> {
    let mut words = [ABSENT; HEADER];
    words[0] = stride(wanted) as u32 / 4;
    for member in &wanted.row.members {
        let place = match derived(wanted, table, member) {
            Some(Derived::Node(NodeMatrix::Transform)) => 1,
            Some(Derived::Node(NodeMatrix::InverseTranspose)) => 2,
            Some(Derived::Node(NodeMatrix::PreviousTransform)) => 3,
            Some(Derived::Corner(VertexAttribute::Position, corner)) => 1 + corner,
            Some(Derived::Corner(VertexAttribute::Normal, corner)) => 4 + corner,
            Some(Derived::Corner(_, corner)) => 7 + corner,
            _ => continue,
        };
        words[place] = member.offset / 4;
    }
    words[1..].iter().any(|place| *place != ABSENT).then_some(words)
}
