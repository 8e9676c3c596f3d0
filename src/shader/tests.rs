//! Composition and reflection from text to interface; every fault with its place.

use super::*;
use crate::{
    diag::{Source, render},
    value::Type,
};

fn library(files: &[(&str, &str)]) -> Library {
    let files = files.iter().map(|(path, text)| ((*path).to_owned(), Source::new(*path, *text)));
    Library { files: files.collect() }
}

fn defs(list: &[(&str, Def)]) -> Defs {
    list.iter().map(|(name, def)| ((*name).to_owned(), *def)).collect()
}

/// The shader `main.wgsl` among `files`; fails with the faults as shown to a user.
fn composed(files: &[(&str, &str)], definitions: &[(&str, Def)]) -> Shader {
    match compose(&library(files), "main.wgsl", &defs(definitions)) {
        Ok(shader) => shader,
        Err(faults) => panic!("{faults}"),
    }
}

fn interface(text: &str) -> Interface {
    composed(&[("main.wgsl", text)], &[]).interface
}

/// Composing `main.wgsl` shows each of `expected`.
fn check_files(files: &[(&str, &str)], definitions: &[(&str, Def)], expected: &[&str]) {
    let shown = match compose(&library(files), "main.wgsl", &defs(definitions)) {
        Ok(_) => panic!("no fault"),
        Err(faults) => {
            assert!(faults.0.iter().all(|d| !d.labels.is_empty()), "a fault without a place: {faults}");
            render(&faults.0)
        }
    };
    for text in expected {
        assert!(shown.contains(text), "expected `{text}` in:\n{shown}");
    }
    for mark in ["X_naga_oil", "X_member", "NUYA"] {
        assert!(!shown.contains(mark), "decorated names:\n{shown}");
    }
}

fn check(text: &str, expected: &[&str]) {
    check_files(&[("main.wgsl", text)], &[], expected);
}

fn names(interface: &Interface) -> Vec<&str> {
    interface.variables.iter().map(|v| v.name.as_str()).collect()
}

const SCENE: &str = "#define_import_path scene
struct Material { base_color: vec4f, c1: vec3f, shininess: f32 }
struct Unused { m: mat3x3f }
var<storage, read> materials: array<Material>;
var<uniform> spare: Unused;
fn shine(i: u32) -> f32 { return materials[i].shininess * materials[i].c1.x; }
";

#[test]
fn imports_reach_through_files_and_share_one_variable() {
    let shader = composed(
        &[
            ("lib/scene.wgsl", SCENE),
            ("lib/brdf.wgsl", "#import scene::{shine, materials}\nfn brdf(i: u32) -> vec4f { return materials[i].base_color * shine(i); }"),
            (
                "main.wgsl",
                "#import \"lib/brdf.wgsl\" as b\n#import scene as s\n#import scene::Material\n#ifdef SECOND\n#import nowhere\n#endif\n
                var<storage, read_write> out: array<vec4f>; // a comment: @group(9)
                @group(3) @binding(7) var<uniform> gain: f32;
                @compute @workgroup_size(#{WG}, 1, 1) fn any_name(@builtin(global_invocation_id) id: vec3u) {
                    let m: Material = s::materials[id.x];
                    out[id.x] = gain * b::brdf(id.x) + vec4f(m.c1, s::shine(0u));
                }",
            ),
            ("lib/broken.wgsl", "this is not WGSL #if"),
        ],
        &[("WG", Def::Uint(64)), ("SECOND", Def::Bool(false))],
    );
    assert_eq!(names(&shader.interface), ["gain", "materials", "out"]);
    assert_eq!(shader.sources, ["lib/brdf.wgsl", "lib/scene.wgsl", "main.wgsl"]);
    let entry = &shader.interface.entries[0];
    assert_eq!((entry.name.as_str(), entry.workgroup_size), ("any_name", [64, 1, 1]));
    let mut bindings: Vec<_> = shader
        .module
        .global_variables
        .iter()
        .map(|(_, v)| (write::plain(v.name.as_deref().unwrap_or("")), v.binding.map(|b| (b.group, b.binding))))
        .collect();
    bindings.sort();
    let expected = [("gain", 0), ("materials", 1), ("out", 2)].map(|(n, b)| (n.to_owned(), Some((0, b))));
    assert_eq!(bindings, expected);
    let BindingKind::Storage { element, stride, fixed_size, writable } = &shader.interface.variables[1].kind else {
        panic!("{:?}", shader.interface.variables[1])
    };
    assert_eq!((*stride, *fixed_size, *writable), (32, None, false));
    let members: Vec<_> = element.members.iter().map(|m| (m.name.as_str(), m.offset, m.ty)).collect();
    assert_eq!(members, [("base_color", 0, Type::Vec4), ("c1", 16, Type::Vec3), ("shininess", 28, Type::Float)]);
}

