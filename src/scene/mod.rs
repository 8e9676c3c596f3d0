//! Scenes: glTF and a scene RON beside it, to plain arrays, named tables and facts. No device.
//!
//! [`Scene::load`] reads files into a [`Scene`], and is the only part that can meet a fault in what a user wrote.
//! A scene then answers pure questions: [`Scene::facts`], [`Scene::pose`] at a time, [`Scene::tables`] and
//! [`Scene::camera_values`] at a pose.
//!
//! - `load` finds the files; `document` reads bytes, buffers and accessors, `decoded` and `draco` those that are
//!   compressed or sparse.
//! - `import` makes nodes of them, `instancing` copies of some. `materials` and `extensions` read materials,
//!   `glossiness` older ones; `textures`, `basis`, `mips` and `pages` read images.
//! - `attached` reads lights and cameras, `names` tells those of one name apart; `animation` moves nodes; `deformer`
//!   reads skins and morph targets, which `deform` poses.
//! - `description` reads the scene RON. `complete` adds its lights and cameras, those of the command (`added`), and
//!   what a scene lacks (`room` finds whether to stand inside); `environment` is light from all around (`sky`,
//!   `panorama`).
//! - `geometry` holds the vertices, `tangents` what normal maps need, `clusters` their compact groups, `levels` fewer
//!   triangles. `glow` says how much light textured triangles give, `smooth` how far normals lie from the triangles'.
//! - `model` holds the scene and its facts; `motion` poses it. `tables`, `finishes`, `corners`, `light_views` and `bvh`
//!   fill the shaders' tables. Columns are `pieces`, `transforms` of nodes, or boxes of a `hierarchy`.
//! - `camera` makes the view matrices, [`navigate`] moves views, `placed` is what programs say that show a scene of
//!   their own.
//!
//! # The scene file
//! A RON file beside the glTF says what glTF has no place for:
//!
//! ```ron
//! Scene(
//!     gltf: "hall.glb",                       // beside this file; without it, the glTF of the same stem
//!     grid: ((-4, 0, -4), (4, 3, 4)),         // corners of the box for probes; without it, the scene's bounds
//!     materials: {                            // by the glTF's names
//!         "floor": (specular: 0.4, shininess: 20),
//!     },
//!     motion: {                               // by the name of a node, or of a light or camera at a node
//!         "lamp": [
//!             (time: 0, translation: (0, 2, 0)),
//!             (time: 4, translation: (1, 2, 0), rotation_degrees: (0, 1, 0, 90)),
//!         ],
//!     },
//!     lights: { "sun": Sun(azimuth: 120, elevation: 30, lux: 3) },
//!     cameras: { "overview": (at: (4, 3, 6), look_at: (0, 1, 0)) },
//!     environment: Sky(),                     // or Constant(radiance: (1, 1, 1)), File(file: "sky.hdr")
//!     camera: "overview",                     // used when none is named; without it, the first
//! )
//! ```
//!
//! All fields are optional; `docs/scenes.md` lists them all. Motion is linear from keyframe to keyframe and begins anew
//! after the last one's time; before the first one's time the first holds. `translation` replaces the node's own;
//! `rotation_degrees` (axis x, y, z, then the angle) turns it about that axis of its parent's space, on top of its own
//! rotation. Between two keyframes with the same axis the angle grows linearly, so that 0 to 360 is a whole turn. A
//! keyframe without one of them has the node's own.

mod added;
mod animation;
mod assets;
mod attached;
mod basis;
mod bvh;
mod camera;
mod clusters;
mod columns;
mod complete;
mod corners;
mod decoded;
mod deform;
mod deformer;
mod description;
mod document;
mod draco;
mod environment;
mod extensions;
mod finishes;
mod geometry;
mod glossiness;
mod glow;
mod hierarchy;
mod import;
mod instancing;
mod json;
mod keyed;
mod levels;
mod light_views;
mod load;
mod materials;
mod mips;
mod model;
mod motion;
mod names;
pub mod navigate;
mod pages;
mod panorama;
mod pieces;
mod placed;
mod room;
mod sky;
mod smooth;
mod tables;
mod tangents;
#[cfg(test)]
mod tests;
mod textures;
mod transforms;

