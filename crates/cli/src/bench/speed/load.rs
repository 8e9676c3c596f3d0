//! Scenes of many triangles, textures or skinned vertices, made, read and posed: time and memory.

use super::list::Load;
use super::{Bench, Goal, SpeedRow};
use crate::glb::glb;
use lightgraph::{Checked, Diagnostic, Gpu, Scene, Session, Settings};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// A hilly ground of `edge`² squares, two triangles each, as GLB. Vertices have normals; indices are 32 bits.
pub(super) fn hills(edge: u32) -> Vec<u8> {
    let (side, mut vertices, mut normals, mut indices) = (edge + 1, vec![], vec![], vec![]);
    for i in 0..side * side {
        let (x, z) = ((i % side) as f32 / edge as f32, (i / side) as f32 / edge as f32);
        let height = |x: f32, z: f32| 0.05 * ((40.0 * x).sin() + (31.0 * z).cos());
        vertices.extend([x, height(x, z), z]);
        let normal = glam::Vec3::new(-2.0 * (40.0 * x).cos(), 1.0, 1.55 * (31.0 * z).sin()).normalize();
        normals.extend(normal.to_array());
    }
    for i in 0..edge * edge {
        let a = i / edge * side + i % edge;
        indices.extend([a, a + side, a + 1, a + 1, a + side, a + side + 1]);
    }
    let parts: [&[u8]; 3] =
        [bytemuck::cast_slice(&vertices), bytemuck::cast_slice(&normals), bytemuck::cast_slice(&indices)];
    let blob = parts.concat();
    let [p, n, i] = parts.map(<[u8]>::len);
    let count = side * side;
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2}}]}}],
        "buffers":[{{"byteLength":{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{p}}},{{"buffer":0,"byteOffset":{p},"byteLength":{n}}},
            {{"buffer":0,"byteOffset":{},"byteLength":{i}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":[0,-0.1,0],"max":[1,0.1,1]}},
            {{"bufferView":1,"componentType":5126,"count":{count},"type":"VEC3"}},
            {{"bufferView":2,"componentType":5125,"count":{},"type":"SCALAR"}}]}}"#,
        blob.len(),
        p + n,
        indices.len(),
    );
    glb(&json, &blob)
}

/// Bones of the tube.
const BONES: usize = 24;

/// Vertices round the tube.
const ROUND: u32 = 200;

/// A tube of rings of [`ROUND`] vertices, as GLB. Each vertex follows four of the bones in a chain, which bend to one
/// side within a second.
pub(super) fn tube(vertices: u32) -> Vec<u8> {
    let rings = (vertices / ROUND).max(2);
    let place = |i: u32| {
        let (turn, up) =
            ((i % ROUND) as f32 * std::f32::consts::TAU / ROUND as f32, (i / ROUND) as f32 / (rings - 1) as f32);
        (turn.cos(), up, turn.sin())
    };
    let all = 0..rings * ROUND;
    let positions: Vec<f32> = all.clone().map(place).flat_map(|(x, y, z)| [0.1 * x, y, 0.1 * z]).collect();
    let normals: Vec<f32> = all.clone().map(place).flat_map(|(x, _, z)| [x, 0.0, z]).collect();
    let first = |up: f32| ((up * BONES as f32) as usize).clamp(1, BONES - 3) - 1;
    let joints: Vec<u8> = all.clone().flat_map(|i| [0, 1, 2, 3].map(|k| (first(place(i).1) + k) as u8)).collect();
    let weights: Vec<f32> = all.flat_map(|_| [0.25; 4]).collect();
    let quad = |i: u32| {
        let (a, b) = (i, i - i % ROUND + (i + 1) % ROUND);
        [a, a + ROUND, b, b, a + ROUND, b + ROUND]
    };
    let indices: Vec<u32> = (0..(rings - 1) * ROUND).flat_map(quad).collect();
    let bone = 1.0 / BONES as f32;
    let identity = |up: f32| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., up, 0., 1.];
    let bind: Vec<f32> = (0..BONES).flat_map(|k| identity(-bone * k as f32)).collect();
    let times = [0.0_f32, 1.0];
    let bent = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.05, 0.998_749];
    let parts: [&[u8]; 8] = [
        bytemuck::cast_slice(&positions),
        bytemuck::cast_slice(&normals),
        &joints,
        bytemuck::cast_slice(&weights),
        bytemuck::cast_slice(&indices),
        bytemuck::cast_slice(&bind),
        bytemuck::cast_slice(&times),
        bytemuck::cast_slice(&bent),
    ];
    let mut from = 0;
    let views = parts.map(|part| {
        let view = json!({"buffer": 0, "byteOffset": from, "byteLength": part.len()});
        from += part.len();
        view
    });
    let count = rings * ROUND;
    let lists = [
        ("VEC3", 5126, count),
        ("VEC3", 5126, count),
        ("VEC4", 5121, count),
        ("VEC4", 5126, count),
        ("SCALAR", 5125, indices.len() as u32),
        ("MAT4", 5126, BONES as u32),
        ("SCALAR", 5126, 2),
        ("VEC4", 5126, 2),
    ];
    let accessor =
        |(view, (kind, code, rows))| json!({"bufferView": view, "type": kind, "componentType": code, "count": rows});
    let mut accessors: Vec<Value> = lists.into_iter().enumerate().map(accessor).collect();
    (accessors[0]["min"], accessors[0]["max"]) = (json!([-0.1, 0, -0.1]), json!([0.1, 1, 0.1]));
    (accessors[6]["min"], accessors[6]["max"]) = (json!([0]), json!([1]));
    // Node 0 has the mesh; the bones follow.
    let mut nodes = vec![json!({"mesh": 0, "skin": 0})];
    nodes.extend((0..BONES).map(|k| match k {
        0 => json!({"children": [2]}),
        k if k + 1 < BONES => json!({"translation": [0, bone, 0], "children": [k + 2]}),
        _ => json!({"translation": [0, bone, 0]}),
    }));
    let channel = |k: usize| json!({"sampler": 0, "target": {"node": k + 1, "path": "rotation"}});
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "nodes": nodes,
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 4,
        }]}],
        "skins": [{"joints": (1..=BONES).collect::<Vec<_>>(), "inverseBindMatrices": 5}],
        "animations": [{
            "samplers": [{"input": 6, "output": 7}],
            "channels": (0..BONES).map(channel).collect::<Vec<Value>>(),
        }],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": from}],
    });
    glb(&json.to_string(), &parts.concat())
}

