//! A bench of a few pixels from end to end.

use crate::command::lightgraph;
use crate::support::Scratch;
use lightgraph_cli::bench::results::{Entry, Phase, Results, Spread};
use std::path::Path;

#[test]
fn a_small_bench_from_end_to_end_resumes_and_repeats_its_errors() {
    let folder = Scratch::new("bench");
    let (out, again) = (folder.path().join("one"), folder.path().join("two"));
    let bench = |out: &Path, more: &[&str]| {
        let out = out.display().to_string();
        let words = [
            &[
                "bench",
                "--graphs",
                "graphs/gi/uniform_grid.ron",
                "--scenes",
                "furnace",
                "--size",
                "32x32",
                "--repeat",
                "2",
            ],
            &["--sweep", "grid=1,2;face=4;bounces=3;epsilon=0;shadow_size=64", "--out", &out][..],
            more,
        ];
        let output = lightgraph(&words.concat(), true);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    bench(&out, &[]);
    let first = Results::read(&out.join("results.json")).unwrap();
    // The graph's own setting, then those of the sweep.
    assert_eq!(first.entries.iter().map(|e| e.setting.is_empty()).collect::<Vec<_>>(), [true, false, false]);
    for e in &first.entries[1..] {
        assert_eq!(e.fault, None);
        assert!(e.times(Phase::Still).is_some_and(|t| t.repeats == 2) && e.times(Phase::Camera).is_some());
        // Three bounces of a furnace of albedo ½ give ¼ + ⅛ + 1/16 of ½: the reference for as many has no error left.
        let bounded = e.scores.iter().find(|s| s.output == "indirect" && !s.only_when.is_empty()).unwrap();
        assert!(bounded.metrics.rmse_percent < 0.1, "{:?}", bounded.metrics);
        assert!((e.score("indirect", Phase::Still).unwrap().metrics.bias_percent + 12.5).abs() < 0.1);
    }
    assert!(out.join("report.html").exists() && out.join("results.csv").exists());

    let old = out.join("results.json").display().to_string();
    bench(&out, &["--resume", "--against", &old]);
    assert_eq!(Results::read(&out.join("results.json")).unwrap(), first, "resumed: even the times are the same");

    // What a run that was cut off wrote is gone on with; a setting that isn't asked for stays.
    let cut = folder.path().join("cut");
    std::fs::create_dir_all(&cut).unwrap();
    let line = serde_json::to_string(&first.entries[2]).unwrap();
    std::fs::write(cut.join("entries.jsonl"), format!("{line}\n{}", &line[..40])).unwrap();
    bench(&cut, &["--resume", "--phases", "everything"]);
    let resumed = Results::read(&cut.join("results.json")).unwrap();
    assert_eq!(resumed.entries.len(), 3);
    assert_eq!(resumed.entries[2], first.entries[2]);
    let phases = |e: &Entry| e.phases.iter().map(|t| t.phase).collect::<Vec<_>>();
    assert_eq!(phases(&resumed.entries[0]), [Phase::First, Phase::Everything]);
    assert!(!cut.join("entries.jsonl").exists());

    bench(&again, &[]);
    let second = Results::read(&again.join("results.json")).unwrap();
    for (a, b) in first.entries.iter().zip(&second.entries) {
        assert_eq!(a.scores, b.scores, "errors repeat to the last digit");
    }

    // A round later the frames of both count.
    bench(&again, &["--resume", "--rounds", "2", "--brief", "0"]);
    assert_eq!(Results::read(&again.join("results.json")).unwrap(), second, "no frame takes no time");
    bench(&again, &["--resume", "--rounds", "2", "--brief", "100"]);
    for (a, b) in second.entries.iter().zip(&Results::read(&again.join("results.json")).unwrap().entries) {
        assert_eq!((b.rounds, &b.scores), (2, &a.scores));
        for (one, both) in a.phases.iter().zip(&b.phases) {
            let more = usize::from(one.phase != Phase::Still);
            assert_eq!(both.frames_ms.len(), one.frames_ms.len() + more, "{}", one.phase.word());
            assert_eq!(
                (both.repeats as usize, Spread::of(&both.frames_ms)),
                (both.frames_ms.len(), Some(both.wall_ms))
            );
        }
    }
}