pub use added::{AddedCamera, AddedEnvironment, AddedLight, Additions};
pub use animation::Animation;
pub use assets::{AssetHashes, Assets};
pub use bvh::{MAX_DEPTH, Refit, reach};
pub use camera::{CONTENT_HASH, FRAME_VALUES};
pub use clusters::{CLUSTER, Cluster};
pub(crate) use columns::Since;
pub use columns::{Column, Table};
pub use corners::{Corners, VertexAttribute};
pub use deform::{Deformed, Owners};
pub use environment::Environment;
pub use geometry::{Geometry, More, VERTEX_ATTRIBUTES, Vertex};
pub use hierarchy::Hierarchy;
pub use keyed::KeyedParam;
pub use levels::{Level, Levels, Taken};
pub use load::Loaded;
pub use mips::TexelCoding;
pub use model::{Alpha, Bounds, Camera, Coat, Face, Keyframe, Lens, Light, LightKind, Material, Node, Scene};
pub use motion::{CameraPose, LightPose, Pose, Shift, View};
pub use pieces::Pieces;
pub use placed::{Extent, Look};
pub use tables::Tables;
pub use textures::{Between, MaterialTexture, TextureArray, Wrap};
pub use transforms::{NodeMatrix, Transforms};

use crate::value::Type;

