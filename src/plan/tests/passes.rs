//! Which passes run, and what a frame begins with.

use super::super::Action;
use super::super::build::Options;
use super::*;

#[test]
fn a_pass_that_no_output_needs_is_left_out_with_its_resources() {
    let passes = make("a", "x") + &make("b", "unseen") + &turn("c", "x", "y");
    let plan = sample(&images(&["x", "y", "unseen"]), &passes, "\"y\": \"y\"").plan();
    assert_eq!(plan.names(), ["a", "c"]);
    assert_eq!(plan.skipped, [("b".to_string(), "no requested output needs it".to_string())]);
    assert!(plan.resources.iter().all(|r| r.name != "unseen"));
}

#[test]
fn only_what_the_requested_outputs_need_runs() {
    let passes = make("a", "x") + &turn("b", "x", "y") + &turn("c", "x", "z");
    let sample = sample(&images(&["x", "y", "z"]), &passes, "\"y\": \"y\", \"z\": \"z\"");
    let plan = sample.try_plan(Options::default(), Some(&["z".to_string()])).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(plan.names(), ["a", "c"]);
    assert_eq!(plan.outputs.len(), 1);
    assert_eq!(plan.skipped[0].0, "b");
}

#[test]
fn a_write_that_is_overwritten_unread_is_left_out() {
    let passes = "Clear(name: \"lost\", target: \"x\"), Clear(name: \"kept\", target: \"x\", value: (1, 1, 1, 1)),";
    let plan = sample(&images(&["x"]), passes, "\"x\": \"x\"").plan();
    assert_eq!(plan.names(), ["kept"]);
}

#[test]
fn a_pass_in_a_loop_is_kept_when_only_the_next_iteration_reads_it() {
    // back → next → back …; nobody else reads what `again` writes.
    let body = turn("forth", "back", "next") + &turn("again", "next", "back");
    let passes = make("start", "back") + &format!("Loop(name: \"n\", count: 3, passes: [{body}]),");
    let plan = sample(&images(&["back", "next"]), &passes, "\"next\": \"next\"").plan();
    assert_eq!(plan.names(), ["start", "forth", "again"]);
}

#[test]
fn the_test_of_a_loop_keeps_what_writes_it() {
    let resources = images(&["x"]) + "\"change\": Buffer(stride: 4, count: 1),";
    let passes = format!(
        "Loop(name: \"n\", count: 3, until: \"change < 1\", passes: [Clear(name: \"measure\", target: \"change\"), {}]),",
        make("a", "x")
    );
    let plan = sample(&resources, &passes, "\"x\": \"x\"").plan();
    assert_eq!(plan.names().len(), 2);
    let Desc::Buffer { usage, .. } = plan.resource("change").desc else { panic!("a buffer") };
    assert!(usage.contains(wgpu_types::BufferUsages::COPY_SRC), "the host reads it");
}

#[test]
fn a_loop_that_never_ends_early_measures_nothing() {
    let resources = images(&["x"]) + "\"change\": Buffer(stride: 4, count: 1),";
    let steps = |until: &str| {
        let body = "Clear(name: \"measure\", target: \"change\"),".to_string() + &make("a", "x");
        let passes = format!("Loop(name: \"n\", count: 3, until: \"{until}\", passes: [{body}]),");
        sample(&resources, &passes, "\"x\": \"x\"").plan().names().join(" ")
    };
    assert_eq!(steps("1 > 0 && change < 1"), "measure a");
    assert_eq!(steps("1 < 0 && change < 1"), "a");
    assert_eq!(
        steps("1 > 0 && 2 > 1 && change < 1"),
        "measure a",
        "tests stand before the comparison, as many as there are"
    );
}

#[test]
fn an_initial_value_is_given_at_the_start_of_each_frame_that_finds_it() {
    let resources = format!("\"x\": Texture(format: R32Float, size: 8, initial: 3),{}", images(&["y"]));
    let plan = sample(&resources, &turn("a", "x", "y"), "\"y\": \"y\"").plan();
    assert_eq!(plan.names(), ["x = initial", "a"]);
    assert!(matches!(plan.step("x = initial").action, Action::Clear { value, .. } if value == [3.0; 4]));
    assert_eq!(plan.resource("x").initial, Some([3.0; 4]));
}

#[test]
fn an_initial_value_that_is_overwritten_whole_is_not_given() {
    let resources = format!("\"x\": Texture(format: R32Float, size: 8, initial: 3),{}", images(&["y"]));
    let passes = "Clear(name: \"own\", target: \"x\"),".to_string() + &turn("a", "x", "y");
    let plan = sample(&resources, &passes, "\"y\": \"y\"").plan();
    assert_eq!(plan.names(), ["own", "a"]);
}

