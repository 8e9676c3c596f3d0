//! Results kept, compared and shown.

use super::against::against;
use super::host::{Host, Machine};
use super::journal::{JOURNAL, Journal};
use super::report;
use super::results::{Entry, PassTime, Phase, PhaseTimes, Results, Spread, hash};
use super::score::Score;
use flate2::{Compression, write::GzEncoder};
use lightgraph::Image;
use lightgraph::internals::files;
use lightgraph::internals::image::metrics::compare;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use tempfile::TempDir;

fn times(phase: Phase, walls: &[f64]) -> PhaseTimes {
    PhaseTimes {
        phase,
        repeats: walls.len() as u32,
        wall_ms: Spread::of(walls).unwrap(),
        frames_ms: walls.to_vec(),
        gpu_ms: None,
        steps_run: 3,
        steps_skipped: 1,
        causes: vec!["table lights".into()],
        iterations: BTreeMap::from([("bounce".into(), 2)]),
        passes: vec![PassTime { name: "relight".into(), group: Some("relight".into()), runs: 2, gpu_ms: Some(0.5) }],
        change_percent: Some(1.5),
        scores: vec![],
    }
}

/// An output that is 1 everywhere where the reference is `truth`.
fn score(output: &str, truth: f32) -> Score {
    let image = |v| Image::filled(8, 8, &[v]).unwrap();
    Score {
        output: output.into(),
        only_when: vec![],
        origin: "closed form".into(),
        stderr_percent: Some(0.0),
        metrics: compare(&image(1.0), &image(truth), None).unwrap(),
        fine_percent: 0.0,
        flip: Some(0.25),
    }
}

fn entry(graph: &str, walls: &[f64], truth: f32) -> Entry {
    Entry {
        graph: graph.into(),
        peer: None,
        scene: "room".into(),
        camera: None,
        size: [8, 8],
        params: BTreeMap::from([("grid".into(), "(4, 4, 4)".into())]),
        setting: "grid=4".into(),
        inputs: "0".into(),
        bytes: 1 << 20,
        bytes_without_sharing: 1 << 21,
        start_up_ms: BTreeMap::from([("device".into(), 80.25)]),
        rounds: 1,
        phases: vec![times(Phase::First, &walls[..1]), times(Phase::Everything, walls)],
        scores: vec![score("color", truth), score("indirect", truth)],
        leak: Some(0.125),
        picture: None,
        fault: None,
        host: None,
    }
}

fn results(entries: Vec<Entry>) -> Results {
    Results {
        version: "0.1.0".into(),
        commit: None,
        machine: Machine {
            adapter: "A, \"quoted\"".into(),
            driver: "D 1".into(),
            backend: "Vulkan".into(),
            software: true,
            cpu: "C".into(),
            cores: 2,
            os: "linux".into(),
        },
        repeat: 3,
        size: [8, 8],
        main_output: Some("indirect".into()),
        published: vec![],
        entries,
        absent: vec![],
        part: None,
    }
}

/// Cells of a line as RFC 4180 has them.
fn cells(line: &str) -> Vec<String> {
    let (mut out, mut quoted, mut last) = (vec![String::new()], false, ' ');
    for c in line.chars() {
        match c {
            '"' => {
                // Two quotes in a row inside of quotes are one.
                if !quoted && last == '"' {
                    out.last_mut().unwrap().push('"');
                }
                quoted = !quoted;
            }
            ',' if !quoted => out.push(String::new()),
            c => out.last_mut().unwrap().push(c),
        }
        last = c;
    }
    out
}

#[test]
fn what_drivers_compile_makes_no_setting_slow() {
    let mut compiled = entry("a", &[3000.0, 400.0, 500.0], 0.8);
    assert_eq!(compiled.slowest_seconds(), 0.4);
    compiled.phases.truncate(1);
    assert_eq!(compiled.slowest_seconds(), 3.0);
}

#[test]
fn json_and_csv_hold_what_was_measured() {
    let folder = TempDir::new().unwrap();
    let before = results(vec![entry("a", &[1.0, 3.0, 2.0], 0.8)]);
    before.write(folder.path()).unwrap();
    assert_eq!(Results::read(&folder.path().join("results.json")).unwrap(), before);

    let text = std::fs::read_to_string(folder.path().join("results.csv")).unwrap();
    let lines: Vec<Vec<String>> = text.lines().map(cells).collect();
    assert_eq!(lines.len(), 3, "a head and two phases");
    assert!(lines.iter().all(|l| l.len() == lines[0].len()));
    let value = |row: usize, column: &str| &lines[row][lines[0].iter().position(|c| c == column).unwrap()];
    assert_eq!(value(2, "phase"), "everything");
    assert_eq!((value(2, "wall_ms_median").as_str(), value(1, "repeats").as_str()), ("2", "1"));
    assert_eq!((value(1, "params").as_str(), value(1, "adapter").as_str()), ("grid=(4, 4, 4)", "A, \"quoted\""));
    let bias: f64 = value(1, "indirect_bias_percent").parse().unwrap();
    assert_eq!(bias, before.entries[0].scores[1].metrics.bias_percent, "to the last digit");
}

