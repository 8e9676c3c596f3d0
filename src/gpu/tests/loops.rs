use crate::gpu::testing::{Sketch, quads, run, run_scene};
use crate::plan::{Comparison, Cull, DrawGeometry, Ending, Loop, OrderNode, Place, TextureKind, Until};
use wgpu::TextureFormat as F;

const HALVE: &str = "
var<storage, read_write> number: array<f32>;
@compute @workgroup_size(1) fn main() { number[0] *= 0.5; }";

fn looped(name: &str, count: u32, until: Option<Until>, body: Vec<OrderNode>) -> OrderNode {
    OrderNode::Loop(Loop { name: name.into(), count, until, body })
}

#[test]
fn a_loop_without_a_test_takes_all_its_iterations_and_tells_their_index() {
    let mut s = Sketch::new();
    s.buffer("sums", 4 * 12);
    let note = s.compute(
        "note",
        "struct Values { inner: u32, outer: u32 }
        var<uniform> values: Values;
        var<storage, read_write> sums: array<u32>;
        @compute @workgroup_size(1) fn main() {
            sums[values.outer * 4u + values.inner] += 100u + values.outer * 10u + values.inner;
        }",
        [1, 1, 1],
    );
    let inner = looped("inner", 4, None, vec![note]);
    let ran = run(s.order([looped("outer", 3, None, vec![inner])]));
    let want: Vec<u32> = (0..12).map(|i| 100 + i / 4 * 10 + i % 4).collect();
    assert_eq!(ran.words("sums"), want);
    assert_eq!(ran.report.steps[0].runs, 12);
    let loops: Vec<(&str, u32)> = ran.report.loops.iter().map(|l| (l.name.as_str(), l.iterations)).collect();
    assert_eq!(loops, [("inner", 4), ("inner", 4), ("inner", 4), ("outer", 3)]);
}

/// Both ways to end a loop.
fn endings() -> [Ending; 2] {
    [Ending::Device, Ending::Host { why: "for comparison".into() }]
}

#[test]
fn a_loop_ends_after_the_iteration_that_passes_the_test() {
    for (ending, count) in endings().into_iter().flat_map(|e| [(e.clone(), 10), (e, 100)]) {
        let mut s = Sketch::new();
        let buffer = s.buffer("number", 4);
        s.plan.resources[0].initial = Some([1.0; 4]);
        s.plan.resources[0].history = true;
        let halve = s.compute("halve", HALVE, [1, 1, 1]);
        let until = Until { buffer, comparison: Comparison::Less, value: 0.2, ending };
        let ran = run(s.order([looped("l", count, Some(until), vec![halve])]));
        assert_eq!(ran.floats("number"), [0.125]);
        assert_eq!((ran.report.loops[0].iterations, ran.report.loops[0].last), (3, Some(0.125)));
        assert_eq!(ran.report.steps[0].runs, 3);
        assert!(ran.report.warnings.is_empty());
    }
}

#[test]
fn each_comparison_is_the_same_on_the_device_as_by_the_host() {
    use Comparison::{Greater, GreaterEqual, Less, LessEqual};
    for (comparison, value, iterations) in
        [(Less, 0.25, 3), (LessEqual, 0.25, 2), (Greater, 0.4, 1), (GreaterEqual, 0.5, 1), (Greater, 0.5, 5)]
    {
        for ending in endings() {
            let mut s = Sketch::new();
            let buffer = s.buffer("number", 4);
            s.plan.resources[0].initial = Some([1.0; 4]);
            s.plan.resources[0].history = true;
            let halve = s.compute("halve", HALVE, [1, 1, 1]);
            let until = Until { buffer, comparison, value, ending };
            let ran = run(s.order([looped("l", 5, Some(until), vec![halve])]));
            assert_eq!(ran.report.loops[0].iterations, iterations, "{comparison:?} {value}");
        }
    }
}

