//! What a device has built, for whoever asks for the same again: pipelines, samplers, uploads of scenes. All that is
//! kept is immutable, so any number of plans may use it at once.

use super::{dirty, numerics, pipelines::Pipeline, pool::Uploaded, scene_data::Mesh, wipe::Fill};
use crate::diag::Checked;
use crate::plan::SamplerDesc;
use crate::recent::{InUse, Recent};
use std::sync::{Mutex, PoisonError};

/// Pipelines stay while one of the last so many plans asked for them. A driver may take megabytes for each.
const PLANS: u64 = 16;

/// Pipelines that clear kept at most: a plan has a few.
const MOST_FILLS: usize = 32;

/// Pipelines that check numbers: one for each way to read a resource.
const MOST_CHECKS: usize = 4;

/// As [`PLANS`], for images of files: a plan and the one before it, a second memory that verifies, and what stands
/// beside.
const IMAGE_PLANS: u64 = 4;

const MOST_SAMPLERS: usize = 32;

/// Scenes whose triangles and textures are kept at most: they are large.
const MOST_SCENES: usize = 2;

#[derive(Debug)]
pub(super) struct Kept {
    pub pipelines: Mutex<InUse<Pipeline>>,
    pub fills: Store<(Fill, wgpu::RenderPipeline)>,
    /// The kernel that ends loops: there is one.
    pub ends: Store<((), wgpu::ComputePipeline)>,
    pub checks: Store<(numerics::Source, wgpu::ComputePipeline)>,
    pub dirty: Store<(dirty::Kernel, wgpu::ComputePipeline)>,
    pub samplers: Store<(SamplerDesc, wgpu::Sampler)>,
    /// By the hash of their content.
    pub meshes: Store<(u128, Option<Mesh>)>,
    pub textures: Store<(u128, wgpu::TextureView)>,
    /// Images of files that a plan of the last few uses.
    pub images: Mutex<InUse<Uploaded>>,
}

impl Default for Kept {
    fn default() -> Kept {
        Kept {
            pipelines: Mutex::new(InUse::new(PLANS)),
            fills: Store::new(MOST_FILLS),
            ends: Store::new(1),
            checks: Store::new(MOST_CHECKS),
            dirty: Store::new(2),
            samplers: Store::new(MOST_SAMPLERS),
            meshes: Store::new(MOST_SCENES),
            textures: Store::new(MOST_SCENES),
            images: Mutex::new(InUse::new(IMAGE_PLANS)),
        }
    }
}

impl Kept {
    pub(super) fn clear(&self) {
        self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.fills.clear();
        self.ends.clear();
        self.checks.clear();
        self.dirty.clear();
        self.samplers.clear();
        self.meshes.clear();
        self.textures.clear();
        self.images.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

/// Things made lately, for several threads.
#[derive(Debug)]
pub(super) struct Store<T>(Mutex<Recent<T>>);

impl<T: Clone> Store<T> {
    fn new(most: usize) -> Store<T> {
        Store(Mutex::new(Recent::new(most)))
    }

    pub(super) fn find(&self, test: impl FnMut(&T) -> bool) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).find(test).cloned()
    }

    fn clear(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    pub(super) fn keep(&self, thing: &T) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).keep(thing.clone());
    }
}

impl<K: Clone + PartialEq, V: Clone> Store<(K, V)> {
    /// What is kept under a key, or made now.
    ///
    /// # Errors
    /// As `make`.
    pub(super) fn get(&self, key: &K, make: impl FnOnce() -> Checked<V>) -> Checked<V> {
        if let Some((_, found)) = self.find(|(k, _)| k == key) {
            return Ok(found);
        }
        let made = make()?;
        self.keep(&(key.clone(), made.clone()));
        Ok(made)
    }
}