#[test]
fn what_is_no_results_file_is_a_fault() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("results.json");
    assert!(Results::read(&path).is_err());
    std::fs::write(&path, "{\"entries\": [").unwrap();
    assert!(Results::read(&path).unwrap_err().to_string().contains("holds no results"));
}

#[test]
fn a_journal_cut_off_within_a_character_keeps_its_whole_lines() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(JOURNAL);
    let mut notes = vec![];
    let (mut journal, kept) = Journal::open(folder.path(), true, &mut notes).unwrap();
    assert_eq!((kept.len(), notes.len()), (0, 0), "there is nothing to go on with");
    let whole = [entry("a", &[1.0], 0.8), entry("b", &[1.0], 0.8)];
    whole.iter().for_each(|e| journal.add(e).unwrap());
    drop(journal);
    let cut = "{\"graph\":\"ä".as_bytes();
    let written = [&std::fs::read(&path).unwrap(), &cut[..cut.len() - 1]].concat();
    std::fs::write(&path, written).unwrap();
    let (mut journal, kept) = Journal::open(folder.path(), true, &mut notes).unwrap();
    assert_eq!(kept, whole);
    assert!(notes[0].message.starts_with("1 lines of ") && notes.len() == 1, "{notes:?}");

    // What comes then stands in a line of its own.
    journal.add(&entry("c", &[1.0], 0.8)).unwrap();
    drop(journal);
    assert_eq!(Journal::open(folder.path(), true, &mut notes).unwrap().1.len(), 3);
}

#[test]
fn a_journal_that_can_t_be_read_is_kept() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(JOURNAL);
    std::fs::File::create(&path).unwrap().set_len(files::TABLE + 1).unwrap();
    let said = Journal::open(folder.path(), true, &mut vec![]).unwrap_err().to_string();
    assert!(said.contains("it is larger than") && said.contains("leave out `--resume`"), "{said}");
    assert_eq!(std::fs::metadata(&path).unwrap().len(), files::TABLE + 1);
}

#[test]
fn medians_of_odd_and_even_numbers() {
    assert_eq!(Spread::of(&[3.0, 1.0, 2.0]), Some(Spread { median: 2.0, min: 1.0, max: 3.0 }));
    assert_eq!(Spread::of(&[4.0, 1.0]), Some(Spread { median: 2.5, min: 1.0, max: 4.0 }));
    assert_eq!(Spread::of(&[]), None);
}

#[test]
fn inputs_are_told_apart() {
    let of = |parts: &[&str]| hash(parts.iter().map(|p| p.as_bytes()));
    assert_ne!(of(&["ab", "c"]), of(&["a", "bc"]));
    assert_eq!(of(&["ab"]), of(&["ab"]));
}

#[test]
fn a_time_is_slower_only_outside_the_noise_of_the_repeats() {
    let old = results(vec![entry("a", &[10.0, 11.0, 12.0], 0.8)]);
    let worse = |walls: &[f64]| against(&old, &results(vec![entry("a", walls, 0.8)])).worse;
    assert_eq!(worse(&[11.5, 13.0, 14.0]), [""; 0], "the repeats overlap");
    assert_eq!(worse(&[12.1, 11.0, 11.2]), [""; 0]);
    assert_eq!(worse(&[5.0, 6.0, 5.5]), [""; 0], "faster");
    let slower = worse(&[13.0, 14.0, 15.0]);
    assert_eq!(slower.len(), 1, "one frame says nothing: {slower:?}");
    assert!(slower[0].contains("everything: 11.00 ms (10.00 to 12.00) became 14.00 ms"), "{slower:?}");

    let mut elsewhere = results(vec![entry("a", &[99.0, 99.0], 0.8)]);
    elsewhere.machine.adapter = "B".into();
    let verdict = against(&old, &elsewhere);
    assert!(verdict.worse.is_empty() && verdict.notes[0].contains("times are not compared"));
}

