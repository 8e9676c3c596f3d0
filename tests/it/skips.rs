//! Frames that leave steps out equal frames in full, whatever moves; and they leave out what they should.

use crate::{device, support};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph::ast::{Name, Param};
use lightgraph::internals::scene::Shift;
use lightgraph::internals::value::Value;
use lightgraph::{Gpu, Project, Scene, Session, Settings};
use std::collections::BTreeSet;

/// A session on a small image that compares every frame with a full run.
fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str]) -> Session {
    let project = Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    let outputs = Some(vec!["color".to_string()]);
    let settings = Settings { params, size: [32, 24], outputs, skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// Names of the passes that ran.
fn ran(session: &Session) -> BTreeSet<&str> {
    let why = session.why().iter().zip(&session.plan.steps);
    why.filter(|(w, _)| w.runs()).map(|(_, s)| s.pass.as_str()).collect()
}

fn frame(gpu: &Gpu, session: &mut Session, index: u32, time: f32) {
    session.frame(gpu, index, time).unwrap_or_else(|f| panic!("frame {index}: {f}"));
}

const SMALL: [&str; 3] = ["grid=2", "face=8", "bounces=2"];

#[test]
fn a_still_frame_runs_nothing() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "cornell.glb", &SMALL);
    frame(gpu, &mut s, 0, 0.0);
    // What writes dirty bits runs when something has moved.
    let plan = &s.plan;
    let marks = |step: &&lightgraph::internals::plan::Step| step.writes.iter().any(|id| plan.resources[id.0].bits);
    let others = plan.steps.iter().filter(|step| !marks(step));
    assert_eq!(ran(&s), others.map(|step| step.pass.as_str()).collect());
    frame(gpu, &mut s, 1, 0.5);
    assert!(ran(&s).is_empty(), "{:?}", ran(&s));
}

#[test]
fn a_moving_camera_touches_no_probe_and_a_moving_light_captures_nothing() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "cornell.glb", &SMALL);
    frame(gpu, &mut s, 0, 0.0);
    s.shift.cameras.x = 0.1;
    frame(gpu, &mut s, 1, 0.0);
    for pass in [
        "shadow.shadow_maps",
        "capture.capture",
        "factors.factors",
        "direct_at_probes",
        "relight",
        "project.multiply",
        "project.sum",
        "project.place",
    ] {
        assert!(!ran(&s).contains(pass), "{pass} ran, though only the camera moved");
    }
    assert!(ran(&s).contains("composite"));
    s.shift.lights.y = -0.2;
    frame(gpu, &mut s, 2, 0.0);
    // What the camera sees shares its memory with nothing that changes with the light.
    for pass in ["capture.capture", "factors.factors", "surface"] {
        assert!(!ran(&s).contains(pass), "{pass} ran, though only the light moved");
    }
    for pass in ["shadow.shadow_maps", "direct_at_probes", "relight", "project.place", "composite"] {
        assert!(ran(&s).contains(pass), "{pass} did not run, though the light moved");
    }
}

/// What makes a frame of any graph short; each takes of these what it has.
const TINY: [&str; 10] = [
    "grid=2",
    "face=4",
    "bounces=2",
    "shadow_size=64",
    "emitter_samples=2",
    "directions=2",
    "hit_samples=1",
    "samples=1",
    "distance_face=4",
    "moment_edge=4",
];

/// What a script edits.
#[derive(Clone)]
struct Stage {
    graph: String,
    scene: Scene,
    set: Vec<String>,
    /// Every pixel is seen through another point than its centre.
    aside: bool,
    size: [u32; 2],
    shift: Shift,
    time: f32,
}

impl Stage {
    fn project(&self) -> Project {
        let path = support::repository("graphs/gi").join(&self.graph);
        let mut project = Project::open(&path, &[]).unwrap_or_else(|f| panic!("{f}"));
        if self.aside {
            let camera = project.texts.files.get_mut("lib/camera.wgsl").expect("a shader that all graphs import");
            let text = camera.text.replace("vec2f(pixel) + 0.5", "vec2f(pixel) + 0.25");
            assert_ne!(text, camera.text);
            *camera = Source::new(camera.path.clone(), text);
        }
        project
    }

    /// The session that takes the place of another.
    fn open(&self, gpu: &Gpu, previous: Option<&Session>) -> Session {
        let project = self.project();
        let known = |set: &&String| project.graph.params.iter().any(|(n, _)| set.starts_with(&format!("{}=", n.value)));
        let set: Vec<String> = self.set.iter().filter(known).cloned().collect();
        let settings = Settings {
            params: project.params(&set).unwrap_or_else(|f| panic!("{f}")),
            size: self.size,
            outputs: Some(vec!["color".to_string()]),
            skip: true,
            verify: true,
            ..Settings::default()
        };
        let session = Session::after(gpu, &project, self.scene.clone(), settings, previous);
        session.unwrap_or_else(|f| panic!("{}: {f}", self.graph))
    }
}

