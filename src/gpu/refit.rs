//! Fits the boxes of a hierarchy round triangles that moved, on the device.

use super::{
    buffers::{bind_buffers, filled, kernel},
    device::Gpu,
    recorder::Recorder,
};
use crate::diag::Checked;
use crate::plan::TableUse;
use crate::plan::tables::{Derived, derived, stride};
use crate::scene::{Hierarchy, MAX_DEPTH, Refit, Table};
use std::sync::Arc;
use wgpu::BufferUsages as U;

/// Levels of a list.
const LEVELS: usize = MAX_DEPTH as usize + 1;
/// Words of a list before its rows.
const HEADER: usize = 2 + LEVELS;
// `ROWS` in refit.wgsl.
const _: () = assert!(HEADER == 50);

/// What a frame fits.
#[derive(Debug)]
pub(super) struct FittedBoxes {
    pipeline: wgpu::ComputePipeline,
    list: wgpu::Buffer,
    /// What the list says.
    listed: Arc<Refit>,
    /// The hierarchy whose rows the device has once the list is done.
    held: Arc<Hierarchy>,
    /// The list is not done yet.
    due: bool,
}

impl FittedBoxes {
    /// # Errors
    /// Fails where the device has no memory left or binds less than the list takes.
    pub(super) fn prepare(gpu: &Gpu, held: &Arc<Hierarchy>) -> Checked<FittedBoxes> {
        let listed = Arc::new(held.whole());
        let list = filled(gpu, "boxes to fit", &[bytemuck::cast_slice(&words(held, &listed))], U::STORAGE)?;
        let pipeline = kernel(gpu, include_str!("refit.wgsl"), "refit")?;
        Ok(FittedBoxes { pipeline, list, listed, held: held.clone(), due: true })
    }

    /// Binds a table. `triangles`: vertices, corners of triangles, where nodes are.
    ///
    /// # Errors
    /// Fails where the device has no memory left.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        layout: [u32; 3],
        triangles: [&wgpu::Buffer; 3],
        rows: &wgpu::Buffer,
    ) -> Checked<wgpu::BindGroup> {
        let layout = filled(gpu, "layout of boxes", &[bytemuck::cast_slice(&layout)], U::STORAGE)?;
        let [vertices, corners, nodes] = triangles;
        let buffers = [&layout, &self.list, vertices, corners, nodes, rows];
        bind_buffers(gpu, "the boxes of triangles", &self.pipeline, &buffers)
    }

    /// Lists what has moved.
    pub(super) fn follow(&mut self, gpu: &Gpu, now: &Arc<Hierarchy>) {
        if Arc::ptr_eq(&self.held, now) {
            return;
        }
        let moved = now.moved_since(&self.held).filter(|_| !self.due).cloned();
        let list = moved.unwrap_or_else(|| Arc::new(now.whole()));
        if !Arc::ptr_eq(&self.listed, &list) {
            gpu.queue.write_buffer(&self.list, 0, bytemuck::cast_slice(&words(now, &list)));
            self.listed = list;
        }
        (self.held, self.due) = (now.clone(), true);
    }

    /// Fits the rows of a table.
    pub(super) fn encode(&self, record: &mut Recorder<'_>, group: &wgpu::BindGroup) {
        if !self.due || self.listed.rows.is_empty() {
            return;
        }
        let pass = record.compute();
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }

    /// Notes that the device got what was encoded.
    pub(super) fn encoded(&mut self) {
        self.due = false;
    }
}

/// The words in a row, and the places in it of a box's corners. `None` where the row has no box.
pub(super) fn layout(wanted: &TableUse, table: &Table) -> Option<[u32; 3]> {
    let place = |of: Derived| {
        let member = wanted.row.members.iter().find(|member| derived(wanted, table, member) == Some(of));
        member.map(|member| member.offset / 4)
    };
    Some([stride(wanted) as u32 / 4, place(Derived::Lower)?, place(Derived::Upper)?])
}

/// A list as the kernel reads it.
fn words(of: &Hierarchy, list: &Refit) -> Vec<u32> {
    let mut words = vec![0; HEADER];
    (words[0], words[1]) = (of.margin().to_bits(), list.ends.len() as u32);
    words[2..][..list.ends.len()].copy_from_slice(&list.ends);
    words.extend(list.rows.as_flattened());
    words
}
