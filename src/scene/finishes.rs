//! The tables of what surfaces are made of: materials, their textures, what vertices bring, and triangles that give
//! light.

use super::{
    Column, Table,
    model::{Alpha, Face, Material, Scene},
    pieces::Pieces,
};
use glam::{Vec2, Vec3, Vec4};
use std::sync::Arc;

/// What stands for no row of another table.
const NONE: u32 = u32::MAX;

impl Scene {
    pub(super) fn material_table(&self) -> Table {
        let all = &self.materials;
        let float = |of: fn(&Material) -> f32| Column::Float(all.iter().map(of).collect());
        let flag = |of: fn(&Material) -> bool| Column::Uint(all.iter().map(|m| of(m).into()).collect());
        let map = |of: fn(&Material) -> Option<u32>| Column::Uint(all.iter().map(|m| of(m).unwrap_or(NONE)).collect());
        Table {
            name: "materials",
            rows: all.len(),
            since: None,
            columns: Arc::new([
                ("base_color", Column::Vec4(all.iter().map(|m| m.base_color).collect())),
                ("base_color_texture", map(|m| m.base_color_texture)),
                ("emission", Column::Vec3(all.iter().map(|m| m.emission).collect())),
                ("emission_texture", map(|m| m.emission_texture)),
                ("double_sided", flag(|m| m.double_sided)),
                ("specular", float(|m| m.specular)),
                ("shininess", float(|m| m.shininess)),
                ("roughness", float(|m| m.roughness)),
                ("metallic", float(|m| m.metallic)),
                ("finish_texture", map(|m| m.finish_texture)),
                ("normal_texture", map(|m| m.normal_texture)),
                ("normal_scale", float(|m| m.normal_scale)),
                ("normal_deviation", float(|m| m.normal_deviation)),
                ("alpha_cutoff", float(cutoff)),
                ("alpha_blend", flag(|m| m.alpha == Alpha::Blend)),
                ("unlit", flag(|m| m.unlit)),
                ("face", Column::Vec4(all.iter().map(|m| head_on(&m.face)).collect())),
                ("face_texture", map(|m| m.face.strength_texture)),
                ("face_tint_texture", map(|m| m.face.tint_texture)),
                ("faced", flag(Material::is_faced)),
                ("transmission", float(|m| m.transmission)),
                ("transmission_texture", map(|m| m.transmission_texture)),
                ("coat", float(|m| m.coat.strength)),
                ("coat_texture", map(|m| m.coat.strength_texture)),
                ("coat_roughness", float(|m| m.coat.roughness)),
                ("coat_roughness_texture", map(|m| m.coat.roughness_texture)),
                ("coat_normal_texture", map(|m| m.coat.normal_texture)),
                ("coat_normal_scale", float(|m| m.coat.normal_scale)),
            ]),
        }
    }

    pub(super) fn texture_table(&self) -> Table {
        let all = &self.maps;
        let uint = |of: fn(&super::MaterialTexture) -> u32| Column::Uint(all.iter().map(of).collect());
        Table {
            name: "textures",
            rows: all.len(),
            since: None,
            columns: Arc::new([
                ("turn", Column::Vec4(all.iter().map(|t| t.turn).collect())),
                ("offset", Column::Vec2(all.iter().map(|t| t.offset).collect())),
                ("x", uint(|t| t.corner[0])),
                ("y", uint(|t| t.corner[1])),
                ("layer", uint(|t| t.layer)),
                ("width", uint(|t| t.size[0])),
                ("height", uint(|t| t.size[1])),
                ("levels", uint(|t| t.levels)),
                ("flags", uint(super::MaterialTexture::flags)),
                ("uv_set", uint(|t| t.set)),
            ]),
        }
    }

    pub(super) fn vertex_table(&self) -> Table {
        let (rows, more) = (self.geometry.vertices.len(), &self.geometry.more);
        // Where no vertex has any, all have the same.
        let color = match more.colors.is_empty() {
            true => Pieces::repeat(Vec4::from(more.color(0)), rows),
            false => more.colors.iter().map(|c| Vec4::from(*c)).collect(),
        };
        let tangent = match more.tangents.is_empty() {
            true => Pieces::repeat(Vec4::from(more.tangent(0)), rows),
            false => more.tangents.iter().map(|t| Vec4::from(*t)).collect(),
        };
        let uv = match more.uvs.is_empty() {
            true => Pieces::repeat(Vec2::ZERO, rows),
            false => more.uvs.iter().map(|uv| Vec2::from(*uv)).collect(),
        };
        Table {
            name: "vertices",
            rows,
            since: None,
            columns: Arc::new([
                ("second_uv", Column::Vec2(uv)),
                ("color", Column::Vec4(color)),
                ("tangent", Column::Vec4(tangent)),
            ]),
        }
    }