/// The most memory this process has held since the last call, in bytes; `None` where the system doesn't say.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?.trim().strip_suffix(" kB")?.parse::<u64>().ok()?;
    // From here on the peak counts anew (proc(5), clear_refs).
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(1024 * kib)
}

fn held() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?.parse::<u64>().ok()?;
    Some(1024 * kib)
}

/// Of a quad: positions, then texture coordinates.
const CORNERS: [f32; 20] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 1.];

/// Quads side by side, one for each of `count` files, whose image it shows; as glTF.
fn quads(count: u32) -> String {
    let list = |of: &dyn Fn(u32) -> String| (0..count).map(of).collect::<Vec<_>>().join(",");
    let nodes = list(&|i| format!(r#"{{"mesh":{i},"translation":[{i},0,0]}}"#));
    let shape = r#""attributes":{"POSITION":0,"TEXCOORD_0":1},"mode":6"#;
    let meshes = list(&|i| format!(r#"{{"primitives":[{{{shape},"material":{i}}}]}}"#));
    let materials = list(&|i| format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#));
    let textures = list(&|i| format!(r#"{{"source":{i}}}"#));
    let images = list(&|i| format!(r#"{{"uri":"{i}.jpg"}}"#));
    let all = list(&|i| i.to_string());
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{all}]}}],"nodes":[{nodes}],"meshes":[{meshes}],
        "materials":[{materials}],"textures":[{textures}],"images":[{images}],
        "buffers":[{{"byteLength":80,"uri":"corners.bin"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}}]}}"#
    )
}

pub(super) fn write_quads(folder: &Path, count: u32, picture: &[u8]) -> std::io::Result<()> {
    std::fs::write(folder.join("quads.gltf"), quads(count))?;
    std::fs::write(folder.join("corners.bin"), bytemuck::cast_slice(&CORNERS))?;
    (0..count).try_for_each(|i| std::fs::write(folder.join(format!("{i}.jpg")), picture))
}

/// Waves and grain, as JPEG: some 10 bits a pixel, as photographs of rough surfaces have.
pub(super) fn picture(edge: u32) -> Checked<Vec<u8>> {
    let texel = |i: u32| {
        let (x, y) = ((i % edge) as f32, (i / edge) as f32);
        let grain = (i.wrapping_mul(747_796_405).rotate_right(15).wrapping_mul(277_803_737) >> 26) as f32;
        [0.031, 0.047, 0.083].map(|f| (128.0 + 60.0 * (f * x).sin() * (f * y).cos() + grain) as u8)
    };
    let pixels: Vec<u8> = (0..edge * edge).flat_map(texel).collect();
    let mut bytes = vec![];
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 90);
    let encoded = encoder.encode(&pixels, edge, edge, image::ExtendedColorType::Rgb8);
    encoded.map_err(|e| Diagnostic::error(format!("can't encode a picture: {e}")))?;
    Ok(bytes)
}

/// `measured` of what `write` puts into a folder, which is gone afterwards.
fn in_folder<T>(
    write: impl Fn(&Path) -> std::io::Result<()>,
    measured: impl FnOnce(&Path) -> Checked<T>,
) -> Checked<T> {
    let folder = tempfile::tempdir().map_err(|e| Diagnostic::error(format!("can't make a folder: {e}")))?;
    let shown = folder.path().display();
    write(folder.path()).map_err(|e| Diagnostic::error(format!("can't write into {shown}: {e}")))?;
    measured(folder.path())
}

const SECTION: &str = "loading";

impl Bench<'_> {
    pub(super) fn load(&self, load: &Load) -> Checked<Vec<SpeedRow>> {
        match *load {
            Load::Triangles { count, most_ms, most_memory } => triangles(count, most_ms, most_memory),
            Load::Textures { count, edge, most_ms } => textures(count, edge, most_ms),
            Load::Poses { vertices, frames, ref graph, most_ms } => self.poses(vertices, frames, graph, most_ms),
        }
    }

    /// On a device that computes nothing: the time is the host's alone.
    fn poses(&self, vertices: u32, frames: u32, graph: &str, most_ms: f64) -> Checked<Vec<SpeedRow>> {
        let bytes = tube(vertices);
        let write = |folder: &Path| std::fs::write(folder.join("tube.glb"), &bytes);
        let scene = in_folder(write, |folder| Ok(Scene::load(&folder.join("tube.glb"))?.scene))?;
        let count = scene.geometry.vertices.len();
        let gpu = Gpu::noop(wgpu::Limits {
            max_multiview_view_count: 6,
            max_color_attachment_bytes_per_sample: 128,
            ..wgpu::Limits::default()
        })?;
        let project = self.project(graph)?;
        let settings = Settings { size: [640, 480], skip: true, ..Settings::default() };
        let mut session = Session::new(&gpu, &project, scene, settings)?;
        let (mut recorded, mut posed) = (vec![], vec![]);
        for frame in 0..frames {
            let time = frame as f32 / frames as f32;
            let start = Instant::now();
            std::hint::black_box(session.scene.pose(time));
            posed.push(start.elapsed().as_secs_f64() * 1e3);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let start = Instant::now();
            let later = session.record(&gpu, &mut encoder, frame, time)?;
            recorded.push(start.elapsed().as_secs_f64() * 1e3);
            gpu.queue.submit([encoder.finish()]);
            gpu.wait()?;
            drop(later);
        }
        let median = |mut times: Vec<f64>| {
            times.sort_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let note = format!("the pose alone {:.2} ms; medians of {frames} frames of {graph}", median(posed));
        let name = format!("{count} skinned vertices, a frame of another pose, the host's part");
        Ok(vec![SpeedRow::new(SECTION, name, median(recorded), "ms").wanted(Goal::AtMost(most_ms)).note(note)])
    }
}

fn triangles(count: u32, most_ms: f64, most_memory: f64) -> Checked<Vec<SpeedRow>> {
    let edge = f64::from(count / 2).sqrt().round().max(1.0) as u32;
    let bytes = hills(edge);
    let size = bytes.len() as f64;
    let write = |folder: &Path| std::fs::write(folder.join("hills.glb"), &bytes);
    let (load_ms, sort_ms, memory) = in_folder(write, |folder| measure(&folder.join("hills.glb")))?;
    let name = format!("{} triangles", 2 * edge * edge);
    let note = format!("read {load_ms:.0} ms, tables and boxes for rays {sort_ms:.0} ms; file {:.1} MB", size * 1e-6);
    let time = SpeedRow::new(SECTION, format!("{name}, read and sorted for rays"), load_ms + sort_ms, "ms");
    let mut rows = vec![time.wanted(Goal::AtMost(most_ms)).note(note)];
    for (what, bytes) in [("to read", memory[0]), ("to sort and hold tables", memory[1])] {
        let peak = bytes.map_or(f64::NAN, |b| b as f64 / size);
        let row = SpeedRow::new(SECTION, format!("{name}, memory {what}"), peak, "× the file");
        rows.push(row.wanted(Goal::AtMost(most_memory)).note("peak, above what was held before"));
    }
    Ok(rows)
}

fn textures(count: u32, edge: u32, most_ms: f64) -> Checked<Vec<SpeedRow>> {
    let picture = picture(edge)?;
    let write = |folder: &Path| write_quads(folder, count, &picture);
    let (load_ms, tables_ms, memory) = in_folder(write, |folder| measure(&folder.join("quads.gltf")))?;
    let gigabytes = |bytes: Option<u64>| bytes.map_or("?".into(), |b| format!("{:.2}", b as f64 * 1e-9));
    let note = format!("files of {:.1} MB; {} GB at the peak", picture.len() as f64 * 1e-6, gigabytes(memory[0]));
    let name = format!("{count} textures of {edge} × {edge}, read and decoded");
    Ok(vec![SpeedRow::new(SECTION, name, load_ms + tables_ms, "ms").wanted(Goal::AtMost(most_ms)).note(note)])
}

/// Milliseconds to read a scene and to make its tables for rays; the peaks of memory of both.
fn measure(path: &Path) -> Checked<(f64, f64, [Option<u64>; 2])> {
    let before = held();
    peak();
    let start = Instant::now();
    let scene = Scene::load(path)?.scene;
    let loaded = start.elapsed().as_secs_f64() * 1e3;
    let first = peak().zip(before).map(|(p, b)| p.saturating_sub(b));
    let start = Instant::now();
    let pose = scene.pose(0.0);
    let tables = scene.tables_named(&pose, |n| ["triangles", "bvh"].contains(&n));
    let sorted = start.elapsed().as_secs_f64() * 1e3;
    let second = peak().zip(before).map(|(p, b)| p.saturating_sub(b));
    drop(tables);
    Ok((loaded, sorted, [first, second]))
}
