//! Versions of contents: equal work has equal ones in any plan, other work has others.

use super::super::build::Options;
use super::super::change::{Held, Selection, carry, carry_history, everything, select};
use super::super::keys::{Keys, UNDEFINED, Version};
use super::super::tables::SceneInputs;
use super::*;

/// The version of an output, in memory that begins empty.
fn output(plan: &Plan, name: &str) -> Version {
    let keys = Keys::of(plan, None);
    let versions = keys.versions(plan, |_| UNDEFINED, &SceneInputs::default(), &Values::new());
    let id = plan.outputs.iter().find(|o| o.0 == name).map(|o| o.1).unwrap_or_else(|| panic!("no output {name}"));
    versions.end[id.0]
}

fn fork() -> Sample {
    let passes = make("a", "x") + &turn("b", "x", "y") + &make("c", "z") + &turn("d", "z", "w");
    sample(&images(&["x", "y", "z", "w"]), &passes, "\"left\": \"y\", \"right\": \"w\"")
}

#[test]
fn neither_order_nor_memory_nor_names_make_another_version() {
    let plan = fork().plan();
    let version = output(&plan, "left");
    assert_eq!(output(&plan, "right"), version, "both are made in the same way");
    for order_seed in 1..6 {
        let other = fork().with(Options { share: order_seed % 2 == 0, order_seed, ..Options::default() });
        assert_eq!(output(&other, "left"), version, "seed {order_seed}");
    }
    let passes = make("first", "u") + &turn("second", "u", "v");
    let renamed = sample(&images(&["u", "v"]), &passes, "\"left\": \"v\"").plan();
    assert_eq!(output(&renamed, "left"), version);
}

#[test]
fn another_size_wiring_or_number_of_turns_makes_another_version() {
    let one = |resources: &str, passes: &str| output(&sample(resources, passes, "\"o\": \"y\"").plan(), "o");
    let passes = make("a", "x") + &turn("b", "x", "y");
    let version = one(&images(&["x", "y"]), &passes);
    assert_ne!(one(&images(&["x", "y"]).replace("size: 8", "size: 16"), &passes), version);
    let longer = make("a", "x") + &turn("b", "x", "z") + &turn("c", "z", "y");
    assert_ne!(one(&images(&["x", "y", "z"]), &longer), version);
    let turns = |n: u32| {
        let body = turn("b", "x", "y") + &turn("c", "y", "x");
        one(&images(&["x", "y"]), &(make("a", "x") + &format!("Loop(name: \"n\", count: {n}, passes: [{body}]),")))
    };
    assert_ne!(turns(2), turns(3));
}

/// Chooses and counts as run.
fn run(
    plan: &Plan,
    held: &mut Held,
    choose: fn(&Plan, &Keys, &Held, &SceneInputs, &Values) -> Selection,
) -> Vec<String> {
    let selection = choose(plan, &Keys::of(plan, None), held, &SceneInputs::default(), &Values::new());
    let ran = plan.steps.iter().zip(&selection.run).filter(|(_, run)| **run).map(|(s, _)| s.name.clone()).collect();
    held.start(&selection);
    held.finish(&selection);
    ran
}

#[test]
fn memory_moves_to_another_place_in_another_plan() {
    let first = fork().plan();
    let mut held = Held::new(&first, &Keys::of(&first, None), &[], None);
    assert_eq!(run(&first, &mut held, everything).len(), 4);
    assert_eq!(run(&first, &mut held, select), [""; 0]);
    // Another graph, in which other contents come first: the same content is in another slot.
    let passes = make("c", "x") + &turn("d", "x", "w") + &turn("e", "w", "y");
    let second = sample(&images(&["x", "w", "y"]), &passes, "\"y\": \"y\"").plan();
    let keys = Keys::of(&second, None);
    let carried = carry(&second, &keys, &held, &SceneInputs::default(), &Values::new());
    assert!(carried.iter().flatten().count() >= 1, "{carried:?}");
    let mut after = Held::new(&second, &keys, &carried, Some(&held));
    let ran = run(&second, &mut after, select);
    assert_eq!(ran, ["e"], "what `c` and `d` make is there already");
    // The first plan knows which of its memory the second has written to.
    let again = run(&first, &mut held, select);
    assert_eq!(run(&first, &mut held, select), [""; 0], "after {again:?}");
}

#[test]
fn other_memory_that_is_lent_holds_another_content_under_the_same_version() {
    let plan = fork().plan();
    let slot = plan.resource("x").slot;
    let mut held = Held::new(&plan, &Keys::of(&plan, None), &[], None);
    let mut lent = |version: u64, other: bool| {
        held.lend(slot, version, other);
        held.version(slot)
    };
    let first = lent(7, true);
    assert_eq!(lent(7, false), first, "nobody wrote to it");
    let written = lent(8, false);
    let others = [lent(7, true), lent(7, true)];
    let distinct: std::collections::BTreeSet<_> = [UNDEFINED, first, written].into_iter().chain(others).collect();
    assert_eq!(distinct.len(), 5, "who lends other memory counts its versions anew");
}

#[test]
fn histories_that_depend_on_one_another_come_over_together() {
    // `sum` is made from `count` by way of `x`; `alone` from itself.
    let plan = |size: u32| {
        let history = |name: &str, size: u32| {
            format!("\"{name}\": Texture(format: R32Float, size: {size}, history: true, initial: 1),")
        };
        let resources = history("count", 8) + &history("sum", size) + &history("alone", 8) + &images(&["x", "y"]);
        let copy = |from: &str, to: &str| format!("Copy(name: \"to_{to}\", from: \"{from}\", to: \"{to}\"),");
        let passes = turn("a", "count", "x") + &turn("b", "x", "sum") + &copy("x", "count");
        let passes = passes + &turn("c", "alone", "y") + &copy("y", "alone");
        sample(&resources, &passes, "\"sum\": \"sum\", \"alone\": \"alone\"").plan()
    };
    let first = plan(8);
    let mut held = Held::new(&first, &Keys::of(&first, None), &[], None);
    run(&first, &mut held, everything);
    let comes = |plan: &Plan, carried: &[Option<usize>]| {
        ["count", "sum", "alone"].map(|name| carried[plan.resource(name).slot].is_some())
    };
    for (size, expected) in [(8, [true; 3]), (16, [false, false, true])] {
        let next = plan(size);
        let keys = Keys::of(&next, None);
        assert_eq!(comes(&next, &carry_history(&next, &keys, &held)), expected);
        // Nor is what the first frame made of `count` taken for what the next begins with.
        let carried = carry(&next, &keys, &held, &SceneInputs::default(), &Values::new());
        assert_eq!(comes(&next, &carried), expected);
    }
}
