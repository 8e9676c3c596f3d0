//! What the user chose: all that undo takes back, and all that a saved state holds.

use super::link::Linked;
use glam::Vec3;
use lightgraph::internals::diag::Source;
use lightgraph::internals::image::exposure::Exposure;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::ToneMap;
use lightgraph::internals::scene::Shift;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, View};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What is seen, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewChoice {
    pub graph: PathBuf,
    pub scene: PathBuf,
    /// Parameters that were set; they hold for every graph that has them.
    #[serde(default)]
    pub params: Values,
    /// A camera of the scene; `None`: its default.
    #[serde(default)]
    pub camera: Option<String>,
    /// Where the user went from there.
    #[serde(default)]
    pub view: Option<View>,
    /// How far lights were dragged, by index, in metres.
    #[serde(default)]
    pub lights: BTreeMap<usize, Vec3>,
    /// The same for nodes.
    #[serde(default)]
    pub nodes: BTreeMap<usize, Vec3>,
    /// Seconds, for scenes that move.
    #[serde(default)]
    pub time: f32,
    #[serde(default)]
    pub exposure: Exposure,
    #[serde(default)]
    pub tone_map: ToneMap,
    #[serde(default)]
    pub resolution: Resolution,
    #[serde(default)]
    pub compare: Compare,
}

/// How many pixels are rendered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Resolution {
    /// This share of the pixels that the image takes in the window, along each axis.
    Window(f32),
    /// Width and height.
    Fixed([u32; 2]),
}

impl Default for Resolution {
    fn default() -> Resolution {
        Resolution::Window(1.0)
    }
}

impl Resolution {
    /// The pixels to render for an image of `room` pixels in the window; at least one, at most `most` along an axis.
    pub fn size(self, room: [u32; 2], most: u32) -> [u32; 2] {
        let size = match self {
            Resolution::Window(share) => room.map(|n| (n as f32 * share).round() as u32),
            Resolution::Fixed(size) => size,
        };
        size.map(|n| n.clamp(1, most.max(1)))
    }
}

/// A second image, and how the two are shown.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compare {
    pub against: ComparedTo,
    pub layout: SplitLayout,
}

/// What the image is held against.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ComparedTo {
    #[default]
    Nothing,
    /// Another graph, on the same scene from the same place.
    Graph(PathBuf),
    /// An EXR file.
    Image(PathBuf),
}

/// How two images share the window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SplitLayout {
    /// The other one right of this share of the width.
    Split(f32),
    /// How much they differ: blue too dark, red too bright, by this gain.
    Difference(f32),
    /// The other one alone.
    Other,
}

impl Default for SplitLayout {
    fn default() -> SplitLayout {
        SplitLayout::Split(0.5)
    }
}

impl ViewChoice {
    /// A graph on a scene, as both say.
    pub fn new(graph: PathBuf, scene: PathBuf) -> ViewChoice {
        ViewChoice {
            graph,
            scene,
            params: Values::new(),
            camera: None,
            view: None,
            lights: BTreeMap::new(),
            nodes: BTreeMap::new(),
            time: 0.0,
            exposure: Exposure::default(),
            tone_map: ToneMap::default(),
            resolution: Resolution::default(),
            compare: Compare::default(),
        }
    }

    /// Stops to show an image with, where `automatic` suits it.
    pub fn stops(&self, automatic: f32) -> f32 {
        match self.exposure {
            Exposure::Auto => automatic,
            Exposure::Stops(stops) => stops,
        }
    }

    /// How far the scene is from what its file says, or its program, as far as that has not moved it since.
    pub fn shift(&self, linked: Option<&Linked>) -> Shift {
        let moved = |map: &BTreeMap<usize, Vec3>| map.iter().map(|(i, by)| (*i, *by)).collect();
        Shift {
            single_lights: moved(&self.lights),
            nodes: moved(&self.nodes),
            places: linked.map_or_else(BTreeMap::new, |l| l.places.clone()),
            view: self.view.or(linked.and_then(|l| l.view)),
            ..Shift::default()
        }
    }

