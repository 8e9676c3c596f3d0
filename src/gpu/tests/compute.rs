use crate::gpu::testing::{Sketch, gpu, run, run_scene, try_run};
use crate::gpu::{FrameInputs, Timing, execute, prepare, prepare_after, read_buffer};
use crate::plan::change::{Held, carry};
use crate::plan::keys::Keys;
use crate::plan::tables::SceneInputs;
use crate::plan::{Action, TextureKind};
use crate::scene::{Assets, Column, Geometry, Table};
use crate::value::{Value, Values};
use glam::{Vec3, Vec4};
use wgpu::TextureFormat as F;

const FILL: &str = "
var image: texture_storage_2d<rgba32float, write>;
var<storage, read_write> sums: array<u32>;
@compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= textureDimensions(image)) { return; }
    textureStore(image, at.xy, vec4f(vec2f(at.xy), 7.0, 1.0));
    sums[at.y * 5u + at.x] = at.x * 100u + at.y;
}";

#[test]
fn compute_writes_a_texture_and_a_buffer() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 5, 3);
    s.buffer("sums", 60);
    let fill = s.compute("fill", FILL, [1, 1, 1]);
    let ran = run(s.order([fill]));
    let image = ran.image("image");
    assert_eq!((image.width, image.height, image.layers, image.channels), (5, 3, 1, 4));
    assert_eq!(image.data[(2 * 5 + 4) * 4..][..4], [4.0, 2.0, 7.0, 1.0]);
    assert_eq!(ran.words("sums")[2 * 5 + 4], 402);
    let step = ran.report.steps[0];
    assert_eq!((step.step, step.runs), (0, 1));
    assert_eq!(step.gpu_ms.is_some(), gpu().features.contains(wgpu::Features::TIMESTAMP_QUERY));
}

#[test]
fn a_frame_timed_as_a_whole_has_no_times_of_steps() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 5, 3);
    s.buffer("sums", 60);
    let fill = s.compute("fill", FILL, [1, 1, 1]);
    let plan = s.order([fill]);
    let mut prepared =
        prepare(gpu(), &plan, &Assets::new(&Geometry::default(), None), &[]).unwrap_or_else(|f| panic!("{f}"));
    let mut frame = |timing| {
        let frame = FrameInputs { timing, ..FrameInputs::default() };
        execute(gpu(), &plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"))
    };
    let (whole, steps) = (frame(Timing::Frame), frame(Timing::Steps));
    let features = gpu().features;
    assert_eq!(whole.device_ms.is_some(), features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS));
    assert_eq!(whole.steps[0].gpu_ms, None);
    assert_eq!(steps.device_ms.is_some(), steps.steps[0].gpu_ms.is_some());
    // Of one step alone both are the same pair of stamps.
    assert_eq!(steps.device_ms, steps.steps[0].gpu_ms);
}

#[test]
fn steps_that_are_waited_for_are_timed_by_the_host() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 5, 3);
    s.buffer("sums", 60);
    let fills = ["first", "second"].map(|name| s.compute(name, FILL, [1, 1, 1]));
    let plan = s.order(fills);
    let mut prepared =
        prepare(gpu(), &plan, &Assets::new(&Geometry::default(), None), &[]).unwrap_or_else(|f| panic!("{f}"));
    let frame = FrameInputs { timing: Timing::Waited, ..FrameInputs::default() };
    let report = execute(gpu(), &plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"));
    let times: Vec<f64> = report.steps.iter().filter_map(|s| s.gpu_ms).collect();
    assert_eq!(times.len(), 2);
    assert!(times.iter().all(|ms| *ms > 0.0) && times.iter().sum::<f64>() <= report.wall_ms);
    assert_eq!(report.device_ms, None);
}

#[test]
fn two_runs_give_the_same_bits() {
    let bits = || {
        let mut s = Sketch::new();
        s.image("image", F::Rgba16Float, 33, 17);
        let noise = s.screen(
            "noise",
            "@fragment fn main(@builtin(position) p: vec4f) -> @location(0) vec4f {
                return fract(sin(dot(p.xy, vec2f(12.9, 78.2)) * vec4f(1, 2, 3, 4)) * 43758.5);
            }",
            "image",
        );
        run(s.order([noise])).image("image").data.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(), bits());
}

