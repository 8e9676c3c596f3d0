//! The proof that leaving steps out changes nothing: the same frame in full, in memory of its own, compared bit for
//! bit.

use crate::diag::{Checked, Diagnostic, Faults};
use crate::gpu::{self, FrameInputs, Gpu, Memory, Prepared};
use crate::plan::change::{Held, carry_history, everything};
use crate::plan::keys::{Keys, UNDEFINED};
use crate::plan::tables::SceneInputs;
use crate::plan::{Desc, Plan, ResourceId};
use crate::scene::{Assets, Table};

/// Memory in which every step of every frame runs.
pub struct Scratch {
    prepared: Prepared,
    held: Held,
}

impl Scratch {
    /// Allocates a second memory for a plan whose resources can all be read back. Of an earlier one it takes over
    /// history and nothing else.
    ///
    /// # Errors
    /// As [`gpu::prepare`].
    pub fn new(
        gpu: &Gpu,
        plan: &Plan,
        keys: &Keys,
        assets: &Assets<'_>,
        tables: &[Table],
        earlier: Option<&Scratch>,
    ) -> Checked<Scratch> {
        let kept = earlier.map_or_else(|| vec![None; plan.slots.len()], |e| carry_history(plan, keys, &e.held));
        let held = Held::new(plan, keys, &kept, earlier.map(|e| &e.held));
        let memory: Vec<Option<Memory>> = match earlier {
            Some(earlier) => earlier.prepared.pool.taken(&kept),
            None => vec![],
        };
        let prepared = gpu::prepare_after(gpu, plan, assets, tables, &memory)?;
        Ok(Scratch { prepared, held })
    }

    /// As [`Prepared::lend`], with the version of what the memory holds.
    ///
    /// # Errors
    /// As [`Prepared::lend`].
    pub fn lend(&mut self, gpu: &Gpu, plan: &Plan, id: ResourceId, memory: Memory, version: u64) -> Checked<()> {
        let other = self.prepared.lend(gpu, plan, id, memory)?;
        self.held.lend(plan.resources[id.0].slot, version, other);
        Ok(())
    }

    /// Runs all steps of a frame and compares what both memories claim to hold the same version of; every output is
    /// among them.
    ///
    /// # Errors
    /// For each content that differs: the resource, the step that makes it, the first texel.
    pub fn verify(
        &mut self,
        gpu: &Gpu,
        (plan, keys): (&Plan, &Keys),
        (prepared, held): (&Prepared, &Held),
        scene: &SceneInputs,
        frame: &FrameInputs,
    ) -> Checked<()> {
        let all = everything(plan, keys, &self.held, scene, &frame.values);
        self.held.start(&all);
        let whole = FrameInputs { chosen: Some(&all), ..frame.clone() };
        gpu::execute(gpu, plan, &mut self.prepared, &whole)?;
        self.held.finish(&all);
        let mut faults = vec![];
        for (name, id) in &plan.outputs {
            let slot = plan.resources[id.0].slot;
            if held.version(slot) != self.held.version(slot) {
                faults.push(Diagnostic::error(format!("the output `{name}` is not the content that a full run makes")));
            }
        }
        for slot in 0..plan.slots.len() {
            let version = held.version(slot);
            if version == UNDEFINED || version != self.held.version(slot) {
                continue;
            }
            let Some(id) = plan.resources.iter().position(|r| r.slot == slot).map(ResourceId) else { continue };
            if keys.from_bits[id.0] || !plan.resources[id.0].desc.is_readable() {
                continue;
            }
            if let Some(place) = self.difference(gpu, plan, prepared, id)? {
                let tenants = || plan.resources.iter().enumerate().filter(|(_, r)| r.slot == slot);
                let names: Vec<String> = tenants().map(|(_, r)| format!("`{}`", r.name)).collect();
                let writes = |id| plan.steps.iter().filter(move |s| s.writes.contains(&id));
                let writers = tenants().flat_map(|(i, _)| writes(ResourceId(i)).map(|s| format!("`{}`", s.name)));
                let writers: Vec<String> = writers.collect();
                let text = format!(
                    "{} differs from a full run at {place}; one of {} should have run",
                    names.join(" or "),
                    writers.join(", ")
                );
                faults.push(Diagnostic::error(text));
            }
        }
        Faults::check(faults, ())
    }

    /// The first place at which the two memories of a resource differ.
    fn difference(&self, gpu: &Gpu, plan: &Plan, prepared: &Prepared, id: ResourceId) -> Checked<Option<String>> {
        match &plan.resources[id.0].desc {
            Desc::Texture(_) => {
                let a = gpu::read_image(gpu, prepared, plan, id)?;
                let b = gpu::read_image(gpu, &self.prepared, plan, id)?;
                let differs = a.data.iter().zip(&b.data).position(|(x, y)| x.to_bits() != y.to_bits());
                Ok(differs.map(|i| {
                    let pixel = i / a.channels as usize;
                    let (w, h) = (a.width as usize, a.height as usize);
                    let (x, y, layer) = (pixel % w, pixel / w % h, pixel / (w * h));
                    format!("texel ({x}, {y}), layer {layer}: {} instead of {}", a.data[i], b.data[i])
                }))
            }
            Desc::Buffer { .. } => {
                let a = gpu::read_buffer(gpu, prepared, plan, id)?;
                let b = gpu::read_buffer(gpu, &self.prepared, plan, id)?;
                Ok(a.iter().zip(&b).position(|(x, y)| x != y).map(|i| format!("byte {i}")))
            }
        }
    }
}
