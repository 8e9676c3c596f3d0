//! From text to interface.

use super::*;

#[test]
fn every_kind_of_variable_is_reflected() {
    let i = interface(
        "struct P { camera: mat4x4f, grid: vec3u, bounces: u32, offset: i32, k2: f32 }
        var<uniform> params: P;
        var<uniform> screen: vec2u;
        var plain: texture_2d<f32>;
        var smooth_array: texture_2d_array<f32>;
        var id: texture_2d<u32>;
        var sid: texture_3d<i32>;
        var multi: texture_multisampled_2d<f32>;
        var shadow: texture_depth_cube_array;
        var sh: texture_storage_3d<rgba32float, write>;
        var acc: texture_storage_2d<r32uint, read_write>;
        var lin: sampler;
        var cmp: sampler_comparison;
        var<storage, read_write> count: atomic<u32>;
        var<storage, read_write> fixed: array<vec3f, 5>;
        struct Open { n: u32, rows: array<vec2f> }
        var<storage> open: Open;
        struct Row { at: vec3f, n: u32 }
        var<uniform> rows: array<Row, 7>;
        var<workgroup> tile: array<f32, 64>;
        fn inner(t: texture_2d_array<f32>, s: sampler) -> vec4f { return textureSampleLevel(t, s, vec2f(), 0, 0); }
        fn outer(t: texture_2d_array<f32>, s: sampler) -> vec4f { return inner(t, s); }
        @compute @workgroup_size(8, 4) fn main() {
            tile[0] = params.k2 + f32(screen.x) + rows[screen.y].at.x;
            let a = textureLoad(plain, vec2i(), 0) + outer(smooth_array, lin) + textureLoad(multi, vec2i(), 0);
            let b = textureLoad(id, vec2i(), 0).x + u32(textureLoad(sid, vec3i(), 0).x) + arrayLength(&open.rows);
            let c = textureSampleCompareLevel(shadow, cmp, vec3f(1, 0, 0), 0, 0.5);
            textureStore(sh, vec3i(), a + c);
            textureStore(acc, vec2i(), textureLoad(acc, vec2i()));
            fixed[0] = vec3f(f32(b));
            atomicAdd(&count, 1u);
        }",
    );
    let kind = |name: &str| match i.variables.iter().find(|v| v.name == name) {
        Some(v) => v.kind.clone(),
        None => panic!("no {name}"),
    };
    let member = |name: &str, offset, ty| Member { name: name.to_owned(), offset, ty, read: true };
    let texture = |dim, sample| BindingKind::Texture { dim, sample, multisampled: false };
    let unread = |name: &str, offset, ty| Member { read: false, ..member(name, offset, ty) };
    let members = vec![
        unread("camera", 0, Type::Mat4),
        unread("grid", 64, Type::UVec3),
        unread("bounces", 76, Type::Uint),
        unread("offset", 80, Type::Int),
        member("k2", 84, Type::Float),
    ];
    assert_eq!(kind("params"), BindingKind::Uniform(Layout { size: 96, members }.into()));
    let members = vec![member("screen", 0, Type::UVec2)];
    assert_eq!(kind("screen"), BindingKind::Uniform(Layout { size: 8, members }.into()));
    assert_eq!(kind("plain"), texture(TextureDim::D2, TextureSample::Float { filtered: false }));
    assert_eq!(kind("smooth_array"), texture(TextureDim::D2Array, TextureSample::Float { filtered: true }));
    assert_eq!(kind("id"), texture(TextureDim::D2, TextureSample::Uint));
    assert_eq!(kind("sid"), texture(TextureDim::D3, TextureSample::Sint));
    assert_eq!(kind("shadow"), texture(TextureDim::CubeArray, TextureSample::Depth));
    let sample = TextureSample::Float { filtered: false };
    assert_eq!(kind("multi"), BindingKind::Texture { dim: TextureDim::D2, sample, multisampled: true });
    let (format, access) = (wgpu_types::TextureFormat::Rgba32Float, wgpu_types::StorageTextureAccess::WriteOnly);
    assert_eq!(kind("sh"), BindingKind::StorageTexture { dim: TextureDim::D3, format, access });
    let (format, access) = (wgpu_types::TextureFormat::R32Uint, wgpu_types::StorageTextureAccess::ReadWrite);
    assert_eq!(kind("acc"), BindingKind::StorageTexture { dim: TextureDim::D2, format, access });
    assert_eq!(kind("lin"), BindingKind::Sampler { comparison: false });
    assert_eq!(kind("cmp"), BindingKind::Sampler { comparison: true });
    let element = Layout { size: 4, members: vec![member("count", 0, Type::Uint)] };
    assert_eq!(
        kind("count"),
        BindingKind::Storage { element, stride: 4, fixed_size: Some(4), writable: true, of: None }
    );
    let element = Layout { size: 12, members: vec![member("fixed", 0, Type::Vec3)] };
    let of = Some(ElementType::Plain);
    assert_eq!(kind("fixed"), BindingKind::Storage { element, stride: 16, fixed_size: Some(80), writable: true, of });
    assert!(matches!(kind("open"), BindingKind::Storage { fixed_size: None, writable: false, .. }));
    let of = ElementType::Struct("Row".into());
    let element = Layout { size: 16, members: vec![member("at", 0, Type::Vec3), member("n", 12, Type::Uint)] };
    assert_eq!(kind("rows"), BindingKind::UniformArray { element, stride: 16, size: 112, of });
    let entry = &i.entries[0];
    let access = |name: &str| entry.uses[&names(&i).iter().position(|n| *n == name).unwrap_or(usize::MAX)];
    assert_eq!(entry.workgroup_size, [8, 4, 1]);
    assert_eq!(access("open"), Access { read: false, write: false });
    assert_eq!(access("fixed"), Access { read: false, write: true });
    assert_eq!(access("count"), Access { read: true, write: true });
    assert_eq!(access("acc"), Access { read: true, write: true });
    assert_eq!(access("smooth_array"), Access { read: true, write: false });
    assert!(!names(&i).contains(&"tile"));
}