const ROWS: &str = "
struct Row { intensity: vec3f, kind: u32 }
var<storage, read> lights: array<Row>;
var<storage, read_write> out: array<f32>;
@compute @workgroup_size(1) fn main() {
    out[0] = f32(arrayLength(&lights));
    for (var i = 0u; i < arrayLength(&lights); i++) {
        out[1u + 2u * i] = lights[i].intensity.y;
        out[2u + 2u * i] = f32(lights[i].kind);
    }
}";

fn lights(intensities: &[Vec3]) -> Table {
    let rows = intensities.len();
    Table {
        name: "lights",
        rows,
        since: None,
        columns: std::sync::Arc::new([
            ("kind", Column::Uint((0..rows as u32).collect())),
            ("position", Column::Vec3(vec![Vec3::ZERO; rows].into_iter().collect())),
            ("intensity", Column::Vec3(intensities.iter().copied().collect())),
        ]),
    }
}

#[test]
fn tables_are_packed_by_the_names_of_members() {
    let mut s = Sketch::new();
    s.buffer("out", 64);
    let read = s.compute("read", ROWS, [1, 1, 1]);
    let plan = s.order([read]);
    let two = [lights(&[Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)])];
    let ran = run_scene(plan.clone(), &Geometry::default(), &two);
    assert_eq!(ran.floats("out")[..5], [2.0, 2.0, 0.0, 5.0, 1.0]);

    let empty = run_scene(plan.clone(), &Geometry::default(), &[lights(&[])]);
    assert_eq!(empty.floats("out")[..3], [1.0, 0.0, 0.0]);

    // More rows than before: new memory, bound anew.
    let mut prepared = empty.prepared;
    let frame = FrameInputs { tables: Some(&two), ..FrameInputs::default() };
    execute(gpu(), &plan, &mut prepared, &frame).unwrap();
    let bytes = read_buffer(gpu(), &prepared, &plan, crate::plan::ResourceId(0)).unwrap();
    assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes)[..5], [2.0, 2.0, 0.0, 5.0, 1.0]);
}

#[test]
fn arrays_in_uniforms_hold_buffers_and_tables() {
    let mut s = Sketch::new();
    s.buffer("numbers", 128);
    s.buffer("out", 32);
    let count = "var<storage, read_write> numbers: array<f32>;
        @compute @workgroup_size(32) fn main(@builtin(local_invocation_index) i: u32) { numbers[i] = f32(i); }";
    // Shorter than the buffer, longer than the table.
    let look = "struct Row { intensity: vec3f, kind: u32 }
        var<uniform> lights: array<Row, 3>;
        var<uniform> numbers: array<vec4f, 7>;
        var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(1) fn main() {
            for (var i = 0u; i < 3u; i++) { out[i] = lights[i].intensity.y; out[3u + i] = f32(lights[i].kind); }
            out[6] = numbers[u32(out[0])].w;
        }";
    let count = s.compute("count", count, [1, 1, 1]);
    let look = s.compute("look", look, [1, 1, 1]);
    let plan = s.order([count, look]);
    let row = |x: f32| Vec3::new(x, x + 1.0, x + 2.0);
    let ran = run_scene(plan.clone(), &Geometry::default(), &[lights(&[row(1.0), row(4.0)])]);
    assert_eq!(ran.floats("out")[..7], [2.0, 5.0, 0.0, 0.0, 1.0, 0.0, 11.0]);

    let four = [lights(&[row(1.0); 4])];
    let fault = try_run(plan, &Geometry::default(), &four).err().map(|f| f.to_string()).unwrap_or_default();
    assert!(fault.contains("table `lights` has 4 rows, and the shader's array holds 3"), "{fault}");
}

