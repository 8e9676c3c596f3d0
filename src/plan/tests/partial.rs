//! Passes that run in part: for some of their instances, or in some frames.

use super::super::change::{Held, Selection, everything, select};
use super::super::keys::Keys;
use super::super::tables::SceneInputs;
use super::*;

const MARK: &str = "
var<storage, read_write> bits: array<u32>;
@compute @workgroup_size(64) fn mark(@builtin(global_invocation_id) id: vec3u) { bits[id.x] = 1u; }
";

const LIST: &str = "
var before: texture_2d<f32>;
var other: texture_2d<f32>;
var after: texture_storage_2d<r32float, write>;
var<storage, read> instances: array<u32>;
@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    let sum = textureLoad(before, id.xy, 0) + textureLoad(other, id.xy, 0);
    textureStore(after, id.xy + 8u * instances[4u + id.z], sum);
}
";

/// Turns with the frame.
const FRAME: &str = "
var<uniform> frame: u32;
var here: texture_2d<f32>;
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn turn(@builtin(global_invocation_id) id: vec3u) {
    textureStore(there, id.xy, f32(frame) * textureLoad(here, id.xy, 0));
}
";

/// `list` runs again for the instances with a bit where only what `of` names has changed: `before` changes with the
/// clock, `other` with the frame.
fn listed(of: &str) -> Sample {
    let turned = |name: &str, shader: &str| {
        let bind = format!("{{\"here\": \"x\", \"there\": \"{name}\"}}");
        format!("Compute(name: \"to_{name}\", shader: \"{shader}.wgsl\", over: \"{name}\", bind: {bind}),")
    };
    let resources = images(&["x", "before", "other", "after"]) + "\"bits\": Buffer(stride: 4, count: 1),";
    let list = format!("each: 4, over: (8, 8), only: Dirty(bits: \"bits\", of: [{of}])");
    let passes = make("make", "x")
        + &turned("before", "when")
        + &turned("other", "frame")
        + "Compute(name: \"mark\", shader: \"mark.wgsl\", over: \"bits\"),"
        + &format!("Compute(name: \"list\", shader: \"list.wgsl\", {list}),");
    let mut sample = sample(&resources, &passes, "\"o\": \"after\"");
    for (path, text) in [("mark.wgsl", MARK), ("list.wgsl", LIST), ("frame.wgsl", FRAME)] {
        sample.texts.files.insert(path.into(), Source::new(path, text));
    }
    sample
}

fn values(time: f32, frame: u32) -> Values {
    [("time".to_owned(), Value::Float(time)), ("frame".to_owned(), Value::Uint(frame))].into()
}

#[test]
fn a_pass_runs_in_part_where_only_what_its_bits_account_for_has_changed() {
    let plan = listed("\"before\"").plan();
    let keys = Keys::of(&plan, None);
    let mut held = Held::new(&plan, &keys, &[], None);
    let mut run = |values: Values, choose: fn(&Plan, &Keys, &Held, &SceneInputs, &Values) -> Selection| {
        let selection = choose(&plan, &keys, &held, &SceneInputs::default(), &values);
        let list = plan.steps.iter().position(|s| s.name == "list").unwrap_or_else(|| panic!("{plan}"));
        let ran = (selection.run[list], selection.partial.iter().any(|s| s.0 == list));
        held.start(&selection);
        held.finish(&selection);
        ran
    };
    assert_eq!(run(values(0.0, 0), everything), (true, false), "the first time for all");
    assert_eq!(run(values(0.0, 0), select), (false, false));
    assert_eq!(run(values(1.0, 0), select), (true, true), "the bits account for `before`");
    assert_eq!(run(values(1.0, 1), select), (true, false), "but not for `other`");
    assert_eq!(run(values(2.0, 2), select), (true, false));
    assert_eq!(run(values(3.0, 2), select), (true, true));
}

#[test]
fn bits_account_only_for_what_the_pass_reads() {
    let plan = |of: &str| listed(of).try_plan(Options::default(), None);
    plan("\"before\", \"other\"").unwrap_or_else(|f| panic!("{f}"));
    for table in ["nodes", "materials"] {
        let said = plan(&format!("\"before\", \"{table}\"")).map(drop).expect_err(table).to_string();
        assert!(said.contains(&format!("`list` reads nothing of `{table}`")), "{said}");
    }
}

#[test]
fn a_pass_of_some_frames_stands_in_no_loop() {
    let pass = turn("b", "x", "y").replace("over:", "when: \"first_frame\", over:");
    let passes = make("a", "x") + &format!("Loop(name: \"n\", count: 2, passes: [{pass}]),");
    let resources = images(&["x"]) + "\"y\": Texture(format: R32Float, size: 8, history: true),";
    let refused = sample(&resources, &passes, "\"o\": \"y\"").try_plan(Options::default(), None);
    let said = refused.map(drop).expect_err("in a loop").to_string();
    assert!(said.contains("`b` runs in some frames only, in a loop"), "{said}");
    let passes = make("a", "x") + &pass;
    sample(&resources, &passes, "\"o\": \"y\"").plan();
}
