//! Random edits of graph, base, shaders, scene and buffer, sound and broken, with reloads in between: the end is what a
//! fresh start gives, nothing panics, and nothing is left behind.

use crate::device;
use crate::support::{Random, Scratch};
use lightgraph::internals::gpu::ADAPTER_VARIABLE;
use lightgraph::{Checked, Gpu, Image, Project, Scene, Session, Settings};
use std::fs;
use std::path::Path;

const GRAPH: &str = r#"Graph(
    about: "Triangles in the light of a lamp.",
    params: {"red": Float(default: 0.5, about: "red"), "rounds": Uint(default: 2, max: 9, about: "how often it is dimmed")},
    resources: {
        "drawn": Texture(format: Rgba32Float, size: "screen"),
        "depth": Texture(format: Depth32Float, size: "screen"),
        "dimmed": Texture(format: Rgba32Float, size: "screen"),
        "color": Texture(format: Rgba32Float, size: "screen"),
    },
    passes: [
        Draw(name: "draw", shader: "draw.wgsl", color: "drawn", depth: "depth", cull: None),
        Loop(name: "again", count: "rounds", passes: [Screen(name: "dim", shader: "dim.wgsl", color: "dimmed")]),
        Screen(name: "show", shader: "show.wgsl", color: "color"),
    ],
    outputs: {"color": "color"},
)"#;

const VARIANT: &str = r#"Variant(
    base: "graph.ron",
    about: "With a red of its own.",
    params: {"red": (default: 0.25)},
)"#;

const DRAW: &str = "#import tint::tint
struct Light { intensity: vec3f }
var<storage, read> lights: array<Light>;
var<uniform> camera_view_projection: mat4x4f;
@vertex fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return camera_view_projection * vec4f(position, 1.0);
}
@fragment fn fragment() -> @location(0) vec4f { return vec4f(tint(lights[0].intensity), 1.0); }
";

const TINT: &str = "#define_import_path tint
var<uniform> red: f32;
fn tint(light: vec3f) -> vec3f { return light * vec3f(red, 0.5, 1.0); }
";

const DIM: &str = "var drawn: texture_2d<f32>;
var<uniform> again: u32;
@fragment fn dim(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(drawn, vec2u(at.xy), 0) / f32(1u + again);
}
";

const SHOW: &str = "var dimmed: texture_2d<f32>;
@fragment fn show(@builtin(position) at: vec4f) -> @location(0) vec4f { return textureLoad(dimmed, vec2u(at.xy), 0); }
";

const SCENE: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
"extensionsUsed": ["KHR_lights_punctual"],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2.0}]}},
"nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]},
    {"translation": [0, 1, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}}],
"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 36, "uri": "triangle.bin"}]
}"#;

/// The corners of a triangle.
fn corners(top: f32) -> Vec<u8> {
    [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, top, 0.0]].concat().iter().flat_map(|x: &f32| x.to_le_bytes()).collect()
}