    /// The scene is another one: what was dragged in the old one has no meaning there.
    pub fn set_scene(&mut self, scene: PathBuf) {
        if self.scene != scene {
            (self.camera, self.view, self.time) = (None, None, 0.0);
            self.lights.clear();
            self.nodes.clear();
            self.scene = scene;
        }
    }

    /// Reads a saved choice.
    ///
    /// # Errors
    /// The file can't be read, or holds something else.
    pub fn load(path: &Path) -> Checked<ViewChoice> {
        let source = Source::read(path)?;
        ron::from_str(&source.text).map_err(|e| {
            let message = format!("{}:{}: {}", path.display(), e.span.start, e.code);
            Diagnostic::error(message).help("give a file that `lightgraph view` saved").into()
        })
    }

    /// Writes the choice as RON, whole or not at all.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn save(&self, path: &Path) -> Checked<()> {
        let text = ron::ser::to_string_pretty(self, ron::ser::PrettyConfig::default())
            .map_err(|e| Diagnostic::error(format!("can't write {}: {e}", path.display())))?;
        write_atomically(path, format!("{text}\n").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::internals::scene::{CameraPose, Lens};
    use lightgraph::internals::value::Value;

    fn full() -> ViewChoice {
        let place = CameraPose { position: Vec3::new(1.0, 2.0, 3.5), forward: Vec3::NEG_Z, up: Vec3::Y };
        let lens = Lens::Perspective { yfov: 0.75, near: 0.125, far: None };
        ViewChoice {
            params: Values::from([
                ("bias".into(), Value::Float(0.25)),
                ("grid".into(), Value::UVec3([1, 2, 3].into())),
            ]),
            camera: Some("eye".into()),
            view: Some(View { place, lens, shift: glam::Vec2::ZERO }),
            lights: BTreeMap::from([(0, Vec3::X)]),
            nodes: BTreeMap::from([(7, Vec3::NEG_Y)]),
            time: 1.5,
            exposure: Exposure::Stops(-1.0),
            resolution: Resolution::Fixed([128, 64]),
            compare: Compare { against: ComparedTo::Image("a b.exr".into()), layout: SplitLayout::Difference(4.0) },
            ..ViewChoice::new("g.ron".into(), "s.glb".into())
        }
    }

    #[test]
    fn what_was_saved_is_what_is_loaded() {
        let path = std::env::temp_dir().join(format!("lightgraph-choice-{}.ron", std::process::id()));
        let choice = full();
        choice.save(&path).unwrap();
        let loaded = ViewChoice::load(&path);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(loaded.unwrap(), choice);
    }

    #[test]
    fn a_file_of_another_kind_is_refused_with_its_place() {
        let path = std::env::temp_dir().join(format!("lightgraph-no-choice-{}.ron", std::process::id()));
        std::fs::write(&path, "(graph: \"a\", scene: \"b\", colour: 3)").unwrap();
        let text = ViewChoice::load(&path).unwrap_err().to_string();
        std::fs::remove_file(&path).unwrap();
        assert!(text.contains(".ron:1:"), "{text}");
        assert!(text.contains("colour"), "{text}");
    }

    #[test]
    fn another_scene_forgets_what_was_moved_in_the_old_one() {
        let mut c = full();
        c.set_scene("s.glb".into());
        assert_eq!(c, full());
        c.set_scene("t.glb".into());
        assert_eq!((c.shift(None), c.params), (Shift::default(), full().params));
    }

    #[test]
    fn an_image_has_a_pixel_at_least() {
        assert_eq!(Resolution::Window(0.5).size([801, 1], 8192), [401, 1]);
        assert_eq!(Resolution::Window(0.25).size([1, 1], 8192), [1, 1]);
        assert_eq!(Resolution::Fixed([0, 99_999]).size([5, 5], 4096), [1, 4096]);
    }
}
