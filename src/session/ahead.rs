//! What a frame finds out before it chooses what to run: what the members of its steps see, and which results come out as they were.
//! Where only the device can tell, it runs a part of the frame ahead of the rest.

use super::Session;
use crate::diag::Checked;
use crate::gpu::{self, Frame, FrameReport, Gpu};
use crate::plan::alike::{Looks, Parts, candidates, digested};
use crate::plan::change::{self, Selection, Why};
use crate::plan::ingredient::Kind;
use crate::plan::keys::Version;
use crate::plan::masked::Mask;
use crate::plan::{Desc, ResourceId, TextureDesc, masked, region};
use crate::scene::Table;
use crate::value::Values;
use glam::Mat4;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The parts of a frame that run ahead of the rest.
pub(super) struct Ahead {
    /// Tables that the device does not hold as they are now.
    pub tables: Option<Vec<Table>>,
    /// Those that it got with a part.
    pub uploaded: Option<Vec<Table>>,
    /// Of each part what it took, and by step why it ran or not.
    parts: Vec<(FrameReport, Vec<Why>)>,
}

/// What the results of steps are compared by.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// By version, of what memory still holds.
    known: BTreeMap<Version, Arc<Vec<u8>>>,
    looks: Looks,
}

/// What a resource holds.
struct Content {
    version: Version,
    bytes: Arc<Vec<u8>>,
    /// Of what members of others read parts of: those.
    parts: Option<Parts>,
}

impl Ahead {
    pub(super) fn of(tables: Option<Vec<Table>>) -> Ahead {
        Ahead { tables, uploaded: None, parts: vec![] }
    }

    /// Adds the parts to what the rest of the frame took.
    pub(super) fn join(self, report: &mut FrameReport, why: &mut [Why], rest: &Selection) {
        for (part, reasons) in self.parts.into_iter().rev() {
            let runs_again = |step: usize| rest.run.get(step).copied().unwrap_or(false);
            report.steps.splice(0..0, part.steps.into_iter().filter(|s| !runs_again(s.step)));
            report.loops.splice(0..0, part.loops);
            report.warnings.splice(0..0, part.warnings);
            report.failed.splice(0..0, part.failed);
            report.numerics = match (part.numerics, report.numerics.take()) {
                (Some(first), Some(later)) => Some(first.then(later)),
                (first, later) => first.or(later),
            };
            report.wall_ms += part.wall_ms;
            report.device_ms = report.device_ms.zip(part.device_ms).map(|(a, b)| a + b);
            for (why, reason) in why.iter_mut().zip(reasons) {
                if reason.runs() && !why.runs() {
                    *why = reason;
                }
            }
        }
    }
}

impl Session {
    /// Runs a part of the frame.
    fn ahead(&mut self, gpu: &Gpu, selection: Selection, values: &Values, ahead: &mut Ahead) -> Checked<()> {
        let (run, partly) = (Some(selection.run.as_slice()), Some(&selection.partly));
        let (values, timing) = (values.clone(), self.settings.timing);
        let frame = Frame { values, tables: ahead.tables.as_deref(), run, partly, timing };
        let report = self.run(gpu, &frame, &selection)?;
        if let Some(tables) = ahead.tables.take() {
            ahead.uploaded = Some(tables);
        }
        ahead.parts.push((report, selection.why.clone()));
        self.held.finish_part(selection);
        Ok(())
    }

    /// Learns what the members of draws see. Where the device makes their frusta and has made none like these before, it makes them
    /// now.
    pub(super) fn look(&mut self, gpu: &Gpu, values: &Values, ahead: &mut Ahead) -> Checked<()> {
        let buffers = self.keys.in_order(region::buffers(&self.apart));
        let made = change::end(&self.plan, &self.keys, &self.held, &self.outside, values);
        let now = buffers.iter().map(|id| made[id.0]);
        if self.looked.as_ref().is_some_and(|looked| looked.iter().copied().eq(now)) {
            return Ok(());
        }
        self.looked = None;
        let (mut known, mut versions) = (BTreeMap::new(), vec![]);
        for id in buffers {
            let mut version = made[id.0];
            // Where a view stands may follow from what another one shows.
            if self.keys.follows_from_views(id) {
                self.see(&known);
                self.settle(gpu, values)?;
                version = change::end(&self.plan, &self.keys, &self.held, &self.outside, values)[id.0];
            }
            let frusta = match self.frusta.get(&version) {
                Some(frusta) => frusta.clone(),
                None => Arc::new(self.make_frusta(gpu, values, ahead, id)?),
            };
            known.insert(id, frusta.clone());
            self.frusta.insert(version, frusta);
            versions.push(version);
        }
        self.frusta.retain(|version, _| versions.contains(version));
        self.see(&known);
        self.looked = Some(versions);
        Ok(())
    }