/// Each file with what may stand in it: the first is what it begins with; sound ones and broken ones.
fn files() -> Vec<(&'static str, Vec<Vec<u8>>)> {
    let texts = |original: &str, edits: &[(&str, &str)]| {
        let edited = edits.iter().map(|(from, to)| {
            assert!(original.contains(from), "{from}");
            original.replace(from, to).into_bytes()
        });
        // Half of it, as while it is being written; and nothing, as when it has just been truncated.
        let broken = [original.as_bytes()[..original.len() / 2].to_vec(), vec![]];
        [original.as_bytes().to_vec()].into_iter().chain(edited).chain(broken).collect::<Vec<_>>()
    };
    vec![
        (
            "graph.ron",
            texts(
                GRAPH,
                &[
                    ("default: 2", "default: 3"),
                    ("default: 2", "default: 0"),
                    ("\"drawn\"", "\"drawm\""),
                    ("default: 0.5", "default: 0.75"),
                ],
            ),
        ),
        (
            "variant.ron",
            texts(
                VARIANT,
                &[("0.25", "1.5"), ("\"red\": (default: 0.25", "\"read\": (default: 1"), ("graph.ron", "gone.ron")],
            ),
        ),
        (
            "shaders/draw.wgsl",
            texts(
                DRAW,
                &[
                    ("tint(lights[0].intensity)", "lights[0].intensity"),
                    ("1.0); }\n", "0.5); }\n"),
                    ("#import tint::tint", ""),
                ],
            ),
        ),
        (
            "shaders/lib/tint.wgsl",
            texts(TINT, &[("0.5", "0.125"), ("light * ", "oops * "), ("red, 0.5, 1.0", "red, red, red")]),
        ),
        ("shaders/dim.wgsl", texts(DIM, &[("1u +", "2u +"), ("again", "agian"), ("vec2u(at.xy)", "vec2u(at.yx)")])),
        (
            "shaders/show.wgsl",
            texts(
                SHOW,
                &[
                    ("textureLoad(dimmed, vec2u(at.xy), 0)", "2.0 * textureLoad(dimmed, vec2u(at.xy), 0)"),
                    ("@fragment", "@fragmint"),
                ],
            ),
        ),
        ("scene.gltf", texts(SCENE, &[("2.0}", "5.0}"), ("[0, 0, 3]", "[0.5, 0, 2]"), ("triangle.bin", "gone.bin")])),
        ("triangle.bin", vec![corners(1.0), corners(0.25), corners(0.5), corners(1.0)[..20].to_vec(), vec![]]),
    ]
}

/// As `lightgraph watch` does on a change.
fn load(gpu: &Gpu, folder: &Path, previous: Option<&Session>) -> Checked<(Session, Image)> {
    let project = Project::open(&folder.join("variant.ron"), &[])?;
    let loaded = Scene::load(&folder.join("scene.gltf"))?;
    let settings = Settings { size: [12, 8], skip: true, ..Settings::default() };
    let mut session = Session::after(gpu, &project, loaded.scene, settings, previous)?;
    session.frame(gpu, 0, 0.0)?;
    let image = session.image(gpu, "color")?;
    Ok((session, image))
}

/// One edit of one file. Returns what it did, for the message of a failure.
fn edit(folder: &Path, files: &[(&str, Vec<Vec<u8>>)], random: &mut Random) -> String {
    let (name, contents) = &files[random.below(files.len())];
    let (path, index) = (folder.join(name), random.below(contents.len()));
    match random.below(6) {
        0 => {
            // It may be gone already.
            let _ = fs::remove_file(&path);
            return format!("{name} deleted");
        }
        1 => fs::write(&path, &contents[0]).unwrap(),
        2 | 3 => {
            let new = path.with_extension("new");
            fs::write(&new, &contents[index]).unwrap();
            fs::rename(&new, &path).unwrap();
        }
        _ => fs::write(&path, &contents[index]).unwrap(),
    }
    format!("{name} is {index}")
}

