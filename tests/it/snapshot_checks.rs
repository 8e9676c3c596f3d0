//! Every kind of check of a snapshot test, once where it holds and once where it does not; steps of the script; devices
//! that are lost.

use crate::device;
use crate::support::{Scratch, repository};
use lightgraph::Gpu;
use lightgraph_cli::snapshot::{Bless, OpenDevice, Summary, TestOptions, TestState, find, run, run_on};
use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A flat colour, a slope that depends on the frame, a loop, and numbers handed out in no fixed order.
const GRAPH: &str = r#"Graph(
    about: "Known colours.",
    params: {"red": Float(default: 0.5, about: "red"), "rounds": Uint(default: 3, max: 9, about: "how often")},
    resources: {
        "flat": Texture(format: Rgba32Float, size: "screen"),
        "slope": Texture(format: Rgba32Float, size: "screen"),
        "last": Texture(format: Rgba32Float, size: "screen"),
        "any": Texture(format: Rgba32Float, size: (256, 256)),
        "counter": Buffer(stride: 4, count: 1),
    },
    passes: [
        Screen(name: "fill", shader: "fill.wgsl", color: "flat"),
        Screen(name: "tilt", shader: "tilt.wgsl", color: "slope"),
        Loop(name: "again", count: "rounds", passes: [Screen(name: "fill_again", shader: "fill.wgsl", color: "last")]),
        Clear(name: "zero", target: "counter", value: (0, 0, 0, 0)),
        Compute(name: "race", shader: "race.wgsl", over: "any"),
    ],
    outputs: {"flat": "flat", "slope": "slope", "last": "last", "any": "any"},
)"#;

const SHADERS: [(&str, &str); 3] = [
    (
        "fill.wgsl",
        "var<uniform> red: f32;
@fragment fn fragment() -> @location(0) vec4f { return vec4f(red, 0.25, 0.0, 1.0); }
",
    ),
    (
        "tilt.wgsl",
        "var<uniform> frame: u32;
@fragment fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(at.x + f32(frame), 1.0, 1.0, 1.0);
}
",
    ),
    (
        "race.wgsl",
        "var<storage, read_write> counter: array<atomic<u32>>;
var any: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {
    textureStore(any, id.xy, vec4f(f32(atomicAdd(&counter[0], 1u))));
}
",
    ),
];

/// A project with these tests, by name: what stands in `Test(…)` after graph, scene and size.
fn project(name: &str, tests: &[(&str, &str)]) -> Scratch {
    let scratch = Scratch::new(name);
    let at = |file: &str| scratch.path().join(file);
    fs::create_dir_all(at("tests")).unwrap();
    fs::create_dir_all(at("shaders")).unwrap();
    fs::write(at("known.ron"), GRAPH).unwrap();
    SHADERS.iter().for_each(|(name, text)| fs::write(at("shaders").join(name), text).unwrap());
    fs::copy(repository("scenes/lambert_plane.glb"), at("plane.glb")).unwrap();
    for (name, body) in tests {
        let text =
            format!("Test(about: \"Known.\", graph: \"../known.ron\", scene: \"../plane.glb\", size: (8, 4), {body})");
        fs::write(at("tests").join(format!("{name}.ron")), text).unwrap();
    }
    scratch
}

fn options(scratch: &Scratch, bless: Bless, jobs: usize) -> TestOptions {
    TestOptions { bless, failures: scratch.path().join("out"), jobs, ..TestOptions::default() }
}

fn tests(scratch: &Scratch) -> Vec<(String, std::path::PathBuf)> {
    find(&[scratch.path().join("tests")]).unwrap_or_else(|f| panic!("{f}"))
}

/// What is said of a test.
fn said(summary: &Summary, name: &str) -> String {
    summary.outcomes.iter().find(|o| o.name == name).map(ToString::to_string).unwrap_or_default()
}