    /// Makes a buffer of frusta and reads it.
    fn make_frusta(&mut self, gpu: &Gpu, values: &Values, ahead: &mut Ahead, id: ResourceId) -> Checked<Vec<Mat4>> {
        let wanted = BTreeSet::from([id]);
        let selection = change::select_for(&self.plan, &self.keys, &self.held, &self.outside, values, &wanted);
        self.ahead(gpu, selection, values, ahead)?;
        let bytes = gpu::read_buffer(gpu, &self.prepared, &self.plan, id)?;
        let frusta = bytemuck::pod_collect_to_vec::<u8, [f32; 16]>(&bytes[..bytes.len() / 64 * 64]);
        Ok(frusta.iter().map(Mat4::from_cols_array).collect())
    }

    /// What members see by these frusta, and by those in tables.
    fn see(&mut self, frusta: &BTreeMap<ResourceId, Arc<Vec<Mat4>>>) {
        let known = |id: ResourceId| frusta.get(&id).cloned();
        let seen = region::seen(&self.plan, &self.apart, &self.tables.list, known, &self.seen);
        self.seen.extend(seen);
    }

    /// Finds which members of draws show nothing of what moved, by the depths that the device holds of them.
    pub(super) fn settle(&mut self, gpu: &Gpu, values: &Values) -> Checked<()> {
        let (plan, prepared, known) = (&self.plan, &self.prepared, &mut self.depths);
        let mut used = BTreeSet::new();
        self.outside.members = self.seen.clone();
        change::settle(plan, &self.keys, &self.held, &mut self.outside, values, |id, version| {
            used.insert(version);
            if let Some(image) = known.get(&version) {
                return Ok(image.clone());
            }
            let image = Arc::new(gpu::read_image(gpu, prepared, plan, id)?);
            known.insert(version, image.clone());
            Ok(image)
        })?;
        self.depths.retain(|version, _| used.contains(version));
        Ok(())
    }

    /// Chooses the steps of the frame. Those that run for some of their members and leave little go ahead, one at a time: what reads a
    /// result that came out as it was need not run.
    pub(super) fn compare(&mut self, gpu: &Gpu, values: &Values, ahead: &mut Ahead) -> Checked<Selection> {
        let mut asked = BTreeSet::new();
        loop {
            let (plan, keys) = (&self.plan, &self.keys);
            let wanted = masked::settle(plan, keys, &self.held, &mut self.outside, values, &self.masks);
            let selection = change::select(plan, keys, &self.held, &self.outside, values);
            let looks = &mut self.contents.looks;
            let ready = |i: usize| wanted.is_empty() || keys.units[i].masked().is_empty();
            let due = |(i, _): &(usize, _)| ready(*i) && asked.insert(*i) && looks.due(&keys.units[*i].name);
            let next = candidates(plan, keys, &selection).find(due);
            if let Some((unit, written)) = next {
                let before = self.contents(gpu, unit, &written, None)?;
                let part = change::select_for(&self.plan, &self.keys, &self.held, &self.outside, values, &written);
                let ran =
                    self.keys.units[unit].steps.first().and_then(|step| part.partly.members.get(&step.0).cloned());
                self.ahead(gpu, part, values, ahead)?;
                let after = self.contents(gpu, unit, &written, ran.map(|ran| (ran, before.as_slice())))?;
                let paid = self.learn(&written, before, after);
                self.contents.known.retain(|version, _| self.held.holds(*version));
                self.contents.looks.learn(&self.keys.units[unit].name, paid);
            } else if wanted.is_empty() {
                return Ok(selection);
            } else {
                self.read_masks(gpu, values, ahead, wanted)?;
            }
        }
    }

