//! What a glTF attaches to nodes besides meshes: lights and cameras, every number checked.

use super::{
    document::{Document, place},
    import::{Placed, usable},
    light_views::WIDEST_HALF_ANGLE,
    model::{Camera, Lens, Light, LightKind},
    names::{TakenNames, short},
};
use crate::diag::Diagnostic;
use glam::Vec3;
use gltf::json::{
    camera::Type as CameraType,
    extensions::scene::khr_lights_punctual::{Light as RawLight, Type as LightType},
    validation::Checked,
};
use std::f32::consts::{FRAC_PI_2, PI};

/// The lights at the scene's nodes, in their order.
pub(super) fn lights(document: &Document<'_>, placed: &[Placed], faults: &mut Vec<Diagnostic>) -> Vec<Light> {
    let root = &document.root;
    let raw_lights: &[RawLight] = root.as_ref();
    let mut lights = vec![];
    for (row, p) in placed.iter().enumerate().filter(|(_, p)| !p.copy) {
        let extension = root.nodes[p.index].extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(index) = extension.map(|e| e.light.value()) else { continue };
        let at = place("nodes", p.index, Some(&p.node.name));
        let Some(raw) = raw_lights.get(index) else {
            faults.push(document.error(at, format!("there is no light {index}")));
            continue;
        };
        match light(raw, row, p) {
            Ok(light) => {
                if light.outer > WIDEST_HALF_ANGLE {
                    let why = "its spot is too wide for one shadow view: the rim past 85° casts no shadow";
                    faults.push(document.warning(at, why));
                }
                lights.push(light);
            }
            Err(why) => {
                faults.push(document.error(format!("{at}, {}", place("lights", index, raw.name.as_deref())), why));
            }
        }
    }
    lights
}

fn light(raw: &RawLight, row: usize, p: &Placed) -> Result<Light, String> {
    let kind = match raw.type_ {
        Checked::Valid(LightType::Point) => LightKind::Point,
        Checked::Valid(LightType::Spot) => LightKind::Spot,
        Checked::Valid(LightType::Directional) => LightKind::Directional,
        Checked::Invalid => return Err("its type is none of point, spot and directional".into()),
    };
    let intensity = Vec3::from(raw.color) * raw.intensity;
    if !usable(&intensity.to_array()) || raw.intensity < 0.0 {
        return Err(format!("colour × intensity {intensity} must be finite and not negative"));
    }
    if let Some(range) = raw.range
        && !(range > 0.0 && range.is_finite())
    {
        return Err(format!("range {range} must be a positive number"));
    }
    let (inner, outer) = match (kind, &raw.spot) {
        (LightKind::Spot, Some(spot)) => (spot.inner_cone_angle, spot.outer_cone_angle),
        (LightKind::Spot, None) => return Err("it is a spot without its cone (`spot`)".into()),
        (LightKind::Point | LightKind::Directional, _) => (0.0, 0.0),
    };
    // Files round π/2 up as often as down.
    let ordered = 0.0 <= inner && inner <= outer && outer <= FRAC_PI_2 + 1e-3;
    if kind == LightKind::Spot && !(ordered && outer > 0.0) {
        return Err(format!("cone angles {inner} and {outer} must rise from 0 to π/2 radians"));
    }
    if kind != LightKind::Point && forward(p).is_none() {
        return Err("its node is scaled to nothing, so that it has no direction".into());
    }
    Ok(Light {
        name: raw.name.as_deref().map_or_else(|| p.node.name.clone(), |name| short(name).into()),
        node: row,
        kind,
        intensity,
        range: raw.range.unwrap_or(0.0),
        inner,
        outer: outer.min(FRAC_PI_2),
    })
}

/// The cameras at the scene's nodes, in their order.
pub(super) fn cameras(document: &Document<'_>, placed: &[Placed], faults: &mut Vec<Diagnostic>) -> Vec<Camera> {
    let root = &document.root;
    let (mut cameras, mut names) = (vec![], TakenNames::default());
    for (row, p) in placed.iter().enumerate().filter(|(_, p)| !p.copy) {
        let Some(index) = root.nodes[p.index].camera.map(|c| c.value()) else { continue };
        let node_at = place("nodes", p.index, Some(&p.node.name));
        let Some(raw) = root.cameras.get(index) else {
            faults.push(document.error(node_at, format!("there is no camera {index}")));
            continue;
        };
        let lens = lens(raw).and_then(|lens| {
            let across = p.world.x_axis.truncate().cross(p.world.y_axis.truncate());
            forward(p).zip(across.try_normalize()).map(|_| lens).ok_or("its node is scaled to nothing".into())
        });
        match lens {
            Ok(lens) => {
                let own = raw.name.as_deref().map(|name| short(name).to_owned());
                let named = root.nodes[p.index].name.clone();
                let name = named.or_else(|| own.clone()).unwrap_or_else(|| format!("camera {index}"));
                // One camera may stand at several nodes, and nodes may have one name: each is to be reached.
                let name = names.take_numbered(name);
                cameras.push(Camera { alias: own.filter(|own| *own != name), name, node: row, lens });
            }
            Err(why) => faults.push(document.error(place("cameras", index, raw.name.as_deref()), why)),
        }
    }
    cameras
}

fn lens(raw: &gltf::json::Camera) -> Result<Lens, String> {
    let depths = |near: f32, far: f32| near.is_finite() && far.is_finite() && near < far;
    match (&raw.type_, &raw.perspective, &raw.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), _) => {
            if !(p.yfov > 0.0 && p.yfov < PI) {
                return Err(format!("yfov {} must lie between 0 and π radians", p.yfov));
            }
            if !(p.znear > 0.0 && depths(p.znear, p.zfar.unwrap_or(f32::MAX))) {
                return Err(format!("znear {} and zfar {:?} must be positive and in this order", p.znear, p.zfar));
            }
            Ok(Lens::Perspective { yfov: p.yfov, near: p.znear, far: p.zfar })
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
            if !(o.ymag != 0.0 && o.ymag.is_finite()) {
                return Err(format!("ymag {} must be finite and not 0", o.ymag));
            }
            if !(o.znear >= 0.0 && depths(o.znear, o.zfar)) {
                return Err(format!("znear {} and zfar {} must not be negative, and in this order", o.znear, o.zfar));
            }
            Ok(Lens::Orthographic { ymag: o.ymag.abs(), near: o.znear, far: o.zfar })
        }
        (Checked::Valid(kind), ..) => Err(format!("the numbers of its kind, {kind:?}, are missing")),
        (Checked::Invalid, ..) => Err("its type is neither perspective nor orthographic".into()),
    }
}

/// World direction of a node's −Z; `None` where its scale leaves none.
fn forward(p: &Placed) -> Option<Vec3> {
    (-p.world.z_axis.truncate()).try_normalize()
}
