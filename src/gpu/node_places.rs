//! Where nodes are and where they were, on the device: what moved is uploaded once, for all that is made of it there.

use super::{buffers::filled, device::Gpu};
use crate::diag::Checked;
use crate::scene::Transforms;
use glam::Mat4;
use wgpu::BufferUsages as U;

/// Bytes before the matrices: which place holds where nodes are, and which where they were.
const HEADER: u64 = 16;

/// The transforms of nodes.
#[derive(Debug)]
pub(super) struct NodePlaces {
    pub buffer: wgpu::Buffer,
    /// What lies there, one behind the other; a second one where shaders ask for where nodes were.
    slots: Vec<Transforms>,
    /// Which of them are those of now and of before.
    shown: [usize; 2],
}

impl NodePlaces {
    /// # Errors
    /// Fails where the device has no memory left or binds less than the transforms take.
    pub(super) fn prepare(gpu: &Gpu, now: &Transforms, before: Option<&Transforms>) -> Checked<NodePlaces> {
        let slots: Vec<Transforms> = std::iter::once(now).chain(before).cloned().collect();
        let shown = [0, slots.len() - 1];
        let header = words(now, shown);
        let mut pieces: Vec<&[u8]> = vec![bytemuck::cast_slice(&header)];
        pieces.extend(slots.iter().map(Transforms::bytes));
        let buffer = filled(gpu, "transforms of nodes", &pieces, U::STORAGE)?;
        Ok(NodePlaces { buffer, slots, shown })
    }

    /// Uploads what is not there yet. There are as many nodes as before.
    pub(super) fn follow(&mut self, gpu: &Gpu, now: &Transforms, before: Option<&Transforms>) {
        let Some(before) = before.filter(|_| self.slots.len() == 2) else {
            return self.hold(gpu, self.shown[0], now);
        };
        let find = |wanted: &Transforms| self.slots.iter().position(|held| held == wanted);
        let kept = find(before);
        let at = find(now).unwrap_or_else(|| kept.map_or(0, |slot| 1 - slot));
        let was = kept.unwrap_or(if before == now { at } else { 1 - at });
        self.hold(gpu, at, now);
        self.hold(gpu, was, before);
        if self.shown != [at, was] {
            self.shown = [at, was];
            gpu.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&words(now, self.shown)));
        }
    }

    fn hold(&mut self, gpu: &Gpu, slot: usize, wanted: &Transforms) {
        let held = std::mem::replace(&mut self.slots[slot], wanted.clone());
        for rows in wanted.differ(&held) {
            let at = HEADER + ((slot * wanted.len() + rows.start) * size_of::<Mat4>()) as u64;
            gpu.queue.write_buffer(&self.buffer, at, bytemuck::cast_slice(&wanted[rows]));
        }
    }
}

/// The rows that lists begin at.
fn words(of: &Transforms, shown: [usize; 2]) -> [u32; 4] {
    let [now, before] = shown.map(|slot| (slot * of.len()) as u32);
    [now, before, 0, 0]
}