/// The tables every scene has, with their columns: what shaders may ask for, known without a scene.
///
/// - `nodes`: `transform`, `inverse_transpose` (for normals), `previous_transform` (in the last frame); behind the
///   nodes a row for each vertex that a skin or morph targets move
/// - `materials`: `base_color` (rgb + alpha), `base_color_texture` (row of `textures`, `0xffffffff` for none, as of all
///   that follow), `emission` (radiance), `emission_texture`, `double_sided` (0 or 1), `specular` (Phong strength, 0 to
///   1), `shininess` (Phong exponent), `roughness`, `metallic` (glTF's, 0 to 1), `finish_texture` (roughness in green,
///   metalness in blue), `normal_texture`, `normal_scale`, `normal_deviation` (sine of the angle between normals
///   and the triangles' planes, at most on nearly all of its area; 0 for flat ones), `alpha_cutoff` (nothing is there
///   where alpha is less; 0 for opaque ones, one half for those that blend, 2 for those that let most light through),
///   `alpha_blend` (0 or 1), `unlit` (0 or 1),
///   `face` (of what is no metal: reflectance head on in rgb, at grazing angles in a), `face_texture` (times its
///   alpha), `face_tint_texture` (head on times its colour), `faced` (0 or 1: the material states what its face does),
///   `transmission`, `transmission_texture` (red), `coat` (share of a clear layer), `coat_texture` (red),
///   `coat_roughness`, `coat_roughness_texture` (green), `coat_normal_texture`, `coat_normal_scale`
/// - `textures`: how materials read images: `turn` (a matrix's columns) and `offset` (what is added then) of
///   coordinates, `x`, `y`, `layer` (its first texel on the pages of `scene_textures`), `width`, `height`, `levels`
///   (mips), `flags` (bits 0 and 1 how x goes on beyond 0 to 1: 0 repeats, 1 stays, 2 mirrors; 2 and 3 the same for y;
///   4 the nearest texel where texels are larger than pixels, 5 where they are smaller; 6 and 7 mips: 0 none, 1 the
///   nearest, 2 between two; 8 colours are in sRGB), `uv_set` (which of a vertex's coordinates, 0 or 1)
/// - `vertices`: what only some scenes' vertices have, by `vertex_index`: `second_uv`, `color` (linear), `tangent` (the
///   node's space; in w the side of the third axis)
/// - `lights`: `kind` (0 point, 1 spot, 2 directional), `position`, `direction` (of travel, unit), `intensity`
///   (colour × candela, or × lux for directional), `range` (0: none), `cos_inner`, `cos_outer`, `first_view`, `views`
///   (the light's rows in `light_views`)
/// - `light_views`: one row a shadow map: `light`, `view_projection`, `near`, `far`; a point light has 6 in the
///   order +X −X +Y −Y +Z −Z, a cube map's faces with left and right exchanged, the others 1. The same in all rows:
///   `lower`, `upper`, corners of the box round everything, world space
/// - `triangles`: world space: corners `a`, `b`, `c` (counter-clockwise seen from the front), unit normals at them
///   `na`, `nb`, `nc`, texture coordinates at them `uva`, `uvb`, `uvc`, the second ones `uv2a`, `uv2b`, `uv2c`, colours
///   `ca`, `cb`, `cc`, tangents `ta`, `tb`, `tc` (in w the side of the third axis), `material`, `emitter` (row of
///   `emitters`, where a material has an emissive texture); in the order of the leaves of `bvh`
/// - `bvh`: boxes within boxes over `triangles`, sorted where they stand at time 0, each leaf of one node, the root
///   first: `lower`, `upper` (corners of the box), `count` (of a leaf: its triangles, 1 to 8; else 0), `first` (of a
///   leaf: its first triangle; else the row of its first child, the other child being the next row). Leaves lie at most
///   47 levels below the root. Without triangles, one leaf with one triangle that no ray meets.
/// - `clusters`: the triangles as the draw passes have them, in compact groups of few: `lower`, `upper` (corners of the
///   box, world space), `first`, `count` (its indices in the order of drawing), `node` (its row in `nodes`),
///   `sides` (of the box round everything that it lies in: bits 0 to 2 the lower ones along x, y, z, bits 3 to 5 the
///   upper ones); those of single-sided materials first
/// - `emitters`: the emissive triangles: corners `a`, `b`, `c`, `radiance` (the mean), `area`, `cumulative` (share of
///   the power up to and with this row; the last is 1), `density` (per m², of picking a point on it by power),
///   `texture` (row of `textures`) with the coordinates at the corners `uva`, `uvb`, `uvc`, and `emission`, what the
///   texture multiplies
/// - `environment`: light from all around by direction: squares of 1, 4, 16, … texels, one after the other, the last of
///   `environment`² texels (a fact); `radiance`, `weight` (what directions are drawn by). Which direction a texel
///   stands for: `shaders/lib/environment.wgsl`
/// - `moved`: boxes round all that moved since the last frame, where it was and where it is: `lower`, `upper`, corners
///   in the world. Always 8 rows; in those that hold nothing `lower.x` is above `upper.x`. A step with `only` doesn't
///   run because this table changed
///
/// A table without rows binds as one zeroed row, so that a shader always has something to point at; the counts
/// are facts.
pub const TABLES: &[TableKind] = &[
    TableKind {
        name: "nodes",
        follows: Follows::NODES,
        large: true,
        columns: &[("transform", Type::Mat4), ("inverse_transpose", Type::Mat4), (PREVIOUS_TRANSFORM, Type::Mat4)],
    },
    TableKind {
        name: "materials",
        follows: Follows::NOTHING,
        large: false,
        columns: &[
            ("base_color", Type::Vec4),
            ("base_color_texture", Type::Uint),
            ("emission", Type::Vec3),
            ("emission_texture", Type::Uint),
            ("double_sided", Type::Uint),
            ("specular", Type::Float),
            ("shininess", Type::Float),
            ("roughness", Type::Float),
            ("metallic", Type::Float),
            ("finish_texture", Type::Uint),
            ("normal_texture", Type::Uint),
            ("normal_scale", Type::Float),
            ("normal_deviation", Type::Float),
            ("alpha_cutoff", Type::Float),
            ("alpha_blend", Type::Uint),
            ("unlit", Type::Uint),
            ("face", Type::Vec4),
            ("face_texture", Type::Uint),
            ("face_tint_texture", Type::Uint),
            ("faced", Type::Uint),
            ("transmission", Type::Float),
            ("transmission_texture", Type::Uint),
            ("coat", Type::Float),
            ("coat_texture", Type::Uint),
            ("coat_roughness", Type::Float),
            ("coat_roughness_texture", Type::Uint),
            ("coat_normal_texture", Type::Uint),
            ("coat_normal_scale", Type::Float),
        ],
    },
    TableKind {
        name: "lights",
        follows: Follows::LIGHTS,
        large: false,
        columns: &[
            ("kind", Type::Uint),
            ("position", Type::Vec3),
            ("direction", Type::Vec3),
            ("intensity", Type::Vec3),
            ("range", Type::Float),
            ("cos_inner", Type::Float),
            ("cos_outer", Type::Float),
            ("first_view", Type::Uint),
            ("views", Type::Uint),
        ],
    },
    TableKind {
        name: "light_views",
        follows: Follows::LIGHTS.and(Follows::NODES),
        large: false,
        columns: &[
            ("light", Type::Uint),
            ("view_projection", Type::Mat4),
            ("near", Type::Float),
            ("far", Type::Float),
            ("lower", Type::Vec3),
            ("upper", Type::Vec3),
        ],
    },
    TableKind {
        name: "triangles",
        follows: Follows::NODES.and(Follows::TRIANGLES),
        large: true,
        columns: &[
            ("a", Type::Vec3),
            ("b", Type::Vec3),
            ("c", Type::Vec3),
            ("na", Type::Vec3),
            ("nb", Type::Vec3),
            ("nc", Type::Vec3),
            ("uva", Type::Vec2),
            ("uvb", Type::Vec2),
            ("uvc", Type::Vec2),
            ("uv2a", Type::Vec2),
            ("uv2b", Type::Vec2),
            ("uv2c", Type::Vec2),
            ("ca", Type::Vec4),
            ("cb", Type::Vec4),
            ("cc", Type::Vec4),
            ("ta", Type::Vec4),
            ("tb", Type::Vec4),
            ("tc", Type::Vec4),
            ("material", Type::Uint),
            ("emitter", Type::Uint),
        ],
    },
    TableKind {
        name: "bvh",
        follows: Follows::NODES.and(Follows::TRIANGLES),
        large: true,
        columns: &[("lower", Type::Vec3), ("upper", Type::Vec3), ("first", Type::Uint), ("count", Type::Uint)],
    },
    TableKind {
        name: "clusters",
        follows: Follows::NODES.and(Follows::LEVELS).and(Follows::TRIANGLES),
        large: true,
        columns: &[
            ("lower", Type::Vec3),
            ("upper", Type::Vec3),
            ("first", Type::Uint),
            ("count", Type::Uint),
            ("node", Type::Uint),
            ("sides", Type::Uint),
        ],
    },
    TableKind {
        name: "emitters",
        follows: Follows::NODES,
        large: false,
        columns: &[
            ("a", Type::Vec3),
            ("b", Type::Vec3),
            ("c", Type::Vec3),
            ("radiance", Type::Vec3),
            ("area", Type::Float),
            ("cumulative", Type::Float),
            ("density", Type::Float),
            ("uva", Type::Vec2),
            ("uvb", Type::Vec2),
            ("uvc", Type::Vec2),
            ("texture", Type::Uint),
            ("emission", Type::Vec3),
        ],
    },
    TableKind {
        name: "environment",
        follows: Follows::NOTHING,
        large: false,
        columns: &[("radiance", Type::Vec3), ("weight", Type::Float)],
    },
    TableKind {
        name: "textures",
        follows: Follows::NOTHING,
        large: false,
        columns: &[
            ("turn", Type::Vec4),
            ("offset", Type::Vec2),
            ("x", Type::Uint),
            ("y", Type::Uint),
            ("layer", Type::Uint),
            ("width", Type::Uint),
            ("height", Type::Uint),
            ("levels", Type::Uint),
            ("flags", Type::Uint),
            ("uv_set", Type::Uint),
        ],
    },
    TableKind {
        name: "vertices",
        follows: Follows::NOTHING,
        large: false,
        columns: &[("second_uv", Type::Vec2), ("color", Type::Vec4), ("tangent", Type::Vec4)],
    },
    TableKind {
        name: MOVED,
        follows: Follows::MOTION,
        large: false,
        columns: &[("lower", Type::Vec3), ("upper", Type::Vec3)],
    },
];

