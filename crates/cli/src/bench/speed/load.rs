//! A scene of many triangles, made, read and sorted for rays: how long that takes and how much memory.

use super::list::Load;
use super::{Bench, Goal, SpeedRow};
use lightgraph::{Checked, Diagnostic, Scene};
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
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let total = 12 + 8 + json.len() + 8 + blob.len();
    let head = [b"glTF".as_slice(), &word(2), &word(total), &word(json.len()), b"JSON"].concat();
    [head, json, word(blob.len()).to_vec(), b"BIN\0".to_vec(), blob].concat()
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

impl Bench<'_> {
    pub(super) fn load(&self, load: &Load) -> Checked<Vec<SpeedRow>> {
        let section = "loading";
        let edge = f64::from(load.triangles / 2).sqrt().round().max(1.0) as u32;
        let bytes = hills(edge);
        let size = bytes.len() as f64;
        let folder = std::env::temp_dir().join(format!("lightgraph-load-{}", std::process::id()));
        let path = folder.join("hills.glb");
        let write = || {
            std::fs::create_dir_all(&folder)?;
            std::fs::write(&path, &bytes)
        };
        write().map_err(|e| Diagnostic::error(format!("can't write {}: {e}", path.display())))?;
        drop(bytes);
        let measured = measure(&path);
        // Nothing hangs on the folder.
        let _ = std::fs::remove_dir_all(&folder);
        let (load_ms, sort_ms, memory) = measured?;
        let name = format!("{} triangles", 2 * edge * edge);
        let note =
            format!("read {load_ms:.0} ms, tables and boxes for rays {sort_ms:.0} ms; file {:.1} MB", size * 1e-6);
        let time = SpeedRow::new(section, format!("{name}, read and sorted for rays"), load_ms + sort_ms, "ms");
        let mut rows = vec![time.wanted(Goal::AtMost(load.most_ms)).note(note)];
        for (what, bytes) in [("to read", memory[0]), ("to sort and hold tables", memory[1])] {
            let row = SpeedRow::new(
                section,
                format!("{name}, memory {what}"),
                bytes.map_or(f64::NAN, |b| b as f64 / size),
                "× the file",
            );
            rows.push(row.wanted(Goal::AtMost(load.most_memory)).note("peak, above what was held before"));
        }
        Ok(rows)
    }
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