/// A parameter that differs from its default: the first number that is no count.
fn other_parameter(graph: &str) -> String {
    let project = Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let float = |(name, p): &(Name, Param)| match (p.default, p.min) {
        (Value::Float(x), Some(Value::Float(min))) => Some(format!("{}={}", name.value, (x + min) / 2.0)),
        _ => None,
    };
    project.graph.params.iter().find_map(float).unwrap_or_else(|| "seed=1".into())
}

type Edit = fn(&mut Stage);

/// Edits of all sorts; those that another plan follows from say so.
const SCRIPT: [(&str, bool, Edit); 12] = [
    ("nothing", false, |_| {}),
    ("camera", false, |s| s.shift.cameras.x += 0.05),
    ("light", false, |s| s.shift.lights.z -= 0.1),
    ("object", false, |s| s.shift.nodes = vec![(0, glam::Vec3::splat(0.1))]),
    ("time", false, |s| s.time += 0.25),
    ("material", true, |s| s.scene.materials[0].base_color *= 0.5),
    ("parameter", true, |s| s.set.push(other_parameter(&s.graph))),
    ("shader", true, |s| s.aside = true),
    ("size", true, |s| s.size = [12, 16]),
    ("shader back", true, |s| s.aside = false),
    ("graph", true, |s| s.graph = "direct.ron".into()),
    ("all back", true, |_| {}),
];

/// Takes its time: every graph, every edit, every frame twice.
fn script_equals_full_runs(scene: &str) {
    let gpu = &device::gpu();
    let scene = Scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}")).scene;
    for graph in support::files("graphs/gi", &["ron"]) {
        let graph = graph.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let set = TINY.iter().map(ToString::to_string).collect();
        let (scene, shift) = (scene.clone(), Shift::default());
        let first = Stage { graph, scene, set, aside: false, size: [16, 12], shift, time: 0.0 };
        let mut stage = first.clone();
        let mut session = stage.open(gpu, None);
        for (index, (name, replan, edit)) in (0..).zip(SCRIPT) {
            edit(&mut stage);
            if name == "all back" {
                stage = first.clone();
            }
            if replan {
                session = stage.open(gpu, Some(&session));
            }
            session.shift = stage.shift.clone();
            let done = session.frame(gpu, index, stage.time);
            done.unwrap_or_else(|f| panic!("{}: after the edit `{name}`: {f}", first.graph));
        }
    }
}

#[test]
fn edits_of_all_graphs_in_a_still_scene_equal_full_runs() {
    script_equals_full_runs("cornell.glb");
}

#[test]
fn edits_of_all_graphs_in_a_moving_scene_equal_full_runs() {
    script_equals_full_runs("hall_moving.ron");
}

#[test]
fn a_variant_keeps_what_it_shares_with_its_base() {
    let gpu = &device::gpu();
    let scene = Scene::load(&support::repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let set = TINY.iter().map(ToString::to_string).collect();
    let (graph, shift) = ("fast_grid.ron".to_string(), Shift::default());
    let mut stage = Stage { graph, scene, set, aside: false, size: [16, 12], shift, time: 0.0 };
    let mut session = stage.open(gpu, None);
    frame(gpu, &mut session, 0, 0.0);
    stage.graph = "facing_probes.ron".into();
    let mut other = stage.open(gpu, Some(&session));
    frame(gpu, &mut other, 1, 0.0);
    for pass in ["shadow.shadow_maps", "capture.capture"] {
        assert!(!ran(&other).contains(pass), "{pass} ran, though the variant shares it");
    }
    stage.graph = "fast_grid.ron".into();
    let mut back = stage.open(gpu, Some(&other));
    frame(gpu, &mut back, 2, 0.0);
    for pass in ["shadow.shadow_maps", "capture.capture"] {
        assert!(!ran(&back).contains(pass), "{pass} ran, though its memory was never given up");
    }
    // The first session shares memory with the later ones, and knows what they wrote there.
    frame(gpu, &mut session, 3, 0.0);
}

#[test]
fn another_size_leaves_alone_what_is_no_picture() {
    let gpu = &device::gpu();
    let scene = Scene::load(&support::repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let set = TINY.iter().map(ToString::to_string).collect();
    let (graph, shift) = ("uniform_grid.ron".to_string(), Shift::default());
    let mut stage = Stage { graph, scene, set, aside: false, size: [16, 12], shift, time: 0.0 };
    let mut session = stage.open(gpu, None);
    frame(gpu, &mut session, 0, 0.0);
    stage.size = [24, 12];
    let mut session = stage.open(gpu, Some(&session));
    frame(gpu, &mut session, 1, 0.0);
    let probes = [
        "shadow.shadow_maps",
        "capture.capture",
        "factors.factors",
        "direct_at_probes",
        "relight",
        "project.multiply",
        "project.sum",
        "project.place",
    ];
    for pass in probes {
        assert!(!ran(&session).contains(pass), "{pass} ran, though only the picture's size changed");
    }
}
