//! The same image on other adapters of this machine.
//!
//! A driver is chosen when the Vulkan loader starts, so every other one gets a process of its own.

use super::case::Cases;
use super::report::{CaseRow, RowState};
use super::run::{StressGraph, difference_but};
use super::{StressOptions, finish};
use lightgraph::internals::gpu::ADAPTER_VARIABLE;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Scene, Session, Settings};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Where a second software driver lies that Debian's and Ubuntu's `chromium` package brings along.
const SWIFTSHADER: [&str; 3] = [
    "/usr/lib/chromium/vk_swiftshader_icd.json",
    "/usr/lib/chromium-browser/vk_swiftshader_icd.json",
    "/snap/chromium/current/usr/lib/chromium-browser/vk_swiftshader_icd.json",
];

/// Another way to render.
struct OtherAdapter {
    name: String,
    /// Set for the process.
    variables: Vec<(&'static str, String)>,
}

/// The rows of all graphs on all other adapters.
///
/// # Errors
/// The scene can't be made or written.
pub(super) fn rows(
    gpu: &Gpu,
    cases: &Cases,
    graphs: &[&StressGraph],
    options: &StressOptions,
    stop: &mut dyn FnMut() -> bool,
) -> Checked<Vec<CaseRow>> {
    let folder = &options.folder;
    let (bytes, description) = cases.adapters.scene.bytes(&Default::default())?;
    let file = folder.join("adapters.glb");
    write_atomically(&file, &bytes)?;
    if let Some(text) = description {
        write_atomically(&folder.join("adapters.ron"), text.as_bytes())?;
    }
    let (others, absent) = others(gpu);
    let mut rows = vec![];
    for (name, why) in absent {
        let mut row = CaseRow::new("adapter", &format!("adapter: {name}"), "", "");
        row.state = RowState::Absent;
        row.note(&why);
        rows.push(row);
    }
    for graph in graphs.iter().filter(|_| !others.is_empty()) {
        let ours = match image(gpu, cases, graph, &file) {
            Ok(image) => image,
            Err(faults) => {
                let mut row = CaseRow::new("adapter", "adapter: ours", &graph.name, "");
                row.fail(&faults.one_line());
                rows.push(row);
                continue;
            }
        };
        for other in &others {
            let mut row = CaseRow::new("adapter", &format!("adapter: {}", other.name), &graph.name, "");
            if stop() {
                rows.push(row.left());
                continue;
            }
            let start = Instant::now();
            let out = folder.join(format!("{}.exr", graph.name));
            match elsewhere(options, cases, graph, &file, &out, other) {
                Ok(theirs) => {
                    let off = difference_but(&theirs, &ours, cases.adapters.edges);
                    row.judge(Some(0.0), Some(off), off, cases.adapters.bound);
                }
                Err(faults) => row.fail(&faults.one_line()),
            }
            row.seconds = start.elapsed().as_secs_f64();
            rows.push(row);
        }
    }
    Ok(rows)
}

/// What else there is, and what there is not.
fn others(gpu: &Gpu) -> (Vec<OtherAdapter>, Vec<(String, String)>) {
    let mut found = vec![];
    let mut absent = vec![];
    match SWIFTSHADER.iter().find(|p| PathBuf::from(p).is_file()) {
        Some(path) if !gpu.info.name.contains("SwiftShader") => {
            let variables = ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"].map(|v| (v, (*path).to_string()));
            found.push(OtherAdapter { name: "SwiftShader".into(), variables: variables.into() });
        }
        Some(_) => {}
        None => absent.push(("SwiftShader".to_string(), "Debian's package `chromium` is not installed".to_string())),
    }
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL;
    for adapter in pollster::block_on(Gpu::instance().enumerate_adapters(backends)) {
        let info = adapter.get_info();
        let known = info.name == gpu.info.name || found.iter().any(|o| o.name == info.name);
        if !known {
            let variables = vec![(ADAPTER_VARIABLE, info.name.clone())];
            found.push(OtherAdapter { name: info.name, variables });
        }
    }
    (found, absent)
}

fn image(gpu: &Gpu, cases: &Cases, graph: &StressGraph, scene: &Path) -> Checked<Image> {
    let output = &cases.adapters.output;
    let settings = Settings {
        params: graph.project.params(&graph.texts(&cases.settings))?,
        size: [cases.adapters.size.0, cases.adapters.size.1],
        outputs: Some(vec![output.clone()]),
        ..Settings::default()
    };
    let mut session = Session::new(gpu, &graph.project, Scene::load(scene)?.scene, settings)?;
    session.frame(gpu, 0, 0.0)?;
    session.image(gpu, output)
}

fn elsewhere(
    options: &StressOptions,
    cases: &Cases,
    graph: &StressGraph,
    scene: &Path,
    out: &Path,
    other: &OtherAdapter,
) -> Checked<Image> {
    let StressOptions { program, shaders, .. } = options;
    let size = format!("{}x{}", cases.adapters.size.0, cases.adapters.size.1);
    let mut command = Command::new(program);
    command.arg("render").arg(&graph.path).arg("--scene").arg(scene).args(["--size", &size]);
    for text in graph.texts(&cases.settings) {
        command.args(["--set", &text]);
    }
    for folder in shaders {
        command.arg("--shaders").arg(folder);
    }
    let mut output = std::ffi::OsString::from(format!("{}=", cases.adapters.output));
    output.push(out);
    command.arg("--output").arg(output);
    command.envs(other.variables.iter().map(|(name, value)| (name, value)));
    let fault = |why: String| Diagnostic::error(format!("on {}: {why}", other.name));
    finish(&mut command, &[0]).map_err(fault)?;
    lightgraph::internals::image::exr::read_exr(out)
}