/// Joined results hold times of several machines: only those of the same one are held against each other.
#[test]
fn times_of_two_machines_never_meet() {
    let mut old = results(vec![entry("a", &[10.0, 11.0], 0.8), entry("b", &[50.0, 51.0], 0.9)]);
    let other = Machine { cpu: "another".into(), ..old.machine.clone() };
    let host = |machine: &Machine| Some(Host { name: "n1".into(), machine: machine.clone(), load: Some(0.5) });
    old.entries[1].host = host(&other);
    let mut new = old.clone();
    for e in &mut new.entries {
        e.phases.iter_mut().for_each(|t| t.wall_ms = Spread { median: 99.0, min: 98.0, max: 100.0 });
    }
    let found = against(&old, &new);
    assert_eq!((found.worse.len(), found.notes.len()), (2, 0), "each against its own: {found}");
    assert_eq!(found.repeated.order().pairs, 0, "neither is the faster of both");
    new.entries[1].host = host(&old.machine);
    let found = against(&old, &new);
    assert_eq!(found.worse.len(), 1, "{found}");
    assert!(found.notes[0].contains("times are not compared") && found.notes[0].contains("another"), "{found}");

    let text = report::text(&old);
    let heads: Vec<&str> = text.lines().filter(|l| l.contains("rmse of")).collect();
    assert_eq!(heads.len(), 2, "a front for each machine: {text}");
    assert!(heads[0].contains("room, on A") && heads[1].contains("another, 2 cores"), "{text}");
    let csv = old.csv();
    assert!(csv.lines().nth(4).is_some_and(|l| cells(l).contains(&"n1".to_string())), "{csv}");
}

