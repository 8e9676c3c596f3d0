//! Devices that lack what others have: what can't be done is told with a remedy, and all else goes on.

use crate::device;
use crate::support::{Scratch, repository};
use lightgraph::{Checked, FrameReport, Gpu, Image, Project, Scene, Session, Settings};
use std::fs;
use std::path::Path;

/// A device of the same adapter with none of the features that graphs may go without: no timestamps, no filtering of
/// 32-bit floats, no draws that begin at an instance of the device's choice.
fn bare(full: &Gpu) -> Gpu {
    let request = full.adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("bare"),
        required_limits: full.adapter.limits(),
        ..Default::default()
    });
    let (device, queue) = pollster::block_on(request).unwrap_or_else(|e| panic!("{e}"));
    let gpu = Gpu::from_parts(full.adapter.clone(), device, queue);
    assert!(!gpu.features.intersects(wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::FLOAT32_FILTERABLE));
    gpu
}

fn frame(gpu: &Gpu, graph: &Path) -> Checked<(FrameReport, Image)> {
    let project = Project::open(graph, &[])?;
    let settings = Settings { size: [24, 16], outputs: Some(vec!["color".into()]), ..Settings::default() };
    let scene = Scene::load(&repository("scenes/lambert_plane"))?.scene;
    let mut session = Session::new(gpu, &project, scene, settings)?;
    let report = session.frame(gpu, 0, 0.0)?;
    Ok((report, session.image(gpu, "color")?))
}

#[test]
fn without_timestamps_the_image_is_the_same_and_the_hosts_times_are_left() {
    let full = device::gpu();
    let bare = bare(&full);
    let render = |gpu: &Gpu| frame(gpu, &repository("graphs/gi/direct.ron")).unwrap_or_else(|f| panic!("{f}"));
    let ((_, expected), (untimed, image)) = (render(&full), render(&bare));
    assert_eq!(image.data, expected.data);
    assert!(untimed.steps.iter().all(|s| s.gpu_ms.is_none()), "{:?}", untimed.steps);
    assert!(untimed.steps.iter().any(|s| s.cpu_ms > 0.0) && untimed.wall_ms > 0.0, "{:?}", untimed.steps);
}

#[test]
fn without_filterable_floats_the_place_and_the_remedy_are_told() {
    const GRAPH: &str = r#"Graph(
        about: "One colour, filtered",
        resources: {
            "flat": Texture(format: Rgba32Float, size: (2, 2), initial: (0.5, 0.25, 0, 1)),
            "smooth_sampler": Sampler(filter: Linear, address: Clamp),
            "color": Texture(format: Rgba32Float, size: "screen"),
        },
        passes: [Screen(name: "paint", shader: "paint.wgsl", color: "color")],
        outputs: {"color": "color"},
    )"#;
    const PAINT: &str = "var flat: texture_2d<f32>;
var smooth_sampler: sampler;
@fragment fn paint() -> @location(0) vec4f { return textureSampleLevel(flat, smooth_sampler, vec2f(0.5), 0.0); }
";
    let full = device::gpu();
    let bare = bare(&full);
    let scratch = Scratch::new("unfilterable");
    let graph = scratch.path().join("graph.ron");
    fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    fs::write(&graph, GRAPH).unwrap();
    fs::write(scratch.path().join("shaders/paint.wgsl"), PAINT).unwrap();
    let faults = frame(&bare, &graph).expect_err("32-bit floats can't be filtered here").to_string();
    for words in ["can't be filtered on this adapter", "use textureLoad, or a 16-bit format", "paint.wgsl:1:"] {
        assert!(faults.contains(words), "{words}: {faults}");
    }
    if full.features.contains(wgpu::Features::FLOAT32_FILTERABLE) {
        frame(&full, &graph).unwrap_or_else(|f| panic!("{f}"));
    }
    // The remedy is one, and the device goes on.
    fs::write(&graph, GRAPH.replacen("Rgba32Float", "Rgba16Float", 1)).unwrap();
    let (_, image) = frame(&bare, &graph).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(image.pixel(0, 3, 3).unwrap()[..2], [0.5, 0.25]);
}
