//! The list that ships, and how figures are judged and shown.

use super::list::SpeedList;
use super::rows::line;
use super::{Goal, SpeedRow};

#[test]
fn the_list_that_ships_names_what_is_there() {
    let root = crate::repository("");
    let list = SpeedList::read(&root.join("benches/speed.ron")).unwrap_or_else(|f| panic!("{f}"));
    let mut runs: Vec<&super::list::GraphRun> = list.pairs.iter().map(|p| &p.fast).collect();
    runs.extend(list.published.iter().map(|p| &p.run));
    runs.extend(list.renderers.iter().map(|r| &r.run));
    let scaled: Vec<super::list::GraphRun> = list.scaling.iter().flat_map(|s| s.runs()).map(|(_, run)| run).collect();
    runs.extend(&scaled);
    runs.extend(list.starts.iter().map(|s| &s.run));
    runs.extend(list.times.iter().map(|t| &t.run));
    assert!(runs.len() > 10, "{runs:?}");
    for run in runs {
        assert!(root.join(&run.graph).is_file(), "{run:?}");
        assert!(lightgraph::Scene::load(&root.join(&run.scene)).is_ok(), "{run:?}");
        let project = lightgraph::Project::open(&root.join(&run.graph), &[]).unwrap_or_else(|f| panic!("{f}"));
        project.params(&run.set).unwrap_or_else(|f| panic!("{run:?}\n{f}"));
        for output in &run.outputs {
            assert!(project.graph.outputs.iter().any(|o| o.0.value == *output), "{run:?}");
        }
    }
}

#[test]
fn a_list_with_a_slip_is_told_with_its_place() {
    let folder = std::env::temp_dir().join(format!("lightgraph-list-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("list.ron");
    std::fs::write(&path, "(\n    piars: [],\n)").unwrap();
    let faults = SpeedList::read(&path).unwrap_err();
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(faults.to_string().contains("piars"), "{faults}");
    assert!(faults.to_string().contains("list.ron:2"), "{faults}");
}

#[test]
fn a_figure_is_judged_by_what_it_is_held_to() {
    let row = SpeedRow::new("against", "lights", 7.5, "x faster");
    assert_eq!(row.met(), None);
    assert_eq!(row.clone().wanted(Goal::AtLeast(8.0)).met(), Some(false));
    assert_eq!(row.clone().wanted(Goal::AtLeast(7.5)).met(), Some(true));
    assert_eq!(row.clone().wanted(Goal::AtMost(7.0)).met(), Some(false));
    let text = line(&row.wanted(Goal::AtLeast(8.0)).note("60 ms, 8 ms"));
    assert!(text.contains("7.500 x faster") && text.contains("missed") && text.contains("60 ms, 8 ms"), "{text}");
}

#[test]
fn the_hills_are_a_scene_of_as_many_triangles_as_asked() {
    let folder = std::env::temp_dir().join(format!("lightgraph-hills-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("hills.glb");
    std::fs::write(&path, super::load::hills(20)).unwrap();
    let loaded = lightgraph::Scene::load(&path);
    std::fs::remove_dir_all(&folder).unwrap();
    let scene = loaded.unwrap_or_else(|f| panic!("{f}")).scene;
    assert_eq!(scene.geometry.indices.len(), 3 * 2 * 20 * 20);
    let up = scene.geometry.vertices.iter().all(|v| v.normal[1] > 0.0);
    assert!(up, "the ground faces up");
}

#[test]
fn the_tube_bends_with_its_bones() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tube.glb");
    std::fs::write(&path, super::load::tube(1000)).unwrap();
    let scene = lightgraph::Scene::load(&path).unwrap_or_else(|f| panic!("{f}")).scene;
    assert_eq!(scene.geometry.vertices.len(), 1000);
    let top = |time: f32| {
        let pose = scene.pose(time);
        let last = scene.geometry.vertices.last().unwrap();
        pose.nodes[last.node as usize].transform_point3(last.position.into())
    };
    assert!(top(0.0).distance(top(0.5)) > 0.3, "{} {}", top(0.0), top(0.5));
}

#[test]
fn each_quad_shows_an_image_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    super::load::write_quads(folder.path(), 3, &super::load::picture(32).unwrap()).unwrap();
    let loaded = lightgraph::Scene::load(&folder.path().join("quads.gltf")).unwrap_or_else(|f| panic!("{f}"));
    // That the scene has no light.
    assert_eq!(loaded.notices.len(), 1, "{:?}", loaded.notices);
    assert_eq!(loaded.scene.geometry.indices.len(), 3 * 6);
    assert_eq!(loaded.scene.materials.len(), 3);
}
