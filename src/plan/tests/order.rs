//! Orders: of the file, of members, of other seeds.

use super::super::build::Options;
use super::*;

/// Each step once, and after all that must come before.
pub fn legal(plan: &Plan) {
    let steps: Vec<usize> = steps_of(&plan.order).into_iter().map(|s| s.0).collect();
    let mut once = steps.clone();
    once.sort_unstable();
    assert_eq!(once, (0..plan.steps.len()).collect::<Vec<_>>(), "each step once in\n{plan}");
    let place = |s: usize| steps.iter().position(|t| *t == s);
    for (i, step) in plan.steps.iter().enumerate() {
        for before in &step.after {
            let name = &plan.steps[before.0].name;
            assert!(place(before.0) < place(i), "{} comes before {name} in\n{plan}", step.name);
        }
    }
}

#[test]
fn the_stable_order_is_that_of_the_file() {
    let passes = make("b", "y") + &make("a", "x") + &turn("c", "x", "z") + &turn("d", "y", "w");
    let plan = sample(&images(&["x", "y", "z", "w"]), &passes, "\"z\": \"z\", \"w\": \"w\"").plan();
    assert_eq!(plan.names(), ["b", "a", "c", "d"]);
}

#[test]
fn a_read_keeps_its_place_between_two_writes() {
    // `early` must see the first `x`, `late` the second, in every order.
    let passes = make("first", "x")
        + &turn("early", "x", "y")
        + "Clear(name: \"second\", target: \"x\"),"
        + &turn("late", "x", "z");
    let sample = sample(&images(&["x", "y", "z"]), &passes, "\"y\": \"y\", \"z\": \"z\"");
    for order_seed in 0..20 {
        let plan = sample.with(Options { order_seed, ..Options::default() });
        legal(&plan);
        assert_eq!(plan.names(), ["first", "early", "second", "late"]);
    }
}

#[test]
fn seeds_give_other_orders_that_make_the_same() {
    // Two chains that do not touch, and a loop.
    let body = turn("go", "p", "q") + &turn("come", "q", "p");
    let passes = make("a", "r")
        + &make("b", "p")
        + &turn("c", "r", "s")
        + &format!("Loop(name: \"n\", count: 2, passes: [{body}]),");
    let sample = sample(&images(&["p", "q", "r", "s"]), &passes, "\"s\": \"s\", \"p\": \"p\"");
    let wanted = machine::run(&sample.with(Options { share: false, ..Options::default() }), 2);
    let mut orders = std::collections::BTreeSet::new();
    for order_seed in 0..30 {
        let plan = sample.with(Options { order_seed, ..Options::default() });
        legal(&plan);
        assert_eq!(machine::run(&plan, 2), wanted, "{plan}");
        orders.insert(plan.names().join(" "));
    }
    assert!(orders.len() > 2, "{orders:?}");
}

#[test]
fn members_go_one_by_one_through_neighbouring_passes() {
    let resources =
        "\"x\": Texture(format: R32Float, size: 8, members: 3), \"y\": Texture(format: R32Float, size: 8, members: 3),"
            .to_string()
            + &images(&["z"]);
    let each = |text: String| text.replace("over:", "each: 3, over:");
    let passes = each(make("a", "x")) + &each(turn("b", "x", "y")) + &each(turn("c", "y", "z"));
    let plan = sample(&resources, &passes, "\"z\": \"z\"").plan();
    legal(&plan);
    assert_eq!(plan.names(), ["a[0]", "b[0]", "c[0]", "a[1]", "b[1]", "c[1]", "a[2]", "b[2]", "c[2]"]);
    assert_eq!(plan.slots.len(), 3, "one memory for every x, one for every y, one for z");
}

#[test]
fn a_pass_between_breaks_the_members_up() {
    let resources = "\"x\": Texture(format: R32Float, size: 8, members: 2),".to_string() + &images(&["y", "z"]);
    let each = |text: String| text.replace("over:", "each: 2, over:");
    let passes = each(make("a", "x")) + &make("between", "y") + &each(turn("b", "x", "z"));
    let plan = sample(&resources, &passes, "\"z\": \"z\", \"y\": \"y\"").plan();
    assert_eq!(plan.names(), ["a[0]", "a[1]", "between", "b[0]", "b[1]"]);
}
