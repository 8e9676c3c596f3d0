//! What the last frame took.

use super::RendererState;
use crate::device::Device;
use serde_json::{Value, json};

/// Milliseconds and counts, by step.
pub fn stats(device: &Device, state: &RendererState) -> Value {
    let RendererState { session, report, number, time, call_ms, .. } = state;
    let (plan, info) = (&session.plan, &device.gpu.info);
    let (allocated, without_sharing) = plan.bytes();
    let steps = plan.steps.iter().enumerate().map(|(i, step)| {
        let took = report.steps.iter().find(|t| t.step == i);
        json!({
            "name": step.name,
            "pass": step.pass,
            "ran": took.is_some(),
            "why": session.why().get(i).map(ToString::to_string),
            "runs": took.map_or(0, |t| t.runs),
            "instances": took.and_then(|t| t.instances),
            "gpu_ms": took.and_then(|t| t.gpu_ms),
            "cpu_ms": took.map_or(0.0, |t| t.cpu_ms),
        })
    });
    let loops = report.loops.iter().map(|l| json!({"name": l.name, "iterations": l.iterations, "last": l.last}));
    json!({
        "graph": plan.graph,
        "scene": session.scene.name,
        "size": session.settings.size,
        "frames": number,
        "time": time,
        "call_ms": call_ms,
        "wall_ms": report.wall_ms,
        "device_ms": report.device_ms,
        "plan_ms": session.plan_ms,
        "causes": session.causes(),
        "steps": steps.collect::<Vec<_>>(),
        "loops": loops.collect::<Vec<_>>(),
        "bytes": {"allocated": allocated, "without_sharing": without_sharing},
        "adapter": {"name": info.name, "driver": info.driver_info, "software": device.gpu.is_software()},
    })
}
