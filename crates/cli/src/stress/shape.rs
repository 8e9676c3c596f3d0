//! The scenes of cases: rooms, spheres and what goes wrong in them, by a few words of data.

use super::build::{GltfBuilder, MeshBuilder, ScenePlacement};
use super::number::{CaseNames, Formula, vector};
use glam::{DQuat, DVec3};
use lightgraph::internals::scene::Loaded;
use lightgraph::{Checked, Scene};
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// x, y, z in metres.
type Point = (f64, f64, f64);

/// What is in a scene.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) enum SceneShape {
    /// A closed room round (0, 1, 0), facing inward; its camera is called `inside`.
    Room(Box<Room>),
    /// Two sealed rooms of 2 m beside each other with a wall of this thickness between them (metres), a lamp of 1.5 cd
    /// in the left one; cameras `lit` and `dark`.
    Rooms { wall: Formula, albedo: Formula },
    /// A sphere of 1 m round the origin, facing inward, with a point light in its middle; its camera is called
    /// `inside`.
    Sphere { albedo: Formula, intensity: Formula, cuts: u32 },
    /// Another, moved.
    Placed {
        of: Box<SceneShape>,
        #[serde(default)]
        translation: (Formula, Formula, Formula),
        /// Axis and degrees.
        #[serde(default)]
        turn: (f64, f64, f64, f64),
        #[serde(default = "one")]
        scale: Formula,
    },
    /// A file, relative to that of the cases.
    File(PathBuf),
}

/// A closed box.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Room {
    /// Along x, y, z, metres.
    #[serde(default = "usual_size")]
    pub size: (Formula, Formula, Formula),
    /// Of all walls, or of each (−x +x −y +y −z +z).
    pub albedo: Vec<Formula>,
    /// Radiance; a formula may use `albedo` and `specular`, those of the wall.
    #[serde(default)]
    pub emission: Formula,
    /// Phong strength and exponent of the walls.
    #[serde(default)]
    pub specular: Formula,
    #[serde(default = "one")]
    pub shininess: Formula,
    #[serde(default)]
    pub lights: Vec<LightShape>,
    /// Corners of a solid block in it, as white as the first wall.
    #[serde(default)]
    pub block: Option<(Point, Point)>,
    /// Radiance of a patch of a square centimetre and its place, facing down.
    #[serde(default)]
    pub hot: Option<(Formula, Point)>,
    #[serde(default)]
    pub odd: Vec<Odd>,
    #[serde(default = "usual_eye")]
    pub eye: (f64, f64, f64),
    #[serde(default = "usual_target")]
    pub target: (f64, f64, f64),
}

/// A light in the scene's own units.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightShape {
    #[serde(default)]
    pub kind: Kind,
    pub at: (Formula, Formula, Formula),
    #[serde(default)]
    pub to: (Formula, Formula, Formula),
    /// Candela or lux.
    pub intensity: Formula,
    /// Of a spot's cone, radians.
    #[serde(default)]
    pub inner: Formula,
    #[serde(default = "one")]
    pub outer: Formula,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
pub(super) enum Kind {
    #[default]
    Point,
    Spot,
    Directional,
}

/// Geometry that exporters write now and then.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) enum Odd {
    /// A needle and a point among the triangles of a sheet.
    NoArea,
    /// Normals of no length.
    ZeroNormals,
    /// Normals that are no numbers.
    BadNormals,
    /// A sheet in the plane of a wall, facing as it does.
    SecondWall,
    /// Two sheets in one plane, facing each other.
    DoubleSheet,
    /// A block under a mirroring transform.
    Mirrored,
    /// A ball scaled to 1 : 100 : 10.
    Squeezed,
    /// A single triangle.
    Triangle,
    /// A sheet of 10⁶ triangles.
    Million,
}

fn one() -> Formula {
    Formula::Value(1.0)
}

fn usual_size() -> (Formula, Formula, Formula) {
    (Formula::Value(2.0), Formula::Value(2.0), Formula::Value(3.0))
}

fn usual_eye() -> (f64, f64, f64) {
    (0.6, 1.3, 1.2)
}

fn usual_target() -> (f64, f64, f64) {
    (-0.2, 0.9, -1.0)
}

/// A scene's bytes as a GLB, and the text of its scene RON.
pub(super) type SceneBytes = (Vec<u8>, Option<String>);