#[test]
fn every_kind_of_check_holds_and_fails() {
    let two_frames = r#"params: {"red": 0.75}, steps: [Frames(count: 2)]"#;
    // Kind; where it holds; where it does not; what is said then.
    let kinds = [
        ("bytes", "Bytes(at_most: 99000000, reason: \"x\")", "Bytes(at_most: 1, reason: \"x\")", "bytes (allowed 1)"),
        (
            "steps",
            r#"Steps(ran: ["tilt"], skipped: ["fill"])"#,
            r#"Steps(ran: ["fill"], skipped: ["tilt"])"#,
            "`fill` did not run, `tilt` ran",
        ),
        (
            "iterations",
            r#"Iterations(of: "again", min: 3, max: 3, reason: "x")"#,
            r#"Iterations(of: "again", min: 4, max: 5, reason: "x")"#,
            "3 iterations (allowed 4 to 5)",
        ),
        (
            "mean",
            r#"Mean(output: "flat", value: 0.3333333, tolerance: 0.001, reason: "a third of red and green")"#,
            r#"Mean(output: "flat", value: 0.34, tolerance: 0.001, reason: "x")"#,
            "0.3333, expected 0.34",
        ),
        (
            "constant",
            r#"Constant(output: "flat", value: (0.75, 0.25, 0), tolerance: 0, reason: "exact")"#,
            r#"Constant(output: "slope", value: (4, 1, 1), tolerance: 0.1, reason: "x")"#,
            "expected [4.0, 1.0, 1.0]",
        ),
        (
            "symmetric",
            r#"Symmetric(output: "slope", axis: TopBottom, max: 0, reason: "exact")"#,
            r#"Symmetric(output: "slope", axis: LeftRight, max: 6, reason: "x")"#,
            "max 7.000 (allowed 6)",
        ),
        (
            "not_brighter",
            r#"NotBrighter(output: "flat", than: Run(params: {"red": 0.8}), slack: 0, reason: "less red")"#,
            r#"NotBrighter(output: "flat", than: Run(params: {"red": 0.7}), slack: 0.01, reason: "x")"#,
            "(allowed +1.00 %)",
        ),
        (
            "times",
            r#"Times(output: "flat", factor: 1, of: Run(light: 2), max: 0, reason: "no light falls in")"#,
            r#"Times(output: "flat", factor: 2, of: Run(light: 2), max: 0.1, reason: "x")"#,
            "max 0.7500 (allowed 0.1)",
        ),
        (
            "image",
            r#"Image(output: "flat", max: 0, reason: "exact")"#,
            r#"Image(output: "last", p95: 0, rmse: 0, flip: 0, max: 0, reason: "x")"#,
            "there is no reference",
        ),
        (
            "image_per_adapter",
            r#"Image(output: "flat", max: 0, per_adapter: true, reason: "exact")"#,
            r#"Image(output: "last", max: 0, per_adapter: true, reason: "x")"#,
            "there is no reference",
        ),
        ("plan", "Plan()", r#"Plan(), Mean(output: "flat", value: 0.3333333, tolerance: 1, reason: "x")"#, "plan: "),
    ];
    let bodies: Vec<(String, String)> = kinds
        .iter()
        .flat_map(|(kind, holds, fails, _)| {
            let body = |check: &str| format!("{two_frames}, checks: [{check}]");
            [(format!("{kind}.holds"), body(holds)), (format!("{kind}.fails"), body(fails))]
        })
        .collect();
    let named: Vec<(&str, &str)> = bodies.iter().map(|(n, b)| (n.as_str(), b.as_str())).collect();
    let scratch = project("snapshot-kinds", &named);
    let _alone = device::gpu();
    // The references of those that are to hold.
    let all = tests(&scratch);
    let good: Vec<_> = all.iter().filter(|t| t.0.ends_with(".holds")).cloned().collect();
    run(&good, &options(&scratch, Bless::All, 1), &mut |_| ());
    let summary = run(&all, &options(&scratch, Bless::None, 1), &mut |_| ());
    for (kind, _, _, why) in kinds {
        let holds = said(&summary, &format!("{kind}.holds"));
        assert!(holds.starts_with("ok "), "{holds}");
        let fails = said(&summary, &format!("{kind}.fails"));
        assert!(fails.starts_with("FAILED ") && fails.contains(why), "`{why}`: {fails}");
    }
    let adapter = summary.adapter.unwrap_or_default().to_lowercase();
    let word: String = adapter.chars().take_while(char::is_ascii_alphanumeric).collect();
    let kept = fs::read_dir(scratch.path().join("tests")).unwrap().map(|e| e.unwrap().file_name());
    let kept: Vec<String> = kept.map(|n| n.to_string_lossy().into_owned()).collect();
    let prefix = format!("image_per_adapter.holds.flat.{word}");
    assert!(kept.iter().any(|n| n.starts_with(&prefix) && n.ends_with(".exr")), "no {prefix}… in {kept:?}");
}

#[test]
fn frames_that_differ_from_a_full_run_are_no_increment() {
    // Invocations of 65,536 workgroups on several cores draw their numbers in another order each time.
    let scratch = project(
        "snapshot-increment",
        &[
            (
                "holds",
                r#"steps: [Frames(count: 2)], checks: [Mean(output: "slope", value: 1, tolerance: 9, reason: "x"), Incremental()]"#,
            ),
            ("fails", r#"checks: [Mean(output: "any", value: 1, tolerance: 1e9, reason: "x"), Incremental()]"#),
        ],
    );
    let _alone = device::gpu();
    let summary = run(&tests(&scratch), &options(&scratch, Bless::None, 1), &mut |_| ());
    assert!(said(&summary, "holds").starts_with("ok "), "{summary}");
    assert!(said(&summary, "fails").contains("`any` differs from a full run at texel"), "{summary}");
}

#[test]
fn shaders_are_edited_and_restored_within_a_script() {
    let edit = r#"Edit(shader: "fill.wgsl", from: "0.25", to: "0.5")"#;
    let green = |value: &str| {
        format!(r#"checks: [Constant(output: "flat", value: (0.5, {value}, 0), tolerance: 0, reason: "exact")]"#)
    };
    let bodies = [
        ("edited", format!("steps: [Frames(), {edit}, Frames()], {}", green("0.5"))),
        ("restored", format!("steps: [{edit}, Frames(), Restore(shader: \"fill.wgsl\"), Frames()], {}", green("0.25"))),
        ("twice", format!("steps: [{edit}, {edit}, Frames()], {}", green("0.5"))),
        ("unknown", format!("steps: [Edit(shader: \"fil.wgsl\", from: \"a\", to: \"b\"), Frames()], {}", green("0.5"))),
        (
            "broken",
            format!("steps: [Edit(shader: \"fill.wgsl\", from: \"0.25\", to: \"green\"), Frames()], {}", green("1")),
        ),
        ("early", format!("steps: [Restore(shader: \"fill.wgsl\"), Frames()], {}", green("0.25"))),
    ];
    let named: Vec<(&str, &str)> = bodies.iter().map(|(n, b)| (*n, b.as_str())).collect();
    let scratch = project("snapshot-edits", &named);
    let _alone = device::gpu();
    let summary = run(&tests(&scratch), &options(&scratch, Bless::None, 1), &mut |_| ());
    for (name, words) in [
        ("edited", "ok "),
        ("restored", "ok "),
        ("twice", "holds this text 0 times, not once"),
        ("unknown", "did you mean `fill.wgsl`?"),
        ("broken", "green"),
        ("early", "`fill.wgsl` is not edited before"),
    ] {
        assert!(said(&summary, name).contains(words), "{name}: `{words}`\n{summary}");
    }
    let file = fs::read_to_string(scratch.path().join("shaders/fill.wgsl")).unwrap();
    assert_eq!(file, SHADERS[0].1, "the file itself stays as it is");
}

const MEAN: &str = r#"checks: [Mean(output: "slope", value: 2, tolerance: 0.001, reason: "(4 + 1 + 1) / 3")]"#;

#[test]
fn a_lost_device_fails_its_test_and_the_next_opens_another() {
    let scratch = project("snapshot-lost", &[("a", MEAN), ("b", MEAN), ("c", MEAN)]);
    let _alone = device::gpu();
    let opened = Arc::new(AtomicUsize::new(0));
    let count = opened.clone();
    let open: OpenDevice = Arc::new(move || {
        let gpu = Gpu::open()?;
        if count.fetch_add(1, Ordering::Relaxed) == 0 {
            gpu.device.destroy();
        }
        Ok(gpu)
    });
    let summary = run_on(&tests(&scratch), &options(&scratch, Bless::None, 1), &open, &mut |_| ());
    let states: Vec<TestState> = summary.outcomes.iter().map(|o| o.state()).collect();
    assert_eq!(states, [TestState::Failed, TestState::Passed, TestState::Passed], "{summary}");
    assert!(said(&summary, "a").contains("the device is lost"), "{summary}");
    assert_eq!(opened.load(Ordering::Relaxed), 2);
}

#[test]
fn tests_side_by_side_are_told_in_their_order() {
    let names = ["a", "b", "c", "d", "e", "f"];
    let bodies = names.map(|n| (n, if n == "c" { MEAN.replace("value: 2", "value: 3") } else { MEAN.to_string() }));
    let scratch = project("snapshot-jobs", &bodies.each_ref().map(|(n, b)| (*n, b.as_str())));
    let _alone = device::gpu();
    let told = |jobs: usize| {
        let mut told = vec![];
        let summary = run(&tests(&scratch), &options(&scratch, Bless::None, jobs), &mut |o| {
            told.push((o.name.clone(), o.state(), o.failures.iter().map(|f| f.why.clone()).collect::<Vec<_>>()));
        });
        assert_eq!(summary.outcomes.len(), names.len());
        told
    };
    let alone = told(1);
    assert_eq!(alone.iter().map(|t| t.0.as_str()).collect::<Vec<_>>(), names);
    assert_eq!(alone[2].1, TestState::Failed);
    assert_eq!(told(3), alone);
}
