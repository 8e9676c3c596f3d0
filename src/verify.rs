//! The proof that leaving steps out changes nothing: the same frame in full, in memory of its own, compared bit for bit.

use crate::diag::{Checked, Diagnostic, Faults};
use crate::gpu::{self, Frame, Gpu, Prepared};
use crate::plan::change::{Held, Selection, everything};
use crate::plan::{Desc, Plan, ResourceId};
use crate::scene::{Assets, Table};

/// Memory in which every step of every frame runs.
pub struct Scratch {
    prepared: Prepared,
    held: Held,
}

impl Scratch {
    /// Allocates a second memory for a plan whose resources can all be read back.
    ///
    /// # Errors
    /// As [`gpu::prepare`].
    pub fn new(gpu: &Gpu, plan: &Plan, assets: &Assets<'_>, tables: &[Table]) -> Checked<Scratch> {
        let prepared = gpu::prepare(gpu, plan, assets, tables)?;
        Ok(Scratch { prepared, held: Held::default() })
    }

    /// Runs all steps of a frame and compares what both memories claim to hold the same version of.
    ///
    /// # Errors
    /// For each content that differs: the resource, the step that makes it, the first texel.
    pub fn verify(
        &mut self,
        gpu: &Gpu,
        plan: &Plan,
        prepared: &Prepared,
        selection: &Selection,
        frame: &Frame,
    ) -> Checked<()> {
        let all = everything(plan, &self.held, &frame.values, frame.tables)?;
        gpu::execute(gpu, plan, &mut self.prepared, &Frame { run: None, ..frame.clone() })?;
        self.held = all.done();
        let mut faults = vec![];
        for id in (0..plan.resources.len()).map(ResourceId) {
            let kept = selection.held().version(plan, id);
            if kept.is_none() || kept != self.held.version(plan, id) {
                continue;
            }
            let place = match &plan.resources[id.0].desc {
                Desc::Texture(_) => {
                    let a = gpu::read_image(gpu, prepared, plan, id)?;
                    let b = gpu::read_image(gpu, &self.prepared, plan, id)?;
                    let differs = a.data.iter().zip(&b.data).position(|(x, y)| x.to_bits() != y.to_bits());
                    differs.map(|i| {
                        let pixel = i / a.channels as usize;
                        let (w, h) = (a.width as usize, a.height as usize);
                        let (x, y, layer) = (pixel % w, pixel / w % h, pixel / (w * h));
                        format!("texel ({x}, {y}), layer {layer}: {} instead of {}", a.data[i], b.data[i])
                    })
                }
                Desc::Buffer { .. } => {
                    let a = gpu::read_buffer(gpu, prepared, plan, id)?;
                    let b = gpu::read_buffer(gpu, &self.prepared, plan, id)?;
                    a.iter().zip(&b).position(|(x, y)| x != y).map(|i| format!("byte {i}"))
                }
            };
            if let Some(place) = place {
                let resource = &plan.resources[id.0].name;
                let writer = plan.steps.iter().rev().find(|s| s.writes.contains(&id)).map_or("?", |s| s.name.as_str());
                let text = format!("`{resource}` differs from a full run at {place}; `{writer}` should have run");
                faults.push(Diagnostic::error(text));
            }
        }
        Faults::check(faults, ())
    }
}
