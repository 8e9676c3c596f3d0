//! What halving a cell is worth: the area of the surfaces in it, times the mean square by which the sketched light at
//! the lattice's points within differs from what the cell's corners give by interpolation. A cell is worth at least
//! what its parts are worth, so that no large error hides below a small one. A cell without surfaces is worth -1.
#import lightgraph::probe_tree::{OPEN, Sketch, cells, level_start, pack, points, tree}

/// 0 for the smallest cells that can be halved, one more for each size above.
var<uniform> member: u32;

var<storage, read> tree_sketch: array<Sketch>;
var<storage, read> tree_areas: array<f32>;
/// A value a cell, level by level, the roots first.
var<storage, read_write> tree_gain: array<f32>;

fn sketch_at(point: vec3u) -> Sketch {
    return tree_sketch[pack(point, points())];
}

@compute @workgroup_size(8, 4, 2)
fn gain(@builtin(global_invocation_id) id: vec3u) {
    let level = tree.levels - 1u - member;
    let counts = tree.roots << vec3u(level);
    if any(id >= counts) {
        return;
    }
    let edge = 2u << member;
    let base = id * edge;
    var area = 0.0;
    for (var i = 0u; i < edge * edge * edge; i++) {
        let cell = base + vec3u(i % edge, i / edge % edge, i / (edge * edge));
        area += tree_areas[pack(cell, cells())];
    }
    var corners: array<Sketch, 8>;
    for (var corner = 0u; corner < 8u; corner++) {
        corners[corner] = sketch_at(base + edge * vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
    }
    var squares = 0.0;
    var found = 0.0;
    let side = edge + 1u;
    for (var i = 0u; i < side * side * side; i++) {
        let step = vec3u(i % side, i / side % side, i / (side * side));
        let here = sketch_at(base + step);
        if here.open < OPEN {
            continue;
        }
        let fraction = vec3f(step) / f32(edge);
        var light = vec4f(0.0);
        var shares = 0.0;
        for (var corner = 0u; corner < 8u; corner++) {
            let far = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u) == vec3u(1u);
            let near = select(1.0 - fraction, fraction, far);
            let share = select(0.0, near.x * near.y * near.z, corners[corner].open >= OPEN);
            light += share * corners[corner].light;
            shares += share;
        }
        let gap = here.light - light / max(shares, 1e-6);
        squares += dot(gap, gap);
        found += 1.0;
    }
    var worth = select(-1.0, area * squares / max(found, 1.0), area > 0.0);
    if member > 0u {
        for (var corner = 0u; corner < 8u; corner++) {
            let part = 2u * id + vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
            worth = max(worth, tree_gain[level_start(level + 1u) + pack(part, 2u * counts)]);
        }
    }
    tree_gain[level_start(level) + pack(id, counts)] = worth;
}
