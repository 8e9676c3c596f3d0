//! What the window remembers: the choice and its past, and what is open, selected and under way.

use super::choice::{ComparedTo, ViewChoice};
use super::feed::Subject;
use super::link::{self, Linked};
use super::pick::Draggable;
use super::stage::{Ask, FrameRequest, ProbedPlace, ResourcePart};
use super::undo::Undo;
use crate::show::Picture;
use egui::Rect;
use glam::{Vec2, Vec3};
use lightgraph::internals::image::paint::PaintLook;
use lightgraph::internals::scene::{Pose, navigate};
use lightgraph::internals::session::Pointer;
use lightgraph::{Scene, View};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Everything that panels read and change. No device and no window.
#[derive(Debug)]
pub struct PanelState {
    pub choice: Undo<ViewChoice>,
    pub panels: Panels,
    /// The output shown; `None`: the usual one.
    pub output: Option<String>,
    pub inspect: Option<ResourcePart>,
    pub look: PaintLook,
    /// The invocation that is asked what it computes.
    pub ask: Option<Ask>,
    /// Of its values those are shown whose names hold this.
    pub ask_search: String,
    pub selected: Option<Draggable>,
    /// What the pointer drags in the image.
    pub gesture: Option<Gesture>,
    /// Time runs.
    pub playing: bool,
    /// Where it is over the image, in pixels of the image.
    pub pointer: Pointer,
    /// All variants are to be made ready.
    pub prepare: bool,
    /// What the view turns round; `None`: the middle of what it looks at.
    pub pivot: Option<Vec3>,
    /// What is to be written to a file: only the event loop can do it.
    pub requests: Vec<Save>,
    /// What became of the last of them: whether it is good, and the words.
    pub message: Option<(bool, String)>,
    /// What has come over the link.
    pub linked: Arc<Linked>,
    /// The pixels that the image takes in the window.
    pub room: [u32; 2],
    pub network: NetworkLook,
    /// Where named parts of the window lie, for who plays events.
    pub marks: BTreeMap<String, Rect>,
    pub file: String,
}

/// Which panels are open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Panels {
    pub left: bool,
    pub right: bool,
    pub bottom: bool,
    pub tab: Tab,
}

/// How the graph is looked at.
#[derive(Debug, Default)]
pub struct NetworkLook {
    /// As the file declares it, not as it was compiled.
    pub declared: bool,
    /// `None`: all of it.
    pub zoom: Option<Zoom>,
    /// A part of the names that are looked for; empty: none is.
    pub search: String,
    /// Sub-graphs that are one box each.
    pub collapsed: BTreeSet<String>,
    /// The picture of a graph with these collapsed.
    pub drawn: Option<(Arc<Subject>, BTreeSet<String>, Picture)>,
}

/// What the lower panel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tab {
    Steps,
    Graph,
    Memory,
    Resource,
    Probe,
}

/// A part of a picture: its scale, and where its corner lies from that of its panel, in points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zoom {
    pub scale: f32,
    pub offset: egui::Vec2,
}

impl Zoom {
    /// All of a picture in the middle of a panel, but no larger than life.
    pub fn whole(picture: egui::Vec2, panel: egui::Vec2) -> Zoom {
        let fit = (panel.x / picture.x.max(1.0)).min(panel.y / picture.y.max(1.0));
        let scale = fit.clamp(0.02, 1.0);
        Zoom { scale, offset: (panel - picture * scale) * 0.5 }
    }

    /// Larger by a factor, while the point at `at` (from the panel's corner) stays where it is.
    pub fn by(self, factor: f32, at: egui::Vec2) -> Zoom {
        let scale = (self.scale * factor).clamp(0.02, 4.0);
        Zoom { scale, offset: at - (at - self.offset) * (scale / self.scale) }
    }
}

/// A drag in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gesture {
    Orbit,
    Pan,
    Look,
    /// The thing, and the point of it that is held.
    Move(Draggable, Vec3),
    Split,
}

/// What is to be written to a file: only the event loop can do it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Save {
    Png,
    Exr,
    Variant,
    Choice,
}

impl PanelState {
    pub fn new(choice: ViewChoice) -> PanelState {
        PanelState {
            choice: Undo::new(choice),
            panels: Panels { left: true, right: true, bottom: true, tab: Tab::Steps },
            output: None,
            inspect: None,
            look: PaintLook::default(),
            ask: None,
            ask_search: String::new(),
            selected: None,
            gesture: None,
            pointer: Pointer::default(),
            playing: false,
            prepare: false,
            pivot: None,
            requests: vec![],
            message: None,
            linked: Arc::default(),
            room: [1, 1],
            network: NetworkLook::default(),
            marks: BTreeMap::new(),
            file: String::new(),
        }
    }

    pub fn now(&self) -> &ViewChoice {
        self.choice.now()
    }

    /// Changes the choice; `about` names the thing, so that one gesture is one step back.
    pub fn edit(&mut self, about: &str, change: impl FnOnce(&mut ViewChoice)) {
        self.choice.edit(about, change);
    }

