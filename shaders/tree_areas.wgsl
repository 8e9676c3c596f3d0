//! Area of the surfaces in each cell of the lattice, square metres. Cells at the border reach as far out as need be.
#import lightgraph::probe_tree::{cell_size, cells, pack, point_position}
#import lightgraph::trace::{STACK, box_at, corners}

var<storage, read_write> tree_areas: array<f32>;

/// Farther out than any scene, metres.
const OUTSIDE: f32 = 1e20;

/// The part of a way between two corners of a box; `along`: which axes count. Empty where the end comes before the
/// start.
fn within(begin: vec3f, to: vec3f, lower: vec3f, upper: vec3f, along: vec3<bool>) -> vec2f {
    let way = to - begin;
    let still = way == vec3f(0.0);
    let inverse = 1.0 / select(way, vec3f(1.0), still);
    let one = (lower - begin) * inverse;
    let two = (upper - begin) * inverse;
    let inside = (begin >= lower) & (begin <= upper);
    let starts = select(min(one, two), select(vec3f(2.0), vec3f(0.0), inside), still);
    let ends = select(max(one, two), select(vec3f(-1.0), vec3f(1.0), inside), still);
    let s = select(vec3f(0.0), starts, along);
    let e = select(vec3f(1.0), ends, along);
    return vec2f(max(max(s.x, s.y), max(s.z, 0.0)), min(min(e.x, e.y), min(e.z, 1.0)));
}

/// What a way along the border adds to twice the area, as a vector.
fn swept(begin: vec3f, to: vec3f, lower: vec3f, upper: vec3f, along: vec3<bool>) -> vec3f {
    let t = within(begin, to, lower, upper, along);
    return select(vec3f(0.0), cross(mix(begin, to, t.x), mix(begin, to, t.y)), t.x < t.y);
}

/// Area of a triangle's part between two corners of a box, by the way round it: along its own edges inside of the box,
/// and on the box's sides from where it leaves them to where it comes back.
fn part(corner: mat3x3f, low: vec3f, high: vec3f) -> f32 {
    // From one of its corners: the products of small numbers are exact enough.
    let lower = low - corner[0];
    let upper = high - corner[0];
    let b = corner[1] - corner[0];
    let c = corner[2] - corner[0];
    let all_axes = vec3<bool>(true);
    var sum = swept(vec3f(0.0), b, lower, upper, all_axes);
    sum += swept(b, c, lower, upper, all_axes);
    sum += swept(c, vec3f(0.0), lower, upper, all_axes);
    for (var plane = 0u; plane < 6u; plane++) {
        let axis = plane / 2u;
        let side = select(1.0, -1.0, plane % 2u == 1u);
        let limit = select(lower[axis], -upper[axis], plane % 2u == 1u);
        let heights = side * vec3f(0.0, b[axis], c[axis]) - limit;
        let inside = heights >= vec3f(0.0);
        // Where edges pass: from a to b, b to c, c to a.
        let next = heights.yzx;
        let shares = heights / select(heights - next, vec3f(1.0), inside == inside.yzx);
        let ab = shares.x * b;
        let bc = mix(b, c, shares.y);
        let ca = mix(c, vec3f(0.0), shares.z);
        let leaves = inside & !inside.yzx;
        let comes = !inside & inside.yzx;
        let out = select(select(ca, bc, leaves.y), ab, leaves.x);
        let back = select(select(ca, bc, comes.y), ab, comes.x);
        let others = vec3<bool>(axis != 0u, axis != 1u, axis != 2u);
        if any(leaves) {
            sum += swept(out, back, lower, upper, others);
        }
    }
    return 0.5 * length(sum);
}

/// Boxes that wait to be looked into.
var<private> stack: array<u32, STACK>;

@compute @workgroup_size(8, 4, 2)
fn areas(@builtin(global_invocation_id) id: vec3u) {
    let counts = cells();
    if any(id >= counts) {
        return;
    }
    let lower = select(point_position(id), vec3f(-OUTSIDE), id == vec3u(0u));
    let upper = select(point_position(id + 1u), vec3f(OUTSIDE), id + 1u == counts);
    // A surface on a border counts on both sides, whatever the rounding.
    let more = 1e-4 * cell_size();
    var sum = 0.0;
    var waiting = 1u;
    stack[0] = 0u;
    while waiting > 0u {
        waiting--;
        let box = box_at(stack[waiting]);
        if any(box.upper < lower - more) || any(box.lower > upper + more) {
            continue;
        }
        if box.count > 0u {
            for (var i = 0u; i < box.count; i++) {
                sum += part(corners(box.first + i), lower - more, upper + more);
            }
        } else if waiting + 1u < STACK {
            stack[waiting] = box.first;
            stack[waiting + 1u] = box.first + 1u;
            waiting += 2u;
        }
    }
    tree_areas[pack(id, counts)] = sum;
}
