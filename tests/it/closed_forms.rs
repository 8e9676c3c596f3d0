//! Light whose amount is known on paper, in every pixel.

use crate::device::{Shot, gpu};
use crate::support::{Scratch, repository};
use glam::{Mat4, Vec3};
use lightgraph::internals::gpu::{FrameInputs, execute, prepare, read_image};
use lightgraph::internals::plan::build::{Options, plan_with};
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::Request;
use lightgraph::internals::value::Value;
use lightgraph::{Image, Project, Scene};
use std::f64::consts::PI;

const GRID: &str = "graphs/gi/uniform_grid.ron";

/// Every channel of every pixel lies within `share` of `expected`.
fn uniform(image: &Image, expected: f64, share: f64, what: &str) {
    for (i, pixel) in image.rgb().enumerate() {
        for value in pixel {
            let error = f64::from(value) / expected - 1.0;
            assert!(error.abs() <= share, "{what}: pixel {i} is {value}, not {expected:.6} (off by {error:.2e})");
        }
    }
}

/// A point light over a Lambert plane: L = ρ/π · I·cosθ/d², from below the light to where the light grazes.
#[test]
fn direct_light_on_a_plane_follows_its_closed_form() {
    let size = 64;
    let [image] = Shot::new("graphs/gi/direct.ron", "scenes/lambert_plane.glb", size).render(["direct"]);
    let scene = Scene::load(&repository("scenes/lambert_plane.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let pose = scene.pose(0.0);
    let (values, _) = scene.camera_values(&pose, None, size, size).unwrap_or_else(|f| panic!("{f}"));
    let Some(Value::Mat4(inverse)) = values.get("camera_inverse_view_projection") else { panic!("{values:?}") };
    let (lamp, intensity, albedo) = (Vec3::new(0.0, 1.0, 0.0), 10.0, 0.5);
    let mut seen = 0;
    for (i, pixel) in image.rgb().enumerate() {
        let point = on_ground(*inverse, i as u32 % size, i as u32 / size, size);
        if point.abs().max_element() > 9.9 {
            continue;
        }
        seen += 1;
        let to_lamp = lamp - point;
        let (d2, cosine) = (f64::from(to_lamp.length_squared()), f64::from(to_lamp.normalize().y));
        let expected = albedo / PI * intensity * cosine / d2;
        for value in pixel {
            let error = f64::from(value) / expected - 1.0;
            assert!(error.abs() < 1e-3, "pixel {i}, {point}: {value}, not {expected:.6} (off by {error:.2e})");
        }
    }
    assert!(seen > size * size / 2, "the camera sees the plane in {seen} pixels only");
}

/// Where the ray through a pixel's centre meets y = 0.
fn on_ground(inverse: Mat4, x: u32, y: u32, size: u32) -> Vec3 {
    let ndc = |t: u32| (t as f32 + 0.5) / size as f32 * 2.0 - 1.0;
    let at = |z: f32| inverse.project_point3(Vec3::new(ndc(x), -ndc(y), z));
    let (a, b) = (at(0.0), at(1.0));
    a + (b - a) * (a.y / (a.y - b.y))
}

/// A closed box whose walls emit 1 and reflect ρ: 1 + ρ + … + ρⁿ⁺¹ after n indirect bounces (what emitters light at
/// once is direct), 1/(1 − ρ) in the end, at every point and in every direction, whatever the grid.
#[test]
fn furnaces_reach_the_sum_of_their_bounces_in_every_pixel() {
    for (scene, albedo) in [("furnace.glb", 0.5f64), ("furnace_80.glb", 0.8), ("furnace_95.glb", 0.95)] {
        let path = format!("scenes/{scene}");
        let shot = |set: &str| {
            let [image] = Shot { set, ..Shot::new(GRID, &path, 32) }.render(["color"]);
            image
        };
        for bounces in [0, 1, 2, 5] {
            let sum: f64 = (0..=bounces + 1).map(|k| albedo.powi(k)).sum();
            let image = shot(&format!("grid=2,2,2 face=16 epsilon=0 bounces={bounces}"));
            uniform(&image, sum, 0.002, &format!("{scene} after {bounces} bounces"));
        }
        // ρⁿ < 10⁻⁴ of the whole.
        let bounces = (1e-5f64.ln() / albedo.ln()).ceil();
        let image = shot(&format!("grid=3,2,1 face=16 epsilon=0 bounces={bounces}"));
        uniform(&image, 1.0 / (1.0 - albedo), 0.005, &format!("{scene} in the limit"));
    }
}

/// No light reaches a sealed room beside a lit one.
#[test]
fn direct_light_does_not_pass_a_wall() {
    let shot = Shot::new("graphs/gi/direct.ron", "scenes/two_rooms.glb", 64);
    let [dark] = Shot { camera: Some("dark"), ..shot }.render(["direct"]);
    let brightest = dark.rgb().flatten().fold(0.0f32, f32::max);
    assert!(brightest == 0.0, "a pixel of the dark room holds {brightest}");
    let [lit] = Shot { camera: Some("lit"), ..shot }.render(["direct"]);
    assert!(lit.rgb().flatten().fold(0.0f32, f32::max) > 0.01);
}

/// The same inputs on the same adapter give the same bits.
#[test]
fn two_runs_give_the_same_bits() {
    let shot = Shot { set: "grid=3,3,3", ..Shot::new(GRID, "scenes/cornell.glb", 64) };
    let outputs = ["color", "direct", "indirect", "sh"];
    let (first, second) = (shot.render(outputs), shot.render(outputs));
    for ((name, a), b) in outputs.iter().zip(first).zip(second) {
        assert!(bits(&a) == bits(&b), "`{name}` differs between two runs");
    }
}

/// Neither shared memory nor another legal order may be seen in an image.
#[test]
fn sharing_and_order_leave_no_trace() {
    let device = gpu();
    let project = Project::open(&repository(GRID), &[]).unwrap_or_else(|f| panic!("{f}"));
    let params = project.params(&["grid=2,2,2".to_string()]).unwrap_or_else(|f| panic!("{f}"));
    let scene = Scene::load(&repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let (pose, facts) = (scene.pose(0.0), scene.facts());
    let request = Request {
        graph: &project.graph,
        texts: &project.texts,
        params: &params,
        facts: &facts,
        screen: [48, 48],
        outputs: None,
        choices: &FIRST,
        levels: &[],
        limits: &device.limits,
        features: device.features,
    };
    let (mut values, _) = scene.camera_values(&pose, None, 48, 48).unwrap_or_else(|f| panic!("{f}"));
    let still = [("frame", Value::Uint(0)), ("first_frame", Value::Bool(true)), ("time", Value::Float(0.0))];
    values.extend(still.map(|(name, value)| (name.into(), value)));
    let run = |options: Options| {
        let plan = plan_with(&request, options).unwrap_or_else(|f| panic!("{f}")).plan;
        let mut prepared =
            prepare(&device, &plan, &scene.assets(), &scene.tables(&pose)).unwrap_or_else(|f| panic!("{f}"));
        let frame = FrameInputs { values: values.clone(), ..FrameInputs::default() };
        execute(&device, &plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"));
        let read = |id| read_image(&device, &prepared, &plan, id).unwrap_or_else(|f| panic!("{f}"));
        plan.outputs.iter().map(|(name, id)| (name.clone(), bits(&read(*id)))).collect::<Vec<_>>()
    };
    let usual = run(Options::default());
    for options in [
        Options { share: false, ..Options::default() },
        Options { order_seed: 1, ..Options::default() },
        Options { order_seed: 29, ..Options::default() },
    ] {
        for ((name, a), (_, b)) in usual.iter().zip(run(options)) {
            assert!(*a == b, "`{name}` differs with {options:?}");
        }
    }
}

fn bits(image: &Image) -> Vec<u32> {
    image.data.iter().map(|x| x.to_bits()).collect()
}

/// A lamp in the very plane of the ceiling lights the room as by shadow maps, which begin a way off. By rounding the
/// ceiling hid it from half of the rays before.
#[test]
fn what_a_lamp_lies_on_does_not_hide_it() {
    let file = repository("scenes/cornell_point.gltf");
    let top = Scene::load(&file).unwrap_or_else(|f| panic!("{f}")).scene.bounds.max.y;
    let text = std::fs::read_to_string(&file).expect("a scene");
    let mut document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let nodes = document["nodes"].as_array_mut().expect("nodes");
    let lamp = nodes.iter_mut().find(|n| n["extensions"].is_object()).expect("a lamp");
    lamp["translation"][1] = top.into();
    let scratch = Scratch::new("lamp-on-ceiling");
    let path = scratch.path().join("room.gltf");
    std::fs::write(&path, document.to_string()).expect("a scene");
    let [by_maps, by_rays] = ["direct", "final_gather"].map(|graph| {
        let graph = format!("graphs/gi/{graph}.ron");
        let [image] = Shot::new(&graph, &path.display().to_string(), 32).render(["direct"]);
        image.rgb().map(|p| f64::from(p.iter().sum::<f32>())).sum::<f64>()
    });
    assert!((by_rays / by_maps - 1.0).abs() <= 0.02, "{by_rays}, not {by_maps}");
}
