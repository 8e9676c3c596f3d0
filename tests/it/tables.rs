//! Columns of the scene's tables as texels hold what the tables hold, also after some rows of them changed.

use crate::{device, support};
use glam::Vec3;
use lightgraph::{Project, Scene, Session, Settings};

const GRAPH: &str = r#"Graph(
    resources: {
        "corners": Table(of: "triangles", columns: ["a", "material", "b", "c"]),
        "boxes": Table(of: "bvh", columns: ["lower", "first", "upper", "count"]),
        "color": Texture(format: Rgba32Float, size: 1),
    },
    passes: [Compute(name: "compare", shader: "compare.wgsl", over: "workgroup_size")],
    outputs: {"color": "color"},
)"#;

const COMPARE: &str = "
struct Triangle { a: vec3f, material: u32, b: vec3f, c: vec3f }
var<storage, read> triangles: array<Triangle>;
struct Box { lower: vec3f, first: u32, upper: vec3f, count: u32 }
var<storage, read> bvh: array<Box>;
var corners: texture_2d<u32>;
var boxes: texture_storage_2d<rgba32uint, read>;
var color: texture_storage_2d<rgba32float, write>;
var<workgroup> wrong: atomic<u32>;

fn place(texel: u32) -> vec2u { return vec2u(texel % 4096u, texel / 4096u); }

fn differ(texel: vec4u, xyz: vec3f, w: u32) -> u32 {
    return u32(any(texel != vec4u(bitcast<vec3u>(xyz), w)));
}

@compute @workgroup_size(64) fn compare(@builtin(local_invocation_index) lane: u32) {
    var n = 0u;
    for (var i = lane; i < arrayLength(&triangles); i += 64u) {
        let t = triangles[i];
        n += differ(textureLoad(corners, place(3u * i), 0), t.a, t.material);
        n += u32(any(textureLoad(corners, place(3u * i + 1u), 0).xyz != bitcast<vec3u>(t.b)));
        n += u32(any(textureLoad(corners, place(3u * i + 2u), 0).xyz != bitcast<vec3u>(t.c)));
    }
    for (var i = lane; i < arrayLength(&bvh); i += 64u) {
        n += differ(textureLoad(boxes, place(2u * i)), bvh[i].lower, bvh[i].first);
        n += differ(textureLoad(boxes, place(2u * i + 1u)), bvh[i].upper, bvh[i].count);
    }
    atomicAdd(&wrong, n);
    workgroupBarrier();
    if lane == 0u {
        // The first corner tells whether the table is that of the pose.
        textureStore(color, vec2u(0u), vec4f(f32(atomicLoad(&wrong)), f32(arrayLength(&triangles)), triangles[0].a.x, 1.0));
    }
}";

#[test]
fn columns_in_texels_follow_the_table() {
    let gpu = &device::gpu();
    let scratch = support::Scratch::new("table_texels");
    std::fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    let file = scratch.path().join("graph.ron");
    std::fs::write(&file, GRAPH).unwrap();
    std::fs::write(scratch.path().join("shaders/compare.wgsl"), COMPARE).unwrap();
    let project = Project::open(&file, &[]).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository("scenes/art_gallery.ron")).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { size: [4, 4], ..Settings::default() };
    let mut session = Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"));
    let nodes = session.scene.nodes.len();
    let mut first = vec![];
    // One node after the other, some at once, none: rows here and there, many lines and less than one.
    for frame in 0..nodes as u32 + 2 {
        session.shift.nodes = (0..nodes)
            .filter(|n| (n + 1) as u32 == frame || frame == nodes as u32 + 1 && n % 2 == 0)
            .map(|n| (n, Vec3::new(0.1, 0.2, 0.3 + frame as f32)))
            .collect();
        session.frame(gpu, frame, 0.0).unwrap_or_else(|f| panic!("frame {frame}: {f}"));
        let [wrong, rows, x] = session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}")).rgb().next().unwrap();
        assert_eq!(wrong, 0.0, "frame {frame}: texels that differ from the table's {rows} rows");
        assert!(3.0 * rows > 2.0 * 4096.0, "{rows} rows are too few to lie in several lines");
        first.push(x);
    }
    assert!(first.iter().any(|x| *x != first[0]), "no frame moved the first triangle");
}
