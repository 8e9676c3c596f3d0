//! Groups of alternatives: which is planned, what becomes of the others, what they must agree on.

use super::super::fastest::{Choice, Way, each, still};
use super::*;
use crate::diag::Faults;

/// `made` by one pass or by way of `between`, from `packed`, which only the second wants; `after` reads it.
fn either(first: &str, second: &str) -> Sample {
    let quick = format!("[{}]", make("quick", "made").replace("over:", &format!("{first} over:")));
    let slow = turn("begin", "packed", "between").replace("over:", &format!("{second} over:"));
    let slow = format!("[{slow} {}]", turn("end", "between", "made").replace("over:", &format!("{second} over:")));
    let group = format!("Fastest(name: \"way\", of: [{quick}, {slow}]),");
    let passes = make("pack", "packed") + &group + &turn("after", "made", "out");
    sample(&images(&["packed", "between", "made", "out"]), &passes, "\"out\": \"out\"")
}

fn choice(index: usize) -> Choices {
    Choices::from([("way".to_string(), Choice { index, why: "measured, 1 ms against 2 ms".into() })])
}

fn reasons(plan: &Plan) -> Vec<(&str, &str)> {
    plan.skipped.iter().map(|(pass, why)| (pass.as_str(), why.as_str())).collect()
}

#[test]
fn the_first_alternative_runs_where_none_is_chosen() {
    let plan = either("", "").plan();
    assert_eq!(plan.names(), ["quick", "after"]);
    let why = "`way` takes `quick`: the first, not measured";
    let expected = [("begin", why), ("end", why), ("pack", "no requested output needs it")];
    assert_eq!(reasons(&plan), expected);
    assert!(plan.resources.iter().all(|r| r.name != "between" && r.name != "packed"), "{plan}");
}

#[test]
fn the_chosen_alternative_runs_with_what_it_needs() {
    let plan = either("", "").choose(&choice(1)).unwrap();
    assert_eq!(plan.names(), ["pack", "begin", "end", "after"]);
    assert_eq!(reasons(&plan), [("quick", "`way` takes `begin` and `end`: measured, 1 ms against 2 ms")]);
    let [group] = plan.alternatives.as_slice() else { panic!("{:?}", plan.alternatives) };
    assert_eq!((group.name.as_str(), group.chosen), ("way", 1));
    let ways = [(0, vec!["quick"]), (1, vec!["begin", "end"])];
    let ways = ways.map(|(index, passes)| Way { index, passes: passes.into_iter().map(String::from).collect() });
    assert_eq!(group.ways, ways);
    assert_eq!(plan.shaders.len(), 2, "none is kept of the alternative that does not run");
}

#[test]
fn alternatives_may_stand_in_a_loop() {
    let group = format!("Fastest(name: \"way\", of: [[{}], [{}]])", make("a", "x"), make("b", "x"));
    let passes = format!("Loop(name: \"n\", count: 2, passes: [{group}, {}]),", turn("after", "x", "y"));
    let sample = sample(&images(&["x", "y"]), &passes, "\"y\": \"y\"");
    assert_eq!(sample.plan().names(), ["a", "after"]);
    assert_eq!(sample.choose(&choice(1)).unwrap().names(), ["b", "after"]);
}

#[test]
fn an_alternative_that_its_conditions_leave_out_is_none() {
    let plan = either("when: \"false\",", "").plan();
    assert_eq!(plan.names(), ["pack", "begin", "end", "after"]);
    assert!(plan.alternatives.is_empty(), "nothing is left to choose");
    assert_eq!(reasons(&plan), [("quick", "`false` is false")]);
    let plan = either("", "when: \"false\",").choose(&choice(1)).unwrap();
    assert_eq!(plan.names(), ["quick", "after"]);
    assert!(plan.alternatives.is_empty());
}

#[test]
fn a_group_that_no_output_needs_is_nothing_to_choose() {
    let group = format!("Fastest(name: \"way\", of: [[{}], [{}]]),", make("a", "x"), make("b", "x"));
    let plan = sample(&images(&["x", "y"]), &(group + &make("c", "y")), "\"y\": \"y\"").plan();
    assert_eq!(plan.names(), ["c"]);
    assert!(plan.alternatives.is_empty());
}

#[test]
fn alternatives_agree_on_what_is_read_elsewhere() {
    let group = format!("Fastest(name: \"way\", of: [[{}], [{}]]),", make("a", "x"), make("b", "y"));
    let sample = sample(&images(&["x", "y", "z"]), &(group + &turn("c", "x", "z")), "\"z\": \"z\"");
    let Err(Faults(faults)) = sample.choose(&FIRST) else { panic!("they differ") };
    let text = "alternatives of `way` leave different results: that of `a` writes `x`, that of `b` does not";
    assert_eq!(faults.iter().map(|d| d.message.as_str()).collect::<Vec<_>>(), [text]);
}

#[test]
fn a_choice_of_what_is_not_there_is_a_fault() {
    let sample = either("", "");
    let message = |choices: &Choices| match sample.choose(choices) {
        Err(Faults(faults)) => faults.into_iter().map(|d| d.message).collect::<Vec<_>>().join("; "),
        Ok(plan) => panic!("{plan}"),
    };
    assert_eq!(message(&choice(2)), "`way` has 2 alternatives, none of number 2");
    let other = Choices::from([("wey".to_string(), choice(0)["way"].clone())]);
    assert_eq!(message(&other), "the graph has no group of alternatives `wey`");
    assert!(still(&sample.graph, &choice(2)).is_empty() && still(&sample.graph, &other).is_empty());
    assert_eq!(still(&sample.graph, &choice(1)), choice(1));
}

#[test]
fn every_alternative_has_its_turn_in_a_check() {
    let turns = each(&either("", "").graph, &FIRST);
    let indices = turns.iter().map(|c| c.get("way").map(|c| c.index)).collect::<Vec<_>>();
    assert_eq!(indices, [None, Some(1)]);
}

#[test]
fn which_alternative_runs_is_a_value() {
    let group = format!("Fastest(name: \"way\", of: [[{}], [{}]]),", make("a", "x"), make("b", "y"));
    let when = |pass: String, value: &str| pass.replace("over:", &format!("when: \"{value}\", over:"));
    let after = when(turn("c", "x", "z"), "way == 0") + &when(turn("d", "y", "z"), "way == 1");
    let sample = sample(&images(&["x", "y", "z"]), &(group + &after), "\"z\": \"z\"");
    assert_eq!(sample.plan().names(), ["a", "c"]);
    assert_eq!(sample.choose(&choice(1)).unwrap().names(), ["b", "d"]);
}

#[test]
fn what_is_read_by_the_value_is_written_by_the_one_that_runs() {
    let group = format!("Fastest(name: \"way\", of: [[{}], [{}]]),", make("a", "x"), make("b", "y"));
    let after = turn("c", "x", "z").replace("over:", "when: \"way >= 0\", over:");
    let sample = sample(&images(&["x", "y", "z"]), &(group + &after), "\"z\": \"z\"");
    let message =
        |choices: &Choices| sample.choose(choices).map_err(|f| f.0.into_iter().map(|d| d.message).collect::<Vec<_>>());
    assert_eq!(message(&FIRST).unwrap().names(), ["a", "c"]);
    let text = "alternatives of `way` leave different results: that of `a` writes `x`, that of `b` does not";
    assert_eq!(message(&choice(1)).unwrap_err(), [text]);
}
