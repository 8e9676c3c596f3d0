//! Caches what a device has built and a later plan may need again: pipelines, samplers, uploads of scenes and images.
//! Entries are immutable, so any number of plans may share one.

use super::{clear::Fill, numerics, pipelines::Pipeline, pool::Uploaded, scene_data::Mesh};
use crate::diag::Checked;
use crate::lru::Lru;
use crate::plan::SamplerDesc;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Pipelines stay while one of the last so many plans asked for them. A driver may take megabytes for each.
const PLANS: u64 = 16;

/// Pipelines that clear: a plan has a few.
const MOST_FILLS: usize = 32;

/// All kernels that are built in.
const MOST_KERNELS: usize = 4;

/// Pipelines that check numbers: one for each way to read a resource.
const MOST_CHECKS: usize = 4;

/// As [`PLANS`], for images of files: a plan and the one before it, a second memory that verifies, and what stands
/// beside.
const IMAGE_PLANS: u64 = 4;

const MOST_SAMPLERS: usize = 32;

/// Scenes whose triangles and textures stay on the device: they are large.
const MOST_SCENES: usize = 2;

/// The caches of a device.
#[derive(Debug)]
pub(super) struct Caches {
    pub pipelines: PlanCache<Pipeline>,
    pub fills: Cache<(Fill, wgpu::RenderPipeline)>,
    /// Kernels that are built in, by their entry points.
    pub kernels: Cache<(&'static str, wgpu::ComputePipeline)>,
    pub checks: Cache<(numerics::ReadMode, wgpu::ComputePipeline)>,
    pub samplers: Cache<(SamplerDesc, wgpu::Sampler)>,
    /// By the hash of their content.
    pub meshes: Cache<(u128, Option<Mesh>)>,
    pub textures: Cache<(u128, wgpu::TextureView)>,
    /// Images of files.
    pub images: PlanCache<Uploaded>,
}

impl Default for Caches {
    fn default() -> Caches {
        Caches {
            pipelines: PlanCache::new(PLANS),
            fills: Cache::new(MOST_FILLS),
            kernels: Cache::new(MOST_KERNELS),
            checks: Cache::new(MOST_CHECKS),
            samplers: Cache::new(MOST_SAMPLERS),
            meshes: Cache::new(MOST_SCENES),
            textures: Cache::new(MOST_SCENES),
            images: PlanCache::new(IMAGE_PLANS),
        }
    }
}

impl Caches {
    /// Drops all entries. What sessions use stays with them.
    pub(super) fn clear(&self) {
        self.pipelines.lock().entries.clear();
        self.fills.clear();
        self.kernels.clear();
        self.checks.clear();
        self.samplers.clear();
        self.meshes.clear();
        self.textures.clear();
        self.images.lock().entries.clear();
    }
}

/// A least-recently-used list for several threads.
#[derive(Debug)]
pub(super) struct Cache<T>(Mutex<Lru<T>>);

impl<T: Clone> Cache<T> {
    fn new(capacity: usize) -> Cache<T> {
        Cache(Mutex::new(Lru::new(capacity)))
    }

    fn lock(&self) -> MutexGuard<'_, Lru<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn find(&self, test: impl FnMut(&T) -> bool) -> Option<T> {
        self.lock().find(test).cloned()
    }

    fn clear(&self) {
        self.lock().clear();
    }

    pub(super) fn insert(&self, entry: &T) {
        self.lock().insert(entry.clone());
    }
}

impl<K: Clone + PartialEq, V: Clone> Cache<(K, V)> {
    /// Returns the value of a key; makes and inserts it where there is none.
    ///
    /// # Errors
    /// As `make`.
    pub(super) fn get(&self, key: &K, make: impl FnOnce() -> Checked<V>) -> Checked<V> {
        if let Some((_, found)) = self.find(|(k, _)| k == key) {
            return Ok(found);
        }
        let made = make()?;
        self.insert(&(key.clone(), made.clone()));
        Ok(made)
    }
}

/// A cache, for several threads, whose entries go when none of the last so many plans asked for them. Whatever one plan
/// asks for stays as long as the plan is prepared, however much that is.
#[derive(Debug)]
pub(super) struct PlanCache<T>(Mutex<PlanEntries<T>>);

/// What a [`PlanCache`] holds.
#[derive(Debug)]
pub(super) struct PlanEntries<T> {
    /// Each with the number of the plan that asked for it last.
    entries: Vec<(u64, T)>,
    /// The number of the plan that asks now.
    plan: u64,
    /// Plans for which an entry stays unused.
    age: u64,
}

impl<T> PlanCache<T> {
    fn new(age: u64) -> PlanCache<T> {
        PlanCache(Mutex::new(PlanEntries { entries: vec![], plan: 0, age }))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, PlanEntries<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> PlanEntries<T> {
    /// Begins the next plan and evicts what none of the last plans asked for.
    pub(super) fn next_plan(&mut self) {
        self.plan += 1;
        let (plan, age) = (self.plan, self.age);
        self.entries.retain(|(last, _)| last + age >= plan);
    }

    /// Finds the entry that passes a test, for the plan that asks now.
    pub(super) fn find(&mut self, mut test: impl FnMut(&T) -> bool) -> Option<&T> {
        let (last, found) = self.entries.iter_mut().find(|(_, entry)| test(entry))?;
        *last = self.plan;
        Some(found)
    }

    pub(super) fn insert(&mut self, entry: T) {
        self.entries.push((self.plan, entry));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_goes_when_no_late_plan_asked_for_it() {
        let cache = PlanCache::new(2);
        let mut entries = cache.lock();
        entries.next_plan();
        entries.insert('a');
        entries.insert('b');
        entries.next_plan();
        assert_eq!(entries.find(|c| *c == 'a'), Some(&'a'));
        entries.next_plan();
        entries.next_plan();
        assert_eq!(entries.find(|c| *c == 'b'), None);
        assert_eq!(entries.find(|c| *c == 'a'), Some(&'a'));
    }
}
