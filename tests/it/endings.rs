//! A loop that ends on the device makes the same bits and takes the same iterations as one that the host ends.

use crate::{device, support};
use lightgraph::internals::gpu::{FrameInputs, execute, prepare, read_image};
use lightgraph::internals::plan::{Ending, OrderNode};
use lightgraph::internals::session::plan_for;
use lightgraph::internals::value::Value;
use lightgraph::{FrameReport, Gpu, Plan, Project, Scene, Settings};

fn plan(gpu: &Gpu, graph: &str, scene: &Scene, set: &[&str]) -> Plan {
    let project = Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { params, size: [16, 12], ..Settings::default() };
    plan_for(&project, scene, &settings, gpu).unwrap_or_else(|f| panic!("{f}")).plan
}

/// The plan with the host in charge of its loops.
fn by_host(mut plan: Plan) -> Plan {
    for node in &mut plan.order {
        if let OrderNode::Loop(l) = node
            && let Some(until) = &mut l.until
        {
            assert_eq!(until.ending, Ending::Device, "`{}`", l.name);
            until.ending = Ending::Host { why: "for comparison".into() };
        }
    }
    plan
}

/// The bits of all outputs, and what the loops took.
fn run(gpu: &Gpu, plan: &Plan, scene: &Scene) -> (Vec<Vec<u32>>, FrameReport) {
    let pose = scene.pose(0.0);
    let tables = scene.tables(&pose);
    let prepared = prepare(gpu, plan, &scene.assets(), &tables);
    let mut prepared = prepared.unwrap_or_else(|f| panic!("{f}"));
    let mut values = scene.camera_values(&pose, None, 16, 12).unwrap_or_else(|f| panic!("{f}")).0;
    values.insert("frame".into(), Value::Uint(0));
    values.insert("first_frame".into(), Value::Bool(true));
    values.insert("time".into(), Value::Float(0.0));
    let frame = FrameInputs { values, ..FrameInputs::default() };
    // Twice: what the first frame's loop left must not reach the second's.
    execute(gpu, plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"));
    let report = execute(gpu, plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"));
    let image = |id| read_image(gpu, &prepared, plan, id).unwrap_or_else(|f| panic!("{f}"));
    let bits = plan.outputs.iter().map(|o| image(o.1).data.iter().map(|x| x.to_bits()).collect()).collect();
    (bits, report)
}

#[test]
fn a_loop_ends_on_the_device_as_it_does_by_the_host() {
    let gpu = &device::gpu();
    let scene = Scene::load(&support::repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let small = ["grid=2", "face=8"];
    let cases: [(&str, &[&str]); 4] = [
        // It ends early, long after the host first looks, at its count, and with the first iteration.
        ("uniform_grid.ron", &["bounces=12", "epsilon=0.1"]),
        ("infinite_bounce.ron", &["bounces=40", "epsilon=0.000001", "memory=2"]),
        ("uniform_grid.ron", &["bounces=3", "epsilon=0"]),
        ("uniform_grid.ron", &["bounces=4", "epsilon=1"]),
    ];
    for (graph, set) in cases {
        let plan = plan(gpu, graph, &scene, &[&small, set].concat());
        let (bits, report) = run(gpu, &plan, &scene);
        let (wanted, by_host) = run(gpu, &by_host(plan), &scene);
        assert!(bits == wanted, "{graph} with {set:?} makes other bits");
        assert_eq!(report.loops, by_host.loops, "{graph} with {set:?}");
        let runs = |r: &FrameReport| -> Vec<(usize, u32)> { r.steps.iter().map(|s| (s.step, s.runs)).collect() };
        assert_eq!(runs(&report), runs(&by_host), "{graph} with {set:?}");
        assert!(report.loops[0].iterations > 0);
    }
}