    /// What the choice asks of the stage.
    pub fn wish(&self, serial: u64, time: f32, most: u32) -> FrameRequest {
        FrameRequest {
            serial,
            choice: self.now().clone(),
            size: self.now().resolution.size(self.room, most),
            time,
            pointer: self.pointer,
            output: self.output.clone(),
            inspect: self.inspect.clone().filter(|_| self.sees(Tab::Resource)),
            ask: self.ask.clone().filter(|_| self.sees(Tab::Probe)),
            prepare: self.prepare,
            linked: self.shown_link().cloned(),
        }
    }

    /// What came over the link, where its scene is the one that is shown.
    fn shown_link(&self) -> Option<&Arc<Linked>> {
        (self.linked.connection > 0 && self.now().scene == Path::new(link::NAME)).then_some(&self.linked)
    }

    /// Takes in what has come over the link. Whoever has just connected is shown; where its camera moves, the view goes
    /// along.
    pub fn follow(&mut self, linked: Arc<Linked>) {
        let before = std::mem::replace(&mut self.linked, linked);
        if before.connection != self.linked.connection {
            self.set_scene(link::NAME.into());
        }
        if before.view != self.linked.view && self.shown_link().is_some() {
            self.edit(link::NAME, |c| c.view = None);
            self.pivot = None;
        }
    }

    /// Whether the lower panel shows this.
    pub fn sees(&self, tab: Tab) -> bool {
        self.panels.bottom && self.panels.tab == tab
    }

    /// Asks an invocation of a graph's pass what it computes, and opens the lower panel for the answer.
    pub fn ask(&mut self, graph: &Path, of: ProbedPlace) {
        let serial = self.ask.as_ref().map_or(0, |a| a.serial.wrapping_add(1));
        self.ask = Some(Ask { serial, graph: graph.into(), of });
        (self.panels.bottom, self.panels.tab) = (true, Tab::Probe);
    }

    /// Opens a resource in the lower panel.
    pub fn open(&mut self, resource: &str) {
        self.inspect = Some(ResourcePart { resource: resource.into(), mip: 0, layer: 0 });
        (self.panels.bottom, self.panels.tab) = (true, Tab::Resource);
    }

    pub fn set_graph(&mut self, graph: PathBuf) {
        self.edit("graph", |c| {
            // What is shown is not held against itself: the two change places.
            if c.compare.against == ComparedTo::Graph(graph.clone()) {
                c.compare.against = ComparedTo::Graph(std::mem::replace(&mut c.graph, graph));
            } else {
                c.graph = graph;
            }
        });
        self.choice.rest();
    }

    pub fn set_scene(&mut self, scene: PathBuf) {
        self.edit("scene", |c| c.set_scene(scene));
        self.choice.rest();
        (self.selected, self.pivot) = (None, None);
    }

    /// The scene as it is seen.
    pub fn pose(&self, scene: &Scene, time: f32) -> Pose {
        scene.pose_shifted(time, &self.now().shift(self.shown_link().map(Arc::as_ref)))
    }

    /// From where it is seen; `None` when the camera is not in the scene.
    pub fn view(&self, scene: &Scene, pose: &Pose, aspect: f32) -> Option<View> {
        scene.view(pose, self.now().camera.as_deref(), aspect).ok().map(|v| v.0)
    }

    /// What the view turns round.
    pub fn pivot(&self, scene: &Scene, view: View) -> Vec3 {
        self.pivot.unwrap_or_else(|| {
            let ahead = (scene.bounds.center() - view.place.position).dot(view.place.forward);
            view.place.position + view.place.forward * ahead.max(scene.bounds.diagonal() * 0.05)
        })
    }

    /// Moves the view.
    pub fn set_view(&mut self, about: &str, view: View) {
        self.edit(about, |c| c.view = Some(view));
    }

    /// A drag in the image by `by`, in heights of the image, x to the right and y down.
    pub fn drag(&mut self, gesture: Gesture, scene: &Scene, view: View, by: Vec2) {
        /// Radians for a drag over the height of the image.
        const TURN: f32 = std::f32::consts::PI;
        let pivot = self.pivot(scene, view);
        match gesture {
            Gesture::Orbit => self.set_view("view", navigate::orbit(view, pivot, by * TURN)),
            Gesture::Pan => {
                let moved = navigate::pan(view, pivot, by);
                if let Some(p) = &mut self.pivot {
                    *p += moved.place.position - view.place.position;
                }
                self.set_view("view", moved);
            }
            Gesture::Look => {
                self.pivot = None;
                self.set_view("view", navigate::look(view, by * TURN * 0.5));
            }
            Gesture::Move(thing, point) => {
                let metres = super::pick::drag(view, 1.0, point, by);
                self.move_thing(thing, metres);
                self.gesture = Some(Gesture::Move(thing, point + metres));
            }
            Gesture::Split => {}
        }
    }

