//! Frames that leave steps out equal frames in full, whatever moves; and they leave out what they should.

use crate::{device, support};
use lightgraph::gpu::Gpu;
use lightgraph::plan::change::Why;
use lightgraph::scene::{self, Shift};
use lightgraph::session::{Project, Session, Settings};
use std::collections::BTreeSet;

/// A session on a small image that compares every frame with a full run.
fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str]) -> Session {
    let project = Project::open(&support::repository("graphs").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    let outputs = Some(vec!["color".to_string()]);
    let settings = Settings { params, size: [32, 24], outputs, skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// Names of the passes that ran.
fn ran(session: &Session) -> BTreeSet<&str> {
    let why = session.why().iter().zip(&session.plan.steps);
    why.filter(|(w, _)| !matches!(w, Why::Unchanged | Why::NotNeeded)).map(|(_, s)| s.pass.as_str()).collect()
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
    assert_eq!(ran(&s).len(), s.plan.steps.iter().map(|s| &s.pass).collect::<BTreeSet<_>>().len());
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
    for pass in ["shadow_maps", "capture", "factors", "direct_at_probes", "relight", "multiply", "sum", "place"] {
        assert!(!ran(&s).contains(pass), "{pass} ran, though only the camera moved");
    }
    assert!(ran(&s).contains("composite"));
    s.shift.lights.y = -0.2;
    frame(gpu, &mut s, 2, 0.0);
    for pass in ["capture", "factors"] {
        assert!(!ran(&s).contains(pass), "{pass} ran, though only the light moved");
    }
    // What the camera sees may have to be drawn again, where its memory was shared; but it did not change.
    let why = s.why().iter().zip(&s.plan.steps).find(|(_, step)| step.pass == "surface").map(|(why, _)| why);
    assert!(matches!(why, Some(Why::Overwritten | Why::Unchanged | Why::NotNeeded)), "{why:?}");
    for pass in ["shadow_maps", "direct_at_probes", "relight", "place", "composite"] {
        assert!(ran(&s).contains(pass), "{pass} did not run, though the light moved");
    }
}

/// Of the parameters that make a graph small those that it has.
fn smallest(graph: &str) -> Vec<&'static str> {
    let project = Project::open(&support::repository("graphs").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let has = |set: &&str| project.graph.params.iter().any(|(n, _)| set.starts_with(&format!("{}=", n.value)));
    SMALL.into_iter().filter(has).collect()
}

#[test]
fn whatever_moves_equals_a_full_run() {
    let gpu = &device::gpu();
    for graph in support::files("graphs", &["ron"]) {
        let graph = graph.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for scene in ["cornell.glb", "hall_moving.ron"] {
            let mut s = session(gpu, &graph, scene, &smallest(&graph));
            // A fixed sequence from a small congruential generator: camera, lights, a node, time, nothing.
            let mut seed = 7u32;
            let mut time = 0.0;
            for index in 0..6 {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let by = (seed >> 16 & 15) as f32 / 64.0;
                match seed >> 28 & 7 {
                    0 | 1 => s.shift.cameras.x += by,
                    2 | 3 => s.shift.lights.z -= by,
                    4 => s.shift.nodes = vec![(0, glam::Vec3::splat(by))],
                    5 => time += 0.25,
                    6 => s.shift = Shift::default(),
                    _ => {}
                }
                frame(gpu, &mut s, index, time);
            }
        }
    }
}
