//! Whether any triangle of the scene lies in a box.
#define_import_path lightgraph::near
#import lightgraph::trace::{STACK, box_at, corners}

/// Whether a triangle may meet a box: neither the box round it nor its plane keeps away. Of those that pass by an edge
/// of the box it may name some too many, none too few.
fn touches(corner: mat3x3f, lower: vec3f, upper: vec3f) -> bool {
    let least = min(min(corner[0], corner[1]), corner[2]);
    let most = max(max(corner[0], corner[1]), corner[2]);
    let middle = 0.5 * (lower + upper);
    let half = 0.5 * (upper - lower);
    let normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    let reach = dot(abs(normal), half) * 1.0001;
    return all(least <= upper) && all(most >= lower) && abs(dot(normal, corner[0] - middle)) <= reach;
}

/// Boxes that wait to be looked into.
var<private> stack: array<u32, STACK>;

/// Whether any triangle may meet a box with these corners, metres.
fn is_any_in(lower: vec3f, upper: vec3f) -> bool {
    var waiting = 0u;
    var row = 0u;
    loop {
        let box = box_at(row);
        var follow = false;
        if all(box.lower <= upper) && all(box.upper >= lower) {
            for (var i = 0u; i < box.count; i++) {
                if touches(corners(box.first + i), lower, upper) {
                    return true;
                }
            }
            follow = box.count == 0u;
        }
        if follow {
            if waiting < STACK {
                stack[waiting] = box.first + 1u;
                waiting++;
            }
            row = box.first;
        } else if waiting == 0u {
            return false;
        } else {
            waiting--;
            row = stack[waiting];
        }
    }
    return false;
}