#[test]
fn a_greater_error_a_new_fault_and_a_lost_comparison_are_worse() {
    let old = results(vec![entry("a", &[1.0, 1.0], 0.8), entry("gone", &[1.0], 0.8)]);
    let mut after = entry("a", &[1.0, 1.0], 0.79);
    after.scores.pop();
    after.fault = Some("broken".into());
    after.leak = Some(0.5);
    let verdict = against(&old, &results(vec![after]));
    let text = verdict.to_string();
    for part in ["rmse of `color` grew from 25.000 % to", "fails now: broken", "no longer compared", "the leak grew"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(verdict.notes[0].contains("gone on room"), "{text}");
    assert!(against(&old, &old).worse.is_empty());
}

/// An error figure that differs in the last digit is no fault, but it is not the same either.
#[test]
fn error_figures_are_equal_to_the_last_digit_or_named() {
    let old = results(vec![entry("a", &[1.0], 0.8), entry("b", &[1.0], 0.8)]);
    let mut after = old.clone();
    after.entries.reverse();
    let same = against(&old, &after).repeated;
    assert_eq!((same.rows, same.other.len()), (4, 0), "two first frames and two leaks, in any order");
    assert!(same.to_string().starts_with("errors: 4 of 4 rows are equal to the last digit\n"), "{same}");

    let figure = &mut after.entries[0].scores[1].metrics.rmse_percent;
    *figure = f64::from_bits(figure.to_bits() + 1);
    after.entries[1].leak = Some(0.25);
    let other = against(&old, &after);
    let text = other.to_string();
    assert!(text.contains("errors: 2 of 4 rows"), "{text}");
    assert!(text.contains("not equal: a on room, grid=4: the leak was 0.125, is 0.25\n"), "{text}");
    assert!(text.contains("not equal: b on room, grid=4: rmse of `indirect` was 24.99"), "{text}");
    assert!(text.find("a on room") < text.find("b on room"), "the greatest change first: {text}");

    let mut left_out = after.clone();
    left_out.entries[0].fault = Some("left out".into());
    assert_eq!(against(&old, &left_out).repeated.rows, 2, "of what did not run nothing is compared");

    after.entries[0].scores.pop();
    assert!(against(&old, &after).to_string().contains("`indirect` is no longer compared"));
    let many = |truth| results((0..20).map(|i| entry(&i.to_string(), &[1.0], truth)).collect());
    assert!(against(&many(0.8), &many(0.9)).to_string().contains("  and 8 more\n"));
}

#[test]
fn settings_that_are_apart_stay_in_their_order_or_the_worst_is_named() {
    let run = |ms: [f64; 3]| {
        let of = |(graph, ms)| Entry { phases: vec![times(Phase::Still, &[ms])], ..entry(graph, &[1.0], 0.8) };
        results(["a", "b", "c"].into_iter().zip(ms).map(of).collect())
    };
    let order = |old, new| {
        let r = against(&run(old), &run(new)).repeated;
        (r.order().pairs, r.order().kept, r.worst.map(|w| w.1).unwrap_or_default())
    };
    let reversed = |old, new| against(&run(old), &run(new)).repeated.order().reversed;
    assert_eq!(reversed([10.0, 20.0, 40.0], [10.0, 8.5, 8.0]), 1, "10 is more than 20 % above 8, and not above 8.5");
    assert_eq!(order([10.0, 11.0, 12.0], [3.0, 2.0, 1.0]), (0, 0, String::new()), "12 is not more than 20 % above 10");
    assert_eq!(order([10.0, 11.0, 13.0], [2.0, 1.0, 2.5]), (1, 1, String::new()), "only the first and the third count");
    let (pairs, kept, worst) = order([10.0, 20.0, 40.0], [10.0, 9.0, 8.0]);
    assert_eq!((pairs, kept), (3, 0));
    assert_eq!(worst, "still: a on room, grid=4 took 10.000 and 10.000 ms; c on room, grid=4 took 40.000 and 8.000 ms");
    assert_eq!(order([10.0, 20.0, 40.0], [5.0, 5.0, 9.0]).1, 2, "of equals none is the faster one");
    assert_eq!(order([0.0, 20.0, 40.0], [5.0, 5.0, 9.0]).0, 1, "of nothing there is no multiple");

    let text = against(&run([10.0, 20.0, 40.0]), &run([10.0, 30.0, 20.0])).to_string();
    assert!(
        text.contains(
            "times: of 3 pairs of settings more than 20 % apart, 2 (66.66 %) are in the same order, 1 (33.33 %) in"
        ),
        "{text}"
    );
    assert!(!text.contains("still: of"), "of one phase all is said: {text}");
    let phases = |still: f64| {
        let of = |(graph, ms)| Entry {
            phases: vec![times(Phase::First, &[90.0 / ms]), times(Phase::Still, &[2.0 * ms, ms])],
            ..entry(graph, &[1.0], 0.8)
        };
        results([("a", 10.0), ("b", still)].map(of).to_vec())
    };
    let text = against(&phases(30.0), &phases(5.0)).to_string();
    assert!(text.contains("  first: of 1 pairs") && text.contains("  still: of 1 pairs"), "{text}");
    let mut elsewhere = run([10.0, 20.0, 40.0]);
    elsewhere.entries.iter_mut().for_each(|e| e.scene = "hall".into());
    let none = against(&run([10.0, 20.0, 40.0]), &elsewhere).to_string();
    assert!(none.contains("of 0 pairs of settings more than 20 % apart, 0 are"), "{none}");
}

#[test]
fn kept_results_are_read_compressed_too() {
    let folder = TempDir::new().unwrap();
    let before = results(vec![entry("a", &[1.0, 3.0, 2.0], 0.8)]);
    before.write(folder.path()).unwrap();
    let path = folder.path().join("results.json.gz");
    let plain = std::fs::read(folder.path().join("results.json")).unwrap();
    let mut encoder = GzEncoder::new(vec![], Compression::default());
    encoder.write_all(&plain).unwrap();
    let bytes = encoder.finish().unwrap();
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(Results::read(&path).unwrap(), before);
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(Results::read(&path).unwrap_err().to_string().contains("can't read"));
}

#[test]
fn the_page_holds_its_data_and_asks_no_network() {
    let mut odd = entry("</script><!--", &[2.0], 0.8);
    odd.fault = Some("a < b && c".into());
    let page = report::html(&results(vec![entry("a", &[1.0, 2.0], 0.9), odd]), Path::new("none"), 4).unwrap();
    assert_eq!(page.matches("</script>").count(), 2);
    assert!(!page.contains("src=\"http") && !page.contains("@DATA@") && !page.contains("<!--"));
    let start = page.find("id=\"data\">").unwrap() + "id=\"data\">".len();
    let data = report::inflated(page[start..].split("</script>").next().unwrap());
    assert_eq!(data["scenes"][0]["fronts"]["indirect|rmse|everything"], serde_json::json!([0]));
    assert!(data["words"].as_array().unwrap().contains(&"</script><!--".into()));
}

/// The script asks of the plot of all scenes what it asks of each.
#[test]
fn entries_of_all_scenes_have_what_those_of_one_have() {
    let elsewhere = Entry { scene: "hall".into(), ..entry("a", &[1.0], 0.9) };
    let little = Entry { scene: "gallery".into(), ..entry("b", &[1.0], 0.9) };
    let entries = vec![entry("a", &[1.0], 0.9), entry("c", &[1.0], 0.9), entry("d", &[1.0], 0.9)];
    let more = ["c", "d"].map(|graph| Entry { scene: "hall".into(), ..entry(graph, &[2.0], 0.8) });
    let entries = entries.into_iter().chain([elsewhere]).chain(more).chain([little]).collect();
    let data = report::page(&results(entries), Path::new("none"), 0);
    let scenes = data["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 4);
    assert_eq!(scenes[0]["label"], "2 scenes", "of the third little was asked");
    let keys = |e: &serde_json::Value| e.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    for scene in scenes {
        for e in scene["entries"].as_array().unwrap() {
            assert_eq!(keys(e), keys(&scenes[1]["entries"][0]), "{}", scene["label"]);
        }
    }
}
