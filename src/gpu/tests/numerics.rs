//! Numbers that should not be, put where the checks must find them.

use crate::gpu::testing::{Sketch, gpu};
use crate::gpu::{FrameInputs, Numerics, execute, prepare};
use crate::plan::{Action, Desc, Loop, OrderNode, Plan, StepId, TextureKind, Tiles};
use crate::scene;
use wgpu::TextureFormat as F;

/// What a frame of watched steps finds. Every step of the plan writes the resource of its own name.
fn watched(mut plan: Plan) -> (Plan, Numerics) {
    for i in 0..plan.steps.len() {
        let id = plan.resources.iter().position(|r| r.name == plan.steps[i].name).unwrap();
        plan.steps[i].writes = vec![crate::plan::ResourceId(id)];
    }
    let mut prepared = prepare(gpu(), &plan, &scene::Assets::new(&scene::Geometry::default(), None), &[]).unwrap();
    prepared.watch(gpu()).unwrap();
    let report = execute(gpu(), &plan, &mut prepared, &FrameInputs::default()).unwrap_or_else(|f| panic!("{f}"));
    (plan, report.numerics.unwrap())
}

/// A shader that fills an image with 1, but for what `special` returns.
fn fill(name: &str, special: &str) -> String {
    format!(
        "var {name}: texture_storage_2d<rgba32float, write>;
        fn special(at: vec2u) -> vec4f {{ {special} return vec4f(1.0); }}
        @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3u) {{
            textureStore({name}, id.xy, special(id.xy));
        }}"
    )
}

#[test]
fn the_first_bad_texel_is_named_with_the_step_that_wrote_it() {
    let mut s = Sketch::new();
    for name in ["clean", "broken", "after"] {
        s.image(name, F::Rgba32Float, 70, 50);
    }
    let nan = "if at.x == 61u && at.y >= 40u { return vec4f(1.0, bitcast<f32>(0x7fc00000u + at.x), 1.0, 1.0); }";
    let nodes = [
        s.compute("clean", &fill("clean", ""), [9, 7, 1]),
        s.compute("broken", &fill("broken", nan), [9, 7, 1]),
        s.compute(
            "after",
            &fill("after", "if at.y == 3u { return vec4f(bitcast<f32>(0xff800000u + at.x * 0u)); }"),
            [9, 7, 1],
        ),
    ];
    let (plan, found) = watched(s.order(nodes));
    assert_eq!(found.readings.len(), 3);
    assert_eq!(found.broken.len(), 2);
    let b = &found.broken[0];
    assert_eq!((b.step, b.texel, b.not_numbers, b.infinite), (StepId(1), [61, 40, 0], 10, 0));
    let b = &found.broken[1];
    assert_eq!((b.step, b.texel, b.not_numbers, b.infinite), (StepId(2), [0, 3, 0], 0, 70 * 4));
    let faults = found.faults(&plan);
    assert!(faults[0].message.contains("`broken` leaves numbers in `broken`"), "{}", faults[0].message);
    assert!(faults[0].help[0].contains("texel (61, 40), layer 0"), "{:?}", faults[0].help);
}

#[test]
fn extremes_and_energy_are_those_of_all_numbers() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 100, 30);
    let special = "if at.x == 99u { return vec4f(-2.0, 3.0, 0.0, 0.5); }";
    let node = s.compute("image", &fill("image", special), [13, 4, 1]);
    let (plan, found) = watched(s.order([node]));
    assert!(found.broken.is_empty(), "without a range nothing is outside of it");
    let r = found.reading(&plan, "image").unwrap();
    assert_eq!((r.least, r.largest, r.checks), (-2.0, 3.0, 1));
    assert_eq!((r.energy, r.negative), (99.0 * 30.0 * 4.0 + 30.0 * 5.5, 60.0));
}