/// Pages of memory that this process holds, and objects of the device by kind.
fn held(gpu: &Gpu, instance: &wgpu::Instance) -> (usize, Vec<(&'static str, usize)>) {
    gpu.wait().unwrap_or_else(|f| panic!("{f}"));
    let report = instance.generate_report().expect("wgpu itself runs below");
    let hub = report.hub_report();
    let objects = vec![
        ("buffers", hub.buffers.num_kept_from_user),
        ("textures", hub.textures.num_kept_from_user),
        ("texture views", hub.texture_views.num_kept_from_user),
        ("samplers", hub.samplers.num_kept_from_user),
        ("bind groups", hub.bind_groups.num_kept_from_user),
        ("bind group layouts", hub.bind_group_layouts.num_kept_from_user),
        ("pipeline layouts", hub.pipeline_layouts.num_kept_from_user),
        ("render pipelines", hub.render_pipelines.num_kept_from_user),
        ("compute pipelines", hub.compute_pipelines.num_kept_from_user),
        ("shader modules", hub.shader_modules.num_kept_from_user),
        ("query sets", hub.query_sets.num_kept_from_user),
    ];
    let statm = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    (statm.split(' ').nth(1).and_then(|n| n.parse().ok()).unwrap_or(0), objects)
}

const SEQUENCES: u64 = 500;

/// 500 sequences of two to seven edits on one live session take their time: each of some 2,000 loads composes and
/// builds.
#[test]
fn random_edits_end_in_what_a_fresh_start_gives() {
    // A device of its own: what others hold on theirs is not counted.
    let _alone = device::gpu();
    let instance = Gpu::instance();
    let wanted = std::env::var(ADAPTER_VARIABLE).ok();
    let gpu = &Gpu::open_for(&instance, wanted.as_deref(), None).unwrap_or_else(|e| panic!("{e:?}"));
    let files = files();
    let scratch = Scratch::new("reloads");
    let folder = scratch.path();
    fs::create_dir_all(folder.join("shaders/lib")).unwrap();
    let restore = || files.iter().for_each(|(name, contents)| fs::write(folder.join(name), &contents[0]).unwrap());
    restore();
    let (mut session, mut last) = load(gpu, folder, None).unwrap_or_else(|f| panic!("{f}"));
    let (mut reloads, mut faulty, mut ended_well) = (0, 0, 0);
    let mut before = None;
    for seed in 0..SEQUENCES {
        let mut random = Random(seed);
        restore();
        let mut done = vec![];
        let edits = 2 + random.below(6);
        for i in 0..edits {
            done.push(edit(folder, &files, &mut random));
            // Rapid edits come without a reload between them.
            if i + 1 < edits && random.below(3) > 0 {
                continue;
            }
            done.push("reload".into());
            reloads += 1;
            let live = load(gpu, folder, Some(&session));
            if i + 1 == edits {
                let fresh = load(gpu, folder, None);
                match (&live, &fresh) {
                    (Ok((_, live)), Ok((_, fresh))) => {
                        ended_well += 1;
                        assert!(same(live, fresh), "{seed}: not what a fresh start gives: {done:?}");
                    }
                    (Err(live), Err(fresh)) => assert_eq!(live.to_string(), fresh.to_string(), "{seed}: {done:?}"),
                    _ => panic!("{seed}: works {}, a fresh start {}: {done:?}", live.is_ok(), fresh.is_ok()),
                }
            }
            match live {
                Ok(new) => (session, last) = new,
                Err(_) => {
                    faulty += 1;
                    // The last good frame keeps running.
                    session.frame(gpu, 1, 0.0).unwrap_or_else(|f| panic!("{seed}, {done:?}: {f}"));
                    let still = session.image(gpu, "color").unwrap_or_else(|f| panic!("{seed}, {done:?}: {f}"));
                    assert!(same(&still, &last), "{seed}: a faulty reload changed the image: {done:?}");
                }
            }
        }
        // By sequence 100 every kind of edit has been made, and what is made once is there. Counted in a state that is
        // always the same.
        if seed % 100 == 99 {
            restore();
            (session, last) = load(gpu, folder, Some(&session)).unwrap_or_else(|f| panic!("{seed}: not mended: {f}"));
            let now = held(gpu, &instance);
            let (_, objects) = before.get_or_insert_with(|| now.clone());
            for ((kind, count), (_, earlier)) in now.1.iter().zip(objects) {
                // Pipelines are kept for when the same is asked for again, with their layouts: so many at most.
                let kept = if matches!(*kind, "render pipelines" | "bind group layouts" | "pipeline layouts") {
                    300
                } else {
                    0
                };
                assert!(
                    *count <= kept.max(*earlier),
                    "{count} {kind} after {} sequences, {earlier} after 100",
                    seed + 1
                );
            }
        }
    }
    let (pages, _) = before.unwrap_or_default();
    let grown = held(gpu, &instance).0 as f64 / pages.max(1) as f64;
    println!(
        "{SEQUENCES} sequences, {reloads} reloads, {faulty} of them faulty, {ended_well} ends sound, memory × {grown:.3}"
    );
    assert!(ended_well > SEQUENCES / 10 && faulty > 100, "{ended_well} ends sound, {faulty} reloads faulty");
    assert!(grown < 1.25, "memory grew by {grown:.3} from sequence 100 to {SEQUENCES}");
}

fn same(a: &Image, b: &Image) -> bool {
    a.data.len() == b.data.len() && a.data.iter().zip(&b.data).all(|(x, y)| x.to_bits() == y.to_bits())
}
