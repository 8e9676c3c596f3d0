//! What the copy of a shader notes.

use super::*;
use crate::shader::probe::instrument;

/// How many values find room, and how many none, in a shader with so many variables of 64 words.
fn noted(variables: usize) -> (usize, usize) {
    let lines: String =
        (0..variables).map(|i| format!("    var a{i} = all[{i}];\n    all[{i}u + id.x] = a{i};\n")).collect();
    let text = format!(
        "var<storage, read_write> all: array<array<f32, 64>>;
@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {{\n{lines}}}"
    );
    let shader = composed(&[("main.wgsl", &text)], &[]);
    let probe = instrument(&shader, "main", &[]).unwrap_or_else(|f| panic!("{f}"));
    (probe.sites.len(), probe.left_out)
}

#[test]
fn values_that_find_no_room_are_counted() {
    let [(few, none), (more, still_none), (most, left_out)] = [10, 20, 400].map(noted);
    assert!(none == 0 && still_none == 0 && more > few && left_out > 0, "{few} {more} {most} {left_out}");
    // Each variable adds as many.
    assert_eq!(most + left_out, few + 390 * (more - few) / 10);
}
