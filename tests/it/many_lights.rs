//! Lights lit in groups, held against all lights lit one by one: by the same graph, and by the path tracer.

use crate::device::{self, Shot};
use crate::support;
use lightgraph::internals::image::metrics::{Metrics, compare};
use lightgraph::internals::session::plan_for;
use lightgraph::{Image, Project, Scene, Settings};

const GRAPH: &str = "graphs/gi/many_lights.ron";

fn lamps(count: u32, size: u32, set: &'static str) -> Shot<'static> {
    let scene = match count {
        16 => "scenes/lamps_16.glb",
        64 => "scenes/lamps_64.glb",
        1024 => "scenes/lamps_1024.glb",
        _ => panic!("no scene with {count} lamps"),
    };
    Shot { set, ..Shot::new(GRAPH, scene, size) }
}

fn compared(test: &Image, expected: &Image) -> Metrics {
    compare(test, expected, None).unwrap_or_else(|f| panic!("{f}"))
}

/// The mean of a channel over the image.
fn mean(image: &Image, channel: usize) -> f64 {
    let pixels = image.data.chunks(image.channels as usize);
    pixels.map(|p| f64::from(p[channel])).sum::<f64>() / image.pixel_count() as f64
}

/// With no error allowed every light has a ray of its own, as the path tracer's have.
#[test]
fn each_light_by_itself_is_what_the_path_tracer_sums_up() {
    for count in [16, 1024] {
        let shot = lamps(count, 32, "error_seen=0 bounces=0");
        let [direct] = shot.render(["direct"]);
        let traced = Shot { graph: "graphs/gi/pathtrace.ron", set: "samples=1 bounces=0", ..shot };
        let [expected] = traced.render(["direct"]);
        let m = compared(&direct, &expected);
        println!("{count} lamps: bias {:+.4} %, 95 % within {:.2e}", m.bias_percent, m.p95_error);
        // A pixel at an edge may see the other surface.
        assert!(m.mean_reference > 0.1 && m.bias_percent.abs() <= 0.1, "{count} lamps: {m:?}");
        assert!(m.p95_error <= 1e-3 * m.mean_reference, "{count} lamps: {m:?}");
    }
}

/// What groups cost in the image, directly and after bounces.
#[test]
fn groups_of_lights_leave_little_error() {
    let small = "grid=2,2,2 face=8";
    let [direct, indirect] = lamps(1024, 48, small).render(["direct", "indirect"]);
    let [wanted, wanted_indirect] =
        lamps(1024, 48, "grid=2,2,2 face=8 error_seen=0 error_captured=0").render(["direct", "indirect"]);
    let [of_direct, of_indirect] = [compared(&direct, &wanted), compared(&indirect, &wanted_indirect)];
    println!(
        "direct: rmse {:.2} %, bias {:+.2} %; indirect: rmse {:.2} %, bias {:+.2} %",
        of_direct.rmse_percent, of_direct.bias_percent, of_indirect.rmse_percent, of_indirect.bias_percent
    );
    assert!(of_direct.rmse_percent > 0.0, "groups are lit as one");
    assert!(of_direct.rmse_percent <= 3.0 && of_direct.bias_percent.abs() <= 1.5, "{of_direct:?}");
    assert!(of_indirect.rmse_percent <= 1.5 && of_indirect.bias_percent.abs() <= 1.5, "{of_indirect:?}");
}

/// Rays and rows of the tree are counted, not timed: sixteen times the lights take a few times the work.
#[test]
fn the_work_grows_less_than_the_lights() {
    let effort = |count: u32, set| {
        let [image] = lamps(count, 32, set).render(["effort"]);
        (mean(&image, 0), mean(&image, 1))
    };
    let [few, many] = [64, 1024].map(|count| effort(count, ""));
    println!("rays and rows a pixel: 64 lamps {few:?}, 1024 {many:?}");
    assert!(many.0 <= 5.0 * few.0 && many.1 <= 5.0 * few.1, "{few:?}, {many:?}");
    // Without groups, every lamp above the surface's horizon has a ray.
    let each = effort(1024, "error_seen=0");
    println!("by themselves {each:?}");
    assert!(each.0 > 512.0 && each.0 <= 1024.0 && many.0 <= each.0 / 3.0, "{each:?}, {many:?}");
}

/// Rows of lights lie in uniforms as far as they fit there in every device, else in tables.
#[test]
fn the_fast_grid_takes_as_many_lights_as_shadow_maps_have_layers() {
    let gpu = device::gpu();
    let project = Project::open(&support::repository("graphs/gi/fast_grid.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}"));
    let mut scene = Scene::clone(&loaded.scene);
    let lamp = scene.lights[0].clone();
    let params = project.params(&["shadow_size=16".to_string()]).unwrap_or_else(|f| panic!("{f}"));
    // A texture has 2,048 layers at most.
    for count in [1, 133, 134, 150, 170, 171, 341] {
        scene.lights = vec![lamp.clone(); count];
        let settings = Settings { params: params.clone(), size: [16, 12], ..Settings::default() };
        plan_for(&project, &scene, &settings, &gpu).unwrap_or_else(|f| panic!("{count} lights: {f}"));
    }
}
