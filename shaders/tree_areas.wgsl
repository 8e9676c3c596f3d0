//! Area of the surfaces in each cell of the lattice, square metres. Cells at the border reach as far out as need be.
#import lightgraph::probe_tree::{cell_size, cells, pack, point_position}

struct Box {
    lower: vec3f,
    first: u32,
    upper: vec3f,
    count: u32,
}
var<storage, read> bvh: array<Box>;

struct Triangle {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}
var<storage, read> triangles: array<Triangle>;
var<storage, read_write> tree_areas: array<f32>;

/// The table's documentation bounds the depth of the leaves by 47.
const STACK: u32 = 48u;
/// Farther out than any scene, metres.
const OUTSIDE: f32 = 1e20;

/// Area of a triangle's part between two corners of a box: the triangle is cut at one plane after the other.
fn part(t: Triangle, lower: vec3f, upper: vec3f) -> f32 {
    var polygon: array<vec3f, 10>;
    polygon[0] = t.a;
    polygon[1] = t.b;
    polygon[2] = t.c;
    var count = 3u;
    for (var plane = 0u; plane < 6u; plane++) {
        let axis = plane / 2u;
        let sign = select(1.0, -1.0, plane % 2u == 1u);
        let limit = select(lower[axis], -upper[axis], plane % 2u == 1u);
        var cut: array<vec3f, 10>;
        var kept = 0u;
        for (var i = 0u; i < count; i++) {
            let p = polygon[i];
            let q = polygon[select(i + 1u, 0u, i + 1u == count)];
            let heights = sign * vec2f(p[axis], q[axis]) - limit;
            if heights.x >= 0.0 {
                cut[kept] = p;
                kept++;
            }
            if (heights.x >= 0.0) != (heights.y >= 0.0) {
                cut[kept] = mix(p, q, heights.x / (heights.x - heights.y));
                kept++;
            }
        }
        polygon = cut;
        count = kept;
    }
    var sum = vec3f(0.0);
    for (var i = 2u; i < count; i++) {
        sum += cross(polygon[i - 1u] - polygon[0], polygon[i] - polygon[0]);
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
        let box = bvh[stack[waiting]];
        if any(box.upper < lower - more) || any(box.lower > upper + more) {
            continue;
        }
        if box.count > 0u {
            for (var i = 0u; i < box.count; i++) {
                sum += part(triangles[box.first + i], lower - more, upper + more);
            }
        } else if waiting + 1u < STACK {
            stack[waiting] = box.first;
            stack[waiting + 1u] = box.first + 1u;
            waiting += 2u;
        }
    }
    tree_areas[pack(id, counts)] = sum;
}
