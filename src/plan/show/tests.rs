//! The real graph, shown in every way.

use super::*;
use crate::plan::Plan;
use crate::plan::build::plan;
use crate::plan::request::{Request, sample_facts};
use crate::session::Project;
use crate::value::{Value, Values};
use std::path::Path;

/// The plan of a graph of the repository with some parameters changed.
fn planned(graph: &str, params: &[(&str, Value)]) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs").join(graph);
    let project = Project::open(&path, &[]).unwrap();
    let params: Values = params.iter().map(|(n, v)| (n.to_string(), *v)).collect();
    let facts = sample_facts(true);
    let mut plan = plan(&Request {
        graph: &project.graph,
        library: &project.library,
        params: &params,
        facts: &facts,
        screen: [640, 480],
        outputs: None,
        limits: &wgpu::Limits::default(),
        features: wgpu::Features::FLOAT32_FILTERABLE,
    })
    .unwrap()
    .plan;
    plan.graph = format!("graphs/{graph}");
    plan
}

#[test]
fn equal_steps_of_a_set_are_one_line() {
    let text = planned("uniform_grid.ron", &[]).to_string();
    println!("{text}");
    assert!(text.contains("loop bounce × 2 until change < 0.002"), "{text}");
    assert!(text.contains("for each i of 0…8"), "{text}");
    assert!(!text.contains("multiply[3]"), "{text}");
}
#[test]
fn dump() {
    let p = planned("uniform_grid.ron", &[]);
    let q = planned("uniform_grid.ron", &[("order", Value::Uint(1)), ("bounces", Value::Uint(0))]);
    std::fs::write("/tmp/show.svg", to_svg(&p)).unwrap();
    std::fs::write("/tmp/show0.svg", to_svg(&q)).unwrap();
    std::fs::write("/tmp/show.dot", to_dot(&p)).unwrap();
    std::fs::write("/tmp/show.json", serde_json::to_string_pretty(&to_json(&p)).unwrap()).unwrap();
    println!("{}", diff(&p, &q));
}
