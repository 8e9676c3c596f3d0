//! Where the planes of a non-uniform grid stand.

use crate::device::gpu;
use crate::support::{Scratch, repository};
use glam::DVec3;
use lightgraph::internals::gpu::read_bytes;
use lightgraph::internals::scene::Table;
use lightgraph::internals::value::Value;
use lightgraph::{Memory, Project, Scene, Session, Settings};

const BINS: usize = 64;
const COUNTS: [usize; 3] = [7, 4, 6];
const CROWDING: f64 = 0.6;
const INSET: f64 = 0.5;

/// The planes as the shaders place them, along x, then y, then z, for a camera that says nothing.
fn placed(scene: Scene) -> Vec<f32> {
    let gpu = gpu();
    let scratch = Scratch::new("planes");
    let variant = scratch.path().join("variant.ron");
    let text = r#"Variant(base: "lightgraph:graphs/gi/nonuniform_grid.ron", about: "for tests", outputs: {"probe_axes": "probe_axes"})"#;
    std::fs::write(&variant, text).unwrap();
    let project = Project::open(&variant, &[repository("shaders")]).unwrap_or_else(|f| panic!("{f}"));
    let [x, y, z] = COUNTS;
    let set = format!("grid={x},{y},{z} crowding={CROWDING} inset={INSET} seen=0 face=2");
    let set: Vec<String> = set.split_whitespace().map(String::from).collect();
    let settings = Settings {
        params: project.params(&set).unwrap_or_else(|f| panic!("{f}")),
        size: [8, 8],
        outputs: Some(vec!["probe_axes".into()]),
        ..Settings::default()
    };
    let mut session = Session::new(&gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let id = session.output("probe_axes").unwrap_or_else(|f| panic!("{f}"));
    let Ok(Memory::Buffer(buffer)) = session.memory(id) else { panic!("`probe_axes` is no buffer") };
    let bytes = read_bytes(&gpu, buffer, "probe_axes").unwrap_or_else(|f| panic!("{f}"));
    bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&bytes).iter().map(|row| row[0]).collect()
}

fn corner(triangles: &Table, name: &str, row: usize) -> DVec3 {
    let column = triangles.column(name);
    match column.and_then(|c| c.get(row)) {
        Some(Value::Vec3(v)) => v.as_dvec3(),
        other => panic!("{name} of {row}: {other:?}"),
    }
}

/// Where planes stand along an axis: at even steps of a mixture of its length and of the area of surfaces along it.
fn stated(triangles: &Table, axis: usize, [low, high]: [f64; 2]) -> Vec<f64> {
    let width = (high - low) / BINS as f64;
    let mut areas = [0.0; BINS];
    for row in 0..triangles.rows {
        let [a, b, c] = ["a", "b", "c"].map(|name| corner(triangles, name, row));
        let mut across = (b - a).cross(c - a);
        across[axis] = 0.0;
        let ends = [a[axis], b[axis], c[axis]];
        let [first, last] = [ends.into_iter().fold(f64::MAX, f64::min), ends.into_iter().fold(f64::MIN, f64::max)];
        for (bin, area) in areas.iter_mut().enumerate() {
            let start = low + bin as f64 * width;
            let overlap = last.min(start + width) - first.max(start);
            if overlap > 0.0 {
                *area += 0.5 * across.length() * overlap / (last - first).max(1e-12);
            }
        }
    }
    let total: f64 = areas.iter().sum();
    let even = 1.0 / BINS as f64;
    let shares = areas.map(|area| even + CROWDING * (area / total - even));
    let count = COUNTS[axis];
    let plane = |i: usize| {
        let mut left = (i as f64 + INSET) / ((count - 1) as f64 + 2.0 * INSET);
        let mut bin = 0;
        while bin + 1 < BINS && left > shares[bin] {
            left -= shares[bin];
            bin += 1;
        }
        low + (bin as f64 + left / shares[bin]) * width
    };
    (0..count).map(plane).collect()
}

/// The gallery has more triangles than a software driver lets a loop have rounds.
#[test]
fn planes_stand_where_surfaces_are_however_many() {
    for (file, least) in [("scenes/hall.ron", 0), ("scenes/art_gallery.ron", 65_536)] {
        let scene = Scene::load(&repository(file)).unwrap_or_else(|f| panic!("{f}")).scene;
        let facts = scene.facts();
        let corners = ["grid_min", "grid_max"].map(|name| match facts.get(name) {
            Some(Value::Vec3(v)) => v.as_dvec3(),
            other => panic!("{name}: {other:?}"),
        });
        let tables = scene.tables_named(&scene.pose(0.0), |name| name == "triangles");
        let triangles = tables.first().expect("every scene has triangles").clone();
        assert!(triangles.rows > least, "{file}: {} triangles", triangles.rows);
        let found = placed(scene);
        let ends = |axis: usize| corners.map(|c| c[axis]);
        let expected =
            (0..3).flat_map(|axis| stated(&triangles, axis, ends(axis)).into_iter().map(move |at| (axis, at)));
        for (i, (axis, at)) in expected.enumerate() {
            let [low, high] = ends(axis);
            let off = (f64::from(found[i]) - at).abs() / (high - low);
            assert!(off < 1e-4, "{file}: plane {i}, along axis {axis}, stands at {}, not at {at}", found[i]);
        }
    }
}
