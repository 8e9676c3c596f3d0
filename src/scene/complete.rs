//! What a scene gets besides its glTF: what a scene RON and a command add, and what is made up where there is no light
//! or no camera.

use super::{
    added::{AddedCamera, AddedEnvironment, AddedLight, Additions, DEFAULT_LUX, DEFAULT_SKY, DEFAULT_SUN},
    description::{Description, Located},
    model::{Bounds, Material, Scene},
    names::TakenNames,
    room::{Stand, is_inside_out, other_side, stand},
};
use crate::diag::Diagnostic;
use std::{path::PathBuf, sync::Arc};

/// Vertical angle of the camera made up inside of a room, in degrees: rooms want a wide one.
const ROOM_FOV: f32 = 60.0;
/// That of one outside.
const OUTSIDE_FOV: f32 = 50.0;

/// Mean radiance of all surfaces below which what they give is no light to see others by: a white one in the sun that
/// is made up has 1.
const FAINT: f32 = 0.04;

/// Adds the lights and cameras of a scene RON, at nodes of their names.
pub(super) fn add_described(scene: &mut Scene, description: &Description, shown: &str, faults: &mut Vec<Diagnostic>) {
    let all = bounds(scene);
    let mut names = TakenNames::of(scene.nodes.iter().map(|n| n.name.as_str()));
    let mut free = |name: &Located<String>| {
        let taken = !names.take(&name.value);
        if taken {
            let d = Diagnostic::error(format!("{shown} has a node called \"{}\" already", name.value));
            faults.push(d.at(&name.span, "").help("give the light or camera a name of its own"));
        }
        !taken
    };
    for (name, light) in &description.lights {
        if free(name) {
            scene.add_light(&name.value, light);
        }
    }
    for (name, camera) in &description.cameras {
        if free(name) {
            scene.add_camera(&name.value, camera, all);
        }
    }
    if scene.default_camera.is_none() && !scene.cameras.is_empty() {
        scene.default_camera = Some(0);
    }
}

/// Adds what a command adds. Its names give way to those that are there.
pub(super) fn add_given(scene: &mut Scene, additions: &Additions) {
    let all = bounds(scene);
    let mut names = TakenNames::of(scene.nodes.iter().map(|n| n.name.as_str()));
    for (name, light) in &additions.lights {
        let name = names.take_numbered(name.clone());
        scene.add_light(&name, light);
    }
    for (name, camera) in &additions.cameras {
        let name = names.take_numbered(name.clone());
        scene.add_camera(&name, camera, all);
        // What a command asks for is what it wants to see.
        scene.default_camera = Some(scene.cameras.len() - 1);
    }
}

/// The environment that a command or else the scene RON gives; with the sun of the scene as it is now.
pub(super) fn add_environment(
    scene: &mut Scene,
    described: Option<&Located<AddedEnvironment>>,
    given: Option<&AddedEnvironment>,
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) {
    let (wanted, span) = match (given, described) {
        (Some(given), _) => (given, None),
        (None, Some(described)) => (&described.value, Some(&described.span)),
        (None, None) => return,
    };
    match wanted.made(scene.sun()) {
        Ok((environment, file)) => {
            scene.environment = Some(environment);
            files.extend(file);
        }
        Err(why) => {
            let d = Diagnostic::error(format!("environment: {why}"));
            faults.push(match span {
                Some(span) => d.at(span, ""),
                None => d,
            });
        }
    }
}