/// A table of [`TABLES`].
#[derive(Debug, Clone, Copy)]
pub struct TableKind {
    pub name: &'static str,
    pub follows: Follows,
    /// It is large, so what it follows from tells it apart in place of its rows.
    pub large: bool,
    pub columns: &'static [(&'static str, Type)],
}

/// The table of what moved since the last frame.
pub const MOVED: &str = "moved";

/// The column of `nodes` that says where each was in the last frame.
pub(crate) const PREVIOUS_TRANSFORM: &str = "previous_transform";

/// The table of this name.
pub fn table(name: &str) -> Option<&'static TableKind> {
    TABLES.iter().find(|t| t.name == name)
}

/// The column of a table, and the only thing in a buffer, that says what a member sees: world to clip space.
pub const FRUSTUM: &str = "view_projection";

/// Tables whose rows hold a frustum.
pub fn frustum_tables() -> impl Iterator<Item = &'static str> {
    let holds = |t: &&TableKind| t.columns.iter().any(|(name, _)| *name == FRUSTUM);
    TABLES.iter().filter(holds).map(|t| t.name)
}

/// What a table's rows follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Follows(u8);

impl Follows {
    pub const NOTHING: Follows = Follows(0);
    /// Where nodes are.
    pub const NODES: Follows = Follows(1);
    /// Where lights are.
    pub const LIGHTS: Follows = Follows(2);
    /// Which simplified triangles the plan draws.
    pub const LEVELS: Follows = Follows(4);
    /// What moved since the last frame.
    pub const MOTION: Follows = Follows(8);
    /// The triangles of its files.
    pub const TRIANGLES: Follows = Follows(16);