/// What draws after the end would clear the target, or count once more.
#[test]
fn nothing_is_drawn_after_the_end_of_a_loop_on_the_device() {
    for ending in endings() {
        let mut s = Sketch::new();
        let buffer = s.buffer("number", 4);
        s.plan.resources[0].initial = Some([1.0; 4]);
        s.plan.resources[0].history = true;
        s.texture("image", TextureKind::D2 { array: true }, F::Rgba32Float, [2, 2, 4]);
        s.image("tiles", F::Rgba32Float, 4, 4);
        let halve = s.compute("halve", HALVE, [1, 1, 1]);
        let layers = "var<uniform> l: u32;
            @vertex fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f { return vec4f(position, 1.0); }
            @fragment fn fragment() -> @location(0) vec4f { return vec4f(f32(l) + 1.0); }";
        let scene = DrawGeometry::Scene { cull: Cull::Material };
        let draw = s.draw("draw", layers, scene, (&["image"], None), &[Place::LoopLayer(0)]);
        let screen =
            s.draw("screen", SCREEN_LOOP, DrawGeometry::Screen, (&["tiles"], None), &[Place::Rect([2, 2, 2, 2])]);
        let until = Until { buffer, comparison: Comparison::Less, value: 0.3, ending };
        let ran = run_scene(s.order([looped("l", 4, Some(until), vec![halve, draw, screen])]), &quads(), &[]);
        let image = ran.image("image");
        let of_layer: Vec<f32> = image.data.chunks(16).map(|layer| layer[0]).collect();
        assert_eq!(of_layer, [1.0, 2.0, 0.0, 0.0]);
        let tiles = ran.image("tiles");
        assert_eq!((tiles.data[0], tiles.data[4 * 15]), (0.0, 2.0));
    }
}

const SCREEN_LOOP: &str = "var<uniform> l: u32;
    @fragment fn fragment() -> @location(0) vec4f { return vec4f(f32(l) + 1.0); }";

#[test]
fn a_loop_stops_and_warns_when_its_number_is_none() {
    for ending in endings() {
        let mut s = Sketch::new();
        let buffer = s.buffer("number", 4);
        s.plan.resources[0].initial = Some([f64::NAN; 4]);
        s.plan.resources[0].history = true;
        let halve = s.compute("halve", HALVE, [1, 1, 1]);
        let until = Until { buffer, comparison: Comparison::Less, value: 0.2, ending };
        let ran = run(s.order([looped("l", 10, Some(until), vec![halve])]));
        assert_eq!(ran.report.loops[0].iterations, 1);
        assert!(ran.report.warnings[0].message.contains("`l`"), "{:?}", ran.report.warnings);
    }
}

#[test]
fn thousands_of_runs_are_all_timed_and_all_done() {
    let mut s = Sketch::new();
    s.buffer("number", 4);
    let add = s.compute(
        "add",
        "var<storage, read_write> number: array<f32>;
        @compute @workgroup_size(1) fn main() { number[0] += 1.0; }",
        [1, 1, 1],
    );
    let ran = run(s.order([looped("l", 5000, None, vec![add])]));
    assert_eq!(ran.floats("number"), [5000.0]);
    assert_eq!(ran.report.steps[0].runs, 5000);
    let timed = crate::gpu::testing::gpu().features.contains(wgpu::Features::TIMESTAMP_QUERY);
    assert_eq!(ran.report.steps[0].gpu_ms.is_some(), timed);
}

#[test]
fn a_loop_draws_to_the_layer_of_its_index() {
    let mut s = Sketch::new();
    s.texture("image", TextureKind::D2 { array: true }, F::Rgba32Float, [2, 2, 4]);
    let draw = s.draw(
        "draw",
        "var<uniform> l: u32;
        @vertex fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f { return vec4f(position, 1.0); }
        @fragment fn fragment() -> @location(0) vec4f { return vec4f(f32(l) + 1.0); }",
        DrawGeometry::Scene { cull: Cull::None },
        (&["image"], None),
        &[Place::LoopLayer(1)],
    );
    let image = run_scene(s.order([looped("l", 3, None, vec![draw])]), &quads(), &[]).image("image");
    let of_layer: Vec<f32> = image.data.chunks(16).map(|layer| layer[0]).collect();
    assert_eq!(of_layer, [0.0, 1.0, 2.0, 3.0]);
}