#[test]
fn a_range_holds_and_the_rest_of_an_atlas_is_nobody_s() {
    let mut s = Sketch::new();
    let id = s.image("image", F::Rgba32Float, 16, 16);
    if let Desc::Texture(t) = &mut s.plan.resources[id.0].desc {
        t.tiles = Some(Tiles { edge: 8, columns: 2, count: 3 });
    }
    s.plan.resources[id.0].min = Some(0.0);
    s.plan.resources[id.0].max = Some(1.5);
    let special =
        "if at.x >= 8u && at.y >= 8u { return vec4f(-1.0); } if at.x == 5u { return vec4f(0.0, -0.5, 2.0, 1.0); }";
    let node = s.compute("image", &fill("image", special), [2, 2, 1]);
    let (_, found) = watched(s.order([node]));
    let b = &found.broken[0];
    assert_eq!((b.below, b.above, b.texel), (16, 16, [5, 0, 0]));
}

#[test]
fn volumes_depths_halves_and_the_floats_of_buffers_are_checked_and_integers_are_not() {
    let mut s = Sketch::new();
    s.texture("volume", TextureKind::D3, F::Rgba16Float, [6, 5, 4]);
    s.buffer("rows", 16 * 10);
    s.buffer("words", 64);
    let volume = "var volume: texture_storage_3d<rgba16float, write>;
        @compute @workgroup_size(4, 4, 4) fn main(@builtin(global_invocation_id) id: vec3u) {
            let infinite = bitcast<f32>(0x7f800000u + id.x / 100u);
            textureStore(volume, id, vec4f(select(1.0, infinite, all(id == vec3u(2u, 3u, 1u)))));
        }";
    // A word of all ones is no float, and a float without value.
    let rows = "struct Row { number: f32, word: u32, other: vec2f }
        var<storage, read_write> rows: array<Row>;
        @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {
            rows[id.x] = Row(2.0, 0xffffffffu, vec2f(3.0, 4.0));
            if id.x == 7u { rows[id.x].other.y = bitcast<f32>(0x7f800000u + id.y); }
        }";
    let words = "var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() { words[0] = 0x7fc00000u; }";
    let nodes = [
        s.compute("volume", volume, [2, 2, 1]),
        s.compute("rows", rows, [10, 1, 1]),
        s.compute("words", words, [1, 1, 1]),
    ];
    let clear = |s: &mut Sketch, name: &str, value: f64| {
        let target = s.image(name, F::Depth32Float, 8, 8);
        s.step(name, Action::Clear { target, value: [value; 4] }, vec![])
    };
    let depth = clear(&mut s, "depth", 0.25);
    let (plan, found) = watched(s.order(nodes.into_iter().chain([depth])));
    let names: Vec<&str> = found.readings.iter().map(|r| plan.resources[r.resource.0].name.as_str()).collect();
    assert_eq!(names, ["volume", "rows", "depth"]);
    assert_eq!(found.reading(&plan, "depth").map(|r| r.energy), Some(16.0));
    assert_eq!((found.broken[0].texel, found.broken[0].infinite), ([2, 3, 1], 4));
    assert_eq!((found.broken[1].texel, found.broken[1].infinite), ([7, 3, 0], 1));
    assert_eq!(found.reading(&plan, "rows").map(|r| (r.least, r.largest)), Some((2.0, 4.0)));
}

#[test]
fn a_long_loop_names_the_iteration_in_which_it_broke() {
    let mut s = Sketch::new();
    s.buffer("number", 4);
    s.plan.resources[0].initial = Some([1.0; 4]);
    s.plan.resources[0].history = true;
    let text = "var<storage, read_write> number: array<f32>;
        @compute @workgroup_size(1) fn main() { number[0] *= 2.0; }";
    let double = s.compute("number", text, [1, 1, 1]);
    let body = vec![double];
    let (_, found) = watched(s.order([OrderNode::Loop(Loop { name: "l".into(), count: 300, until: None, body })]));
    // 2^128 is beyond a float.
    assert_eq!((found.broken[0].iterations.as_slice(), found.broken[0].infinite), ([127].as_slice(), 1));
    assert_eq!(found.readings[0].checks, 300);
}
