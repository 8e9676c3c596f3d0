//! `--stats`: what each frame and step took, as JSON.

use lightgraph::internals::plan::change::Why;
use lightgraph::{FrameReport, Gpu, Plan, Session};
use serde::Serialize;
use std::collections::BTreeMap;

/// The whole file.
#[derive(Debug, Clone, Serialize)]
pub struct Stats {
    pub version: &'static str,
    pub graph: String,
    pub scene: String,
    pub size: [u32; 2],
    pub parameters: BTreeMap<String, String>,
    pub adapter: Adapter,
    /// Milliseconds of each stage before the first frame.
    pub start_up_ms: BTreeMap<&'static str, f64>,
    pub bytes: MemoryUse,
    pub frames: Vec<FrameStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct Adapter {
    pub name: String,
    pub driver: String,
    pub driver_info: String,
    pub backend: String,
    /// Rendered on a CPU.
    pub software: bool,
}

/// Bytes of textures and buffers that the graph declares.
#[derive(Debug, Clone, Serialize)]
pub struct MemoryUse {
    pub allocated: u64,
    pub without_sharing: u64,
}

#[derive(Debug, Clone, Serialize)]
pub struct FrameStats {
    pub wall_ms: f64,
    /// Sum over the steps; `null` where the adapter has no timestamps.
    pub gpu_ms: Option<f64>,
    pub cpu_ms: f64,
    pub steps: Vec<StepStats>,
    pub loops: Vec<LoopStats>,
}

/// A step that ran, or a pass that did not.
#[derive(Debug, Clone, Serialize)]
pub struct StepStats {
    pub name: String,
    pub pass: String,
    /// `ran` or `skipped`.
    pub state: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    pub runs: u32,
    /// Of a step that ran in part: for how many of its instances.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instances: Option<u32>,
    pub gpu_ms: Option<f64>,
    pub cpu_ms: f64,
    /// Of a draw that leaves out what its members don't see.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<TriangleCounts>,
}

/// What a draw over several views sets up.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TriangleCounts {
    pub drawn: u64,
    /// All of the scene, once for each member.
    pub whole: u64,
}

#[derive(Debug, Clone, Serialize)]
pub struct LoopStats {
    pub name: String,
    pub iterations: u32,
    /// The number tested last.
    pub last: Option<f32>,
}

impl Stats {
    /// The statistics of a session before its first frame.
    pub fn new(gpu: &Gpu, session: &Session, start_up_ms: BTreeMap<&'static str, f64>) -> Stats {
        let plan = &session.plan;
        let (allocated, without_sharing) = plan.bytes();
        Stats {
            version: env!("CARGO_PKG_VERSION"),
            graph: plan.graph.clone(),
            scene: session.scene.name.clone(),
            size: session.settings.size,
            parameters: plan.params.iter().filter_map(|n| Some((n.clone(), plan.value(n)?.to_string()))).collect(),
            adapter: Adapter {
                name: gpu.info.name.clone(),
                driver: gpu.info.driver.clone(),
                driver_info: gpu.info.driver_info.clone(),
                backend: format!("{:?}", gpu.info.backend),
                software: gpu.is_software(),
            },
            start_up_ms,
            bytes: MemoryUse { allocated, without_sharing },
            frames: vec![],
        }
    }
}

impl FrameStats {
    /// The statistics of one frame.
    ///
    /// `why` says by step why it ran or did not, `triangles` what it drew ([`Session::triangles`]).
    pub fn new(plan: &Plan, report: &FrameReport, why: &[Why], triangles: &BTreeMap<usize, (u64, u64)>) -> FrameStats {
        let ran = report.steps.iter().filter_map(|t| {
            let step = plan.steps.get(t.step)?;
            Some(StepStats {
                name: step.name.clone(),
                pass: step.pass.clone(),
                state: "ran",
                why: why.get(t.step).map(Why::to_string),
                runs: t.runs,
                instances: t.instances,
                gpu_ms: t.gpu_ms,
                cpu_ms: t.cpu_ms,
                triangles: triangles.get(&t.step).map(|(drawn, whole)| TriangleCounts { drawn: *drawn, whole: *whole }),
            })
        });
        let left_out = plan.steps.iter().enumerate().filter(|(i, _)| !report.steps.iter().any(|t| t.step == *i));
        let left_out = left_out.map(|(i, step)| StepStats {
            name: step.name.clone(),
            pass: step.pass.clone(),
            state: "skipped",
            why: why.get(i).map(Why::to_string),
            runs: 0,
            instances: None,
            gpu_ms: None,
            cpu_ms: 0.0,
            triangles: None,
        });
        let skipped = plan.skipped.iter().map(|(name, why)| StepStats {
            name: name.clone(),
            pass: name.clone(),
            state: "skipped",
            why: Some(why.clone()),
            runs: 0,
            instances: None,
            gpu_ms: None,
            cpu_ms: 0.0,
            triangles: None,
        });
        FrameStats {
            wall_ms: report.wall_ms,
            gpu_ms: report.steps.iter().map(|t| t.gpu_ms).sum(),
            cpu_ms: report.steps.iter().map(|t| t.cpu_ms).sum(),
            steps: ran.chain(left_out).chain(skipped).collect(),
            loops: report
                .loops
                .iter()
                .map(|l| LoopStats { name: l.name.clone(), iterations: l.iterations, last: l.last })
                .collect(),
        }
    }
}