    pub const fn and(self, other: Follows) -> Follows {
        Follows(self.0 | other.0)
    }

    pub const fn contains(self, other: Follows) -> bool {
        self.0 & other.0 == other.0
    }

    pub const fn meets(self, other: Follows) -> bool {
        self.0 & other.0 != 0
    }
}

/// The facts every scene states, for conditions, sizes and uniforms. `environment` is the edge of the finest square of
/// the table of that name, 0 for a scene in the dark. Materials with textures of a kind are `finish_textures`,
/// `normal_textures` and `emission_textures`; `smooth_materials` are shaded by other normals than their triangles',
/// `masked_materials` have holes or let most light through, `clear_materials` blend or let light through,
/// `faced_materials` state what their face does. `colored_vertices` and `second_uvs` are 0 where no vertex has any.
/// `max_shininess` is the largest exponent of those with a Phong lobe, 0 without; `max_albedo` is the largest share of
/// light that a material without a texture reflects. `bounds_*` enclose all geometry over all its motion;
/// `grid_*` are the scene file's probe bounds, or `bounds_*`.
pub const FACTS: &[(&str, Type)] = &[
    ("lights", Type::Uint),
    ("point_lights", Type::Uint),
    ("spot_lights", Type::Uint),
    ("directional_lights", Type::Uint),
    ("light_views", Type::Uint),
    ("environment", Type::Uint),
    ("emitters", Type::Uint),
    ("materials", Type::Uint),
    ("emissive_materials", Type::Uint),
    ("specular_materials", Type::Uint),
    ("max_shininess", Type::Float),
    ("max_albedo", Type::Float),
    ("metallic_materials", Type::Uint),
    ("textured_materials", Type::Uint),
    ("finish_textures", Type::Uint),
    ("normal_textures", Type::Uint),
    ("smooth_materials", Type::Uint),
    ("emission_textures", Type::Uint),
    ("masked_materials", Type::Uint),
    ("clear_materials", Type::Uint),
    ("unlit_materials", Type::Uint),
    ("faced_materials", Type::Uint),
    ("coated_materials", Type::Uint),
    ("colored_vertices", Type::Uint),
    ("second_uvs", Type::Uint),
    ("double_sided_materials", Type::Uint),
    ("nodes", Type::Uint),
    ("moving_nodes", Type::Uint),
    ("triangles", Type::Uint),
    ("vertices", Type::Uint),
    ("clusters", Type::Uint),
    ("one_sided_clusters", Type::Uint),
    ("bounds_min", Type::Vec3),
    ("bounds_max", Type::Vec3),
    ("grid_min", Type::Vec3),
    ("grid_max", Type::Vec3),
];
