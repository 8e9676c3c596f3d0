//! What a frame costs the host, on a device that computes nothing:
//! `cargo run --release --example host_time -- GRAPH SCENE NODE [NAME=VALUE]…`. Prints the medians of each kind of
//! frame: to record it, and to submit it.

use glam::Vec3;
use lightgraph::{Checked, Diagnostic, Gpu, Project, Scene, Session, Settings, View};
use std::path::Path;
use std::time::Instant;

/// Frames of each kind.
const FRAMES: u32 = 101;

/// What is changed before a frame, by a distance.
type SceneEdit<'c> = &'c dyn Fn(&mut Session, f32);

fn main() -> Checked<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [graph, scene, node, params @ ..] = words.as_slice() else {
        return Err(Diagnostic::error("say what is drawn").help("host_time GRAPH SCENE NODE [NAME=VALUE]…").into());
    };
    for (what, [recorded, submitted]) in times(Path::new(graph), Path::new(scene), node, params)? {
        println!("{what}: {recorded:.3} ms, to submit it {submitted:.3} ms");
    }
    Ok(())
}

/// The medians of each kind of frame in milliseconds: to record it, and to submit it.
fn times(graph: &Path, scene: &Path, node: &str, params: &[String]) -> Checked<Vec<(&'static str, [f64; 2])>> {
    let gpu = Gpu::noop(wgpu::Limits {
        max_multiview_view_count: 6,
        max_color_attachment_bytes_per_sample: 128,
        ..wgpu::Limits::default()
    })?;
    let project = Project::open(graph, &[])?;
    let scene = Scene::load(scene)?.scene;
    let moved = scene.nodes.iter().position(|n| n.name == node);
    let moved = moved.ok_or_else(|| Diagnostic::error(format!("the scene has no node `{node}`")))?;
    let settings = Settings { params: project.params(params)?, size: [640, 480], skip: true, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, scene, settings)?;
    let pose = session.scene.pose(0.0);
    let eye = pose.cameras.first().copied();
    let mut index = 0;
    let mut frame = |session: &mut Session| -> Checked<[f64; 2]> {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let start = Instant::now();
        let recorded = session.record(&gpu, &mut encoder, index, 0.0)?;
        let middle = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        let times = [middle - start, middle.elapsed()].map(|t| t.as_secs_f64() * 1e3);
        index += 1;
        gpu.wait()?;
        drop(recorded);
        Ok(times)
    };
    let kinds: [(&str, SceneEdit); 4] = [
        ("nothing changed", &|_, _| {}),
        ("the camera moved", &|session, by| {
            session.shift.view = eye.map(|e| View::perspective(e.position + Vec3::Y * by, e.forward, e.up, 0.9));
        }),
        ("the lights moved", &|session, by| session.shift.lights = Vec3::Y * by),
        ("the object moved", &|session, by| session.shift.nodes = vec![(moved, Vec3::Y * by)]),
    ];
    let mut found = vec![];
    for (what, change) in kinds {
        let mut times = vec![];
        for i in 0..FRAMES {
            change(&mut session, 0.001 * (i % 7 + 1) as f32);
            times.push(frame(&mut session)?);
        }
        let median = |part: usize| {
            let mut part: Vec<f64> = times.iter().map(|t| t[part]).collect();
            part.sort_by(f64::total_cmp);
            part[part.len() / 2]
        };
        found.push((what, [median(0), median(1)]));
    }
    Ok(found)
}
