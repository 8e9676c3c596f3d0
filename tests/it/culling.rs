//! Draws that leave out what their members don't see make the same images as draws of everything, from fewer triangles.

use crate::{device, support};
use glam::Vec3;
use lightgraph::internals::graph::ast::{PassKind, walk_mut};
use lightgraph::internals::image::metrics::compare;
use lightgraph::internals::plan::Action;
use lightgraph::{Gpu, Project, Scene, Session, Settings};

/// What draws leave out.
#[derive(Clone, Copy, PartialEq)]
enum Culled {
    /// What frusta don't meet.
    Unseen,
    /// That, and what hides nothing where the graph says so.
    Idle,
    Nothing,
}

fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str], culled: Culled, outputs: &[&str]) -> Session {
    let mut project =
        Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    walk_mut(&mut project.graph.passes, &mut |p| {
        if let PassKind::Draw(raster) = &mut p.kind {
            raster.occluders &= culled == Culled::Idle;
            raster.frusta = raster.frusta.take().filter(|_| culled != Culled::Nothing);
        }
    });
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let settings = Settings {
        params: project.params(&set).unwrap_or_else(|f| panic!("{f}")),
        size: [24, 16],
        outputs: Some(outputs.iter().map(ToString::to_string).collect()),
        skip: true,
        ..Settings::default()
    };
    let loaded = Scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// The bits of some outputs after a frame at each of these times.
fn bits(gpu: &Gpu, session: &mut Session, times: &[f32], outputs: &[&str]) -> Vec<Vec<u32>> {
    let mut all = vec![];
    for (index, time) in (0..).zip(times) {
        session.frame(gpu, index, *time).unwrap_or_else(|f| panic!("{f}"));
        for output in outputs {
            let image = session.image(gpu, output).unwrap_or_else(|f| panic!("{f}"));
            all.push(image.data.iter().map(|x| x.to_bits()).collect());
        }
    }
    all
}

/// Triangles drawn and in the whole, by pass.
fn triangles(gpu: &Gpu, session: &Session, pass: &str) -> (u64, u64) {
    let counts = session.triangles(gpu).unwrap_or_else(|f| panic!("{f}"));
    let of_pass = |i: &usize| session.plan.steps[*i].pass == pass;
    let (_, found) = counts.into_iter().find(|(i, _)| of_pass(i)).unwrap_or_else(|| panic!("{pass} is not culled"));
    found
}

#[test]
fn culled_draws_make_the_same_bits() {
    let gpu = &device::gpu();
    let small = ["grid=2", "face=8", "bounces=1"];
    let drawn = ["grid=2", "face=8", "bounces=1", "rays_above=100000"];
    let simplified = ["grid=2", "face=8", "bounces=1", "capture_tolerance=0.02"];
    let cases: [(&str, &str, &[&str], &[f32]); 6] = [
        ("uniform_grid.ron", "hall_moving.ron", &simplified, &[0.0, 0.7]),
        ("uniform_grid.ron", "hall_moving.ron", &small, &[0.0, 0.7, 1.3]),
        ("uniform_grid.ron", "cornell_point.gltf", &small, &[0.0]),
        ("indirect_shadow.ron", "two_rooms.glb", &small, &[0.0]),
        ("nonuniform_grid.ron", "hall.ron", &drawn, &[0.0]),
        ("direct.ron", "art_gallery.ron", &["shadow_size=256"], &[0.0]),
    ];
    for (graph, scene, set, times) in cases {
        let outputs: &[&str] = if graph == "direct.ron" { &["direct"] } else { &["color", "sh"] };
        let mut with = session(gpu, graph, scene, set, Culled::Unseen, outputs);
        let mut without = session(gpu, graph, scene, set, Culled::Nothing, outputs);
        let same = bits(gpu, &mut with, times, outputs) == bits(gpu, &mut without, times, outputs);
        assert!(same, "{graph} on {scene} differs without culling");
        assert!(without.triangles(gpu).unwrap().is_empty(), "{graph} is culled all the same");
        let (drawn, whole) = triangles(gpu, &with, "shadow.shadow_maps");
        assert!(drawn > 0 && drawn <= whole, "{graph} on {scene}: {drawn} of {whole}");
    }
}

/// Draws walls into shadow maps or not: a wall comes between a light in the room and nothing, but its texels shadow
/// edges.
#[test]
fn walls_round_everything_shadow_nothing() {
    let gpu = &device::gpu();
    let outputs = &["direct"];
    for (scene, room, blocks) in [("cornell_point.gltf", 10, 6 * 20), ("empty_room.glb", 12, 0)] {
        let of = |culled| session(gpu, "direct.ron", scene, &["shadow_size=256"], culled, outputs);
        let (mut with, mut without) = (of(Culled::Idle), of(Culled::Unseen));
        let values = |s: &mut Session| {
            let all = bits(gpu, s, &[0.0], outputs).remove(0);
            all.into_iter().map(f32::from_bits).collect::<Vec<_>>()
        };
        let (new, old) = (values(&mut with), values(&mut without));
        assert!(new.iter().zip(&old).all(|(n, o)| n >= o), "{scene}: it is darker without walls");
        let brighter = new.iter().zip(&old).filter(|(n, o)| n > o).count();
        assert!(brighter * 25 < new.len(), "{scene}: {brighter} of {} values differ", new.len());
        let (drawn, whole) = triangles(gpu, &with, "shadow.shadow_maps");
        assert!(drawn <= blocks && whole >= 6 * room, "{scene}: {drawn} of {whole} triangles are drawn");

        // From outside the wall is all that hides the room.
        for s in [&mut with, &mut without] {
            s.shift.lights = Vec3::new(0.0, 40.0, 0.0);
        }
        let (new, old) = (values(&mut with), values(&mut without));
        assert!(triangles(gpu, &with, "shadow.shadow_maps").0 > 0, "{scene}: the ceiling is left out");
        let same = new.iter().zip(&old).filter(|(n, o)| n == o).count();
        assert!(same * 50 > new.len() * 49, "{scene}: {same} of {} values are the same", new.len());
    }
}

/// The figure for views in all directions from within a scene is at best 6, the faces of a cube.
#[test]
fn a_face_of_a_cube_draws_less_than_a_quarter_of_the_scene() {
    let gpu = &device::gpu();
    for (scene, grid) in [("hall.ron", "grid=4"), ("hall.ron", "grid=8"), ("art_gallery.ron", "grid=4")] {
        let mut s = session(gpu, "uniform_grid.ron", scene, &[grid, "face=2", "bounces=1"], Culled::Unseen, &["sh"]);
        s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let (drawn, whole) = triangles(gpu, &s, "capture.capture");
        assert!(drawn * 4 <= whole && drawn > 0, "{scene}, {grid}: {drawn} of {whole} triangles are drawn");
    }
}

/// Half a centimetre off, half of the triangles: what is seen through the probes hardly changes. With
/// eight probes of coarse faces the light is off by 0.29 %, with 64 of fine ones by 0.57 %.
#[test]
fn simplified_captures_take_fewer_triangles_and_leave_the_light() {
    let gpu = &device::gpu();
    let made = |tolerance: &str| {
        let set = ["grid=2", "face=8", "bounces=1", tolerance];
        let mut s = session(gpu, "uniform_grid.ron", "art_gallery.ron", &set, Culled::Unseen, &["indirect"]);
        s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        (s.image(gpu, "indirect").unwrap_or_else(|f| panic!("{f}")), triangles(gpu, &s, "capture.capture").0)
    };
    let ((all, many), (some, few)) = (made("capture_tolerance=0"), made("capture_tolerance=0.005"));
    assert!(few * 2 < many, "{few} of {many} triangles are drawn");
    let off = compare(&some, &all, None).unwrap_or_else(|f| panic!("{f}")).rmse_percent;
    assert!(off > 0.0 && off < 0.6, "indirect light is off by {off} %");
}

/// To begin a draw costs more than a handful of triangles.
#[test]
fn a_small_scene_is_one_draw_a_member() {
    let gpu = &device::gpu();
    let s = session(gpu, "uniform_grid.ron", "cornell_point.gltf", &["grid=2", "face=2"], Culled::Unseen, &["sh"]);
    let draws = s.plan.steps.iter().filter_map(|step| match &step.action {
        Action::Draw(draw) => draw.indirect.map(|i| i.first + i.second),
        _ => None,
    });
    assert_eq!(draws.collect::<Vec<_>>(), [1, 1], "shadow maps and capture");
}
