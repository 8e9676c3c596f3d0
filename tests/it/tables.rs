//! Columns of the scene's tables as texels hold what the tables hold, also after some rows of them changed; and what
//! the device writes to tables is what the host works out.

use crate::{device, support};
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use lightgraph::internals::value::Value;
use lightgraph::{Gpu, Project, Scene, Session, Settings};

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

/// Of a graph and the shader that all of its passes run.
fn session(gpu: &Gpu, name: &str, scene: &str, [graph, shader]: [&str; 2]) -> Session {
    let scratch = support::Scratch::new(name);
    std::fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    let file = scratch.path().join("graph.ron");
    std::fs::write(&file, graph).unwrap();
    std::fs::write(scratch.path().join("shaders/compare.wgsl"), shader).unwrap();
    let project = Project::open(&file, &[]).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository(&format!("scenes/{scene}"))).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { size: [4, 4], ..Settings::default() };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

#[test]
fn columns_in_texels_follow_the_table() {
    let gpu = &device::gpu();
    let mut session = session(gpu, "table_texels", "art_gallery.ron", [GRAPH, COMPARE]);
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

const SHOWN: &str = r#"Graph(
    resources: {
        "matrices": Texture(format: Rgba32Float, size: (12, 64)),
        "boxes": Texture(format: Rgba32Float, size: (2, 512)),
        "corners": Texture(format: Rgba32Float, size: (3, 512)),
    },
    passes: [Compute(name: "show", shader: "compare.wgsl", over: "workgroup_size")],
    outputs: {"matrices": "matrices", "boxes": "boxes", "corners": "corners"},
)"#;

const SHOW: &str = "
struct Node { transform: mat4x4f, inverse_transpose: mat4x4f, previous_transform: mat4x4f }
var<storage, read> nodes: array<Node>;
struct Box { lower: vec3f, upper: vec3f }
var<storage, read> bvh: array<Box>;
struct Triangle { a: vec3f, na: vec3f, ta: vec4f }
var<storage, read> triangles: array<Triangle>;
var matrices: texture_storage_2d<rgba32float, write>;
var boxes: texture_storage_2d<rgba32float, write>;
var corners: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(64) fn show(@builtin(local_invocation_index) lane: u32) {
    for (var i = lane; i < arrayLength(&nodes); i += 64u) {
        for (var column = 0u; column < 4u; column++) {
            textureStore(matrices, vec2u(column, i), nodes[i].transform[column]);
            textureStore(matrices, vec2u(4u + column, i), nodes[i].inverse_transpose[column]);
            textureStore(matrices, vec2u(8u + column, i), nodes[i].previous_transform[column]);
        }
    }
    for (var i = lane; i < arrayLength(&bvh); i += 64u) {
        textureStore(boxes, vec2u(0u, i), vec4f(bvh[i].lower, 0.0));
        textureStore(boxes, vec2u(1u, i), vec4f(bvh[i].upper, 0.0));
    }
    for (var i = lane; i < arrayLength(&triangles); i += 64u) {
        textureStore(corners, vec2u(0u, i), vec4f(triangles[i].a, 0.0));
        textureStore(corners, vec2u(1u, i), vec4f(triangles[i].na, 0.0));
        textureStore(corners, vec2u(2u, i), triangles[i].ta);
    }
}";

/// Texels of an output, row by row.
fn texels(gpu: &Gpu, session: &Session, output: &str, across: usize) -> Vec<Vec<Vec4>> {
    let image = session.image(gpu, output).unwrap_or_else(|f| panic!("{f}"));
    let all: Vec<Vec4> = image.data.chunks_exact(4).map(Vec4::from_slice).collect();
    all.chunks(across).map(<[Vec4]>::to_vec).collect()
}

#[test]
fn what_the_device_writes_to_tables_is_what_the_host_works_out() {
    let gpu = &device::gpu();
    let mut session = session(gpu, "table_rows", "corridor.glb", [SHOWN, SHOW]);
    let turned = |scale: Vec3| {
        Mat4::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.7), Vec3::new(0.3, 0.5, -0.2))
    };
    // A move, a rest, others at once, one that mirrors, one that flattens, back to where it began.
    let moves: [&[(usize, Mat4)]; 7] = [
        &[],
        &[(3, turned(Vec3::ONE))],
        &[(3, turned(Vec3::ONE))],
        &[(1, turned(Vec3::new(2.0, 0.5, 3.0))), (5, turned(Vec3::splat(0.1)))],
        &[(4, turned(Vec3::new(-1.0, 1.0, 2.0)))],
        &[(4, turned(Vec3::new(1.0, 0.0, 1.0)))],
        &[],
    ];
    let mut before = None;
    for (frame, places) in (0..).zip(moves) {
        session.shift.places = places.iter().copied().collect();
        session.frame(gpu, frame, 0.0).unwrap_or_else(|f| panic!("frame {frame}: {f}"));
        let pose = session.scene.pose_shifted(0.0, &session.shift);
        let was = before.replace(pose.clone()).unwrap_or_else(|| pose.clone());
        let found = texels(gpu, &session, "matrices", 12);
        let near = |a: Vec4, b: Vec4| a.distance(b) <= 1e-5 * b.length().max(1.0);
        for (row, ((now, was), found)) in pose.nodes.iter().zip(was.nodes.iter()).zip(&found).enumerate() {
            let columns = |m: &Mat4| [m.x_axis, m.y_axis, m.z_axis, m.w_axis];
            assert_eq!((&found[..4], &found[8..]), (&columns(now)[..], &columns(was)[..]), "frame {frame}, node {row}");
            let m = Mat3::from_mat4(*now);
            let cofactors = [m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)];
            let scale = if m.determinant() == 0.0 { 1.0 } else { m.determinant().recip() };
            for (cofactor, found) in cofactors.into_iter().zip(&found[4..]) {
                assert!(near(*found, (cofactor * scale).extend(0.0)), "frame {frame}, node {row}: {found}");
            }
        }
        for (table, output, columns) in
            [("bvh", "boxes", &["lower", "upper"][..]), ("triangles", "corners", &["a", "na", "ta"])]
        {
            let tables = session.scene.tables(&pose);
            let expected = tables.iter().find(|t| t.name == table).unwrap();
            assert!(expected.rows > 20 && expected.rows <= 512, "{table}: {} rows", expected.rows);
            let found = texels(gpu, &session, output, columns.len());
            for (row, found) in found.iter().take(expected.rows).enumerate() {
                for (column, found) in columns.iter().zip(found) {
                    let expected = match expected.column(column).and_then(|c| c.get(row)) {
                        Some(Value::Vec3(v)) => v.extend(0.0),
                        Some(Value::Vec4(v)) => v,
                        other => panic!("{column} holds {other:?}"),
                    };
                    let right = near(*found, expected);
                    assert!(right, "frame {frame}, {table}, row {row}, {column}: {found}, not {expected}");
                }
            }
        }
    }
}
