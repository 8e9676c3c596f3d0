//! Lights, cameras and an environment that a scene RON or a command gives a scene, besides what its glTF holds.

use super::{
    environment::Environment,
    geometry::MAX_COORDINATE,
    import::usable,
    model::{Bounds, Camera, Lens, Light, LightKind, Node, Scene},
    panorama,
    sky::{LOWEST_SUN, Sky, TURBIDITY},
};
use glam::{EulerRot, Mat3, Quat, Vec3};
use serde::Deserialize;
use std::{path::PathBuf, sync::Arc};

/// What is added to a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Additions {
    /// By name: of the light, and of the node that it gets.
    pub lights: Vec<(String, AddedLight)>,
    pub cameras: Vec<(String, AddedCamera)>,
    /// In place of the scene RON's.
    pub environment: Option<AddedEnvironment>,
    /// Leave a scene without light black.
    pub no_default_light: bool,
}

/// A light by what a person knows of it. Colours are linear and multiply the strength.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum AddedLight {
    /// From infinitely far. `azimuth` is a compass bearing in degrees: 0 in the north (−Z), 90 in the east (+X);
    /// `elevation` the height above the horizon in degrees; `lux` the illuminance of a surface that faces it.
    Sun {
        azimuth: f32,
        elevation: f32,
        lux: f32,
        #[serde(default = "white")]
        color: [f32; 3],
    },
    /// From a point, the same to all sides. `range` in metres, as glTF has it.
    Point {
        at: [f32; 3],
        candela: f32,
        #[serde(default = "white")]
        color: [f32; 3],
        #[serde(default)]
        range: Option<f32>,
    },
    /// A cone of light. `angle` is the whole angle across in degrees; within `inner` degrees it has its full strength.
    Spot {
        at: [f32; 3],
        look_at: [f32; 3],
        candela: f32,
        angle: f32,
        #[serde(default)]
        inner: f32,
        #[serde(default = "white")]
        color: [f32; 3],
        #[serde(default)]
        range: Option<f32>,
    },
}

/// A camera by where it stands and what it looks at.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AddedCamera {
    pub at: [f32; 3],
    /// Without it, the middle of the scene.
    #[serde(default)]
    pub look_at: Option<[f32; 3]>,
    /// The whole vertical angle in degrees.
    #[serde(default = "usual_fov")]
    pub fov: f32,
}

/// Light from all around.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum AddedEnvironment {
    /// The same radiance from everywhere.
    Constant { radiance: [f32; 3] },
    /// A clear sky (Preetham 1999). Where the sun stands and its strength are those of the scene's first directional
    /// light, where not given.
    Sky {
        #[serde(default)]
        azimuth: Option<f32>,
        #[serde(default)]
        elevation: Option<f32>,
        #[serde(default)]
        sun_lux: Option<f32>,
        #[serde(default = "usual_turbidity")]
        turbidity: f32,
        /// What the ground below the horizon reflects.
        #[serde(default = "usual_ground")]
        ground: [f32; 3],
        #[serde(default = "one")]
        strength: f32,
    },
    /// A panorama, .hdr or .exr, twice as wide as high. Its middle lies in the north (−Z); `rotation` turns it by so
    /// many degrees towards the east.
    File {
        file: PathBuf,
        #[serde(default)]
        rotation: f32,
        #[serde(default = "one")]
        strength: f32,
    },
}

/// The sun of a scene without light: it comes from behind the shoulder of a camera that looks along −Z.
pub(super) const DEFAULT_SUN: AddedLight =
    AddedLight::Sun { azimuth: 145.0, elevation: 45.0, lux: DEFAULT_LUX, color: [1.0, 0.96, 0.9] };

/// The sky that goes with it.
pub(super) const DEFAULT_SKY: AddedEnvironment = AddedEnvironment::Sky {
    azimuth: None,
    elevation: None,
    sun_lux: None,
    turbidity: TURBIDITY_USUAL,
    ground: [0.2; 3],
    strength: 1.0,
};

/// A white surface that faces the default light sends back about 1.
pub(super) const DEFAULT_LUX: f32 = 3.0;

const TURBIDITY_USUAL: f32 = 2.5;

/// Texels along an analytic sky's finest square: it is smooth but near the sun.
const SKY_EDGE: u32 = 256;

/// Least distance that a camera sees, as a share of the scene's size.
const NEAR: f32 = 1e-3;