    pub(super) fn emitter_table(&self, corners: impl Fn(usize) -> [Vec3; 3]) -> Table {
        let all: Vec<Emitter> = self.emitting().map(|(i, radiance)| self.emitter(i, corners(i), radiance)).collect();
        let total: f64 = all.iter().map(Emitter::power).sum();
        let mut sum = 0.0;
        let mut cumulative = Vec::with_capacity(all.len());
        for emitter in &all {
            sum += emitter.power();
            cumulative.push((sum / total) as f32);
        }
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        let corner = |i: usize| Column::Vec3(all.iter().map(|e| e.corners[i]).collect());
        let uv = |i: usize| Column::Vec2(all.iter().map(|e| e.uvs[i]).collect());
        Table {
            name: "emitters",
            rows: all.len(),
            since: None,
            columns: Arc::new([
                ("a", corner(0)),
                ("b", corner(1)),
                ("c", corner(2)),
                ("radiance", Column::Vec3(all.iter().map(|e| e.radiance).collect())),
                ("area", Column::Float(all.iter().map(Emitter::area).collect())),
                ("cumulative", Column::Float(cumulative.into_iter().collect())),
                (
                    "density",
                    Column::Float(all.iter().map(|e| (f64::from(e.radiance.element_sum()) / total) as f32).collect()),
                ),
                ("uva", uv(0)),
                ("uvb", uv(1)),
                ("uvc", uv(2)),
                ("texture", Column::Uint(all.iter().map(|e| e.texture).collect())),
                ("emission", Column::Vec3(all.iter().map(|e| e.emission).collect())),
            ]),
        }
    }

    /// A triangle that gives light, by its place in the order of indices.
    fn emitter(&self, triangle: usize, corners: [Vec3; 3], radiance: Vec3) -> Emitter {
        let geometry = &self.geometry;
        let vertices = [0, 1, 2].map(|i| geometry.indices[3 * triangle + i] as usize);
        let material = self.materials.get(geometry.vertices[vertices[0]].material as usize);
        let texture = material.and_then(|m| m.emission_texture);
        let second = texture.and_then(|t| self.maps.get(t as usize)).is_some_and(|t| t.set == 1);
        let uvs = vertices.map(|v| Vec2::from(if second { geometry.more.uv(v) } else { geometry.vertices[v].uv }));
        let emission = material.map_or(Vec3::ZERO, |m| m.emission);
        Emitter { corners, radiance, uvs, texture: texture.unwrap_or(NONE), emission }
    }

    /// Rows of the `emitters` table, by triangle in the order of indices; empty where no material has an emissive
    /// texture, which leave the row to be known by the radiance.
    pub(super) fn emitter_rows(&self) -> Arc<Vec<u32>> {
        if self.glow.is_empty() {
            return Arc::default();
        }
        let mut rows = vec![NONE; self.geometry.indices.len() / 3];
        self.emitting().enumerate().for_each(|(row, (triangle, _))| rows[triangle] = row as u32);
        Arc::new(rows)
    }
}

/// From which alpha on something is there, for what can't be there in part; 0: always, above 1: never.
fn cutoff(m: &Material) -> f32 {
    match m.alpha {
        _ if m.is_mostly_clear() => 2.0,
        Alpha::Opaque => 0.0,
        Alpha::Mask(cutoff) => cutoff,
        Alpha::Blend => 0.5,
    }
}

/// Reflectance of a face seen head on, and in w at grazing angles. Source: `KHR_materials_specular`, "Implementation".
fn head_on(face: &Face) -> Vec4 {
    let root = if face.ior == 0.0 { 1.0 } else { (face.ior - 1.0) / (face.ior + 1.0) };
    (face.tint * root * root).min(Vec3::ONE).extend(1.0) * face.strength
}

/// A triangle that gives light.
struct Emitter {
    corners: [Vec3; 3],
    /// The mean.
    radiance: Vec3,
    /// Of its texture.
    uvs: [Vec2; 3],
    texture: u32,
    /// What the texture multiplies.
    emission: Vec3,
}

impl Emitter {
    fn area(&self) -> f32 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
    }

    fn power(&self) -> f64 {
        f64::from(self.radiance.element_sum()) * f64::from(self.area())
    }
}
