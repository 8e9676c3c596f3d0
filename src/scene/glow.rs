//! How much light triangles with an emissive texture give on average.

use super::{
    model::Scene,
    textures::{MaterialTexture, TextureArray, Wrap},
};
use crate::image::srgb;
use glam::{Mat2, Vec2, Vec3};
use std::sync::Arc;

/// Places along an edge of a triangle, at most, at which its texture is read.
const MOST: u32 = 24;

impl Scene {
    /// The mean of its emissive texture over each triangle, in the order of indices; empty where no material has one.
    pub(super) fn mean_glow(&self) -> Arc<Vec<Vec3>> {
        let Some(pages) =
            self.textures.as_ref().filter(|_| self.materials.iter().any(|m| m.emission_texture.is_some()))
        else {
            return Arc::default();
        };
        let of = |corners: [u32; 3]| {
            let texture = self.material(&corners).and_then(|m| m.emission_texture);
            let Some(texture) = texture.and_then(|t| self.maps.get(t as usize)) else { return Vec3::ONE };
            let uv = |v: u32| match texture.set {
                1 => self.geometry.more.uv(v as usize),
                _ => self.geometry.vertices[v as usize].uv,
            };
            mean(pages, texture, corners.map(|v| Vec2::from(uv(v))))
        };
        Arc::new(self.corners().map(of).collect())
    }
}

impl Scene {
    /// The radiance that its surfaces give by themselves, as a mean over all of them and the channels.
    pub(super) fn mean_emission(&self) -> f32 {
        let nodes = self.pose(0.0).nodes;
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| {
                let v = &self.geometry.vertices[i as usize];
                nodes[v.node as usize].transform_point3(v.position.into()).as_dvec3()
            });
            (b - a).cross(c - a).length()
        };
        let all: Vec<f64> = self.corners().map(|corners| area(&corners)).collect();
        let given = self.emitting().map(|(i, radiance)| all[i] * f64::from(radiance.element_sum()) / 3.0);
        (given.sum::<f64>() / all.iter().sum::<f64>().max(f64::MIN_POSITIVE)) as f32
    }
}

/// The mean over a triangle: of texels of the mip of which few cover it, so that none that shines is missed.
fn mean(pages: &TextureArray, t: &MaterialTexture, corners: [Vec2; 3]) -> Vec3 {
    let turn = Mat2::from_cols_array(&t.turn.to_array());
    let size = Vec2::new(t.size[0] as f32, t.size[1] as f32);
    let [a, b, c] = corners.map(|uv| (turn * uv + t.offset) * size);
    let longest = (b - a).abs().max((c - a).abs()).max((c - b).abs()).max_element();
    // Half a texel from place to place, at this mip.
    let level = ((2.0 * longest / MOST as f32).max(1.0).log2().ceil() as u32).min(t.levels - 1);
    let steps = ((2.0 * longest / (level as f32).exp2()).ceil() as u32).clamp(2, MOST);
    let scale = (level as f32).exp2().recip();
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for i in 0..steps {
        for j in 0..steps - i {
            let [u, v] = [i, j].map(|n| (n as f32 + 1.0 / 3.0) / steps as f32);
            sum += texel(pages, t, level, (a + u * (b - a) + v * (c - a)) * scale);
            count += 1.0;
        }
    }
    sum / count
}

/// The texel of a mip at a place, in its texels.
fn texel(pages: &TextureArray, t: &MaterialTexture, level: u32, at: Vec2) -> Vec3 {
    let edge = |size: u32, level: u32| (size >> level).max(1);
    let [width, height] = t.size.map(|size| edge(size, level));
    let wrapped = |at: f32, size: u32, wrap: Wrap| {
        // Numbers beyond are no places that a texture would be made for.
        let (n, size) = (at.floor().clamp(-1e9, 1e9) as i64, i64::from(size));
        let inside = match wrap {
            Wrap::Repeat => n.rem_euclid(size),
            Wrap::Clamp => n.clamp(0, size - 1),
            Wrap::Mirror => {
                let n = n.rem_euclid(2 * size);
                n.min(2 * size - 1 - n)
            }
        };
        inside as u32
    };
    let (x, y) = (wrapped(at.x, width, t.wrap[0]), wrapped(at.y, height, t.wrap[1]));
    let [mut left, mut top] = t.corner;
    if level > 0 {
        left += t.size[0];
        top += (1..level).map(|l| edge(t.size[1], l)).sum::<u32>();
    }
    let page = pages.width as usize * pages.height as usize;
    let place = t.layer as usize * page + (top + y) as usize * pages.width as usize + (left + x) as usize;
    let texel = pages.mips.first().and_then(|page| page.get(4 * place..4 * place + 3));
    texel.map_or(Vec3::ZERO, |t| Vec3::new(t[0].into(), t[1].into(), t[2].into()) / 255.0).map(srgb::decode)
}