impl SceneShape {
    /// The scene, read as every file is.
    ///
    /// # Errors
    /// Formulas that can't be computed, and whatever the loader refuses.
    pub fn load(&self, names: &CaseNames, folder: &Path) -> Checked<Loaded> {
        match self {
            SceneShape::File(path) => Scene::load(&folder.join(path)),
            _ => {
                let (bytes, description) = self.bytes(names)?;
                Scene::from_bytes(&bytes, "case", description.as_deref())
            }
        }
    }

    /// The scene's files, for all but [`Shape::File`].
    ///
    /// # Errors
    /// Formulas that can't be computed.
    pub fn bytes(&self, names: &CaseNames) -> Checked<SceneBytes> {
        self.placed(names, None)
    }

    fn placed(&self, names: &CaseNames, placing: Option<ScenePlacement>) -> Checked<SceneBytes> {
        let unit = placing.map_or(1.0, |p| p.scale);
        let document = match self {
            SceneShape::Room(room) => room.document(names, unit)?,
            SceneShape::Rooms { wall, albedo } => rooms(wall.value(names)?, albedo.value(names)?, unit),
            SceneShape::Sphere { albedo, intensity, cuts } => {
                let mut d = GltfBuilder::default();
                let material = d.material(albedo.value(names)?, 0.0, None);
                d.mesh(&MeshBuilder::sphere(1.0, *cuts).inside_out(), material, json!({}));
                let candela = intensity.value(names)? * unit * unit;
                d.light(json!({"type": "point", "intensity": candela}), DVec3::ZERO, DVec3::NEG_Y);
                d.camera("inside", DVec3::new(0.3, 0.1, 0.2), DVec3::new(-1.0, -0.3, -0.5), unit);
                d
            }
            SceneShape::Placed { of, translation, turn, scale } => {
                let axis = DVec3::new(turn.0, turn.1, turn.2).try_normalize().unwrap_or(DVec3::Y);
                let turn = DQuat::from_axis_angle(axis, turn.3.to_radians());
                let placing =
                    ScenePlacement { translation: vector(translation, names)?, turn, scale: scale.value(names)? };
                return of.placed(names, Some(placing));
            }
            SceneShape::File(_) => GltfBuilder::default(),
        };
        Ok(document.finish(placing))
    }
}

impl Room {
    fn document(&self, names: &CaseNames, unit: f64) -> Checked<GltfBuilder> {
        let mut d = GltfBuilder::default();
        let size = vector(&self.size, names)?;
        let (low, high) =
            (DVec3::new(-size.x / 2.0, 0.0, -size.z / 2.0), DVec3::new(size.x / 2.0, size.y, size.z / 2.0));
        let specular = self.specular.value(names)?;
        let gloss = (specular > 0.0).then_some((specular, self.shininess.value(names)?));
        let walls = MeshBuilder::sides(low, high).map(MeshBuilder::inside_out);
        let mut first = None;
        if let [albedo] = self.albedo.as_slice() {
            let material = self.wall(&mut d, albedo.value(names)?, specular, gloss, names)?;
            first = Some(material);
            let mut all = MeshBuilder::default();
            walls.iter().for_each(|w| all.add(w));
            d.mesh(&all, material, json!({}));
        } else {
            for (wall, albedo) in walls.iter().zip(self.albedo.iter().cycle()) {
                let material = self.wall(&mut d, albedo.value(names)?, specular, gloss, names)?;
                first = first.or(Some(material));
                d.mesh(wall, material, json!({}));
            }
        }
        let first = first.unwrap_or(0);
        if let Some((a, b)) = self.block {
            let mut block = MeshBuilder::default();
            MeshBuilder::sides(a.into(), b.into()).iter().for_each(|s| block.add(s));
            d.mesh(&block, first, json!({}));
        }
        if let Some((radiance, at)) = &self.hot {
            let material = d.material(0.0, radiance.value(names)?, None);
            let at = DVec3::from(*at);
            let corner = |x: f64, z: f64| at + DVec3::new(x, 0.0, z) * 0.005;
            let mut patch = MeshBuilder::default();
            patch.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
            d.mesh(&patch, material, json!({}));
        }
        for odd in &self.odd {
            odd.add(&mut d, first, low, high);
        }
        for light in &self.lights {
            light.add(&mut d, names, unit)?;
        }
        d.camera("inside", self.eye.into(), self.target.into(), unit);
        Ok(d)
    }

