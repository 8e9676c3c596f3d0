//! Where things are, and from where they are seen; in the coordinates of the scene's file.

use glam::Vec3;
use lightgraph::internals::scene::{self, Extent, Lens};
use lightgraph::{Checked, Diagnostic, Scene, Session, View};

/// Eye, target, up; whole vertical angle in degrees, or half the height in metres and `true`; near; far; lens shift.
pub type CameraTuple = ([f32; 3], [f32; 3], [f32; 3], (f32, bool), Option<f32>, Option<f32>, [f32; 2]);

/// How a thing is moved.
pub enum Movement {
    By(Vec3),
    To(Vec3),
}

/// Nodes and lights of a name: a node takes along the lights that hang from it.
fn named(scene: &Scene, name: &str) -> Checked<(Option<usize>, Vec<usize>)> {
    let node = scene.nodes.iter().position(|n| n.name == name);
    let hangs = |at: usize| {
        std::iter::successors(Some(at), |at| scene.nodes.get(*at).and_then(|n| n.parent)).any(|at| Some(at) == node)
    };
    let lights = scene.lights.iter().enumerate().filter(|(_, l)| match node {
        Some(_) => hangs(l.node),
        None => l.name == name,
    });
    let lights: Vec<usize> = lights.map(|(i, _)| i).collect();
    if node.is_some() || !lights.is_empty() {
        return Ok((node, lights));
    }
    let known = || scene.nodes.iter().map(|n| n.name.as_str()).chain(scene.lights.iter().map(|l| l.name.as_str()));
    let d = Diagnostic::error(format!("{}: there is no node or light \"{name}\"", scene.name)).nearest(name, known());
    let mut names: Vec<&str> = known().collect();
    names.sort_unstable();
    names.dedup();
    names.truncate(20);
    Err(d.help(format!("it has {}", names.join(", "))).into())
}

/// Moves a thing, from the next frame on.
pub fn shift(session: &mut Session, name: &str, step: Movement, time: f32) -> Checked<()> {
    let by = match step {
        Movement::By(by) => by,
        Movement::To(to) => to - Vec3::from(position(session, name, time)?),
    };
    if !by.is_finite() {
        let d = Diagnostic::error(format!("\"{name}\" can't be moved by {by}"));
        return Err(d.help("give finite numbers, in metres").into());
    }
    let (node, lights) = named(&session.scene, name)?;
    let add = |all: &mut Vec<(usize, Vec3)>, at: usize| match all.iter_mut().find(|(i, _)| *i == at) {
        Some((_, sum)) => *sum += by,
        None => all.push((at, by)),
    };
    if let Some(node) = node {
        add(&mut session.shift.nodes, node);
    }
    for light in lights {
        add(&mut session.shift.single_lights, light);
    }
    Ok(())
}

/// Puts nodes where matrices, column by column, say: node to world. All of them or, after a fault, none.
pub fn place(session: &mut Session, all: &[(String, [f32; 16])]) -> Checked<()> {
    let all = all.iter().map(|(name, matrix)| (name.as_str(), *matrix));
    session.shift.places = session.scene.placed(session.shift.places.clone(), all)?;
    Ok(())
}

/// Where a thing is.
pub fn position(session: &Session, name: &str, time: f32) -> Checked<[f32; 3]> {
    let scene = &session.scene;
    let (node, lights) = named(scene, name)?;
    let pose = scene.pose_shifted(time, &session.shift);
    let light = || Some(pose.lights.get(*lights.first()?)?.position);
    let node = node.and_then(|i| Some(pose.nodes.get(i)?.w_axis.truncate()));
    Ok((node.or_else(light).unwrap_or_default() + scene.origin).to_array())
}

/// Sees through a camera of the scene.
pub fn look_through(session: &mut Session, camera: Option<String>) -> Checked<()> {
    if let Some(name) = &camera {
        session.scene.find_camera(name)?;
    }
    session.settings.camera = camera;
    session.shift.view = None;
    Ok(())
}

/// Sees from a place of its own.
pub fn look(session: &mut Session, (eye, target, up, (extent, flat), near, far, shift): &CameraTuple) -> Checked<()> {
    let [eye, target, up] = [*eye, *target, *up].map(Vec3::from);
    let extent = if *flat { Extent::Flat(*extent) } else { Extent::Angle(*extent) };
    let look = scene::Look { eye, target, up, extent, near: *near, far: *far, shift: (*shift).into() };
    session.shift.view = Some(session.scene.look(look)?);
    Ok(())
}

/// What is seen at a time.
pub fn seen(session: &Session, time: f32) -> Checked<CameraTuple> {
    let scene = &session.scene;
    let pose = scene.pose_shifted(time, &session.shift);
    let [width, height] = session.settings.size;
    let (View { place, lens, shift }, _) =
        scene.view(&pose, session.settings.camera.as_deref(), width as f32 / height as f32)?;
    let eye = place.position + scene.origin;
    let (extent, near, far) = match lens {
        Lens::Perspective { yfov, near, far } => ((yfov.to_degrees(), false), near, far),
        Lens::Orthographic { ymag, near, far } => ((ymag, true), near, Some(far)),
    };
    Ok((
        eye.to_array(),
        (eye + place.forward).to_array(),
        place.up.to_array(),
        extent,
        Some(near),
        far,
        shift.to_array(),
    ))
}
