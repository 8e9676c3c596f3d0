//! Instances laid out as vertices and indices.

use super::{Flipped, Geometry, Instance, More, Primitive, Tangents, Vertex, face_normal, has_area};
use crate::{
    diag::Diagnostic,
    scene::{
        deform::{Deformed, Owners},
        deformer::{Deformer, MAX_DISPLACEMENTS},
        document::Document,
        tangents,
    },
};
use glam::Vec3;
use rustc_hash::FxHashMap;

/// Rows of a table of 128 bytes each, for which a binding of 128 MiB has room.
const MAX_DEFORMED: usize = (1 << 20) - (1 << 18);

/// Lays all instances out in one list, not yet in clusters. Mirroring transforms get their winding turned round, so
/// that front stays front. `nodes`: how many there are. The instances of a node follow on each other, and have
/// MAX_TRIANGLES at most.
pub(in crate::internals::scene) fn assemble(
    document: &Document<'_>,
    nodes: usize,
    instances: &[Instance<'_>],
    faults: &mut Vec<Diagnostic>,
) -> (Geometry, Vec<Deformed>) {
    let drawn = |sides: bool| {
        let of = instances.iter().filter(|i| i.double_sided == sides);
        of.map(|i| i.primitive.drawn).fold(0, usize::saturating_add)
    };
    let total = drawn(false).saturating_add(drawn(true));
    let has = |what: fn(&Primitive<'_>) -> bool| instances.iter().any(|i| what(i.primitive));
    let mut out = Placing {
        vertices: vec![],
        more: More::default(),
        second: has(|p| p.uvs[1].is_some()),
        colored: has(|p| p.colors.is_some()),
        framed: has(|p| !matches!(p.tangents, Tangents::None)),
        owners: Owners::of(nodes),
        sources: vec![],
        became: vec![],
    };
    let (mut deformed, mut displacements) = (vec![], 0_usize);
    let mut one_sided = Vec::with_capacity(3 * total);
    let mut two_sided = Vec::with_capacity(3 * drawn(true));
    let mut dropped = 0;
    for (i, instance) in instances.iter().enumerate() {
        let indices = if instance.double_sided { &mut two_sided } else { &mut one_sided };
        let first = out.vertices.len();
        dropped += out.place(instance, indices);
        if let Some(deformer) = instance.deformer.filter(|_| out.vertices.len() > first) {
            let (of, placed) = (&instance.primitive.deformable, &out.vertices[first..]);
            displacements = displacements.saturating_add(Deformer::displacements(of, placed.len()));
            if out.owners.rows() > MAX_DEFORMED || displacements > MAX_DISPLACEMENTS {
                let why = format!(
                    "more than {MAX_DEFORMED} vertices with skins or morph targets, or {MAX_DISPLACEMENTS} displacements"
                );
                faults.push(document.error("scene", why).help("thin these meshes out, or place them at fewer nodes"));
                return Default::default();
            }
            let sources = std::mem::take(&mut out.sources);
            deformed.push(deformer.deformed(of, instance.node, placed, first, &sources));
        }
        let whole = instances.get(i + 1).is_none_or(|next| next.node != instance.node);
        if whole && dropped > 0 {
            let why = format!("its transform leaves {dropped} triangles without area; they are dropped");
            faults.push(document.warning(format!("node \"{}\"", instance.node_name), why));
            dropped = 0;
        }
    }
    // MAX_TRIANGLES keeps the count far inside u32.
    let count = one_sided.len() as u32;
    one_sided.append(&mut two_sided);
    let Placing { vertices, more, owners, .. } = out;
    (Geometry { vertices, indices: one_sided, one_sided: count, clusters: vec![], more, owners }, deformed)
}

/// Vertices of the instances so far, and what some of them have.
pub(super) struct Placing {
    pub vertices: Vec<Vertex>,
    pub more: More,
    pub second: bool,
    pub colored: bool,
    pub framed: bool,
    pub owners: Owners,
    /// Of an instance with a deformer: the places in the primitive that its vertices were.
    pub sources: Vec<u32>,
    /// By place in a primitive: the vertex that it became last, in whichever instance.
    pub became: Vec<u32>,
}

impl Placing {
    /// Appends an instance; returns how many triangles its transform flattens away.
    pub fn place(&mut self, instance: &Instance<'_>, indices: &mut Vec<u32>) -> usize {
        let primitive = instance.primitive;
        let mirrored = (instance.world.determinant() < 0.0) != (primitive.flipped == Flipped::Triangles);
        // What vertices of other instances became lies before; what is no vertex yet, behind.
        let first = self.vertices.len();
        let given = primitive.normals.is_some();
        if given && self.became.len() < primitive.positions.len() {
            self.became.resize(primitive.positions.len(), u32::MAX);
        }
        // Where tangents are made, a place may become several vertices: by the tangent's bits.
        let mut parted: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
        // A flat normal belongs to one triangle: its vertices are its own.
        let most = if given { primitive.positions.len() } else { usize::MAX };
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
            let [a, b, c] = [0, 1, 2].map(|corner| {
                let index = triangle[corner];
                let made = match &primitive.tangents {
                    Tangents::Made(all) => all.get(drawn - 1).map(|t| t[corner]),
                    _ => None,
                };
                let known = match made {
                    Some(made) if given => parted.get(&(index, made.map(f32::to_bits))).copied(),
                    Some(_) => None,
                    None if given => {
                        let own = first..self.vertices.len();
                        Some(self.became[index as usize]).filter(|v| own.contains(&(*v as usize)))
                    }
                    None => None,
                };
                if let Some(known) = known {
                    return known;
                }
                let new = self.push(instance, index, primitive.normal(index, flat), made);
                match made {
                    Some(made) => drop(parted.insert((index, made.map(f32::to_bits)), new)),
                    None if given => self.became[index as usize] = new,
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
        let node = match instance.deformer {
            Some(_) => {
                self.sources.push(index);
                self.owners.add(*node)
            }
            None => *node,
        };
        let uv = |set: usize| primitive.uvs[set].map_or([0.0; 2], |uvs| uvs.get(place));
        self.vertices.push(Vertex {
            position: primitive.positions.get(place),
            normal: normal.to_array(),
            uv: uv(0),
            node,
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