    fn wall(
        &self,
        d: &mut GltfBuilder,
        albedo: f64,
        specular: f64,
        gloss: Option<(f64, f64)>,
        names: &CaseNames,
    ) -> Checked<usize> {
        let mut own = names.clone();
        own.insert("albedo".into(), albedo.to_string());
        own.insert("specular".into(), specular.to_string());
        Ok(d.material(albedo, self.emission.value(&own)?, gloss))
    }
}

impl LightShape {
    fn add(&self, d: &mut GltfBuilder, names: &CaseNames, unit: f64) -> Checked<()> {
        let intensity = self.intensity.value(names)?;
        // Candela grow with the square of a length, so that a larger scene looks the same.
        let light = match self.kind {
            Kind::Point => json!({"type": "point", "intensity": intensity * unit * unit}),
            Kind::Directional => json!({"type": "directional", "intensity": intensity}),
            Kind::Spot => {
                let cone =
                    json!({"innerConeAngle": self.inner.value(names)?, "outerConeAngle": self.outer.value(names)?});
                json!({"type": "spot", "intensity": intensity * unit * unit, "spot": cone})
            }
        };
        d.light(light, vector(&self.at, names)?, vector(&self.to, names)?);
        Ok(())
    }
}

impl Odd {
    fn add(self, d: &mut GltfBuilder, material: usize, low: DVec3, high: DVec3) {
        let middle = (low + high) / 2.0;
        let mut sheet = MeshBuilder::field(4, 0.5);
        let at = |p: DVec3| json!({"translation": p.to_array()});
        match self {
            Odd::NoArea => {
                let last = sheet.positions.len() as u32 - 1;
                sheet.indices.extend([0, 0, last, 1, 1, 1, 0, 1, 2]);
                d.mesh(&sheet, material, at(middle));
            }
            Odd::ZeroNormals => {
                sheet.normals.iter_mut().for_each(|n| *n = [0.0; 3]);
                d.mesh(&sheet, material, at(middle));
            }
            Odd::BadNormals => {
                sheet.normals.iter_mut().for_each(|n| *n = [f32::NAN; 3]);
                d.mesh(&sheet, material, at(middle));
            }
            Odd::SecondWall => d.mesh(&sheet, material, at(DVec3::new(0.0, low.y, 0.0))),
            Odd::DoubleSheet => {
                d.mesh(&sheet, material, at(middle));
                d.mesh(&sheet.inside_out(), material, at(middle));
            }
            Odd::Mirrored => {
                let mut block = MeshBuilder::default();
                MeshBuilder::sides(DVec3::splat(-0.2), DVec3::splat(0.2)).iter().for_each(|s| block.add(s));
                d.mesh(&block, material, json!({"translation": middle.to_array(), "scale": [-1, 1, 1]}));
            }
            Odd::Squeezed => {
                let ball = MeshBuilder::sphere(0.4, 2);
                d.mesh(&ball, material, json!({"translation": middle.to_array(), "scale": [0.01, 1.0, 0.1]}));
            }
            Odd::Triangle => {
                sheet.indices.truncate(3);
                d.mesh(&sheet, material, at(middle));
            }
            Odd::Million => d.mesh(&MeshBuilder::field(708, 0.5), material, at(middle)),
        }
    }
}

fn rooms(wall: f64, albedo: f64, unit: f64) -> GltfBuilder {
    let mut d = GltfBuilder::default();
    let material = d.material(albedo, 0.0, None);
    for side in [-1.0, 1.0] {
        let (near, far) = (side * wall / 2.0, side * (wall / 2.0 + 2.0));
        let (low, high) = (DVec3::new(near.min(far), 0.0, -1.0), DVec3::new(near.max(far), 2.0, 1.0));
        let mut room = MeshBuilder::default();
        MeshBuilder::sides(low, high).iter().for_each(|s| room.add(s));
        d.mesh(&room.inside_out(), material, json!({}));
    }
    let lamp = json!({"type": "point", "intensity": 1.5 * unit * unit});
    d.light(lamp, DVec3::new(-1.0, 1.7, 0.2), DVec3::ZERO);
    for (name, side) in [("lit", -1.0), ("dark", 1.0)] {
        d.camera(name, DVec3::new(side * 1.8, 1.2, 0.8), DVec3::new(side * 0.4, 0.8, -0.5), unit);
    }
    d
}
