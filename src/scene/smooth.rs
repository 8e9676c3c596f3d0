//! How far the normals that surfaces are shaded by lie from the planes of their triangles.

use super::{
    model::{Material, Scene},
    textures::{MaterialTexture, TextureArray},
};
use glam::Vec3;

/// Steps of the sine; what lies below one is flat.
const STEPS: usize = 256;
/// Share of a material's area whose normals deviate no more than what is stated.
const KEPT: f32 = 0.95;
/// Beyond it (30°) normals say little of the triangles.
const MOST: f32 = 0.5;
/// Texels along an edge of a normal map that are looked at.
const LOOKS: u32 = 64;

/// Area by the sine of a deviation.
struct Histogram([f32; STEPS]);

impl Histogram {
    fn add(&mut self, sine: f32, area: f32) {
        // What is no number deviates not at all.
        self.0[((sine * STEPS as f32) as usize).min(STEPS - 1)] += area;
    }

    /// The sine that `KEPT` of the area keeps below.
    fn bound(&self) -> f32 {
        let all: f32 = self.0.iter().sum();
        let mut below = 0.0;
        let step = self.0.iter().position(|area| {
            below += area;
            below >= KEPT * all
        });
        step.filter(|step| *step > 0).map_or(0.0, |step| (step + 1) as f32 / STEPS as f32).min(MOST)
    }
}

impl Scene {
    /// Sets [`Material::normal_deviation`] by the triangles and normal maps.
    pub(super) fn measure_normals(&mut self) {
        let geometry = &self.geometry;
        let mut found: Vec<Histogram> = self.materials.iter().map(|_| Histogram([0.0; STEPS])).collect();
        for triangle in self.corners() {
            let corners = triangle.map(|v| &geometry.vertices[v as usize]);
            let Some(histogram) = found.get_mut(corners[0].material as usize) else { continue };
            let [a, b, c] = corners.map(|v| Vec3::from(v.position));
            let across = (b - a).cross(c - a);
            let plane = across.normalize_or_zero();
            let sine = |v: &super::Vertex| plane.cross(Vec3::from(v.normal).normalize_or_zero()).length();
            histogram.add(corners.map(sine).into_iter().fold(0.0, f32::max), across.length());
        }
        for (material, histogram) in self.materials.iter_mut().zip(found) {
            let map = material.normal_texture.and_then(|row| self.maps.get(row as usize));
            let bent = self.textures.as_ref().zip(map).map_or(0.0, |(pages, map)| bent(pages, map, material));
            material.normal_deviation = (histogram.bound() + bent).min(MOST);
        }
    }
}

/// The same of what a normal map adds.
fn bent(pages: &TextureArray, map: &MaterialTexture, material: &Material) -> f32 {
    let Some(texels) = pages.mips.first() else { return 0.0 };
    let mut found = Histogram([0.0; STEPS]);
    let [across, down] = map.size.map(|edge| edge.min(LOOKS));
    for (i, j) in (0..down).flat_map(|j| (0..across).map(move |i| (i, j))) {
        let x = (map.corner[0] + i * map.size[0] / across) as usize;
        let y = (map.corner[1] + j * map.size[1] / down) as usize;
        let row = map.layer as usize * pages.height as usize + y;
        let Some([r, g, b, _]) = texels.as_chunks::<4>().0.get(row * pages.width as usize + x) else { continue };
        let [x, y, z] = [*r, *g, *b].map(|code| f32::from(code) / 127.5 - 1.0);
        let normal = Vec3::new(x * material.normal_scale, y * material.normal_scale, z);
        found.add(normal.normalize_or_zero().truncate().length(), 1.0);
    }
    found.bound()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_leaves_out_what_is_rare_and_what_rounding_adds() {
        let mut flat = Histogram([0.0; STEPS]);
        flat.add(1e-4, 90.0);
        flat.add(f32::NAN, 1.0);
        flat.add(1.0, 4.0);
        assert_eq!(flat.bound(), 0.0);
        let mut round = Histogram([0.0; STEPS]);
        round.add(0.25, 90.0);
        round.add(0.1, 9.0);
        assert!((0.25..0.26).contains(&round.bound()), "{}", round.bound());
        round.add(0.9, 100.0);
        assert_eq!(round.bound(), MOST);
        assert_eq!(Histogram([0.0; STEPS]).bound(), 0.0);
    }
}