#[test]
fn entries_are_reflected() {
    let i = interface(
        "struct V { @location(1) uv: vec2f, @builtin(instance_index) member: u32, @location(2) @interpolate(flat) node0: u32 }
        struct F { @location(1) normal: vec4f, @location(0) albedo: vec3f, @location(2) id: u32, @builtin(frag_depth) d: f32 }
        var<uniform> a: f32;
        var<uniform> b: f32;
        @vertex fn vs(@location(0) position: vec3f, v: V) -> @builtin(position) vec4f { return vec4f(position * a, v.uv.x); }
        @fragment fn fs() -> F { return F(vec4f(b), vec3f(), 1, 0.5); }
        @fragment fn bare() -> @location(0) vec4f { return vec4f(a + b); }",
    );
    let vs = i.entry(Stage::Vertex).expect("a vertex entry");
    let inputs: Vec<_> = vs.inputs.iter().map(|v| (v.name.as_str(), v.location, v.format)).collect();
    use wgpu_types::VertexFormat as F;
    assert_eq!(inputs, [("position", 0, F::Float32x3), ("uv", 1, F::Float32x2), ("node0", 2, F::Uint32)]);
    assert_eq!(vs.uses.keys().copied().collect::<Vec<_>>(), [0]);
    let fs = i.entry(Stage::Fragment).expect("a fragment entry");
    let outputs: Vec<_> = fs.outputs.iter().map(|o| (o.name.as_deref(), o.location, o.kind, o.components)).collect();
    let expected = [
        (Some("albedo"), 0, OutputKind::Float, 3),
        (Some("normal"), 1, OutputKind::Float, 4),
        (Some("id"), 2, OutputKind::Uint, 1),
    ];
    assert_eq!(outputs, expected);
    assert!(fs.writes_depth && !i.entries[2].writes_depth);
    assert_eq!(i.entries[2].outputs[0].name, None);
    assert_eq!(i.entries.iter().map(|e| e.name.as_str()).collect::<Vec<_>>(), ["vs", "fs", "bare"]);
}

#[test]
fn members_that_nobody_asks_for_are_told_apart() {
    let interface = interface(
        "struct Params { asked: f32, unasked: f32, handed: f32 }
        struct Whole { a: f32, b: f32 }
        var<uniform> params: Params;
        var<uniform> whole: Whole;
        var<storage, read_write> out: array<f32>;
        fn part(w: Whole) -> f32 { return w.a; }
        @compute @workgroup_size(1) fn main() { out[0] = params.asked + part(whole); let h = params.handed; out[1] = h; }",
    );
    let read = |name: &str| -> Vec<(String, bool)> {
        let variable = interface.variables.iter().find(|v| v.name == name).unwrap();
        let BindingKind::Uniform(layout) = &variable.kind else { panic!("{name} is no uniform") };
        layout.members.iter().map(|m| (m.name.clone(), m.read)).collect()
    };
    let expected = |list: &[(&str, bool)]| -> Vec<_> { list.iter().map(|(n, r)| ((*n).to_string(), *r)).collect() };
    assert_eq!(read("params"), expected(&[("asked", true), ("unasked", false), ("handed", true)]));
    assert_eq!(read("whole"), expected(&[("a", true), ("b", true)]), "all of it is loaded");
}

#[test]
fn entry_points_that_nobody_asked_for_leave_with_what_only_they_use() {
    let text = "var<storage, read_write> a: array<u32>;
        var<storage, read_write> b: array<u32>;
        @compute @workgroup_size(1) fn one() { a[0] = 1u; }
        @compute @workgroup_size(1) fn two() { b[0] = 2u; }";
    let files = library(&[("main.wgsl", text)]);
    let found = |wanted: &[&str]| {
        let wanted: Vec<String> = wanted.iter().map(|w| (*w).to_owned()).collect();
        let interface = &files.shader("main.wgsl", &Defs::new(), &wanted).unwrap_or_else(|f| panic!("{f}")).interface;
        let entries: Vec<_> = interface.entries.iter().map(|e| e.name.clone()).collect();
        let variables: Vec<_> = interface.variables.iter().map(|v| v.name.clone()).collect();
        (entries.join(" "), variables.join(" "))
    };
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    assert_eq!(found(&[]), pair("one two", "a b"));
    assert_eq!(found(&["two"]), pair("two", "b"));
    assert_eq!(found(&["one"]), pair("one", "a"));
    assert_eq!(found(&["three"]), pair("one two", "a b"), "the pass that asks says so, with all names at hand");
}
