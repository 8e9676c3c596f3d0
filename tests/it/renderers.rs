//! A graph beside another program: whose setting counts, and what is said of one that isn't there.

use crate::device::gpu;
use crate::support::{Scratch, repository};
use lightgraph::internals::fastest::Policy;
use lightgraph_cli::bench::speed::{Bench, SpeedList, SpeedRow};

/// The rows beside a program that a script stands for.
fn rows(name: &str, script: &str) -> Vec<SpeedRow> {
    let folder = Scratch::new(name);
    let peers = folder.path().join("peers");
    std::fs::create_dir_all(&peers).unwrap();
    let settings = [serde_json::json!({"good": false}), serde_json::json!({"good": true})];
    let peer = serde_json::json!({"name": "other", "command": ["sh", "-c", script, "other"], "settings": settings});
    std::fs::write(peers.join("other.json"), peer.to_string()).unwrap();
    let list = folder.path().join("list.ron");
    let text = format!(
        r#"(renderers: [(name: "other", peer: ("{}", "other"), run: (graph: "graphs/gi/fast_grid.ron", scene: "scenes/cornell_point",
            set: ["grid=2,2,2", "face=4", "bounces=1"], outputs: ["indirect"]), output: "indirect", image: (16, 16), ours: Frame,
            at_least: 10, moved_at_least: 50)])"#,
        peers.display()
    );
    std::fs::write(&list, text).unwrap();
    let list = SpeedList::read(&list).unwrap_or_else(|f| panic!("{f}"));
    let (root, references) = (repository(""), repository("tests/references"));
    let bench =
        Bench { gpu: &gpu(), root: &root, shaders: &[], references: &references, repeat: 1, fastest: Policy::First };
    bench.run(&list, &mut |_| {}).unwrap_or_else(|f| panic!("{f}"))
}

/// A renderer whose images are the reference of indirect light itself, or that of direct light, which is far off.
fn script(seconds: &[(f64, bool)]) -> String {
    let line = |(seconds, good): &(f64, bool)| {
        let quantity = if *good { "indirect" } else { "direct" };
        let image = repository(&format!("tests/references/cornell_point_{quantity}.exr"));
        let settings = serde_json::json!({"good": good});
        let line = serde_json::json!({"renderer": "Other", "version": "1", "settings": settings, "seconds": seconds,
            "image": image, "indirect": image});
        format!("echo '{line}'")
    };
    seconds.iter().map(line).collect::<Vec<_>>().join("; ")
}

#[test]
fn the_most_accurate_setting_that_errs_no_less_is_set_beside() {
    let rows = rows("renderers", &script(&[(1000.0, false), (5000.0, true)]));
    assert_eq!(rows.len(), 2, "{rows:?}");
    for row in &rows {
        assert_eq!(row.met(), Some(true), "{row:?}");
        assert!(row.note.contains("1000.00 s by Other 1"), "{row:?}");
    }
    assert!(rows[0].name.ends_with("a frame of everything") && rows[1].name.ends_with("the camera moved"));
}

#[test]
fn one_that_errs_less_in_all_is_a_miss_and_one_that_is_not_there_no_figure() {
    let rows = rows("renderers-better", &script(&[(5000.0, true)]));
    assert_eq!((rows.len(), rows[0].met()), (1, Some(false)), "{rows:?}");
    assert!(rows[0].note.contains("errs less than ours"), "{rows:?}");
}

#[test]
fn a_renderer_that_is_not_there_is_named_without_a_figure() {
    let rows = rows("renderers-absent", "echo not installed >&2; exit 4");
    assert_eq!((rows.len(), rows[0].met()), (1, None), "{rows:?}");
    assert!(rows[0].note.contains("not installed"), "{rows:?}");
}
