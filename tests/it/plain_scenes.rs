//! What a scene does not need is not planned, or left out on the device: figures, held as shares of what is left.

use crate::{device, support};
use lightgraph::internals::plan::build::plan;
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts};
use lightgraph::internals::value::Value;
use lightgraph::{Gpu, Image, Plan, Project, Scene, Session, Settings};

fn open(graph: &str) -> Project {
    Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"))
}

/// A plan for a scene with these facts, besides those of a scene with nothing.
fn planned(project: &Project, facts: &[(&str, u32)], set: &[String]) -> Plan {
    let (limits, features) = sample_device();
    let mut all = sample_facts(false);
    for (name, n) in facts {
        assert!(all.insert(name.to_string(), Value::Uint(*n)).is_some(), "no fact `{name}`");
    }
    let request = Request {
        graph: &project.graph,
        texts: &project.texts,
        params: &project.params(set).unwrap_or_else(|f| panic!("{f}")),
        facts: &all,
        screen: [640, 480],
        outputs: Some(&["color".to_string()]),
        choices: &FIRST,
        levels: &[],
        limits: &limits,
        features,
    };
    plan(&request).unwrap_or_else(|f| panic!("{f}")).plan
}

/// Both with the same parameters: harmonics that hold a glossy lobe.
#[test]
fn one_diffuse_point_light_takes_half_of_what_a_scene_with_everything_takes() {
    let project = open("uniform_grid.ron");
    let geometry = [("triangles", 500), ("vertices", 1500), ("nodes", 9), ("materials", 6), ("clusters", 20)];
    let mut plain = geometry.to_vec();
    plain.extend([("one_sided_clusters", 20), ("lights", 1), ("point_lights", 1), ("light_views", 6)]);
    let mut full = geometry.to_vec();
    full.extend([("one_sided_clusters", 12), ("double_sided_materials", 1), ("textured_materials", 2)]);
    full.extend([("specular_materials", 1), ("emissive_materials", 1), ("emitters", 2), ("moving_nodes", 1)]);
    // Four point lights, a spot and a sun.
    full.extend([
        ("lights", 6),
        ("point_lights", 4),
        ("spot_lights", 1),
        ("directional_lights", 1),
        ("light_views", 26),
    ]);
    let set = ["order=4".to_string()];
    let (plain, full) = (planned(&project, &plain, &set), planned(&project, &full, &set));
    let (few, many) = (plain.steps.len(), full.steps.len());
    assert!(2 * few <= many, "{few} steps of {many}");
    let ((small, _), (large, _)) = (plain.bytes(), full.bytes());
    assert!(2 * small <= large, "{small} bytes of {large}");
    println!("{few} steps of {many}, {small} bytes of {large}");
}

#[test]
fn without_lights_nothing_casts_shadows_and_without_bounces_there_are_no_probes() {
    let project = open("uniform_grid.ron");
    let passes = |plan: &Plan| plan.steps.iter().map(|s| s.pass.clone()).collect::<Vec<_>>();
    let dark = passes(&planned(&project, &[("emissive_materials", 1), ("triangles", 12)], &[]));
    assert!(!dark.iter().any(|p| p == "shadow.shadow_maps") && dark.iter().any(|p| p == "capture.capture"), "{dark:?}");
    let lit = [("lights", 1), ("spot_lights", 1), ("light_views", 1), ("triangles", 12)];
    let direct = planned(&project, &lit, &["bounces=0".into()]);
    let probes = [
        "capture.probe_views",
        "capture.capture",
        "factors.factors",
        "direct_at_probes",
        "relight",
        "project.multiply",
        "project.sum",
        "project.place",
    ];
    let left: Vec<String> = passes(&direct).into_iter().filter(|p| probes.contains(&p.as_str())).collect();
    assert!(left.is_empty(), "{left:?}");
    assert!(direct.resources.iter().all(|r| !r.name.starts_with("cube_")), "probes have memory without bounces");
}

/// The image of the hall, and the triangles that its probes draw.
fn hall(gpu: &Gpu, lean: bool) -> (Image, u64) {
    let project = open("uniform_grid.ron");
    let set = ["grid=8,8,3", "face=2", "bounces=2", "epsilon=0", if lean { "lean=true" } else { "lean=false" }];
    let loaded = Scene::load(&support::repository("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings {
        params: project.params(&set.map(String::from)).unwrap_or_else(|f| panic!("{f}")),
        size: [24, 18],
        outputs: Some(vec!["color".to_string()]),
        skip: true,
        ..Settings::default()
    };
    let mut session = Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let drawn = session.triangles(gpu).unwrap_or_else(|f| panic!("{f}"));
    let capture = session.plan.steps.iter().position(|s| s.name == "capture.capture").expect("probes are captured");
    (session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}")), drawn[&capture].0)
}

#[test]
fn probes_in_empty_cells_are_left_out_and_the_image_stays() {
    let gpu = &device::gpu();
    let (all, many) = hall(gpu, false);
    let (lean, few) = hall(gpu, true);
    assert!(few < many && few > 0, "{few} of {many} triangles are drawn");
    let largest = all.data.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    let differ = all.data.iter().zip(&lean.data).fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    assert!(differ <= 1e-6 * largest, "the images differ by {differ} of {largest}");
}
