//! How much plans do.

use super::*;

#[test]
fn work_is_invocations_and_what_they_write_as_often_as_loops_go_round() {
    // Of 8×8 texels of 4 bytes: 64 invocations, and 16 texels of 16 bytes are written.
    let plan = |n: u32, size: &str| {
        let body = turn("b", "x", "y") + &turn("c", "y", "x");
        let passes = make("a", "x") + &format!("Loop(name: \"n\", count: {n}, passes: [{body}]),");
        sample(&images(&["x", "y"]).replace("size: 8", size), &passes, "\"o\": \"y\"").plan()
    };
    assert_eq!(plan(1, "size: 8").work(), 80 + 2 * 80);
    assert_eq!(plan(3, "size: 8").work(), 80 + 3 * 2 * 80);
    assert_eq!(plan(3, "size: 16").work(), 4 * (80 + 3 * 2 * 80));
}
