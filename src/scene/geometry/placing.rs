//! Instances laid out as vertices and indices.

use super::{Instance, More, Tangents, Vertex, face_normal, has_area};
use crate::scene::tangents;
use glam::Vec3;
use rustc_hash::FxHashMap;

/// Vertices of the instances so far, and what some of them have.
pub(super) struct Placing {
    pub vertices: Vec<Vertex>,
    pub more: More,
    pub second: bool,
    pub colored: bool,
    pub framed: bool,
}

impl Placing {
    /// Appends an instance; returns how many triangles its transform flattens away.
    pub fn place(&mut self, instance: &Instance<'_>, indices: &mut Vec<u32>) -> usize {
        let primitive = instance.primitive;
        let mirrored = instance.world.determinant() < 0.0;
        // By place in the primitive: the vertex that it became.
        const NOWHERE: u32 = u32::MAX;
        let mut placed = vec![NOWHERE; primitive.positions.len()];
        // Where tangents are made, a place may become several vertices: by the tangent's bits.
        let mut parted: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
        // A flat normal belongs to one triangle: its vertices are its own.
        let most = if primitive.normals.is_some() { placed.len() } else { usize::MAX };
        self.vertices.reserve(most.min(3 * primitive.drawn));
        let (mut dropped, mut drawn) = (0, 0);
        for triangle in primitive.triangles.iter() {
            let corners = primitive.corners(triangle);
            if !has_area(corners) {
                continue;
            }
            drawn += 1;
            if !has_area(corners.map(|p| instance.world.transform_point3(p))) {
                dropped += 1;
                continue;
            }
            let flat = face_normal(corners);
            let given = primitive.normals.is_some();
            let [a, b, c] = [0, 1, 2].map(|corner| {
                let index = triangle[corner];
                let made = match &primitive.tangents {
                    Tangents::Made(all) => all.get(drawn - 1).map(|t| t[corner]),
                    _ => None,
                };
                let known = match made {
                    Some(made) if given => parted.get(&(index, made.map(f32::to_bits))).copied(),
                    Some(_) => None,
                    None => Some(placed[index as usize]).filter(|v| *v != NOWHERE),
                };
                if let Some(known) = known {
                    return known;
                }
                let new = self.push(instance, index, primitive.normal(index, flat), made);
                match made {
                    Some(made) => drop(parted.insert((index, made.map(f32::to_bits)), new)),
                    None if given => placed[index as usize] = new,
                    None => {}
                }
                new
            });
            indices.extend(if mirrored { [a, c, b] } else { [a, b, c] });
        }
        dropped
    }

    /// Appends a vertex.
    fn push(&mut self, instance: &Instance<'_>, index: u32, normal: Vec3, made: Option<[f32; 4]>) -> u32 {
        let Instance { primitive, node, .. } = instance;
        let (place, new) = (index as usize, self.vertices.len());
        let uv = |set: usize| primitive.uvs[set].map_or([0.0; 2], |uvs| uvs.get(place));
        self.vertices.push(Vertex {
            position: primitive.positions.get(place),
            normal: normal.to_array(),
            uv: uv(0),
            node: *node,
            material: primitive.material,
        });
        if self.second {
            self.more.uvs.push(uv(1));
        }
        if self.colored {
            self.more.colors.push(primitive.colors.map_or([1.0; 4], |c| c.get(place)));
        }
        if self.framed {
            let given = match &primitive.tangents {
                Tangents::Given(tangents) => Some(tangents.get(place)),
                _ => made,
            };
            self.more.tangents.push(given.map_or([1.0, 0.0, 0.0, 1.0], |t| tangents::beside(t, normal)));
        }
        new as u32
    }
}
