//! What of a scene stays as it is for as long as it is loaded.

use super::{Geometry, Level, Scene, TextureArray};
use crate::content::hash;
use std::sync::Arc;

/// Triangles and textures, with hashes that stand for them.
#[derive(Debug, Clone, Copy)]
pub struct Assets<'a> {
    pub geometry: &'a Geometry,
    /// Simplified triangles that stand beside those of `geometry`.
    pub levels: &'a [Arc<Level>],
    pub textures: Option<&'a TextureArray>,
    pub hashes: AssetHashes,
}

/// Equal hashes, equal contents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AssetHashes {
    pub geometry: u128,
    /// The order in which triangles are sorted for rays, as far as the geometry leaves it open.
    pub order: u128,
    pub textures: u128,
}

impl<'a> Assets<'a> {
    /// Reads all of both to hash them.
    pub fn new(geometry: &'a Geometry, textures: Option<&'a TextureArray>) -> Assets<'a> {
        let vertices: &[u8] = bytemuck::cast_slice(&geometry.vertices);
        let more: [&[u8]; 3] = [
            bytemuck::cast_slice(&geometry.more.uvs),
            bytemuck::cast_slice(&geometry.more.colors),
            bytemuck::cast_slice(&geometry.more.tangents),
        ];
        let hashes = AssetHashes {
            geometry: hash(&(vertices, &geometry.indices, geometry.one_sided, more)),
            order: 0,
            textures: hash(&textures.map(|t| (t.width, t.height, t.layers, &t.mips))),
        };
        Assets { geometry, levels: &[], textures, hashes }
    }
}

impl Scene {
    /// Its triangles and textures; reads all of both.
    pub fn assets(&self) -> Assets<'_> {
        let mut assets = Assets::new(&self.geometry, self.textures.as_ref());
        // They are sorted where they stand in the beginning.
        let places: Vec<[u32; 16]> = self.pose(0.0).nodes.iter().map(|m| m.to_cols_array().map(f32::to_bits)).collect();
        assets.hashes.order = hash(&places);
        assets
    }

    /// As [`Scene::assets`], with hashes that are known, and levels of this scene.
    pub fn assets_with<'a>(&'a self, hashes: AssetHashes, levels: &'a [Arc<Level>]) -> Assets<'a> {
        Assets { geometry: &self.geometry, levels, textures: self.textures.as_ref(), hashes }
    }
}
