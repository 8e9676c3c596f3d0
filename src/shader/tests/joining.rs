//! Several files and definitions to one module.

use super::*;

#[test]
fn a_condition_compares_as_its_operator_says() {
    let branch = |name: &str| {
        let declared = format!("var<storage, read_write> {name}: array<u32>;");
        format!("{declared}\n@compute @workgroup_size(1) fn main() {{ {name}[0] = 1u; }}")
    };
    for n in 3..=5_u32 {
        let all = [("==", n == 4), ("!=", n != 4), ("<", n < 4), ("<=", n <= 4), (">", n > 4), (">=", n >= 4)];
        for (operator, holds) in all {
            let text = format!("#if N {operator} 4\n{}\n#else\n{}\n#endif\n", branch("yes"), branch("no"));
            let shader = composed(&[("main.wgsl", &text)], &[("N", Def::Uint(n))]);
            assert_eq!(names(&shader.interface), [if holds { "yes" } else { "no" }], "{n} {operator} 4");
        }
    }
}

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
    let BindingKind::Storage { element, stride, fixed_size, writable, of } = &shader.interface.variables[1].kind else {
        panic!("{:?}", shader.interface.variables[1])
    };
    assert_eq!((*stride, *fixed_size, *writable), (32, None, false));
    assert_eq!(*of, Some(ElementType::Struct("Material".into())));
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
    let index = files.index();
    let mentioned: Vec<&str> = index.mentioned(["main.wgsl"]).into_iter().collect();
    assert_eq!(mentioned, ["DEEP", "M", "N", "OFF", "OTHER"]);
    assert!(index.mentioned(["absent.wgsl"]).is_empty());
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

/// Those of folders, without the language's own.
fn paths(library: &Library) -> Vec<&str> {
    library.files.keys().map(String::as_str).filter(|path| !path.starts_with("lightgraph/")).collect()
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
    assert_eq!(paths(&loaded), ["a.wgsl", "c.wgsl", "lib/b.wgsl"]);
    assert_eq!(loaded.files["a.wgsl"].text, "// first");
    write("two/bad.wgsl", b"\xff");
    let faults = Library::load(&[dirs[1].clone(), root.join("none")]).expect_err("two faults");
    assert_eq!(faults.0.len(), 2, "{faults}");
    std::fs::remove_dir_all(&root).expect("to clean up");
}

/// wgpu takes the module as it is and finds a layout in it. No GPU: the noop device still validates.
#[cfg(feature = "gpu")]
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

/// What shader libraries are made of survives the way through naga_oil, which turns headers back into WGSL.
#[test]
fn libraries_may_hold_all_of_wgsl() {
    let random = "#define_import_path random
        var<private> seed: u32 = 7u;
        fn pcg(state: ptr<function, u32>) -> u32 { *state = *state * 747796405u + 2891336453u; return (*state >> 16u) ^ *state; }
        fn next() -> f32 { seed = seed * 3u; return bitcast<f32>((seed >> 9u) | 0x3f800000u) - 1.0; }";
    let sh = "#define_import_path sh
        #import random::next
        const ORDER = 3u;
        const COUNT: u32 = ORDER * ORDER;
        const BAND = array<f32, COUNT>(0.282095, 0.488603, 0.488603, 0.488603, 1.0, 1.0, 1.0, 1.0, 1.0);
        struct Sh9 { l: array<vec3f, COUNT> }
        struct Pair { s1: Sh9, s2: Sh9, }
        var<workgroup> partial: array<vec3f, 64>;
        var<storage, read_write> total: array<atomic<u32>, 4>;
        var probes: texture_storage_3d<rgba32float, read_write>;
        @group(0) @binding(auto) var atlas: texture_2d<f32>;
        fn zero() -> Sh9 { return Sh9(); }
        fn eval(sh: Sh9, n: vec3f) -> vec3f {
            var sum = vec3f(0.0);
            for (var i = 0u; i < COUNT; i++) { sum += sh.l[i] * BAND[i] * n.x; }
            switch ORDER { case 1u, 2u: { sum *= 2.0; } default: {} }
            return select(sum, vec3f(next()), any(n == vec3f(0.0)));
        }
        fn sample(t: texture_2d<f32>, s: sampler, uv: vec2f) -> vec4f { return textureSampleLevel(t, s, uv, 0.0); }
        fn gather_here(s: sampler) -> vec4f { return sample(atlas, s, vec2f(0.5)) + textureGather(1, atlas, s, vec2f()); }
        fn reduce(i: u32) -> vec3f {
            partial[i] = vec3f(f32(i));
            workgroupBarrier();
            atomicMax(&total[i % 4u], i);
            let r = atomicCompareExchangeWeak(&total[0], 1u, 2u);
            let m = modf(f32(i) * 0.5);
            let f = frexp(m.fract);
            return partial[i ^ 1u] * select(f.fract, m.whole, r.exchanged);
        }";
    let main = "#import sh::{Sh9, Pair, eval, zero, reduce, gather_here, COUNT, BAND}
        #import random
        var lin: sampler;
        const HALF = COUNT / 2u;
        struct Mine { pair: Pair, list: array<Sh9, 2> }
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            var state = i;
            var mine: Mine;
            mine.pair.s1.l[HALF] = reduce(i) + BAND[i % COUNT] + f32(random::pcg(&state));
            mine.list[0] = zero();
            let light = eval(mine.pair.s1, vec3f(random::next(), 1, 0)) + gather_here(lin).xyz;
            textureStore(sh::probes, vec3u(i), vec4f(light, textureLoad(sh::probes, vec3u(0)).x));
        }";
    let shader = composed(&[("random.wgsl", random), ("lib/sh.wgsl", sh), ("main.wgsl", main)], &[]);
    assert_eq!(names(&shader.interface), ["atlas", "lin", "probes", "total"]);
    let filtered = TextureSample::Float { filtered: true };
    assert!(matches!(shader.interface.variables[0].kind, BindingKind::Texture { sample, .. } if sample == filtered));
    assert_eq!(shader.interface.entries[0].uses[&3], Access { read: true, write: true });
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    use std::os::unix::fs::symlink;
    let root = std::env::temp_dir().join(format!("lightgraph-links-{}", std::process::id()));
    let inside = root.join("inside");
    std::fs::create_dir_all(&inside).expect("a new folder");
    std::fs::write(root.join("secret.wgsl"), "").expect("a new file");
    std::fs::write(inside.join("a.wgsl"), "").expect("a new file");
    symlink(root.join("secret.wgsl"), inside.join("out.wgsl")).expect("a link");
    symlink(&root, inside.join("up")).expect("a link");
    symlink(&inside, inside.join("round")).expect("a link");
    symlink(inside.join("a.wgsl"), inside.join("b.wgsl")).expect("a link");
    let loaded = Library::load(std::slice::from_ref(&inside)).expect("a library");
    assert_eq!(paths(&loaded), ["a.wgsl", "b.wgsl"]);
    symlink(root.join("nowhere.wgsl"), inside.join("c.wgsl")).expect("a link");
    assert_eq!(Library::load(std::slice::from_ref(&inside)).expect_err("a fault").0.len(), 1);
    std::fs::remove_dir_all(&root).expect("to clean up");
}