impl AddedLight {
    /// # Errors
    /// What is wrong with its numbers.
    pub fn check(&self) -> Result<(), String> {
        let (strength, color) = match self {
            AddedLight::Sun { azimuth, elevation, lux, color } => {
                if !azimuth.is_finite() || !(-90.0..=90.0).contains(elevation) {
                    return Err(format!(
                        "a sun at azimuth {azimuth}, elevation {elevation}: write degrees, the elevation from -90 to 90"
                    ));
                }
                (*lux, color)
            }
            AddedLight::Point { at, candela, color, range } => {
                place("at", at)?;
                reach(*range)?;
                (*candela, color)
            }
            AddedLight::Spot { at, look_at, candela, angle, inner, color, range } => {
                place("at", at)?;
                place("look_at", look_at)?;
                reach(*range)?;
                if at == look_at {
                    return Err("`at` and `look_at` are the same place".into());
                }
                if !(0.0 <= *inner && inner <= angle && *angle > 0.0 && *angle <= 180.0) {
                    return Err(format!("cone angles {inner} and {angle} must rise from 0 to 180 degrees"));
                }
                (*candela, color)
            }
        };
        match usable(&[strength]) && usable(color) && usable(&color.map(|c| c * strength)) {
            true => Ok(()),
            false => {
                Err(format!("strength {strength}, colour {color:?} and their product must be finite and not negative"))
            }
        }
    }
}

impl AddedCamera {
    /// # Errors
    /// What is wrong with its numbers.
    pub fn check(&self) -> Result<(), String> {
        place("at", &self.at)?;
        if let Some(look_at) = &self.look_at {
            place("look_at", look_at)?;
            if *look_at == self.at {
                return Err("`at` and `look_at` are the same place".into());
            }
        }
        match self.fov > 0.0 && self.fov < 180.0 {
            true => Ok(()),
            false => Err(format!("a vertical angle of {} degrees: it must lie between 0 and 180", self.fov)),
        }
    }
}

impl AddedEnvironment {
    /// # Errors
    /// What is wrong with its numbers.
    pub fn check(&self) -> Result<(), String> {
        let (sound, numbers) = match self {
            AddedEnvironment::Constant { radiance } => (true, radiance.to_vec()),
            AddedEnvironment::Sky { azimuth, elevation, sun_lux, turbidity, ground, strength } => {
                let [clear, hazy] = TURBIDITY;
                if !(clear..=hazy).contains(turbidity) {
                    return Err(format!(
                        "turbidity {turbidity}: the sky is known from {clear} (clear) to {hazy} (hazy)"
                    ));
                }
                if !elevation.is_none_or(|e| (LOWEST_SUN..=90.0).contains(&e)) {
                    return Err(format!("the sun of a sky stands {LOWEST_SUN} to 90 degrees high"));
                }
                if ground.iter().any(|g| *g > 1.0) {
                    return Err(format!("`ground` {ground:?} reflects more than it gets: write shares from 0 to 1"));
                }
                let sound = azimuth.is_none_or(f32::is_finite);
                (sound, ground.iter().chain([strength]).chain(sun_lux).copied().collect())
            }
            AddedEnvironment::File { rotation, strength, .. } => (rotation.is_finite(), vec![*strength]),
        };
        match sound && usable(&numbers) {
            true => Ok(()),
            false => Err("its numbers must be finite, and its light not negative".into()),
        }
    }

    /// Light by direction, and the file that was read for it. `sun`: direction towards the sun and its illuminance,
    /// where the scene has one.
    ///
    /// # Errors
    /// The file can't be read, or is no panorama.
    pub(super) fn made(&self, sun: Option<(Vec3, f32)>) -> Result<(Environment, Option<PathBuf>), String> {
        match self {
            AddedEnvironment::Constant { radiance } => Ok((Environment::constant(Vec3::from(*radiance)), None)),
            AddedEnvironment::Sky { azimuth, elevation, sun_lux, turbidity, ground, strength } => {
                let (towards, lux) = sun.unwrap_or((Vec3::Y, DEFAULT_LUX));
                let known = sun.map(|_| (towards.x.atan2(-towards.z), towards.y.clamp(-1.0, 1.0).asin()));
                let azimuth = azimuth.map(f32::to_radians).or(known.map(|k| k.0)).unwrap_or(145_f32.to_radians());
                let elevation = elevation.map(f32::to_radians).or(known.map(|k| k.1)).unwrap_or(45_f32.to_radians());
                let sun = bearing(azimuth, elevation);
                let sky =
                    Sky { sun, sun_lux: sun_lux.unwrap_or(lux), turbidity: *turbidity, ground: Vec3::from(*ground) };
                let model = sky.model();
                Ok((Environment::from_fn(SKY_EDGE, 2, |d| *strength * model.radiance(d)), None))
            }
            AddedEnvironment::File { file, rotation, strength } => {
                let found = panorama::read(file)?.environment(rotation.to_radians(), *strength);
                Ok((found, Some(file.clone())))
            }
        }
    }
}

