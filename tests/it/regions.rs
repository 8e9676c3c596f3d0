//! What moves is drawn again only in the views that show it, before or after; every frame is compared with a full run.

use crate::{device, support};
use glam::Vec3;
use lightgraph::gpu::Gpu;
use lightgraph::plan::change::Why;
use lightgraph::scene;
use lightgraph::session::{Project, Session, Settings};

fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str]) -> Session {
    let project = Project::open(&support::repository("graphs").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    let outputs = Some(vec!["color".to_string()]);
    let settings = Settings { params, size: [16, 12], outputs, skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// How many members of a pass ran in the last frame, and of how many; `None` when it did not run.
fn members(session: &Session, pass: &str) -> Option<(u32, u32)> {
    let mut steps = session.plan.steps.iter().zip(session.why());
    let (_, why) = steps.find(|(s, _)| s.name == pass).unwrap_or_else(|| panic!("no step `{pass}`"));
    match why {
        Why::Changed(names) => {
            let words: Vec<&str> = names[0].split(' ').collect();
            match words[..] {
                ["what", some, "of", all, "members", "see"] => Some((some.parse().unwrap(), all.parse().unwrap())),
                _ => panic!("`{pass}` ran as a whole: {names:?}"),
            }
        }
        why if why.runs() => panic!("`{pass}` ran as a whole: {why}"),
        _ => None,
    }
}

#[test]
fn an_object_is_captured_again_only_by_the_faces_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &["grid=3", "face=4", "bounces=1"]);
    let name = |s: &Session, i: usize| s.scene.nodes[i].name.clone();
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    // The smallest thing in the hall: the node whose triangles reach least far.
    let extent = |node: u32| {
        let of_node = s.scene.geometry.vertices.iter().filter(|v| v.node == node).map(|v| Vec3::from(v.position));
        let (low, high) = of_node.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        if low.x <= high.x { low.distance(high) } else { f32::INFINITY }
    };
    let count = s.scene.nodes.len() as u32;
    let small = (0..count).min_by(|a, b| extent(*a).total_cmp(&extent(*b))).unwrap() as usize;
    s.shift.nodes = vec![(small, Vec3::new(0.05, 0.1, 0.0))];
    s.frame(gpu, 1, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let (some, all) = members(&s, "capture").unwrap_or_else(|| panic!("nobody sees `{}`", name(&s, small)));
    assert_eq!(all, 27 * 6);
    // From inside its box every direction but one in six looks away; from near it a few faces share it.
    assert!(some > 0 && some < all / 2, "{some} of {all} faces see `{}`", name(&s, small));
    // Nothing more moves: nothing more is drawn.
    s.frame(gpu, 2, 0.0).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(members(&s, "capture"), None);
    s.shift.nodes = vec![];
    s.frame(gpu, 3, 0.0).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(members(&s, "capture"), Some((some, all)), "back where it was, seen by the same faces");
}

#[test]
fn a_shadow_moves_only_in_the_maps_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "direct.ron", "cornell_point.gltf", &["shadow_size=64"]);
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let (mut some, mut none) = (0, 0);
    for node in 0..s.scene.nodes.len() {
        if !s.scene.geometry.vertices.iter().any(|v| v.node as usize == node) {
            continue;
        }
        s.shift.nodes = vec![(node, Vec3::new(0.0, 0.02, 0.01))];
        s.frame(gpu, 1, 0.0).unwrap_or_else(|f| panic!("{f}"));
        match members(&s, "shadow_maps") {
            Some((few, 6)) if few < 6 => some += 1,
            Some(_) => {}
            None => none += 1,
        }
        s.shift.nodes = vec![];
        s.frame(gpu, 2, 0.0).unwrap_or_else(|f| panic!("{f}"));
    }
    assert!(some > 0, "no object moved in some of the maps only ({none} in none)");
}
