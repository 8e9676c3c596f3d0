//! The scene as plain data, and the facts it states.

use super::{Animation, Deformed, Environment, Geometry, KeyedParam, Levels, MaterialTexture, TextureArray};
use crate::value::{Value, Values};
use glam::{Mat3, Vec3, Vec3A, Vec4};
use std::sync::Arc;

/// Everything a graph may ask of a scene, checked: all numbers are finite, all indices in range.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file's name without its extension.
    pub name: String,
    /// All instances of all meshes as one indexed triangle list. Tables share it.
    pub geometry: Arc<Geometry>,
    /// Vertices that skins and morph targets move, in their order.
    pub deformed: Arc<Vec<Deformed>>,
    /// Parents come before their children.
    pub nodes: Vec<Node>,
    pub materials: Vec<Material>,
    pub lights: Vec<Light>,
    pub cameras: Vec<Camera>,
    /// Index into `cameras` of the one used when none is named; `None` only without cameras.
    pub default_camera: Option<usize>,
    /// What materials' textures refer to.
    pub maps: Vec<MaterialTexture>,
    /// The images of these; `None` without.
    pub textures: Option<TextureArray>,
    /// What is seen where nothing is; `None` for darkness.
    pub environment: Option<Environment>,
    /// Of each triangle, in the order of indices, the mean of its emissive texture; empty where no material has one.
    /// Tables share it.
    pub glow: Arc<Vec<Vec3>>,
    /// All geometry over all its motion, in metres, world space.
    pub bounds: Bounds,
    /// Where probes go: the scene file's `grid`, or `bounds`.
    pub grid: Bounds,
    /// Parameters of the graph that shows it, over time.
    pub params: Vec<KeyedParam>,
    /// What was subtracted from the file's coordinates: not 0 for scenes that lie far from their origin.
    pub origin: Vec3,
    /// Made of the rest when asked for.
    pub levels: Levels,
}

/// A place in the hierarchy: `x_parent = linear · x + translation`.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    pub name: String,
    /// An earlier node.
    pub parent: Option<usize>,
    pub translation: Vec3,
    /// Rotation and scale.
    pub linear: Mat3,
    /// In the order of time; empty for a node that the scene file does not move.
    pub motion: Vec<Keyframe>,
    /// How the glTF moves it, where the scene file does not.
    pub animation: Option<Animation>,
}

impl Node {
    /// Whether it moves by itself.
    pub(super) fn moves(&self) -> bool {
        !self.motion.is_empty() || self.animation.is_some()
    }
}

/// Where a moving node is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keyframe {
    /// Seconds, at least 0.
    pub time: f32,
    /// In the parent's space; replaces the node's own.
    pub translation: Vec3,
    /// Unit axis in the parent's space and an angle in radians, on top of the node's own rotation.
    pub rotation: Option<(Vec3, f32)>,
}

/// A surface: Lambert, with an optional Phong lobe, or glTF's metallic-roughness model, as shaders choose; and emission
/// from its front face. Textures are indices into [`Scene::maps`], and multiply what they belong to.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    /// Linear reflectance (rgb) and alpha.
    pub base_color: Vec4,
    pub base_color_texture: Option<u32>,
    /// Radiance.
    pub emission: Vec3,
    pub emission_texture: Option<u32>,
    pub double_sided: bool,
    /// Phong strength, 0 to 1.
    pub specular: f32,
    /// Phong exponent.
    pub shininess: f32,
    /// glTF's roughness and metalness, 0 to 1.
    pub roughness: f32,
    pub metallic: f32,
    /// Roughness in green, metalness in blue.
    pub finish_texture: Option<u32>,
    /// Normals in the frame of tangents, and what their x and y are multiplied by.
    pub normal_texture: Option<u32>,
    pub normal_scale: f32,
    /// Sine of the angle between the normals that it is shaded by and its triangles' planes, at most on nearly all of
    /// its area; 0 for flat ones.
    pub normal_deviation: f32,
    pub alpha: Alpha,
    /// It shows its base colour, whatever lights it, and takes and gives no light.
    pub unlit: bool,
    pub face: Face,
    /// Share of the light that goes through the face and straight on, behind it; its texture in red.
    pub transmission: f32,
    pub transmission_texture: Option<u32>,
    pub coat: Coat,
}

/// What alpha says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alpha {
    Opaque,
    /// Nothing is there where it is less.
    Mask(f32),
    /// The share that is there.
    Blend,
}

/// How a surface that is no metal reflects at its face (`KHR_materials_ior`, `KHR_materials_specular`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    pub ior: f32,
    /// How much of it, 0 to 1; its texture in alpha.
    pub strength: f32,
    pub strength_texture: Option<u32>,
    /// What head-on reflection is multiplied by.
    pub tint: Vec3,
    pub tint_texture: Option<u32>,
}

impl Default for Face {
    fn default() -> Face {
        Face { ior: 1.5, strength: 1.0, strength_texture: None, tint: Vec3::ONE, tint_texture: None }
    }
}