impl Scene {
    /// Adds a light at a node of its own.
    pub(super) fn add_light(&mut self, name: &str, light: &AddedLight) {
        let (at, forward, kind, strength, color, range, inner, outer) = match *light {
            AddedLight::Sun { azimuth, elevation, lux, color } => {
                let forward = -bearing(azimuth.to_radians(), elevation.to_radians());
                (Vec3::ZERO, forward, LightKind::Directional, lux, color, None, 0.0, 0.0)
            }
            AddedLight::Point { at, candela, color, range } => {
                (at.into(), Vec3::NEG_Z, LightKind::Point, candela, color, range, 0.0, 0.0)
            }
            AddedLight::Spot { at, look_at, candela, angle, inner, color, range } => {
                let half = |degrees: f32| 0.5 * degrees.to_radians();
                let at = Vec3::from(at);
                let forward = (Vec3::from(look_at) - at).normalize_or(Vec3::NEG_Z);
                (at, forward, LightKind::Spot, candela, color, range, half(inner), half(angle))
            }
        };
        let node = self.add_node(name, at, forward);
        let (intensity, range) = (Vec3::from(color) * strength, range.unwrap_or(0.0));
        self.lights.push(Light { name: name.into(), node, kind, intensity, range, inner, outer });
    }

    /// Adds a camera at a node of its own. `all`: where the scene is.
    pub(super) fn add_camera(&mut self, name: &str, camera: &AddedCamera, all: Bounds) {
        let at = Vec3::from(camera.at);
        let target = camera.look_at.map_or(all.center(), Vec3::from);
        let node = self.add_node(name, at, (target - at).normalize_or(Vec3::NEG_Z));
        let near = (all.diagonal() * NEAR).max(1e-5);
        let lens = Lens::Perspective { yfov: camera.fov.to_radians(), near, far: None };
        self.cameras.push(Camera { name: name.into(), alias: None, node, lens });
    }

    fn add_node(&mut self, name: &str, translation: Vec3, forward: Vec3) -> usize {
        // Turned about the vertical, then tilted: what is level stays so.
        let turn = (-forward.x).atan2(-forward.z);
        let tilt = forward.y.clamp(-1.0, 1.0).asin();
        let linear = Mat3::from_quat(Quat::from_euler(EulerRot::YXZ, turn, tilt, 0.0));
        // The rows of vertices come after those of nodes.
        if let Some(first) = Arc::make_mut(&mut self.geometry).owners.shift() {
            Arc::make_mut(&mut self.geometry).vertices.iter_mut().filter(|v| v.node >= first).for_each(|v| v.node += 1);
        }
        self.nodes.push(Node { name: name.into(), parent: None, translation, linear, motion: vec![], animation: None });
        self.nodes.len() - 1
    }

    /// Direction towards the first directional light, and its illuminance.
    pub(super) fn sun(&self) -> Option<(Vec3, f32)> {
        let i = self.lights.iter().position(|l| l.kind == LightKind::Directional)?;
        let towards = -self.pose(0.0).lights.get(i)?.direction;
        Some((towards, self.lights[i].intensity.dot(Vec3::new(0.2126, 0.7152, 0.0722))))
    }
}

/// Unit direction of a compass bearing and a height, in radians.
fn bearing(azimuth: f32, elevation: f32) -> Vec3 {
    let (up, flat) = elevation.sin_cos();
    Vec3::new(flat * azimuth.sin(), up, -flat * azimuth.cos())
}

fn place(what: &str, p: &[f32; 3]) -> Result<(), String> {
    match p.iter().all(|x| x.abs() <= MAX_COORDINATE) {
        true => Ok(()),
        false => Err(format!("`{what}` {p:?} is no usable place")),
    }
}

fn reach(range: Option<f32>) -> Result<(), String> {
    match range.is_none_or(|r| r > 0.0 && r.is_finite()) {
        true => Ok(()),
        false => Err(format!("range {} must be a positive number", range.unwrap_or(0.0))),
    }
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

fn one() -> f32 {
    1.0
}

fn usual_fov() -> f32 {
    50.0
}

fn usual_turbidity() -> f32 {
    TURBIDITY_USUAL
}

fn usual_ground() -> [f32; 3] {
    [0.2; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_is_no_stronger_than_a_number_says() {
        let light = |candela| AddedLight::Point { at: [0.0; 3], candela, color: [100.0, 0.0, 0.0], range: None };
        assert_eq!(light(1e36).check(), Ok(()));
        assert!(light(1e38).check().unwrap_err().contains("their product must be finite"));
    }
}
