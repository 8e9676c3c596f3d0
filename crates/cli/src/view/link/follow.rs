//! From messages to what there is to show. A message that can't be followed changes nothing.

use super::Linked;
use super::message::{self, LinkCamera, LinkMessage, SceneHead, Transport};
use glam::{Vec2, Vec3};
use lightgraph::internals::diag::{render, tame};
use lightgraph::internals::scene::{Environment, Extent, Look};
use lightgraph::{Checked, Diagnostic, Image, Scene};
use std::sync::Arc;

/// Bytes of a node's place: 16 f32.
const PLACE: usize = 64;

/// Bytes of a panorama's pixel: three f32.
const PIXEL: usize = 12;

/// Follows one program.
pub struct Follower {
    linked: Linked,
    /// What was last looked at: where it is in a scene is known with the scene.
    look: Option<Look>,
}

impl Follower {
    pub fn new(linked: Linked) -> Follower {
        Follower { linked, look: None }
    }

    /// Takes messages until the other side ends, or says what can't be read. `publish` is called after each; false
    /// ends it.
    pub fn follow(mut self, wire: &mut impl Transport, mut publish: impl FnMut(&Linked) -> bool) {
        let broken = loop {
            let (header, body) = match message::frame(wire) {
                Ok(Some(frame)) => frame,
                Ok(None) => break None,
                Err(d) => break Some(d),
            };
            let taken = message::parsed(&header).map_err(Into::into).and_then(|message| self.take(message, &body));
            self.linked.faults = taken.err().map_or(vec![], |faults| faults.0);
            if !publish(&self.linked) || answer(wire, &self.linked.faults).is_err() {
                break None;
            }
        };
        self.linked.program = None;
        self.linked.faults = Vec::from_iter(broken);
        if publish(&self.linked) && !self.linked.faults.is_empty() {
            // It may be gone already.
            let _ = answer(wire, &self.linked.faults);
        }
    }

    fn take(&mut self, message: LinkMessage, body: &[u8]) -> Checked<()> {
        match message {
            LinkMessage::Hello(_) => Err(Diagnostic::error("link: `hello` is said once").into()),
            LinkMessage::Scene(head) => self.scene(head, body),
            LinkMessage::Place { nodes } => self.place(&nodes, body),
            LinkMessage::Camera(camera) => self.camera(&camera, body),
        }
    }

    fn scene(&mut self, head: SceneHead, body: &[u8]) -> Checked<()> {
        let [width, height] = head.panorama.unwrap_or_default();
        let pixels = (width as usize).checked_mul(height as usize).and_then(|n| n.checked_mul(PIXEL));
        let Some((gltf, panorama)) = pixels.and_then(|n| body.split_at_checked(body.len().checked_sub(n)?)) else {
            let size = body.len();
            let d =
                Diagnostic::error(format!("link: a panorama of {width}×{height} is more than the {size} bytes sent"));
            return Err(d.help("send the glTF, then three f32 for each pixel").into());
        };
        let loaded = Scene::from_bytes(gltf, &tame(&head.name, 60), None)?;
        let mut scene = loaded.scene;
        if head.panorama.is_some() {
            let image = Image::new(width, height, 3, floats(panorama).collect())?;
            scene.environment = Some(Environment::panorama(&image)?);
        } else if let Some(radiance) = head.radiance {
            let radiance = Vec3::from(radiance);
            if !radiance.is_finite() || radiance.min_element() < 0.0 {
                let d = Diagnostic::error(format!("link: light of {radiance} from all around"));
                return Err(d.help("radiance is finite and not negative").into());
            }
            scene.environment = Some(Environment::constant(radiance));
        }
        self.linked.view = self.look.map(|look| scene.look(look)).transpose()?;
        self.linked.scene = Some(Arc::new(scene));
        self.linked.notices = Arc::new(loaded.notices);
        self.linked.places.clear();
        Ok(())
    }

    fn place(&mut self, nodes: &[String], body: &[u8]) -> Checked<()> {
        let Some(scene) = &self.linked.scene else {
            return Err(Diagnostic::error("link: `place` came before a `scene`").into());
        };
        if nodes.len().checked_mul(PLACE) != Some(body.len()) {
            let d = Diagnostic::error(format!("link: {} nodes are placed by {} bytes", nodes.len(), body.len()));
            return Err(d.help("send 16 f32 for each node, column by column").into());
        }
        let matrices = body.chunks_exact(PLACE).map(|bytes| {
            let mut matrix = [0.0; 16];
            matrix.iter_mut().zip(floats(bytes)).for_each(|(to, from)| *to = from);
            matrix
        });
        let all = nodes.iter().map(String::as_str).zip(matrices);
        self.linked.places = scene.placed(self.linked.places.clone(), all)?;
        Ok(())
    }

    fn camera(&mut self, camera: &LinkCamera, body: &[u8]) -> Checked<()> {
        if !body.is_empty() {
            let d = Diagnostic::error(format!("link: a camera with {} bytes behind it", body.len()));
            return Err(d.help("a `camera` has a header alone").into());
        }
        let [eye, target, up] = [camera.eye, camera.target, camera.up].map(Vec3::from);
        let extent = camera.height.map_or(Extent::Angle(camera.fov), |height| Extent::Flat(height / 2.0));
        let (near, far, shift) = (camera.near, camera.far, Vec2::from(camera.shift));
        let look = Look { eye, target, up, extent, near, far, shift };
        if let Some(scene) = &self.linked.scene {
            self.linked.view = Some(scene.look(look)?);
        }
        self.look = Some(look);
        Ok(())
    }
}

fn answer(wire: &mut impl Transport, faults: &[Diagnostic]) -> std::io::Result<()> {
    let text = render(faults);
    message::answer(wire, Some(text.trim_end()).filter(|text| !text.is_empty()))
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes))
}