/// A clear layer on top (`KHR_materials_clearcoat`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coat {
    /// Share of the surface, 0 to 1; its texture in red.
    pub strength: f32,
    pub strength_texture: Option<u32>,
    pub roughness: f32,
    /// In green.
    pub roughness_texture: Option<u32>,
    /// Without one it is as smooth as the geometry, whatever bends the normals below.
    pub normal_texture: Option<u32>,
    pub normal_scale: f32,
}

impl Default for Coat {
    fn default() -> Coat {
        Coat {
            strength: 0.0,
            strength_texture: None,
            roughness: 0.0,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

/// A light at a node, as glTF's `KHR_lights_punctual` states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    pub name: String,
    pub node: usize,
    pub kind: LightKind,
    /// Colour times candela (point, spot) or lux (directional).
    pub intensity: Vec3,
    /// Metres; 0 for none.
    pub range: f32,
    /// Half angles of a spot's cone in radians, `0 ≤ inner ≤ outer ≤ π/2`; 0 for the other kinds.
    pub inner: f32,
    pub outer: f32,
}

/// The kinds of light; the numbers are those of the `lights` table's `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightKind {
    Point = 0,
    Spot = 1,
    Directional = 2,
}

impl LightKind {
    /// Shadow views of such a light.
    pub fn views(self) -> u32 {
        match self {
            LightKind::Point => 6,
            LightKind::Spot | LightKind::Directional => 1,
        }
    }
}

/// A camera at a node; it looks down the node's −Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The node's name, or the camera's where the node has none.
    pub name: String,
    /// The glTF camera's own name, where it differs.
    pub alias: Option<String>,
    pub node: usize,
    pub lens: Lens,
}

/// How a camera projects. The aspect is always the image's.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Lens {
    /// `yfov` is the whole vertical angle in radians; without `far` the scene's extent decides.
    Perspective { yfov: f32, near: f32, far: Option<f32> },
    /// `ymag` is half the height in metres.
    Orthographic { ymag: f32, near: f32, far: f32 },
}

/// An axis-aligned box; empty when `min` exceeds `max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    /// The box of nothing.
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box round some points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Bounds {
        let nothing = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        let grown = |(min, max): (Vec3A, Vec3A), p: Vec3| (min.min(p.into()), max.max(p.into()));
        let (min, max) = points.into_iter().fold(nothing, grown);
        Bounds { min: min.into(), max: max.into() }
    }

    /// The smallest box round both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// As many boxes as there is room for, round all of these.
    pub fn gathered(boxes: &[Bounds], room: usize) -> Vec<Bounds> {
        let round = |some: &[Bounds]| some.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        boxes.chunks(boxes.len().div_ceil(room.max(1)).max(1)).map(round).collect()
    }

    /// Whether the two have a point in common.
    pub fn meets(&self, other: &Bounds) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The eight corners.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
            Vec3::new(pick(1, self.min.x, self.max.x), pick(2, self.min.y, self.max.y), pick(4, self.min.z, self.max.z))
        })
    }

    pub fn center(self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Length of the diagonal.
    pub fn diagonal(self) -> f32 {
        self.min.distance(self.max)
    }

    /// Distance from a point to the box: 0 inside.
    pub fn nearest(self, point: Vec3) -> f32 {
        (point - point.max(self.min).min(self.max)).length()
    }

    /// Where the first corner lies along a unit direction, from the origin.
    pub fn first_along(self, direction: Vec3) -> f32 {
        (self.min * direction).min(self.max * direction).element_sum()
    }

    /// Distance from a point to the farthest corner.
    pub fn farthest(self, point: Vec3) -> f32 {
        (point - self.min).abs().max((point - self.max).abs()).length()
    }
}

