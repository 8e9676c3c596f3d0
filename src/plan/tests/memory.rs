//! Lifetimes and shared memory.

use super::super::build::Options;
use super::*;

/// Resources share a slot only if their lifetimes never meet.
fn apart(plan: &Plan) {
    for (i, a) in plan.resources.iter().enumerate() {
        for b in &plan.resources[i + 1..] {
            let together = a.lifetime.0 <= b.lifetime.1 && b.lifetime.0 <= a.lifetime.1;
            assert!(a.slot != b.slot || !together, "{} and {} share a slot in\n{plan}", a.name, b.name);
            assert!(a.slot != b.slot || a.desc.shape() == b.desc.shape(), "{} and {} differ", a.name, b.name);
        }
        let Some(slot) = plan.slots.get(a.slot) else { panic!("{} has no slot", a.name) };
        match (&a.desc, &slot.desc) {
            (Desc::Texture(a), Desc::Texture(s)) => assert!(s.usage.contains(a.usage)),
            (Desc::Buffer { usage: a, .. }, Desc::Buffer { usage: s, .. }) => assert!(s.contains(*a)),
            _ => panic!("{} lies in memory of another kind", a.name),
        }
    }
}

#[test]
fn a_chain_needs_two_memories() {
    let passes = make("a", "r") + &turn("b", "r", "s") + &turn("c", "s", "t") + &turn("d", "t", "u");
    let sample = sample(&images(&["r", "s", "t", "u"]), &passes, "\"u\": \"u\"");
    let plan = sample.plan();
    apart(&plan);
    assert_eq!(plan.slots.len(), 2);
    assert_eq!(plan.bytes(), (2 * 256, 4 * 256));
    let unshared = sample.with(Options { share: false, ..Options::default() });
    assert_eq!(unshared.slots.len(), 4);
    assert_eq!(machine::run(&plan, 1), machine::run(&unshared, 1));
}

#[test]
fn what_outlives_a_change_of_its_readers_keeps_its_memory() {
    // The clock changes `s` and what follows, and not `r`, which `b` reads again then.
    let by_clock = |name: &str, from: &str, to: &str| {
        format!(
            "Compute(name: \"{name}\", shader: \"when.wgsl\", over: \"{to}\", bind: {{\"here\": \"{from}\", \"there\": \"{to}\"}}),"
        )
    };
    let passes = make("a", "q")
        + &turn("aa", "q", "r")
        + &by_clock("b", "r", "s")
        + &turn("c", "s", "t")
        + &turn("d", "t", "u")
        + &turn("e", "u", "v");
    let sample = sample(&images(&["q", "r", "s", "t", "u", "v"]), &passes, "\"v\": \"v\"");
    let plan = sample.plan();
    apart(&plan);
    let slot = |name: &str| plan.resource(name).slot;
    for other in ["q", "s", "t", "u", "v"] {
        assert_ne!(slot(other), slot("r"), "`{other}` lies where `r` is asked for again\n{plan}");
    }
    assert_eq!(slot("s"), slot("u"), "what changes together shares memory\n{plan}");
}

#[test]
fn an_output_is_alive_to_the_end() {
    // `x` would be free after `b`, were it not asked for.
    let passes = make("a", "x") + &turn("b", "x", "y") + &turn("c", "y", "z");
    let plan = sample(&images(&["x", "y", "z"]), &passes, "\"x\": \"x\", \"z\": \"z\"").plan();
    apart(&plan);
    assert_eq!(plan.slots.len(), 3);
}

#[test]
fn what_an_iteration_leaves_to_the_next_is_alive_for_the_whole_loop() {
    // start → [ keep: carried → brief; brief → carried ] → end
    let body = turn("use", "carried", "brief") + &turn("renew", "brief", "carried");
    let passes = make("start", "carried")
        + &format!("Loop(name: \"n\", count: 3, passes: [{body}]),")
        + &turn("end", "carried", "out");
    let plan = sample(&images(&["carried", "brief", "out"]), &passes, "\"out\": \"out\"").plan();
    apart(&plan);
    // Places: start 0, use 1, renew 2, the loop's end 3, end 4.
    assert_eq!(plan.resource("carried").lifetime, (0, 4));
    assert_eq!(plan.resource("brief").lifetime, (1, 2));
    assert_eq!(plan.resource("out").slot, plan.resource("brief").slot);
}

#[test]
fn what_a_loop_reads_from_outside_is_alive_to_its_end() {
    // `given` is read first in the body; the next iteration reads it again after `later` was written.
    let body = turn("use", "given", "brief") + &turn("go", "brief", "later") + &turn("last", "later", "sum");
    let passes = make("start", "given") + &format!("Loop(name: \"n\", count: 3, passes: [{body}]),");
    let plan = sample(&images(&["given", "brief", "later", "sum"]), &passes, "\"sum\": \"sum\"").plan();
    apart(&plan);
    assert_eq!(plan.resource("given").lifetime, (0, 4));
    machine::run(&plan, 2);
}

#[test]
fn rows_that_the_iterations_write_one_by_one_are_alive_for_the_whole_loop() {
    // Each iteration writes a row of `table` (its shader knows the index), then reads all rows so far.
    let row = "Compute(name: \"row\", shader: \"rows.wgsl\", over: (8, 1, 1), bind: {\"there\": \"table\"}),";
    let body = make("other", "scratch") + &turn("eat", "scratch", "crumbs") + row + &turn("all", "table", "out");
    let passes = format!("Loop(name: \"n\", count: 3, passes: [{body}]),");
    let resources = images(&["scratch", "crumbs", "table", "out"]);
    let sample = sample(&resources, &passes, "\"out\": \"out\", \"crumbs\": \"crumbs\"");
    let plan = sample.plan();
    apart(&plan);
    assert_ne!(plan.resource("table").slot, plan.resource("scratch").slot, "in\n{plan}");
    let unshared = sample.with(Options { share: false, ..Options::default() });
    assert_eq!(machine::run(&plan, 2), machine::run(&unshared, 2));
}

#[test]
fn memory_is_shared_inside_loops_of_loops() {
    let inner = turn("a", "x", "p") + &turn("b", "p", "q") + &turn("c", "q", "x");
    let body = format!("Loop(name: \"m\", count: 2, passes: [{inner}]),") + &turn("d", "x", "r") + &turn("e", "r", "y");
    let passes = make("start", "x") + &format!("Loop(name: \"n\", count: 2, passes: [{body}]),") + &turn("f", "y", "z");
    let sample = sample(&images(&["x", "p", "q", "r", "y", "z"]), &passes, "\"z\": \"z\"");
    let plan = sample.plan();
    apart(&plan);
    assert!(plan.slots.len() < plan.resources.len());
    let unshared = sample.with(Options { share: false, ..Options::default() });
    assert_eq!(machine::run(&plan, 3), machine::run(&unshared, 3));
}

#[test]
fn the_shipped_graphs_make_the_same_in_any_order_and_memory() {
    for graph in all_shipped() {
        let graph = graph.as_str();
        for full in [true, false] {
            let reference = shipped(graph, &[], full, Options { share: false, ..Options::default() });
            let wanted = machine::run(&reference, 2);
            for order_seed in 0..3 {
                let plan = shipped(graph, &[], full, Options { order_seed, ..Options::default() });
                apart(&plan);
                order::legal(&plan);
                assert_eq!(machine::run(&plan, 2), wanted, "{graph}, seed {order_seed}\n{plan}");
            }
        }
    }
}