#[test]
fn uniforms_take_the_strongest_value() {
    let mut s = Sketch::new();
    s.buffer("out", 16);
    let step = s.compute(
        "read",
        "struct Values { a: f32, b: vec3f, c: u32, d: vec4f }
        var<uniform> values: Values;
        var<uniform> scale: f32;
        var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(1) fn main() {
            out[0] = values.a; out[1] = values.b.z * scale; out[2] = f32(values.c); out[3] = values.d.w;
        }",
        [1, 1, 1],
    );
    s.plan.values.extend([
        ("a".to_owned(), Value::Float(1.0)),
        ("b".to_owned(), Value::Vec3(Vec3::new(0.0, 0.0, 3.0))),
        ("c".to_owned(), Value::Uint(9)),
        ("d".to_owned(), Value::Vec4(Vec4::splat(4.0))),
        ("scale".to_owned(), Value::Uint(2)),
    ]);
    let plan = s.order([step]);
    let mut prepared = prepare(gpu(), &plan, &Assets::new(&Geometry::default(), None), &[]).unwrap();
    let mut frame = FrameInputs::default();
    frame.values.insert("a".into(), Value::Float(10.0));
    execute(gpu(), &plan, &mut prepared, &frame).unwrap();
    let bytes = read_buffer(gpu(), &prepared, &plan, crate::plan::ResourceId(0)).unwrap();
    assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes), [10.0, 6.0, 9.0, 4.0]);
}

#[test]
fn clears_and_copies_reach_every_layer() {
    let mut s = Sketch::new();
    let kind = TextureKind::D2 { array: true };
    let from = s.texture("from", kind, F::Rgba16Float, [3, 2, 4]);
    let to = s.texture("to", kind, F::Rgba16Float, [3, 2, 4]);
    let solid = s.texture("solid", TextureKind::D3, F::Rgba32Float, [3, 2, 4]);
    // Three texels of five bytes: no row is a multiple of anything.
    let copied = s.image("copied", F::Rgba8Snorm, 5, 3);
    let depth = s.texture("depth", kind, F::Depth32Float, [3, 2, 2]);
    let (numbers, zeros) = (s.buffer("numbers", 20), s.buffer("zeros", 20));
    let value = [0.25, 0.5, -1.0, 1.0];
    let nodes = [
        s.step("1", Action::Clear { target: from, value }, vec![]),
        s.step("2", Action::Copy { from, to }, vec![]),
        s.step("3", Action::Clear { target: solid, value }, vec![]),
        s.step("4", Action::Clear { target: copied, value }, vec![]),
        s.step("5", Action::Clear { target: depth, value }, vec![]),
        s.step("6", Action::Clear { target: numbers, value }, vec![]),
        s.step("7", Action::Copy { from: numbers, to: zeros }, vec![]),
        s.step("8", Action::Clear { target: numbers, value: [0.0; 4] }, vec![]),
    ];
    let ran = run(s.order(nodes));
    for name in ["from", "to", "solid"] {
        let image = ran.image(name);
        assert_eq!(image.layers, 4);
        assert_eq!(image.data, [0.25, 0.5, -1.0, 1.0].repeat(3 * 2 * 4), "{name}");
    }
    let copied = ran.image("copied");
    assert_eq!(copied.data.len(), 60);
    assert!(copied.data.chunks(4).all(|t| (t[0] - 0.25).abs() < 0.005 && t[2] == -1.0), "{:?}", copied.data);
    assert_eq!(ran.image("depth").data, [0.25; 12]);
    assert_eq!(ran.floats("zeros"), [0.25; 5]);
    assert_eq!(ran.floats("numbers"), [0.0; 5]);
}