#[test]
fn an_output_that_nothing_writes_is_its_initial_value() {
    let resources = "\"x\": Texture(format: R32Float, size: 8, initial: 3),";
    let plan = sample(resources, "", "\"x\": \"x\"").plan();
    assert_eq!(plan.names(), ["x = initial"]);
}

#[test]
fn every_member_of_a_set_gets_the_initial_value() {
    let resources = format!("\"x\": Texture(format: R32Float, size: 8, initial: 3, members: 2), \"y\": {SET_OF_TWO},");
    let bind = "bind: {\"here\": \"x\", \"there\": \"y\"}";
    let each = format!("Compute(name: \"a\", shader: \"turn.wgsl\", each: 2, over: \"y\", {bind}),");
    let join = turn("join", "y", "z").replace("over: \"z\"", "each: 2, over: \"z\"");
    let plan = sample(&(resources + &images(&["z"])), &(each + &join), "\"z\": \"z\"").plan();
    let clears: Vec<&str> = plan.names().into_iter().filter(|n| n.ends_with("initial")).collect();
    assert_eq!(clears, ["x[0] = initial", "x[1] = initial"]);
}

const SET_OF_TWO: &str = "Texture(format: R32Float, size: 8, members: 2)";

#[test]
fn history_keeps_its_writer_and_has_memory_of_its_own() {
    // The output reads last frame's `old`; `keep` writes it for the next frame.
    let resources = images(&["new", "out"]) + "\"old\": Texture(format: R32Float, size: 8, history: true, initial: 5),";
    let passes = turn("show", "old", "out") + &make("a", "new") + "Copy(name: \"keep\", from: \"new\", to: \"old\"),";
    let plan = sample(&resources, &passes, "\"out\": \"out\"").plan();
    assert_eq!(plan.names(), ["show", "a", "keep"]);
    let old = plan.resource("old");
    assert!(old.history && old.initial == Some([5.0; 4]));
    assert_eq!(plan.resources.iter().filter(|r| r.slot == old.slot).count(), 1);
    assert_ne!(machine::run(&plan, 1), machine::run(&plan, 2), "the second frame finds the first one's");
}

#[test]
fn history_without_an_initial_value_begins_with_zero() {
    let resources = images(&["out"]) + "\"old\": Texture(format: R32Float, size: 8, history: true),";
    let passes = turn("show", "old", "out") + "Copy(name: \"keep\", from: \"out\", to: \"old\"),";
    let plan = sample(&resources, &passes, "\"out\": \"out\"").plan();
    assert_eq!(plan.resource("old").initial, Some([0.0; 4]));
}

/// A reduction of an image of `size` to `to` texels; the edges of the stages and their workgroups.
fn reduced(size: u32, factor: u32, to: u32) -> (Plan, Vec<u32>) {
    let resources =
        format!("\"x\": Texture(format: R32Float, size: {size}), \"total\": Texture(format: R32Float, size: {to}),");
    let reduce = format!(
        "Reduce(name: \"sum\", shader: \"sum.wgsl\", from: \"x\", to: \"total\", factor: ({factor}, {factor}), until: {to}),"
    );
    let plan = sample(&resources, &(make("a", "x") + &reduce), "\"total\": \"total\"").plan();
    let edges = plan.steps.iter().filter(|s| s.pass == "sum").map(|s| {
        let name = &plan.resources[s.writes[0].0].name;
        let (width, Action::Compute { groups, .. }) = (plan.texture(name).width, &s.action) else {
            panic!("a reduction computes")
        };
        assert_eq!(groups[..2], [width.div_ceil(8); 2]);
        width
    });
    let edges = edges.collect();
    (plan, edges)
}

#[test]
fn a_reduction_rounds_up_at_each_stage() {
    assert_eq!(reduced(64, 4, 1).1, [16, 4, 1]);
    assert_eq!(reduced(100, 4, 1).1, [25, 7, 2, 1]);
    assert_eq!(reduced(7, 3, 1).1, [3, 1]);
    assert_eq!(reduced(100, 4, 2).1, [25, 7, 2]);
}

#[test]
fn the_stages_of_a_reduction_follow_each_other_to_its_target() {
    let (plan, _) = reduced(100, 4, 1);
    assert_eq!(plan.names(), ["a", "sum.0", "sum.1", "sum.2", "sum.3"]);
    for pair in plan.steps.windows(2) {
        assert_eq!(pair[0].writes, pair[1].reads);
    }
    assert_eq!(plan.resources[plan.steps[4].writes[0].0].name, "total");
}

#[test]
fn a_reduction_that_is_done_at_once_is_one_step() {
    let (plan, edges) = reduced(4, 4, 1);
    assert_eq!(edges, [1]);
    assert_eq!(plan.names(), ["a", "sum"]);
}
