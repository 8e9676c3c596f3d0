//! What passes are bound to, and what their steps say of it.

use super::*;

const DRAW: &str = "
@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f { return vec4f(f32(i)); }
@fragment fn fragment() -> @location(0) vec4f { return vec4f(1.0); }
";

const FILL: &str = "@fragment fn fragment() -> @location(0) vec4f { return vec4f(1.0); }";

/// Looks at `cube` as texture of a type.
fn look(kind: &str, at: &str) -> String {
    format!(
        "var cube: {kind};
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn look(@builtin(global_invocation_id) id: vec3u) {{ textureStore(there, id.xy, textureLoad(cube, id.xy, {at})); }}"
    )
}

fn with(mut sample: Sample, file: &str, text: &str) -> Sample {
    sample.texts.files.insert(file.into(), Source::new(file, text));
    sample
}

#[test]
fn a_step_names_the_shader_of_its_pass_and_a_copy_has_none() {
    let passes = make("a", "x") + &turn("b", "x", "y") + "Copy(name: \"c\", from: \"y\", to: \"z\"),";
    let plan = sample(&images(&["x", "y", "z"]), &passes, "\"o\": \"z\"").plan();
    let shader = |name: &str| plan.step(name).action.shader().map(|i| plan.shaders[i].path.clone());
    assert!(shader("a").is_some_and(|s| s.contains("make")) && shader("b").is_some_and(|s| s.contains("turn")));
    assert_eq!(shader("c"), None);
}

#[test]
fn a_target_of_which_a_layer_is_drawn_begins_with_its_initial_value() {
    let plan = |layers: u32| {
        let resources = format!("\"x\": Texture(format: Rgba16Float, size: 8, layers: {layers}, initial: 1),");
        let pass = "Screen(name: \"s\", shader: \"fill.wgsl\", color: \"x\", layer: 0),";
        with(sample(&resources, pass, "\"o\": \"x\""), "fill.wgsl", FILL).plan()
    };
    assert_eq!(plan(2).names(), ["x = initial", "s"], "nobody draws to the second");
    assert_eq!(plan(1).names(), ["s"], "all of it is drawn over");
}

#[test]
fn the_faces_of_a_cube_are_read_as_layers_and_not_as_one_image() {
    let plan = |kind: &str, at: &str| {
        let resources = format!("\"cube\": Cube(format: R32Float, size: 8, initial: 1), \"there\": {IMAGE}");
        let pass = "Compute(name: \"l\", shader: \"look.wgsl\", over: \"there\"),";
        let sample = with(sample(&resources, pass, "\"o\": \"there\""), "look.wgsl", &look(kind, at));
        sample.try_plan(Options::default(), None)
    };
    assert_eq!(plan("texture_2d_array<f32>", "0, 0").unwrap_or_else(|f| panic!("{f}")).names().last(), Some(&"l"));
    let refused = plan("texture_2d<f32>", "0").map(drop).expect_err("six faces are no image").to_string();
    assert!(refused.contains("a cube texture, but the shader's `cube` is texture_2d<f32>"), "{refused}");
}

#[test]
fn counts_that_a_shader_writes_are_bounded_in_memory_that_a_dispatch_reads() {
    use wgpu_types::BufferUsages;
    let resources = format!("\"counts\": Buffer(element: \"u32\", count: 3, initial: 1), \"x\": {IMAGE}");
    let pass = make("a", "x").replace("over:", "indirect: \"counts\", over:");
    let plan = sample(&resources, &pass, "\"o\": \"x\"").plan();
    let bounded = plan.resources.iter().find(|r| r.name.ends_with(".counts")).unwrap_or_else(|| panic!("{plan}"));
    let Desc::Buffer { size, usage } = bounded.desc else { panic!("{plan}") };
    assert!(size == 12 && usage.contains(BufferUsages::STORAGE | BufferUsages::INDIRECT), "{usage:?}");
}

#[test]
fn memory_of_several_samples_is_not_read_back_whatever_is_inspected() {
    let texture = |name: &str, more: &str| format!("\"{name}\": Texture(format: Rgba16Float, size: 8{more}),");
    let resources = texture("several", ", samples: 4") + &texture("one", "");
    let resolve = "resolve: {\"several\": \"one\"}";
    let pass = format!("Draw(name: \"d\", shader: \"own.wgsl\", color: \"several\", vertices: 3, {resolve}),");
    let sample = with(sample(&resources, &pass, "\"o\": \"one\""), "own.wgsl", DRAW);
    let plan = sample.with(Options { readable: true, ..Options::default() });
    let read = |name: &str| plan.texture(name).usage.contains(wgpu_types::TextureUsages::COPY_SRC);
    assert!(read("one") && !read("several"));
}
