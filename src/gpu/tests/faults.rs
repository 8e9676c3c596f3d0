use crate::gpu::testing::{Sketch, faults, gpu, run};
use crate::gpu::{FrameInputs, Gpu, execute, prepare, read_image};
use crate::plan::{Comparison, Cull, DrawGeometry, Ending, Loop, OrderNode, Place, ResourceId, TextureKind, Until};
use crate::scene;
use wgpu::TextureFormat as F;

#[test]
fn sizes_beyond_the_device_name_both_numbers_all_at_once() {
    let mut s = Sketch::new();
    let most = gpu().limits.max_texture_dimension_2d;
    s.image("wide", F::R8Unorm, most + 1, 1);
    let layers = gpu().limits.max_texture_array_layers;
    s.texture("deep", TextureKind::D2 { array: true }, F::R8Unorm, [1, 1, layers + 1]);
    s.image("flat", F::R8Unorm, 1, 0);
    let text = faults(s.order([]));
    for part in ["`wide`", "`deep`", "`flat`", &format!("{}", most + 1), &format!("allows {most}"), "height of 0"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
}

#[test]
fn a_graph_that_asks_for_more_memory_than_is_sane_is_refused() {
    let mut s = Sketch::new();
    s.image("huge", F::R8Unorm, 1, 1);
    s.plan.slots[0].bytes = 9 << 30;
    let text = faults(s.order([]));
    assert!(text.contains("9.00 GiB") && text.contains("`huge`"), "{text}");
}

#[test]
fn limits_are_those_of_the_device_at_hand() {
    let gpu = Gpu::noop(wgpu::Limits::downlevel_defaults()).unwrap_or_else(|f| panic!("{f}"));
    let mut s = Sketch::new();
    s.image("wide", F::Rgba8Unorm, 4096, 1);
    let plan = s.order([]);
    let text = match prepare(&gpu, &plan, &scene::Assets::new(&scene::Geometry::default(), None), &[]) {
        Ok(_) => panic!("it fits"),
        Err(f) => f.to_string(),
    };
    assert!(text.contains("allows 2048"), "{text}");
}

#[test]
fn the_devices_own_faults_name_the_step_when_it_is_built() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 1, 1);
    // The image gives no unsigned integers.
    s.buffer("out", 4);
    let bad = s.compute(
        "bad_step",
        "var image: texture_2d<u32>; var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1) fn main() { out[0] = textureLoad(image, vec2u(0), 0).x; }",
        [1, 1, 1],
    );
    let text = faults(s.order([bad]));
    assert!(text.contains("`bad_step`"), "{text}");
}

#[test]
fn the_devices_own_faults_name_the_step_when_it_runs() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 4, 4);
    let wgsl = "@fragment fn main() -> @location(0) vec4f { return vec4f(1.0); }";
    let good = s.screen("good_step", wgsl, "image");
    let place = [Place::Rect([2, 2, 4, 4])];
    let bad = s.draw("bad_step", wgsl, DrawGeometry::Screen, (&["image"], None), &place);
    let text = faults(s.order([good, bad]));
    assert!(text.contains("can't run `bad_step`") && !text.contains("good_step"), "{text}");

    // The device is still good.
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 4, 4);
    let good = s.screen("good_step", wgsl, "image");
    assert_eq!(run(s.order([good])).image("image").data, [1.0; 64]);
}

#[test]
fn a_texture_that_a_step_reads_and_writes_is_the_steps_fault() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 4, 4);
    let wgsl = "var image: texture_2d<f32>;
        @fragment fn main() -> @location(0) vec4f { return textureLoad(image, vec2u(0), 0); }";
    let bad = s.screen("feedback", wgsl, "image");
    let text = faults(s.order([bad]));
    assert!(text.contains("`feedback`"), "{text}");
}

#[test]
fn a_value_that_nothing_gives_names_shader_and_member() {
    let mut s = Sketch::new();
    s.plan.values.insert("bounces".into(), crate::value::Value::Float(1.5));
    s.plan.values.insert("grid".into(), crate::value::Value::Uint(1));
    s.buffer("out", 4);
    let bad = s.compute(
        "bad",
        "struct Values { bouncs: f32, bounces: u32 } var<uniform> values: Values;
        var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(1) fn main() { out[0] = values.bouncs + f32(values.bounces); }",
        [1, 1, 1],
    );
    let text = faults(s.order([bad]));
    for part in ["bad.wgsl", "`values.bouncs`", "did you mean `bounces`?", "`values.bounces` is u32"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
}

#[test]
fn a_layer_that_the_target_lacks_is_refused() {
    let mut s = Sketch::new();
    s.texture("image", TextureKind::D2 { array: true }, F::Rgba32Float, [4, 4, 2]);
    let wgsl = "@fragment fn main() -> @location(0) vec4f { return vec4f(1.0); }";
    let bad = s.draw("bad", wgsl, DrawGeometry::Screen, (&["image"], None), &[Place::Layer(2)]);
    let text = faults(s.order([bad]));
    assert!(text.contains("layer 2 of `image`, which has 2"), "{text}");
}

#[test]
fn an_attribute_that_vertices_lack_and_a_missing_table_are_named() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 4, 4);
    let wgsl =
        "@vertex fn vertex(@location(0) positon: vec3f) -> @builtin(position) vec4f { return vec4f(positon, 1.0); }
        @fragment fn main() -> @location(0) vec4f { return vec4f(1.0); }";
    let cull = Cull::Material;
    let bad = s.draw("bad", wgsl, DrawGeometry::Scene { cull }, (&["image"], None), &[Place::Whole]);
    let text = faults(s.order([bad]));
    assert!(text.contains("`positon`") && text.contains("did you mean `position`?"), "{text}");

    let mut s = Sketch::new();
    s.buffer("out", 4);
    let bad = s.compute(
        "bad",
        "struct Row { kind: u32 } var<storage, read> lights: array<Row>; var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1) fn main() { out[0] = lights[0].kind; }",
        [1, 1, 1],
    );
    let text = faults(s.order([bad]));
    assert!(text.contains("no table `lights`"), "{text}");
}

#[test]
fn a_loop_that_tests_a_texture_is_refused() {
    let mut s = Sketch::new();
    let buffer = s.image("image", F::Rgba32Float, 4, 4);
    let until = Some(Until { buffer, comparison: Comparison::Less, value: 0.0, ending: Ending::Device });
    let text = faults(s.order([OrderNode::Loop(Loop { name: "l".into(), count: 1, until, body: vec![] })]));
    assert!(text.contains("`l`") && text.contains("`image`"), "{text}");
}

#[test]
fn a_lost_device_is_a_fault_and_no_panic() {
    let gpu = Gpu::open().unwrap_or_else(|e| panic!("{}", crate::diag::Faults::from(e)));
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 4, 4);
    let step = s.screen("step", "@fragment fn main() -> @location(0) vec4f { return vec4f(1.0); }", "image");
    let plan = s.order([step]);
    let mut prepared = prepare(&gpu, &plan, &scene::Assets::new(&scene::Geometry::default(), None), &[]).unwrap();
    gpu.device.destroy();
    let text = execute(&gpu, &plan, &mut prepared, &FrameInputs::default()).unwrap_err().to_string();
    assert!(text.contains("the device is lost"), "{text}");
    assert!(read_image(&gpu, &prepared, &plan, ResourceId(0)).is_err());
    assert!(prepare(&gpu, &plan, &scene::Assets::new(&scene::Geometry::default(), None), &[]).is_err());
}