/// Makes up light for a scene without, unless `dark`, and a camera for a room without, if `sought`; says so.
pub(super) fn make_up(scene: &mut Scene, shown: &str, dark: bool, sought: bool, faults: &mut Vec<Diagnostic>) {
    let unlit = scene.lights.is_empty() && scene.environment.is_none();
    let glow = if unlit && scene.materials.iter().any(Material::emits) { scene.mean_emission() } else { 0.0 };
    let unlit = unlit && glow < FAINT;
    let camera = sought && scene.cameras.is_empty();
    let room = (unlit && !dark || camera).then(|| stand(scene)).flatten();
    // In a room a small lamp is enough; elsewhere what glows a little shows nothing but itself.
    let light = unlit && (glow == 0.0 || room.is_none() && !dark);
    if let Some(Stand { eye, forward, .. }) = room
        && camera
    {
        let look_at = Some((eye + forward).to_array());
        let inside = AddedCamera { at: eye.to_array(), look_at, fov: ROOM_FOV };
        scene.add_camera("inside", &inside, bounds(scene));
        scene.default_camera = Some(0);
        let d =
            Diagnostic::note(format!("{shown}: the scene has no camera; it is a room, and one stands inside of it"));
        faults.push(d.help("add a camera to the glTF or the scene RON, or use --camera-at and --look-at"));
    }
    if camera && room.is_none() && is_inside_out(scene) {
        Arc::make_mut(&mut scene.geometry).flip();
        let d = Diagnostic::warning(format!(
            "{shown}: the scene shows backs from all around; its triangles are flipped, for it was inside out"
        ));
        faults.push(d.help("turn its normals outwards where it was made (in Blender: Mesh > Normals > Recalculate)"));
    }
    if camera
        && room.is_none()
        && let Some(side) = other_side(scene)
    {
        let all = bounds(scene);
        let away = 0.5 * all.diagonal() / (0.5 * OUTSIDE_FOV.to_radians()).sin();
        let at = (all.center() + side.normalize() * away).to_array();
        let outside = AddedCamera { at, look_at: Some(all.center().to_array()), fov: OUTSIDE_FOV };
        scene.add_camera("outside", &outside, all);
        scene.default_camera = Some(0);
        let d = Diagnostic::note(format!(
            "{shown}: the scene has no camera; from +Z only backs would show, and one stands where fronts do"
        ));
        faults.push(d.help("add a camera to the glTF or the scene RON, or use --camera-at and --look-at"));
    }
    if !light {
        return;
    }
    if dark {
        let d = Diagnostic::note(format!("{shown}: the scene has no light; everything will be black"));
        faults.push(
            d.help("add a light (KHR_lights_punctual) or an emissive material, or use --sun, --light or --environment"),
        );
        return;
    }
    let what = match room.filter(|room| room.closed) {
        Some(Stand { lamp, reach, .. }) => {
            // As bright as the sun, on average over the walls.
            let candela = DEFAULT_LUX * reach * reach;
            let light = AddedLight::Point { at: lamp.to_array(), candela, color: [1.0; 3], range: None };
            scene.add_light("default lamp", &light);
            format!("it is a closed room, and a lamp of {candela:.1} cd is put into it")
        }
        None => {
            scene.add_light("default sun", &DEFAULT_SUN);
            if let Ok((sky, _)) = DEFAULT_SKY.made(scene.sun()) {
                scene.environment = Some(sky);
            }
            let AddedLight::Sun { azimuth, elevation, lux, .. } = DEFAULT_SUN else { return };
            format!("a sun of {lux} lx (azimuth {azimuth}°, {elevation}° high) and a clear sky are put over it")
        }
    };
    let but = if glow > 0.0 { " but the faint glow of some materials" } else { "" };
    let d = Diagnostic::note(format!("{shown}: the scene has no light{but}; {what}"));
    faults.push(
        d.help("choose it with --sun, --light or --environment, in a scene RON or in the glTF (KHR_lights_punctual); --no-default-light leaves it black"),
    );
}

/// The box round everything at time 0, before anything is known of motion.
fn bounds(scene: &Scene) -> Bounds {
    let nodes = scene.pose(0.0).nodes;
    let vertices = scene.geometry.vertices.iter();
    Bounds::of(vertices.map(|v| nodes[v.node as usize].transform_point3(v.position.into())))
}