impl Scene {
    /// The facts of [`super::FACTS`], by name.
    pub fn facts(&self) -> Values {
        let count = |n: usize| Value::Uint(u32::try_from(n).unwrap_or(u32::MAX));
        let lights = |kind| count(self.lights.iter().filter(|l| l.kind == kind).count());
        let materials = |test: fn(&Material) -> bool| count(self.materials.iter().filter(|m| test(m)).count());
        let facts = [
            ("lights", count(self.lights.len())),
            ("point_lights", lights(LightKind::Point)),
            ("spot_lights", lights(LightKind::Spot)),
            ("directional_lights", lights(LightKind::Directional)),
            ("light_views", Value::Uint(self.lights.iter().map(|l| l.kind.views()).sum())),
            ("environment", Value::Uint(self.environment.as_ref().map_or(0, Environment::edge))),
            ("emitters", count(self.emitting().count())),
            ("materials", count(self.materials.len())),
            ("emissive_materials", materials(Material::emits)),
            ("specular_materials", materials(|m| m.specular > 0.0)),
            (
                "max_shininess",
                Value::Float(
                    self.materials.iter().filter(|m| m.specular > 0.0).map(|m| m.shininess).fold(0.0, f32::max),
                ),
            ),
            (
                "max_albedo",
                Value::Float(self.materials.iter().map(Material::most_reflected).fold(0.0, f32::max).min(1.0)),
            ),
            ("metallic_materials", materials(|m| m.metallic > 0.0)),
            ("textured_materials", materials(|m| m.textures().next().is_some())),
            ("finish_textures", materials(|m| m.finish_texture.is_some())),
            ("normal_textures", materials(|m| m.normal_texture.or(m.coat.normal_texture).is_some())),
            ("smooth_materials", materials(|m| m.normal_deviation > 0.0)),
            ("emission_textures", materials(|m| m.emission_texture.is_some())),
            ("masked_materials", materials(|m| m.alpha != Alpha::Opaque || m.is_mostly_clear())),
            ("clear_materials", materials(Material::is_clear)),
            ("unlit_materials", materials(|m| m.unlit)),
            ("faced_materials", materials(Material::is_faced)),
            ("coated_materials", materials(|m| m.coat.strength > 0.0)),
            ("colored_vertices", count(self.geometry.more.colors.len())),
            ("second_uvs", count(self.geometry.more.uvs.len())),
            ("double_sided_materials", materials(|m| m.double_sided)),
            ("nodes", count(self.nodes.len() + self.geometry.owners.rows())),
            ("moving_nodes", count(self.moving_shown().into_iter().filter(|m| *m).count())),
            ("triangles", count(self.geometry.indices.len() / 3)),
            ("vertices", count(self.geometry.vertices.len())),
            ("clusters", count(self.geometry.clusters.len())),
            ("one_sided_clusters", count(self.geometry.one_sided_clusters())),
            ("bounds_min", Value::Vec3(self.bounds.min)),
            ("bounds_max", Value::Vec3(self.bounds.max)),
            ("grid_min", Value::Vec3(self.grid.min)),
            ("grid_max", Value::Vec3(self.grid.max)),
        ];
        facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// Vertex indices of each triangle, in the order of the `triangles` table.
    pub(super) fn corners(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.geometry.indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]])
    }

    /// Triangles that give light, by their place in the order of indices, and how much on average: their radiance.
    pub(super) fn emitting(&self) -> impl Iterator<Item = (usize, Vec3)> + '_ {
        let radiance = |(i, c): (usize, [u32; 3])| {
            let whole = self.material(&c).map_or(Vec3::ZERO, |m| m.emission);
            (i, self.glow.get(i).map_or(whole, |share| whole * *share))
        };
        self.corners().enumerate().map(radiance).filter(|(_, e)| e.max_element() > 0.0)
    }

    /// The material of a triangle.
    pub(super) fn material(&self, corners: &[u32; 3]) -> Option<&Material> {
        let vertex = self.geometry.vertices.get(corners[0] as usize)?;
        self.materials.get(vertex.material as usize)
    }
}

impl Material {
    /// What glTF gives a primitive without one.
    pub fn plain() -> Material {
        Material {
            name: "default".into(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            double_sided: false,
            specular: 0.0,
            shininess: 1.0,
            roughness: 1.0,
            metallic: 1.0,
            finish_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            normal_deviation: 0.0,
            alpha: Alpha::Opaque,
            unlit: false,
            face: Face::default(),
            transmission: 0.0,
            transmission_texture: None,
            coat: Coat::default(),
        }
    }

    /// Its textures.
    pub fn textures(&self) -> impl Iterator<Item = u32> {
        let all = [
            self.base_color_texture,
            self.emission_texture,
            self.finish_texture,
            self.normal_texture,
            self.face.strength_texture,
            self.face.tint_texture,
            self.transmission_texture,
            self.coat.strength_texture,
            self.coat.roughness_texture,
            self.coat.normal_texture,
        ];
        all.into_iter().flatten()
    }

    /// Whether some light goes straight through.
    pub fn is_clear(&self) -> bool {
        self.alpha == Alpha::Blend || self.transmission > 0.0
    }

    /// Whether it states what its face does, by ior, specular or transmission: else it counts as matte.
    pub fn is_faced(&self) -> bool {
        self.face != Face::default() || self.transmission > 0.0
    }

    /// Whether most light goes straight through everywhere: who cannot show it in part leaves it out.
    pub fn is_mostly_clear(&self) -> bool {
        let through = self.transmission * (1.0 - self.metallic) * self.base_color.truncate().max_element();
        let everywhere = self.transmission_texture.is_none() && !matches!(self.alpha, Alpha::Mask(_));
        everywhere && !self.emits() && through > 0.5
    }

    /// The share of light that it reflects, of the channel of which it does most; 0 where a texture decides, or where
    /// light goes through.
    pub fn most_reflected(&self) -> f32 {
        let elsewhere = self.base_color_texture.is_some() || self.unlit || self.transmission > 0.0;
        if elsewhere { 0.0 } else { self.base_color.truncate().max_element() + self.specular }
    }

    /// Whether it gives light.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }
}