#[test]
fn history_outlives_a_new_plan_of_the_same_shape() {
    let sketch = |initial, size| {
        let mut s = Sketch::new();
        s.buffer("kept", size);
        s.plan.resources[0].history = true;
        s.plan.resources[0].initial = Some([initial; 4]);
        let add = s.compute(
            "add",
            "var<storage, read_write> kept: array<f32>; @compute @workgroup_size(1) fn main() { kept[0] += 1.0; }",
            [1, 1, 1],
        );
        s.order([add])
    };
    let mut first = run(sketch(5.0, 8));
    assert_eq!(first.floats("kept"), [6.0, 5.0]);
    execute(gpu(), &first.plan, &mut first.prepared, &FrameInputs::default()).unwrap();
    let empty = Geometry::default();
    let after = |plan: crate::plan::Plan| {
        let (keys, none) = (Keys::of(&plan, None), vec![None; first.plan.slots.len()]);
        let earlier = Held::new(&first.plan, &Keys::of(&first.plan, None), &none, None);
        let kept = carry(&plan, &keys, &earlier, &SceneInputs::default(), &Values::new());
        let (assets, kept) = (Assets::new(&empty, None), first.prepared.pool.taken(&kept));
        let mut prepared = prepare_after(gpu(), &plan, &assets, &[], &kept).unwrap();
        execute(gpu(), &plan, &mut prepared, &FrameInputs::default()).unwrap();
        let bytes = read_buffer(gpu(), &prepared, &plan, crate::plan::ResourceId(0)).unwrap();
        bytemuck::pod_collect_to_vec::<u8, f32>(&bytes)
    };
    assert_eq!(after(sketch(9.0, 8)), [8.0, 5.0]);
    assert_eq!(after(sketch(9.0, 4)), [10.0]);
}

#[test]
fn solid_textures_and_cubes_are_bound_whole() {
    let mut s = Sketch::new();
    s.texture("solid", TextureKind::D3, F::Rgba16Float, [2, 3, 4]);
    let cube = s.texture("cube", TextureKind::Cube { array: false }, F::Rgba32Float, [2, 2, 6]);
    s.buffer("out", 20);
    let fill = s.compute(
        "fill",
        "var solid: texture_storage_3d<rgba16float, write>;
        @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) at: vec3u) {
            textureStore(solid, at, vec4f(vec3f(at), 1.0));
        }",
        [2, 3, 4],
    );
    let clear = s.step("clear", Action::Clear { target: cube, value: [0.5; 4] }, vec![]);
    // A cube is written to as an array of six faces.
    let face = s.compute(
        "face",
        "var cube: texture_storage_2d_array<rgba32float, write>;
        @compute @workgroup_size(2, 2) fn main(@builtin(global_invocation_id) at: vec3u) {
            textureStore(cube, at.xy, 3, vec4f(8.0));
        }",
        [1, 1, 1],
    );
    let read = s.compute(
        "read",
        "var solid: texture_3d<f32>; var cube: texture_cube<f32>; var nearest: sampler;
        var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(1) fn main() {
            let texel = textureLoad(solid, vec3u(1, 2, 3), 0);
            out[0] = texel.x; out[1] = texel.y; out[2] = texel.z;
            out[3] = textureSampleLevel(cube, nearest, vec3f(1.0, 0.0, 0.0), 0.0).x;
            out[4] = textureSampleLevel(cube, nearest, vec3f(0.0, -1.0, 0.0), 0.0).x;
        }",
        [1, 1, 1],
    );
    let ran = run(s.order([fill, clear, face, read]));
    assert_eq!(ran.floats("out"), [1.0, 2.0, 3.0, 0.5, 8.0]);
    let solid = ran.image("solid");
    assert_eq!((solid.layers, &solid.data[solid.data.len() - 4..]), (4, [1.0, 2.0, 3.0, 1.0].as_slice()));
}

#[test]
fn pipelines_of_the_same_content_are_built_once_a_device() {
    use crate::gpu::prepare::Ready;
    let made = |text: &str| {
        let mut s = Sketch::new();
        s.buffer("kept", 8);
        let node = s.compute("a", text, [1, 1, 1]);
        run(s.order([node]))
    };
    let first =
        made("var<storage, read_write> kept: array<f32>; @compute @workgroup_size(1) fn main() { kept[0] += 1.5; }");
    let same = |text: &str| match (&first.prepared.steps[0], &made(text).prepared.steps[0]) {
        (Ready::Shaded(a), Ready::Shaded(b)) => a.pipelines.built == b.pipelines.built,
        _ => false,
    };
    // Another text of the same meaning, and one of another.
    assert!(same(
        "// The same.\nvar<storage, read_write> kept: array<f32>;\n@compute @workgroup_size(1) fn main() { kept[0] += 1.5; }"
    ));
    assert!(!same(
        "var<storage, read_write> kept: array<f32>; @compute @workgroup_size(1) fn main() { kept[0] += 2.5; }"
    ));
}