    /// Moves a light or an object by metres.
    pub fn move_thing(&mut self, thing: Draggable, by: Vec3) {
        self.edit(&format!("{thing:?}"), |c| {
            let (map, index) = match thing {
                Draggable::Light(i) => (&mut c.lights, i),
                Draggable::Node(i) => (&mut c.nodes, i),
            };
            *map.entry(index).or_default() += by;
        });
    }

    /// Remembers where a part of the window lies.
    pub fn mark(&mut self, name: impl Into<String>, rect: Rect) {
        self.marks.insert(name.into(), rect);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn state() -> (PanelState, Scene) {
        let path = crate::repository("scenes/hall");
        let scene = lightgraph::Scene::load(&path).unwrap_or_else(|f| panic!("{f}")).scene;
        (PanelState::new(ViewChoice::new("g.ron".into(), path)), scene)
    }

    #[test]
    fn a_drag_of_the_view_is_one_step_back() {
        let (mut s, scene) = state();
        let start = s.now().clone();
        for _ in 0..10 {
            let view = s.view(&scene, &s.pose(&scene, 0.0), 1.5).unwrap();
            s.drag(Gesture::Orbit, &scene, view, Vec2::new(0.02, 0.01));
        }
        assert!(s.now().view.is_some());
        s.choice.undo();
        assert_eq!(*s.now(), start);
    }

    #[test]
    fn a_dragged_light_is_where_the_shader_sees_it() {
        let (mut s, scene) = state();
        let before = s.pose(&scene, 0.0).lights[0].position;
        s.move_thing(Draggable::Light(0), Vec3::new(0.5, 0.0, 0.0));
        s.move_thing(Draggable::Light(0), Vec3::new(0.0, -0.25, 0.0));
        let after = s.pose(&scene, 0.0).lights[0].position;
        assert!((after - before - Vec3::new(0.5, -0.25, 0.0)).length() < 1e-6);
        s.choice.undo();
        assert_eq!(s.pose(&scene, 0.0).lights[0].position, before);
    }

    #[test]
    fn a_graph_is_never_held_against_itself() {
        let (mut s, _) = state();
        s.edit("against", |c| c.compare.against = ComparedTo::Graph("h.ron".into()));
        s.set_graph("h.ron".into());
        assert_eq!(s.now().graph, Path::new("h.ron"));
        assert_eq!(s.now().compare.against, ComparedTo::Graph("g.ron".into()));
    }

    #[test]
    fn a_program_that_connects_is_shown_until_another_scene_is() {
        let (mut s, scene) = state();
        let view = |x| View::perspective(Vec3::X * x, Vec3::NEG_Z, Vec3::Y, 0.8);
        let linked = |connection, x| Arc::new(Linked { connection, view: Some(view(x)), ..Linked::default() });
        let seen = |s: &PanelState| s.pose(&scene, 0.0).view;
        s.follow(linked(1, 1.0));
        assert_eq!((s.now().scene.as_path(), seen(&s)), (Path::new(link::NAME), Some(view(1.0))));
        // Where the user went, the view stays until the program's camera moves.
        s.set_view("view", view(5.0));
        s.follow(linked(1, 1.0));
        assert_eq!(seen(&s), Some(view(5.0)));
        s.follow(linked(1, 2.0));
        assert_eq!(seen(&s), Some(view(2.0)));
        s.set_scene("other.glb".into());
        s.follow(linked(1, 3.0));
        assert_eq!((seen(&s), s.wish(0, 0.0, 4096).linked.is_none()), (None, true));
        s.set_scene(link::NAME.into());
        assert_eq!((seen(&s), s.wish(0, 0.0, 4096).linked.is_some()), (Some(view(3.0)), true));
        s.set_scene("other.glb".into());
        s.follow(linked(2, 3.0));
        assert_eq!(s.now().scene, Path::new(link::NAME));
    }

    #[test]
    fn resources_are_read_only_while_they_are_looked_at() {
        let (mut s, _) = state();
        s.open("sh");
        assert!(s.wish(0, 0.0, 4096).inspect.is_some());
        s.panels.tab = Tab::Steps;
        assert!(s.wish(0, 0.0, 4096).inspect.is_none());
    }

    #[test]
    fn a_picture_grows_round_the_pointer() {
        let v = egui::Vec2::new;
        let whole = Zoom::whole(v(200.0, 100.0), v(100.0, 100.0));
        assert_eq!(whole, Zoom { scale: 0.5, offset: v(0.0, 25.0) });
        let near = whole.by(2.0, v(50.0, 50.0));
        assert_eq!(near, Zoom { scale: 1.0, offset: v(-50.0, 0.0) });
        let no_room = Zoom::whole(v(200.0, 100.0), v(0.0, -4.0));
        assert!(no_room.scale > 0.0 && no_room.offset.is_finite());
    }

    #[test]
    fn a_window_without_room_still_asks_for_a_pixel() {
        let (mut s, _) = state();
        s.room = [0, 0];
        assert_eq!(s.wish(0, 0.0, 4096).size, [1, 1]);
    }
}