#[test]
fn definitions_choose_branches() {
    let text = "
        #ifdef OFF
        nonsense
        #else if N == 3
        const A = 1u;
        #else
        more nonsense
        #endif
        #ifndef OFF
        #if M < -1 // a comment
        const B = #{N}u;
        #endif
        #endif
        var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1) fn main() { out[0] = A + B; }";
    let given = [("OFF", Def::Bool(false)), ("N", Def::Uint(3)), ("M", Def::Int(-2))];
    composed(&[("main.wgsl", text)], &given);
    let files = library(&[
        ("main.wgsl", &format!("{text}\n#ifdef OTHER\n#import lib::f\n#endif")),
        ("lib.wgsl", "#define_import_path lib\n#if DEEP == true\n#endif"),
    ]);
    let mentioned: Vec<String> = mentioned_defs(&files, "main.wgsl").into_iter().collect();
    assert_eq!(mentioned, ["DEEP", "M", "N", "OFF", "OTHER"]);
    assert!(mentioned_defs(&files, "absent.wgsl").is_empty());
}

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
        var<workgroup> tile: array<f32, 64>;
        fn inner(t: texture_2d_array<f32>, s: sampler) -> vec4f { return textureSampleLevel(t, s, vec2f(), 0, 0); }
        fn outer(t: texture_2d_array<f32>, s: sampler) -> vec4f { return inner(t, s); }
        @compute @workgroup_size(8, 4) fn main() {
            tile[0] = params.k2 + f32(screen.x);
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
    let member = |name: &str, offset, ty| Member { name: name.to_owned(), offset, ty };
    let texture = |dim, sample| BindingKind::Texture { dim, sample, multisampled: false };
    let members = vec![
        member("camera", 0, Type::Mat4),
        member("grid", 64, Type::UVec3),
        member("bounces", 76, Type::Uint),
        member("offset", 80, Type::Int),
        member("k2", 84, Type::Float),
    ];
    assert_eq!(kind("params"), BindingKind::Uniform(Layout { size: 96, members }));
    let members = vec![member("screen", 0, Type::UVec2)];
    assert_eq!(kind("screen"), BindingKind::Uniform(Layout { size: 8, members }));
    assert_eq!(kind("plain"), texture(TextureDim::D2, TextureSample::Float { filtered: false }));
    assert_eq!(kind("smooth_array"), texture(TextureDim::D2Array, TextureSample::Float { filtered: true }));
    assert_eq!(kind("id"), texture(TextureDim::D2, TextureSample::Uint));
    assert_eq!(kind("sid"), texture(TextureDim::D3, TextureSample::Sint));
    assert_eq!(kind("shadow"), texture(TextureDim::CubeArray, TextureSample::Depth));
    let sample = TextureSample::Float { filtered: false };
    assert_eq!(kind("multi"), BindingKind::Texture { dim: TextureDim::D2, sample, multisampled: true });
    let (format, access) = (wgpu::TextureFormat::Rgba32Float, wgpu::StorageTextureAccess::WriteOnly);
    assert_eq!(kind("sh"), BindingKind::StorageTexture { dim: TextureDim::D3, format, access });
    let (format, access) = (wgpu::TextureFormat::R32Uint, wgpu::StorageTextureAccess::ReadWrite);
    assert_eq!(kind("acc"), BindingKind::StorageTexture { dim: TextureDim::D2, format, access });
    assert_eq!(kind("lin"), BindingKind::Sampler { comparison: false });
    assert_eq!(kind("cmp"), BindingKind::Sampler { comparison: true });
    let element = Layout { size: 4, members: vec![] };
    assert_eq!(kind("count"), BindingKind::Storage { element, stride: 4, fixed_size: Some(4), writable: true });
    let element = Layout { size: 12, members: vec![member("fixed", 0, Type::Vec3)] };
    assert_eq!(kind("fixed"), BindingKind::Storage { element, stride: 16, fixed_size: Some(80), writable: true });
    assert!(matches!(kind("open"), BindingKind::Storage { fixed_size: None, writable: false, .. }));
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
    use wgpu::VertexFormat as F;
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
fn entry_points_of_imports_stay_outside() {
    let lib =
        "#define_import_path lib\nfn f() -> f32 { return 1.0; }\n@compute @workgroup_size(1) fn main() { _ = f(); }";
    let main = "#import lib::f\n@fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
    let shader = composed(&[("lib.wgsl", lib), ("main.wgsl", main)], &[]);
    assert_eq!(shader.interface.entries.len(), 1);
}

#[test]
fn the_same_text_gives_the_same_module() {
    let files = [
        ("lib.wgsl", SCENE),
        ("main.wgsl", "#import scene::shine\n@fragment fn f() -> @location(0) vec4f { return vec4f(shine(0)); }"),
    ];
    let once = composed(&files, &[]);
    for _ in 0..4 {
        assert_eq!(format!("{:?}", composed(&files, &[]).module), format!("{:?}", once.module));
    }
}

#[test]
fn unknown_paths_and_imports_name_the_nearest() {
    let files = library(&[("main.wgsl", "")]);
    let faults = compose(&files, "man.wgsl", &Defs::new()).expect_err("an unknown path");
    assert!(faults.to_string().contains("did you mean `main.wgsl`?"), "{faults}");
    let files = |main| [("lib/scene.wgsl", SCENE), ("lib/bare.wgsl", "fn f() {}"), ("main.wgsl", main)];
    let cases: [(&str, &[&str]); 9] = [
        ("#import scne::shine", &["unknown module `scne`", "main.wgsl:1:9", "did you mean `scene`?"]),
        ("\n#import scene::{shine,\n shne}", &["`scene` has no `shne`", "main.wgsl:3:2", "did you mean `shine`?"]),
        ("#import scene\n fn f() { _ = scene::xyz(); }", &["`scene` has no `xyz`", "main.wgsl:2:15"]),
        ("fn f() { nowhere::f(); }", &["unknown module `nowhere`", "main.wgsl:1:10"]),
        ("#import \"lib/bear.wgsl\"::f", &["did you mean `\"lib/bare.wgsl\"`?", "main.wgsl:1:9"]),
        ("#import \"lib/scene.wgsl\"::shine", &["that file is called `scene`"]),
        ("#import lib/bare.wgsl", &["unexpected text in an import", "main.wgsl:1:12", "quotes"]),
        ("#import", &["expected a name in an import"]),
        ("#import scene::shine\nfn shine() {}", &["both imported and declared", "main.wgsl:1:9", "declared here"]),
    ];
    for (main, expected) in cases {
        check_files(&files(main), &[], expected);
    }
}

#[test]
fn faults_in_imported_files_are_placed_there() {
    let main = "#import lib::f\n@fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
    let with = |lib: &str, expected: &[&str]| {
        let lib = format!("#define_import_path lib\n{lib}");
        check_files(&[("lib.wgsl", &lib), ("main.wgsl", main)], &[("N", Def::Int(12345))], expected);
    };
    with("fn f() -> f32 { return 1.0 }", &["lib.wgsl:2:28", "expected"]);
    with("fn f() -> f32 { let n = #{N}; return nope; }", &["lib.wgsl:2:38", "nope"]);
    with("var<uniform> u: f32;\nvar<uniform> v: f32; fn f() -> f32 { return u + v + 1u; }", &["lib.wgsl:3:"]);
    with("fn f() -> f32 { return 1u; }", &["lib.wgsl:2:24"]);
    with(
        "fn f() -> f32 { return 1.0; }\nstruct A { b: bool }\nvar<uniform> a: A;\nfn g() -> bool { return a.b; }",
        &["lib.wgsl:"],
    );
    with("fn f() -> f32 { return 1.0; }\nfn a__b() {}", &["lib.wgsl:", "`a__b` can't be exported"]);
    with("#if N == 1", &["never closed", "lib.wgsl:2:1"]);
    // Behind decorated names of a third file.
    let deep =
        "#define_import_path lib\n#import scene::{shine}\nfn f() -> f32 { return shine(0u) + shine(1u) + nope; }";
    check_files(&[("s.wgsl", SCENE), ("lib.wgsl", deep), ("main.wgsl", main)], &[], &["lib.wgsl:3:48"]);
    let wrong = "#define_import_path lib\n#import scene::{shine}\nfn f() -> f32 { return shine(0u, 2u); }";
    check_files(&[("s.wgsl", SCENE), ("lib.wgsl", wrong), ("main.wgsl", main)], &[], &["lib.wgsl:3:"]);
}

#[test]
fn validation_faults_are_placed_through_imports() {
    let lib = "#define_import_path lib\nfn helper(i: i32) -> i32 { return i; }\nvar<storage, read> data: array<i32>;\nfn f() -> i32 {\n  data[0] = 1;\n  return helper(2);\n}";
    let main = "#import lib::{f}\n@compute @workgroup_size(1) fn main() { _ = f(); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["lib.wgsl:5:"]);
    let main = "#import lib::{helper}\n@compute @workgroup_size(1) fn main() {\n  _ = helper(helper(helper(1)));\n  if true { workgroupBarrier(); }\n}\n@fragment fn g() { workgroupBarrier(); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["main.wgsl:6:"]);
}

#[test]
fn directive_faults_are_all_reported() {
    let expected = [
        "main.wgsl:2:1",
        "`#if N` needs a comparison",
        "main.wgsl:4:1",
        "unknown definition `M`",
        "main.wgsl:6:1",
        "`#endif` without",
        "main.wgsl:7:1",
        "`#else` without",
        "main.wgsl:8:1",
        "did you mean `ifdef`?",
        "main.wgsl:9:1",
        "`true`",
        "main.wgsl:11:11",
        "unknown definition `NN`",
        "main.wgsl:12:1",
        "definitions don't stand in shaders",
        "main.wgsl:13:13",
        "unexpected text after a directive",
        "main.wgsl:15:5",
        "stray `#`",
    ];
    check_files(
        &[(
            "main.wgsl",
            "\n#if N\n#endif\n#if M == 1\n#endif\n#endif\n#else\n#ifdeff N\n#if N == true\n#endif\nconst a = #{NN};\n#define X 1\n#ifdef N    more\n#endif\na = #N;",
        )],
        &[("N", Def::Int(1))],
        &expected,
    );
    check("/* open", &["a comment is never closed", "main.wgsl:1:1"]);
    check("#ifdef A\n#else\n#else\n#endif", &["a second `#else`", "main.wgsl:3:1"]);
}

#[test]
fn imports_in_a_circle_are_a_fault() {
    let a = "#define_import_path a\n#import b::g\nfn f() { b::g(); }";
    let b = "#define_import_path b\n#import a::f\nfn g() { a::f(); }";
    let main = "#import a::f\n@compute @workgroup_size(1) fn main() { f(); }";
    check_files(
        &[("a.wgsl", a), ("b.wgsl", b), ("main.wgsl", main)],
        &[],
        &["circle", "b.wgsl:2:9", "a.wgsl → b.wgsl"],
    );
    let own = "#define_import_path own\n#import own::f\nfn f() {}";
    check(own, &["circle", "main.wgsl:2:9"]);
}

#[test]
fn two_variables_of_one_name_are_a_fault() {
    let lib = "#define_import_path lib\nvar<uniform> gain: f32;\nfn f() -> f32 { return gain; }";
    let main = "#import lib::f\nvar<uniform> gain: f32;\n@fragment fn main() -> @location(0) vec4f { return vec4f(f() * gain); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["`gain`", "lib.wgsl:2:14", "main.wgsl:2:14"]);
    let main =
        "#import lib::f\nvar<uniform> gain: f32;\n@fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
    assert_eq!(names(&composed(&[("lib.wgsl", lib), ("main.wgsl", main)], &[]).interface), ["gain"]);
}

#[test]
fn types_that_no_value_has_are_faults() {
    let with = |ty: &str, expected: &[&str]| {
        check(
            &format!(
                "struct S {{ x: {ty} }}\nvar<uniform> s: S;\n@compute @workgroup_size(1) fn main() {{ let a = s.x; }}"
            ),
            expected,
        );
    };
    with("mat3x3f", &["no value has the type of `x`", "mat4x4f", "main.wgsl:2:14"]);
    with("vec2i", &["no value has the type of `x`"]);
    with("array<vec4f, 2>", &["use plain members, or a storage buffer"]);
    with("bool", &["main.wgsl:", "use `u32`"]);
    check("override N: u32 = 1u;", &["`override` isn't supported", "main.wgsl:1:1"]);
    check("enable f16;", &["extensions aren't supported"]);
}

#[test]
fn no_text_panics() {
    let texts = [
        "",
        "\n",
        "// only a comment",
        "/* /* */",
        "\u{feff}",
        "\r\r\n",
        "#",
        "##",
        "#{",
        "#{}",
        "#{X}",
        "# {X",
        "#import {",
        "#import a::{{",
        "#import a::{b",
        "#import a as",
        "#import \"",
        "#import \"a\"",
        "#import \"\"::x",
        "\"",
        "\"a\"::b",
        "a::b",
        "::",
        "a::",
        "::a",
        "#if",
        "#if X",
        "#if X ==",
        "#if X == 99999999999999999999",
        "#else if",
        "#endif",
        "#define_import_path",
        "#define_import_path a b",
        "@",
        "@group",
        "@group(",
        "var",
        "var<",
        "var<uniform",
        "var<uniform>",
        "struct",
        "struct {",
        "}",
        ")",
        "fn",
        "fn f(",
        "fn __x() {}",
        "fn f__g() {}",
        "const é = 1;",
        "fn é() {}",
        "struct ÿ9 { x_: f32, é1: f32 }",
        "const 🦀 = 1;",
        "fn f() { let 日本 = 1; }",
        "var t: texture_2d<f32>; var t: sampler;",
        "X_naga_oil_mod_XNUYAX",
        "a.X_member_X",
        "@workgroup_size(0) @compute fn f() {}",
        "@compute fn f() {}",
        "@vertex fn f() {}",
        "fn f() { f(); }",
        "struct A { a: A }",
        "const a = b; const b = a;",
        "alias A = B; alias B = A;",
        "@compute @workgroup_size(1u << 40) fn f() {}",
        "var<private> x: array<f32, 0>;",
        "var<immediate> x: u32;",
        "const_assert false;",
        "diagnostic(off, x);",
        "\0",
        "fn f() { _ = 0x; }",
        "1e999",
        "\u{2028}",
        "a\u{0}b",
        "var<uniform> _naga: f32; fn g() -> f32 { return _naga; }",
    ];
    for text in texts {
        // A fault or not; never a panic, not in an import either.
        let _ = compose(&library(&[("main.wgsl", text)]), "main.wgsl", &Defs::new());
        let lib = format!("#define_import_path lib\nfn ok() {{}}\n{text}");
        let main = "#import lib::ok\n@compute @workgroup_size(1) fn main() { ok(); }";
        let files = library(&[("lib.wgsl", &lib), ("main.wgsl", main)]);
        if let Err(faults) = compose(&files, "main.wgsl", &Defs::new()) {
            assert!(!faults.to_string().contains("gave up"), "{text:?}: {faults}");
        }
        mentioned_defs(&files, "main.wgsl");
    }
}

#[test]
fn cut_texts_do_not_panic() {
    let whole = "#import scene::{shine as s, materials}\n#if N == 1\nvar<uniform> é: f32; /* c */\n#endif\n@compute @workgroup_size(#{N}) fn main() { _ = s(0u) + materials[0].c1.x; }";
    let cuts = whole.char_indices().map(|(at, _)| at).filter(|at| at % 3 == 0);
    for at in cuts {
        let files = library(&[("lib.wgsl", SCENE), ("main.wgsl", &whole[..at])]);
        if let Err(faults) = compose(&files, "main.wgsl", &defs(&[("N", Def::Int(1))])) {
            assert!(!faults.to_string().contains("gave up"), "{faults}");
        }
    }
}

#[test]
fn folders_are_read_once_and_the_first_wins() {
    let root = std::env::temp_dir().join(format!("lightgraph-library-{}", std::process::id()));
    let write = |path: &str, text: &[u8]| {
        let path = root.join(path);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a new folder");
        std::fs::write(path, text).expect("a new file");
    };
    write("one/a.wgsl", b"// first");
    write("one/lib/b.wgsl", b"// b");
    write("one/notes.txt", b"\xff");
    write("two/a.wgsl", b"// second");
    write("two/c.wgsl", b"// c");
    let dirs = [root.join("one"), root.join("two")];
    let loaded = Library::load(&dirs).expect("a library");
    assert_eq!(loaded.files.keys().collect::<Vec<_>>(), ["a.wgsl", "c.wgsl", "lib/b.wgsl"]);
    assert_eq!(loaded.files["a.wgsl"].text, "// first");
    write("two/bad.wgsl", b"\xff");
    let faults = Library::load(&[dirs[1].clone(), root.join("none")]).expect_err("two faults");
    assert_eq!(faults.0.len(), 2, "{faults}");
    std::fs::remove_dir_all(&root).expect("to clean up");
}

/// wgpu takes the module as it is and finds a layout in it. No GPU: the noop device still validates.
#[test]
fn wgpu_takes_the_module() {
    let main = "#import scene::{shine, materials}
        var<uniform> never: f32;
        var<storage, read_write> out: array<f32>;
        var<storage, read_write> named: array<f32>;
        @compute @workgroup_size(8) fn main(@builtin(global_invocation_id) id: vec3u) {
            _ = &named;
            out[id.x] = shine(id.x) + materials[0].c1.x;
        }";
    let shader = composed(&[("lib/scene.wgsl", SCENE), ("main.wgsl", main)], &[]);
    assert_eq!(names(&shader.interface), ["materials", "out"]);
    let (device, _) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(shader.module)),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    pipeline.get_bind_group_layout(0);
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
}

#[test]
fn stacked_and_shadowed_names() {
    let lib = "#define_import_path lib\nconst K = 2.0;\nstruct S { shine: f32, x1: f32, y_: f32 }\nfn shine(s: S) -> f32 { return s.shine * s.x1 * s.y_; }";
    let main = "#import lib::{S, shine, K as k}\nstruct T { k: f32, shine: f32 }\n
        @fragment fn main(@location(0) k: f32, @builtin(position) p: vec4f) -> @location(0) vec4f {
            let t = T(k, 1.0);
            let s = S(t.k, t.shine, k);
            let shine2 = modf(p.x).fract + s.x1;
            return vec4f(shine(s), p.xy, shine2);
        }";
    composed(&[("lib.wgsl", lib), ("main.wgsl", main)], &[]);
}