    /// Makes masks, where memory does not hold them, and reads them.
    fn read_masks(
        &mut self,
        gpu: &Gpu,
        values: &Values,
        ahead: &mut Ahead,
        wanted: Vec<(ResourceId, Vec<u64>)>,
    ) -> Checked<()> {
        let ids: BTreeSet<ResourceId> = wanted.iter().map(|w| w.0).collect();
        let part = change::select_for(&self.plan, &self.keys, &self.held, &self.outside, values, &ids);
        if part.count() > 0 {
            self.ahead(gpu, part, values, ahead)?;
        }
        for (id, rows) in wanted {
            let bytes = gpu::read_buffer(gpu, &self.prepared, &self.plan, id)?;
            self.masks.insert(id, Mask { rows, words: bytemuck::pod_collect_to_vec::<u8, u32>(&bytes) });
        }
        Ok(())
    }

    /// Learns what of some results came out as it was. Whether all did, or enough of what members of others read parts of.
    fn learn(&mut self, written: &BTreeSet<ResourceId>, before: Vec<Content>, after: Vec<Content>) -> bool {
        let (mut same, mut enough) = (true, false);
        for (id, (was, is)) in written.iter().zip(before.into_iter().zip(after)) {
            if let Some((then, now)) = was.parts.zip(is.parts)
                && let Some((ran, other)) = self.outside.parts.learn(*id, &then, &now, &was.bytes, &is.bytes)
            {
                enough |= 4 * other <= 3 * ran;
                self.outside.settled.clear();
            }
            if is.bytes == was.bytes || self.settings.without == Some(Kind::Result) {
                self.held.stands(self.plan.resources[id.0].slot, was.version);
                self.outside.alike.add(is.version, was.version, |v| self.held.holds(v));
            } else {
                same = false;
            }
        }
        same || enough
    }

    /// What some resources hold that a unit writes. `ran`: the members that have run since, and what there was before.
    fn contents(
        &mut self,
        gpu: &Gpu,
        unit: usize,
        of: &BTreeSet<ResourceId>,
        ran: Option<(Vec<bool>, &[Content])>,
    ) -> Checked<Vec<Content>> {
        let mut found = vec![];
        for (at, id) in of.iter().enumerate() {
            let version = self.held.version(self.plan.resources[id.0].slot);
            let bytes = match self.contents.known.get(&version) {
                Some(bytes) => bytes.clone(),
                None if digested(&self.plan, &self.keys, *id) => {
                    let since = ran.as_ref().and_then(|(ran, before)| Some((ran.as_slice(), before.get(at)?)));
                    Arc::new(self.digests(gpu, *id, since)?)
                }
                None => Arc::new(gpu::read_content(gpu, &self.prepared, &self.plan, *id)?),
            };
            self.contents.known.insert(version, bytes.clone());
            // Of what members of others read parts of.
            let read = self.keys.units.iter().any(|u| u.reads_parts(*id));
            let parts = || self.held.parts(&self.plan, &self.keys.units[unit], *id, &self.outside);
            found.push(Content { version, bytes, parts: read.then(parts).flatten() });
        }
        Ok(found)
    }

    /// Digests of the tiles of an atlas: of those that have run since, and of the others those of before.
    fn digests(&self, gpu: &Gpu, id: ResourceId, since: Option<(&[bool], &Content)>) -> Checked<Vec<u8>> {
        let Desc::Texture(TextureDesc { tiles: Some(tiles), .. }) = &self.plan.resources[id.0].desc else {
            return Ok(vec![]);
        };
        let count = tiles.count as usize;
        let whole = gpu::DIGEST * count;
        let (ran, mut all) = match since {
            Some((ran, before)) if ran.len() == count && before.bytes.len() == whole => (ran, before.bytes.to_vec()),
            _ => (&[][..], vec![0; whole]),
        };
        let asked: Vec<u32> = (0..tiles.count).filter(|i| ran.get(*i as usize) != Some(&false)).collect();
        let found = gpu::digests(gpu, &self.prepared, &self.plan, id, &asked)?;
        for (tile, digest) in asked.into_iter().zip(found.chunks_exact(gpu::DIGEST)) {
            all[tile as usize * gpu::DIGEST..][..gpu::DIGEST].copy_from_slice(digest);
        }
        Ok(all)
    }
}
